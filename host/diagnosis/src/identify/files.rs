//! The files of an identification and of a designed motion, with the figures for programs.

use crate::Result;
use crate::identify::Identification;
use crate::identify::excitation::Excitation;
use crate::identify::marks::Mark;
use crate::identify::{motion_page, report};
use crate::result_files::{FiguresAndFiles, readable};
use softdock_campaign::Robot;
use softdock_results::ResultFile;

/// Time between set points of a designed motion \[s\]: the stock interface of an industrial robot.
const SET_POINTS: f64 = 0.004;

/// Robot model, page and figures of an identification that `command` has made.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn identification_files(found: &Identification, marks: &[Mark], command: &str) -> Result<FiguresAndFiles> {
    let remarks = [
        format!("{}, identified by softdock {}", found.prior.title, env!("CARGO_PKG_VERSION")),
        command.to_owned(),
        "A robot model: what no motion showed stands near its a-priori value.".to_owned(),
    ];
    let figures = report::summary(found, marks);
    let files = vec![
        ResultFile::new("robot.toml", found.robot.to_toml(&remarks)),
        ResultFile::new("identify.html", report::page(found, marks, command)?),
        ResultFile::new("identify.json", readable(&figures)),
    ];
    Ok(FiguresAndFiles { figures, files })
}

/// Set points, page and figures of a motion that `command` has designed.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn motion_files(robot: &Robot, motion: &Excitation, command: &str) -> Result<FiguresAndFiles> {
    let figures = motion_page::summary(robot, motion);
    let files = vec![
        ResultFile::new("motion.csv", motion_page::csv(robot, motion, SET_POINTS)),
        ResultFile::new("motion.html", motion_page::page(robot, motion, command)?),
        ResultFile::new("motion.json", readable(&figures)),
    ];
    Ok(FiguresAndFiles { figures, files })
}
