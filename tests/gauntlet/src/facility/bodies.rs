//! Simulation computer: two free bodies under the measured wrench, once a millisecond.

use super::motions::Start;
use super::nominal::{CHASER, TARGET};
use crate::space::{Quaternion, Vector, cross, difference, into_body, into_world, scaled, sum, turned};

/// Pose and twist of a part, contact frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// \[m\]
    pub(crate) position: Vector,
    pub(crate) attitude: Quaternion,
    /// \[m/s\]
    pub(crate) velocity: Vector,
    /// World axes \[rad/s\].
    pub(crate) omega: Vector,
}

/// A rigid body that carries a part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// \[kg\]
    mass: f64,
    /// About the principal axes \[kg m^2\].
    inertia: Vector,
    /// Of the part, in body axes \[m\].
    place: Vector,
    /// Centre of mass \[m\] and its velocity \[m/s\].
    centre: Vector,
    velocity: Vector,
    attitude: Quaternion,
    /// Angular momentum about the centre of mass, world axes \[kg m^2/s\].
    spin: Vector,
}

impl Body {
    /// A body whose part has a pose and twist.
    fn carrying((mass, inertia, place): (f64, Vector, Vector), part: Part) -> Self {
        let lever = into_world(part.attitude, place);
        let rate = into_body(part.attitude, part.omega);
        Self {
            mass,
            inertia,
            place,
            centre: difference(part.position, lever),
            velocity: difference(part.velocity, cross(part.omega, lever)),
            attitude: part.attitude,
            spin: into_world(part.attitude, std::array::from_fn(|i| inertia[i] * rate[i])),
        }
    }

    /// World axes \[rad/s\].
    fn omega(&self) -> Vector {
        let spin = into_body(self.attitude, self.spin);
        into_world(self.attitude, std::array::from_fn(|i| spin[i] / self.inertia[i]))
    }

    pub(crate) fn part(&self) -> Part {
        let (lever, omega) = (into_world(self.attitude, self.place), self.omega());
        Part {
            position: sum(self.centre, lever),
            attitude: self.attitude,
            velocity: sum(self.velocity, cross(omega, lever)),
            omega,
        }
    }

    /// A step \[s\] under a force \[N\] at a point \[m\] and a moment \[N m\], semi-implicit.
    fn advance(&mut self, force: Vector, at: Vector, moment: Vector, step: f64) {
        let torque = sum(moment, cross(difference(at, self.centre), force));
        self.velocity = sum(self.velocity, scaled(step / self.mass, force));
        self.spin = sum(self.spin, scaled(step, torque));
        self.centre = sum(self.centre, scaled(step, self.velocity));
        self.attitude = turned(self.attitude, scaled(step, self.omega()));
    }
}

/// Chaser with part A and target with part B.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bodies {
    pub(crate) chaser: Body,
    pub(crate) target: Body,
}

impl Bodies {
    pub(crate) fn at(start: &Start) -> Self {
        let [a, b] = start.parts();
        Self { chaser: Body::carrying(CHASER, a), target: Body::carrying(TARGET, b) }
    }

    pub(crate) fn parts(&self) -> [Part; 2] {
        [self.chaser.part(), self.target.part()]
    }

    /// A step \[s\] under the wrench on part A about its origin, part A's axes \[N, N m\], and its negative on the target at
    /// the same point.
    pub(crate) fn advance(&mut self, wrench: [f64; 6], step: f64) {
        let at = self.chaser.part();
        let [force, moment] = [0, 3].map(|i| into_world(at.attitude, [wrench[i], wrench[i + 1], wrench[i + 2]]));
        self.chaser.advance(force, at.position, moment, step);
        self.target.advance(scaled(-1.0, force), at.position, scaled(-1.0, moment), step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::dot;

    /// Linear \[kg m/s\] and angular \[kg m^2/s\] momentum of both, the latter about the origin.
    fn momentum(bodies: &Bodies) -> [Vector; 2] {
        let of = |body: &Body| {
            let linear = scaled(body.mass, body.velocity);
            [linear, sum(body.spin, cross(body.centre, linear))]
        };
        let [a, b] = [of(&bodies.chaser), of(&bodies.target)];
        [sum(a[0], b[0]), sum(a[1], b[1])]
    }

    /// Kinetic energy \[J\].
    fn energy(bodies: &Bodies) -> f64 {
        let of = |body: &Body| 0.5 * (body.mass * dot(body.velocity, body.velocity) + dot(body.spin, body.omega()));
        of(&bodies.chaser) + of(&bodies.target)
    }

    #[test]
    fn bodies_conserve_momentum_always_and_energy_without_wrench() {
        let start = Bodies::at(&Start::of("turning"));
        let (mut pushed, mut free) = (start, start);
        for cycle in 0..400 {
            let push = (f64::from(cycle) * 0.01).sin();
            pushed.advance([-40.0 * push, 5.0, -3.0 * push, 0.2, 0.1, -0.3], 1e-3);
            free.advance([0.0; 6], 1e-3);
        }
        let off = momentum(&start).into_iter().flatten().zip(momentum(&pushed).into_iter().flatten());
        off.for_each(|(before, after)| assert!((before - after).abs() < 1e-10, "{before} {after}"));
        assert!((energy(&pushed) - energy(&start)).abs() > 0.1, "the wrench has worked");
        assert!((energy(&free) / energy(&start) - 1.0).abs() < 1e-5, "a free body keeps its energy");
    }
}
