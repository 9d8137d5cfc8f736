//! HTML page of a score: criteria, confusion matrix, reliability curve, baseline methods.

use crate::Result;
use crate::outcome::AnswerGrade;
use crate::plan::MachineKind;
use crate::plant::order;
use crate::score::{DemandStatus, GauntletScore, Row, median};
use crate::seal::Asks;
use crate::summary_text::{found, name, shared};
use serde::Serialize;
use softdock_analysis::number::significant;
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, Size, colour};
use softdock_analysis::{PageOrigin, render_page};
use std::collections::{BTreeMap, BTreeSet};

#[derive(Serialize)]
struct Page {
    headline: String,
    cases: usize,
    unasked: usize,
    hours: [String; 2],
    marks: Vec<[String; 3]>,
    outcomes: Vec<&'static str>,
    rows: Vec<Line>,
    confusion: Vec<Confusion>,
    curve: Option<String>,
    calibration: Vec<[String; 2]>,
    parameters: Vec<[String; 6]>,
    methods: Vec<[String; 5]>,
    failures: Vec<[String; 5]>,
}

/// Counts of grades for a hidden effect and size.
#[derive(Serialize)]
struct Line {
    hidden: String,
    multiple: String,
    scale: String,
    right: String,
    outcomes: Vec<String>,
}

/// Confusion matrix of a plant at a size: rows are hidden effects, columns are answers.
#[derive(Serialize)]
struct Confusion {
    title: String,
    answers: Vec<String>,
    rows: Vec<(String, Vec<Cell>)>,
}

#[derive(Serialize)]
struct Cell {
    count: usize,
    /// Share of the row, for its shade.
    share: f64,
}

/// Renders the page as HTML; `command` is the command that reproduces it.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn page(score: &GauntletScore, origin: &PageOrigin) -> Result<String> {
    let page = Page {
        headline: headline(score),
        cases: score.cases,
        unasked: score.unasked.len(),
        hours: score.seconds.map(|seconds| significant(seconds / 3600.0, 3)),
        marks: score
            .marks
            .iter()
            .map(|mark| [mark.status.word().to_owned(), mark.demand.clone(), found(mark)])
            .collect(),
        outcomes: AnswerGrade::ALL.map(AnswerGrade::word).into(),
        rows: score.rows.iter().map(line).collect(),
        confusion: confusions(&score.rows),
        curve: curve(score)?,
        calibration: score
            .calibration
            .bins
            .iter()
            .map(|bin| [significant(bin.stated, 3), shared(&bin.right)])
            .collect(),
        parameters: parameters(score),
        methods: score
            .methods
            .iter()
            .map(|row| {
                let cost = format!("{} s", significant(row.seconds, 2));
                [row.method.clone(), shared(&row.right), shared(&row.wrong), shared(&row.alarms), cost]
            })
            .collect(),
        failures: score
            .failures
            .iter()
            .map(|own| {
                let outcome = own.outcome.word().to_owned();
                [outcome, own.case.clone(), own.seed.to_string(), own.hidden.clone(), own.answered.clone()]
            })
            .collect(),
    };
    Ok(render_page("score.html", include_str!("page/score.html"), origin, &page)?)
}

fn headline(score: &GauntletScore) -> String {
    let count = |status: DemandStatus| score.marks.iter().filter(|mark| mark.status == status).count();
    let asked = score.marks.len() - count(DemandStatus::NoCases);
    let (met, refuted) = (count(DemandStatus::Met), count(DemandStatus::Refuted));
    format!("{met} of {asked} criteria are met, {refuted} are refuted.")
}

fn multiple(row: &Row) -> String {
    if row.multiple > 0.0 { format!("{} s*", row.multiple) } else { String::new() }
}

fn line(row: &Row) -> Line {
    let count = |outcome: &AnswerGrade| match row.outcomes.get(outcome) {
        None => String::new(),
        Some(count) => count.to_string(),
    };
    Line {
        hidden: name(row),
        multiple: multiple(row),
        scale: row.scale.map_or(String::new(), |scale| significant(scale, 3)),
        right: if row.cases > 0 { format!("{} of {}", row.right, row.cases) } else { "out of range".to_owned() },
        outcomes: AnswerGrade::ALL.iter().map(count).collect(),
    }
}

/// One matrix a plant and size of its single effects and nulls.
fn confusions(rows: &[Row]) -> Vec<Confusion> {
    let mut groups: BTreeMap<(&str, MachineKind, u64), Vec<&Row>> = BTreeMap::new();
    let inside = |row: &&Row| row.cases > 0 && matches!(row.asks, Asks::Effect | Asks::Outside);
    for row in rows.iter().filter(inside) {
        groups.entry((&row.plant, row.machine, row.multiple.to_bits())).or_default().push(row);
    }
    let of = |((plant, machine, multiple), mut own): ((&str, MachineKind, u64), Vec<&Row>)| {
        let is_same = |row: &&Row| row.plant == plant && row.machine == machine;
        own.extend(rows.iter().filter(is_same).filter(|row| row.asks == Asks::Null && row.cases > 0));
        let answers: BTreeSet<&String> = own.iter().flat_map(|row| row.answers.keys()).collect();
        let mut answers: Vec<&String> = answers.into_iter().collect();
        answers.sort_by_key(|answer| order(answer));
        let cells = |row: &&Row| {
            let cell = |answer: &&String| {
                let count = row.answers.get(*answer).copied().unwrap_or(0);
                Cell { count, share: count as f64 / row.cases as f64 }
            };
            let name = if row.hidden.is_empty() { "nothing".to_owned() } else { row.hidden.clone() };
            (name, answers.iter().map(cell).collect())
        };
        Confusion {
            title: format!("{plant}{}, {} s*", suffix(machine), f64::from_bits(multiple)),
            rows: own.iter().map(cells).collect(),
            answers: answers.into_iter().cloned().collect(),
        }
    };
    groups.into_iter().map(of).collect()
}

/// The kind of machine after the name of a plant; nothing for an exact one.
fn suffix(machine: MachineKind) -> String {
    if machine == MachineKind::Exact { String::new() } else { format!(", {} machine", machine.word()) }
}

/// Frequency over stated probability, with exact intervals.
fn curve(score: &GauntletScore) -> Result<Option<String>> {
    let bins = &score.calibration.bins;
    if bins.is_empty() {
        return Ok(None);
    }
    let x = Axis::linear("stated probability", 0.0, 1.0).padded(0.02);
    let y = Axis::linear("share of right names", 0.0, 1.0).padded(0.02);
    let mut figure = Figure::new("reliability of stated probabilities", Size::Half, x, y);
    figure = figure.line(vec![(0.0, 0.0), (1.0, 1.0)], colour::LIMIT, 1.0);
    for bin in bins {
        let interval = bin.right.interval;
        figure = figure.line(vec![(bin.stated, interval.lo), (bin.stated, interval.hi)], colour::SPACE, 1.4);
    }
    let share = |bin: &crate::calibration::Bin| bin.right.count as f64 / bin.right.cases as f64;
    let points = bins.iter().map(|bin| (bin.stated, share(bin))).collect();
    Ok(Some(figure.points(points, colour::SPACE, 3.0, 1.0).svg()?))
}

/// Errors of each parameter by size: number, median error of the parameter, over its bound, intervals that hold.
fn parameters(score: &GauntletScore) -> Vec<[String; 6]> {
    let mut groups: BTreeMap<(&str, MachineKind, u64), Vec<&crate::parameters::ParameterError>> = BTreeMap::new();
    for own in &score.parameters {
        groups.entry((&own.name, own.machine, own.multiple.to_bits())).or_default().push(own);
    }
    let number = |value: Option<f64>| value.map_or(String::new(), |value| significant(value, 3));
    let of = |((name, machine, multiple), own): ((&str, MachineKind, u64), Vec<&crate::parameters::ParameterError>)| {
        let held: Vec<bool> = own.iter().filter_map(|own| own.held).collect();
        let covered = held.iter().filter(|held| **held).count();
        [
            format!("{name}{}", suffix(machine)),
            format!("{} s*", f64::from_bits(multiple)),
            own.len().to_string(),
            number(median(own.iter().map(|own| 100.0 * own.relative))),
            number(median(own.iter().filter_map(|own| own.by_bound))),
            if held.is_empty() { String::new() } else { format!("{covered} of {}", held.len()) },
        ]
    };
    groups.into_iter().map(of).collect()
}
