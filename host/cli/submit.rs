//! `softdock submit`: a campaign as an array job of a cluster.

use crate::args::SubmitArgs;
use crate::farm::called;
use crate::progress::Terminal;
use crate::words::{Exit, say};
use miette::IntoDiagnostic;
use softdock_farm::{
    Selection, SlurmOptions, default_results, load_campaign, submit_slurm_scripts, write_slurm_scripts,
};

/// Writes the scripts of the jobs and submits them.
pub(crate) fn submit(args: &SubmitArgs) -> miette::Result<Exit> {
    let terminal = Terminal::new();
    let selection = Selection { runs: args.runs, seed: args.seed, ..Selection::default() };
    let campaign = called(load_campaign(&args.campaign, &selection, terminal.context()))?;
    let results = args.out.clone().unwrap_or_else(|| default_results(&campaign.id));
    let options = SlurmOptions {
        program: std::env::current_exe().into_diagnostic()?,
        backend: args.backend.word(),
        tasks: args.tasks,
        grace_s: args.grace,
        sbatch: args.sbatch.clone(),
        finish_sbatch: args.finish_sbatch.clone(),
    };
    let scripts = called(write_slurm_scripts(campaign, &results, &options, terminal.context()))?;
    let shown = results.display();
    if args.dry_run {
        scripts.iter().for_each(|script| say(script.display()));
        return Ok(Exit::Done);
    }
    let jobs = called(submit_slurm_scripts(&results, &scripts))?;
    say(format!(
        "job {}: {} tasks make the runs; job {} judges them\nfollow it:  softdock status {shown}",
        jobs.array, jobs.tasks, jobs.finish
    ));
    Ok(Exit::Done)
}
