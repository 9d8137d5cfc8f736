//! `softdock diagnose`: what a model gets wrong, by recordings of the real thing.

use crate::args::{DiagnoseArgs, default_results};
use crate::farm::called;
use crate::progress::Terminal;
use crate::reports::{diagnosis_failed, listed, paths, session_failed, write};
use crate::words::{Exit, explain, json, say, warn};
use miette::IntoDiagnostic;
use softdock_diagnosis::answer::DiagnosisVerdict;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, Judged};
use softdock_diagnosis::experiment::ProposedExperiment;
use softdock_diagnosis::signals_text::signals_text;
use softdock_diagnosis::subject::{DiagnosedModel, EXTENDED};
use softdock_diagnosis::{answer_text, isolability};
use softdock_engine::EngineError;
use softdock_engine::simulator::Simulator;
use softdock_farm::{FarmError, ModelComparison, device_failure};
use softdock_session::rehearsal::rehearse_runs;
use std::path::Path;

/// Diagnoses a rig or a facility.
pub(crate) fn diagnose(args: &DiagnoseArgs) -> miette::Result<Exit> {
    let Some(file) = args.model.as_ref().filter(|_| !args.signals) else {
        say(signals_text());
        return Ok(Exit::Done);
    };
    let options = DiagnosisOptions {
        hold_out_from: args.hold_out_from,
        hold_out_experiments: args.hold_out_experiments,
        without: args.without.clone(),
        half_step: args.half_step,
        simulator: called(Simulator::open(args.backend.choice(), warn_of_lanes).map_err(FarmError::from))?,
    };
    let model = DiagnosedModel::load(file).map_err(explain)?;
    let prepared = model.prepare(&paths(&args.logs), &paths(&args.holdout), &options).map_err(diagnosis_failed)?;
    // Before any number: what these channels can show at all.
    warn(isolability::text(&prepared.isolability));
    let (mut diagnosis, judged) = prepared.diagnose().map_err(diagnosis_failed)?;
    if model.campaign().is_some() && diagnosis.answer == DiagnosisVerdict::Ambiguous {
        // The answer is there already, and must not be lost for want of a facility file.
        diagnosis.proposed = proposed(&model, &args.facility, &diagnosis, &judged).unwrap_or_else(|error| {
            warn(format!("no run is proposed to drive next: {error}; name the facility file with --facility"));
            None
        });
    }
    let mut work = model.files(&diagnosis, &judged, &args.command(file)).map_err(diagnosis_failed)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("diagnose_{}", model.id())));
    let written = write(&folder, &work.files)?;
    let comparison = compared(args, &folder, work.files.iter().any(|file| file.name == EXTENDED))?;
    if args.json {
        if let Some(comparison) = &comparison {
            work.figures["comparison"] = comparison.json();
        }
        say(json(&work.figures));
    } else {
        let comparison = comparison.map_or_else(String::new, |comparison| comparison.text() + "\n");
        say(format!("{}\n\n{comparison}{}", answer_text::text(&diagnosis), listed(&written)));
    }
    Ok(Exit::Done)
}

/// The run to drive next: of those that a rehearsal at the facility completes.
fn proposed(
    model: &DiagnosedModel,
    facility: &Path,
    diagnosis: &Diagnosis,
    judged: &[Judged],
) -> miette::Result<Option<ProposedExperiment>> {
    let Some(campaign) = model.campaign() else { return Ok(None) };
    let folder = tempfile::tempdir().into_diagnostic()?;
    let rehearsed = rehearse_runs(campaign, facility, folder.path()).map_err(session_failed)?;
    let logs: Vec<(u64, &Path)> = rehearsed.iter().map(|rehearsed| (rehearsed.run, rehearsed.log.as_path())).collect();
    model.next_drive(diagnosis, judged, &logs).map_err(diagnosis_failed)
}

/// Warns that CPU lanes simulate from now on, and why.
fn warn_of_lanes(error: &EngineError) {
    warn(format!("{}; CPU lanes simulate the rest", device_failure(error)));
}

/// How the verdicts of a campaign change with what was found, if that was asked for and there is anything.
fn compared(args: &DiagnoseArgs, folder: &Path, is_extended: bool) -> miette::Result<Option<ModelComparison>> {
    match &args.compare {
        Some(campaign) if is_extended => {
            let (extended, terminal) = (folder.join(EXTENDED), Terminal::new());
            called(ModelComparison::of(campaign, &extended, args.compare_runs, terminal.context())).map(Some)
        }
        Some(_) => {
            warn("nothing was found that would change a verdict: no comparison".to_owned());
            Ok(None)
        }
        None => Ok(None),
    }
}
