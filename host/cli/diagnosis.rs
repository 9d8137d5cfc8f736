//! `softdock identify` and `diagnose`: models from recordings, and the causes of their deviations.

use crate::progress::Terminal;
use crate::terminal::{Exit, Failure, Format, Outcome, warn, write};
use crate::values::{named, positive, share_below_one};
use clap::{Args, Subcommand};
use serde_json::json;
use softdock_campaign::{Rig, Robot};
use softdock_diagnosis::data::hold_out::Every;
use softdock_diagnosis::data::quality;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions};
use softdock_diagnosis::model::isolability;
use softdock_diagnosis::propose::experiment::ProposedExperiment;
use softdock_diagnosis::report::command_line::CommandLine;
use softdock_diagnosis::report::result_files::FiguresAndFiles;
use softdock_diagnosis::report::signals_text::signals_text;
use softdock_diagnosis::report::summary::{DiagnosisSummary, identifiability};
use softdock_diagnosis::subject::{DiagnosedModel, EXTENDED};
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_diagnosis::verdict::judged::Judged;
use softdock_engine::simulator::Simulator;
use softdock_engine::{Choice, EngineError};
use softdock_farm::{Context, FarmError, ModelComparison, default_results, device_failure, page_origin};
use softdock_identify::contact::identification::{ContactOptions, identify_contact};
use softdock_identify::contact::law::FittedLaw;
use softdock_identify::contact::report::{contact_files, terminal as contact_text};
use softdock_identify::excitation::{DesignOptions, design};
use softdock_identify::files::{identification_files, motion_files};
use softdock_identify::motion::Preparation;
use softdock_identify::published_errors::read_published_errors;
use softdock_identify::{IdentificationOptions, identify as identify_robot, report};
use softdock_session::rehearsal::rehearse_runs;
use std::path::{Path, PathBuf};

/// Identify a robot or a contact from recordings, or design a motion that excites a robot's parameters.
#[derive(Args, Debug)]
pub(crate) struct IdentifyArgs {
    /// System to identify.
    #[command(subcommand)]
    system: Identify,
}

/// Systems that can be identified.
#[derive(Debug, Subcommand)]
enum Identify {
    Robot(Box<RobotArgs>),
    Contact(ContactArgs),
}

/// Identify links, rotors and friction of an industrial robot.
#[derive(Args, Debug)]
#[command(after_help = "\
Recordings are CSV or Parquet; the model file's [log] names their columns. DIR gets the identified model, the page and
the figures as JSON.

Examples:
  softdock identify robot campaigns/models/kr300_r2500.toml traj_A.csv --validate traj_B.csv --out results/kr300
  softdock identify robot campaigns/models/kr300_r2500.toml --design --out results/kr300_motion")]
struct RobotArgs {
    /// Robot model file: the a-priori model.
    model: PathBuf,
    /// Recordings to fit.
    #[arg(value_name = "LOG", required_unless_present = "design", conflicts_with = "design")]
    logs: Vec<PathBuf>,
    /// Held-out recordings: predicted, not fitted.
    #[arg(long, value_name = "LOG", num_args = 1.., conflicts_with = "design")]
    validate: Vec<PathBuf>,
    /// Published errors for comparison: a CSV with a name and one percentage per joint in each line.
    #[arg(long, value_name = "FILE", conflicts_with = "design")]
    marks: Option<PathBuf>,
    /// Results folder; `results/identify_ID` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Low-pass of positions and torques, or highest frequency of the Fourier series, in Hz.
    #[arg(long, value_name = "HERTZ", default_value_t = 10.0, value_parser = positive)]
    cutoff: f64,
    /// Period of a periodic motion in seconds: its periods are averaged and differentiated as a Fourier series. With
    /// --design, the period of the motion.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    period: Option<f64>,
    /// Weight of the a-priori model; chosen by cross-validation if not given.
    #[arg(long, value_name = "WEIGHT", value_parser = positive)]
    weight: Option<f64>,
    /// Design a motion inside all limits that makes the parameters identifiable, instead of identifying.
    #[arg(long)]
    design: bool,
    /// Seed of the design.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "design")]
    seed: u64,
}

/// Identify stiffness, damping, exponent, restitution and friction of a contact.
#[derive(Args, Debug)]
#[command(after_help = "\
The rig file states what is recorded. Kind \"contact\": presses and impacts, with columns for time, position.z (or depth, with
scale = -1) and force.z, optionally for rate.z and for lateral positions and forces. Kind \"toss\": poses of a body that is
thrown onto a plane. Recordings are CSV or Parquet; [log] of the rig file names their columns.

DIR gets contact.toml (a [contact] table for a scenario file), identify.html and identification.json. A parameter that the
data do not determine has no value; a required key without a value is \"fill in\", which every reader rejects.

Exit codes: 0 answered, whatever is determined; 2 bad input.

Examples:
  softdock identify contact campaigns/rigs/plate_press.toml --data press_1.csv press_2.csv --hold-out 0.3
  softdock identify contact campaigns/rigs/cube_toss.toml --data tosses.csv --hold-out 0.5 --out results/cube")]
struct ContactArgs {
    /// Rig file of kind \"contact\" or \"toss\".
    rig: PathBuf,
    /// Recordings.
    #[arg(long, value_name = "LOG", num_args = 1.., required = true)]
    data: Vec<PathBuf>,
    /// Share of the touches or tosses that is held out of the fit, evenly spread; 0 for none.
    #[arg(long, value_name = "SHARE", default_value_t = 0.25, value_parser = share_below_one)]
    hold_out: f64,
    /// Law of the normal force; the one with the least information criterion if not given. Not for tosses.
    #[arg(long, value_name = "LAW", value_parser = named(&LAWS))]
    law: Option<FittedLaw>,
    /// Seed of the start values.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Results folder; `results/identify_ID` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Laws that can be identified.
const LAWS: [(&str, &str, FittedLaw); 3] = [
    ("linear", "F = K d + b d'", FittedLaw::Linear),
    ("power", "F = K d^n (1 + a d')", FittedLaw::Power),
    ("rebound", "F = K d^n (1 + D d'/v), the same restitution at every speed v of approach", FittedLaw::Rebound),
];

pub(crate) fn identify(args: &IdentifyArgs, format: &Format) -> Outcome {
    match &args.system {
        Identify::Robot(args) => identify_links(args, format),
        Identify::Contact(args) => identify_law(args, format),
    }
}

fn identify_law(args: &ContactArgs, format: &Format) -> Outcome {
    let rig = Rig::load(&args.rig)?;
    let options = ContactOptions { hold_out: args.hold_out, law: args.law, seed: args.seed };
    let terminal = Terminal::new("identify contact");
    let found = identify_contact(&rig, &paths(&args.data), &options)?;
    terminal.end();
    let command = CommandLine::new("identify contact", std::slice::from_ref(&args.rig)).files("data", &args.data);
    let command = command.option("hold-out", Some(args.hold_out)).option("law", args.law.map(FittedLaw::word));
    let work = contact_files(&found, &page_origin(&command.option("seed", Some(args.seed)).text()))?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("identify_{}", rig.id)));
    let written = write(&folder, &work.files)?;
    format.print(|| work.figures, || format!("{}\n\n{written}", contact_text(&found)));
    Ok(Exit::Done)
}

fn identify_links(args: &RobotArgs, format: &Format) -> Outcome {
    let prior = Robot::load(&args.model)?;
    let terminal = Terminal::new("identify robot");
    let (name, work, text) = if args.design { design_motion(args, &prior)? } else { fit_robot(args, &prior)? };
    terminal.end();
    let folder = args.out.clone().unwrap_or_else(|| default_results(&name));
    let written = write(&folder, &work.files)?;
    format.print(|| work.figures, || format!("{text}\n\n{written}"));
    Ok(Exit::Done)
}

fn fit_robot(args: &RobotArgs, prior: &Robot) -> Result<(String, FiguresAndFiles, String), Failure> {
    let preparation = Preparation { cutoff: args.cutoff, period: args.period };
    let options = IdentificationOptions { preparation, lambda: args.weight, ..IdentificationOptions::default() };
    let marks = args.marks.as_ref().map_or(Ok(Vec::new()), |path| read_published_errors(path, prior.joints.len()))?;
    let identified = identify_robot(prior, &paths(&args.logs), &paths(&args.validate), &options)?;
    let command = CommandLine::new("identify robot", std::slice::from_ref(&args.model)).more(&args.logs);
    let command = command.files("validate", &args.validate).file("marks", args.marks.as_deref());
    let command = command.option("cutoff", Some(args.cutoff)).option("period", args.period);
    let work = identification_files(&identified, &marks, &page_origin(&command.option("weight", args.weight).text()))?;
    Ok((format!("identify_{}", prior.id), work, report::terminal(&identified, &marks)))
}

fn design_motion(args: &RobotArgs, robot: &Robot) -> Result<(String, FiguresAndFiles, String), Failure> {
    let mut options = DesignOptions { seed: args.seed, ..DesignOptions::default() };
    options.period = args.period.unwrap_or(options.period);
    let motion = design(robot, &options)?;
    let command = CommandLine::new("identify robot", std::slice::from_ref(&args.model)).flag("design", true);
    let command = command.option("period", Some(options.period)).option("seed", Some(args.seed));
    let work = motion_files(robot, &motion, &page_origin(&command.text()))?;
    Ok((format!("motion_{}", robot.id), work, motion.text()))
}

/// Diagnose from recordings the causes of a model's errors, and the gain of correcting them.
#[derive(Args, Debug)]
#[command(after_help = "\
Recordings are CSV or Parquet; the model file's [log] names their columns. Files that share a name up to the last
underscore (sine_1.csv, sine_2.csv) are repeats of one command. An answer that can be signed needs three repeats of each
command and another, held-out motion; otherwise it is reported as provisional. DIR gets the page, the figures as JSON,
the extended model where causes are named, and the discriminating experiment where causes are confounded: a path for a
joint (experiment.csv), the run of its campaign to drive next for a facility (experiment.toml).

Exit codes: 0 answered, whatever the answer; 2 bad input.

Examples:
  softdock diagnose model.toml training/*.csv --holdout validation/*.csv --out results/joint
  softdock diagnose model.toml recording.csv --hold-out-from 6.21
  softdock diagnose model.toml tosses.csv --hold-out-experiments 4:1
  softdock diagnose campaigns/probe_drogue.toml logs/*/log.parquet --compare campaigns/probe_drogue.toml
  softdock diagnose --signals")]
pub(crate) struct DiagnoseArgs {
    /// Model file of the rig, with its uncertainties. Of a whole facility: the scenario that it follows, or the campaign
    /// whose runs were driven.
    #[arg(required_unless_present = "signals")]
    model: Option<PathBuf>,
    /// Recordings to fit.
    #[arg(value_name = "LOG", required_unless_present = "signals")]
    logs: Vec<PathBuf>,
    /// Held-out recordings of another motion, for validation.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Hold out each recording from this time on, in seconds of its own clock.
    #[arg(long, value_name = "SECONDS", conflicts_with = "holdout")]
    hold_out_from: Option<f64>,
    /// Hold out the experiments whose number modulo EVERY is REST: 4:1 holds out 1, 5, 9 and so on.
    #[arg(long, value_name = "EVERY:REST", conflicts_with_all = ["holdout", "hold_out_from"])]
    hold_out_experiments: Option<Every>,
    /// Exclude a cause of the catalogue from the library; may be given several times.
    #[arg(long, value_name = "ID")]
    without: Vec<String>,
    /// Simulate with half the step size, to check that the answer does not depend on it.
    #[arg(long)]
    half_step: bool,
    /// Backend that simulates.
    #[arg(long, value_name = "BACKEND", value_parser = named(&Choice::NAMED), default_value = "cpu")]
    backend: Choice,
    /// Campaign whose verdicts with the given and with the extended model are compared; for whole facilities.
    #[arg(long, value_name = "CAMPAIGN")]
    compare: Option<PathBuf>,
    /// Runs of that comparison, in place of the campaign's.
    #[arg(long, value_name = "N", requires = "compare", value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    compare_runs: Option<u64>,
    /// Facility file on which the runs of a campaign are rehearsed to propose the next drive.
    #[arg(long, value_name = "FILE", default_value = "campaigns/facilities/reference.toml")]
    facility: PathBuf,
    /// Results folder; `results/diagnose_ID` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the kinds of plants with the names of their signals, and diagnose nothing.
    #[arg(long, conflicts_with_all = ["model", "logs"])]
    signals: bool,
}

/// Returns the command that repeats the diagnosis.
fn repeat_command(args: &DiagnoseArgs, model: &PathBuf) -> String {
    let command = CommandLine::new("diagnose", std::slice::from_ref(model)).more(&args.logs);
    let command = command.files("holdout", &args.holdout).option("hold-out-from", args.hold_out_from);
    let command = command.option("hold-out-experiments", args.hold_out_experiments);
    let command = command.flag("half-step", args.half_step);
    args.without.iter().fold(command, |command, id| command.option("without", Some(id))).text()
}

pub(crate) fn diagnose(args: &DiagnoseArgs, format: &Format) -> Outcome {
    let Some(file) = args.model.as_ref().filter(|_| !args.signals) else {
        format.print(|| json!({ "text": signals_text() }), signals_text);
        return Ok(Exit::Done);
    };
    let options = DiagnosisOptions {
        hold_out_from: args.hold_out_from,
        hold_out_experiments: args.hold_out_experiments,
        without: args.without.clone(),
        half_step: args.half_step,
        simulator: Simulator::open(args.backend, warn_of_lanes).map_err(FarmError::from)?,
    };
    let terminal = Terminal::new("diagnose");
    let model = DiagnosedModel::load(file)?;
    let mut prepared = model.prepare(&paths(&args.logs), &paths(&args.holdout), &options)?;
    // Printed before the long computation: the causes that these channels can isolate.
    for line in quality::lines(&prepared.data_quality) {
        warn(format!("Data quality of {line}"));
    }
    warn(isolability::text(&prepared.isolability));
    warn(identifiability::text(prepared.identifiability()));
    let (mut diagnosis, judged) = prepared.diagnose()?;
    if model.campaign().is_some() && diagnosis.answer == DiagnosisVerdict::Ambiguous {
        // A missing facility file must not discard the answer.
        diagnosis.proposed = proposed(&model, &args.facility, &diagnosis, &judged).unwrap_or_else(|error| {
            warn(format!("no run is proposed to drive next: {error}; name the facility file with --facility"));
            None
        });
    }
    let command = repeat_command(args, file);
    let origin = page_origin(&command);
    let mut work = model.files(&diagnosis, &judged, &origin)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("diagnose_{}", model.id())));
    let written = write(&folder, &work.files)?;
    let comparison = compared(args, &folder, work.files.iter().any(|file| file.name == EXTENDED), terminal.context())?;
    if let Some(comparison) = &comparison {
        work.figures["comparison"] = comparison.json();
        write(&folder, &[model.page(&diagnosis, &judged, &origin, Some(&comparison.text()))?])?;
    }
    terminal.end();
    let comparison = comparison.map_or_else(String::new, |comparison| comparison.text() + "\n");
    format.print(|| work.figures, || format!("{}\n\n{comparison}{written}", DiagnosisSummary::of(&diagnosis).text()));
    Ok(Exit::Done)
}

/// Proposes the run to drive next, among those that a rehearsal at the facility completes.
fn proposed(
    model: &DiagnosedModel,
    facility: &Path,
    diagnosis: &Diagnosis,
    judged: &[Judged],
) -> Result<Option<ProposedExperiment>, Failure> {
    let Some(campaign) = model.campaign() else { return Ok(None) };
    let folder = tempfile::tempdir().map_err(Failure::of)?;
    let rehearsed = rehearse_runs(campaign, facility, folder.path())?;
    let logs: Vec<(u64, &Path)> = rehearsed.iter().map(|rehearsed| (rehearsed.run, rehearsed.log.as_path())).collect();
    Ok(model.next_drive(diagnosis, judged, &logs)?)
}

/// Warns that CPU lanes simulate from now on, and why.
fn warn_of_lanes(error: &EngineError) {
    warn(format!("{}; CPU lanes simulate the rest", device_failure(error)));
}

/// Compares the verdicts of the campaign of --compare with and without the extended model, if there is one.
fn compared(
    args: &DiagnoseArgs,
    folder: &Path,
    is_extended: bool,
    context: Context,
) -> Result<Option<ModelComparison>, Failure> {
    let Some(campaign) = &args.compare else { return Ok(None) };
    if !is_extended {
        warn("no comparison: no identified effect changes a verdict");
        return Ok(None);
    }
    Ok(Some(ModelComparison::of(campaign, &folder.join(EXTENDED), args.compare_runs, context)?))
}

fn paths(paths: &[PathBuf]) -> Vec<&Path> {
    paths.iter().map(PathBuf::as_path).collect()
}
