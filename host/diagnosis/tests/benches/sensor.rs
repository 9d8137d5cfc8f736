//! The sensor bench.

use super::{Recorded, assert_nothing_found, files};
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, prepare};
use softdock_diagnosis::plants::sensor::excess_noise::excess_noise;
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_gauntlet::{Hidden, NoiseColour, Rig as Bench, generate};
use softdock_test_size::is_full;
use std::path::Path;

#[test]
fn null_recordings_give_no_effect() {
    assert_nothing_found(Bench::Sensor);
}

#[test]
fn excess_noise_is_detected_from_repeats() {
    let odds = |hidden: &[Hidden]| {
        let recorded = Recorded::of(Bench::Sensor, hidden, 4);
        let RigModel::Sensor(rig) = &recorded.rig.plant else { unreachable!("a sensor bench") };
        excess_noise(rig, &recorded.block()).expect("healthy noise is known")
    };
    assert!(odds(&[]).log_odds < 0.0, "{:?}", odds(&[]));
    let more = odds(&[Hidden { id: "S7_noise", size: 1.0 }]);
    assert!(more.log_odds > 20.0 && (more.deviation[0].value - 1.0).abs() < 0.15, "{more:?}");
    assert!((more.deviation[1].value - 0.1).abs() < 0.015 && (more.correlation_time - 0.05).abs() < 0.02, "{more:?}");
}

#[test]
fn drift_and_noise_are_not_reported_as_signal_trend() {
    let grew = |id, size| {
        let block = Recorded::of(Bench::Sensor, &[Hidden { id, size }], 4).block();
        block.grew(&block.base)
    };
    assert!(grew("temperature_gain", 0.02), "half of what one would look for");
    assert!(!grew("S2_drift", 0.02) && !grew("S7_noise", 1.0) && !grew("S3_gain", 0.1));
}

#[test]
fn shortcut_is_exact_for_a_drifting_sensor() {
    let block = Recorded::of(Bench::Sensor, &[], 4).block();
    let mut set = block.base.clone();
    (set[block.field("drift_force_x")], set[block.field("resolution")]) = (0.05, 3.0);
    let part = block.part(false);
    let noise = part.noise(&block.base).expect("repeats");
    let quick = part.shortcut(&noise, &set).whitened(std::slice::from_ref(&set)).remove(0);
    let whole = part.whitened(&noise, std::slice::from_ref(&set)).remove(0);
    assert!((&quick - &whole).amax() < 1e-6 * whole.amax(), "{} of {}", (&quick - &whole).amax(), whole.amax());
}

#[test]
fn quantisation_is_named_beside_a_bias() {
    let hidden = [Hidden { id: "S1_bias", size: 4.2 }, Hidden { id: "S6_quantisation", size: 4.0 }];
    let said = said(&hidden, &[]);
    let ids: Vec<&str> = said.effects.iter().map(|effect| effect.id).collect();
    assert!(said.answer == DiagnosisVerdict::Named && ids.len() == 2, "{:?} {ids:?}", said.answer);
    assert!(ids.contains(&"S1_bias") && ids.contains(&"S6_quantisation"), "{ids:?}");
}

#[test]
fn quantisation_is_not_noise_and_excess_noise_is_named_beyond_it() {
    let found = |hidden: [Hidden; 2]| {
        let said = said(&hidden, &[]);
        let mut ids: Vec<&str> = said.effects.iter().map(|effect| effect.id).collect();
        ids.sort_unstable();
        let step = said.effects.iter().find(|effect| effect.id == "S6_quantisation")?.parameters["resolution"].value;
        Some((said.answer, ids, step))
    };
    let steps = |size| Hidden { id: "S6_quantisation", size };
    let (answer, ids, step) = found([Hidden { id: "S2_drift", size: 0.13 }, steps(4.0)]).expect("steps");
    assert!(answer == DiagnosisVerdict::Named && ids == ["S2_drift", "S6_quantisation"], "{answer:?} {ids:?}");
    assert!((step - 4.0).abs() < 0.01, "{step}");
    if !is_full() {
        return;
    }
    let (answer, ids, step) = found([Hidden { id: "S7_noise", size: 1.35 }, steps(4.75)]).expect("steps");
    assert!(answer == DiagnosisVerdict::Named && ids == ["S6_quantisation", "S7_noise"], "{answer:?} {ids:?}");
    assert!((step - 4.75).abs() < 0.02, "{step}");
}

/// What is said of a bench with something hidden, by a library without some effects.
fn said(hidden: &[Hidden], without: &[&str]) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    generate(Bench::Sensor, hidden, NoiseColour::FirstOrder, 4).expect("a set").write(folder.path()).expect("writable");
    let rig = Rig::load(&folder.path().join("model.toml")).expect("a legal model");
    let [logs, holdout] = ["training", "holdout"].map(|name| files(&folder.path().join(name)));
    let logs: Vec<&Path> = logs.iter().map(AsRef::as_ref).collect();
    let holdout: Vec<&Path> = holdout.iter().map(AsRef::as_ref).collect();
    let options = DiagnosisOptions {
        without: without.iter().map(|id| (*id).to_owned()).collect(),
        ..DiagnosisOptions::default()
    };
    prepare(rig, &logs, &holdout, &options).expect("recordings of use").diagnose().expect("an answer").0
}

#[test]
fn noise_excluded_from_the_library_is_not_named() {
    let said = said(&[Hidden { id: "S7_noise", size: 1.0 }], &["S7_noise"]);
    assert!(
        said.answer == DiagnosisVerdict::NotInLibrary && said.effects.is_empty(),
        "{:?} {:?}",
        said.answer,
        said.effects
    );
}

#[test]
fn temperature_dependent_gain_is_outside_the_library_and_not_noise() {
    let said = said(&[Hidden { id: "temperature_gain", size: 0.02 }], &[]);
    assert!(
        said.answer == DiagnosisVerdict::NotInLibrary && said.effects.is_empty(),
        "{:?} {:?}",
        said.answer,
        said.effects
    );
    assert!(
        said.findings.iter().any(|finding| finding.what.contains("grows with the session time")),
        "{:?}",
        said.findings
    );
}
