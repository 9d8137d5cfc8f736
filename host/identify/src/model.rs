//! Robot model from identified parameters, and predicted torques of a motion.

use crate::layout::{INERTIAL, Layout};
use crate::motion::RecordedMotion;
use crate::system::FrictionShape;
use nalgebra::DVector;
use softdock_campaign::Robot;
use softdock_kernels::manipulator::{Counterweight, Manipulator, inverse_dynamics};
use softdock_kernels::vector::{Sym3, vec3};
use softdock_kernels::with_joints;

/// Separator before the source of the parameters that an earlier identification did not change.
const REST: &str = "; the rest: ";

/// Returns the a-priori robot with the identified parameters; `source` describes their origin.
pub fn identified(prior: &Robot, theta: &DVector<f64>, shapes: &[FrictionShape], source: &str) -> Robot {
    let layout = Layout::of(prior);
    let mut robot = prior.clone();
    for i in 0..layout.joints {
        let (joint, facts) = (&mut robot.model.joints[i], &mut robot.joints[i]);
        let p = &theta.as_slice()[layout.inertial(i)..layout.inertial(i) + INERTIAL];
        let mass = p[9];
        let com = vec3(p[6], p[7], p[8]) * (1.0 / mass);
        let about_origin = Sym3 { xx: p[0], yy: p[3], zz: p[5], xy: p[1], xz: p[2], yz: p[4] };
        joint.link.mass = mass;
        joint.link.com = com;
        joint.link.inertia = about_origin + Sym3::point_mass(-mass, com);
        let ratio = joint.drive.gear_ratio;
        joint.drive.rotor_inertia = theta[layout.rotor(i)] / (ratio * ratio);
        joint.drive.torque_offset = theta[layout.offset(i)];
        let (coulomb, stribeck) = (theta[layout.coulomb(i)], theta[layout.stribeck(i)]);
        joint.friction.coulomb = coulomb;
        joint.friction.viscous = theta[layout.viscous(i)];
        joint.friction.stribeck = stribeck;
        joint.friction.stribeck_speed = shapes[i].speed;
        // Load-dependent friction is not linear in the parameters: the other terms have taken its part.
        joint.friction.load_coefficient = 0.0;
        joint.friction.presliding_stiffness = (coulomb + stribeck) / shapes[i].travel;
        if let Some(place) = layout.counterweight(i) {
            let (sin, cos) = (theta[place], theta[place + 1]);
            joint.counterweight = Some(Counterweight { torque: sin.hypot(cos), angle: (-cos).atan2(sin) });
            facts.sources.counterweight = source.to_owned();
        }
        facts.sources.link = source.to_owned();
        facts.sources.friction = source.to_owned();
        let rest = facts.sources.drive.rsplit_once(REST).map_or(facts.sources.drive.as_str(), |(_, rest)| rest);
        facts.sources.drive = format!("rotor inertia, torque offset: {source}{REST}{rest}");
    }
    robot
}

/// Returns the joint-side torques of a motion \[N m\], filtered as the motion.
pub fn predicted(robot: &Manipulator, motion: &RecordedMotion) -> Vec<Vec<f64>> {
    let raw = with_joints!(robot.joints.len(), raw_torques(robot, motion));
    raw.iter().map(|series| motion.smooth(series)).collect()
}

/// Unfiltered torques, by joint.
fn raw_torques<const N: usize>(robot: &Manipulator, motion: &RecordedMotion) -> Vec<Vec<f64>> {
    let slip: Vec<Vec<f64>> =
        (0..N).map(|joint| motion.slip(joint, robot.joints[joint].friction.presliding_travel())).collect();
    let mut out = vec![Vec::with_capacity(motion.rows()); N];
    for k in 0..motion.rows() {
        let at = |columns: &[Vec<f64>]| -> [f64; N] { std::array::from_fn(|joint| columns[joint][k]) };
        let torques = inverse_dynamics(robot, at(&motion.angle), at(&motion.rate), at(&motion.acceleration), at(&slip));
        out.iter_mut().zip(torques).for_each(|(series, torque)| series.push(torque));
    }
    out
}
