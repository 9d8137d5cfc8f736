//! Sessions on real robots: cycle, robot and sensor protocols, safety, log, and an emulated facility behind the same
//! protocols.
//!
//! Data flows one way through a cycle: a robot's packet and the sensor's newest sample arrive ([`protocol`] over
//! [`wire`]), the simulation computer computes the next set-points, the limiter clamps them, the command is sent, and
//! the log records all of it.

pub mod arms;
pub mod clock;
pub mod drive;
pub mod emulation;
pub mod histogram;
pub mod latency;
pub mod limiter;
pub mod links;
pub mod log;
pub mod process;
pub mod protocol;
pub mod sensing;
pub mod signals;
pub mod time;
pub mod view;
pub mod wire;
