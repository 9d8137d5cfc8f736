//! ATI Net F/T: addresses, our link with the check of the box, and the emulated box.

use super::address::{LinkAddress, LinkOption};
use super::error::LinkError;
use super::row::{EmulatedEnd, LinkNotice, LinkRequest, ProtocolRow, Reach, Reporter, Usage, anywhere, bind};
use crate::protocol::SensorBox;
use crate::protocol::netft::calibration::NetFtCalibration;
use crate::protocol::netft::driver::{NetFt, NetFtSettings, OnSilence};
use crate::protocol::netft::http::{CalibrationServer, fetch_calibration};
use crate::protocol::netft::sensor_box::NetBox;
use crate::protocol::netft::{HTTP_PORT, RATE_HZ, RDT_PORT};
use crate::signals::ForceSensor;
use crate::time::Nanos;
use softdock_campaign::Station;
use std::net::SocketAddr;
use std::time::Duration;

/// Silence after which the link counts as dead, in ms; the limit on the sample age stops a run long before.
const LEAST_SILENCE: i64 = 100;
/// Longest wait for the calibration of a Net Box.
const CALIBRATION_LIMIT: Duration = Duration::from_secs(5);
/// Counts of the emulated box per newton and newton metre.
const COUNTS: f64 = 1e6;
const HTTP: LinkOption = LinkOption::number("http", HTTP_PORT as f64, "80");
const RATE: LinkOption = LinkOption::number("rate_hz", RATE_HZ, "1000");

/// The protocol's row.
pub(super) const ROW: ProtocolRow = ProtocolRow {
    scheme: "netft",
    reach: Reach::Connects,
    port: Some(RDT_PORT),
    options: &[HTTP, RATE],
    usage: &[Usage { address: "HOST[:PORT][?http={http}&rate_hz={rate_hz}]", meaning: "ATI Net F/T" }],
    emulated_usage: &[Usage {
        address: "[BIND[:PORT]][?http={http}&rate_hz={rate_hz}]",
        meaning: "listens there, without BIND on this machine alone",
    }],
    robot: None,
    sensor: Some(sensor),
    emulated_robot: None,
    emulated_sensor: Some(sensor_box),
    configuration: None,
    opens_last: false,
};

fn sensor(request: &LinkRequest) -> Result<Box<dyn ForceSensor>, LinkError> {
    let place = request.address.socket(RDT_PORT)?;
    let http = request.address.port(&HTTP)?;
    let rate = request.address.number(&RATE)?;
    let calibration = fetch_calibration(SocketAddr::new(place.ip(), http), CALIBRATION_LIMIT).map_err(|error| {
        LinkError::refused(
            format!("the Net Box at {} does not report its calibration: {error}", place.ip()),
            "switch it on; if its HTTP port is not 80, write netft://HOST?http=PORT",
        )
    })?;
    check_box(&calibration, request.context.station, request.context.report)?;
    let period = Nanos::from_seconds(1.0 / rate.clamp(1.0, 1e5));
    let mut settings = NetFtSettings::new(place, calibration, period);
    settings.silence = Nanos(settings.silence.0.max(Nanos::from_millis(LEAST_SILENCE).0));
    settings.on_silence = if request.context.armed { OnSilence::Stop } else { OnSilence::Request };
    Ok(Box::new(NetFt::start(bind(anywhere())?, settings)?))
}

/// Checks that the box is the one of the facility file, and sends untransformed measurements.
fn check_box(calibration: &NetFtCalibration, station: &Station, report: Reporter) -> Result<(), LinkError> {
    let NetFtCalibration { product, serial, .. } = calibration;
    report(LinkNotice::Sensor { product: product.clone(), serial: serial.clone() });
    if let Some(wanted) = station.sensor_serial.as_deref().filter(|wanted| Some(*wanted) != serial.as_deref()) {
        let stated = serial.as_deref().unwrap_or("none");
        let what = format!("the sensor states serial number {stated}, the facility file {wanted}");
        let remedy = "connect the right sensor, or correct serial in [sensor] of the facility file";
        return Err(LinkError::refused(what, remedy));
    }
    if let (true, Some(transform)) = (calibration.is_transformed(), calibration.transform) {
        let what = format!("the Net Box transforms its measurements by its tool transformation {transform:?}");
        let remedy = "set the transformation of its active configuration to zero; the frame of the sensor is \
                      position and rotation of [sensor] in the facility file";
        return Err(LinkError::refused(what, remedy));
    }
    let limits = [station.rules.force, station.rules.moment];
    if let Some(range) = calibration.range().filter(|range| range[0] < limits[0] || range[1] < limits[1]) {
        report(LinkNotice::SaturatesFirst { limits, range });
    }
    Ok(())
}

fn sensor_box(address: &LinkAddress) -> Result<EmulatedEnd<dyn SensorBox>, LinkError> {
    let calibration = NetFtCalibration::new(COUNTS, COUNTS)?;
    let place = address.listening(RDT_PORT)?;
    let http = address.port(&HTTP)?;
    let rate = address.number(&RATE)?;
    let server = CalibrationServer::start(SocketAddr::new(place.ip(), http), &calibration).map_err(|error| {
        LinkError::refused(
            format!("cannot serve HTTP on port {http}: {error}"),
            "select another port: netft://BIND?http=8080",
        )
    })?;
    let period = Nanos::from_seconds(1.0 / rate.clamp(1.0, 1e4));
    let device = Box::new(NetBox::new(calibration, period));
    Ok(EmulatedEnd { device, port: bind(place)?, server: Some(Box::new(server)) })
}
