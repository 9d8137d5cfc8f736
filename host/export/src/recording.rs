//! The time history of a run as an MCAP file that ROS 2 tools and Foxglove open.
//!
//! Profile `ros2`, messages in CDR. `/tf` has base, arm and target of both loops (`space/...`, `hil/...`) and the robots'
//! axes; wrenches stand at part A in axes that their frame names.

use crate::tree::{SceneJoint, SceneTree, WORLD};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_realtime::log::cdr::Encoder;
use softdock_realtime::log::mcap::{LogError, PROVENANCE, channel};
use softdock_realtime::log::schemas::{self, Schema};
use softdock_realtime::log::topics::{DESCRIPTION_TOPIC, FIXED_FRAMES_TOPIC};
use softdock_results::traces::Trace;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::Cursor;

/// Why a run has no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The time history lacks the poses.
    #[error("the time history of run {0} has no poses: an earlier version wrote it")]
    NoPoses(u64),
    /// The recording cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The recording cannot be written.
    #[error("the recording cannot be written: {0}")]
    Mcap(#[from] mcap::McapError),
}

/// Name of the message with all signals that no standard message has.
const SIGNALS: &str = "softdock_msgs/msg/Signals";

/// Returns the bytes of an MCAP file.
///
/// `start` is the wall clock at the start of the run, in nanoseconds since 1970; `urdf` the description of the scene;
/// `provenance` goes into the metadata record `softdock`.
///
/// # Errors
/// If the time history has no poses.
pub fn run_recording(
    tree: &SceneTree,
    trace: &Trace,
    start: u64,
    urdf: &str,
    provenance: BTreeMap<String, String>,
) -> Result<Vec<u8>, RecordingError> {
    let columns = Columns { trace };
    let sides = [("space", &columns), ("hil", &columns)].map(|(side, columns)| Side::of(side, tree, columns));
    let [Some(space), Some(hil)] = sides else { return Err(RecordingError::NoPoses(trace.run)) };
    let sides = [space, hil];
    let robots = moving(tree, &columns, |name| name.starts_with("robot"), robot_column);
    let options = WriteOptions::new().profile("ros2").library("softdock").compression(Some(Compression::Zstd));
    let mut writer = options.create(Cursor::new(Vec::new()))?;
    writer.write_metadata(&Metadata { name: PROVENANCE.to_owned(), metadata: provenance })?;
    let mut message = Encoder::default();
    let send = |writer: &mut mcap::Writer<_>, channel_id: u16, sequence: usize, time: u64, message: &Encoder| {
        let header = MessageHeader { channel_id, sequence: sequence as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, message.bytes())
    };
    let description = channel(&mut writer, DESCRIPTION_TOPIC, &schemas::string(), true)?;
    message.start();
    message.string(urdf);
    send(&mut writer, description, 0, start, &message)?;
    let fixed = channel(&mut writer, FIXED_FRAMES_TOPIC, &schemas::tf_message(), true)?;
    transforms(&mut message, start, &fixed_frames(tree));
    send(&mut writer, fixed, 0, start, &message)?;

    let tf = channel(&mut writer, "/tf", &schemas::tf_message(), false)?;
    let joints = [&sides[0].joints, &sides[1].joints, &robots];
    let states = ["/space/joint_states", "/hil/joint_states", "/robots/joint_states"];
    let states: Vec<_> = states.into_iter().zip(joints).filter(|(_, joints)| !joints.is_empty()).collect();
    let states = states
        .into_iter()
        .map(|(topic, joints)| Ok((channel(&mut writer, topic, &schemas::joint_state(), false)?, joints)))
        .collect::<Result<Vec<_>, LogError>>()?;
    let wrenches = WRENCHES
        .iter()
        .map(|(topic, name, frame)| {
            let id = channel(&mut writer, topic, &schemas::wrench_stamped(), false)?;
            let part = |part: &str, unit: &str| {
                ["x", "y", "z"].map(|axis| columns.of(&format!("{name}_{part}_{axis}_{unit}")))
            };
            Ok((id, *frame, [part("force", "n"), part("moment", "n_m")]))
        })
        .collect::<Result<Vec<_>, LogError>>()?;
    let rest: Vec<_> = trace.signals.iter().filter(|signal| !is_in_messages(&signal.name)).collect();
    let mut definition = String::new();
    for signal in &rest {
        let _ = writeln!(definition, "float64 {}  # [{}] {}", signal.name, signal.unit, signal.description);
    }
    let signals = channel(&mut writer, "/signals", &Schema { name: SIGNALS, text: definition }, false)?;

    for (row, t) in trace.time.iter().enumerate() {
        let time = start + (t * 1e9).round().max(0.0) as u64;
        let mut frames: Vec<(String, String, Pose<f64>)> = Vec::new();
        sides.iter().for_each(|side| side.frames(row, &mut frames));
        for joint in &robots {
            frames.push((joint.parent.clone(), joint.child.clone(), joint.pose(row)));
        }
        if let Some(part) = columns.place("robots_part_a", row) {
            let axes = Pose { position: part.position, attitude: Quat::identity() };
            frames.push((WORLD.to_owned(), ROBOT_AXES.to_owned(), axes));
        }
        transforms(&mut message, time, &frames);
        send(&mut writer, tf, row, time, &message)?;
        for (id, joints) in &states {
            message.start();
            stamp(&mut message, time, "");
            message.u32(joints.len() as u32);
            joints.iter().for_each(|joint| message.string(&joint.name));
            message.u32(joints.len() as u32);
            joints.iter().for_each(|joint| message.f64(joint.position(row)));
            // No velocities, no efforts.
            message.u32(0);
            message.u32(0);
            send(&mut writer, *id, row, time, &message)?;
        }
        for (id, frame, parts) in &wrenches {
            message.start();
            stamp(&mut message, time, frame);
            parts.iter().flatten().for_each(|values| message.f64(at(*values, row)));
            send(&mut writer, *id, row, time, &message)?;
        }
        message.start();
        rest.iter().for_each(|signal| message.f64(at(Some(&signal.values), row)));
        send(&mut writer, signals, row, time, &message)?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

/// Frame at part A as the robots hold it, with the laboratory's axes.
const ROBOT_AXES: &str = "robots/part_a_axes";

/// Topics of wrenches on part A about its origin: the columns, and the frame in whose axes they are.
const WRENCHES: [(&str, &str, &str); 4] = [
    ("/space/contact_wrench", "space_contact", "space/part_a_axes"),
    ("/hil/contact_wrench", "hil_contact", ROBOT_AXES),
    ("/hil/measured_wrench", "measured", "hil/part_a"),
    ("/hil/fed_back_wrench", "fed_back", "hil/part_a"),
];

/// Whether a column is in a standard message.
fn is_in_messages(name: &str) -> bool {
    let is_pose = ["_attitude_", "_joint_", "_axis_", "_rail_"].iter().any(|part| name.contains(part))
        || ["_base_position_", "_part_a_position_", "_part_b_position_"].iter().any(|part| name.contains(part));
    let is_component = |column: &str| ["_x_", "_y_", "_z_"].iter().any(|axis| column.contains(axis));
    is_pose || WRENCHES.iter().any(|(_, column, _)| name.strip_prefix(column).is_some_and(is_component))
}

/// Columns of a time history.
#[derive(Clone, Copy)]
struct Columns<'a> {
    trace: &'a Trace,
}

type Values<'a> = Option<&'a [Option<f64>]>;

fn at(values: Values<'_>, row: usize) -> f64 {
    values.and_then(|values| values[row]).unwrap_or(f64::NAN)
}

impl<'a> Columns<'a> {
    fn of(&self, name: &str) -> Values<'a> {
        self.trace.signal(name)
    }

    /// Pose of a frame in inertial or laboratory axes.
    fn place(&self, name: &str, row: usize) -> Option<Pose<f64>> {
        let value = |rest: &str| self.of(&format!("{name}_{rest}")).and_then(|values| values[row]);
        let position = vec3(value("position_x_m")?, value("position_y_m")?, value("position_z_m")?);
        let v = vec3(value("attitude_x")?, value("attitude_y")?, value("attitude_z")?);
        Some(Pose { position, attitude: Quat { w: value("attitude_w")?, v } })
    }
}

/// A joint that the time history moves.
struct Moving<'a> {
    parent: String,
    child: String,
    /// Name of the joint in the URDF.
    name: String,
    tree: &'a SceneTree,
    frame: usize,
    values: &'a [Option<f64>],
}

impl Moving<'_> {
    fn position(&self, row: usize) -> f64 {
        self.values[row].unwrap_or(f64::NAN)
    }

    fn pose(&self, row: usize) -> Pose<f64> {
        self.tree.frames[self.frame].pose(self.position(row))
    }
}

/// Joints of frames whose column the time history has.
fn moving<'a>(
    tree: &'a SceneTree,
    columns: &Columns<'a>,
    is_meant: impl Fn(&str) -> bool,
    column: impl Fn(&str) -> Option<String>,
) -> Vec<Moving<'a>> {
    let frames = tree.frames.iter().enumerate().filter(|(_, frame)| is_meant(&frame.name));
    frames
        .filter(|(_, frame)| matches!(frame.joint, SceneJoint::Turns(_) | SceneJoint::Slides(_)))
        .filter_map(|(at, frame)| {
            let values = columns.of(&column(&frame.name)?)?;
            let parent = tree.frames[frame.parent?].name.clone();
            let name = format!("{}_joint", frame.name);
            Some(Moving { parent, child: frame.name.clone(), name, tree, frame: at, values })
        })
        .collect()
}

/// Column of a robot's axis or rail.
fn robot_column(frame: &str) -> Option<String> {
    if frame.ends_with("_rail") { Some(format!("{frame}_m")) } else { Some(format!("{frame}_rad")) }
}

/// One loop of the run: base, arm and target.
struct Side<'a> {
    name: &'static str,
    columns: Columns<'a>,
    joints: Vec<Moving<'a>>,
    /// From part B to the target; none if part B rides on a ring.
    from_part_b: Option<Pose<f64>>,
    /// Part A in the base, by the joints.
    tree: &'a SceneTree,
    part_a: usize,
}

impl<'a> Side<'a> {
    fn of(name: &'static str, tree: &'a SceneTree, columns: &Columns<'a>) -> Option<Self> {
        columns.place(&format!("{name}_base"), 0)?;
        let column = |frame: &str| {
            let number = frame.strip_prefix("link_")?;
            ["rad", "m"]
                .map(|unit| format!("{name}_joint_{number}_{unit}"))
                .into_iter()
                .find(|it| columns.of(it).is_some())
        };
        let mut joints = moving(tree, columns, |frame| frame.starts_with("link_"), column);
        for joint in &mut joints {
            joint.parent = format!("{name}/{}", joint.parent);
            joint.child = format!("{name}/{}", joint.child);
        }
        let part_b = tree.find("part_b")?;
        let from_part_b = (!tree.rides_on_ring).then(|| tree.frames[part_b].origin.inverse());
        Some(Self { name, columns: *columns, joints, from_part_b, tree, part_a: tree.find("part_a")? })
    }

    fn frames(&self, row: usize, out: &mut Vec<(String, String, Pose<f64>)>) {
        let name = |rest: &str| format!("{}/{rest}", self.name);
        if let Some(base) = self.columns.place(&format!("{}_base", self.name), row) {
            out.push((WORLD.to_owned(), name("base"), base));
            let arm = self.joints.iter().fold(base, |arm, joint| arm.compose(joint.pose(row)));
            let part = arm.compose(self.tree.frames[self.part_a].origin);
            let axes = Pose { position: part.position, attitude: Quat::identity() };
            out.push((WORLD.to_owned(), name("part_a_axes"), axes));
        }
        for joint in &self.joints {
            out.push((joint.parent.clone(), joint.child.clone(), joint.pose(row)));
        }
        if let Some(part) = self.columns.place(&format!("{}_part_b", self.name), row) {
            match self.from_part_b {
                Some(back) => out.push((WORLD.to_owned(), name("target"), part.compose(back))),
                None => out.push((WORLD.to_owned(), name("part_b"), part)),
            }
        }
    }
}

/// Frames without a joint: the parts of both loops, the laboratory, the robots' bases.
fn fixed_frames(tree: &SceneTree) -> Vec<(String, String, Pose<f64>)> {
    let mut frames = Vec::new();
    for frame in tree.frames.iter().filter(|frame| frame.joint == SceneJoint::Fixed) {
        let Some(parent) = frame.parent.map(|parent| &tree.frames[parent].name) else { continue };
        let is_part = ["part_a", "part_b"].contains(&frame.name.as_str());
        if is_part && !(tree.rides_on_ring && frame.name == "part_b") {
            for side in ["space", "hil"] {
                frames.push((format!("{side}/{parent}"), format!("{side}/{}", frame.name), frame.origin));
            }
        } else if !is_part {
            frames.push((parent.clone(), frame.name.clone(), frame.origin));
        }
    }
    frames
}

fn stamp(message: &mut Encoder, time: u64, frame: &str) {
    message.i32((time / 1_000_000_000) as i32);
    message.u32((time % 1_000_000_000) as u32);
    message.string(frame);
}

/// A TFMessage.
fn transforms(message: &mut Encoder, time: u64, frames: &[(String, String, Pose<f64>)]) {
    message.start();
    message.u32(frames.len() as u32);
    for (parent, child, pose) in frames {
        stamp(message, time, parent);
        message.string(child);
        let (p, q): (Vec3<f64>, Quat<f64>) = (pose.position, pose.attitude);
        [p.x, p.y, p.z, q.v.x, q.v.y, q.v.z, q.w].into_iter().for_each(|value| message.f64(value));
    }
}
