//! Gear stiffness from the difference of the motor-side and link-side encoders.

use crate::filter::Smoother;
use crate::log::Recording;
use crate::model::predicted;
use crate::motion::{Preparation, RecordedMotion};
use serde::Serialize;
use softdock_campaign::Robot;

/// Share of the variance remaining after the recorder latency that the load must explain for a valid stiffness.
const LEAST_EXPLAINED: f64 = 0.5;

/// Elasticity of a joint from its second encoder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Elasticity {
    /// Joint, from 0.
    pub joint: usize,
    /// Root mean square of motor angle - link angle about its mean \[rad\].
    pub difference_rad: f64,
    /// Latency of the second encoder relative to the motor's \[s\].
    pub lag_s: f64,
    /// Share of the difference's variance that this latency explains.
    pub explained_by_lag: f64,
    /// Stiffness `load / (motor angle - link angle)` after removal of the latency \[N m/rad\].
    pub stiffness_n_m_per_rad: f64,
    /// Share of the remaining variance that the load explains.
    pub explained_by_load: f64,
}

impl Elasticity {
    /// Returns whether the stiffness is valid for the model.
    pub fn is_believed(&self) -> bool {
        self.explained_by_load >= LEAST_EXPLAINED && self.stiffness_n_m_per_rad > 0.0
    }
}

/// Returns the elasticity of each joint with a second encoder, from the angle difference and the load of the gear.
///
/// The load is the identified robot's without rotors, friction and offsets, which act before the gear.
pub fn elasticity(robot: &Robot, recordings: &[Recording], preparation: &Preparation) -> Vec<Elasticity> {
    let mut bare = robot.model.clone();
    for joint in &mut bare.joints {
        joint.drive.rotor_inertia = 0.0;
        joint.drive.torque_offset = 0.0;
        joint.friction.coulomb = 0.0;
        joint.friction.stribeck = 0.0;
        joint.friction.viscous = 0.0;
        joint.friction.load_coefficient = 0.0;
    }
    let preparation = Preparation { period: None, ..*preparation };
    let smoother = Smoother::LowPass { cutoff: preparation.cutoff };
    let joints = 0..robot.model.joints.len();
    let of_joint = |joint: usize| {
        let (mut load, mut rate, mut difference) = (Vec::new(), Vec::new(), Vec::new());
        for recording in recordings {
            let Some(link) = recording.link_angle.get(&joint) else { continue };
            let motion = RecordedMotion::new(recording, &preparation).ok()?;
            load.extend(predicted(&bare, &motion).swap_remove(joint));
            rate.extend_from_slice(&motion.rate[joint]);
            let link = smoother.smooth(link, recording.step);
            difference.extend(motion.angle[joint].iter().zip(link).map(|(motor, link)| motor - link));
        }
        (!load.is_empty()).then(|| split(joint, centred(&load), &centred(&rate), centred(&difference)))
    };
    joints.filter_map(of_joint).collect()
}

fn centred(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    series.iter().map(|value| value - mean).collect()
}

/// Lag first: it belongs to the recorder; then the stiffness from what is left of load and difference.
fn split(joint: usize, load: Vec<f64>, rate: &[f64], difference: Vec<f64>) -> Elasticity {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let power = |a: &[f64]| product(a, a).max(f64::MIN_POSITIVE);
    let without_rate = |series: &[f64]| -> (f64, Vec<f64>) {
        let factor = product(series, rate) / power(rate);
        (factor, series.iter().zip(rate).map(|(value, rate)| value - factor * rate).collect())
    };
    let (lag_s, rest) = without_rate(&difference);
    let (_, load) = without_rate(&load);
    let cross = product(&load, &rest);
    Elasticity {
        joint,
        difference_rad: crate::system::rms(&difference),
        lag_s,
        explained_by_lag: 1.0 - power(&rest) / power(&difference),
        stiffness_n_m_per_rad: power(&load) / cross,
        explained_by_load: cross * cross / (power(&load) * power(&rest)),
    }
}
