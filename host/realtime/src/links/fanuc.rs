//! FANUC Stream Motion: addresses, our link with its arming over the Remote Motion Interface, the emulated controller.

use super::address::{LinkAddress, LinkOption};
use super::error::LinkError;
use super::row::{EmulatedEnd, LinkRequest, ProtocolRow, Reach, Reporter, Usage, bind, towards};
use crate::protocol::EmulatedController;
use crate::protocol::fanuc::armed::ArmedFanuc;
use crate::protocol::fanuc::controller::FanucController;
use crate::protocol::fanuc::driver::FanucRobot;
use crate::protocol::fanuc::rmi_server::RmiServer;
use crate::protocol::fanuc::{CYCLE, RMI_PORT, STREAM_PORT};
use crate::signals::RobotLink;
use std::net::SocketAddr;
use std::time::Duration;

/// Longest step of arming a controller: servo enabling, program start.
const ARMING_LIMIT: Duration = Duration::from_secs(10);
/// Protocol version of the emulated controller.
const EMULATED_VERSION: u32 = 3;
const CYCLE_MS: LinkOption = LinkOption::cycle(CYCLE);
const RMI: LinkOption = LinkOption::number("rmi", RMI_PORT as f64, "16001");

/// The protocol's row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "fanuc",
    reach: Reach::Connects,
    port: Some(STREAM_PORT),
    options: &[CYCLE_MS, RMI],
    usage: &[Usage {
        address: "HOST[:PORT][?cycle_ms={cycle_ms}&rmi={rmi}]",
        meaning: "FANUC Stream Motion; --arm starts its program over RMI",
    }],
    emulated_usage: &[Usage {
        address: "[BIND[:PORT]][?rmi={rmi}]",
        meaning: "listens there, without BIND on this machine alone",
    }],
    robot: Some(robot),
    sensor: None,
    emulated_robot: Some(controller),
    emulated_sensor: None,
    configuration: None,
    opens_last: false,
};

/// Opens the link to a robot; if armed, starts the program that follows the stream over the Remote Motion Interface.
fn robot(request: &LinkRequest) -> Result<Box<dyn RobotLink>, LinkError> {
    let address = request.address;
    let stream = address.socket(STREAM_PORT)?;
    let rmi = address.port(&RMI)?;
    let robot = FanucRobot::open(bind(towards(stream))?, stream, address.cycle(&CYCLE_MS)?)?;
    if !request.context.armed {
        return Ok(Box::new(robot.watched()));
    }
    let controller = SocketAddr::new(stream.ip(), rmi);
    let robot = ArmedFanuc::arm(robot, controller, ARMING_LIMIT).map_err(|error| {
        let remedy = "clear the alarm at the teach pendant, switch to AUTO, and start again; for another port write \
            fanuc://HOST?rmi=PORT";
        LinkError::refused(format!("robot {} at {controller} cannot be armed: {error}", request.index + 1), remedy)
    })?;
    Ok(Box::new(robot))
}

fn controller(address: &LinkAddress, _: bool, _: Reporter) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError> {
    let place = address.listening(STREAM_PORT)?;
    let rmi = address.port(&RMI)?;
    let server = RmiServer::start(SocketAddr::new(place.ip(), rmi)).map_err(|error| {
        let remedy = "select another port: fanuc://BIND?rmi=16002";
        LinkError::refused(format!("cannot serve RMI at {}:{rmi}: {error}", place.ip()), remedy)
    })?;
    let mut controller = FanucController::new(address.cycle(&CYCLE_MS)?, EMULATED_VERSION);
    controller.obey(server.remote());
    Ok(EmulatedEnd { device: Box::new(controller), port: bind(place)?, server: Some(Box::new(server)) })
}
