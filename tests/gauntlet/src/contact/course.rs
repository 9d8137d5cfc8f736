//! Body in contact with one plate, and the force of another plate under the same motion.

use super::plant::{BODY, Inputs, Plant, State};
use crate::ode::System;

/// State of the body with the plate that moves it, then that of the other plate.
pub(crate) type Both = [f64; 22];

/// The body's course.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    /// The plate that moves the body.
    pub(crate) mover: Plant,
    /// The plate whose force is shown, if it is another.
    pub(crate) shown: Option<Plant>,
}

/// The state of the plate that moves the body.
fn moving(both: &Both) -> State {
    std::array::from_fn(|i| both[i])
}

/// The state of the other plate: the body's motion is the same.
fn showing(both: &Both) -> State {
    const OWN: usize = 22 - 14;
    std::array::from_fn(|i| if i < BODY { both[i] } else { both[i + OWN] })
}

impl Course {
    /// What acts over a tick; a disturbance moves the body and with it both.
    pub(crate) fn act(&mut self, inputs: Inputs) {
        self.mover.inputs = inputs;
    }

    /// Force that the sensor shows \[N\].
    pub(crate) fn sensed(&self, both: &Both) -> [f64; 3] {
        match &self.shown {
            Some(shown) => shown.sensed(&showing(both)),
            None => self.mover.sensed(&moving(both)),
        }
    }

    /// After a step: dents grow to the depth reached.
    pub(crate) fn dent(&mut self, both: &Both) {
        self.mover.dent(&moving(both));
        self.shown.iter_mut().for_each(|shown| shown.dent(&showing(both)));
    }
}

impl System<22, 6> for Course {
    fn rate(&self, both: &Both) -> Both {
        let mut out = [0.0; 22];
        out[..14].copy_from_slice(&self.mover.rate(&moving(both)));
        if let Some(shown) = &self.shown {
            out[14..].copy_from_slice(&shown.rate(&showing(both))[BODY..]);
        }
        out
    }

    fn surfaces(&self, both: &Both) -> [f64; 6] {
        let own = self.mover.surfaces(&moving(both));
        let others = self.shown.as_ref().map_or([1.0; 3], |shown| shown.surfaces(&showing(both)));
        std::array::from_fn(|i| if i < 3 { own[i] } else { others[i - 3] })
    }
}
