//! `softdock identify robot`: a robot's model from its recorded motions, or a motion worth recording.

use crate::args::{Identify, IdentifyArgs, RobotArgs, default_results};
use crate::reports::{diagnosis_failed, listed, paths, write};
use crate::words::{Exit, explain, json, say};
use softdock_analysis::number::significant;
use softdock_campaign::Robot;
use softdock_diagnosis::identify::excitation::{DesignOptions, design};
use softdock_diagnosis::identify::files::{identification_files, motion_files};
use softdock_diagnosis::identify::motion::Preparation;
use softdock_diagnosis::identify::published_errors::read_published_errors;
use softdock_diagnosis::identify::report::terminal;
use softdock_diagnosis::identify::{IdentificationOptions, identify as identify_robot};
use softdock_diagnosis::result_files::FiguresAndFiles;

/// Identifies what is asked.
pub(crate) fn identify(args: &IdentifyArgs) -> miette::Result<Exit> {
    let Identify::Robot(args) = &args.what;
    let prior = Robot::load(&args.model).map_err(explain)?;
    if args.design { motion(args, &prior) } else { robot(args, &prior) }
}

fn robot(args: &RobotArgs, prior: &Robot) -> miette::Result<Exit> {
    let preparation = Preparation { cutoff: args.cutoff, period: args.period };
    let options = IdentificationOptions { preparation, lambda: args.weight, ..IdentificationOptions::default() };
    let marks = args.marks.as_ref().map_or(Ok(Vec::new()), |path| read_published_errors(path, prior.joints.len()));
    let marks = marks.map_err(diagnosis_failed)?;
    let found =
        identify_robot(prior, &paths(&args.logs), &paths(&args.validate), &options).map_err(diagnosis_failed)?;
    let work = identification_files(&found, &marks, &args.command()).map_err(diagnosis_failed)?;
    finish(args, &format!("identify_{}", prior.id), &work, &terminal(&found, &marks))
}

fn motion(args: &RobotArgs, robot: &Robot) -> miette::Result<Exit> {
    let mut options = DesignOptions { seed: args.seed, ..DesignOptions::default() };
    options.period = args.period.unwrap_or(options.period);
    let motion = design(robot, &options).map_err(diagnosis_failed)?;
    let work = motion_files(robot, &motion, &args.design_command(options.period)).map_err(diagnosis_failed)?;
    let used = 100.0 * motion.uses.greatest();
    let (own, random) = (significant(motion.condition, 3), significant(motion.random_condition, 3));
    let text = format!(
        "condition number {own}, {random} for a random motion inside the limits\n\
         greatest use of a limit {used:.0} %"
    );
    finish(args, &format!("motion_{}", robot.id), &work, &text)
}

/// Writes the files and prints the answer.
fn finish(args: &RobotArgs, name: &str, work: &FiguresAndFiles, text: &str) -> miette::Result<Exit> {
    let folder = args.out.clone().unwrap_or_else(|| default_results(name));
    let written = write(&folder, &work.files)?;
    say(if args.json { json(&work.figures) } else { format!("{text}\n\n{}", listed(&written)) });
    Ok(Exit::Done)
}
