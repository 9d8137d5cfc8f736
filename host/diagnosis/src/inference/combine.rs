//! Combinations of effects by beam search: adds effects that raise the evidence of the joint fit, and drops those that
//! no longer do.

use crate::inference::admissibility::{NEARLY_NOISE, is_admissible, reported_nuisances};
use crate::inference::bank::Bank;
use crate::inference::evidence::evidence;
use crate::inference::fit::{Fitted, Simulate, Start};
use crate::inference::judge::{best_entries, sized, taken, unknowns};
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::{Role, Unknown};
use nalgebra::DVector;

/// Beam width; one if the noise is estimated from the residual of the richest hypothesis.
const BEAM: usize = 3;
/// Largest number of effects in an answer, and in the hypothesis whose residual estimates the noise.
const MOST: usize = 4;
const MOST_FOR_NOISE: usize = 3;
/// Effects that are tried on top of a combination, the most promising.
const TRIED: usize = 8;
/// Log-odds by the screening below which an effect is not tried on top of a combination.
const PROMISING: f64 = 2.0;
/// Mean square of whitened residuals from which on effects are looked for by signatures on top of what was found.
const MUCH: f64 = 1.5;
/// Correlation of a signature with the part absorbed by nuisance parameters beyond their priors, above which its effect
/// is tried whatever its log-odds.
const ALONG: f64 = 0.5;
/// Log-odds that one more effect must gain.
const PAYS: f64 = 5.0;

/// Returns the complexity penalty of an effect in log-odds, for a library of `effects` effects.
pub(crate) fn price(effects: usize) -> f64 {
    PAYS + (effects as f64).ln()
}

/// Fits starts; the best of each hypothesis comes back.
pub(crate) type Fit<'a> = dyn Fn(Vec<Start>) -> Vec<Fitted> + 'a;

/// Hypotheses of a combination, in rising order, and their joint fit.
pub(crate) type Set = (Vec<usize>, Fitted);

/// What combinations are made of.
pub(crate) struct Combiner<'a> {
    pub(crate) block: &'a MeasuredBlock,
    pub(crate) library: &'a [Hypothesis],
    /// The null hypothesis by one repeat of each experiment, and signatures on top of it.
    pub(crate) null: &'a Fitted,
    pub(crate) bank: &'a Bank,
    /// Factor by which residual variances exceed the noise's even for the best single effect.
    pub(crate) dispersion: f64,
    /// Whether combinations must be admissible.
    pub(crate) strictly: bool,
    /// Whether the noise is estimated from repeats.
    pub(crate) repeated: bool,
    /// Whitened residuals to screen by.
    pub(crate) simulate: &'a Simulate<'a>,
    pub(crate) fit: &'a Fit<'a>,
}

impl Combiner<'_> {
    /// All single effects, pairs that are known from elsewhere, and the combinations that explain the data better than any
    /// of their parts.
    pub(crate) fn combine(&self, singles: Vec<Fitted>, pairs: Vec<Set>) -> Vec<Set> {
        let mut all: Vec<Set> = singles.into_iter().map(|fitted| (vec![fitted.hypothesis], fitted)).collect();
        let calibration = self.paying(self.calibration(), &all);
        let pairs: Vec<Set> = self.paying(pairs, &all).into_iter().chain(calibration).collect();
        let begun = if pairs.is_empty() { 1 } else { 2 };
        let mut beam = self.beam(all.iter().chain(&pairs).cloned().collect());
        all.extend(pairs.into_iter().filter(|set| self.is_admissible(set)));
        let most = if self.strictly { MOST } else { MOST_FOR_NOISE };
        for _ in begun..most {
            // A set that leaves only noise is extended; sets without it explain nothing more.
            if beam.first().is_some_and(|best| best.1.mean_square() < NEARLY_NOISE) {
                beam.truncate(1);
            }
            let Some((_, best)) = beam.first() else { break };
            // With a large misfit, one effect may change the signature of another: weight moves the angle at which
            // teeth separate. A nuisance parameter that is a finding may hide the effect that it imitates.
            let on_top = (best.mean_square() > MUCH || reported_nuisances(best).next().is_some())
                .then(|| self.bank_on(&with_nominal_nuisances(best)));
            let starts = beam.iter().flat_map(|set| self.grown(self.bank, set, None, &all));
            let cleared = on_top.iter().flat_map(|bank| beam.iter().map(move |set| (bank, set)));
            let cleared = cleared.flat_map(|(bank, (members, fitted))| {
                let with_nominal_nuisances = with_nominal_nuisances(fitted);
                let taken = &with_nominal_nuisances.residual - &fitted.residual;
                self.grown(bank, &(members.clone(), with_nominal_nuisances), Some(&taken), &all)
            });
            // Where the noise is estimated from the residual of the richest hypothesis, nuisance z-scores do not
            // measure the misfit.
            let absorbing_nuisances =
                beam.iter().filter(|_| self.repeated).flat_map(|set| self.absorbing_nuisances(set, &all));
            let larger = self.fitted(starts.chain(cleared).chain(absorbing_nuisances).collect());
            let paying = self.paying(larger, &all);
            if paying.is_empty() {
                break;
            }
            beam = self.beam(paying.clone());
            // An inadmissible combination may still have found the minimum of one of its members.
            if let Some(best) = beam.first().filter(|best| !self.is_admissible(best)) {
                let parts = self.fitted(self.parts(best));
                self.take_better(&mut all, parts);
            }
            all.extend(paying.into_iter().filter(|set| self.is_admissible(set)));
        }
        self.without_redundant(all)
    }

    /// Returns the calibration: all its effects fitted together, then without those that the evidence does not need, step
    /// by step. A machine differs from a new model in all of them at once, and no single one explains much.
    fn calibration(&self) -> Vec<Set> {
        let members = (0..self.library.len()).filter(|number| self.library[*number].calibration);
        let members = members.fold(Vec::new(), |mut members: Vec<usize>, number| {
            if !self.shares(&members, number) {
                members.push(number);
            }
            members
        });
        if members.len() < 2 {
            return Vec::new();
        }
        let unknowns = self.unknowns(&members);
        let from_null = taken(&unknowns, self.null);
        let starts =
            [vec![0.0; unknowns.len()], from_null].map(|z| (members.clone(), Start::new(0, unknowns.clone(), z)));
        let mut found = self.fitted(starts.into());
        let price = price(self.library.len());
        while let Some(whole) = found.pop().filter(|whole| whole.0.len() > 1) {
            let own = self.log(&whole);
            let weakest = self.ranked(self.fitted(self.parts(&whole))).into_iter().next();
            match weakest.filter(|part| self.log(part) + price > own) {
                Some(part) => found.push(part),
                None => return vec![whole],
            }
        }
        Vec::new()
    }

    /// Returns the sets whose evidence exceeds that of all their subsets.
    fn paying(&self, sets: Vec<Set>, all: &[Set]) -> Vec<Set> {
        let price = price(self.library.len());
        let pays = |set: &Set| {
            let parts = all.iter().filter(|part| part.0.iter().all(|own| set.0.contains(own)));
            self.log(set) > price + parts.map(|part| self.log(part)).fold(f64::NEG_INFINITY, f64::max)
        };
        sets.into_iter().filter(pays).collect()
    }

    /// Removes combinations with a redundant effect: a subset, refitted from their parameters, explains as much. An
    /// effect that was added first may have substituted for the one added last.
    fn without_redundant(&self, mut all: Vec<Set>) -> Vec<Set> {
        let price = price(self.library.len());
        loop {
            all = self.ranked(all);
            let Some(best) = all.first().filter(|best| best.0.len() > 1) else { return all };
            let (parts, own) = (self.fitted(self.parts(best)), self.log(best));
            let is_spare = parts.iter().any(|part| self.log(part) + price > own);
            if is_spare {
                all.remove(0);
            }
            self.take_better(&mut all, parts);
            if !is_spare {
                return all;
            }
        }
    }

    /// Takes the sound ones of sets that are new or better than those known.
    fn take_better(&self, all: &mut Vec<Set>, sets: Vec<Set>) {
        for set in sets.into_iter().filter(|set| self.is_admissible(set)) {
            match all.iter_mut().find(|other| other.0 == set.0) {
                Some(other) if set.1.cost() < other.1.cost() => *other = set,
                Some(_) => {}
                None => all.push(set),
            }
        }
    }

    /// A combination without each of its members, from where it has the others.
    fn parts(&self, (members, fitted): &Set) -> Vec<(Vec<usize>, Start)> {
        let without = |left_out: &usize| {
            let set: Vec<usize> = members.iter().copied().filter(|own| own != left_out).collect();
            let unknowns = self.unknowns(&set);
            (set, from_there(unknowns, fitted))
        };
        members.iter().map(without).collect()
    }

    /// Free numbers of a combination.
    fn unknowns(&self, set: &[usize]) -> Vec<Unknown> {
        let hypotheses: Vec<&Hypothesis> = set.iter().map(|number| &self.library[*number]).collect();
        unknowns(self.block, &hypotheses)
    }

    fn log(&self, set: &Set) -> f64 {
        evidence(&set.1, self.dispersion).log
    }

    fn is_admissible(&self, (members, fitted): &Set) -> bool {
        let base = &self.block.base;
        !self.strictly
            || is_admissible(base, self.library, members, fitted, &evidence(fitted, self.dispersion).covariance)
    }

    /// Sets by their evidence, the best first.
    fn ranked(&self, sets: Vec<Set>) -> Vec<Set> {
        let mut sets: Vec<(f64, Set)> = sets.into_iter().map(|set| (self.log(&set), set)).collect();
        sets.sort_by(|a, b| b.0.total_cmp(&a.0));
        sets.into_iter().map(|(_, set)| set).collect()
    }

    /// Returns the best admissible sets, and the best of all if it is inadmissible: one more effect may relax its
    /// nuisance parameters.
    fn beam(&self, sets: Vec<Set>) -> Vec<Set> {
        let sets = self.ranked(sets);
        let nuisances_beyond_prior = sets.first().filter(|best| !self.is_admissible(best)).cloned();
        let most = if self.strictly { BEAM } else { 1 };
        nuisances_beyond_prior
            .into_iter()
            .chain(sets.into_iter().filter(|set| self.is_admissible(set)).take(most))
            .collect()
    }

    /// Signatures on top of a fit.
    fn bank_on(&self, fitted: &Fitted) -> Bank {
        let base = &self.block.base;
        let residual = (self.simulate)(&[fitted.values(base)]).remove(0);
        Bank::simulate(self.library, &Fitted { residual, ..fitted.clone() }, base, self.simulate)
    }

    /// Returns the combination with one more effect, for every promising effect and every effect along the part
    /// absorbed by nuisance parameters beyond their priors.
    fn grown(
        &self,
        bank: &Bank,
        (members, fitted): &Set,
        taken: Option<&DVector<f64>>,
        known: &[Set],
    ) -> Vec<(Vec<usize>, Start)> {
        let library = self.library;
        let scores = bank.scores(fitted).dispersed(self.dispersion);
        let odds = bank.log_odds(&scores, library.len());
        let is_along = |number: usize| taken.is_some_and(|taken| bank.correlation(number, taken) > ALONG);
        let promises =
            |number: &usize| (odds[*number] > PROMISING || is_along(*number)) && !self.shares(members, *number);
        let mut tried: Vec<usize> = (0..library.len()).filter(promises).collect();
        tried.sort_by(|a, b| odds[*b].total_cmp(&odds[*a]));
        tried.truncate(TRIED);
        let with = |number: usize| {
            let (set, unknowns) = self.joined(members, number, known)?;
            let (entry, multiples) = best_entries(bank, &scores, number).into_iter().next()?;
            let new = sized(&library[number], entry, &multiples);
            let place = |field: usize, unknowns: &[Unknown]| unknowns.iter().position(|unknown| unknown.field == field);
            let z = unknowns.iter().map(|unknown| match place(unknown.field, &library[number].unknowns) {
                Some(own) => new[own],
                None => place(unknown.field, &fitted.unknowns).map_or(0.0, |own| fitted.z[own]),
            });
            let z = z.collect();
            Some((set, Start::new(0, unknowns, z).beside(fitted)))
        };
        tried.into_iter().filter_map(with).collect()
    }

    /// Returns the combination with an effect that equals or imitates its nuisance parameters beyond their priors
    /// (biases, or a delay for a clock offset), started at their values. Some effects (quantisation) are in phase with
    /// these values and are not found from other starts.
    fn absorbing_nuisances(&self, (members, fitted): &Set, known: &[Set]) -> Vec<(Vec<usize>, Start)> {
        let with = |number: usize| {
            let imitated = self.imitated(number, fitted)?;
            let (set, unknowns) = self.joined(members, number, known)?;
            Some((set, self.with_imitated_effect(number, &imitated, from_there(unknowns, fitted))))
        };
        (0..self.library.len()).filter(|number| !self.shares(members, *number)).filter_map(with).collect()
    }

    /// Returns the nuisance parameters beyond their priors that an effect imitates, each with the effect's `z`; `None`
    /// if there are none.
    fn imitated(&self, number: usize, fitted: &Fitted) -> Option<Vec<(usize, Vec<f64>)>> {
        let hypothesis = &self.library[number];
        let (own, others): (Vec<_>, Vec<_>) =
            reported_nuisances(fitted).partition(|(_, nuisance, _)| place(hypothesis, nuisance.field).is_some());
        let imitation = |(_, nuisance, z): (usize, &Unknown, f64)| {
            let change = self.null.jacobian.column(self.null.place(nuisance.field)?) * z;
            let (entry, multiples) = self.bank.imitation(number, &change)?;
            Some((nuisance.field, sized(hypothesis, entry, &multiples)))
        };
        let imitated: Vec<_> = others.into_iter().filter_map(imitation).collect();
        (!own.is_empty() || !imitated.is_empty()).then_some(imitated)
    }

    /// Returns a start in which the effect replaces the nuisance parameters that it imitates.
    fn with_imitated_effect(&self, number: usize, imitated: &[(usize, Vec<f64>)], mut start: Start) -> Start {
        for (field, own) in imitated {
            for (unknown, z) in start.unknowns.iter().zip(&mut start.z) {
                match place(&self.library[number], unknown.field) {
                    Some(place) if unknown.role == Role::Size => *z += own[place],
                    Some(place) => *z = own[place],
                    None if unknown.field == *field => *z = 0.0,
                    None => {}
                }
            }
        }
        start
    }

    /// Whether an effect has a number in common with some others.
    fn shares(&self, members: &[usize], number: usize) -> bool {
        let of = |number: usize| self.library[number].unknowns.iter().map(|unknown| unknown.field);
        members.iter().any(|own| of(*own).any(|field| of(number).any(|other| other == field)))
    }

    /// A combination with one more effect, and its free numbers; `None` if it is known.
    fn joined(&self, members: &[usize], number: usize, known: &[Set]) -> Option<(Vec<usize>, Vec<Unknown>)> {
        let mut set = members.to_vec();
        set.push(number);
        set.sort_unstable();
        if known.iter().any(|other| other.0 == set) {
            return None;
        }
        let unknowns = self.unknowns(&set);
        Some((set, unknowns))
    }

    /// Joint fits; combinations that were reached from two sides are fitted from both.
    fn fitted(&self, starts: Vec<(Vec<usize>, Start)>) -> Vec<Set> {
        let mut sets: Vec<Vec<usize>> = starts.iter().map(|(set, _)| set.clone()).collect();
        sets.sort();
        sets.dedup();
        let numbered = |(set, start): (Vec<usize>, Start)| Start {
            hypothesis: sets.iter().position(|other| *other == set).expect("collected above"),
            ..start
        };
        let fits = (self.fit)(starts.into_iter().map(numbered).collect());
        fits.into_iter().map(|fitted| (sets[fitted.hypothesis].clone(), fitted)).collect()
    }
}

/// The place of a number among those of an effect.
fn place(hypothesis: &Hypothesis, field: usize) -> Option<usize> {
    hypothesis.unknowns.iter().position(|unknown| unknown.field == field)
}

/// A start of free numbers where a fit has them.
fn from_there(unknowns: Vec<Unknown>, fitted: &Fitted) -> Start {
    let z = taken(&unknowns, fitted);
    Start::new(0, unknowns, z).beside(fitted)
}

/// Returns a fit with the nuisance parameters that are findings reset to nominal, to first order: the part that they
/// absorbed is then available to one more effect.
fn with_nominal_nuisances(fitted: &Fitted) -> Fitted {
    let mut with_nominal_nuisances = fitted.clone();
    for (place, _, z) in reported_nuisances(fitted) {
        with_nominal_nuisances.residual.axpy(-z, &fitted.jacobian.column(place), 1.0);
        with_nominal_nuisances.z[place] = 0.0;
    }
    with_nominal_nuisances
}
