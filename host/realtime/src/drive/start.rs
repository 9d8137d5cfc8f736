//! What is checked before anything moves: links whole, rates as configured, poses as computed, sensor quiet.

use crate::arms::Arms;
use crate::log::codes::robot_flags;
use crate::log::record::{CycleRecord, ForceRecord, RobotRecord};
use crate::signals::{AXES, Capabilities, RAIL, axis_name, of_axis};
use crate::time::Nanos;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::vector::Pose;
use std::fmt;

/// Cycles in a row that must come without loss.
pub const GOOD_CYCLES: u32 = 100;
/// Cycles after which the links have had their chance.
pub const LAST_CYCLE: u64 = 2500;
/// Our forward kinematics and the robot's agree this well \[m\], \[rad\].
pub const POSE_TOLERANCE: [f64; 2] = [1e-3, 0.2 * std::f64::consts::PI / 180.0];
/// A run begins this near to its start pose \[m\], \[rad\].
pub const START_TOLERANCE: [f64; 2] = POSE_TOLERANCE;
/// The measured rate is the configured one to this share.
const RATE_TOLERANCE: f64 = 0.05;

/// Why a drive does not begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// No reports of robot 1 or 2.
    NoRobot(usize),
    /// No samples of the sensor.
    NoSensor,
    /// Packets of robot 1 or 2 keep getting lost.
    Lossy(usize),
    /// A robot's cycle is not the configured one: robot, measured and configured \[s\].
    Rate(usize, f64, f64),
    /// A robot is not ready to follow.
    NotReady(usize),
    /// The robot's own pose of its tool differs from ours: robot, distance \[m\], angle \[rad\].
    Pose(usize, f64, f64),
    /// An axis stands outside its limits: robot, axis, position.
    Outside(usize, usize, f64),
    /// The parts are not at the start of the run: robot, distance \[m\], angle \[rad\].
    NotAtStart(usize, f64, f64),
    /// The start of the run is beyond a robot's reach or limits: robot.
    Unreachable(usize),
    /// The way to the start brings the arms too near each other: distance and what is allowed \[m\].
    ArmsOnWay([f64; 2]),
    /// The way to the start leads a link or a tool into a keep-out box: depth \[m\].
    BoxOnWay(f64),
    /// The sensor's samples are invalid or saturated.
    BadSensor,
    /// At rest without contact the sensor's force spreads more than this \[N\].
    Restless(f64),
    /// At rest the sensor reads more beside the tool's weight than it may \[N\], \[N m\], and what it may.
    Bias([f64; 2], [f64; 2]),
    /// The link of robot 1 or 2, or of the sensor (3), cannot go on.
    Link(usize),
    /// A robot's set-point has moved while it was told to stay: robot, axis, by how much.
    Moved(usize, usize, f64),
    /// A robot stands away from its own set-point: robot, axis, by how much.
    Servo(usize, usize, f64),
    /// Somebody else sends to the port of robot 1 or 2: how many datagrams.
    Stranger(usize, u64),
}

/// A robot whose set-point moves by so much while it is told to stay is moved by somebody else \[rad\], \[m\].
const STAYS: [f64; 2] = [1e-3, 1e-3];
/// A robot at rest is so near to its own set-point \[rad\], \[m\].
const SERVO_ERROR: [f64; 2] = [0.01, 5e-3];

/// A way of an axis in the unit that users read.
fn way(axis: usize, by: f64) -> String {
    if axis == RAIL { format!("{:.2} mm", by * 1e3) } else { format!("{:.3} deg", by.to_degrees()) }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mm, deg) = (|v: &f64| v * 1e3, |v: &f64| v.to_degrees());
        match self {
            Self::NoRobot(r) => {
                write!(f, "robot {r} sends nothing: is its program running, and is this the address that it sends to?")
            }
            Self::NoSensor => {
                write!(f, "the sensor sends nothing: check its address, and that no other computer has its stream")
            }
            Self::Lossy(r) => write!(
                f,
                "packets of robot {r} get lost: {GOOD_CYCLES} cycles in a row never came whole; check cable, switch and load"
            ),
            Self::Rate(r, measured, wanted) => {
                let (measured, wanted) = (measured * 1e3, wanted * 1e3);
                write!(f, "robot {r} has a cycle of {measured:.3} ms, {wanted:.3} ms is configured")
            }
            Self::NotReady(r) => write!(f, "robot {r} does not follow commands: drives off, a fault, or a stop"),
            Self::Pose(r, d, a) => write!(
                f,
                "robot {r} reports its tool {:.2} mm and {:.3} deg from where its joints put it by our model (1 mm and 0.2 deg \
                 are allowed): check robot model, [joints] zero, and tool_position and tool_rotation of the facility file",
                mm(d),
                deg(a)
            ),
            Self::Outside(r, axis, at) => {
                let name = axis_name(*axis);
                write!(f, "{name} of robot {r} stands at {at:.4}, outside its limits: move it by hand")
            }
            Self::NotAtStart(r, d, a) => write!(
                f,
                "robot {r} holds its part {:.2} mm and {:.3} deg from the start of the run (1 mm and 0.2 deg are allowed): \
                 move it there with --to-start --arm",
                mm(d),
                deg(a)
            ),
            Self::Unreachable(r) => write!(
                f,
                "robot {r} cannot reach the start of this run within its limits: move its base, or take another run"
            ),
            Self::ArmsOnWay([apart, least]) => write!(
                f,
                "the way to the start brings the arms within {:.0} mm of each other (arm_distance is {:.0} mm): move the robots \
                 nearer to the start by hand",
                mm(apart),
                mm(least)
            ),
            Self::BoxOnWay(depth) => write!(
                f,
                "the way to the start leads a link or a tool {:.0} mm deep into a keep-out box: move the robots nearer to the \
                 start by hand",
                mm(depth)
            ),
            Self::BadSensor => write!(f, "the sensor's samples are invalid or saturated: see its status"),
            Self::Bias([force, moment], [most_force, most_moment]) => write!(
                f,
                "at rest the sensor reads {force:.1} N and {moment:.2} N m beside the weight of its tool ({most_force} N and \
                 {most_moment} N m are allowed): check tool_mass, tool_centre and the axes of [sensor] in the facility file, \
                 what lies against the tool, and the sensor's own bias"
            ),
            Self::Link(3) => write!(f, "the link of the sensor cannot go on"),
            Self::Link(r) => write!(f, "the link of robot {r} cannot go on"),
            Self::Moved(r, axis, by) => write!(
                f,
                "{} of robot {r} was moved by {} while it was told to stay: somebody else moves it, or its controller has \
                 begun a new session; begin again",
                axis_name(*axis),
                way(*axis, *by)
            ),
            Self::Servo(r, axis, by) => write!(
                f,
                "{} of robot {r} stands {} from its own set-point: brakes closed, drives off, or something holds it",
                axis_name(*axis),
                way(*axis, *by)
            ),
            Self::Stranger(r, count) => {
                write!(f, "{count} datagrams of somebody else have come for robot {r}: find out who, and begin again")
            }
            Self::Restless(n) => {
                write!(f, "at rest the measured force spreads by {n:.1} N: something touches or vibrates")
            }
        }
    }
}

/// Distance \[m\] and angle \[rad\] between two poses.
pub fn apart(one: &Pose<f64>, two: &Pose<f64>) -> (f64, f64) {
    let turn = one.attitude.compose(two.attitude.conjugate());
    ((one.position - two.position).norm(), 2.0 * turn.v.norm().atan2(turn.w.abs()))
}

/// What the start-up has seen of one robot.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    good: u32,
    /// Arrival of its first report and of its last one, and how many it had sent by then, as our link counts them.
    first: Option<(Nanos, u64)>,
    last: (Nanos, u64),
    /// Set-point of its first report.
    set_point: [f64; AXES],
}

/// The links that a start-up checks, as a cycle has left them.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// Robots 1 and 2.
    pub robots: [&'a RobotRecord; 2],
    /// The sensor.
    pub sensor: &'a ForceRecord,
    /// Which of these links cannot go on.
    pub broken: [bool; 3],
}

impl<'a> Watched<'a> {
    /// Those who take the commands.
    pub fn moved(record: &'a CycleRecord, broken: [bool; 3]) -> Self {
        Self { robots: moved(record), sensor: moved_sensor(record), broken }
    }

    /// The real ones of a dry run.
    pub fn exercised(record: &'a CycleRecord, broken: [bool; 3]) -> Self {
        Self { robots: [&record.robot_1, &record.robot_2], sensor: &record.ft, broken }
    }
}

/// The checks at start-up, cycle by cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct StartUp {
    robots: [Seen; 2],
    samples: u32,
    cycles: u64,
}

impl StartUp {
    /// One more cycle; an answer once all checks have passed, or one has failed.
    pub fn check(
        &mut self,
        links: &Watched,
        arms: &Arms,
        limits: &[AxisLimits; AXES],
        robots: &[Capabilities; 2],
    ) -> Option<Result<(), Refusal>> {
        self.cycles += 1;
        for (seen, robot) in self.robots.iter_mut().zip(links.robots) {
            let fresh = robot.flags & robot_flags::FRESH != 0;
            if fresh {
                if seen.first.is_none() {
                    seen.set_point = robot.set_point();
                }
                seen.last = (robot.received, robot.link.received + robot.link.lost);
                seen.first.get_or_insert(seen.last);
            }
            seen.good = if fresh { seen.good + 1 } else { 0 };
        }
        if let Some(refusal) = self.disturbed(links) {
            return Some(Err(refusal));
        }
        self.samples += u32::from(links.sensor.flags & crate::log::codes::force_flags::FRESH != 0);
        let slower = robots.map(|robot| robot.cycle.0 as f64 / robots[0].cycle.0 as f64);
        // A robot slower than the master is not fresh in every cycle of it.
        let whole =
            (0..2).all(|r| self.robots[r].good >= GOOD_CYCLES || slower[r] > 1.01 && self.robots[r].first.is_some());
        if whole && self.samples > 0 && self.cycles >= u64::from(GOOD_CYCLES) {
            // Whoever waits for GO has all the time, and may lose a packet over it.
            self.cycles = u64::from(GOOD_CYCLES);
            return Some(self.verdict(links, arms, limits, robots));
        }
        (self.cycles >= LAST_CYCLE).then(|| Err(self.missing(robots)))
    }

    /// What ends the start-up at once: a link that cannot go on, a robot that somebody else moves or writes to.
    fn disturbed(&self, links: &Watched) -> Option<Refusal> {
        if let Some(link) = links.broken.iter().position(|broken| *broken) {
            return Some(if link == 2 && self.samples == 0 { Refusal::NoSensor } else { Refusal::Link(link + 1) });
        }
        for (r, robot) in links.robots.into_iter().enumerate().filter(|(r, _)| self.robots[*r].first.is_some()) {
            let (now, first) = (robot.set_point(), self.robots[r].set_point);
            if let Some(i) = (0..AXES).find(|i| (now[*i] - first[*i]).abs() > of_axis(STAYS, *i)) {
                return Some(Refusal::Moved(r + 1, i, (now[i] - first[i]).abs()));
            }
            if robot.link.foreign > 0 {
                return Some(Refusal::Stranger(r + 1, robot.link.foreign));
            }
        }
        None
    }

    fn missing(&self, robots: &[Capabilities; 2]) -> Refusal {
        match (0..2).find(|r| self.robots[*r].first.is_none()) {
            Some(r) => Refusal::NoRobot(r + 1),
            None if self.samples == 0 => Refusal::NoSensor,
            None => (0..2)
                .find_map(|r| self.off_rate(r, robots))
                .unwrap_or(Refusal::Lossy(if self.robots[0].good < GOOD_CYCLES { 1 } else { 2 })),
        }
    }

    /// A robot that sends at another rate than it is configured for, by its own count of what it sends.
    fn off_rate(&self, robot: usize, robots: &[Capabilities; 2]) -> Option<Refusal> {
        let Seen { first: Some(first), last, .. } = self.robots[robot] else { return None };
        let (sent, wanted) = (last.1 - first.1, robots[robot].cycle.seconds());
        // Links that count nothing, and a handful of reports, tell no rate.
        let measured = (last.0 - first.0).seconds() / sent as f64;
        let is_off = sent >= 50 && (measured - wanted).abs() > RATE_TOLERANCE * wanted;
        is_off.then_some(Refusal::Rate(robot + 1, measured, wanted))
    }

    fn verdict(
        &self,
        links: &Watched,
        arms: &Arms,
        limits: &[AxisLimits; AXES],
        capabilities: &[Capabilities; 2],
    ) -> Result<(), Refusal> {
        for (r, robot) in links.robots.into_iter().enumerate() {
            if let Some(refusal) = self.off_rate(r, capabilities) {
                return Err(refusal);
            }
            if robot.flags & robot_flags::READY == 0 {
                return Err(Refusal::NotReady(r + 1));
            }
            let error = |i: usize| (robot.position[i] - robot.set_point()[i]).abs();
            if let Some(i) = (0..AXES).find(|i| error(*i) > of_axis(SERVO_ERROR, *i)) {
                return Err(Refusal::Servo(r + 1, i, error(i)));
            }
            let axes = (0..AXES).find(|i| {
                let at = robot.position[*i];
                !(limits[*i].lower - 1e-9..=limits[*i].upper + 1e-9).contains(&at) && (*i < AXES - 1 || r == 0)
            });
            if let Some(i) = axes {
                return Err(Refusal::Outside(r + 1, i, robot.position[i]));
            }
            if robot.flags & robot_flags::POSE != 0 {
                let (distance, angle) = apart(&robot.tool, &arms.tool_pose(r, &robot.position));
                if !(distance <= POSE_TOLERANCE[0] && angle <= POSE_TOLERANCE[1]) {
                    return Err(Refusal::Pose(r + 1, distance, angle));
                }
            }
        }
        let bad = crate::log::codes::force_flags::SATURATED | crate::log::codes::force_flags::INVALID;
        if links.sensor.flags & bad != 0 {
            return Err(Refusal::BadSensor);
        }
        Ok(())
    }
}

/// The robots that take the commands: the emulated ones of a dry run, else the real ones.
pub fn moved(record: &CycleRecord) -> [&RobotRecord; 2] {
    if record.emulated_1.present() {
        [&record.emulated_1, &record.emulated_2]
    } else {
        [&record.robot_1, &record.robot_2]
    }
}

/// The sensor beside the robots that take the commands.
pub fn moved_sensor(record: &CycleRecord) -> &ForceRecord {
    if record.emulated_ft.flags != 0 { &record.emulated_ft } else { &record.ft }
}
