//! Estimates of a contact's parameters: value with interval where the data determine it, otherwise the reason.

use super::uncertainty::ParameterUncertainty;
use nalgebra::DVector;
use serde::Serialize;
use softdock_diagnosis::inference::fit::Fitted;
use softdock_diagnosis::model::unknown::ParameterPrior;

/// Largest half-width of a 95 % interval over the value at which a parameter counts as determined.
pub const DETERMINED: f64 = 0.5;
/// The same of an exponent, absolute.
pub const DETERMINED_EXPONENT: f64 = 0.2;

/// Least half-width of an interval as a share of the value: smoothed motion and steps of the evaluation change it by up to
/// 3e-4, which the scatter of residuals does not show.
const SYSTEMATIC: f64 = 1e-3;

/// What the data state about a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactDetermination {
    /// A value with its interval.
    Determined,
    /// Only an upper bound: the value is not distinguishable from 0.
    Bounded,
    /// Neither.
    NotDetermined,
}

/// Estimate of a parameter under the key of a scenario or rig file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactEstimate {
    /// Key in the file.
    pub key: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Whether the data determine it.
    pub determination: ContactDetermination,
    /// Value; `None` unless determined.
    pub value: Option<f64>,
    /// Lower and upper end of the 95 % interval; of a bounded parameter 0 and the bound.
    pub interval: Option<[f64; 2]>,
    /// Reason why there is no value, or empty.
    pub reason: String,
}

impl ContactEstimate {
    /// Builds an estimate that the data do not determine at all.
    pub fn undetermined(key: &'static str, unit: &'static str, reason: impl Into<String>) -> Self {
        let determination = ContactDetermination::NotDetermined;
        Self { key, unit, determination, value: None, interval: None, reason: reason.into() }
    }

    /// Builds the estimate of a value with an interval, determined if it is narrow.
    pub fn new(key: &'static str, unit: &'static str, value: f64, interval: [f64; 2]) -> Self {
        let half = 0.5 * (interval[1] - interval[0]);
        let is_exponent = key == "exponent";
        let narrow = if is_exponent { half <= DETERMINED_EXPONENT } else { half <= DETERMINED * value.abs() };
        let (determination, reason) = if narrow && (is_exponent || interval[0] > 0.0) {
            (ContactDetermination::Determined, String::new())
        } else {
            let share = 100.0 * half / value.abs().max(f64::MIN_POSITIVE);
            let wide = match share < 1e4 {
                true => format!("its 95 % interval is ± {share:.0} % wide"),
                false => "the residual does not depend on it within its legal range".to_owned(),
            };
            (ContactDetermination::NotDetermined, wide)
        };
        let value = (determination == ContactDetermination::Determined).then_some(value);
        Self { key, unit, determination, value, interval: value.map(|_| interval), reason }
    }

    /// The same of a parameter that is never negative; `most` is a size that would have a clear effect.
    pub fn positive(key: &'static str, unit: &'static str, value: f64, interval: [f64; 2], most: f64) -> Self {
        let interval = [interval[0].max(0.0), interval[1]];
        let found = Self::new(key, unit, value, interval);
        if found.determination == ContactDetermination::Determined || interval[1] > most {
            return found;
        }
        let reason = "it is not distinguishable from 0".to_owned();
        Self { determination: ContactDetermination::Bounded, interval: Some([0.0, interval[1]]), reason, ..found }
    }
}

/// A fit with the covariance of its parameters.
pub struct FittedContact<'a> {
    /// The fit.
    pub fitted: &'a Fitted,
    /// Its uncertainty.
    pub uncertainty: &'a ParameterUncertainty,
}

impl FittedContact<'_> {
    /// Returns the index of a parameter by its name in the field table.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.fitted.unknowns.iter().position(|unknown| unknown.name == name)
    }

    fn weight(&self, place: usize, weight: f64) -> DVector<f64> {
        let mut weights = DVector::zeros(self.fitted.z.len());
        weights[place] = weight;
        weights
    }

    /// Value and 95 % interval of a parameter; that of a factor is multiplicative.
    pub fn value(&self, place: usize) -> (f64, [f64; 2]) {
        let (prior, z) = (self.fitted.unknowns[place].prior, self.fitted.z[place]);
        let value = prior.value(z);
        let half = |weight: f64| self.uncertainty.quantile * self.uncertainty.deviation(&self.weight(place, weight));
        match prior {
            ParameterPrior::LogNormal { spread, .. } => {
                let factor = half(spread).hypot(SYSTEMATIC).min(300.0).exp();
                (value, [value / factor, value * factor])
            }
            _ => {
                let half = half(prior.slope(z)).hypot(SYSTEMATIC * value);
                (value, [value - half, value + half])
            }
        }
    }

    /// Value and 95 % interval of `K = K1 1000^e` (N/m^n) from the stiffness at 1 mm and the exponent less one.
    pub fn power_stiffness(&self, stiffness: usize, exponent: usize) -> (f64, [f64; 2]) {
        let (k, e) = (&self.fitted.unknowns[stiffness].prior, &self.fitted.unknowns[exponent].prior);
        let (zk, ze) = (self.fitted.z[stiffness], self.fitted.z[exponent]);
        let metres = 1000.0_f64.ln();
        let value = k.value(zk) * (e.value(ze) * metres).exp();
        let weights = self.weight(stiffness, k.slope(zk) / k.value(zk)) + self.weight(exponent, e.slope(ze) * metres);
        let scatter = self.uncertainty.quantile * self.uncertainty.deviation(&weights);
        let factor = scatter.hypot(SYSTEMATIC).min(300.0).exp();
        (value, [value / factor, value * factor])
    }
}
