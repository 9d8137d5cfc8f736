//! An industrial robot of plain bodies in its place, for tests and benchmarks: no model of any one robot.

use super::cell::{Carriage, Feedforward, Mount, Payload, Servo};
use super::{
    Capsule, DhRow, Drive, DriveParams, Friction, GRAVITY, Joint, JointLimits, Manipulator, RobotRating, VelocityLoop,
};
use crate::model::Link;
use crate::segment::Segment;
use crate::vector::{Pose, Quat, Sym3, vec3};

/// Geometry of a KUKA KR 300 R2500 ultra with plain bodies.
pub fn robot() -> Manipulator {
    let rows: [(f64, f64, f64, f64, f64); 6] = [
        (0.0, 0.0, 0.675, 0.0, -1.0),
        (0.35, -90.0, 0.0, 0.0, 1.0),
        (1.15, 0.0, 0.0, -90.0, 1.0),
        (-0.041, -90.0, 1.0, 0.0, -1.0),
        (0.0, 90.0, 0.0, 0.0, 1.0),
        (0.0, -90.0, 0.24, 180.0, -1.0),
    ];
    let joint = |(a, alpha, d, offset, sign): (f64, f64, f64, f64, f64)| {
        let row = DhRow { a, alpha: alpha.to_radians(), d, offset: offset.to_radians(), sign };
        Joint {
            link: Link {
                origin: row.origin(),
                mass: 100.0 + 50.0 * a,
                com: vec3(0.1, 0.2 * a, -0.1),
                inertia: Sym3 { xx: 5.0, yy: 6.0, zz: 7.0, xy: 0.3, xz: -0.2, yz: 0.1 },
            },
            sign,
            drive: Drive {
                gear_ratio: 200.0,
                rotor_inertia: 0.01,
                gear_stiffness: 1e6,
                gear_damping: 1e3,
                backlash: 0.0,
                torque_offset: 3.0,
                torque_limit: 1e4,
                static_torque: 5e3,
            },
            friction: Friction {
                coulomb: 100.0,
                viscous: 500.0,
                stribeck: 40.0,
                stribeck_speed: 0.02,
                presliding_stiffness: 1.4e6,
                load_coefficient: 0.0,
            },
            counterweight: None,
            limits: JointLimits { lower: -3.0, upper: 3.0, speed: 1.0, acceleration: 5.0 },
        }
    };
    let workspace = RobotRating { reach: 2.3, payload: 300.0, repeatability: 2e-4 };
    Manipulator {
        joints: rows.map(joint).into(),
        flange: Pose::identity(),
        gravity: vec3(0.0, 0.0, -GRAVITY),
        workspace,
        capsules: vec![
            capsule(0, [0.0, 0.0, -0.1], [0.35, 0.0, 0.0], 0.3),
            capsule(1, [0.0, 0.0, 0.0], [1.15, 0.0, 0.0], 0.25),
            capsule(2, [0.0, 0.0, 0.0], [-0.041, 0.3, 0.0], 0.25),
            capsule(3, [0.0, 0.0, -0.7], [0.0, 0.0, 0.0], 0.2),
            capsule(4, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0], 0.15),
            capsule(5, [0.0, 0.0, -0.1], [0.0, 0.0, 0.0], 0.12),
        ],
    }
}

fn capsule(joint: usize, from: [f64; 3], to: [f64; 3], radius: f64) -> Capsule {
    let point = |[x, y, z]: [f64; 3]| vec3(x, y, z);
    Capsule { joint, axis: Segment { from: point(from), to: point(to) }, radius }
}

/// A carriage of 2 t with a drive of 400 N s/mm.
pub fn carriage() -> Carriage {
    let mut joint = robot().joints[0];
    joint.link.mass = 2000.0;
    (joint.drive.gear_ratio, joint.drive.rotor_inertia, joint.drive.torque_offset) = (400.0, 0.002, 0.0);
    (joint.drive.gear_stiffness, joint.drive.gear_damping, joint.drive.torque_limit) = (1e8, 1e5, 3e4);
    joint.limits = JointLimits { lower: -1.0, upper: 1.0, speed: 1.5, acceleration: 2.0 };
    Carriage { joint, velocity: VelocityLoop { gain: 4e5, integral_time: 0.05 } }
}

/// 2 m behind the laboratory's origin, the flange looking along +x, the part of 200 kg at the origin.
pub fn mount() -> Mount {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Mount {
        base: Pose { position: vec3(-2.0, 0.0, -1.8), attitude: Quat::identity() },
        // The part's x axis is the last link's z axis.
        tool: Pose { position: vec3(0.0, 0.0, 0.1), attitude: Quat { w: half, v: vec3(0.0, -half, 0.0) } },
        payload: Payload { mass: 200.0, com: vec3(0.0, 0.0, 0.0), inertia: Sym3::diagonal(vec3(5.0, 5.0, 5.0)) },
    }
}

/// Velocity loops of 0.3 MN m s/rad in the arm and 0.1 in the wrist.
pub fn servo(feedforward: Feedforward) -> Servo {
    let velocity = [300_000.0, 300_000.0, 300_000.0, 100_000.0, 100_000.0, 100_000.0];
    Servo { velocity: velocity.map(|gain| VelocityLoop { gain, integral_time: 0.05 }), feedforward }
}

/// The loops of the reference facility: gain 7 1/s with 45 % velocity feedforward; gears and friction of the model.
pub fn reference_drives() -> DriveParams<f64> {
    DriveParams {
        position_gain: 7.0,
        velocity_feedforward: 0.45,
        stribeck: 1.0,
        presliding: 1.0,
        gear_compliance: 1.0,
        backlash: 1.0,
        current_lag: 1.0 / (std::f64::consts::TAU * 600.0),
        ..crate::params::Params::null().robot1
    }
}
