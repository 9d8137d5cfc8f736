//! The shipped facility with its workspace guard, and spoiled copies of it.

use super::*;
use crate::problem::Problem;
use crate::scenario::Scenario;
use softdock_kernels::plant::Plant;
use softdock_kernels::session::axes_asked;
use softdock_kernels::vector::vec3;
use std::path::PathBuf;

fn shipped(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns").join(file)
}

/// A box beside that of the shipped facility.
const FENCE: &str = "[[safety.keep_out]]\nname = \"fence\"\nmin = [\"-6 m\", \"2.5 m\", \"-1 m\"]\nmax = [\"6 m\", \"2.6 m\", \"2 m\"]\n";

/// The shipped facility with a second box.
fn text() -> String {
    std::fs::read_to_string(shipped("facilities/reference.toml")).expect("the shipped facility") + FENCE
}

fn read(text: &str) -> Result<Station, Vec<Problem>> {
    let source = Source::new(shipped("facilities/reference.toml"), text.to_owned());
    Station::from_source(source).map_err(|problems| problems.into_iter().collect())
}

#[test]
fn rules_of_the_workspace_are_off_unless_they_are_written() {
    let rules = read(&text()).expect("valid").rules;
    assert!(rules.tool_speed.is_finite() && rules.arm_distance.is_finite() && rules.singularity.is_finite());
    assert!(!rules.keep_out.is_empty());
    let text = text();
    let guard = text.find("tool_speed =").expect("the guard is written last");
    let off = read(&text[..guard]).expect("valid without it").rules;
    let none = SessionRules::NONE;
    assert_eq!(
        (off.tool_speed, off.arm_distance, off.singularity),
        (none.tool_speed, none.arm_distance, none.singularity)
    );
    assert_eq!(off.keep_out, none.keep_out);
    assert_eq!(off.clamp_time, rules.clamp_time);
}

#[test]
fn a_box_is_written_by_corners_or_by_centre_and_size() {
    let mut text = text();
    text += "[[safety.keep_out]]\nname = \"post\"\ncentre = [\"1 m\", \"0 m\", \"0 m\"]\nsize = [\"20 cm\", \"40 cm\", \"2 m\"]\n\
             rotation = [\"0 deg\", \"0 deg\", \"90 deg\"]\n";
    let boxes = read(&text).expect("valid").rules.keep_out;
    let names: Vec<&str> = boxes.iter().map(|keep_out| keep_out.name.as_str()).collect();
    assert_eq!(names, ["floor", "fence", "post"]);
    assert!((boxes[0].frame.position.z + boxes[0].half.z + 0.95).abs() < 1e-12, "the floor's upper face");
    let along = boxes[2].frame.attitude.rotate(vec3(boxes[2].half.x, 0.0, 0.0));
    assert!((along - vec3(0.0, 0.1, 0.0)).norm() < 1e-12, "{along:?}");
}

#[test]
fn spoiled_guards_name_the_place() {
    let text = text();
    let keep_out =
        |keys: &str| format!("[[safety.keep_out]]\nname = \"post\"\n{keys}\n[[safety.keep_out]]\nname = \"fence\"");
    let fence = "[[safety.keep_out]]\nname = \"fence\"";
    let unplaced = keep_out("min = [\"0 m\", \"0 m\", \"0 m\"]");
    let twice = keep_out(
        "min = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"1 m\", \"1 m\", \"1 m\"]\nsize = [\"1 m\", \"1 m\", \"1 m\"]",
    );
    let flat = keep_out("min = [\"0 m\", \"0 m\", \"0 m\"]\nmax = [\"1 m\", \"0 m\", \"1 m\"]");
    let many = (0..3).map(|i| {
        keep_out("centre = [\"0 m\", \"9 m\", \"0 m\"]\nsize = [\"1 m\", \"1 m\", \"1 m\"]")
            .replace("post", &format!("post{i}"))
    });
    let many = many.map(|text| text.replace(fence, "")).collect::<String>() + fence;
    let cases: Vec<(&str, &str, &str, &str, &str)> = vec![
        ("tool_speed = \"0.5 m/s\"", "tool_speed = \"0 m/s\"", "safety.tool_speed", "out of range", "above 0 m/s"),
        ("tool_speed = \"0.5 m/s\"", "tool_speed = 0.5", "safety.tool_speed", "needs its unit", "0.5 m/s"),
        ("arm_distance = \"50 mm\"", "arm_distance = \"-5 mm\"", "safety.arm_distance", "out of range", "at least 0 m"),
        ("singularity = \"5 deg\"", "singularity = \"100 deg\"", "safety.singularity", "out of range", "at most"),
        ("tool_radius = \"0.2 m\"", "tool_radius = \"0.2 s\"", "robot2.tool_radius", "a time, not a length", "m"),
        ("name = \"fence\"", "name = \"floor\"", "safety.keep_out[2].name", "two keep-out boxes", "rename"),
        ("name = \"fence\"", "name = \"a/b\"", "safety.keep_out[2].name", "cannot be a name", "letters"),
        (fence, &unplaced, "safety.keep_out[2]", "needs its place exactly once", "min and max, or centre and size"),
        (fence, &twice, "safety.keep_out[2]", "needs its place exactly once", "min and max, or centre and size"),
        (fence, &flat, "safety.keep_out[2].max", "not beyond `min`", "greater max"),
        (fence, &many, "safety.keep_out[5]", "5 keep-out boxes", "unite"),
        (
            "robot = \"../models/kr300_r2500.toml\"",
            "robot = \"../models/kr300_identified.toml\"",
            "safety.arm_distance",
            "has no capsules",
            "add a [[capsule]]",
        ),
    ];
    for (old, new, key, message, remedy) in cases {
        assert!(text.contains(old), "{old}");
        let problems = read(&text.replacen(old, new, 1)).expect_err(new);
        let found = problems.iter().find(|problem| problem.key.starts_with(key));
        let problem = found.unwrap_or_else(|| panic!("{new}: {problems:?}"));
        assert!(problem.message.contains(message), "{new}: {}", problem.message);
        assert!(problem.remedy.contains(remedy), "{new}: {}", problem.remedy);
        assert!(problem.line > 1, "{problem}");
    }
}

#[test]
fn the_shipped_guard_costs_no_distance_from_the_start_to_the_latch() {
    let scenario = Scenario::load(&shipped("scenarios/probe_drogue.toml")).expect("the shipped scenario");
    let plant = Plant::new(scenario.model);
    // Both parts as far towards each other as the seat is deep, and aside as far as the campaign's offsets go.
    for (way, aside) in [(0.0, 0.0), (0.13, 0.0), (0.13, 0.05), (0.05, -0.05)] {
        let mut reference = plant.start;
        (reference.a.position.x, reference.b.position.x) = (reference.a.position.x + way, reference.b.position.x - way);
        (reference.a.position.y, reference.b.position.z) =
            (reference.a.position.y + aside, reference.b.position.z + aside);
        let asked = axes_asked(&plant, &reference);
        assert_eq!((asked.near_limit, asked.near_body), (0.0, 0.0), "{way} m together, {aside} m aside");
    }
}

#[test]
fn a_start_that_every_session_would_be_stopped_at_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for (file, to) in [
        ("models/kr300_r2500.toml", "models/kr300_r2500.toml"),
        ("models/ets_vii_arm.urdf", "models/ets_vii_arm.urdf"),
        ("scenarios/probe_drogue.toml", "scenarios/probe_drogue.toml"),
    ] {
        let to = folder.path().join(to);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("created");
        std::fs::copy(shipped(file), to).expect("copied");
    }
    std::fs::create_dir_all(folder.path().join("facilities")).expect("created");
    let load = |text: &str| {
        std::fs::write(folder.path().join("facilities/reference.toml"), text).expect("written");
        let loaded = Scenario::load(&folder.path().join("scenarios/probe_drogue.toml"));
        loaded.map(|_| ()).map_err(|problems| problems.into_iter().collect::<Vec<_>>())
    };
    load(&text()).expect("the shipped facility");
    load(&text()[..text().find("tool_speed =").expect("the guard")]).expect("a facility without a guard");
    for (old, new, message, remedy) in [
        (
            "arm_distance = \"50 mm\"",
            "arm_distance = \"2 m\"",
            "apart at the start: safety.arm_distance is 2 m",
            "lower arm_distance",
        ),
        (
            "singularity = \"5 deg\"",
            "singularity = \"60 deg\"",
            "from singular: safety.singularity is 60 deg",
            "lower singularity",
        ),
        ("\"-0.95 m\"]", "\"-0.3 m\"]", "deep in the keep-out box `floor` at the start", "shrink the box"),
    ] {
        let problems = load(&text().replacen(old, new, 1)).expect_err(new);
        let problem = &problems[0];
        assert_eq!(problem.key, "facility.file", "{problem}");
        assert!(problem.message.contains(message), "{new}: {}", problem.message);
        assert!(problem.remedy.contains(remedy), "{new}: {}", problem.remedy);
    }
}
