//! Opens links at typed addresses, from one table of protocols with one row and one file each.
//!
//! Addresses, help texts, lists of schemes and the arming rule derive from [`PROTOCOLS`]; only the rows hold ports and
//! default cycles.

pub mod address;
mod egm;
mod emulated;
mod error;
mod ethercat;
mod fanuc;
mod netft;
pub mod row;
mod rsi;

pub use address::LinkAddress;
pub use error::LinkError;
pub use row::{EmulatedEnd, LinkContext, LinkNotice, LinkRequest, ProtocolRow, Reach, Reporter};

use crate::protocol::{EmulatedController, SensorBox};
use crate::signals::{ForceSensor, RobotLink};
use crate::time::Nanos;
use crate::wire::udp::UdpPort;
use softdock_campaign::Station;
use std::net::{Ipv4Addr, SocketAddr};

/// All protocols, in the order of the help texts.
pub const PROTOCOLS: [&ProtocolRow; 6] =
    [&rsi::ROW, &egm::ROW, &fanuc::ROW, &ethercat::ROW, &netft::ROW, &emulated::ROW];

/// An address whose protocol and options are in the table.
#[derive(Clone, Debug)]
pub struct CheckedAddress {
    address: LinkAddress,
    row: &'static ProtocolRow,
}

impl CheckedAddress {
    /// Parses the address of a robot, for our side of its link.
    ///
    /// # Errors
    /// If the text is no address, is no robot protocol, or has an unknown option.
    pub fn robot(text: &str) -> Result<Self, LinkError> {
        let remedy = || format!("robot protocols are {}", spoken(|row| row.robot.is_some()));
        Self::ours(text, "robot", |row| row.robot.is_some(), remedy)
    }

    /// Parses the address of a sensor, for our side of its link.
    ///
    /// # Errors
    /// As [`Self::robot`].
    pub fn sensor(text: &str) -> Result<Self, LinkError> {
        let remedy = || format!("sensor protocols are {}", spoken(|row| row.sensor.is_some()));
        Self::ours(text, "sensor", |row| row.sensor.is_some(), remedy)
    }

    fn ours(
        text: &str,
        device: &str,
        speaks: fn(&ProtocolRow) -> bool,
        remedy: impl Fn() -> String,
    ) -> Result<Self, LinkError> {
        let address = LinkAddress::parse(text)?;
        let what = format!("`{}://` is not a {device} protocol", address.scheme());
        let row = row_of(&address, speaks).ok_or_else(|| LinkError::address(what, remedy()))?;
        address.only(row.options.iter())?;
        Ok(Self { address, row })
    }

    /// Parses the address of a robot, for its emulated side.
    ///
    /// # Errors
    /// As [`Self::robot`], of the protocols with an emulated side.
    pub fn emulated_robot(text: &str) -> Result<Self, LinkError> {
        Self::theirs(text, "robot", |row| row.emulated_robot.is_some())
    }

    /// Parses the address of a sensor, for its emulated side.
    ///
    /// # Errors
    /// As [`Self::robot`], of the protocols with an emulated side.
    pub fn emulated_sensor(text: &str) -> Result<Self, LinkError> {
        Self::theirs(text, "sensor", |row| row.emulated_sensor.is_some())
    }

    fn theirs(text: &str, device: &str, speaks: fn(&ProtocolRow) -> bool) -> Result<Self, LinkError> {
        let address = LinkAddress::parse(text)?;
        let what = format!("`{}://` is not a {device} protocol with an emulated side", address.scheme());
        let remedy = || format!("write {}", joined(&schemes(speaks)));
        let row = row_of(&address, speaks).ok_or_else(|| LinkError::address(what, remedy()))?;
        address.only(row.options.iter().filter(|option| !option.ours_only))?;
        Ok(Self { address, row })
    }

    /// Returns the row of the protocol.
    pub fn row(&self) -> &'static ProtocolRow {
        self.row
    }

    /// Returns scheme and place, without options: `rsi://0.0.0.0:59152`.
    pub fn shown(&self) -> String {
        format!("{}://{}", self.row.scheme, self.address.place())
    }

    /// Whether the link is real.
    pub fn is_real(&self) -> bool {
        self.row.reach != Reach::InProcess
    }

    /// Returns the robot's cycle: of the address, or the protocol's default.
    ///
    /// # Errors
    /// If it is not between 0.1 and 100 ms, or the protocol has no cycle.
    pub fn cycle(&self) -> Result<Nanos, LinkError> {
        let missing =
            || LinkError::address(format!("{}:// has no cycle", self.row.scheme), "use the address of a robot");
        self.address.cycle(self.row.option("cycle_ms").ok_or_else(missing)?)
    }

    /// Opens the link to robot 0 or 1.
    ///
    /// # Errors
    /// If the link or the robot refuses.
    pub fn open_robot(&self, index: usize, context: &LinkContext) -> Result<Box<dyn RobotLink>, LinkError> {
        match self.row.robot {
            Some(open) => open(&LinkRequest { address: &self.address, index, context }),
            None => Err(LinkError::address(
                format!("`{}` is not the address of a robot", self.shown()),
                "use the address of a robot",
            )),
        }
    }

    /// Opens the link to the sensor.
    ///
    /// # Errors
    /// If the link or the sensor refuses.
    pub fn open_sensor(&self, context: &LinkContext) -> Result<Box<dyn ForceSensor>, LinkError> {
        match self.row.sensor {
            Some(open) => open(&LinkRequest { address: &self.address, index: 0, context }),
            None => Err(LinkError::address(
                format!("`{}` is not the address of a sensor", self.shown()),
                "use the address of a sensor",
            )),
        }
    }

    /// Builds the emulated controller of a robot, with or without a rail.
    ///
    /// # Errors
    /// If a port is taken, or the address lacks an option that the controller needs.
    pub fn emulate_robot(
        &self,
        rail: bool,
        report: Reporter,
    ) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError> {
        match self.row.emulated_robot {
            Some(emulate) => emulate(&self.address, rail, report),
            None => Err(LinkError::address(format!("`{}` has no emulated side", self.shown()), "use another protocol")),
        }
    }

    /// Builds the electronics of an emulated sensor.
    ///
    /// # Errors
    /// If a port is taken.
    pub fn emulate_sensor(&self) -> Result<EmulatedEnd<dyn SensorBox>, LinkError> {
        match self.row.emulated_sensor {
            Some(emulate) => emulate(&self.address),
            None => Err(LinkError::address(format!("`{}` has no emulated side", self.shown()), "use another protocol")),
        }
    }

    /// Returns the configuration file that the robot's controller needs for this address, if its protocol has one: name
    /// after `robotN_`, and text.
    ///
    /// # Errors
    /// If the address lacks an option that the configuration needs.
    pub fn configuration(&self, rail: bool, report: Reporter) -> Result<Option<(&'static str, String)>, LinkError> {
        self.row.configuration.map(|write| write(&self.address, rail, report)).transpose()
    }
}

/// Checks whether the robots at these addresses (robot 1, robot 2, sensor) may be armed.
///
/// # Errors
/// If no link is real, or a controller that calls us has no known host.
pub fn check_arming(all: &[CheckedAddress; 3], station: &Station) -> Result<(), LinkError> {
    if !all.iter().any(CheckedAddress::is_real) {
        return Err(LinkError::address("no robot can be armed: all links are emulated", "remove --arm"));
    }
    for (index, checked) in all[..2].iter().enumerate() {
        if let Some(why) = checked.row.reach.unarmed_until_known()
            && row::known_host(&checked.address, station, index)?.is_none()
        {
            let robot = index + 1;
            let remedy = format!("write robot{robot}.address in the facility file, or ?from=IP behind its address");
            return Err(LinkError::address(format!("robot {robot} {why}"), remedy));
        }
    }
    Ok(())
}

/// Opens an unreachable port on loopback: of an emulated device without an address.
///
/// # Errors
/// If this machine has no port left.
pub fn unreached_port() -> Result<UdpPort, LinkError> {
    row::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))
}

fn row_of(address: &LinkAddress, speaks: fn(&ProtocolRow) -> bool) -> Option<&'static ProtocolRow> {
    PROTOCOLS.into_iter().find(|row| row.scheme == address.scheme() && speaks(row))
}

/// Returns the schemes of a kind of protocols, as `scheme://`.
fn schemes(speaks: fn(&ProtocolRow) -> bool) -> Vec<String> {
    PROTOCOLS.iter().filter(|row| speaks(row)).map(|row| format!("{}://", row.scheme)).collect()
}

/// Returns the schemes with real links, and `or are emulated://`.
fn spoken(speaks: fn(&ProtocolRow) -> bool) -> String {
    let real = PROTOCOLS.iter().filter(|row| speaks(row) && row.reach != Reach::InProcess);
    let real: Vec<String> = real.map(|row| format!("{}://", row.scheme)).collect();
    format!("{} or are {}://", real.join(", "), emulated::ROW.scheme)
}

/// `a, b or c`.
fn joined(words: &[String]) -> String {
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests;
