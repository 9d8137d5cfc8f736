//! Summary of a results folder that grows.

use std::collections::BTreeMap;
use std::path::Path;

use softdock_results::shards::{KnownShards, Origin, ShardIndex, ShardPlan};

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

/// The shards of a campaign that have been counted.
struct Counted {
    plan: ShardPlan,
    origin: Origin,
    /// Hash of the rows by number.
    shards: BTreeMap<u32, String>,
    tally: Tally,
}

impl Counted {
    /// Whether an index still has every counted shard.
    fn is_part_of(&self, index: &ShardIndex) -> bool {
        let is_there =
            |(shard, hash): (&u32, &String)| index.complete.get(shard).is_some_and(|file| file.content_hash == *hash);
        (&self.plan, &self.origin) == (&index.plan, &index.origin) && self.shards.iter().all(is_there)
    }
}

impl RunningSummary {
    /// Judges the folder as it is now, as [`summarise`](crate::summarise()) does.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn renew(&mut self, results: &Path, facts: &CampaignFacts) -> Result<Summary> {
        let index = facts.shards_again(results, &mut self.known)?;
        // Taken out: after an error the count is incomplete and begins anew.
        let counted = self.counted.take().filter(|counted| counted.is_part_of(&index));
        let mut counted = counted.unwrap_or_else(|| Counted {
            plan: index.plan,
            origin: index.origin.clone(),
            shards: BTreeMap::new(),
            tally: Tally::new(facts),
        });
        let mut fresh = index.clone();
        fresh.complete.retain(|shard, _| !counted.shards.contains_key(shard));
        count(&mut counted.tally, results, &fresh, facts)?;
        counted.shards.extend(fresh.complete.into_iter().map(|(shard, file)| (shard, file.content_hash)));
        let summary = summary_of(&Content::of_shards(results, index)?, facts, &counted.tally)?;
        self.counted = Some(counted);
        Ok(summary)
    }
}
