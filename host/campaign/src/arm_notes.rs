//! Drives of a scenario's arm in words, with what the URDF states in vain.

use crate::scenario::Scenario;
use crate::scenario::sliding::of_sliding;
use crate::units::show;
use softdock_kernels::manipulator::ArmDrive;
use softdock_kernels::model::Brakes;

/// Returns a line for each joint that is held, and one for the drive of each that moves, or a note if the URDF states limits or friction that the arm has not.
pub fn arm_lines(scenario: &Scenario) -> Vec<String> {
    let (drives, brakes) = (&scenario.model.drives, scenario.model.brakes);
    let held = scenario.held_joints.iter().cloned();
    if drives.is_empty() {
        return held.chain(stated_in_vain(scenario)).collect();
    }
    let named = scenario.joints.iter().zip(drives).enumerate();
    let text = |(i, (joint, drive)): (usize, (&String, &ArmDrive))| {
        format!("joint `{joint}`: {}", drive_text(drive, brakes, scenario.model.slides(i)))
    };
    held.chain(named.map(text)).collect()
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
