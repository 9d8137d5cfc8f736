//! Estimates of an effect in a fit: parameters, covariance, and the principal size, which states how large it is.

use crate::inference::evidence::{CredibleInterval, interval};
use crate::inference::judge::Candidate;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::{Role, Unknown};
use serde::Serialize;
use softdock_campaign::rig::sliding;
use softdock_kernels::range::UNLIMITED;
use std::collections::BTreeMap;

/// Estimate of a parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterEstimate {
    /// Best value.
    pub value: f64,
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
    /// Unit.
    pub unit: String,
}

impl ParameterEstimate {
    pub(crate) fn new(CredibleInterval { value, lo, hi }: CredibleInterval, unit: &str) -> Self {
        Self { value, lo, hi, unit: unit.to_owned() }
    }
}

/// Principal size of an effect with its 95 % interval, SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectSize {
    /// Parameter that it comes from; of an amplitude, that of the sine.
    pub parameter: String,
    /// The estimate. Of a half width, the whole width; of a sine and a cosine, the amplitude.
    #[serde(flatten)]
    pub estimate: ParameterEstimate,
    /// Value in the model; `None` if the model has no such effect.
    pub model: Option<f64>,
}

/// Prefix of parameters that are half of what they are named after.
const HALF: &str = "half_";

impl EffectSize {
    /// Returns the size of a fitted effect: of its size parameters, the one that is known best relative to its value.
    pub(crate) fn of(
        block: &MeasuredBlock,
        hypothesis: &Hypothesis,
        parameters: &BTreeMap<String, ParameterEstimate>,
    ) -> Option<Self> {
        let names: Vec<&str> = hypothesis.sizes.iter().map(|size| hypothesis.unknowns[*size].name.as_str()).collect();
        if let [sine, cosine] = names[..]
            && sine.ends_with("_sin")
            && cosine.ends_with("_cos")
        {
            return Some(Self::amplitude(sine, parameters.get(sine)?, parameters.get(cosine)?));
        }
        let best = Self::among(parameters, &names)?;
        let nominal = block.base[block.field(&best.parameter)];
        let is_there = nominal != 0.0 && nominal.abs() < UNLIMITED;
        let model = is_there.then_some(nominal);
        Some(Self { model, ..best }.whole())
    }

    /// Returns the size from parameters with these names; the first of equals.
    pub(crate) fn among(parameters: &BTreeMap<String, ParameterEstimate>, names: &[&str]) -> Option<Self> {
        let known =
            |estimate: &ParameterEstimate| estimate.value.abs() / (estimate.hi - estimate.lo).max(f64::MIN_POSITIVE);
        let all = names.iter().filter_map(|name| Some((*name, parameters.get(*name)?)));
        let best = all.reduce(|best, own| if known(own.1) > known(best.1) { own } else { best });
        best.map(|(name, estimate)| Self { parameter: name.to_owned(), estimate: estimate.clone(), model: None })
    }

    /// Returns the whole width for a half width, and any other size as it is.
    fn whole(mut self) -> Self {
        if self.parameter.starts_with(HALF) {
            let ParameterEstimate { value, lo, hi, .. } = &mut self.estimate;
            [value, lo, hi].into_iter().for_each(|own| *own *= 2.0);
            self.model = self.model.map(|model| 2.0 * model);
        }
        self
    }

    /// Returns the amplitude of a sine and a cosine, with the interval to first order.
    fn amplitude(parameter: &str, sine: &ParameterEstimate, cosine: &ParameterEstimate) -> Self {
        let value = sine.value.hypot(cosine.value);
        let half = |estimate: &ParameterEstimate| 0.5 * (estimate.hi - estimate.lo) * estimate.value;
        let width = if value > 0.0 { half(sine).hypot(half(cosine)) / value } else { 0.0 };
        let (lo, hi) = ((value - width).max(0.0), value + width);
        let estimate = ParameterEstimate { value, lo, hi, unit: sine.unit.clone() };
        Self { parameter: parameter.to_owned(), estimate, model: None }
    }
}

/// Returns the parameters of an effect in a fit.
pub(crate) fn parameters(
    candidate: &Candidate,
    hypothesis: &Hypothesis,
    prismatic: bool,
) -> BTreeMap<String, ParameterEstimate> {
    let mut all = BTreeMap::new();
    for (place, unknown) in candidate.fitted.unknowns.iter().enumerate() {
        let own = hypothesis.unknowns.iter().any(|own| own.field == unknown.field);
        if own && unknown.role != Role::Nuisance {
            let interval = interval(&unknown.prior, candidate.fitted.z[place], candidate.deviations[place]);
            let unit = if prismatic { sliding(unknown.unit) } else { unknown.unit };
            all.insert(unknown.name.clone(), ParameterEstimate::new(interval, unit));
        }
    }
    all
}

/// Returns the covariance of an effect's parameters in a fit, in the order of their names, scaled to their standard
/// deviations.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, half: f64) -> ParameterEstimate {
        ParameterEstimate { value, lo: value - half, hi: value + half, unit: "N m".to_owned() }
    }

    #[test]
    fn best_known_parameter_states_the_size() {
        let parameters = BTreeMap::from([("a".to_owned(), estimate(1.0, 0.5)), ("b".to_owned(), estimate(-2.0, 0.1))]);
        assert_eq!(EffectSize::among(&parameters, &["a", "b"]).map(|size| size.parameter), Some("b".to_owned()));
        assert_eq!(EffectSize::among(&parameters, &["c"]), None);
    }

    #[test]
    fn amplitude_does_not_depend_on_the_phase() {
        let [along, across] =
            [(0.0, 5.0), (3.0, 4.0)].map(|(s, c)| EffectSize::amplitude("x_sin", &estimate(s, 0.2), &estimate(c, 0.2)));
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(along.estimate.value, 5.0) && near(across.estimate.value, 5.0));
        assert!(near(along.estimate.lo, across.estimate.lo) && near(along.estimate.hi, 5.2));
    }

    #[test]
    fn half_width_is_stated_as_the_whole() {
        let half = EffectSize { parameter: "half_backlash".to_owned(), estimate: estimate(0.4, 0.1), model: Some(0.2) };
        let whole = half.whole();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(whole.estimate.value, 0.8) && near(whole.estimate.lo, 0.6) && whole.model == Some(0.4));
    }
}
