//! Diagnosis of the gauntlet's benches of one block, whose generator shares no code with the fitter.

mod body;
mod command;
mod contact;
mod facility;
mod sensor;
mod toss;

use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_diagnosis::data::grid::{Piece, read};
use softdock_diagnosis::judge;
use softdock_diagnosis::model::block::MeasuredBlock;
use softdock_diagnosis::model::hypothesis::Hypothesis;
use softdock_diagnosis::plants::body::block::body_block;
use softdock_diagnosis::plants::command::block::command_block;
use softdock_diagnosis::plants::contact::block::contact_block;
use softdock_diagnosis::plants::sensor::block::sensor_block;
use softdock_diagnosis::plants::{
    body as body_plant, command as command_plant, contact as contact_plant, sensor as sensor_plant,
};
use softdock_gauntlet::{Hidden, NoiseColour, Rig as Bench, generate};
use std::path::{Path, PathBuf};

/// A bench with something hidden: its rig and its recordings, training and held out.
struct Recorded {
    rig: Rig,
    all: Vec<Piece>,
    held_out: Vec<String>,
}

impl Recorded {
    fn of(bench: Bench, hidden: &[Hidden], seed: u64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let set = generate(bench, hidden, NoiseColour::FirstOrder, seed).expect("a legal size");
        set.write(folder.path()).expect("writable");
        let rig = Rig::load(&folder.path().join("model.toml")).expect("a legal model");
        let read = |name: &str| -> Vec<Piece> {
            files(&folder.path().join(name)).iter().flat_map(|file| read(file, &rig).expect("a log").0).collect()
        };
        let (mut all, test) = (read("training"), read("holdout"));
        let held_out = test.iter().map(|piece| piece.experiment.clone()).collect();
        all.extend(test);
        Self { rig, all, held_out }
    }

    fn block(&self) -> MeasuredBlock {
        let is_held = |experiment: &str| self.held_out.iter().any(|held| held == experiment);
        match &self.rig.plant {
            RigModel::Sensor(rig) => sensor_block(rig, &self.all, &is_held, 1),
            RigModel::Contact(rig) => contact_block(rig, &self.all, &is_held, 1),
            RigModel::Command(rig) => command_block(rig, &self.all, &is_held, 1),
            RigModel::Body(rig) => body_block(rig, &self.all, &is_held, 1),
            RigModel::Drive(_) | RigModel::Robot(_) | RigModel::Toss(_) => unreachable!("another bench"),
        }
    }

    fn library(&self, block: &MeasuredBlock) -> Vec<Hypothesis> {
        match &self.rig.plant {
            RigModel::Sensor(_) => sensor_plant::hypotheses::effects(block),
            RigModel::Contact(_) => contact_plant::hypotheses::effects(block),
            RigModel::Command(rig) => command_plant::hypotheses::effects(block, None, rig.is_servo),
            RigModel::Body(_) => body_plant::hypotheses::effects(block),
            RigModel::Drive(_) | RigModel::Robot(_) | RigModel::Toss(_) => unreachable!("another bench"),
        }
    }
}

/// Asserts that nothing is found on a healthy bench.
fn assert_nothing_found(bench: Bench) {
    let recorded = Recorded::of(bench, &[], 1);
    let block = &recorded.block();
    let judgement = judge(block, block, &recorded.library(block)).expect("repeats");
    let (log_odds, misfit) = (judgement.ranking[0].log_odds, judgement.misfit());
    assert!(log_odds < 5.0 && misfit < 1.1, "{log_odds} {misfit}");
}

/// Files of a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        folder.read_dir().expect("a folder").map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}
