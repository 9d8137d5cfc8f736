//! An effect that a diagnosis found, as it writes it behind a model file.

use super::{At, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// An effect of the catalogue.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EffectTable {
    /// Its id, as `softdock diagnose` reports it (`J3_stribeck`).
    pub(crate) id: At<String>,
    /// Axis of a robot, from 1; in the model of a robot only.
    pub(crate) joint: Option<At<u64>>,
    /// Covariance of its numbers in the order of their names, SI units; default none: they are known exactly.
    pub(crate) covariance: Option<At<Vec<Vec<f64>>>>,
    /// Its numbers by name.
    pub(crate) parameters: BTreeMap<String, Quantity>,
}
