//! Test motion: a known motion added to part A's command, and how the robots follow it.
//!
//! What an operator does before a campaign: a sine, a run at constant speed, or one with ramps of speed at both ends,
//! along one axis of the laboratory.

use crate::bundle;
use crate::math::{atan2, sin_cos};
use crate::model::{TestMotion, Waveform};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Parts};
use crate::vector::Vec3;
use std::f64::consts::TAU;

bundle! {
    /// What is kept of the robots' answer to a test motion; written by the tracking stage.
    Tracking {
        start: R, "m", "place of the mounted parts along the test's axis before the test";
        sine: R, "m s", "integral of displacement times the sine of the commanded phase";
        cosine: R, "m s", "integral of displacement times the cosine of the commanded phase";
        square: R, "m^2 s", "integral of the square of displacement less command";
        time: R, "s", "time over which the integrals run";
        top_speed: R, "m/s", "greatest speed along the test's axis";
    }
}

bundle! {
    /// How the robots followed a test motion.
    Followed {
        gain: R, "1", "amplitude over commanded amplitude";
        lag: R, "rad", "phase behind the command";
        error: R, "m", "root mean square of displacement less command";
        overshoot: R, "1", "greatest speed over the commanded one, less 1";
    }
}

/// Share of a trapezoid's time in which its speed rises, and in which it falls.
const RAMP: f64 = 0.25;

/// Before the test.
#[inline(always)]
pub fn no_tracking<R: Real>() -> Tracking<R> {
    crate::fields::filled(R::lit(0.0))
}

/// Displacement \[m\] and speed \[m/s\] of a test motion at a time \[s\] after its start; nothing before.
#[inline(always)]
fn displacement<R: Real>(test: &TestMotion, p: &Params<R>, time: R) -> (R, R) {
    let zero = R::lit(0.0);
    let (x, v) = match test.waveform {
        Waveform::Sine => {
            let rate = p.test_frequency * R::lit(TAU);
            let (s, c) = sin_cos(rate * time);
            (s * p.test_amplitude, c * p.test_amplitude * rate)
        }
        // Out at constant speed for half a period, then standing there.
        Waveform::Run => {
            let half = R::lit(0.5) / p.test_frequency;
            let speed = p.test_amplitude / half;
            (speed * time.min(half), R::select(time.lt(half), speed, zero))
        }
        Waveform::Trapezoid => trapezoid(p, time),
    };
    let begun = zero.le(time);
    (R::select(begun, x, zero), R::select(begun, v, zero))
}

/// Displacement and speed of a run of half a period whose speed rises and falls linearly.
#[inline(always)]
fn trapezoid<R: Real>(p: &Params<R>, time: R) -> (R, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let half = R::lit(0.5) / p.test_frequency;
    let (ramp, top) = (half * R::lit(RAMP), top_speed(Waveform::Trapezoid, p));
    let time = time.min(half);
    let (rising, falling) = (time.min(ramp), (time - (half - ramp)).max(zero));
    let cruising = (time - ramp).max(zero);
    let ramps = (rising * rising - falling * falling) * (R::lit(0.5) / ramp);
    (top * (cruising + ramps), top * ((rising - falling) / ramp).min(one))
}

/// Greatest speed of the command.
#[inline(always)]
fn top_speed<R: Real>(waveform: Waveform, p: &Params<R>) -> R {
    let factor = match waveform {
        Waveform::Sine => TAU,
        Waveform::Run => 2.0,
        Waveform::Trapezoid => 2.0 / (1.0 - RAMP),
    };
    p.test_amplitude * p.test_frequency * R::lit(factor)
}

/// A command with the test motion added to part A's.
#[inline(always)]
pub fn with_test<R: Real>(m: &Plant, p: &Params<R>, reference: &Parts<R>, time: R) -> Parts<R> {
    let Some(test) = &m.facility.test_motion else {
        return *reference;
    };
    let (x, v) = displacement(test, p, time - R::lit(test.begin));
    let axis = Vec3::lit(test.axis);
    let a = Motion {
        position: axis.scale_add(x, reference.a.position),
        velocity: axis.scale_add(v, reference.a.velocity),
        ..reference.a
    };
    Parts { a, ..*reference }
}

/// One tick of watching the mounted parts; `time` is that of the parts.
#[inline(always)]
pub fn track<R: Real>(m: &Plant, p: &Params<R>, s: &Tracking<R>, parts: &Parts<R>, time: R) -> Tracking<R> {
    let Some(test) = &m.facility.test_motion else {
        return *s;
    };
    let (axis, zero, tick) = (Vec3::lit(test.axis), R::lit(0.0), R::lit(m.timing.tick()));
    let place = axis.dot(parts.a.position - parts.b.position);
    let since = time - R::lit(test.begin);
    let start = R::select(since.le(zero), place, s.start);
    let (reference, _) = displacement(test, p, since);
    let (sine, cosine) = sin_cos(since * p.test_frequency * R::lit(TAU));
    let at = place - start;
    // Whole periods after the settling time, as many as there are before the run's end.
    let end = R::lit(f64::from(m.timing.max_ticks) * m.timing.tick() - test.begin - test.settle);
    let whole = (end * p.test_frequency).floor() / p.test_frequency;
    let settled = since - R::lit(test.settle);
    let counts = zero.lt(settled) & settled.le(whole);
    let weight = R::select(counts, tick, zero);
    let speed = axis.dot(parts.a.velocity - parts.b.velocity);
    Tracking {
        start,
        sine: (at * sine).mul_add(weight, s.sine),
        cosine: (at * cosine).mul_add(weight, s.cosine),
        square: ((at - reference) * (at - reference)).mul_add(weight, s.square),
        time: s.time + weight,
        top_speed: R::select(zero.lt(since), s.top_speed.max(speed), s.top_speed),
    }
}

/// Gain, lag, error and overshoot; a gain of -1 (and all else 0) without a test.
#[inline(always)]
pub fn followed<R: Real>(m: &Plant, p: &Params<R>, s: &Tracking<R>) -> Followed<R> {
    let (zero, one, two) = (R::lit(0.0), R::lit(1.0), R::lit(2.0));
    let Some(test) = &m.facility.test_motion else {
        return Followed { gain: -one, lag: zero, error: zero, overshoot: zero };
    };
    let seen = zero.lt(s.time);
    let time = R::select(seen, s.time, one);
    let amplitude = s.sine.mul_add(s.sine, s.cosine * s.cosine).sqrt() * (two / time);
    Followed {
        gain: R::select(seen, amplitude / p.test_amplitude, -one),
        lag: atan2(-s.cosine, s.sine),
        error: (s.square / time).sqrt(),
        overshoot: s.top_speed / top_speed(test.waveform, p) - one,
    }
}
