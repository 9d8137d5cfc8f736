//! Load of the sensor: weight and inertia force of part A behind it, the facility's estimate of both, and the
//! tare before a run.
//!
//! The load is a point mass at its centre. The sensor feels m (g - a) besides the contact; the facility subtracts its
//! own m^ (g - a) at its own centre, or m^ g alone. A tare takes off what is read at the start pose without contact:
//! bias and error of the weight there, not drift, and not what turns with the attitude.

use crate::bundle;
use crate::model::SensorLoad;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::sensor::{Sensor, distorted};
use crate::space::{Motion, Wrench};
use crate::vector::Vec3;

bundle! {
    /// The load between two substeps.
    Load {
        velocity: Vec3<R>, "m/s", "velocity of the load's centre at the last substep, laboratory";
        acceleration: Vec3<R>, "m/s^2", "acceleration of the load's centre over the last substep, laboratory";
        tare: Wrench<R>, "1", "result of the tare, part A's axes";
    }
}

/// Whether anything is felt or taken off besides the contact.
pub fn loaded(m: &Plant) -> bool {
    m.facility.load.is_some() || m.facility.tared
}

/// The load after one more substep of its part.
#[inline(always)]
pub fn carry<R: Real>(m: &Plant, s: &Load<R>, a: Motion<R>) -> Load<R> {
    let velocity = centre_velocity(m, a);
    let acceleration = (velocity - s.velocity) * R::lit(1.0 / m.timing.substep);
    Load { velocity, acceleration, ..*s }
}

#[inline(always)]
fn centre_velocity<R: Real>(m: &Plant, a: Motion<R>) -> Vec3<R> {
    match m.facility.load {
        Some(load) => a.velocity + a.omega.cross(a.attitude.rotate(Vec3::lit(load.centre))),
        None => Vec3::zero(),
    }
}

/// The contact wrench with what the load adds to it, part A's axes.
#[inline(always)]
pub fn felt<R: Real>(m: &Plant, s: &Load<R>, a: Motion<R>, w: Wrench<R>) -> Wrench<R> {
    match m.facility.load {
        Some(load) => w + pull(load, a, s.acceleration, R::lit(load.mass), Vec3::lit(load.centre)),
        None => w,
    }
}

/// m (g - a) at a centre, part A's axes.
#[inline(always)]
fn pull<R: Real>(load: SensorLoad, a: Motion<R>, acceleration: Vec3<R>, mass: R, centre: Vec3<R>) -> Wrench<R> {
    let force = a.attitude.rotate_back((Vec3::lit(load.gravity) - acceleration) * mass);
    Wrench { force, moment: centre.cross(force) }
}

/// What the facility takes for the load's wrench.
#[inline(always)]
fn estimated<R: Real>(m: &Plant, p: &Params<R>, a: Motion<R>, acceleration: Vec3<R>) -> Wrench<R> {
    let Some(load) = m.facility.load else {
        return Wrench::zero();
    };
    let known = if load.inertia_compensated { acceleration } else { Vec3::zero() };
    let mass = R::lit(load.mass) * (R::lit(1.0) + p.load_mass_error);
    pull(load, a, known, mass, Vec3::lit(load.centre) + p.load_centre_error)
}

/// A sample as the simulation gets it: less the estimate of the load, less the tare.
#[inline(always)]
pub fn without_load<R: Real>(m: &Plant, p: &Params<R>, s: &Load<R>, a: Motion<R>, sensor: &Sensor<R>) -> Sensor<R> {
    let output = sensor.output - estimated(m, p, a, s.acceleration) - s.tare;
    Sensor { output, ..*sensor }
}

/// The load at the start, its tare taken.
#[inline(always)]
pub fn load_at<R: Real>(m: &Plant, p: &Params<R>, a: Motion<R>) -> Load<R> {
    let none = Wrench::zero();
    let rest = Load { velocity: centre_velocity(m, a), acceleration: Vec3::zero(), tare: none };
    if !m.facility.tared {
        return rest;
    }
    let read = distorted(m, p, R::lit(0.0), felt(m, &rest, a, none));
    let error = Wrench { force: p.tare_error_force, moment: p.tare_error_moment };
    Load { tare: read - estimated(m, p, a, Vec3::zero()) + error, ..rest }
}

/// The sensor at the start: its low-pass has long settled on the load's weight.
#[inline(always)]
pub fn sensor_at<R: Real>(m: &Plant, s: &Load<R>, a: Motion<R>) -> Sensor<R> {
    let none = Wrench::zero();
    Sensor { filtered: felt(m, s, a, none), output: none, saturated: R::lit(0.0) }
}
