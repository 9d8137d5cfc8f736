//! Runs a campaign from its file to its verdict.
//!
//! ```text
//! cargo run --release --example run_campaign -- campaigns/smoke.toml results/smoke
//! ```

use softdock_farm::{Cancel, Context, RunOptions, Selection, Shown, Silent, load_campaign, run};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(file), Some(results)) = (words.next(), words.next()) else {
        return Err("usage: run_campaign CAMPAIGN RESULTS".into());
    };
    let (observer, cancel) = (Silent, Cancel::default());
    let context = Context { observer: &observer, cancel: &cancel };

    let campaign = load_campaign(&file, &Selection::default(), context)?;
    let ended = run(campaign, &results, &RunOptions::default(), context)?;

    // The text of the terminal, and the typed summary behind it.
    println!("{}", ended.shown.text());
    if let Shown::Campaign(summary) = &ended.shown {
        for requirement in &summary.requirements {
            println!("{}: {:?}", requirement.id, requirement.verdict);
        }
    }
    Ok(())
}
