//! `softdock map`: how stiff a contact the delayed loop bears, for every compensator.

use crate::args::MapArgs;
use crate::words::{Exit, say};
use miette::IntoDiagnostic;
use rayon::prelude::*;
use softdock_analysis::{MapCurve, map_page};
use softdock_engine::map::{Limit, closed_form, stiffest};
use softdock_kernels::model::CompensatorKind;

/// Dampings b/(k h) of the map; the least are met only with a compensator.
const RATIOS: [f64; 16] = [0.02, 0.1, 0.3, 0.6, 0.9, 1.05, 1.1, 1.2, 1.35, 1.55, 1.72, 2.0, 2.2, 2.6, 3.0, 3.8];

/// Finds the limits, prints them and draws the page.
pub(crate) fn map(args: &MapArgs) -> miette::Result<Exit> {
    let (mass, delay) = (args.mass_kg, 1e-3 * args.delay_ms);
    let curves: Vec<MapCurve> = CompensatorKind::NAMES
        .par_iter()
        .map(|(name, kind)| curve(name, *kind, mass, delay, if args.quick { 3 } else { 1 }))
        .collect();
    let unit = mass / (delay * delay);
    say(in_words(&curves, unit));
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

/// Every so many dampings.
fn curve(name: &str, kind: CompensatorKind, mass: f64, delay: f64, every: usize) -> MapCurve {
    let found = |limit| -> Vec<(f64, f64)> {
        let at = |ratio: &f64| Some((*ratio, stiffest(limit, kind, mass, delay, *ratio)?));
        RATIOS.iter().step_by(every).collect::<Vec<_>>().into_par_iter().filter_map(at).collect()
    };
    // Energy observers are not linear: what a contact that never opens does under them is no question of roots.
    let nonlinear = matches!(kind, CompensatorKind::Passivity | CompensatorKind::LeadPassivity);
    let closed = (1..400).map(|i| 0.01 * f64::from(i)).filter_map(|ratio| Some((ratio, closed_form(kind, ratio)?)));
    MapCurve {
        name: name.to_owned(),
        linear: if nonlinear { Vec::new() } else { found(Limit::Linear) },
        energy: found(Limit::Energy),
        closed: closed.filter(|point| point.1 <= 4.0).collect(),
    }
}

fn in_words(curves: &[MapCurve], unit: f64) -> String {
    let mut out = String::from("compensator          b/(k h)  limit   k h^2/m     closed   k [N/m]\n");
    for curve in curves {
        for (limit, points) in [("linear", &curve.linear), ("energy", &curve.energy)] {
            for (ratio, kappa) in points {
                let near = curve.closed.iter().find(|c| limit == "linear" && (c.0 - ratio).abs() < 5e-3);
                let closed = near.map_or("-".to_owned(), |c| format!("{:.4}", c.1));
                out.push_str(&format!(
                    "{:<20} {ratio:>7.2}  {limit} {kappa:>9.4} {closed:>10} {:>10.3e}\n",
                    curve.name,
                    kappa * unit
                ));
            }
        }
    }
    out
}
