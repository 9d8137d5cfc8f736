//! Acceptance criteria of the diagnosis.

use super::demand::{AcceptanceCriterion, Demand, Measured, judged};
use super::methods::MethodRow;
use super::{Scored, median};
use crate::calibration::ProbabilityCalibration;
use crate::outcome::{AnswerGrade, block_is_right};
use crate::parameters::ParameterError;
use crate::plan::MachineKind;
use crate::record::{RecordedAnswer, TrueGain};
use crate::seal::Asks;
use std::collections::{BTreeMap, BTreeSet};

/// Cases and parameters of a kind of machine.
pub(super) struct OfMachine<'a> {
    pub(super) asked: Vec<&'a Scored>,
    pub(super) parameters: Vec<&'a ParameterError>,
}

impl<'a> OfMachine<'a> {
    /// Of all cases with an answer and of the parameters of the right names.
    pub(super) fn of(kind: MachineKind, asked: &[&'a Scored], parameters: &'a [ParameterError]) -> Self {
        let asked = asked.iter().copied().filter(|scored| scored.truth.machine == kind).collect();
        let parameters = parameters.iter().filter(|own| own.machine == kind).collect();
        Self { asked, parameters }
    }
}

/// Evaluates all criteria.
pub(super) fn criteria(
    exact: &OfMachine<'_>,
    perturbed: &OfMachine<'_>,
    calibration: &ProbabilityCalibration,
    methods: &[MethodRow],
) -> Vec<AcceptanceCriterion> {
    let mut demands = naming(&exact.asked);
    demands.extend(restraint(&exact.asked));
    demands.extend(numbers(exact, calibration));
    demands.extend(beaten(methods));
    demands.extend(of_perturbed(perturbed));
    judged(demands)
}

/// Share of cases for which something holds.
fn share<'a>(cases: impl Iterator<Item = &'a &'a Scored>, holds: impl Fn(&Scored) -> bool) -> Measured {
    let holding: Vec<bool> = cases.map(|scored| holds(scored)).collect();
    of_all(&holding)
}

fn of_all(holding: &[bool]) -> Measured {
    Measured::Share { count: holding.iter().filter(|holds| **holds).count(), cases: holding.len() }
}

/// Criteria on right names.
fn naming(asked: &[&Scored]) -> Vec<Demand> {
    let right = |text: &str, asks: Asks, multiple: f64, least: f64| {
        let own = asked.iter().filter(|scored| scored.asks(asks, multiple));
        Demand::at_least(text, least, share(own, Scored::is_right))
    };
    let blocks: Vec<bool> =
        asked.iter().filter_map(|scored| block_is_right(scored.plant, &scored.truth, scored.answer()?)).collect();
    vec![
        right("right name at 2 s*: at least 90 %", Asks::Effect, 2.0, 0.90),
        right("right name at 4 s*: at least 98 %", Asks::Effect, 4.0, 0.98),
        least(asked, "worst effect at 2 s*: at least 75 %", 2.0, 0.75),
        least(asked, "worst effect at 4 s*: at least 85 %", 4.0, 0.85),
        right("pairs across groups, both names: at least 90 %", Asks::Pair, 4.0, 0.90),
        right("forms outside the library at 16 s*: at least 90 % not in library", Asks::Outside, 16.0, 0.90),
        right("excluded from the library, at 16 s*: at least 90 % not in library", Asks::LeftOut, 16.0, 0.90),
        resolved(asked),
        Demand::at_least("block right: at least 99 %", 0.99, of_all(&blocks)),
    ]
}

/// Criterion on ambiguous answers after their experiments.
fn resolved(asked: &[&Scored]) -> Demand {
    let after: Vec<bool> =
        asked.iter().filter_map(|scored| scored.after).map(|outcome| outcome == AnswerGrade::Right).collect();
    let text = "ambiguous answers right after at most two proposed experiments: at least 95 %";
    Demand::at_least(text, 0.95, of_all(&after))
}

/// Criterion on the effect that is named least.
fn least(asked: &[&Scored], text: &str, multiple: f64, least: f64) -> Demand {
    let mut counts: BTreeMap<(&str, &str), (usize, usize)> = BTreeMap::new();
    for scored in asked.iter().filter(|scored| scored.asks(Asks::Effect, multiple)) {
        let count = counts.entry((scored.plant.name, &scored.truth.hidden[0].id)).or_default();
        *count = (count.0 + usize::from(scored.is_right()), count.1 + 1);
    }
    let rate = |(right, cases): &(usize, usize)| *right as f64 / *cases as f64;
    let worst = counts.iter().min_by(|a, b| rate(a.1).total_cmp(&rate(b.1)));
    let name = worst.map_or(String::new(), |((plant, id), _)| format!(" ({plant} {id})"));
    Demand::at_least(format!("{text}{name}"), least, Measured::Smallest(counts.into_values().collect()))
}

/// Criteria on false names.
fn restraint(asked: &[&Scored]) -> Vec<Demand> {
    let of = |text: &str, asks: &[Asks], outcome: AnswerGrade, most: f64| {
        let own = asked.iter().filter(|scored| asks.contains(&scored.truth.asks));
        Demand::at_most(text, most, share(own, |scored| scored.outcome == Some(outcome)))
    };
    let (inside, outside) = ([Asks::Effect, Asks::Pair], [Asks::Outside, Asks::LeftOut]);
    vec![
        of("wrong names, effect in the library: at most 1 %", &inside, AnswerGrade::Wrong, 0.01),
        of("wrong names, effect outside the library: at most 5 %", &outside, AnswerGrade::Wrong, 0.05),
        of("false alarms where nothing is hidden: at most 1 %", &[Asks::Null], AnswerGrade::Wrong, 0.01),
        of("no practical effect where nothing is hidden: at most 1 %", &[Asks::Null], AnswerGrade::NotPractical, 0.01),
    ]
}

/// Criteria on perturbed machines.
fn of_perturbed(perturbed: &OfMachine<'_>) -> Vec<Demand> {
    let asked = &perturbed.asked;
    let hidden = || asked.iter().filter(|scored| scored.truth.asks != Asks::Null);
    let nulls = asked.iter().filter(|scored| scored.truth.asks == Asks::Null);
    let is_wrong = |scored: &Scored| scored.outcome == Some(AnswerGrade::Wrong);
    let named = hidden().filter(|scored| scored.truth.multiple == 4.0);
    vec![
        Demand::at_least(
            "perturbed machines, right names at 4 s*: at least 85 %",
            0.85,
            share(named, Scored::is_right),
        ),
        Demand::at_most("perturbed machines, wrong names: at most 2 %", 0.02, share(hidden(), is_wrong)),
        Demand::at_most(
            "perturbed machines, false names where nothing is hidden: at most 2 %",
            0.02,
            share(nulls, is_wrong),
        ),
        covered("perturbed machines, 95 % intervals contain the truth: 90 to 98 %", [0.90, 0.98], perturbed),
    ]
}

/// Criterion on the coverage of intervals. Parameters of one case are correlated.
fn covered(text: &str, range: [f64; 2], OfMachine { parameters, .. }: &OfMachine<'_>) -> Demand {
    let held: Vec<(&str, bool)> = parameters.iter().filter_map(|own| Some((own.case.as_str(), own.held?))).collect();
    let count = held.iter().filter(|(_, held)| *held).count();
    let groups = held.iter().map(|(case, _)| *case).collect::<BTreeSet<&str>>().len();
    Demand::within(text, range, Measured::Grouped { count, cases: held.len(), groups })
}

/// Criterion on the median of errors.
fn middle(text: &str, most: f64, values: &[f64]) -> Demand {
    let (value, within) = (median(values.iter().copied()), values.iter().filter(|value| **value <= most).count());
    Demand::at_least(text, 0.5, Measured::Median { value, within, cases: values.len() })
}

/// Error of a time that is always allowed \[s\].
const TIME: f64 = 1e-4;

/// Criteria on parameters, probabilities and gains.
fn numbers(exact: &OfMachine<'_>, calibration: &ProbabilityCalibration) -> Vec<Demand> {
    let sizes = |multiple: f64| exact.parameters.iter().filter(move |own| own.is_size && own.multiple == multiple);
    let by_bound: Vec<f64> = sizes(4.0).filter_map(|own| own.by_bound).collect();
    let relative: Vec<f64> = sizes(16.0).filter(|own| own.unit != "s").map(|own| own.relative).collect();
    let times = sizes(16.0).filter(|own| own.unit == "s");
    let near: Vec<bool> = times.map(|own| own.error <= TIME.max(2.0 * own.sd.unwrap_or(0.0))).collect();
    let gained = |text: &str, interval: fn(&RecordedAnswer) -> Option<[f64; 2]>, truth: fn(&TrueGain) -> f64| {
        let is_held = |scored: &&Scored| -> Option<bool> {
            let ([lo, hi], gain) = (interval(scored.answer()?)?, truth(&scored.record.gain?));
            scored.is_right().then_some((lo..=hi).contains(&gain))
        };
        let held: Vec<bool> = exact.asked.iter().filter_map(is_held).collect();
        Demand::at_least(text, 0.90, of_all(&held))
    };
    let (error, bins) = (calibration.error, calibration.bins.clone());
    vec![
        middle("median error at 4 s* over the Cramer-Rao standard deviation (ideal 0.67): at most 1.3", 1.3, &by_bound),
        middle("median error at 16 s*: at most 2 %", 0.02, &relative),
        Demand::at_least("times at 16 s* within 0.1 ms or 2 standard deviations: at least 95 %", 0.95, of_all(&near)),
        covered("95 % intervals contain the truth: 92 to 97 %", [0.92, 0.97], exact),
        Demand::at_most("calibration error: at most 0.05", 0.05, Measured::Calibration { error, bins }),
        gained(
            "gain interval contains the true gain on an unrecorded motion: at least 90 %",
            |answer| answer.gain_elsewhere,
            |gain| gain.fresh,
        ),
        gained(
            "gain interval contains the true gain on the held-out motion: at least 90 %",
            |answer| answer.gain.map(|[_, lo, hi]| [lo, hi]),
            |gain| gain.held_out,
        ),
    ]
}

/// Criteria on the lead over the baseline methods.
fn beaten(methods: &[MethodRow]) -> Vec<Demand> {
    let Some((own, others)) = methods.split_first() else {
        return Vec::new();
    };
    let of = |other: &MethodRow| {
        let (lead, excess) = ([own.right, other.right], [own.wrong, other.wrong]);
        let method = &other.method;
        [
            Demand::at_least(format!("lead over {method}: at least 0.20"), 0.20, Measured::Difference(lead)),
            Demand::at_most(format!("wrong names beyond those of {method}: none"), 0.0, Measured::Difference(excess)),
        ]
    };
    others.iter().flat_map(of).collect()
}
