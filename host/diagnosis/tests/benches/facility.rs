//! A whole facility, recorded by a driver that is not softdock.

use super::files;
use softdock_campaign::Scenario;
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::diagnosis::{DiagnosisOptions, Prepared, prepare_facility};
use softdock_diagnosis::plants::facility::block::FacilityModel;
use softdock_gauntlet::{NoiseColour, Rig as Bench, generate};
use std::path::{Path, PathBuf};

/// A folder with the drives of a healthy facility.
fn recorded() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let set = generate(Bench::Facility, &[], NoiseColour::FirstOrder, 1).expect("nothing hidden");
    set.write(folder.path()).expect("writable");
    folder
}

/// Reads the drives of a folder.
fn prepared(folder: &Path) -> Result<Prepared, DiagnosisError> {
    let scenario = Scenario::load(&folder.join("model.toml")).expect("a legal scenario");
    let [training, holdout] = ["training", "holdout"].map(|name| files(&folder.join(name)));
    let [training, holdout]: [Vec<&Path>; 2] =
        [&training, &holdout].map(|files| files.iter().map(PathBuf::as_path).collect());
    prepare_facility(FacilityModel::Scenario(Box::new(scenario)), &training, &holdout, &DiagnosisOptions::default())
}

#[test]
fn logs_of_other_drivers_are_read_by_column_name() {
    let folder = recorded();
    let blocks = prepared(folder.path()).unwrap_or_else(|error| panic!("{error}")).blocks(1);
    assert_eq!(
        blocks.iter().map(|(block, _)| block.name).collect::<Vec<_>>(),
        ["R2 command to motion", "R5 motion to wrench"]
    );
    let names: Vec<&str> = blocks[0].0.trials.iter().map(|trial| trial.experiment.as_str()).collect();
    assert_eq!((names.len(), names[0], names[11]), (12, "aslant_1", "validation_3"));
    let trial = &blocks[0].0.trials[0];
    assert!((trial.recorded.step - 1e-3).abs() < 1e-12 && trial.recorded.stride == 1 && !trial.held_out);
}

#[test]
fn missing_column_of_a_log_is_reported_with_a_remedy() {
    let folder = recorded();
    let file = folder.path().join("training/aslant_1.csv");
    let text = std::fs::read_to_string(&file).expect("a log").replace("part_b_attitude_w", "part_b_q0");
    std::fs::write(&file, text).expect("writable");
    let error = prepared(folder.path()).err().expect("a column is missing");
    let message = error.to_string();
    assert!(message.contains("aslant_1.csv:1") && message.contains("`simulated_part_b_attitude_w`"), "{message}");
    assert!(error.remedy().contains("ft_compensated"), "{}", error.remedy());
}
