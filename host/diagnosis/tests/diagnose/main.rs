//! Diagnosis against recordings of the gauntlet, whose generator shares no code with the fitter.

use softdock_campaign::Rig;
use softdock_campaign::rig::Plant;
use softdock_diagnosis::block::MeasuredBlock;
use softdock_diagnosis::block::controller::controller_block;
use softdock_diagnosis::block::drive::drive_block;
use softdock_diagnosis::recording::grid::{self, Piece};
use softdock_diagnosis::{Judgement, judge, library};
use softdock_gauntlet::{Hidden, NoiseColour, Rig as Bench, generate};
use std::path::{Path, PathBuf};

const DRIVE: Bench = Bench::Drive { link_encoder: false };

/// Files of a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        folder.read_dir().expect("a folder").map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}

/// The drive's and the controller's block of a bench with hidden effects.
fn blocks(hidden: &[Hidden], seed: u64) -> [MeasuredBlock; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let set = generate(DRIVE, hidden, NoiseColour::FirstOrder, seed).expect("a legal size");
    set.write(folder.path()).expect("room");
    let rig = Rig::load(&folder.path().join("model.toml")).expect("a legal model");
    let Plant::Drive(drive) = &rig.plant else { unreachable!("a drive bench") };
    let read = |name: &str| -> Vec<Piece> {
        let pieces = files(&folder.path().join(name)).into_iter().map(|file| grid::read(&file, &rig).expect("a log").0);
        pieces.flatten().collect()
    };
    let (learn, test) = (read("training"), read("holdout"));
    let held_out = |experiment: &str| test.iter().any(|piece| piece.experiment == experiment);
    let all: Vec<Piece> = learn.iter().chain(&test).cloned().collect();
    let controller = drive.controller.as_ref().expect("the bench has one");
    [drive_block(drive, &all, &held_out, 1), controller_block(drive, controller, &all, &held_out)]
}

fn judged(block: &MeasuredBlock) -> (Judgement, Vec<library::Hypothesis>) {
    let library = match block.kind {
        softdock_engine::blocks::Kind::Drive => library::drive::effects(block),
        softdock_engine::blocks::Kind::Controller => library::controller::effects(block),
        kind => unreachable!("{kind:?} is of another bench"),
    };
    (judge(block, &library).expect("repeats"), library)
}

/// The best hypothesis of a block, its odds, and how adequate it is on held-out motion.
fn best(block: &MeasuredBlock) -> (String, f64, f64) {
    let (judgement, library) = judged(block);
    let first = &judgement.ranking[0];
    (library[first.hypotheses[0]].effect.id.to_owned(), first.log_odds, first.adequacy.expect("held-out motion").with)
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    for block in blocks(&[], 1) {
        let (judgement, _) = judged(&block);
        assert!(judgement.ranking[0].log_odds < 5.0, "{}: {}", judgement.block, judgement.ranking[0].log_odds);
        assert!(judgement.misfit() < 1.2, "{}: {}", judgement.block, judgement.misfit());
    }
}

#[test]
fn a_delay_of_the_reference_shows_in_the_controller_alone() {
    let [drive, controller] = blocks(&[Hidden { id: "C1_transport_delay", size: 0.003 }], 2);
    assert!(best(&drive).1 < 5.0, "{:?}", best(&drive));
    let (id, odds, adequacy) = best(&controller);
    assert!(id == "C1_transport_delay" && odds > 20.0 && adequacy < 1.3, "{id} {odds} {adequacy}");
}

#[test]
fn friction_and_load_are_told_apart() {
    for (id, size) in [("J3_stribeck", 8.0), ("J14_payload", 1.5), ("J8_elasticity", 2e-6)] {
        let [drive, _] = blocks(&[Hidden { id, size }], 3);
        let (found, odds, _) = best(&drive);
        assert!(found == id && odds > 20.0, "{id}: {found} {odds}");
    }
}
