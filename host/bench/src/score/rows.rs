//! Grades by hidden effect and size, and the suboptimal answers.

use super::{Scored, median};
use crate::outcome::AnswerGrade;
use crate::plan::MachineKind;
use crate::plant::{PLANTS, order};
use crate::record::{RecordedAnswer, RecordedVerdict};
use crate::seal::{Asks, Hidden, SealedTruth};
use serde::Serialize;
use std::collections::BTreeMap;

/// Grades of a hidden effect at a size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Plant.
    pub plant: String,
    /// Machine.
    pub machine: MachineKind,
    /// Task.
    pub asks: Asks,
    /// Hidden effects.
    pub hidden: String,
    /// Size, in multiples of the detection limit.
    pub multiple: f64,
    /// Cases with an answer.
    pub cases: usize,
    /// Cases with the best possible answer.
    pub right: usize,
    /// Cases by grade.
    pub outcomes: BTreeMap<AnswerGrade, usize>,
    /// Cases beyond the range of the generator.
    pub unasked: usize,
    /// Median detection limit, in the effect's unit.
    pub scale: Option<f64>,
    /// Rival that is confounded at every size.
    pub inseparable: Option<String>,
    /// Cases by answer.
    pub answers: BTreeMap<String, usize>,
}

/// Case with a suboptimal answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The case.
    pub case: String,
    /// Its seed.
    pub seed: u64,
    /// Hidden effects and perturbations with sizes and units.
    pub hidden: String,
    /// Answers, including those after proposed experiments.
    pub answered: String,
    /// Grade.
    pub outcome: AnswerGrade,
}

/// Outcomes by plant, task, what was hidden, and size.
pub(super) fn rows(all: &[Scored]) -> Vec<Row> {
    let mut groups: BTreeMap<_, Vec<&Scored>> = BTreeMap::new();
    for scored in all {
        let place = PLANTS.iter().position(|plant| plant.name == scored.plant.name);
        let truth = &scored.truth;
        let effects: Vec<_> = truth.hidden.iter().map(|hidden| order(&hidden.id)).collect();
        // Positive numbers are ordered as their bits.
        groups.entry((place, truth.machine, truth.asks, effects, truth.multiple.to_bits())).or_default().push(scored);
    }
    groups.into_values().map(|own| row(&own)).collect()
}

/// Cases that hide the same in the same size.
fn row(own: &[&Scored]) -> Row {
    let truth = &own[0].truth;
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
        machine: truth.machine,
        asks: truth.asks,
        hidden: hidden(truth),
        multiple: truth.multiple,
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
fn hidden(truth: &SealedTruth) -> String {
    truth.hidden.iter().map(|hidden| hidden.id.as_str()).collect::<Vec<_>>().join(" + ")
}

/// What is answered, in short.
fn answered(answer: &RecordedAnswer) -> String {
    let names = |joint: &str| answer.effects.iter().map(|effect| effect.id.as_str()).collect::<Vec<_>>().join(joint);
    match answer.verdict {
        RecordedVerdict::Refused => "refused".to_owned(),
        RecordedVerdict::NoEffect => "no effect".to_owned(),
        RecordedVerdict::Withheld => "withheld".to_owned(),
        RecordedVerdict::NoPracticalEffect => "no practical effect".to_owned(),
        RecordedVerdict::Named => names(" + "),
        RecordedVerdict::Ambiguous => names(" or "),
        verdict => {
            let open = if verdict == RecordedVerdict::NotInLibrary { "not in library" } else { "model inadequate" };
            if answer.effects.is_empty() { open.to_owned() } else { format!("{}; {open}", names(" + ")) }
        }
    }
}

/// Returns the failure of a case: a suboptimal answer at a detectable size, or a wrong name at any size.
pub(super) fn failure(scored: &Scored) -> Option<Failure> {
    let (outcome, answer) = (scored.outcome?, scored.answer()?);
    let detectable = match scored.truth.asks {
        Asks::Null | Asks::Pair => true,
        Asks::Effect => scored.truth.multiple >= 2.0,
        Asks::Outside | Asks::LeftOut => scored.truth.multiple >= 16.0,
    };
    let failed = outcome == AnswerGrade::Wrong || (detectable && !scored.is_right());
    let first = answer.refusal.clone().unwrap_or_else(|| answered(answer));
    let all = std::iter::once(first).chain(scored.record.after.iter().map(answered));
    failed.then(|| Failure {
        case: scored.truth.case.clone(),
        seed: scored.truth.seed,
        hidden: sized(&scored.truth),
        answered: all.collect::<Vec<_>>().join(", then "),
        outcome,
    })
}

/// What is hidden, with sizes.
fn sized(truth: &SealedTruth) -> String {
    let of = |hidden: &Hidden| {
        let size = hidden.parameters.first().map(|size| format!(" {:.4e} {}", size.value, size.unit));
        format!("{}{}", hidden.id, size.unwrap_or_default().trim_end())
    };
    let list = |all: &[Hidden]| all.iter().map(of).collect::<Vec<_>>().join(" + ");
    let hidden = if truth.hidden.is_empty() { "nothing".to_owned() } else { list(&truth.hidden) };
    if truth.perturbations.is_empty() {
        hidden
    } else {
        format!("{hidden}; perturbed by {}", list(&truth.perturbations))
    }
}
