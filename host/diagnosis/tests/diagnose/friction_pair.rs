//! A joint known by its inertia alone, whose friction takes nearly all of its torque.

use softdock_campaign::Rig;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, prepare};
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_kernels::philox;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;

const MODEL: &str = r#"
schema = "rig/1"
kind = "drive"
id = "joint"
title = "Joint known by its inertia alone"
[drive]
motion = "revolute"
motor_inertia = "5.4 kg m^2"
[tolerance]
motor_inertia = "5 %"
[log]
"t" = { column = "t", unit = "s" }
"q" = { column = "q", unit = "rad" }
"tau" = { column = "tau", unit = "N m" }
"#;
/// Base joint of a UR10e: 5.4 kg m^2, 12.55 N m, 21.26 N m s/rad (Mamedov and Mikhel 2020).
const INERTIA: f64 = 5.4;
const COULOMB: f64 = 12.55;
const VISCOUS: f64 = 21.26;
/// Travel in which the friction turns over \[rad\].
const PRESLIDING: f64 = 2e-4;
/// Samples per second of the log, and steps of the drive per sample.
const RATE: f64 = 100.0;
const STEPS: usize = 20;

/// A recording of 20 s: sines up to 1 Hz, friction by inverse dynamics with a bristle, noise of torque and encoder.
fn recording(seed: u64) -> String {
    let random = |of: &str, k: usize| (0..12).map(|j| philox::uniform(seed, of, k as u64, j)).sum::<f64>() - 6.0;
    let sines: Vec<[f64; 3]> = [0.1, 0.2, 0.3, 0.5, 0.7, 0.9]
        .iter()
        .enumerate()
        .map(|(k, f)| [random("size", k) * 0.08 / f, TAU * f, TAU * random("phase", k)])
        .collect();
    let at = |t: f64, order: i32| -> f64 {
        let turn = 0.25 * TAU * f64::from(order);
        sines.iter().map(|[a, w, p]| a * w.powi(order) * (w * t + p + turn).sin()).sum()
    };
    let (mut bristle, step) = (0.0_f64, 1.0 / (RATE * STEPS as f64));
    let mut text = String::from("t,q,tau\n");
    for k in 0..20 * RATE as usize * STEPS {
        let t = k as f64 * step;
        let travel = at(t, 1) * step / PRESLIDING;
        bristle += (travel - travel.abs() * bristle) * if travel.abs() < 1.0 { 1.0 } else { travel.abs().recip() };
        if k % STEPS == 0 {
            let sample = k / STEPS;
            let torque = INERTIA * at(t, 2) + VISCOUS * at(t, 1) + COULOMB * bristle + 0.5 * random("torque", sample);
            let angle = at(t, 0) + 5e-6 * random("angle", sample);
            writeln!(text, "{:.4},{angle:.7},{torque:.5}", sample as f64 / RATE).expect("text in memory");
        }
    }
    text
}

fn diagnosed(scale: f64) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scaled = |name: &str, seed: u64| {
        let file = folder.path().join(name);
        let row = |line: &str| match line.rsplit_once(',') {
            Some((head, torque)) => match torque.parse::<f64>() {
                Ok(torque) => format!("{head},{:e}\n", scale * torque),
                Err(_) => format!("{line}\n"),
            },
            None => String::new(),
        };
        fs::write(&file, recording(seed).lines().map(row).collect::<String>()).expect("a file");
        file
    };
    let model = folder.path().join("rig.toml");
    let inertia = format!("motor_inertia = \"{} kg m^2\"", scale * INERTIA);
    fs::write(&model, MODEL.replace("motor_inertia = \"5.4 kg m^2\"", &inertia)).expect("a file");
    let rig = Rig::load(&model).expect("a legal model");
    let (training, held_out) = (scaled("a.csv", 1), scaled("b.csv", 2));
    let prepared = prepare(rig, &[&training], &[&held_out], &DiagnosisOptions::default()).expect("good recordings");
    prepared.diagnose().expect("a motion that shows something").0
}

/// Asserts that both frictions are named within 3 % of their sizes, and nothing else.
fn assert_friction(diagnosis: &Diagnosis, scale: f64) {
    let mut found: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
    found.sort_unstable();
    assert_eq!((diagnosis.answer, &found[..]), (DiagnosisVerdict::Named, &["J1_coulomb", "J2_viscous"][..]));
    for (id, name, truth) in [("J1_coulomb", "coulomb", COULOMB), ("J2_viscous", "viscous", VISCOUS)] {
        let effect = diagnosis.effects.iter().find(|effect| effect.id == id).expect("named above");
        let value = effect.parameters[name].value / scale;
        assert!((value / truth - 1.0).abs() < 0.03, "{name}: {value} instead of {truth}");
    }
}

#[test]
fn friction_pair_of_real_size_is_named() {
    assert_friction(&diagnosed(1.0), 1.0);
}

/// Units and sizes of machines differ by orders of magnitude; the answer must not.
#[test]
fn answer_is_invariant_under_scaling_of_torque_and_inertia() {
    for scale in [1e-4, 1e4] {
        assert_friction(&diagnosed(scale), scale);
    }
}
