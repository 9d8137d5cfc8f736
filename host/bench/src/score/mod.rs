//! Score: opens the seals and counts grades by size and effect, criteria with exact bounds, parameter errors, gains,
//! computing time.

mod criteria;
mod demand;
mod methods;
mod rows;

use crate::calibration::{ProbabilityCalibration, calibration};
use crate::outcome::{AnswerGrade, outcome};
use crate::parameters::{ParameterError, compared};
use crate::plan::MachineKind;
use crate::plant::{GauntletPlant, plant};
use crate::record::{CaseRecord, RecordedAnswer, RecordedVerdict, records, seals};
use crate::seal::{Asks, SealedTruth, open};
use crate::{GauntletError, Result};
use criteria::{OfMachine, criteria};
pub use demand::{AcceptanceCriterion, DemandStatus};
pub use methods::MethodRow;
use methods::methods;
pub use rows::{Failure, Row};
use rows::{failure, rows};
use serde::Serialize;
use std::path::Path;

/// Finished case with its truth.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The plant.
    pub plant: &'static GauntletPlant,
    /// Hidden effects.
    pub truth: SealedTruth,
    /// Record of the case.
    pub record: CaseRecord,
    /// Grade; `None` if the case has no answer.
    pub outcome: Option<AnswerGrade>,
    /// Grade after the proposed experiments; `None` if none was proposed.
    pub after: Option<AnswerGrade>,
}

impl Scored {
    /// Grades a record against the sealed truth.
    ///
    /// # Errors
    /// An unknown plant.
    pub fn of(truth: SealedTruth, record: CaseRecord) -> Result<Self> {
        let unknown = || GauntletError::Unknown { what: format!("{}: no plant `{}`", truth.case, truth.plant) };
        let plant = plant(&truth.plant).ok_or_else(unknown)?;
        let worth = |answer: Option<&RecordedAnswer>| answer.map(|answer| outcome(plant, &truth, answer));
        let (first, after) = (worth(record.answer.as_ref()), worth(record.after.last()));
        Ok(Self { plant, truth, record, outcome: first, after })
    }

    fn answer(&self) -> Option<&RecordedAnswer> {
        self.record.answer.as_ref()
    }

    fn asks(&self, asks: Asks, multiple: f64) -> bool {
        self.truth.asks == asks && self.truth.multiple == multiple
    }

    /// Returns whether the answer is the best possible: the truth, or a list with it where the oracle is inseparable.
    fn is_right(&self) -> bool {
        let inseparable = || {
            let hidden = &self.truth.hidden;
            hidden.iter().any(|hidden| hidden.scale.as_ref().is_some_and(|scale| scale.inseparable.is_some()))
        };
        match self.outcome {
            Some(AnswerGrade::Right | AnswerGrade::Partner) => true,
            Some(AnswerGrade::Listed) => inseparable(),
            _ => false,
        }
    }
}

/// Returns all finished cases with their opened truths.
///
/// # Errors
/// Records that cannot be read; a truth that is not the one sealed before the diagnosis began.
pub fn scored(folder: &Path) -> Result<Vec<Scored>> {
    let seals = seals(folder)?;
    let of = |record: CaseRecord| {
        if seals.get(&record.case) != Some(&record.sealed) {
            return Err(GauntletError::damaged(
                folder,
                format!("{} was not sealed before it was diagnosed", record.case),
            ));
        }
        Scored::of(open(folder, &record.case, &record.sealed)?, record)
    };
    records(folder)?.into_iter().map(of).collect()
}

/// Score of the diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct GauntletScore {
    /// Cases with an answer.
    pub cases: usize,
    /// Cases beyond the range of the generator.
    pub unasked: Vec<String>,
    /// Acceptance criteria.
    pub marks: Vec<AcceptanceCriterion>,
    /// Grades by hidden effect and size.
    pub rows: Vec<Row>,
    /// Calibration of stated probabilities.
    pub calibration: ProbabilityCalibration,
    /// Parameter errors.
    pub parameters: Vec<ParameterError>,
    /// Diagnosis and baseline methods.
    pub methods: Vec<MethodRow>,
    /// Suboptimal answers at detectable sizes, and wrong answers at any size.
    pub failures: Vec<Failure>,
    /// Computing time of the diagnoses and of everything else \[s\].
    pub seconds: [f64; 2],
}

impl GauntletScore {
    /// Returns whether no criterion is refuted.
    pub fn is_met(&self) -> bool {
        self.marks.iter().all(|mark| mark.status != DemandStatus::Refuted)
    }
}

/// Computes the score.
pub fn score(all: &[Scored]) -> GauntletScore {
    let asked: Vec<&Scored> = all.iter().filter(|scored| scored.outcome.is_some()).collect();
    let unasked = all.iter().filter(|scored| scored.outcome.is_none());
    let parameters: Vec<ParameterError> = asked.iter().flat_map(|scored| of_right(scored)).collect();
    let [exact, perturbed] =
        [MachineKind::Exact, MachineKind::Perturbed].map(|kind| OfMachine::of(kind, &asked, &parameters));
    let calibration = calibration(&names(&exact.asked));
    let methods = methods(&asked);
    let marks = criteria(&exact, &perturbed, &calibration, &methods);
    GauntletScore {
        cases: asked.len(),
        unasked: unasked.map(|scored| scored.truth.case.clone()).collect(),
        marks,
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
fn of_right(scored: &Scored) -> Vec<ParameterError> {
    match (scored.outcome, scored.answer()) {
        (Some(AnswerGrade::Right), Some(answer)) if scored.truth.asks == Asks::Effect => {
            compared(scored.plant, &scored.truth, answer)
        }
        _ => Vec::new(),
    }
}

/// Stated probability of the first name of every answer that names, and whether it is right.
fn names(asked: &[&Scored]) -> Vec<(f64, bool)> {
    let of = |scored: &&&Scored| {
        let answer = scored.answer()?;
        let first = answer.effects.first().filter(|_| answer.verdict >= RecordedVerdict::Named)?;
        Some((first.p, scored.truth.hidden.iter().any(|hidden| scored.plant.is_right(&hidden.id, &first.id))))
    };
    // A form outside the library has no probability to calibrate.
    let known = |scored: &&&Scored| matches!(scored.truth.asks, Asks::Null | Asks::Effect | Asks::Pair);
    asked.iter().filter(known).filter_map(|scored| of(&scored)).collect()
}

/// Returns the median.
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

    fn case(asks: Asks, hidden: &[&str], verdict: RecordedVerdict, effects: &[&str]) -> Scored {
        let answer = Some(answer(verdict, effects));
        let cost = Cost { diagnosis: 2.0, rest: 1.0 };
        let record = CaseRecord { answer, cost, ..CaseRecord::of(String::new(), String::new()) };
        Scored::of(truth(asks, hidden), record).expect("the drive")
    }

    fn mark<'a>(score: &'a GauntletScore, start: &str) -> &'a AcceptanceCriterion {
        score.marks.iter().find(|mark| mark.demand.starts_with(start)).expect(start)
    }

    #[test]
    fn synthetic_answers_give_the_expected_score() {
        let mut all: Vec<Scored> =
            (0..19).map(|_| case(Asks::Effect, &["J1_coulomb"], RecordedVerdict::Named, &["J1_coulomb"])).collect();
        all.push(case(Asks::Effect, &["J1_coulomb"], RecordedVerdict::Named, &["J2_viscous"]));
        all.push(case(Asks::Null, &[], RecordedVerdict::NoEffect, &[]));
        all.push(case(Asks::Pair, &["J1_coulomb", "C2_lag"], RecordedVerdict::Named, &["J1_coulomb"]));
        let score = score(&all);
        let right = mark(&score, "right name at 4 s*");
        let share = right.share.expect("20 cases");
        assert_eq!((share.count, share.cases, right.status), (19, 20, DemandStatus::NotRefuted));
        assert!((share.interval.lo - 0.7513).abs() < 1e-3 && (share.interval.hi - 0.9987).abs() < 1e-3, "{share:?}");
        assert_eq!(mark(&score, "worst effect at 4 s*").share.expect("20").count, 19);
        assert_eq!(mark(&score, "wrong names, effect in").share.expect("21").count, 1);
        assert_eq!(mark(&score, "false alarms").status, DemandStatus::NotRefuted, "one case decides nothing");
        assert_eq!(mark(&score, "right name at 2 s*").status, DemandStatus::NoCases);
        assert!((score.calibration.error.expect("names") - (0.99 - 20.0 / 21.0)).abs() < 1e-9);
        assert_eq!(score.failures.iter().filter(|failure| failure.outcome == AnswerGrade::Wrong).count(), 1);
        assert_eq!((score.seconds, score.is_met()), ([44.0, 22.0], true));
    }

    #[test]
    fn ambiguous_list_is_right_only_where_the_oracle_is_inseparable() {
        let mut listed = case(Asks::Effect, &["J1_coulomb"], RecordedVerdict::Ambiguous, &["J2_viscous", "J1_coulomb"]);
        assert!(!listed.is_right());
        let rival = Some("J2_viscous".to_owned());
        listed.truth.hidden[0].scale = Some(crate::oracle::DetectionLimit { size: 1.0, inseparable: rival });
        assert!(listed.is_right());
    }

    #[test]
    fn ambiguous_answer_is_scored_again_after_its_experiment() {
        let listed = case(Asks::Effect, &["J1_coulomb"], RecordedVerdict::Ambiguous, &["J2_viscous", "J1_coulomb"]);
        let with = |after: &[&str]| {
            let after = after.iter().map(|id| answer(RecordedVerdict::Named, &[id])).collect();
            Scored::of(listed.truth.clone(), CaseRecord { after, ..listed.record.clone() }).expect("the drive")
        };
        let all = [listed.clone(), with(&["J1_coulomb"]), with(&["J2_viscous", "J1_coulomb"]), with(&["J2_viscous"])];
        let share = mark(&score(&all), "ambiguous answers").share.expect("three with an experiment");
        assert_eq!((share.count, share.cases), (2, 3));
    }
}
