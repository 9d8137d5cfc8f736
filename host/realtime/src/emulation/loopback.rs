//! An emulated facility and our drivers, connected by sockets on the loopback interface: RSI twice, and Net F/T.

use super::facility::EmulatedFacility;
use super::server::Sockets;
use super::world::World;
use crate::clock::{Clock, Monotonic};
use crate::protocol::EmulatedController;
use crate::protocol::netft::calibration::NetFtCalibration;
use crate::protocol::netft::driver::{NetFt, NetFtSettings};
use crate::protocol::netft::sensor_box::NetBox;
use crate::protocol::rsi::controller::{Krc, KrcSettings};
use crate::protocol::rsi::driver::RsiRobot;
use crate::protocol::rsi::tags::TagMap;
use crate::signals::LinkFault;
use crate::signals::Links;
use crate::time::Nanos;
use crate::wire::udp::UdpPort;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};

/// Counts per newton and per newton metre: the factory setting of a Net Box.
const COUNTS: f64 = 1e6;
/// Period of the sensor's records.
const SAMPLES: Nanos = Nanos::from_millis(1);
/// A silence longer than any scheduling delay.
const SILENCE: Nanos = Nanos::from_millis(1000);

/// Creates a facility on free ports, and our links to it; robot 2's cycles begin half a cycle after robot 1's.
///
/// Must be served ([`serve`](super::server::serve)) at once: the links wait for it. The cycle is a whole number of
/// milliseconds, IPOC's unit.
///
/// # Errors
/// If the machine has no free sockets.
pub fn rsi(world: World, cycle: Nanos) -> Result<(EmulatedFacility, Sockets, Links), LinkFault> {
    let tags = || TagMap { cycle, ..TagMap::im_free().with_rail() };
    let [theirs_1, theirs_2, theirs_3] = [bind()?, bind()?, bind()?];
    let [ours_1, ours_2, ours_3] = [bind()?, bind()?, bind()?];
    let krc =
        |client: SocketAddr| -> Box<dyn EmulatedController> { Box::new(Krc::new(KrcSettings::new(tags(), client))) };
    let controllers = [krc(ours_1.local_address()?), krc(ours_2.local_address()?)];
    let calibration = NetFtCalibration::new(COUNTS, COUNTS).map_err(|_| LinkFault::Mismatch("a calibration"))?;
    let sensor = Box::new(NetBox::new(calibration.clone(), SAMPLES));
    let settings =
        NetFtSettings { silence: SILENCE, ..NetFtSettings::new(theirs_3.local_address()?, calibration, SAMPLES) };
    let facility = EmulatedFacility::new(world, controllers, sensor, Monotonic.now(), Nanos(cycle.0 / 2));
    let from = |port: &UdpPort| port.local_address().map(|address| Some(address.ip()));
    let (host_1, host_2) = (from(&theirs_1)?, from(&theirs_2)?);
    let links = Links {
        robots: [Box::new(RsiRobot::new(ours_1, tags(), host_1)?), Box::new(RsiRobot::new(ours_2, tags(), host_2)?)],
        sensor: Box::new(NetFt::start(ours_3, settings)?),
    };
    Ok((facility, Sockets { ports: [theirs_1, theirs_2, theirs_3] }, links))
}

fn bind() -> io::Result<UdpPort> {
    UdpPort::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))
}
