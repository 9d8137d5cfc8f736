//! Execution of the cases of a plan: selection, missing cases, and a case written for inspection.

use crate::plan::Case;
use crate::record::{CaseRecord, Ledger, done};
use crate::score::GauntletScore;
use crate::trial::{TrialRunner, lay_out};
use crate::{GauntletError, Result, page};
use serde_json::Value;
use softdock_analysis::PageOrigin;
use softdock_results::ResultFile;
use std::path::Path;
use std::time::Instant;

/// Finished case with the progress.
#[derive(Debug)]
pub struct CaseDone<'a> {
    /// Cases done since the start.
    pub done: usize,
    /// Cases that were missing at the start.
    pub missing: usize,
    /// Record of the case.
    pub record: &'a CaseRecord,
    /// Estimate of the time to the end \[s\].
    pub seconds_left: f64,
}

impl CaseDone<'_> {
    /// Returns progress, case, cost and remaining time in one line.
    pub fn text(&self) -> String {
        let Self { done, missing, record, seconds_left } = self;
        let cost = match &record.answer {
            None => "no recording shows such a size".to_owned(),
            Some(_) => format!("{:.1} s", record.cost.diagnosis + record.cost.rest),
        };
        format!("{done} of {missing}  {}: {cost}  {seconds_left:.0} s left", record.case)
    }
}

/// Returns the cases whose name contains `text` and whose size is one of `multiples`; of any size if `multiples` is
/// empty.
///
/// # Errors
/// If there is no such case.
pub fn selected(all: &[Case], text: &str, multiples: &[f64]) -> Result<Vec<Case>> {
    let is_wanted =
        |case: &&Case| case.id().contains(text) && (multiples.is_empty() || multiples.contains(&case.multiple));
    let own: Vec<Case> = all.iter().filter(is_wanted).copied().collect();
    if own.is_empty() {
        let sized = if multiples.is_empty() { "" } else { " and such a multiple" };
        let (all, one) = ("no case of this size and these plants", all[0].id());
        return Err(GauntletError::Unknown { what: format!("{all} has `{text}` in its name{sized}; one is `{one}`") });
    }
    Ok(own)
}

/// Writes model and recordings of a case into a folder, with its sealed truth; returns the command that diagnoses them.
///
/// # Errors
/// If there is no such case, or no bench can show as much as it hides.
pub fn lay_out_case(all: &[Case], id: &str, folder: &Path) -> Result<String> {
    let Some(case) = all.iter().find(|case| case.id() == *id) else {
        let other = all[0].id();
        let what = format!("no case `{id}` of this size and these plants; another is `{other}`");
        return Err(GauntletError::Unknown { what });
    };
    if !lay_out(case, folder)? {
        let what = format!("the size of `{id}` is beyond the range of the generator; use a smaller multiple");
        return Err(GauntletError::Unknown { what });
    }
    let folder = folder.display();
    Ok(format!("softdock diagnose {folder}/model.toml {folder}/training/* --holdout {folder}/holdout/*"))
}

/// Runs the cases that no worker has finished, until they are done or `stopped` holds.
///
/// # Errors
/// If a case cannot be run or recorded.
pub fn run_missing(
    cases: Vec<Case>,
    ledger: &Ledger,
    stopped: &dyn Fn() -> bool,
    report: &mut dyn FnMut(CaseDone),
) -> Result<()> {
    let known = done(ledger.folder())?;
    let missing: Vec<Case> = cases.into_iter().filter(|case| !known.contains(&case.id())).collect();
    let (mut runner, begin) = (TrialRunner::new(ledger)?, Instant::now());
    for (number, case) in missing.iter().enumerate() {
        if stopped() {
            return Ok(());
        }
        let record = runner.run(case)?;
        let (done, elapsed) = (number + 1, begin.elapsed().as_secs_f64());
        let seconds_left = elapsed / done as f64 * (missing.len() - done) as f64;
        report(CaseDone { done, missing: missing.len(), record: &record, seconds_left });
    }
    Ok(())
}

/// Returns the number of cases that no worker has finished.
///
/// # Errors
/// If the records cannot be read.
pub fn count_missing(all: &[Case], folder: &Path) -> Result<usize> {
    let known = done(folder)?;
    Ok(all.iter().filter(|case| !known.contains(&case.id())).count())
}

/// Returns figures and files of a score.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn score_files(score: &GauntletScore, origin: &PageOrigin) -> Result<(Value, Vec<ResultFile>)> {
    let figures = serde_json::to_value(score).expect("a score has string keys");
    let text = serde_json::to_string_pretty(&figures).expect("a value has string keys") + "\n";
    let files = vec![ResultFile::new("score.html", page::page(score, origin)?), ResultFile::new("score.json", text)];
    Ok((figures, files))
}
