//! Text of a score for the terminal.

use crate::plan::MachineKind;
use crate::score::{AcceptanceCriterion, Failure, GauntletScore, MethodRow, Row};
use softdock_analysis::Share;
use softdock_analysis::number::{digits_of, significant};
use std::collections::BTreeMap;

/// Returns the score as text for the terminal.
pub fn text(score: &GauntletScore) -> String {
    let mut out = format!("Cases diagnosed: {}", score.cases);
    if !score.unasked.is_empty() {
        out += &format!(", {} beyond the range of the generator", score.unasked.len());
    }
    let [diagnosis, rest] = score.seconds;
    out += &format!("; {} h for diagnoses, {} h for everything else\n\n", hours(diagnosis), hours(rest));
    score.marks.iter().for_each(|mark| out += &format!("{}\n", line(mark)));
    out += &format!("\n{}", names(&score.rows));
    if score.methods.len() > 1 {
        out += &format!("\n{}", methods(&score.methods));
    }
    if !score.failures.is_empty() {
        out += "\nSuboptimal answers\n";
        score.failures.iter().for_each(|failure| out += &format!("{}\n", failed(failure)));
    }
    out
}

fn hours(seconds: f64) -> String {
    significant(seconds / 3600.0, 3)
}

/// Returns the line of a criterion: status, demand, result.
fn line(mark: &AcceptanceCriterion) -> String {
    format!("  {:<11}  {}: {}", mark.status.word(), mark.demand, found(mark))
}

/// Returns the result of a criterion.
pub fn found(mark: &AcceptanceCriterion) -> String {
    match (&mark.share, mark.value) {
        (Some(share), _) => shared(share),
        (_, Some(value)) => significant(value, 3),
        _ => "no cases".to_owned(),
    }
}

/// Returns a share with its exact 95 % interval.
pub fn shared(share: &Share) -> String {
    let percent = |share: f64| digits_of(100.0 * share, 3);
    let rate = share.count as f64 / (share.cases as f64).max(1.0);
    let (lo, hi) = (percent(share.interval.lo), percent(share.interval.hi));
    format!("{} of {}, {} % ({lo} to {hi})", share.count, share.cases, percent(rate))
}

/// Returns the table of right answers by hidden effect and multiple of the detection limit.
fn names(rows: &[Row]) -> String {
    let mut hidden: BTreeMap<(usize, String), Vec<&Row>> = BTreeMap::new();
    for (place, row) in rows.iter().enumerate() {
        let name = name(row);
        let place = hidden.keys().find(|key| key.1 == name).map_or(place, |key| key.0);
        hidden.entry((place, name)).or_default().push(row);
    }
    let mut out = format!("{:<52} {:>10}  right of cases at multiples of s*\n", "hidden", "s*");
    for ((_, name), rows) in hidden {
        let scale = rows[0].scale.map_or("-".to_owned(), |scale| significant(scale, 3));
        let sizes: Vec<String> = rows.iter().map(|row| sized(row)).collect();
        let rival = rows[0].inseparable.as_ref().map_or(String::new(), |rival| format!("  confounded with {rival}"));
        out += &format!("{name:<52} {scale:>10}  {}{rival}\n", sizes.join("  "));
    }
    out
}

fn sized(row: &Row) -> String {
    let size = if row.multiple > 0.0 { format!("x{} ", row.multiple) } else { String::new() };
    match row.cases {
        0 => format!("{size}out of range"),
        cases => format!("{size}{}/{cases}", row.right),
    }
}

/// Returns plant, machine unless exact, task and hidden effects of a row.
pub fn name(row: &Row) -> String {
    let machine = if row.machine == MachineKind::Exact { String::new() } else { format!("{} ", row.machine.word()) };
    format!("{} {machine}{} {}", row.plant, asks(row), row.hidden)
}

/// Returns the name of a row's task.
fn asks(row: &Row) -> &'static str {
    use crate::seal::Asks;
    match row.asks {
        Asks::Null => "nothing",
        Asks::Effect => "effect",
        Asks::Pair => "pair",
        Asks::Outside => "outside",
        Asks::LeftOut => "excluded",
    }
}

fn methods(methods: &[MethodRow]) -> String {
    let mut out = String::from("Baseline methods on the same recordings (single effects at 2 s* and more)\n");
    for row in methods {
        out += &format!(
            "  {:<24} right {}; wrong {}; false alarms {}; {} s per case\n",
            row.method,
            shared(&row.right),
            shared(&row.wrong),
            shared(&row.alarms),
            significant(row.seconds, 2)
        );
    }
    out
}

fn failed(failure: &Failure) -> String {
    let Failure { case, seed, hidden, answered, outcome } = failure;
    format!("  {:<15} {case} (seed {seed}; {hidden}): {answered}", outcome.word())
}
