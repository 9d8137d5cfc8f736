//! Reads the runs of a results folder: every shard is verified, columns are streamed with their units.
//!
//! ```text
//! cargo run --release --example read_results -- results/smoke
//! ```

use softdock_farm::ResultsFolder;
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let Some(results) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err("usage: read_results RESULTS".into());
    };
    let folder = ResultsFolder::open(&results)?;
    let shards = folder.shards()?;
    println!("{}: {} of {} shards", folder.campaign.id, shards.complete.len(), shards.plan.shards());
    for (file, reason) in &shards.foreign {
        println!("ignored: {} ({reason})", file.display());
    }

    // The contract of the columns is in the files themselves.
    let columns = shards.columns()?;
    let name = "space_peak_contact_force_n";
    let column = columns.column(name).ok_or("no such column")?;
    println!("{name} [{}]: {}", column.unit, column.description);

    let (mut runs, mut most) = (0, 0.0_f64);
    for batch in shards.read_columns(&[name.to_owned()]) {
        let batch = batch?;
        for force in batch.f64s(name).unwrap_or_default().iter().flatten() {
            (runs, most) = (runs + 1, most.max(*force));
        }
    }
    println!("{runs} runs, at most {most:.1} {}", column.unit);
    Ok(())
}
