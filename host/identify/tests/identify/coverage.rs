//! Stated intervals against what they promise, on data that the model can explain but for noise.

use crate::kr300;
use nalgebra::DVector;
use softdock_campaign::Robot;
use softdock_identify::base::{Base, LeastSquares};
use softdock_identify::excitation::{DesignOptions, design};
use softdock_identify::layout::Layout;
use softdock_identify::log::Recording;
use softdock_identify::motion::{Preparation, RecordedMotion};
use softdock_identify::series::Series;
use softdock_identify::system::{System, shapes};
use softdock_kernels::manipulator::{bristle, inverse_dynamics};
use softdock_kernels::philox;
use softdock_test_size::sized;
use std::collections::BTreeMap;

/// Draws of the noise.
fn trials() -> u64 {
    sized(50, 100)
}

const STEP: f64 = 0.02;
const PERIOD: f64 = 10.0;

/// Noise of the torques, as a share of the torque limits, and of the encoders \[rad\].
const TORQUE_NOISE: f64 = 0.01;
const ENCODER_NOISE: f64 = 1e-6;

fn normal(trial: u64, what: &str, index: u32) -> f64 {
    let uniform = |part: u32| philox::uniform(trial, what, u64::from(index), part);
    (-2.0 * uniform(0).ln()).sqrt() * (2.0 * std::f64::consts::PI * uniform(1)).cos()
}

/// What a robot with this friction would record, without noise; the first period brings friction to its cycle.
fn clean(robot: &Robot, motion: &[Series], periods: usize) -> Recording {
    let samples = (PERIOD / STEP).round() as usize;
    let mut slip = [0.0; 6];
    let mut before: [f64; 6] = std::array::from_fn(|joint| motion[joint].at(0.0)[0]);
    let mut recording = Recording {
        name: "clean".to_owned(),
        step: STEP,
        angle: vec![Vec::new(); 6],
        torque: vec![Vec::new(); 6],
        link_angle: BTreeMap::new(),
        notes: Vec::new(),
    };
    for k in 0..samples * (periods + 1) {
        let states: Vec<[f64; 3]> = motion.iter().map(|series| series.at(k as f64 * STEP)).collect();
        let of = |order: usize| -> [f64; 6] { std::array::from_fn(|joint| states[joint][order]) };
        for (joint, frictions) in robot.model.joints.iter().map(|joint| joint.friction).enumerate() {
            slip[joint] = bristle(slip[joint], of(0)[joint] - before[joint], frictions.presliding_travel());
        }
        before = of(0);
        let torques = inverse_dynamics(&robot.model, of(0), of(1), of(2), slip);
        if k >= samples {
            recording.angle.iter_mut().zip(of(0)).for_each(|(column, value)| column.push(value));
            recording.torque.iter_mut().zip(torques).for_each(|(column, value)| column.push(value));
        }
    }
    recording
}

fn noisy(robot: &Robot, clean: &Recording, trial: u64) -> Recording {
    let mut recording = clean.clone();
    for joint in 0..6 {
        let size = TORQUE_NOISE * robot.model.joints[joint].drive.torque_limit;
        let at = |k: usize| (joint * clean.rows() + k) as u32;
        for k in 0..clean.rows() {
            recording.torque[joint][k] += size * normal(trial, "torque", at(k));
            recording.angle[joint][k] += ENCODER_NOISE * normal(trial, "encoder", at(k));
        }
    }
    recording
}

/// Shares of the trials whose 95 % interval holds the truth, by base parameter.
fn coverage(preparation: Preparation, periods: usize) -> Vec<f64> {
    let robot = kr300();
    let options = DesignOptions { period: PERIOD, harmonics: 5, starts: 10, steps: 20, ..DesignOptions::default() };
    let motion = design(&robot, &options).expect("a motion").joints;
    let clean = clean(&robot, &motion, periods);
    let base = Base::of(&robot);
    let truth = &base.map * DVector::from_vec(Layout::of(&robot).values(&robot));
    let mut hits = vec![0.0; base.len()];
    for trial in 0..trials() {
        let motions = [RecordedMotion::new(&noisy(&robot, &clean, trial), &preparation).expect("a motion")];
        let system = System::new(&robot, &motions, &shapes(&robot));
        let found = LeastSquares::new(&system, &base, &motions);
        for (index, error) in found.standard_errors().iter().enumerate() {
            if (found.beta[index] - truth[index]).abs() <= 1.96 * error {
                hits[index] += 1.0 / trials() as f64;
            }
        }
    }
    hits
}

fn holds(hits: &[f64]) {
    let pooled = hits.iter().sum::<f64>() / hits.len() as f64;
    let least = hits.iter().copied().fold(1.0, f64::min);
    println!("pooled {pooled:.4}, least {least:.2} of {} parameters", hits.len());
    assert!((0.92..=0.97).contains(&pooled), "pooled {pooled}");
    assert!(least >= sized(0.8, 0.85), "the worst parameter: {least}");
}

#[test]
fn intervals_of_periodic_recordings_have_their_coverage() {
    holds(&coverage(Preparation { cutoff: 8.0, period: Some(PERIOD) }, 2));
}

#[test]
fn intervals_of_low_passed_recordings_have_their_coverage() {
    holds(&coverage(Preparation { cutoff: 8.0, period: None }, 2));
}
