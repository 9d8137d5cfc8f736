//! `softdock plan`: how many runs a requirement needs.

use crate::args::PlanArgs;
use crate::words::{Exit, json, say};
use serde_json::json;
use softdock_analysis::exact::{allowed_failures, smallest_runs};
use softdock_analysis::plan::plan_text;

/// Failures for which the answer in JSON lists the runs needed.
const LISTED_FAILURES: u64 = 20;

/// Answers with a table.
pub(crate) fn plan(args: &PlanArgs) -> miette::Result<Exit> {
    let (probability, confidence) = (args.probability, args.confidence);
    if args.json {
        let needed =
            |failures| json!({ "failures": failures, "runs": smallest_runs(failures, probability, confidence) });
        say(json(&json!({
            "probability": probability,
            "confidence": confidence,
            "needed": (0..=LISTED_FAILURES).map(needed).collect::<Vec<_>>(),
            "runs": args.runs,
            "allowed_failures": args.runs.and_then(|runs| allowed_failures(runs, probability, confidence)),
        })));
    } else {
        say(plan_text(probability, confidence, args.runs));
    }
    Ok(Exit::Done)
}
