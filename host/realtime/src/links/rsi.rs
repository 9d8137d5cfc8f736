//! KUKA RSI: addresses, our link, the emulated controller and the controller's own configuration.

use super::address::{FROM, LinkAddress, LinkOption};
use super::error::LinkError;
use super::row::{EmulatedEnd, LinkNotice, LinkRequest, ProtocolRow, Reach, Reporter, Usage, bind, towards};
use crate::protocol::EmulatedController;
use crate::protocol::rsi::context::rsi_ethernet;
use crate::protocol::rsi::controller::{Krc, KrcSettings};
use crate::protocol::rsi::driver::RsiRobot;
use crate::protocol::rsi::ethernet_file::{RsiExpectation, read_rsi_ethernet};
use crate::protocol::rsi::tags::{Correction, TagMap};
use crate::protocol::rsi::{CYCLE, RSI_PORT};
use crate::signals::RobotLink;
use std::path::{Path, PathBuf};

const CYCLE_MS: LinkOption = LinkOption::cycle(CYCLE);
const TYPE: LinkOption = LinkOption::text("type", "ImFree");
const MODE: LinkOption = LinkOption::text("mode", "absolute");
const TAGS: LinkOption = LinkOption::text("tags", "rsi_ethernet.xml");
const TORQUE: LinkOption = LinkOption::text("torque", "GearTorque");

/// The protocol's row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "rsi",
    reach: Reach::Listens,
    port: Some(RSI_PORT),
    options: &[FROM, CYCLE_MS, TYPE, MODE, TAGS, TORQUE],
    usage: &[
        Usage {
            address: "BIND:PORT[?from=IP&cycle_ms={cycle_ms}&type=ImFree|KROSHU&mode=absolute|relative]",
            meaning: "KUKA RSI, listens there",
        },
        Usage {
            address: "BIND:PORT?tags=FILE[&torque=NAME&...]",
            meaning: "KUKA RSI, with the tag map of the controller's own rsi_ethernet.xml",
        },
    ],
    emulated_usage: &[
        Usage {
            address: "HOST:PORT[?cycle_ms={cycle_ms}&type=ImFree|KROSHU&mode=absolute|relative]",
            meaning: "sends there, as a KUKA controller does",
        },
        Usage {
            address: "HOST:PORT?tags=FILE[&torque=NAME&...]",
            meaning: "sends there, with the tag map of an rsi_ethernet.xml",
        },
    ],
    robot: Some(robot),
    sensor: None,
    emulated_robot: Some(controller),
    emulated_sensor: None,
    configuration: Some(configuration),
    opens_last: false,
};

fn robot(request: &LinkRequest) -> Result<Box<dyn RobotLink>, LinkError> {
    let (address, from) = (request.address, request.known_host()?);
    let tags = tag_map(address, request.rail(), request.context.report)?;
    Ok(Box::new(RsiRobot::new(bind(address.socket(RSI_PORT)?)?, tags, from)?))
}

fn controller(
    address: &LinkAddress,
    rail: bool,
    report: Reporter,
) -> Result<EmulatedEnd<dyn EmulatedController>, LinkError> {
    let client = address.socket(RSI_PORT)?;
    let settings = KrcSettings::new(tag_map(address, rail, report)?, client);
    Ok(EmulatedEnd { device: Box::new(Krc::new(settings)), port: bind(towards(client))?, server: None })
}

/// Returns the `rsi_ethernet.xml` of a controller that sends to an address.
fn configuration(address: &LinkAddress, rail: bool, report: Reporter) -> Result<(&'static str, String), LinkError> {
    let tags = tag_map(address, rail, report)?;
    Ok(("rsi_ethernet.xml", rsi_ethernet(&tags, address.socket(RSI_PORT)?)))
}

/// Returns the tag map of an address: of the controller's own file, or a predefined one.
fn tag_map(address: &LinkAddress, rail: bool, report: Reporter) -> Result<TagMap, LinkError> {
    let mode: String = address.option(&MODE)?.unwrap_or_else(|| "absolute".to_owned());
    let mode = match mode.as_str() {
        "absolute" => Correction::Absolute,
        "relative" => Correction::Relative,
        _ => {
            let what = format!("`mode={mode}` is not a kind of correction");
            return Err(LinkError::address(what, "write mode=absolute or mode=relative"));
        }
    };
    let (kind, file): (Option<String>, Option<PathBuf>) = (address.option(&TYPE)?, address.option(&TAGS)?);
    let torque: Option<String> = address.option(&TORQUE)?;
    let cycle = address.cycle(&CYCLE_MS)?;
    if let Some(file) = file {
        if let Some(kind) = kind {
            let what = format!("`type={kind}` beside `tags={}`", file.display());
            return Err(LinkError::address(what, "remove type: SENTYPE of the file states it"));
        }
        let expected = RsiExpectation { mode, cycle, rail, torque: torque.as_deref() };
        return tag_map_of(&file, address, &expected, report);
    }
    if let Some(torque) = torque {
        let what = format!("`torque={torque}` names an element, but no file is given");
        return Err(LinkError::address(what, "add tags=rsi_ethernet.xml"));
    }
    let kind = kind.unwrap_or_else(|| "ImFree".to_owned());
    let tags = match kind.as_str() {
        "ImFree" => TagMap::im_free(),
        "KROSHU" => TagMap::kroshu(),
        _ => {
            let remedy = "write type=ImFree, type=KROSHU, or tags=FILE with the controller's rsi_ethernet.xml";
            return Err(LinkError::address(format!("`type={kind}` is not a known tag map"), remedy));
        }
    };
    let tags = TagMap { mode, cycle, ..tags };
    Ok(if rail { tags.with_rail() } else { tags })
}

/// Reads the tag map of a controller's file; warns if the file has another port.
fn tag_map_of(
    file: &Path,
    address: &LinkAddress,
    expected: &RsiExpectation,
    report: Reporter,
) -> Result<TagMap, LinkError> {
    // A controller reads a few kilobytes.
    let text = softdock_input::read_text(file, 256 << 10).map_err(|error| {
        let remedy = "copy rsi_ethernet.xml from the controller's SensorInterface folder";
        LinkError::refused(format!("cannot read `{}`: {}", file.display(), error.what()), remedy)
    })?;
    let read = read_rsi_ethernet(&text, expected).map_err(|error| {
        let remedy = error.remedy.clone();
        LinkError::refused(format!("{}: {error}", file.display()), remedy)
    })?;
    let port = address.socket(RSI_PORT)?.port();
    if port != read.port {
        report(LinkNotice::OtherPort { file: file.to_owned(), sends: read.port, port });
    }
    Ok(read.tags)
}
