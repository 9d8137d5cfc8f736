//! Verified content of a results folder.

use softdock_results::contact_events::{check_contact_events, contact_events_path};
use softdock_results::shards::ShardIndex;
use softdock_results::traces::{Traces, read_traces};
use std::path::{Path, PathBuf};

use crate::Result;
use crate::facts::CampaignFacts;

/// Shards, time histories and contact events of a campaign in a results folder, with all hashes verified.
#[derive(Clone, Debug)]
pub struct Content {
    /// The folder.
    pub results: PathBuf,
    /// Its shards.
    pub shards: ShardIndex,
    /// Its time histories.
    pub traces: Traces,
    /// The file of contact events if it counts for nothing, with the reason.
    pub foreign_events: Option<(PathBuf, String)>,
}

impl Content {
    /// Reads and verifies a results folder.
    ///
    /// # Errors
    /// If it cannot be read. Foreign files are listed and are not an error.
    pub fn read(results: &Path, facts: &CampaignFacts) -> Result<Self> {
        Self::of_shards(results, facts.shards(results)?)
    }

    /// Reads the rest of a folder whose shards have been read.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn of_shards(results: &Path, shards: ShardIndex) -> Result<Self> {
        let traces = read_traces(results, &shards)?;
        let foreign_events = check_contact_events(results, &shards).err();
        let foreign_events = foreign_events.map(|error| (contact_events_path(results), error.to_string()));
        Ok(Self { results: results.to_owned(), shards, traces, foreign_events })
    }

    /// Returns the foreign files, with the reason.
    pub fn foreign(&self) -> impl Iterator<Item = &(PathBuf, String)> {
        self.shards.foreign.iter().chain(&self.traces.foreign).chain(&self.foreign_events)
    }
}
