//! A facility file: the real robots, their limits, the sensor and when to stop, checked.

use crate::check::Checker;
use crate::mount::mount;
use crate::problem::Problems;
use crate::read;
use crate::robot::Robot;
use crate::source::Source;
use crate::written::At;
use crate::written::station::{
    EtherCatTable, JointsTable, KeepOutTable, RailTable, RobotTable, SafetyTable, SensorTable, StationFile,
};
use softdock_kernels::manipulator::cell::{AXES, Carriage, Feedforward, Mount, Servo};
use softdock_kernels::manipulator::{Drive, Friction, Joint, JointLimits, Manipulator, VelocityLoop};
use softdock_kernels::model::{AxisRange, JointLevel, KeepOut, Link, MAX_KEEP_OUT, SessionRobots, SessionRules};
use softdock_kernels::range::{ANGLE, FORCE, LENGTH, MASS, RATE, Range, SPEED};
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3};
use std::path::Path;

/// Format that this version reads.
pub(crate) const FORMAT: &str = "facility/2";
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
    /// Angles of the model at the controllers' zeros \[rad\]; last the model's position on the rail there \[m\].
    pub zero: [f64; AXES],
    /// What an axis may do: the joints' of both robots, and the rail's; joints in the model's angles.
    pub limits: [AxisLimits; AXES],
    /// Whether robot 1 is mounted on a rail.
    pub rail: bool,
    /// Robots 1 and 2.
    pub robots: [StationRobot; 2],
    /// The sensor.
    pub sensor: StationSensor,
    /// Serial number that the sensor must state.
    pub sensor_serial: Option<String>,
    /// What a session tolerates of its links.
    pub links: LinkRules,
    /// What torques of the robots need no explanation.
    pub torques: TorqueRules,
    /// The rules that stop a session, in the farm and on the robots.
    pub rules: SessionRules,
    /// A session ends with a controlled stop when the latch closes.
    pub end_at_capture: bool,
    /// The robots' model.
    robot_source: Source,
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
    /// Its base and its part.
    pub mount: Mount,
    /// Tool frame of its controller, in the flange.
    pub tool: Pose<f64>,
    /// Greatest way of a joint from where the session begins \[rad\].
    pub correction: f64,
    /// Radius of what it holds, about the line from its last link's frame to the part's origin \[m\].
    pub tool_radius: f64,
    /// Counts per radian (or metre) and counts at zero of its drives, axis by axis, if it is an EtherCAT segment.
    pub drives: Vec<(f64, i32)>,
}

/// The sensor's frame and load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StationSensor {
    /// Its frame in part A's.
    pub frame: Pose<f64>,
    /// Mass that hangs on it \[kg\].
    pub tool_mass: f64,
    /// Centre of that mass in the sensor's frame \[m\].
    pub tool_centre: Vec3<f64>,
    /// Greatest force and moment that it may read at rest beside the tool's weight \[N\], \[N m\].
    pub bias: [f64; 2],
    /// Angle by which a session turns the tool to weigh it in a second attitude \[rad\]; 0: it does not.
    pub weighing_turn: f64,
    /// Greatest change of force and moment there beyond that of the tool's weight \[N\], \[N m\].
    pub weighing: [f64; 2],
    /// Measured force above which the parts count as touching \[N\].
    pub touch_force: f64,
}

/// What a robot's tool may be from its command, the more the faster it is commanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking {
    /// At rest \[m\].
    pub distance: f64,
    /// At rest \[rad\].
    pub angle: f64,
    /// For each unit of commanded speed or angular speed: how late the robot may be \[s\].
    pub time: f64,
}

/// Torques of a joint that weight and measured force need not explain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRules {
    /// For each joint \[N m\]; none: torques are not compared.
    pub limits: Option<[f64; JOINTS]>,
    /// Time for which a torque may be beyond its limit \[s\].
    pub time: f64,
}

/// What geometry and measured force may contradict each other by, as long as no latch holds the parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plausible {
    /// Overlap of the parts up to which a sensor may feel nothing \[m\].
    pub blind_overlap: f64,
    /// Distance of the parts from which on no force is plausible \[m\].
    pub free_distance: f64,
    /// Force that is plausible there, of inertia and noise \[N\].
    pub free_force: f64,
}

/// What a session tolerates of its links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkRules {
    /// Cycles in a row, lost or with an answer that the robot has not taken, over which the last command is held.
    pub hold_cycles: u32,
    /// Lost cycles in a row after which the link counts as dead.
    pub stop_cycles: u32,
    /// The span in which such cycles are counted \[s\].
    pub window: f64,
    /// Most of them in a window.
    pub window_cycles: u32,
    /// Longest time for which a robot is led back to its commands after such cycles \[s\].
    pub catch_up: f64,
    /// What a robot's tool may be from its command: at rest \[m\], \[rad\], and for each unit of commanded speed \[s\].
    pub tracking: Tracking,
    /// What geometry and measured force may contradict each other by.
    pub contact: Plausible,
    /// Greatest age of a sensor sample \[s\].
    pub sensor_age: f64,
}

impl Station {
    /// Reads a facility file and the robot model that it names.
    ///
    /// # Errors
    /// Everything that is wrong with the file, with places and remedies.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::from_source(Source::read(path, None)?)
    }

    /// Its robots joint by joint, as ideal drives: for where the joints stand and what they may do.
    pub fn joint_level(&self) -> JointLevel {
        let still = VelocityLoop { gain: 0.0, integral_time: f64::INFINITY };
        JointLevel {
            robot: self.model.clone(),
            mounts: [self.robots[0].mount, self.robots[1].mount],
            servo: Servo { velocity: [still; JOINTS], feedforward: Feedforward::Off },
            carriage: self.rail.then(|| Carriage { joint: rail_joint(&self.limits[JOINTS]), velocity: still }),
        }
    }

    /// Its robots as a session's rules look at them.
    pub fn session_robots(&self) -> SessionRobots {
        let range = |limit: AxisLimits| {
            let AxisLimits { lower, upper, speed, acceleration, .. } = limit;
            AxisRange { lower, upper, speed, acceleration }
        };
        SessionRobots {
            level: self.joint_level(),
            limits: self.limits.map(range),
            correction: [self.robots[0].correction, self.robots[1].correction],
            tool_radius: [self.robots[0].tool_radius, self.robots[1].tool_radius],
        }
    }

    /// Where the file lies.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// The file's text with its robots' model beside it: the text, and name and text of the model.
    pub(crate) fn gathered(&self) -> (String, (String, String)) {
        let name = |source: &Source| {
            source.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
        };
        let (model, written) = (name(&self.robot_source), &self.text()[self.source.span_of("robot")]);
        let text = self.text().replacen(written, &format!("\"{model}\""), 1);
        (text, (model, self.robot_source.text().to_owned()))
    }

    /// The file's text.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// The file and its robots' model.
    pub(crate) fn sources(&self) -> [&Source; 2] {
        [&self.source, &self.robot_source]
    }

    pub(crate) fn from_source(source: Source) -> Result<Self, Problems> {
        let file: StationFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let id = c.name(&file.id);
        let path = c.source.sibling(&file.robot.value);
        let robot_source = Source::read(&path, Some((&c.source, file.robot.span.clone())))?;
        let model = Robot::from_source(robot_source.clone())?.model;
        if model.joints.len() != JOINTS {
            let message = format!("a robot of {} joints cannot be driven", model.joints.len());
            c.refuse(&file.robot.span, message, "take a model of six joints");
            Problems::check(std::mem::take(&mut c.problems))?;
        }
        let (zero, limits) = axes(&mut c, &file.joints, file.rail.as_ref(), &model);
        let robots = [&file.robot1, &file.robot2].map(|table| robot(&mut c, table));
        let sensor = sensor(&mut c, &file.sensor);
        let (links, torques) = (links(&mut c, &file.safety), torques(&mut c, &file.safety));
        let rules = rules(&mut c, &file.safety, &model);
        Problems::check(std::mem::take(&mut c.problems))?;
        let (title, end_at_capture) = (file.title.value, file.safety.end_at_capture);
        Ok(Self {
            id,
            title,
            model,
            zero,
            limits,
            rail: file.rail.is_some(),
            robots,
            sensor,
            sensor_serial: file.sensor.serial.as_ref().map(|serial| serial.value.clone()),
            links,
            torques,
            rules,
            end_at_capture,
            robot_source,
            source: c.source,
        })
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
        tool_radius: c.number_or(&table.tool_radius, 0.0, "m", Range::within(0.0, LENGTH)),
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
        bias: [
            c.number_or(&table.bias, 100.0, "N", Range::above(0.0, FORCE)),
            c.number_or(&table.bias_moment, 10.0, "N m", Range::above(0.0, FORCE)),
        ],
        weighing_turn: c.number_or(&table.weighing_turn, 15f64.to_radians(), "rad", Range::within(0.0, ANGLE / 4.0)),
        weighing: [
            c.number_or(&table.weighing, 5.0, "N", Range::above(0.0, FORCE)),
            c.number_or(&table.weighing_moment, 1.0, "N m", Range::above(0.0, FORCE)),
        ],
        touch_force: c.number_or(&table.touch_force, 5.0, "N", Range::above(0.0, FORCE)),
    }
}

fn torques(c: &mut Checker, table: &SafetyTable) -> TorqueRules {
    let list = table.torque.as_ref().map(|list| c.list(list, JOINTS, "N m", Range::above(0.0, FORCE)));
    TorqueRules {
        limits: list.and_then(|list| list.try_into().ok()),
        time: c.number_or(&table.torque_time, 0.05, "s", Range::within(0.0, 10.0)),
    }
}

fn links(c: &mut Checker, table: &SafetyTable) -> LinkRules {
    let hold = table.hold_cycles.as_ref().map_or(3, |cycles| c.count(cycles, 1, 1000));
    let stop = table.stop_cycles.as_ref().map_or(10, |cycles| c.count(cycles, 2, 10_000));
    if let (true, Some(written)) = (stop <= hold, table.stop_cycles.as_ref().or(table.hold_cycles.as_ref())) {
        let message = format!("a link that is dead after {stop} lost cycles is never held over {hold}");
        c.refuse(&written.span, message, "write stop_cycles greater than hold_cycles");
    }
    let sensor_age = c.number_or(&table.sensor_age, 5e-3, "s", Range::above(0.0, 1.0));
    let window_cycles = table.window_cycles.as_ref().map_or(10, |cycles| c.count(cycles, 1, 10_000));
    LinkRules {
        hold_cycles: hold as u32,
        stop_cycles: stop as u32,
        window: c.number_or(&table.window, 1.0, "s", Range::within(0.01, 10.0)),
        window_cycles: window_cycles as u32,
        catch_up: c.number_or(&table.catch_up, 0.1, "s", Range::above(0.0, 10.0)),
        tracking: Tracking {
            distance: c.number_or(&table.tracking, 3e-3, "m", Range::above(0.0, LENGTH)),
            angle: c.number_or(&table.tracking_rotation, 0.5_f64.to_radians(), "rad", Range::above(0.0, ANGLE / 4.0)),
            time: c.number_or(&table.tracking_time, 0.25, "s", Range::above(0.0, 10.0)),
        },
        contact: Plausible {
            blind_overlap: c.number_or(&table.blind_overlap, 4e-3, "m", Range::above(0.0, LENGTH)),
            free_distance: c.number_or(&table.free_distance, 20e-3, "m", Range::above(0.0, LENGTH)),
            free_force: c.number_or(&table.free_force, 50.0, "N", Range::above(0.0, FORCE)),
        },
        sensor_age,
    }
}

/// The rules that farm and robots step alike.
fn rules(c: &mut Checker, table: &SafetyTable, model: &Manipulator) -> SessionRules {
    let off = f64::INFINITY;
    let of_capsules =
        [table.arm_distance.as_ref().map(|written| &written.span), table.keep_out.first().map(|b| &b.span)];
    if let (Some(span), true) = (of_capsules.into_iter().flatten().next(), model.capsules.is_empty()) {
        let message = "the robot's model has no capsules, so the positions of its links are unknown";
        c.refuse(span, message, "add a [[capsule]] for each link to the robot model file, or remove this key");
    }
    SessionRules {
        force: c.number(&table.force, "N", Range::above(0.0, FORCE)),
        moment: c.number(&table.moment, "N m", Range::above(0.0, FORCE)),
        force_rate: c.number(&table.force_rate, "N/s", Range::above(0.0, FORCE)),
        sensor_saturation: table.sensor_saturation,
        injected_energy: c.number(&table.injected_energy, "J", Range::above(0.0, 1e6)),
        following_error: c.number(&table.following_error, "m", Range::above(0.0, LENGTH)),
        following_rotation: c.number(&table.following_rotation, "rad", Range::above(0.0, ANGLE / 4.0)),
        tool_reach: c.number(&table.tool_reach, "m", Range::above(0.0, LENGTH)),
        tool_rotation: c.number(&table.tool_rotation, "rad", Range::above(0.0, ANGLE / 4.0)),
        clamp_time: c.number(&table.clamp_time, "s", Range::within(0.0, 1e3)),
        tool_speed: c.number_or(&table.tool_speed, off, "m/s", Range::above(0.0, SPEED)),
        keep_out: keep_out(c, &table.keep_out),
        arm_distance: c.number_or(&table.arm_distance, off, "m", Range::within(0.0, 5.0)),
        singularity: c.number_or(&table.singularity, off, "rad", Range::above(0.0, ANGLE / 8.0)),
    }
}

fn keep_out(c: &mut Checker, tables: &[At<KeepOutTable>]) -> Vec<KeepOut> {
    if let Some(table) = tables.get(MAX_KEEP_OUT) {
        let message = format!("{} keep-out boxes: a facility has {MAX_KEEP_OUT} at most", tables.len());
        c.refuse(&table.span, message, "unite boxes that are next to each other");
    }
    let mut boxes: Vec<KeepOut> = Vec::new();
    for table in tables {
        let name = c.name(&table.value.name);
        if boxes.iter().any(|before| before.name == name) {
            c.refuse(&table.value.name.span, format!("two keep-out boxes are called `{name}`"), "rename one of them");
        }
        let (frame, half) = place_of_box(c, table);
        boxes.push(KeepOut { name, frame, half });
    }
    boxes
}

/// Frame and half edge lengths of a keep-out box.
fn place_of_box(c: &mut Checker, table: &At<KeepOutTable>) -> (Pose<f64>, Vec3<f64>) {
    let (t, length) = (&table.value, Range::size(LENGTH));
    match (&t.min, &t.max, &t.centre, &t.size) {
        (Some(min), Some(max), None, None) if t.rotation.is_none() => {
            let (lower, upper) = (c.vector(min, "m", length), c.vector(max, "m", length));
            let half = (upper - lower) * 0.5;
            if half.x.min(half.y).min(half.z) <= 0.0 {
                c.refuse(&max.span, "this corner is not beyond `min` along x, y and z", "write a greater max");
            }
            (Pose { position: (lower + upper) * 0.5, attitude: Quat::identity() }, half)
        }
        (None, None, Some(_), Some(size)) => {
            let frame = c.pose(&t.centre, &t.rotation);
            (frame, c.vector(size, "m", Range::above(0.0, LENGTH)) * 0.5)
        }
        _ => {
            let message = "a box needs its place exactly once";
            c.refuse(&table.span, message, "write min and max, or centre and size, with rotation if it is turned");
            (Pose::identity(), Vec3::splat(1.0))
        }
    }
}

/// The rail as an axis of which only the range counts: nothing here has dynamics.
fn rail_joint(limits: &AxisLimits) -> Joint {
    let drive = Drive { gear_stiffness: 1.0, torque_limit: 0.0, ..Drive::ideal() };
    let friction = Friction::none();
    let link = Link { origin: Pose::identity(), mass: 0.0, com: Vec3::zero(), inertia: Sym3::splat(0.0) };
    let limits = JointLimits {
        lower: limits.lower,
        upper: limits.upper,
        speed: limits.speed,
        acceleration: limits.acceleration,
    };
    Joint { link, sign: 1.0, drive, friction, counterweight: None, limits }
}

#[cfg(test)]
mod tests;
