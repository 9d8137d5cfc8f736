//! `softdock rig init`: a rig file from logs.

use crate::progress::Terminal;
use crate::terminal::{Exit, Failure, Format, Outcome, write};
use crate::values::positive;
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use softdock_results::ResultFile;
use softdock_rig_init::{PROPOSED_KINDS, ProposedRig, RigInitError, RigInitOptions};
use std::path::{Path, PathBuf};

/// Work with rig files.
#[derive(Args, Debug)]
pub(crate) struct RigArgs {
    /// Work.
    #[command(subcommand)]
    work: RigWork,
}

/// Works with rig files.
#[derive(Debug, Subcommand)]
enum RigWork {
    Init(Box<RigInitArgs>),
}

/// Write a rig file from a log: what the log shows, and "fill in" for the rest.
#[derive(Args, Debug)]
#[command(after_help = "\
Logs are CSV or Parquet. Columns are recognised by their names (UR RTDE, ROS 2 joint_states, KUKA RSI, Staubli, dSPACE, or a
unit at the end), units also by their values and by the derivative of a position. Every guess states its figure in a comment.
diagnose refuses values \"fill in\" and names the key.

Examples:
  softdock rig init log.csv
  softdock rig init log.csv --joint 2 --out axis2.toml
  softdock rig init joint_states.parquet --urdf robot.urdf --out robot_rig.toml")]
struct RigInitArgs {
    /// Logs of the rig; guesses come from the first one.
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,
    /// URDF of the robot: its model file is written beside the rig file.
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Kind of the rig, where the guess is wrong.
    #[arg(long, value_name = "KIND", value_parser = PossibleValuesParser::new(PROPOSED_KINDS))]
    kind: Option<String>,
    /// Joint of a drive or a command, from 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    joint: Option<u32>,
    /// Torque (N m) or force (N) at the joint's side per unit of the recorded torque, current or voltage: gear ratio times
    /// torque constant.
    #[arg(long, value_name = "NUMBER", value_parser = positive)]
    torque_scale: Option<f64>,
    /// Rig file to write.
    #[arg(long, value_name = "FILE", default_value = "rig.toml")]
    out: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn rig(args: &RigArgs, format: &Format) -> Outcome {
    let RigWork::Init(args) = &args.work;
    let name = args.out.file_name().map(|name| name.to_string_lossy().into_owned());
    let Some(file) = name.filter(|name| name.ends_with(".toml")) else {
        let message = format!("--out {}: a rig file ends in .toml", args.out.display());
        return Err(Failure::new(message, "name a file such as rig.toml"));
    };
    let options = RigInitOptions {
        kind: args.kind.clone(),
        joint: args.joint,
        urdf: args.urdf.clone(),
        torque_scale: args.torque_scale,
        id: id_of(&file),
    };
    let terminal = Terminal::new("rig init");
    let proposed = ProposedRig::of(&args.logs, &file, &options)?;
    terminal.end();
    let folder = args.out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut files = vec![ResultFile::new(&file, proposed.rig.clone())];
    files.extend(proposed.robot.iter().map(|(name, text)| ResultFile::new(name, text.clone())));
    if let Some(existing) = files.iter().map(|file| folder.join(&file.name)).find(|path| path.exists() && !args.force) {
        let message = format!("{} exists", existing.display());
        return Err(Failure::new(message, "name another file with --out, or replace it with --force"));
    }
    let written = write(folder, &files)?;
    format.print(|| json(&proposed, &written), || text(&proposed, &written, args));
    Ok(Exit::Done)
}

/// Name of the rig by the name of its file.
fn id_of(file: &str) -> String {
    let stem = file.trim_end_matches(".toml");
    let legal = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    let id: String = stem.chars().map(legal).take(56).collect();
    let id = id.trim_start_matches('-');
    if id.is_empty() { "rig".to_owned() } else { id.to_owned() }
}

fn json(proposed: &ProposedRig, written: &str) -> serde_json::Value {
    let open = |key: &softdock_rig_init::OpenKey| serde_json::json!({ "file": key.file, "line": key.line, "key": key.key, "meaning": key.meaning });
    serde_json::json!({
        "kind": proposed.kind,
        "notes": proposed.notes,
        "open": proposed.open.iter().map(open).collect::<Vec<_>>(),
        "files": written.lines().collect::<Vec<_>>(),
    })
}

fn text(proposed: &ProposedRig, written: &str, args: &RigInitArgs) -> String {
    let mut out = String::new();
    proposed.notes.iter().for_each(|note| out += &format!("{note}\n"));
    if proposed.open.is_empty() {
        out += "\nno value is open\n";
    } else {
        out += &format!("\n{} values to fill in:\n", proposed.open.len());
        for key in &proposed.open {
            out += &format!("  {}:{}  {}: {}\n", key.file, key.line, key.key, key.meaning);
        }
    }
    let next = format!("softdock diagnose {} {}", args.out.display(), args.logs[0].display());
    format!("{out}\n{written}\nnext: {next}, with --holdout LOG or --hold-out-from SECONDS")
}

impl From<RigInitError> for Failure {
    fn from(error: RigInitError) -> Self {
        match error {
            RigInitError::Recording(error) => error.into(),
            RigInitError::Urdf(problems) => problems.into(),
        }
    }
}
