//! Runs a campaign with an observer of its own, which prints one JSON line for each event.
//!
//! ```text
//! cargo run --release --example observe_progress -- campaigns/smoke.toml results/smoke
//! ```

use serde_json::json;
use softdock_farm::{Cancel, Context, Note, Observer, RunOptions, Selection, Work, load_campaign, run};
use std::error::Error;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Prints events; progress in steps of ten per cent.
#[derive(Default)]
struct JsonLines {
    total: AtomicU64,
    printed_percent: AtomicU64,
}

impl Observer for JsonLines {
    fn begin(&self, work: Work, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.printed_percent.store(0, Ordering::Relaxed);
        println!("{}", json!({ "event": "begin", "work": work.name(), "runs": total }));
    }

    // Engines call this from several threads.
    fn progress(&self, work: Work, done: u64) {
        let percent = 100 * done / self.total.load(Ordering::Relaxed).max(1) / 10 * 10;
        if self.printed_percent.fetch_max(percent, Ordering::Relaxed) < percent {
            println!("{}", json!({ "event": "progress", "work": work.name(), "percent": percent }));
        }
    }

    fn end(&self, work: Work) {
        println!("{}", json!({ "event": "end", "work": work.name() }));
    }

    fn note(&self, note: &Note) {
        println!("{}", json!({ "event": "note", "text": note.to_string() }));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(file), Some(results)) = (words.next(), words.next()) else {
        return Err("usage: observe_progress CAMPAIGN RESULTS".into());
    };
    let (observer, cancel) = (JsonLines::default(), Cancel::default());
    let context = Context { observer: &observer, cancel: &cancel };

    let campaign = load_campaign(&file, &Selection::default(), context)?;
    let ended = run(campaign, &results, &RunOptions::default(), context)?;

    println!("{}", json!({ "event": "verdict", "exit_code": ended.exit_code() }));
    Ok(())
}
