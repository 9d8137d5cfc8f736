//! What the table of protocols holds of each: addresses, defaults, who may be armed, how both sides are built.

use super::address::{LinkAddress, LinkOption};
use super::error::LinkError;
use crate::emulation::in_process::InProcessRig;
use crate::protocol::{EmulatedController, SensorBox};
use crate::signals::{ForceSensor, RobotLink};
use crate::wire::udp::UdpPort;
use softdock_campaign::Station;
use std::any::Any;
use std::cell::RefCell;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::rc::Rc;

/// Who begins to speak on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// There is no link: the device is emulated in this process.
    InProcess,
    /// We listen at the address, and the controller sends there. It must be known by its host before it is armed.
    Listens,
    /// We send to the address.
    Connects,
}

impl Reach {
    /// Why a robot may not be armed until it is known by its host; `None` if its address names it.
    pub fn unarmed_until_known(self) -> Option<&'static str> {
        match self {
            Self::Listens => Some("would take commands from whoever answers first"),
            Self::InProcess | Self::Connects => None,
        }
    }
}

/// An address of a protocol as a help text shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Usage {
    /// The part behind `scheme://`; `{key}` stands for the default of an option.
    pub address: &'static str,
    /// What it stands for.
    pub meaning: &'static str,
}

/// A protocol: one row of [`PROTOCOLS`](super::PROTOCOLS).
#[derive(Debug)]
pub struct ProtocolRow {
    /// The part of an address before `://`.
    pub scheme: &'static str,
    /// Who begins to speak.
    pub reach: Reach,
    /// Port if the address has none; `None` for protocols without ports.
    pub port: Option<u16>,
    /// Options of an address, with their defaults; a robot's cycle is among them.
    pub options: &'static [LinkOption],
    /// Addresses of our side, for the help of `softdock drive`.
    pub usage: &'static [Usage],
    /// Addresses of the emulated side, for the help of `softdock emulate`.
    pub emulated_usage: &'static [Usage],
    /// Opens our link to a robot, if the protocol is one of robots.
    pub robot: Option<OpenRobot>,
    /// Opens our link to a sensor, if the protocol is one of sensors.
    pub sensor: Option<OpenSensor>,
    /// Builds the emulated controller of a robot.
    pub emulated_robot: Option<EmulateRobot>,
    /// Builds the emulated electronics of a sensor.
    pub emulated_sensor: Option<EmulateSensor>,
    /// Writes the configuration that a real controller needs for an address: file name behind `robotN_`, and text.
    pub configuration: Option<WriteConfiguration>,
    /// Its links open after all others: its devices want frames from then on.
    pub opens_last: bool,
}

/// Opens a link to a robot.
pub type OpenRobot = fn(&LinkRequest) -> Result<Box<dyn RobotLink>, LinkError>;
/// Opens a link to a sensor.
pub type OpenSensor = fn(&LinkRequest) -> Result<Box<dyn ForceSensor>, LinkError>;
/// Builds an emulated controller; the flag states whether its robot stands on a rail.
pub type EmulateRobot = fn(&LinkAddress, bool, Reporter) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError>;
/// Builds the electronics of an emulated sensor.
pub type EmulateSensor = fn(&LinkAddress) -> Result<EmulatedEnd<dyn SensorBox>, LinkError>;
/// Writes a controller's configuration for an address; the flag states whether its robot stands on a rail.
pub type WriteConfiguration = fn(&LinkAddress, bool, Reporter) -> Result<(&'static str, String), LinkError>;
/// Takes what an opening reports.
pub type Reporter<'a> = &'a dyn Fn(LinkNotice);

/// What all links of a session are opened with.
pub struct LinkContext<'a> {
    /// The commands will move real robots.
    pub armed: bool,
    /// The facility.
    pub station: &'a Station,
    /// The facility in this process, if some device is emulated.
    pub bench: Option<&'a Rc<RefCell<InProcessRig>>>,
    /// Takes what the opening reports.
    pub report: Reporter<'a>,
}

/// What one link is opened with.
pub struct LinkRequest<'a> {
    /// The address.
    pub address: &'a LinkAddress,
    /// Robot 1 or 2 (0 or 1 here); 0 for the sensor.
    pub index: usize,
    /// What it shares with the other links.
    pub context: &'a LinkContext<'a>,
}

impl LinkRequest<'_> {
    /// The only host whose reports are taken: of the address, or of the facility file.
    pub(super) fn known_host(&self) -> Result<Option<IpAddr>, LinkError> {
        known_host(self.address, self.context.station, self.index)
    }

    /// Whether the robot stands on a rail.
    pub(super) fn rail(&self) -> bool {
        self.context.station.rail && self.index == 0
    }
}

/// The only host that a robot (0 or 1) may speak from: of its address, or of the facility file.
pub(super) fn known_host(address: &LinkAddress, station: &Station, index: usize) -> Result<Option<IpAddr>, LinkError> {
    let named = station.robots[index].address.as_ref().and_then(|address| address.parse().ok());
    Ok(address.from()?.or(named))
}

/// The emulated side of a link.
pub struct EmulatedEnd<T: ?Sized> {
    /// The controller or the electronics.
    pub device: Box<T>,
    /// The port that it speaks from.
    pub port: UdpPort,
    /// A server beside the port; it ends when this is dropped.
    pub server: Option<Box<dyn Any>>,
}

impl ProtocolRow {
    /// An option by its key.
    pub fn option(&self, key: &str) -> Option<&'static LinkOption> {
        self.options.iter().find(|option| option.key == key)
    }

    /// The addresses of our side, as lines `scheme://...   meaning`.
    pub fn usage_lines(&self) -> Vec<String> {
        self.lines(self.usage)
    }

    /// The addresses of the emulated side, as lines `scheme://...   meaning`.
    pub fn emulated_usage_lines(&self) -> Vec<String> {
        self.lines(self.emulated_usage)
    }

    fn lines(&self, usage: &[Usage]) -> Vec<String> {
        let filled = |text: &str| {
            self.options.iter().fold(text.to_owned(), |text, option| {
                let default = option.default.map_or_else(String::new, |default| default.to_string());
                text.replace(&format!("{{{}}}", option.key), &default)
            })
        };
        usage.iter().map(|line| format!("{}://{}   {}", self.scheme, filled(line.address), line.meaning)).collect()
    }
}

/// What the opening of a link reports besides its result.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkNotice {
    /// The sensor that has answered.
    Sensor {
        /// Product.
        product: String,
        /// Serial number, if it states one.
        serial: Option<String>,
    },
    /// A controller's file sends to another port than the address has.
    OtherPort {
        /// The controller's file.
        file: PathBuf,
        /// The port in the file.
        sends: u16,
        /// The port of the address.
        port: u16,
    },
    /// The drive of an axis coasts at a fault.
    Coasts {
        /// Robot, from 1.
        robot: usize,
        /// Axis, from 1.
        axis: usize,
    },
    /// The sensor saturates before the session's limits are met.
    SaturatesFirst {
        /// Limits of force \[N\] and moment \[N m\].
        limits: [f64; 2],
        /// Range of the sensor \[N\], \[N m\].
        range: [f64; 2],
    },
}

impl LinkNotice {
    /// Whether it is something to beware of.
    pub fn is_warning(&self) -> bool {
        match self {
            Self::Sensor { .. } => false,
            Self::OtherPort { .. } | Self::Coasts { .. } | Self::SaturatesFirst { .. } => true,
        }
    }
}

impl fmt::Display for LinkNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sensor { product, serial } => {
                write!(f, "  sensor    {product}, serial number {}", serial.as_deref().unwrap_or("none"))
            }
            Self::OtherPort { file, sends, port } => {
                write!(f, "warning: {} sends to port {sends}, and the address has port {port}", file.display())
            }
            Self::Coasts { robot, axis } => {
                write!(f, "warning: the drive of axis {axis} of robot {robot} coasts at a fault (object 605E is 0)")
            }
            Self::SaturatesFirst { limits, range } => write!(
                f,
                "the session's limits of {} N and {} N m are beyond the sensor's range of {:.0} N and {:.1} N m: it \
                 saturates first",
                limits[0], limits[1], range[0], range[1]
            ),
        }
    }
}

/// Listens on a local address.
pub(super) fn bind(address: SocketAddr) -> Result<UdpPort, LinkError> {
    UdpPort::bind(address).map_err(|error| {
        let remedy = "another program has this port, or the address is not of this machine: `ss -lunp` shows who";
        LinkError::refused(format!("cannot listen on {address}: {error}"), remedy)
    })
}

/// Any free port of this machine.
pub(super) fn anywhere() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0))
}

/// Any free port from which an address can be reached; nobody from outside reaches the one towards this machine itself.
pub(super) fn towards(address: SocketAddr) -> SocketAddr {
    if address.ip().is_loopback() { SocketAddr::new(address.ip(), 0) } else { anywhere() }
}
