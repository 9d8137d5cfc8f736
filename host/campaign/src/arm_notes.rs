//! Drives and phases of a scenario's arm in words, with what the URDF states in vain.

use crate::scenario::Scenario;
use crate::scenario::sliding::of_sliding;
use crate::units::show;
use softdock_kernels::arm_plan::{ArmGuard, ArmPhase, ArmPlan, Goal};
use softdock_kernels::manipulator::ArmDrive;
use softdock_kernels::model::Brakes;
use softdock_kernels::vector::Pose;

/// Returns a line for each joint that is held, one for the drive of each that moves, or a note if the URDF states limits or
/// friction that the arm has not, and one for each phase.
pub fn arm_lines(scenario: &Scenario) -> Vec<String> {
    let (drives, brakes) = (&scenario.model.drives, scenario.model.brakes);
    let mut lines = scenario.held_joints.clone();
    for (i, (joint, drive)) in scenario.joints.iter().zip(drives).enumerate() {
        lines.push(format!("joint `{joint}`: {}", drive_text(drive, brakes, scenario.model.slides(i))));
    }
    if drives.is_empty() {
        lines.extend(stated_in_vain(scenario));
    }
    if let Some(plan) = &scenario.model.guidance.plan {
        lines.extend(
            plan.phases.iter().map(|phase| format!("phase `{}`: {}", phase.name, phase_text(plan, phase, scenario))),
        );
    }
    lines
}

fn phase_text(plan: &ArmPlan, phase: &ArmPhase, scenario: &Scenario) -> String {
    let pose = |place: &Pose<f64>, frame: &str| {
        let [x, y, z] = [place.position.x, place.position.y, place.position.z].map(|e| show(e, "m"));
        format!("part A to ({x}, {y}, {z}) in the frame of {frame}")
    };
    let moves = match &phase.goal {
        Goal::Hold => "holds".to_owned(),
        Goal::Joints(angles) => {
            let start = &scenario.model.start_angles;
            let unit = |joint| if scenario.model.slides(joint) { "m" } else { "rad" };
            let places = angles.iter().zip(start).enumerate();
            let places: Vec<String> = places.map(|(i, (way, start))| show(way + start, unit(i))).collect();
            format!("joints to {}", places.join(", "))
        }
        Goal::Base(place) => pose(place, "the base"),
        Goal::PartB(place) => pose(place, "part B"),
    };
    let turns = matches!(phase.goal, Goal::Joints(_)) && !scenario.model.slides(0);
    let unit = if turns { "rad/s" } else { "m/s" };
    let pace = match phase.goal {
        Goal::Hold => String::new(),
        _ => format!(", at most {}", show(phase.pace.speed, unit)),
    };
    let yields = if phase.compliance.is_some() { ", gives way to the force" } else { "" };
    let grip = match phase.closes {
        Some(true) => ", the fingers close",
        Some(false) => ", the fingers open",
        None => "",
    };
    let ends = phase.guards.iter().map(|own| format!("; {} -> {}", guard_text(own), plan.phases[own.next].name));
    let ends: String = ends.collect();
    format!("{moves}{pace}{yields}{grip}{}", if ends.is_empty() { "; to the end".to_owned() } else { ends })
}

fn guard_text(own: &ArmGuard) -> String {
    let parts = [
        own.arrived.then(|| "arrived".to_owned()),
        own.captured.then(|| "captured".to_owned()),
        own.gripped.then(|| "gripped".to_owned()),
        own.force.map(|limit| format!("force of {}", show(limit, "N"))),
        own.force_below.map(|limit| format!("force below {}", show(limit, "N"))),
        own.after.map(|limit| format!("after {}", show(limit, "s"))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" and ")
}

fn drive_text(own: &ArmDrive, brakes: Brakes, slides: bool) -> String {
    let (drive, friction) = (&own.drive, &own.friction);
    let show = |value: f64, unit: &'static str| show(value, if slides { of_sliding(unit) } else { unit });
    let mut parts = vec![format!("rotor {} behind the gear", show(drive.reflected_inertia(), "kg m^2"))];
    parts.push(match drive.gear_stiffness.is_finite() {
        true => format!("gear {}", show(drive.gear_stiffness, "N m/rad")),
        false => "rigid gear".to_owned(),
    });
    parts.push(match (friction.coulomb + friction.stribeck, friction.viscous) {
        (0.0, 0.0) => "no friction".to_owned(),
        (dry, viscous) => format!("friction {} and {}", show(dry, "N m"), show(viscous, "N m s/rad")),
    });
    if drive.torque_limit.is_finite() {
        parts.push(format!("at most {}", show(drive.torque_limit, "N m")));
    }
    if own.speed_limit.is_finite() {
        parts.push(format!("at most {}", show(own.speed_limit, "rad/s")));
    }
    if let Some(stops) = &own.stops {
        let way = format!("{} and {}", show(stops.lower, "rad"), show(stops.upper, "rad"));
        parts.push(format!("stops {way} from the start"));
    }
    match brakes {
        Brakes::Open => {}
        Brakes::Closed => parts.push(format!("brake {}", show(own.brake, "N m"))),
        Brakes::CloseAtTouch => parts.push(format!("brake {} from the first touch", show(own.brake, "N m"))),
    }
    parts.join(", ")
}

fn stated_in_vain(scenario: &Scenario) -> Option<String> {
    let count = scenario.rated_joints;
    let note = format!(
        "note: the URDF states torque, speed or friction of {count} joints; without [arm.drive] the arm has neither limits nor \
         friction"
    );
    (count > 0).then_some(note)
}
