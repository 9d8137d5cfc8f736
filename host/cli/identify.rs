//! `softdock identify robot`: a robot's model from its recorded motions, or a motion worth recording.

use crate::args::{Identify, IdentifyArgs, RobotArgs, default_results};
use crate::found::{file_name, file_names, listed, paths, told, write};
use crate::words::{Exit, explain, json, say};
use softdock_analysis::number::significant;
use softdock_campaign::Robot;
use softdock_diagnosis::identify::Options;
use softdock_diagnosis::identify::excitation::{self, DesignOptions};
use softdock_diagnosis::identify::marks::read_marks;
use softdock_diagnosis::identify::motion::Preparation;
use softdock_diagnosis::identify::motion_page;
use softdock_diagnosis::identify::report::{page, summary, terminal};

/// Identifies what is asked.
pub(crate) fn identify(args: &IdentifyArgs) -> miette::Result<Exit> {
    let Identify::Robot(args) = &args.what;
    robot(args)
}

fn robot(args: &RobotArgs) -> miette::Result<Exit> {
    let prior = Robot::load(&args.model).map_err(explain)?;
    if args.design {
        return design(args, &prior);
    }
    let preparation = Preparation { cutoff: args.cutoff, period: args.period };
    let options = Options { preparation, lambda: args.weight, ..Options::default() };
    let marks =
        args.marks.as_ref().map_or(Ok(Vec::new()), |path| read_marks(path, prior.joints.len())).map_err(told)?;
    let found = softdock_diagnosis::identify::identify(&prior, &paths(&args.logs), &paths(&args.validate), &options)
        .map_err(told)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("identify_{}", prior.id)));
    let remarks = [
        format!("{}, identified by softdock {}", prior.title, env!("CARGO_PKG_VERSION")),
        command(args),
        "A robot model: what no motion showed stands near its a-priori value.".to_owned(),
    ];
    let figures = summary(&found, &marks);
    let files = [
        ("robot.toml", found.robot.to_toml(&remarks)),
        ("identify.html", page(&found, &marks, &command(args)).map_err(told)?),
        ("identify.json", json(&figures) + "\n"),
    ];
    write(&folder, &files)?;
    if args.json {
        say(json(&figures));
    } else {
        say(format!("{}\n\n{}", terminal(&found, &marks), listed(&folder, &files)));
    }
    Ok(Exit::Done)
}

/// Time between set points of a designed motion \[s\]: the stock interface of an industrial robot.
const SET_POINTS: f64 = 0.004;

fn design(args: &RobotArgs, robot: &Robot) -> miette::Result<Exit> {
    let mut options = DesignOptions { seed: args.seed, ..DesignOptions::default() };
    options.period = args.period.unwrap_or(options.period);
    let motion = excitation::design(robot, &options).map_err(told)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("motion_{}", robot.id)));
    let figures = motion_page::summary(robot, &motion);
    let files = [
        ("motion.csv", motion_page::csv(robot, &motion, SET_POINTS)),
        ("motion.html", motion_page::page(robot, &motion, &design_command(args, &options)).map_err(told)?),
        ("motion.json", json(&figures) + "\n"),
    ];
    write(&folder, &files)?;
    if args.json {
        say(json(&figures));
    } else {
        let used = 100.0 * motion.uses.greatest();
        let (own, random) = (significant(motion.condition, 3), significant(motion.random_condition, 3));
        say(format!(
            "condition number {own}, {random} for a random motion inside the limits\n\
             greatest use of a limit {used:.0} %\n\n{}",
            listed(&folder, &files)
        ));
    }
    Ok(Exit::Done)
}

fn design_command(args: &RobotArgs, options: &DesignOptions) -> String {
    let name = file_name(&args.model);
    format!("softdock identify robot {name} --design --period {} --seed {}", options.period, options.seed)
}

/// The command that repeats the work, with file names alone: no path of the machine stands in a result.
fn command(args: &RobotArgs) -> String {
    let mut text = format!("softdock identify robot {}{}", file_name(&args.model), file_names(&args.logs));
    if !args.validate.is_empty() {
        text += &format!(" --validate{}", file_names(&args.validate));
    }
    text += &args.marks.as_ref().map_or_else(String::new, |path| format!(" --marks {}", file_name(path)));
    text += &format!(" --cutoff {}", args.cutoff);
    text += &args.period.map_or_else(String::new, |period| format!(" --period {period}"));
    text + &args.weight.map_or_else(String::new, |weight| format!(" --weight {weight}"))
}
