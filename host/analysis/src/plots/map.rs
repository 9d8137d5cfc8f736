//! Stability map: limits of the contact stiffness in a delayed loop over its damping, with closed-form curves.

use crate::Result;
use crate::plots::axis::{Axis, Scale};
use crate::plots::figure::{Figure, Size, colour};

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

/// Renders a page with one figure per compensator; `heading` states mass and delay.
///
/// # Errors
/// If a figure cannot be drawn.
pub fn map_page(mass_kg: f64, delay_ms: f64, curves: &[MapCurve]) -> Result<String> {
    let unit = mass_kg / (1e-3 * delay_ms).powi(2);
    let heading = format!(
        "Two bodies of reduced mass {mass_kg} kg, ideal robots, {delay_ms} ms of dead time: k h\u{b2}/m = 1 is {unit:.4e} \
         N/m. Compensators know delay, stiffness and damping exactly."
    );
    let mut figures = String::new();
    for curve in curves {
        figures.push_str(&format!("<figure><figcaption>{}</figcaption>{}</figure>\n", curve.name, figure(curve)?));
    }
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Stability map</title></head>\n\
         <body style=\"font-family:sans-serif;max-width:1020px;margin:2em auto\"><h1>Stability map</h1>\n<p>{heading}</p>\n\
         <p>Blue dots: the linear limit, found through the loop; blue line: the same in closed form. Orange: the energy \
         limit, e = 1 without adhesion. Below its curve a contact is within the limit; a curve that is missing was not \
         met between the softest and the stiffest contact.</p>\n\
         <div style=\"display:flex;flex-wrap:wrap;gap:12px\">\n{figures}</div></body></html>\n"
    ))
}

/// The limits as a table; `unit` is the stiffness \[N/m\] at k h^2/m = 1.
pub fn map_text(curves: &[MapCurve], unit: f64) -> String {
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
