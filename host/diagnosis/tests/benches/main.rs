//! Diagnosis of the gauntlet's benches of one block, whose generator shares no code with the fitter.

mod body;
mod command;
mod contact;
mod facility;
mod sensor;
mod toss;

use softdock_campaign::Rig;
use softdock_campaign::rig::Plant;
use softdock_diagnosis::block::MeasuredBlock;
use softdock_diagnosis::block::body::body_block;
use softdock_diagnosis::block::command::command_block;
use softdock_diagnosis::block::contact::contact_block;
use softdock_diagnosis::block::sensor::sensor_block;
use softdock_diagnosis::recording::grid::{Piece, read};
use softdock_diagnosis::{judge, library};
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
        set.write(folder.path()).expect("room");
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
            Plant::Sensor(rig) => sensor_block(rig, &self.all, &is_held, 1),
            Plant::Contact(rig) => contact_block(rig, &self.all, &is_held, 1),
            Plant::Command(rig) => command_block(rig, &self.all, &is_held, 1),
            Plant::Body(rig) => body_block(rig, &self.all, &is_held, 1),
            Plant::Drive(_) | Plant::Robot(_) | Plant::Toss(_) => unreachable!("another bench"),
        }
    }

    fn library(&self, block: &MeasuredBlock) -> Vec<library::Hypothesis> {
        match &self.rig.plant {
            Plant::Sensor(_) => library::sensor::effects(block),
            Plant::Contact(_) => library::contact::effects(block),
            Plant::Command(_) => library::command::effects(block, None),
            Plant::Body(_) => library::body::effects(block),
            Plant::Drive(_) | Plant::Robot(_) | Plant::Toss(_) => unreachable!("another bench"),
        }
    }
}

/// Asserts that nothing is found on a healthy bench.
fn assert_nothing_found(bench: Bench) {
    let said = said(bench, &[], 1);
    assert!(said.log_odds < 5.0 && said.misfit < 1.1, "{said:?}");
}

/// Asserts that what is hidden, of a size, is named.
fn assert_named(bench: Bench, id: &'static str, size: f64, named: &str) {
    let said = said(bench, &[Hidden { id, size }], 11);
    assert!(said.ids == [named] && said.log_odds > 20.0 && said.gap > 10.0 && said.held_out < 1.3, "{id}: {said:?}");
}

/// Files of a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        folder.read_dir().expect("a folder").map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}

/// What is said of a bench.
#[derive(Debug)]
struct Said {
    /// Id of the best hypothesis, or several.
    ids: Vec<&'static str>,
    log_odds: f64,
    /// By how much the best single rival is behind.
    gap: f64,
    /// Mean square of held-out residuals under the best.
    held_out: f64,
    /// Mean square of the null hypothesis' residuals.
    misfit: f64,
}

/// What is said of a bench with something hidden.
fn said(bench: Bench, hidden: &[Hidden], seed: u64) -> Said {
    let recorded = Recorded::of(bench, hidden, seed);
    let block = &recorded.block();
    let library = &recorded.library(block);
    let judgement = judge(block, block, library).expect("repeats");
    let first = &judgement.ranking[0];
    let ids: Vec<&str> = first.hypotheses.iter().map(|number| library[*number].effect.id).collect();
    let rival = judgement.ranking.iter().find(|c| c.hypotheses.iter().all(|h| !first.hypotheses.contains(h)));
    Said {
        log_odds: first.log_odds,
        gap: first.log_odds - rival.map_or(0.0, |rival| rival.log_odds),
        held_out: first.adequacy.expect("held-out motion").own,
        misfit: judgement.misfit(),
        ids,
    }
}
