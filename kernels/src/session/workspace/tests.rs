//! Where the links are, how far they reach at most, and which commands are near a rule of the workspace.

use super::*;
use crate::manipulator::cell::{Axes, Cell, Feedforward, commanded_axes};
use crate::manipulator::{Capsule, MAX_CAPSULES, link_frames, sample};
use crate::model::{AxisRange, Rail, Timing};
use crate::philox::uniform;
use crate::space::Motion;
use crate::vector::{Pose, Quat};

/// Numbers from -1 to 1.
fn draws(name: &'static str) -> impl FnMut() -> f64 {
    let mut drawn = 0;
    move || {
        drawn += 1;
        2.0 * uniform(7, name, 0, drawn) - 1.0
    }
}

fn vector(draw: &mut impl FnMut() -> f64, size: f64) -> Vec3<f64> {
    vec3(draw(), draw(), draw()) * size
}

fn attitude(draw: &mut impl FnMut() -> f64, size: f64) -> Quat<f64> {
    let v = vector(draw, size);
    Quat { w: (1.0 - v.dot(v)).sqrt(), v }
}

const TOOL: f64 = 0.08;

/// Robot 1 or 2 of two sample robots face to face, 1 m below their parts, with capsules of random place and size; robot 1
/// on a rail if it is to.
fn robot(number: usize, on_rail: bool, draw: &mut impl FnMut() -> f64) -> SessionRobot {
    let (timing, mut mount, mut model) =
        (Timing { substep: 1e-3, substeps: 1, max_ticks: 1 }, sample::mount(), sample::robot());
    mount.base.position.z = -1.0;
    model.workspace.reach = 4.0;
    model.capsules = (0..MAX_CAPSULES)
        .map(|index| {
            let capsule = sample::robot().capsules[index % 6];
            let (from, to) = (capsule.axis.from + vector(draw, 0.1), capsule.axis.to + vector(draw, 0.1));
            Capsule { axis: Segment { from, to }, radius: 0.1 + 0.05 * draw(), ..capsule }
        })
        .collect();
    let mut home = Pose::identity();
    if number == 2 {
        let around = Quat { w: 0.0, v: vec3(0.0, 0.0, 1.0) };
        mount.base = Pose { position: vec3(2.0, 0.1, -0.9), attitude: around };
        home.attitude = around;
    }
    let rail = (on_rail && number == 1).then(|| (Rail { axis: vec3(0.8, 0.6, 0.0), share: 0.5 }, sample::carriage()));
    let servo = sample::servo(Feedforward::Full);
    let cell = Cell::new(&model, &mount, &servo, rail, home, &timing).expect("in reach");
    let far = AxisRange { lower: -9.0, upper: 9.0, speed: 1.0, acceleration: 4.0 };
    SessionRobot::new(cell, &[far; crate::manipulator::cell::AXES], 9.0, TOOL)
}

fn robots(on_rail: bool, draw: &mut impl FnMut() -> f64) -> [SessionRobot; 2] {
    [robot(1, on_rail, draw), robot(2, on_rail, draw)]
}

/// Motions up to 0.9 m and about 1.2 rad from the start, in reach of both robots.
fn motions(robots: &[SessionRobot; 2], draw: &mut impl FnMut() -> f64) -> Parts<f64> {
    loop {
        let mut motion = |turn: Quat<f64>| Motion {
            position: vector(draw, 0.5),
            attitude: attitude(draw, 0.35).compose(turn),
            velocity: Vec3::zero(),
            omega: Vec3::zero(),
        };
        let around = Quat { w: 0.0, v: vec3(0.0, 0.0, 1.0) };
        let parts = Parts { a: motion(Quat::identity()), b: motion(around) };
        let reference = [parts.a, parts.b];
        if (0..2).all(|r| commanded_axes(&robots[r].cell, &reference[r]).1 == 0.0) {
            return parts;
        }
    }
}

fn start() -> Parts<f64> {
    let still = Vec3::zero();
    let at = |attitude| Motion { position: still, attitude, velocity: still, omega: still };
    Parts { a: at(Quat::identity()), b: at(Quat { w: 0.0, v: vec3(0.0, 0.0, 1.0) }) }
}

#[test]
fn links_are_where_the_forward_kinematics_puts_them() {
    let mut draw = draws("links");
    for on_rail in [false, true] {
        let robots = robots(on_rail, &mut draw);
        for _ in 0..1000 {
            let parts = motions(&robots, &mut draw);
            for (number, reference) in [(0, parts.a), (1, parts.b)] {
                let cell = &robots[number].cell;
                let (axes, reachable) = cell.axes_for(&reference);
                assert!(reachable);
                let Axes { position, .. } = axes;
                let angle = std::array::from_fn::<f64, 6, _>(|i| position[i]);
                // The model as it was, whose angles are the robot's own.
                let frames = link_frames(&sample::robot(), angle);
                let found = links(cell, &reference);
                for i in 0..found.count {
                    let capsule = cell.capsules()[i];
                    for (end, point) in [(capsule.axis.from, found.axes[i].from), (capsule.axis.to, found.axes[i].to)] {
                        let frame = frames[capsule.joint];
                        let in_base = frame.position + frame.attitude.rotate(end);
                        let expected = cell.in_laboratory(in_base, position[6]);
                        assert!(
                            (expected - point).norm() < 1e-9,
                            "link {}: {expected:?}, not {point:?}",
                            capsule.joint
                        );
                    }
                }
                let again = links_at(cell, &position);
                for i in 0..=found.count {
                    let (one, two) = (found.axes[i], again.axes[i]);
                    assert!(
                        (one.from - two.from).norm().max((one.to - two.to).norm()) < 1e-9,
                        "capsule {i} from angles"
                    );
                }
                let tool = found.axes[found.count];
                let hand = cell.in_laboratory(frames[5].position, position[6]);
                assert!((tool.from - hand).norm() < 1e-9 && (tool.to - reference.position).norm() < 1e-9);
            }
        }
    }
}

#[test]
fn no_link_and_no_tool_reaches_beyond_the_bound() {
    let (mut draw, mut slack) = (draws("bound"), Vec::new());
    for on_rail in [false, true] {
        let robots = robots(on_rail, &mut draw);
        for _ in 0..3000 {
            let parts = motions(&robots, &mut draw);
            let towards = loop {
                let v = vector(&mut draw, 1.0);
                if v.norm() > 0.1 {
                    break v * (1.0 / v.norm());
                }
            };
            for (number, reference) in [(0, parts.a), (1, parts.b)] {
                let robot = &robots[number];
                let (at, found) = (robot.commanded(&reference), links(&robot.cell, &reference));
                for tool in [None, Some(TOOL)] {
                    let mut most = f64::NEG_INFINITY;
                    for i in 0..found.count {
                        let (radius, is_arm) = wrapped(&robot.cell, i);
                        if is_arm || tool.is_some() {
                            let Segment { from, to } = found.axes[i];
                            most = most.max(towards.dot(from).max(towards.dot(to)) + radius);
                        }
                    }
                    if let Some(radius) = tool {
                        let Segment { from, to } = found.axes[found.count];
                        most = most.max(towards.dot(from).max(towards.dot(to)) + radius);
                    }
                    let bound = Extent::new(&robot.cell, towards, tool).reach(&at);
                    assert!(bound >= most - 1e-9, "{bound} m for {most} m");
                    slack.push(bound - most);
                }
            }
        }
    }
    let mean = slack.iter().sum::<f64>() / slack.len() as f64;
    assert!(mean < 0.2, "a bound {mean} m too wide on average excludes little");
}

#[test]
fn whatever_meets_a_rule_of_the_workspace_is_near() {
    let (mut draw, mut near, mut met, mut cases) = (draws("near"), 0, [0; 2], 0);
    for case in 0..40 {
        let robots = robots(case % 2 == 0, &mut draw);
        let mut keep_out = || KeepOut {
            name: "box".to_owned(),
            frame: Pose { position: vector(&mut draw, 1.5), attitude: attitude(&mut draw, 0.5) },
            half: vec3(0.3, 0.3, 0.3) + vector(&mut draw, 0.25),
        };
        let rules = SessionRules { keep_out: vec![keep_out(), keep_out()], arm_distance: 0.2, ..SessionRules::NONE };
        let workspace = Workspace::new(&rules, &robots, &start()).expect("two rules need it");
        for _ in 0..250 {
            let parts = motions(&robots, &mut draw);
            let reference = [parts.a, parts.b];
            let is_near = workspace.is_near(&[robots[0].commanded(&reference[0]), robots[1].commanded(&reference[1])]);
            let at = [links(&robots[0].cell, &reference[0]), links(&robots[1].cell, &reference[1])];
            let apart = arms_apart(&robots, &at);
            let depth = |r: usize| {
                workspace.boxes[0].depth(&robots[r], &at[r]).max(workspace.boxes[1].depth(&robots[r], &at[r]))
            };
            let rules_met = [apart < rules.arm_distance, depth(0).max(depth(1)) > 0.0];
            assert!(is_near || rules_met == [false; 2], "{rules_met:?}, unseen");
            (met[0], met[1]) = (met[0] + usize::from(rules_met[0]), met[1] + usize::from(rules_met[1]));
            (near, cases) = (near + usize::from(is_near), cases + 1);
        }
    }
    assert!(met[0] > 100 && met[1] > 100 && near < cases, "{met:?} met, {near} of {cases} near");
}

#[test]
fn a_command_that_is_no_number_meets_every_rule_of_the_workspace() {
    let mut draw = draws("nan");
    let robots = robots(true, &mut draw);
    let wall = KeepOut {
        name: "wall".to_owned(),
        frame: Pose { position: vec3(0.0, 3.0, 0.0), attitude: Quat::identity() },
        half: vec3(1.0, 0.1, 1.0),
    };
    let rules = SessionRules { keep_out: vec![wall], arm_distance: 0.1, ..SessionRules::NONE };
    let workspace = Workspace::new(&rules, &robots, &start()).expect("two rules need it");
    for wrong in [0, 1] {
        let mut reference = [start().a, start().b];
        let calm = [robots[0].commanded(&reference[0]), robots[1].commanded(&reference[1])];
        assert!(!workspace.is_near(&calm), "the start is far from all");
        reference[wrong].position.y = f64::NAN;
        let at = [robots[0].commanded(&reference[0]), robots[1].commanded(&reference[1])];
        assert!(workspace.is_near(&at), "robot {}", wrong + 1);
        let at = [links(&robots[0].cell, &reference[0]), links(&robots[1].cell, &reference[1])];
        assert!(arms_apart(&robots, &at).is_nan(), "robot {}", wrong + 1);
        assert!(workspace.boxes[0].depth(&robots[wrong], &at[wrong]).is_nan());
    }
}

#[test]
fn the_least_sine_is_that_of_wrist_elbow_or_shoulder() {
    let mut draw = draws("sine");
    let robot = robot(1, false, &mut draw);
    let mut seen = [0; 3];
    for _ in 0..3000 {
        let reference = Motion { position: vector(&mut draw, 0.9), attitude: attitude(&mut draw, 0.5), ..start().a };
        let at = robot.commanded(&reference);
        if at.singular > 0.0 {
            continue;
        }
        let (axes, _) = robot.cell.axes_for(&reference);
        let frames = link_frames(&sample::robot(), std::array::from_fn::<f64, 6, _>(|i| axes.position[i]));
        let origin = |i: usize| frames[i].position;
        let sine = |a: Vec3<f64>, b: Vec3<f64>| a.cross(b).norm() / (a.norm() * b.norm());
        let axis = |i: usize| frames[i].attitude.rotate(vec3(0.0, 0.0, 1.0));
        let (upper, lower) = (origin(2) - origin(1), origin(3) - origin(2));
        let out = origin(3).x.hypot(origin(3).y) / (upper.norm() + lower.norm());
        let sines = [sine(axis(3), axis(5)), sine(upper, lower), out];
        let least = sines.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((least - at.least_sine).abs() < 1e-6, "{} of {sines:?}", at.least_sine);
        seen[sines.iter().position(|sine| *sine == least).expect("one of them")] += 1;
    }
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}
