//! Rates and metrics of several facilities along one parameter, a line for each.

use crate::Result;
use crate::compare::{Band, ComparedVariant, MapAxis as Cut, Spread};
use crate::exact::Share;
use crate::moments::sorted_quantile;
use crate::number::{axis_label, shown_in};
use crate::plots::Drawing;
use crate::plots::axis::{Axis, Scale};
use crate::plots::figure::{Figure, Size, colour};

/// Ratio of large to typical sizes beyond which an axis of both signs is logarithmic far from zero.
const WIDE: f64 = 50.0;

/// The colour of a variant.
pub(crate) fn colour_of(variant: usize) -> plotters::style::RGBColor {
    colour::VARIANTS[variant % colour::VARIANTS.len()]
}

/// Share of wrong verdicts, of those that are given, against the parameter.
pub(crate) fn wrong_figure(cut: &Cut, variants: &[ComparedVariant]) -> Result<Drawing> {
    let caption = "False passes and false fails together, of the verdicts that are given in each band, with 95 % \
        Clopper-Pearson bands.";
    rate_figure(cut, variants, "wrong verdicts", caption, |band| &band.wrong.share)
}

/// Share of aborted sessions against the parameter.
pub(crate) fn aborted_figure(cut: &Cut, variants: &[ComparedVariant]) -> Result<Drawing> {
    let caption = "Aborted sessions, of the valid runs in each band, with 95 % Clopper-Pearson bands.";
    rate_figure(cut, variants, "aborted sessions", caption, |band| &band.aborted)
}

fn rate_figure(
    cut: &Cut,
    variants: &[ComparedVariant],
    what: &str,
    caption: &str,
    pick: fn(&Band) -> &Share,
) -> Result<Drawing> {
    let (x, factor) = along(cut);
    let y = Axis::linear(format!("share of {what}"), 0.0, 1.0);
    let mut figure = Figure::new(format!("{what} against {}", cut.parameter), Size::Wide, x.clone(), y);
    for (index, variant) in variants.iter().enumerate() {
        let place = |band: &Band| factor * x.middle((band.lo, band.hi));
        let seen = || variant.bands.iter().filter(|band| pick(band).cases > 0);
        let band = seen().map(|band| (place(band), pick(band).interval.lo, pick(band).interval.hi));
        let share = |band: &Band| pick(band).count as f64 / pick(band).cases as f64;
        let line: Vec<_> = seen().map(|band| (place(band), share(band))).collect();
        figure = figure
            .band(&band.collect::<Vec<_>>(), colour_of(index), 0.08)
            .line(line.clone(), colour_of(index), 1.8)
            .points(line, colour_of(index), 2.8, 1.0);
    }
    Ok(Drawing { svg: figure.svg()?, caption: caption.to_owned() })
}

/// Median of a metric against the parameter; `None` if nothing has it.
pub(crate) fn metric_figure(cut: &Cut, variants: &[ComparedVariant], metric: usize) -> Result<Option<Drawing>> {
    let spreads = || variants.iter().flat_map(|variant| variant.bands.iter().map(|band| &band.metrics[metric]));
    let Some(first) = spreads().find(|spread| spread.median.is_some()) else { return Ok(None) };
    let (x, factor) = along(cut);
    let y = value_axis(&axis_label(&first.metric.replace('_', " "), first.unit), spreads());
    let wide = matches!(y.scale, Scale::SymLog(_));
    let mut figure = Figure::new(format!("{} against {}", first.metric, cut.parameter), Size::Half, x.clone(), y);
    for (index, variant) in variants.iter().enumerate() {
        let bands = variant.bands.iter();
        let median: Vec<(f64, f64)> = bands
            .filter_map(|band| Some((factor * x.middle((band.lo, band.hi)), band.metrics[metric].median?)))
            .collect();
        figure = figure.line(median.clone(), colour_of(index), 1.6).points(median, colour_of(index), 2.4, 1.0);
    }
    let mut caption = format!("Median of {} on the facility in each band.", first.metric.replace('_', " "));
    if wide {
        caption.push_str(" The axis is linear around zero and logarithmic far from it.");
    }
    Ok(Some(Drawing { svg: figure.svg()?, caption }))
}

/// The parameter's axis in the unit in which it is shown, and the factor to that unit.
fn along(cut: &Cut) -> (Axis, f64) {
    let (lo, hi) = (cut.edges[0], cut.edges[cut.edges.len() - 1]);
    let (factor, unit) = shown_in(cut.unit, hi);
    let logarithmic = lo > 0.0 && hi / lo >= 5.0;
    (Axis::scaled(axis_label(&cut.parameter.replace('_', " "), unit), factor * lo, factor * hi, logarithmic), factor)
}

/// Around all medians: logarithmic for positive values of several decades, symmetric-logarithmic for both signs.
fn value_axis<'a>(label: &str, spreads: impl Iterator<Item = &'a Spread>) -> Axis {
    let mut values: Vec<f64> = spreads.filter_map(|spread| spread.median).collect();
    values.sort_by(f64::total_cmp);
    let (lo, hi) = (values[0], values[values.len() - 1]);
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).filter(|size| *size > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sorted_quantile(&sizes, 0.5);
    if lo < 0.0 && typical > 0.0 && lo.abs().max(hi.abs()) > WIDE * typical {
        let size = 10.0f64.powf(typical.log10().floor());
        let end = |value: f64| if value.abs() > size { 1.3 * value } else { value };
        return Axis {
            lo: end(lo.min(0.0)),
            hi: end(hi.max(size)),
            scale: Scale::SymLog(size),
            label: label.to_owned(),
        };
    }
    let axis = Axis::fitting(label, lo, hi);
    if axis.scale == Scale::Log { Axis { lo: lo / 1.2, hi: hi * 1.2, ..axis } } else { axis.padded(0.06) }
}
