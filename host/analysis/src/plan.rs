//! Number of runs for a requirement: the output of `plan`.

use std::fmt::Write;

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
