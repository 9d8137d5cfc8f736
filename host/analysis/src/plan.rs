//! Number of runs for a requirement: the output of `plan`.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::exact::{allowed_failures, smallest_runs, tolerated_rate};
use crate::number::{digits_of, percent};

/// Failures for which the smallest campaign is listed.
const LISTED_FAILURES: [u64; 8] = [0, 1, 2, 3, 5, 10, 20, 50];

/// Campaign sizes for which the allowed failures are listed.
const LISTED_RUNS: [u64; 5] = [2_000, 10_000, 20_000, 100_000, 1_000_000];

/// Returns the plan for a probability and a confidence, with the failures that the campaign's number of runs allows.
pub fn plan_text(probability: f64, confidence: f64, runs: Option<u64>) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{} of all cases, shown with {} confidence", percent(probability), percent(confidence));
    let _ = writeln!(out, "  failed at most   runs needed   passed 9 times in 10 by a true failure rate of");
    for failures in LISTED_FAILURES {
        if let Some(needed) = smallest_runs(failures, probability, confidence) {
            let rate = digits_of(tolerated_rate(needed, failures), 3);
            let _ = writeln!(out, "  {failures:>14}   {needed:>11}   {rate}");
        }
    }
    let _ = writeln!(out, "            runs   failures allowed   passed 9 times in 10 by a true failure rate of");
    let listed = LISTED_RUNS.into_iter().chain(runs).collect::<std::collections::BTreeSet<_>>();
    for number in listed {
        let mark = if Some(number) == runs { "  <- this campaign" } else { "" };
        let _ = match allowed_failures(number, probability, confidence) {
            Some(allowed) => {
                let rate = digits_of(tolerated_rate(number, allowed), 3);
                writeln!(out, "  {number:>14}   {allowed:>16}   {rate}{mark}")
            }
            None => writeln!(out, "  {number:>14}   {:>16}   cannot be shown with so few runs{mark}", "-"),
        };
    }
    out
}

/// Failures for which [`plan_json`] lists the runs needed.
const JSON_FAILURES: u64 = 20;

/// Returns the plan as JSON: the runs needed for each number of failures, and the failures that `runs` allow.
pub fn plan_json(probability: f64, confidence: f64, runs: Option<u64>) -> Value {
    let needed = |failures| json!({ "failures": failures, "runs": smallest_runs(failures, probability, confidence) });
    json!({
        "probability": probability,
        "confidence": confidence,
        "needed": (0..=JSON_FAILURES).map(needed).collect::<Vec<_>>(),
        "runs": runs,
        "allowed_failures": runs.and_then(|runs| allowed_failures(runs, probability, confidence)),
    })
}

/// Reads a share of `99%` or `0.99`.
///
/// # Errors
/// If the text is no number above 0 and up to 0.999999.
pub fn parse_share(text: &str) -> Result<f64, String> {
    let (number, scale) = text.strip_suffix('%').map_or((text, 1.0), |percent| (percent, 100.0));
    let value = number.trim().parse::<f64>().map_err(|_| "write a share as 99% or 0.99".to_owned())? / scale;
    let possible = value > 0.0 && value <= 0.999_999;
    possible.then_some(value).ok_or_else(|| "a share lies above 0 and is at most 99.9999%".to_owned())
}

/// Returns a sentence for `check`: the failures that the campaign's number of runs allows, and that ten times as many
/// allow.
pub fn plan_line(probability: f64, confidence: f64, runs: u64) -> String {
    let asked = format!("{}/{}", percent(probability), percent(confidence));
    match allowed_failures(runs, probability, confidence) {
        Some(allowed) => {
            let failures = if allowed == 1 { "failure" } else { "failures" };
            let rate = digits_of(tolerated_rate(runs, allowed), 2);
            format!("{asked}: {runs} runs allow {allowed} {failures}; passed 9 times in 10 if the true rate is {rate}")
        }
        None => {
            let needed = smallest_runs(0, probability, confidence);
            let needed = needed.map_or("more".to_owned(), |needed| needed.to_string());
            format!("{asked}: cannot be shown by {runs} runs; at least {needed} are needed")
        }
    }
}
