//! A facility that stands in for a real one: the farm's robots, contact and sensor behind the same links.

mod axes;
pub mod facility;
pub mod in_process;
pub mod loopback;
pub mod network;
pub mod server;
pub mod world;
