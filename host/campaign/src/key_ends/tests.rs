//! Keys of the scenario in a campaign: values of runs, and what is refused.

use super::*;
use std::path::{Path, PathBuf};

fn campaigns() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns")
}

/// The berthing campaign with these dispersions alone.
fn campaign(dispersions: &str) -> Result<Campaign, Problems> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = campaigns().join("scenarios/berth.toml").canonicalize().expect("the shipped scenario");
    let text = format!(
        "schema = \"campaign/2\"\nid = \"keys\"\ntitle = \"t\"\nseed = 42\nruns = 50\nscenario = {scenario:?}\n{dispersions}"
    );
    let path = folder.path().join("c.toml");
    std::fs::write(&path, text).expect("written");
    Campaign::load(&path)
}

fn dispersion(target: &str, dist: &str) -> String {
    format!("[[dispersion]]\ntarget = \"{target}\"\ndist = {{ {dist} }}\n")
}

#[test]
fn each_run_has_its_values() {
    let text =
        dispersion("scenario.contact.pair[1].stiffness", "kind = \"uniform\", min = \"3 N/mm\", max = \"5 N/mm\"")
            + &dispersion("loop_delay", "kind = \"uniform\", min = \"3 ms\", max = \"5 ms\"")
            + &dispersion("scenario.target.mass", "kind = \"uniform\", min = \"3 t\", max = \"5 t\"");
    let campaign = campaign(&text).unwrap_or_else(|problems| panic!("{problems}"));
    let mut seen = Vec::new();
    for run in 0..campaign.runs {
        let draw = campaign.draw(run).expect("legal");
        let own = draw.own.as_ref().expect("the campaign disperses keys");
        assert_eq!(own.model.contact.pairs[0].properties.stiffness, own.keys[0]);
        assert_eq!(draw.params.target_mass, own.keys[1], "a key that gives a parameter gives it to the run");
        assert!((3e-3..5e-3).contains(&draw.params.loop_delay) && (3000.0..5000.0).contains(&own.keys[0]));
        assert_eq!(draw.inputs()[draw.inputs().len() - 2..], own.keys);
        seen.push(own.keys[0]);
    }
    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
    assert!((mean - 4000.0).abs() < 4.0 * 2000.0 / 12.0_f64.sqrt() / 50.0_f64.sqrt(), "{mean}");
    assert_eq!(campaign.nominal(), campaign.scenario.model.nominal, "the undispersed run is the scenario's");
}

#[test]
fn dispersions_that_contradict_each_other_or_the_scenario_are_refused() {
    let uniform = |target: &str, min: &str, max: &str| {
        dispersion(target, &format!("kind = \"uniform\", min = \"{min}\", max = \"{max}\""))
    };
    let radius = |item: &str| uniform(&format!("scenario.part_b.solid[{item}].radius"), "24 mm", "26 mm");
    let mass = uniform("scenario.target.mass", "3 t", "5 t") + &uniform("target_mass", "3 t", "5 t");
    let normal = dispersion("scenario.latch.depth", "kind = \"normal\", mean = \"3.5 mm\", sigma = \"1 mm\"");
    let unit = uniform("scenario.latch.depth", "3 N", "4 N");
    let deep = uniform("scenario.start.gap", "-200 mm", "100 mm");
    let cases = [
        (radius("bumper") + &radius("3"), "dispersed twice", "remove one"),
        (mass, "gives each run its `target_mass`, which is set in this file too", "remove this dispersion"),
        (normal, "`scenario.latch.depth` reaches -", "truncnormal"),
        (unit, "this is a force, not a length", "write \"3 m\""),
        (deep, "`scenario.start.gap` reaches -0.2 m: ", "narrow the distribution"),
    ];
    for (text, what, remedy) in cases {
        let problems = campaign(&text).expect_err(&text);
        let problem = problems.iter().next().expect("one");
        assert!(problem.message.contains(what) && problem.remedy.contains(remedy), "{problem}; {}", problem.remedy);
    }
}

#[test]
fn robots_and_recordings_have_one_scenario() {
    let text = dispersion("scenario.latch.depth", "kind = \"uniform\", min = \"3 mm\", max = \"4 mm\"");
    let problems = campaign(&text).expect("legal").refuse_for("a session").expect_err("keys");
    assert!(problems.to_string().contains("a session has one scenario"), "{problems}");
    assert!(campaign("").expect("legal").refuse_for("a session").is_ok());
}

#[test]
fn robots_hold_rigid_parts() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/grapple.toml");
    let grapple = crate::load(&path).unwrap_or_else(|problems| panic!("{problems}"));
    let problems = grapple.refuse_for("a session").expect_err("fingers");
    assert!(problems.to_string().contains("a session commands no gripper"), "{problems}");
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/soft_capture.toml");
    let ring = crate::load(&path).unwrap_or_else(|problems| panic!("{problems}"));
    let problems = ring.refuse_for("a session").expect_err("a ring");
    assert!(problems.to_string().contains("a session measures no ring"), "{problems}");
}
