//! A free body between the wrench on it and the motion that its instruments show.
//!
//! One rigid body by Newton and Euler, with up to two masses on springs inside it (liquid that sways, a boom that bends):
//! they take their share of the whole's mass, centre and inertia. No gravity. Everything in body axes, moments about
//! their origin. The simulated rate is held to the measured one by a weak observer, so that disturbances, whose impulses
//! add up, are forgotten; the acceleration is not integrated at all.

use super::Block;
use crate::bundle;
use crate::fields::filled;
use crate::modes::{Mode, Sway};
use crate::real::Real;
use crate::space::Wrench;
use crate::vector::{Sym3, Vec3};
use std::f64::consts::TAU;

bundle! {
    /// A mass that hangs on springs in the body.
    Hung {
        mass: R, "kg", "its mass, part of the whole";
        frequency: R, "Hz", "natural frequency with the body fixed";
        damping: R, "1", "damping ratio";
        place: Vec3<R>, "m", "where it rests";
    }
}

bundle! {
    /// A body's values, effects and what may differ unnoticed.
    BodyValues {
        mass: R, "kg", "mass of the whole";
        centre: Vec3<R>, "m", "its centre of mass";
        inertia: Vec3<R>, "kg m^2", "its moments of inertia about the centre of mass";
        slosh: Hung<R>, "1", "liquid that sways";
        appendage: Hung<R>, "1", "tip of a boom that bends";
        accelerometer_bias: Vec3<R>, "m/s^2", "acceleration read without any";
        gyroscope_bias: Vec3<R>, "rad/s", "rate read without any";
        clock_offset: R, "s", "delay of the wrench against its time stamp, without a common clock";
    }
}

impl BodyValues<f64> {
    /// A ball of a kilogram without anything inside it or errors.
    pub fn null() -> Self {
        let none = filled(0.0);
        let inertia = Vec3::splat(1.0);
        let slosh = Hung { frequency: 0.5, damping: 0.02, ..none };
        let appendage = Hung { frequency: 3.0, damping: 0.005, ..none };
        Self { mass: 1.0, inertia, slosh, appendage, ..filled(0.0) }
    }
}

bundle! {
    /// What is known of a body at an instant.
    BodyInput {
        rate: Vec3<R>, "rad/s", "rate that the gyroscope reads";
        steady: R, "1", "0 where the wrench jumps within its clock's tolerance, so that the acceleration is not known; else 1";
    }
}

bundle! {
    /// What is hidden in a body.
    BodyHidden {
        rate: Vec3<R>, "rad/s", "rate of the body";
        slosh: Sway<R>, "1", "the liquid from its place, body axes";
        appendage: Sway<R>, "1", "the boom's tip from its place, body axes";
    }
}

bundle! {
    /// Output of a body's model for a recording.
    BodyOutput {
        acceleration: Vec3<R>, "m/s^2", "acceleration of the origin, body axes";
        rate: Vec3<R>, "rad/s", "rate of the body";
    }
}

/// A free body, from wrench to motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct BodyBlock;

/// Rate at which the observer forgets \[1/s\]: a third of what rings most slowly, 0.15 Hz.
pub(super) const OBSERVER: f64 = TAU * 0.05;

/// Least share of the whole's mass that the body itself keeps.
const LEAST_REST: f64 = 0.05;

impl Block for BodyBlock {
    type Params<R: Real> = BodyValues<R>;
    type State<R: Real> = BodyHidden<R>;
    type Input<R: Real> = BodyInput<R>;
    /// Mean wrench over the step that ends at an instant.
    type Late<R: Real> = Wrench<R>;
    type Output<R: Real> = BodyOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &BodyValues<R>, _time: R) -> R {
        p.clock_offset
    }

    /// What hangs in it rests.
    #[inline(always)]
    fn start<R: Real>(&self, p: &BodyValues<R>, u: &BodyInput<R>, _late: &Wrench<R>) -> BodyHidden<R> {
        let none = Sway { shift: Vec3::zero(), velocity: Vec3::zero() };
        BodyHidden { rate: u.rate - p.gyroscope_bias, slosh: none, appendage: none }
    }

    /// Half a drift, a kick, half a drift: exact to second order but for the slow turning of the axes.
    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &BodyValues<R>,
        s: &BodyHidden<R>,
        u: &BodyInput<R>,
        late: &Wrench<R>,
    ) -> BodyHidden<R> {
        let half = R::lit(0.5 * step);
        let at = BodyHidden { rate: s.rate, slosh: drifted(half, &s.slosh), appendage: drifted(half, &s.appendage) };
        let a = accelerations(p, &at, late);
        // What is read is the rate at the end of the step: compared with that at its start, it would always be ahead of a
        // rate that grows, and the body would seem harder to turn by a share of a step over what the observer forgets in.
        let turned = a.angular.scale_add(R::lit(step), s.rate);
        let behind = u.rate - p.gyroscope_bias - turned;
        BodyHidden {
            rate: behind.scale_add(R::lit(OBSERVER * step), turned),
            slosh: drifted(half, &kicked(step, &at.slosh, a.slosh)),
            appendage: drifted(half, &kicked(step, &at.appendage, a.appendage)),
        }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &BodyValues<R>,
        s: &BodyHidden<R>,
        u: &BodyInput<R>,
        late: &Wrench<R>,
    ) -> BodyOutput<R> {
        let acceleration = accelerations(p, s, late).origin + p.accelerometer_bias;
        BodyOutput { acceleration: acceleration * u.steady, rate: s.rate + p.gyroscope_bias }
    }
}

/// Where a hung mass is a time \[s\] later.
#[inline(always)]
fn drifted<R: Real>(time: R, s: &Sway<R>) -> Sway<R> {
    Sway { shift: s.velocity.scale_add(time, s.shift), velocity: s.velocity }
}

/// How it moves a step \[s\] later.
#[inline(always)]
fn kicked<R: Real>(step: f64, s: &Sway<R>, acceleration: Vec3<R>) -> Sway<R> {
    Sway { shift: s.shift, velocity: acceleration.scale_add(R::lit(step), s.velocity) }
}

/// Accelerations in body axes.
struct Accelerations<R> {
    /// Of the axes' origin \[m/s^2\].
    origin: Vec3<R>,
    /// Angular \[rad/s^2\].
    angular: Vec3<R>,
    /// Of what hangs in the body, as the body sees it \[m/s^2\].
    slosh: Vec3<R>,
    appendage: Vec3<R>,
}

/// The whole less what hangs in it.
struct Rest<R> {
    mass: R,
    centre: Vec3<R>,
    /// About its centre.
    inertia: Sym3<R>,
}

impl<R: Real> Rest<R> {
    #[inline(always)]
    fn of(p: &BodyValues<R>) -> Self {
        let (slosh, appendage) = (&p.slosh, &p.appendage);
        let mass = (p.mass - slosh.mass - appendage.mass).max(p.mass * R::lit(LEAST_REST));
        let first = p.centre * p.mass - slosh.place * slosh.mass - appendage.place * appendage.mass;
        let centre = first * (R::lit(1.0) / mass);
        let second = Sym3::diagonal(p.inertia) + Sym3::point_mass(p.mass, p.centre);
        let hung = Sym3::point_mass(-slosh.mass, slosh.place) + Sym3::point_mass(-appendage.mass, appendage.place);
        Self { mass, centre, inertia: second + hung + Sym3::point_mass(-mass, centre) }
    }
}

impl<R: Real> Hung<R> {
    #[inline(always)]
    fn pull(&self, s: &Sway<R>) -> Vec3<R> {
        Mode { share: self.mass, frequency: self.frequency * R::lit(TAU), damping: self.damping }.pull(s)
    }
}

/// Newton and Euler for the body without what hangs in it, which pulls at it where it is; then Newton for that.
#[inline(always)]
fn accelerations<R: Real>(p: &BodyValues<R>, s: &BodyHidden<R>, w: &Wrench<R>) -> Accelerations<R> {
    let rest = Rest::of(p);
    let (slosh, appendage) = (p.slosh.pull(&s.slosh), p.appendage.pull(&s.appendage));
    let (by_slosh, by_appendage) = (slosh * p.slosh.mass, appendage * p.appendage.mass);
    let (slosh_at, tip_at) = (p.slosh.place + s.slosh.shift, p.appendage.place + s.appendage.shift);
    let force = w.force + by_slosh + by_appendage;
    let moment = w.moment + slosh_at.cross(by_slosh) + tip_at.cross(by_appendage);
    let about_centre = moment - rest.centre.cross(force) - s.rate.cross(rest.inertia.times(s.rate));
    let angular = rest.inertia.inverse().times(about_centre);
    let origin = force * (R::lit(1.0) / rest.mass) - carried(s.rate, angular, rest.centre);
    Accelerations {
        origin,
        angular,
        slosh: -(slosh + seen(s.rate, angular, origin, slosh_at, &s.slosh)),
        appendage: -(appendage + seen(s.rate, angular, origin, tip_at, &s.appendage)),
    }
}

/// Acceleration of a place in turning axes from that of their origin.
#[inline(always)]
fn carried<R: Real>(rate: Vec3<R>, angular: Vec3<R>, place: Vec3<R>) -> Vec3<R> {
    angular.cross(place) + rate.cross(rate.cross(place))
}

/// Acceleration of the axes at a place that moves in them, Coriolis' included.
#[inline(always)]
fn seen<R: Real>(rate: Vec3<R>, angular: Vec3<R>, origin: Vec3<R>, at: Vec3<R>, s: &Sway<R>) -> Vec3<R> {
    origin + carried(rate, angular, at) + rate.cross(s.velocity) * R::lit(2.0)
}
