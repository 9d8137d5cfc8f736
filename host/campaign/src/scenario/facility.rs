//! The facility: command path, robots, rail, sensor, and its differences from space.

use super::{compensator, impedance, joint_level, whole_steps};
use crate::check::Checker;
use crate::source::Source;
use crate::source::settings::SetFile;
use crate::station::Station;
use crate::units::show;
use crate::written::At;
use crate::written::facility::{FacilityTable, LoadTable, RailTable, SensorTable, TestMotionTable};
use softdock_kernels::model::{
    Facility, JointLevel, Model, Rail, SensorLoad, SessionRules, TestMotion, Timing, Waveform,
};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, place};
use softdock_kernels::range::{LENGTH, MASS, MAX_DELAY_S, Range, SPEED};
use softdock_kernels::session::{axes_asked, clearance, deepest_in_box};
use softdock_kernels::vector::{Vec3, vec3};

/// Ticks during which a lost command is extrapolated along its twist.
const DROP_HOLD_TICKS: u32 = 2;

const WAVEFORMS: [(&str, Waveform); 3] =
    [("sine", Waveform::Sine), ("run", Waveform::Run), ("trapezoid", Waveform::Trapezoid)];

/// The facility, and the file of its robots' model if there is one.
pub(crate) fn read(
    c: &mut Checker,
    written: &At<FacilityTable>,
    station: Option<&Station>,
    timing: &Timing,
    p: &mut Params<f64>,
) -> (Facility, Option<Source>) {
    let table = &written.value;
    sensor(c, &table.sensor, p);
    let own = timing.loop_delay(p.sensor_delay, 0.0);
    p.loop_delay = c.parameter_or(&table.loop_delay, "loop_delay", own);
    c.take(table.parameters(0), p);
    for (robot, response) in [&table.robot1, &table.robot2].into_iter().enumerate() {
        c.take(response.parameters(robot), p);
    }
    c.take(table.errors.parameters(0), p);
    // What rings besides the robots.
    c.take(table.fixture.parameters(0), p);
    for (mode, table) in [&table.slosh, &table.appendage].into_iter().enumerate() {
        c.take(table.parameters(mode), p);
    }
    let rail = table.rail.as_ref().map(|table| rail(c, table, p));
    let drop_hold_ticks = table.drop_hold_ticks.as_ref().map_or(DROP_HOLD_TICKS, |ticks| {
        let written = At { value: u64::from(ticks.value), span: ticks.span.clone() };
        c.count(&written, 0, 1000) as u32
    });
    let period = c.number_or(&table.sensor.period, timing.substep, "s", Range::above(0.0, MAX_DELAY_S));
    let (joint_level, robot) = joint_level(c, table, rail.as_ref(), p).unzip();
    let facility = Facility {
        robot1_share: c.number_or(&table.robot1_share, 0.5, "1", Range::within(0.0, 1.0)),
        rail,
        drop_hold_ticks,
        sensor_substeps: whole_steps(c, table.sensor.period.as_ref(), period, timing.substep, 1000.0),
        crosstalk: crosstalk(c, &table.sensor),
        compensator: compensator::read(c, &table.compensator, p),
        load: table.sensor.load.as_ref().map(|load| sensor_load(c, load, p)),
        tared: table.sensor.tared.as_ref().is_some_and(|tared| tared.value),
        unstable_speed: unstable_speed(c, written),
        rules: station.map_or(SessionRules::NONE, |station| station.rules.clone()),
        session_robots: None,
        impedance: table.impedance.as_ref().and_then(|table| impedance::read(c, table)),
        test_motion: table.test_motion.as_ref().map(|table| test_motion(c, table, p)),
        joint_level,
    };
    (facility, robot)
}

/// The facility whose rules end and stop a session; none if the scenario has no rules.
pub(crate) fn station(c: &mut Checker, table: &At<FacilityTable>) -> Option<Station> {
    let settings = c.source.settings().clone();
    // A file that is known has its values already.
    let set = |file: Source| if file.is_set() { Ok(file) } else { settings.apply(SetFile::Station, file) };
    match (&table.value.file, &table.value.session_rules) {
        (Some(written), None) => match c.read_beside(written).and_then(set).and_then(Station::from_source) {
            Ok(station) => return Some(station),
            Err(problems) => c.problems.extend(problems),
        },
        (None, Some(written)) => c.choice(written, &[("none", ())]),
        (Some(_), Some(written)) => {
            let message = "the rules of a session are written twice: here and by `facility.file`";
            c.refuse(&written.span, message, "remove one of them");
        }
        (None, None) => {
            let remedy = "add file = \"../facilities/reference.toml\", or session_rules = \"none\"";
            c.refuse(&table.span, "the rules that end and stop a session on the robots are missing", remedy);
        }
    }
    None
}

/// Puts the facility's robots behind the parts, where they can hold them; or refuses the facility.
pub(crate) fn check_robots(c: &mut Checker, station: &Station, written: &At<String>, model: &mut Model) {
    let robots = station.session_robots();
    match place(&Plant::new(model.clone()), &robots.level) {
        Ok(_) => {
            model.facility.session_robots = Some(robots);
            check_start(c, written, &Plant::new(model.clone()));
        }
        Err((robot, why)) => {
            let message = format!("robot {robot} of this facility cannot hold its part at the start ({why:?})");
            c.refuse(&written.span, message, "move its base in the facility file, or move the start");
        }
    }
}

/// Refuses a start at which a rule of the workspace would stop every session.
fn check_start(c: &mut Checker, written: &At<String>, plant: &Plant) {
    let (asked, rules) = (axes_asked(plant, &plant.start), &plant.facility.rules);
    let apart = clearance(plant, &asked, &plant.start).arms;
    let angle = asked.least_sine.clamp(0.0, 1.0).asin();
    let move_them = "move the bases of its robots in the facility file, or the start";
    if rules.arm_distance.is_finite() && apart < rules.arm_distance {
        let (apart, least) = (show(apart, "m"), show(rules.arm_distance, "m"));
        let message =
            format!("the arms of this facility are {apart} apart at the start: safety.arm_distance is {least}");
        c.refuse(&written.span, message, format!("{move_them}, or lower arm_distance"));
    }
    if let Some((robot, name, depth)) = deepest_in_box(plant, &plant.start) {
        let depth = show(depth, "m");
        let message =
            format!("robot {robot} of this facility is {depth} deep in the keep-out box `{name}` at the start");
        c.refuse(&written.span, message, format!("{move_them}, or shrink the box"));
    }
    if rules.singularity.is_finite() && angle < rules.singularity {
        let (angle, least) = (show(angle.to_degrees(), "deg"), show(rules.singularity.to_degrees(), "deg"));
        let message = format!("a robot of this facility starts {angle} from singular: safety.singularity is {least}");
        c.refuse(&written.span, message, format!("{move_them}, or lower singularity"));
    }
}

/// Above this relative speed of the parts the loop counts as diverged: it ends runs, so it is written.
fn unstable_speed(c: &mut Checker, table: &At<FacilityTable>) -> f64 {
    let range = Range::above(0.0, SPEED);
    if let Some(written) = &table.value.unstable_speed {
        return c.number(written, "m/s", range);
    }
    c.refuse(&table.span, "the divergence limit of the HIL loop is missing", "add unstable_speed = \"2 m/s\"");
    range.max
}

/// A motion that is added to the robots' reference.
fn test_motion(c: &mut Checker, table: &TestMotionTable, p: &mut Params<f64>) -> TestMotion {
    c.take(table.parameters(0), p);
    let time = Range::within(0.0, 1e6);
    TestMotion {
        axis: direction(c, &table.axis),
        waveform: c.choice(&table.waveform, &WAVEFORMS),
        begin: c.number_or(&table.begin, 0.0, "s", time),
        settle: c.number_or(&table.settle, 0.0, "s", time),
    }
}

/// The joint level, which takes the place of the robots' responses.
fn joint_level(
    c: &mut Checker,
    table: &FacilityTable,
    rail: Option<&Rail>,
    p: &mut Params<f64>,
) -> Option<(JointLevel, Source)> {
    let level = table.joint_level.as_ref()?;
    let responses = [&table.robot1, &table.robot2];
    let written = responses.iter().flat_map(|response| [&response.lag, &response.damping, &response.zero]);
    let of_rail = table.rail.iter().flat_map(|rail| [&rail.lag, &rail.damping]);
    for response in written.chain([&table.max_speed, &table.max_rate]).chain(of_rail).flatten() {
        let remedy =
            "remove it: at the joint level the robots follow by their drives, and keep the limits of their joints";
        c.refuse(&response.span, "this does nothing beside [facility.joint_level]", remedy);
    }
    let (read, source) = joint_level::read(c, &level.value, p)?;
    joint_level::check_rail(c, &level.value, rail, &read);
    Some((read, source))
}

fn sensor(c: &mut Checker, t: &SensorTable, p: &mut Params<f64>) {
    c.take(t.parameters(0), p);
    let errors = [&t.tare_error_force, &t.tare_error_moment].into_iter().flatten().next();
    if let (Some(error), false) = (errors, t.tared.as_ref().is_some_and(|tared| tared.value)) {
        let remedy = "remove it, or write tared = true";
        c.refuse(&error.span, "this does nothing: the sensor is not tared", remedy);
    }
}

fn sensor_load(c: &mut Checker, t: &LoadTable, p: &mut Params<f64>) -> SensorLoad {
    c.take(t.parameters(0), p);
    SensorLoad {
        mass: c.number(&t.mass, "kg", Range::within(0.0, MASS)),
        centre: c.vector(&t.centre, "m", Range::size(LENGTH)),
        gravity: c.vector(&t.gravity, "m/s^2", Range::size(SPEED)),
        inertia_compensated: t.inertia_compensated.unwrap_or(true),
    }
}

fn rail(c: &mut Checker, table: &RailTable, p: &mut Params<f64>) -> Rail {
    c.take(table.parameters(0), p);
    let share = c.number(&table.share, "1", Range::within(0.0, 1.0));
    Rail { axis: direction(c, &table.axis), share }
}

/// A unit vector from three numbers.
fn direction(c: &mut Checker, written: &At<Vec<At<f64>>>) -> Vec3<f64> {
    let numbers: Vec<f64> = written.value.iter().map(|number| number.value).collect();
    let mut axis = vec3(1.0, 0.0, 0.0);
    match numbers[..] {
        [x, y, z] if vec3(x, y, z).norm().is_finite() && vec3(x, y, z).norm() > 1e-9 => axis = vec3(x, y, z),
        _ => c.refuse(&written.span, "this is not a direction", "write three numbers, not all zero: [1, 0, 0]"),
    }
    axis * (1.0 / axis.norm())
}

/// The stated pattern, or ones between the forces and between the moments.
fn crosstalk(c: &mut Checker, table: &SensorTable) -> [[f64; 6]; 6] {
    let mut pattern = std::array::from_fn(|row: usize| {
        std::array::from_fn(|column: usize| if row != column && row / 3 == column / 3 { 1.0 } else { 0.0 })
    });
    if let Some(written) = &table.crosstalk_pattern {
        let square = written.value.len() == 6 && written.value.iter().all(|row| row.len() == 6);
        if square && written.value.iter().flatten().all(|element| element.is_finite()) {
            pattern = std::array::from_fn(|row| std::array::from_fn(|column| written.value[row][column]));
        } else {
            c.refuse(&written.span, "this is not a 6 x 6 matrix", "write six rows of six finite numbers");
        }
    }
    if let (Some(factor), true) = (&table.crosstalk, pattern.iter().flatten().all(|element| *element == 0.0)) {
        let remedy = "remove it, or write a crosstalk_pattern with an element that is not 0";
        c.refuse(&factor.span, "this does nothing: every element of the crosstalk pattern is 0", remedy);
    }
    pattern
}
