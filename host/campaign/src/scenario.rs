//! A scenario: the file checked and compiled into the kernels' model.

mod arm_drive;
mod arm_plan;
mod bodies;
mod compensator;
pub(crate) mod contact;
mod control;
mod facility;
pub(crate) mod held;
mod impedance;
mod joint_level;
pub(crate) mod sliding;
mod soft_capture;

use crate::check::Checker;
use crate::identified::{IdentifiedEffect, identified_effects};
use crate::mesh::{self, MeshFile};
use crate::overlap;
use crate::placement::{base_from_tool, end_frame};
use crate::problem::{Problem, Problems};
use crate::read;
use crate::source::Source;
use crate::stability::{Extremes, faults};
use crate::station::Station;
use crate::units::show;
use crate::written::Quantity;
use crate::written::scenario::{ScenarioFile, StartTable, TaskTable, TimingTable};
use bodies::Bodies;
use softdock_kernels::model::{Contact, Guidance, Model, Task, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::range::{ANGLE, FORCE, LENGTH, Range, SPEED};
use softdock_kernels::vector::{Quat, Vec3};
use std::ops::Range as Span;
use std::path::Path;
use toml::Spanned;
use toml::de::DeTable;

/// Format that this version reads.
pub(crate) const FORMAT: &str = "scenario/2";

/// Most ticks of a run: an hour at 1 ms.
const MOST_TICKS: f64 = 3.6e6;

/// A checked scenario.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Name.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// What the kernels run.
    pub model: Model,
    /// Names of the arm's joints, from the base outwards.
    pub joints: Vec<String>,
    /// Lines of `check` about the joints that are held.
    pub(crate) held_joints: Vec<String>,
    /// Joints for which the URDF states torque, speed or friction.
    pub(crate) rated_joints: usize,
    /// Effects that a diagnosis has identified.
    pub identified: Vec<IdentifiedEffect>,
    /// The file.
    source: Source,
    /// The URDF, if there is an arm.
    urdf: Option<Source>,
    /// The robots' model, at the joint level.
    robot: Option<Source>,
    /// The files of the meshes.
    meshes: Vec<MeshFile>,
    /// The facility whose rules end and stop a session; none: no rule does.
    pub station: Option<Station>,
}

impl Scenario {
    /// Reads a scenario file and the arm that it names.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::from_source(Source::read(path, None)?)
    }

    /// The file's text.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// The URDF's text, if there is an arm.
    pub fn urdf_text(&self) -> Option<&str> {
        self.urdf.as_ref().map(Source::text)
    }

    /// The robot model's text, at the joint level.
    pub fn robot_text(&self) -> Option<&str> {
        self.robot.as_ref().map(Source::text)
    }

    /// Hashes of the meshes' files, in their order; empty without meshes.
    pub fn mesh_hashes(&self) -> Vec<String> {
        self.meshes.iter().map(MeshFile::hash).collect()
    }

    /// Lines of `check` about the meshes: size, grid, accuracy, mass.
    pub fn mesh_lines(&self) -> Vec<String> {
        mesh::lines(&self.meshes, &self.model)
    }

    /// The files of the meshes.
    pub(crate) fn mesh_files(&self) -> impl Iterator<Item = &Path> {
        self.meshes.iter().map(MeshFile::path)
    }

    /// The scenario file.
    pub fn file(&self) -> &Path {
        self.source().path()
    }

    /// The file's text with every file that it names beside it: the text, and name and text of the others.
    pub fn gathered(&self) -> (String, Vec<(String, String)>) {
        let mut text = self.text().to_owned();
        let (mut beside, mut meshes) = (Vec::new(), Vec::new());
        let [station, _] = self.station_sources();
        let named = [
            ("arm.urdf", self.urdf.as_ref()),
            ("facility.joint_level.robot", self.robot.as_ref()),
            ("facility.file", station),
        ];
        for (key, file) in named.into_iter().filter_map(|(key, file)| Some((key, file?))) {
            let name = file.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            let written = self.text()[self.source.span_of(key)].to_owned();
            text = text.replacen(&written, &format!("\"{name}\""), 1);
            beside.push((name, file.text().to_owned()));
        }
        for mesh in &self.meshes {
            let name = mesh.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            let (written, own) = (self.text()[self.source.span_of(&mesh.file_key())].to_owned(), mesh.text());
            // Two files of one name from two folders.
            let is_taken = meshes.iter().any(|(known, text)| *known == name && *text != own);
            let name = if is_taken { format!("{}_{name}", meshes.len() + 1) } else { name };
            text = text.replace(&written, &format!("\"{name}\""));
            meshes.push((name, own));
        }
        if let (Some(own), Some(station)) = (beside.last_mut(), &self.station) {
            let (text, model) = station.gathered();
            own.1 = text;
            beside.push(model);
        }
        beside.extend(meshes);
        (text, beside)
    }

    pub(crate) fn source(&self) -> &Source {
        &self.source
    }

    /// The facility file and its robots' model, if there is a facility.
    fn station_sources(&self) -> [Option<&Source>; 2] {
        self.station.as_ref().map_or([None; 2], |station| station.sources().map(Some))
    }

    /// The text of the facility file, and of its robots' model, if there is a facility.
    pub fn station_texts(&self) -> impl Iterator<Item = &str> {
        self.station_sources().into_iter().flatten().map(Source::text)
    }

    /// The file, the URDF, the robots' model, the facility file and its robots' model, each once.
    pub(crate) fn sources(&self) -> impl Iterator<Item = &Source> {
        let of_joints =
            self.robot.iter().filter(|robot| self.station_sources()[1].is_none_or(|own| own.path() != robot.path()));
        std::iter::once(&self.source)
            .chain(&self.urdf)
            .chain(of_joints)
            .chain(self.station_sources().into_iter().flatten())
    }

    pub(crate) fn from_source(source: Source) -> Result<Self, Problems> {
        let file: ScenarioFile = read::parse(&source, FORMAT)?;
        Self::checked(Checker::new(source), file, None)
    }

    /// The same file with other values in its table; what it names besides is not read again.
    pub(crate) fn read_again(&self, table: Spanned<DeTable<'_>>) -> Result<Self, Problems> {
        let file: ScenarioFile = read::structured(&self.source, table)?;
        let mut c = Checker::new(self.source.clone());
        c.known = self.sources().skip(1).cloned().collect();
        Self::checked(c, file, self.station.as_ref())
    }

    /// A file as written, checked; a facility that is known is not read again.
    fn checked(mut c: Checker, file: ScenarioFile, station: Option<&Station>) -> Result<Self, Problems> {
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let id = c.name(&file.id);
        let mut nominal = Params::null();
        start(&mut c, &file.start, &mut nominal);
        let (contact, meshes) = contact::read(&mut c, &file, &mut nominal);
        let bodies = bodies::read(&mut c, &file, &contact, &meshes);
        let Compiled { model, robot, station } = compile(&mut c, &file, &bodies, (nominal, contact), station);
        Problems::check(std::mem::take(&mut c.problems))?;

        let mut scenario = Self {
            id,
            title: file.title.value.clone(),
            model,
            joints: bodies.joints,
            held_joints: bodies.held_joints,
            rated_joints: bodies.rated_joints,
            identified: Vec::new(),
            source: c.source.clone(),
            urdf: bodies.urdf,
            robot,
            meshes,
            station,
        };
        contact::complete(&mut c, &file.contact.value, &file.start, &mut scenario.model);
        if let Some(level) = &file.facility.value.joint_level {
            joint_level::check_places(&mut c, &level.value, &mut scenario.model);
        }
        if let (Some(station), Some(written)) = (&scenario.station, &file.facility.value.file) {
            facility::check_robots(&mut c, station, written, &mut scenario.model);
        }
        overlap::refuse(&mut c, &file, &scenario.model);
        scenario.identified = identified_effects(&mut c, &file.effect, &mut scenario.model.nominal);
        Problems::check(std::mem::take(&mut c.problems))?;
        let nominal = scenario.model.nominal;
        scenario.check_steps(&Extremes { least: nominal, greatest: nominal }, |_| None)?;
        Ok(scenario)
    }

    /// Refuses a step that cannot follow the springs, and a loop delay below the frame's own part.
    ///
    /// `disperses` gives the place in a campaign that disperses a parameter.
    pub(crate) fn check_steps(
        &self,
        extremes: &Extremes,
        disperses: impl Fn(&str) -> Option<(Source, Span<usize>)>,
    ) -> Result<(), Problems> {
        let mut problems = Vec::new();
        let mut note = |key: &str, parameter: Option<&str>, message: String, remedy: String| {
            let place = parameter.and_then(&disperses);
            let (source, span) = place.unwrap_or_else(|| (self.source.clone(), self.source.span_of(key)));
            problems.push(Problem::at(&source, span, message).remedy(remedy));
        };
        for fault in faults(&self.model, extremes) {
            note(&fault.key, fault.parameter, fault.message, fault.remedy);
        }
        let sensor = extremes.greatest.sensor_delay;
        let least = self.model.timing.loop_delay(sensor, 0.0);
        if extremes.least.loop_delay < least * (1.0 - 1e-12) {
            let message =
                format!("a loop delay of {} is less than the loop has by itself", show(extremes.least.loop_delay, "s"));
            let remedy = format!(
                "write at least \"{:.6} ms\": {:.6} ms of the loop's own (half the hold) and {:.6} ms of sensor delay",
                least * 1e3,
                self.model.timing.own_delay() * 1e3,
                sensor * 1e3
            );
            note("facility.loop_delay", Some("loop_delay"), message, remedy);
        }
        Problems::check(problems)
    }
}

/// A model with what it was made of.
struct Compiled {
    model: Model,
    /// The robots' model file, if the scenario names it.
    robot: Option<Source>,
    /// The facility, if the scenario names it.
    station: Option<Station>,
}

/// The model, with harmless values where there are problems.
fn compile(
    c: &mut Checker,
    file: &ScenarioFile,
    bodies: &Bodies,
    (mut nominal, contact): (Params<f64>, Contact),
    known: Option<&Station>,
) -> Compiled {
    let timing = timing(c, &file.timing);
    bodies.masses(&mut nominal);
    held::check(c, file, bodies.held, &nominal);
    let station = known.cloned().or_else(|| facility::station(c, &file.facility));
    let (facility, robot) = facility::read(c, &file.facility, station.as_ref(), &timing, &mut nominal);
    let guidance = Guidance {
        thrust: control::thrust(c, &file.guidance),
        thrusters: control::thrusters(c, file.base.thrusters.as_ref(), &timing),
        // Without its URDF an arm has no joints to control; that problem is noted already.
        arm: control::arm(c, file.arm.as_ref().filter(|_| bodies.urdf.is_some()), &bodies.slides),
        plan: file.arm.as_ref().filter(|_| bodies.urdf.is_some()).and_then(|arm| {
            arm_plan::read(c, arm, bodies, (&timing, file.latch.is_some(), !contact.fingers.is_empty()), &mut nominal)
        }),
    };
    let (orbit_rate, orbit_axes) = match &file.orbit {
        Some(orbit) => {
            (c.number(&orbit.rate, "rad/s", Range::within(0.0, 0.01)), c.pose(&None, &orbit.rotation).attitude)
        }
        None => (0.0, Quat::identity()),
    };
    let field =
        file.field.as_ref().map_or(Vec3::zero(), |field| c.vector(&field.acceleration, "m/s^2", Range::size(SPEED)));
    let model = Model {
        timing,
        base_inertia: bodies.base_inertia,
        base_pose: place_base(c, file, bodies),
        links: bodies.links.clone(),
        slides: bodies.slides.clone(),
        tool: bodies.tool,
        drives: bodies.drives.clone(),
        brakes: bodies.brakes,
        start_angles: bodies.angles.clone(),
        target_inertia: bodies.target_inertia,
        target_pose: bodies.target_pose,
        seat: bodies.seat,
        ring: soft_capture::read(c, file),
        held: bodies.held,
        contact,
        guidance,
        orbit_rate,
        orbit_axes,
        field,
        facility,
        task: task(c, &file.task, file.latch.is_some(), station.as_ref()),
        nominal,
    };
    Compiled { model, robot, station }
}

/// The base either as stated or from the gap between the parts.
fn place_base(c: &mut Checker, file: &ScenarioFile, bodies: &Bodies) -> softdock_kernels::vector::Pose<f64> {
    let stated = [&file.base.position, &file.base.rotation].into_iter().flatten().next();
    match (&file.start.gap, stated) {
        (Some(gap), None) => {
            let gap = c.number(gap, "m", Range::size(LENGTH));
            base_from_tool(end_frame(&bodies.links, &bodies.slides, &bodies.angles, bodies.tool), gap)
        }
        (None, Some(_)) => c.pose(&file.base.position, &file.base.rotation).compose(bodies.centre),
        (Some(_), Some(stated)) => {
            let message = "the base is placed twice: here and by `start.gap`";
            c.refuse(&stated.span, message, "remove one of them");
            bodies.base_at_origin()
        }
        (None, None) => {
            let span = c.source.span_of("start");
            let remedy = "add gap = \"50 mm\" (from part A to part B), or base.position and base.rotation";
            c.refuse(&span, "the start of the chaser is missing", remedy);
            bodies.base_at_origin()
        }
    }
}

fn timing(c: &mut Checker, table: &TimingTable) -> Timing {
    let step = Range::within(1e-6, 0.1);
    let substep = c.number_or(&table.substep, 0.25e-3, "s", step);
    let tick = c.number_or(&table.tick, 1e-3, "s", step);
    let substeps = whole_steps(c, table.tick.as_ref().or(table.substep.as_ref()), tick, substep, 1000.0);
    let limit = c.number(&table.time_limit, "s", Range::within(tick, MOST_TICKS * tick));
    // A hundredth of a tick forgives the rounding of "15 s" / "1 ms".
    Timing { substep, substeps, max_ticks: (limit / tick - 0.01).ceil() as u32 }
}

/// How many steps a period has; it must be a whole number.
fn whole_steps(c: &mut Checker, written: Option<&Quantity>, period: f64, step: f64, most: f64) -> u32 {
    let ratio = period / step;
    let whole = ratio.round();
    if (ratio - whole).abs() > 1e-6 || !(1.0..=most).contains(&whole) {
        let span = written.map_or(0..0, |written| written.span.clone());
        let message = format!("{} is not a whole number of substeps of {}", show(period, "s"), show(step, "s"));
        let nearest = show(whole.clamp(1.0, most) * step, "s");
        c.refuse(
            &span,
            message,
            format!("write a multiple of the substep, up to {most} of them: {nearest} is the nearest"),
        );
        return 1;
    }
    whole as u32
}

fn start(c: &mut Checker, table: &StartTable, p: &mut Params<f64>) {
    c.take(table.parameters(0), p);
}

fn task(c: &mut Checker, table: &TaskTable, has_latch: bool, station: Option<&Station>) -> Task {
    let never = f64::INFINITY;
    let time = Range::above(0.0, 1e6);
    let capture = table.capture.value;
    if capture && !has_latch {
        c.refuse(
            &table.capture.span,
            "success needs a closed latch, but there is none",
            "add a table [latch], or write capture = false",
        );
    }
    for written in [&table.end_after_capture, &table.facility_end_after_capture].into_iter().flatten() {
        if !has_latch {
            let remedy = "remove it, or add a table [latch]";
            c.refuse(&written.span, "this does nothing: without a latch nothing is captured", remedy);
        }
    }
    let hold = Range::within(0.0, 1e6);
    let in_space = c.number_or(&table.end_after_capture, never, "s", hold);
    let on_facility = match (&table.facility_end_after_capture, station.is_some_and(|station| station.end_at_capture)) {
        (Some(written), true) => {
            let remedy = "remove it, or write end_at_capture = false in the facility file";
            c.refuse(&written.span, "the facility ends a session at capture: there is no phase after it", remedy);
            0.0
        }
        (None, true) => 0.0,
        (written, false) => c.number_or(written, in_space, "s", hold),
    };
    Task {
        capture,
        touch: table.touch,
        max_contact_force: c.number_or(&table.max_contact_force, never, "N", Range::above(0.0, FORCE)),
        max_interface_force: c.number_or(&table.max_interface_force, never, "N", Range::above(0.0, FORCE)),
        max_time: c.number_or(&table.max_time, never, "s", time),
        min_insertion: c.number_or(&table.min_insertion, -never, "m", Range::size(LENGTH)),
        max_restitution: c.number_or(&table.max_restitution, never, "1", Range::above(0.0, 1e3)),
        end_after_separation: c.number_or(&table.end_after_separation, never, "s", Range::within(0.0, 1e6)),
        end_after_capture: [in_space, on_facility],
        max_depth: c.number(&table.max_depth, "m", Range::above(0.0, 10.0)),
    }
}

/// Range of a gate's angle and of its sizes.
pub(crate) const GATE_ANGLE: Range = Range::above(0.0, ANGLE / 4.0);
pub(crate) const GATE_SIZE: Range = Range::above(0.0, 10.0);

#[cfg(test)]
pub(crate) mod tests;
