//! Sensor stage: the force/torque sensor between robot 1's flange and part A, in part A's axes about A's origin.

use crate::bundle;
use crate::effects::EffectId;
use crate::params::Params;
use crate::plant::Plant;
use crate::range::MAX_DELAY_S;
use crate::real::Real;
use crate::space::{Motion, Wrench};
use crate::vector::{Vec3, vec3};

const CROSSTALK: EffectId = EffectId::of("S4_crosstalk");

bundle! {
    /// The sensor; written by the sensor stage.
    Sensor {
        filtered: Wrench<R>, "1", "wrench behind the low-pass";
        output: Wrench<R>, "1", "last sample of the sensor";
        saturated: R, "1", "1 once a channel has saturated";
    }
}

/// A wrench on part A from inertial axes to part A's axes.
#[inline(always)]
pub fn to_sensor<R: Real>(a: Motion<R>, w: Wrench<R>) -> Wrench<R> {
    Wrench { force: a.attitude.rotate_back(w.force), moment: a.attitude.rotate_back(w.moment) }
}

/// The measured wrench on the simulated part A, in inertial axes.
#[inline(always)]
pub fn feed_back<R: Real>(a: Motion<R>, w: Wrench<R>) -> Wrench<R> {
    Wrench { force: a.attitude.rotate(w.force), moment: a.attitude.rotate(w.moment) }
}

/// First-order low-pass, backward Euler; without a time constant the wrench passes unchanged.
#[inline(always)]
pub fn low_pass<R: Real>(m: &Plant, p: &Params<R>, s: &Sensor<R>, w: Wrench<R>) -> Sensor<R> {
    let dt = R::lit(m.timing.substep);
    let (gain, none) = (dt / (dt + p.sensor_lag), p.sensor_lag.le(R::lit(0.0)));
    let (force, moment) = (s.filtered.force, s.filtered.moment);
    let filtered = Wrench {
        force: Vec3::select(none, w.force, (w.force - force).scale_add(gain, force)),
        moment: Vec3::select(none, w.moment, (w.moment - moment).scale_add(gain, moment)),
    };
    Sensor { filtered, ..*s }
}

/// What a sensor without noise, range and quantum reads: gain, crosstalk, bias and its drift until now.
#[inline(always)]
pub(crate) fn distorted<R: Real>(m: &Plant, p: &Params<R>, time: R, w: Wrench<R>) -> Wrench<R> {
    let gained_force = w.force.zip(p.sensor_gain_force, |v, gain| v.mul_add(gain, v));
    let gained_moment = w.moment.zip(p.sensor_gain_moment, |v, gain| v.mul_add(gain, v));
    let bias = p.sensor_drift_force.scale_add(time, p.sensor_bias_force);
    let bias_moment = p.sensor_drift_moment.scale_add(time, p.sensor_bias_moment);
    let mut read = Wrench { force: gained_force, moment: gained_moment };
    if m.effects.has(CROSSTALK) {
        read = crosstalk(m, w.force, w.moment).scale_add(p.sensor_crosstalk, read);
    }
    Wrench { force: read.force + bias, moment: read.moment + bias_moment }
}

/// One sample: distortion, noise (unit normal deviates), saturation, quantisation.
#[inline(always)]
pub fn sample<R: Real>(m: &Plant, p: &Params<R>, s: &Sensor<R>, time: R, noise: Wrench<R>) -> Sensor<R> {
    let one = R::lit(1.0);
    let read = distorted(m, p, time, s.filtered);
    let noisy = Wrench {
        force: noise.force.scale_add(p.sensor_noise_force, read.force),
        moment: noise.moment.scale_add(p.sensor_noise_moment, read.moment),
    };
    let cut =
        Wrench { force: noisy.force.clamp(p.sensor_range_force), moment: noisy.moment.clamp(p.sensor_range_moment) };
    let over = (p.sensor_range_force.lt(largest(noisy.force))) | (p.sensor_range_moment.lt(largest(noisy.moment)));
    Sensor {
        output: Wrench {
            force: quantised(cut.force, p.sensor_resolution_force),
            moment: quantised(cut.moment, p.sensor_resolution_moment),
        },
        saturated: R::select(over, one, s.saturated),
        ..*s
    }
}

/// The facility's crosstalk pattern applied to a wrench.
#[inline(always)]
fn crosstalk<R: Real>(m: &Plant, force: Vec3<R>, moment: Vec3<R>) -> Wrench<R> {
    let row = |i| crosstalk_row(m, i, force, moment);
    Wrench { force: vec3(row(0), row(1), row(2)), moment: vec3(row(3), row(4), row(5)) }
}

#[inline(always)]
fn crosstalk_row<R: Real>(m: &Plant, row: usize, force: Vec3<R>, moment: Vec3<R>) -> R {
    let c = &m.facility.crosstalk[row];
    Vec3::lit(vec3(c[0], c[1], c[2])).dot(force) + Vec3::lit(vec3(c[3], c[4], c[5])).dot(moment)
}

#[inline(always)]
fn largest<R: Real>(v: Vec3<R>) -> R {
    v.x.abs().max(v.y.abs()).max(v.z.abs())
}

/// The nearest whole multiples of the step; any value if there is no step.
#[inline(always)]
fn quantised<R: Real>(value: Vec3<R>, step: R) -> Vec3<R> {
    let none = step.le(R::lit(0.0));
    let inverse = R::lit(1.0) / R::select(none, R::lit(1.0), step);
    let steps = (value * inverse + Vec3::splat(R::lit(0.5))).map(R::floor);
    Vec3::select(none, value, steps * step)
}

/// How long ago a wrench that arrives now was sampled, in ticks.
#[inline(always)]
pub fn wrench_age<R: Real>(m: &Plant, p: &Params<R>) -> R {
    let late = (p.sensor_delay + p.sensor_delay_error).max(R::lit(0.0));
    late.min(R::lit(MAX_DELAY_S)) * R::lit(1.0 / m.timing.tick())
}

/// Between two samples: 0 gives the newer, 1 the older.
#[inline(always)]
pub fn blend<R: Real>(newer: Wrench<R>, older: Wrench<R>, age: R) -> Wrench<R> {
    let mix = |n: Vec3<R>, o: Vec3<R>| (o - n).scale_add(age, n);
    Wrench { force: mix(newer.force, older.force), moment: mix(newer.moment, older.moment) }
}
