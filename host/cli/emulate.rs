//! `softdock emulate`: the other side of the protocols, two robots and a sensor that feel one another's contact.

use crate::address::Address;
use crate::args::EmulateArgs;
use crate::band::parameters;
use crate::drive::{facility_of, run_asked};
use crate::links::{EGM_PORT, FANUC_PORT, RDT_PORT, RSI_OPTIONS, RSI_PORT, bind, tag_map, towards};
use crate::realtime::apply;
use crate::secret::with_secret;
use crate::words::{Exit, explain, json, refuse, say};
use miette::IntoDiagnostic;
use softdock_campaign::{Scenario, Station};
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;
use softdock_realtime::clock::{Clock, Monotonic};
use softdock_realtime::emulation::facility::Facility;
use softdock_realtime::emulation::server::{Sockets, serve};
use softdock_realtime::emulation::world::World;
use softdock_realtime::histogram::Histogram;
use softdock_realtime::protocol::egm::controller::{EgmController, EgmSettings};
use softdock_realtime::protocol::fanuc::RMI_PORT;
use softdock_realtime::protocol::fanuc::controller::FanucController;
use softdock_realtime::protocol::fanuc::rmi_server::RmiServer;
use softdock_realtime::protocol::netft::calibration::Calibration;
use softdock_realtime::protocol::netft::http::CalibrationServer;
use softdock_realtime::protocol::netft::sensor_box::NetBox;
use softdock_realtime::protocol::rsi::controller::{Krc, KrcSettings};
use softdock_realtime::protocol::{Controller, SensorBox};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Counts of the emulated box per newton and newton metre.
const COUNTS: f64 = 1e6;
/// How long nobody commands a robot before a new session is offered.
const PAUSE: Nanos = Nanos::from_millis(1000);
/// A look at the sessions this often.
const LOOK: Duration = Duration::from_millis(50);
/// Robot 2's controller was switched on so long after robot 1's.
const PHASE: Nanos = Nanos::from_micros(1300);

/// What the emulated facility is made of.
struct Truth {
    plant: Arc<Plant>,
    station: Station,
    params: Params<f64>,
    key: [u32; 2],
    run: u64,
    bias: Wrench<f64>,
}

/// Servers beside the UDP ports; they live as long as this does.
#[derive(Default)]
struct Servers {
    calibration: Option<CalibrationServer>,
    rmi: Vec<RmiServer>,
}

/// Serves an emulated facility.
pub(crate) fn emulate(args: &EmulateArgs) -> miette::Result<Exit> {
    let truth = truth(args)?;
    let mut servers = Servers::default();
    let (one, first) = controller(args.robot1.as_deref(), truth.station.rail, &mut servers)?;
    let (two, second) = controller(args.robot2.as_deref(), false, &mut servers)?;
    let (sensor, third) = sensor_box(args.ft.as_deref(), &mut servers)?;
    let world = World::new(&truth.plant, &truth.station, truth.key, truth.run, &truth.params, truth.bias)
        .map_err(|(robot, why)| refuse(format!("robot {robot} cannot hold its part ({why:?})"), "move its base"))?;
    let begin = Monotonic.now();
    let mut facility = Facility::new(world, [one, two], sensor, begin, PHASE);
    let over = if args.once { Arc::default() } else { facility.renew_sessions(PAUSE) };
    let stop = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&stop);
    ctrlc::set_handler(move || heard.store(true, Ordering::Relaxed)).into_diagnostic()?;
    say("the emulated facility runs; Ctrl-C ends it");
    let until = args.seconds.map_or(Nanos(i64::MAX), |seconds| begin + Nanos::from_seconds(seconds));
    let mut sockets = Sockets { ports: [first, second, third] };
    let mut lateness = Histogram::default();
    std::thread::scope(|scope| {
        // Before the priority is raised, which it would inherit.
        scope.spawn(|| report_sessions(&over, &stop));
        let served = apply(args.priority, args.core)
            .and_then(|()| serve(&mut facility, &mut sockets, &stop, until, &mut lateness).into_diagnostic());
        stop.store(true, Ordering::Relaxed);
        served
    })?;
    say(format!("the facility's own lateness: {lateness}"));
    for robot in 0..2 {
        if let Some(end) = facility.last_end(robot) {
            say(format!("robot {} stopped: {end}", robot + 1));
        }
    }
    let watch = facility.watch();
    say(format!("peak force {:.1} N  captured {}", watch.contact_force.value(), watch.closed > 0.0));
    if let Some(path) = &args.truth {
        std::fs::write(path, json(&truth_of(&truth, &watch))).into_diagnostic()?;
    }
    Ok(Exit::Done)
}

/// Says when a session is over, until the facility ends.
fn report_sessions(over: &AtomicU32, stop: &AtomicBool) {
    let mut reported = 0;
    while !stop.load(Ordering::Relaxed) {
        let now = over.load(Ordering::Relaxed);
        if now != reported {
            say(format!("session {now} is over: the robots hold, the parts are released, a new session is offered"));
            reported = now;
        }
        std::thread::sleep(LOOK);
    }
}

fn truth_of(truth: &Truth, watch: &softdock_kernels::monitor::Watch<f64>) -> serde_json::Value {
    serde_json::json!({
        "run": truth.run,
        "parameters": parameters(&truth.params),
        "touch_time": watch.touch_time,
        "capture_time": watch.capture_time,
        "peak_contact_force": watch.contact_force.value(),
        "peak_latch_force": watch.latch_force.value(),
        "peak_interface_force": watch.interface_force.value(),
        "peak_interface_moment": watch.interface_moment.value(),
        "peak_depth": watch.peak_depth,
        "contact_duration": watch.contact_duration,
        "impulse": watch.impulse,
    })
}

/// The scenario, its draw and its secret effects.
fn truth(args: &EmulateArgs) -> miette::Result<Truth> {
    let (scenario, params, seed, run) = match (&args.experiment, args.run) {
        (None, None) => {
            let scenario = Scenario::load(&args.scenario).map_err(explain)?;
            let params = scenario.model.nominal;
            (scenario, params, 1, 0)
        }
        (experiment, number) => {
            let campaign = softdock_campaign::load(&args.scenario).map_err(explain)?;
            let (run, _) = run_asked(&campaign, experiment.as_deref(), number)?;
            let params = campaign.draw(run).params;
            (campaign.scenario, params, campaign.seed, run)
        }
    };
    let station = facility_of(&scenario, args.facility.as_deref())?;
    let (model, params) = with_secret(&scenario, args.effects.as_deref(), params)?;
    let bias = Wrench { force: vec3(3.0, -2.0, 8.0), moment: vec3(0.1, 0.05, -0.08) };
    let plant = Arc::new(Plant::new(model));
    Ok(Truth { plant, station, params, key: philox::key(seed ^ 0x5EC2E7), run, bias })
}

/// A controller that nobody hears: the robot stands.
struct Idle([f64; 7]);

impl Controller for Idle {
    fn cycle(&self) -> Nanos {
        Nanos::from_millis(4)
    }
    fn take(&mut self, _: Nanos, _: SocketAddr, _: &[u8], _: softdock_realtime::protocol::Outbox) {}
    fn target(&mut self, _: Nanos) -> [f64; 7] {
        self.0
    }
    fn report(
        &mut self,
        _: Nanos,
        state: &softdock_realtime::signals::RobotState,
        _: softdock_realtime::protocol::Outbox,
    ) {
        if self.0.iter().all(|axis| *axis == 0.0) {
            self.0 = state.position;
        }
    }
    fn fault(&self) -> Option<&'static str> {
        None
    }
    fn has_client(&self) -> bool {
        false
    }
    fn renew(&mut self, at: [f64; 7]) {
        self.0 = at;
    }
}

/// A port that nobody sends to, and that no other machine reaches.
fn nowhere() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::LOCALHOST, 0))
}

/// Where to listen: on this machine alone, unless the address says where.
fn listening(address: &Address, port: u16) -> miette::Result<SocketAddr> {
    if address.place.is_empty() { Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port))) } else { address.socket(port) }
}

/// The controller of a robot and the port that it speaks from.
fn controller(
    address: Option<&str>,
    rail: bool,
    servers: &mut Servers,
) -> miette::Result<(Box<dyn Controller>, UdpPort)> {
    let Some(text) = address else {
        return Ok((Box::new(Idle([0.0; 7])), bind(nowhere())?));
    };
    let address = Address::parse(text)?;
    match address.scheme.as_str() {
        "rsi" => {
            address.only(&RSI_OPTIONS)?;
            let client = address.socket(RSI_PORT)?;
            let settings = KrcSettings::new(tag_map(&address, rail)?, client);
            Ok((Box::new(Krc::new(settings)), bind(towards(client))?))
        }
        "egm" => {
            address.only(&["cycle_ms"])?;
            let client = address.socket(EGM_PORT)?;
            let settings = EgmSettings { cycle: address.cycle(4.0)?, rail, ..EgmSettings::new(client) };
            Ok((Box::new(EgmController::new(settings)), bind(towards(client))?))
        }
        "fanuc" => {
            address.only(&["cycle_ms", "rmi"])?;
            let place = listening(&address, FANUC_PORT)?;
            let rmi: u16 = address.option("rmi", "16001")?.unwrap_or(RMI_PORT);
            let server = RmiServer::start(SocketAddr::new(place.ip(), rmi)).map_err(|error| {
                let remedy = "write another port: fanuc://BIND?rmi=16002";
                refuse(format!("cannot serve RMI at {}:{rmi}: {error}", place.ip()), remedy)
            })?;
            let mut controller = FanucController::new(address.cycle(8.0)?, 3);
            controller.obey(server.remote());
            servers.rmi.push(server);
            Ok((Box::new(controller), bind(place)?))
        }
        other => Err(refuse(format!("`{other}://` is no robot's protocol here"), "write rsi://, egm:// or fanuc://")),
    }
}

/// The sensor's box and the port that it streams from.
fn sensor_box(address: Option<&str>, servers: &mut Servers) -> miette::Result<(Box<dyn SensorBox>, UdpPort)> {
    let calibration = Calibration::new(COUNTS, COUNTS).into_diagnostic()?;
    let Some(text) = address else {
        return Ok((Box::new(NetBox::new(calibration, Nanos::from_millis(1))), bind(nowhere())?));
    };
    let address = Address::parse(text)?;
    if address.scheme != "netft" {
        let message = format!("`{}://` is no sensor's protocol here", address.scheme);
        return Err(refuse(message, "write netft://BIND?http=PORT"));
    }
    address.only(&["http", "rate_hz"])?;
    let place = listening(&address, RDT_PORT)?;
    let http: u16 = address.option("http", "80")?.unwrap_or(80);
    let rate: f64 = address.option("rate_hz", "1000")?.unwrap_or(1000.0);
    let server = CalibrationServer::start(SocketAddr::new(place.ip(), http), &calibration);
    servers.calibration = Some(server.map_err(|error| {
        refuse(format!("cannot serve HTTP on port {http}: {error}"), "write another one: netft://BIND?http=8080")
    })?);
    let period = Nanos::from_seconds(1.0 / rate.clamp(1.0, 1e4));
    Ok((Box::new(NetBox::new(calibration, period)), bind(place)?))
}
