//! Judges one block: null hypothesis, screening, fits of every effect, evidence, adequacy on held-out motion.

use crate::block::{MeasuredBlock, Part};
use crate::inference::adequacy::{Adequacy, adequacy};
use crate::inference::evidence::{Evidence, evidence, greatest_pull};
use crate::inference::fit::{Fitted, Simulate, Start, fit};
use crate::inference::noise::Noise;
use crate::inference::screen::{Match, Projector, matched, taken};
use crate::inference::unknown::{Role, Unknown, applied};
use crate::library::Hypothesis;
use nalgebra::DVector;

/// A nuisance pulled further than this many tolerances is clamped in the null hypothesis that gains are measured by.
const CLAMP: f64 = 3.0;
/// Starts of a hypothesis that are fitted.
const STARTS: usize = 3;

/// A hypothesis with what the data say of it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Number in the library.
    pub hypothesis: usize,
    /// Its fit.
    pub fitted: Fitted,
    /// Its evidence.
    pub evidence: Evidence,
    /// How much better than the null hypothesis it explains the data: difference of log evidence.
    pub log_odds: f64,
    /// Held-out data, if there are any.
    pub adequacy: Option<Adequacy>,
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
    /// The null hypothesis: nuisances alone.
    pub null: Fitted,
    /// Mean square of the null hypothesis' whitened residuals, nuisances clamped, on the data that it was fitted to.
    pub misfit: f64,
    /// Factor by which residual variances exceed the noise's even for the best hypothesis, at least 1.
    pub dispersion: f64,
    /// All hypotheses, the best first.
    pub ranking: Vec<Candidate>,
}

/// Judges a block by its library; `None` if its noise cannot be told.
pub fn judge(block: &MeasuredBlock, library: &[Hypothesis]) -> Option<Judgement> {
    let (learn, test) = (block.part(false), block.part(true));
    let noise = noise(block, &learn, &test)?;
    let simulate = |sets: &[Vec<f64>]| learn.whitened(&noise, sets);
    let null = fit(vec![null_start(block)], &block.base, &simulate).remove(0);
    let clamped = clamped(block, &null, &simulate);
    let samples = null.residual.len();

    let starts = screened(block, library, &null, &simulate);
    let fits = fit(starts, &block.base, &simulate);
    let least = fits.iter().map(|fitted| fitted.chi2()).fold(null.chi2(), f64::min);
    let dispersion = (least / samples as f64).max(1.0);
    let none = evidence(&null, dispersion).log;
    let without = (!test.is_empty()).then(|| test.whitened(&noise, &[clamped.values(&block.base)]).remove(0));
    let sets: Vec<_> = fits.iter().map(|fitted| fitted.values(&block.base)).collect();
    let with = if test.is_empty() { Vec::new() } else { test.whitened(&noise, &sets) };
    let mut ranking: Vec<Candidate> = fits
        .into_iter()
        .enumerate()
        .map(|(place, fitted)| {
            let evidence = evidence(&fitted, dispersion);
            let log_odds = evidence.log - none;
            let adequacy = without.as_ref().map(|without| adequacy(with[place].as_slice(), without.as_slice()));
            Candidate { hypothesis: fitted.hypothesis, fitted, evidence, log_odds, adequacy }
        })
        .collect();
    ranking.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let misfit = clamped.chi2() / samples as f64;
    Some(Judgement { block: block.name, samples, noise, null, misfit, dispersion, ranking })
}

/// The noise by the repeats of all experiments.
fn noise(block: &MeasuredBlock, learn: &Part, test: &Part) -> Option<Noise> {
    let mut deviations = learn.deviations(&block.base);
    if !test.is_empty() {
        deviations.extend(test.deviations(&block.base));
    }
    Noise::fit(&deviations)
}

fn null_start(block: &MeasuredBlock) -> Start {
    Start { hypothesis: 0, unknowns: block.nuisances.clone(), z: vec![0.0; block.nuisances.len()] }
}

/// The null hypothesis with no nuisance pulled beyond what its tolerance makes plausible.
fn clamped(block: &MeasuredBlock, null: &Fitted, simulate: &Simulate) -> Fitted {
    if null.z.iter().all(|z| z.abs() <= CLAMP) {
        return null.clone();
    }
    let mut base = block.base.clone();
    let mut free = Vec::new();
    for (unknown, z) in null.unknowns.iter().zip(&null.z) {
        match z.abs() > CLAMP {
            true => base[unknown.field] = unknown.prior.value(z.clamp(-CLAMP, CLAMP)),
            false => free.push(unknown.clone()),
        }
    }
    let count = free.len();
    let start = Start { hypothesis: 0, unknowns: free, z: vec![0.0; count] };
    let mut fitted = fit(vec![start], &base, simulate).remove(0);
    for (unknown, z) in null.unknowns.iter().zip(&null.z).filter(|(_, z)| z.abs() > CLAMP) {
        fitted.unknowns.push(unknown.clone());
        fitted.z.push(z.clamp(-CLAMP, CLAMP));
    }
    fitted
}

/// The free numbers of a hypothesis with the nuisances that it leaves; nuisances first.
fn unknowns(block: &MeasuredBlock, hypothesis: &Hypothesis) -> Vec<Unknown> {
    let own = |nuisance: &&Unknown| hypothesis.unknowns.iter().all(|unknown| unknown.field != nuisance.field);
    block.nuisances.iter().filter(own).chain(&hypothesis.unknowns).cloned().collect()
}

/// The most promising forms of every hypothesis, each at its best size.
fn screened(block: &MeasuredBlock, library: &[Hypothesis], null: &Fitted, simulate: &Simulate) -> Vec<Start> {
    let projector = Projector::of(null);
    let base = null.values(&block.base);
    let mut sets = Vec::new();
    for hypothesis in library {
        for form in &hypothesis.forms {
            sets.extend(signatures(&base, hypothesis, form));
        }
    }
    let mut simulated = simulate(&sets).into_iter();
    let mut starts = Vec::new();
    for (number, hypothesis) in library.iter().enumerate() {
        let mut found: Vec<(Match, &Vec<f64>)> = Vec::new();
        for form in &hypothesis.forms {
            let change: Vec<DVector<f64>> =
                hypothesis.sizes.iter().map(|_| simulated.next().expect("one a set") - &null.residual).collect();
            let signed = hypothesis.sizes.iter().all(|size| !hypothesis.unknowns[*size].prior.is_one_sided());
            let best = match hypothesis.shaped && change.len() == 1 {
                true => taken(&projector, &change[0], &null.residual),
                false => matched(&projector, &change, &null.residual, signed),
            };
            found.push((best, form));
        }
        found.sort_by(|a, b| b.0.statistic.total_cmp(&a.0.statistic));
        starts.extend(found.iter().take(STARTS).map(|(best, form)| start(block, number, hypothesis, null, best, form)));
    }
    starts
}

/// Parameters with the effect at a form, one set for each of its sizes alone.
fn signatures<'a>(base: &'a [f64], hypothesis: &'a Hypothesis, form: &'a [f64]) -> impl Iterator<Item = Vec<f64>> + 'a {
    hypothesis.sizes.iter().map(move |size| {
        let z: Vec<f64> =
            (0..form.len()).map(|i| if i != *size && hypothesis.sizes.contains(&i) { 0.0 } else { form[i] }).collect();
        applied(base, &hypothesis.unknowns, &z)
    })
}

fn start(
    block: &MeasuredBlock,
    number: usize,
    hypothesis: &Hypothesis,
    null: &Fitted,
    best: &Match,
    form: &[f64],
) -> Start {
    let unknowns = unknowns(block, hypothesis);
    let first = unknowns.len() - hypothesis.unknowns.len();
    let nuisance = |unknown: &Unknown| {
        let place = null.unknowns.iter().position(|own| own.field == unknown.field);
        place.map_or(0.0, |place| null.z[place].clamp(-CLAMP, CLAMP))
    };
    let mut z: Vec<f64> = unknowns[..first].iter().map(nuisance).collect();
    for (i, unknown) in hypothesis.unknowns.iter().enumerate() {
        let scale = hypothesis.sizes.iter().position(|size| *size == i).map_or(1.0, |k| best.sizes[k]);
        let size = unknown.role == Role::Size;
        z.push(if size && scale.abs() < 0.05 { 0.05 * form[i] } else { (form[i] * scale).clamp(-30.0, 30.0) });
    }
    Start { hypothesis: number, unknowns, z }
}

impl Candidate {
    /// The nuisance that was pulled furthest, and how far.
    pub fn greatest_pull(&self) -> Option<(&str, f64)> {
        greatest_pull(&self.fitted)
    }
}
