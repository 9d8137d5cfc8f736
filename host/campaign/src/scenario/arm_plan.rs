//! Phases of the arm's motion, with their guards; the camera and the force sensor of the arm.

use super::bodies::{Bodies, joint_places};
use super::control::{self, IDLE, ticks};
use crate::check::{Checker, span_of};
use crate::written::scenario::{ArmTable, CameraTable, ComplianceTable, GoalTable, GuardTable, PhaseTable};
use crate::written::{At, Quantity};
use softdock_kernels::arm_plan::{ArmGuard, ArmPhase, ArmPlan, Camera, Compliance, Goal, IMAGES, Pace};
use softdock_kernels::model::{ArmControl, MAX_JOINTS, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::range::{DAMPING, FORCE, INERTIA, MASS, RATE, Range, SPEED, STIFFNESS};
use softdock_kernels::vector::Vec3;

/// Most phases of an arm.
const MOST_PHASES: usize = 16;

/// Angular speed of part A where none is written \[rad/s\].
const TURN_SPEED: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Time in which a move's acceleration is reached where no jerk is written \[s\].
const JERK_TIME: f64 = 0.1;

/// Of a phase that holds: no move uses it.
const RESTING: Pace = Pace { speed: 1.0, acceleration: 1.0, jerk: 1.0, turn_speed: 1.0 };

const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// The plan of an arm with phases.
pub(super) fn read(
    c: &mut Checker,
    arm: &ArmTable,
    bodies: &Bodies,
    (timing, has_latch, has_fingers): (&Timing, bool, bool),
    nominal: &mut Params<f64>,
) -> Option<ArmPlan> {
    refuse_without_phases(c, arm);
    let first = arm.phase.first()?;
    if arm.phase.len() > MOST_PHASES {
        let message = format!("the arm has {} phases", arm.phase.len());
        c.refuse(&arm.phase[MOST_PHASES].span, message, format!("write at most {MOST_PHASES}"));
        return None;
    }
    let default = default_controller(c, arm, &bodies.slides, &first.value);
    let names: Vec<String> = arm.phase.iter().map(|phase| name(c, arm, &phase.value)).collect();
    let phases: Vec<ArmPhase> =
        (0..arm.phase.len()).map(|index| phase(c, arm, index, &names, default, (bodies, has_latch))).collect();
    refuse_unreachable(c, arm, &phases);
    let camera = camera(c, arm, timing, &phases, nominal);
    let senses = phases.iter().any(|phase| {
        phase.compliance.is_some() || phase.guards.iter().any(|own| own.force.is_some() || own.force_below.is_some())
    });
    let sensor_lag = arm.sensor.as_ref().map_or(0.0, |sensor| {
        if !senses {
            let remedy = "remove [arm.sensor], or add a guard with `force` or a `compliance`";
            c.refuse(&sensor.span, "this does nothing: no phase uses the arm's force sensor", remedy);
        }
        c.number(&sensor.value.lag, "s", Range::within(0.0, 10.0))
    });
    let grip_time = grip_time(c, arm, &phases, has_fingers);
    Some(ArmPlan { phases, camera, grip_time, sensor_lag })
}

/// Refuses what only phases use.
fn refuse_without_phases(c: &mut Checker, arm: &ArmTable) {
    if !arm.phase.is_empty() {
        return;
    }
    for (name, span) in
        [("camera", span_of(&arm.camera)), ("sensor", span_of(&arm.sensor)), ("grip", span_of(&arm.grip))]
    {
        if let Some(span) = span {
            c.refuse(&span, format!("`{name}` does nothing without phases"), "add [[arm.phase]], or remove it");
        }
    }
}

/// The controller of phases without one of their own.
fn default_controller(c: &mut Checker, arm: &ArmTable, slides: &[bool], first: &PhaseTable) -> Option<ArmControl> {
    let lacking = arm.phase.iter().find(|phase| phase.value.controller.is_none());
    match (&arm.controller, lacking) {
        (Some(table), Some(_)) => Some(control::controller(c, &table.value, slides)),
        (Some(table), None) => {
            let remedy = "remove it, or leave out the `controller` of a phase";
            c.refuse(&table.span, "this does nothing: every phase has its own controller", remedy);
            None
        }
        (None, Some(phase)) => {
            let name = if phase.value.name.value.is_empty() { &first.name.value } else { &phase.value.name.value };
            let remedy = "add `controller` to the phase, or a table [arm.controller] for all";
            c.refuse(&phase.span, format!("the phase `{name}` has no controller"), remedy);
            None
        }
        (None, None) => None,
    }
}

/// A phase's name, once.
fn name(c: &mut Checker, arm: &ArmTable, phase: &PhaseTable) -> String {
    let name = c.name(&phase.name);
    let first = arm.phase.iter().find(|other| other.value.name.value == name);
    if first.is_some_and(|first| first.value.name.span != phase.name.span) {
        c.refuse(&phase.name.span, format!("two phases are called `{name}`"), "give each phase its own name");
    }
    name
}

/// One phase; `names` are those of all.
fn phase(
    c: &mut Checker,
    arm: &ArmTable,
    index: usize,
    names: &[String],
    default: Option<ArmControl>,
    (bodies, has_latch): (&Bodies, bool),
) -> ArmPhase {
    let At { value: table, span } = &arm.phase[index];
    let own = table.controller.as_ref().map(|own| control::controller(c, &own.value, &bodies.slides));
    let control = own.or(default).unwrap_or(IDLE);
    let (goal, pace) = match &table.to {
        Some(to) => (
            goal(c, to, control, arm, bodies),
            pace(c, table, span, (to.value.angles.is_some(), bodies.slides.contains(&true))),
        ),
        None => {
            refuse_pace(c, table);
            (Goal::Hold, RESTING)
        }
    };
    let compliance = table.compliance.as_ref().map(|own| {
        if !control.is_cartesian() {
            let remedy = "give the phase a controller with law = \"cartesian_impedance\", which follows the pose";
            c.refuse(&own.span, "only a Cartesian controller has a wanted pose that can give way", remedy);
        }
        compliance(c, own)
    });
    let has = Has { motion: table.to.is_some(), latch: has_latch, grip: arm.grip.is_some() };
    let guards = table.until.iter().map(|own| guard(c, own, index, names, has)).collect();
    let closes = table.grip.as_ref().map(|own| {
        if arm.grip.is_none() {
            c.refuse(&own.span, "the arm has no grip", "add grip = { time = \"1 s\" } to [arm], or remove it");
        }
        c.choice(own, &[("close", true), ("open", false)])
    });
    ArmPhase { name: names[index].clone(), control, goal, pace, compliance, closes, guards }
}

/// Where a phase moves the arm.
fn goal(c: &mut Checker, to: &At<GoalTable>, control: ArmControl, arm: &ArmTable, bodies: &Bodies) -> Goal {
    let table = &to.value;
    match (&table.angles, &table.frame) {
        (Some(angles), None) => {
            let pose = [span_of(&table.position), span_of(&table.rotation)];
            if let Some(span) = pose.into_iter().flatten().next() {
                let remedy = "remove it, or write `frame` in place of `angles`";
                c.refuse(&span, "joint angles leave part A's pose no choice", remedy);
            }
            if control.is_cartesian() {
                let remedy = "give the phase a controller with law = \"joint_pd\" or \"computed_torque\"";
                c.refuse(&angles.span, "the phase's controller leads part A, not the joints", remedy);
            }
            if bodies.slides.contains(&true) && bodies.slides.contains(&false) {
                let remedy = "lead part A by a Cartesian controller and `frame`";
                c.refuse(&angles.span, "joints that turn and joints that slide have no common speed", remedy);
            }
            let places = joint_places(c, angles, &bodies.slides, &bodies.limits, &bodies.joints);
            let mut wanted = [0.0; MAX_JOINTS];
            for (i, place) in places.iter().enumerate() {
                wanted[i] = place - bodies.angles.get(i).unwrap_or(&0.0);
            }
            Goal::Joints(wanted)
        }
        (None, Some(frame)) => {
            if !control.is_cartesian() {
                let remedy = "give the phase a controller with law = \"cartesian_impedance\"";
                c.refuse(&frame.span, "the phase's controller leads the joints, not part A", remedy);
            }
            let pose = c.pose(&table.position, &table.rotation);
            let is_seen = c.choice(frame, &[("base", false), ("part_b", true)]);
            if is_seen && arm.camera.is_none() {
                let remedy = "add a table [arm.camera], or write frame = \"base\"";
                c.refuse(&frame.span, "the arm has nothing that sees part B", remedy);
            }
            if is_seen { Goal::PartB(pose) } else { Goal::Base(pose) }
        }
        _ => {
            let remedy = "write either angles = [...], or frame = \"base\" or \"part_b\" with a position";
            c.refuse(&to.span, "where the phase moves is not clear", remedy);
            Goal::Hold
        }
    }
}

/// Limits of a move, of part A or of each joint.
fn pace(c: &mut Checker, table: &PhaseTable, span: &std::ops::Range<usize>, (of_joints, slide): (bool, bool)) -> Pace {
    let turn = of_joints && !slide;
    let units = if turn { ["rad/s", "rad/s^2", "rad/s^3"] } else { ["m/s", "m/s^2", "m/s^3"] };
    let most = if turn { RATE } else { SPEED };
    let mut needed = |written: &Option<Quantity>, name: &str, unit: &str, most: f64| match written {
        Some(written) => c.number(written, unit, Range::above(0.0, most)),
        None => {
            let message = format!("the move of phase `{}` has no `{name}`", table.name.value);
            c.refuse(span, message, format!("add {name} = \"... {unit}\""));
            1.0
        }
    };
    let speed = needed(&table.speed, "speed", units[0], most);
    let acceleration = needed(&table.acceleration, "acceleration", units[1], 1e3);
    let jerk = c.number_or(&table.jerk, acceleration / JERK_TIME, units[2], Range::above(0.0, 1e6));
    if let Some(written) = table.turn_speed.as_ref().filter(|_| of_joints) {
        c.refuse(&written.span, "a move of the joints has no `turn_speed`", "remove it: `speed` limits each joint");
    }
    let turn_speed = c.number_or(&table.turn_speed, TURN_SPEED, "rad/s", Range::above(0.0, RATE));
    Pace { speed, acceleration, jerk, turn_speed }
}

/// Refuses limits of a move that a phase does not make.
fn refuse_pace(c: &mut Checker, table: &PhaseTable) {
    let keys = [
        ("speed", &table.speed),
        ("acceleration", &table.acceleration),
        ("jerk", &table.jerk),
        ("turn_speed", &table.turn_speed),
    ];
    for (name, written) in keys {
        if let Some(written) = written {
            c.refuse(
                &written.span,
                format!("`{name}` does nothing: the phase moves nowhere"),
                "add `to`, or remove it",
            );
        }
    }
}

/// How the wanted pose gives way.
fn compliance(c: &mut Checker, own: &At<ComplianceTable>) -> Compliance {
    let At { value: table, span } = own;
    let mut yields = [false; 6];
    for axis in &table.axes {
        let choices: Vec<(&str, usize)> = AXES.into_iter().zip(0..).collect();
        yields[c.choice(axis, &choices)] = true;
    }
    if table.axes.is_empty() {
        c.refuse(span, "no axis gives way", "write axes = [\"x\", \"y\", \"z\"], or remove `compliance`");
    }
    let (stiff, damp) = (Range::within(0.0, STIFFNESS), Range::above(0.0, DAMPING));
    let kinds = [
        (&table.mass, &table.damping, &table.stiffness, &table.press, "", ["kg", "N s/m", "N/m", "N"], MASS, 0..3),
        (
            &table.rotation_inertia,
            &table.rotation_damping,
            &table.rotation_stiffness,
            &table.press_moment,
            "rotation_",
            ["kg m^2", "N m s/rad", "N m/rad", "N m"],
            INERTIA,
            3..6,
        ),
    ];
    let mut all = Compliance { inverse_mass: [0.0; 6], damping: [0.0; 6], stiffness: [0.0; 6], press: [0.0; 6] };
    for (mass, damping, stiffness, press, prefix, units, most, axes) in kinds {
        let is_used = axes.clone().any(|axis| yields[axis]);
        let spans = [span_of(mass), span_of(damping), span_of(stiffness), span_of(press)];
        if let Some(span) = spans.into_iter().flatten().next().filter(|_| !is_used) {
            let named = axes.clone().map(|axis| AXES[axis]).collect::<Vec<_>>().join(", ");
            c.refuse(&span, format!("this does nothing: none of {named} gives way"), "add the axes, or remove it");
        }
        if !is_used {
            continue;
        }
        let mass_name = if prefix.is_empty() { "mass".to_owned() } else { "rotation_inertia".to_owned() };
        let mut needed = |written: &Option<Quantity>, name: &str, unit: &str, range: Range| match written {
            Some(written) => c.number(written, unit, range),
            None => {
                c.refuse(
                    span,
                    format!("`{name}` of the axes that give way is missing"),
                    format!("add {name} = \"... {unit}\""),
                );
                1.0
            }
        };
        let inertia = needed(mass, &mass_name, units[0], Range::above(0.0, most));
        let resistance = needed(damping, &format!("{prefix}damping"), units[1], damp);
        let spring = c.number_or(stiffness, 0.0, units[2], stiff);
        let press = press.as_ref().map_or(Vec3::zero(), |press| c.vector(press, units[3], Range::size(FORCE)));
        for (axis, press) in axes.zip([press.x, press.y, press.z]) {
            if yields[axis] {
                all.inverse_mass[axis] = 1.0 / inertia;
                (all.damping[axis], all.stiffness[axis], all.press[axis]) = (resistance, spring, press);
            } else if press != 0.0 {
                let key = if prefix.is_empty() { "press" } else { "press_moment" };
                let remedy = format!("add \"{}\" to `axes`, or write 0 there in `{key}`", AXES[axis]);
                c.refuse(span, format!("`{key}` presses along {}, which does not give way", AXES[axis]), remedy);
            }
        }
    }
    all
}

/// What a phase has that a guard may wait for.
#[derive(Clone, Copy)]
struct Has {
    motion: bool,
    latch: bool,
    grip: bool,
}

/// What ends a phase.
fn guard(c: &mut Checker, own: &At<GuardTable>, index: usize, names: &[String], has: Has) -> ArmGuard {
    let At { value: table, span } = own;
    let mut set = |written: &Option<At<bool>>, name: &str, refusal: Option<(&str, &str)>| {
        let Some(written) = written else { return false };
        if !written.value {
            c.refuse(
                &written.span,
                format!("`{name}` = false ends nothing"),
                format!("write {name} = true, or remove it"),
            );
        } else if let Some((message, remedy)) = refusal {
            c.refuse(&written.span, message, remedy);
        }
        written.value
    };
    let stays =
        (!has.motion).then_some(("the phase moves nowhere: nothing arrives", "add `to` to the phase, or remove it"));
    let unlatched =
        (!has.latch).then_some(("without a latch nothing is captured", "add a table [latch], or remove it"));
    let arrived = set(&table.arrived, "arrived", stays);
    let captured = set(&table.captured, "captured", unlatched);
    let ungripped =
        (!has.grip).then_some(("the arm has no grip", "add grip = { time = \"1 s\" } to [arm], or remove it"));
    let gripped = set(&table.gripped, "gripped", ungripped);
    let force = Range::above(0.0, FORCE);
    let mut limit = |written: &Option<Quantity>, unit: &str, range: Range| {
        written.as_ref().map(|written| c.number(written, unit, range))
    };
    let (above, force_below) = (limit(&table.force, "N", force), limit(&table.force_below, "N", force));
    let after = limit(&table.after, "s", Range::within(0.0, 1e5));
    if !arrived && !captured && !gripped && above.is_none() && force_below.is_none() && after.is_none() {
        let remedy = "write arrived, captured or gripped = true, force, force_below or after";
        c.refuse(span, "nothing is said that ends the phase", remedy);
    }
    let next = match &table.go_to {
        Some(to) => {
            let choices: Vec<(&str, usize)> = names.iter().map(String::as_str).zip(0..).collect();
            c.choice(to, &choices)
        }
        None if index + 1 < names.len() => index + 1,
        None => {
            c.refuse(span, "no phase follows the last one", "add go_to = \"...\", or remove this end");
            index
        }
    };
    if next == index && table.go_to.is_some() {
        c.refuse(span, "the phase goes to itself", "name another phase in `go_to`");
    }
    ArmGuard { arrived, captured, gripped, force: above, force_below, after, next }
}

/// Refuses phases that nothing leads to.
fn refuse_unreachable(c: &mut Checker, arm: &ArmTable, phases: &[ArmPhase]) {
    let mut is_reached = vec![false; phases.len()];
    let mut open = vec![0];
    while let Some(index) = open.pop() {
        if !std::mem::replace(&mut is_reached[index], true) {
            open.extend(phases[index].guards.iter().map(|own| own.next));
        }
    }
    for (index, phase) in phases.iter().enumerate().filter(|(index, _)| !is_reached[*index]) {
        let remedy = "end an earlier phase with an `until` that goes to it, or remove it";
        c.refuse(&arm.phase[index].span, format!("no phase leads to `{}`", phase.name), remedy);
    }
}

/// Time in which the fingers close \[s\]; 0 without any.
fn grip_time(c: &mut Checker, arm: &ArmTable, phases: &[ArmPhase], has_fingers: bool) -> f64 {
    let Some(At { value: table, span }) = &arm.grip else { return 0.0 };
    if !has_fingers {
        let remedy = "give solids of part A a `closes`, the way that they move, or remove it";
        c.refuse(span, "this does nothing: nothing of part A moves with the grip", remedy);
    }
    if !phases.iter().any(|phase| phase.closes == Some(true)) {
        c.refuse(span, "the grip never closes", "write grip = \"close\" in a phase, or remove it");
    }
    c.number(&table.time, "s", Range::within(0.01, 1e3))
}

/// The arm's camera.
fn camera(
    c: &mut Checker,
    arm: &ArmTable,
    timing: &Timing,
    phases: &[ArmPhase],
    nominal: &mut Params<f64>,
) -> Option<Camera> {
    let At { value: table, span } = arm.camera.as_ref()?;
    if !phases.iter().any(|phase| matches!(phase.goal, Goal::PartB(_))) {
        let remedy = "remove [arm.camera], or move a phase to = { frame = \"part_b\" }";
        c.refuse(span, "this does nothing: no phase moves relative to part B", remedy);
    }
    let CameraTable { period, delay, noise_position, noise_rotation, smoothing, .. } = table;
    let tick = timing.tick();
    let period_ticks = ticks(c, period, tick, [1.0, 1e4]);
    let delay_ticks = ticks(c, delay, tick, [0.0, (IMAGES - 1) as f64 * f64::from(period_ticks)]);
    let noise = Range::within(0.0, 1.0);
    c.take(table.parameters(0), nominal);
    Some(Camera {
        period: period_ticks,
        delay: delay_ticks,
        noise_position: c.number_or(noise_position, 0.0, "m", noise),
        noise_rotation: c.number_or(noise_rotation, 0.0, "rad", noise),
        smoothing: c.number_or(smoothing, 0.0, "s", Range::within(0.0, 100.0)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_notes::arm_lines;
    use crate::problem::Problems;
    use crate::scenario::Scenario;
    use crate::source::Source;
    use softdock_kernels::vector::vec3;
    use std::path::Path;

    /// The shipped scenario with another text.
    fn servo(old: &str, new: &str) -> Result<Scenario, Problems> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/servo.toml");
        let text = std::fs::read_to_string(&path).expect("the shipped scenario");
        assert!(text.contains(old), "the scenario has no `{old}`");
        Scenario::from_source(Source::new(path, text.replacen(old, new, 1)))
    }

    #[test]
    fn phases_are_read_with_their_defaults() {
        let scenario = servo("seven", "seven").unwrap_or_else(|problems| panic!("{problems}"));
        let plan = scenario.model.guidance.plan.as_ref().expect("phases");
        let names: Vec<&str> = plan.phases.iter().map(|phase| phase.name.as_str()).collect();
        assert_eq!(names, ["approach", "touch", "press", "hold", "retreat"]);
        let first = &plan.phases[0];
        assert!(matches!(first.goal, Goal::PartB(pose) if (pose.position - vec3(-0.07, 0.0, 0.0)).norm() < 1e-15));
        assert!((first.pace.jerk - 10.0 * first.pace.acceleration).abs() < 1e-12, "{:?}", first.pace);
        let ends: Vec<usize> = first.guards.iter().map(|own| own.next).collect();
        assert_eq!(ends, [1, 4], "the next phase, and the one that is named");
        assert_eq!(plan.camera.map(|own| (own.period, own.delay)), Some((100, 80)));
        let press = plan.phases[2].compliance.expect("it gives way");
        assert_eq!(press.inverse_mass, [1.0 / 20.0, 0.0, 0.0, 0.2, 0.2, 0.2]);
        assert_eq!((press.press[0], press.stiffness), (30.0, [0.0; 6]));
        assert!(plan.phases[3].guards.is_empty() && plan.phases[3].goal == Goal::Hold);
        let lines = arm_lines(&scenario);
        assert!(
            lines.iter().any(|line| line.contains("phase `touch`") && line.contains("force of 6 N -> press")),
            "{lines:?}"
        );
    }

    #[test]
    fn joints_are_led_from_the_start_posture() {
        let text = "[[arm.phase]]\nname = \"fold\"\ncontroller = { law = \"computed_torque\", bandwidth = \"3 rad/s\", damping_ratio = 1 }\n\
                    to = { angles = [\"10 deg\", \"30 deg\", \"0 deg\", \"90 deg\", \"0 deg\", \"-30 deg\", \"0 deg\"] }\n\
                    speed = \"5 deg/s\"\nacceleration = \"10 deg/s^2\"\nuntil = [{ arrived = true }]\n\n[[arm.phase]]";
        let scenario = servo("[[arm.phase]]", text).unwrap_or_else(|problems| panic!("{problems}"));
        let plan = scenario.model.guidance.plan.expect("phases");
        let Goal::Joints(angles) = plan.phases[0].goal else { panic!("{:?}", plan.phases[0].goal) };
        assert!((angles[0] - 10.0_f64.to_radians()).abs() < 1e-12 && angles[1..].iter().all(|way| way.abs() < 1e-12));
    }

    #[test]
    fn phases_that_contradict_themselves_are_refused() {
        let cases = [
            ("go_to = \"retreat\"", "go_to = \"retread\"", "`retread` is not known here", "retreat"),
            ("name = \"touch\"", "name = \"approach\"", "two phases are called `approach`", "its own name"),
            ("speed = \"30 mm/s\"\n", "", "has no `speed`", "add speed"),
            (
                "until = [{ force = \"6 N\" }",
                "until = [{ }",
                "nothing is said that ends the phase",
                "arrived, captured",
            ),
            ("{ arrived = true }", "{ arrived = false }", "ends nothing", "arrived = true"),
            ("name = \"hold\"", "name = \"hold\"\nspeed = \"1 m/s\"", "the phase moves nowhere", "add `to`"),
            (
                "name = \"hold\"",
                "name = \"hold\"\nuntil = [{ arrived = true, go_to = \"touch\" }]",
                "nothing arrives",
                "add `to`",
            ),
            ("camera = {", "# camera = {", "nothing that sees part B", "add a table [arm.camera]"),
            ("period = \"100 ms\"", "period = \"100.4 ms\"", "not a whole number of ticks", "0.1 s is the nearest"),
            ("delay = \"80 ms\"", "delay = \"480 ms\"", "out of range", "0.3"),
            ("axes = [\"x\", \"rx\"", "axes = [\"y\", \"rx\"", "which does not give way", "add \"x\" to `axes`"),
            ("mass = \"20 kg\", ", "", "`mass` of the axes that give way is missing", "add mass"),
            (
                "axes = [\"x\", \"rx\", \"ry\", \"rz\"]",
                "axes = [\"x\"]",
                "none of rx, ry, rz gives way",
                "add the axes",
            ),
            ("frame = \"part_b\"", "frame = \"part_c\"", "`part_c` is not known here", "part_b"),
            (
                "captured = true, go_to = \"hold\"",
                "captured = true, go_to = \"retreat\"",
                "no phase leads to `hold`",
                "remove it",
            ),
            (
                "name = \"hold\"",
                "name = \"hold\"\nuntil = [{ after = \"1 s\", go_to = \"hold\" }]",
                "goes to itself",
                "another phase",
            ),
            (
                "[arm.controller]\nlaw = \"cartesian_impedance\"",
                "[arm.controller]\nlaw = \"computed_torque\"",
                "does not take",
                "takes",
            ),
            ("stiffness = \"4 N/mm\"", "stiffness = \"4e5 N/mm\"", "of phase `approach`", "timing.tick"),
        ];
        let mut faults = Vec::new();
        for (old, new, what, remedy) in cases {
            let problems = servo(old, new).expect_err(new);
            let found = |own: &crate::problem::Problem| {
                own.to_string().contains(what) && (own.remedy.contains(remedy) || own.to_string().contains(remedy))
            };
            if !problems.iter().any(found) {
                faults.push(format!("{old} -> {new}: {problems}"));
            }
        }
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    #[test]
    fn tables_that_only_phases_use_and_controllers_that_none_uses_are_refused() {
        let berth = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/berth.toml");
        let text = std::fs::read_to_string(&berth).expect("the shipped scenario");
        let with = |table: &str| {
            Scenario::from_source(Source::new(
                berth.clone(),
                text.replace("[arm.controller]", &format!("{table}\n[arm.controller]")),
            ))
        };
        for (table, what) in [
            ("sensor = { lag = \"1 ms\" }", "`sensor` does nothing without phases"),
            ("camera = { period = \"1 ms\", delay = \"0 s\" }", "`camera` does nothing without phases"),
        ] {
            let problems = with(table).expect_err(table);
            assert!(problems.to_string().contains(what), "{problems}");
        }
        let (start, end) =
            (text.find("[arm.controller]").expect("its table"), text.find("[part_a]").expect("the next"));
        let without = format!("{}{}", &text[..start], &text[end..]);
        let problems = Scenario::from_source(Source::new(berth, without)).expect_err("no controller");
        assert!(problems.to_string().contains("the arm has no controller"), "{problems}");
    }
}
