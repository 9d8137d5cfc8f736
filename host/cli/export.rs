//! `softdock export`: scenes and runs for other programs.

use crate::terminal::{Exit, Failure, Format, Outcome, warn, write};
use clap::{Args, Subcommand};
use serde_json::json;
use softdock_campaign::{Campaign, FileKind, Problems, Scenario, kind, load_scenario};
use softdock_export::{ExportedScene, SceneTree, mjcf_files, run_recording, urdf_files};
use softdock_farm::query::run_trace;
use softdock_farm::{ResultsFolder, default_results};
use softdock_kernels::plant::Plant;
use softdock_results::traces::read_trace;
use softdock_results::write_file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Export the scene as URDF or MJCF, or a run as MCAP for Foxglove and ROS 2.
#[derive(Args, Debug)]
#[command(after_help = "\
The log of a session (drive.mcap) is such a recording already, with the wall clock of the session.

Examples:
  softdock export urdf campaigns/probe_drogue.toml --out scene
  softdock export mjcf campaigns/scenarios/berth.toml --out scene
  softdock export mcap results/probe_drogue 17 --out run17.mcap")]
pub(crate) struct ExportArgs {
    /// Format.
    #[command(subcommand)]
    format: Export,
}

/// Formats.
#[derive(Debug, Subcommand)]
enum Export {
    /// Base, arm, parts, target and robots as URDF.
    Urdf(SceneArgs),
    /// The same as MJCF, for MuJoCo.
    Mjcf(SceneArgs),
    /// The time history of a run as MCAP: frames, joints, wrenches, description.
    Mcap(RecordingArgs),
}

#[derive(Args, Debug)]
struct SceneArgs {
    /// Campaign or scenario file.
    file: PathBuf,
    /// Folder that receives the files; `results/export_ID` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct RecordingArgs {
    /// Results folder.
    results: PathBuf,
    /// Number of the run.
    run: u64,
    /// File of the recording; `DIR/replays/run=N.mcap` if not given.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Wall clock at the start of the run, seconds since 1970.
    #[arg(long, value_name = "SECONDS", default_value_t = 0)]
    start: u32,
}

pub(crate) fn export(args: &ExportArgs, format: &Format) -> Outcome {
    match &args.format {
        Export::Urdf(args) => scene(args, format, |tree, _| urdf_files(tree)),
        Export::Mjcf(args) => {
            scene(args, format, |tree, plant| mjcf_files(tree, plant.nominal.contact_friction, plant.timing.substep))
        }
        Export::Mcap(args) => recording(args, format),
    }
}

fn scenario(file: &Path) -> Result<Scenario, Problems> {
    match kind(file)? {
        FileKind::Campaign => Ok(Campaign::load(file)?.scenario),
        FileKind::Scenario | FileKind::Other => load_scenario(file),
    }
}

fn scene(args: &SceneArgs, format: &Format, files: impl Fn(&SceneTree, &Plant) -> ExportedScene) -> Outcome {
    let scenario = scenario(&args.file)?;
    let (id, plant) = (scenario.id.clone(), Plant::new(scenario.model));
    let exported = files(&SceneTree::of(&id, &plant), &plant);
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("export_{id}")));
    let written = write(&folder, &exported.files)?;
    exported.notes.iter().for_each(warn);
    format
        .print(|| json!({ "files": written.lines().collect::<Vec<_>>(), "notes": exported.notes }), || written.clone());
    Ok(Exit::Done)
}

fn recording(args: &RecordingArgs, format: &Format) -> Outcome {
    let folder = ResultsFolder::open(&args.results)?;
    let trace = read_trace(&run_trace(&folder, args.run)?).map_err(Failure::of)?;
    let plant = Plant::new(folder.campaign.scenario.model.clone());
    let tree = SceneTree::of(&folder.campaign.scenario.id, &plant);
    let urdf = &urdf_files(&tree).files[0].text;
    let provenance = BTreeMap::from([
        ("campaign".to_owned(), folder.campaign.id.clone()),
        ("campaign_hash".to_owned(), folder.campaign.hash.clone()),
        ("seed".to_owned(), folder.campaign.seed.to_string()),
        ("run".to_owned(), args.run.to_string()),
    ]);
    let remedy = format!(
        "run the campaign again with --fresh, or repeat the run: softdock replay {} {}",
        args.results.display(),
        args.run
    );
    let recorded = run_recording(&tree, &trace, u64::from(args.start) * 1_000_000_000, urdf, provenance);
    let bytes = recorded.map_err(|error| Failure::new(error, remedy))?;
    let name = format!("run={:09}.mcap", args.run);
    let file = args.out.clone().unwrap_or_else(|| args.results.join("replays").join(name));
    if let Some(parent) = file.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(Failure::of)?;
    }
    write_file(&file, &bytes).map_err(|error| Failure::new(error, "name a file that can be written"))?;
    if args.start == 0 {
        warn("the clock starts at 1970-01-01: name the start of the run with --start SECONDS");
    }
    format.print(|| json!({ "file": file, "instants": trace.time.len() }), || file.display().to_string());
    Ok(Exit::Done)
}
