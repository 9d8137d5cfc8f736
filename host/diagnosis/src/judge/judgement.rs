//! What the data say of a block: its candidates, the null hypotheses that they are measured by, and the noise.

use crate::combine::price;
use crate::inference::adequacy::Adequacy;
use crate::inference::evidence::{Evidence, greatest_pull};
use crate::inference::fit::Fitted;
use crate::inference::noise::Noise;
use crate::soundness::{is_strained, strain};
use nalgebra::{DMatrix, DVector};

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
