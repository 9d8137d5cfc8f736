//! A facility file: the real robots, their limits, the sensor and when to stop, checked.

use crate::check::Checker;
use crate::problem::Problems;
use crate::ranges::{ANGLE, FORCE, LENGTH, MASS, RATE, Range, SPEED};
use crate::read;
use crate::robot::Robot;
use crate::scenario::mount;
use crate::source::Source;
use crate::written::station::{
    EtherCatTable, JointsTable, RailTable, RobotTable, SafetyTable, SensorTable, StationFile,
};
use softdock_kernels::manipulator::Manipulator;
use softdock_kernels::manipulator::cell::{AXES, Mount};
use softdock_kernels::vector::{Pose, Vec3};
use std::path::Path;

/// Format that this version reads.
const FORMAT: &str = "facility/1";
/// Joints of a robot with a spherical wrist.
const JOINTS: usize = 6;

/// The real robots and the sensor of a facility.
#[derive(Clone, Debug)]
pub struct Station {
    /// Name.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// The model of both robots.
    pub model: Manipulator,
    /// Angles of the model where the controllers say zero \[rad\]; last the model's place on the rail there \[m\].
    pub zero: [f64; AXES],
    /// What an axis may do: the joints' of both robots, and the rail's; joints in the model's angles.
    pub limits: [AxisLimits; AXES],
    /// Whether robot 1 stands on a rail.
    pub rail: bool,
    /// Robots 1 and 2.
    pub robots: [StationRobot; 2],
    /// The sensor.
    pub sensor: StationSensor,
    /// When to stop.
    pub safety: Safety,
    source: Source,
}

/// What an axis may do; rad for joints, m for the rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisLimits {
    /// Least position.
    pub lower: f64,
    /// Greatest position.
    pub upper: f64,
    /// Greatest speed \[1/s\].
    pub speed: f64,
    /// Greatest acceleration \[1/s^2\].
    pub acceleration: f64,
    /// Greatest jerk \[1/s^3\].
    pub jerk: f64,
}

/// One real robot.
#[derive(Clone, Debug)]
pub struct StationRobot {
    /// Name or serial number.
    pub name: String,
    /// Address that its controller sends from, or its network interface.
    pub address: Option<String>,
    /// Where it stands and what it holds.
    pub mount: Mount,
    /// Tool frame of its controller, in the flange.
    pub tool: Pose<f64>,
    /// Greatest way of a joint from where the session begins \[rad\].
    pub correction: f64,
    /// Counts per radian (or metre) and counts at zero of its drives, axis by axis, if it is an EtherCAT segment.
    pub drives: Vec<(f64, i32)>,
}

/// The sensor's frame and what it carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StationSensor {
    /// Its frame in part A's.
    pub frame: Pose<f64>,
    /// Mass that hangs on it \[kg\].
    pub tool_mass: f64,
    /// Centre of that mass in the sensor's frame \[m\].
    pub tool_centre: Vec3<f64>,
    /// Measured force above which the parts count as touching \[N\].
    pub touch_force: f64,
}

/// When a run is stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// Lost cycles in a row over which the last command is held.
    pub hold_cycles: u32,
    /// Lost cycles in a row after which the link counts as dead.
    pub stop_cycles: u32,
    /// Greatest age of a sensor sample \[s\].
    pub sensor_age: f64,
    /// Energy that the facility may create in the contact \[J\].
    pub contact_energy: f64,
    /// The run ends with a controlled stop when the latch closes.
    pub end_at_capture: bool,
    /// Greatest measured force \[N\].
    pub force: f64,
    /// Greatest measured moment \[N m\].
    pub moment: f64,
    /// Greatest change of the measured force \[N/s\].
    pub force_rate: f64,
    /// Time over which commands may be cut to speed, acceleration and jerk without a pause \[s\].
    pub clamp_time: f64,
    /// Greatest distance of a measured axis from its command: joints \[rad\], the rail \[m\].
    pub following_error: [f64; 2],
}

impl Station {
    /// Reads a facility file and the robot model that it names.
    ///
    /// # Errors
    /// Everything that is wrong with the file, with places and remedies.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::from_source(Source::read(path, None)?)
    }

    /// The file's text.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    fn from_source(source: Source) -> Result<Self, Problems> {
        let file: StationFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let id = c.name(&file.id);
        let path = c.source.sibling(&file.robot.value);
        let model = Robot::from_source(Source::read(&path, Some((&c.source, file.robot.span.clone())))?)?.model;
        if model.joints.len() != JOINTS {
            let message = format!("a robot of {} joints cannot be driven", model.joints.len());
            c.refuse(&file.robot.span, message, "take a model of six joints");
            Problems::check(std::mem::take(&mut c.problems))?;
        }
        let (zero, limits) = axes(&mut c, &file.joints, file.rail.as_ref(), &model);
        let robots = [&file.robot1, &file.robot2].map(|table| robot(&mut c, table));
        let sensor = sensor(&mut c, &file.sensor);
        let safety = safety(&mut c, &file.safety);
        Problems::check(std::mem::take(&mut c.problems))?;
        let title = file.title.value;
        Ok(Self { id, title, model, zero, limits, rail: file.rail.is_some(), robots, sensor, safety, source: c.source })
    }
}

/// Zeros and limits of the joints and the rail.
fn axes(
    c: &mut Checker,
    joints: &JointsTable,
    rail: Option<&RailTable>,
    model: &Manipulator,
) -> ([f64; AXES], [AxisLimits; AXES]) {
    let still = AxisLimits { lower: 0.0, upper: 0.0, speed: 0.0, acceleration: 0.0, jerk: 0.0 };
    let (mut zero, mut limits) = ([0.0; AXES], [still; AXES]);
    if let Some(written) = &joints.zero {
        zero[..JOINTS].copy_from_slice(&c.list(written, JOINTS, "rad", Range::size(ANGLE)));
    }
    let margin = c.number_or(&joints.margin, 1f64.to_radians(), "rad", Range::within(0.0, ANGLE / 8.0));
    let speed = c.list(&joints.speed, JOINTS, "rad/s", Range::above(0.0, RATE));
    let acceleration = c.list(&joints.acceleration, JOINTS, "rad/s^2", Range::above(0.0, 1e4));
    let jerk = c.list(&joints.jerk, JOINTS, "rad/s^3", Range::above(0.0, 1e6));
    for (i, joint) in model.joints.iter().enumerate() {
        let robot = joint.limits;
        if speed[i] > robot.speed * (1.0 + 1e-9) {
            let (asked, able) = (speed[i].to_degrees(), robot.speed.to_degrees());
            let message = format!("joint {} may not move at {asked} deg/s: its robot makes {able} deg/s", i + 1);
            c.refuse(&joints.speed.span, message, format!("write at most \"{able} deg/s\""));
        }
        let (lower, upper) = (robot.lower + margin, robot.upper - margin);
        limits[i] = AxisLimits { lower, upper, speed: speed[i], acceleration: acceleration[i], jerk: jerk[i] };
    }
    if let Some(rail) = rail {
        zero[JOINTS] = -c.number_or(&rail.zero, 0.0, "m", Range::size(LENGTH));
        limits[JOINTS] = AxisLimits {
            lower: c.number(&rail.lower, "m", Range::within(-LENGTH, 0.0)),
            upper: c.number(&rail.upper, "m", Range::within(0.0, LENGTH)),
            speed: c.number(&rail.speed, "m/s", Range::above(0.0, SPEED)),
            acceleration: c.number(&rail.acceleration, "m/s^2", Range::above(0.0, 1e4)),
            jerk: c.number(&rail.jerk, "m/s^3", Range::above(0.0, 1e6)),
        };
    }
    (zero, limits)
}

fn robot(c: &mut Checker, table: &RobotTable) -> StationRobot {
    StationRobot {
        name: table.name.value.clone(),
        address: table.address.as_ref().map(|address| address.value.clone()),
        mount: mount(c, &table.mount.value),
        tool: c.pose(&table.tool_position, &table.tool_rotation),
        correction: c.number_or(&table.correction, 30f64.to_radians(), "rad", Range::above(0.0, ANGLE)),
        drives: table.ethercat.as_ref().map_or_else(Vec::new, |table| drives(c, table)),
    }
}

fn drives(c: &mut Checker, table: &EtherCatTable) -> Vec<(f64, i32)> {
    let counts = &table.counts.value;
    if !(JOINTS..=AXES).contains(&counts.len()) || counts.iter().any(|counts| !counts.is_finite() || *counts == 0.0) {
        let message = format!("{} drives with these counts", counts.len());
        c.refuse(&table.counts.span, message, "write six numbers other than 0, and a seventh for the rail");
        return Vec::new();
    }
    let zero = table.zero.as_ref().map_or_else(|| vec![0; counts.len()], |zero| zero.value.clone());
    if let (Some(written), true) = (&table.zero, zero.len() != counts.len()) {
        let message = format!("{} zeros of {} drives", zero.len(), counts.len());
        c.refuse(&written.span, message, "write one for each entry of counts");
    }
    counts.iter().copied().zip(zero).collect()
}

fn sensor(c: &mut Checker, table: &SensorTable) -> StationSensor {
    StationSensor {
        frame: c.pose(&table.position, &table.rotation),
        tool_mass: c.number(&table.tool_mass, "kg", Range::within(0.0, MASS)),
        tool_centre: c.vector(&table.tool_centre, "m", Range::size(LENGTH)),
        touch_force: c.number_or(&table.touch_force, 5.0, "N", Range::above(0.0, FORCE)),
    }
}

fn safety(c: &mut Checker, table: &SafetyTable) -> Safety {
    let hold = table.hold_cycles.as_ref().map_or(3, |cycles| c.count(cycles, 1, 1000));
    let stop = table.stop_cycles.as_ref().map_or(10, |cycles| c.count(cycles, 2, 10_000));
    if let (true, Some(written)) = (stop <= hold, table.stop_cycles.as_ref().or(table.hold_cycles.as_ref())) {
        let message = format!("a link that is dead after {stop} lost cycles is never held over {hold}");
        c.refuse(&written.span, message, "write stop_cycles greater than hold_cycles");
    }
    Safety {
        hold_cycles: hold as u32,
        stop_cycles: stop as u32,
        sensor_age: c.number_or(&table.sensor_age, 5e-3, "s", Range::above(0.0, 1.0)),
        contact_energy: c.number_or(&table.contact_energy, 0.5, "J", Range::above(0.0, 1e6)),
        end_at_capture: table.end_at_capture.unwrap_or(true),
        force: c.number_or(&table.force, 500.0, "N", Range::above(0.0, FORCE)),
        moment: c.number_or(&table.moment, 100.0, "N m", Range::above(0.0, FORCE)),
        force_rate: c.number_or(&table.force_rate, 2e5, "N/s", Range::above(0.0, FORCE)),
        clamp_time: c.number_or(&table.clamp_time, 0.1, "s", Range::within(0.0, 1e3)),
        following_error: [
            c.number_or(&table.following_error, 5f64.to_radians(), "rad", Range::above(0.0, ANGLE)),
            c.number_or(&table.rail_following_error, 0.05, "m", Range::above(0.0, LENGTH)),
        ],
    }
}
