//! One joint with its drive and controller.

pub mod block;
pub mod controller;
pub mod controller_hypotheses;
pub mod dictionary;
pub mod hypotheses;
pub(crate) mod unit_checks;
