//! An emulated facility behind RSI and Net F/T in virtual time, with a session.

use softdock_campaign::station::AxisLimits;
use softdock_campaign::{Campaign, Station};
use softdock_kernels::frame::{Batch, Loops, Tile};
use softdock_kernels::model::SessionRules;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;
use softdock_kernels::with_joints;
use softdock_realtime::clock::{Clock, Virtual};
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::facility::{EmulatedFacility, SetPoint};
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::emulation::network::{Network, NetworkPort, address_of, our_address};
use softdock_realtime::emulation::world::World;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::protocol::netft::calibration::NetFtCalibration;
use softdock_realtime::protocol::netft::driver::{NetFt, NetFtSettings};
use softdock_realtime::protocol::netft::sensor_box::NetBox;
use softdock_realtime::protocol::rsi::controller::{Krc, KrcSettings};
use softdock_realtime::protocol::rsi::driver::RsiRobot;
use softdock_realtime::protocol::rsi::tags::TagMap;
use softdock_realtime::signals::AXES;
use softdock_realtime::signals::Links;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::{Direction, Endpoint, Fault, Relay, RelayRule};
use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

/// Corrections have six decimals of a degree on the wire; those of a millimetre are finer.
pub(crate) const QUANTUM: f64 = 1e-6 * std::f64::consts::PI / 180.0;
/// Period of the sensor's samples.
const SAMPLES: Nanos = Nanos::from_millis(1);
/// Cycle of both robots.
pub(crate) const CYCLE: Nanos = Nanos::from_millis(4);
/// Cycle of a robot 2 that is faster than the master.
pub(crate) const SHORT_CYCLE: Nanos = Nanos::from_millis(1);
/// Delay of robot 2's cycles after robot 1's.
const PHASE: Nanos = Nanos::from_micros(1500);

pub(crate) fn shipped(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns").join(file)
}

pub(crate) fn campaign(file: &str) -> Campaign {
    softdock_campaign::load(&shipped(file)).expect("a shipped campaign")
}

pub(crate) fn station() -> Station {
    Station::load(&shipped("facilities/reference.toml")).expect("the shipped facility")
}

/// Reading of the sensor without weight and contact.
pub(crate) fn bias() -> Wrench<f64> {
    Wrench { force: vec3(12.0, -7.0, 30.0), moment: vec3(0.5, 0.2, -0.4) }
}

/// A run on a facility.
#[derive(Clone)]
pub(crate) struct Setting {
    pub(crate) seed: u64,
    pub(crate) plant: Arc<Plant>,
    pub(crate) station: Station,
    pub(crate) run: u64,
    pub(crate) params: Params<f64>,
    pub(crate) armed: bool,
    pub(crate) to_start: bool,
    pub(crate) check_only: bool,
    /// Retraction distance after a stop \[m\].
    pub(crate) retract: f64,
    /// Reading of the sensor without weight and contact.
    pub(crate) bias: Wrench<f64>,
}

impl Setting {
    /// Run 1244 of `probe_drogue`: 2.1 ms of delay, captured in space and on the facility, 16 N at most.
    pub(crate) fn docking() -> Self {
        Self::draw(&campaign("probe_drogue.toml"), 1244)
    }

    /// A run of a campaign on the reference facility.
    pub(crate) fn draw(campaign: &Campaign, run: u64) -> Self {
        let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
        let (seed, params) = (campaign.seed, campaign.draw(run).expect("a draw").params);
        Self {
            seed,
            plant,
            station: station(),
            run,
            params,
            armed: true,
            to_start: true,
            check_only: false,
            retract: 0.0,
            bias: bias(),
        }
    }

    /// Replaces the rules of the scenario and of the facility.
    pub(crate) fn with_rules(&mut self, change: impl FnOnce(&mut SessionRules)) {
        change(&mut self.station.rules);
        let mut model = (**self.plant).clone();
        model.facility.rules = self.station.rules.clone();
        self.plant = Arc::new(Plant::new(model));
    }

    pub(crate) fn world(&self) -> World {
        let key = philox::key(self.seed);
        World::new(&self.plant, &self.station, key, self.run, &self.params, self.bias).expect("in reach")
    }

    pub(crate) fn task(&self) -> SessionTask {
        let (plant, station) = (Arc::clone(&self.plant), Arc::new(self.station.clone()));
        SessionTask {
            armed: self.armed,
            to_start: self.to_start,
            check_only: self.check_only,
            retract: self.retract,
            ..SessionTask::new(plant, station, self.run, self.params)
        }
    }
}

/// The links of both robots.
const ROBOTS: [Endpoint; 2] = [Endpoint::Robot1, Endpoint::Robot2];

fn calibration() -> NetFtCalibration {
    NetFtCalibration::new(1e6, 1e6).expect("a calibration")
}

/// The controller of a robot.
fn krc(endpoint: Endpoint) -> KrcSettings {
    KrcSettings::new(tags(endpoint), our_address(endpoint))
}

/// Creates a fault for a number of datagrams of a link, the first in the cycle after this time.
pub(crate) fn rule(endpoint: Endpoint, direction: Direction, from: Nanos, cycles: i64, fault: Fault) -> RelayRule {
    // Half a cycle more: the next reports arrive a cycle after the one being answered.
    RelayRule { endpoint, direction, from, until: from + CYCLE * cycles + Nanos(CYCLE.0 / 2), every: 1, fault }
}

/// Robot 1 has a rail, robot 2 has none.
pub(crate) fn tags(endpoint: Endpoint) -> TagMap {
    if endpoint == Endpoint::Robot1 { TagMap::im_free().with_rail() } else { TagMap::im_free() }
}

/// The farm's own run of a draw.
pub(crate) fn farm_run(plant: &Plant, seed: u64, run: u64, params: Params<f64>) -> Finished {
    fn step<const N: usize>(plant: &Plant, seed: u64, run: u64, params: Params<f64>) -> Finished {
        let batch = Batch { key: philox::key(seed), noisy: true, loops: Loops::Both };
        let mut tile = Tile::<f64, N>::new(plant, batch);
        tile.load(plant, &[(0, run, params)]);
        let mut out = Vec::new();
        while out.is_empty() {
            tile.step(plant);
            tile.take_finished(plant, &mut out);
        }
        out[0]
    }
    with_joints!(plant.joints(), step(plant, seed, run, params))
}

/// A session over the protocols in virtual time.
pub(crate) struct Rig {
    pub(crate) session: Session,
    pub(crate) network: Rc<RefCell<Network>>,
    pub(crate) records: Vec<CycleRecord>,
    clock: Virtual,
}

impl Rig {
    /// Connects a rig; if `armed`, the commands go to the network's robots, else to emulated ones in process.
    pub(crate) fn new(setting: &Setting, relay: Relay) -> Self {
        Self::with(setting, setting, relay)
    }

    /// Connects a rig with a facility that differs from the file.
    pub(crate) fn with(there: &Setting, setting: &Setting, relay: Relay) -> Self {
        let mut rig = Self::before_go(there, setting, relay, |_, _| {});
        rig.session.go();
        rig
    }

    /// Connects a rig whose controllers repeat their IPOC until it is answered, as the ROS-Industrial simulator does.
    pub(crate) fn repeating(setting: &Setting) -> Self {
        let mut rig = Self::before_go(setting, setting, Relay::default(), |_, settings| settings.repeats = true);
        rig.session.go();
        rig
    }

    /// Connects a rig whose robot 2 has a shorter cycle.
    pub(crate) fn mixed(setting: &Setting) -> Self {
        let mut rig = Self::before_go(setting, setting, Relay::default(), |endpoint, settings| {
            if endpoint == Endpoint::Robot2 {
                settings.tags.cycle = SHORT_CYCLE;
            }
        });
        rig.session.go();
        rig
    }

    /// Connects a rig whose robots wait for GO.
    pub(crate) fn waiting(setting: &Setting) -> Self {
        Self::before_go(setting, setting, Relay::default(), |_, _| {})
    }

    fn before_go(there: &Setting, setting: &Setting, relay: Relay, change: fn(Endpoint, &mut KrcSettings)) -> Self {
        let settings = |endpoint| {
            let mut settings = krc(endpoint);
            change(endpoint, &mut settings);
            settings
        };
        let clock = Virtual::default();
        let sensor = Box::new(NetBox::new(calibration(), SAMPLES));
        let controllers: [Box<dyn softdock_realtime::protocol::EmulatedController>; 2] =
            ROBOTS.map(|endpoint| Box::new(Krc::new(settings(endpoint))) as _);
        let facility = EmulatedFacility::new(there.world(), controllers, sensor, Nanos(0), PHASE);
        let network = Network::new(clock.clone(), facility, relay);
        network.borrow_mut().facility().keep_set_points();
        Self::on(network, clock, setting, |endpoint| settings(endpoint).tags)
    }

    /// Connects a rig to an existing facility.
    fn on(network: Rc<RefCell<Network>>, clock: Virtual, setting: &Setting, tags: impl Fn(Endpoint) -> TagMap) -> Self {
        let robot = |endpoint| {
            let port = NetworkPort::new(&network, endpoint);
            Box::new(RsiRobot::new(port, tags(endpoint), Some(address_of(endpoint).ip())).expect("a tag map"))
        };
        let port = NetworkPort::new(&network, Endpoint::Sensor);
        let settings = NetFtSettings::new(address_of(Endpoint::Sensor), calibration(), SAMPLES);
        let real = Links {
            robots: [robot(Endpoint::Robot1), robot(Endpoint::Robot2)],
            sensor: Box::new(NetFt::start(port, settings).expect("a stream")),
        };
        let time = clock.clone();
        let clock = Rc::new(clock);
        let session = if setting.armed {
            Session::new(setting.task(), real, None, clock)
        } else {
            let bench = InProcessRig::new(setting.world(), Rc::new(Virtual::default()), CYCLE);
            Session::new(setting.task(), links(&bench), Some(real), clock)
        };
        Self { session: session.expect("a drive"), network, records: Vec::new(), clock: time }
    }

    /// Starts another session on the same facility, whose clock continues; the previous one ends like a killed process.
    pub(crate) fn again(self, setting: &Setting) -> Self {
        let Self { network, clock, session, .. } = self;
        drop(session);
        let mut rig = Self::on(network, clock, setting, tags);
        rig.session.go();
        rig
    }

    /// Returns the greatest share of a limit that the set-point steps of both robots have used.
    pub(crate) fn greatest_share(&self, limits: &[AxisLimits; AXES]) -> f64 {
        let mut network = self.network.borrow_mut();
        let shares = [0, 1].map(|robot| {
            let facility = network.facility();
            greatest_share(facility.set_points(robot), facility.begins_in_motion(robot), limits)
        });
        shares[0].max(shares[1])
    }

    /// The controller of robot 0 or 1 ends its session, the axis is jogged, and after some cycles another session
    /// begins.
    pub(crate) fn jog(&mut self, robot: usize, axis: usize, by: f64, cycles: u64) {
        let settings = krc(ROBOTS[robot]);
        let first_ipoc = settings.first_ipoc + self.session.record().time.0 as u64 / 1_000_000 + 4 * cycles;
        let krc = Box::new(Krc::new(KrcSettings { first_ipoc, ..settings }));
        self.network.borrow_mut().facility().begin_again(robot, krc, axis, by, CYCLE * cycles as i64);
    }

    /// The controller of robot 0 or 1 has another cycle than configured.
    pub(crate) fn with_cycle(&mut self, robot: usize, cycle: Nanos) {
        let mut settings = krc(ROBOTS[robot]);
        settings.tags.cycle = cycle;
        let krc = Box::new(Krc::new(settings));
        self.network.borrow_mut().facility().begin_again(robot, krc, 0, 0.0, Nanos(0));
    }

    /// Changes the cycle of the controller of robot 0 or 1.
    pub(crate) fn change_cycle(&mut self, robot: usize, cycle: Nanos) {
        self.network.borrow_mut().facility().change_cycle(robot, cycle);
    }

    /// Stalls the program for a time.
    pub(crate) fn stall(&mut self, time: Nanos) {
        self.clock.sleep_until(self.clock.now() + time);
    }

    /// Runs one cycle; returns whether the session is over.
    pub(crate) fn cycle(&mut self) -> bool {
        let over = self.session.cycle(None);
        self.records.push(*self.session.record());
        over
    }

    /// Runs to the end; a session that does not end is an error.
    pub(crate) fn finish(&mut self) -> &CycleRecord {
        for _ in 0..40_000 {
            if self.cycle() {
                return self.session.record();
            }
        }
        panic!("the session does not end: {:?}", self.session.record().phase)
    }

    /// Runs until the run itself has lasted this time \[s\].
    pub(crate) fn run_for(&mut self, seconds: f64) {
        while (self.session.record().tick as f64) * 1e-3 < seconds {
            assert!(
                !self.cycle(),
                "ended early: {:?} {:?}",
                self.session.record().cause,
                self.session.core().refusal()
            );
        }
    }
}

/// Returns the greatest share of a limit that the steps of a robot's set-point use: speed, acceleration and jerk.
///
/// Set-points that begin `in_motion` are judged from the third step on, others from rest. After a cycle without an
/// answer in time the controller holds at rest; later steps are judged from there.
pub(crate) fn greatest_share(seen: &[SetPoint], in_motion: bool, limits: &[AxisLimits; AXES]) -> f64 {
    let (mut most, mut speed, mut acceleration) = (0.0_f64, [0.0; AXES], [0.0; AXES]);
    for (n, three) in seen.array_windows::<3>().enumerate() {
        // In motion the first two steps give the speed and acceleration from which the others are judged.
        let first = in_motion && n < 2;
        let h = (three[2].at - three[1].at).seconds();
        let held = three[1].late_answers > three[0].late_answers;
        for (i, limit) in limits.iter().enumerate() {
            let step = three[2].axes[i] - three[1].axes[i];
            if held {
                assert!(step.abs() < 1e-9, "a controller without an answer holds: axis {i} makes {step}");
                (speed[i], acceleration[i]) = (0.0, 0.0);
                continue;
            }
            let faster = step / h - speed[i];
            let jerk = faster / h - acceleration[i];
            // Tolerance of rounding on the wire.
            let beyond =
                |value: f64, order: i32| (value.abs() - 4.0_f64.powi(order) * QUANTUM / h.powi(order)).max(0.0);
            let shares = [
                beyond(step / h, 1) / limit.speed,
                beyond(faster / h, 2) / limit.acceleration,
                beyond(jerk / h, 3) / limit.jerk,
            ];
            if !first {
                most = shares.into_iter().fold(most, f64::max);
            }
            (speed[i], acceleration[i]) = (step / h, faster / h);
        }
    }
    most
}
