//! The contact's block against closed forms.

use super::contact::{ContactBlock, ContactValues};
use super::tests::same_beside_others;
use super::{Recorded, replay};

const STEP: f64 = 1e-4;

fn contact() -> ContactValues<f64> {
    ContactValues { stiffness: 1e5, damping: 200.0, friction: 0.2, presliding_travel: 5e-5, ..ContactValues::null() }
}

/// Forces on a point that moves over time: position and rate \[m, m/s\].
fn forces(p: ContactValues<f64>, seconds: f64, motion: impl Fn(f64) -> ([f64; 3], [f64; 3])) -> Vec<[f64; 3]> {
    let outputs = replay::<f64, ContactBlock>(&ContactBlock, &recorded(seconds, motion), &p);
    outputs.chunks(3).map(|f| [f[0], f[1], f[2]]).collect()
}

fn recorded(seconds: f64, motion: impl Fn(f64) -> ([f64; 3], [f64; 3])) -> Recorded {
    let instants = (seconds / STEP).round() as usize + 1;
    let at = |i: usize| motion(i as f64 * STEP);
    let late = (0..instants).flat_map(|i| [at(i).0, at(i).1].concat()).collect();
    let inputs = (0..instants).map(|i| i as f64 * STEP).collect();
    Recorded { step: STEP, instants, stride: 1, inputs, late, offsets: Vec::new() }
}

/// Normal force of a point at rest at a depth.
fn pressed(p: ContactValues<f64>, depth: f64) -> f64 {
    forces(p, 1e-3, |_| ([0.0, 0.0, -depth], [0.0; 3]))[5][2]
}

/// Force on a point that slides in a straight line, 2 mm deep, after a way.
fn slid(p: ContactValues<f64>, rate: [f64; 2], way: f64) -> [f64; 3] {
    let speed = rate[0].hypot(rate[1]);
    let motion = |t: f64| ([rate[0] * t, rate[1] * t, -2e-3], [rate[0], rate[1], 0.0]);
    *forces(p, way / speed, motion).last().expect("instants")
}

fn near(a: [f64; 3], b: [f64; 3]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
}

#[test]
fn the_normal_force_goes_with_depth_and_its_rate_and_never_pulls() {
    assert!((pressed(contact(), 2e-3) - 200.0).abs() < 1e-9 && pressed(contact(), -1e-6) == 0.0);
    let hard = ContactValues { exponent: 1.5, ..contact() };
    assert!((pressed(hard, 1e-3) - 100.0).abs() < 1e-9 && (pressed(hard, 4e-3) - 800.0).abs() < 1e-9);
    assert!((pressed(ContactValues { surface: 5e-4, ..contact() }, 2e-3) - 250.0).abs() < 1e-9);
    let sinking = |rate: f64| move |t: f64| ([0.0, 0.0, -1e-3 - rate * t], [0.0, 0.0, -rate]);
    let damped = ContactValues { depth_damping: 1e5, ..contact() };
    assert!((forces(damped, 1e-3, sinking(0.1))[0][2] - 100.0 - 0.1 * 300.0).abs() < 1e-9);
    assert_eq!(forces(contact(), 1e-3, sinking(-0.9))[0][2], 0.0);
    let soft = ContactValues { damping_onset: 1e-3, ..contact() };
    let share = 1.0 - (-1.0_f64).exp();
    assert!((forces(soft, 1e-3, sinking(0.1))[0][2] - 100.0 - 20.0 * share).abs() < 1e-9);
}

/// Where one point touches, its neighbours may not.
#[test]
fn a_contact_gives_the_same_whatever_contacts_are_simulated_beside_it() {
    let base = ContactValues { damping_onset: 1e-4, ..contact() };
    let sets = [
        base,
        ContactValues { surface: -2e-3, ..base },
        ContactValues { surface: 5e-4, ..base },
        ContactValues { exponent: 1.5, stribeck: 0.1, stribeck_speed: 0.01, ..base },
        ContactValues { adhesion: 10.0, adhesion_range: 1e-4, ..base },
        ContactValues { anisotropy: 0.3, bristle_lead: 1e-4, ..base },
        ContactValues { fixture_compliance: 1e-6, fixture_frequency: 40.0, fixture_damping: 0.05, ..base },
        ContactValues { lag: 2e-3, clock_offset: 1e-3, ..base },
    ];
    let bounce = |t: f64| {
        let (sin, cos) = (60.0 * t).sin_cos();
        ([0.05 * t, 0.02 * t * t, 1e-3 * cos], [0.05, 0.04 * t, -0.06 * sin])
    };
    same_beside_others(&ContactBlock, &recorded(0.5, bounce), &sets);
}

#[test]
fn parts_that_adhere_pull_until_they_are_apart() {
    let p = ContactValues { adhesion: 10.0, adhesion_range: 1e-4, ..contact() };
    assert!((pressed(p, 2e-3) - 190.0).abs() < 1e-9);
    assert!((pressed(p, -3e-5) + 7.0).abs() < 1e-9 && pressed(p, -1.1e-4) == 0.0);
}

#[test]
fn friction_rises_over_a_travel_and_turns_with_the_sliding() {
    near(slid(contact(), [0.03, -0.04], 2e-3), [-24.0, 32.0, 200.0]);
    let share = 1.0 - (-1.0_f64).exp();
    near(slid(contact(), [0.05, 0.0], 5e-5), [-40.0 * share, 0.0, 200.0]);
    let sticky = ContactValues { stribeck: 0.1, stribeck_speed: 0.01, ..contact() };
    near(slid(sticky, [0.02, 0.0], 2e-3), [-200.0 * (0.2 + 0.1 * (-2.0_f64).exp()), 0.0, 200.0]);
    let rough = ContactValues { anisotropy: 0.1, ..contact() };
    near(slid(rough, [0.02, 0.0], 2e-3), [-44.0, 0.0, 200.0]);
    near(slid(rough, [0.0, 0.02], 2e-3), [0.0, -36.0, 200.0]);
    let turned = ContactValues { anisotropy_across: 0.1, ..contact() };
    near(slid(turned, [0.03, 0.03], 2e-3), [-44.0 / 2_f64.sqrt(), -44.0 / 2_f64.sqrt(), 200.0]);
}

#[test]
fn bristles_that_are_damped_resist_before_they_are_bent() {
    let p = ContactValues { bristle_lead: 2e-4, ..contact() };
    // z = 1 - exp(-v t / s), so that z' falls from v / s to nothing while the bristles' force comes.
    for way in [1e-5, 5e-5, 2e-3] {
        let left = (-way / 5e-5_f64).exp();
        near(slid(p, [0.1, 0.0], way), [-40.0 * (1.0 - left + 2e-4 * 0.1 / 5e-5 * left), 0.0, 200.0]);
    }
}

#[test]
fn a_mount_is_compliant_and_rings() {
    let (compliance, frequency) = (5e-6, 40.0);
    let p = ContactValues {
        fixture_compliance: compliance,
        fixture_frequency: frequency,
        fixture_damping: 0.0,
        damping: 0.0,
        ..contact()
    };
    // A point that stops at once, 1 mm deep: the plate swings about its balance with the contact's spring beside its own.
    let motion = |t: f64| if t < 5e-5 { ([0.0; 3], [0.0; 3]) } else { ([0.0, 0.0, -1e-3], [0.0; 3]) };
    let balance = 100.0 / (1.0 + 1e5 * compliance);
    let omega = std::f64::consts::TAU * frequency * (1.0 + 1e5 * compliance).sqrt();
    let rung = forces(p, 0.2, motion);
    for i in [50, 333, 1111, 1999] {
        let exact = balance + (100.0 - balance) * (omega * (i - 1) as f64 * STEP).cos();
        assert!((rung[i][2] - exact).abs() < 0.03 * 100.0, "{i}: {} instead of {exact}", rung[i][2]);
    }
    let damped = ContactValues { fixture_damping: 0.5, ..p };
    assert!((forces(damped, 0.5, motion)[5000][2] - balance).abs() < 1e-6);
}

/// Half a step late, the contact's damper made a plate of 1.5 kg seem 2 % stiffer in steps of 0.25 ms.
#[test]
fn a_plate_that_the_contact_damps_rings_as_long_and_as_fast_as_it_should() {
    let (compliance, stiffness, damping, depth) = (5e-6, 1e5, 200.0, 1e-3);
    let p =
        ContactValues { fixture_compliance: compliance, fixture_frequency: 40.0, fixture_damping: 0.0, ..contact() };
    let square = (std::f64::consts::TAU * 40.0).powi(2);
    let (fast, decay) = (square * (1.0 + stiffness * compliance), 0.5 * square * compliance * damping);
    let omega = (fast - decay * decay).sqrt();
    let balance = -compliance * stiffness * depth / (1.0 + stiffness * compliance);
    let furthest = -compliance * stiffness * depth - balance;
    let exact = |t: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        let swing = furthest * (-decay * t).exp();
        let plate = balance + swing * (cos + decay / omega * sin);
        stiffness * (depth + plate) - damping * swing * fast / omega * sin
    };
    // It is let go half a step before the recording starts.
    let rung = forces(p, 0.1, |_| ([0.0, 0.0, -depth], [0.0; 3]));
    for i in (10..1000).step_by(33) {
        let (force, exact) = (rung[i][2], exact((i as f64 + 0.5) * STEP));
        assert!((force - exact).abs() < 0.02, "{i}: {force} instead of {exact}");
    }
}

#[test]
fn the_force_is_read_late_with_a_bias() {
    let ramp = |t: f64| ([0.0, 0.0, -0.01 * t], [0.0, 0.0, -0.01]);
    let p = ContactValues { damping: 0.0, lag: 0.01, clock_offset: 0.002, ..contact() };
    let read = forces(ContactValues { bias: crate::vector::vec3(1.0, 2.0, 3.0), ..p }, 0.3, ramp);
    // 1000 N/s, behind by 12 ms.
    near(read[2900], [1.0, 2.0, 3.0 + 1000.0 * (0.29 - 0.012)]);
}

#[test]
fn null_effects_change_nothing() {
    let wave = |t: f64| ([1e-3 * (20.0 * t).sin(), 0.0, -1e-3], [0.02 * (20.0 * t).cos(), 0.0, 0.0]);
    let exotic = ContactValues {
        stribeck_speed: 0.3,
        adhesion_range: 1e-3,
        fixture_frequency: 33.0,
        fixture_damping: 0.4,
        ..contact()
    };
    assert_eq!(forces(contact(), 0.2, wave), forces(exotic, 0.2, wave));
}
