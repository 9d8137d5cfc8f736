//! `softdock bench`: what this machine makes of the loops, in one run, beside its own peak.

use crate::args::BenchArgs;
use crate::words::{Exit, json, say};
use miette::IntoDiagnostic;
use softdock_engine::bench::{Windows, measure_machine};

/// Measures every backend at hand and prints the tables.
pub(crate) fn bench(args: &BenchArgs) -> miette::Result<Exit> {
    let report = measure_machine(if args.quick { Windows::QUICK } else { Windows::FULL }).into_diagnostic()?;
    say(if args.json { json(&serde_json::json!(report)) } else { report.text() });
    Ok(Exit::Done)
}
