//! The free body's block against closed forms.

use super::body::{BodyBlock, BodyValues, Hung, OBSERVER};
use super::{Recorded, replay};
use crate::vector::{Vec3, vec3};
use std::f64::consts::TAU;

const STEP: f64 = 1e-3;

fn body() -> BodyValues<f64> {
    BodyValues { mass: 300.0, inertia: vec3(90.0, 110.0, 100.0), ..BodyValues::null() }
}

/// Acceleration and rate under a wrench over time, the gyroscope reading a known rate.
fn run(
    p: BodyValues<f64>,
    seconds: f64,
    wrench: impl Fn(f64) -> [f64; 6],
    rate: impl Fn(f64) -> [f64; 3],
) -> Vec<[f64; 6]> {
    let instants = (seconds / STEP).round() as usize + 1;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for i in 0..instants {
        let t = i as f64 * STEP;
        inputs.extend(rate(t));
        inputs.push(1.0);
        late.extend(wrench(t));
    }
    let recorded = Recorded { step: STEP, instants, stride: 1, inputs, late, offsets: Vec::new() };
    replay::<f64, BodyBlock>(&BodyBlock, &recorded, &p).chunks(6).map(|c| std::array::from_fn(|i| c[i])).collect()
}

/// Under a steady wrench from rest, for a moment so short that nothing else counts.
fn at_first(p: BodyValues<f64>, wrench: [f64; 6]) -> [f64; 6] {
    let rows = run(p, 2.0 * STEP, |_| wrench, |_| [0.0; 3]);
    let [x, y, z, ..] = rows[0];
    // The observer forgets a share of what the gyroscope does not read.
    let [.., p, q, r] = rows[1].map(|rate| rate / (STEP * (1.0 - OBSERVER * STEP)));
    [x, y, z, p, q, r]
}

fn near(a: &[f64], b: &[f64], allowed: f64) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < allowed), "{a:?} {b:?}");
}

#[test]
fn a_rigid_body_obeys_newton_and_euler_about_any_point() {
    near(&at_first(body(), [60.0, -30.0, 15.0, 9.0, 11.0, 5.0]), &[0.2, -0.1, 0.05, 0.1, 0.1, 0.05], 1e-6);
    // A force through the origin of a body whose centre lies 0.2 m aside turns it as well.
    let p = BodyValues { centre: vec3(0.2, 0.0, 0.0), ..body() };
    let angular = -0.2 * 60.0 / 100.0;
    near(&at_first(p, [0.0, 60.0, 0.0, 0.0, 0.0, 0.0]), &[0.0, 0.2 - 0.2 * angular, 0.0, 0.0, 0.0, angular], 1e-6);
    let biased =
        BodyValues { accelerometer_bias: vec3(0.01, 0.0, 0.0), gyroscope_bias: vec3(0.0, 2e-3, 0.0), ..body() };
    let rows = run(biased, 0.1, |_| [0.0; 6], |_| [0.0, 2e-3, 0.0]);
    near(&rows[100], &[0.01, 0.0, 0.0, 0.0, 2e-3, 0.0], 1e-12);
}

#[test]
fn a_body_is_no_harder_to_turn_for_being_observed() {
    // The gyroscope reads what is so: nothing is left for the observer to make good.
    let rows = run(body(), 4.0, |_| [0.0, 0.0, 0.0, 0.0, 0.0, 5.0], |t| [0.0, 0.0, 0.05 * t]);
    for (i, row) in rows.iter().enumerate() {
        near(&row[3..], &[0.0, 0.0, 0.05 * i as f64 * STEP], 1e-12);
    }
}

#[test]
fn a_turning_body_wobbles_as_its_measured_rate_says() {
    // Free precession of a body with an axis of symmetry: the rate across turns with (1 - c/a) n.
    let p = BodyValues { inertia: vec3(100.0, 100.0, 150.0), ..body() };
    let omega = 0.5 * 0.4;
    let rate = |t: f64| [0.1 * (omega * t).cos(), 0.1 * (omega * t).sin(), 0.4];
    let rows = run(p, 6.0, |_| [0.0; 6], rate);
    for (i, row) in rows.iter().enumerate() {
        near(&row[3..], &rate(i as f64 * STEP), 2e-5);
    }
}

#[test]
fn a_hung_mass_is_missing_at_first_and_then_rings_as_one_in_a_free_body() {
    let slosh = Hung { mass: 60.0, frequency: 2.0, damping: 0.0, place: Vec3::zero() };
    let p = BodyValues { slosh, ..body() };
    let first = at_first(p, [0.0, 0.0, 60.0, 0.0, 0.0, 0.0]);
    near(&first[..3], &[0.0, 0.0, 60.0 / 240.0], 1e-9);
    // a = F/M + (F/m0 - F/M) cos(w t) with w^2 = w0^2 M / m0.
    let omega = TAU * 2.0 * (300.0_f64 / 240.0).sqrt();
    let rows = run(p, 3.0, |_| [0.0, 0.0, 60.0, 0.0, 0.0, 0.0], |_| [0.0; 3]);
    for (i, row) in rows.iter().enumerate() {
        let exact = 0.2 + 0.05 * (omega * i as f64 * STEP).cos();
        assert!((row[2] - exact).abs() < 2e-4, "{i}: {} instead of {exact}", row[2]);
    }
}

#[test]
fn a_boom_bends_under_turning_and_keeps_the_wholes_inertia() {
    let appendage = Hung { mass: 4.0, frequency: 20.0, damping: 0.5, place: vec3(2.0, 0.0, 0.0) };
    let p = BodyValues { appendage, ..body() };
    let first = at_first(p, [0.0, 0.0, 0.0, 0.0, 0.0, 5.0]);
    // The body alone: 4 kg at 2 m less, its own centre at -8/296 m.
    let alone = 100.0 - 16.0 - 296.0 * (8.0_f64 / 296.0).powi(2);
    assert!((first[5] * alone / 5.0 - 1.0).abs() < 1e-6, "{first:?}");
    // Once the ringing is over the whole turns as one; the observer sees what it knows.
    let rows = run(p, 2.0, |_| [0.0, 0.0, 0.0, 0.0, 0.0, 5.0], |t| [0.0, 0.0, 0.05 * t]);
    assert!((rows[2000][5] / 0.1 - 1.0).abs() < 2e-3, "{:?}", rows[2000]);
}

#[test]
fn null_effects_change_no_bit() {
    let push = |t: f64| [60.0, 20.0, 0.0, 1.0, -2.0, 3.0 * t];
    let placed = |frequency| Hung { mass: 0.0, frequency, damping: 0.3, place: vec3(0.5, -0.2, 1.0) };
    let exotic = BodyValues { slosh: placed(0.3), appendage: placed(7.0), ..body() };
    assert_eq!(run(body(), 0.5, push, |_| [0.0; 3]), run(exotic, 0.5, push, |_| [0.0; 3]));
}
