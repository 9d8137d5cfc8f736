//! The verdict as aligned plain text for the terminal.

use std::fmt::Write;

use softdock_campaign::requirement::{Rate, Subject};
use softdock_results::parity::{HALF_STEP, PARITY, Repetition};

use crate::causes::cause_text;
use crate::exact::Share;
use crate::number::{digits_of, interval, percent, with_unit};
use crate::parity::Parity;
use crate::summary::{LoopSummary, RateSummary, RequirementSummary, Summary};

/// The whole verdict: requirements, agreement, accounting, repeated runs.
pub fn verdict_text(summary: &Summary) -> String {
    let mut out = String::new();
    let done = &summary.completeness;
    let _ = writeln!(
        out,
        "{}  {}  {} of {} runs, {} of {} shards, seed {}",
        summary.campaign,
        summary.verdict.word(),
        done.runs_done,
        done.runs_planned,
        done.shards_done,
        done.shards_planned,
        summary.seed
    );
    made_on_line(&mut out, summary);
    for ignored in &done.ignored {
        let _ = writeln!(out, "  ignored  {}: {}", ignored.file, ignored.reason);
    }
    for extension in &summary.extensions {
        let _ = writeln!(
            out,
            "  extended from {} to {} runs: if a verdict was looked at before, the stated confidence does not hold",
            extension.runs_before, extension.runs_after
        );
    }
    for judgement in &summary.judgements {
        let _ = writeln!(out, "  judged again after the runs were made; what changed:");
        for change in &judgement.changes {
            let _ = writeln!(out, "    {change}");
        }
    }
    if summary.requirements.is_empty() && summary.agreement_requirements.is_empty() {
        out.push_str("  no verdict: the campaign has no requirement\n");
    }
    if summary.given_cases {
        out.push_str("  given cases, no verdict: the inputs are no sample of what the campaign disperses;\n");
        out.push_str("  counts are those of these cases; intervals are informative, as if the cases were drawn\n");
    } else if !summary.independent_runs {
        out.push_str(
            "  exploring only, no verdict: the runs are not independent (Sobol' or Latin hypercube sample);\n",
        );
        out.push_str(
            "  intervals are informative, as if they were; write sampling.method = \"random\" for a verdict\n",
        );
    }
    requirement_lines(&mut out, summary);
    agreement_lines(&mut out, summary);
    cause_lines(&mut out, summary);
    accounting_line(&mut out, summary);
    for (name, kind, repeated) in [("parity", PARITY, &summary.parity), ("step size", HALF_STEP, &summary.half_step)] {
        if let Some(repeated) = repeated {
            repetition_lines(&mut out, name, &kind, repeated);
        }
    }
    out
}

/// Returns the devices of the rows, with a note if rows of f32 and f64 are mixed.
fn made_on_line(out: &mut String, summary: &Summary) {
    let devices = &summary.completeness.devices;
    let shards = |count: u32| format!("{count} {}", if count == 1 { "shard" } else { "shards" });
    let made: Vec<String> = devices.iter().map(|made| format!("{} ({})", made.device, shards(made.shards))).collect();
    let mixed = devices.iter().any(|made| made.backend != devices[0].backend);
    if !made.is_empty() {
        let note = if mixed { "rows of two backends: " } else { "" };
        let _ = writeln!(out, "  {note}made on {}", made.join(" and "));
    }
}

fn requirement_lines(out: &mut String, summary: &Summary) {
    let mut rows = Vec::new();
    for requirement in &summary.requirements {
        let loops = &requirement.loops;
        if requirement.subject == Subject::Space.word() {
            rows.push(requirement_row(&requirement.id, "space", requirement, &loops.space));
            rows.push(requirement_row("", "(facility)", requirement, &loops.facility));
        } else {
            rows.push(requirement_row(&requirement.id, "facility", requirement, &loops.facility));
        }
    }
    rows.extend(summary.agreement_requirements.iter().map(rate_row));
    let joint = &summary.joint;
    if summary.given_cases {
        for row in &mut rows {
            row[4] = row[4].replace(EXPLORING, "given cases, no verdict");
        }
    }
    let together = [("together", "space", &joint.space), ("", "(facility)", &joint.facility)];
    for (name, side, share) in together.into_iter().filter(|_| !summary.requirements.is_empty()) {
        let passed = format!("{} of {} passed", share.count, share.cases);
        rows.push([name, side, "", &passed, &interval(&share.interval), ""].map(str::to_owned));
    }
    out.push('\n');
    table(out, &rows);
}

/// What a sample that is not independent shows.
const EXPLORING: &str = "exploring only, no verdict";

/// Returns the row of a requirement in a loop. A loop in parentheses is informative: the requirement is judged on its
/// subject.
fn requirement_row(name: &str, side: &str, requirement: &RequirementSummary, judged: &LoopSummary) -> [String; 6] {
    let (failed, mut reading) = match judged.failure_rate_bound {
        Some(bound) => {
            let allowed = judged.allowed.map_or("too few runs".to_owned(), |allowed| format!("{allowed} allowed"));
            let failed = format!("{} of {} failed ({allowed})", judged.failures, judged.runs);
            (failed, format!("p <= {} at {}", digits_of(bound, 3), percent(requirement.confidence)))
        }
        None => (format!("{} of {} failed", judged.failures, judged.runs), EXPLORING.to_owned()),
    };
    if let Some(outer) = &judged.outer {
        let _ = write!(reading, ", {} of {} draws verified", outer.verified, outer.draws);
    }
    let margin = match (&judged.tolerance_limit, &judged.worst) {
        (Some(limit), _) => format!("margin >= {}", with_unit(limit.margin, &requirement.unit)),
        (None, Some(worst)) => format!("worst {} (run {})", with_unit(worst.margin, &requirement.unit), worst.run),
        (None, None) => String::new(),
    };
    let verdict = if side.starts_with('(') { "" } else { judged.verdict.word() };
    [name.to_owned(), side.to_owned(), verdict.to_owned(), failed, reading, margin]
}

fn rate_row(rate: &RateSummary) -> [String; 6] {
    let allowed = rate.allowed.map_or("too few cases".to_owned(), |allowed| format!("{allowed} allowed"));
    let wrong = if rate.rate == Rate::Abort.word() { "aborted" } else { "wrong" };
    let (counted, mut reading) = match rate.bound {
        Some(bound) => (
            format!("{} of {} {wrong} ({allowed})", rate.share.count, rate.share.cases),
            format!("{} <= {} at {}", rate.rate, digits_of(bound, 3), percent(rate.confidence)),
        ),
        None => (format!("{} of {} {wrong}", rate.share.count, rate.share.cases), EXPLORING.to_owned()),
    };
    if let Some(outer) = &rate.outer {
        let _ = write!(reading, ", {} of {} draws verified", outer.verified, outer.draws);
    }
    let note = if rate.invalid > 0 { format!("{} invalid runs counted", rate.invalid) } else { String::new() };
    [rate.id.clone(), "agreement".to_owned(), rate.verdict.word().to_owned(), counted, reading, note]
}

fn agreement_lines(out: &mut String, summary: &Summary) {
    let agreement = &summary.agreement;
    let row = |name: &str, share: &Share, of: &str| {
        [name.to_owned(), format!("{} of {}", share.count, share.cases), interval(&share.interval), of.to_owned()]
    };
    out.push_str("\nagreement of the facility with space, on the task and all requirements on space\n");
    table(
        out,
        &[
            row("true pass", &agreement.true_pass, "both pass"),
            row("false pass", &agreement.false_pass, "the facility passes, space fails"),
            row("true fail", &agreement.true_fail, "both fail"),
            row("false fail", &agreement.false_fail, "the facility fails, space passes"),
            row("aborted, passes", &agreement.aborted_pass, "the session was stopped, space passes"),
            row("aborted, fails", &agreement.aborted_fail, "the session was stopped, space fails"),
            row("invalid", &agreement.invalid, "numbers that cannot be trusted"),
            row("abort rate", &agreement.abort_rate, "of the valid runs: no verdict of the facility"),
            row("false-pass rate", &agreement.false_pass_rate, "of the runs that fail in space"),
            row("false-fail rate", &agreement.false_fail_rate, "of the runs that pass in space"),
            row("misleading passes", &agreement.misleading_passes, "of the runs that the facility passes"),
        ],
    );
}

/// Causes listed for each loop.
const MOST_CAUSES: usize = 6;

/// Why runs do not pass the task, most frequent first.
fn cause_lines(out: &mut String, summary: &Summary) {
    let mut rows = Vec::new();
    for (side, causes) in [("space", &summary.causes.space), ("facility", &summary.causes.facility)] {
        for (index, cause) in causes.iter().take(MOST_CAUSES).enumerate() {
            let side = if index == 0 { side } else { "" };
            let runs = cause.examples.iter().take(3).map(u64::to_string).collect::<Vec<_>>().join(", ");
            let phase = if cause.phase == "none" { String::new() } else { format!("{} phase", cause.phase) };
            rows.push([
                side.to_owned(),
                format!("{} {}", cause.runs, cause.outcome),
                cause_text(&cause.cause, cause.limit),
                phase,
                format!("runs {runs} ..."),
            ]);
        }
    }
    if !rows.is_empty() {
        out.push_str("\nwhy runs do not pass the task\n");
        table(out, &rows);
    }
}

fn accounting_line(out: &mut String, summary: &Summary) {
    let runs = &summary.accounting;
    let _ = writeln!(
        out,
        "\nruns  {} pass, {} fail, {} invalid ({})",
        runs.pass, runs.fail, runs.invalid, summary.invalid_runs
    );
    for flag in &runs.flags {
        let _ = writeln!(out, "  {:>9}  {}: {}", flag.runs, flag.flag, flag.meaning);
    }
}

fn repetition_lines(out: &mut String, name: &str, kind: &Repetition, parity: &Parity) {
    let flips = &parity.flipped;
    let _ = writeln!(
        out,
        "{name}  {} runs repeated {}: {} with another verdict, {}",
        parity.runs,
        kind.words,
        flips.count,
        interval(&flips.interval)
    );
    if parity.diverged > 0 {
        let _ = writeln!(out, "  {} of them: the facility's loop diverged in one of the two alone", parity.diverged);
    }
    let forces = parity.metrics.iter().filter(|metric| metric.column.ends_with("peak_contact_force_n"));
    for metric in forces {
        let (max, rms) =
            (with_unit(metric.max_difference, &metric.unit), with_unit(metric.rms_difference, &metric.unit));
        let _ = writeln!(out, "  {}: largest difference {max}, root mean square {rms}", metric.column);
    }
}

/// Rows with aligned columns, two blanks between them.
pub fn table(out: &mut String, rows: &[impl AsRef<[String]>]) {
    let columns = rows.iter().map(|row| row.as_ref().len()).max().unwrap_or(0);
    let width = |column: usize| rows.iter().map(|row| row.as_ref()[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let cells = row.as_ref().iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        let line = cells.collect::<Vec<_>>().join("  ");
        let _ = writeln!(out, "  {}", line.trim_end());
    }
}
