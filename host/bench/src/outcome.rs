//! Grade of an answer against the truth.

use crate::plant::GauntletPlant;
use crate::record::{RecordedAnswer, RecordedVerdict};
use crate::seal::{Asks, SealedTruth};
use serde::Serialize;
use softdock_kernels::effects::{GROUPS, code, share_group};

/// Grade of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AnswerGrade {
    /// The truth, or no effect where nothing is hidden.
    Right,
    /// Ambiguous, with the truth in the list.
    Listed,
    /// Some of several hidden effects, and no false one.
    Partly,
    /// A confounded partner of the excluded effect, as ambiguous, with the discriminating experiment.
    Partner,
    /// Reported as outside the library.
    NotInLibrary,
    /// Reported as without practical effect.
    NotPractical,
    /// No effect reported.
    Missed,
    /// The recordings were rejected.
    Refused,
    /// A false name, or a list without the truth; where nothing is hidden, any finding.
    Wrong,
}

impl AnswerGrade {
    /// All grades.
    pub const ALL: [Self; 9] = [
        Self::Right,
        Self::Listed,
        Self::Partly,
        Self::Partner,
        Self::NotInLibrary,
        Self::NotPractical,
        Self::Missed,
        Self::Refused,
        Self::Wrong,
    ];

    /// Returns the name of the grade.
    pub fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Listed => "listed",
            Self::Partly => "partly",
            Self::Partner => "partner",
            Self::NotInLibrary => "not in library",
            Self::NotPractical => "not practical",
            Self::Missed => "missed",
            Self::Refused => "refused",
            Self::Wrong => "wrong",
        }
    }
}

/// Grades an answer.
pub fn outcome(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    match (truth.asks, answer.verdict) {
        (_, RecordedVerdict::Refused) => AnswerGrade::Refused,
        (Asks::Null, RecordedVerdict::NoEffect) => AnswerGrade::Right,
        (_, RecordedVerdict::NoPracticalEffect) => AnswerGrade::NotPractical,
        (Asks::Null, _) => AnswerGrade::Wrong,
        (_, RecordedVerdict::NoEffect) => AnswerGrade::Missed,
        (_, RecordedVerdict::NotInLibrary) if names_falsely(plant, truth, answer) => AnswerGrade::Wrong,
        (Asks::Outside | Asks::LeftOut, RecordedVerdict::NotInLibrary) => AnswerGrade::Right,
        (_, RecordedVerdict::NotInLibrary) => AnswerGrade::NotInLibrary,
        // An effect excluded from the library cannot be named.
        (Asks::LeftOut, RecordedVerdict::Named) => AnswerGrade::Wrong,
        (_, RecordedVerdict::Named) => named(plant, truth, answer),
        (_, RecordedVerdict::Ambiguous) => ambiguous(plant, truth, answer),
    }
}

/// Returns whether any block names an effect that is not hidden.
fn names_falsely(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> bool {
    let is_named =
        |block: &str| answer.blocks.iter().any(|(own, verdict)| own == block && *verdict == RecordedVerdict::Named);
    let is_true = |id: &str| truth.hidden.iter().any(|hidden| plant.is_right(&hidden.id, id));
    answer.effects.iter().any(|effect| is_named(&effect.block) && !is_true(&effect.id))
}

fn named(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    let is_true = |id: &str| truth.hidden.iter().any(|hidden| plant.is_right(&hidden.id, id));
    let is_found = |hidden: &str| answer.effects.iter().any(|effect| plant.is_right(hidden, &effect.id));
    if answer.effects.iter().any(|effect| !is_true(&effect.id)) {
        return AnswerGrade::Wrong;
    }
    match truth.hidden.iter().all(|hidden| is_found(&hidden.id)) {
        true => AnswerGrade::Right,
        false => AnswerGrade::Partly,
    }
}

fn ambiguous(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    let lists = |hidden: &str| answer.effects.iter().any(|effect| plant.is_right(hidden, &effect.id));
    if truth.hidden.iter().all(|hidden| lists(&hidden.id)) {
        return AnswerGrade::Listed;
    }
    let partner = |hidden: &str| {
        let relative = answer.effects.iter().any(|effect| share_group(hidden, &effect.id));
        relative
            && answer.partner_missing
            && answer.experiment.as_ref().is_some_and(|proposed| splits(hidden, proposed))
    };
    match truth.asks == Asks::LeftOut && truth.hidden.iter().any(|hidden| partner(&hidden.id)) {
        true => AnswerGrade::Partner,
        false => AnswerGrade::Wrong,
    }
}

/// Returns whether a proposed experiment is that of a group of the effect.
fn splits(hidden: &str, proposed: &str) -> bool {
    let has = |members: &[&str]| members.iter().any(|member| code(member) == code(hidden));
    GROUPS.iter().any(|group| has(group.members) && proposed.contains(group.splits))
}

/// Returns whether all findings are in blocks with a hidden effect; `None` without findings or hidden effects.
pub fn block_is_right(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> Option<bool> {
    let hidden: Vec<&str> = truth.hidden.iter().map(|hidden| plant.block(&hidden.id)).collect();
    let found = answer.blocks.iter().filter(|(_, verdict)| *verdict >= RecordedVerdict::NoPracticalEffect);
    let found: Vec<&str> = found.map(|(block, _)| block.as_str()).collect();
    (!hidden.is_empty() && !found.is_empty()).then(|| found.iter().all(|block| hidden.contains(block)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::plant::PLANTS;
    use crate::record::NamedCause;
    use crate::seal::Hidden;

    pub(crate) fn truth(asks: Asks, hidden: &[&str]) -> SealedTruth {
        let of = |id: &&str| Hidden { id: (*id).to_owned(), scale: None, parameters: Vec::new() };
        SealedTruth {
            case: String::new(),
            plant: "drive".to_owned(),
            asks,
            multiple: 4.0,
            seed: 1,
            hidden: hidden.iter().map(of).collect(),
            nuisances: Vec::new(),
        }
    }

    pub(crate) fn answer(verdict: RecordedVerdict, effects: &[&str]) -> RecordedAnswer {
        let block = |id: &str| PLANTS[0].block(id).to_owned();
        let of =
            |id: &&str| NamedCause { id: (*id).to_owned(), block: block(id), p: 0.99, parameters: Default::default() };
        RecordedAnswer {
            verdict,
            effects: effects.iter().map(of).collect(),
            blocks: vec![
                ("R2 reference to torque".to_owned(), RecordedVerdict::NoEffect),
                ("R3 torque to motion".to_owned(), verdict),
            ],
            partner_missing: false,
            experiment: None,
            gain: None,
            gain_elsewhere: None,
            refusal: None,
        }
    }

    fn worth(asks: Asks, hidden: &[&str], verdict: RecordedVerdict, effects: &[&str]) -> AnswerGrade {
        outcome(&PLANTS[0], &truth(asks, hidden), &answer(verdict, effects))
    }

    #[test]
    fn names_match_by_catalogue_number() {
        use AnswerGrade::{Listed, Missed, NotInLibrary, NotPractical, Partly, Right, Wrong};
        let named = |hidden: &[&str], effects: &[&str]| worth(Asks::Effect, hidden, RecordedVerdict::Named, effects);
        assert_eq!(named(&["J6_warm_up"], &["J6_temperature"]), Right);
        assert_eq!(named(&["J1_coulomb"], &["J18_drive_offset"]), Wrong, "J1 is not the beginning of J18");
        assert_eq!(named(&["J1_coulomb"], &["J1_coulomb", "J2_viscous"]), Wrong);
        assert_eq!(named(&["J1_coulomb", "C2_lag"], &["C2_lag"]), Partly);
        assert_eq!(named(&["J1_coulomb", "C2_lag"], &["C2_lag", "J1_coulomb"]), Right);
        let grade = |verdict, effects: &[&str]| worth(Asks::Effect, &["J1_coulomb"], verdict, effects);
        assert_eq!(grade(RecordedVerdict::Ambiguous, &["J2_viscous", "J1_coulomb"]), Listed);
        assert_eq!(grade(RecordedVerdict::Ambiguous, &["J2_viscous"]), Wrong);
        assert_eq!(grade(RecordedVerdict::NotInLibrary, &[]), NotInLibrary);
        assert_eq!(grade(RecordedVerdict::NoEffect, &[]), Missed);
        assert_eq!(grade(RecordedVerdict::NoPracticalEffect, &["J1_coulomb"]), NotPractical);
        assert_eq!(worth(Asks::Null, &[], RecordedVerdict::NoEffect, &[]), Right);
        assert_eq!(worth(Asks::Null, &[], RecordedVerdict::NotInLibrary, &[]), Wrong);
    }

    #[test]
    fn confounded_partner_with_experiment_counts_for_a_form_outside_the_library() {
        assert_eq!(worth(Asks::Outside, &["quadratic_drag"], RecordedVerdict::NotInLibrary, &[]), AnswerGrade::Right);
        assert_eq!(
            worth(Asks::Outside, &["quadratic_drag"], RecordedVerdict::Named, &["J2_viscous"]),
            AnswerGrade::Wrong
        );
        assert_eq!(
            worth(Asks::Outside, &["stribeck_squared"], RecordedVerdict::Named, &["J3_stribeck"]),
            AnswerGrade::Right
        );
        assert_eq!(worth(Asks::LeftOut, &["S7_noise"], RecordedVerdict::Named, &["S7_noise"]), AnswerGrade::Wrong);
        let truth = truth(Asks::LeftOut, &["J14_payload"]);
        let mut relative = answer(RecordedVerdict::Ambiguous, &["J15_link_inertia"]);
        assert_eq!(outcome(&PLANTS[0], &truth, &relative), AnswerGrade::Wrong);
        relative.partner_missing = true;
        let scale = GROUPS.iter().find(|group| group.id == "G5").expect("a group");
        relative.experiment = Some(scale.splits.to_owned());
        assert_eq!(outcome(&PLANTS[0], &truth, &relative), AnswerGrade::Partner);
    }

    #[test]
    fn false_name_in_a_block_is_wrong_despite_not_in_library_in_another() {
        let mut answer = answer(RecordedVerdict::NotInLibrary, &["C2_lag"]);
        assert_eq!(outcome(&PLANTS[0], &truth(Asks::Effect, &["C6_hold"]), &answer), AnswerGrade::NotInLibrary);
        answer.blocks[0].1 = RecordedVerdict::Named;
        assert_eq!(outcome(&PLANTS[0], &truth(Asks::Effect, &["C6_hold"]), &answer), AnswerGrade::Wrong);
        assert_eq!(outcome(&PLANTS[0], &truth(Asks::Effect, &["C2_lag"]), &answer), AnswerGrade::NotInLibrary);
    }

    #[test]
    fn finding_in_another_block_is_in_the_wrong_block() {
        let right = |hidden: &str| {
            block_is_right(
                &PLANTS[0],
                &truth(Asks::Effect, &[hidden]),
                &answer(RecordedVerdict::Named, &["J1_coulomb"]),
            )
        };
        assert_eq!((right("J1_coulomb"), right("C2_lag")), (Some(true), Some(false)));
        let nothing = answer(RecordedVerdict::NoEffect, &[]);
        assert_eq!(block_is_right(&PLANTS[0], &truth(Asks::Effect, &["J1_coulomb"]), &nothing), None);
    }
}
