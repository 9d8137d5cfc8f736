//! Rig files from logs: columns, units, rate and kind with the figure of each guess, start values by regression, and open
//! values for what a log does not show.

mod clock;
mod drive_fit;
mod drive_text;
mod error;
mod figures;
mod joints;
mod names;
mod other_texts;
mod proposal;
mod recorded_table;
mod robot_text;
mod toml_text;

pub use error::RigInitError;
pub use proposal::{OpenKey, PROPOSED_KINDS, ProposedRig, RigInitOptions};
