//! `softdock bench`: what this machine makes of the loops, in one run, beside its own peak.

use crate::args::{BenchArgs, BenchDeviceArgs};
use crate::farm::called;
use crate::progress::Terminal;
use crate::words::{Exit, json, say};
use miette::IntoDiagnostic;
use softdock_engine::bench::{Windows, measure_machine};
use softdock_farm::{CardOptions, Selection, card_report, load_campaign};

/// Measures one card, writes its report and prints it.
pub(crate) fn bench_device(args: &BenchDeviceArgs) -> miette::Result<Exit> {
    let (terminal, full) = (Terminal::new(), CardOptions::full());
    let context = terminal.context();
    let selection = Selection { runs: Some(args.runs), ..Selection::default() };
    let campaign = called(load_campaign(&args.campaign, &selection, context))?;
    let options = CardOptions {
        lanes: if args.lanes.is_empty() {
            full.lanes
        } else {
            args.lanes.iter().map(|lanes| *lanes as usize).collect()
        },
        windows: if args.quick { Windows::QUICK } else { full.windows },
        accepts_software: args.software,
    };
    let report = called(card_report(campaign, &args.out.join("campaign"), &options, context))?;
    called(report.write(&args.out))?;
    say(if args.json { json(&serde_json::json!(report)) } else { report.text() });
    Ok(if report.faults.is_empty() { Exit::Done } else { Exit::NotVerified })
}

/// Measures every backend at hand and prints the tables.
pub(crate) fn bench(args: &BenchArgs) -> miette::Result<Exit> {
    let report = measure_machine(if args.quick { Windows::QUICK } else { Windows::FULL }).into_diagnostic()?;
    say(if args.json { json(&serde_json::json!(report)) } else { report.text() });
    Ok(Exit::Done)
}
