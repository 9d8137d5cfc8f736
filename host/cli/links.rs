//! From typed addresses to open links: real robots and sensors, or emulated ones in process.

use crate::address::Address;
use crate::words::{refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_campaign::Station;
use softdock_realtime::clock::{Clock, Monotonic};
use softdock_realtime::drive::session::Links;
use softdock_realtime::emulation::in_process::{Bench, EmulatedRobot, EmulatedSensor};
use softdock_realtime::emulation::world::World;
use softdock_realtime::protocol::egm::driver::EgmRobot;
use softdock_realtime::protocol::ethercat::EtherCatRobot;
use softdock_realtime::protocol::ethercat::config::EtherCatConfig;
use softdock_realtime::protocol::ethercat::scale::AxisScale;
use softdock_realtime::protocol::fanuc::RMI_PORT;
use softdock_realtime::protocol::fanuc::armed::ArmedFanuc;
use softdock_realtime::protocol::fanuc::driver::FanucRobot;
use softdock_realtime::protocol::netft::calibration::Calibration;
use softdock_realtime::protocol::netft::driver::{NetFt, NetFtSettings, OnSilence};
use softdock_realtime::protocol::netft::http::fetch_calibration;
use softdock_realtime::protocol::rsi::context::rsi_ethernet;
use softdock_realtime::protocol::rsi::driver::RsiRobot;
use softdock_realtime::protocol::rsi::ethernet_file::{Expected, read_rsi_ethernet};
use softdock_realtime::protocol::rsi::tags::{Correction, TagMap};
use softdock_realtime::signals::{ForceSensor, Robot};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use std::cell::RefCell;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// Silence after which the link counts as dead, in ms; the age of its samples stops a run long before.
const LEAST_SILENCE: i64 = 100;
/// Time for a Net Box to tell its calibration.
const CALIBRATION_LIMIT: Duration = Duration::from_secs(5);
/// Longest step of arming a FANUC controller: servos that come up, a program that starts.
const ARMING_LIMIT: Duration = Duration::from_secs(10);
/// Port that RSI controllers send to unless told otherwise (49152 is Net F/T's).
pub(crate) const RSI_PORT: u16 = 59152;
/// RDT port of a Net Box.
pub(crate) const RDT_PORT: u16 = 49152;
/// Port of ABB's EGM.
pub(crate) const EGM_PORT: u16 = 6510;
/// Port of FANUC's Stream Motion.
pub(crate) const FANUC_PORT: u16 = 60015;

/// The three addresses of a facility.
#[derive(Clone, Debug)]
pub(crate) struct Addresses {
    /// Robot 1, robot 2, sensor.
    pub(crate) all: [Address; 3],
}

impl Addresses {
    /// Reads them.
    pub(crate) fn parse(robot1: &str, robot2: &str, ft: &str) -> miette::Result<Self> {
        Ok(Self { all: [Address::parse(robot1)?, Address::parse(robot2)?, Address::parse(ft)?] })
    }

    /// Names of the real links, by what they are reached at; for the locks.
    pub(crate) fn real(&self) -> Vec<String> {
        let real = self.all.iter().filter(|address| address.scheme != "emulated");
        real.map(|Address { scheme, place, .. }| format!("{scheme}://{place}")).collect()
    }

    /// Whether any of them is a real link.
    pub(crate) fn any_real(&self) -> bool {
        self.all.iter().any(|address| address.scheme != "emulated")
    }

    /// Cycle of robot 1, which gives the beat.
    pub(crate) fn cycle(&self) -> miette::Result<Nanos> {
        match self.all[0].scheme.as_str() {
            "emulated" | "ethercat" => self.all[0].cycle(1.0),
            "fanuc" => self.all[0].cycle(8.0),
            _ => self.all[0].cycle(4.0),
        }
    }
}

/// Options of an RSI address, beside the host that may speak.
pub(crate) const RSI_OPTIONS: [&str; 5] = ["cycle_ms", "type", "mode", "tags", "torque"];

/// The tag map that an address asks for: the controller's own file, or one of the usual ones.
pub(crate) fn tag_map(address: &Address, rail: bool) -> miette::Result<TagMap> {
    let mode: String = address.option("mode", "absolute")?.unwrap_or_else(|| "absolute".to_owned());
    let mode = match mode.as_str() {
        "absolute" => Correction::Absolute,
        "relative" => Correction::Relative,
        _ => {
            return Err(refuse(
                format!("`mode={mode}` is no kind of correction"),
                "write mode=absolute or mode=relative",
            ));
        }
    };
    let (kind, file): (Option<String>, Option<PathBuf>) =
        (address.option("type", "ImFree")?, address.option("tags", "rsi_ethernet.xml")?);
    let torque: Option<String> = address.option("torque", "GearTorque")?;
    let cycle = address.cycle(4.0)?;
    if let Some(file) = file {
        if let Some(kind) = kind {
            let remedy = "leave type away: SENTYPE of the file says it";
            return Err(refuse(format!("`type={kind}` beside `tags={}`", file.display()), remedy));
        }
        let expected = Expected { mode, cycle, rail, torque: torque.as_deref() };
        return tag_map_of(&file, address, &expected);
    }
    if let Some(torque) = torque {
        return Err(refuse(format!("`torque={torque}` names an element of no file"), "add tags=rsi_ethernet.xml"));
    }
    let kind = kind.unwrap_or_else(|| "ImFree".to_owned());
    let tags = match kind.as_str() {
        "ImFree" => TagMap::im_free(),
        "KROSHU" => TagMap::kroshu(),
        _ => {
            let remedy = "write type=ImFree, type=KROSHU, or tags=FILE with the controller's rsi_ethernet.xml";
            return Err(refuse(format!("`type={kind}` is no known tag map"), remedy));
        }
    };
    let tags = TagMap { mode, cycle, ..tags };
    Ok(if rail { tags.with_rail() } else { tags })
}

/// The tag map of a controller's file; a warning if the file sends to another port.
fn tag_map_of(file: &Path, address: &Address, expected: &Expected) -> miette::Result<TagMap> {
    // A controller reads a few kilobytes.
    let text = softdock_input::read_text(file, 256 << 10).map_err(|error| {
        let remedy = "copy rsi_ethernet.xml from the controller's SensorInterface folder";
        refuse(format!("cannot read `{}`: {}", file.display(), error.what()), remedy)
    })?;
    let read = read_rsi_ethernet(&text, expected).map_err(|error| {
        let remedy = error.remedy.clone();
        refuse(format!("{}: {error}", file.display()), remedy)
    })?;
    let port = address.socket(RSI_PORT)?.port();
    if port != read.port {
        let file = file.display();
        warn(format!("warning: {file} sends to port {}, and the address has port {port}", read.port));
    }
    Ok(read.tags)
}

/// What the controllers of the RSI robots must be told: file names and contents.
pub(crate) fn rsi_configurations(addresses: &Addresses, station: &Station) -> miette::Result<Vec<(String, String)>> {
    let robots = addresses.all[..2].iter().enumerate().filter(|(_, address)| address.scheme == "rsi");
    robots
        .map(|(index, address)| {
            let tags = tag_map(address, station.rail && index == 0)?;
            let text = rsi_ethernet(&tags, address.socket(RSI_PORT)?);
            Ok((format!("robot{}_rsi_ethernet.xml", index + 1), text))
        })
        .collect()
}

/// Listens on a local address.
pub(crate) fn bind(address: SocketAddr) -> miette::Result<UdpPort> {
    UdpPort::bind(address).map_err(|error| {
        let remedy = "another program has this port, or the address is not of this machine: `ss -lunp` shows who";
        refuse(format!("cannot listen on {address}: {error}"), remedy)
    })
}

/// Any free port of this machine.
pub(crate) fn anywhere() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0))
}

/// Any free port from which an address can be reached; nobody from outside reaches the one towards this machine itself.
pub(crate) fn towards(address: SocketAddr) -> SocketAddr {
    if address.ip().is_loopback() { SocketAddr::new(address.ip(), 0) } else { anywhere() }
}

/// Opens the link to robot 1 or 2 (0 or 1 here).
fn robot(
    address: &Address,
    index: usize,
    armed: bool,
    station: &Station,
    bench: Option<&Rc<RefCell<Bench>>>,
) -> miette::Result<Box<dyn Robot>> {
    let rail = station.rail && index == 0;
    // Commands are taken from the robot that the facility file names.
    let named = station.robots[index].address.as_ref().and_then(|address| address.parse().ok());
    let from = address.from()?.or(named);
    match (address.scheme.as_str(), bench) {
        ("emulated", Some(bench)) => Ok(Box::new(EmulatedRobot::new(bench, index))),
        ("rsi", _) => {
            address.only(&[&["from"], RSI_OPTIONS.as_slice()].concat())?;
            let tags = tag_map(address, rail)?;
            let robot = RsiRobot::new(bind(address.socket(RSI_PORT)?)?, tags, from);
            Ok(Box::new(robot.into_diagnostic()?))
        }
        ("egm", _) => {
            address.only(&["from", "cycle_ms"])?;
            let port = bind(address.socket(EGM_PORT)?)?;
            Ok(Box::new(EgmRobot::new(port, address.cycle(4.0)?, rail, from)))
        }
        ("fanuc", _) => fanuc(address, index, armed),
        ("ethercat", _) => {
            address.only(&["cycle_ms"])?;
            let config = EtherCatConfig { cycle: address.cycle(1.0)?, ..segment(station, index)? };
            let opened = EtherCatRobot::open(&address.place, &config).into_diagnostic()?;
            for (axis, _) in opened.stop_options().filter(|(_, options)| options.fault == Some(0)) {
                let (robot, axis) = (index + 1, axis + 1);
                warn(format!(
                    "warning: the drive of axis {axis} of robot {robot} coasts at a fault (object 605E is 0)"
                ));
            }
            Ok(Box::new(opened))
        }
        (other, _) => {
            let remedy = "robots speak rsi://, egm://, fanuc://, ethercat:// or are emulated://";
            Err(refuse(format!("`{other}://` is no robot's protocol"), remedy))
        }
    }
}

/// A FANUC arm; armed, its program that follows the stream is started over the Remote Motion Interface.
fn fanuc(address: &Address, index: usize, armed: bool) -> miette::Result<Box<dyn Robot>> {
    address.only(&["cycle_ms", "rmi"])?;
    let stream = address.socket(FANUC_PORT)?;
    let rmi: u16 = address.option("rmi", "16001")?.unwrap_or(RMI_PORT);
    let robot = FanucRobot::open(bind(towards(stream))?, stream, address.cycle(8.0)?).into_diagnostic()?;
    if !armed {
        return Ok(Box::new(robot.watched()));
    }
    let controller = SocketAddr::new(stream.ip(), rmi);
    let robot = ArmedFanuc::arm(robot, controller, ARMING_LIMIT).map_err(|error| {
        let remedy = "clear what it says at its teach pendant, switch to AUTO, and begin again; another port is \
            fanuc://HOST?rmi=PORT";
        refuse(format!("robot {} at {controller} cannot be armed: {error}", index + 1), remedy)
    })?;
    Ok(Box::new(robot))
}

/// The drives of a robot's EtherCAT segment, as the facility file has them.
fn segment(station: &Station, index: usize) -> miette::Result<EtherCatConfig> {
    let drives = &station.robots[index].drives;
    if drives.is_empty() {
        let message = format!("the facility file does not say what the drives of robot {} count", index + 1);
        return Err(refuse(message, format!("add a table [robot{}.ethercat] with counts = [...]", index + 1)));
    }
    let scales = drives.iter().zip(&station.limits).map(|((counts, zero), limit)| AxisScale {
        reversed: *counts < 0.0,
        zero: *zero,
        velocity: limit.speed,
        ..AxisScale::new(counts.abs())
    });
    Ok(EtherCatConfig::new(&scales.collect::<Vec<_>>()))
}

/// Opens the link to the sensor.
fn sensor(
    address: &Address,
    armed: bool,
    station: &Station,
    bench: Option<&Rc<RefCell<Bench>>>,
) -> miette::Result<Box<dyn ForceSensor>> {
    match (address.scheme.as_str(), bench) {
        ("emulated", Some(bench)) => Ok(Box::new(EmulatedSensor::new(bench))),
        ("netft", _) => {
            address.only(&["http", "rate_hz"])?;
            let place = address.socket(RDT_PORT)?;
            let http: u16 = address.option("http", "80")?.unwrap_or(80);
            let rate: f64 = address.option("rate_hz", "1000")?.unwrap_or(1000.0);
            let calibration =
                fetch_calibration(SocketAddr::new(place.ip(), http), CALIBRATION_LIMIT).map_err(|error| {
                    refuse(
                        format!("the Net Box at {} does not tell its calibration: {error}", place.ip()),
                        "is it switched on, and is its HTTP port 80? otherwise write netft://HOST?http=PORT",
                    )
                })?;
            check_box(&calibration, station)?;
            let period = Nanos::from_seconds(1.0 / rate.clamp(1.0, 1e5));
            let mut settings = NetFtSettings::new(place, calibration, period);
            settings.silence = Nanos(settings.silence.0.max(Nanos::from_millis(LEAST_SILENCE).0));
            settings.on_silence = if armed { OnSilence::Stop } else { OnSilence::Request };
            Ok(Box::new(NetFt::start(bind(anywhere())?, settings).into_diagnostic()?))
        }
        (other, _) => {
            Err(refuse(format!("`{other}://` is no sensor's protocol"), "sensors speak netft:// or are emulated://"))
        }
    }
}

/// Whether a box is the one that the facility file describes, and sends what its sensor measures.
fn check_box(calibration: &Calibration, station: &Station) -> miette::Result<()> {
    let Calibration { product, serial, .. } = calibration;
    let stated = serial.as_deref().unwrap_or("none");
    say(format!("  sensor    {product}, serial number {stated}"));
    if let Some(wanted) = station.sensor_serial.as_deref().filter(|wanted| Some(*wanted) != serial.as_deref()) {
        let message = format!("the sensor states serial number {stated}, the facility file {wanted}");
        return Err(refuse(message, "connect the right sensor, or correct serial in [sensor] of the facility file"));
    }
    if let (true, Some(transform)) = (calibration.is_transformed(), calibration.transform) {
        let message = format!("the Net Box shifts or turns what it sends by its tool transformation {transform:?}");
        let remedy = "set the transformation of its active configuration to zero; the frame of the sensor is \
                      position and rotation of [sensor] in the facility file";
        return Err(refuse(message, remedy));
    }
    let limits = [station.rules.force, station.rules.moment];
    if let Some(range) = calibration.range().filter(|range| range[0] < limits[0] || range[1] < limits[1]) {
        warn(format!(
            "the session's limits of {} N and {} N m are beyond the sensor's range of {:.0} N and {:.1} N m: it saturates first",
            limits[0], limits[1], range[0], range[1]
        ));
    }
    Ok(())
}

/// Opens all links of a drive: those that take the commands, and the real ones that a dry run only exercises.
///
/// An emulated robot or sensor is a place in `world`, whose clock is `clock` (of its own in a dry run with real links).
pub(crate) fn open(
    addresses: &Addresses,
    armed: bool,
    station: &Station,
    world: impl Fn() -> miette::Result<World>,
    clock: Rc<dyn Clock>,
) -> miette::Result<(Links, Option<Links>)> {
    let cycle = addresses.cycle()?;
    let [one, two, ft] = &addresses.all;
    let linked = |bench: Option<&Rc<RefCell<Bench>>>| -> miette::Result<Links> {
        let sensor = sensor(ft, armed, station, bench)?;
        let open = |address, index| robot(address, index, armed, station, bench);
        // Drives of EtherCAT come last: they want frames from then on, and others take their time to open.
        let robots = if one.scheme == "ethercat" && two.scheme != "ethercat" {
            let second = open(two, 1)?;
            [open(one, 0)?, second]
        } else {
            [open(one, 0)?, open(two, 1)?]
        };
        Ok(Links { robots, sensor })
    };
    let emulated = addresses.all.iter().any(|address| address.scheme == "emulated");
    if !addresses.any_real() {
        let bench = Bench::new(world()?, clock, cycle);
        return Ok((linked(Some(&bench))?, None));
    }
    let bench = if emulated { Some(Bench::new(world()?, Rc::new(Monotonic), cycle)) } else { None };
    let real = linked(bench.as_ref())?;
    if armed {
        return Ok((real, None));
    }
    let shadow = Bench::new(world()?, Rc::new(softdock_realtime::clock::Virtual::default()), cycle);
    Ok((softdock_realtime::emulation::in_process::links(&shadow), Some(real)))
}
