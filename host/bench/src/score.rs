//! Opens the seals and counts: outcomes by size and effect, marks with their exact bounds, parameters, gains, cost.

use crate::calibration::{Calibration, calibration};
use crate::outcome::{Outcome, block_is_right, outcome};
use crate::parameters::{Compared, compared};
use crate::plant::{Plant, plant};
use crate::record::{Answer, Record, Said, records, seals};
use crate::seal::{Asks, SealedTruth, open};
use crate::{Error, Result};
use serde::Serialize;
use softdock_analysis::summary::Share;
use std::collections::BTreeMap;
use std::path::Path;

/// A finished case beside its truth.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The plant.
    pub plant: &'static Plant,
    /// What was hidden.
    pub truth: SealedTruth,
    /// What was found.
    pub record: Record,
    /// What that is worth; none if the case could not be asked.
    pub outcome: Option<Outcome>,
}

impl Scored {
    /// As the sealed truth and a record have it.
    ///
    /// # Errors
    /// A plant that there is not.
    pub fn of(truth: SealedTruth, record: Record) -> Result<Self> {
        let unknown = || Error::Unknown { what: format!("{}: no plant `{}`", truth.case, truth.plant) };
        let plant = plant(&truth.plant).ok_or_else(unknown)?;
        let outcome = record.answer.as_ref().map(|answer| outcome(plant, &truth, answer));
        Ok(Self { plant, truth, record, outcome })
    }

    fn answer(&self) -> Option<&Answer> {
        self.record.answer.as_ref()
    }

    fn asks(&self, asks: Asks, multiple: f64) -> bool {
        self.truth.asks == asks && self.truth.multiple == multiple
    }

    /// Whether the answer is as good as can be: the truth, or the list that holds it where no oracle tells more.
    fn is_right(&self) -> bool {
        let inseparable = || {
            let hidden = &self.truth.hidden;
            hidden.iter().any(|hidden| hidden.scale.as_ref().is_some_and(|scale| scale.inseparable.is_some()))
        };
        match self.outcome {
            Some(Outcome::Right | Outcome::Partner) => true,
            Some(Outcome::Listed) => inseparable(),
            _ => false,
        }
    }
}

/// Opens the seals of all finished cases.
///
/// # Errors
/// Records that cannot be read; a truth that is not the one sealed before the diagnosis began.
pub fn scored(folder: &Path) -> Result<Vec<Scored>> {
    let seals = seals(folder)?;
    let of = |record: Record| {
        if seals.get(&record.case) != Some(&record.sealed) {
            return Err(Error::damaged(folder, format!("{} was not sealed before it was diagnosed", record.case)));
        }
        Scored::of(open(folder, &record.case, &record.sealed)?, record)
    };
    records(folder)?.into_iter().map(of).collect()
}

/// One demand, and what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// What is demanded.
    pub demand: String,
    /// A share with its exact interval.
    pub share: Option<Share>,
    /// A number that is no share.
    pub value: Option<f64>,
    /// Whether the demand is met; none where no case asks.
    pub met: Option<bool>,
}

impl Mark {
    fn share(demand: &str, count: usize, cases: usize, meets: impl Fn(f64) -> bool) -> Self {
        let share = (cases > 0).then(|| Share::of(count as u64, cases as u64));
        let met = (cases > 0).then(|| meets(count as f64 / cases as f64));
        Self { demand: demand.to_owned(), share, value: None, met }
    }

    fn value(demand: &str, value: Option<f64>, meets: impl Fn(f64) -> bool) -> Self {
        Self { demand: demand.to_owned(), share: None, value, met: value.map(meets) }
    }
}

/// Outcomes of what was hidden in one size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Plant.
    pub plant: String,
    /// What was asked.
    pub asks: Asks,
    /// What was hidden.
    pub hidden: String,
    /// In multiples of the smallest size that could be told.
    pub multiple: f64,
    /// Cases that were asked.
    pub cases: usize,
    /// Those with the best possible answer.
    pub right: usize,
    /// Cases by outcome.
    pub outcomes: BTreeMap<Outcome, usize>,
    /// Cases that the bench cannot show.
    pub unasked: usize,
    /// Median of the smallest size that could be told, in the effect's unit.
    pub scale: Option<f64>,
    /// The rival that no size tells it from, in most cases.
    pub inseparable: Option<String>,
    /// Cases by what was answered.
    pub answers: BTreeMap<String, usize>,
}

/// A method beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodRow {
    /// The method.
    pub method: String,
    /// Right names of single effects, at sizes that an oracle tells.
    pub right: Share,
    /// Wrong names among all cases that it was given.
    pub wrong: Share,
    /// Names where nothing is hidden.
    pub alarms: Share,
    /// Mean cost \[s\].
    pub seconds: f64,
}

/// A case whose answer is not as good as can be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The case.
    pub case: String,
    /// Its seed.
    pub seed: u64,
    /// What was hidden, with sizes and units.
    pub hidden: String,
    /// What was answered.
    pub answered: String,
    /// What that is worth.
    pub outcome: Outcome,
}

/// The whole score.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// Cases with an answer.
    pub cases: usize,
    /// Cases that the bench cannot show, told apart.
    pub unasked: Vec<String>,
    /// The demands.
    pub marks: Vec<Mark>,
    /// Outcomes by what was hidden and how large.
    pub rows: Vec<Row>,
    /// Stated probabilities.
    pub calibration: Calibration,
    /// Parameters.
    pub parameters: Vec<Compared>,
    /// Ours and others.
    pub methods: Vec<MethodRow>,
    /// Answers that could be better at sizes that an oracle tells, and wrong ones at any size.
    pub failures: Vec<Failure>,
    /// Cost of the diagnoses and of all else \[s\].
    pub seconds: [f64; 2],
}

impl Score {
    /// Whether every demand that was asked is met.
    pub fn is_met(&self) -> bool {
        self.marks.iter().all(|mark| mark.met != Some(false))
    }
}

/// Counts.
pub fn score(all: &[Scored]) -> Score {
    let asked: Vec<&Scored> = all.iter().filter(|scored| scored.outcome.is_some()).collect();
    let unasked = all.iter().filter(|scored| scored.outcome.is_none());
    let parameters: Vec<Compared> = asked.iter().flat_map(|scored| of_right(scored)).collect();
    let calibration = calibration(&names(&asked));
    let methods = methods(&asked);
    Score {
        cases: asked.len(),
        unasked: unasked.map(|scored| scored.truth.case.clone()).collect(),
        marks: marks(&asked, &parameters, &calibration, &methods),
        rows: rows(all),
        calibration,
        parameters,
        methods,
        failures: asked.iter().filter_map(|scored| failure(scored)).collect(),
        seconds: [
            all.iter().map(|scored| scored.record.cost.diagnosis).sum(),
            all.iter().map(|scored| scored.record.cost.rest).sum(),
        ],
    }
}

/// Parameters of the right names.
fn of_right(scored: &Scored) -> Vec<Compared> {
    match (scored.outcome, scored.answer()) {
        (Some(Outcome::Right), Some(answer)) if scored.truth.asks == Asks::Effect => {
            compared(scored.plant, &scored.truth, answer)
        }
        _ => Vec::new(),
    }
}

/// Stated probability of the first name of every answer that names, and whether it is right.
fn names(asked: &[&Scored]) -> Vec<(f64, bool)> {
    let of = |scored: &&&Scored| {
        let answer = scored.answer()?;
        let named = matches!(answer.said, Said::Named | Said::Ambiguous);
        let first = answer.effects.first().filter(|_| named)?;
        Some((first.p, scored.truth.hidden.iter().any(|hidden| scored.plant.is_right(&hidden.id, &first.id))))
    };
    // What is in no library has no probability that could be right.
    let known = |scored: &&&Scored| matches!(scored.truth.asks, Asks::Null | Asks::Effect | Asks::Pair);
    asked.iter().filter(known).filter_map(|scored| of(&scored)).collect()
}

fn marks(asked: &[&Scored], parameters: &[Compared], calibration: &Calibration, methods: &[MethodRow]) -> Vec<Mark> {
    let mut marks = naming(asked);
    marks.extend(restraint(asked));
    marks.extend(numbers(asked, parameters, calibration));
    marks.extend(beaten(methods));
    marks
}

/// Right names.
fn naming(asked: &[&Scored]) -> Vec<Mark> {
    let right = |demand: &str, asks: Asks, multiple: f64, least: f64| {
        let own: Vec<&&Scored> = asked.iter().filter(|scored| scored.asks(asks, multiple)).collect();
        let count = own.iter().filter(|scored| scored.is_right()).count();
        Mark::share(demand, count, own.len(), |share| share >= least)
    };
    let blocks: Vec<bool> =
        asked.iter().filter_map(|scored| block_is_right(scored.plant, &scored.truth, scored.answer()?)).collect();
    vec![
        right("right name at 2 s*: at least 90 %", Asks::Effect, 2.0, 0.90),
        right("right name at 4 s*: at least 98 %", Asks::Effect, 4.0, 0.98),
        least(asked, "least effect at 2 s*: at least 15 of 20", 2.0, 0.75),
        least(asked, "least effect at 4 s*: at least 17 of 20", 4.0, 0.85),
        right("pairs across groups, both names: at least 90 %", Asks::Pair, 4.0, 0.90),
        right("forms outside the library at 16 s*: at least 90 % not in library", Asks::Outside, 16.0, 0.90),
        right("left out of the library, at 16 s*: at least 90 % not in library", Asks::LeftOut, 16.0, 0.90),
        Mark::share(
            "block right: at least 99 %",
            blocks.iter().filter(|right| **right).count(),
            blocks.len(),
            |share| share >= 0.99,
        ),
    ]
}

/// The effect that is named least.
fn least(asked: &[&Scored], demand: &str, multiple: f64, least: f64) -> Mark {
    let mut counts: BTreeMap<(&str, &str), (usize, usize)> = BTreeMap::new();
    for scored in asked.iter().filter(|scored| scored.asks(Asks::Effect, multiple)) {
        let count = counts.entry((scored.plant.name, &scored.truth.hidden[0].id)).or_default();
        *count = (count.0 + usize::from(scored.is_right()), count.1 + 1);
    }
    let share = |(right, cases): &(usize, usize)| *right as f64 / *cases as f64;
    let worst = counts.iter().min_by(|a, b| share(a.1).total_cmp(&share(b.1)));
    let (name, (right, cases)) = worst.map_or((String::new(), (0, 0)), |((_, id), count)| (format!(" ({id})"), *count));
    Mark::share(&format!("{demand}{name}"), right, cases, |share| share >= least)
}

/// Names that must not be spoken.
fn restraint(asked: &[&Scored]) -> Vec<Mark> {
    let of = |demand: &str, asks: &[Asks], outcome: Outcome, most: f64| {
        let own: Vec<&&Scored> = asked.iter().filter(|scored| asks.contains(&scored.truth.asks)).collect();
        let count = own.iter().filter(|scored| scored.outcome == Some(outcome)).count();
        Mark::share(demand, count, own.len(), |share| share <= most)
    };
    let inside = [Asks::Effect, Asks::Pair];
    vec![
        of("wrong names, anything in the library: at most 1 %", &inside, Outcome::Wrong, 0.01),
        of("wrong names, nothing in the library: at most 5 %", &[Asks::Outside, Asks::LeftOut], Outcome::Wrong, 0.05),
        of("false alarms where nothing is hidden: none", &[Asks::Null], Outcome::Wrong, 0.0),
        of("no practical effect where nothing is hidden: at most 1 %", &[Asks::Null], Outcome::NotPractical, 0.01),
    ]
}

/// Median size of a normal number, in standard deviations: what the Cramer-Rao value allows as a median error.
const MEDIAN: f64 = 0.6745;
/// Error of a time that is always allowed \[s\].
const TIME: f64 = 1e-4;

/// Parameters, probabilities, gains.
fn numbers(asked: &[&Scored], parameters: &[Compared], calibration: &Calibration) -> Vec<Mark> {
    let at = |multiple: f64| parameters.iter().filter(move |own| own.multiple == multiple);
    let sizes = |multiple: f64| at(multiple).filter(|own| own.is_size);
    let by_bound = median(sizes(4.0).filter_map(|own| own.by_bound).map(|error| error / MEDIAN));
    let relative = median(sizes(16.0).filter(|own| own.unit != "s").map(|own| own.relative));
    let times: Vec<&Compared> = sizes(16.0).filter(|own| own.unit == "s").collect();
    let near = |own: &&&Compared| own.error <= TIME.max(2.0 * own.sd.unwrap_or(0.0));
    let held: Vec<bool> = parameters.iter().filter_map(|own| own.held).collect();
    let gains: Vec<[bool; 2]> = asked
        .iter()
        .filter_map(|scored| {
            let ([_, lo, hi], gain) = (scored.answer()?.gain?, scored.record.gain?);
            (scored.is_right()).then_some([gain.fresh, gain.held_out].map(|true_gain| (lo..=hi).contains(&true_gain)))
        })
        .collect();
    let gained = |demand: &str, which: usize, least: f64| {
        let count = gains.iter().filter(|held| held[which]).count();
        Mark::share(demand, count, gains.len(), |share| share >= least)
    };
    vec![
        Mark::value("median error at 4 s*, of what Cramer and Rao allow: at most 1.3", by_bound, |value| value <= 1.3),
        Mark::value("median error at 16 s*: at most 2 %", relative, |value| value <= 0.02),
        Mark::share(
            "times at 16 s* within 0.1 ms or 2 standard deviations",
            times.iter().filter(near).count(),
            times.len(),
            |share| share >= 0.95,
        ),
        Mark::share(
            "95 % intervals hold the truth: 92 to 97 %",
            held.iter().filter(|held| **held).count(),
            held.len(),
            |share| (0.92..=0.97).contains(&share),
        ),
        Mark::value("calibration error: at most 0.05", calibration.error, |value| value <= 0.05),
        gained("gain's interval holds the true gain of a fresh motion: at least 90 %", 0, 0.90),
        gained("gain's interval holds the true gain of the held-out motion: at least 90 %", 1, 0.90),
    ]
}

/// Other methods, beaten in right names by 20 points, with fewer wrong ones.
fn beaten(methods: &[MethodRow]) -> Vec<Mark> {
    let Some((own, others)) = methods.split_first() else {
        return Vec::new();
    };
    let share = |share: &Share| share.count as f64 / (share.cases as f64).max(1.0);
    let of = |other: &MethodRow| {
        let lead = share(&own.right) - share(&other.right);
        let value = (other.right.cases > 0).then_some(lead);
        let fewer = own.wrong.count <= other.wrong.count;
        Mark::value(&format!("lead over {}: at least 0.20, and no more wrong names", other.method), value, |lead| {
            lead >= 0.20 && fewer
        })
    };
    others.iter().map(of).collect()
}

/// Ours and others on the cases that all were given.
fn methods(asked: &[&Scored]) -> Vec<MethodRow> {
    let given: Vec<&Scored> = asked.iter().copied().filter(|scored| !scored.record.baselines.is_empty()).collect();
    let Some(first) = given.first() else {
        return Vec::new();
    };
    let names = first.record.baselines.iter().map(|baseline| baseline.method.as_str());
    let ours = |scored: &Scored| (scored.outcome.unwrap_or(Outcome::Missed), scored.record.cost.diagnosis);
    let other = |scored: &Scored, name: &str| {
        let own = scored.record.baselines.iter().find(|baseline| baseline.method == name);
        own.map_or((Outcome::Missed, 0.0), |own| (of_name(scored, own.named.as_deref()), own.seconds))
    };
    std::iter::once(method("softdock diagnose", &given, &ours))
        .chain(names.map(|name| method(name, &given, &|scored| other(scored, name))))
        .collect()
}

/// A method, by what each of its answers is worth and costs.
fn method(name: &str, given: &[&Scored], worth: &dyn Fn(&Scored) -> (Outcome, f64)) -> MethodRow {
    let share = |cases: &[&Scored], outcome: Outcome| {
        let hits = cases.iter().filter(|scored| worth(scored).0 == outcome).count();
        Share::of(hits as u64, cases.len() as u64)
    };
    let (nulls, hidden): (Vec<&Scored>, Vec<&Scored>) =
        given.iter().copied().partition(|scored| scored.truth.asks == Asks::Null);
    let told =
        hidden.iter().copied().filter(|scored| scored.truth.asks == Asks::Effect && scored.truth.multiple >= 2.0);
    MethodRow {
        method: name.to_owned(),
        right: share(&told.collect::<Vec<_>>(), Outcome::Right),
        wrong: share(&hidden, Outcome::Wrong),
        alarms: share(&nulls, Outcome::Wrong),
        seconds: given.iter().map(|scored| worth(scored).1).sum::<f64>() / given.len() as f64,
    }
}

/// What a bare name is worth.
fn of_name(scored: &Scored, named: Option<&str>) -> Outcome {
    let is_right = |name: &str| scored.truth.hidden.iter().any(|hidden| scored.plant.is_right(&hidden.id, name));
    match (named, scored.truth.asks) {
        (None, Asks::Null) => Outcome::Right,
        (None, _) => Outcome::Missed,
        (Some(name), Asks::Pair) if is_right(name) => Outcome::Partly,
        (Some(name), _) if is_right(name) => Outcome::Right,
        (Some(_), _) => Outcome::Wrong,
    }
}

/// Outcomes by plant, task, what was hidden, and size.
fn rows(all: &[Scored]) -> Vec<Row> {
    let mut groups: BTreeMap<(usize, Asks, String, u64), Vec<&Scored>> = BTreeMap::new();
    for scored in all {
        let place = crate::plant::PLANTS.iter().position(|plant| plant.name == scored.plant.name).unwrap_or(0);
        let truth = &scored.truth;
        // Positive numbers are ordered as their bits.
        groups.entry((place, truth.asks, hidden(truth), truth.multiple.to_bits())).or_default().push(scored);
    }
    groups
        .into_iter()
        .map(|((_, asks, hidden, multiple), own)| row(asks, hidden, f64::from_bits(multiple), &own))
        .collect()
}

fn row(asks: Asks, hidden: String, multiple: f64, own: &[&Scored]) -> Row {
    let asked: Vec<&&Scored> = own.iter().filter(|scored| scored.outcome.is_some()).collect();
    let (mut outcomes, mut answers) = (BTreeMap::new(), BTreeMap::new());
    for scored in &asked {
        if let (Some(outcome), Some(answer)) = (scored.outcome, scored.answer()) {
            *outcomes.entry(outcome).or_default() += 1;
            *answers.entry(answered(answer)).or_default() += 1;
        }
    }
    let scales = || own.iter().filter_map(|scored| scored.truth.hidden.first()?.scale.as_ref());
    Row {
        plant: own[0].plant.name.to_owned(),
        asks,
        hidden,
        multiple,
        cases: asked.len(),
        right: asked.iter().filter(|scored| scored.is_right()).count(),
        outcomes,
        unasked: own.len() - asked.len(),
        scale: median(scales().map(|scale| scale.size)),
        inseparable: scales().find_map(|scale| scale.inseparable.clone()),
        answers,
    }
}

/// What is hidden, by its names.
pub(crate) fn hidden(truth: &SealedTruth) -> String {
    truth.hidden.iter().map(|hidden| hidden.id.as_str()).collect::<Vec<_>>().join(" + ")
}

/// What is answered, in short.
pub(crate) fn answered(answer: &Answer) -> String {
    let names = |joint: &str| answer.effects.iter().map(|effect| effect.id.as_str()).collect::<Vec<_>>().join(joint);
    match answer.said {
        Said::Refused => "refused".to_owned(),
        Said::NoEffect => "no effect".to_owned(),
        Said::NoPracticalEffect => "no practical effect".to_owned(),
        Said::Named => names(" + "),
        Said::Ambiguous => names(" or "),
        Said::NotInLibrary => "not in library".to_owned(),
    }
}

/// A case that an oracle could tell and the diagnosis could not, or a wrong name at any size.
fn failure(scored: &Scored) -> Option<Failure> {
    let (outcome, answer) = (scored.outcome?, scored.answer()?);
    let told = match scored.truth.asks {
        Asks::Null | Asks::Pair => true,
        Asks::Effect => scored.truth.multiple >= 2.0,
        Asks::Outside | Asks::LeftOut => scored.truth.multiple >= 16.0,
    };
    let failed = outcome == Outcome::Wrong || (told && !scored.is_right());
    failed.then(|| Failure {
        case: scored.truth.case.clone(),
        seed: scored.truth.seed,
        hidden: sized(&scored.truth),
        answered: answer.refusal.clone().unwrap_or_else(|| answered(answer)),
        outcome,
    })
}

/// What is hidden, with sizes.
fn sized(truth: &SealedTruth) -> String {
    let of = |hidden: &crate::seal::Hidden| {
        let size = hidden.parameters.first().map(|size| format!(" {:.4e} {}", size.value, size.unit));
        format!("{}{}", hidden.id, size.unwrap_or_default().trim_end())
    };
    truth.hidden.iter().map(of).collect::<Vec<_>>().join(" + ")
}

/// The middle of some numbers.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::tests::{answer, truth};
    use crate::record::Cost;

    fn case(asks: Asks, hidden: &[&str], said: Said, effects: &[&str]) -> Scored {
        let answer = Some(answer(said, effects));
        let (case, sealed, cost) = (String::new(), String::new(), Cost { diagnosis: 2.0, rest: 1.0 });
        let record = Record { case, sealed, answer, gain: None, baselines: Vec::new(), cost };
        Scored::of(truth(asks, hidden), record).expect("the drive")
    }

    fn mark<'a>(score: &'a Score, start: &str) -> &'a Mark {
        score.marks.iter().find(|mark| mark.demand.starts_with(start)).expect(start)
    }

    #[test]
    fn made_up_answers_get_the_score_that_they_deserve() {
        let mut all: Vec<Scored> =
            (0..19).map(|_| case(Asks::Effect, &["J1_coulomb"], Said::Named, &["J1_coulomb"])).collect();
        all.push(case(Asks::Effect, &["J1_coulomb"], Said::Named, &["J2_viscous"]));
        all.push(case(Asks::Null, &[], Said::NoEffect, &[]));
        all.push(case(Asks::Pair, &["J1_coulomb", "C2_lag"], Said::Named, &["J1_coulomb"]));
        let score = score(&all);
        let right = mark(&score, "right name at 4 s*");
        let share = right.share.expect("20 cases");
        assert_eq!((share.count, share.cases, right.met), (19, 20, Some(false)));
        assert!((share.interval.lo - 0.7513).abs() < 1e-3 && (share.interval.hi - 0.9987).abs() < 1e-3, "{share:?}");
        assert_eq!(mark(&score, "least effect at 4 s*").met, Some(true));
        assert_eq!(mark(&score, "wrong names, anything").share.expect("21").count, 1);
        assert_eq!(mark(&score, "false alarms").met, Some(true));
        assert_eq!(mark(&score, "right name at 2 s*").met, None, "nobody asked");
        assert_eq!(mark(&score, "pairs").met, Some(false));
        assert!((score.calibration.error.expect("names") - (0.99 - 20.0 / 21.0)).abs() < 1e-9);
        assert_eq!(score.failures.iter().filter(|failure| failure.outcome == Outcome::Wrong).count(), 1);
        assert_eq!((score.seconds, score.is_met()), ([44.0, 22.0], false));
    }

    #[test]
    fn a_list_that_holds_the_truth_is_right_only_where_no_oracle_tells_more() {
        let mut listed = case(Asks::Effect, &["J1_coulomb"], Said::Ambiguous, &["J2_viscous", "J1_coulomb"]);
        assert!(!listed.is_right());
        let rival = Some("J2_viscous".to_owned());
        listed.truth.hidden[0].scale = Some(crate::oracle::Scale { size: 1.0, inseparable: rival, nominal: false });
        assert!(listed.is_right());
    }
}
