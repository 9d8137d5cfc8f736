//! Campaigns as array jobs of Slurm: editable scripts, their submission, their state.
//!
//! The results folder must be visible from all nodes. The campaign's files are written there first. Every task of the
//! array is a worker ([`crate::work`]) in that folder, and a second job, which waits for the array, completes the
//! folder ([`crate::finish_folder`]). A requeued task continues from the files on disk.

use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::observer::Context;
use crate::paths::normal;
use serde::{Deserialize, Serialize};
use softdock_campaign::Campaign;
use softdock_results::write_file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the scripts, their logs and the jobs' numbers below a results folder.
pub(crate) const SLURM_FOLDER: &str = "slurm";

/// Script of the array, script of the last job, and numbers of both jobs.
pub(crate) const SLURM_FILES: [&str; 3] = ["array.sh", "finish.sh", "jobs.json"];

/// Most tasks if none are asked for.
const MOST_TASKS: u32 = 64;

/// Options of an array job.
#[derive(Clone, Debug)]
pub struct SlurmOptions {
    /// The program that the jobs run.
    pub program: PathBuf,
    /// Backend of the workers: `auto`, `gpu` or `cpu`.
    pub backend: &'static str,
    /// Tasks of the array; by default one for each shard, 64 at most.
    pub tasks: Option<u32>,
    /// Time before the time limit at which a task receives a signal to end and keeps its finished runs \[s\].
    pub grace_s: u32,
    /// More options of `sbatch` for the array, such as `--time=02:00:00`.
    pub sbatch: Vec<String>,
    /// The same for the last job.
    pub finish_sbatch: Vec<String>,
}

/// Numbers of the jobs of a results folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlurmJobs {
    /// Job of the array.
    pub array: String,
    /// Job that ends the folder.
    pub finish: String,
    /// Tasks of the array.
    pub tasks: u32,
}

impl SlurmJobs {
    /// Returns the job numbers, and the command that shows the progress of `results`.
    pub fn text(&self, results: &Path) -> String {
        let Self { array, finish, tasks } = self;
        let results = results.display();
        format!(
            "job {array}: {tasks} tasks make the runs; job {finish} judges them\n\
             follow it:  softdock status {results}"
        )
    }
}

/// Claims a results folder for a campaign and writes the scripts of its jobs there, without submission.
///
/// # Errors
/// If the folder is not one of this campaign, or a file cannot be written.
pub fn write_slurm_scripts(
    campaign: Campaign,
    results: &Path,
    options: &SlurmOptions,
    context: Context,
) -> Result<[PathBuf; 2]> {
    let folder = ResultsFolder::claim(results, campaign, context)?;
    let shards = folder.plan().shards().max(1);
    let tasks = options.tasks.unwrap_or(shards.min(MOST_TASKS)).min(shards);
    let place = normal(results);
    let scripts = place.join(SLURM_FOLDER);
    let name = folder.campaign.id.replace('/', "_");
    let (program, place) = (quoted(&options.program), quoted(&place));
    let logs = quoted(&scripts);
    let lines = |options: &[String]| options.iter().map(|option| format!("#SBATCH {option}\n")).collect::<String>();
    let array = format!(
        "#!/bin/bash\n\
         # An array job that makes the runs of a campaign; written by `softdock submit`.\n\
         # By hand: sbatch array.sh, then sbatch --dependency=afterany:JOB finish.sh\n\
         #SBATCH --job-name=softdock-{name}\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --output={logs}/task-%a.log\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --requeue\n\
         #SBATCH --signal=B:TERM@{grace}\n\
         {more}\
         \n\
         terminated=\n\
         {program} worker {place} --part array/{tasks} --backend {backend} &\n\
         worker=$!\n\
         trap 'terminated=yes; kill -TERM \"$worker\"' TERM\n\
         wait \"$worker\"\n\
         code=$?\n\
         # The wait ends when the signal arrives, the worker a little later.\n\
         if [ -n \"$terminated\" ]; then wait \"$worker\"; code=$?; fi\n\
         # Near its time limit a task goes to the queue again and goes on from what is on disk.\n\
         if [ -n \"$terminated\" ] && [ \"$code\" = 3 ]; then scontrol requeue \"$SLURM_JOB_ID\" || true; fi\n\
         exit \"$code\"\n",
        last = tasks - 1,
        grace = options.grace_s,
        more = lines(&options.sbatch),
        backend = options.backend,
    );
    let finish = format!(
        "#!/bin/bash\n\
         # Judges the campaign once its runs are made; written by `softdock submit`.\n\
         #SBATCH --job-name=softdock-{name}-finish\n\
         #SBATCH --output={logs}/finish.log\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --requeue\n\
         {more}\
         \n\
         exec {program} finish {place}\n",
        more = lines(&options.finish_sbatch),
    );
    let [array_path, finish_path] = [SLURM_FILES[0], SLURM_FILES[1]].map(|name| scripts.join(name));
    write_file(&array_path, array.as_bytes())?;
    write_file(&finish_path, finish.as_bytes())?;
    Ok([array_path, finish_path])
}

/// Submits the scripts of [`write_slurm_scripts`], the second after the first, and records their numbers.
///
/// # Errors
/// If `sbatch` is missing, or rejects a script.
pub fn submit_slurm_scripts(results: &Path, [array, finish]: &[PathBuf; 2]) -> Result<SlurmJobs> {
    let text = softdock_input::read_text(array, softdock_input::MAX_TEXT)?;
    let tasks = text.lines().find_map(|line| line.strip_prefix("#SBATCH --array=0-")?.parse().ok()).unwrap_or(0) + 1;
    let array = sbatch(&[], array)?;
    let finish = sbatch(&[format!("--dependency=afterany:{array}")], finish)?;
    let jobs = SlurmJobs { array, finish, tasks };
    let text = serde_json::to_string_pretty(&jobs).expect("plain JSON") + "\n";
    write_file(&results.join(SLURM_FOLDER).join(SLURM_FILES[2]), text.as_bytes())?;
    Ok(jobs)
}

/// Submits a script; gives the job's number.
fn sbatch(options: &[String], script: &Path) -> Result<String> {
    let remedy = "run this where the cluster's `sbatch` is, or write the scripts alone: --dry-run";
    let output = Command::new("sbatch").arg("--parsable").args(options).arg(script).output();
    let output = output.map_err(|error| FarmError::refused(format!("sbatch: {error}"), remedy))?;
    let text = String::from_utf8_lossy(&output.stdout);
    if output.status.success() {
        // `JOB` or `JOB;CLUSTER`.
        return Ok(text.trim().split(';').next().unwrap_or_default().to_owned());
    }
    let message = format!("sbatch refuses `{}`: {}", script.display(), String::from_utf8_lossy(&output.stderr).trim());
    Err(FarmError::refused(message, "correct the options: --sbatch OPTION"))
}

/// State of the jobs of a results folder as `squeue` reports it: number of tasks by state. `None` if nothing was
/// submitted, an empty map once the jobs have left the queue.
///
/// # Errors
/// If `squeue` is missing or fails.
pub fn slurm_state(results: &Path) -> Result<Option<(SlurmJobs, BTreeMap<String, u32>)>> {
    let path = results.join(SLURM_FOLDER).join(SLURM_FILES[2]);
    if !path.is_file() {
        return Ok(None);
    }
    let text = softdock_input::read_text(&path, softdock_input::MAX_TEXT)?;
    let jobs: SlurmJobs = serde_json::from_str(&text)
        .map_err(|error| FarmError::refused(format!("{}: {error}", path.display()), "delete the file"))?;
    let both = format!("{},{}", jobs.array, jobs.finish);
    let output = Command::new("squeue").args(["--noheader", "--array", "--format=%T", "--jobs", &both]).output();
    let output =
        output.map_err(|error| FarmError::refused(format!("squeue: {error}"), "ask on a node of the cluster"))?;
    let mut states = BTreeMap::new();
    // Jobs that have left the queue long ago are unknown to it, which is no error here.
    for state in String::from_utf8_lossy(&output.stdout).lines() {
        *states.entry(state.trim().to_lowercase()).or_default() += 1;
    }
    Ok(Some((jobs, states)))
}

/// A path as one word of a shell.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}
