//! Results of a call: a verdict or a comparison, and the reason for an incomplete campaign.

use crate::folder::ResultsFolder;
use crate::part::Part;
use softdock_analysis::{Compared, Summary, compare_text, verdict_text};
use std::fmt;
use std::path::PathBuf;

/// Result of a results folder.
#[derive(Clone, Debug)]
pub enum Shown {
    /// No shard exists.
    Nothing,
    /// The summary of a campaign.
    Campaign(Box<Summary>),
    /// The comparison of a campaign's variants.
    Variants(Box<Compared>),
}

impl Shown {
    /// 0 verified, 1 not verified, 3 incomplete.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Nothing => 3,
            Self::Campaign(summary) => summary.exit_code,
            Self::Variants(compared) => compared.exit_code,
        }
    }

    /// Returns the text for the terminal; empty without shards.
    pub fn text(&self) -> String {
        match self {
            Self::Nothing => String::new(),
            Self::Campaign(summary) => verdict_text(summary),
            Self::Variants(compared) => compare_text(compared),
        }
    }

    /// Returns the JSON of `summary.json` or `compare.json`; null without shards.
    pub fn json(&self) -> serde_json::Value {
        match self {
            Self::Nothing => Ok(serde_json::Value::Null),
            Self::Campaign(summary) => serde_json::to_value(summary),
            Self::Variants(compared) => serde_json::to_value(compared),
        }
        .expect("summaries are plain JSON")
    }
}

/// End of a call on a results folder.
#[derive(Clone, Debug)]
pub struct Ended {
    /// The results folder.
    pub results: PathBuf,
    /// Result.
    pub shown: Shown,
    /// Why the campaign is not complete, if it is not.
    pub incomplete: Option<Incomplete>,
}

impl Ended {
    pub(crate) fn new(folder: &ResultsFolder, shown: Shown) -> Self {
        Self { results: folder.path.clone(), shown, incomplete: None }
    }

    /// 0 verified, 1 not verified, 3 incomplete.
    pub fn exit_code(&self) -> u8 {
        if self.incomplete.is_some() { 3 } else { self.shown.exit_code() }
    }

    /// The files that a report writes again: summary and page, or the comparison of the variants.
    pub fn report_files(&self) -> [PathBuf; 2] {
        let names = match self.shown {
            Shown::Variants(_) => ["compare.json", "compare.html"],
            _ => ["summary.json", "report.html"],
        };
        names.map(|name| self.results.join(name))
    }

    /// Returns the page of the results, if the campaign is complete or compared.
    pub fn page(&self) -> Option<PathBuf> {
        match (&self.shown, &self.incomplete) {
            (Shown::Variants(_), _) => Some(self.results.join("compare.html")),
            (Shown::Campaign(_), None) => Some(self.results.join("report.html")),
            _ => None,
        }
    }
}

/// Why a campaign is not complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incomplete {
    /// The caller has cancelled the runs.
    Cancelled {
        /// Whole shards.
        done: usize,
        /// Shards of the campaign.
        planned: u32,
        /// Finished runs of other shards.
        partial_runs: u64,
    },
    /// The caller has cancelled the checks after the runs.
    CancelledInChecks,
    /// Shards of another call or process are missing.
    ShardsMissing {
        /// Whole shards.
        done: usize,
        /// Shards of the campaign.
        planned: u32,
    },
    /// No folder of the parts holds these shards.
    PartsMissing {
        /// Whole shards.
        done: usize,
        /// Shards of the campaign.
        planned: u32,
        /// The first missing one.
        first: u32,
    },
    /// The requested part is made.
    PartMade(Part),
    /// The device failed.
    DeviceFailed,
    /// A variant is not complete.
    VariantMissing,
}

impl fmt::Display for Incomplete {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cancelled { done, planned, partial_runs: 0 } => {
                write!(f, "stopped with {done} of {planned} shards; the same command resumes")
            }
            Self::Cancelled { done, planned, partial_runs } => write!(
                f,
                "stopped with {done} of {planned} shards and {partial_runs} runs of others; the same command resumes"
            ),
            Self::CancelledInChecks => f.write_str(
                "stopped while runs were repeated for checks; every run is on disk, the same command resumes",
            ),
            Self::ShardsMissing { done, planned } => {
                write!(f, "{done} of {planned} shards; `softdock run` makes the others")
            }
            Self::PartsMissing { done, planned, first } => write!(
                f,
                "{} of {planned} shards are missing, the first is {first}; run the missing parts first",
                *planned as usize - done
            ),
            Self::PartMade(part) => {
                write!(f, "part {} of {} is made; `softdock merge` joins the parts", part.index + 1, part.count)
            }
            Self::DeviceFailed => f.write_str("the device failed; the same command resumes"),
            Self::VariantMissing => f.write_str("not every variant is complete; `softdock run` makes the rest"),
        }
    }
}
