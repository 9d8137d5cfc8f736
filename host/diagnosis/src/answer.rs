//! What a diagnosis says of a block, and with which numbers.

use crate::free_run::FreeRun;
use crate::inference::adequacy::Adequacy;
use crate::inference::evidence::{Interval, interval};
use crate::inference::unknown::{Role, Unknown};
use crate::judge::Candidate;
use crate::library::Hypothesis;
use crate::outside::Form;
use crate::torque_error::TorqueError;
use crate::variance::ExcessNoise;
use serde::Serialize;
use softdock_campaign::rig::sliding;
use softdock_kernels::effects::Effect;
use std::collections::BTreeMap;

/// What a diagnosis can answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is wrong that these data could show.
    NoEffect,
    /// Something is there by the statistics, but knowing it gains less than anybody would notice.
    NoPracticalEffect,
    /// One or several causes.
    Named,
    /// One of several causes, which these data cannot tell apart.
    Ambiguous,
    /// Something is wrong that no cause of the library explains.
    NotInLibrary,
}

impl Verdict {
    /// Whether causes go with it.
    pub(crate) fn names(self) -> bool {
        matches!(self, Self::Named | Self::Ambiguous | Self::NoPracticalEffect)
    }
}

/// A cause.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectFound {
    /// Catalogue id.
    pub id: &'static str,
    /// What it is, in a few words.
    pub name: &'static str,
    /// Where it acts.
    pub block: &'static str,
    /// Its probability.
    pub p: f64,
    /// Its numbers.
    pub parameters: BTreeMap<String, Estimate>,
    /// Their covariance in the order of their names, SI units; empty where there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
}

/// A number with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
    /// Unit.
    pub unit: String,
}

impl Estimate {
    pub(crate) fn new(Interval { value, lo, hi }: Interval, unit: &str) -> Self {
        Self { value, lo, hi, unit: unit.to_owned() }
    }
}

/// A cause that was ruled out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RuledOut {
    /// Catalogue id.
    pub id: &'static str,
    /// Where it would act.
    pub block: &'static str,
    /// By how much the best answer is more probable: natural logarithm of the odds.
    pub log_odds: f64,
    /// Whether its best numbers are not what its name says: a size that is nothing, a form that is implausible, or a drift
    /// that is left of what drifts.
    pub implausible: bool,
    /// Root mean square of what it leaves on held-out motion, in units of the noise.
    pub residual: Option<f64>,
}

/// A cause that these data could not have shown at a plausible size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotVisible {
    /// Catalogue id.
    pub id: &'static str,
    /// What it is, in a few words.
    pub name: &'static str,
    /// Where it would act.
    pub block: &'static str,
    /// Log-odds that it would have at a plausible size.
    pub log_odds: f64,
}

/// The gain on held-out motion: by how much the root mean square of the residual falls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Best value.
    pub value: f64,
    /// Lower bound of the 95 % interval.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
    /// The same on a motion that was not recorded, if several were: some motions show an effect that others hardly have.
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

/// Root mean square of the whitened residual, in units of the noise: 1 where nothing but noise is left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// With the model as it is.
    pub before: f64,
    /// With the answer.
    pub after: f64,
}

/// What something outside the library behaves like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FormFound {
    /// Its terms.
    pub terms: Vec<FormTerm>,
    /// Whether it explains motion that no fit has seen as a named cause must; else it is a hint.
    pub holds: bool,
    /// Held-out gain.
    pub gain: Option<Gain>,
    /// Root mean square of what it leaves on held-out motion, in units of the noise.
    pub residual: Option<f64>,
}

/// A term of a form.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FormTerm {
    /// `dictionary`, or the catalogue id of an effect that acts beside.
    pub id: &'static str,
    /// What it is, in a few words.
    pub name: &'static str,
    /// Share of the data's halves that picked it.
    pub stability: f64,
    /// Its numbers.
    pub parameters: BTreeMap<String, Estimate>,
}

/// The answer for a block.
#[derive(Clone, Debug, Serialize)]
pub struct BlockAnswer {
    /// The block.
    pub block: &'static str,
    /// The answer.
    pub answer: Verdict,
    /// The causes: all of a combination, or the rivals of an ambiguous answer.
    pub effects: Vec<EffectFound>,
    /// What it behaves like, if no cause of the library explains it.
    pub form: Option<FormFound>,
    /// The causes that look like what is found, and were not in the library.
    pub partner_missing: Vec<&'static str>,
    /// Log-odds of the best explanation against none, and from where on it counts.
    pub log_odds: f64,
    /// See `log_odds`.
    pub threshold: f64,
    /// Held-out gain.
    pub gain: Option<Gain>,
    /// Residual before and after.
    pub residual: Residual,
    /// Relative error of a drive's torque.
    pub torque_error: Option<TorqueError>,
    /// Errors of free runs of a tossed body.
    pub free_run: Option<FreeRun>,
    /// Whether those were taken from held-out motion.
    pub held_out: bool,
    /// What was ruled out, the nearest first.
    pub ruled_out: Vec<RuledOut>,
    /// What these data could not have shown.
    pub not_visible: Vec<NotVisible>,
    /// Causes that these data cannot tell apart, by groups of two.
    pub alike: Vec<[&'static str; 2]>,
    /// Nuisances that the answer pulls beyond their tolerance: name and how many tolerances.
    pub strained: Vec<(String, f64)>,
    /// Number of whitened samples that the fit saw.
    pub samples: usize,
}

impl BlockAnswer {
    /// The answer where something outside the library explains the data better than what is named.
    #[must_use]
    pub fn denied(self) -> Self {
        Self { answer: Verdict::NotInLibrary, ..self.nameless() }
    }

    /// The answer without any cause.
    fn nameless(self) -> Self {
        let (effects, ruled_out, partner_missing) = (Vec::new(), Vec::new(), Vec::new());
        Self { effects, ruled_out, partner_missing, ..self }
    }

    /// The answer where what is left may be no fault of this block: it finds nothing, and none of its library's effects
    /// could have been shown.
    #[must_use]
    pub(crate) fn withheld(self, library: &[Hypothesis]) -> Self {
        let hidden = |hypothesis: &Hypothesis| NotVisible {
            id: hypothesis.effect.id,
            name: hypothesis.name,
            block: self.block,
            log_odds: 0.0,
        };
        let not_visible = library.iter().map(hidden).collect();
        let residual = Residual { after: self.residual.before, ..self.residual };
        Self { answer: Verdict::NoEffect, form: None, gain: None, residual, not_visible, ..self.nameless() }
    }

    /// The answer with what something outside the library behaves like.
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

    /// The answer with noise beyond a sensor's own, where repeats differ by more than that, and with the steps that such
    /// noise comes from. `without` are effects that the library goes without.
    #[must_use]
    pub fn with_noise(self, noise: &ExcessNoise, without: &[String]) -> Self {
        let stairs = self.effects.iter().any(|effect| effect.id.starts_with("S6"));
        // A sensor whose readings are stairs differs at their edges.
        if noise.log_odds < self.threshold || stairs && noise.step.is_none() {
            return self;
        }
        let steps = noise.rounding().filter(|_| !stairs);
        let beyond = Some(noise.beyond()).filter(|beyond| beyond.log_odds >= self.threshold);
        steps.into_iter().chain(beyond).fold(self, |answer, found| {
            match without.iter().any(|id| id == found.effect.id) {
                true => answer.denied(),
                false => answer.beside(found),
            }
        })
    }

    /// The answer with an effect that was not found by a fit; what nothing explains may look like it, too.
    #[must_use]
    pub(crate) fn beside(mut self, found: Beside) -> Self {
        let Beside { effect, name, parameters, log_odds } = found;
        if self.answer == Verdict::NotInLibrary {
            return self;
        }
        if self.answer < Verdict::Named {
            // What has no practical effect is not the answer any more.
            self.effects.clear();
        }
        let p = 1.0 / (1.0 + (-log_odds).exp());
        let (id, block, covariance) = (effect.id, self.block, Vec::new());
        self.effects.push(EffectFound { id, name, block, p, parameters, covariance });
        self.log_odds = self.log_odds.max(log_odds);
        self.answer = self.answer.max(Verdict::Named);
        self
    }
}

/// An effect that was found beside the fits: by what repeats differ by, or by the readings themselves.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    /// Its row of the effect table.
    pub(crate) effect: &'static Effect,
    /// What it is, in a few words.
    pub(crate) name: &'static str,
    /// Its numbers.
    pub(crate) parameters: BTreeMap<String, Estimate>,
    /// Log-odds for it against none.
    pub(crate) log_odds: f64,
}

/// The numbers of an effect in a fit.
pub(crate) fn parameters(
    candidate: &Candidate,
    hypothesis: &Hypothesis,
    prismatic: bool,
) -> BTreeMap<String, Estimate> {
    let mut all = BTreeMap::new();
    for (place, unknown) in candidate.fitted.unknowns.iter().enumerate() {
        let own = hypothesis.unknowns.iter().any(|own| own.field == unknown.field);
        if own && unknown.role != Role::Nuisance {
            let interval = interval(&unknown.prior, candidate.fitted.z[place], candidate.deviations[place]);
            let unit = if prismatic { sliding(unknown.unit) } else { unknown.unit };
            all.insert(unknown.name.clone(), Estimate::new(interval, unit));
        }
    }
    all
}

/// Covariance of an effect's numbers in a fit, in the order of their names, as large as their deviations have it.
pub(crate) fn covariance(candidate: &Candidate, hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
    let (fitted, covariance) = (&candidate.fitted, candidate.covariance());
    let own = |unknown: &Unknown| unknown.role != Role::Nuisance;
    let of_effect = |unknown: &Unknown| hypothesis.unknowns.iter().any(|one| one.field == unknown.field);
    let mut places: Vec<usize> = (0..fitted.unknowns.len())
        .filter(|place| own(&fitted.unknowns[*place]) && of_effect(&fitted.unknowns[*place]))
        .collect();
    places.sort_by(|a, b| fitted.unknowns[*a].name.cmp(&fitted.unknowns[*b].name));
    let slope = |place: usize| fitted.unknowns[place].prior.slope(fitted.z[place]);
    let cell = |a: usize, b: usize| slope(a) * covariance[(a, b)] * slope(b);
    places.iter().map(|a| places.iter().map(|b| cell(*a, *b)).collect()).collect()
}
