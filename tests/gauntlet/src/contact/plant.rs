//! Body, plate and force sensor of the contact rig as differential equations.

use super::law::{Law, TENSION_RANGE};
use super::nominal::{CARRIAGE_DAMPING, CARRIAGE_STIFFNESS, MASS};
use crate::ode::System;

/// First index of a group of states: position (3) and velocity (3) of the body, bristles (2), displacement and velocity of
/// the plate, memory of the contact, filtered force (3).
pub(crate) const POSITION: usize = 0;
pub(crate) const VELOCITY: usize = 3;
/// How many states are the body's own.
pub(crate) const BODY: usize = 6;
const BRISTLES: usize = BODY;
const PLATE: usize = 8;
const PLATE_RATE: usize = 9;
const MEMORY: usize = 10;
const FORCE: usize = 11;

/// State \[m, m/s, m, m, m/s, m, N\].
pub(crate) type State = [f64; 14];

/// The plate's mass \[kg\] where it stands on a spring.
pub(crate) const PLATE_MASS: f64 = 1.5;

/// Held over a tick: push towards the plate \[N\], carriage (x, y) \[m\] with its rate \[m/s\], disturbance (3) \[N\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inputs {
    pub(crate) push: f64,
    pub(crate) carriage: [[f64; 2]; 2],
    pub(crate) disturbance: [f64; 3],
}

/// The rig, with its inputs of the tick.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    pub(crate) law: Law,
    /// Where the plate is \[m\].
    pub(crate) surface: f64,
    /// The plate's spring: stiffness \[N/m\] (infinite if rigid) and damping \[N s/m\].
    pub(crate) fixture: (f64, f64),
    /// Time constant of the force sensor \[s\]; 0 for none.
    pub(crate) filter: f64,
    /// Deepest depth so far \[m\].
    pub(crate) deepest: f64,
    pub(crate) inputs: Inputs,
}

impl Plant {
    /// Depth \[m\] and its rate \[m/s\].
    pub(crate) fn depth(&self, state: &State) -> [f64; 2] {
        [self.surface + state[PLATE] - state[POSITION + 2], state[PLATE_RATE] - state[VELOCITY + 2]]
    }

    /// Rate of the bristles \[m/s\] and force of the plate on the body \[N\].
    fn contact(&self, state: &State) -> ([f64; 2], [f64; 3]) {
        let [depth, rate] = self.depth(state);
        let normal = self.law.normal(depth, rate, self.deepest, state[MEMORY]);
        let pair = |at: usize| [state[at], state[at + 1]];
        let (bristle_rate, [x, y]) = self.law.tangential(pair(POSITION), pair(VELOCITY), pair(BRISTLES), normal);
        (bristle_rate, [x, y, normal])
    }

    /// Force that the sensor shows \[N\].
    pub(crate) fn sensed(&self, state: &State) -> [f64; 3] {
        if self.filter > 0.0 { [state[FORCE], state[FORCE + 1], state[FORCE + 2]] } else { self.contact(state).1 }
    }

    /// After a step: the dent grows to the depth reached.
    pub(crate) fn dent(&mut self, state: &State) {
        self.deepest = self.deepest.max(self.depth(state)[0]);
    }
}

impl System<14, 3> for Plant {
    fn rate(&self, state: &State) -> State {
        let (bristle_rate, force) = self.contact(state);
        let Inputs { push, carriage, disturbance } = self.inputs;
        let mut drive = [0.0, 0.0, -push];
        for axis in 0..2 {
            drive[axis] = CARRIAGE_STIFFNESS * (carriage[0][axis] - state[POSITION + axis])
                + CARRIAGE_DAMPING * (carriage[1][axis] - state[VELOCITY + axis]);
        }
        let mut out = [0.0; 14];
        for axis in 0..3 {
            out[POSITION + axis] = state[VELOCITY + axis];
            out[VELOCITY + axis] = (force[axis] + drive[axis] + disturbance[axis]) / MASS;
            if self.filter > 0.0 {
                out[FORCE + axis] = (force[axis] - state[FORCE + axis]) / self.filter;
            }
        }
        [out[BRISTLES], out[BRISTLES + 1]] = bristle_rate;
        let (stiffness, damping) = self.fixture;
        if stiffness.is_finite() {
            out[PLATE] = state[PLATE_RATE];
            let spring = stiffness * state[PLATE] + damping * state[PLATE_RATE];
            out[PLATE_RATE] = (-force[2] - spring) / PLATE_MASS;
        }
        out[MEMORY] = self.law.memory_rate(self.depth(state)[0], state[MEMORY]);
        out
    }

    /// Touch, the end of tension, and the end of a dent's reloading.
    fn surfaces(&self, state: &State) -> [f64; 3] {
        let depth = self.depth(state)[0];
        let tension = if self.law.adhesion > 0.0 { depth + TENSION_RANGE } else { 1.0 };
        let reloading = if self.law.plastic > 0.0 { depth - self.deepest } else { 1.0 };
        [depth - self.law.touch(self.deepest), tension, reloading]
    }
}
