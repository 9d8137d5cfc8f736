//! Robots and sensor emulated in this process; there is nothing real to arm.

use super::address::LinkOption;
use super::error::LinkError;
use super::row::{LinkRequest, ProtocolRow, Reach, Usage};
use crate::emulation::in_process::{CYCLE, EmulatedRobot, EmulatedSensor, InProcessRig};
use crate::signals::{ForceSensor, RobotLink};
use std::cell::RefCell;
use std::rc::Rc;

const CYCLE_MS: LinkOption = LinkOption::cycle(CYCLE);

/// The row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "emulated",
    reach: Reach::InProcess,
    port: None,
    options: &[CYCLE_MS],
    usage: &[Usage { address: "[?cycle_ms={cycle_ms}]", meaning: "in process" }],
    emulated_usage: &[],
    robot: Some(robot),
    sensor: Some(sensor),
    emulated_robot: None,
    emulated_sensor: None,
    configuration: None,
    opens_last: false,
};

fn robot(request: &LinkRequest) -> Result<Box<dyn RobotLink>, LinkError> {
    Ok(Box::new(EmulatedRobot::new(bench(request)?, request.index)))
}

fn sensor(request: &LinkRequest) -> Result<Box<dyn ForceSensor>, LinkError> {
    Ok(Box::new(EmulatedSensor::new(bench(request)?)))
}

fn bench<'a>(request: &LinkRequest<'a>) -> Result<&'a Rc<RefCell<InProcessRig>>, LinkError> {
    let missing = || LinkError::refused("there is no emulated facility in this process", "report this");
    request.context.bench.ok_or_else(missing)
}
