//! Growth of a bilateral contact through the loop: critical delays, lags, the step's and the hold's own part.

use super::bench::{assert_close, closing, job, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;

/// A contact that never opens, of `substeps` steps a tick.
pub(super) fn spring(substep: f64, substeps: u32) -> Model {
    let mut model = two_bodies(substep, 0.0, 0.0);
    model.timing.substeps = substeps;
    model.contact.bilateral = true;
    model
}

/// Logarithmic growth of the dominant oscillation per second, from four samples a quarter period or so apart.
///
/// With one pair of roots z left, x0..x3 obey x[n+2] = p x[n+1] - |z|^2 x[n]; four samples give |z|.
pub(super) fn growth(mut model: Model, params: Params<f64>, settle: f64, stride: f64) -> f64 {
    let tick = model.timing.tick();
    let (first, stride) = ((settle / tick).round() as u32, (stride / tick).round() as u32);
    model.timing.max_ticks = first + 3 * stride + 2;
    let (mut count, mut x) = (0, Vec::new());
    replay(&job(model, &[params]), RunInput::new(0, params), &mut |signals| {
        if count >= first && (count - first) % stride == 0 {
            x.push(signals.parts[1].a.position.x - signals.parts[1].b.position.x);
        }
        count += 1;
    });
    let square = (x[2] * x[2] - x[1] * x[3]) / (x[1] * x[1] - x[0] * x[2]);
    square.ln() / (2.0 * f64::from(stride) * tick)
}

/// Growth on an otherwise ideal facility.
fn delayed(mass: f64, stiffness: f64, damping: f64, delay: f64, substep: f64) -> f64 {
    let params = Params { loop_delay: delay, ..closing(mass, 0.01, stiffness, damping) };
    let period = std::f64::consts::TAU / (stiffness / mass).sqrt();
    growth(spring(substep, 1), params, 2.0 * period, period / 4.0)
}

#[test]
fn the_critical_delay_of_a_damped_contact_is_met_within_one_percent() {
    // The third row of the source, (1, 1, 0.3) with 0.291084 s, on a clock ten times as fast: delay lines end at 128 ms.
    for (mass, stiffness, damping, critical) in
        [(100.0, 1e4, 50.0, 4.99583e-3), (500.0, 1e5, 2000.0, 19.4711e-3), (1.0, 100.0, 3.0, 29.1084e-3)]
    {
        let at = |factor| delayed(mass, stiffness, damping, factor * critical, 1e-4);
        let (below, above) = (at(0.99), at(1.01));
        assert!(below < 0.0 && above > 0.0, "h* = {critical}: growth {below} at -1 %, {above} at +1 %");
    }
}

#[test]
fn a_second_order_robot_is_stable_between_the_two_routh_limits() {
    // m = 200 kg, w = 25 rad/s, z = 0.7, k = 2e4 N/m: stable for b in (1400, 5600) N s/m.
    let at = |damping: f64| {
        let params = Params {
            robot1_lag: 1.0 / 25.0,
            robot1_lag_damping: 0.7,
            robot2_lag: 1.0 / 25.0,
            robot2_lag_damping: 0.7,
            ..closing(200.0, 0.01, 2e4, damping)
        };
        growth(spring(5e-5, 1), params, 3.0, 0.06)
    };
    let found = [0.98 * 1400.0, 1.02 * 1400.0, 0.98 * 5600.0, 1.02 * 5600.0].map(at);
    assert!(found[0] > 0.0 && found[1] < 0.0 && found[2] < 0.0 && found[3] > 0.0, "growth {found:?}");
}

#[test]
fn a_low_pass_in_the_sensor_needs_damping_above_stiffness_times_lag() {
    let at = |factor: f64| {
        let params = Params { sensor_lag: 5e-3, ..closing(100.0, 0.01, 1e4, factor * 50.0) };
        growth(spring(2e-5, 1), params, 1.0, 0.15)
    };
    let (below, above) = (at(0.98), at(1.02));
    assert!(below > 0.0 && above < 0.0, "growth {below} at 0.98 k tau, {above} at 1.02 k tau");
}

#[test]
fn the_step_and_whole_steps_of_delay_grow_as_their_characteristic_equation() {
    // z^(d-1) (z-1)^2 + k dt^2/m = 0 at k dt^2/m = 1e-4: |z| - 1 to six digits.
    let (step, mass) = (1e-3, 100.0);
    for (steps, excess) in [(1.0, 4.999875e-5), (2.0, 9.998001e-5), (5.0, 2.496197e-4), (10.0, 4.968315e-4)] {
        let rate = delayed(mass, 1e-4 * mass / (step * step), 0.0, steps * step, step);
        assert_close(&format!("|z| - 1 at {steps} steps"), (rate * step).exp_m1(), excess, 1e-4);
    }
    let none = delayed(mass, 1e-4 * mass / (step * step), 0.0, 0.0, step);
    assert!(none.abs() < 1e-9, "without delay nothing grows: {none}");
}

#[test]
fn damping_limit_of_the_discrete_loop_matches_its_roots() {
    // b_crit / (k dt) of the semi-implicit loop with the damper delayed too.
    let (step, mass) = (1e-3, 100.0);
    for (w_dt, steps, ratio) in
        [(0.01, 5.0, 5.0055), (0.01, 10.0, 10.0389), (0.03, 10.0, 10.3814), (0.03, 20.0, 24.2326)]
    {
        let stiffness = mass * (w_dt / step) * (w_dt / step);
        let at = |f: f64| delayed(mass, stiffness, f * ratio * stiffness * step, steps * step, step);
        let (below, above) = (at(0.998), at(1.002));
        assert!(below > 0.0 && above < 0.0, "w dt {w_dt}, {steps} steps: growth {below} and {above}");
    }
}

/// Growth over natural frequency with a force held over a tick of `substeps` steps and `ticks` more of dead time.
fn held(w_tick: f64, ticks: f64, substeps: u32) -> f64 {
    let (tick, mass) = (1e-3, 100.0);
    let model = spring(tick / f64::from(substeps), substeps);
    let (w, delay) = (w_tick / tick, model.timing.own_delay() + ticks * tick);
    let params = Params { loop_delay: delay, ..closing(mass, 0.01, mass * w * w, 0.0) };
    let period = std::f64::consts::TAU / w;
    growth(model, params, 2.0 * period, period / 4.0) / w
}

#[test]
fn a_force_held_over_a_tick_grows_as_the_exact_hold() {
    let table = [
        (0.02, 0.0, 0.0049995),
        (0.02, 1.0, 0.0149905),
        (0.1, 0.0, 0.0249377),
        (0.1, 1.0, 0.0738405),
        (0.1, 3.0, 0.1621424),
    ];
    for (w_tick, ticks, exact) in table {
        // First order in the substep: twice the finer less the coarser.
        let limit = 2.0 * held(w_tick, ticks, 16) - held(w_tick, ticks, 8);
        assert_close(&format!("w T = {w_tick}, {ticks} ticks"), limit, exact, 1e-2);
    }
}

#[test]
fn at_one_millisecond_half_the_hold_is_a_part_of_the_stated_delay() {
    let (mass, w) = (100.0, 20.0);
    let params = Params { loop_delay: 5e-3, ..closing(mass, 0.01, mass * w * w, 0.0) };
    let rate = growth(spring(2.5e-4, 4), params, 0.6, 0.08) / w;
    // theta = 0.1; the root of s^2 + e^(-0.1 s) = 0.
    assert_close("growth at theta = 0.1", rate, 0.0496700, 2e-3);
}
