//! A drive: one run on real or emulated robots, cycle by cycle.
//!
//! [`core`] maps the inputs of a cycle to the commands of the robots, without links and clocks, so that a log replays
//! bit for bit. [`session`] adds the links and the clock.

pub mod checklist;
pub mod controls;
pub mod core;
pub mod delay;
pub mod feed;
pub mod guard;
pub mod motion;
pub mod prediction;
pub mod replay;
pub mod runner;
pub mod session;
pub mod start;
pub mod torque;
pub mod wire;
