//! Histogram and empirical distribution of a requirement's margin, both loops over one another.

use crate::Result;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};
use crate::plots::{Drawing, axis_label, sorted_quantile};

/// Bars of a histogram.
const BARS: usize = 48;

/// Points of an empirical distribution on the page.
const STEPS: usize = 400;

/// Share of the margins cut off at each end, so that one wild run does not flatten the rest.
const CUT: f64 = 0.005;

/// The two figures, or `None` if there are no margins or they take only one or two values.
pub(crate) fn margin_figures(id: &str, unit: &str, margins: &[Vec<Option<f64>>; 2]) -> Result<Option<[Drawing; 2]>> {
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
        svg: distribution(id, axis, &sorted)?,
        caption: "Empirical distribution of the margin: share of the runs with at most this margin.".to_owned(),
    };
    Ok(Some([histogram, distribution]))
}

fn sorted(margins: &[Option<f64>]) -> Vec<f64> {
    let mut values: Vec<f64> = margins.iter().flatten().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The range that both loops' margins fill, without the outermost; `None` for verdicts in disguise.
fn range(sorted: &[Vec<f64>; 2]) -> Option<(f64, f64)> {
    let filled: Vec<&Vec<f64>> = sorted.iter().filter(|values| !values.is_empty()).collect();
    let lo = filled.iter().map(|values| sorted_quantile(values, CUT)).reduce(f64::min)?;
    let hi = filled.iter().map(|values| sorted_quantile(values, 1.0 - CUT)).reduce(f64::max)?;
    let mut distinct: Vec<f64> = filled.into_iter().flatten().copied().collect();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    (distinct.len() > 2).then_some((lo, hi))
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
        .limit(0.0, "limit")
        .svg()
}

fn distribution(id: &str, axis: Axis, sorted: &[Vec<f64>; 2]) -> Result<String> {
    let curve = |values: &[f64]| -> Vec<(f64, f64)> {
        let at = |step: usize| {
            let x = axis.lo + (axis.hi - axis.lo) * step as f64 / STEPS as f64;
            (x, values.partition_point(|value| *value <= x) as f64 / values.len().max(1) as f64)
        };
        (0..=STEPS).map(at).collect()
    };
    let [space, facility] = sorted.each_ref().map(|values| curve(values));
    let y = Axis::linear("share of runs", 0.0, 1.0);
    Figure::new(format!("Distribution of the margin of {id}"), Size::Half, axis.clone(), y)
        .line(space, colour::SPACE, 1.8)
        .line(facility, colour::FACILITY, 1.8)
        .limit(0.0, "limit")
        .svg()
}
