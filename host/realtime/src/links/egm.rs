//! ABB EGM: addresses, our link and the emulated controller.

use super::address::{FROM, LinkAddress, LinkOption};
use super::error::LinkError;
use super::row::{EmulatedEnd, LinkRequest, ProtocolRow, Reach, Reporter, Usage, bind, towards};
use crate::protocol::EmulatedController;
use crate::protocol::egm::controller::{EgmController, EgmSettings};
use crate::protocol::egm::driver::EgmRobot;
use crate::protocol::egm::{CYCLE, EGM_PORT};
use crate::signals::RobotLink;

const CYCLE_MS: LinkOption = LinkOption::cycle(CYCLE);

/// The protocol's row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "egm",
    reach: Reach::Listens,
    port: Some(EGM_PORT),
    options: &[FROM, CYCLE_MS],
    usage: &[Usage { address: "BIND:PORT[?from=IP&cycle_ms={cycle_ms}]", meaning: "ABB EGM, listens there" }],
    emulated_usage: &[Usage {
        address: "HOST:PORT[?cycle_ms={cycle_ms}]",
        meaning: "sends there, as an ABB controller does",
    }],
    robot: Some(robot),
    sensor: None,
    emulated_robot: Some(controller),
    emulated_sensor: None,
    configuration: None,
    opens_last: false,
};

fn robot(request: &LinkRequest) -> Result<Box<dyn RobotLink>, LinkError> {
    let (address, from) = (request.address, request.known_host()?);
    let port = bind(address.socket(EGM_PORT)?)?;
    Ok(Box::new(EgmRobot::new(port, address.cycle(&CYCLE_MS)?, request.rail(), from)))
}

fn controller(
    address: &LinkAddress,
    rail: bool,
    _: Reporter,
) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError> {
    let client = address.socket(EGM_PORT)?;
    let settings = EgmSettings { cycle: address.cycle(&CYCLE_MS)?, rail, ..EgmSettings::new(client) };
    Ok(EmulatedEnd { device: Box::new(EgmController::new(settings)), port: bind(towards(client))?, server: None })
}
