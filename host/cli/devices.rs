//! `softdock devices`: what runs can be made on.

use crate::words::{Exit, say};
use softdock_engine::{Choice, open};

/// Opens each backend as `run` would.
pub(crate) fn devices() -> miette::Result<Exit> {
    for (name, choice) in [("cpu", Choice::Cpu), ("gpu", Choice::Gpu), ("auto", Choice::Auto)] {
        let found = open(choice, |_| ()).map_or_else(|error| error.to_string(), |engine| engine.device());
        say(format!("--backend {name:<4}  {found}"));
    }
    Ok(Exit::Done)
}
