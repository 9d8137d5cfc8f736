//! Summary of a results folder that grows.

use std::path::Path;

use softdock_results::shards::{KnownShards, ShardFile, ShardIndex};

use crate::Result;
use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::summarise::{count, summary_of};
use crate::summary::Summary;
use crate::tally::Tally;

/// Summary of a results folder that is asked for again and again: a shard that has been counted is not read again while
/// its file stays as it is.
#[derive(Default)]
pub struct RunningSummary {
    known: KnownShards,
    counted: Option<Counted>,
}

/// The shards that have been counted.
struct Counted {
    shards: ShardIndex,
    tally: Tally,
}

impl Counted {
    /// Whether an index still has every counted shard.
    fn is_part_of(&self, index: &ShardIndex) -> bool {
        let own = &self.shards;
        let is_there = |(number, file): (&u32, &ShardFile)| index.complete.get(number) == Some(file);
        (own.plan, &own.origin) == (index.plan, &index.origin) && own.complete.iter().all(is_there)
    }
}

impl RunningSummary {
    /// Judges the folder as it is now, as [`summarise`](crate::summarise()) does.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn renew(&mut self, results: &Path, facts: &CampaignFacts) -> Result<Summary> {
        let index = ShardIndex::scan_again(results, facts.plan, &facts.origin(), &mut self.known)?;
        let mut fresh = index.clone();
        // Taken out: after an error the count is incomplete and begins anew.
        let mut tally = match self.counted.take().filter(|counted| counted.is_part_of(&index)) {
            Some(counted) => {
                fresh.complete.retain(|shard, _| !counted.shards.complete.contains_key(shard));
                counted.tally
            }
            None => Tally::new(facts),
        };
        count(&mut tally, results, &fresh, facts)?;
        let summary = summary_of(&Content::of_shards(results, index.clone())?, facts, &tally)?;
        self.counted = Some(Counted { shards: index, tally });
        Ok(summary)
    }
}
