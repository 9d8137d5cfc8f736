//! Keys of a scenario: paths and values.

use super::*;
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
