//! Sensor stage: the force/torque sensor between robot 1's flange and part A, in part A's axes about A's origin.

use crate::bundle;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Wrench};
use crate::vector::Vec3;

bundle! {
    /// The sensor; written by the sensor stage.
    Sensor {
        filtered: Wrench<R>, "1", "wrench behind the low-pass";
        output: Wrench<R>, "1", "last sample as it leaves the sensor";
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
    let pass = |old: Vec3<R>, new: Vec3<R>| Vec3::select(none, new, (new - old).scale_add(gain, old));
    let filtered = Wrench { force: pass(s.filtered.force, w.force), moment: pass(s.filtered.moment, w.moment) };
    Sensor { filtered, ..*s }
}

/// One sample: gain, crosstalk, bias, noise (unit normal deviates), saturation, quantisation.
#[inline(always)]
pub fn sample<R: Real>(m: &Plant, p: &Params<R>, s: &Sensor<R>, noise: Wrench<R>) -> Sensor<R> {
    let one = R::lit(1.0);
    let (f, t) = (s.filtered.force, s.filtered.moment);
    let leak = crosstalk(m, f, t);
    let gained = |true_value: Vec3<R>, gain: Vec3<R>, leak: Vec3<R>, bias: Vec3<R>| {
        leak.scale_add(p.sensor_crosstalk, true_value.zip(gain, |v, g| v * (one + g))) + bias
    };
    let force = gained(f, p.sensor_gain_force, leak.force, p.sensor_bias_force);
    let moment = gained(t, p.sensor_gain_moment, leak.moment, p.sensor_bias_moment);
    let noisy = Wrench {
        force: noise.force.scale_add(p.sensor_noise_force, force),
        moment: noise.moment.scale_add(p.sensor_noise_moment, moment),
    };
    let cut =
        Wrench { force: noisy.force.clamp(p.sensor_range_force), moment: noisy.moment.clamp(p.sensor_range_moment) };
    let over = (p.sensor_range_force.lt(largest(noisy.force))) | (p.sensor_range_moment.lt(largest(noisy.moment)));
    Sensor {
        output: Wrench {
            force: cut.force.map(|v| quantised(v, p.sensor_resolution_force)),
            moment: cut.moment.map(|v| quantised(v, p.sensor_resolution_moment)),
        },
        saturated: R::select(over, one, s.saturated),
        ..*s
    }
}

/// The facility's crosstalk pattern applied to a wrench.
#[inline(always)]
fn crosstalk<R: Real>(m: &Plant, force: Vec3<R>, moment: Vec3<R>) -> Wrench<R> {
    let row = |i: usize| {
        let c = &m.facility.crosstalk[i];
        let lit = |a: usize| Vec3::lit(crate::vector::vec3(c[a], c[a + 1], c[a + 2]));
        lit(0).dot(force) + lit(3).dot(moment)
    };
    Wrench { force: crate::vector::vec3(row(0), row(1), row(2)), moment: crate::vector::vec3(row(3), row(4), row(5)) }
}

#[inline(always)]
fn largest<R: Real>(v: Vec3<R>) -> R {
    v.x.abs().max(v.y.abs()).max(v.z.abs())
}

/// The nearest whole multiple of the step; any value if there is no step.
#[inline(always)]
fn quantised<R: Real>(value: R, step: R) -> R {
    let none = step.le(R::lit(0.0));
    let steps = (value / R::select(none, R::lit(1.0), step) + R::lit(0.5)).floor();
    R::select(none, value, steps * step)
}

/// Between two samples: 0 gives the newer, 1 the older.
#[inline(always)]
pub fn blend<R: Real>(newer: Wrench<R>, older: Wrench<R>, age: R) -> Wrench<R> {
    let mix = |n: Vec3<R>, o: Vec3<R>| (o - n).scale_add(age, n);
    Wrench { force: mix(newer.force, older.force), moment: mix(newer.moment, older.moment) }
}
