//! Drives of a scenario's arm in words, with what the URDF states in vain.

use crate::arm::{self, BaseMass};
use crate::scenario::Scenario;
use crate::units::show;
use softdock_kernels::manipulator::ArmDrive;
use softdock_kernels::model::Brakes;
use softdock_kernels::vector::Pose;

/// Returns a line for the drive of each joint, or a note if the URDF states limits or friction that the arm has not.
pub fn arm_lines(scenario: &Scenario) -> Vec<String> {
    let (drives, brakes) = (&scenario.model.drives, scenario.model.brakes);
    if drives.is_empty() {
        return stated_in_vain(scenario).into_iter().collect();
    }
    let named = scenario.joints.iter().zip(drives);
    named.map(|(joint, drive)| format!("joint `{joint}`: {}", drive_text(drive, brakes))).collect()
}

fn drive_text(own: &ArmDrive, brakes: Brakes) -> String {
    let (drive, friction) = (&own.drive, &own.friction);
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
    let arm = arm::read(scenario.urdf()?, Pose::identity(), BaseMass::Refused).ok()?;
    let states = |own: &&arm::JointRating| **own != arm::JointRating::default();
    let count = arm.ratings.iter().filter(states).count();
    let note = format!(
        "note: the URDF states torque, speed or friction of {count} joints; without [arm.drive] the arm has neither limits nor \
         friction"
    );
    (count > 0).then_some(note)
}
