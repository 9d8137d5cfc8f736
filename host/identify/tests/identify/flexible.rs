//! A robot of other make: link-side dynamics by Jacobians, elastic joints, smooth Stribeck friction, Runge-Kutta steps,
//! a sampled controller, noisy encoders and currents. The model identified from one motion must predict another.

use crate::kr300;
use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};
use softdock_campaign::Robot;
use softdock_identify::excitation::{DesignOptions, design};
use softdock_identify::log::Recording;
use softdock_identify::motion::Preparation;
use softdock_identify::series::Series;
use softdock_identify::{IdentificationOptions, identify_recordings};
use softdock_kernels::philox;
use std::collections::BTreeMap;

const PERIOD: f64 = 8.0;
/// Integration step, and samples of the controller and of the recording, in steps.
const STEP: f64 = 5e-4;
const CONTROL: usize = 2;
const SAMPLE: usize = 8;

/// One body of the made-up robot, in its own frame.
struct Body {
    /// Row of the modified Denavit-Hartenberg table: a, alpha, d, offset, sign.
    row: [f64; 5],
    mass: f64,
    com: Vector3<f64>,
    inertia: Matrix3<f64>,
    rotor: f64,
    stiffness: f64,
    coulomb: f64,
    stribeck: f64,
    viscous: f64,
}

/// The shipped robot with every mass, centre, inertia and friction changed by up to so much.
fn changed(robot: &Robot, share: f64) -> Vec<Body> {
    let body = |(i, joint): (usize, &softdock_kernels::manipulator::Joint)| {
        let draw = |what: &str| 1.0 + share * (2.0 * philox::uniform(5, what, i as u64, 0) - 1.0);
        let (link, row) = (&joint.link, &robot.joints[i].row);
        let n = link.inertia;
        let mass = link.mass * draw("mass") + if i == 5 { 80.0 } else { 0.0 };
        Body {
            row: [row.a, row.alpha, row.d, row.offset, row.sign],
            mass,
            com: Vector3::new(link.com.x, link.com.y, link.com.z) * draw("com"),
            inertia: Matrix3::new(n.xx, n.xy, n.xz, n.xy, n.yy, n.yz, n.xz, n.yz, n.zz)
                * draw("inertia")
                * (mass / link.mass),
            rotor: joint.drive.reflected_inertia() * draw("rotor"),
            stiffness: joint.drive.gear_stiffness,
            coulomb: joint.friction.coulomb * draw("coulomb"),
            stribeck: 0.6 * joint.friction.coulomb * draw("stribeck"),
            viscous: joint.friction.viscous * draw("viscous"),
        }
    };
    robot.model.joints.iter().enumerate().map(body).collect()
}

/// Mass matrix and bias torques (gravity, Coriolis) at link angles and rates, by Jacobians of the centres of mass.
fn dynamics(bodies: &[Body], q: &Vector6<f64>, v: &Vector6<f64>) -> (Matrix6<f64>, Vector6<f64>) {
    let gravity = Vector3::new(0.0, 0.0, -9.80665);
    let mut frame = Isometry3::identity();
    let (mut axes, mut feet): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
    let (mut mass_matrix, mut bias) = (Matrix6::zeros(), Vector6::zeros());
    let (mut omega, mut alpha, mut gain, mut before) =
        (Vector3::zeros(), Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    for (i, body) in bodies.iter().enumerate() {
        let [a, tilt, d, offset, sign] = body.row;
        let about = |axis: &nalgebra::Unit<Vector3<f64>>, angle: f64| UnitQuaternion::from_axis_angle(axis, angle);
        let fixed = Isometry3::from_parts(Translation3::identity(), about(&Vector3::x_axis(), tilt))
            * Translation3::new(a, 0.0, 0.0);
        let moved = Isometry3::from_parts(Translation3::identity(), about(&Vector3::z_axis(), sign * q[i] + offset))
            * Translation3::new(0.0, 0.0, d);
        frame *= fixed * moved;
        let foot = frame.translation.vector;
        let axis = frame.rotation * Vector3::z() * sign;
        axes.push(axis);
        feet.push(foot);
        // Accelerations while no joint accelerates.
        let arm: Vector3<f64> = foot - before;
        gain += alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
        alpha += omega.cross(&axis) * v[i];
        omega += axis * v[i];
        before = foot;
        let lever = frame.rotation * body.com;
        let com_gain = gain + alpha.cross(&lever) + omega.cross(&omega.cross(&lever)) - gravity;
        let rotation: Rotation3<f64> = frame.rotation.to_rotation_matrix();
        let inertia = rotation.matrix() * body.inertia * rotation.matrix().transpose();
        let moment = inertia * alpha + omega.cross(&(inertia * omega));
        let linear: Vec<Vector3<f64>> = (0..=i).map(|k| axes[k].cross(&(foot + lever - feet[k]))).collect();
        for r in 0..=i {
            bias[r] += body.mass * linear[r].dot(&com_gain) + axes[r].dot(&moment);
            for c in 0..=i {
                mass_matrix[(r, c)] += body.mass * linear[r].dot(&linear[c]) + axes[r].dot(&(inertia * axes[c]));
            }
        }
    }
    (mass_matrix, bias)
}

/// Motor angles, link angles and their rates.
#[derive(Clone, Copy)]
struct State([Vector6<f64>; 4]);

impl State {
    fn plus(&self, o: &Self, s: f64) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + o.0[k] * s))
    }
}

fn slope(bodies: &[Body], state: &State, torque: &Vector6<f64>) -> State {
    let [motor, link, motor_rate, link_rate] = state.0;
    let by_joint = |f: &dyn Fn(usize) -> f64| Vector6::from_fn(|i, _| f(i));
    let damping = |i: usize| 0.02 * (bodies[i].stiffness * bodies[i].rotor).sqrt();
    let gear = by_joint(&|i| bodies[i].stiffness * (motor[i] - link[i]) + damping(i) * (motor_rate[i] - link_rate[i]));
    let friction = by_joint(&|i| {
        let (b, v) = (&bodies[i], motor_rate[i]);
        (b.coulomb + b.stribeck * (-(v / 0.03).powi(2)).exp()) * (v / 2e-3).tanh() + b.viscous * v
    });
    let (mass_matrix, bias) = dynamics(bodies, &link, &link_rate);
    let link_gain = mass_matrix.cholesky().expect("positive definite").solve(&(gear - bias));
    let motor_gain = by_joint(&|i| (torque[i] - friction[i] - gear[i]) / bodies[i].rotor);
    State([motor_rate, link_rate, motor_gain, link_gain])
}

/// Runs the motion, once to settle and then recorded; the controller is a PD on the motor's encoder.
fn record(robot: &Robot, bodies: &[Body], motion: &[Series], periods: usize, seed: u64) -> Recording {
    let reference = |t: f64, order: usize| Vector6::from_fn(|i, _| motion[i].at(t)[order]);
    let start = reference(0.0, 0);
    // The gears begin wound up by the load.
    let (_, load) = dynamics(bodies, &start, &Vector6::zeros());
    let motor = Vector6::from_fn(|i, _| start[i] + load[i] / bodies[i].stiffness);
    let mut state = State([motor, start, Vector6::zeros(), Vector6::zeros()]);
    let mut torque = Vector6::zeros();
    let mut recording = Recording {
        name: format!("motion {seed}"),
        step: STEP * SAMPLE as f64,
        angle: vec![Vec::new(); 6],
        torque: vec![Vec::new(); 6],
        link_angle: BTreeMap::new(),
        notes: Vec::new(),
    };
    let noise = |what: &str, k: usize, i: usize| {
        let uniform = |part: u32| philox::uniform(seed, what, k as u64, 2 * i as u32 + part);
        (-2.0 * uniform(0).ln()).sqrt() * (2.0 * std::f64::consts::PI * uniform(1)).cos()
    };
    let settle = (PERIOD / STEP).round() as usize;
    for k in 0..settle * (periods + 1) {
        let t = k as f64 * STEP;
        if k % CONTROL == 0 {
            let (angle, rate, gain) = (reference(t, 0), reference(t, 1), reference(t, 2));
            torque = Vector6::from_fn(|i, _| {
                let (w, inertia) = (40.0, bodies[i].rotor);
                inertia * (gain[i] + w * w * (angle[i] - state.0[0][i]) + 2.0 * w * (rate[i] - state.0[2][i]))
            });
            let (_, load) = dynamics(bodies, &angle, &rate);
            torque += load;
        }
        if k >= settle && k % SAMPLE == 0 {
            for i in 0..6 {
                let limit = robot.model.joints[i].drive.torque_limit;
                recording.angle[i].push(state.0[0][i] + 2e-6 * noise("encoder", k, i));
                recording.torque[i].push(torque[i] + 2e-3 * limit * noise("current", k, i));
            }
        }
        let k1 = slope(bodies, &state, &torque);
        let k2 = slope(bodies, &state.plus(&k1, 0.5 * STEP), &torque);
        let k3 = slope(bodies, &state.plus(&k2, 0.5 * STEP), &torque);
        let k4 = slope(bodies, &state.plus(&k3, STEP), &torque);
        let sum = k1.plus(&k2, 2.0).plus(&k3, 2.0).plus(&k4, 1.0);
        state = state.plus(&sum, STEP / 6.0);
    }
    recording
}

#[test]
fn a_flexible_robot_is_predicted_within_ten_per_cent_on_axis_one() {
    let robot = kr300();
    let bodies = changed(&robot, 0.3);
    let motion = |seed: u64| {
        let options = DesignOptions { period: PERIOD, harmonics: 4, starts: 20, steps: 30, seed };
        design(&robot, &options).expect("a motion").joints
    };
    let fitted = record(&robot, &bodies, &motion(1), 2, 1);
    let other = record(&robot, &bodies, &motion(2), 1, 2);
    let options = IdentificationOptions {
        preparation: Preparation { cutoff: 10.0, period: Some(PERIOD) },
        ..IdentificationOptions::default()
    };
    let found = identify_recordings(&robot, &[fitted], &[other], &options).expect("identified");
    let errors: Vec<f64> = found.validated[0].joints.iter().map(|joint| 100.0 * joint.relative_error).collect();
    println!("{errors:.1?}");
    assert!(errors[0] < 10.0, "axis 1, the paper's figure: {errors:.1?} %");
    assert!(errors.iter().all(|error| *error < 30.0), "{errors:.1?} %");
}
