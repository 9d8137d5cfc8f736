//! Relative errors that are known for a pair of recordings, to stand beside one's own: a small CSV.

use crate::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// Errors that somebody else reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// By what.
    pub name: String,
    /// Relative error of each joint in per cent.
    pub percent: Vec<f64>,
}

/// Reads marks: a header, then one line each of a name and one percentage per joint.
pub fn read_marks(path: &Path, joints: usize) -> Result<Vec<Mark>> {
    let text = softdock_input::read_text(path, softdock_input::MAX_TEXT).map_err(Error::input)?;
    let rows = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
    let mark = |(number, line): (usize, &str)| {
        let (name, numbers) = line.split_once(',').unwrap_or((line, ""));
        let percent: Vec<f64> = numbers.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
        if percent.len() == joints {
            return Ok(Mark { name: name.trim().trim_matches('"').to_owned(), percent });
        }
        let what = format!("{} percentages for {joints} joints", percent.len());
        Err(Error::log(path, Some(number + 1), what, "write a name and one percentage per joint: mark,1,2,..."))
    };
    rows.map(mark).collect()
}
