//! A session: one run of a campaign on robots, real or emulated, from its plan to the files that it writes.
//!
//! [`plan`] checks what is asked for, [`run`] opens the links and runs the cycle, an [`operator`] watches it (a
//! terminal, the web page of [`page`], a test), [`answer`] states how it ended, and [`prediction`] compares its metrics
//! with those that the model predicts. [`emulated`] is the other side of the links, [`replay`] repeats the decisions of
//! a log, and [`rehearsal`] runs draws of a campaign on emulated robots.
//!
//! Nothing here prints, ends the process or keeps global state.

pub mod addresses;
pub mod answer;
pub mod emulated;
mod error;
mod files;
mod hidden_effects;
pub mod operator;
pub mod page;
pub mod plan;
pub mod prediction;
pub mod rehearsal;
pub mod replay;
pub mod rights;
pub mod run;
pub mod terminal_text;

pub use error::SessionError;
