//! Judges one block: null hypothesis, screening, fits of every effect and of combinations, adequacy on held-out motion.

mod held_out;
mod in_steps;
mod nested;
mod uncertainty;

use crate::block::{MeasuredBlock, Part};
use crate::combine::{Combiner, Set, price};
use crate::inference::adequacy::Adequacy;
use crate::inference::bank::{Bank, Entry, Gram, Scores};
use crate::inference::evidence::{Evidence, evidence, greatest_pull};
use crate::inference::fit::{Fitted, HOPELESS, Simulate, Start, fit};
use crate::inference::noise::Noise;
use crate::inference::spread::scatter;
use crate::inference::unknown::{Role, Unknown};
use crate::library::Hypothesis;
use crate::soundness::{drop_worthless, is_sound, is_strained, is_strained_for_nothing, strain};
use nalgebra::{DMatrix, DVector};
use softdock_engine::blocks::Kind;

/// A nuisance pulled further than this many tolerances is clamped in the null hypothesis that gains are measured by.
const CLAMP: f64 = 3.0;
/// A nuisance that the null hypothesis pulls further than this many tolerances may make up for an effect.
const SUSPECT: f64 = 2.0;
/// Starts of a hypothesis that are fitted.
const STARTS: usize = 3;
/// Hypotheses whose fits are carried on with all repeats.
const POLISHED: usize = 5;
/// Best candidates whose numbers go without the pull of input noise, and that are simulated in steps half as long.
const REFINED: usize = 3;
/// Noise alone may reach the threshold with this probability.
const RARITY: f64 = 5e-4;
/// Least threshold of log-odds from which on an effect counts as present.
const LEAST_THRESHOLD: f64 = 5.0;

/// One or several hypotheses together, with what the data say of them.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Numbers in the library, in rising order.
    pub hypotheses: Vec<usize>,
    /// The fit.
    pub fitted: Fitted,
    /// Its evidence.
    pub evidence: Evidence,
    /// Standard deviations of its free numbers' `z`: by noise, by the simulation's step, by what the model lacks.
    pub deviations: Vec<f64>,
    /// How much better than the null hypothesis it explains the data: difference of log evidence.
    pub log_odds: f64,
    /// Log-odds that the noise of measured inputs alone may give it, for it carries that noise otherwise than the null
    /// hypothesis does; 0 until it is looked at.
    pub by_input_noise: f64,
    /// Whether it is what its name says; see `is_sound`.
    pub sound: bool,
    /// Whether it is that by all that its numbers may be off, not by noise alone.
    pub sure: bool,
    /// Whitened residuals of held-out data, none if there are none.
    pub held_out: DVector<f64>,
    /// How it does on held-out data, if there are any.
    pub adequacy: Option<Adequacy>,
}

/// Where a block's noise is known from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseFrom {
    /// What repeats of one command differ by.
    Repeats,
    /// Stretches of the recordings that hold nothing else.
    Quiet,
    /// What the richest combination of effects leaves.
    Richest,
}

/// What the data say of a block.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The block's name.
    pub block: &'static str,
    /// Number of whitened samples.
    pub samples: usize,
    /// The noise.
    pub noise: Noise,
    /// Where the noise is known from.
    pub noise_from: NoiseFrom,
    /// The null hypothesis: nuisances alone.
    pub null: Fitted,
    /// The null hypothesis with no nuisance beyond what its tolerance makes plausible.
    pub clamped: Fitted,
    /// Factor by which residual variances exceed the noise's even for the best hypothesis, at least 1.
    pub dispersion: f64,
    /// Log-odds from which on an effect counts as present.
    pub threshold: f64,
    /// Log-odds that each hypothesis would have at a plausible size, were it there.
    pub visibility: Vec<f64>,
    /// How alike two hypotheses can look in these data, 0 to 1.
    pub likeness: DMatrix<f64>,
    /// All hypotheses and the combinations that were tried, the best first.
    pub ranking: Vec<Candidate>,
}

impl Judgement {
    /// Mean square of the clamped null hypothesis' whitened residuals on the data that it was fitted to.
    pub fn misfit(&self) -> f64 {
        self.clamped.mean_square()
    }

    /// The candidates that are sound, the best first.
    pub(crate) fn sound(&self) -> impl Iterator<Item = &Candidate> {
        self.ranking.iter().filter(|candidate| candidate.sound)
    }

    /// Probabilities of the sound candidates of a library of so many effects, in their order; what they leave is that of no
    /// effect, and nothing where that asks the impossible of a nuisance.
    pub(crate) fn probabilities(&self, effects: usize) -> Vec<f64> {
        let scores: Vec<f64> = self.sound().map(|candidate| candidate.score(effects)).collect();
        let top = scores.iter().copied().fold(0.0, f64::max);
        let nothing = if is_strained(&self.null) { 0.0 } else { (-top).exp() };
        let all: f64 = nothing + scores.iter().map(|score| (score - top).exp()).sum::<f64>();
        scores.iter().map(|score| (score - top).exp() / all).collect()
    }

    /// Whether a sound candidate is there by the statistics, and some explanation, whichever it is, more probable than
    /// none, of a library of so many effects.
    pub(crate) fn finds(&self, best: &Candidate, effects: usize) -> bool {
        let spares_the_impossible = is_strained(&self.null) && !is_strained(&best.fitted) && best.log_odds > 0.0;
        let any = self.probabilities(effects).iter().sum::<f64>() >= 0.5;
        any && (spares_the_impossible || best.is_present(self.threshold))
    }
}

/// Judges a block by its library; `finer` is the same block in steps half as long, which tells what the step changes.
/// `None` if its noise cannot be told.
pub fn judge(block: &MeasuredBlock, finer: &MeasuredBlock, library: &[Hypothesis]) -> Option<Judgement> {
    let from = if block.part(false).has_repeats() { NoiseFrom::Repeats } else { NoiseFrom::Quiet };
    if let Some(noise) = Noise::above(&block.noise_alone(), &block.floor) {
        return Some(Bench::of(block, library, noise).beside(finer).judged(from));
    }
    if from == NoiseFrom::Repeats {
        return None;
    }
    // With noise of no colour the richest combination is found; what that leaves is the noise.
    let rough = Noise::rough(&block.part(false).means(&block.base), &block.floor)?;
    let bench = Bench::of(block, library, rough).beside(finer);
    let found = bench.search(false);
    let fits = found.sets.iter().map(|set| &set.1).chain([&found.null]);
    let richest = fits.min_by(|a, b| a.chi2().total_cmp(&b.chi2())).expect("the null hypothesis at least");
    let values = richest.values(&block.base);
    let mut rest = bench.learn.means(&values);
    rest.extend(bench.test.means(&values));
    Some(Bench { noise: Noise::above(&rest, &block.floor)?, ..bench }.judged(NoiseFrom::Richest))
}

/// Mean square by which the whitened residuals of two simulations of the same block differ; `None` if its noise cannot
/// be told.
pub(crate) fn numerical_error(coarse: &MeasuredBlock, fine: &MeasuredBlock) -> Option<f64> {
    let (a, b) = (coarse.part(false), fine.part(false));
    let noise = a.noise(&coarse.base)?;
    let of = |part: &Part, block: &MeasuredBlock| part.whitened(&noise, std::slice::from_ref(&block.base)).remove(0);
    let difference = of(&a, coarse) - of(&b, fine);
    Some(difference.norm_squared() / difference.len() as f64)
}

/// Log-odds from which on an effect counts as present: what chance finds in a bank of so many hypotheses, and no less than
/// what nobody doubts.
pub fn threshold(bank: &Bank, gram: &Gram, hypotheses: usize) -> f64 {
    bank.chance(gram, hypotheses, RARITY).max(LEAST_THRESHOLD)
}

/// All that a judgement needs.
pub(crate) struct Bench<'a> {
    pub(crate) block: &'a MeasuredBlock,
    library: &'a [Hypothesis],
    /// What is learnt from.
    pub(crate) learn: Part<'a>,
    /// The same, where `learn` takes each repeat by itself.
    together: Option<Part<'a>>,
    test: Part<'a>,
    /// What is learnt from in steps half as long, if that was simulated.
    finer: Option<Part<'a>>,
    pub(crate) noise: Noise,
}

/// What the fits of all hypotheses and combinations give.
struct Found {
    null: Fitted,
    clamped: Fitted,
    scores: Scores,
    bank: Bank,
    dispersion: f64,
    sets: Vec<Set>,
}

impl<'a> Bench<'a> {
    /// A bench whose noise is known.
    pub(crate) fn of(block: &'a MeasuredBlock, library: &'a [Hypothesis], noise: Noise) -> Self {
        let (learn, test) = (block.part(false), block.part(true));
        // A drive that warms up shows it from repeat to repeat, which a mean of them may not.
        let changes = block.section.is(Kind::Drive) && block.grew(&block.base);
        let (learn, together) = if changes { (learn.repeats_apart(), Some(learn)) } else { (learn, None) };
        Self { block, library, learn, together, test, finer: None, noise }
    }

    /// With the same block in steps half as long beside it.
    fn beside(self, finer: &'a MeasuredBlock) -> Self {
        let finer = finer.part(false);
        let finer = if self.together.is_some() { finer.repeats_apart() } else { finer };
        Self { finer: Some(finer), ..self }
    }

    /// What is learnt from, motion by motion.
    fn motions(&self) -> &Part<'a> {
        self.together.as_ref().unwrap_or(&self.learn)
    }

    /// Fits the null hypothesis, every effect, and the combinations that pay, `strictly` none but those that are sound.
    fn search(&self, strictly: bool) -> Found {
        let (block, library) = (self.block, self.library);
        let (shortcut, quotient) = (self.learn.shortcut(&self.noise, &block.base), block.quotient());
        let quick = |sets: &[Vec<f64>]| shortcut.whitened(sets);
        let simulate = |sets: &[Vec<f64>]| self.simulated(sets);
        let near = shortcut.null();
        let null = self.with_carried(fit(vec![Start::at(&near)], &block.base, quotient, &simulate)).remove(0);
        let clamped = self.with_carried(vec![clamped(block, &null, CLAMP, &simulate)]).remove(0);
        let bank = Bank::simulate(library, &near, &block.base, &quick);
        let scores = bank.scores(&null);

        let starts = starts(block, library, &bank, &scores, &null);
        let singles = self.polished(fit(starts, &block.base, quotient, &quick));
        let again = fit(nested::starts(library, &singles), &block.base, quotient, &quick);
        let singles = nested::better(singles, self.polished(again));
        let again = fit(nested::astray(&singles, &null), &block.base, quotient, &simulate);
        let singles = nested::better(singles, self.with_carried(again));
        let singles: Vec<Fitted> = singles.into_iter().map(|single| no_worse(single, &null)).collect();
        let alone = self.dispersion(&null, singles.iter());
        let anchor = singles.iter().min_by(|a, b| a.cost().total_cmp(&b.cost())).unwrap_or(&null).values(&block.base);
        let shortcut = self.learn.shortcut(&self.noise, &anchor);
        let quick = |sets: &[Vec<f64>]| shortcut.whitened(sets);
        let in_steps = in_steps::pairs(self, &singles, &null);
        let fit_jointly = |starts| self.polished(fit(starts, &block.base, quotient, &quick));
        let (repeated, simulate, fit) = (self.learn.has_repeats(), &quick, &fit_jointly);
        let combiner =
            Combiner { block, library, null: &near, bank: &bank, dispersion: alone, strictly, repeated, simulate, fit };
        let sets = combiner.combine(singles, in_steps);
        // A combination may leave less than any effect alone.
        let dispersion = self.dispersion(&null, sets.iter().map(|set| &set.1));
        Found { null, clamped, scores, bank, dispersion, sets }
    }

    /// Factor by which residual variances exceed the noise's even for the best hypothesis, at least 1.
    fn dispersion<'f>(&self, null: &'f Fitted, fits: impl Iterator<Item = &'f Fitted>) -> f64 {
        let best = fits.fold(null, |best, fitted| if fitted.chi2() < best.chi2() { fitted } else { best });
        let scatter = if self.block.stands_alone { scatter(best, self.block.channels.len()) } else { 1.0 };
        (best.chi2() / best.residual.len() as f64).max(scatter).max(1.0)
    }

    /// Whitened residuals by all repeats.
    fn simulated(&self, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        self.learn.whitened(&self.noise, sets)
    }

    /// Fits by one repeat of each experiment, carried on with all repeats: the best of them; of the others the residuals
    /// alone.
    pub(crate) fn polished(&self, quick: Vec<Fitted>) -> Vec<Fitted> {
        if !self.learn.has_repeats() {
            return self.with_carried(quick);
        }
        let base = &self.block.base;
        let sets: Vec<Vec<f64>> = quick.iter().map(|fitted| fitted.values(base)).collect();
        let with = |(fitted, residual): (Fitted, DVector<f64>)| Fitted { residual, ..fitted };
        let mut all: Vec<Fitted> = quick.into_iter().zip(self.simulated(&sets)).map(with).collect();
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| all[*a].cost().total_cmp(&all[*b].cost()));
        order.truncate(POLISHED);
        // Those that lie far behind the best are ruled out, whatever they reach.
        let best = order.first().map_or((0.0, 1.0), |best| (all[*best].cost(), all[*best].mean_square().max(1.0)));
        order.retain(|place| all[*place].cost() < best.0 + HOPELESS * best.1);
        // In the order in which the fits come back.
        order.sort_by_key(|place| all[*place].hypothesis);
        let starts = order.iter().map(|place| Start::at(&all[*place])).collect();
        for (place, fitted) in
            order.into_iter().zip(fit(starts, base, self.block.quotient(), &|sets| self.simulated(sets)))
        {
            all[place] = fitted;
        }
        self.with_carried(all)
    }

    /// Fits with the noise that the simulation carries under their parameters.
    fn with_carried(&self, fits: Vec<Fitted>) -> Vec<Fitted> {
        let sets: Vec<Vec<f64>> = fits.iter().map(|fitted| fitted.values(&self.block.base)).collect();
        let carried = self.learn.carried(&self.noise, &sets);
        fits.into_iter().zip(carried).map(|(fitted, carried)| Fitted { carried, ..fitted }).collect()
    }

    /// Where repeats differ by more and more as a session goes on, what leaves that is no cause, however well it explains
    /// the rest.
    fn deny_what_leaves_a_drift(&self, ranking: &mut [Candidate]) {
        if self.together.is_some() {
            let sound = ranking.iter_mut().filter(|candidate| candidate.sound);
            sound.for_each(|own| own.sound = !self.block.grew(&own.fitted.values(&self.block.base)));
        }
    }

    fn judged(self, noise_from: NoiseFrom) -> Judgement {
        let Found { null, clamped, scores, bank, dispersion, sets } = self.search(true);
        let library = self.library;
        let gram = bank.gram(&null);
        let threshold = threshold(&bank, &gram, library.len());
        let samples = null.residual.len();
        let none = evidence(&null, dispersion).log;
        let mut ranking: Vec<Candidate> = sets
            .into_iter()
            .map(|(hypotheses, fitted)| {
                let evidence = evidence(&fitted, dispersion);
                let log_odds = evidence.log - none;
                let sound = is_sound(&self.block.base, library, &hypotheses, &fitted, &evidence.covariance)
                    && !is_strained_for_nothing(&fitted, &null);
                Candidate { log_odds, sound, ..Candidate::new(hypotheses, fitted, evidence) }
            })
            .collect();
        ranking.sort_by(|a, b| b.score(library.len()).total_cmp(&a.score(library.len())));
        self.deny_what_leaves_a_drift(&mut ranking);
        self.add_input_noise(&null, dispersion, &mut ranking);
        self.compensate(dispersion, &mut ranking);
        self.add_deviations(dispersion, &mut ranking);
        self.add_adequacies(&null, &clamped, &mut ranking);
        drop_worthless(&mut ranking, dispersion);
        let visibility = bank.visibility(&scores, library.len());
        let likeness = DMatrix::from_fn(library.len(), library.len(), |a, b| match a == b {
            true => 1.0,
            false => bank.likeness(&gram, a.min(b), a.max(b)),
        });
        let (block, noise) = (self.block.name, self.noise.clone());
        Judgement {
            block,
            samples,
            noise,
            noise_from,
            null,
            clamped,
            dispersion,
            threshold,
            visibility,
            likeness,
            ranking,
        }
    }
}

/// The null hypothesis with no nuisance pulled by more than so many tolerances.
fn clamped(block: &MeasuredBlock, null: &Fitted, reach: f64, simulate: &Simulate) -> Fitted {
    if null.z.iter().all(|z| z.abs() <= reach) {
        return null.clone();
    }
    let mut base = block.base.clone();
    let mut free = Vec::new();
    for (unknown, z) in null.unknowns.iter().zip(&null.z) {
        match z.abs() > reach {
            true => base[unknown.field] = unknown.prior.value(z.clamp(-reach, reach)),
            false => free.push(unknown.clone()),
        }
    }
    let mut fitted = fit(vec![Start::nominal(free)], &base, block.quotient(), simulate).remove(0);
    for (unknown, z) in null.unknowns.iter().zip(&null.z).filter(|(_, z)| z.abs() > reach) {
        fitted.unknowns.push(unknown.clone());
        fitted.z.push(z.clamp(-reach, reach));
    }
    fitted
}

/// A fit that ended above the null hypothesis, which it contains, is the null hypothesis.
fn no_worse(mut single: Fitted, null: &Fitted) -> Fitted {
    if single.cost() <= null.cost() {
        return single;
    }
    for (unknown, z) in single.unknowns.iter().zip(&mut single.z) {
        // A nuisance of the null hypothesis may be the size of an effect, with a spread of its own.
        *z = null.value(unknown.field).map_or(0.0, |value| unknown.prior.place(value));
    }
    (single.residual, single.carried) = (null.residual.clone(), null.carried);
    single
}

/// The free numbers of hypotheses together with the nuisances that they leave; nuisances first.
pub(crate) fn unknowns(block: &MeasuredBlock, hypotheses: &[&Hypothesis]) -> Vec<Unknown> {
    let own: Vec<&Unknown> = hypotheses.iter().flat_map(|hypothesis| &hypothesis.unknowns).collect();
    let left = |nuisance: &&Unknown| own.iter().all(|unknown| unknown.field != nuisance.field);
    block.nuisances.iter().filter(left).chain(own.iter().copied()).cloned().collect()
}

/// The most promising forms of every hypothesis, each at its best size.
fn starts(block: &MeasuredBlock, library: &[Hypothesis], bank: &Bank, scores: &Scores, null: &Fitted) -> Vec<Start> {
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

/// Where nuisances start beside an effect: where the null hypothesis has them, unless one is a suspect. What makes up
/// for an effect tells nothing of where it is beside it, so that it starts to either side of its tolerance's middle: a
/// clock that is early sees the other neighbour of each stamp than one that is late.
fn first_nuisances(nuisances: &[Unknown], null: &Fitted) -> Vec<Vec<f64>> {
    let Some((pulled, _)) = greatest_pull(null).filter(|pull| pull.1.abs() > SUSPECT) else {
        return vec![carried(nuisances, null)];
    };
    let beside = |side: f64| nuisances.iter().map(|own| if own.name == pulled { side } else { 0.0 }).collect();
    vec![beside(-1.0), beside(1.0)]
}

/// Entries of a hypothesis with the best multiples of their sizes, the most promising first.
pub(crate) fn best_entries<'b>(bank: &'b Bank, scores: &Scores, number: usize) -> Vec<(&'b Entry, Vec<f64>)> {
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
pub(crate) fn sized(hypothesis: &Hypothesis, entry: &Entry, multiples: &[f64]) -> Vec<f64> {
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

impl Candidate {
    /// A fit of some hypotheses of which no more is known than its evidence.
    pub(crate) fn new(hypotheses: Vec<usize>, fitted: Fitted, evidence: Evidence) -> Self {
        let (deviations, held_out) = (Vec::new(), DVector::zeros(0));
        let (log_odds, by_input_noise) = (0.0, 0.0);
        Self {
            hypotheses,
            fitted,
            evidence,
            deviations,
            log_odds,
            by_input_noise,
            sound: true,
            sure: true,
            held_out,
            adequacy: None,
        }
    }

    /// Log-odds less the price of its effects, of a library of so many.
    pub(crate) fn score(&self, effects: usize) -> f64 {
        self.log_odds - self.hypotheses.len() as f64 * price(effects)
    }

    /// Whether it is there by the statistics, where an effect counts as present from a threshold of log-odds on, and from
    /// what strained nuisances hide beside it.
    pub(crate) fn is_present(&self, threshold: f64) -> bool {
        self.log_odds >= threshold.max(self.by_input_noise) + strain(&self.fitted)
    }

    /// Covariance of its free numbers' `z`, as large as their deviations have it.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        let covariance = &self.evidence.covariance;
        let scale = DVector::from_fn(self.deviations.len(), |i, _| self.deviations[i] / covariance[(i, i)].sqrt());
        covariance.component_mul(&(&scale * scale.transpose()))
    }

    /// The nuisance that was pulled furthest, and how far.
    pub fn greatest_pull(&self) -> Option<(&str, f64)> {
        greatest_pull(&self.fitted)
    }
}
