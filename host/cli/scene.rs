//! The nominal start of a campaign as a drawing.

use crate::words::{refuse, warn};
use softdock_analysis::scene_svg;
use softdock_campaign::Campaign;
use softdock_campaign::overlap::without_robots;
use std::fs;
use std::path::Path;

/// Draws the nominal start into an SVG file; variants of the facility share it.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn draw_scene(campaign: &Campaign, path: &Path) -> miette::Result<()> {
    let scenario = &campaign.scenario;
    let heading = format!("{}: {}, nominal start", scenario.id, scenario.title);
    let svg = scene_svg(&heading, &without_robots(&scenario.model), &campaign.nominal());
    fs::write(path, svg).map_err(|error| {
        refuse(format!("`{}` cannot be written: {error}", path.display()), "name a file in a folder that exists")
    })?;
    warn(format!("scene  {}", path.display()));
    Ok(())
}
