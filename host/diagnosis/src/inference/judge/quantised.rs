//! Effects in addition to the quantisation of a reading, from the residual beyond the quantisation step.

use crate::inference::combine::{Set, price};
use crate::inference::dead_zone::DeadZone;
use crate::inference::fit::{Fitted, Start, fit};
use crate::inference::judge::{JudgementContext, taken, unknowns};
use crate::model::unknown::{Role, Unknown};

/// Share of what the best effect explains that another must explain.
const SHARE: f64 = 0.5;
/// Weights of the residual within the quantisation step, in the first and the last fits. A weight of zero gives no
/// direction towards the step, a weight of one would fit the rounding.
const WITHIN: [f64; 2] = [0.1, 0.0];

/// Returns the quantisation combined with each effect that explains the residual beyond it; empty if the readings are
/// not quantised.
///
/// A model of the steps has a minimum wherever readings are a step off, and finds none but the one that it starts in.
/// It is fitted by all repeats: they are rounded each in its own way, so that one cannot stand for all.
pub(super) fn pairs(bench: &JudgementContext, singles: &[Fitted], null: &Fitted) -> Vec<Set> {
    let Some(quantisation) = bench.block.quantisation else { return Vec::new() };
    let is_steps = |single: &&Fitted| bench.library[single.hypothesis].name == quantisation.name;
    let Some(steps) = singles.iter().find(is_steps) else { return Vec::new() };
    let Some(zone) = DeadZone::of(&bench.learn) else { return Vec::new() };
    let others = singles.iter().filter(|single| !is_steps(single));
    let found = explaining(bench, &zone, others, null);
    let starts = found.iter().map(|other| beside(bench, &zone, steps, other)).collect();
    let fits = fit(starts, &bench.block.base, bench.block.quotient(), &|sets| bench.simulated(sets));
    let set = |fitted: Fitted| {
        let mut members = vec![steps.hypothesis, fitted.hypothesis];
        members.sort_unstable();
        (members, fitted)
    };
    bench.with_carried(fits).into_iter().map(set).collect()
}

/// Returns the fits of the effects that explain the residual beyond the quantisation about as well as the best.
fn explaining<'f>(
    bench: &JudgementContext,
    zone: &DeadZone,
    singles: impl Iterator<Item = &'f Fitted>,
    null: &Fitted,
) -> Vec<Fitted> {
    let (base, quotient, none) = (&bench.block.base, bench.block.quotient(), bench.library.len());
    let fit_by = |starts, within| fit(starts, base, quotient, &|sets: &[Vec<f64>]| zone.residuals(within, sets));
    let null = Start { hypothesis: none, ..start(null) };
    let mut fits = fit_by(singles.map(start).chain([null]).collect(), WITHIN[0]);
    let null = fits.pop().expect("the null hypothesis, which is numbered last").cost();
    let explained = |fitted: &Fitted| null - fitted.cost();
    let most = fits.iter().map(explained).fold(0.0, f64::max);
    fits.retain(|fitted| explained(fitted) > f64::max(price(none), SHARE * most));
    fit_by(fits.iter().map(Start::at).collect(), WITHIN[1])
}

/// Where a fit ended, its nuisances back at nothing: they make up for the steps, too.
fn start(fitted: &Fitted) -> Start {
    let first = |(unknown, z): (&Unknown, &f64)| if unknown.role == Role::Nuisance { 0.0 } else { *z };
    let z = fitted.unknowns.iter().zip(&fitted.z).map(first).collect();
    Start::new(fitted.hypothesis, fitted.unknowns.clone(), z)
}

/// An effect as it was found beside steps as large as they are seen, which nothing but noise blurs.
fn beside(bench: &JudgementContext, zone: &DeadZone, steps: &Fitted, other: &Fitted) -> Start {
    let both = [steps, other].map(|fitted| &bench.library[fitted.hypothesis]);
    let unknowns = unknowns(bench.block, &both);
    let mut z = taken(&unknowns, other);
    if let Some(size) = unknowns.iter().position(|unknown| unknown.name == zone.size) {
        z[size] = unknowns[size].prior.place(zone.step);
    }
    Start::new(other.hypothesis, unknowns, z)
}
