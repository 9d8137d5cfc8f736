//! A drive: one run on real or emulated robots, cycle by cycle.
//!
//! [`core`] decides, from what the links have brought, what the robots are told: no link, no clock and no surprise, so
//! that a log can be replayed bit for bit. [`session`] carries the links and the clock around it.

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
