//! Properties of the data sets of every rig.

use crate::support::{RIGS, Recording, distance, set};
use softdock_gauntlet::{
    EffectCase, Error, Hidden, NoiseColour, Rig, Stronger, effects, exact, fresh, further, generate, outside,
};
use softdock_test_size::sized;

const DRIVE: Rig = Rig::Drive { link_encoder: false };

/// Every effect of a rig.
fn cases(rig: Rig) -> impl Iterator<Item = &'static EffectCase> {
    effects(rig).iter().chain(outside(rig))
}

/// Every effect of a rig at its plausible size.
fn every(rig: Rig) -> impl Iterator<Item = Hidden> {
    cases(rig).map(|case| Hidden { id: case.id, size: case.size })
}

#[test]
fn same_seed_gives_same_bytes_and_another_seed_others() {
    for &rig in RIGS {
        let first = every(rig).next().expect("an effect");
        assert_eq!(set(rig, &[first], 3), set(rig, &[first], 3));
        let (one, other) = (set(rig, &[], 3), set(rig, &[], 4));
        assert_ne!(one.truth.nuisances, other.truth.nuisances);
        assert!(one.logs.iter().zip(&other.logs).all(|(one, other)| one.0 == other.0 && one.1 != other.1));
    }
}

#[test]
fn a_null_set_hides_nothing_and_repeats_differ_in_noise_only() {
    for &rig in RIGS {
        let null = set(rig, &[], 11);
        assert!(null.truth.hidden.is_empty());
        let fresh = fresh(rig, &[], 11).expect("a motion");
        assert_eq!(fresh.with_effect, fresh.without_effect);
        assert_eq!(null.logs.len() % 3, 0);
        assert_eq!(null.holdout.len(), 3);
        for (file, text) in null.logs.iter().chain(&null.holdout) {
            assert!(file.ends_with("_1.csv") || file.ends_with("_2.csv") || file.ends_with("_3.csv"), "{file}");
            assert!(Recording::read(text).len() > 500, "{file}");
        }
        assert_ne!(null.logs[0].1, null.logs[1].1);
    }
}

#[test]
fn without_noise_the_same_files_come_and_repeats_are_the_same_but_for_the_clock() {
    for &rig in RIGS {
        let (noisy, exact) = (set(rig, &[], 11), exact(rig, &[], 11).expect("a set"));
        let names = |logs: &[(String, String)]| logs.iter().map(|log| log.0.clone()).collect::<Vec<_>>();
        assert_eq!((names(&noisy.logs), names(&noisy.holdout)), (names(&exact.logs), names(&exact.holdout)));
        assert_eq!((&noisy.truth, &noisy.model), (&exact.truth, &exact.model));
    }
    let exact = exact(DRIVE, &[], 11).expect("a set");
    let [first, second] = [0, 1].map(|place| Recording::read(&exact.logs[place].1));
    for column in ["ref_rad", "q_rad", "tau_nm"] {
        assert_eq!(first.column(column), second.column(column), "{column}");
    }
    assert_ne!(first.column("t_s"), second.column("t_s"));
}

#[test]
fn further_recordings_are_the_same_motions_in_noise_of_their_own() {
    for &rig in RIGS {
        let (set, further) =
            (set(rig, &[], 11), further(rig, &[], NoiseColour::FirstOrder, 11, 2).expect("recordings"));
        assert_eq!((further.holdout.len(), further.fresh.len()), (6, 6));
        let all: Vec<&String> = set.holdout.iter().chain(&further.holdout).map(|file| &file.1).collect();
        assert!((0..all.len()).all(|a| (0..a).all(|b| all[a] != all[b])), "{rig:?}");
        // Each stands for one of the session's, at its time.
        let starts = |files: &[(String, String)]| {
            let mut starts: Vec<f64> = files.iter().map(|file| Recording::read(&file.1).column("t_s")[0]).collect();
            starts.sort_by(f64::total_cmp);
            starts
        };
        assert_eq!(starts(&further.holdout[..3]), starts(&set.holdout), "{rig:?}");
    }
}

#[test]
fn the_log_table_of_the_model_names_the_columns() {
    for &rig in RIGS {
        let set = set(rig, &[], 1);
        let columns = Recording::read(&set.logs[0].1).names().to_vec();
        for name in &columns {
            assert!(set.model.contains(&format!("column = \"{name}\"")), "{rig:?}: {name}");
        }
        assert_eq!(set.model.matches("column = ").count(), columns.len(), "{rig:?}");
    }
}

/// How far a size of an effect moves the truth: the sum over columns of the change's share of the column.
fn change(rig: Rig, id: &'static str, size: f64) -> f64 {
    let fresh = fresh(rig, &[Hidden { id, size }], 5).expect(id);
    let (with, without) = (Recording::read(&fresh.with_effect), Recording::read(&fresh.without_effect));
    let zero = vec![0.0; without.len()];
    let share = |name: &String| {
        let before = without.column(name);
        distance(&with.column(name), &before) / distance(&before, &zero).max(1e-9)
    };
    with.names().iter().map(share).sum()
}

#[test]
fn every_effect_changes_the_truth_and_a_smaller_one_changes_it_less() {
    for &rig in RIGS {
        // In the short check every third effect.
        for case in cases(rig).step_by(sized(3, 1)) {
            let full = change(rig, case.id, case.size);
            assert!(full.is_finite() && full > 1e-6, "{}: {full}", case.id);
            let weaker = match case.stronger {
                Stronger::Larger => (case.size / 50.0).max(case.smallest),
                Stronger::Smaller => case.size * 50.0,
            };
            let less = change(rig, case.id, weaker);
            assert!(less < 0.5 * full, "{}: {less} of {full}", case.id);
        }
    }
}

#[test]
fn every_effect_accepts_its_range_and_a_partner() {
    for &rig in RIGS {
        let all: Vec<Hidden> = every(rig).collect();
        for (i, case) in cases(rig).enumerate().step_by(sized(3, 1)) {
            let smallest = Some(case.smallest).filter(|smallest| *smallest > 0.0);
            for size in smallest.into_iter().chain([case.largest.min(1000.0 * case.size)]) {
                let pair = [Hidden { id: case.id, size }, all[(i + 1) % all.len()]];
                let text = fresh(rig, &pair, 2).expect("a motion").with_effect;
                assert!(!text.contains("NaN") && !text.contains("inf"), "{} of {size}", case.id);
            }
        }
    }
}

#[test]
fn rigs_accept_the_effects_of_the_catalogue() {
    let short =
        |rig: Rig| effects(rig).iter().map(|case| case.id.split('_').next().expect("a number")).collect::<Vec<_>>();
    let numbers = |letter: char, range: std::ops::RangeInclusive<u32>| range.map(move |i| format!("{letter}{i}"));
    assert!(numbers('J', 1..=18).all(|id| short(DRIVE).contains(&&id[..])));
    assert!(numbers('C', 1..=7).all(|id| short(Rig::Command).contains(&&id[..])));
    assert!(numbers('S', 1..=8).all(|id| short(Rig::Sensor).contains(&&id[..])));
    assert!(numbers('K', 1..=10).all(|id| short(Rig::Contact).contains(&&id[..])));
    assert!(numbers('P', 1..=3).all(|id| short(Rig::Body).contains(&&id[..])));
    assert!(["C1", "C2", "C5", "C6", "C7"].iter().all(|id| short(DRIVE).contains(id)));
    for &rig in RIGS {
        assert!(!outside(rig).is_empty());
        let ids: std::collections::BTreeSet<&str> = cases(rig).map(|case| case.id).collect();
        assert_eq!(ids.len(), cases(rig).count(), "{rig:?}");
    }
}

#[test]
fn noise_has_the_colour_asked_for() {
    for &rig in RIGS {
        let logs = NoiseColour::ALL.map(|colour| generate(rig, &[], colour, 1).expect("a set").logs);
        assert!(logs[0] != logs[1] && logs[1] != logs[2] && logs[0] != logs[2], "{rig:?}");
    }
}

#[test]
fn bad_request_reports_the_error() {
    let ask = |hidden: &[Hidden]| generate(DRIVE, hidden, NoiseColour::White, 0).expect_err("an error");
    let known = Hidden { id: "J1_coulomb", size: 2.0 };
    assert!(matches!(ask(&[Hidden { id: "J1", size: 2.0 }]), Error::UnknownEffect { .. }));
    assert!(ask(&[Hidden { id: "J1", size: 2.0 }]).to_string().contains("J1_coulomb"));
    assert_eq!(ask(&[known, known]), Error::Repeated { id: "J1_coulomb" });
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(ask(&[Hidden { size, ..known }]).to_string().contains("8e1 N m"), "{size}");
    }
    assert!(matches!(ask(&[Hidden { id: "J8_elasticity", size: 1e-10 }]), Error::Size { .. }));
}

#[test]
fn truth_is_not_written_to_the_folder() {
    let folder = std::env::temp_dir().join(format!("gauntlet-{}", std::process::id()));
    let set = set(DRIVE, &[Hidden { id: "J7_backlash", size: 0.0005 }], 8);
    set.write(&folder).expect("a folder");
    let mut files: Vec<String> = ["", "training", "holdout"]
        .iter()
        .flat_map(|part| std::fs::read_dir(folder.join(part)).expect("a folder"))
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    files.sort();
    std::fs::remove_dir_all(&folder).expect("a folder");
    let recordings = set.logs.len() + set.holdout.len();
    assert_eq!(files.len(), recordings + 3, "{files:?}");
    assert!(!set.model.contains("backlash"));
    assert!(set.truth.hidden[0].parameters.iter().any(|parameter| parameter.name == "half_gap"));
}
