//! EtherCAT with CiA 402 drives: six axes and a rail in cyclic synchronous position.
//!
//! The parts without a wire stand alone: the state machine of one drive ([`cia402`]), of all together ([`drives`]), the
//! mapping that a drive tells ([`mapping`]), its counts ([`scale`]), and what it does when nobody speaks to it any more
//! ([`watchdog`]). The crate ethercrab brings the segment to OP
//! and makes its datagrams; [`segment`] is the other side, at the level of frames.

mod bus;
pub mod cia402;
pub mod config;
pub mod drives;
pub mod mapping;
mod opening;
mod pump;
pub mod raw;
mod robot;
pub mod scale;
pub mod segment;
pub mod watchdog;

pub use config::{AxisConfig, EtherCatConfig, OpenError};
pub use robot::EtherCatRobot;
pub use scale::AxisScale;

use crate::time::Nanos;

/// Cycle of a segment.
pub const CYCLE: Nanos = Nanos::from_millis(1);
