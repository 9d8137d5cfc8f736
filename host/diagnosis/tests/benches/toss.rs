//! Tossed cubes, whose generator knows blows as impulses.

use softdock_campaign::Rig;
use softdock_diagnosis::diagnosis::{Diagnosis, Options, prepare};
use softdock_gauntlet::{Hidden, tosses};

/// What is said of so many tosses with something hidden, every fourth held out.
fn diagnosed(hidden: &[Hidden], count: u64) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    let made = tosses(hidden, count, 5).expect("a legal size");
    let (model, log) = (folder.path().join("model.toml"), folder.path().join("tosses.csv"));
    std::fs::write(&model, made.model).expect("room");
    std::fs::write(&log, made.log).expect("room");
    let rig = Rig::load(&model).expect("a legal model");
    let options = Options { hold_out_experiments: "4:1".parse().ok(), ..Options::default() };
    let prepared = prepare(rig, &[&log], &[], &options).expect("good recordings");
    prepared.diagnose().expect("tosses that show something").0
}

#[test]
fn friction_that_is_higher_than_the_models_is_named() {
    let diagnosis = diagnosed(&[Hidden { id: "K4_friction", size: 0.12 }], 40);
    eprintln!("{}", softdock_diagnosis::words::text(&diagnosis));
}
