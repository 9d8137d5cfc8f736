//! `softdock bench diagnosis`: runs the cases that are missing, then scores all that is there.

use crate::args::{BenchDiagnosisArgs, default_results};
use crate::progress::{listen, stopped};
use crate::reports::{gauntlet_failed, listed, write};
use crate::words::{Exit, json, say, warn};
use softdock_bench::cases::{CaseDone, count_missing, lay_out_case, run_missing, score_files, selected};
use softdock_bench::plan::{Case, Wanted, plan, shard};
use softdock_bench::record::Ledger;
use softdock_bench::score::{GauntletScore, score, scored};
use softdock_bench::{GauntletError, summary_text};
use std::path::Path;

/// Judges the diagnosis.
pub(crate) fn bench_diagnosis(args: &BenchDiagnosisArgs) -> miette::Result<Exit> {
    let wanted = Wanted { extent: args.size.extent(), plants: args.plants.clone(), draws: args.draws };
    let all = plan(&wanted).map_err(gauntlet_failed)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("bench_diagnosis_{}", args.size.word())));
    if let Some(id) = &args.lay_out {
        return lay_out(&all, id, &folder);
    }
    if !args.score {
        run(&all, args, &folder).map_err(gauntlet_failed)?;
    }
    let score = scored(&folder).map(|all| score(&all)).map_err(gauntlet_failed)?;
    report(args, &folder, &score)?;
    let missing = count_missing(&all, &folder).map_err(gauntlet_failed)?;
    if missing > 0 {
        warn(format!("{missing} of {} cases are missing; the same command resumes", all.len()));
        return Ok(Exit::Incomplete);
    }
    Ok(if score.is_met() { Exit::Done } else { Exit::NotVerified })
}

/// Writes a case's model and recordings into a folder, and prints how they are diagnosed.
fn lay_out(all: &[Case], id: &str, folder: &Path) -> miette::Result<Exit> {
    lay_out_case(all, id, folder).map_err(gauntlet_failed)?;
    let shown = folder.display();
    say(format!(
        "{id}; its truth lies in {shown}/sealed\n\n  \
         softdock diagnose {shown}/model.toml {shown}/training/* --holdout {shown}/holdout/*"
    ));
    Ok(Exit::Done)
}

/// Runs the part of the cases that is asked for; nothing of a truth is printed before the score.
fn run(all: &[Case], args: &BenchDiagnosisArgs, folder: &Path) -> Result<(), GauntletError> {
    let (number, of) = (args.shard.index as usize + 1, args.shard.count as usize);
    let own = shard(selected(all, args.only.as_deref().unwrap_or(""), &args.multiples)?, number, of);
    let ledger = Ledger::open(folder, number, of)?;
    listen();
    run_missing(own, &ledger, &stopped, &mut |CaseDone { done, missing, record, seconds_left }| {
        let seconds = record.cost.diagnosis + record.cost.rest;
        let cost = match &record.answer {
            None => "size out of range".to_owned(),
            Some(_) => format!("{seconds:.1} s"),
        };
        warn(format!("{done} of {missing}  {}: {cost}  {seconds_left:.0} s left", record.case));
    })
}

/// Writes the score and prints it.
fn report(args: &BenchDiagnosisArgs, folder: &Path, score: &GauntletScore) -> miette::Result<()> {
    let (figures, files) = score_files(score, &args.command()).map_err(gauntlet_failed)?;
    let written = write(folder, &files)?;
    say(if args.json { json(&figures) } else { format!("{}\n{}", summary_text::text(score), listed(&written)) });
    Ok(())
}
