//! EtherCAT with CiA 402 drives: six axes and a rail in cyclic synchronous position.
//!
//! Modules without input and output: the state machine of one drive ([`cia402`]), of all drives ([`drives`]), the
//! mapping of a drive ([`mapping`]), its counts ([`scale`]), its reaction to missing frames ([`watchdog`]). The crate
//! ethercrab brings the segment to OP and creates its datagrams; [`segment`] emulates a segment at the level of frames.

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
