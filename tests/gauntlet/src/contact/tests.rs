//! Each effect of the contact follows its law: on the plant alone, without noise and nuisances.

use super::law::{MEMORY_TIME, REFERENCE_DEPTH, TENSION_RANGE};
use super::motions::TRAINING;
use super::nominal::{FRICTION, MASS, PRESLIDING_TRAVEL, STIFFNESS};
use super::plant::{PLATE_MASS, POSITION, Plant, State, VELOCITY};
use super::{ContactRig, Nuisances, plant};
use crate::catalogue::{Hidden, Rig, Sizes};
use crate::ode::advance;
use crate::session::Run;
use std::f64::consts::{PI, TAU};

const NONE: Nuisances = Nuisances {
    stiffness: 1.0,
    damping: 1.0,
    friction: 1.0,
    travel: 1.0,
    surface: 0.0,
    bias: [0.0; 3],
    clock_offset: 0.0,
};
const MAP: [[f64; 3]; 3] = [[200.0, 50.0, 0.3], [-90.0, 300.0, 2.0], [400.0, -20.0, 4.0]];

fn sizes(hidden: &[(&'static str, f64)]) -> Sizes {
    let hidden: Vec<Hidden> = hidden.iter().map(|&(id, size)| Hidden { id, size }).collect();
    Sizes::check(Rig::Contact, &hidden).expect("effects")
}

fn with(id: &'static str, size: f64) -> Plant {
    plant(&sizes(&[(id, size)]), &NONE, MAP)
}

fn healthy() -> Plant {
    plant(&sizes(&[]), &NONE, MAP)
}

fn undamped(mut plant: Plant) -> Plant {
    plant.law.damping = 0.0;
    plant
}

fn near(value: f64, expected: f64, bound: f64) {
    assert!((value - expected).abs() < bound, "{value} instead of {expected}");
}

/// What one free blow shows: restitution, time between touch and release \[s\], extremes of the normal force \[N\].
struct Blow {
    restitution: f64,
    duration: f64,
    peak: f64,
    tension: f64,
    touch: f64,
}

/// A body flies at the plate from 1 mm and leaves it again.
fn blow(plant: &mut Plant, speed: f64) -> Blow {
    let mut state: State = [0.0; 14];
    (state[POSITION + 2], state[VELOCITY + 2]) = (0.001, -speed);
    let step = 1e-5;
    let mut out = Blow { restitution: 0.0, duration: 0.0, peak: 0.0, tension: 0.0, touch: f64::NAN };
    for i in 0..100_000 {
        state = advance(plant, &state, step);
        plant.dent(&state);
        let force = plant.sensed(&state)[2];
        if force > 0.0 {
            out.duration += step;
            out.touch = out.touch.min(f64::from(i) * step);
        }
        out.peak = out.peak.max(force);
        out.tension = out.tension.min(force);
        if state[VELOCITY + 2] > 0.0 && state[POSITION + 2] > 0.0009 {
            break;
        }
    }
    out.restitution = state[VELOCITY + 2] / speed;
    out
}

#[test]
fn blow_on_the_healthy_plate_matches_spring_and_damper() {
    let omega = (STIFFNESS / MASS).sqrt();
    let ideal = blow(&mut undamped(healthy()), 0.1);
    near(ideal.restitution, 1.0, 1e-6);
    near(ideal.duration, PI / omega, 3e-5);
    near(ideal.peak, 0.1 * (STIFFNESS * MASS).sqrt(), 0.01);
    // Damping ratio 0.05 without tension at the end: e = 0.8588; a blow of 2 mm hardly sees the onset of 0.01 mm.
    near(blow(&mut healthy(), 0.1).restitution, 0.8588, 0.01);
}

#[test]
fn stiffness_effects_change_force_and_duration() {
    let stiff = blow(&mut undamped(with("K1_stiffness", 2e4)), 0.05);
    near(stiff.peak, 0.05 * (1.2 * STIFFNESS * MASS).sqrt(), 0.01);
    let law = with("K2_exponent", 0.5).law;
    near(law.normal(REFERENCE_DEPTH, 0.0, 0.0, 0.0), 100.0, 1e-9);
    near(law.normal(4.0 * REFERENCE_DEPTH, 0.0, 0.0, 0.0), 800.0, 1e-9);
    // Hertz: the duration goes with v^(-1/5).
    let mut hertz = undamped(with("K2_exponent", 0.5));
    let ratio = blow(&mut hertz, 0.02).duration / blow(&mut hertz.clone(), 0.08).duration;
    near(ratio, 4.0_f64.powf(0.2), 0.005);
}

#[test]
fn depth_damping_restores_less_of_a_faster_blow() {
    // k d + lambda d d': D (1 + e) = ln((1 + D) / (1 - e D)) with D = lambda v / k gives e(0.1) = 0.93748, e(0.5) = 0.74843.
    for (d, e) in [(0.1, 0.937_476), (0.5, 0.748_435)] {
        let mut plant = undamped(with("K3_damping", 2e6));
        near(blow(&mut plant, d * STIFFNESS / 2e6).restitution, e, 2e-3);
    }
    let mut plant = undamped(with("quadratic_damping", 5e4));
    let (slow, fast) = (blow(&mut plant, 0.02).restitution, blow(&mut plant.clone(), 0.1).restitution);
    assert!(fast < slow && slow < 1.0, "{slow} {fast}");
}

#[test]
fn an_offset_moves_the_touch_in_space() {
    for speed in [0.02, 0.1] {
        let earlier = blow(&mut healthy(), speed).touch - blow(&mut with("K7_surface_offset", 2e-4), speed).touch;
        near(earlier * speed, 2e-4, 2e-5 * speed + 2e-6);
    }
}

#[test]
fn adhesion_pulls_before_release() {
    near(blow(&mut with("K8_adhesion", 10.0), 0.05).tension, -10.0, 0.1);
    near(blow(&mut healthy(), 0.05).tension, 0.0, 1e-12);
    let law = with("K8_adhesion", 10.0).law;
    near(law.normal(-0.5 * TENSION_RANGE, 0.0, 0.0, 0.0), -5.0, 1e-9);
    near(law.normal(-TENSION_RANGE, 0.0, 0.0, 0.0), 0.0, 1e-12);
}

#[test]
fn plastic_plate_keeps_a_dent_and_the_second_blow_is_elastic() {
    let mut plant = undamped(with("K9_plastic", 0.19));
    // Energy given back is the ratio of the slopes: e^2 = 1 - share.
    let first = blow(&mut plant, 0.05);
    near(first.restitution, 0.9, 1e-3);
    near(plant.law.touch(plant.deepest), 0.19 * plant.deepest, 1e-15);
    let second = blow(&mut plant, 0.04);
    near(second.restitution, 1.0, 1e-3);
}

#[test]
fn a_plate_on_a_spring_rings_at_its_frequency() {
    let compliance = 7.5e-7;
    let mut plant = with("K10_fixture", compliance);
    plant.fixture.1 = 0.0;
    let mut state: State = [0.0; 14];
    state[POSITION + 2] = 0.05;
    state[8] = 1e-5;
    let period = TAU * (compliance * PLATE_MASS).sqrt();
    for _ in 0..10_000 {
        state = advance(&plant, &state, 10.0 * period / 1e4);
    }
    near(state[8], 1e-5, 1e-9);
}

/// Friction force per normal force in steady sliding of a speed \[m/s\] in a direction \[rad\].
fn grip(plant: &Plant, speed: f64, direction: f64) -> [f64; 2] {
    let unit = [direction.cos(), direction.sin()];
    let (rate, bristles) = (unit.map(|x| x * speed), unit.map(|x| x * PRESLIDING_TRAVEL));
    let (bristle_rate, force) = plant.law.tangential([0.003, 0.001], rate, bristles, 70.0);
    assert!(bristle_rate.iter().all(|rate| rate.abs() < 1e-12));
    force.map(|force| force / 70.0)
}

#[test]
fn contact_friction_effects_depend_on_speed_and_direction() {
    for (speed, direction) in [(0.004, 0.0), (0.05, 1.0), (0.02, 4.0)] {
        let level = |plant: &Plant| grip(plant, speed, direction)[0].hypot(grip(plant, speed, direction)[1]);
        near(level(&healthy()), FRICTION, 1e-9);
        near(level(&with("K4_friction", 0.04)), FRICTION + 0.04, 1e-9);
        near(level(&with("K5_stick_slip", 0.08)), FRICTION + 0.08 * (-speed / 0.01).exp(), 1e-9);
        let [x, y] = grip(&with("K6_anisotropy", 0.2), speed, direction);
        near(x, -1.2 * FRICTION * direction.cos(), 1e-9);
        near(y, -0.8 * FRICTION * direction.sin(), 1e-9);
    }
    let map = with("friction_map", 0.05);
    let here = map.law.coefficient([0.01, 0.02], 0.1);
    assert!(here != map.law.coefficient([0.013, 0.02], 0.1) && here == map.law.coefficient([0.01, 0.02], 0.01));
}

#[test]
fn memory_relaxes_and_the_sensor_lags() {
    let law = with("contact_memory", 3e4).law;
    near(law.normal(1e-3, 0.0, 0.0, 0.0), 130.0, 1e-9);
    near(law.normal(1e-3, 0.0, 0.0, 1e-3), 100.0, 1e-9);
    near(law.memory_rate(1e-3, 4e-4), 6e-4 / MEMORY_TIME, 1e-12);
    let (direct, lagging) = (blow(&mut healthy(), 0.1), blow(&mut with("S5_low_pass", 0.005), 0.1));
    assert!(lagging.peak < 0.97 * direct.peak && lagging.peak > 0.9 * direct.peak, "{} {}", lagging.peak, direct.peak);
}

#[test]
fn every_experiment_excites_its_effects() {
    let bench = ContactRig { nuisances: NONE, plant: healthy(), healthy: healthy() };
    let run = Run { seed: 1, number: 0, start_s: 0.0, noise: None, unmoved: false };
    let trace = |name: &str| bench.simulate(&super::motions::experiment(name), &run, super::STEPS);
    let [press, bounce, slide] = [0, 1, 2].map(|i| trace(TRAINING[i]));
    let peak = |trace: &[Vec<f64>; 6]| trace[5].iter().fold(0.0_f64, |peak, force| peak.max(*force));
    assert!(peak(&press) > 300.0 && press[2].last() > Some(&1e-3), "{} {:?}", peak(&press), press[2].last());
    let touches = bounce[5].windows(2).filter(|pair| pair[0] == 0.0 && pair[1] > 0.0).count();
    assert!(touches >= 4, "{touches} touches");
    let sliding = |axis: usize| slide[axis].iter().fold(0.0_f64, |far, x| far.max(x.abs()));
    assert!(sliding(0) > 0.01 && sliding(1) > 0.01, "{} {}", sliding(0), sliding(1));
    assert!(slide[5].iter().all(|force| *force > 0.0), "the body left the plate");
}

#[test]
fn half_step_changes_less_than_the_sensor_noise() {
    for hidden in [&[][..], &[("K9_plastic", 0.15)], &[("K8_adhesion", 10.0)], &[("K10_fixture", 7.5e-7)]] {
        let bench = ContactRig { nuisances: NONE, plant: plant(&sizes(hidden), &NONE, MAP), healthy: healthy() };
        let run = Run { seed: 1, number: 0, start_s: 0.0, noise: None, unmoved: false };
        for name in TRAINING {
            let [coarse, fine] = [10, 20].map(|steps| bench.simulate(&super::motions::experiment(name), &run, steps));
            let apart = |i: usize| {
                let pairs = coarse[i].iter().zip(&fine[i]);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            // The sensors' noise: 0.3 um and 0.3 N.
            for i in 0..3 {
                assert!(apart(i) < 3e-8, "{hidden:?} {name}: {:e} m", apart(i));
                assert!(apart(3 + i) < 0.03, "{hidden:?} {name}: {} N", apart(3 + i));
            }
        }
    }
}

#[test]
fn unmoved_effect_changes_readings_and_not_the_motion() {
    let record = |hidden: &[(&'static str, f64)], unmoved: bool| {
        let bench = ContactRig { nuisances: NONE, plant: plant(&sizes(hidden), &NONE, MAP), healthy: healthy() };
        let run = Run { seed: 1, number: 0, start_s: 0.0, noise: None, unmoved };
        bench.simulate(&super::motions::experiment("bounce"), &run, super::STEPS)
    };
    let still = record(&[], false);
    let none = record(&[], true);
    assert!(none[2] == still[2] && none[5] == still[5], "without hidden effects the two are equal");
    let (stiffer, moved) = (record(&[("K1_stiffness", 2e4)], true), record(&[("K1_stiffness", 2e4)], false));
    assert!(stiffer[2] == still[2] && moved[2] != still[2]);
    // The same depths, a fifth more of the spring's force; the damper's share stays.
    for (with, without) in stiffer[5].iter().zip(&still[5]).filter(|(_, without)| **without > 50.0) {
        assert!((1.1..1.3).contains(&(with / without)), "{with} N instead of {without} N");
    }
    // What the plate and the sensor do by themselves goes on under it.
    for own in [("K10_fixture", 7.5e-7), ("S5_low_pass", 1e-3), ("K9_plastic", 0.15)] {
        let shown = record(&[own], true);
        let apart = shown[5].iter().zip(&still[5]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Its own kinks cut the steps of both.
        let gone = shown[2].iter().zip(&still[2]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(gone < 1e-8 && apart > 5.0, "{own:?}: {gone:e} m, {apart} N");
    }
}
