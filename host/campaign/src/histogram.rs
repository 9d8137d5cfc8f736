//! What a campaign draws, as text: a histogram of every dispersed and derived input, and the effects in play.

use crate::campaign::Campaign;
use crate::dispersion::Class;
use crate::problem::Problems;
use crate::units::show;
use std::fmt::Write;

/// Classes of a histogram.
const BARS: usize = 32;

/// Heights of a bar, in eighths.
const HEIGHTS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Histograms of the inputs of `n` runs (at least one) spread over the campaign, with mean, deviation and ends.
///
/// # Errors
/// See [`Campaign::draw`].
pub fn histograms(campaign: &Campaign, n: u64) -> Result<String, Problems> {
    let runs = n.clamp(1, campaign.runs.max(1));
    // Spread, so that every outer draw is met.
    let run = |index: u64| (u128::from(index) * u128::from(campaign.runs) / u128::from(runs)) as u64;
    let draws = (0..runs).map(|index| Ok(campaign.draw(run(index))?.inputs()));
    let draws: Vec<Vec<f64>> = draws.collect::<Result<_, Problems>>()?;
    let mut text = format!("inputs of {runs} of {} runs, seed {}\n", campaign.runs, campaign.seed);
    for dispersion in &campaign.dispersions {
        let Some(place) = campaign.input_place(dispersion.field) else { continue };
        let class = match dispersion.class {
            Class::Aleatory => "",
            Class::Epistemic => ", epistemic",
        };
        let source = dispersion.source.as_deref().unwrap_or("no source stated");
        let what = format!("{}{class}; {source}", dispersion.distribution.kind());
        row(&mut text, &dispersion.name, dispersion.unit, &what, &column(&draws, place));
    }
    let variables = campaign.dispersions.iter().filter(|variable| campaign.input_place(variable.field).is_none());
    for variable in variables {
        let _ = writeln!(text, "\n  {}  (variable, {})", variable.name, variable.distribution.kind());
    }
    for derived in &campaign.derived {
        row(&mut text, &derived.name, derived.unit, &format!("= {}", derived.text), &column(&draws, derived.field));
    }
    effects(&mut text, campaign);
    Ok(text)
}

fn column(draws: &[Vec<f64>], field: usize) -> Vec<f64> {
    draws.iter().map(|draw| draw[field]).collect()
}

fn row(text: &mut String, name: &str, unit: &str, what: &str, values: &[f64]) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
    let (min, max) = ends(values);
    let number = |value: f64| show(round(value), unit);
    // Orders of magnitude are seen on a logarithmic axis.
    let wide = min > 0.0 && max > 8.0 * min;
    let axis = if wide { "|  logarithmic axis" } else { "|" };
    let scaled = |value: f64| if wide { value.ln() } else { value };
    let shown: Vec<f64> = values.iter().map(|value| scaled(*value)).collect();
    let _ = writeln!(text, "\n  {name}  ({what})\n    |{}{axis}", bars(&shown, scaled(min), scaled(max)));
    let _ = writeln!(
        text,
        "    min {}   mean {}   sd {}   max {}",
        number(min),
        number(mean),
        number(deviation),
        number(max)
    );
}

fn ends(values: &[f64]) -> (f64, f64) {
    let min = values.iter().copied().fold(f64::INFINITY, f64::min);
    (min, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

/// Four significant digits.
fn round(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn bars(values: &[f64], min: f64, max: f64) -> String {
    let width = (max - min) / BARS as f64;
    let mut counts = [0_usize; BARS];
    for value in values {
        let bar = if width > 0.0 { ((value - min) / width) as usize } else { BARS / 2 };
        counts[bar.min(BARS - 1)] += 1;
    }
    let highest = counts.iter().copied().max().unwrap_or(1).max(1);
    // A bar that holds anything shows.
    counts.iter().map(|count| HEIGHTS[(count * 8).div_ceil(highest)]).collect()
}

/// The rows of the effect table that differ from their null value in at least one run.
fn effects(text: &mut String, campaign: &Campaign) {
    let active: Vec<String> =
        campaign.effects().iter().map(|effect| format!("  {}  {}", effect.id, effect.words())).collect();
    let heading = if active.is_empty() { "\neffects on the facility: none" } else { "\neffects on the facility" };
    let _ = writeln!(text, "{heading}");
    for line in active {
        let _ = writeln!(text, "{line}");
    }
}
