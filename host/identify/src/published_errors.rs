//! Published relative errors for the same recordings, for comparison, read from CSV.

use crate::{DiagnosisError, Result};
use serde::Serialize;
use std::path::Path;

/// Relative errors of another method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PublishedErrors {
    /// Name of the method.
    pub name: String,
    /// Relative error of each joint in per cent.
    pub percent: Vec<f64>,
}

/// Reads published errors: a header, then one line per method with a name and one percentage per joint.
pub fn read_published_errors(path: &Path, joints: usize) -> Result<Vec<PublishedErrors>> {
    let text = softdock_input::read_text(path, softdock_input::MAX_TEXT).map_err(DiagnosisError::input)?;
    let rows = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
    let mark = |(number, line): (usize, &str)| {
        let (name, numbers) = line.split_once(',').unwrap_or((line, ""));
        let percent: Vec<f64> = numbers.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
        if percent.len() == joints {
            return Ok(PublishedErrors { name: name.trim().trim_matches('"').to_owned(), percent });
        }
        let what = format!("{} percentages for {joints} joints", percent.len());
        Err(DiagnosisError::log(
            path,
            Some(number + 1),
            what,
            "write a name and one percentage per joint: mark,1,2,...",
        ))
    };
    rows.map(mark).collect()
}
