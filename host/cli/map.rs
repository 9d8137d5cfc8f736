//! `softdock map`: the stiffest contact that the delayed loop tolerates, for every compensator.

use crate::args::MapArgs;
use crate::words::{Exit, say};
use miette::IntoDiagnostic;
use softdock_analysis::{MapCurve, map_page, map_text};
use softdock_engine::map::{LimitCurve, stability_map};

/// Finds the limits, prints them and draws the page.
pub(crate) fn map(args: &MapArgs) -> miette::Result<Exit> {
    let (mass, delay) = (args.mass_kg, 1e-3 * args.delay_ms);
    let shown =
        |LimitCurve { name, linear, energy, closed }| MapCurve { name: String::from(name), linear, energy, closed };
    let curves: Vec<MapCurve> =
        stability_map(mass, delay, if args.quick { 3 } else { 1 }).into_iter().map(shown).collect();
    let unit = mass / (delay * delay);
    say(map_text(&curves, unit));
    if let Some(path) = &args.out {
        let heading = format!(
            "Two bodies of reduced mass {mass} kg, ideal robots, {} ms of dead time: k h\u{b2}/m = 1 is {unit:.4e} N/m. \
             Compensators know delay, stiffness and damping exactly.",
            args.delay_ms
        );
        std::fs::write(path, map_page(&heading, &curves).into_diagnostic()?).into_diagnostic()?;
        say(format!("map: {}", path.display()));
    }
    Ok(Exit::Done)
}
