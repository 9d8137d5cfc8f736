//! Starts of the fits: the most promising forms of each hypothesis, with nuisance parameters that may absorb it.

use crate::inference::bank::{Bank, Scores, SignatureEntry};
use crate::inference::evidence::greatest_nuisance_deviation;
use crate::inference::fit::{Fitted, Start};
use crate::inference::judge::CLAMP;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::{Role, Unknown};

/// Starts of a hypothesis that are fitted.
const STARTS: usize = 3;
/// z-score in the null hypothesis above which a nuisance parameter may have absorbed an effect.
const SUSPECT: f64 = 2.0;

/// Returns the free parameters of hypotheses with the remaining nuisance parameters, nuisance parameters first.
pub(crate) fn unknowns(block: &MeasuredBlock, hypotheses: &[&Hypothesis]) -> Vec<Unknown> {
    let own: Vec<&Unknown> = hypotheses.iter().flat_map(|hypothesis| &hypothesis.unknowns).collect();
    let left = |nuisance: &&Unknown| own.iter().all(|unknown| unknown.field != nuisance.field);
    block.nuisances.iter().filter(left).chain(own.iter().copied()).cloned().collect()
}

/// The most promising forms of every hypothesis, each at its best size.
pub(super) fn starts(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    bank: &Bank,
    scores: &Scores,
    null: &Fitted,
) -> Vec<Start> {
    let mut starts = Vec::new();
    for (number, hypothesis) in library.iter().enumerate() {
        let unknowns = unknowns(block, &[hypothesis]);
        for (entry, multiples) in best_entries(bank, scores, number).into_iter().take(STARTS) {
            let nuisances = &unknowns[..unknowns.len() - hypothesis.unknowns.len()];
            for mut z in first_nuisances(nuisances, null) {
                z.extend(sized(hypothesis, entry, &multiples));
                starts.push(Start::new(number, unknowns.clone(), z).beside(null));
            }
        }
    }
    starts
}

/// Returns the initial nuisance parameters beside an effect: those of the null hypothesis, except for suspect ones,
/// which may have absorbed the effect. They start on either side of nominal, because an early and a late clock match
/// different neighbours of each stamp.
fn first_nuisances(nuisances: &[Unknown], null: &Fitted) -> Vec<Vec<f64>> {
    let Some((shifted, _)) = greatest_nuisance_deviation(null).filter(|z| z.1.abs() > SUSPECT) else {
        return vec![carried(nuisances, null)];
    };
    let beside = |side: f64| nuisances.iter().map(|own| if own.name == shifted { side } else { 0.0 }).collect();
    vec![beside(-1.0), beside(1.0)]
}

/// Entries of a hypothesis with the best multiples of their sizes, the most promising first.
pub(crate) fn best_entries<'b>(bank: &'b Bank, scores: &Scores, number: usize) -> Vec<(&'b SignatureEntry, Vec<f64>)> {
    let own = bank.entries().iter().filter(|entry| entry.hypothesis == number);
    let mut found: Vec<_> = own.map(|entry| (entry, entry.best(scores))).collect();
    found.sort_by(|a, b| b.1.0.total_cmp(&a.1.0));
    found.into_iter().map(|(entry, (_, multiples))| (entry, multiples)).collect()
}

/// Where free numbers stand in another fit, none beyond what is plausible; 0 if it does not have them.
pub(crate) fn carried(unknowns: &[Unknown], from: &Fitted) -> Vec<f64> {
    unknowns
        .iter()
        .map(|unknown| from.place(unknown.field).map_or(0.0, |place| from.z[place].clamp(-CLAMP, CLAMP)))
        .collect()
}

/// First `z` of free numbers whose values are those of another fit, however far that has gone; 0 if it does not have them.
pub(crate) fn taken(unknowns: &[Unknown], from: &Fitted) -> Vec<f64> {
    let of = |Unknown { field, prior, .. }: &Unknown| match from.value(*field) {
        Some(value) => prior.allowed(prior.place(value)),
        None => 0.0,
    };
    unknowns.iter().map(of).collect()
}

/// First `z` of a hypothesis' free numbers by an entry of the bank.
pub(crate) fn sized(hypothesis: &Hypothesis, entry: &SignatureEntry, multiples: &[f64]) -> Vec<f64> {
    let of = |(i, unknown): (usize, &Unknown)| {
        let z = entry.form[i];
        let multiple = hypothesis.sizes.iter().position(|size| *size == i).map_or(1.0, |k| multiples[k]);
        match unknown.role == Role::Size && multiple.abs() < 0.05 {
            true => 0.05 * z,
            false => (z * multiple).clamp(-30.0, 30.0),
        }
    };
    hypothesis.unknowns.iter().enumerate().map(of).collect()
}
