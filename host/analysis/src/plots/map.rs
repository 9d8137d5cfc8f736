//! Stability map: limits of the contact stiffness in a delayed loop over its damping, with closed-form curves.

use serde::Serialize;

use crate::Result;
use crate::plots::axis::{Axis, Scale};
use crate::plots::figure::{Figure, Size, colour};
use crate::templates::{PageOrigin, render_page};

/// The limits of one compensator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapCurve {
    /// Compensator.
    pub name: String,
    /// Linear limit found: b/(k h) and k h^2/m.
    pub linear: Vec<(f64, f64)>,
    /// Energy limit found.
    pub energy: Vec<(f64, f64)>,
    /// Linear limit in closed form.
    pub closed: Vec<(f64, f64)>,
}

/// Values of the template.
#[derive(Serialize)]
struct Page {
    mass: String,
    delay: String,
    unit: String,
    figures: Vec<(String, String)>,
    rows: Vec<LimitRow>,
}

/// A limit at one damping.
#[derive(Serialize)]
struct LimitRow {
    name: String,
    limit: &'static str,
    damping: String,
    stiffness: String,
    /// The limit in closed form; a dash where there is none.
    closed: String,
    newton_per_metre: String,
}

/// Renders a page with one figure per compensator.
///
/// # Errors
/// If a figure cannot be drawn.
pub fn map_page(mass_kg: f64, delay_ms: f64, curves: &[MapCurve], origin: &PageOrigin) -> Result<String> {
    let unit = mass_kg / (1e-3 * delay_ms).powi(2);
    let page = Page {
        mass: mass_kg.to_string(),
        delay: delay_ms.to_string(),
        unit: format!("{unit:.4e}"),
        figures: curves.iter().map(|curve| Ok((curve.name.clone(), figure(curve)?))).collect::<Result<_>>()?,
        rows: rows(curves, unit),
    };
    render_page("map.html", include_str!("../page/map.html"), origin, &page)
}

fn rows(curves: &[MapCurve], unit: f64) -> Vec<LimitRow> {
    let mut all = Vec::new();
    for curve in curves {
        for (limit, points) in [("linear", &curve.linear), ("energy", &curve.energy)] {
            for (ratio, kappa) in points {
                let near = curve.closed.iter().find(|c| limit == "linear" && (c.0 - ratio).abs() < 5e-3);
                all.push(LimitRow {
                    name: curve.name.clone(),
                    limit,
                    damping: format!("{ratio:.2}"),
                    stiffness: format!("{kappa:.4}"),
                    closed: near.map_or("-".to_owned(), |c| format!("{:.4}", c.1)),
                    newton_per_metre: format!("{:.3e}", kappa * unit),
                });
            }
        }
    }
    all
}

/// The limits as a table; `unit` is the stiffness \[N/m\] at k h^2/m = 1.
pub fn map_text(curves: &[MapCurve], unit: f64) -> String {
    let mut out = String::from("compensator          b/(k h)  limit   k h^2/m     closed   k [N/m]\n");
    for row in rows(curves, unit) {
        let LimitRow { name, limit, damping, stiffness, closed, newton_per_metre } = row;
        out += &format!("{name:<20} {damping:>7}  {limit} {stiffness:>9} {closed:>10} {newton_per_metre:>10}\n");
    }
    out
}

fn figure(curve: &MapCurve) -> Result<String> {
    let x = Axis::linear("damping b/(k h)", 0.0, 4.0);
    let y = Axis { scale: Scale::Log, ..Axis::linear("stiffness k h\u{b2}/m", 4e-3, 4.0) };
    Figure::new(format!("stability map, {}", curve.name), Size::Half, x, y)
        .line(curve.closed.clone(), colour::SPACE, 1.4)
        .line(curve.energy.clone(), colour::FACILITY, 1.0)
        .points(curve.linear.clone(), colour::SPACE, 2.6, 1.0)
        .points(curve.energy.clone(), colour::FACILITY, 2.6, 1.0)
        .svg()
}
