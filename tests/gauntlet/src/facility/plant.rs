//! Robots, contact and the sensor's filter as differential equations.

use super::law::Law;
use super::nominal::{RADIUS, RESPONSE, SENSOR_LAG};
use super::path::CommandedPose;
use crate::catalogue::Sizes;
use crate::ode::System;
use crate::space::{
    Quaternion, Vector, cross, difference, into_body, into_world, quaternion_rate, scaled, sum, turn_between,
};
use std::f64::consts::TAU;

/// First index of a group of states: the two robots, bristles (2), memory of the contact, displacement and velocity of the
/// plate on its mount, filtered wrench (6), how far robot 2 has given way (3), time within the step.
const ROBOTS: [usize; 2] = [0, ROBOT];
const BRISTLES: usize = 2 * ROBOT;
const MEMORY: usize = BRISTLES + 2;
const MOUNT: usize = MEMORY + 1;
const FILTERED: usize = MOUNT + 6;
const YIELDED: usize = FILTERED + 6;
const TIME: usize = YIELDED + 3;
const STATES: usize = TIME + 1;
/// States of a robot: position and velocity of its tool (laboratory), attitude, rate (laboratory axes).
const ROBOT: usize = 13;

/// State \[m, m/s, 1, rad/s, m, m, m, m/s, N, N m, m, s\].
pub(crate) type State = [f64; STATES];

/// Frequency \[Hz\] and damping ratio of the plate on its mount.
pub(crate) const MOUNT_HZ: f64 = 40.0;
pub(crate) const MOUNT_DAMPING_RATIO: f64 = 0.02;
/// Time constant of a robot's compliance \[s\].
const YIELDING_TIME: f64 = 5e-3;

/// Response w^2 (1 + T s) / (s^2 + 2 z w s + w^2) of a robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response {
    /// 1/w \[s\], z, T \[s\].
    pub(crate) lag: f64,
    pub(crate) damping: f64,
    pub(crate) zero: f64,
}

/// Robots with the parts that they hold.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    pub(crate) responses: [Response; 2],
    pub(crate) law: Law,
    /// Of the plate's mount, and of robot 2 \[m/N\].
    mount: f64,
    compliance: f64,
    /// By which robot 1 moves aside as it moves ahead \[rad\].
    tilt: f64,
    /// Time constant of the sensor's low-pass \[s\].
    filter: f64,
    /// Held over a step: the commands to the robots at its start, and the disturbances of their drives \[m/s, rad/s\].
    pub(crate) commanded: [CommandedPose; 2],
    pub(crate) disturbance: [[f64; 6]; 2],
}

/// Where a robot holds its part, and how that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) position: Vector,
    pub(crate) velocity: Vector,
    pub(crate) attitude: Quaternion,
    pub(crate) omega: Vector,
}

/// What the parts do to one another.
struct Touch {
    depth: f64,
    bristle_rate: [f64; 2],
    /// Force \[N\] and moment about part A's origin \[N m\] on part A, laboratory axes.
    force: Vector,
    moment: Vector,
}

fn vector(state: &State, at: usize) -> Vector {
    [state[at], state[at + 1], state[at + 2]]
}

fn put(state: &mut State, at: usize, value: Vector) {
    state[at..at + 3].copy_from_slice(&value);
}

impl Plant {
    pub(crate) fn new(sizes: &Sizes, law: Law) -> Self {
        let [lag, damping, zero] = RESPONSE;
        let response = |more: f64| Response { lag: lag + more, damping, zero };
        Self {
            responses: [response(sizes.of("C2_lag")), response(0.0)],
            law,
            mount: sizes.of("K10_fixture"),
            compliance: sizes.of("robot_compliance"),
            tilt: sizes.of("robot_tilt"),
            filter: SENSOR_LAG + sizes.of("S5_low_pass"),
            commanded: [CommandedPose::default(); 2],
            disturbance: [[0.0; 6]; 2],
        }
    }

    /// Returns the state with the robots at their commanded poses.
    pub(crate) fn at_command(&self) -> State {
        let mut state = [0.0; STATES];
        for (from, commanded) in ROBOTS.into_iter().zip(&self.commanded) {
            put(&mut state, from, commanded.position);
            put(&mut state, from + 3, commanded.velocity);
            state[from + 6..from + 10].copy_from_slice(&commanded.attitude);
            put(&mut state, from + 10, commanded.omega);
        }
        state
    }

    /// Returns the poses of the parts, measured by the robots' axes.
    pub(crate) fn held(&self, state: &State) -> [Held; 2] {
        let robot = |from: usize| Held {
            position: vector(state, from),
            velocity: vector(state, from + 3),
            attitude: std::array::from_fn(|i| state[from + 6 + i]),
            omega: vector(state, from + 10),
        };
        let [mut a, mut b] = ROBOTS.map(robot);
        a.position[1] += self.tilt * a.position[0];
        a.velocity[1] += self.tilt * a.velocity[0];
        b.position = sum(b.position, vector(state, YIELDED));
        [a, b]
    }

    /// Wrench behind the sensor's filter, part A's axes \[N, N m\].
    pub(crate) fn filtered(&self, state: &State) -> [f64; 6] {
        std::array::from_fn(|i| state[FILTERED + i])
    }

    fn touch(&self, state: &State) -> Touch {
        let [a, b] = self.held(state);
        let gap = difference(a.position, sum(b.position, vector(state, MOUNT)));
        let [x, y, z] = into_body(b.attitude, gap);
        let depth = RADIUS + x + self.law.offset;
        // From part A's origin to where the ball touches, straight into the plate.
        let lever = into_world(b.attitude, [RADIUS, 0.0, 0.0]);
        let of_b = sum(sum(b.velocity, vector(state, MOUNT + 3)), cross(b.omega, sum(lever, gap)));
        let slip = difference(sum(a.velocity, cross(a.omega, lever)), of_b);
        let [rate, slip_y, slip_z] = into_body(b.attitude, slip);
        let normal = self.law.normal(depth, rate, [y, z], state[MEMORY]);
        let bristles = [state[BRISTLES], state[BRISTLES + 1]];
        let (bristle_rate, [push_y, push_z]) = self.law.tangential([slip_y, slip_z], bristles, normal);
        let force = into_world(b.attitude, [-normal, push_y, push_z]);
        Touch { depth, bristle_rate, force, moment: cross(lever, force) }
    }

    /// A robot's acceleration on each axis: a position loop with feedforward behind a drive that is disturbed.
    fn follow(&self, robot: usize, state: &State, out: &mut State) {
        let (from, commanded) = (ROBOTS[robot], self.commanded[robot].after(state[TIME]));
        let Response { lag, damping, zero } = self.responses[robot];
        let attitude: Quaternion = std::array::from_fn(|i| state[from + 6 + i]);
        let errors = [difference(commanded.position, vector(state, from)), turn_between(attitude, commanded.attitude)];
        let rates = [vector(state, from + 3), vector(state, from + 10)];
        let asked = [commanded.velocity, commanded.omega];
        let w = 1.0 / lag;
        let acceleration = |kind: usize, axis: usize| {
            let drive = rates[kind][axis] - self.disturbance[robot][3 * kind + axis];
            w * w * (errors[kind][axis] + zero * asked[kind][axis]) - 2.0 * damping * w * drive
        };
        put(out, from, rates[0]);
        put(out, from + 3, std::array::from_fn(|axis| acceleration(0, axis)));
        out[from + 6..from + 10].copy_from_slice(&quaternion_rate(attitude, into_body(attitude, rates[1])));
        put(out, from + 10, std::array::from_fn(|axis| acceleration(1, axis)));
    }
}

impl System<STATES, 1> for Plant {
    fn rate(&self, state: &State) -> State {
        let mut out = [0.0; STATES];
        (0..2).for_each(|robot| self.follow(robot, state, &mut out));
        let touch = self.touch(state);
        out[BRISTLES..MEMORY].copy_from_slice(&touch.bristle_rate);
        out[MEMORY] = self.law.memory_rate(touch.depth, state[MEMORY]);
        if self.mount > 0.0 {
            let (w, rate) = (TAU * MOUNT_HZ, vector(state, MOUNT + 3));
            let pull = sum(scaled(-self.mount, touch.force), scaled(-1.0, vector(state, MOUNT)));
            put(&mut out, MOUNT, rate);
            put(&mut out, MOUNT + 3, sum(scaled(w * w, pull), scaled(-2.0 * MOUNT_DAMPING_RATIO * w, rate)));
        }
        let attitude: Quaternion = std::array::from_fn(|i| state[6 + i]);
        let felt = [into_body(attitude, touch.force), into_body(attitude, touch.moment)].concat();
        for (i, felt) in felt.into_iter().enumerate() {
            out[FILTERED + i] = (felt - state[FILTERED + i]) / self.filter;
        }
        let given = difference(scaled(-self.compliance, touch.force), vector(state, YIELDED));
        put(&mut out, YIELDED, scaled(1.0 / YIELDING_TIME, given));
        out[TIME] = 1.0;
        out
    }

    /// The first and the last touch.
    fn surfaces(&self, state: &State) -> [f64; 1] {
        [self.touch(state).depth]
    }
}

impl Plant {
    /// The state at the begin of the next step: time starts anew, attitudes are of length 1.
    pub(crate) fn settled(&self, mut state: State) -> State {
        state[TIME] = 0.0;
        for from in ROBOTS {
            let own = &mut state[from + 6..from + 10];
            let length = own.iter().map(|x| x * x).sum::<f64>().sqrt();
            own.iter_mut().for_each(|x| *x /= length);
        }
        state
    }
}
