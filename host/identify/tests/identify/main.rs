//! Identification against physics of another make, against its own statistics, against real and spoiled recordings.

mod contact;
mod coverage;
mod design;
mod flexible;
mod kuka;
mod logs;
mod regressor;

use softdock_campaign::Robot;
use std::path::{Path, PathBuf};

/// The repository's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The shipped KR 300.
fn kr300() -> Robot {
    Robot::load(&root().join("campaigns/models/kr300_r2500.toml")).expect("the shipped robot")
}
