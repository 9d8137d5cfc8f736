//! Result files of an identification and of a designed motion.

use crate::excitation::Excitation;
use crate::published_errors::PublishedErrors;
use crate::{Identification, Result};
use crate::{motion_page, report};
use softdock_analysis::PageOrigin;
use softdock_campaign::Robot;
use softdock_diagnosis::report::result_files::{FiguresAndFiles, readable};
use softdock_results::ResultFile;

/// Time between set points of a designed motion \[s\]: the stock interface of an industrial robot.
const SET_POINTS: f64 = 0.004;

/// Returns robot model, page and figures of an identification.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn identification_files(
    found: &Identification,
    marks: &[PublishedErrors],
    origin: &PageOrigin,
) -> Result<FiguresAndFiles> {
    let remarks = [
        format!("{}, identified by softdock {}", found.prior.title, origin.version),
        origin.command.to_owned(),
        "A robot model. Parameters that no motion excites stay near their a-priori values.".to_owned(),
    ];
    let figures = report::summary(found, marks);
    let files = vec![
        ResultFile::new("robot.toml", found.robot.to_toml(&remarks)),
        ResultFile::new("identify.html", report::page(found, marks, origin)?),
        ResultFile::new("identify.json", readable(&figures)),
    ];
    Ok(FiguresAndFiles { figures, files })
}

/// Returns set points, page and figures of a designed motion.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn motion_files(robot: &Robot, motion: &Excitation, origin: &PageOrigin) -> Result<FiguresAndFiles> {
    let figures = motion_page::summary(robot, motion);
    let files = vec![
        ResultFile::new("motion.csv", motion_page::csv(robot, motion, SET_POINTS)),
        ResultFile::new("motion.html", motion_page::page(robot, motion, origin)?),
        ResultFile::new("motion.json", readable(&figures)),
    ];
    Ok(FiguresAndFiles { figures, files })
}
