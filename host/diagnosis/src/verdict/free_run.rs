//! Errors of free runs of a tossed body: speed after the first impact, and rest position.

use crate::verdict::estimates::ParameterEstimate;
use serde::Serialize;
use std::collections::BTreeMap;

/// A median with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Median {
    /// The median.
    pub value: f64,
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

/// Error of the nominal model and of the model with the identified effects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorReduction {
    /// With the nominal constants.
    pub before: Median,
    /// With the identified effects.
    pub after: Median,
    /// Relative reduction of the median, over the same tosses.
    pub gain: Median,
}

/// Errors of free runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FreeRun {
    /// Number of tosses with a rebound, and with a rest position.
    pub tosses: [usize; 2],
    /// Whether the tosses were held out.
    pub held_out: bool,
    /// Relative error of the speed at the first smooth frame after the first impact.
    pub rebound_speed: ErrorReduction,
    /// Norm of the velocity error at that frame over the measured speed.
    pub rebound_velocity: ErrorReduction,
    /// Distance of the rest position from the measured one along the plane \[m\].
    pub rest_position: ErrorReduction,
    /// Effects of the extended model: the best hypothesis, named or not.
    pub with: Vec<FittedEffect>,
}

/// Effect of the extended model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittedEffect {
    /// Catalogue id.
    pub id: &'static str,
    /// What it is, in a few words.
    pub name: &'static str,
    /// Its numbers.
    pub parameters: BTreeMap<String, ParameterEstimate>,
}
