//! An emulated facility: the farm's robots, contact and sensor behind the links of a real one.

mod axes;
pub mod facility;
pub mod in_process;
pub mod loopback;
pub mod network;
pub mod server;
pub mod world;
