//! Rows of the protocol table: addresses, defaults, arming, constructors of both sides.

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

/// Side that opens the communication.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// No link: the device is emulated in this process.
    InProcess,
    /// We listen at the address, and the controller sends there. Arming requires that its host is known.
    Listens,
    /// We send to the address.
    Connects,
}

impl Reach {
    /// Returns why a robot may not be armed before its host is known; `None` if its address names it.
    pub fn unarmed_until_known(self) -> Option<&'static str> {
        match self {
            Self::Listens => Some("has no controller address: any host on the network could answer first"),
            Self::InProcess | Self::Connects => None,
        }
    }
}

/// An address form of a protocol in a help text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Usage {
    /// Text after `scheme://`; `{key}` stands for the default of an option.
    pub address: &'static str,
    /// Meaning.
    pub meaning: &'static str,
}

/// A protocol: one row of [`PROTOCOLS`](super::PROTOCOLS).
#[derive(Debug)]
pub struct ProtocolRow {
    /// Text of an address before `://`.
    pub scheme: &'static str,
    /// Side that opens the communication.
    pub reach: Reach,
    /// Default port; `None` for protocols without ports.
    pub port: Option<u16>,
    /// Options of an address, with their defaults; includes a robot's cycle.
    pub options: &'static [LinkOption],
    /// Address forms of our side, for the help of `softdock drive`.
    pub usage: &'static [Usage],
    /// Address forms of the emulated side, for the help of `softdock emulate`.
    pub emulated_usage: &'static [Usage],
    /// Opens our link to a robot, if this is a robot protocol.
    pub robot: Option<OpenRobot>,
    /// Opens our link to a sensor, if this is a sensor protocol.
    pub sensor: Option<OpenSensor>,
    /// Builds the emulated controller of a robot.
    pub emulated_robot: Option<EmulateRobot>,
    /// Builds the emulated electronics of a sensor.
    pub emulated_sensor: Option<EmulateSensor>,
    /// Creates the configuration file that a real controller needs for an address: name after `robotN_`, and text.
    pub configuration: Option<WriteConfiguration>,
    /// Whether its links open after all others: its devices need frames from then on.
    pub opens_last: bool,
}

/// Opens a link to a robot.
pub type OpenRobot = fn(&LinkRequest) -> Result<Box<dyn RobotLink>, LinkError>;
/// Opens a link to a sensor.
pub type OpenSensor = fn(&LinkRequest) -> Result<Box<dyn ForceSensor>, LinkError>;
/// Builds an emulated controller; the flag states whether its robot has a rail.
pub type EmulateRobot = fn(&LinkAddress, bool, Reporter) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError>;
/// Builds the electronics of an emulated sensor.
pub type EmulateSensor = fn(&LinkAddress) -> Result<EmulatedEnd<dyn SensorBox>, LinkError>;
/// Creates a controller's configuration for an address; the flag states whether its robot has a rail.
pub type WriteConfiguration = fn(&LinkAddress, bool, Reporter) -> Result<(&'static str, String), LinkError>;
/// Receives the notices of an opening.
pub type Reporter<'a> = &'a dyn Fn(LinkNotice);

/// Context of the links of a session.
pub struct LinkContext<'a> {
    /// Whether the commands will move real robots.
    pub armed: bool,
    /// The facility.
    pub station: &'a Station,
    /// The facility in this process, if a device is emulated.
    pub bench: Option<&'a Rc<RefCell<InProcessRig>>>,
    /// Receives the notices of an opening.
    pub report: Reporter<'a>,
}

/// Context of one link.
pub struct LinkRequest<'a> {
    /// The address.
    pub address: &'a LinkAddress,
    /// Robot 0 or 1; 0 for the sensor.
    pub index: usize,
    /// Context shared with the other links.
    pub context: &'a LinkContext<'a>,
}

impl LinkRequest<'_> {
    /// Returns the only accepted host: of the address, or of the facility file.
    pub(super) fn known_host(&self) -> Result<Option<IpAddr>, LinkError> {
        known_host(self.address, self.context.station, self.index)
    }

    /// Whether the robot has a rail.
    pub(super) fn rail(&self) -> bool {
        self.context.station.rail && self.index == 0
    }
}

/// Returns the only accepted host of robot 0 or 1: of its address, or of the facility file.
pub(super) fn known_host(address: &LinkAddress, station: &Station, index: usize) -> Result<Option<IpAddr>, LinkError> {
    let named = station.robots[index].address.as_ref().and_then(|address| address.parse().ok());
    Ok(address.from()?.or(named))
}

/// The emulated side of a link.
pub struct EmulatedEnd<T: ?Sized> {
    /// Controller or sensor electronics.
    pub device: Box<T>,
    /// Its port.
    pub port: UdpPort,
    /// A server beside the port; it ends on drop.
    pub server: Option<Box<dyn Any>>,
}

impl ProtocolRow {
    /// Returns an option by its key.
    pub fn option(&self, key: &str) -> Option<&'static LinkOption> {
        self.options.iter().find(|option| option.key == key)
    }

    /// Returns the addresses of our side, as lines `scheme://...   meaning`.
    pub fn usage_lines(&self) -> Vec<String> {
        self.lines(self.usage)
    }

    /// Returns the addresses of the emulated side, as lines `scheme://...   meaning`.
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

/// Notice of a link's opening.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkNotice {
    /// The sensor's identification.
    Sensor {
        /// Product.
        product: String,
        /// Serial number, if it states one.
        serial: Option<String>,
    },
    /// A controller's file has another port than the address.
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
    /// The sensor saturates below the session's limits.
    SaturatesFirst {
        /// Limits of force \[N\] and moment \[N m\].
        limits: [f64; 2],
        /// Range of the sensor \[N\], \[N m\].
        range: [f64; 2],
    },
}

impl LinkNotice {
    /// Whether the notice is a warning.
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
        let remedy = "another program uses this port, or the address does not belong to this machine: `ss -lunp` lists the programs";
        LinkError::refused(format!("cannot listen on {address}: {error}"), remedy)
    })
}

/// Binds any free port of this machine.
pub(super) fn anywhere() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0))
}

/// Binds any free port from which an address can be reached; for an address of this machine, on loopback only.
pub(super) fn towards(address: SocketAddr) -> SocketAddr {
    if address.ip().is_loopback() { SocketAddr::new(address.ip(), 0) } else { anywhere() }
}
