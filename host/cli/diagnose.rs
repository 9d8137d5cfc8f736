//! `softdock diagnose`: what a model gets wrong, by recordings of the real thing.

use crate::args::{DiagnoseArgs, default_results};
use crate::compare_models::Comparison;
use crate::farm::failed;
use crate::found::{file_name, file_names, listed, paths, told, write};
use crate::reports::session_failed;
use crate::run::unusable;
use crate::words::{Exit, explain, json, say, warn};
use miette::IntoDiagnostic;
use softdock_campaign::rig::{
    BODY_SIGNALS, COMMAND_SIGNALS, CONTACT_SIGNALS, DRIVE_SIGNALS, SENSOR_SIGNALS, TOSS_SIGNALS,
};
use softdock_campaign::{Campaign, FileKind, Rig, Scenario};
use softdock_diagnosis::answer::Verdict;
use softdock_diagnosis::block::facility::FacilityModel;
use softdock_diagnosis::diagnosis::{Diagnosis, Judged, Options, prepare, prepare_facility};
use softdock_diagnosis::experiment::Experiment;
use softdock_diagnosis::{diagnosis_page, extend, isolability, next_drive, outside, words};
use softdock_engine::EngineError;
use softdock_engine::simulator::Simulator;
use softdock_session::rehearsal::rehearse_runs;
use std::path::Path;

/// Diagnoses a rig.
pub(crate) fn diagnose(args: &DiagnoseArgs) -> miette::Result<Exit> {
    let Some(model) = args.model.as_ref().filter(|_| !args.signals) else {
        say(signals());
        return Ok(Exit::Done);
    };
    let options = Options {
        hold_out_from: args.hold_out_from,
        hold_out_experiments: args.hold_out_experiments,
        without: args.without.clone(),
        half_step: args.half_step,
        simulator: Simulator::open(args.backend.choice(), tell_lanes).map_err(unusable)?,
    };
    let (logs, holdout) = (paths(&args.logs), paths(&args.holdout));
    let whole = facility(model)?;
    let (title, id, (text, beside), prepared) = match &whole {
        Some(facility) => {
            let scenario = facility.scenario();
            let prepared = prepare_facility(facility.clone(), &logs, &holdout, &options);
            (scenario.title.clone(), scenario.id.clone(), scenario.gathered(), prepared)
        }
        None => {
            let rig = Rig::load(model).map_err(explain)?;
            let gathered = rig.gathered();
            (rig.title.clone(), rig.id.clone(), gathered, prepare(rig, &logs, &holdout, &options))
        }
    };
    let prepared = prepared.map_err(told)?;
    // Before any number: what these channels can show at all.
    warn(isolability::text(&prepared.isolability));
    let (mut diagnosis, judged) = prepared.diagnose().map_err(told)?;
    let campaign = whole.as_ref().and_then(FacilityModel::campaign);
    if let Some(campaign) = campaign.filter(|_| diagnosis.answer == Verdict::Ambiguous) {
        // The answer is there already, and must not be lost for want of a facility file.
        diagnosis.proposed = proposed(campaign, &args.facility, &diagnosis, &judged).unwrap_or_else(|error| {
            warn(format!("no run is proposed to drive next: {error}; name the facility file with --facility"));
            None
        });
    }
    let command = command(args, model);
    let mut figures = serde_json::to_value(&diagnosis).into_diagnostic()?;
    let mut files = vec![
        ("diagnosis.html", diagnosis_page::page(&title, &diagnosis, &judged, &command).map_err(told)?),
        ("diagnosis.json", json(&figures) + "\n"),
    ];
    if let Some(text) = extend::extended(&text, &diagnosis, whole.is_some()) {
        files.push((EXTENDED, text));
        files.extend(beside.iter().map(|(name, text)| (name.as_str(), text.clone())));
    }
    files.extend(diagnosis.proposed.as_ref().map(|experiment| {
        let asked = experiment.run.zip(campaign).map(|(run, campaign)| {
            let why = format!("{} Made by `{command}`.", words::headline(&diagnosis));
            campaign.experiment_text(&why, run, experiment.repeats)
        });
        (experiment.file(), asked.unwrap_or_else(|| experiment.csv()))
    }));
    let outside = judged.iter().filter_map(|judged| judged.outside.as_ref());
    files.extend(outside::table(outside).map(|text| ("missing_torque.csv", text)));
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("diagnose_{id}")));
    write(&folder, &files)?;
    let comparison = compared(args, &folder, files.iter().any(|file| file.0 == EXTENDED))?;
    if let (Some(comparison), true) = (&comparison, args.json) {
        figures["comparison"] = comparison.json();
    }
    if args.json {
        say(json(&figures));
    } else {
        let comparison = comparison.map_or_else(String::new, |comparison| comparison.text() + "\n");
        say(format!("{}\n\n{comparison}{}", words::text(&diagnosis), listed(&folder, &files)));
    }
    Ok(Exit::Done)
}

/// The run to drive next, if an answer to drives of a campaign is ambiguous: of those that a rehearsal at the station
/// completes.
fn proposed(
    campaign: &Campaign,
    station: &Path,
    diagnosis: &Diagnosis,
    judged: &[Judged],
) -> miette::Result<Option<Experiment>> {
    let folder = tempfile::tempdir().into_diagnostic()?;
    let rehearsed = rehearse_runs(campaign, station, folder.path()).map_err(session_failed)?;
    let logs: Vec<(u64, &Path)> = rehearsed.iter().map(|rehearsed| (rehearsed.run, rehearsed.log.as_path())).collect();
    let model = FacilityModel::Campaign(Box::new(campaign.clone()));
    next_drive(&model, diagnosis, judged, &logs).map_err(told)
}

/// Says that CPU lanes simulate from now on, and why.
fn tell_lanes(error: &EngineError) {
    warn(format!("{}; CPU lanes simulate the rest", failed(error)));
}

/// The extended model in the results folder.
const EXTENDED: &str = "extended.toml";

/// How the verdicts of a campaign change with what was found, if that was asked for and there is anything.
fn compared(args: &DiagnoseArgs, folder: &Path, found: bool) -> miette::Result<Option<Comparison>> {
    match &args.compare {
        Some(campaign) if found => Comparison::of(campaign, &folder.join(EXTENDED), args.compare_runs).map(Some),
        Some(_) => {
            warn("nothing was found that would change a verdict: no comparison".to_owned());
            Ok(None)
        }
        None => Ok(None),
    }
}

/// The facility that a scenario or campaign file describes; `None` for a rig's model file.
fn facility(model: &Path) -> miette::Result<Option<FacilityModel>> {
    Ok(match softdock_campaign::kind(model).map_err(explain)? {
        FileKind::Campaign => Some(FacilityModel::Campaign(Box::new(Campaign::load(model).map_err(explain)?))),
        FileKind::Scenario => Some(FacilityModel::Scenario(Box::new(Scenario::load(model).map_err(explain)?))),
        FileKind::Other => None,
    })
}

/// Plant kinds and their signals, one a line.
fn signals() -> String {
    let mut out = String::from("drive: one joint with its drive, turning or sliding\n");
    let either = |(name, turning, sliding, meaning): &(&str, &str, &str, &str)| {
        let unit = if turning == sliding { (*turning).to_owned() } else { format!("{turning} or {sliding}") };
        signal(name, &unit, meaning)
    };
    DRIVE_SIGNALS.iter().for_each(|row| out += &either(row));
    out += "\nrobot: axis by axis; in the [log] of the robot's own model file, r1. before and the axis' number behind a name\n";
    let named = |name: &str| if name == "t" { name.to_owned() } else { format!("r1.{name}.1") };
    softdock_campaign::robot::SIGNALS
        .iter()
        .for_each(|(name, _, unit, meaning)| out += &signal(&named(name), unit, meaning));
    out += "\nsensor: a force/torque sensor under known loads\n";
    SENSOR_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ncontact: one body against a plate\n";
    CONTACT_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ncommand: a command's way from sender to receiver, by its echo or by events\n";
    COMMAND_SIGNALS.iter().for_each(|row| out += &either(row));
    out += "\nbody: a free body under known wrenches\n";
    BODY_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out += "\ntoss: a body tossed onto a plane\n";
    TOSS_SIGNALS.iter().for_each(|(name, unit, meaning)| out += &signal(name, unit, meaning));
    out
}

fn signal(name: &str, unit: &str, meaning: &str) -> String {
    format!("  {name:<20}{unit:<12}{meaning}\n")
}

/// The command that repeats the work, with file names alone: no path of the machine stands in a result.
fn command(args: &DiagnoseArgs, model: &Path) -> String {
    let mut text = format!("softdock diagnose {}{}", file_name(model), file_names(&args.logs));
    if !args.holdout.is_empty() {
        text += &format!(" --holdout{}", file_names(&args.holdout));
    }
    text += &args.hold_out_from.map_or_else(String::new, |from| format!(" --hold-out-from {from}"));
    text += &args.hold_out_experiments.map_or_else(String::new, |every| format!(" --hold-out-experiments {every}"));
    text += if args.half_step { " --half-step" } else { "" };
    text + &args.without.iter().map(|id| format!(" --without {id}")).collect::<String>()
}
