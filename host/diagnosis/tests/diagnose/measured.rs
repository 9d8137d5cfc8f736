//! Measured data that nobody in this project made; their folder is in `SOFTDOCK_DATA`.

use softdock_analysis::PageOrigin;
use softdock_campaign::Rig;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, prepare};
use softdock_diagnosis::report::page::page;
use softdock_diagnosis::report::summary::DiagnosisSummary;
use softdock_diagnosis::verdict::answer::{BlockAnswer, DiagnosisVerdict};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

fn data(file: &str) -> PathBuf {
    let folder = std::env::var("SOFTDOCK_DATA").expect("SOFTDOCK_DATA: the folder of the measured data");
    Path::new(&folder).join(file)
}

fn shipped(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/rigs").join(file)
}

/// EMPS known by its mass and viscous friction alone: Coulomb friction and offset are missing (Janot, Gautier and Brunot
/// 2019: 20.3935 N, -3.1648 N).
#[test]
#[ignore = "needs SOFTDOCK_DATA"]
fn emps_lacks_coulomb_friction_and_an_offset() {
    let rig = Rig::load(&shipped("emps.toml")).expect("a legal model");
    let options = DiagnosisOptions { hold_out_from: Some(6.21), ..DiagnosisOptions::default() };
    let prepared = prepare(rig, &[&data("emps/emps_train.csv")], &[], &options).expect("good recordings");
    let diagnosis = prepared.diagnose().expect("a motion that shows something").0;
    let mut found: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
    found.sort_unstable();
    assert_eq!((diagnosis.answer, diagnosis.provisional), (DiagnosisVerdict::Named, true));
    assert_eq!(found, ["J18_drive_offset", "J1_coulomb"]);
    let of = |id: &str, name: &str| {
        let effect = diagnosis.effects.iter().find(|effect| effect.id == id).expect("named above");
        effect.parameters[name].value
    };
    let coulomb = of("J1_coulomb", "coulomb");
    assert!((coulomb / 20.3935 - 1.0).abs() < 0.03, "{coulomb}");
    let offset = of("J18_drive_offset", "offset");
    assert!((offset + 3.1648).abs() < 0.3, "{offset}");
    // The published model leaves 3.5 to 3.6 %, by the data's own description.
    let error = diagnosis.blocks.iter().find_map(|block| block.torque_error).expect("a drive");
    assert!(error.before > 0.18 && error.after < 0.037, "{error:?}");
}

/// Diagnosis of a KUKA KR 300 with its page.
static KUKA: LazyLock<(Diagnosis, String)> = LazyLock::new(|| {
    let rig = Rig::load(&shipped("kr300.toml")).expect("a legal model");
    let log =
        |file: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/kuka-kr300-recordings").join(file);
    let prepared = prepare(rig, &[&log("traj_A.csv")], &[&log("traj_B.csv")], &DiagnosisOptions::default());
    let (diagnosis, judged) = prepared.expect("good recordings").diagnose().expect("motions that show something");
    let page = page("robot", &diagnosis, &judged, &PageOrigin::default(), None).expect("figures");
    (diagnosis, page)
});

/// Greatest size of the page of a robot with six axes [B].
const LARGEST_PAGE: usize = 3_000_000;

#[test]
fn page_of_a_robot_is_small_and_explains_its_ids() {
    let (diagnosis, page) = &*KUKA;
    assert!(page.len() < LARGEST_PAGE, "{} bytes", page.len());
    for axis in 1..=6 {
        assert!(page.contains(&format!("<td class=\"nw\">Axis {axis}</td>")), "axis {axis} is in a table");
    }
    let summary = DiagnosisSummary::of(diagnosis);
    assert!(page.contains("<h1>") && !summary.headline.contains("probability 1"), "{}", summary.headline);
    let with_finding = diagnosis.blocks.iter().filter(|block| block.answer >= DiagnosisVerdict::NoPracticalEffect);
    assert!(with_finding.count() < diagnosis.blocks.len() && page.contains("link encoder: latency"));
    // Amplitudes of noise-free bands are not drawn.
    assert!(!page.contains("e-14") && !page.contains("e-15"), "an axis goes down to roundings");
}

/// Without repeats the residual is the only estimate of the noise, and never larger than it: the axis as a single drive
/// misses two fifths of the torque.
#[test]
fn large_torque_error_is_not_taken_for_noise() {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench/rigs/kr300_axis4.toml");
    let log =
        |file: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/kuka-kr300-recordings").join(file);
    let rig = Rig::load(&rig).expect("a legal model");
    let prepared = prepare(rig, &[&log("traj_A.csv")], &[&log("traj_B.csv")], &DiagnosisOptions::default());
    let axis = prepared.expect("good recordings").diagnose().expect("a motion that shows something").0;
    assert_eq!(axis.answer, DiagnosisVerdict::ModelInadequate);
    let reason = axis.blocks.iter().flat_map(|block| &block.inadequate).next().expect("a reason");
    assert!(reason.contains("% of the torque, and without repeats"), "{reason}");
    for block in axis.blocks.iter().chain(&KUKA.0.blocks) {
        let finds_nothing = matches!(block.answer, DiagnosisVerdict::NoEffect | DiagnosisVerdict::NoPracticalEffect);
        let error = block.torque_error.map_or(0.0, |error| error.after);
        assert!(!finds_nothing || error <= 0.2, "{}: {error}", block.block);
    }
}

/// A KUKA KR 300 of which an identification knows links, rotors and friction: its second encoders are read three
/// milliseconds late (Weigand 2021; a straight line through their differences says 3.0 to 3.1 ms).
#[test]
fn second_encoders_of_a_robot_are_late() {
    let diagnosis = &KUKA.0;
    let axes: Vec<&BlockAnswer> = diagnosis.blocks.iter().filter(|block| block.block.contains(", axis ")).collect();
    assert!(diagnosis.provisional && axes.len() == 6 && diagnosis.blocks.len() == 7);
    // Axis 1 has no other error; the model of axis 3 lacks more than its library has.
    let late = |block: &BlockAnswer| {
        let named = block.effects.iter().map(|effect| (effect.id, &effect.parameters));
        let terms = block.form.iter().flat_map(|form| &form.terms).map(|term| (term.id, &term.parameters));
        let mut all = named.chain(terms);
        all.find(|(id, _)| *id == "J20_encoder_delay").map(|(_, parameters)| parameters["link_age"].value)
    };
    for axis in [0, 2] {
        let block = axes[axis];
        let age = late(block).unwrap_or_else(|| panic!("{}: {:?} {:?}", block.block, block.answer, block.effects));
        assert!((age - 3.05e-3).abs() < 0.3e-3, "{}: {age}", block.block);
        assert!(block.gain.expect("another motion").value > 0.15, "{}", block.block);
    }
    for block in axes {
        let error = block.torque_error.expect("a drive");
        assert!(error.after <= 1.1 * error.before, "{}: {error:?}", block.block);
        let inertia = block.effects.iter().find_map(|effect| effect.parameters.get("inertia_error"));
        assert!(inertia.is_none_or(|inertia| inertia.value.abs() < 800.0), "the robot weighs 1.1 t: {inertia:?}");
    }
}

/// Cubes tossed onto a board, in the tree and outside it (Pfrommer, Halm and Posa 2020).
fn tossed(log: &Path) -> Diagnosis {
    let rig = Rig::load(&shipped("cube_toss.toml")).expect("a legal model");
    let options = DiagnosisOptions { hold_out_experiments: "4:1".parse().ok(), ..DiagnosisOptions::default() };
    let diagnosis = prepare(rig, &[log], &[], &options).expect("good recordings").diagnose().expect("tosses").0;
    assert!(diagnosis.provisional && diagnosis.reasons.len() == 1 && diagnosis.reasons[0].starts_with("no repeats"));
    diagnosis
}

/// 32 of the tosses: the sharp cube of the nominal constants is what explains least.
#[test]
fn cube_has_round_corners_and_another_inertia() {
    let diagnosis = tossed(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cube-tosses/tosses.csv"));
    let block = &diagnosis.blocks[0];
    let run = block.free_run.as_ref().expect("tosses that rebound and rest");
    assert_eq!((run.tosses, run.held_out), ([8, 8], true));
    let radius =
        &run.with.iter().find(|effect| effect.id == "K11_shape").expect("round corners").parameters["corner_radius"];
    assert!(radius.lo > 2e-3 && radius.hi < 5e-3, "{radius:?}");
    assert!(block.residual.after < 0.5 * block.residual.before, "{:?}", block.residual);
    assert!(run.rebound_velocity.after.value < 0.8 * run.rebound_velocity.before.value, "{run:?}");
}

/// All tosses: restitution, shape and mass are not those of the nominal constants, and knowing them helps free runs.
#[test]
#[ignore = "needs SOFTDOCK_DATA; full size, minutes"]
fn extended_model_reduces_free_run_errors_of_the_cube() {
    let diagnosis = tossed(&data("cube-tosses/tosses.csv"));
    let mut found: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
    found.sort_unstable();
    assert_eq!((diagnosis.answer, found), (DiagnosisVerdict::Named, vec!["K11_shape", "K3_damping", "P1_mass"]));
    let run = diagnosis.blocks[0].free_run.as_ref().expect("tosses that rebound and rest");
    assert_eq!(run.tosses, [114, 114]);
    assert!(run.rebound_velocity.before.lo > 0.15 && run.rebound_velocity.after.hi < 0.07, "{run:?}");
    assert!(run.rebound_speed.gain.lo > 0.0 && run.rest_position.gain.lo > 0.0, "{run:?}");
}

/// One speedj command: its flag stands from row 251 on, the target's rate from row 253 on, the motion's from row 254 on,
/// every 8 ms; the PC's clock runs 8.1205 ms a row.
#[test]
#[ignore = "needs SOFTDOCK_DATA"]
fn robot_arm_has_two_delays_and_a_clock_skew() {
    let rig = Rig::load(&shipped("ur_servo.toml")).expect("a legal model");
    let log = data("ur-servo/delay_log.csv");
    let prepared = prepare(rig, &[&log], &[], &DiagnosisOptions::default()).expect("a good recording");
    let diagnosis = prepared.diagnose().expect("an event").0;
    assert!(diagnosis.provisional && diagnosis.reasons[0].starts_with("one event"), "{:?}", diagnosis.reasons);
    let of = |block: usize, name: &str| {
        let estimate = &diagnosis.blocks[block].effects[0].parameters[name];
        [estimate.value, estimate.lo, estimate.hi]
    };
    let near = |a: [f64; 3], b: [f64; 3], allowed: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < allowed);
    assert!(near(of(0, "delay"), [0.016, 0.008, 0.024], 1e-6), "{:?}", of(0, "delay"));
    assert!(near(of(1, "delay"), [0.024, 0.016, 0.032], 1e-6), "{:?}", of(1, "delay"));
    assert!(near(of(2, "clock_skew"), [0.01506; 3], 2e-4), "{:?}", of(2, "clock_skew"));
}

/// Servos of a hobby arm by commands and positions alone: lag, dead band or limits learned on four motions explain most
/// of the error of an ideal servo on the fifth.
#[test]
#[ignore = "needs SOFTDOCK_DATA"]
fn servos_follow_with_lag_and_dead_band() {
    let learned = ["multisine", "friction_gravity", "prbs_excitation", "hold_under_gravity"];
    let folder = tempfile::tempdir().expect("a folder");
    let mut gains = Vec::new();
    for joint in 1..=6 {
        let file = folder.path().join("rig.toml");
        let text = format!(
            "schema = \"rig/1\"\nkind = \"command\"\nid = \"so101\"\n\
             [command]\nperiod = \"20.06 ms\"\nreceived = \"position\"\n\
             [log]\n\"t\" = {{ column = \"time_us\", unit = \"us\" }}\n\
             \"sent\" = {{ column = \"command_rad_{joint}\", unit = \"rad\" }}\n\
             \"received\" = {{ column = \"position_rad_{joint}\", unit = \"rad\" }}\n"
        );
        std::fs::write(&file, text).expect("writable");
        let logs = learned.map(|motion| data(&format!("so101/{motion}.csv")));
        let logs: Vec<&Path> = logs.iter().map(PathBuf::as_path).collect();
        let held_out = data("so101/chirp_sweep.csv");
        let rig = Rig::load(&file).expect("a legal model");
        let prepared = prepare(rig, &logs, &[&held_out], &DiagnosisOptions::default()).expect("good recordings");
        let diagnosis = prepared.diagnose().expect("motions that show something").0;
        let found: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
        assert_eq!(diagnosis.answer, DiagnosisVerdict::Named, "joint {joint}: {found:?}");
        assert!(
            found.iter().any(|id| ["C2_lag", "C8_dead_band"].contains(id)) && !found.contains(&"C5_clock_skew"),
            "joint {joint}: {found:?}"
        );
        gains.push(diagnosis.gain.expect("another motion").value);
    }
    assert!(gains.iter().filter(|gain| **gain > 0.5).count() >= 5 && gains.iter().all(|gain| *gain > 0.3), "{gains:?}");
}
