//! The shipped robot, its way through the writer, and spoiled copies of it.

use super::*;
use crate::problem::Problem;
use softdock_kernels::manipulator::{flange, link_frames};
use std::path::PathBuf;

fn shipped() -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/models/kr300_r2500.toml");
    std::fs::read_to_string(path).expect("the shipped robot")
}

fn read(text: &str) -> Result<Robot, Vec<Problem>> {
    Robot::from_text(Path::new("kr300.toml"), text).map_err(|problems| problems.into_iter().collect())
}

#[test]
fn the_shipped_robot_stands_where_it_should() {
    let robot = read(&shipped()).expect("valid");
    assert_eq!((robot.id.as_str(), robot.joints.len(), robot.joints[1].name.as_str()), ("kr300_r2500", 6, "A2"));
    let frames = link_frames(&robot.model, [0.0; 6]);
    assert!((frames[4].position - vec3(2.5, 0.0, 0.634)).norm() < 1e-4, "wrist");
    assert!((flange(&robot.model, [0.0; 6]).position - vec3(2.74, 0.0, 0.634)).norm() < 1e-4, "flange");
    let table: Vec<(f64, f64)> =
        robot.model.joints.iter().map(|j| (j.drive.static_torque, j.limits.speed.to_degrees().round())).collect();
    assert_eq!(table, [(0.0, 70.0), (6400.0, 55.0), (6000.0, 60.0), (1650.0, 80.0), (1650.0, 60.0), (900.0, 100.0)]);
    assert_eq!(robot.model.joints[0].drive.torque_limit, robot.model.joints[1].drive.torque_limit, "J1 as J2");
    let mass: f64 = robot.model.joints.iter().map(|joint| joint.link.mass).sum();
    assert!((mass / (1100.0 * (1.0 - 1572.9 / 4879.0)) - 1.0).abs() < 1e-3, "moving masses of 1.1 t: {mass}");
}

/// The ranges +80/-55 and +80/-195 deg of axes 2 and 3 count from the upright posture. From there the longer way of
/// axis 2 leans the arm forwards and down, and the longer way of axis 3 folds the forearm up and back.
#[test]
fn ranges_count_from_the_upright_posture() {
    let robot = read(&shipped()).expect("valid");
    let limits = |joint: usize| robot.model.joints[joint].limits;
    let home = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    for (joint, upper, lower) in [(1, 80.0_f64, -55.0_f64), (2, 80.0, -195.0)] {
        assert!((limits(joint).upper - home[joint] - upper.to_radians()).abs() < 1e-12);
        assert!((limits(joint).lower - home[joint] - lower.to_radians()).abs() < 1e-12);
    }
    let wrist = |joint: usize, angle: f64| {
        let mut posture = home;
        posture[joint] = angle;
        link_frames(&robot.model, posture)[4].position
    };
    let upright = wrist(0, 0.0);
    let (forwards, backwards) = (wrist(1, limits(1).upper), wrist(1, limits(1).lower));
    assert!(forwards.z < upright.z - 1.0 && backwards.x < upright.x - 1.0, "{forwards:?} {backwards:?}");
    let (down, back) = (wrist(2, limits(2).upper), wrist(2, limits(2).lower));
    assert!(down.z < upright.z - 0.9 && back.x < 0.0, "{down:?} {back:?}");
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let robot = read(&shipped()).expect("valid");
    let again = read(&robot.to_toml(&["a remark".to_owned()])).expect("the writer's text is valid");
    assert_eq!(again.model, robot.model);
    assert_eq!(
        (&again.joints, &again.model.workspace, &again.log),
        (&robot.joints, &robot.model.workspace, &robot.log)
    );
    assert_eq!((&again.id, &again.title), (&robot.id, &robot.title));
}

#[test]
fn spoiled_robots_name_the_place() {
    let text = shipped();
    let line_of = |part: &str| 1 + text[..text.find(part).expect(part)].matches('\n').count();
    let a2 = text.find("name = \"A2\"").expect("A2");
    let in_a2 = |key: &str| {
        let at = a2 + text[a2..].find(key).expect(key);
        text[at..].lines().next().expect("a line").to_owned()
    };
    let cases: Vec<(String, String, &str, &str, &str)> = vec![
        (in_a2("mass ="), "mass = \"-3 kg\"".into(), "joint[2].link.mass", "out of range", "above 0 kg"),
        (in_a2("mass ="), "mass = 3".into(), "joint[2].link.mass", "needs its unit", "3 kg"),
        (
            in_a2("gear_stiffness"),
            "gear_stiffness = \"5 N m\"".into(),
            "joint[2].drive.gear_stiffness",
            "a moment",
            "N m/rad",
        ),
        (
            in_a2("inertia ="),
            "inertia = { ixx = \"1 kg m^2\", iyy = \"1 kg m^2\", izz = \"9 kg m^2\" }".into(),
            "joint[2].link.inertia",
            "link `A2`: it breaks the triangle inequality",
            "centre of mass",
        ),
        ("unit = \"deg\"".into(), "unit = \"N\"".into(), "log.r1.q.1.unit", "the unit of a force", "deg"),
        (
            "\"r1.tau_motor.6\" =".into(),
            "\"r2.tau_motor.6\" =".into(),
            "log.r2",
            "more than one robot",
            "keep one robot's",
        ),
        ("\"r1.q.1\" =".into(), "\"r1.q.9\" =".into(), "log.r1.q.9", "no signal `r1.q.9`", "r1.q.1"),
    ];
    for (old, new, key, message, remedy) in cases {
        let problems = read(&text.replacen(&old, &new, 1)).expect_err(&new);
        let problem = &problems[0];
        assert!(problem.key.starts_with(key), "{new}: `{}`", problem.key);
        assert_eq!(problem.line, line_of(&old), "{new}: {problem}");
        assert!(problem.message.contains(message), "{new}: {}", problem.message);
        assert!(problem.remedy.contains(remedy), "{new}: {}", problem.remedy);
    }
}
