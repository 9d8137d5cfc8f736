//! Answer of a diagnosis for a block: verdict, causes, parameters, gain and residual.

use crate::inference::adequacy::Adequacy;
use crate::inference::torque_error::TorqueError;
use crate::inference::unmodelled::Form;
use crate::model::hypothesis::Hypothesis;
use crate::verdict::errors::{FittedParameter, RemainingError};
use crate::verdict::estimates::{EffectSize, ParameterEstimate, parameters};
use crate::verdict::free_run::FreeRun;
use serde::Serialize;
use softdock_kernels::effects::Effect;
use std::collections::BTreeMap;

/// Verdict of a diagnosis, ordered by severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DiagnosisVerdict {
    /// No detectable model error.
    NoEffect,
    /// No verdict: another block, itself unexplained, may cause the residual.
    Withheld,
    /// A statistically significant effect whose gain on held-out motion is below the practical limit.
    NoPracticalEffect,
    /// One or several causes are named.
    Named,
    /// One of several causes that are confounded in these data.
    Ambiguous,
    /// A model error that no cause of the library explains.
    NotInLibrary,
    /// The model is inadequate: what explains these recordings best is physically impossible, or a parameter is far
    /// beyond its tolerance.
    ModelInadequate,
}

impl DiagnosisVerdict {
    /// Returns whether the verdict comes with causes.
    pub(crate) fn names(self) -> bool {
        matches!(self, Self::Named | Self::Ambiguous | Self::NoPracticalEffect)
    }

    /// Returns whether it is a model error without a cause.
    pub fn is_open(self) -> bool {
        matches!(self, Self::NotInLibrary | Self::ModelInadequate)
    }
}

/// Cause of an answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectFound {
    /// Catalogue id.
    pub id: &'static str,
    /// Short description.
    pub name: &'static str,
    /// Block in which it acts.
    pub block: &'static str,
    /// Posterior probability.
    pub p: f64,
    /// Log-odds of the best explanation with the effect against the best one without it, natural logarithm.
    pub log_odds: f64,
    /// Principal size.
    pub size: Option<EffectSize>,
    /// Parameters by name.
    pub parameters: BTreeMap<String, ParameterEstimate>,
    /// Covariance of the parameters in the order of their names, SI units; empty if unknown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
}

/// Cause that was ruled out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RuledOut {
    /// Catalogue id.
    pub id: &'static str,
    /// Block in which it would act.
    pub block: &'static str,
    /// Log-odds of the best answer against this cause, natural logarithm.
    pub log_odds: f64,
    /// Whether its best parameters contradict its name: a size of zero, an implausible form, or a remaining drift.
    pub implausible: bool,
    /// Root mean square of its residual on held-out motion, in units of the noise.
    pub residual: Option<f64>,
}

/// Cause that is not detectable with these data at a plausible size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotVisible {
    /// Catalogue id.
    pub id: &'static str,
    /// Short description.
    pub name: &'static str,
    /// Block in which it would act.
    pub block: &'static str,
    /// Expected log-odds at a plausible size.
    pub log_odds: f64,
}

/// Gain on held-out motion: relative reduction of the residual's root mean square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Best value.
    pub value: f64,
    /// Lower bound of the 95 % interval.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
    /// 95 % interval of the gain on an unrecorded motion; `None` unless several motions were recorded.
    pub elsewhere: Option<Bounds>,
}

/// A 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

impl Gain {
    pub(crate) fn of(adequacy: &Adequacy) -> Self {
        let elsewhere = adequacy.gain_elsewhere.map(|[lo, hi]| Bounds { lo, hi });
        Self { value: adequacy.gain, lo: adequacy.gain_lo, hi: adequacy.gain_hi, elsewhere }
    }
}

/// Root mean square of the whitened residual, in units of the noise; noise alone gives 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// With the model as given.
    pub before: f64,
    /// With the answer.
    pub after: f64,
}

/// Form of a model error that has no cause in the library.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FormFound {
    /// Its terms.
    pub terms: Vec<FormTerm>,
    /// Whether it is adequate on held-out motion, as a named cause must be; otherwise it is a hint.
    pub holds: bool,
    /// Held-out gain.
    pub gain: Option<Gain>,
    /// Root mean square of its residual on held-out motion, in units of the noise.
    pub residual: Option<f64>,
}

/// Term of a form.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FormTerm {
    /// `dictionary`, or the catalogue id of an additional effect.
    pub id: &'static str,
    /// Short description.
    pub name: &'static str,
    /// Share of the random halves of the data that select it (stability selection).
    pub stability: f64,
    /// Parameters by name.
    pub parameters: BTreeMap<String, ParameterEstimate>,
}

/// Answer for a block.
#[derive(Clone, Debug, Serialize)]
pub struct BlockAnswer {
    /// The block.
    pub block: &'static str,
    /// The answer.
    pub answer: DiagnosisVerdict,
    /// Causes: all effects of a combination, or the rivals of an ambiguous answer.
    pub effects: Vec<EffectFound>,
    /// Why the model is inadequate: sizes beyond physical limits, a larger torque error, parameters beyond their
    /// tolerances.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inadequate: Vec<String>,
    /// Most probable physically possible causes of an inadequate model; they are no answer.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub possible: Vec<EffectFound>,
    /// Form of the model error, if no cause of the library explains it.
    pub form: Option<FormFound>,
    /// Causes that are confounded with the finding and were not in the library.
    pub partner_missing: Vec<&'static str>,
    /// Log-odds of the best hypothesis against the null hypothesis.
    pub log_odds: f64,
    /// Detection threshold of `log_odds`.
    pub threshold: f64,
    /// Held-out gain.
    pub gain: Option<Gain>,
    /// Residual before and after.
    pub residual: Residual,
    /// Relative error of a drive's torque.
    pub torque_error: Option<TorqueError>,
    /// Error that remains, in physical units; empty for blocks without a simulation.
    pub remaining: Vec<RemainingError>,
    /// Nuisance parameters with their fitted values: calibrated, or beyond their tolerances.
    pub fitted: Vec<FittedParameter>,
    /// Errors of free runs of a tossed body.
    pub free_run: Option<FreeRun>,
    /// Whether gain and residual are those of held-out motion.
    pub held_out: bool,
    /// Causes that were ruled out, in rising order of their log-odds.
    pub ruled_out: Vec<RuledOut>,
    /// Causes that are not detectable with these data.
    pub not_visible: Vec<NotVisible>,
    /// Pairs of causes that are confounded in these data.
    #[serde(rename = "alike")]
    pub confounded: Vec<[&'static str; 2]>,
    /// Nuisance parameters beyond their prior: name and z-score.
    #[serde(rename = "strained")]
    pub nuisances_beyond_prior: Vec<(String, f64)>,
    /// Number of whitened samples in the fit.
    pub samples: usize,
}

impl BlockAnswer {
    /// Returns the largest error that the model has as given.
    pub fn largest_error(&self) -> Option<&RemainingError> {
        self.remaining.iter().max_by(|a, b| a.before.total_cmp(&b.before))
    }

    /// Returns the answer without its causes, because a form outside the library explains the data better.
    #[must_use]
    pub fn without_name(self) -> Self {
        Self { answer: DiagnosisVerdict::NotInLibrary, ..self.without_effects() }
    }

    /// Returns the answer without causes.
    fn without_effects(self) -> Self {
        let (effects, ruled_out, partner_missing) = (Vec::new(), Vec::new(), Vec::new());
        Self { effects, ruled_out, partner_missing, inadequate: Vec::new(), possible: Vec::new(), ..self }
    }

    /// Returns the answer that the model is inadequate for a reason; effects without practical gain remain possible.
    #[must_use]
    pub(crate) fn inadequate_by(mut self, reason: String) -> Self {
        let possible = std::mem::take(&mut self.effects);
        Self { answer: DiagnosisVerdict::ModelInadequate, inadequate: vec![reason], possible, ..self.without_effects() }
    }

    /// Returns the answer without a finding, because another block may cause the residual.
    #[must_use]
    pub(crate) fn withheld(self) -> Self {
        let residual = Residual { after: self.residual.before, ..self.residual };
        Self {
            answer: DiagnosisVerdict::Withheld,
            form: None,
            gain: None,
            fitted: self.fitted.iter().filter(|own| own.is_beyond_tolerance()).cloned().collect(),
            residual,
            ..self.without_effects()
        }
    }

    /// Returns the answer with the form of a model error outside the library.
    #[must_use]
    pub fn with_form(mut self, form: &Form, prismatic: bool) -> Self {
        let term = |(hypothesis, share): &(Hypothesis, f64)| FormTerm {
            id: hypothesis.effect.id,
            name: hypothesis.name,
            stability: *share,
            parameters: parameters(&form.candidate, hypothesis, prismatic),
        };
        if let Some(adequacy) = form.candidate.adequacy.filter(|_| form.holds) {
            self.gain = Some(Gain::of(&adequacy));
            self.residual.after = adequacy.with.sqrt();
        }
        self.form = Some(FormFound {
            terms: form.terms.iter().map(term).collect(),
            holds: form.holds,
            gain: form.candidate.adequacy.as_ref().map(Gain::of),
            residual: form.candidate.adequacy.map(|adequacy| adequacy.with.sqrt()),
        });
        self
    }

    /// Returns the answer with an effect that was found without a fit; an unexplained residual may resemble it, too.
    #[must_use]
    pub(crate) fn beside(mut self, found: Beside) -> Self {
        let Beside { effect, name, parameters, log_odds } = found;
        if self.answer.is_open() {
            return self;
        }
        if self.answer < DiagnosisVerdict::Named {
            // An effect without practical gain is no longer the answer.
            self.effects.clear();
        }
        let p = 1.0 / (1.0 + (-log_odds).exp());
        let (id, block, covariance) = (effect.id, self.block, Vec::new());
        let names: Vec<&str> = parameters.keys().map(String::as_str).collect();
        let size = EffectSize::among(&parameters, &names);
        self.effects.push(EffectFound { id, name, block, p, log_odds, size, parameters, covariance });
        self.log_odds = self.log_odds.max(log_odds);
        self.answer = self.answer.max(DiagnosisVerdict::Named);
        self
    }
}

/// Effect that was found without a fit: from repeat-to-repeat variance, or from the readings themselves.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    /// Its row of the effect table.
    pub(crate) effect: &'static Effect,
    /// Short description.
    pub(crate) name: &'static str,
    /// Parameters by name.
    pub(crate) parameters: BTreeMap<String, ParameterEstimate>,
    /// Log-odds for it against none.
    pub(crate) log_odds: f64,
}
