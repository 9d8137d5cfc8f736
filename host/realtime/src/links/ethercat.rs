//! EtherCAT with CiA 402 drives: addresses and our link; there is no emulated side.

use super::address::LinkOption;
use super::error::LinkError;
use super::row::{LinkNotice, LinkRequest, ProtocolRow, Reach, Usage};
use crate::protocol::ethercat::{AxisScale, CYCLE, EtherCatConfig, EtherCatRobot};
use crate::signals::RobotLink;
use softdock_campaign::Station;

const CYCLE_MS: LinkOption = LinkOption::cycle(CYCLE);

/// The protocol's row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "ethercat",
    reach: Reach::Connects,
    port: None,
    options: &[CYCLE_MS],
    usage: &[Usage {
        address: "INTERFACE[?cycle_ms={cycle_ms}]",
        meaning: "CiA 402 drives; [robotN.ethercat] of the facility file states their counts",
    }],
    emulated_usage: &[],
    robot: Some(robot),
    sensor: None,
    emulated_robot: None,
    emulated_sensor: None,
    configuration: None,
    opens_last: true,
};

fn robot(request: &LinkRequest) -> Result<Box<dyn RobotLink>, LinkError> {
    let LinkRequest { address, index, context } = request;
    let config = EtherCatConfig { cycle: address.cycle(&CYCLE_MS)?, ..segment(context.station, *index)? };
    let opened = EtherCatRobot::open(address.place(), &config)?;
    for (axis, _) in opened.stop_options().filter(|(_, options)| options.fault == Some(0)) {
        (context.report)(LinkNotice::Coasts { robot: index + 1, axis: axis + 1 });
    }
    Ok(Box::new(opened))
}

/// Returns the drives of a robot's EtherCAT segment, from the facility file.
fn segment(station: &Station, index: usize) -> Result<EtherCatConfig, LinkError> {
    let drives = &station.robots[index].drives;
    if drives.is_empty() {
        let what = format!("the facility file does not state the drive counts of robot {}", index + 1);
        return Err(LinkError::address(what, format!("add a table [robot{}.ethercat] with counts = [...]", index + 1)));
    }
    let scales = drives.iter().zip(&station.limits).map(|((counts, zero), limit)| AxisScale {
        reversed: *counts < 0.0,
        zero: *zero,
        velocity: limit.speed,
        ..AxisScale::new(counts.abs())
    });
    Ok(EtherCatConfig::new(&scales.collect::<Vec<_>>()))
}
