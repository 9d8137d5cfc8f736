//! The sensor rig's experiments: poses and moves without load, a hung mass, blows with an instrumented hammer.

use crate::motion::{Motion, Wave, sine};
use crate::session::{FRESH, HOLDOUT};
use crate::space::{Quaternion, Vector, body_rate, carried, cross, difference, from_angles, into_body, scaled, sum};
use std::f64::consts::{FRAC_PI_2, PI};

/// Length of a record \[s\].
pub(crate) const DURATION_S: f64 = 4.0;

/// Training experiments.
pub(crate) const TRAINING: &[&str] = &["poses", "load", "hammer"];

/// Standard gravity in the world \[m/s^2\].
pub(crate) const GRAVITY: Vector = [0.0, 0.0, -9.80665];

/// A blow with a hammer that measures it: a half sine of force at a place, in sensor axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blow {
    pub(crate) start_s: f64,
    pub(crate) width_s: f64,
    /// Peak \[N\] and where it acts \[m\].
    pub(crate) force: Vector,
    pub(crate) place: Vector,
}

/// One experiment.
pub(crate) struct Experiment {
    /// Roll, pitch and yaw of the sensor \[rad\].
    angles: [Motion; 3],
    /// Its origin in the world \[m\].
    position: [Motion; 3],
    /// A mass \[kg\] hung at a place in sensor axes \[m\].
    hung: (f64, Vector),
    pub(crate) blows: Vec<Blow>,
}

/// How the sensor moves at a time; vectors in sensor axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moving {
    pub(crate) orientation: Quaternion,
    /// Acceleration of the origin without gravity \[m/s^2\], rate \[rad/s\], angular acceleration \[rad/s^2\].
    pub(crate) acceleration: Vector,
    pub(crate) rate: Vector,
    pub(crate) angular_acceleration: Vector,
}

impl Moving {
    /// Force \[N\] of a mass \[kg\] carried at a place \[m\] on what carries it.
    pub(crate) fn carried_force(&self, mass: f64, place: Vector) -> Vector {
        let acceleration = sum(self.acceleration, carried(self.rate, self.angular_acceleration, place));
        scaled(mass, difference(into_body(self.orientation, GRAVITY), acceleration))
    }
}

impl Experiment {
    fn rate(&self, time: f64) -> Vector {
        let at: [[f64; 3]; 3] = std::array::from_fn(|i| self.angles[i].at(time));
        body_rate(at.map(|at| at[0]), at.map(|at| at[1]))
    }

    /// Motion at a time \[s\]. The angular acceleration is a central difference of the exact rate (error below 1e-7).
    pub(crate) fn moving(&self, time: f64) -> Moving {
        const DIFFERENCE_S: f64 = 1e-5;
        let orientation = from_angles(std::array::from_fn(|i| self.angles[i].at(time)[0]));
        let change = difference(self.rate(time + DIFFERENCE_S), self.rate(time - DIFFERENCE_S));
        let acceleration = std::array::from_fn(|i| self.position[i].at(time)[2]);
        Moving {
            orientation,
            acceleration: into_body(orientation, acceleration),
            rate: self.rate(time),
            angular_acceleration: scaled(0.5 / DIFFERENCE_S, change),
        }
    }

    /// Wrench of the hung mass on the sensor.
    pub(crate) fn hung_wrench(&self, moving: &Moving) -> [f64; 6] {
        let (mass, place) = self.hung;
        joined(moving.carried_force(mass, place), place)
    }

    /// Wrench of the hammer on the sensor at a time \[s\].
    pub(crate) fn blow_wrench(&self, time: f64) -> [f64; 6] {
        let mut wrench = [0.0; 6];
        for blow in &self.blows {
            let phase = (time - blow.start_s) / blow.width_s;
            if phase > 0.0 && phase < 1.0 {
                let one = joined(scaled((PI * phase).sin(), blow.force), blow.place);
                wrench = std::array::from_fn(|i| wrench[i] + one[i]);
            }
        }
        wrench
    }
}

/// Wrench of a force \[N\] at a place \[m\].
pub(crate) fn joined(force: Vector, place: Vector) -> [f64; 6] {
    let moment = cross(place, force);
    [force[0], force[1], force[2], moment[0], moment[1], moment[2]]
}

fn about(centre: f64, waves: &[Wave]) -> Motion {
    Motion { centre, waves: waves.to_vec() }
}

fn still() -> [Motion; 3] {
    [0.0; 3].map(|centre| about(centre, &[]))
}

/// Blows along x, y and z in turn, at three widths.
fn hammer(start_s: f64, peak: f64) -> Vec<Blow> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let blow = |i: usize| Blow {
        start_s: start_s + 0.25 * i as f64,
        width_s: [0.004, 0.008, 0.02][i / 3],
        force: scaled(peak, axes[i % 3]),
        place: [0.02, -0.01, 0.15],
    };
    (0..9).map(blow).collect()
}

/// The experiment of a name.
pub(crate) fn experiment(name: &str) -> Experiment {
    let tumbling = |roll: f64| {
        [about(roll, &[sine(1.0, 0.24, 0.0)]), about(-0.2, &[sine(1.1, 0.2, 0.0)]), about(0.0, &[sine(0.6, 0.4, 0.0)])]
    };
    let shaking = |amplitude: f64| {
        [
            about(0.0, &[sine(amplitude, 1.3, 0.0)]),
            about(0.0, &[sine(amplitude, 1.9, 1.0)]),
            about(0.0, &[sine(0.7 * amplitude, 2.3, 2.0)]),
        ]
    };
    let place = [0.03, 0.02, 0.2];
    match name {
        "poses" => Experiment { angles: tumbling(0.1), position: shaking(0.03), hung: (0.0, place), blows: Vec::new() },
        "load" => Experiment { angles: tumbling(1.8), position: still(), hung: (12.0, place), blows: Vec::new() },
        "hammer" => Experiment {
            angles: [about(PI, &[]), about(0.0, &[]), about(0.3, &[])],
            position: still(),
            hung: (0.0, place),
            blows: hammer(0.6, 180.0),
        },
        HOLDOUT => Experiment {
            angles: [about(0.9, &[sine(0.7, 0.3, 0.0)]), about(0.5, &[sine(-1.0, 0.22, 0.0)]), about(0.0, &[])],
            position: shaking(0.02),
            hung: (7.0, [-0.02, 0.04, 0.17]),
            blows: hammer(1.2, 110.0),
        },
        FRESH => Experiment {
            angles: [about(-0.7, &[sine(0.8, 0.27, 0.0)]), about(FRAC_PI_2, &[sine(0.9, 0.21, 0.0)]), about(1.0, &[])],
            position: shaking(0.025),
            hung: (9.0, [0.05, -0.03, 0.18]),
            blows: hammer(0.9, 150.0),
        },
        _ => unreachable!("experiments come from the list above"),
    }
}
