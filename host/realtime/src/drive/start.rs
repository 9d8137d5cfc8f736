//! Start-up checks before any motion: links, rates, poses, sensor at rest.

use super::checklist::{Check, CheckKind, CheckOutcome, Checklist};
use super::motion::JointMove;
use crate::arms::Arms;
use crate::log::codes::{force_flags, robot_flags};
use crate::log::record::{CycleRecord, ForceRecord, RobotRecord};
use crate::sensing::Sensing;
use crate::signals::{AXES, Capabilities, RAIL, of_axis};
use crate::time::Nanos;
use softdock_campaign::Station;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::contact::overlap::deepest_overlap;
use softdock_kernels::plant::Plant;
use softdock_kernels::session::clearance_at;
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::Pose;

/// Successive reports without loss that a start-up requires.
pub const GOOD_REPORTS: u32 = 100;
/// Minimum of them for a robot slower than the master.
const FEWEST_REPORTS: u32 = 10;
/// Cycles after which a missing report fails the start-up.
pub const LAST_CYCLE: u64 = 2500;
/// Cycles between two listings of checks that do not decide yet.
pub const SHOWN_EVERY: u64 = 25;
/// Tolerance between our forward kinematics and the robot's \[m\], \[rad\].
pub const POSE_TOLERANCE: [f64; 2] = [1e-3, 0.2 * std::f64::consts::PI / 180.0];
/// Tolerance of the start pose \[m\], \[rad\].
pub const START_TOLERANCE: [f64; 2] = POSE_TOLERANCE;
/// Tolerance of a set-point while no motion is commanded; beyond it another master moves the robot \[rad\], \[m\].
const STAYS: [f64; 2] = [1e-3, 1e-3];
/// Tolerance of a robot at rest from its own set-point \[rad\], \[m\].
const SERVO_ERROR: [f64; 2] = [0.01, 5e-3];
/// Greatest difference between the rates of a robot's clock and ours.
const CLOCK_TOLERANCE: f64 = 0.02;
/// A stamp whose rate differs by more counts cycles, not time.
const COUNTS_TIME: std::ops::Range<f64> = 0.5..2.0;
/// A report later than this share of a cycle after the last one counts as lost.
const GAP: f64 = 1.6;
/// Greatest force range of a sensor at rest, as a multiple of the touch force.
pub(super) const REST_FORCE_RANGE: f64 = 2.0;
/// Samples of a weighing.
const WEIGHING_SAMPLES: u32 = 100;
/// Number of poses of a path at which distances are computed.
const WAY_POSES: u32 = 200;

/// Returns distance \[m\] and angle \[rad\] between two poses.
pub fn apart(one: &Pose<f64>, two: &Pose<f64>) -> (f64, f64) {
    let turn = one.attitude.compose(two.attitude.conjugate());
    ((one.position - two.position).norm(), 2.0 * turn.v.norm().atan2(turn.w.abs()))
}

/// Received reports of one robot since the start-up began.
#[derive(Clone, Copy, Debug, Default)]
struct RobotHistory {
    /// Reports since the last gap, and the robot's count of late answers when they began.
    good: u32,
    late_answers: u32,
    /// Arrival, stamp and number of its first and last report; the number counts lost reports as well.
    first: Option<Report>,
    last: Report,
    /// Set-point of its first report.
    set_point: [f64; AXES],
}

#[derive(Clone, Copy, Debug, Default)]
struct Report {
    received: Nanos,
    stamp: Nanos,
    number: u64,
}

impl RobotHistory {
    /// Takes a cycle's record of the robot; `period` is the longer of its cycle and the master's.
    fn take(&mut self, robot: &RobotRecord, now: Nanos, period: Nanos) {
        let gap = |until: Nanos| (until - self.last.received).0 as f64 > GAP * period.0 as f64;
        if robot.flags & robot_flags::FRESH == 0 {
            if gap(now) {
                self.good = 0;
            }
            return;
        }
        if self.first.is_none() {
            self.set_point = robot.set_point();
        }
        if self.good == 0 || gap(robot.received) {
            (self.good, self.late_answers) = (0, robot.late_answers);
        }
        self.good += 1;
        let number = robot.link.received + robot.link.lost;
        self.last = Report { received: robot.received, stamp: robot.stamp, number };
        self.first.get_or_insert(self.last);
    }

    /// Returns the mean period by its own report count \[s\]; NaN without a count, or after few reports.
    fn period(&self) -> f64 {
        let Some(first) = self.first else { return f64::NAN };
        let sent = self.last.number - first.number;
        if sent >= 50 { (self.last.received - first.received).seconds() / sent as f64 } else { f64::NAN }
    }

    /// Returns the rate difference of its clock and ours, where its stamp is a time.
    fn clock(&self) -> f64 {
        let Some(first) = self.first.filter(|first| self.last.number >= first.number + 50) else { return f64::NAN };
        let rate = (self.last.stamp - first.stamp).0 as f64 / (self.last.received - first.received).0 as f64;
        if COUNTS_TIME.contains(&rate) { (rate - 1.0).abs() } else { f64::NAN }
    }
}

/// Mean and range of a sensor at rest, without the weight of the tool.
#[derive(Clone, Copy, Debug)]
pub struct Weighing {
    sum: Wrench<f64>,
    least: f64,
    most: f64,
    samples: u32,
}

impl Default for Weighing {
    fn default() -> Self {
        Self { sum: Wrench::zero(), least: f64::INFINITY, most: 0.0, samples: 0 }
    }
}

impl Weighing {
    /// Takes a reading without the weight of the tool, sensor axes.
    pub fn take(&mut self, net: Wrench<f64>) {
        let force = net.force.norm();
        (self.sum, self.samples) = (self.sum + net, self.samples + 1);
        (self.least, self.most) = (self.least.min(force), self.most.max(force));
    }

    /// Returns the mean of the readings; NaN without one.
    pub fn mean(&self) -> Wrench<f64> {
        self.sum.scale_add(1.0 / f64::from(self.samples), Wrench::zero())
    }

    /// Returns the difference between the greatest and the least force \[N\]; NaN without a reading.
    pub fn spread(&self) -> f64 {
        if self.samples == 0 { f64::NAN } else { self.most - self.least }
    }

    /// Number of readings.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Returns the checks of a sensor at rest: range, force and moment, each with its limit.
    pub fn checks(&self, station: &Station) -> [Check; 3] {
        let (mean, sensor) = (self.mean(), &station.sensor);
        [
            Check::new(CheckKind::RestSpread, self.spread(), REST_FORCE_RANGE * sensor.touch_force),
            Check::new(CheckKind::RestForce, mean.force.norm(), sensor.bias[0]),
            Check::new(CheckKind::RestMoment, mean.moment.norm(), sensor.bias[1]),
        ]
    }
}

/// The links that a start-up checks, from a cycle's record.
#[derive(Clone, Copy, Debug)]
pub struct CheckedLinks<'a> {
    /// Robots 1 and 2.
    pub robots: [&'a RobotRecord; 2],
    /// The sensor.
    pub sensor: &'a ForceRecord,
    /// Links that have failed: robots 1 and 2, sensor.
    pub broken: [bool; 3],
}

impl<'a> CheckedLinks<'a> {
    /// Selects the links that receive the commands.
    pub fn moved(record: &'a CycleRecord, broken: [bool; 3]) -> Self {
        Self { robots: moved(record), sensor: moved_sensor(record), broken }
    }

    /// Selects the real links of a dry run.
    pub fn exercised(record: &'a CycleRecord, broken: [bool; 3]) -> Self {
        Self { robots: [&record.robot_1, &record.robot_2], sensor: &record.ft, broken }
    }
}

/// Reference values of the start-up checks.
#[derive(Clone, Copy)]
pub struct StartUpContext<'a> {
    /// Kinematics of the robots.
    pub arms: &'a Arms,
    /// Limits of the axes in controller coordinates.
    pub limits: &'a [AxisLimits; AXES],
    /// Capabilities of the robots.
    pub robots: &'a [Capabilities; 2],
    /// The facility.
    pub station: &'a Station,
    /// The scenario.
    pub plant: &'a Plant,
    /// The sensor.
    pub sensing: &'a Sensing,
    /// Parts at the start of the run-in, at rest.
    pub start: &'a Parts<f64>,
    /// Whether the robots are moved there first.
    pub to_start: bool,
    /// Start of the cycle since the start of the session.
    pub now: Nanos,
}

/// The checks, as far as they are known in a cycle.
#[derive(Clone, Copy, Debug)]
pub struct StartUpResult {
    /// The checks.
    pub list: Checklist,
    /// Whether the list decides: it is complete, or a check failed that ends the start-up at once.
    pub decides: bool,
}

/// The start-up checks, cycle by cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct StartUp {
    robots: [RobotHistory; 2],
    samples: u64,
    weighings: [Weighing; 2],
    cycles: u64,
    path: Option<PathClearance>,
}

impl StartUp {
    /// Takes one cycle. Returns the checks every [`SHOWN_EVERY`] cycles, and in every cycle once they decide.
    pub fn check(&mut self, links: &CheckedLinks, cell: &StartUpContext) -> Option<StartUpResult> {
        self.cycles += 1;
        let master = cell.robots[0].cycle;
        for ((history, robot), can) in self.robots.iter_mut().zip(links.robots).zip(cell.robots) {
            history.take(robot, cell.now, can.cycle.max(master));
        }
        if links.sensor.flags & force_flags::FRESH != 0 {
            self.samples += 1;
            // The weight of the tool depends on the posture of robot 1.
            if self.robots[0].first.is_some() {
                self.weigh(links, cell);
            }
        }
        let good = (0..2).all(|r| self.robots[r].good >= reports_wanted(cell.robots, r));
        let whole = good && self.samples > 0 && self.cycles >= u64::from(GOOD_REPORTS);
        if whole {
            // While the operator has not given GO, an occasional loss is no reason to fail.
            self.cycles = u64::from(GOOD_REPORTS);
        }
        let disturbed = self.disturbs(links).into_iter().any(|check| check.answer() == CheckOutcome::Failed);
        let settled = whole || self.cycles >= LAST_CYCLE;
        let decides = settled || disturbed;
        let shown = decides || self.cycles.is_multiple_of(SHOWN_EVERY);
        shown.then(|| StartUpResult { list: self.list(links, cell, settled), decides })
    }

    /// Stores the reading; keeps about the last hundred.
    fn weigh(&mut self, links: &CheckedLinks, cell: &StartUpContext) {
        if self.weighings[0].samples() >= WEIGHING_SAMPLES {
            self.weighings = [Weighing::default(), self.weighings[0]];
        }
        let a = cell.arms.part_on(0, &links.robots[0].position, &[0.0; AXES]);
        self.weighings[0].take(links.sensor.raw - cell.sensing.weight(&a));
    }

    /// Returns the sensor's readings at rest, without the weight of its tool.
    pub fn weighing(&self) -> Weighing {
        let [now, before] = self.weighings;
        if before.samples() > 0 { before } else { now }
    }

    /// Returns the checks that end a start-up at once: failed links, foreign senders, foreign motion commands.
    fn disturbs(&self, links: &CheckedLinks) -> [Check; 7] {
        let works = |broken: bool| f64::from(u8::from(!broken));
        let of_robot = |r: usize| {
            let (robot, history) = (links.robots[r], &self.robots[r]);
            let link = Check::of_robot(CheckKind::Link, r, works(links.broken[r]), 1.0);
            let foreign = Check::of_robot(CheckKind::Foreign, r, robot.link.foreign as f64, 0.0);
            let change = |i: usize| (robot.set_point()[i] - history.set_point[i]).abs();
            let still = worst_axis(CheckKind::Still, r, change, STAYS);
            let value = if history.first.is_some() { still.value } else { f64::NAN };
            [link, foreign, Check { value, ..still }]
        };
        let ([a, b, c], [d, e, f]) = (of_robot(0), of_robot(1));
        [a, d, Check::new(CheckKind::SensorLink, works(links.broken[2]), 1.0), b, e, c, f]
    }

    /// Returns all checks with their known values; before the links are `settled`, missing data decide nothing.
    fn list(&mut self, links: &CheckedLinks, cell: &StartUpContext, settled: bool) -> Checklist {
        let mut list = Checklist::default();
        for r in 0..2 {
            let history = &self.robots[r];
            let reports = history.first.map_or(0, |first| history.last.number - first.number + 1);
            list.push(Check { decides: settled, ..Check::of_robot(CheckKind::Reports, r, reports as f64, 1.0) });
        }
        list.push(Check { decides: settled, ..Check::new(CheckKind::Samples, self.samples as f64, 1.0) });
        self.disturbs(links).into_iter().for_each(|check| list.push(check));
        self.of_links(links, cell, settled, &mut list);
        for r in (0..2).filter(|r| self.robots[*r].first.is_some()) {
            of_robot(r, links.robots[r], cell, &mut list);
        }
        if self.samples > 0 {
            of_sensor(links.sensor, cell, &mut list);
            let weighed = self.weighing().samples() > 0;
            let checks = self.weighing().checks(cell.station);
            checks.into_iter().for_each(|check| list.push(Check { decides: weighed || settled, ..check }));
            for kind in [CheckKind::TurnedForce, CheckKind::TurnedMoment] {
                let limit = cell.station.sensor.weighing[usize::from(kind == CheckKind::TurnedMoment)];
                list.push(Check::new(kind, f64::NAN, limit));
            }
        }
        if self.robots.iter().all(|history| history.first.is_some()) {
            if settled {
                self.path.get_or_insert_with(|| path_clearance(links, cell));
            }
            let path = self.path.unwrap_or(PathClearance { parts: f64::NAN, arms: f64::NAN, depth: f64::NAN });
            let rules = &cell.plant.facility.rules;
            list.push(Check::new(CheckKind::Clearance, path.parts, 0.0));
            if rules.arm_distance.is_finite() {
                list.push(Check::new(CheckKind::ArmDistance, path.arms, rules.arm_distance));
            }
            if !rules.keep_out.is_empty() {
                list.push(Check::new(CheckKind::KeepOut, path.depth, 0.0));
            }
        }
        list
    }

    /// Adds rates, losses and clocks.
    fn of_links(&self, links: &CheckedLinks, cell: &StartUpContext, settled: bool, list: &mut Checklist) {
        let mut rows = |kind: CheckKind, value: &dyn Fn(usize) -> f64, limit: &dyn Fn(usize) -> f64| {
            let decides = settled || kind != CheckKind::Loss;
            (0..2).for_each(|r| list.push(Check { decides, ..Check::of_robot(kind, r, value(r), limit(r)) }));
        };
        rows(CheckKind::Period, &|r| self.robots[r].period(), &|r| cell.robots[r].cycle.seconds());
        rows(CheckKind::Loss, &|r| f64::from(self.robots[r].good), &|r| f64::from(reports_wanted(cell.robots, r)));
        let late = |r: usize| links.robots[r].late_answers.saturating_sub(self.robots[r].late_answers);
        rows(CheckKind::Late, &|r| f64::from(late(r)), &|_| f64::from(cell.station.links.hold_cycles));
        rows(CheckKind::Clock, &|r| self.robots[r].clock(), &|_| CLOCK_TOLERANCE);
    }
}

/// Returns the successive reports that a robot must send: those of the master's time.
fn reports_wanted(robots: &[Capabilities; 2], robot: usize) -> u32 {
    let slower = (robots[robot].cycle.0 as f64 / robots[0].cycle.0 as f64).max(1.0);
    ((f64::from(GOOD_REPORTS) / slower) as u32).max(FEWEST_REPORTS)
}

/// Axes of a robot; only robot 1 has the rail.
fn axes(robot: usize) -> std::ops::Range<usize> {
    0..if robot == 0 { AXES } else { RAIL }
}

/// Returns the check of the axis with the greatest share of its tolerance.
fn worst_axis(kind: CheckKind, robot: usize, value: impl Fn(usize) -> f64, tolerance: [f64; 2]) -> Check {
    let share = |i: &usize| value(*i) / of_axis(tolerance, *i);
    let axis = axes(robot).rev().max_by(|i, j| share(i).total_cmp(&share(j))).unwrap_or(0);
    Check { axis: Some(axis), ..Check::of_robot(kind, robot, value(axis), of_axis(tolerance, axis)) }
}

/// Adds the checks of the robot itself.
fn of_robot(r: usize, robot: &RobotRecord, cell: &StartUpContext, list: &mut Checklist) {
    let ready = f64::from(u8::from(robot.flags & robot_flags::READY != 0));
    list.push(Check::of_robot(CheckKind::Ready, r, ready, 1.0));
    let error = |i: usize| (robot.position[i] - robot.set_point()[i]).abs();
    list.push(worst_axis(CheckKind::Servo, r, error, SERVO_ERROR));
    let margin = |i: usize| {
        let (at, limit) = (robot.position[i], &cell.limits[i]);
        // Tolerates rounding of positions on the wire.
        (at - limit.lower).min(limit.upper - at) + 1e-9
    };
    let nearest = axes(r).min_by(|i, j| margin(*i).total_cmp(&margin(*j))).unwrap_or(0);
    list.push(Check { axis: Some(nearest), ..Check::of_robot(CheckKind::Range, r, margin(nearest), 0.0) });
    let tool = if robot.flags & robot_flags::POSE != 0 {
        apart(&robot.tool, &cell.arms.tool_pose(r, &robot.position))
    } else {
        (f64::NAN, f64::NAN)
    };
    list.push(Check::of_robot(CheckKind::ToolPosition, r, tool.0, POSE_TOLERANCE[0]));
    list.push(Check::of_robot(CheckKind::ToolRotation, r, tool.1, POSE_TOLERANCE[1]));
    if cell.station.torques.limits.is_some() {
        let reports = f64::from(u8::from(robot.flags & robot_flags::TORQUE != 0));
        list.push(Check::of_robot(CheckKind::Torques, r, reports, 1.0));
    }
    let start = if r == 0 { &cell.start.a } else { &cell.start.b };
    let reaches = cell.arms.axes_for(r, start).1;
    list.push(Check::of_robot(CheckKind::Reach, r, f64::from(u8::from(reaches)), 1.0));
    let [position, rotation] = start_errors(r, &robot.position, cell.arms, cell.start);
    let decides = !cell.to_start;
    list.push(Check { decides, ..position });
    list.push(Check { decides, ..rotation });
}

/// Returns the distance and angle of a robot's part from the start of the run.
pub fn start_errors(robot: usize, axes: &[f64; AXES], arms: &Arms, start: &Parts<f64>) -> [Check; 2] {
    let (want, at) = (if robot == 0 { &start.a } else { &start.b }, arms.part_on(robot, axes, &[0.0; AXES]));
    let pose = |motion: &Motion<f64>| Pose { position: motion.position, attitude: motion.attitude };
    let (distance, angle) = apart(&pose(want), &pose(&at));
    [
        Check::of_robot(CheckKind::StartPosition, robot, distance, START_TOLERANCE[0]),
        Check::of_robot(CheckKind::StartRotation, robot, angle, START_TOLERANCE[1]),
    ]
}

/// Adds the checks of the sensor's stream.
fn of_sensor(sensor: &ForceRecord, cell: &StartUpContext, list: &mut Checklist) {
    let valid = sensor.flags & (force_flags::SATURATED | force_flags::INVALID) == 0;
    list.push(Check::new(CheckKind::Status, f64::from(u8::from(valid)), 1.0));
    let age = (cell.now - sensor.received).seconds();
    list.push(Check::new(CheckKind::Age, age, cell.station.links.sensor_age));
}

/// Least distances of the robots at rest and along their path to the start of the run.
#[derive(Clone, Copy, Debug)]
struct PathClearance {
    /// Least distance of the parts \[m\]; NaN if no pair of shapes can touch.
    parts: f64,
    /// Least distance of the arms \[m\].
    arms: f64,
    /// Greatest depth in a keep-out box \[m\].
    depth: f64,
}

fn path_clearance(links: &CheckedLinks, cell: &StartUpContext) -> PathClearance {
    let from = links.robots.map(|robot| robot.position);
    let (to, reachable) = cell.arms.positions_for(cell.start);
    let path = JointMove::new(from, if cell.to_start && reachable { to } else { from }, cell.limits);
    let near = |k: u32| {
        let axes = path.at(path.duration() * f64::from(k) / f64::from(WAY_POSES));
        let parts = cell.arms.parts_on(&axes, &[[0.0; AXES]; 2]);
        let parts = deepest_overlap(cell.plant, &parts).map_or(f64::NAN, |overlap| -overlap.depth);
        let axes: [[f64; AXES]; 2] = std::array::from_fn(|robot| cell.arms.in_model(robot, &axes[robot]));
        let found = clearance_at(cell.plant, [&axes[0], &axes[1]]);
        PathClearance { parts, arms: found.arms, depth: found.depth }
    };
    let nearest = |one: PathClearance, two: PathClearance| PathClearance {
        parts: one.parts.min(two.parts),
        arms: one.arms.min(two.arms),
        depth: one.depth.max(two.depth),
    };
    (1..=WAY_POSES).map(near).fold(near(0), nearest)
}

/// Selects the robots that receive the commands: the emulated ones of a dry run, else the real ones.
pub fn moved(record: &CycleRecord) -> [&RobotRecord; 2] {
    if record.emulated_1.present() {
        [&record.emulated_1, &record.emulated_2]
    } else {
        [&record.robot_1, &record.robot_2]
    }
}

/// Selects the sensor of the robots that receive the commands.
pub fn moved_sensor(record: &CycleRecord) -> &ForceRecord {
    if record.emulated_ft.flags != 0 { &record.emulated_ft } else { &record.ft }
}
