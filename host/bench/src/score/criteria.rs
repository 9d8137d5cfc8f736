//! Acceptance criteria of the diagnosis, each with its result and exact bounds.

use super::methods::MethodRow;
use super::{Scored, median};
use crate::calibration::ProbabilityCalibration;
use crate::outcome::{AnswerGrade, block_is_right};
use crate::parameters::ParameterError;
use crate::record::{RecordedAnswer, TrueGain};
use crate::seal::Asks;
use serde::Serialize;
use softdock_analysis::Share;
use std::collections::BTreeMap;

/// Acceptance criterion with its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AcceptanceCriterion {
    /// Demand.
    pub demand: String,
    /// A share with its exact interval.
    pub share: Option<Share>,
    /// Value, if the result is not a share.
    pub value: Option<f64>,
    /// Whether it is met; `None` without cases.
    pub met: Option<bool>,
}

impl AcceptanceCriterion {
    fn share(demand: &str, count: usize, cases: usize, meets: impl Fn(f64) -> bool) -> Self {
        let share = (cases > 0).then(|| Share::of(count as u64, cases as u64));
        let met = (cases > 0).then(|| meets(count as f64 / cases as f64));
        Self { demand: demand.to_owned(), share, value: None, met }
    }

    fn value(demand: &str, value: Option<f64>, meets: impl Fn(f64) -> bool) -> Self {
        Self { demand: demand.to_owned(), share: None, value, met: value.map(meets) }
    }
}

/// Evaluates all criteria.
pub(super) fn criteria(
    asked: &[&Scored],
    parameters: &[ParameterError],
    calibration: &ProbabilityCalibration,
    methods: &[MethodRow],
) -> Vec<AcceptanceCriterion> {
    let mut criteria = naming(asked);
    criteria.extend(restraint(asked));
    criteria.extend(numbers(asked, parameters, calibration));
    criteria.extend(beaten(methods));
    criteria
}

/// Criteria on right names.
fn naming(asked: &[&Scored]) -> Vec<AcceptanceCriterion> {
    let right = |demand: &str, asks: Asks, multiple: f64, least: f64| {
        let own: Vec<&&Scored> = asked.iter().filter(|scored| scored.asks(asks, multiple)).collect();
        let count = own.iter().filter(|scored| scored.is_right()).count();
        AcceptanceCriterion::share(demand, count, own.len(), |share| share >= least)
    };
    let blocks: Vec<bool> =
        asked.iter().filter_map(|scored| block_is_right(scored.plant, &scored.truth, scored.answer()?)).collect();
    vec![
        right("right name at 2 s*: at least 90 %", Asks::Effect, 2.0, 0.90),
        right("right name at 4 s*: at least 98 %", Asks::Effect, 4.0, 0.98),
        least(asked, "worst effect at 2 s*: at least 15 of 20", 2.0, 0.75),
        least(asked, "worst effect at 4 s*: at least 17 of 20", 4.0, 0.85),
        right("pairs across groups, both names: at least 90 %", Asks::Pair, 4.0, 0.90),
        right("forms outside the library at 16 s*: at least 90 % not in library", Asks::Outside, 16.0, 0.90),
        right("excluded from the library, at 16 s*: at least 90 % not in library", Asks::LeftOut, 16.0, 0.90),
        resolved(asked),
        AcceptanceCriterion::share(
            "block right: at least 99 %",
            blocks.iter().filter(|right| **right).count(),
            blocks.len(),
            |share| share >= 0.99,
        ),
    ]
}

/// Criterion on ambiguous answers after their experiments.
fn resolved(asked: &[&Scored]) -> AcceptanceCriterion {
    let after: Vec<AnswerGrade> = asked.iter().filter_map(|scored| scored.after).collect();
    let right = after.iter().filter(|outcome| **outcome == AnswerGrade::Right).count();
    let demand = "ambiguous answers right after at most two proposed experiments: at least 95 %";
    AcceptanceCriterion::share(demand, right, after.len(), |share| share >= 0.95)
}

/// Criterion on the effect that is named least.
fn least(asked: &[&Scored], demand: &str, multiple: f64, least: f64) -> AcceptanceCriterion {
    let mut counts: BTreeMap<(&str, &str), (usize, usize)> = BTreeMap::new();
    for scored in asked.iter().filter(|scored| scored.asks(Asks::Effect, multiple)) {
        let count = counts.entry((scored.plant.name, &scored.truth.hidden[0].id)).or_default();
        *count = (count.0 + usize::from(scored.is_right()), count.1 + 1);
    }
    let share = |(right, cases): &(usize, usize)| *right as f64 / *cases as f64;
    let worst = counts.iter().min_by(|a, b| share(a.1).total_cmp(&share(b.1)));
    let (name, (right, cases)) = worst.map_or((String::new(), (0, 0)), |((_, id), count)| (format!(" ({id})"), *count));
    AcceptanceCriterion::share(&format!("{demand}{name}"), right, cases, |share| share >= least)
}

/// Criteria on false names.
fn restraint(asked: &[&Scored]) -> Vec<AcceptanceCriterion> {
    let of = |demand: &str, asks: &[Asks], outcome: AnswerGrade, most: f64| {
        let own: Vec<&&Scored> = asked.iter().filter(|scored| asks.contains(&scored.truth.asks)).collect();
        let count = own.iter().filter(|scored| scored.outcome == Some(outcome)).count();
        AcceptanceCriterion::share(demand, count, own.len(), |share| share <= most)
    };
    let inside = [Asks::Effect, Asks::Pair];
    vec![
        of("wrong names, effect in the library: at most 1 %", &inside, AnswerGrade::Wrong, 0.01),
        of(
            "wrong names, effect outside the library: at most 5 %",
            &[Asks::Outside, Asks::LeftOut],
            AnswerGrade::Wrong,
            0.05,
        ),
        of("false alarms where nothing is hidden: none", &[Asks::Null], AnswerGrade::Wrong, 0.0),
        of("no practical effect where nothing is hidden: at most 1 %", &[Asks::Null], AnswerGrade::NotPractical, 0.01),
    ]
}

/// Error of a time that is always allowed \[s\].
const TIME: f64 = 1e-4;

/// Criteria on parameters, probabilities and gains.
fn numbers(
    asked: &[&Scored],
    parameters: &[ParameterError],
    calibration: &ProbabilityCalibration,
) -> Vec<AcceptanceCriterion> {
    let at = |multiple: f64| parameters.iter().filter(move |own| own.multiple == multiple);
    let sizes = |multiple: f64| at(multiple).filter(|own| own.is_size);
    let by_bound = median(sizes(4.0).filter_map(|own| own.by_bound));
    let relative = median(sizes(16.0).filter(|own| own.unit != "s").map(|own| own.relative));
    let times: Vec<&ParameterError> = sizes(16.0).filter(|own| own.unit == "s").collect();
    let near = |own: &&&ParameterError| own.error <= TIME.max(2.0 * own.sd.unwrap_or(0.0));
    let held: Vec<bool> = parameters.iter().filter_map(|own| own.held).collect();
    let gained = |demand: &str, interval: fn(&RecordedAnswer) -> Option<[f64; 2]>, truth: fn(&TrueGain) -> f64| {
        let is_held = |scored: &&Scored| -> Option<bool> {
            let ([lo, hi], gain) = (interval(scored.answer()?)?, truth(&scored.record.gain?));
            scored.is_right().then_some((lo..=hi).contains(&gain))
        };
        let held: Vec<bool> = asked.iter().filter_map(is_held).collect();
        AcceptanceCriterion::share(demand, held.iter().filter(|held| **held).count(), held.len(), |share| share >= 0.90)
    };
    vec![
        AcceptanceCriterion::value(
            "median error at 4 s* over the Cramer-Rao standard deviation (ideal 0.67): at most 1.3",
            by_bound,
            |value| value <= 1.3,
        ),
        AcceptanceCriterion::value("median error at 16 s*: at most 2 %", relative, |value| value <= 0.02),
        AcceptanceCriterion::share(
            "times at 16 s* within 0.1 ms or 2 standard deviations",
            times.iter().filter(near).count(),
            times.len(),
            |share| share >= 0.95,
        ),
        AcceptanceCriterion::share(
            "95 % intervals contain the truth: 92 to 97 %",
            held.iter().filter(|held| **held).count(),
            held.len(),
            |share| (0.92..=0.97).contains(&share),
        ),
        AcceptanceCriterion::value("calibration error: at most 0.05", calibration.error, |value| value <= 0.05),
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
fn beaten(methods: &[MethodRow]) -> Vec<AcceptanceCriterion> {
    let Some((own, others)) = methods.split_first() else {
        return Vec::new();
    };
    let share = |share: &Share| share.count as f64 / (share.cases as f64).max(1.0);
    let of = |other: &MethodRow| {
        let lead = share(&own.right) - share(&other.right);
        let value = (other.right.cases > 0).then_some(lead);
        let fewer = own.wrong.count <= other.wrong.count;
        AcceptanceCriterion::value(
            &format!("lead over {}: at least 0.20, and no more wrong names", other.method),
            value,
            |lead| lead >= 0.20 && fewer,
        )
    };
    others.iter().map(of).collect()
}
