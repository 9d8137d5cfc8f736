//! Proposal of a rig file from logs: kind, columns, start values, and what is open.

use crate::clock::Clock;
use crate::error::RigInitError;
use crate::figures::short;
use crate::joints::JointColumns;
use crate::names::Meaning;
use crate::recorded_table::RecordedTable;
use crate::robot_text::RecordedRobot;
use crate::toml_text::{TomlText, quoted};
use crate::{drive_text, other_texts};
use softdock_campaign::urdf::UrdfRobot;
use softdock_diagnosis::DiagnosisError;
use std::path::PathBuf;

/// Kinds that are proposed; a facility has a campaign.
pub const PROPOSED_KINDS: [&str; 7] = ["drive", "robot", "command", "sensor", "contact", "body", "toss"];

/// What a user states beside the logs.
#[derive(Clone, Debug, Default)]
pub struct RigInitOptions {
    /// Kind of the rig, where the guess is not wanted.
    pub kind: Option<String>,
    /// Joint of a drive or a command, from 1.
    pub joint: Option<u32>,
    /// URDF of the robot.
    pub urdf: Option<PathBuf>,
    /// Torque or force at the joint's side per unit of the recorded torque, current or voltage.
    pub torque_scale: Option<f64>,
    /// Name of the rig, and beginning of the robot file's name.
    pub id: String,
}

/// A key whose value the log does not show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenKey {
    /// File.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Key.
    pub key: String,
    /// Meaning, unit and range.
    pub meaning: String,
}

/// Proposed files.
#[derive(Clone, Debug)]
pub struct ProposedRig {
    /// Text of the rig file.
    pub rig: String,
    /// Name and text of the robot's model file.
    pub robot: Option<(String, String)>,
    /// Kind of the rig.
    pub kind: String,
    /// Guesses with their figures, and what to check.
    pub notes: Vec<String>,
    /// Keys to fill in.
    pub open: Vec<OpenKey>,
}

impl ProposedRig {
    /// Proposes a rig file; guesses and start values come from the first log, the others must have its columns.
    ///
    /// `file` is the name of the rig file, for the list of open keys.
    ///
    /// # Errors
    /// A log or a URDF that cannot be read, and a log that fits no kind, with its columns.
    pub fn of(logs: &[PathBuf], file: &str, options: &RigInitOptions) -> Result<Self, RigInitError> {
        let table = RecordedTable::read(&logs[0])?;
        for log in &logs[1..] {
            same_columns(&table, &RecordedTable::read(log)?, log)?;
        }
        let clock = Clock::of(&table);
        let mut joints = JointColumns::all(&table, &clock);
        let torques = joints.iter_mut().filter_map(|joint| joint.torque.as_mut());
        if let Some(scale) = options.torque_scale {
            torques.for_each(|torque| torque.rescale(scale));
        }
        let joints = joints;
        let urdf = options.urdf.as_ref().map(|path| UrdfRobot::load(path)).transpose()?;
        let (kind, why) = match &options.kind {
            Some(kind) => (kind.clone(), "as requested".to_owned()),
            None => kind(&table, &joints, urdf.is_some())?,
        };
        if urdf.is_some() && kind != "robot" {
            let what = format!("--urdf belongs to the kind \"robot\", not to \"{kind}\"");
            return Err(DiagnosisError::unfit(what, "leave out --urdf, or --kind").into());
        }
        let mut notes = vec![format!("kind {kind}: {why}"), format!("clock: {}", clock.basis)];
        if !table.unread.is_empty() {
            notes.push(format!("columns without numbers: {}", table.unread.join(", ")));
        }
        let mut out = TomlText::default();
        head(&mut out, &table, &kind, &options.id, &why);
        let mut robot = None;
        match kind.as_str() {
            "robot" => {
                let Some(urdf) = &urdf else {
                    let remedy = "add --urdf ROBOT.urdf, or propose one joint with --kind drive --joint N";
                    return Err(DiagnosisError::unfit("a robot needs its links and axes", remedy).into());
                };
                let recorded = RecordedRobot::of(urdf, &joints, &clock).map_err(|what| {
                    let remedy = "name the URDF of the recorded robot; joints that do not move have type=\"fixed\"";
                    DiagnosisError::unfit(what, remedy)
                })?;
                let name = format!("{}_robot.toml", file.strip_suffix(".toml").unwrap_or(file));
                let urdf_name = options.urdf.as_ref().and_then(|path| path.file_name());
                let urdf_name = urdf_name.map_or_else(String::new, |name| name.to_string_lossy().into_owned());
                let mut model = TomlText::default();
                recorded.model(&mut model, &format!("{}-robot", options.id), &urdf_name, &clock);
                recorded.rig(&mut out, &name, &clock);
                notes.extend(recorded.notes(&table));
                notes.extend(joints.iter().flat_map(|joint| joint.notes.clone()));
                robot = Some((name, model));
            }
            "drive" => {
                let joint = drive_joint(&joints, options.joint, &clock, &mut notes)?;
                notes.extend(joint.notes.clone());
                drive_text::write(&mut out, joint, &clock, joints.len() > 1);
            }
            "command" => {
                let joint = match options.joint {
                    Some(_) => Some(chosen(&joints, options.joint)?),
                    None => other_texts::fastest(&joints),
                };
                joint.iter().for_each(|joint| notes.extend(joint.notes.clone()));
                other_texts::command(&mut out, &table, &clock, joint);
            }
            "sensor" => other_texts::sensor(&mut out, &table, &clock),
            "contact" => other_texts::contact(&mut out, &table, &clock),
            "body" => other_texts::body(&mut out, &table, &clock),
            "toss" => other_texts::toss(&mut out, &table, &clock),
            other => {
                let what = format!("there is no kind \"{other}\"");
                return Err(DiagnosisError::unfit(what, format!("name one of: {}", PROPOSED_KINDS.join(", "))).into());
            }
        }
        let open_in = |file: &str, text: &TomlText| -> Vec<OpenKey> {
            let keys = text.open_keys().into_iter();
            keys.map(|(line, key, meaning)| OpenKey { file: file.to_owned(), line, key, meaning }).collect()
        };
        let mut open = open_in(file, &out);
        robot.iter().for_each(|(name, text)| open.extend(open_in(name, text)));
        let robot = robot.map(|(name, text)| (name, text.text));
        Ok(Self { rig: out.text, robot, kind, notes, open })
    }
}

fn head(out: &mut TomlText, table: &RecordedTable, kind: &str, id: &str, why: &str) {
    out.push("schema = \"rig/1\"");
    out.comment(why);
    out.push(&format!("kind = \"{kind}\""));
    out.push(&format!("id = {}", quoted(id)));
    out.push(&format!("title = {}", quoted(&format!("Rig of {}", table.file))));
    out.comment("Written by softdock rig init. Values \"fill in\" are refused until they are replaced.");
}

/// Refuses a log with other columns.
fn same_columns(first: &RecordedTable, other: &RecordedTable, path: &std::path::Path) -> Result<(), RigInitError> {
    let has = |table: &RecordedTable, name: &str| table.columns.iter().any(|column| column.name == name);
    let lacking = first.columns.iter().find(|column| !has(other, &column.name));
    lacking.map_or(Ok(()), |column| {
        let what = format!("there is no column `{}`, which {} has", column.name, first.file);
        Err(DiagnosisError::log(path, Some(1), what, "write a rig for each kind of log").into())
    })
}

/// Kind of the rig by what the columns hold, with the reason.
fn kind(table: &RecordedTable, joints: &[JointColumns], urdf: bool) -> Result<(String, String), RigInitError> {
    let wrench = table.has_vector(Meaning::Force, "xyz", false);
    let known = table.has_vector(Meaning::Force, "xyz", true);
    let with_torque = joints.iter().filter(|joint| joint.torque.is_some()).count();
    let of = |kind: &str, why: String| Ok((kind.to_owned(), why));
    if urdf {
        return of("robot", format!("a URDF is given; the log has positions of {} joints", joints.len()));
    }
    if wrench && known {
        return of("sensor", "the log has known forces beside measured ones".to_owned());
    }
    if with_torque > 0 {
        let many = if joints.len() > 1 { "; with --urdf the whole robot is a rig" } else { "" };
        let torques = format!("{with_torque} of {} joints have a position and a torque or current", joints.len());
        return of("drive", torques + many);
    }
    if let Some(event) = other_texts::event(table).filter(|_| table.of(Meaning::Rate).next().is_some()) {
        return of("command", format!("`{}` is a flag, rates are recorded and no torques", event.name));
    }
    if joints.iter().any(|joint| joint.reference.is_some()) {
        return of("command", "positions and their commands are recorded, and no torques with a sign".to_owned());
    }
    let motion = table.has_vector(Meaning::BodyAcceleration, "xyz", false);
    if wrench && motion && table.has_vector(Meaning::BodyRate, "xyz", false) {
        return of("body", "a wrench, accelerations and angular rates are recorded".to_owned());
    }
    let place = table.has_vector(Meaning::Place, "xyz", false);
    if wrench && place {
        return of("contact", "forces and a position are recorded".to_owned());
    }
    if place && table.has_vector(Meaning::Orientation, "wxyz", false) {
        return of("toss", "positions and quaternions are recorded, and no forces".to_owned());
    }
    let names: Vec<&str> = table.columns.iter().take(16).map(|column| column.name.as_str()).collect();
    let more = if table.columns.len() > names.len() { ", ..." } else { "" };
    let unused: String = joints.iter().flat_map(|joint| &joint.notes).map(|note| format!("; {note}")).collect();
    let what = format!("the columns of {} fit no kind of rig: {}{more}{unused}", table.file, names.join(", "));
    let remedy = "a drive needs position and torque or current; a command a flag and rates, or command and position; a \
                  sensor, a contact and a body forces along x, y, z; a toss positions and quaternions. Name the kind with \
                  --kind, and correct the columns in the file (`softdock diagnose --signals` lists the signals)";
    Err(DiagnosisError::unfit(what, remedy).into())
}

/// The joint with a number.
fn chosen(joints: &[JointColumns], number: Option<u32>) -> Result<&JointColumns, RigInitError> {
    let found = joints.iter().find(|joint| joint.axis == number || joint.axis.is_none());
    found.ok_or_else(|| {
        let numbers: Vec<String> = joints.iter().filter_map(|joint| joint.axis).map(|axis| axis.to_string()).collect();
        let what = format!("the log has no position of joint {}", number.unwrap_or_default());
        DiagnosisError::unfit(what, format!("name one of: {}", numbers.join(", "))).into()
    })
}

/// The joint of a drive: as requested, or the one whose torque its own motion explains best.
fn drive_joint<'a>(
    joints: &'a [JointColumns],
    number: Option<u32>,
    clock: &Clock,
    notes: &mut Vec<String>,
) -> Result<&'a JointColumns, RigInitError> {
    if number.is_some() {
        return chosen(joints, number);
    }
    let Some(first) = joints.iter().find(|joint| joint.torque.is_some()).or_else(|| joints.first()) else {
        let remedy = "name another kind with --kind, or write the columns into the file by hand";
        return Err(DiagnosisError::unfit("the log has no position of a joint", remedy).into());
    };
    if joints.len() == 1 {
        return Ok(first);
    }
    let explained = joints.iter().filter_map(|joint| Some((drive_text::fit(joint, clock)?.unexplained, joint)));
    let mut explained: Vec<(f64, &JointColumns)> = explained.collect();
    explained.sort_by(|a, b| a.0.total_cmp(&b.0));
    let shares: Vec<String> =
        explained.iter().map(|(share, joint)| format!("{} {} %", joint.title(), short(100.0 * share))).collect();
    let joint = explained.first().map(|(_, joint)| *joint);
    let joint = joint.or_else(|| other_texts::fastest(joints)).unwrap_or(first);
    let basis = if shares.is_empty() {
        "not known for any joint, so the fastest is proposed".to_owned()
    } else {
        shares.join(", ")
    };
    notes.push(format!(
        "{} is proposed (--joint selects another); torque unexplained by its own motion: {basis}",
        joint.title()
    ));
    Ok(joint)
}
