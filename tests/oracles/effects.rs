//! Effects of commands, fixture and simulated target against what they must do to the facility's loop.

use super::bench::{assert_close, closing, inertia, run, two_bodies};
use softdock_kernels::fixture::push_fixture;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::{Model, TestMotion, Waveform};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::{Robots, transport};
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::{Vec3, vec3};
use std::f64::consts::{PI, TAU};

const STEP: f64 = 1e-4;
const GAP: f64 = 0.1;
const SPEED: f64 = 0.1;

/// Two bodies that meet after a second.
fn meeting() -> Model {
    two_bodies(STEP, 1.2, GAP)
}

fn on_facility(model: Model, params: Params<f64>) -> Metrics<f64> {
    run(model, &[params])[0].hil
}

#[test]
fn a_clock_skew_makes_the_delay_grow_with_time() {
    let (delay, skew) = (4e-3, 0.02);
    let params = Params { loop_delay: delay, clock_skew: skew, ..closing(50.0, SPEED, 1e4, 0.0) };
    // The mounted parts are where the simulated ones were at t - delay - skew t.
    let touch = on_facility(meeting(), params).touch_time;
    let expected = (GAP / SPEED + delay) / (1.0 - skew);
    assert!((touch - expected).abs() <= 2.0 * STEP, "touch at {touch} s instead of {expected} s");
    let plant = Plant::new(meeting());
    let ticks = |time: f64| transport(&plant, &params, time) * STEP;
    assert!((ticks(3.0) - ticks(1.0) - 2.0 * skew).abs() < 1e-12);
    assert!(ticks(1e9) <= 0.128 + 1e-12, "longer than the delay lines are");
}

#[test]
fn a_held_command_adds_a_sawtooth_of_its_period_to_the_delay() {
    let mut model = meeting();
    (model.timing.substep, model.timing.substeps, model.timing.max_ticks) = (2.5e-4, 4, 1200);
    let (tick, hold) = (1e-3, 8e-3);
    let own = model.timing.own_delay();
    let params = Params { loop_delay: own + 3e-3, command_hold: hold, ..closing(50.0, SPEED, 1e4, 0.0) };
    let plant = Plant::new(model.clone());
    for n in 0..10_000 {
        let late = transport(&plant, &params, f64::from(n) * tick) - 3.0;
        assert!((late - f64::from(n % 8)).abs() < 1e-9, "tick {n}: {late}");
    }
    // Nothing moves between the first substeps of two periods.
    let touch = on_facility(model, params).touch_time;
    let period = (touch + 0.75 * tick) / hold;
    assert!((period - period.round()).abs() < 1e-6, "touch at {touch} s");
    assert!(touch > GAP / SPEED + 3e-3 - tick && touch < GAP / SPEED + 3e-3 + hold + tick, "touch at {touch} s");
}

#[test]
fn a_rate_limit_is_the_tools_greatest_speed_with_and_without_a_lag() {
    let mut model = two_bodies(1e-3, 1.0, 10.0);
    let axis = vec3(1.0, 0.0, 0.0);
    model.facility.test_motion = Some(TestMotion { axis, waveform: Waveform::Run, begin: 0.0, settle: 0.0 });
    let still = Params { test_amplitude: 0.05, test_frequency: 1.0, ..closing(50.0, 0.0, 1e4, 0.0) };
    for robot1_lag in [0.0, 0.01] {
        let at = |tool_speed_limit: f64| on_facility(model.clone(), Params { tool_speed_limit, robot1_lag, ..still });
        // 0.1 m/s are asked for.
        assert!((at(0.04).tracking_overshoot + 0.6).abs() < 1e-6, "{}", at(0.04).tracking_overshoot);
        assert!(at(0.2).tracking_overshoot.abs() < 1e-6, "{}", at(0.2).tracking_overshoot);
    }
}

/// Part B's displacement along x on its mount, substep by substep, under a constant force on part A.
fn pushed(params: &Params<f64>, substep: f64, count: usize, force: f64) -> Vec<f64> {
    let plant = Plant::new(two_bodies(substep, 1.0, 1.0));
    let mut s: Robots<f64> = softdock_kernels::fields::filled(0.0);
    let w = Wrench { force: vec3(force, 0.0, 0.0), moment: Vec3::zero() };
    let mut step = |_| {
        s = push_fixture(&plant, params, &s, w);
        s.fixture.shift.x
    };
    (0..count).map(&mut step).collect()
}

#[test]
fn fixture_oscillates_at_its_frequency_about_its_deflection() {
    let (compliance, frequency, force) = (2e-6, 40.0, -300.0);
    let params =
        Params { fixture_compliance: compliance, fixture_frequency: frequency, fixture_damping: 0.0, ..Params::null() };
    // Part A is pushed back, part B with the same force forwards.
    let rest = -compliance * force;
    for (index, shift) in pushed(&params, STEP, 5000, force).into_iter().enumerate() {
        let time = (index + 1) as f64 * STEP;
        let expected = rest * (1.0 - (TAU * frequency * time).cos());
        // The midpoint rule is late by (w dt)^2 / 12 of the phase.
        let late = (TAU * frequency * STEP).powi(2) / 12.0 * TAU * frequency * time;
        assert!((shift - expected).abs() <= rest * (2.0 * late + 1e-4), "{shift} for {expected} at {time} s");
    }
    let damped = Params { fixture_damping: 0.1, ..params };
    let end = *pushed(&damped, STEP, 20_000, force).last().expect("steps");
    assert_close("given way", end, rest, 1e-9);
    let coarse = pushed(&Params { fixture_frequency: 1000.0, ..damped }, 1e-2, 3000, force);
    assert!(coarse.iter().all(|shift| shift.abs() <= 2.1 * rest), "unstable at w dt = 63");
}

#[test]
fn contact_lasts_longer_on_a_compliant_fixture() {
    // A mount far quicker than the contact is a spring in series: 1/k + c.
    let (mass, stiffness, compliance) = (50.0, 5e4, 1e-5);
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    model.task.end_after_separation = 2e-3;
    let soft =
        Params { fixture_compliance: compliance, fixture_frequency: 800.0, ..closing(mass, SPEED, stiffness, 0.0) };
    let together = 1.0 / (1.0 / stiffness + compliance);
    let soft = on_facility(model.clone(), Params { fixture_damping: 0.3, ..soft });
    assert_close("duration", soft.contact_duration, PI * (mass / together).sqrt(), 0.02);
    let rigid = on_facility(model, closing(mass, SPEED, stiffness, 0.0));
    assert_close("duration on a rigid mount", rigid.contact_duration, PI * (mass / stiffness).sqrt(), 1e-3);
}

/// A bounce of two equal bodies, free of friction and damping.
fn bouncing(change: impl Fn(&mut Params<f64>)) -> (Metrics<f64>, Metrics<f64>) {
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    model.task.end_after_separation = 2e-3;
    model.target_inertia = inertia(10.0, 10.0, 10.0);
    let mut params = closing(50.0, SPEED, 5e4, 0.0);
    change(&mut params);
    let row = run(model, &[params])[0];
    (row.space, row.hil)
}

#[test]
fn short_contact_does_not_excite_the_sloshing_mass() {
    let share = 0.4;
    let hanging: [fn(&mut Params<f64>); 2] = [
        |p| (p.slosh_share, p.slosh_frequency) = (0.4, 0.2),
        |p| (p.appendage_share, p.appendage_frequency) = (0.4, 0.2),
    ];
    for hang in hanging {
        let (space, hil) = bouncing(hang);
        // 100 kg against 60 kg; half a period of 0.1 s against a period of 4 s.
        let reduced = 100.0 * (1.0 - share) / (2.0 - share);
        assert_close("duration", hil.contact_duration, PI * (reduced / 5e4_f64).sqrt(), 0.02);
        assert_close("duration in space", space.contact_duration, PI * (50.0 / 5e4_f64).sqrt(), 1e-3);
        assert!(hil.linear_momentum_error < 1e-12, "what sways carries momentum: {}", hil.linear_momentum_error);
        assert!(hil.angular_momentum_error < 1e-12, "{}", hil.angular_momentum_error);
    }
}

#[test]
fn eccentric_impact_is_reduced_by_target_rotation() {
    let offset = 0.2;
    let (space, hil) = bouncing(|p| p.target_com_error = vec3(0.0, offset, 0.0));
    let mobility = 0.01 + 0.01 + offset * offset / 10.0;
    assert_close("duration", hil.contact_duration, PI / (mobility * 5e4).sqrt(), 0.01);
    assert_close("duration in space", space.contact_duration, PI * (50.0 / 5e4_f64).sqrt(), 1e-3);
    assert!(hil.touch_time == space.touch_time, "part B stands where it stood");
    assert!(hil.angular_momentum_error < 1e-12, "{}", hil.angular_momentum_error);
}
