//! The tossed body's block against closed forms.

use super::toss::{TossBlock, TossValues};
use super::{Recorded, replay};
use crate::vector::{Vec3, vec3};

const STEP: f64 = 1e-4;
const GRAVITY: f64 = 9.81;

/// A cube of 10 cm.
fn cube() -> TossValues<f64> {
    TossValues {
        mass: 0.4,
        inertia: Vec3::splat(8e-4),
        half_width: 0.05,
        gravity: vec3(0.0, 0.0, -GRAVITY),
        stiffness: 1e5,
        restitution: 0.5,
        ..TossValues::null()
    }
}

/// Position, attitude (w, x, y, z), velocity and rate at the begin.
#[derive(Clone, Copy)]
struct Begin([f64; 3], [f64; 4], [f64; 3], [f64; 3]);

/// Way, turn and velocity after every step.
fn tossed(p: TossValues<f64>, begin: Begin, seconds: f64) -> Vec<[f64; 9]> {
    let instants = (seconds / STEP).round() as usize + 1;
    let mut inputs = vec![0.0; 16 * instants];
    let first = [&[1.0][..], &begin.0, &begin.1, &begin.2, &begin.3].concat();
    inputs[..14].copy_from_slice(&first);
    inputs.chunks_mut(16).for_each(|row| row[14..].fill(1.0));
    let late = (0..instants).map(|i| i as f64 * STEP).collect();
    let recorded = Recorded { step: STEP, instants, stride: 1, inputs, late, offsets: Vec::new() };
    replay::<f64, TossBlock>(&TossBlock, &recorded, &p).chunks(9).map(|c| std::array::from_fn(|i| c[i])).collect()
}

fn near(a: &[f64], b: &[f64], allowed: f64) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < allowed), "{a:?} {b:?}");
}

const UPRIGHT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// Attitude with one corner straight below the middle: a turn by acos(1 / sqrt 3) about (1, -1, 0).
fn on_a_corner() -> [f64; 4] {
    let (sin, cos) = (0.5 * (1.0 / 3.0_f64.sqrt()).acos()).sin_cos();
    let side = sin / 2.0_f64.sqrt();
    [cos, side, -side, 0.0]
}

#[test]
fn a_body_in_flight_falls_and_turns_as_it_did() {
    let rows = tossed(cube(), Begin([0.0, 0.0, 1.0], UPRIGHT, [0.3, -0.2, 1.0], [0.0, 5.0, 0.0]), 0.2);
    let t = 0.2_f64;
    near(&rows[2000], &[0.06, -0.04, t - 0.5 * GRAVITY * t * t, 0.0, 1.0, 0.0, 0.3, -0.2, 1.0 - GRAVITY * t], 1e-9);
    // Free precession of a body with an axis of symmetry (Euler): it spins about that axis, which circles the momentum.
    let disc = TossValues { inertia: vec3(6e-4, 6e-4, 9e-4), ..cube() };
    let (across, spin, t) = (1.0_f64, 8.0, 0.15);
    let momentum = [6e-4 * across, 9e-4 * spin];
    let size = momentum[0].hypot(momentum[1]);
    let (sin, cos) = (momentum[0] / size, momentum[1] / size);
    let precession = size / 6e-4;
    let own = quaternion([0.0, 0.0, 1.0], (spin - precession * cos) * t);
    let exact = compose(quaternion([sin, 0.0, cos], precession * t), own);
    let angle = 2.0 * exact[0].acos();
    let scale = angle / (0.5 * angle).sin();
    let rows = tossed(disc, Begin([0.0, 0.0, 1.0], UPRIGHT, [0.0; 3], [across, 0.0, spin]), t);
    near(&rows[1500][3..6], &[exact[1] * scale, exact[2] * scale, exact[3] * scale], 2e-5);
}

fn quaternion(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let (sin, cos) = (0.5 * angle).sin_cos();
    [cos, axis[0] * sin, axis[1] * sin, axis[2] * sin]
}

fn compose([w, x, y, z]: [f64; 4], [a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c + y * a + z * b - x * d,
        w * d + z * a + x * c - y * b,
    ]
}

/// Speed after a blow on one corner, straight below the middle, over the speed before it.
fn rebound(p: TossValues<f64>, speed: f64) -> f64 {
    let p = TossValues { gravity: Vec3::zero(), ..p };
    let height = (p.half_width - p.corner_radius) * 3.0_f64.sqrt() + p.corner_radius;
    let rows = tossed(p, Begin([0.0, 0.0, height + 1e-5], on_a_corner(), [0.0, 0.0, -speed], [0.0; 3]), 0.06);
    let last = rows[rows.len() - 1];
    near(&last[3..8], &[0.0; 5], 1e-6);
    last[8] / speed
}

#[test]
fn the_restitution_of_a_blow_is_that_of_the_model_at_any_speed_and_mass() {
    for (restitution, speed) in [(0.5, 1.0), (0.125, 1.0), (0.5, 0.5), (0.125, 2.0)] {
        let p = TossValues { restitution, ..cube() };
        for p in [p, TossValues { mass: 0.1, ..p }, TossValues { corner_radius: 5e-3, ..p }] {
            let found = rebound(p, speed);
            assert!((found / restitution - 1.0).abs() < 0.03, "{restitution} at {speed} m/s: {found}");
        }
    }
    let damped = TossValues { depth_damping: 5e4, ..cube() };
    assert!(rebound(damped, 2.0) < 0.9 * rebound(damped, 0.5), "it falls with the speed");
    let harder = TossValues { hardening: 0.3, ..cube() };
    assert!((rebound(harder, 1.0) / 0.5 - 1.0).abs() < 0.03);
}

/// Deceleration of a box that slides on its face without tipping, its weight on its corners already.
fn deceleration(p: TossValues<f64>, way: [f64; 2]) -> [f64; 2] {
    let p = TossValues { inertia: Vec3::splat(1.0), ..p };
    let sunk = 0.4 * GRAVITY / (4.0 * 1e5 * 0.5 * (1.0 + 0.25));
    let rows = tossed(p, Begin([0.0, 0.0, 0.05 - sunk], UPRIGHT, [way[0], way[1], 0.0], [0.0; 3]), 0.06);
    [0, 1].map(|axis| (rows[100][6 + axis] - rows[600][6 + axis]) / 0.05)
}

#[test]
fn a_sliding_body_slows_down_by_its_friction_alone() {
    let p = TossValues { friction: 0.2, restitution: 0.5, ..cube() };
    let weight = 0.2 * GRAVITY;
    near(&deceleration(p, [1.0, 0.0]), &[weight, 0.0], 0.01 * weight);
    near(&deceleration(p, [0.6, -0.8]), &[0.6 * weight, -0.8 * weight], 0.01 * weight);
    let rough = TossValues { anisotropy: 0.2, ..p };
    near(&deceleration(rough, [0.0, 1.0]), &[0.0, 0.8 * weight], 0.01 * weight);
    let sticky = TossValues { stribeck: 0.1, stribeck_speed: 100.0, ..p };
    near(&deceleration(sticky, [1.0, 0.0]), &[1.5 * weight, 0.0], 0.02 * weight);
}

#[test]
fn a_body_comes_to_rest_on_a_slope_that_its_friction_holds_and_slides_down_a_steeper_one() {
    let begin = |slope: f64| {
        let angle = -slope.atan();
        Begin(
            [0.0, 0.0, 0.05 / (1.0 + slope * slope).sqrt().recip()],
            quaternion([0.0, 1.0, 0.0], angle),
            [0.0; 3],
            [0.0; 3],
        )
    };
    let slid = |slope: f64| {
        let p = TossValues { friction: 0.2, slope_x: slope, restitution: 0.1, ..cube() };
        let rows = tossed(p, begin(slope), 0.5);
        rows[rows.len() - 1]
    };
    assert!(slid(0.1)[6].abs() < 1e-3, "{:?}", slid(0.1));
    let (sin, cos) = 0.4_f64.atan().sin_cos();
    let along = (slid(0.4)[6].powi(2) + slid(0.4)[8].powi(2)).sqrt();
    assert!((along / ((sin - 0.2 * cos) * GRAVITY * 0.5) - 1.0).abs() < 0.03, "{along}");
}

#[test]
fn a_segment_starts_from_its_first_sample_and_outputs_the_end_of_the_last() {
    let p = TossValues { gravity: Vec3::zero(), centre: vec3(0.01, 0.0, 0.0), ..cube() };
    let mut inputs = vec![0.0; 16 * 5];
    let row = |velocity: f64| [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, velocity, 0.0, 0.0, 0.0, 0.0, 2.0, 3.0, 2.0];
    inputs[..16].copy_from_slice(&row(1.0));
    inputs[32..48].copy_from_slice(&row(-2.0));
    inputs[64 + 14] = 1.0;
    let recorded = Recorded { step: STEP, instants: 5, stride: 2, inputs, late: vec![0.0; 5], offsets: Vec::new() };
    let out = replay::<f64, TossBlock>(&TossBlock, &recorded, &p);
    near(&out[..9], &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 1e-12);
    // The centre of mass goes straight on; the middle circles it.
    near(&out[9..18], &[6e-4, 0.0, 0.0, 0.0, 0.0, 8e-4, 1.0, 0.0, 0.0], 1e-5);
    near(&out[18..24], &[-4e-4, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-5);
}

#[test]
fn null_effects_change_nothing() {
    let begin = Begin([0.0, 0.0, 0.09], on_a_corner(), [0.5, 0.2, -0.5], [1.0, -3.0, 2.0]);
    let exotic = TossValues { stribeck_speed: 0.7, ..cube() };
    assert_eq!(tossed(cube(), begin, 0.3), tossed(exotic, begin, 0.3));
}
