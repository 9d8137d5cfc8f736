//! Fitted parameters of the model under an answer, and the error that remains, in physical units.

use crate::inference::admissibility::REPORTED_Z;
use crate::inference::fit::Fitted;
use crate::model::block::MeasuredBlock;
use crate::model::unknown::Unknown;
use serde::Serialize;
use softdock_campaign::rig::sliding;

/// Nuisance parameter of the model with its fitted value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittedParameter {
    /// Name in the model file.
    pub name: String,
    /// What it means.
    pub meaning: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value in the model.
    pub model: f64,
    /// Fitted value.
    pub value: f64,
    /// Change in tolerances.
    pub tolerances: f64,
}

impl FittedParameter {
    /// Returns the nuisance parameters of a fit.
    pub(crate) fn all(block: &MeasuredBlock, fitted: &Fitted, prismatic: bool) -> Vec<Self> {
        let fields = block.section.parameters();
        let row = |(_, unknown, z): (usize, &Unknown, f64)| Self {
            name: unknown.name.clone(),
            meaning: fields[unknown.field].meaning,
            unit: if prismatic { sliding(unknown.unit) } else { unknown.unit },
            model: unknown.prior.value(0.0),
            value: unknown.prior.value(z),
            tolerances: z,
        };
        fitted.nuisances().map(row).collect()
    }

    /// Returns whether the parameter is so far from the model that the model is wrong, not badly calibrated.
    pub fn is_beyond_tolerance(&self) -> bool {
        self.tolerances.abs() > REPORTED_Z
    }
}

/// Root mean square by which a model misses a signal, without and with the answer, in the signal's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RemainingError {
    /// The signal.
    pub signal: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
    /// With the model as given.
    pub before: f64,
    /// With the answer.
    pub after: f64,
    /// Frequency below which it counts \[Hz\]; `None` for the whole band of the recordings.
    pub below_hz: Option<f64>,
}
