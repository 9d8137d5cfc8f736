//! Result of a block's judgement: candidates, null hypotheses and noise.

use crate::inference::adequacy::{ADEQUATE, Adequacy, log_odds_of_closeness};
use crate::inference::admissibility::{beyond_limits, has_nuisance_beyond_prior, penalty_of_nuisances};
use crate::inference::combine::price;
use crate::inference::evidence::{MarginalLikelihood, greatest_nuisance_deviation};
use crate::inference::fit::Fitted;
use crate::inference::noise::Noise;
use crate::inference::torque_error::TorqueError;
use nalgebra::{DMatrix, DVector};

/// Hypothesis, or combination of hypotheses, with its fit and evidence.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Numbers in the library, in rising order.
    pub hypotheses: Vec<usize>,
    /// The fit.
    pub fitted: Fitted,
    /// Evidence of the fit.
    pub evidence: MarginalLikelihood,
    /// Standard deviations of the free parameters' `z`, from noise, discretisation error and model error.
    pub deviations: Vec<f64>,
    /// Log-odds against the null hypothesis: difference of log evidence.
    pub log_odds: f64,
    /// Log-odds that input noise alone may give, because the candidate propagates it differently from the null
    /// hypothesis; 0 until computed.
    pub by_input_noise: f64,
    /// Whether it is admissible; see `is_admissible`.
    pub admissible: bool,
    /// Relative torque errors without and with the candidate, where its own is larger by more than a tenth.
    pub worse_torque: Option<TorqueError>,
    /// Whether it is admissible under the total uncertainty of its parameters, not under noise alone.
    pub sure: bool,
    /// Whitened residuals of held-out data; empty without any.
    pub held_out: DVector<f64>,
    /// Adequacy on held-out data, if there are any.
    pub adequacy: Option<Adequacy>,
}

impl Candidate {
    /// A fit of some hypotheses of which no more is known than its evidence.
    pub(crate) fn new(hypotheses: Vec<usize>, fitted: Fitted, evidence: MarginalLikelihood) -> Self {
        let (deviations, held_out) = (Vec::new(), DVector::zeros(0));
        let (log_odds, by_input_noise) = (0.0, 0.0);
        Self {
            hypotheses,
            fitted,
            evidence,
            deviations,
            log_odds,
            by_input_noise,
            admissible: true,
            worse_torque: None,
            sure: true,
            held_out,
            adequacy: None,
        }
    }

    /// Log-odds less the price of its effects, of a library of so many.
    pub(crate) fn score(&self, effects: usize) -> f64 {
        self.log_odds - self.hypotheses.len() as f64 * price(effects)
    }

    /// Returns whether it is detected: its log-odds exceed the threshold and the penalty of nuisance parameters beyond
    /// their priors.
    pub(crate) fn is_present(&self, threshold: f64) -> bool {
        self.log_odds >= threshold.max(self.by_input_noise) + penalty_of_nuisances(&self.fitted)
    }

    /// Covariance of its free numbers' `z`, as large as their deviations have it.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        let covariance = &self.evidence.covariance;
        let scale = DVector::from_fn(self.deviations.len(), |i, _| self.deviations[i] / covariance[(i, i)].sqrt());
        covariance.component_mul(&(&scale * scale.transpose()))
    }

    /// Returns whether it is a fit that physics does not allow: a size beyond its limits, or a larger torque error.
    pub(crate) fn is_impossible(&self) -> bool {
        self.worse_torque.is_some() || beyond_limits(&self.fitted).next().is_some()
    }

    /// Returns the nuisance parameter with the greatest z-score.
    pub fn greatest_nuisance_deviation(&self) -> Option<(&str, f64)> {
        greatest_nuisance_deviation(&self.fitted)
    }
}

/// Source of the noise estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseFrom {
    /// Differences of repeats.
    Repeats,
    /// Stretches of the recordings that contain only noise.
    Quiet,
    /// Residual of the richest combination of effects.
    Richest,
}

/// Judgement of a block.
#[derive(Clone, Debug)]
pub struct BlockJudgement {
    /// Name of the block.
    pub block: &'static str,
    /// Number of whitened samples.
    pub samples: usize,
    /// The noise.
    pub noise: Noise,
    /// Source of the noise estimate.
    pub noise_from: NoiseFrom,
    /// The null hypothesis: nuisances alone.
    pub null: Fitted,
    /// The null hypothesis with all nuisance parameters clamped to their priors.
    pub clamped: Fitted,
    /// Dispersion: factor by which residual variances exceed the noise under the best hypothesis, at least 1.
    pub dispersion: f64,
    /// Whether samples are independent; see `MeasuredBlock::stands_alone`.
    pub(crate) stands_alone: bool,
    /// Detection threshold in log-odds.
    pub threshold: f64,
    /// All fitted hypotheses and combinations, in falling order of evidence.
    pub ranking: Vec<Candidate>,
}

impl BlockJudgement {
    /// Returns the mean square of the clamped null hypothesis' whitened residuals on the training data.
    pub fn misfit(&self) -> f64 {
        self.clamped.mean_square()
    }

    /// Returns the admissible candidates, the best first.
    pub(crate) fn admissible(&self) -> impl Iterator<Item = &Candidate> {
        self.ranking.iter().filter(|candidate| candidate.admissible)
    }

    /// Returns the log-odds of a candidate against another, with the price of their effects.
    ///
    /// Where a candidate leaves more than noise, it is not true, and the evidence, which takes the remainder for noise, is
    /// too sure. Then the log-odds are at most those with which the candidate is closer to the data than the other, by
    /// the scatter of their difference along the recordings. Independent samples have their dispersion for this.
    pub(crate) fn lead(&self, candidate: &Candidate, other: Option<&Candidate>, effects: usize) -> f64 {
        let lead = candidate.score(effects) - other.map_or(0.0, |other| other.score(effects));
        if self.stands_alone || candidate.fitted.mean_square() < ADEQUATE || lead <= 0.0 {
            return lead;
        }
        let other = other.map_or(&self.null, |other| &other.fitted);
        lead.min(log_odds_of_closeness(candidate.fitted.residual.as_slice(), other.residual.as_slice()).max(0.0))
    }

    /// Returns the probabilities of the admissible candidates in their order, for a library of `effects` effects. The
    /// remainder is the probability of no effect, or zero if that requires nuisance parameters beyond their priors.
    pub(crate) fn probabilities(&self, effects: usize) -> Vec<f64> {
        let Some(best) = self.admissible().max_by(|a, b| a.score(effects).total_cmp(&b.score(effects))) else {
            return Vec::new();
        };
        let lag = |other: Option<&Candidate>| -self.lead(best, other, effects);
        let lags: Vec<f64> = self.admissible().map(|candidate| lag(Some(candidate))).collect();
        let nothing = if has_nuisance_beyond_prior(&self.null) { f64::NEG_INFINITY } else { lag(None) };
        let top = nothing.max(0.0);
        let all: f64 = (nothing - top).exp() + lags.iter().map(|lag| (lag - top).exp()).sum::<f64>();
        lags.iter().map(|lag| (lag - top).exp() / all).collect()
    }

    /// Returns whether an admissible candidate is detected, and any explanation is more probable than none, for a
    /// library of `effects` effects.
    pub(crate) fn finds(&self, best: &Candidate, effects: usize) -> bool {
        let spares_the_impossible =
            has_nuisance_beyond_prior(&self.null) && !has_nuisance_beyond_prior(&best.fitted) && best.log_odds > 0.0;
        let any = self.probabilities(effects).iter().sum::<f64>() >= 0.5;
        any && (spares_the_impossible || best.is_present(self.threshold))
    }
}
