//! Arm controllers on a floating base: computed torque holds the posture, Cartesian impedance comes to rest.

use super::lanes::six_joints;
use softdock_kernels::arm_motion::no_motion;
use softdock_kernels::guidance::guide;
use softdock_kernels::model::{ArmControl, Thrust};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Bodies, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::thrusters::no_firing;
use softdock_kernels::vector::{Vec3, vec3};

/// Turn of the base at the start \[rad/s\].
const SPIN: Vec3<f64> = vec3(0.05, 0.1, -0.08);

/// Thrusters that accelerate and turn the base while its arm is controlled.
const THRUST: Thrust = Thrust::Approach {
    speed_gain: 50.0,
    lateral_stiffness: 20.0,
    lateral_damping: 50.0,
    attitude_stiffness: 20.0,
    attitude_damping: 40.0,
    max_force: 20.0,
    max_torque: 10.0,
};

/// Ticks of 1 ms under a controller, no contact, on a base that turns at `spin`; `see` gets the bodies after each.
fn controlled(
    (arm, thrust): (ArmControl, Thrust),
    spin: Vec3<f64>,
    rate: [f64; 6],
    ticks: u32,
    mut see: impl FnMut(&Bodies<f64, 6>),
) {
    let mut model = six_joints(2.5e-4, 1.0);
    model.guidance.arm = arm;
    model.guidance.thrust = thrust;
    let m = Plant::new(model);
    let p = Params {
        base_mass: 400.0,
        target_mass: 300.0,
        chaser_rate: spin,
        offset: vec3(-0.5, 0.1, 0.05),
        closing_speed: 0.05,
        ..Params::null()
    };
    let masses = space_masses(&p);
    let mut s = start::<f64, 6>(&m, &p, &masses);
    s.arm.rate = rate;
    let none = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
    for _ in 0..ticks {
        let u = guide(
            &m,
            &p,
            &masses,
            &s.arm,
            &s.drives,
            s.chaser.attitude,
            &kinematics(&m, &masses, &s),
            0.0,
            &no_motion(),
            &no_firing(),
        );
        for _ in 0..4 {
            s = advance(&m, &masses, &s, &kinematics(&m, &masses, &s), &u, none);
        }
        s = settle(s);
        see(&s);
    }
}

fn largest(values: [f64; 6]) -> f64 {
    values.into_iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

#[test]
fn computed_torque_holds_the_posture_while_the_base_moves() {
    let mut worst = 0.0f64;
    let law = ArmControl::ComputedTorque { bandwidth: 20.0, damping_ratio: 1.0 };
    controlled((law, THRUST), SPIN, [0.0; 6], 5000, |s| {
        worst = worst.max(largest(s.arm.angle));
    });
    assert!(worst < 1e-6, "posture lost by {worst} rad");
}

#[test]
fn computed_torque_responds_as_the_second_order_system() {
    // q'' = -w^2 q - 2 w q' from q = 0 at rate v: q = v t exp(-w t), at most v / (e w).
    let mut peak = [0.0f64; 6];
    let rate = [0.02, -0.03, 0.04, 0.02, -0.05, 0.03];
    let law = ArmControl::ComputedTorque { bandwidth: 5.0, damping_ratio: 1.0 };
    controlled((law, THRUST), SPIN, rate, 2000, |s| {
        (0..6).for_each(|i| peak[i] = peak[i].max(s.arm.angle[i].abs()));
    });
    for (peak, rate) in peak.iter().zip(rate) {
        let exact = rate.abs() / (5.0 * std::f64::consts::E);
        // A torque held for 1 ms and a step's own damping: w T = 0.5 %, allowed twice.
        assert!((peak / exact - 1.0).abs() < 1e-2, "peak {peak} instead of {exact}");
    }
}

#[test]
fn cartesian_impedance_brings_the_arm_to_rest_at_its_start_posture() {
    let law = ArmControl::CartesianImpedance {
        stiffness: 300.0,
        damping: 150.0,
        rotation_stiffness: 60.0,
        rotation_damping: 30.0,
        joint_damping: 2.0,
    };
    let (mut most, mut last) = (0.0f64, [0.0; 6]);
    controlled((law, Thrust::Off), Vec3::zero(), [0.1, -0.1, 0.1, 0.1, -0.1, 0.1], 60_000, |s| {
        most = most.max(largest(s.arm.angle));
        last = s.arm.angle;
    });
    assert!(most < 0.5, "arm swings by {most} rad");
    assert!(largest(last) < 0.02 * most, "arm still {last:?} rad away of {most}");
}
