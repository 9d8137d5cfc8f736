//! Judgement of a block: null hypothesis, screening, fits of effects and combinations, adequacy on held-out motion.

mod held_out;
mod judgement;
mod nested;
mod quantised;
mod starts;
mod uncertainty;

pub use judgement::{BlockJudgement, Candidate, NoiseFrom};
pub(crate) use starts::{best_entries, carried, sized, taken, unknowns};

use crate::inference::admissibility::{
    drop_over_parameterised, drop_without_held_out_gain, is_admissible, only_shifts_nuisances,
};
use crate::inference::bank::{Bank, Gram};
use crate::inference::combine::{Combiner, Set};
use crate::inference::evidence::evidence;
use crate::inference::fit::{Fitted, HOPELESS, Simulate, Start, fit};
use crate::inference::noise::Noise;
use crate::inference::parameter_deviations::scatter;
use crate::inference::recordings::BlockRecordings;
use crate::inference::torque_error::TorqueError;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use nalgebra::DVector;

/// z-score at which nuisance parameters are clamped in the null hypothesis for the gain.
const CLAMP: f64 = 3.0;
/// Hypotheses whose fits are carried on with all repeats.
const POLISHED: usize = 5;
/// Number of best candidates with bias compensation and half-step simulation.
const REFINED: usize = 3;
/// Number of best candidates whose torque errors are compared with the nominal model's.
const COMPARED: usize = 12;
/// Probability that noise alone reaches the threshold (false-positive rate).
const RARITY: f64 = 5e-4;
/// Power of a drift over the session, as a share of what a candidate explains, that it may leave.
pub(crate) const SMALL_TREND: f64 = 0.1;
/// Least threshold of log-odds from which on an effect counts as present.
const LEAST_THRESHOLD: f64 = 5.0;

/// Judges a block by its library. `finer` is the same block with a smaller step, for the discretisation error. Returns
/// `None` if the noise is not identifiable.
pub fn judge(block: &MeasuredBlock, finer: &MeasuredBlock, library: &[Hypothesis]) -> Option<BlockJudgement> {
    let from = if block.part(false).has_repeats() { NoiseFrom::Repeats } else { NoiseFrom::Quiet };
    if let Some(noise) = Noise::above(&block.noise_alone(), &block.floor) {
        return Some(JudgementContext::of(block, library, noise).beside(finer).judged(from));
    }
    if from == NoiseFrom::Repeats {
        return None;
    }
    // The richest combination is fitted with white noise; its residual estimates the noise.
    let rough = Noise::rough(&block.part(false).means(&block.base), &block.floor)?;
    let bench = JudgementContext::of(block, library, rough).beside(finer);
    let found = bench.search(false);
    let fits = found.sets.iter().map(|set| &set.1).chain([&found.null]);
    let richest = fits.min_by(|a, b| a.chi2().total_cmp(&b.chi2())).expect("the null hypothesis at least");
    let values = richest.values(&block.base);
    let mut rest = bench.learn.means(&values);
    rest.extend(bench.test.means(&values));
    Some(JudgementContext { noise: Noise::above(&rest, &block.floor)?, ..bench }.judged(NoiseFrom::Richest))
}

/// Returns the mean square difference of the whitened residuals of two simulations of a block; `None` if its noise is
/// not identifiable.
pub(crate) fn numerical_error(coarse: &MeasuredBlock, fine: &MeasuredBlock) -> Option<f64> {
    let (a, b) = (coarse.part(false), fine.part(false));
    let noise = a.noise(&coarse.base)?;
    let of = |part: &BlockRecordings, block: &MeasuredBlock| {
        part.whitened(&noise, std::slice::from_ref(&block.base)).remove(0)
    };
    let difference = of(&a, coarse) - of(&b, fine);
    Some(difference.norm_squared() / difference.len() as f64)
}

/// Returns whether a block has a smaller training residual than the same block with another step, each with fitted
/// nuisance parameters.
pub(crate) fn explains_better(block: &MeasuredBlock, other: &MeasuredBlock) -> bool {
    let nominal = |block: &MeasuredBlock| vec![Start::nominal(block.nuisances.clone())];
    misfits([block, other], &nominal).is_some_and(|[own, other]| own < other)
}

/// Returns the sums of squares of the training residuals of two forms of a block, each with its nuisance parameters and a
/// hypothesis fitted from all starts of the hypothesis, in units of the first form's noise; `None` if that is not
/// identifiable.
pub(crate) fn misfits_with(forms: [&MeasuredBlock; 2], hypothesis: &Hypothesis) -> Option<[f64; 2]> {
    let starts = |block: &MeasuredBlock| {
        let free = unknowns(block, &[hypothesis]);
        let nuisances = free.len() - hypothesis.unknowns.len();
        let start = |form: &Vec<f64>| {
            let z = std::iter::repeat_n(0.0, nuisances).chain(form.iter().copied());
            Start::new(0, free.clone(), z.collect())
        };
        hypothesis.forms.iter().map(start).chain([Start::nominal(free.clone())]).collect()
    };
    misfits(forms, &starts)
}

/// Returns the sums of squares of the training residuals of two forms of a block, fitted from starts of one hypothesis, in
/// units of the first form's noise; `None` if that is not identifiable.
fn misfits(forms: [&MeasuredBlock; 2], starts: &dyn Fn(&MeasuredBlock) -> Vec<Start>) -> Option<[f64; 2]> {
    let noise = forms[0].part(false).noise(&forms[0].base)?;
    Some(forms.map(|block| {
        let context = JudgementContext::of(block, &[], noise.clone());
        let simulate = |sets: &[Vec<f64>]| context.simulated(sets);
        fit(starts(block), &block.base, block.quotient(), &simulate).remove(0).chi2()
    }))
}

/// Returns the detection threshold in log-odds: the chance level of a bank of `hypotheses` hypotheses, at least
/// `LEAST_THRESHOLD`.
pub fn threshold(bank: &Bank, gram: &Gram, hypotheses: usize) -> f64 {
    bank.chance(gram, hypotheses, RARITY).max(LEAST_THRESHOLD)
}

/// Context of a judgement.
pub(crate) struct JudgementContext<'a> {
    pub(crate) block: &'a MeasuredBlock,
    library: &'a [Hypothesis],
    /// What is learnt from.
    pub(crate) learn: BlockRecordings<'a>,
    /// The same, where `learn` takes each repeat by itself.
    together: Option<BlockRecordings<'a>>,
    test: BlockRecordings<'a>,
    /// What is learnt from in steps half as long, if that was simulated.
    finer: Option<BlockRecordings<'a>>,
    pub(crate) noise: Noise,
}

/// What the fits of all hypotheses and combinations give.
struct Found {
    null: Fitted,
    clamped: Fitted,
    bank: Bank,
    dispersion: f64,
    sets: Vec<Set>,
}

impl<'a> JudgementContext<'a> {
    /// Builds the context for a known noise.
    pub(crate) fn of(block: &'a MeasuredBlock, library: &'a [Hypothesis], noise: Noise) -> Self {
        let (learn, test) = (block.part(false), block.part(true));
        // A drive that warms up shows it from repeat to repeat, which a mean of them may not.
        let changes = block.may_grow && block.grew(&block.base);
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
    fn motions(&self) -> &BlockRecordings<'a> {
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

        let starts = starts::starts(block, library, &bank, &scores, &null);
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
        let in_steps = quantised::pairs(self, &singles, &null);
        let fit_jointly = |starts| self.polished(fit(starts, &block.base, quotient, &quick));
        let (repeated, simulate, fit) = (self.learn.has_repeats(), &quick, &fit_jointly);
        let combiner =
            Combiner { block, library, null: &near, bank: &bank, dispersion: alone, strictly, repeated, simulate, fit };
        let sets = combiner.combine(singles, in_steps);
        // A combination may have a smaller residual than any single effect.
        let dispersion = self.dispersion(&null, sets.iter().map(|set| &set.1));
        Found { null, clamped, bank, dispersion, sets }
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

    /// If the differences of repeats grow over the session, rejects candidates that leave a drift that is not small beside
    /// what they explain.
    fn deny_what_leaves_a_drift(&self, clamped: &Fitted, ranking: &mut [Candidate]) {
        if self.together.is_none() {
            return;
        }
        let admissible: Vec<&mut Candidate> = ranking.iter_mut().filter(|candidate| candidate.admissible).collect();
        let values = |fitted: &Fitted| fitted.values(&self.block.base);
        let sets: Vec<Vec<f64>> = admissible.iter().map(|candidate| values(&candidate.fitted)).collect();
        let shares = self.block.shares_of_trend(&values(clamped), &sets);
        for (candidate, share) in admissible.into_iter().zip(shares) {
            candidate.admissible = share.is_none_or(|share| share < SMALL_TREND);
        }
    }

    /// Refuses candidates with a larger torque error than the nominal model has, however much of the motion they explain:
    /// a drive whose torque is computed worse is another drive.
    pub(crate) fn refuse_worse_torque(&self, clamped: &Fitted, ranking: &mut [Candidate]) {
        let mut compared: Vec<&mut Candidate> =
            ranking.iter_mut().filter(|candidate| candidate.admissible).take(COMPARED).collect();
        let fits: Vec<&Fitted> = compared.iter().map(|candidate| &candidate.fitted).collect();
        let errors = TorqueError::of_each(self.block, !self.test.is_empty(), clamped, &fits);
        for (candidate, error) in compared.iter_mut().zip(errors.into_iter().flatten()) {
            candidate.worse_torque = Some(error).filter(TorqueError::rises);
            candidate.admissible = candidate.worse_torque.is_none();
        }
    }

    fn judged(self, noise_from: NoiseFrom) -> BlockJudgement {
        let Found { null, clamped, bank, dispersion, sets } = self.search(true);
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
                let admissible = is_admissible(&self.block.base, library, &hypotheses, &fitted, &evidence.covariance)
                    && !only_shifts_nuisances(&fitted, &null);
                Candidate { log_odds, admissible, ..Candidate::new(hypotheses, fitted, evidence) }
            })
            .collect();
        ranking.sort_by(|a, b| b.score(library.len()).total_cmp(&a.score(library.len())));
        self.deny_what_leaves_a_drift(&clamped, &mut ranking);
        self.add_input_noise(&null, dispersion, &mut ranking);
        self.compensate(dispersion, &mut ranking);
        self.add_deviations(dispersion, &mut ranking);
        self.add_adequacies(&null, &clamped, &mut ranking);
        self.refuse_worse_torque(&clamped, &mut ranking);
        drop_without_held_out_gain(&mut ranking, dispersion);
        drop_over_parameterised(&mut ranking, library);
        let (block, noise) = (self.block.name, self.noise.clone());
        BlockJudgement {
            block,
            samples,
            noise,
            noise_from,
            null,
            clamped,
            dispersion,
            stands_alone: self.block.stands_alone,
            threshold,
            ranking,
        }
    }
}

/// Returns the null hypothesis with nuisance z-scores limited to `reach`.
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
