//! From typed addresses to links: one table of protocols, one row and one file each.
//!
//! Addresses, help texts, messages that list the known schemes and the rule of arming derive from [`PROTOCOLS`]; ports
//! and default cycles stand in the rows alone.

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

/// An address whose protocol is in the table and has all of its options.
#[derive(Clone, Debug)]
pub struct CheckedAddress {
    address: LinkAddress,
    row: &'static ProtocolRow,
}

impl CheckedAddress {
    /// The address of a robot, for our side of its link.
    ///
    /// # Errors
    /// If it is no address, no robot speaks its protocol, or the protocol does not have one of its options.
    pub fn robot(text: &str) -> Result<Self, LinkError> {
        let remedy = || format!("robots speak {}", spoken(|row| row.robot.is_some()));
        Self::ours(text, "robot", |row| row.robot.is_some(), remedy)
    }

    /// The address of a sensor, for our side of its link.
    ///
    /// # Errors
    /// As [`Self::robot`].
    pub fn sensor(text: &str) -> Result<Self, LinkError> {
        let remedy = || format!("sensors speak {}", spoken(|row| row.sensor.is_some()));
        Self::ours(text, "sensor", |row| row.sensor.is_some(), remedy)
    }

    fn ours(
        text: &str,
        device: &str,
        speaks: fn(&ProtocolRow) -> bool,
        remedy: impl Fn() -> String,
    ) -> Result<Self, LinkError> {
        let address = LinkAddress::parse(text)?;
        let what = format!("`{}://` is no {device}'s protocol", address.scheme());
        let row = row_of(&address, speaks).ok_or_else(|| LinkError::address(what, remedy()))?;
        address.only(row.options.iter())?;
        Ok(Self { address, row })
    }

    /// The address of a robot, for its emulated side.
    ///
    /// # Errors
    /// As [`Self::robot`], of the protocols with an emulated side.
    pub fn emulated_robot(text: &str) -> Result<Self, LinkError> {
        Self::theirs(text, "robot", |row| row.emulated_robot.is_some())
    }

    /// The address of a sensor, for its emulated side.
    ///
    /// # Errors
    /// As [`Self::robot`], of the protocols with an emulated side.
    pub fn emulated_sensor(text: &str) -> Result<Self, LinkError> {
        Self::theirs(text, "sensor", |row| row.emulated_sensor.is_some())
    }

    fn theirs(text: &str, device: &str, speaks: fn(&ProtocolRow) -> bool) -> Result<Self, LinkError> {
        let address = LinkAddress::parse(text)?;
        let what = format!("`{}://` is no {device}'s protocol here", address.scheme());
        let remedy = || format!("write {}", joined(&schemes(speaks)));
        let row = row_of(&address, speaks).ok_or_else(|| LinkError::address(what, remedy()))?;
        address.only(row.options.iter().filter(|option| !option.ours_only))?;
        Ok(Self { address, row })
    }

    /// The protocol.
    pub fn row(&self) -> &'static ProtocolRow {
        self.row
    }

    /// Scheme and place, without options: `rsi://0.0.0.0:59152`.
    pub fn shown(&self) -> String {
        format!("{}://{}", self.row.scheme, self.address.place())
    }

    /// Whether there is a real link.
    pub fn is_real(&self) -> bool {
        self.row.reach != Reach::InProcess
    }

    /// The robot's cycle: of the address, or the protocol's own.
    ///
    /// # Errors
    /// If it is not between 0.1 and 100 ms, or the protocol has no cycle.
    pub fn cycle(&self) -> Result<Nanos, LinkError> {
        let missing = || LinkError::address(format!("{}:// has no cycle", self.row.scheme), "name a robot's address");
        self.address.cycle(self.row.option("cycle_ms").ok_or_else(missing)?)
    }

    /// Opens the link to robot 1 or 2 (0 or 1 here).
    ///
    /// # Errors
    /// If the link or the robot refuses.
    pub fn open_robot(&self, index: usize, context: &LinkContext) -> Result<Box<dyn RobotLink>, LinkError> {
        match self.row.robot {
            Some(open) => open(&LinkRequest { address: &self.address, index, context }),
            None => Err(LinkError::address(format!("`{}` is no robot's address", self.shown()), "name a robot's")),
        }
    }

    /// Opens the link to the sensor.
    ///
    /// # Errors
    /// If the link or the sensor refuses.
    pub fn open_sensor(&self, context: &LinkContext) -> Result<Box<dyn ForceSensor>, LinkError> {
        match self.row.sensor {
            Some(open) => open(&LinkRequest { address: &self.address, index: 0, context }),
            None => Err(LinkError::address(format!("`{}` is no sensor's address", self.shown()), "name a sensor's")),
        }
    }

    /// Builds the emulated controller of a robot, on a rail or not.
    ///
    /// # Errors
    /// If a port is taken, or the address does not state what the controller needs.
    pub fn emulate_robot(
        &self,
        rail: bool,
        report: Reporter,
    ) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError> {
        match self.row.emulated_robot {
            Some(emulate) => emulate(&self.address, rail, report),
            None => Err(LinkError::address(format!("`{}` has no emulated side", self.shown()), "write another")),
        }
    }

    /// Builds the electronics of an emulated sensor.
    ///
    /// # Errors
    /// If a port is taken.
    pub fn emulate_sensor(&self) -> Result<EmulatedEnd<dyn SensorBox>, LinkError> {
        match self.row.emulated_sensor {
            Some(emulate) => emulate(&self.address),
            None => Err(LinkError::address(format!("`{}` has no emulated side", self.shown()), "write another")),
        }
    }

    /// The configuration that the robot's controller needs for this address, if its protocol has one: file name behind
    /// `robotN_`, and text.
    ///
    /// # Errors
    /// If the address does not state what the configuration needs.
    pub fn configuration(&self, rail: bool, report: Reporter) -> Result<Option<(&'static str, String)>, LinkError> {
        self.row.configuration.map(|write| write(&self.address, rail, report)).transpose()
    }
}

/// Checks whether the robots at these addresses (robot 1, robot 2, sensor) may be armed.
///
/// # Errors
/// If no link is real, or a controller that calls us is not known by its host.
pub fn check_arming(all: &[CheckedAddress; 3], station: &Station) -> Result<(), LinkError> {
    if !all.iter().any(CheckedAddress::is_real) {
        return Err(LinkError::address("nothing here can be armed: all links are emulated", "leave --arm away"));
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

/// A port that nobody sends to, and that no other machine reaches: of an emulated device without an address.
///
/// # Errors
/// If this machine has no port left.
pub fn unreached_port() -> Result<UdpPort, LinkError> {
    row::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))
}

fn row_of(address: &LinkAddress, speaks: fn(&ProtocolRow) -> bool) -> Option<&'static ProtocolRow> {
    PROTOCOLS.into_iter().find(|row| row.scheme == address.scheme() && speaks(row))
}

/// Schemes of the protocols of a kind, as `scheme://`.
fn schemes(speaks: fn(&ProtocolRow) -> bool) -> Vec<String> {
    PROTOCOLS.iter().filter(|row| speaks(row)).map(|row| format!("{}://", row.scheme)).collect()
}

/// The same of protocols with real links, and `or are emulated://`.
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
