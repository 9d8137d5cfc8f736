//! An emulated facility on real protocols: two robots and a sensor.

use crate::error::{Result, SessionError};
use crate::files::parameters;
use crate::hidden_effects::with_effects;
use crate::plan::{RunChoice, chosen_run, facility_of};
use crate::rights::CycleRights;
use serde::Serialize;
use softdock_campaign::{Campaign, Scenario, Station};
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;
use softdock_realtime::clock::{Clock, Monotonic};
use softdock_realtime::emulation::facility::EmulatedFacility;
use softdock_realtime::emulation::server::{Sockets, serve};
use softdock_realtime::emulation::world::World;
use softdock_realtime::histogram::Histogram;
use softdock_realtime::links::{CheckedAddress, EmulatedEnd, LinkNotice, unreached_port};
use softdock_realtime::process::Warning;
use softdock_realtime::protocol::netft::calibration::NetFtCalibration;
use softdock_realtime::protocol::netft::sensor_box::NetBox;
use softdock_realtime::protocol::{EmulatedController, Outbox, SensorBox};
use softdock_realtime::signals::{AXES, RobotState};
use softdock_realtime::time::Nanos;
use std::any::Any;
use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Counts of the sensor without an address, per newton and newton metre.
const COUNTS: f64 = 1e6;
/// Time without commands to a robot before a new session is offered.
const PAUSE: Nanos = Nanos::from_millis(1000);
/// Period of checking for ended sessions.
const LOOK: Duration = Duration::from_millis(50);
/// Delay of robot 2's cycles after robot 1's.
const PHASE: Nanos = Nanos::from_micros(1300);
/// Bias of the sensor: force \[N\] and moment \[N m\].
const BIAS: Wrench<f64> = Wrench { force: vec3(3.0, -2.0, 8.0), moment: vec3(0.1, 0.05, -0.08) };

/// Request for an emulated facility.
#[derive(Clone, Debug)]
pub struct EmulationOptions {
    /// Scenario file; or a campaign file, if `run` is given.
    pub scenario: PathBuf,
    /// The draw of the campaign; `None`: the scenario's own values.
    pub run: Option<RunChoice>,
    /// Facility file in place of the scenario's.
    pub facility: Option<PathBuf>,
    /// Addresses of robots 1 and 2; a robot without one is at rest.
    pub robots: [Option<String>; 2],
    /// Address of the sensor.
    pub sensor: Option<String>,
    /// Effects file: keys of the scenario that differ.
    pub effects: Option<PathBuf>,
    /// Whether no new session is offered after the first one.
    pub once: bool,
}

/// Notice of an emulated facility.
#[derive(Debug)]
pub enum EmulationNotice {
    /// A link reports at its opening.
    Link(LinkNotice),
    /// The operating system refuses a real-time right.
    Rights(Warning),
    /// Number of ended sessions.
    SessionOver(u32),
}

impl EmulationNotice {
    /// Whether the notice is a warning.
    pub fn is_warning(&self) -> bool {
        match self {
            Self::Link(notice) => notice.is_warning(),
            Self::Rights(_) => true,
            Self::SessionOver(_) => false,
        }
    }
}

impl fmt::Display for EmulationNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(notice) => write!(f, "{notice}"),
            Self::Rights(warning) => write!(f, "warning: {warning}"),
            Self::SessionOver(number) => {
                write!(f, "session {number} is over: the robots hold, the parts are released, a new session is offered")
            }
        }
    }
}

/// True parameters and events of an emulated facility.
#[derive(Clone, Debug, Serialize)]
pub struct FacilityTruth {
    /// Number of the run.
    pub run: u64,
    /// Parameters by their names, hidden effects included.
    pub parameters: serde_json::Map<String, serde_json::Value>,
    /// First touch of the parts \[s\]; -1 if there was none.
    pub touch_time: f64,
    /// Capture by the latch \[s\]; -1 if there was none.
    pub capture_time: f64,
    /// Greatest force of the contact \[N\].
    pub peak_contact_force: f64,
    /// Greatest force of the latch \[N\].
    pub peak_latch_force: f64,
    /// Greatest force at the sensor \[N\].
    pub peak_interface_force: f64,
    /// Greatest moment at the sensor \[N m\].
    pub peak_interface_moment: f64,
    /// Greatest overlap of the parts \[m\].
    pub peak_depth: f64,
    /// Time in contact \[s\].
    pub contact_duration: f64,
    /// Impulse of the contact \[N s\].
    pub impulse: f64,
}

/// The end of an emulated facility.
#[derive(Debug)]
pub struct EmulationSummary {
    /// Lateness of the facility's events.
    pub lateness: Histogram,
    /// Reason why robots 1 and 2 have stopped following, if they have.
    pub ends: [Option<&'static str>; 2],
    /// Whether the latch has closed.
    pub captured: bool,
    /// Parameters and events.
    pub truth: FacilityTruth,
}

/// The scenario with its draw and its hidden effects.
struct Source {
    plant: Arc<Plant>,
    station: Station,
    params: Params<f64>,
    seed: u64,
    run: u64,
}

/// An emulated facility with open ports.
pub struct FacilityEmulator {
    source: Source,
    facility: EmulatedFacility,
    sockets: Sockets,
    over: Arc<AtomicU32>,
    begin: Nanos,
    /// Servers beside the ports; they end on drop.
    _servers: Vec<Box<dyn Any>>,
}

impl FacilityEmulator {
    /// Reads the files and opens the ports.
    ///
    /// # Errors
    /// If a file or an address cannot be used, or a port is taken.
    pub fn open(options: &EmulationOptions, report: &dyn Fn(EmulationNotice)) -> Result<Self> {
        let source = Source::read(options)?;
        let report = |notice| report(EmulationNotice::Link(notice));
        let robot = |index: usize| -> Result<EmulatedEnd<dyn EmulatedController>> {
            match &options.robots[index] {
                Some(text) => {
                    let rail = source.station.rail && index == 0;
                    Ok(CheckedAddress::emulated_robot(text)?.emulate_robot(rail, &report)?)
                }
                None => Ok(EmulatedEnd { device: Box::new(Idle([0.0; AXES])), port: unreached_port()?, server: None }),
            }
        };
        let (one, two, sensor) = (robot(0)?, robot(1)?, sensor(options.sensor.as_deref())?);
        let Source { plant, station, params, seed, run } = &source;
        let key = philox::key(seed ^ 0x5EC2E7);
        let world = World::new(plant, station, key, *run, params, BIAS).map_err(|(robot, why)| {
            SessionError::refused(format!("robot {robot} cannot hold its part ({why:?})"), "move its base")
        })?;
        let begin = Monotonic.now();
        let mut facility = EmulatedFacility::new(world, [one.device, two.device], sensor.device, begin, PHASE);
        let over = if options.once { Arc::default() } else { facility.renew_sessions(PAUSE) };
        let sockets = Sockets { ports: [one.port, two.port, sensor.port] };
        let servers = [one.server, two.server, sensor.server].into_iter().flatten().collect();
        Ok(Self { source, facility, sockets, over, begin, _servers: servers })
    }

    /// Serves the facility until `stop` holds, or for this time since its opening \[s\].
    ///
    /// # Errors
    /// If a socket fails, or a required right is refused.
    pub fn serve(
        mut self,
        rights: CycleRights,
        seconds: Option<f64>,
        stop: &AtomicBool,
        report: &(dyn Fn(EmulationNotice) + Sync),
    ) -> Result<EmulationSummary> {
        let until = seconds.map_or(Nanos(i64::MAX), |seconds| self.begin + Nanos::from_seconds(seconds));
        let mut lateness = Histogram::default();
        let (facility, sockets, over) = (&mut self.facility, &mut self.sockets, &self.over);
        std::thread::scope(|scope| -> Result<()> {
            // Started before the priority is raised, which it would inherit.
            scope.spawn(|| report_sessions(over, stop, report));
            let served = rights
                .apply(|warning| report(EmulationNotice::Rights(warning)))
                .and_then(|()| Ok(serve(facility, sockets, stop, until, &mut lateness)?));
            stop.store(true, Ordering::Relaxed);
            served
        })?;
        Ok(self.summary(lateness))
    }

    fn summary(&self, lateness: Histogram) -> EmulationSummary {
        let watch = self.facility.watch();
        let truth = FacilityTruth {
            run: self.source.run,
            parameters: parameters(&self.source.params),
            touch_time: watch.touch_time,
            capture_time: watch.capture_time,
            peak_contact_force: watch.contact_force.value(),
            peak_latch_force: watch.latch_force.value(),
            peak_interface_force: watch.interface_force.value(),
            peak_interface_moment: watch.interface_moment.value(),
            peak_depth: watch.peak_depth,
            contact_duration: watch.contact_duration,
            impulse: watch.impulse,
        };
        let ends = [0, 1].map(|robot| self.facility.last_end(robot));
        EmulationSummary { lateness, ends, captured: watch.closed > 0.0, truth }
    }
}

impl Source {
    fn read(options: &EmulationOptions) -> Result<Self> {
        let (scenario, params, seed, run) = match &options.run {
            None => {
                let scenario = Scenario::load(&options.scenario)?;
                let params = scenario.model.nominal;
                (scenario, params, 1, 0)
            }
            Some(choice) => {
                let campaign = Campaign::load(&options.scenario)?;
                campaign.refuse_for("an emulated facility")?;
                let (run, _) = chosen_run(&campaign, choice)?;
                let params = campaign.draw(run)?.params;
                (campaign.scenario, params, campaign.seed, run)
            }
        };
        let station = facility_of(&scenario, options.facility.as_deref())?;
        let (model, params) = with_effects(&scenario, options.effects.as_deref(), params)?;
        Ok(Self { plant: Arc::new(Plant::new(model)), station, params, seed, run })
    }
}

/// Creates the electronics of the sensor; without an address it has an unreachable port.
fn sensor(address: Option<&str>) -> Result<EmulatedEnd<dyn SensorBox>> {
    match address {
        Some(text) => Ok(CheckedAddress::emulated_sensor(text)?.emulate_sensor()?),
        None => {
            let calibration =
                NetFtCalibration::new(COUNTS, COUNTS).map_err(softdock_realtime::links::LinkError::from)?;
            let device = Box::new(NetBox::new(calibration, Nanos::from_millis(1)));
            Ok(EmulatedEnd { device, port: unreached_port()?, server: None })
        }
    }
}

/// Reports each ended session, until the facility ends.
fn report_sessions(over: &AtomicU32, stop: &AtomicBool, report: &dyn Fn(EmulationNotice)) {
    let mut reported = 0;
    while !stop.load(Ordering::Relaxed) {
        let now = over.load(Ordering::Relaxed);
        if now != reported {
            report(EmulationNotice::SessionOver(now));
            reported = now;
        }
        std::thread::sleep(LOOK);
    }
}

/// The controller of a robot without an address: the robot is at rest.
struct Idle([f64; AXES]);

impl EmulatedController for Idle {
    fn cycle(&self) -> Nanos {
        Nanos::from_millis(4)
    }

    fn take(&mut self, _: Nanos, _: SocketAddr, _: &[u8], _: Outbox) {}

    fn target(&mut self, _: Nanos) -> [f64; AXES] {
        self.0
    }

    fn report(&mut self, _: Nanos, state: &RobotState, _: Outbox) {
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

    fn renew(&mut self, at: [f64; AXES]) {
        self.0 = at;
    }
}
