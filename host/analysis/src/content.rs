//! The content of a results folder, verified once for everything that is made from it.

use softdock_results::shards::ShardIndex;
use softdock_results::traces::{Traces, read_traces};
use std::path::{Path, PathBuf};

use crate::Result;
use crate::facts::CampaignFacts;

/// The shards and time histories of a results folder that are those of a campaign; every byte of them has been checked.
#[derive(Clone, Debug)]
pub struct Content {
    /// The folder.
    pub results: PathBuf,
    /// Its shards.
    pub shards: ShardIndex,
    /// Its time histories.
    pub traces: Traces,
}

impl Content {
    /// Reads a results folder.
    ///
    /// # Errors
    /// If it cannot be read. Files that do not belong are listed, and are no error.
    pub fn read(results: &Path, facts: &CampaignFacts) -> Result<Self> {
        Self::of_shards(results, facts.shards(results)?)
    }

    /// The same of a folder whose shards have been read already.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn of_shards(results: &Path, shards: ShardIndex) -> Result<Self> {
        let traces = read_traces(results, &shards)?;
        Ok(Self { results: results.to_owned(), shards, traces })
    }

    /// Files that do not belong, with the reason.
    pub fn foreign(&self) -> impl Iterator<Item = &(PathBuf, String)> {
        self.shards.foreign.iter().chain(&self.traces.foreign)
    }
}
