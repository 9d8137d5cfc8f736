//! Histogram and empirical distribution of a requirement's margin, both loops over one another.

use crate::Result;
use crate::moments::sorted_quantile;
use crate::number::axis_label;
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};

/// Bars of a histogram.
const BARS: usize = 48;

/// Points of an empirical distribution on the page.
const STEPS: usize = 400;

/// Share of the margins cut off at each end, so that one wild run does not flatten the rest.
const CUT: f64 = 0.005;

/// Quartile ranges beyond the quartiles at which the axis ends: a facility that diverges in many runs has margins
/// of any size.
const FENCE: f64 = 4.0;

/// The two figures, or `None` if there are no margins or they take only one or two values.
///
/// `tolerance` is the tolerance limit in space.
pub(crate) fn margin_figures(
    id: &str,
    unit: &str,
    margins: &[Vec<Option<f64>>; 2],
    tolerance: Option<f64>,
) -> Result<Option<[Drawing; 2]>> {
    let sorted = [sorted(&margins[0]), sorted(&margins[1])];
    let Some((lo, hi)) = range(&sorted) else { return Ok(None) };
    let axis = Axis::linear(axis_label(&format!("margin of {id}"), unit), lo.min(0.0), hi.max(0.0)).padded(0.03);
    let beyond: usize = sorted.iter().flatten().filter(|margin| !axis.contains(**margin)).count();
    let missing: usize = margins.iter().flatten().filter(|margin| margin.is_none()).count();
    let mut note = String::new();
    if beyond > 0 {
        note.push_str(&format!(" {beyond} margins lie beyond the axis."));
    }
    if missing > 0 {
        note.push_str(&format!(" {missing} have no margin (metric not available, or run invalid)."));
    }
    let histogram = Drawing {
        svg: histogram(id, axis.clone(), &sorted)?,
        caption: format!("Histogram of the margin; right of the limit the requirement holds.{note}"),
    };
    let distribution = Drawing {
        svg: distribution(id, axis, &sorted, margins.each_ref().map(Vec::len), tolerance)?,
        caption: "Empirical distribution: share of the runs with at most this margin; a run without a margin lies \
            below every margin. At the limit the curves read the shares of failed runs."
            .to_owned(),
    };
    Ok(Some([histogram, distribution]))
}

fn sorted(margins: &[Option<f64>]) -> Vec<f64> {
    let mut values: Vec<f64> = margins.iter().flatten().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The range that both loops' margins fill, without outliers; `None` for verdicts in disguise.
fn range(sorted: &[Vec<f64>; 2]) -> Option<(f64, f64)> {
    let filled: Vec<&Vec<f64>> = sorted.iter().filter(|values| !values.is_empty()).collect();
    let ranges = filled.iter().map(|values| range_of(values));
    let (lo, hi) = ranges.reduce(|one, two| (one.0.min(two.0), one.1.max(two.1)))?;
    let mut distinct: Vec<f64> = filled.into_iter().flatten().copied().collect();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    (distinct.len() > 2).then_some((lo, hi))
}

/// The range of one loop: a share is cut off at the ends, and whatever lies beyond the fences.
fn range_of(sorted: &[f64]) -> (f64, f64) {
    let [first, third] = [0.25, 0.75].map(|share| sorted_quantile(sorted, share));
    let fence = if third > first { FENCE * (third - first) } else { f64::INFINITY };
    (sorted_quantile(sorted, CUT).max(first - fence), sorted_quantile(sorted, 1.0 - CUT).min(third + fence))
}

fn histogram(id: &str, axis: Axis, sorted: &[Vec<f64>; 2]) -> Result<String> {
    let width = (axis.hi - axis.lo) / BARS as f64;
    let edge = |bar: usize| axis.lo + bar as f64 * width;
    let counts = sorted.each_ref().map(|values| {
        let mut counts = vec![0.0; BARS];
        for value in values.iter().filter(|value| axis.contains(**value)) {
            let bar = ((value - axis.lo) / width) as usize;
            counts[bar.min(BARS - 1)] += 1.0;
        }
        counts
    });
    let highest = counts.iter().flatten().copied().fold(1.0, f64::max);
    let bars = (0..BARS).map(|bar| (edge(bar), edge(bar + 1), counts[0][bar])).collect();
    let outline = (0..BARS).flat_map(|bar| [(edge(bar), counts[1][bar]), (edge(bar + 1), counts[1][bar])]).collect();
    let y = Axis::linear("runs", 0.0, 1.08 * highest);
    Figure::new(format!("Histogram of the margin of {id}"), Size::Half, axis, y)
        .bars(bars, colour::SPACE, 0.45)
        .line(outline, colour::FACILITY, 1.6)
        .limit(0.0, "limit", colour::LIMIT, 1.0)
        .svg()
}

fn distribution(
    id: &str,
    axis: Axis,
    sorted: &[Vec<f64>; 2],
    runs: [usize; 2],
    tolerance: Option<f64>,
) -> Result<String> {
    let curve = |values: &[f64], runs: usize| -> Vec<(f64, f64)> {
        let missing = runs - values.len();
        let at = |step: usize| {
            let x = axis.lo + (axis.hi - axis.lo) * step as f64 / STEPS as f64;
            let below = missing + values.partition_point(|value| *value <= x);
            (x, below as f64 / runs.max(1) as f64)
        };
        (0..=STEPS).map(at).collect()
    };
    let [space, facility] = [0, 1].map(|side| curve(&sorted[side], runs[side]));
    let y = Axis::linear("share of runs", 0.0, 1.0);
    let tolerance = tolerance.filter(|margin| axis.contains(*margin));
    let figure = Figure::new(format!("Distribution of the margin of {id}"), Size::Half, axis.clone(), y)
        .line(space, colour::SPACE, 1.8)
        .line(facility, colour::FACILITY, 1.8)
        .limit(0.0, "limit", colour::LIMIT, 1.0);
    match tolerance {
        Some(margin) => figure.limit(margin, "tolerance limit in space", colour::SPACE, 0.85).svg(),
        None => figure.svg(),
    }
}
