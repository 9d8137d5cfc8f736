//! Gear stiffness from the difference of the encoders before and behind the gear.

use crate::filter::Smoother;
use crate::log::Recording;
use crate::model::predicted;
use crate::motion::{Motion, Preparation};
use serde::Serialize;
use softdock_campaign::Robot;

/// Share of the difference's variance that the load must explain before a stiffness is believed.
const LEAST_EXPLAINED: f64 = 0.5;

/// What the second encoder of a joint shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Elasticity {
    /// Joint, from 0.
    pub joint: usize,
    /// Stiffness `load / (motor angle - link angle)` \[N m/rad\].
    pub stiffness_n_m_per_rad: f64,
    /// Share of the difference's variance that the load explains.
    pub explained: f64,
    /// Root mean square of the difference \[rad\].
    pub difference_rad: f64,
}

impl Elasticity {
    /// Worth writing into the model.
    pub fn is_believed(&self) -> bool {
        self.explained >= LEAST_EXPLAINED && self.stiffness_n_m_per_rad > 0.0
    }
}

/// For each joint with a second encoder: the difference of the angles against the load that the links put on the gear.
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
        let (mut load, mut difference) = (Vec::new(), Vec::new());
        for recording in recordings {
            let Some(link) = recording.link_angle.get(&joint) else { continue };
            let motion = Motion::new(recording, &preparation).ok()?;
            load.extend(predicted(&bare, &motion).swap_remove(joint));
            let link = smoother.smooth(link, recording.step);
            difference.extend(motion.angle[joint].iter().zip(link).map(|(motor, link)| motor - link));
        }
        (!load.is_empty()).then(|| slope(joint, &load, &difference))
    };
    joints.filter_map(of_joint).collect()
}

fn slope(joint: usize, load: &[f64], difference: &[f64]) -> Elasticity {
    let mean = |series: &[f64]| series.iter().sum::<f64>() / series.len() as f64;
    let (of_load, of_difference) = (mean(load), mean(difference));
    let product = |a: &[f64], b: &[f64], ma: f64, mb: f64| a.iter().zip(b).map(|(a, b)| (a - ma) * (b - mb)).sum::<f64>();
    let cross = product(load, difference, of_load, of_difference);
    let power = product(load, load, of_load, of_load).max(f64::MIN_POSITIVE);
    let variance = product(difference, difference, of_difference, of_difference).max(f64::MIN_POSITIVE);
    Elasticity {
        joint,
        stiffness_n_m_per_rad: power / cross,
        explained: cross * cross / (power * variance),
        difference_rad: crate::system::rms(difference),
    }
}
