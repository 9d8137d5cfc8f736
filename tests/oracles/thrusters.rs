//! Attitude control of the base by thruster pulses: impulses, limit cycle, damping of a rate, silence after the touch.

use super::bench::{assert_close, inertia, two_bodies};
use softdock_kernels::arm_motion::no_motion;
use softdock_kernels::guidance::guide;
use softdock_kernels::model::{Model, Thrusters};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Bodies, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::thrusters::{Firing, fire, no_firing};
use softdock_kernels::vector::{Vec3, vec3};

const INERTIA: f64 = 100.0;
const TORQUE: f64 = 1.0;
/// Pulse \[s\] and the rate that it gives \[rad/s\].
const PULSE: f64 = 0.02;
const STEP: f64 = TORQUE * PULSE / INERTIA;
const DEADBAND: f64 = 1e-3;
const LEAD: f64 = 2.0;

fn base(off_at_touch: bool) -> Model {
    let mut model = two_bodies(2.5e-4, 1.0, 10.0);
    model.timing.substeps = 4;
    model.base_inertia = inertia(INERTIA, INERTIA, INERTIA);
    let torque = vec3(TORQUE, TORQUE, TORQUE);
    model.guidance.thrusters = Some(Thrusters { torque, deadband: DEADBAND, lead: LEAD, pulse: 20, off_at_touch });
    model
}

/// Ticks of a free base from a rate; the thrusters and the bodies after each.
fn turned(model: Model, rate: Vec3<f64>, touched: f64, ticks: usize) -> Vec<(Firing<f64>, Bodies<f64, 0>)> {
    let m = Plant::new(model);
    let p = Params { chaser_rate: rate, tilt: vec3(0.02, -0.01, 0.03), base_mass: 500.0, ..Params::null() };
    let masses = space_masses(&p);
    let mut s = start::<f64, 0>(&m, &p, &masses);
    let (mut firing, mut seen) = (no_firing(), Vec::new());
    let none = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
    for _ in 0..ticks {
        let k = kinematics(&m, &masses, &s);
        firing = fire(&m, &firing, s.chaser.attitude, &k, touched);
        let (base, motion) = (s.chaser.attitude, no_motion());
        let u = guide(&m, &p, &masses, &s.arm, &s.drives, base, &k, touched, &motion, &firing);
        for _ in 0..4 {
            s = advance(&m, &masses, &s, &kinematics(&m, &masses, &s), &u, none);
        }
        s = settle(s);
        seen.push((firing, s));
    }
    seen
}

#[test]
fn limit_cycle_has_the_period_of_the_phase_plane() {
    // One pulse turns the rate round: the base drifts from switching line to switching line.
    let seen = turned(base(false), vec3(0.0, 0.0, 0.5 * STEP), 0.0, 100_000);
    let begins = seen.windows(2).enumerate().filter(|(_, pair)| pair[0].0.pulse.z == 0.0 && pair[1].0.pulse.z != 0.0);
    let times: Vec<f64> = begins.map(|(tick, _)| tick as f64 * 1e-3).collect();
    let half = 2.0 * (DEADBAND - LEAD * 0.5 * STEP) / (0.5 * STEP);
    assert!(times.len() >= 5, "{times:?}");
    for pair in times.windows(2) {
        assert_close("half a period", pair[1] - pair[0], half, 1e-2);
    }
    let (first, last) = (&seen[0].1, &seen[seen.len() - 1].1);
    assert_close("the rate's size stays", last.chaser.spin.norm(), first.chaser.spin.norm(), 1e-9);
}

#[test]
fn every_pulse_has_the_same_impulse_and_a_rate_dies_away() {
    let rate = vec3(0.004, -0.003, 0.002);
    let seen = turned(base(false), rate, 0.0, 60_000);
    let begins = |axis: fn(&Vec3<f64>) -> f64| {
        let of = |firing: &Firing<f64>| axis(&firing.pulse);
        // A pulse begins with its whole count.
        seen.iter().filter(|(firing, _)| of(firing).abs() == 20.0).map(|(firing, _)| of(firing).signum()).sum::<f64>()
    };
    let last = &seen[seen.len() - 1];
    let fired = vec3(begins(|v| v.x), begins(|v| v.y), begins(|v| v.z)) * (TORQUE * PULSE);
    // The body hardly turns, so that the impulses add up along its axes.
    let gained = last.1.chaser.spin - rate * INERTIA;
    let under_way = last.0.pulse.map(|left: f64| if left == 0.0 { 0.0 } else { TORQUE * PULSE });
    assert!((gained - fired).norm() < 0.02 * gained.norm() + under_way.norm(), "{gained:?} from {fired:?}");
    let still = last.1.chaser.spin * (1.0 / INERTIA);
    assert!(still.x.abs().max(still.y.abs()).max(still.z.abs()) < 1.5 * STEP, "{still:?}");
    // The thrusters' moments are in the account of momentum.
    let place = last.1.chaser.com.cross(last.1.chaser.momentum) + last.1.chaser.spin + last.1.target.spin;
    assert!((place - last.1.moment_impulse).norm() < 1e-11);
}

#[test]
fn thrusters_can_fall_silent_at_the_first_touch() {
    let rate = vec3(0.0, 0.01, 0.0);
    let silent = turned(base(true), rate, 1.0, 2000);
    assert!(silent.iter().all(|(firing, _)| firing.pulse == Vec3::zero()));
    assert!(turned(base(false), rate, 1.0, 2000).iter().any(|(firing, _)| firing.pulse.y < 0.0), "against the rate");
}
