//! The nominal start of a campaign as a drawing.

use crate::error::{FarmError, Result};
use softdock_analysis::scene_svg;
use softdock_campaign::Campaign;
use softdock_campaign::overlap::without_robots;
use softdock_results::write_file;
use std::path::Path;

/// Draws the nominal start into an SVG file; variants of the facility share it.
///
/// # Errors
/// If the file cannot be written.
pub fn draw_nominal_start(campaign: &Campaign, path: &Path) -> Result<()> {
    let scenario = &campaign.scenario;
    let heading = format!("{}: {}, nominal start", scenario.id, scenario.title);
    let svg = scene_svg(&heading, &without_robots(&scenario.model), &campaign.nominal());
    write_file(path, svg.as_bytes()).map_err(|error| FarmError::refused(error, "name a file that can be written"))
}
