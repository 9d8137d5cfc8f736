//! A free rigid body with masses on springs inside it, as differential equations.

use crate::ode::System;
use crate::space::{
    Matrix, Quaternion, Vector, carried, cross, difference, dot, into_body, into_world, inverse, point_inertia,
    quaternion_rate, scaled, sum, times,
};

/// First index of a group of states: position and velocity of the origin (world), quaternion, rate (body axes),
/// displacements and their rates of the two masses on springs (body axes).
pub(crate) const POSITION: usize = 0;
pub(crate) const VELOCITY: usize = 3;
pub(crate) const QUATERNION: usize = 6;
pub(crate) const RATE: usize = 10;
pub(crate) const SPRUNG: [usize; 2] = [13, 19];

/// State \[m, m/s, 1, rad/s, m, m/s\].
pub(crate) type State = [f64; 25];

/// A mass on a spring in the body: sloshing liquid, or the tip of a flexible boom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sprung {
    /// \[kg\]; 0 for none.
    pub(crate) mass: f64,
    /// Where it rests, in body axes \[m\].
    pub(crate) place: Vector,
    /// Natural frequency \[rad/s\] and damping ratio with the body held.
    pub(crate) frequency: f64,
    pub(crate) damping_ratio: f64,
}

/// The body, with its inputs of the moment.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    /// Without the sprung masses \[kg\], \[m\], about its own centre of mass \[kg m^2\].
    mass: f64,
    centre: Vector,
    inertia: Matrix,
    inverse_inertia: Matrix,
    sprung: [Sprung; 2],
    /// Drag with the square of the speed \[N s^2/m^2\], spring to the place of the start \[N/m\].
    drag: f64,
    umbilical: f64,
    /// Force and moment on the body, in body axes \[N, N m\].
    pub(crate) force: Vector,
    pub(crate) moment: Vector,
}

/// Accelerations in body axes: of the origin \[m/s^2\], angular \[rad/s^2\], of the sprung masses in the body \[m/s^2\].
pub(crate) struct Accelerations {
    pub(crate) origin: Vector,
    pub(crate) angular: Vector,
    sprung: [Vector; 2],
}

fn vector(state: &State, at: usize) -> Vector {
    [state[at], state[at + 1], state[at + 2]]
}

fn quaternion(state: &State) -> Quaternion {
    [state[QUATERNION], state[QUATERNION + 1], state[QUATERNION + 2], state[QUATERNION + 3]]
}

impl Plant {
    /// A body whose whole, sprung masses at rest, has this mass \[kg\], centre \[m\] and inertia about it \[kg m^2\].
    pub(crate) fn new(mass: f64, centre: Vector, inertia: Matrix, sprung: [Sprung; 2], drag: [f64; 2]) -> Self {
        let rest = mass - sprung[0].mass - sprung[1].mass;
        let mut first = scaled(mass, centre);
        let mut second = added(inertia, point_inertia(mass, centre), 1.0);
        for part in sprung {
            first = difference(first, scaled(part.mass, part.place));
            second = added(second, point_inertia(part.mass, part.place), -1.0);
        }
        let own = scaled(1.0 / rest, first);
        let inertia = added(second, point_inertia(rest, own), -1.0);
        Self {
            mass: rest,
            centre: own,
            inertia,
            inverse_inertia: inverse(&inertia),
            sprung,
            drag: drag[0],
            umbilical: drag[1],
            force: [0.0; 3],
            moment: [0.0; 3],
        }
    }

    /// At rest.
    pub(crate) fn at_rest() -> State {
        let mut state = [0.0; 25];
        state[QUATERNION] = 1.0;
        state
    }

    /// Force of the surroundings, in body axes \[N\].
    fn surroundings(&self, state: &State) -> Vector {
        if self.drag == 0.0 && self.umbilical == 0.0 {
            return [0.0; 3];
        }
        let velocity = vector(state, VELOCITY);
        let drag = scaled(-self.drag * dot(velocity, velocity).sqrt(), velocity);
        into_body(quaternion(state), sum(drag, scaled(-self.umbilical, vector(state, POSITION))))
    }

    /// Newton and Euler for the body under what acts on it, then Newton for each sprung mass in the moving axes.
    pub(crate) fn accelerations(&self, state: &State) -> Accelerations {
        let rate = vector(state, RATE);
        let mut force = sum(self.force, self.surroundings(state));
        let mut moment = self.moment;
        let mut pulls = [[0.0; 3]; 2];
        for (i, part) in self.sprung.iter().enumerate().filter(|(_, part)| part.mass > 0.0) {
            let [displacement, speed] = [0, 3].map(|offset| vector(state, SPRUNG[i] + offset));
            let spring = scaled(part.frequency * part.frequency, displacement);
            let damper = scaled(2.0 * part.damping_ratio * part.frequency, speed);
            pulls[i] = scaled(-part.mass, sum(spring, damper));
            force = difference(force, pulls[i]);
            moment = difference(moment, cross(sum(part.place, displacement), pulls[i]));
        }
        let about_centre = difference(moment, cross(self.centre, force));
        let gyroscopic = cross(rate, times(&self.inertia, rate));
        let angular = times(&self.inverse_inertia, difference(about_centre, gyroscopic));
        let origin = difference(scaled(1.0 / self.mass, force), carried(rate, angular, self.centre));
        let mut sprung = [[0.0; 3]; 2];
        for (i, part) in self.sprung.iter().enumerate().filter(|(_, part)| part.mass > 0.0) {
            let [displacement, speed] = [0, 3].map(|offset| vector(state, SPRUNG[i] + offset));
            let frame = sum(origin, carried(rate, angular, sum(part.place, displacement)));
            let coriolis = scaled(2.0, cross(rate, speed));
            sprung[i] = difference(scaled(1.0 / part.mass, pulls[i]), sum(frame, coriolis));
        }
        Accelerations { origin, angular, sprung }
    }
}

/// a + factor b.
fn added(a: Matrix, b: Matrix, factor: f64) -> Matrix {
    std::array::from_fn(|i| sum(a[i], scaled(factor, b[i])))
}

impl System<25, 0> for Plant {
    fn rate(&self, state: &State) -> State {
        let Accelerations { origin, angular, sprung } = self.accelerations(state);
        let mut out = [0.0; 25];
        let mut put = |at: usize, values: &[f64]| out[at..at + values.len()].copy_from_slice(values);
        put(POSITION, &vector(state, VELOCITY));
        put(VELOCITY, &into_world(quaternion(state), origin));
        put(QUATERNION, &quaternion_rate(quaternion(state), vector(state, RATE)));
        put(RATE, &angular);
        for (at, acceleration) in SPRUNG.into_iter().zip(sprung) {
            put(at, &vector(state, at + 3));
            put(at + 3, &acceleration);
        }
        out
    }

    fn surfaces(&self, _: &State) -> [f64; 0] {
        []
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ode::advance;

    const INERTIA: Matrix = [[90.0, 0.0, 0.0], [0.0, 110.0, 0.0], [0.0, 0.0, 100.0]];

    fn sprung(mass: f64, place: Vector, hz: f64) -> Sprung {
        Sprung { mass, place, frequency: hz * std::f64::consts::TAU, damping_ratio: 0.0 }
    }

    fn body(masses: [f64; 2]) -> Plant {
        let parts = [sprung(masses[0], [0.1, 0.05, 0.3], 0.5), sprung(masses[1], [2.5, 0.0, 0.1], 3.0)];
        Plant::new(300.0, [0.02, 0.0, -0.01], INERTIA, parts, [0.0; 2])
    }

    /// Mass, place, and velocity of every part in the world, the body first.
    fn parts(plant: &Plant, state: &State) -> Vec<(f64, Vector, Vector)> {
        let (orientation, rate) = (quaternion(state), vector(state, RATE));
        let moving = |place: Vector, speed: Vector| {
            let turned = into_world(orientation, sum(cross(rate, place), speed));
            (sum(vector(state, POSITION), into_world(orientation, place)), sum(vector(state, VELOCITY), turned))
        };
        let (place, velocity) = moving(plant.centre, [0.0; 3]);
        let mut out = vec![(plant.mass, place, velocity)];
        for (part, at) in plant.sprung.iter().zip(SPRUNG) {
            let (place, velocity) = moving(sum(part.place, vector(state, at)), vector(state, at + 3));
            out.push((part.mass, place, velocity));
        }
        out
    }

    fn momenta(plant: &Plant, state: &State) -> (Vector, Vector) {
        let spin = into_world(quaternion(state), times(&plant.inertia, vector(state, RATE)));
        parts(plant, state).into_iter().fold(([0.0; 3], spin), |(linear, angular), (mass, place, velocity)| {
            let momentum = scaled(mass, velocity);
            (sum(linear, momentum), sum(angular, cross(place, momentum)))
        })
    }

    fn energy(plant: &Plant, state: &State) -> f64 {
        let rate = vector(state, RATE);
        let kinetic: f64 = parts(plant, state).iter().map(|(mass, _, velocity)| mass * dot(*velocity, *velocity)).sum();
        let springs = plant
            .sprung
            .iter()
            .zip(SPRUNG)
            .map(|(part, at)| part.mass * part.frequency.powi(2) * dot(vector(state, at), vector(state, at)));
        0.5 * (kinetic + dot(rate, times(&plant.inertia, rate)) + springs.sum::<f64>())
    }

    fn shaken() -> State {
        let mut state = Plant::at_rest();
        state[VELOCITY..VELOCITY + 3].copy_from_slice(&[0.1, -0.05, 0.02]);
        state[RATE..RATE + 3].copy_from_slice(&[0.2, 0.3, -0.25]);
        state[SPRUNG[0]] = 0.05;
        state[SPRUNG[1] + 1] = 0.02;
        state
    }

    #[test]
    fn free_body_conserves_momentum_and_energy() {
        let plant = body([12.0, 3.0]);
        let mut state = shaken();
        let before = (momenta(&plant, &state), energy(&plant, &state));
        for _ in 0..50_000 {
            state = advance(&plant, &state, 1e-4);
        }
        let after = (momenta(&plant, &state), energy(&plant, &state));
        for (a, b) in [(before.0.0, after.0.0), (before.0.1, after.0.1)] {
            assert!(dot(difference(a, b), difference(a, b)).sqrt() < 1e-8, "{a:?} {b:?}");
        }
        assert!((after.1 / before.1 - 1.0).abs() < 1e-9, "{} {}", before.1, after.1);
    }

    #[test]
    fn sprung_masses_keep_total_mass_centre_and_inertia() {
        // Springs so stiff that the masses follow: the whole answers as one body.
        let stiff = [sprung(12.0, [0.1, 0.05, 0.3], 60.0), sprung(3.0, [2.5, 0.0, 0.1], 60.0)];
        let mut whole = Plant::new(300.0, [0.0; 3], INERTIA, stiff, [0.0; 2]);
        whole.force = [60.0, 0.0, 0.0];
        whole.moment = [0.0, 0.0, 5.0];
        let mut state = Plant::at_rest();
        for _ in 0..10_000 {
            state = advance(&whole, &state, 1e-4);
        }
        assert!((state[VELOCITY] / 0.2 - 1.0).abs() < 0.01, "{}", state[VELOCITY]);
        assert!((state[RATE + 2] / 0.05 - 1.0).abs() < 0.01, "{}", state[RATE + 2]);
        // At the first moment a sprung mass is missing.
        let mut loose = body([30.0, 0.0]);
        loose.force = [0.0, 0.0, 60.0];
        loose.moment = cross(loose.centre, loose.force);
        assert!((loose.accelerations(&Plant::at_rest()).origin[2] - 60.0 / 270.0).abs() < 1e-12);
    }
}
