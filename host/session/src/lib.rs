//! A session: one run of a campaign on robots, real or emulated, from its plan to the files that it writes.
//!
//! [`plan`] checks the request, [`run`] opens the links and runs the cycle, an [`operator`] watches it (a terminal, the
//! web page of [`page`], a test), [`answer`] states its end, and [`prediction`] compares its metrics with the model's
//! prediction. [`emulated`] serves the emulated facility, [`replay`] repeats the decisions of a log, and [`rehearsal`]
//! runs draws of a campaign on emulated robots. [`terminal_text`] renders the values for a terminal.
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
