//! Whole facility with a hidden effect: diagnosis of its drives, extended model, and the campaign's verdicts.

use serde_json::{Value, json};
use softdock_campaign::{Scenario, load};
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::frame::facility::{Readings, readings};
use softdock_kernels::frame::single::emulated_facility;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Parts;
use softdock_test_size::sized;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use tempfile::TempDir;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Part A goes from rest into part B and out again, aside as it goes.
fn commanded(start: &Parts<f64>, tick: usize) -> Parts<f64> {
    let time = tick as f64 * 1e-3;
    let (mut commanded, omega) = (*start, 3.0);
    let way = 0.12 * (1.0 - (omega * time).cos());
    commanded.a.position.x += way;
    commanded.a.position.y += 0.2 * way;
    commanded.a.velocity.x = 0.12 * omega * (omega * time).sin();
    commanded.a.velocity.y = 0.2 * commanded.a.velocity.x;
    commanded
}

#[test]
fn standalone_facility_is_bit_identical_to_the_emulated_one() {
    let campaign = load(&root().join("campaigns/probe_drogue.toml")).expect("it loads");
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let quiet = |run: u64| {
        let mut params = campaign.draw(run).expect("a draw").params;
        (params.delay_jitter, params.sensor_noise_force, params.sensor_noise_moment) = (0.0, 0.0, 0.0);
        params
    };
    let sets: Vec<_> = (0..9).map(quiet).collect();
    let rows: Vec<Parts<f64>> = (0..1500).map(|tick: usize| commanded(&plant.start, tick.saturating_sub(1))).collect();
    let recorded = Recorded {
        step: 1e-3,
        instants: rows.len(),
        stride: 1,
        inputs: rows.iter().flat_map(to_vec::<f64, _>).collect(),
        late: Vec::new(),
        offsets: Vec::new(),
    };
    let all: Vec<Vec<f64>> = sets.iter().map(to_vec).collect();
    let alone = Section::Facility(Arc::clone(&plant)).simulate(&[&recorded], &all, &Decimator::none()).remove(0);
    let width = fields::<f64, Readings<f64>>().len();
    let mut touched = false;
    for (run, (params, alone)) in sets.iter().zip(&alone).enumerate() {
        let mut facility = emulated_facility(&plant, [0; 2], run as u64, params);
        facility.stand(&rows[0]);
        for (row, commanded) in rows.iter().enumerate().skip(1) {
            let measured = facility.tick(commanded);
            let emulated = to_vec(&readings(&plant.start, &measured.parts, measured.wrench));
            touched |= measured.wrench.force.norm() > 20.0;
            assert_eq!(alone[row * width..][..width], emulated[..], "run {run}, tick {row}");
        }
    }
    assert!(touched, "the parts touch");
}

/// Runs a command that must succeed and returns its output.
fn softdock(words: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    let output = command.current_dir(root()).args(words.split_whitespace()).output().expect("softdock starts");
    let printed = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    // A drive that fails the task ends with 1, and a stopped one with 3; its log exists in both cases.
    let codes = if words.starts_with("drive") { &[0, 1, 3][..] } else { &[0] };
    assert!(output.status.code().is_some_and(|code| codes.contains(&code)), "softdock {words}\n{printed}");
    printed
}

/// Folder with a hidden effect, its drives and diagnoses.
struct Secret {
    folder: TempDir,
}

impl Secret {
    fn of(set: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("secret.toml"), format!("schema = \"effects/1\"\n[set]\n{set}\n"))
            .expect("writable");
        Self { folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// Drives a run, by its number or by an experiment, and returns its log.
    fn driven(&self, run: &str, name: &str) -> String {
        let (effects, out) = (self.path("secret.toml"), self.path(name));
        softdock(&format!(
            "drive campaigns/probe_drogue.toml {run} --virtual --no-band --priority 0 --effects {effects} --out {out}"
        ));
        format!("{out}/log.parquet")
    }

    /// Returns the diagnosis of logs.
    fn answer(&self, logs: &str) -> Value {
        let out = self.path("answer");
        softdock(&format!("diagnose campaigns/probe_drogue.toml {logs} --out {out}"));
        let text = std::fs::read_to_string(format!("{out}/diagnosis.json")).expect("an answer");
        serde_json::from_str(&text).expect("JSON")
    }

    /// Returns the diagnosis of three drives; of two in the short check.
    fn diagnosed(&self) -> Value {
        // The last one is held out.
        let runs = sized(&[3, 40][..], &[3, 11, 40]);
        let logs: Vec<String> = runs.iter().map(|run| self.driven(&format!("--run {run}"), &run.to_string())).collect();
        self.answer(&logs.join(" "))
    }
}

#[test]
fn hidden_robot_lag_is_named_and_extends_the_scenario() {
    let secret = Secret::of("\"facility.robot1.lag\" = \"32 ms\"");
    let answer = secret.diagnosed();
    assert_eq!((&answer["answer"], &answer["provisional"]), (&json!("named"), &json!(true)));
    assert_eq!(answer["effects"][0]["id"], "C2_lag");
    let lag = &answer["effects"][0]["parameters"]["robot1_lag"];
    assert!((lag["value"].as_f64().expect("a number") - 0.032).abs() < 2e-4, "{lag}");
    let other = &answer["effects"][0]["parameters"]["robot2_lag"]["value"];
    assert!((other.as_f64().expect("a number") - 0.02673).abs() < 2e-4, "the other robot is as it should be: {other}");
    let extended = secret.path("answer/extended.toml");
    let scenario = Scenario::load(Path::new(&extended)).expect("a scenario");
    assert!((scenario.model.nominal.robot1_lag - 0.032).abs() < 2e-4);
    assert!(scenario.identified[0].is_uncertain(), "with its covariance");
    softdock(&format!("check campaigns/probe_drogue.toml --model {extended} --runs 10"));
    secret.driven(&format!("--run 3 --model {extended}"), "again");
    let printed = softdock(&format!("replay --log {}", secret.path("again/log.mcap")));
    assert!(printed.contains("equal, bit for bit"), "{printed}");
}

/// No effect is hidden: the robots move with the step of the scenario, and a converged step would differ.
#[test]
fn facility_without_hidden_effects_gives_no_effect() {
    let answer = Secret::of("\"facility.robot1.lag\" = \"26.73 ms\"").diagnosed();
    assert_eq!((&answer["answer"], &answer["effects"]), (&json!("no_effect"), &json!([])), "{answer}");
    for finding in answer["findings"].as_array().expect("a list") {
        let what = finding["what"].as_str().expect("a finding");
        assert!(what.starts_with("simulated with the step of the scenario"), "{what}");
    }
    // What drives never show is listed before the answer, each with the session that shows it.
    let facility = &answer["identifiability"][0];
    assert_eq!(facility["block"], "whole facility");
    for id in ["P1_mass", "C3_jitter", "C4_drops", "S1_bias", "S7_noise", "S9_tare"] {
        let rows = facility["rows"].as_array().expect("a list");
        let row = rows.iter().find(|row| row["id"] == id).unwrap_or_else(|| panic!("no row {id}"));
        assert_eq!((&row["determination"], row["session"].is_string()), (&json!("not"), true), "{row}");
    }
}

/// The drives stop on their way to the start, as the robots do not follow.
#[test]
fn speed_limit_that_stops_every_drive_is_named_from_the_move_to_the_start() {
    let answer = Secret::of("\"facility.max_speed\" = \"25 mm/s\"").diagnosed();
    assert_eq!(
        (&answer["answer"], &answer["effects"][0]["id"]),
        (&json!("named"), &json!("C7_rate_limit")),
        "{answer}"
    );
    let parameters = answer["effects"][0]["parameters"].as_object().expect("a table");
    let speed = parameters["tool_speed_limit"]["value"].as_f64().expect("a number");
    assert!((speed - 0.025).abs() < 2e-4 && parameters.len() == 1, "not the limit of rotation: {parameters:?}");
    let findings = answer["findings"].to_string();
    assert!(findings.contains("the drive ended before its run began"), "{findings}");
    assert!(findings.contains("contact and sensor are not judged"), "{findings}");
}

/// The encoders of the axes do not see the deflection of part B's mount: it is a softer contact, or a gain of the sensor.
#[test]
fn compliant_fixture_is_seen_between_motion_and_wrench_alone() {
    let secret = Secret::of("\"facility.fixture.compliance\" = \"5e-6 m/N\"");
    let logs = [3, 11, 40].map(|run| secret.driven(&format!("--run {run}"), &run.to_string()));
    let answer = secret.answer(&logs.join(" "));
    let block = |name: &str| {
        let blocks = answer["blocks"].as_array().expect("a list");
        blocks.iter().find(|block| block["block"] == name).expect("the block").clone()
    };
    assert_eq!(block("R2 command to motion")["answer"], "no_effect");
    let wrench = block("R5 motion to wrench");
    assert!(["named", "ambiguous"].iter().any(|answer| wrench["answer"] == *answer), "{wrench}");
    let effects = wrench["effects"].as_array().expect("a list");
    assert!(effects.iter().any(|effect| effect["id"] == "K10_fixture"), "{wrench}");
}

/// One training drive, in which the parts slide one way, so that friction is confounded with its direction dependence.
#[test]
fn proposed_run_resolves_an_ambiguous_diagnosis() {
    let secret = Secret::of("\"facility.errors.contact_friction\" = 0.18");
    let [learnt, held_out] = [25, 12].map(|run| secret.driven(&format!("--run {run}"), &run.to_string()));
    let answer = secret.answer(&format!("{learnt} --holdout {held_out}"));
    let mut rivals: Vec<&str> = answer["effects"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|effect| effect["id"].as_str().expect("an id"))
        .collect();
    rivals.sort_unstable();
    assert_eq!(
        (&answer["answer"], &rivals[..]),
        (&json!("ambiguous"), &["K4_friction", "K6_anisotropy"][..]),
        "{answer}"
    );
    assert!(answer["proposed"]["expected_log_odds"].as_f64().expect("a number") > 8.0, "{}", answer["proposed"]);
    let next = secret.driven(&format!("--experiment {}", secret.path("answer/experiment.toml")), "next");
    let sharper = secret.answer(&format!("{learnt} {next} --holdout {held_out}"));
    assert_eq!((&sharper["answer"], sharper["effects"].as_array().map(Vec::len)), (&json!("named"), Some(1)));
    assert_eq!(sharper["effects"][0]["id"], "K4_friction");
    let friction = sharper["effects"][0]["parameters"]["contact_friction_error"]["value"].as_f64().expect("a number");
    assert!((friction / 0.18 - 1.0).abs() < 0.03, "{friction}");
}
