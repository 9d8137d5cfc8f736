//! Campaigns from file to verdict, as functions on typed values.
//!
//! [`load_campaign`] reads a campaign, [`run`] makes its missing runs in a results folder and judges it, [`merge`]
//! joins the folders of several workers. [`work`] is one of many workers in a folder, and [`finish_folder`] completes
//! it. [`judge`] judges finished runs by other criteria. [`status`], [`report`], [`verify`], [`compare_folders`] and
//! [`replay_run`] read a folder. Long calls take a [`Context`]: an [`Observer`] that receives progress and notes, and a
//! [`Cancel`] token. The library prints nothing and has no global state.
//!
//! ```no_run
//! use softdock_farm::{Cancel, Context, RunOptions, Selection, Silent, load_campaign, run};
//! use std::path::Path;
//!
//! let (observer, cancel) = (Silent, Cancel::default());
//! let context = Context { observer: &observer, cancel: &cancel };
//! let campaign = load_campaign(Path::new("campaigns/smoke.toml"), &Selection::default(), context)?;
//! let ended = run(campaign, Path::new("results/smoke"), &RunOptions::default(), context)?;
//! println!("{}", ended.shown.text());
//! # Ok::<(), softdock_farm::FarmError>(())
//! ```

mod author_units;
pub mod card;
mod cases;
pub mod changes;
pub mod check;
mod clear;
mod compare;
mod compare_models;
mod contact_events;
mod error;
mod failed_runs;
mod finish;
mod folder;
mod join;
mod judge;
mod lock;
mod make;
mod manifest;
mod merge;
mod nominal_scene;
mod observer;
mod outcome;
mod page;
mod part;
mod paths;
mod progress_lines;
pub mod query;
mod repetitions;
mod replay;
mod rows;
mod run;
mod run_engine;
mod run_selection;
mod select;
mod signals;
mod slurm;
mod status;
pub mod step;
#[cfg(feature = "s3")]
pub mod store;
#[cfg(test)]
mod tests;
mod traces;
mod variants;
mod verify;
mod worker;

pub use card::{CardOptions, CardReport, card_report};
pub use cases::read_cases;
pub use compare::{FolderComparison, compare_folders};
pub use compare_models::ModelComparison;
pub use error::FarmError;
pub use failed_runs::{failed_results, failed_runs};
pub use folder::ResultsFolder;
pub use judge::judge;
pub use make::RunOptions;
pub use manifest::{Build, MANIFEST_SCHEMA, page_origin};
pub use merge::merge;
pub use nominal_scene::draw_nominal_start;
pub use observer::{Cancel, Context, Note, Observer, Silent, Work, device_failure};
pub use outcome::{Ended, Incomplete, Shown};
pub use part::{ARRAY_INDICES, Part, array_part};
pub use progress_lines::ProgressLines;
pub use replay::{ReplayedRun, replay_run};
pub use run::run;
pub use select::{Selection, load_campaign, load_campaign_text};
pub use signals::signal_rows;
pub use slurm::{SlurmJobs, SlurmOptions, slurm_state, submit_slurm_scripts, write_slurm_scripts};
pub use status::{FolderStatus, FolderWatch, report, results_of, status};
pub use verify::{Verification, verify};
pub use worker::{finish_folder, work};

use std::path::{Path, PathBuf};

/// Returns the default results folder of a campaign: `results/ID`.
pub fn default_results(id: &str) -> PathBuf {
    Path::new("results").join(id)
}

/// Returns the backend of a campaign.
pub fn choice_of(campaign: &softdock_campaign::Campaign) -> softdock_engine::Choice {
    use softdock_campaign::campaign::Backend;
    use softdock_engine::Choice;
    match campaign.execution.backend {
        Backend::Auto => Choice::Auto,
        Backend::Gpu => Choice::Gpu,
        Backend::Cpu => Choice::Cpu,
    }
}
