//! Energy injected by the facility against the loop delay, coloured by agreement.

use softdock_results::runs::Agreement;

use crate::Result;
use crate::moments::sorted_quantile;
use crate::plots::Drawing;
use crate::plots::axis::{Axis, Scale};
use crate::plots::figure::{Figure, Size, colour};
use crate::plots::sample::Sample;

/// Dots of one kind, at most: the page stays small, and rare kinds stay visible.
const MOST_DOTS: usize = 1_500;

/// Ratio of large to typical energies beyond which the axis is logarithmic far from zero.
const WIDE: f64 = 50.0;

/// The kinds of runs, frequent ones first so that rare ones lie on top.
const KINDS: [(Agreement, plotters::style::RGBColor); 6] = [
    (Agreement::AbortedPass, colour::ABORTED),
    (Agreement::AbortedFail, colour::ABORTED),
    (Agreement::TruePass, colour::TRUE_PASS),
    (Agreement::TrueFail, colour::TRUE_FAIL),
    (Agreement::FalseFail, colour::FALSE_FAIL),
    (Agreement::FalsePass, colour::FALSE_PASS),
];

/// The figure, or `None` if no run has both numbers.
pub(crate) fn energy_figure(sample: &Sample) -> Result<Option<Drawing>> {
    let dots: Vec<(Agreement, f64, f64)> = (0..sample.runs())
        .filter_map(|row| Some((sample.agreement[row], sample.delay[row], sample.injected_energy[row]?)))
        .filter(|(_, delay, _)| delay.is_finite())
        .collect();
    let Some(y) = energy_axis(&dots) else { return Ok(None) };
    let wide = y.scale != Scale::Linear;
    let delays = dots.iter().map(|(_, delay, _)| 1.0e3 * delay);
    let (lo, hi) = delays.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), delay| (lo.min(delay), hi.max(delay)));
    let x = Axis::linear("loop delay [ms]", lo, hi).padded(0.02);
    let mut figure = Figure::new("Energy injected by the facility against loop delay", Size::Wide, x, y);
    let mut thinned = false;
    for (kind, colour) in KINDS {
        let all: Vec<(f64, f64)> = dots
            .iter()
            .filter(|(agreement, ..)| *agreement == kind)
            .map(|(_, delay, energy)| (1.0e3 * delay, *energy))
            .collect();
        let stride = all.len().div_ceil(MOST_DOTS).max(1);
        thinned |= stride > 1;
        figure = figure.points(all.into_iter().step_by(stride).collect(), colour, 1.9, 0.75);
    }
    let mut caption = "Each dot is a run: the energy that the facility has put into the simulated contact \
        (space port minus hardware port)."
        .to_owned();
    if wide {
        caption.push_str(" The energy axis is linear around zero and logarithmic far from it.");
    }
    if thinned {
        caption.push_str(&format!(" At most {MOST_DOTS} runs of each colour are drawn."));
    }
    Ok(Some(Drawing { svg: figure.svg()?, caption }))
}

/// Linear if the energies are of one size, else linear around zero and logarithmic far from it.
fn energy_axis(dots: &[(Agreement, f64, f64)]) -> Option<Axis> {
    let mut energies: Vec<f64> = dots.iter().map(|(.., energy)| *energy).collect();
    energies.sort_by(f64::total_cmp);
    let (lo, hi) = (*energies.first()?, *energies.last()?);
    let axis = Axis::linear("injected energy [J]", lo.min(0.0), hi.max(0.0)).padded(0.03);
    let mut sizes: Vec<f64> = energies.iter().map(|energy| energy.abs()).filter(|size| *size > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sorted_quantile(&sizes, 0.5);
    let wide = typical > 0.0 && lo.abs().max(hi.abs()) > WIDE * typical;
    let size = 10.0f64.powf(typical.max(f64::MIN_POSITIVE).log10().floor());
    Some(if wide {
        Axis { lo: 1.3 * lo.min(0.0), hi: 1.3 * hi.max(size), scale: Scale::SymLog(size), ..axis }
    } else {
        axis
    })
}
