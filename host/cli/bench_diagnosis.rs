//! `softdock bench diagnosis`: runs the cases that are missing, then scores all that is there.

use crate::args::{BenchDiagnosisArgs, BenchSize, default_results};
use crate::found::{listed, write};
use crate::progress::{listen, stopped};
use crate::words::{Exit, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_bench::plan::{Case, Extent, Wanted, plan, shard};
use softdock_bench::record::{Ledger, Record, done};
use softdock_bench::score::{Score, score, scored};
use softdock_bench::trial::{Bench, lay_out};
use softdock_bench::{Error, page, words};
use std::path::Path;
use std::time::Instant;

/// Judges the diagnosis.
pub(crate) fn bench_diagnosis(args: &BenchDiagnosisArgs) -> miette::Result<Exit> {
    let extent = if args.size == BenchSize::Ci { Extent::Ci } else { Extent::Full };
    let wanted = Wanted { extent, plants: args.plants.clone(), draws: args.draws };
    let all = plan(&wanted).map_err(told)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("bench_diagnosis_{}", size(args))));
    if let Some(id) = &args.lay_out {
        return one_laid_out(&all, id, &folder);
    }
    if !args.score {
        let (number, of) = (args.shard.index as usize + 1, args.shard.count as usize);
        let own = shard(only(&all, args)?, number, of);
        run_missing(own, &Ledger::open(&folder, number, of).map_err(told)?)?;
    }
    let score = score(&scored(&folder).map_err(told)?);
    leave(args, &folder, &score)?;
    let known = done(&folder).map_err(told)?;
    let missing = all.iter().filter(|case| !known.contains(&case.id())).count();
    if missing > 0 {
        warn(format!("{missing} of {} cases are missing; the same command resumes", all.len()));
        return Ok(Exit::Incomplete);
    }
    Ok(if score.is_met() { Exit::Done } else { Exit::NotVerified })
}

/// The cases whose name and size are asked for.
fn only(all: &[Case], args: &BenchDiagnosisArgs) -> miette::Result<Vec<Case>> {
    let (text, multiples) = (args.only.as_deref().unwrap_or(""), &args.multiples);
    let is_wanted =
        |case: &&Case| case.id().contains(text) && (multiples.is_empty() || multiples.contains(&case.multiple));
    let own: Vec<Case> = all.iter().filter(is_wanted).copied().collect();
    if own.is_empty() {
        let sized = if multiples.is_empty() { "" } else { " and such a multiple" };
        let (all, one) = ("no case of this size and these plants", all[0].id());
        let what = format!("{all} has `{text}` in its name{sized}; one is `{one}`");
        return Err(told(Error::Unknown { what }));
    }
    Ok(own)
}

/// Leaves a case's model and recordings in a folder, and says how they are diagnosed.
fn one_laid_out(all: &[Case], id: &str, folder: &Path) -> miette::Result<Exit> {
    let Some(case) = all.iter().find(|case| case.id() == *id) else {
        let error = Error::Unknown {
            what: format!("no case `{id}` of this size and these plants; another is `{}`", all[0].id()),
        };
        return Err(told(error));
    };
    if !lay_out(case, folder).map_err(told)? {
        let error = Error::Unknown {
            what: format!("no bench can show as much as `{id}` hides; the same of a smaller multiple can be shown"),
        };
        return Err(told(error));
    }
    let shown = folder.display();
    say(format!(
        "{id}; its truth lies in {shown}/sealed\n\n  \
         softdock diagnose {shown}/model.toml {shown}/training/* --holdout {shown}/holdout/*"
    ));
    Ok(Exit::Done)
}

/// Runs the cases that no worker has finished, until they are done or somebody wishes to stop.
fn run_missing(cases: Vec<Case>, ledger: &Ledger) -> miette::Result<()> {
    listen();
    let known = done(ledger.folder()).map_err(told)?;
    let missing: Vec<Case> = cases.into_iter().filter(|case| !known.contains(&case.id())).collect();
    let (mut bench, begin) = (Bench::new(ledger).map_err(told)?, Instant::now());
    for (number, case) in missing.iter().enumerate() {
        if stopped() {
            return Ok(());
        }
        let record = bench.run(case).map_err(told)?;
        let (done, elapsed) = (number + 1, begin.elapsed().as_secs_f64());
        let left = elapsed / done as f64 * (missing.len() - done) as f64;
        warn(format!("{done} of {}  {}  {left:.0} s left", missing.len(), line(&record)));
    }
    Ok(())
}

/// A case that has just been finished; nothing of the truth is told before the score.
fn line(record: &Record) -> String {
    let seconds = record.cost.diagnosis + record.cost.rest;
    match &record.answer {
        None => format!("{}: no bench shows such a size", record.case),
        Some(_) => format!("{}: {seconds:.1} s", record.case),
    }
}

fn size(args: &BenchDiagnosisArgs) -> &'static str {
    if args.size == BenchSize::Ci { "ci" } else { "full" }
}

/// Writes the score and says it.
fn leave(args: &BenchDiagnosisArgs, folder: &Path, score: &Score) -> miette::Result<()> {
    let figures = serde_json::to_value(score).into_diagnostic()?;
    let files =
        [("score.html", page::page(score, &command(args)).map_err(told)?), ("score.json", json(&figures) + "\n")];
    write(folder, &files)?;
    match args.json {
        true => say(json(&figures)),
        false => say(format!("{}\n{}", words::text(score), listed(folder, &files))),
    }
    Ok(())
}

/// The command that repeats the work, without the folder.
fn command(args: &BenchDiagnosisArgs) -> String {
    let mut text = format!("softdock bench diagnosis --size {}", size(args));
    if !args.plants.is_empty() {
        text += &format!(" --plants {}", args.plants.join(","));
    }
    text + &args.draws.map_or_else(String::new, |draws| format!(" --draws {draws}"))
}

/// An error with its remedy.
fn told(error: Error) -> miette::Report {
    refuse(&error, error.remedy())
}
