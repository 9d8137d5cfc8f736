//! `softdock init` and `examples`: the shipped campaigns, embedded in the program.

use crate::listing::{Listing, search};
use crate::terminal::{Exit, Failure, Format, Outcome, write_file};
use clap::Args;
use include_dir::{Dir, include_dir};
use serde_json::json;
use softdock_campaign::suggest::did_you_mean;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// The shipped files.
static SHIPPED: Dir = include_dir!("$CARGO_MANIFEST_DIR/campaigns");

/// A shipped campaign.
struct Example {
    /// Word of the task.
    task: &'static str,
    /// Id of the campaign, and name of its file.
    id: &'static str,
    meaning: &'static str,
}

const EXAMPLES: [Example; 18] = [
    Example { task: "first", id: "smoke", meaning: "a free chaser docks in three seconds: the smallest campaign" },
    Example { task: "dock", id: "probe_drogue", meaning: "a six-joint arm docks a probe into a free target's drogue" },
    Example { task: "berth", id: "berth", meaning: "a seven-joint arm berths a cube on four bumpers" },
    Example { task: "approach", id: "servo", meaning: "the arm berths the cube by its camera, in phases" },
    Example { task: "insert", id: "insert", meaning: "an arm inserts a peg into its bore" },
    Example { task: "mesh", id: "mesh", meaning: "a square peg enters its socket: both parts are meshes" },
    Example { task: "grapple", id: "grapple", meaning: "three fingers grapple a tumbling satellite by its pin" },
    Example {
        task: "ring",
        id: "adapter_ring",
        meaning: "two jaws grapple a tumbling satellite by its launch-adapter ring",
    },
    Example { task: "capture", id: "soft_capture", meaning: "a soft capture ring on six legs captures a 12 t vehicle" },
    Example {
        task: "impact",
        id: "plate_impact",
        meaning: "a ball bounces on a plate: loop delay against stiffness and damping",
    },
    Example { task: "jam", id: "jamming", meaning: "a tilted peg slides in or jams: friction against tilt" },
    Example { task: "wedge", id: "wedging", meaning: "a squeezed peg stays without a load: friction against tilt" },
    Example {
        task: "delay",
        id: "compensators",
        meaning: "seven delay compensations in the docking of probe and drogue",
    },
    Example {
        task: "stability",
        id: "stability_map",
        meaning: "energy limit of a delayed bounce, for every compensation",
    },
    Example {
        task: "joints",
        id: "smoke_joint",
        meaning: "the smallest docking on two industrial robots, joint by joint",
    },
    Example { task: "track", id: "facility_sine", meaning: "a robot of the facility follows a sine" },
    Example {
        task: "feedforward",
        id: "facility_feedforward",
        meaning: "velocity response of a robot: feedforward off, gravity, full",
    },
    Example {
        task: "gears",
        id: "facility_gear_ratio",
        meaning: "bandwidth against speed of a robot with other gears",
    },
];

/// Write a commented campaign with every file that it needs, from the shipped examples.
#[derive(Args, Debug)]
#[command(after_help = "\
Without TASK the tasks are listed. The files are part of the program. An existing file with other content is kept: the
command stops and writes nothing.

Examples:
  softdock init
  softdock init dock
  softdock init capture my_study")]
pub(crate) struct InitArgs {
    /// Task, or id of a shipped campaign.
    task: Option<String>,
    /// Folder that receives the files.
    #[arg(value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Replace existing files.
    #[arg(long, requires = "task")]
    force: bool,
}

pub(crate) fn init(args: &InitArgs, format: &Format) -> Outcome {
    let Some(task) = &args.task else {
        tasks(&EXAMPLES.iter().collect::<Vec<_>>()).print(format, "\nnext  softdock init TASK [DIR]");
        return Ok(Exit::Done);
    };
    let example = EXAMPLES.iter().find(|example| example.task == task || example.id == task).ok_or_else(|| {
        let words: Vec<&str> = EXAMPLES.iter().flat_map(|example| [example.task, example.id]).collect();
        let near = did_you_mean(task, &words).unwrap_or_default();
        Failure::new(
            format!("there is no task `{task}`"),
            format!("{near} `softdock init` lists the tasks").trim_start(),
        )
    })?;
    let files = files_of(&campaign_file(example));
    let differs = |(name, bytes): &(&String, &&[u8])| {
        let path = args.folder.join(name);
        path.symlink_metadata().is_ok()
            && !softdock_input::read(&path, softdock_input::MAX_BINARY).is_ok_and(|own| own == **bytes)
    };
    let existing: Vec<String> =
        files.iter().filter(differs).map(|(name, _)| args.folder.join(name).display().to_string()).collect();
    if !existing.is_empty() && !args.force {
        let message = format!("these files exist with other content: {}", existing.join(", "));
        return Err(Failure::new(message, "name another folder, or replace them with --force"));
    }
    for (name, bytes) in &files {
        write_file(&args.folder.join(name), bytes)?;
    }
    let paths: Vec<String> = files.keys().map(|name| shown(&args.folder, name)).collect();
    let next = format!("softdock run {}", quoted(&shown(&args.folder, &campaign_file(example))));
    format.print(
        || json!({ "task": example.task, "id": example.id, "files": paths, "next": next }),
        || format!("{}\n{}\n\nnext  {next}", example.meaning, paths.join("\n")),
    );
    Ok(Exit::Done)
}

/// A path below a folder, without a leading `./`.
fn shown(folder: &Path, name: &str) -> String {
    let path = if folder == Path::new(".") { PathBuf::from(name) } else { folder.join(name) };
    path.display().to_string()
}

/// A word of a shell's command.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/\\._-:".contains(c);
    if word.chars().all(is_plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

fn campaign_file(example: &Example) -> String {
    format!("{}.toml", example.id)
}

/// List the shipped campaigns: task, id, number of runs, meaning.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  softdock examples\n  softdock examples peg")]
pub(crate) struct ExamplesArgs {
    /// Word in task, id or meaning.
    word: Option<String>,
}

pub(crate) fn examples(args: &ExamplesArgs, format: &Format) -> Outcome {
    let all: Vec<&Example> = EXAMPLES.iter().collect();
    let found = search(all, args.word.as_deref(), "example", |row| [row.task, row.id], |row| row.meaning)?;
    tasks(&found).print(format, "\nnext  softdock init TASK [DIR]");
    Ok(Exit::Done)
}

/// The table of examples.
fn tasks(examples: &[&Example]) -> Listing {
    let row = |example: &&Example| {
        let runs = campaign_table(example).get("runs").and_then(toml::Value::as_integer).unwrap_or_default();
        vec![json!(example.task), json!(example.id), json!(runs), json!(example.meaning)]
    };
    Listing { head: &["task", "id", "runs", "meaning"], rows: examples.iter().map(row).collect() }
}

/// The campaign of an example as a table.
fn campaign_table(example: &Example) -> toml::Table {
    let text = SHIPPED.get_file(campaign_file(example)).and_then(|file| file.contents_utf8());
    text.and_then(|text| text.parse().ok()).unwrap_or_default()
}

/// A shipped file and all shipped files that it names, directly or not, by their paths.
fn files_of(first: &str) -> BTreeMap<String, &'static [u8]> {
    let (mut open, mut files) = (vec![first.to_owned()], BTreeMap::new());
    while let Some(name) = open.pop() {
        let Some(file) = SHIPPED.get_file(&name) else { continue };
        files.insert(name.clone(), file.contents());
        let Some(table) = file.contents_utf8().and_then(|text| text.parse::<toml::Table>().ok()) else { continue };
        let mut texts: Vec<String> = file.contents_utf8().and_then(schema_of).map(str::to_owned).into_iter().collect();
        texts_in(&toml::Value::Table(table), &mut texts);
        let named = texts.iter().filter_map(|text| beside(&name, text)).filter(|path| SHIPPED.get_file(path).is_some());
        open.extend(named.filter(|path| !files.contains_key(path)));
    }
    files
}

/// The schema that the first line of a file names for editors.
fn schema_of(text: &str) -> Option<&str> {
    text.lines().next()?.strip_prefix("#:schema ").map(str::trim)
}

/// All texts in a value.
fn texts_in(value: &toml::Value, texts: &mut Vec<String>) {
    match value {
        toml::Value::String(text) => texts.push(text.clone()),
        toml::Value::Array(items) => items.iter().for_each(|item| texts_in(item, texts)),
        toml::Value::Table(table) => table.iter().for_each(|(_, item)| texts_in(item, texts)),
        _ => {}
    }
}

/// A path that a file names, seen from the shipped folder; `None` if it leads out.
fn beside(file: &str, path: &str) -> Option<String> {
    let mut parts: Vec<&str> = file.split('/').collect();
    parts.pop();
    for part in Path::new(path).components() {
        match part {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::ParentDir => drop(parts.pop()?),
            Component::CurDir => {}
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_campaign_is_one_example() {
        let campaigns = SHIPPED.files().filter_map(|file| file.path().to_str()?.strip_suffix(".toml"));
        let campaigns: Vec<&str> = campaigns.collect();
        for id in &campaigns {
            assert_eq!(EXAMPLES.iter().filter(|example| example.id == *id).count(), 1, "{id}");
        }
        assert_eq!(campaigns.len(), EXAMPLES.len());
        let mut words: Vec<&str> = EXAMPLES.iter().map(|example| example.task).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), EXAMPLES.len(), "a word of a task names one campaign");
    }

    #[test]
    fn files_of_a_campaign_are_those_that_it_names() {
        let names = |id: &str| files_of(id).into_keys().collect::<Vec<_>>();
        let schemas = ["schemas/campaign.schema.json", "schemas/scenario.schema.json"];
        assert_eq!(names("smoke.toml"), ["scenarios/smoke.toml", schemas[0], schemas[1], "smoke.toml"]);
        let docking = names("probe_drogue.toml");
        for name in ["facilities/reference.toml", "models/kr300_r2500.toml", "scenarios/probe_drogue.toml"] {
            assert!(docking.iter().any(|own| own == name), "{docking:?}");
        }
        assert_eq!(beside("scenarios/a.toml", "../../x.toml"), None);
    }
}
