//! A rigid cube whose corners strike a board: Newton's restitution and Coulomb's cone, impulse by impulse.

use crate::space::{Quaternion, Vector, cross, dot, into_world, scaled, sum, turned};

/// Sweeps over the corners that touch, until their impulses agree.
const SWEEPS: usize = 30;
/// Approach below which a corner does not rebound \[m/s\].
const SOFT: f64 = 0.01;
/// Rate at which a corner that has sunk in is lifted \[1/s\].
const LIFT: f64 = 20.0;

/// A cube and its board, the plane z = 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube {
    pub(super) mass: f64,
    pub(super) inertia: f64,
    /// Half its edge, and the radius of its corners.
    pub(super) half: f64,
    pub(super) radius: f64,
    pub(super) restitution: f64,
    pub(super) friction: f64,
    pub(super) gravity: f64,
}

/// Its state in world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub(super) position: Vector,
    pub(super) attitude: Quaternion,
    pub(super) velocity: Vector,
    pub(super) rate: Vector,
}

/// A corner that touches.
struct Contact {
    arm: Vector,
    /// Speed along the normal that it must leave with at least.
    leaving: f64,
    impulse: Vector,
}

impl Body {
    /// A step \[s\]: free motion, then impulses of the corners that touch.
    pub(super) fn advance(&mut self, cube: &Cube, step: f64) {
        let mut contacts = self.contacts(cube);
        self.velocity[2] -= cube.gravity * step;
        for _ in 0..if contacts.is_empty() { 0 } else { SWEEPS } {
            contacts.iter_mut().for_each(|contact| self.strike(cube, contact));
        }
        self.position = sum(self.position, scaled(step, self.velocity));
        self.attitude = turned(self.attitude, scaled(step, self.rate));
    }

    /// Corners below the board, with what they have to reach.
    fn contacts(&self, cube: &Cube) -> Vec<Contact> {
        let side = cube.half - cube.radius;
        let corner = |number: usize| {
            let sign = |bit: usize| if number >> bit & 1 == 1 { side } else { -side };
            let mut arm = into_world(self.attitude, [sign(0), sign(1), sign(2)]);
            arm[2] -= cube.radius;
            arm
        };
        let touching = |arm: &Vector| self.position[2] + arm[2] < 0.0;
        let contact = |arm: Vector| {
            let approach = -self.at(arm)[2];
            let rebound = if approach > SOFT { cube.restitution * approach } else { 0.0 };
            Contact { arm, leaving: rebound.max(-LIFT * (self.position[2] + arm[2])), impulse: [0.0; 3] }
        };
        (0..8).map(corner).filter(touching).map(contact).collect()
    }

    /// Velocity of a point of the body.
    fn at(&self, arm: Vector) -> Vector {
        sum(self.velocity, cross(self.rate, arm))
    }

    /// Brings one corner to what it has to reach, as far as its friction cone allows.
    fn strike(&mut self, cube: &Cube, contact: &mut Contact) {
        let before = contact.impulse;
        let along = |axis: Vector| {
            let lever = cross(contact.arm, axis);
            1.0 / (1.0 / cube.mass + dot(lever, lever) / cube.inertia)
        };
        let speed = self.at(contact.arm);
        contact.impulse[2] = (before[2] + along([0.0, 0.0, 1.0]) * (contact.leaving - speed[2])).max(0.0);
        contact.impulse[0] = before[0] - along([1.0, 0.0, 0.0]) * speed[0];
        contact.impulse[1] = before[1] - along([0.0, 1.0, 0.0]) * speed[1];
        let (sliding, most) = (contact.impulse[0].hypot(contact.impulse[1]), cube.friction * contact.impulse[2]);
        if sliding > most {
            contact.impulse[0] *= most / sliding;
            contact.impulse[1] *= most / sliding;
        }
        let change: Vector = std::array::from_fn(|i| contact.impulse[i] - before[i]);
        self.velocity = sum(self.velocity, scaled(1.0 / cube.mass, change));
        self.rate = sum(self.rate, scaled(1.0 / cube.inertia, cross(contact.arm, change)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: Cube =
        Cube { mass: 0.4, inertia: 8e-4, half: 0.05, radius: 0.0, restitution: 0.5, friction: 0.2, gravity: 9.81 };

    fn dropped(cube: &Cube, mut body: Body, seconds: f64) -> Body {
        (0..(seconds / 1e-5) as usize).for_each(|_| body.advance(cube, 1e-5));
        body
    }

    fn flat(velocity: Vector) -> Body {
        Body { position: [0.0, 0.0, 0.05], attitude: [1.0, 0.0, 0.0, 0.0], velocity, rate: [0.0; 3] }
    }

    #[test]
    fn flat_impact_has_the_restitution_and_sliding_the_friction() {
        let weightless = Cube { gravity: 0.0, ..CUBE };
        let after = dropped(&weightless, flat([0.0, 0.0, -1.0]), 1e-3);
        assert!((after.velocity[2] - 0.5).abs() < 1e-3, "{after:?}");
        let slid = dropped(&CUBE, flat([1.0, 0.0, 0.0]), 0.1);
        assert!((slid.velocity[0] - (1.0 - 0.2 * 9.81 * 0.1)).abs() < 2e-3, "{slid:?}");
        let rest = dropped(&CUBE, Body { position: [0.0, 0.0, 0.08], ..flat([0.3, 0.0, 0.0]) }, 2.0);
        assert!(rest.velocity.iter().chain(&rest.rate).all(|v| v.abs() < 1e-2), "{rest:?}");
        assert!((rest.position[2] - 0.05).abs() < 1e-3, "{rest:?}");
    }
}
