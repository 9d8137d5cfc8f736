//! Each effect of the drive follows its law: on the plant alone, without noise and nuisances.

use super::build::{Inner, Nuisances, plant};
use super::friction::Sliding;
use super::nominal::{COULOMB, LINK_INERTIA, MOTOR_INERTIA, PRESLIDING_TRAVEL, VISCOUS};
use super::plant::{CURRENT, LINK, LINK_RATE, MOTOR, MOTOR_RATE, Plant, State};
use crate::catalogue::{Hidden, Rig, Sizes};
use crate::ode::{System, advance};
use crate::{CommandedPath, NoiseColour, follow, generate};

const NONE: Nuisances = Nuisances {
    coulomb: 1.0,
    viscous: 1.0,
    torque_constant: 1.0,
    presliding_travel: 1.0,
    offset: 0.0,
    clock_offset: 0.0,
};

fn with(hidden: &[(&'static str, f64)]) -> Plant {
    let hidden: Vec<Hidden> = hidden.iter().map(|&(id, size)| Hidden { id, size }).collect();
    let sizes = Sizes::check(Rig::Drive { link_encoder: false }, &hidden).expect("effects");
    plant(&sizes, &NONE, &Inner::draw(4))
}

/// Friction torque \[N m\] of steady sliding at an angle \[rad\] and rate \[rad/s\].
fn sliding(plant: &Plant, angle: f64, rate: f64, warmth: f64) -> f64 {
    let load = 60.0 * angle.cos();
    let at = Sliding { angle, rate, bristle: 0.0, load, warmth };
    let bristle = (plant.friction.level(at) / plant.friction.stiffness).copysign(rate);
    let (bristle_rate, torque) = plant.friction.of(Sliding { bristle, ..at });
    assert!(bristle_rate.abs() < 1e-12);
    torque
}

/// Change of the friction torque of steady sliding by an effect.
fn change(id: &'static str, size: f64, angle: f64, rate: f64, warmth: f64) -> f64 {
    sliding(&with(&[(id, size)]), angle, rate, warmth) - sliding(&with(&[]), angle, rate, warmth)
}

fn near(value: f64, expected: f64, bound: f64) {
    assert!((value - expected).abs() < bound, "{value} instead of {expected}");
}

#[test]
fn friction_of_the_healthy_drive_is_coulomb_and_viscous() {
    near(sliding(&with(&[]), 0.3, 0.5, 0.0), COULOMB + VISCOUS * 0.5, 1e-9);
    near(sliding(&with(&[]), 0.3, -0.01, 1.0), -COULOMB - VISCOUS * 0.01, 1e-9);
}

#[test]
fn drive_friction_effects_depend_on_speed_load_angle_and_warmth() {
    for rate in [-0.8, -0.06, 0.01, 0.4] {
        let sign = f64::signum(rate);
        near(change("J1_coulomb", 4.0, 0.2, rate, 0.0), 4.0 * sign, 1e-9);
        near(change("J2_viscous", 6.0, 0.2, rate, 0.0), 6.0 * rate, 1e-9);
        near(change("J3_stribeck", 8.0, 0.2, rate, 0.0), 8.0 * (-rate.abs() / 0.03).exp() * sign, 1e-9);
        near(change("stribeck_squared", 8.0, 0.2, rate, 0.0), 8.0 * (-(rate / 0.03).powi(2)).exp() * sign, 1e-9);
        near(change("J5_load_friction", 0.1, 1.0, rate, 0.0), 6.0 * 1.0_f64.cos() * sign, 1e-9);
        near(change("J6_warm_up", 0.5, 0.2, rate, 1.0), VISCOUS * rate * ((-0.5_f64).exp() - 1.0), 1e-9);
        near(change("J6_warm_up", 0.5, 0.2, rate, 0.0), 0.0, 1e-9);
        near(change("J18_direction_friction", 3.0, 0.2, rate, 0.0), 3.0, 1e-9);
        near(change("quadratic_drag", 25.0, 0.2, rate, 0.0), 25.0 * rate * rate.abs(), 1e-9);
        near(change("cubic_drag", 30.0, 0.2, rate, 0.0), 30.0 * rate.powi(3), 1e-9);
        near(change("temperature_load", 0.1, 1.0, rate, 0.5), 3.0 * 1.0_f64.cos() * sign, 1e-9);
        near(change("temperature_load", 0.1, 1.0, rate, 0.0), 0.0, 1e-9);
    }
}

#[test]
fn a_friction_map_belongs_to_the_angle_and_has_its_deviation() {
    let at = |i: usize| change("friction_map", 5.0, i as f64 * 0.01, 0.2, 0.0);
    let power = (0..20_000).map(|i| at(i).powi(2)).sum::<f64>() / 20_000.0;
    near(power.sqrt(), 5.0, 0.2);
    near(change("friction_map", 5.0, 0.7, -0.5, 0.0), -change("friction_map", 5.0, 0.7, 0.2, 0.0), 1e-9);
}

#[test]
fn bristles_load_over_their_travel() {
    for extra in [0.0, 0.0008] {
        let plant = if extra > 0.0 { with(&[("J4_presliding", extra)]) } else { with(&[]) };
        let travel = PRESLIDING_TRAVEL + extra;
        // At constant speed z = (Fc / s0)(1 - exp(-s0 x / Fc)); s0 = Fc / travel.
        let (speed, step) = (1e-3, 1e-5);
        let (mut bristle, mut moved) = (0.0, 0.0);
        while moved < travel {
            let at = Sliding { angle: 0.0, rate: speed, bristle, load: 0.0, warmth: 0.0 };
            bristle += step * plant.friction.of(at).0;
            moved += step * speed;
        }
        near(plant.friction.stiffness * bristle, COULOMB * (1.0 - (-1.0_f64).exp()), 0.01);
    }
}

/// Acceleration of the motor \[rad/s^2\] at an angle under a torque \[N m\], bristles unloaded.
fn acceleration(plant: &Plant, angle: f64, torque: f64) -> f64 {
    let mut plant = plant.clone();
    plant.inputs.torque = torque;
    plant.rate(&plant.at_rest(angle))[MOTOR_RATE]
}

#[test]
fn inertia_gravity_and_torque_effects_follow_newton() {
    let inertia = MOTOR_INERTIA + LINK_INERTIA;
    for (angle, torque) in [(0.0, 100.0), (1.2, -300.0)] {
        let weight = 60.0 * f64::cos(angle);
        let of = |id, size| acceleration(&with(&[(id, size)]), angle, torque);
        near(acceleration(&with(&[]), angle, torque), (torque - weight) / inertia, 1e-9);
        near(of("J11_torque_constant", 0.1), (1.1 * torque - weight) / inertia, 1e-9);
        near(of("J13_saturation", 80.0), (torque.clamp(-80.0, 80.0) - weight) / inertia, 1e-9);
        let payload = 2.0 * 9.80665 * 0.8 * f64::cos(angle);
        near(of("J14_payload", 2.0), (torque - weight - payload) / (inertia + 2.0 * 0.64), 1e-9);
        near(of("J15_link_inertia", 3.0), (torque - weight) / (inertia + 3.0), 1e-9);
        near(of("J16_gravity_compensation", 6.0), (torque - 1.1 * weight) / inertia, 1e-9);
        near(of("J17_cable", 10.0), (torque - weight - 10.0 * angle) / inertia, 1e-9);
        let (number, phase) = Inner::draw(4).ripple;
        let ripple = 3.0 * (number * angle + phase).sin();
        near(of("J9_torque_ripple", 3.0), (torque - weight + ripple) / inertia, 1e-9);
    }
}

/// The state after a time \[s\] under a constant torque \[N m\].
fn run(plant: &Plant, mut state: State, torque: f64, time: f64, step: f64) -> State {
    let mut plant = plant.clone();
    plant.inputs.torque = torque;
    for _ in 0..(time / step).round() as usize {
        state = advance(&plant, &state, step);
    }
    state
}

#[test]
fn the_current_loop_lags() {
    let plant = with(&[("J12_current_loop", 0.003)]);
    let state = run(&plant, plant.at_rest(0.0), 50.0, 0.003, 1e-4);
    near(state[CURRENT], 50.0 * (1.0 - (-1.0_f64).exp()), 1e-4);
}

/// The plant without friction, damping and gravity.
fn free(hidden: &[(&'static str, f64)]) -> Plant {
    let mut plant = with(hidden);
    (plant.friction.coulomb, plant.friction.stiffness) = (1e-9, 0.0);
    (plant.friction.damping, plant.friction.viscous, plant.link.gravity) = (0.0, 0.0, 0.0);
    if let Some(spring) = &mut plant.spring {
        (spring.damping, spring.impact) = (0.0, 0.0);
    }
    plant
}

#[test]
fn an_elastic_gear_rings_at_its_frequency() {
    let compliance = 1.17e-5;
    let plant = free(&[("J8_elasticity", compliance)]);
    let mut state = plant.at_rest(0.0);
    state[LINK] = -1e-4;
    let reduced = MOTOR_INERTIA * LINK_INERTIA / (MOTOR_INERTIA + LINK_INERTIA);
    let period = std::f64::consts::TAU * (compliance * reduced).sqrt();
    let steps = (20.0 * period / 1e-4).round();
    let end = run(&plant, state, 0.0, 20.0 * period, 20.0 * period / steps);
    near((end[MOTOR] - end[LINK]) / 1e-4, 1.0, 1e-4);
}

#[test]
fn backlash_conserves_energy_in_free_flight() {
    let gap = 0.0005;
    let plant = free(&[("J7_backlash", gap)]);
    let stiffness = plant.spring.expect("a spring").positive.stiffness;
    let energy = |state: &State| {
        let depth = ((state[MOTOR] - state[LINK]).abs() - gap).max(0.0);
        let kinetic = MOTOR_INERTIA * state[MOTOR_RATE].powi(2) + LINK_INERTIA * state[LINK_RATE].powi(2);
        0.5 * (kinetic + stiffness * depth * depth)
    };
    let mut state = plant.at_rest(0.0);
    (state[LINK], state[LINK_RATE]) = (0.0, 0.02);
    let before = energy(&state);
    // Flight to the flank: 0.5 mrad at 0.02 rad/s takes 25 ms, and nothing happens on the way.
    let flown = run(&plant, state, 0.0, 0.0249, 1e-4);
    near(flown[LINK], 0.0249 * 0.02, 1e-12);
    near(flown[MOTOR], 0.0, 1e-15);
    for (step, bound) in [(1e-4, 1e-5), (5e-5, 1e-6)] {
        let end = run(&plant, state, 0.0, 3.0, step);
        near(energy(&end) / before, 1.0, bound);
        near(MOTOR_INERTIA * end[MOTOR_RATE] + LINK_INERTIA * end[LINK_RATE], LINK_INERTIA * 0.02, 1e-9);
    }
}

#[test]
fn only_one_flank_of_an_asymmetric_backlash_is_loose() {
    let spring = with(&[("asymmetric_backlash", 0.001)]).spring.expect("a spring");
    assert!(spring.torque(1e-5, 0.0) > 0.0);
    assert_eq!(spring.torque(-0.0009, 0.0), 0.0);
    near(spring.torque(1e-4, 0.0) / -spring.torque(-0.0011, 0.0), 6.0, 1e-9);
}

#[test]
fn an_elastic_part_of_the_link_leaves_the_weight_and_the_whole_inertia() {
    let plant = free(&[("second_resonance", 3e-5)]);
    near(acceleration(&plant, 0.3, 100.0), 100.0 / 21.0, 1e-9);
    let end = run(&plant, plant.at_rest(0.3), 100.0, 2.0, 1e-4);
    near(end[MOTOR_RATE], 100.0 * 2.0 / 25.0, 0.1);
}

#[test]
fn half_step_changes_less_than_the_encoder_noise() {
    for hidden in
        [None, Some(("J3_stribeck", 8.0)), Some(("J7_backlash", 0.0005)), Some(("J10_transmission_error", 3e-4))]
    {
        let sizes: Vec<Hidden> = hidden.into_iter().map(|(id, size)| Hidden { id, size }).collect();
        let sizes = Sizes::check(Rig::Drive { link_encoder: true }, &sizes).expect("effects");
        let bench = super::DriveRig::new(&sizes, true, 9);
        let run = crate::session::Run { seed: 9, number: 0, start_s: 0.0, noise: None, unmoved: false };
        let motion = super::motions::motion("creep");
        let [coarse, fine] = [10, 20].map(|steps| bench.simulate(&motion, super::motions::DURATION_S, &run, steps));
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The encoder's quantum is 6e-6 rad, its noise 5e-6 rad.
        assert!(apart(&coarse.motor, &fine.motor) < 3e-7, "{hidden:?}: {:e}", apart(&coarse.motor, &fine.motor));
        assert!(apart(&coarse.link, &fine.link) < 3e-7, "{hidden:?}: {:e}", apart(&coarse.link, &fine.link));
    }
}

#[test]
fn commanded_path_is_followed_like_the_rigs_own() {
    let rig = Rig::Drive { link_encoder: false };
    let own = super::motions::motion("creep");
    let path = (0..=1500).map(|i| own.at(f64::from(i) * 0.004)[0]).collect();
    let commanded = CommandedPath { step_s: 0.004, path, repeats: 3 };
    let followed = |rig: Rig| follow(rig, &[], NoiseColour::White, 5, &commanded, 1).expect("a legal bench");
    let asked = followed(rig).expect("a drive follows paths");
    let names: Vec<&str> = asked.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["asked1_1.csv", "asked1_2.csv", "asked1_3.csv"]);
    let set = generate(rig, &[], NoiseColour::White, 5).expect("a legal bench");
    let own = &set.logs.iter().find(|(name, _)| name == "creep_1.csv").expect("an experiment").1;
    let angles = |text: &str| -> Vec<f64> {
        text.lines().skip(1).map(|row| row.split(',').nth(2).expect("q").parse().expect("a number")).collect()
    };
    let (asked, own) = (angles(&asked[0].1), angles(own));
    let apart = asked.iter().zip(&own).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(asked.len() == own.len() && apart < 2e-4 && apart > 0.0, "{apart}: other noise, the same motion");
    assert!(followed(Rig::Sensor).is_none(), "that bench follows no path");
}
