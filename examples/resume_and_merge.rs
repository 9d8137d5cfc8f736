//! Cancels a campaign, resumes it, and does the same work in two parts that are merged: the results are equal.
//!
//! ```text
//! cargo run --release --example resume_and_merge -- campaigns/smoke.toml results/parts
//! ```

use softdock_farm::{
    Cancel, Context, Observer, Part, RunOptions, Selection, Shown, Silent, Work, load_campaign, merge, run,
};
use std::error::Error;
use std::path::PathBuf;

/// Cancels the call once so many runs have ended.
struct CancelAfter<'a> {
    runs: u64,
    cancel: &'a Cancel,
}

impl Observer for CancelAfter<'_> {
    fn progress(&self, work: Work, done: u64) {
        if work == Work::Runs && done >= self.runs {
            self.cancel.cancel();
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(file), Some(folder)) = (words.next(), words.next()) else {
        return Err("usage: resume_and_merge CAMPAIGN FOLDER".into());
    };
    let (silent, never) = (Silent, Cancel::default());
    let context = Context { observer: &silent, cancel: &never };
    let campaign = load_campaign(&file, &Selection::default(), context)?;

    // Cancelled: every finished run is on disk, and the same call resumes.
    let whole = folder.join("whole");
    let cancel = Cancel::default();
    let observer = CancelAfter { runs: 5, cancel: &cancel };
    let cancelled = Context { observer: &observer, cancel: &cancel };
    let ended = run(campaign.clone(), &whole, &RunOptions::default(), cancelled)?;
    println!("first call: {}", ended.incomplete.map_or("complete".to_owned(), |reason| reason.to_string()));
    let resumed = run(campaign.clone(), &whole, &RunOptions::default(), context)?;

    // The same campaign in two parts, as two machines would make it.
    let parts = [0, 1].map(|index| (Part { index, count: 2 }, folder.join(format!("part{}", index + 1))));
    for (part, results) in &parts {
        run(campaign.clone(), results, &RunOptions { part: *part, ..RunOptions::default() }, context)?;
    }
    let merged = merge(&parts.map(|(_, results)| results), &folder.join("merged"), context)?;

    let hash = |shown: &Shown| match shown {
        Shown::Campaign(summary) => summary.results_hash.clone(),
        _ => None,
    };
    println!("resumed and merged results are equal: {}", hash(&resumed.shown) == hash(&merged.shown));
    Ok(())
}
