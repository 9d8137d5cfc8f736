//! Sentences for the agreement table.

use crate::exact::Share;
use crate::number::interval;
use crate::summary::Summary;

/// Returns sentences on the facility's false verdicts, each with its interval.
pub(crate) fn agreement_reading(summary: &Summary) -> Vec<String> {
    let agreement = &summary.agreement;
    let of = |share: &Share, what: &str, then: &str, rate: &str| match share.cases {
        0 => format!("No run {what}, so the {rate} cannot be estimated."),
        cases => format!(
            "Of {} that {what}, {} {then}: the {rate} is {}.",
            plural(cases, "run", "runs"),
            share.count,
            unbroken(share)
        ),
    };
    let mut sentences = vec![
        of(&agreement.false_pass_rate, "fail in space", "pass on the facility", "false-pass rate"),
        of(&agreement.false_fail_rate, "pass in space", "fail on the facility", "false-fail rate"),
        of(&agreement.misleading_passes, "pass on the facility", "fail in space", "risk behind a passed test"),
    ];
    if agreement.abort_rate.count > 0 {
        sentences.push(of(&agreement.abort_rate, "are valid", "end in an aborted session", "abort rate"));
    }
    if agreement.invalid.count > 0 {
        let invalid = plural(agreement.invalid.count, "run is", "runs are");
        sentences.push(format!("{invalid} invalid and in no cell: {}.", unbroken(&agreement.invalid)));
    }
    sentences
}

/// The interval of a share, without line breaks before its per cent signs.
fn unbroken(share: &Share) -> String {
    interval(&share.interval).replace(" %", "\u{a0}%")
}

fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
