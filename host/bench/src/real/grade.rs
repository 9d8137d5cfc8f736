//! Grades of answers in measured recordings, against the answer for the unchanged set.

use crate::outcome::causes;
use crate::real::trial::{PlantedEffect, RealRecord};
use crate::record::{NamedCause, RecordedAnswer, RecordedVerdict};
use serde::Serialize;
use softdock_kernels::effects::code;

/// Range of a size over the planted one, of an effect that the unchanged set has as well.
const SAME_SIZE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Grade of an answer against that for the unchanged set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RealGrade {
    /// The planted effects are named; without one, the answer is that for the unchanged set.
    Right,
    /// Ambiguous, with the planted effects in the list.
    Listed,
    /// Some of several planted effects, and nothing else.
    Partly,
    /// No cause is named, but a model error is reported for which the planted effects are possible causes.
    Possible,
    /// No cause is named, but a model error is reported.
    Abstained,
    /// No model error is reported.
    Missed,
    /// The recordings were rejected.
    Refused,
    /// A new cause that was not planted; without a planted effect, another answer.
    Wrong,
}

impl RealGrade {
    /// All grades with their words.
    pub const ALL: [(Self, &'static str); 8] = [
        (Self::Right, "right"),
        (Self::Listed, "listed"),
        (Self::Partly, "partly"),
        (Self::Possible, "possible"),
        (Self::Abstained, "abstained"),
        (Self::Missed, "missed"),
        (Self::Refused, "refused"),
        (Self::Wrong, "wrong"),
    ];
}

/// Named causes of an answer, in blocks with that verdict.
pub(super) fn named(answer: &RecordedAnswer) -> impl Iterator<Item = &NamedCause> {
    causes(answer, RecordedVerdict::Named).into_iter().flatten()
}

pub(super) fn is_effect(planted: &PlantedEffect, cause: &NamedCause) -> bool {
    (planted.block.is_empty() || planted.block == cause.block) && code(&planted.id) == code(&cause.id)
}

/// Same cause in another answer, with or without practical gain: of the unchanged set it is a property of the machine.
pub(super) fn same_in<'a>(other: &'a RecordedAnswer, cause: &NamedCause) -> Option<&'a NamedCause> {
    other.effects.iter().find(|own| own.block == cause.block && code(&own.id) == code(&cause.id))
}

/// Whether an answer leaves a cause possible: of the unchanged set, it may be a property of the machine.
fn is_possible(answer: &RecordedAnswer, id: &str, block: &str) -> bool {
    let is_own = |own: &(String, String)| code(&own.0) == code(id) && (block.is_empty() || own.1 == block);
    answer.possible.iter().any(is_own)
}

/// Grades the answer of a case with planted effects.
pub fn planted_grade(base: &RecordedAnswer, record: &RealRecord) -> RealGrade {
    let (answer, planted) = (&record.answer, &record.planted);
    if answer.verdict == RecordedVerdict::Refused {
        return RealGrade::Refused;
    }
    let is_new = |cause: &&NamedCause| same_in(base, cause).is_none() && !is_possible(base, &cause.id, &cause.block);
    let is_planted = |cause: &NamedCause| planted.iter().any(|own| is_effect(own, cause));
    if named(answer).filter(is_new).any(|cause| !is_planted(cause)) {
        return RealGrade::Wrong;
    }
    let found =
        planted.iter().filter(|own| named(answer).any(|cause| is_effect(own, cause) && has_size(base, own, cause)));
    let found = found.count();
    if found == planted.len() {
        return RealGrade::Right;
    }
    if found > 0 {
        return RealGrade::Partly;
    }
    let lists = |own: &PlantedEffect| answer.effects.iter().any(|cause| is_effect(own, cause));
    match answer.verdict {
        RecordedVerdict::Ambiguous if planted.iter().all(lists) => RealGrade::Listed,
        RecordedVerdict::ModelInadequate if planted.iter().all(|own| is_possible(answer, &own.id, &own.block)) => {
            RealGrade::Possible
        }
        RecordedVerdict::NoEffect | RecordedVerdict::NoPracticalEffect | RecordedVerdict::Named => RealGrade::Missed,
        _ => RealGrade::Abstained,
    }
}

/// Whether an effect that the unchanged set has as well has changed by about the planted size.
fn has_size(base: &RecordedAnswer, planted: &PlantedEffect, cause: &NamedCause) -> bool {
    let Some(own) = same_in(base, cause) else { return true };
    let value = |cause: &NamedCause| cause.parameters.get(&planted.field).map(|estimate| estimate.value);
    match (value(own), value(cause), planted.size) {
        (Some(before), Some(after), Some(size)) => SAME_SIZE.contains(&((after - before) / size)),
        _ => true,
    }
}

/// Grades the answer of a case without a planted effect.
pub fn untouched_grade(base: &RecordedAnswer, answer: &RecordedAnswer) -> RealGrade {
    let verdicts = |answer: &RecordedAnswer| answer.blocks.clone();
    let ids = |answer: &RecordedAnswer| {
        let mut all: Vec<(String, String)> =
            answer.effects.iter().map(|cause| (cause.block.clone(), cause.id.clone())).collect();
        all.sort();
        all
    };
    let held = |cause: &NamedCause| {
        let Some(other) = same_in(answer, cause) else { return false };
        cause.parameters.iter().all(|(name, own)| {
            other.parameters.get(name).is_some_and(|other| own.lo <= other.value && other.value <= own.hi)
        })
    };
    if answer.verdict == RecordedVerdict::Refused && base.verdict != RecordedVerdict::Refused {
        return RealGrade::Refused;
    }
    match verdicts(base) == verdicts(answer) && ids(base) == ids(answer) && base.effects.iter().all(held) {
        true => RealGrade::Right,
        false => RealGrade::Wrong,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::RecordedEstimate;
    use std::collections::BTreeMap;

    fn cause(id: &str, field: &str, value: f64) -> NamedCause {
        let estimate = RecordedEstimate { value, lo: value - 1.0, hi: value + 1.0, sd: 0.5, nominal: 0.0 };
        let parameters = BTreeMap::from([(field.to_owned(), estimate)]);
        NamedCause { id: id.to_owned(), block: "R3".to_owned(), p: 0.99, parameters }
    }

    fn answer(verdict: RecordedVerdict, effects: &[NamedCause]) -> RecordedAnswer {
        RecordedAnswer {
            verdict,
            effects: effects.to_vec(),
            possible: Vec::new(),
            blocks: vec![("R3".to_owned(), verdict)],
            partner_missing: false,
            experiment: None,
            gain: None,
            gain_elsewhere: None,
            refusal: None,
        }
    }

    fn record(answer: RecordedAnswer, planted: &[(&str, &str, f64)]) -> RealRecord {
        let of = |(id, field, size): &(&str, &str, f64)| PlantedEffect {
            id: (*id).to_owned(),
            block: String::new(),
            field: (*field).to_owned(),
            size: Some(*size),
            on_nominal: false,
        };
        let (case, set) = ("set.planted".to_owned(), "set".to_owned());
        RealRecord {
            case,
            set,
            planted: planted.iter().map(of).collect(),
            answer,
            unexplained: BTreeMap::new(),
            seconds: 1.0,
        }
    }

    #[test]
    fn planted_effects_are_graded_against_the_unchanged_set() {
        use RecordedVerdict::{Ambiguous, Named, NoEffect, NotInLibrary};
        let (friction, spring) =
            (cause("J1_coulomb", "coulomb", 8.0), cause("J17_cable_drag", "cable_stiffness", 40.0));
        let nothing = answer(NoEffect, &[]);
        let planted = [("J1_coulomb", "coulomb", 8.0)];
        let grade = |base: &RecordedAnswer, verdict, effects: &[NamedCause]| {
            planted_grade(base, &record(answer(verdict, effects), &planted))
        };
        assert_eq!(grade(&nothing, Named, std::slice::from_ref(&friction)), RealGrade::Right);
        assert_eq!(grade(&nothing, Named, &[friction.clone(), spring.clone()]), RealGrade::Wrong);
        assert_eq!(grade(&nothing, Named, std::slice::from_ref(&spring)), RealGrade::Wrong);
        assert_eq!(grade(&nothing, Ambiguous, &[friction.clone(), spring.clone()]), RealGrade::Listed);
        assert_eq!(grade(&nothing, NotInLibrary, &[]), RealGrade::Abstained);
        assert_eq!(grade(&nothing, NoEffect, &[]), RealGrade::Missed);
        // What an inadequate model leaves possible is no answer; of the unchanged set it is no false name.
        let open = |possible: &str| RecordedAnswer {
            possible: vec![(possible.to_owned(), "R3".to_owned())],
            ..answer(RecordedVerdict::ModelInadequate, &[])
        };
        let left = |possible: &str| planted_grade(&nothing, &record(open(possible), &planted));
        assert_eq!((left("J1_coulomb"), left("J17_cable_drag")), (RealGrade::Possible, RealGrade::Abstained));
        let both = [friction.clone(), spring.clone()];
        assert_eq!(grade(&open("J17_cable_drag"), Named, &both), RealGrade::Right);
        assert_eq!(grade(&open("J9_torque_ripple"), Named, &both), RealGrade::Wrong);
        // What the unchanged set has as well is no false name, and must change by the planted size.
        let with_spring = answer(Named, std::slice::from_ref(&spring));
        assert_eq!(grade(&with_spring, Named, &[friction.clone(), spring.clone()]), RealGrade::Right);
        assert_eq!(grade(&with_spring, Named, std::slice::from_ref(&spring)), RealGrade::Missed);
        let with_friction = answer(Named, &[cause("J1_coulomb", "coulomb", 7.0)]);
        assert_eq!(grade(&with_friction, Named, std::slice::from_ref(&friction)), RealGrade::Missed);
        assert_eq!(grade(&with_friction, Named, &[cause("J1_coulomb", "coulomb", 15.5)]), RealGrade::Right);
    }

    #[test]
    fn untouched_set_keeps_its_causes_and_values() {
        let base = answer(RecordedVerdict::Named, &[cause("J1_coulomb", "coulomb", 8.0)]);
        let of = |value| answer(RecordedVerdict::Named, &[cause("J1_coulomb", "coulomb", value)]);
        assert_eq!(untouched_grade(&base, &of(8.5)), RealGrade::Right);
        assert_eq!(untouched_grade(&base, &of(10.0)), RealGrade::Wrong);
        assert_eq!(untouched_grade(&base, &answer(RecordedVerdict::NoEffect, &[])), RealGrade::Wrong);
    }
}
