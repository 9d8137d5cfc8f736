//! One run on the real robots: the cycle, robot and sensor protocols, safety and the log; and the other side of the
//! protocols, an emulated facility.
//!
//! Data flows one way through a cycle: a robot's packet and the sensor's newest sample come in ([`protocol`] over
//! [`wire`]), the simulation computer answers with the next set-points, the limits have the last word, the command
//! goes out, and the log takes all of it.

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
