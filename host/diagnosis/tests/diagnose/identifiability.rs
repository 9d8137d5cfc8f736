//! Identifiability before the fit: it never contradicts what is named, and a motion that moves nothing determines nothing.

use super::bench::{Bench, Kind};
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions};
use softdock_diagnosis::inference::identifiability::{BlockIdentifiability, Determination};
use softdock_gauntlet::NoiseColour;
use softdock_test_size::first;
use std::collections::BTreeSet;

/// Catalogue ids of a block none of whose forms is determined.
fn undetermined(block: &BlockIdentifiability) -> BTreeSet<&'static str> {
    let of = |is: bool| {
        let rows = block.rows.iter().filter(move |row| (row.determination == Determination::Determined) == is);
        rows.filter_map(|row| row.id).collect::<BTreeSet<_>>()
    };
    &of(false) - &of(true)
}

/// Asserts that answers and identifiability agree, block by block.
fn assert_agree(diagnosis: &Diagnosis) {
    assert!(!diagnosis.identifiability.is_empty());
    for answer in &diagnosis.blocks {
        let named: BTreeSet<&str> = answer.effects.iter().map(|effect| effect.id).collect();
        let hidden: BTreeSet<&str> = answer.not_visible.iter().map(|effect| effect.id).collect();
        assert!(named.is_disjoint(&hidden), "{}: {named:?} {hidden:?}", answer.block);
        assert_eq!(answer.not_visible.len(), hidden.len(), "{}: an effect twice", answer.block);
        let block = diagnosis.identifiability.iter().find(|own| own.block == answer.block).expect("a table");
        assert_eq!(undetermined(block), hidden, "{}", answer.block);
        assert!(undetermined(block).is_disjoint(&named), "{}: {named:?}", answer.block);
        for pair in &block.confounded {
            assert!(pair.correlation > 0.9 && pair.correlation <= 1.0 && pair.rows[0] != pair.rows[1], "{pair:?}");
        }
    }
}

/// Kind of a bench, hidden effects with their sizes, seed.
type Case = (Kind, &'static [(&'static str, f64)], u64);

#[test]
fn named_effects_are_determined() {
    let drive = Kind::Drive { link_encoder: false };
    let cases: [Case; 6] = [
        // Coulomb friction is a nuisance parameter of the drive as well.
        (drive, &[("J1_coulomb", 9.5), ("J11_torque_constant", 0.08)], 275_533_025),
        (drive, &[], 1),
        (Kind::Sensor, &[("S3_gain", 0.05)], 3),
        (drive, &[("J14_payload", 1.5)], 3),
        (Kind::Contact, &[("K1_stiffness", 0.3)], 2),
        (drive, &[("C2_lag", 0.004)], 9),
    ];
    for (kind, hidden, seed) in first(3, cases) {
        let bench = Bench::of(kind, NoiseColour::FirstOrder, hidden, seed);
        let mut prepared = bench.prepared(&DiagnosisOptions::default()).expect("good recordings");
        let before = prepared.identifiability().to_vec();
        let diagnosis = prepared.diagnose().expect("a motion that shows something").0;
        assert_agree(&diagnosis);
        // What was stated before the answer differs only for what was named or withheld.
        for (before, after) in before.iter().zip(&diagnosis.identifiability) {
            for (was, is) in before.rows.iter().zip(&after.rows) {
                let is_named = diagnosis.effects.iter().any(|effect| Some(effect.id) == was.id);
                let answer = diagnosis.blocks.iter().find(|answer| answer.block == after.block).expect("an answer");
                let is_same = was == is || is_named || answer.effects.iter().any(|effect| Some(effect.id) == was.id);
                assert!(is_same || is.determination == Determination::Not, "{was:?} {is:?}");
            }
        }
    }
}

/// Returns how well the recordings of a drive determine an effect or a parameter, by its id or its name.
fn determination(bench: &Bench, key: &str) -> Determination {
    let mut prepared = bench.prepared(&DiagnosisOptions::default()).expect("good recordings");
    let blocks = prepared.identifiability();
    let block = blocks.iter().find(|block| block.block == "R3 torque to motion").expect("a drive");
    block.rows.iter().find(|row| row.key() == key).expect("a row").determination
}

#[test]
fn motion_that_holds_an_axis_still_does_not_determine_its_friction() {
    let moving = Bench::drive(&[], 1);
    let still = Bench::drive(&[], 1).with_recordings(held);
    for key in ["J1_coulomb", "J2_viscous"] {
        assert_eq!(determination(&moving, key), Determination::Determined, "{key} while it moves");
        assert!(determination(&still, key) < Determination::Determined, "{key} while it is held");
    }
}

/// The recording of an axis that is held at its first angle: the encoder flickers between two steps.
fn held(text: &str) -> String {
    let mut lines = text.lines();
    let header = lines.next().expect("a header");
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    let first = &rows[0];
    let held = rows.iter().map(|row| {
        // The digits of the torque are noise of their own in each repeat.
        let noise = (row[3] * 7.3).sin();
        let angle = first[2] + if noise > 0.0 { 8e-6 } else { 0.0 };
        format!("{},{},{angle:.7},{}\n", row[0], first[1] + 1e-9 * noise, first[3] + 0.5 * noise)
    });
    format!("{header}\n{}", held.collect::<String>())
}
