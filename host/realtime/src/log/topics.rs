//! Topics of the log and their columns; conversion of records to messages and back.
//!
//! Standard messages come first, so that every ROS 2 tool shows them; `/hil/cycle` has all other columns and closes the
//! record. A standard message omits parts that are blank throughout; a message without parts is omitted, and its
//! columns are blank when read.

use super::cdr::{Decoder, Encoder};
use super::record::CycleRecord;
use super::scene::{LABORATORY_FRAME, LoggedScene};
use super::schemas::{self, Schema};
use super::table::{LogColumn, LogValue, Logged, Type, columns};
use crate::signals::AXES;
use softdock_kernels::vector::{Pose, Quat};

/// Topic of the columns without a standard message; its message closes a record.
pub const CYCLE_TOPIC: &str = "/hil/cycle";
/// Topic of the robots' description.
pub const DESCRIPTION_TOPIC: &str = "/robot_description";

/// Topic of the frames fixed in their parents.
pub const FIXED_FRAMES_TOPIC: &str = "/tf_static";

/// Frame of the parts' poses: it moves in the laboratory, without rotation.
pub const CONTACT_FRAME: &str = "contact_frame";

/// Scalars of a wrench.
const WRENCH: usize = 6;
/// Scalars of a pose: position, then attitude with its scalar part first.
const POSE: usize = 7;

/// Contents of a topic: positions among the record's columns.
#[derive(Clone, Debug)]
enum TopicContents {
    /// A JointState of the given robot: axes, and torques if it reports any.
    Joints { robot: usize, position: usize, effort: Option<usize> },
    /// A WrenchStamped.
    Wrench { frame: &'static str, at: usize },
    /// A TFMessage: child frames and their poses.
    Frames(Vec<(&'static str, usize)>),
    /// Our own message: type of each field and, if this version has it, its column.
    Cycle(Vec<(Type, Option<usize>)>),
}

/// A topic.
#[derive(Clone, Debug)]
pub struct Topic {
    /// Its name.
    pub name: &'static str,
    /// Column of its time stamp \[ns\] since the start.
    stamp: usize,
    contents: TopicContents,
}

/// The topics of a record, in writing order.
#[derive(Clone, Debug)]
pub struct Topics {
    /// All columns of a record.
    pub columns: Vec<LogColumn>,
    topics: Vec<Topic>,
    /// Names of the axes of robots 1 and 2, rail last, as in the robots' description.
    names: [[String; AXES]; 2],
    wall_offset: usize,
    /// The robots' frames, and the columns of the axes of robots 1 and 2: emulated ones, then real ones.
    scene: Option<LoggedScene>,
    axes: [[usize; 2]; 2],
    part_a: usize,
}

/// Returns `robot_1_joint_1` to `robot_1_joint_6` and `robot_1_rail`; likewise for robot 2.
pub fn default_names() -> [[String; AXES]; 2] {
    [1, 2].map(|robot| {
        std::array::from_fn(|axis| match axis {
            crate::signals::RAIL => format!("robot_{robot}_rail"),
            joint => format!("robot_{robot}_joint_{}", joint + 1),
        })
    })
}

impl Topics {
    /// Creates the topics, with these names of the axes, and the robots' frames among the transforms if they are known.
    pub fn new(names: [[String; AXES]; 2], scene: Option<LoggedScene>) -> Self {
        let columns = columns::<CycleRecord>();
        let at = |name: &str| {
            let found = columns.iter().position(|column| column.name == name);
            found.unwrap_or_else(|| panic!("the record has no column `{name}`"))
        };
        let mut topics = standard(&at);
        let mut taken = vec![false; columns.len()];
        for place in topics.iter().flat_map(Topic::places) {
            taken[place] = true;
        }
        let rest = (0..columns.len()).filter(|place| !taken[*place]);
        let rest = rest.map(|place| (columns[place].kind, Some(place))).collect();
        topics.push(Topic { name: CYCLE_TOPIC, stamp: at("time_ns"), contents: TopicContents::Cycle(rest) });
        let wall_offset = at("wall_offset_ns");
        let axes = [1, 2].map(|robot| ["emulated", "robot"].map(|kind| at(&format!("{kind}_{robot}_position_1_rad"))));
        let part_a = at("part_a_position_x_m");
        Self { columns, topics, names, wall_offset, scene, axes, part_a }
    }

    /// Returns name, schema and position of each topic.
    pub(crate) fn list(&self) -> impl Iterator<Item = (&'static str, Schema)> {
        self.topics.iter().map(|topic| (topic.name, self.schema(topic)))
    }

    fn schema(&self, topic: &Topic) -> Schema {
        match &topic.contents {
            TopicContents::Joints { .. } => schemas::joint_state(),
            TopicContents::Wrench { .. } => schemas::wrench_stamped(),
            TopicContents::Frames(_) => schemas::tf_message(),
            TopicContents::Cycle(_) => schemas::cycle(topic.places().map(|place| &self.columns[place])),
        }
    }

    /// Returns the position of a topic by its name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.topics.iter().position(|topic| topic.name == name)
    }

    /// Adopts the fields of `/hil/cycle` in a file: skips fields unknown to this version; fields missing in the file
    /// stay blank. Returns false if a field has another type than its column.
    #[must_use]
    pub(crate) fn adapt(&mut self, schema: &str) -> bool {
        let mut fields = Vec::new();
        for (primitive, name) in schemas::cycle_fields(schema) {
            let own = self.columns.iter().position(|column| column.name == name);
            let kind = match (own, primitive) {
                (Some(own), _) => self.columns[own].kind,
                (None, "float64") => Type::Real,
                (None, "int64") => Type::Signed,
                (None, "uint64") => Type::Whole,
                (None, _) => Type::Word,
            };
            if schemas::primitive(kind) != primitive {
                return false;
            }
            fields.push((kind, own));
        }
        let last = self.topics.last_mut().expect("the cycle's topic");
        last.contents = TopicContents::Cycle(fields);
        true
    }

    /// Writes the message of a topic; returns false if all of it is blank.
    pub(crate) fn encode(&self, topic: usize, values: &[LogValue], out: &mut Encoder) -> bool {
        let topic = &self.topics[topic];
        let stamp = values[topic.stamp].signed().wrapping_add(values[self.wall_offset].signed());
        out.start();
        match &topic.contents {
            TopicContents::Joints { robot, position, effort } => {
                let (position, effort) =
                    (known_values(values, *position, AXES), effort.map(|at| known_values(values, at, AXES)));
                let effort = effort.unwrap_or_default();
                header(out, stamp, "");
                strings(out, &self.names[*robot]);
                reals(out, position);
                reals(out, &[]);
                reals(out, effort);
                !position.is_empty() || !effort.is_empty()
            }
            TopicContents::Wrench { frame, at } => {
                let wrench = known_values(values, *at, WRENCH);
                header(out, stamp, frame);
                wrench.iter().for_each(|value| out.f64(value.real()));
                !wrench.is_empty()
            }
            TopicContents::Frames(frames) => self.transforms(out, stamp, frames, values),
            TopicContents::Cycle(fields) => {
                header(out, stamp, "");
                fields.iter().filter_map(|(_, place)| *place).for_each(|place| scalar(out, values[place]));
                true
            }
        }
    }

    /// Returns the known poses of parts, and the robots' frames, as transforms; false without any.
    fn transforms(&self, out: &mut Encoder, stamp: i64, frames: &[(&str, usize)], values: &[LogValue]) -> bool {
        let known = || {
            frames.iter().map(|(name, at)| (name, known_values(values, *at, POSE))).filter(|(_, pose)| !pose.is_empty())
        };
        // The commanded robots: the emulated ones of a dry run, else the real ones.
        let axes = self.axes.map(|kinds| {
            let kinds = kinds.map(|at| known_values(values, at, AXES));
            kinds.into_iter().find(|axes| !axes.is_empty()).unwrap_or_default()
        });
        let robots = || {
            let scene = self.scene.iter().flat_map(|scene| scene.moving.iter().zip(axes));
            scene.filter(|(_, axes)| !axes.is_empty())
        };
        let contact_frame = self.scene.as_ref().filter(|_| !axes[0].is_empty()).and_then(|scene| {
            let [x, y, z, ..] = known_values(values, self.part_a, POSE) else { return None };
            let held = scene.part_a(|axis| axes[0][axis].real()).position;
            let position = softdock_kernels::vector::vec3(held.x - x.real(), held.y - y.real(), held.z - z.real());
            Some(Pose { position, attitude: Quat::identity() })
        });
        let moving: usize = robots().map(|(frames, _)| frames.len()).sum();
        let count = known().count() + moving + usize::from(contact_frame.is_some());
        out.u32(count as u32);
        for (name, pose) in known() {
            header(out, stamp, CONTACT_FRAME);
            out.string(name);
            // ROS has the scalar part of a quaternion last.
            for place in [0, 1, 2, 4, 5, 6, 3] {
                out.f64(pose[place].real());
            }
        }
        if let Some(pose) = contact_frame {
            transform(out, stamp, [LABORATORY_FRAME, CONTACT_FRAME], &pose);
        }
        for (frames, axes) in robots() {
            for frame in frames {
                transform(out, stamp, [&frame.parent, &frame.child], &frame.pose(axes[frame.axis].real()));
            }
        }
        count > 0
    }

    /// Stores the contents of a message; `None` if it is not a message of this topic.
    pub(crate) fn decode(&self, topic: usize, message: &[u8], values: &mut [LogValue]) -> Option<()> {
        let mut read = Decoder::new(message)?;
        match &self.topics[topic].contents {
            TopicContents::Joints { position, effort, .. } => {
                skip_header(&mut read)?;
                let names = read.u32()?;
                (0..names).try_for_each(|_| read.string().map(|_| ()))?;
                take_reals(&mut read, Some(*position), values)?;
                take_reals(&mut read, None, values)?;
                take_reals(&mut read, *effort, values)
            }
            TopicContents::Wrench { at, .. } => {
                skip_header(&mut read)?;
                values[*at..*at + WRENCH].iter_mut().try_for_each(|value| {
                    *value = LogValue::Real(read.f64()?);
                    Some(())
                })
            }
            TopicContents::Frames(frames) => take_transforms(&mut read, frames, values),
            TopicContents::Cycle(fields) => {
                skip_header(&mut read)?;
                fields.iter().try_for_each(|(kind, place)| {
                    let value = take_scalar(&mut read, *kind)?;
                    if let Some(place) = place {
                        values[*place] = value;
                    }
                    Some(())
                })
            }
        }
    }

    /// Returns a record's blank values.
    pub(crate) fn blank(&self) -> Vec<LogValue> {
        self.columns.iter().map(|column| LogValue::blank(column.kind)).collect()
    }
}

impl Topic {
    /// Returns the positions of this topic's columns.
    fn places(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        match &self.contents {
            TopicContents::Joints { position, effort, .. } => {
                Box::new((*position..position + AXES).chain(effort.iter().flat_map(|at| *at..at + AXES)))
            }
            TopicContents::Wrench { at, .. } => Box::new(*at..at + WRENCH),
            TopicContents::Frames(frames) => Box::new(frames.iter().flat_map(|(_, at)| *at..at + POSE)),
            TopicContents::Cycle(fields) => Box::new(fields.iter().filter_map(|(_, place)| *place)),
        }
    }
}

/// Returns the topics of standard messages; `at` gives the position of a column.
fn standard(at: &impl Fn(&str) -> usize) -> Vec<Topic> {
    let states = |name, robot, prefix: &str| Topic {
        name,
        stamp: at(&format!("{prefix}_received_ns")),
        contents: TopicContents::Joints {
            robot,
            position: at(&format!("{prefix}_position_1_rad")),
            effort: Some(at(&format!("{prefix}_torque_1_n_m"))),
        },
    };
    let commands = |name, robot, prefix: &str| Topic {
        name,
        stamp: at("time_ns"),
        contents: TopicContents::Joints { robot, position: at(&format!("{prefix}_command_1_rad")), effort: None },
    };
    let wrench = |name, frame, prefix: &str, kind: &str| Topic {
        name,
        stamp: at(&format!("{prefix}_received_ns")),
        contents: TopicContents::Wrench { frame, at: at(&format!("{prefix}_{kind}_force_x_n")) },
    };
    let frame = |name| (name, at(&format!("{name}_position_x_m")));
    let frames = ["part_a", "part_b", "simulated_part_a", "simulated_part_b"].map(frame).to_vec();
    vec![
        states("/robot_1/joint_states", 0, "robot_1"),
        commands("/robot_1/joint_commands", 0, "robot_1"),
        states("/robot_2/joint_states", 1, "robot_2"),
        commands("/robot_2/joint_commands", 1, "robot_2"),
        states("/emulated_1/joint_states", 0, "emulated_1"),
        commands("/emulated_1/joint_commands", 0, "emulated_1"),
        states("/emulated_2/joint_states", 1, "emulated_2"),
        commands("/emulated_2/joint_commands", 1, "emulated_2"),
        wrench("/ft/wrench", "part_a", "ft", "compensated"),
        wrench("/ft/wrench_raw", "ft_sensor", "ft", "raw"),
        wrench("/emulated_ft/wrench", "part_a", "emulated_ft", "compensated"),
        wrench("/emulated_ft/wrench_raw", "ft_sensor", "emulated_ft", "raw"),
        Topic { name: "/tf", stamp: at("time_ns"), contents: TopicContents::Frames(frames) },
    ]
}

/// Returns a run of columns, or `None` if all of it is blank.
fn known_values(values: &[LogValue], at: usize, count: usize) -> &[LogValue] {
    let part = &values[at..at + count];
    let blank = part.iter().all(|value| *value == LogValue::Real(f64::BLANK));
    if blank { &[] } else { part }
}

/// Writes a std_msgs/Header; `stamp` in nanoseconds since the Unix epoch.
fn header(out: &mut Encoder, stamp: i64, frame: &str) {
    out.i32(stamp.div_euclid(1_000_000_000) as i32);
    out.u32(stamp.rem_euclid(1_000_000_000) as u32);
    out.string(frame);
}

fn skip_header(read: &mut Decoder) -> Option<()> {
    read.i32()?;
    read.u32()?;
    read.string().map(|_| ())
}

fn strings(out: &mut Encoder, texts: &[String]) {
    out.u32(texts.len() as u32);
    texts.iter().for_each(|text| out.string(text));
}

fn reals(out: &mut Encoder, values: &[LogValue]) {
    out.u32(values.len() as u32);
    values.iter().for_each(|value| out.f64(value.real()));
}

/// Reads a sequence of axes; an empty or unused one changes nothing.
fn take_reals(read: &mut Decoder, place: Option<usize>, values: &mut [LogValue]) -> Option<()> {
    let count = read.u32()? as usize;
    if count > AXES {
        return None;
    }
    for axis in 0..count {
        let value = read.f64()?;
        if let Some(place) = place {
            values[place + axis] = LogValue::Real(value);
        }
    }
    Some(())
}

/// Writes a geometry_msgs/TransformStamped from a parent to a child.
fn transform(out: &mut Encoder, stamp: i64, [parent, child]: [&str; 2], pose: &Pose<f64>) {
    header(out, stamp, parent);
    out.string(child);
    let (p, q) = (pose.position, pose.attitude);
    [p.x, p.y, p.z, q.v.x, q.v.y, q.v.z, q.w].into_iter().for_each(|value| out.f64(value));
}

/// Returns the message of the fixed frames.
pub(crate) fn fixed_frames(out: &mut Encoder, stamp: i64, scene: &LoggedScene) {
    out.start();
    out.u32(scene.fixed.len() as u32);
    for frame in &scene.fixed {
        transform(out, stamp, [&frame.parent, &frame.child], &frame.pose);
    }
}

fn take_transforms(read: &mut Decoder, frames: &[(&str, usize)], values: &mut [LogValue]) -> Option<()> {
    for _ in 0..read.u32()? {
        skip_header(read)?;
        let child = read.string()?;
        let at = frames.iter().find(|(name, _)| *name == child).map(|(_, at)| *at);
        for place in [0, 1, 2, 4, 5, 6, 3] {
            let value = read.f64()?;
            if let Some(at) = at {
                values[at + place] = LogValue::Real(value);
            }
        }
    }
    Some(())
}

fn scalar(out: &mut Encoder, value: LogValue) {
    match value {
        LogValue::Real(value) => out.f64(value),
        LogValue::Signed(value) => out.i64(value),
        LogValue::Whole(value) => out.u64(value),
        LogValue::Word(value) => out.u32(value),
    }
}

fn take_scalar(read: &mut Decoder, kind: Type) -> Option<LogValue> {
    Some(match kind {
        Type::Real => LogValue::Real(read.f64()?),
        Type::Signed => LogValue::Signed(read.i64()?),
        Type::Whole => LogValue::Whole(read.u64()?),
        Type::Word | Type::Code(_) => LogValue::Word(read.u32()?),
    })
}

#[cfg(test)]
mod tests;
