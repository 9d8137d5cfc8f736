//! The stability map against its closed forms: limits along stiffness and delay, fold points, compensated loops.

use super::bench::assert_close;
use rayon::prelude::*;
use softdock_engine::map::{DelayedContact, Limit, closed_form, longest_delay, stiffest};
use softdock_kernels::model::CompensatorKind;
use softdock_test_size::{first, sized};

const MASS: f64 = 200.0;
const DELAY: f64 = 0.016;

fn found(limit: Limit, kind: CompensatorKind, ratio: f64) -> f64 {
    stiffest(limit, kind, MASS, DELAY, ratio)
        .unwrap_or_else(|| panic!("{limit:?} of {kind:?} at r = {ratio}: no limit"))
}

#[test]
fn the_closed_form_is_that_of_the_table() {
    // b_low/(k h) over kappa without a compensator.
    let table = [(0.01, 1.00336), (0.04, 1.01384), (0.10, 1.03672), (0.25, 1.10999), (0.40, 1.22905), (0.50, 1.39088)];
    for (kappa, ratio) in table {
        let closed = closed_form(CompensatorKind::None, ratio).expect("a limit");
        assert_close(&format!("closed form at r = {ratio}"), closed, kappa, 2e-3);
    }
    // A perfect predictor: 1 + r s e^(-s) is real at phi = pi/2.
    let quarter = std::f64::consts::FRAC_PI_2;
    let smith = closed_form(CompensatorKind::Smith, 2.0).expect("a limit");
    assert_close("predictor at r = 2", smith, quarter * quarter / (1.0 + 2.0 * quarter), 1e-6);
}

#[test]
fn linear_limits_along_the_stiffness_are_met_within_two_percent() {
    let ratios = [1.01384, 1.03672, 1.10999, 1.22905, 1.39088];
    let cases: Vec<(CompensatorKind, f64)> = ratios
        .map(|ratio| (CompensatorKind::None, ratio))
        .into_iter()
        .chain([0.02, 0.1, 0.3, 1.5, 3.0].map(|ratio| (CompensatorKind::FirstOrderLead, ratio)))
        .chain([0.3, 1.0, 1.5, 2.0, 3.0].map(|ratio| (CompensatorKind::Smith, ratio)))
        .chain([1.5, 2.0, 3.0, 3.8].map(|ratio| (CompensatorKind::VirtualDamping, ratio)))
        .collect();
    let cases: Vec<_> = cases.into_iter().step_by(sized(5, 1)).collect();
    let rows: Vec<_> = cases.into_par_iter().map(|(kind, r)| (kind, r, found(Limit::Linear, kind, r))).collect();
    for (kind, ratio, kappa) in rows {
        let closed = closed_form(kind, ratio).expect("a limit");
        println!("{kind:?}, r = {ratio}: kappa {kappa:.5}, closed form {closed:.5}");
        assert_close(&format!("{kind:?} at r = {ratio}"), kappa, closed, 2e-2);
    }
}

#[test]
fn energy_limits_along_the_stiffness_are_met_within_two_percent() {
    // F-exit ratios of the table over theta.
    for (theta, ratio) in [(0.10_f64, 1.0376), (0.20, 1.0895), (0.30, 1.1626), (0.40, 1.2735), (0.50, 1.4795)] {
        let kappa = found(Limit::Energy, CompensatorKind::None, ratio);
        println!("energy, r = {ratio}: kappa {kappa:.5}, table {:.5}", theta * theta);
        assert_close(&format!("energy limit at r = {ratio}"), kappa, theta * theta, 2e-2);
    }
}

#[test]
fn folds_lie_where_no_damping_stabilises() {
    // Linear: kappa_max at b h/m = 0.948166; energy: at zeta = 0.6343 and theta = 0.57390.
    let greatest = |limit, around: f64| {
        let factors = sized(&[0.96, 1.0, 1.04][..], &[0.92, 0.96, 1.0, 1.04, 1.08]);
        factors.iter().map(|factor| found(limit, CompensatorKind::None, factor * around)).fold(0.0, f64::max)
    };
    let linear = greatest(Limit::Linear, 0.948166 / 0.549774);
    let energy = greatest(Limit::Energy, 2.0 * 0.6343 / 0.57390);
    println!("folds: linear {linear:.5}, energy {energy:.5}");
    assert_close("linear fold", linear, 0.549774, 2e-2);
    assert_close("energy fold", energy, 0.32936, 2e-2);
}

#[test]
fn critical_delays_are_met_within_two_percent() {
    let cases = [(500.0, 1e5, 2000.0, 19.4711e-3), (100.0, 1e4, 50.0, 4.99583e-3)];
    for (mass, stiffness, damping, exact) in first(1, cases) {
        let contact = DelayedContact { mass, stiffness, damping, delay: exact };
        let delay = longest_delay(Limit::Linear, CompensatorKind::None, contact).expect("a limit");
        println!("critical delay {:.5} ms, exact {:.5} ms", 1e3 * delay, 1e3 * exact);
        assert_close("critical delay", delay, exact, 2e-2);
    }
}
