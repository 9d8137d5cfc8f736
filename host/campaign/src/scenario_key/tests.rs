//! Keys of the scenario in a campaign: paths, values, and what is refused.

use super::*;
use crate::campaign::Campaign;
use std::path::{Path, PathBuf};

fn campaigns() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns")
}

fn berth() -> Scenario {
    Scenario::load(&campaigns().join("scenarios/berth.toml")).expect("the shipped scenario")
}

fn find(path: &str) -> Result<ScenarioKey, Fault> {
    ScenarioKey::find(berth().source(), path)
}

#[test]
fn paths_lead_to_numbers_with_their_units() {
    let cases = [
        ("scenario.contact.pair[1].stiffness", "N/m", 4000.0, "in_scenario_contact_pair_1_stiffness_n_per_m"),
        ("scenario.part_b.solid[2].position.y", "m", 0.2, "in_scenario_part_b_solid_2_position_y_m"),
        ("scenario.part_b.solid[2].position[2]", "m", 0.2, "in_scenario_part_b_solid_2_position_2_m"),
        ("scenario.part_b.solid[bumper].radius", "m", 0.025, "in_scenario_part_b_solid_bumper_radius_m"),
        ("scenario.contact.friction", "1", 0.2, "in_scenario_contact_friction"),
        ("scenario.latch.rotation_damping", "N m s/rad", 100.0, "in_scenario_latch_rotation_damping_n_m_s_per_rad"),
        ("scenario.arm.angles[4]", "rad", std::f64::consts::FRAC_PI_2, "in_scenario_arm_angles_4_rad"),
    ];
    for (path, unit, nominal, column) in cases {
        let key = find(path).unwrap_or_else(|(message, _)| panic!("{message}"));
        assert_eq!((key.unit, key.nominal, key.column().as_str()), (unit, nominal, column), "{path}");
    }
}

#[test]
fn wrong_paths_are_named_with_what_to_write() {
    let cases = [
        ("scenario.contact.pair[0].stiffness", "has an item 0", "from 1"),
        ("scenario.contact.pair[3].stiffness", "there is no item 3, the list has 1", "from 1 to 1"),
        ("scenario.contact.pair[1].stifness", "does not write `stifness`", "did you mean `stiffness`?"),
        ("scenario.contact.pair.stiffness", "`stiffness` is asked of a list", "pair[1]"),
        ("scenario.part_b.solid[bumpers].radius", "no item has the name `bumpers`", "did you mean `bumper`?"),
        ("scenario.contact.pair[soft].stiffness", "no item has the name `soft`", "write a number"),
        ("scenario.part_b.solid[2].position", "is a list", "position[1], or .x, .y, .z"),
        ("scenario.latch", "is a table", "name a key of it"),
        ("scenario.contact.law", "is no number", "needs a variant"),
        ("scenario.latch.depth.x", "the value before `x` has no keys", "end the path"),
        ("scenario.latch[1]", "is no list", "remove the brackets"),
        ("scenario.", "is no path", "scenario.contact.pair[1].stiffness"),
        ("scenario.latch[", "is no path", "scenario.contact.pair[1].stiffness"),
        ("scenario.task.max_time", "cannot vary from run to run", "disperse another key"),
        ("scenario.timing.time_limit", "cannot vary from run to run", "disperse another key"),
    ];
    for (path, what, remedy) in cases {
        let (message, advice) = find(path).expect_err(path);
        assert!(message.contains(what) && advice.contains(remedy), "{path}: {message}; {advice}");
    }
}

#[test]
fn values_reach_the_model_and_nothing_else_changes() {
    let (scenario, paths) = (berth(), ["scenario.contact.pair[1].stiffness", "scenario.part_b.solid[bumper].radius"]);
    let [stiffness, radius] = paths.map(|path| find(path).expect(path));
    let other = scenario.with_keys(&[(&stiffness, 4321.0), (&radius, 0.0249)]).expect("legal");
    let mut expected = scenario.model.clone();
    expected.contact.pairs[0].properties.stiffness = 4321.0;
    let solids = &mut expected.contact.b.solids;
    solids[1..].iter_mut().for_each(|solid| solid.shape = softdock_kernels::model::Shape::Sphere { radius: 0.0249 });
    // The bristle of a pair has a default that follows its stiffness.
    let bristle = other.model.contact.pairs[0].properties;
    assert!(bristle.bristle_stiffness > expected.contact.pairs[0].properties.bristle_stiffness);
    expected.contact.pairs[0].properties = softdock_kernels::material::Pair { stiffness: 4321.0, ..bristle };
    assert_eq!(other.model, expected);
    assert_eq!(scenario.with_keys(&[(&stiffness, stiffness.nominal)]).expect("legal").model, scenario.model);
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
    let problems = campaign(&text).expect("legal").refuse_keys("a session").expect_err("keys");
    assert!(problems.to_string().contains("a session has one scenario"), "{problems}");
    assert!(campaign("").expect("legal").refuse_keys("a session").is_ok());
}
