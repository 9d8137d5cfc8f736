//! Arguments of long calls: an observer of progress, and a cancellation token.

use softdock_engine::EngineError;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Kinds of long work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// The runs of the campaign.
    Runs,
    /// Runs of a GPU repeated in f64.
    Parity,
    /// Runs repeated at half the substep.
    HalfStep,
    /// Runs repeated in f64 for their contact events.
    ContactEvents,
    /// Runs with a campaign's own model.
    OwnModel,
    /// The same runs with an extended model.
    ExtendedModel,
    /// Draws of a check, in space and on the facility.
    Step,
    /// Limits of a stability map.
    Map,
}

impl Work {
    /// Name for a progress line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Runs => "run",
            Self::Parity => "parity",
            Self::HalfStep => "half step",
            Self::ContactEvents => "contact events",
            Self::OwnModel => "own model",
            Self::ExtendedModel => "extended model",
            Self::Step => "step",
            Self::Map => "map",
        }
    }

    /// What is counted, for a progress line.
    pub fn unit(self) -> &'static str {
        if self == Self::Map { "limits" } else { "runs" }
    }
}

/// Receives progress and notes; every method has an empty default.
///
/// Calls may come from any thread, several at a time.
pub trait Observer: Sync {
    /// Called when work on `total` runs begins.
    fn begin(&self, work: Work, total: u64) {
        let _ = (work, total);
    }

    /// Called when `done` runs of the work have ended.
    fn progress(&self, work: Work, done: u64) {
        let _ = (work, done);
    }

    /// Called when the work has ended, completely or not.
    fn end(&self, work: Work) {
        let _ = work;
    }

    /// Called with a note for the user.
    fn note(&self, note: &Note) {
        let _ = note;
    }
}

/// Observer that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}

/// Cancellation token for any thread; clones share their state.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Requests an orderly end: finished runs are kept.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns whether an end was requested.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Observer and token of one call.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Receives progress and notes.
    pub observer: &'a dyn Observer,
    /// Cancels the call.
    pub cancel: &'a Cancel,
}

impl Context<'_> {
    /// Passes a note on.
    pub(crate) fn note(&self, note: Note) {
        self.observer.note(&note);
    }
}

/// Counts the runs of a piece of work for its observer.
pub(crate) struct Progress<'a> {
    context: Context<'a>,
    work: Work,
    done: std::sync::atomic::AtomicU64,
}

impl<'a> Progress<'a> {
    /// Begins work on `total` runs.
    pub(crate) fn new(context: Context<'a>, work: Work, total: u64) -> Self {
        context.observer.begin(work, total);
        Self { context, work, done: Default::default() }
    }

    /// Counts runs that have ended; false if the work should stop.
    pub(crate) fn add(&self, runs: usize) -> bool {
        let done = self.done.fetch_add(runs as u64, Ordering::Relaxed) + runs as u64;
        self.context.observer.progress(self.work, done);
        !self.context.cancel.is_cancelled()
    }

    /// Sets the count, after runs that were counted have been dropped.
    pub(crate) fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        self.context.observer.end(self.work);
    }
}

/// Note of a call besides its result.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Note {
    /// A table of given cases was read.
    GivenCases {
        /// Number of runs.
        runs: u64,
        /// Number of parameters.
        parameters: usize,
        /// Whether the table numbers its runs.
        is_numbered: bool,
        /// Columns of results that are ignored.
        ignored_columns: usize,
    },
    /// Failed runs of a folder are repeated.
    FailedRuns {
        /// Id of the campaign.
        campaign: String,
        /// Runs of the campaign.
        all: u64,
        /// Runs that are repeated.
        repeated: usize,
        /// Of these: failed in space, failed on the facility, invalid.
        counts: [u64; 3],
    },
    /// Files of a results folder were deleted.
    Deleted {
        /// The folder.
        folder: PathBuf,
        /// Number of files.
        files: usize,
        /// Number of shards among them.
        shards: usize,
    },
    /// A campaign got more runs.
    Extended {
        /// Id of the campaign.
        campaign: String,
        /// Runs before.
        before: u64,
        /// Runs now.
        after: u64,
    },
    /// Making of runs begins.
    Begin {
        /// Id of the campaign.
        campaign: String,
        /// Shards to make.
        missing: usize,
        /// Whole shards.
        complete: usize,
        /// Finished runs of unfinished shards.
        partial_runs: usize,
        /// The device.
        device: String,
    },
    /// A file is ignored, and its runs are made again.
    MadeAgain {
        /// The file.
        path: PathBuf,
        /// Why it is ignored.
        reason: String,
        /// Whether it holds an unfinished shard.
        is_partial: bool,
    },
    /// A damaged or foreign file that was at the place of a shard is kept under another name, and ignored.
    SetAside(PathBuf),
    /// A GPU failed, and the CPU makes the rest.
    Failover(EngineError),
    /// The device failed, and the rest is missing.
    DeviceFailed(EngineError),
    /// The requested GPU is missing, and draws are stepped on the CPU.
    NoAdapter(EngineError),
    /// Runs were judged by another version of the campaign.
    Rejudged {
        /// Id of the campaign.
        campaign: String,
        /// Number of keys that differ; none if the campaign is that of the folder.
        changes: Option<usize>,
    },
}

/// Returns the text of a GPU failure.
pub fn device_failure(error: &EngineError) -> String {
    match error {
        EngineError::OutOfMemory(why) => format!("the GPU has too little memory for a batch ({why})"),
        EngineError::DeviceLost(why) => format!("the GPU was lost in mid-batch ({why})"),
        other => other.to_string(),
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GivenCases { runs, parameters, is_numbered, ignored_columns } => {
                let numbers = if *is_numbered { "run numbers of the table" } else { "run numbers from 0" };
                write!(f, "given cases  {runs} runs, {parameters} parameters, {numbers}")?;
                match ignored_columns {
                    0 => Ok(()),
                    count => write!(f, "; {count} columns of results are ignored"),
                }
            }
            Self::FailedRuns { campaign, all, repeated: 0, .. } => {
                write!(f, "{campaign}  none of {all} runs failed: nothing to repeat")
            }
            Self::FailedRuns { campaign, all, repeated, counts: [space, facility, invalid] } => write!(
                f,
                "{campaign}  {repeated} of {all} runs are repeated: {space} failed in space, {facility} on the \
                 facility, {invalid} invalid"
            ),
            Self::Deleted { folder, files, shards } => {
                write!(f, "deleted {files} files of `{}`, {shards} shards among them", folder.display())
            }
            Self::Extended { campaign, before, after } => write!(
                f,
                "{campaign}  extended from {before} to {after} runs (recorded in campaign.json). If the verdict seen \
                 so far led to this, it is optional stopping: the stated confidence does not hold"
            ),
            Self::Begin { campaign, missing, complete, partial_runs, device } => {
                let partial = match partial_runs {
                    0 => String::new(),
                    runs => format!(" and {runs} runs of others"),
                };
                write!(f, "{campaign}  {missing} shards to make, {complete}{partial} there  on {device}")
            }
            Self::MadeAgain { path, reason, is_partial: false } => {
                write!(f, "made again: {} ({reason}); the file is kept with the ending .damaged-N", path.display())
            }
            Self::MadeAgain { path, reason, is_partial: true } => {
                write!(f, "made again: the runs of {} ({reason})", path.display())
            }
            Self::SetAside(path) => {
                write!(f, "ignored: {} (it was damaged or foreign; delete it if you do not need it)", path.display())
            }
            Self::Failover(error) => write!(
                f,
                "{}; finished shards stay, the CPU makes the rest: each shard states its backend",
                device_failure(error)
            ),
            Self::DeviceFailed(error) => error.fmt(f),
            Self::NoAdapter(error) => write!(f, "{error}; the draws are stepped on the CPU"),
            Self::Rejudged { campaign, changes: Some(changes) } => write!(
                f,
                "{campaign}  judged again by a campaign that differs in {changes} keys (recorded in campaign.json); no \
                 run was made"
            ),
            Self::Rejudged { campaign, changes: None } => {
                write!(f, "{campaign}  judged again by the campaign of the folder; no run was made")
            }
        }
    }
}
