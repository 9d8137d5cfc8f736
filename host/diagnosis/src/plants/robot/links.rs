//! Motion of a robot's links, driven by the measured motors through elastic gears.

use crate::data::grid::Piece;
use crate::data::smooth::{SmoothedSignal, motion};
use nalgebra::{DMatrix, DVector};
use softdock_campaign::rig::RobotRig;
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::manipulator::{Manipulator, counterweight_torque, rigid_torques};
use softdock_kernels::vector::Vec3;

/// Cut-off of the motors' motion \[Hz\]: above it the noise of an encoder is no acceleration, far below it a reversal,
/// where friction turns about at once, reaches the other axes too early and too late.
const COUPLING: f64 = 40.0;
/// Share of a recording's Nyquist frequency that the cut-off stays below.
const BAND: f64 = 0.8;
/// Longest step in which links swing on their gears \[s\].
const LONGEST_STEP: f64 = 5e-4;
/// Newmark's weights: stable however stiff a gear is, and what swings faster than the step dies away (N. M. Newmark,
/// J. Eng. Mech. Div. 85, 1959; beta = (gamma + 1/2)^2 / 4).
const GAMMA: f64 = 0.6;
const BETA: f64 = 0.25 * (GAMMA + 0.5) * (GAMMA + 0.5);

/// The motion of every link at a recording's samples, if the gears are those of `drives`.
pub(super) fn links<const N: usize>(rig: &RobotRig, piece: &Piece, drives: &[DriveValues<f64>]) -> [SmoothedSignal; N] {
    let cutoff = COUPLING.min(BAND * 0.5 / piece.step);
    let motors = |finer: usize| -> [SmoothedSignal; N] {
        std::array::from_fn(|axis| motion(&piece.signals[&format!("q.{}", axis + 1)], piece.step, cutoff, finer))
    };
    if drives.iter().all(|drive| drive.compliance == 0.0) {
        return motors(1);
    }
    let each = (piece.step / LONGEST_STEP).ceil() as usize;
    let motors = motors(each);
    let mut gears = Gears::<N>::of(rig, drives);
    gears.rest(&motors);
    let mut links =
        motors.clone().map(|_| SmoothedSignal { value: Vec::new(), rate: Vec::new(), acceleration: Vec::new() });
    for k in 0..motors[0].value.len() {
        if k > 0 {
            gears.step(&motors, k, piece.step / each as f64);
        }
        if k % each == 0 {
            gears.push_links(&motors, k, &mut links);
        }
    }
    links
}

/// A number of each axis' motion at a sample.
pub(super) fn at<const N: usize>(
    motions: &[SmoothedSignal; N],
    sample: usize,
    of: fn(&SmoothedSignal) -> &Vec<f64>,
) -> [f64; N] {
    std::array::from_fn(|axis| of(&motions[axis])[sample])
}

/// What a counterweight takes off an axis \[N m\].
pub(super) fn helped(robot: &Manipulator, axis: usize, angle: f64) -> f64 {
    robot.joints[axis].counterweight.map_or(0.0, |counterweight| counterweight_torque(&counterweight, angle))
}

/// The robot without weight.
pub(super) fn weightless(robot: &Manipulator) -> Manipulator {
    Manipulator { gravity: Vec3::zero(), ..robot.clone() }
}

/// Gears with what they are wound up by.
struct Gears<'a, const N: usize> {
    robot: &'a Manipulator,
    weightless: Manipulator,
    /// \[rad/(N m)\].
    compliance: [f64; N],
    /// Time in which a gear without a link would unwind \[s\].
    relaxation: [f64; N],
    windup: [f64; N],
    rate: [f64; N],
    acceleration: [f64; N],
}

impl<'a, const N: usize> Gears<'a, N> {
    fn of(rig: &'a RobotRig, drives: &[DriveValues<f64>]) -> Self {
        let relaxation = |axis: usize| {
            let (drive, link) = (&drives[axis], rig.drives[axis].link_inertia);
            let reduced = drive.motor_inertia * link / (drive.motor_inertia + link);
            2.0 * drive.gear_damping * (reduced * drive.compliance).sqrt()
        };
        Self {
            robot: &rig.model,
            weightless: weightless(&rig.model),
            compliance: std::array::from_fn(|axis| drives[axis].compliance),
            relaxation: std::array::from_fn(relaxation),
            windup: [0.0; N],
            rate: [0.0; N],
            acceleration: [0.0; N],
        }
    }

    /// Torque that each gear carries if its link is wound up so far and accelerates as its motor does.
    fn carried(&self, motors: &[SmoothedSignal; N], k: usize, windup: &[f64; N], rate: &[f64; N]) -> [f64; N] {
        let (angle, speed) = (at(motors, k, |m| &m.value), at(motors, k, |m| &m.rate));
        let angle: [f64; N] = std::array::from_fn(|axis| angle[axis] - windup[axis]);
        let speed = std::array::from_fn(|axis| speed[axis] - rate[axis]);
        let torques = rigid_torques(self.robot, angle, speed, at(motors, k, |m| &m.acceleration));
        std::array::from_fn(|axis| torques[axis] - helped(self.robot, axis, angle[axis]))
    }

    /// Every gear wound up by what it carries at first.
    fn rest(&mut self, motors: &[SmoothedSignal; N]) {
        let torques = self.carried(motors, 0, &self.windup, &self.rate);
        self.windup = std::array::from_fn(|axis| self.compliance[axis] * torques[axis]);
    }

    /// Goes on to sample `k`: `c M e'' + T e' + e = c tau` of the windups `e`, where `tau` is what the gears would carry
    /// if the links accelerated as the motors do.
    fn step(&mut self, motors: &[SmoothedSignal; N], k: usize, h: f64) {
        let windup: [f64; N] =
            std::array::from_fn(|i| self.windup[i] + h * self.rate[i] + h * h * (0.5 - BETA) * self.acceleration[i]);
        let rate: [f64; N] = std::array::from_fn(|i| self.rate[i] + h * (1.0 - GAMMA) * self.acceleration[i]);
        let torques = self.carried(motors, k, &windup, &rate);
        let angle = at(motors, k, |m| &m.value);
        let unit = |axis: usize| std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
        let columns: [[f64; N]; N] =
            std::array::from_fn(|axis| rigid_torques(&self.weightless, angle, [0.0; N], unit(axis)));
        let matrix = DMatrix::from_fn(N, N, |i, j| {
            let own = if i == j { GAMMA * h * self.relaxation[i] + BETA * h * h } else { 0.0 };
            self.compliance[i] * columns[j][i] + own
        });
        let right =
            DVector::from_fn(N, |i, _| self.compliance[i] * torques[i] - self.relaxation[i] * rate[i] - windup[i]);
        // Inertias of a robot that was checked, and a diagonal of their own for gears that are rigid.
        let next = matrix.lu().solve(&right).expect("a matrix with a positive diagonal");
        self.acceleration = std::array::from_fn(|i| next[i]);
        self.rate = std::array::from_fn(|i| rate[i] + h * GAMMA * next[i]);
        self.windup = std::array::from_fn(|i| windup[i] + h * h * BETA * next[i]);
    }

    fn push_links(&self, motors: &[SmoothedSignal; N], k: usize, links: &mut [SmoothedSignal; N]) {
        for (axis, (link, motor)) in links.iter_mut().zip(motors).enumerate() {
            link.value.push(motor.value[k] - self.windup[axis]);
            link.rate.push(motor.rate[k] - self.rate[axis]);
            link.acceleration.push(motor.acceleration[k] - self.acceleration[axis]);
        }
    }
}
