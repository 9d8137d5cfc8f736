//! Start values of a drive by regression of its torque over its motion.

use crate::figures::{Regression, Smoothed, extent, regress, rms, smoothed};

/// Parts of a log that are left out in turn.
const PARTS: usize = 8;
/// A fit that leaves more of the torque unexplained gives no start values.
const WORST: f64 = 0.5;
/// Tolerances are at least this share, and a value whose error exceeds the other is not written.
const LEAST_SCATTER: f64 = 0.02;
const LARGEST_SCATTER: f64 = 0.5;
/// The weight is fitted if it reduces the unexplained share to less than this share of it.
const WEIGHT_GAIN: f64 = 0.9;
/// A joint that moves less stands still \[rad, m\].
const LEAST_ANGLE: f64 = 0.02;
const LEAST_TRAVEL: f64 = 2e-3;
/// Speed over which friction changes its sign, as a share of the root mean square of the speed.
const SIGN_SPEED: f64 = 0.05;

/// A value with its standard error by the jackknife, as a share of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StartValue {
    pub(crate) value: f64,
    pub(crate) scatter: f64,
}

/// Start values of a drive, SI at the joint's side.
#[derive(Clone, Debug)]
pub(crate) struct DriveFit {
    pub(crate) inertia: StartValue,
    pub(crate) viscous: Option<StartValue>,
    pub(crate) coulomb: Option<StartValue>,
    /// Torque at standstill; of a sliding joint the weight is part of it.
    pub(crate) offset: f64,
    /// Standard error of the offset.
    pub(crate) offset_error: f64,
    /// Torque of the weight and the angle at which it is greatest.
    pub(crate) weight: Option<(f64, f64)>,
    /// Standard error of the weight's torque, the greater one of its two components.
    pub(crate) weight_error: f64,
    /// Torque per unit of the model's torque; 1 without a model.
    pub(crate) scale: f64,
    /// Share of the torque (root mean square) that the fit leaves.
    pub(crate) unexplained: f64,
}

/// Torque of a joint, and what is known of its load.
pub(crate) struct Load<'a> {
    pub(crate) time: &'a [f64],
    pub(crate) step: f64,
    pub(crate) motion: &'a Smoothed,
    /// Torque as recorded, times the known scale.
    pub(crate) torque: &'a [f64],
    pub(crate) prismatic: bool,
    /// Torque of the links by a model, and whether the scale of the recorded torque is unknown.
    pub(crate) model: Option<(&'a [f64], bool)>,
}

impl DriveFit {
    /// Fits inertia, friction, offset and weight; none if the log does not show an inertia.
    pub(crate) fn of(load: &Load) -> Option<Self> {
        let least = if load.prismatic { LEAST_TRAVEL } else { LEAST_ANGLE };
        let (low, high) = extent(&load.motion.value);
        if high - low < least {
            return None;
        }
        // The same low-pass on both sides: a parabola over the same window.
        let torque = smoothed(load.time, load.torque, load.step).value;
        let rate = &load.motion.rate;
        let speed = SIGN_SPEED * rms(rate);
        if speed <= 0.0 {
            return None;
        }
        let sign = rate.iter().map(|rate| (rate / speed).tanh()).collect();
        let ones = vec![1.0; rate.len()];
        let base = vec![load.motion.acceleration.clone(), rate.clone(), sign, ones];
        match load.model {
            None => Self::alone(load, base, &torque),
            Some((model, false)) => {
                let rest: Vec<f64> = torque.iter().zip(model).map(|(torque, model)| torque - model).collect();
                let mut fit = Self::from_parts(&base, &rest, 1.0)?;
                fit.unexplained *= rms(&rest) / rms(&torque);
                Some(fit)
            }
            Some((model, true)) => {
                let mut columns = base;
                columns.push(model.to_vec());
                let whole = regress(&columns, &torque)?;
                let per_unit = whole.coefficients[4];
                let is_sharp = whole.errors[4] < 0.02 * per_unit.abs() && per_unit != 0.0;
                is_sharp.then(|| Self::from_parts(&columns, &torque, 1.0 / per_unit)).flatten()
            }
        }
    }

    /// A joint without a model of its load: the weight follows the cosine of the angle, if the log shows it.
    fn alone(load: &Load, base: Vec<Vec<f64>>, torque: &[f64]) -> Option<Self> {
        let plain = Self::from_parts(&base, torque, 1.0);
        if load.prismatic {
            return plain;
        }
        let angle = &load.motion.value;
        let mut columns = base;
        columns.push(angle.iter().map(|angle| angle.cos()).collect());
        columns.push(angle.iter().map(|angle| angle.sin()).collect());
        let Some(mut weighted) = Self::from_parts(&columns, torque, 1.0) else { return plain };
        let whole = regress(&columns, torque)?;
        let (cosine, sine) = (whole.coefficients[4], whole.coefficients[5]);
        let is_sharp = whole.errors[4].max(whole.errors[5]) < 0.2 * cosine.hypot(sine);
        if !is_sharp || plain.as_ref().is_some_and(|plain| weighted.unexplained > WEIGHT_GAIN * plain.unexplained) {
            return plain;
        }
        weighted.weight = Some((cosine.hypot(sine), sine.atan2(cosine)));
        Some(weighted)
    }

    fn from_parts(columns: &[Vec<f64>], torque: &[f64], scale: f64) -> Option<Self> {
        let whole = regress(columns, torque)?;
        let rows = torque.len();
        // Jackknife: each part is left out in turn, so that every fit sees motion both ways.
        let parts: Vec<Regression> = (0..PARTS)
            .filter_map(|part| {
                let left_out = part * rows / PARTS..(part + 1) * rows / PARTS;
                let mut kept = torque.to_vec();
                kept[left_out].fill(f64::NAN);
                regress(columns, &kept)
            })
            .collect();
        let error = |place: usize| {
            let of_parts = || parts.iter().map(|part| part.coefficients[place] * scale);
            let mean = of_parts().sum::<f64>() / parts.len().max(1) as f64;
            let share = (PARTS - 1) as f64 / PARTS as f64;
            (share * of_parts().map(|part| (part - mean).powi(2)).sum::<f64>()).sqrt()
        };
        let value = |place: usize| {
            let (value, error) = (whole.coefficients[place] * scale, error(place));
            let scatter = if parts.len() < PARTS { f64::INFINITY } else { error / value.abs() };
            let start = StartValue { value, scatter: scatter.max(LEAST_SCATTER) };
            (value > 0.0 && scatter < LARGEST_SCATTER).then_some(start)
        };
        let is_usable = whole.unexplained < WORST;
        Some(Self {
            inertia: value(0).filter(|_| is_usable)?,
            viscous: value(1),
            coulomb: value(2),
            offset: whole.coefficients[3] * scale,
            offset_error: error(3),
            weight: None,
            weight_error: (4..columns.len()).map(error).fold(0.0, f64::max),
            scale,
            unexplained: whole.unexplained,
        })
    }
}
