//! `campaign.json`: campaign of a results folder, and build that made its runs.

use crate::error::{FarmError, Result};
use serde::{Deserialize, Serialize};
use softdock_analysis::{Extension, Judgement, PageOrigin};
use softdock_results::write_file;
use std::fmt;
use std::path::{Path, PathBuf};

/// Version of `campaign.json`.
pub const MANIFEST_SCHEMA: &str = "results/4";

/// Name of the file.
pub(crate) const MANIFEST_FILE: &str = softdock_campaign::manifest::FILE;

const VERSION: &str = env!("CARGO_PKG_VERSION");
const COMMIT: &str = env!("SOFTDOCK_COMMIT");

/// Build of softdock that made the runs of a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Build {
    /// Version of softdock.
    pub version: String,
    /// Commit of the build; `unknown` outside a repository.
    pub commit: String,
}

impl Build {
    /// Returns this build.
    pub fn own() -> Self {
        Self { version: VERSION.to_owned(), commit: COMMIT.to_owned() }
    }
}

/// Returns what a page states of this build and of the command that makes the page.
pub fn page_origin(command: &str) -> PageOrigin<'_> {
    PageOrigin { version: VERSION, commit: COMMIT, command }
}

impl fmt::Display for Build {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "softdock {} (commit {})", self.version, self.commit)
    }
}

/// The content of `campaign.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// [`MANIFEST_SCHEMA`].
    pub(crate) schema: String,
    /// Id of the campaign.
    pub(crate) id: String,
    /// The campaign's file below `campaign/`.
    pub(crate) campaign: String,
    /// Hash of the campaign.
    pub(crate) hash: String,
    /// Seed of the campaign.
    pub(crate) seed: u64,
    /// Runs of the campaign.
    pub(crate) runs: u64,
    /// Build that made the runs.
    pub(crate) made_by: Build,
    /// Scenario below `campaign/` that replaces the campaign's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) model: Option<String>,
    /// Table of given cases in the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cases: Option<String>,
    /// Hash of that table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cases_hash: Option<String>,
    /// Extensions of the campaign, in chronological order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) extensions: Vec<Extension>,
    /// Repeated judgements, in chronological order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) judgements: Vec<Judgement>,
    /// Hash of the previous campaign while the runs are judged again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) judging: Option<String>,
}

impl Manifest {
    /// Reads the manifest of a folder; `None` if there is none.
    ///
    /// # Errors
    /// If it cannot be read, is of another format, or is damaged.
    pub(crate) fn read(folder: &Path) -> Result<Option<Self>> {
        let Some(value) = softdock_campaign::manifest::read(folder, MANIFEST_SCHEMA)? else { return Ok(None) };
        if value["schema"] != MANIFEST_SCHEMA {
            let message = format!(
                "`{}` holds results of the format {}, and this version of softdock reads \"{MANIFEST_SCHEMA}\"",
                folder.display(),
                value["schema"]
            );
            let remedy = "run the campaign again with another `--out DIR`, or delete the folder; the version that \
                          wrote it reads it";
            return Err(FarmError::refused(message, remedy));
        }
        let damaged = |error| {
            FarmError::refused(
                format!("{}: {error}", folder.join(MANIFEST_FILE).display()),
                "restore the file from a backup, or run the campaign into a folder of its own with --out DIR",
            )
        };
        serde_json::from_value(value).map(Some).map_err(damaged)
    }

    /// Reads the manifest of a folder that must have one.
    ///
    /// # Errors
    /// As [`Manifest::read`], and if there is none.
    pub(crate) fn require(folder: &Path) -> Result<Self> {
        Self::read(folder)?.ok_or_else(|| {
            let message = format!("`{}` is no results folder", folder.display());
            FarmError::refused(message, "name a folder that `softdock run` has written")
        })
    }

    /// Writes the manifest into a folder.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("a manifest has string keys") + "\n";
        Ok(write_file(&folder.join(MANIFEST_FILE), text.as_bytes())?)
    }

    /// The same with another number of runs.
    pub(crate) fn with_runs(&self, runs: u64) -> Self {
        Self { runs, ..self.clone() }
    }

    /// The same without the records of extensions and judgements.
    pub(crate) fn without_records(&self) -> Self {
        Self { extensions: Vec::new(), judgements: Vec::new(), ..self.clone() }
    }

    /// Rejects a folder whose runs are judged by different campaigns.
    pub(crate) fn refuse_half_judged(&self, path: &Path) -> Result<()> {
        if self.judging.is_none() {
            return Ok(());
        }
        let message = format!("the judgement of the runs in `{}` was interrupted", path.display());
        let remedy = format!("complete it with the campaign file: softdock judge {} CAMPAIGN", path.display());
        Err(FarmError::refused(message, remedy))
    }

    /// The table of given cases, if there is one.
    pub(crate) fn cases_file(&self, folder: &Path) -> Option<PathBuf> {
        self.cases.as_ref().map(|name| folder.join(name))
    }
}
