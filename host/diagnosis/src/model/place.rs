//! Blocks by their names in answers, with the place that each one is of a rig or a facility.

use softdock_kernels::model::MAX_JOINTS;

/// Name of a block, and its place in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockPlace {
    /// Name in answers: number of the residual in the catalogue, input and output (`R3 torque to motion`).
    pub name: &'static str,
    /// Place that a reader knows (`Axis 2`).
    pub place: &'static str,
}

const fn row(name: &'static str, place: &'static str) -> BlockPlace {
    BlockPlace { name, place }
}

/// Transmission of a command, by its echo.
pub const ECHO: BlockPlace = row("R1 command sent to command received", "Command path");
/// Command to the target of the controller.
pub const TARGET: BlockPlace = row("R1 command to target", "Command path");
/// Command to the first motion.
pub const FIRST_MOTION: BlockPlace = row("R1 to R3 command to first motion", "Command path and drive");
/// Clocks of sender and receiver.
pub const CLOCKS: BlockPlace = row("R1 clocks", "Clocks");
/// Controller of a drive.
pub const CONTROLLER: BlockPlace = row("R2 reference to torque", "Controller");
/// Whole facility.
pub const FACILITY: BlockPlace = row("whole facility", "Facility");
/// Commands of a facility to the motion of its parts.
pub const FACILITY_MOTION: BlockPlace = row("R2 command to motion", "Robots");
/// Drive of one joint.
pub const DRIVE: BlockPlace = row("R3 torque to motion", "Drive");
/// Axes of a robot.
pub const AXES: [BlockPlace; MAX_JOINTS] = [
    row("R3 torque to motion, axis 1", "Axis 1"),
    row("R3 torque to motion, axis 2", "Axis 2"),
    row("R3 torque to motion, axis 3", "Axis 3"),
    row("R3 torque to motion, axis 4", "Axis 4"),
    row("R3 torque to motion, axis 5", "Axis 5"),
    row("R3 torque to motion, axis 6", "Axis 6"),
    row("R3 torque to motion, axis 7", "Axis 7"),
    row("R3 torque to motion, axis 8", "Axis 8"),
];
/// Couplings of an axis to the one before, from axis 2 on.
pub const COUPLINGS: [BlockPlace; MAX_JOINTS - 1] = [
    row("R3 coupling of axes 1 and 2", "Axes 1 and 2"),
    row("R3 coupling of axes 2 and 3", "Axes 2 and 3"),
    row("R3 coupling of axes 3 and 4", "Axes 3 and 4"),
    row("R3 coupling of axes 4 and 5", "Axes 4 and 5"),
    row("R3 coupling of axes 5 and 6", "Axes 5 and 6"),
    row("R3 coupling of axes 6 and 7", "Axes 6 and 7"),
    row("R3 coupling of axes 7 and 8", "Axes 7 and 8"),
];
/// Robot as a whole.
pub const ROBOT: BlockPlace = row("R3 torques of all axes", "Robot");
/// Force/torque sensor.
pub const SENSOR: BlockPlace = row("R5 force to reading", "Sensor");
/// Motion of a facility's parts to the measured wrench.
pub const FACILITY_WRENCH: BlockPlace = row("R5 motion to wrench", "Contact and sensor");
/// Contact of one body.
pub const CONTACT: BlockPlace = row("R5 motion to force", "Contact");
/// Tossed body.
pub const TOSS: BlockPlace = row("R5 state to state", "Tossed body");
/// Free body.
pub const BODY: BlockPlace = row("R6 wrench to motion", "Body");

/// Blocks that are no axes of a robot.
const OTHERS: [BlockPlace; 14] = [
    ECHO,
    TARGET,
    FIRST_MOTION,
    CLOCKS,
    CONTROLLER,
    FACILITY,
    FACILITY_MOTION,
    DRIVE,
    ROBOT,
    SENSOR,
    FACILITY_WRENCH,
    CONTACT,
    TOSS,
    BODY,
];

/// Returns the place of a block; any other name, such as that of a recording, is returned as it is.
pub fn place(name: &str) -> &str {
    let mut all = OTHERS.iter().chain(&AXES).chain(&COUPLINGS);
    all.find(|row| row.name == name).map_or(name, |row| row.place)
}

/// Returns the axis of a block, from 1; `None` for blocks of other plants and of the robot as a whole.
pub fn axis(name: &str) -> Option<usize> {
    let of = |rows: &[BlockPlace]| rows.iter().position(|row| row.name == name);
    of(&AXES).map(|axis| axis + 1).or(of(&COUPLINGS).map(|axis| axis + 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_block_has_a_name_of_its_own_and_an_axis_has_its_number() {
        let names: BTreeSet<&str> = OTHERS.iter().chain(&AXES).chain(&COUPLINGS).map(|row| row.name).collect();
        assert_eq!(names.len(), OTHERS.len() + AXES.len() + COUPLINGS.len());
        for (number, row) in AXES.iter().enumerate() {
            assert_eq!((axis(row.name), place(row.name)), (Some(number + 1), row.place));
            assert!(row.place.ends_with(&(number + 1).to_string()));
        }
        assert_eq!((axis(ROBOT.name), place("log.csv")), (None, "log.csv"));
    }
}
