//! Grade of an answer against the truth.

use crate::parameters::is_about;
use crate::plan::MachineKind;
use crate::plant::GauntletPlant;
use crate::record::{NamedCause, RecordedAnswer, RecordedVerdict};
use crate::seal::{Asks, SealedTruth};
use serde::Serialize;
use softdock_kernels::effects::{GROUPS, share_group};

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
    /// Only perturbations of the machine, each at about its true size, as named or as ambiguous.
    Perturbation,
    /// Reported as outside the library.
    NotInLibrary,
    /// The model is reported as inadequate, or the verdict is withheld.
    Abstained,
    /// Reported as without practical effect.
    NotPractical,
    /// No effect reported.
    Missed,
    /// The recordings were rejected.
    Refused,
    /// A false name, or a list without the truth; where nothing is hidden in an exact machine, any finding.
    Wrong,
}

impl AnswerGrade {
    /// All grades.
    pub const ALL: [Self; 11] = [
        Self::Right,
        Self::Listed,
        Self::Partly,
        Self::Partner,
        Self::Perturbation,
        Self::NotInLibrary,
        Self::Abstained,
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
            Self::Perturbation => "perturbation",
            Self::NotInLibrary => "not in library",
            Self::Abstained => "abstained",
            Self::NotPractical => "not practical",
            Self::Missed => "missed",
            Self::Refused => "refused",
            Self::Wrong => "wrong",
        }
    }
}

/// Grades an answer.
pub fn outcome(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    use RecordedVerdict as Verdict;
    match (truth.asks, answer.verdict) {
        (_, Verdict::Refused) => AnswerGrade::Refused,
        (Asks::Null, Verdict::NoEffect) => AnswerGrade::Right,
        (_, Verdict::NoPracticalEffect) => AnswerGrade::NotPractical,
        (Asks::Null, _) if truth.machine == MachineKind::Exact => AnswerGrade::Wrong,
        (_, Verdict::NoEffect) => AnswerGrade::Missed,
        (_, Verdict::Withheld) => AnswerGrade::Abstained,
        _ if truth.machine == MachineKind::Perturbed => by_blocks(plant, truth, answer),
        (_, verdict) if verdict.is_open() && names_falsely(plant, truth, answer) => AnswerGrade::Wrong,
        (Asks::Outside | Asks::LeftOut, verdict) if verdict.is_open() => AnswerGrade::Right,
        (_, Verdict::NotInLibrary | Verdict::ModelInadequate) => open(answer),
        // An effect excluded from the library cannot be named.
        (Asks::LeftOut, Verdict::Named) => AnswerGrade::Wrong,
        (_, Verdict::Named) => named(plant, truth, answer),
        (_, Verdict::Ambiguous) => ambiguous(plant, truth, answer),
    }
}

/// Grade of a model error without a cause.
fn open(answer: &RecordedAnswer) -> AnswerGrade {
    if answer.verdict == RecordedVerdict::NotInLibrary { AnswerGrade::NotInLibrary } else { AnswerGrade::Abstained }
}

/// Grades an answer for a perturbed machine, block by block: every block has a model error, so that its verdict is
/// independent of the others. A cause is true if it is hidden, or a perturbation at about its true size.
fn by_blocks(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    let lists = causes(answer, RecordedVerdict::Ambiguous);
    let is_false = |list: &Vec<&NamedCause>| !list.iter().any(|cause| is_true(plant, truth, cause));
    if names_falsely(plant, truth, answer) || lists.iter().any(is_false) {
        return AnswerGrade::Wrong;
    }
    let named = causes(answer, RecordedVerdict::Named).concat();
    let all = [named.clone(), lists.concat()].concat();
    let count = |found: &[&NamedCause]| {
        let is_found = |hidden: &str| found.iter().any(|cause| plant.is_right(hidden, &cause.id));
        truth.hidden.iter().filter(|hidden| is_found(&hidden.id)).count()
    };
    match (truth.hidden.len(), count(&named), count(&all)) {
        (1.., own, _) if own == truth.hidden.len() => AnswerGrade::Right,
        (1.., _, own) if own == truth.hidden.len() => AnswerGrade::Listed,
        (_, _, 1..) => AnswerGrade::Partly,
        _ if !all.is_empty() => AnswerGrade::Perturbation,
        _ => open(answer),
    }
}

/// Returns the causes of each block with a verdict.
pub(crate) fn causes(answer: &RecordedAnswer, verdict: RecordedVerdict) -> Vec<Vec<&NamedCause>> {
    let blocks = answer.blocks.iter().filter(|(_, own)| *own == verdict);
    blocks.map(|(block, _)| answer.effects.iter().filter(|effect| effect.block == *block).collect()).collect()
}

/// Returns whether a cause is a hidden effect, or a perturbation of the machine at about its true size.
fn is_true(plant: &GauntletPlant, truth: &SealedTruth, found: &NamedCause) -> bool {
    let is_hidden = truth.hidden.iter().any(|hidden| plant.is_right(&hidden.id, &found.id));
    let mut perturbations = truth.perturbations.iter().filter(|own| plant.is_right(&own.id, &found.id));
    is_hidden || perturbations.any(|own| is_about(plant, truth, own, found))
}

/// Returns whether any block names an effect that is not there.
fn names_falsely(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> bool {
    causes(answer, RecordedVerdict::Named).iter().flatten().any(|cause| !is_true(plant, truth, cause))
}

fn named(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> AnswerGrade {
    let is_found = |hidden: &str| answer.effects.iter().any(|effect| plant.is_right(hidden, &effect.id));
    if answer.effects.iter().any(|effect| !is_true(plant, truth, effect)) {
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
    GROUPS.iter().any(|group| group.has(hidden) && proposed.contains(group.splits))
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
            machine: MachineKind::Exact,
            asks,
            multiple: 4.0,
            seed: 1,
            hidden: hidden.iter().map(of).collect(),
            perturbations: Vec::new(),
            nuisances: Vec::new(),
        }
    }

    pub(crate) fn answer(verdict: RecordedVerdict, effects: &[&str]) -> RecordedAnswer {
        let block = |id: &str| PLANTS[0].block(id).to_owned();
        let of =
            |id: &&str| NamedCause { id: (*id).to_owned(), block: block(id), p: 0.99, parameters: Default::default() };
        let effects: Vec<NamedCause> = effects.iter().map(of).collect();
        let has = |block: &str| effects.iter().any(|effect| effect.block == block);
        let [commands, motion] = ["R2 reference to torque", "R3 torque to motion"];
        let own = |is_found: bool| if is_found { verdict } else { RecordedVerdict::NoEffect };
        let blocks = vec![
            (commands.to_owned(), own(has(commands))),
            (motion.to_owned(), own(has(motion) || effects.is_empty())),
        ];
        RecordedAnswer {
            verdict,
            effects,
            possible: Vec::new(),
            blocks,
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
    fn perturbation_at_its_size_is_no_wrong_name_and_an_abstention_is_neither() {
        use AnswerGrade::{Abstained, Listed, Missed, NotInLibrary, Partly, Perturbation, Right, Wrong};
        let perturbation = |id: &str| Hidden { id: id.to_owned(), scale: None, parameters: Vec::new() };
        let grade = |asks, hidden: &[&str], verdict, effects: &[&str]| {
            let mut truth = truth(asks, hidden);
            truth.machine = MachineKind::Perturbed;
            truth.perturbations = vec![perturbation("J6_warm_up"), perturbation("friction_map")];
            outcome(&PLANTS[0], &truth, &answer(verdict, effects))
        };
        let null = |verdict, effects: &[&str]| grade(Asks::Null, &[], verdict, effects);
        assert_eq!(null(RecordedVerdict::NoEffect, &[]), Right);
        assert_eq!(null(RecordedVerdict::NotInLibrary, &[]), NotInLibrary);
        assert_eq!(null(RecordedVerdict::ModelInadequate, &[]), Abstained);
        assert_eq!(null(RecordedVerdict::Named, &["J6_temperature"]), Perturbation);
        assert_eq!(null(RecordedVerdict::Ambiguous, &["J2_viscous", "J6_temperature"]), Perturbation);
        assert_eq!(null(RecordedVerdict::Named, &["J2_viscous"]), Wrong);
        assert_eq!(null(RecordedVerdict::Ambiguous, &["J2_viscous"]), Wrong);
        let one = |verdict, effects: &[&str]| grade(Asks::Effect, &["C2_lag"], verdict, effects);
        assert_eq!(one(RecordedVerdict::Named, &["C2_lag", "J6_temperature"]), Right);
        assert_eq!(one(RecordedVerdict::Named, &["J6_temperature"]), Perturbation);
        assert_eq!(one(RecordedVerdict::Named, &["C2_lag", "J2_viscous"]), Wrong);
        assert_eq!(one(RecordedVerdict::Ambiguous, &["C2_lag", "C1_delay"]), Listed);
        assert_eq!(one(RecordedVerdict::Withheld, &[]), Abstained);
        assert_eq!(one(RecordedVerdict::NoEffect, &[]), Missed);
        let mut beside = answer(RecordedVerdict::Ambiguous, &["J6_temperature", "C2_lag", "C1_delay"]);
        beside.blocks = [(0, RecordedVerdict::Ambiguous), (1, RecordedVerdict::Named)]
            .map(|(place, verdict)| (beside.blocks[place].0.clone(), verdict))
            .to_vec();
        let mut truth = truth(Asks::Effect, &["J6_warm_up"]);
        truth.machine = MachineKind::Perturbed;
        truth.perturbations = vec![perturbation("C2_lag")];
        assert_eq!(outcome(&PLANTS[0], &truth, &beside), Right, "an ambiguous perturbation in another block");
        truth.perturbations.clear();
        assert_eq!(outcome(&PLANTS[0], &truth, &beside), Wrong, "a list without a true cause in another block");
        let both = grade(Asks::Pair, &["C2_lag", "J1_coulomb"], RecordedVerdict::Named, &["C2_lag", "J6_temperature"]);
        assert_eq!(both, Partly);
    }

    #[test]
    fn inadequate_model_is_an_abstention_and_an_alarm_where_nothing_is_hidden_in_an_exact_machine() {
        let verdict = RecordedVerdict::ModelInadequate;
        assert_eq!(worth(Asks::Effect, &["J1_coulomb"], verdict, &[]), AnswerGrade::Abstained);
        assert_eq!(worth(Asks::Outside, &["quadratic_drag"], verdict, &[]), AnswerGrade::Right);
        assert_eq!(worth(Asks::Null, &[], verdict, &[]), AnswerGrade::Wrong);
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
