//! One bounce on a spring through the whole loop: restitution in space, and what dead time adds to it.

use super::bench::{assert_close, closing, job, numbered, run, two_bodies};
use softdock_engine::Engine;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::gpu::{Adapters, GpuEngine};
use softdock_kernels::params::Params;

/// Dead time of the delayed bounces \[s\]: 100 steps of 0.1 ms.
const DELAY: f64 = 0.01;
const STEP: f64 = 1e-4;

/// A bounce with natural frequency times delay `theta` and damping ratio `zeta`.
fn bounce(theta: f64, zeta: f64) -> Params<f64> {
    let (mass, w) = (100.0, theta / DELAY);
    Params { loop_delay: DELAY, ..closing(mass, 0.1, mass * w * w, 2.0 * zeta * mass * w) }
}

/// Restitutions of the facility for many bounces.
fn restitutions(bounces: &[(f64, f64)]) -> Vec<f64> {
    restitutions_on(&mut CpuEngine::new(), bounces)
}

/// The same on a given engine.
fn restitutions_on(engine: &mut dyn Engine, bounces: &[(f64, f64)]) -> Vec<f64> {
    let params: Vec<_> = bounces.iter().map(|(theta, zeta)| bounce(*theta, *zeta)).collect();
    restitutions_with(engine, &params)
}

/// The same with given parameters.
fn restitutions_with(engine: &mut dyn Engine, params: &[Params<f64>]) -> Vec<f64> {
    let mut model = two_bodies(STEP, 1.2, 1e-3);
    model.task.end_after_separation = 0.03;
    let rows = engine.run(&job(model, params), &numbered(params), &|_| true).expect("nobody stops the batch");
    rows.iter().map(|row| row.hil.restitution).collect()
}

/// Restitution over w0 times delay without damping, from the exact series.
const SERIES: [(f64, f64); 8] = [
    (0.05, 1.081645),
    (0.10, 1.169562),
    (0.15, 1.263798),
    (0.20, 1.364341),
    (0.30, 1.584065),
    (0.50, 2.094308),
    (0.70, 2.690168),
    (1.00, 3.723648),
];

#[test]
fn an_undamped_bounce_in_space_returns_the_speed_and_keeps_momentum() {
    let model = two_bodies(2.5e-4, 1.0, 1.23e-3);
    let rows = run(model, &[closing(50.0, 0.1, 5e4, 0.0), closing(50.0, 0.1, 5e3, 0.0)]);
    for row in rows {
        // Entry and exit fall between substeps: (w dt)^2 / 2 of the energy, w dt = 0.008.
        assert_close("restitution", row.space.restitution, 1.0, 1e-4);
        assert!(row.space.linear_momentum_error < 1e-12 && row.hil.linear_momentum_error < 1e-12);
        // Both ports see the same work: of 0.25 J, what entry and exit between substeps are worth.
        assert!(row.hil.injected_energy.abs() < 1e-4 * 0.25, "created {} J", row.hil.injected_energy);
        assert!(row.space.touch_time >= 0.0 && row.flags == 0, "flags {}", row.flags);
    }
}

#[test]
fn restitution_grows_with_dead_time_as_the_exact_series() {
    let found = restitutions(&SERIES.map(|(theta, _)| (theta, 0.0)));
    for ((theta, exact), e) in SERIES.into_iter().zip(found) {
        assert_close(&format!("e({theta})"), e, exact, 5e-3);
    }
}

#[test]
fn sensor_delay_beyond_the_loop_delay_adds_dead_time() {
    for (theta, exact) in SERIES.into_iter().filter(|(theta, _)| *theta >= 0.3) {
        let whole = bounce(theta, 0.0);
        let later = Params { loop_delay: 0.4 * DELAY, sensor_delay_error: 0.6 * DELAY, ..whole };
        let told_too_much =
            Params { loop_delay: 1.5 * DELAY, sensor_delay: 0.8 * DELAY, sensor_delay_error: -0.5 * DELAY, ..whole };
        for e in restitutions_with(&mut CpuEngine::new(), &[later, told_too_much]) {
            assert_close(&format!("e({theta})"), e, exact, 1e-2);
        }
    }
}

#[test]
fn on_a_gpu_restitution_grows_with_dead_time_as_well() {
    let mut gpu = GpuEngine::new(Adapters::Any).expect("tests/run.sh installs lavapipe, a software adapter");
    let found = restitutions_on(&mut gpu, &SERIES.map(|(theta, _)| (theta, 0.0)));
    for ((theta, exact), e) in SERIES.into_iter().zip(found) {
        println!("e({theta}) = {e} on the device, {exact} by the series");
        assert_close(&format!("e({theta})"), e, exact, 1e-2);
    }
}

#[test]
fn damped_bounces_match_the_table_over_delay_and_damping() {
    let dampings = [0.05, 0.1, 0.2, 0.4];
    let table = [
        (0.05, [0.92910, 0.80510, 0.61851, 0.39279]),
        (0.1, [1.00553, 0.87198, 0.67066, 0.42656]),
        (0.2, [1.17724, 1.02437, 0.79300, 0.51114]),
        (0.5, [1.84304, 1.63661, 1.32426, 0.96210]),
    ];
    let cases: Vec<_> = table.iter().flat_map(|(theta, _)| dampings.map(|zeta| (*theta, zeta))).collect();
    let exact = table.iter().flat_map(|(_, row)| *row);
    for (((theta, zeta), e), exact) in cases.iter().zip(restitutions(&cases)).zip(exact) {
        assert_close(&format!("e({theta}, {zeta})"), e, exact, 5e-3);
    }
}

/// Least damping ratio at which a bounce injects no energy, by interpolation between two guesses.
#[test]
fn energy_neutral_damping_matches_the_series() {
    let table = [(0.05, 1.0173), (0.10, 1.0376), (0.20, 1.0895), (0.30, 1.1626), (0.40, 1.2735), (0.50, 1.4795)];
    let guesses: Vec<_> =
        table.iter().flat_map(|(theta, ratio)| [0.98, 1.02].map(|f| (*theta, f * ratio * theta / 2.0))).collect();
    let found = restitutions(&guesses);
    for ((theta, ratio), e) in table.iter().zip(found.chunks(2)) {
        assert!(e[0] > 1.0 && e[1] < 1.0, "theta {theta}: e = {e:?} around the ratio {ratio}");
    }
}

#[test]
fn beyond_theta_0_574_every_damping_injects_energy() {
    let at = |theta: f64| restitutions(&(1..=24).map(|i| (theta, 0.05 * f64::from(i))).collect::<Vec<_>>());
    let least = |found: Vec<f64>| found.into_iter().fold(f64::INFINITY, f64::min);
    let (below, above) = (least(at(0.56)), least(at(0.59)));
    assert!(below < 1.0, "least e {below} at theta 0.56");
    assert!(above > 1.0, "least e {above} at theta 0.59");
}
