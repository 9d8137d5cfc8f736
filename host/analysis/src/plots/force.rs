//! Contact force over time of the kept runs, in space and on the facility.

use softdock_results::traces::{FORCE_SIGNALS, NOMINAL_RUN, Trace};

use crate::Result;
use crate::number::with_unit;
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};

/// Points of a line on the page; between them the extremes are kept.
const MOST_POINTS: usize = 600;

/// Figures on the page, at most.
const MOST_FIGURES: usize = 8;

/// Figures of one kind (worst, random) on the page, at most.
const MOST_OF_A_KIND: usize = 4;

/// Peaks in space beyond which the facility's force leaves the axis: a facility that diverges has no scale.
const HIGHEST: f64 = 6.0;

/// Share of the time of contact that is shown before and after it.
const ROOM: f64 = 0.08;

/// Nominal, then worst, then random runs; runs without a force signal are left out.
pub(crate) fn force_figures(traces: &[Trace]) -> Result<Vec<Drawing>> {
    let of_kind =
        |kind: &'static str| traces.iter().filter(move |trace| trace.kept_as.starts_with(kind)).take(MOST_OF_A_KIND);
    let chosen = ["nominal", "worst", "random"].into_iter().flat_map(of_kind);
    let mut drawings = Vec::new();
    for trace in chosen.take(MOST_FIGURES) {
        drawings.extend(force_figure(trace)?);
    }
    Ok(drawings)
}

fn force_figure(trace: &Trace) -> Result<Option<Drawing>> {
    let [Some(space), Some(facility)] = FORCE_SIGNALS.map(|name| points(trace, name)) else { return Ok(None) };
    let (start, end) = time_of_contact(&space, &facility);
    let [peak, facility_peak] =
        [&space, &facility].map(|points| points.iter().map(|point| point.1).fold(0.0, f64::max));
    let leaves = peak > 0.0 && facility_peak > HIGHEST * peak;
    let highest = if leaves { HIGHEST * peak } else { facility_peak.max(peak) };
    let name = match trace.run {
        NOMINAL_RUN => "Nominal case".to_owned(),
        run => format!("Run {run}"),
    };
    let shown =
        |points: Vec<(f64, f64)>| thinned(points.into_iter().filter(|(t, _)| (start..=end).contains(t)).collect());
    let x = Axis::linear("time [s]", start, end);
    let y = Axis::linear("contact force [N]", 0.0, if highest > 0.0 { 1.08 * highest } else { 1.0 });
    let svg = Figure::new(format!("Contact force, {name}"), Size::Half, x, y)
        .line(shown(facility), colour::FACILITY, 1.3)
        .line(shown(space), colour::SPACE, 1.3)
        .svg()?;
    let kept = if trace.kept_as == "nominal" { String::new() } else { format!(" ({})", trace.kept_as) };
    let note = if leaves {
        format!(" The facility's force leaves the axis; its peak is {}.", with_unit(facility_peak, "N"))
    } else {
        String::new()
    };
    Ok(Some(Drawing { svg, caption: format!("{name}{kept}.{note}") }))
}

fn points(trace: &Trace, signal: &str) -> Option<Vec<(f64, f64)>> {
    let values = trace.signal(signal)?;
    Some(trace.time.iter().zip(values).filter_map(|(time, value)| Some((*time, (*value)?))).collect())
}

/// First to last contact in either loop, with some room; the whole trace without contact.
fn time_of_contact(space: &[(f64, f64)], facility: &[(f64, f64)]) -> (f64, f64) {
    let all = || space.iter().chain(facility);
    let touching = all().filter(|(_, force)| *force > 0.0);
    let span = |(lo, hi): (f64, f64), (time, _): &(f64, f64)| (lo.min(*time), hi.max(*time));
    let (start, end) = touching.fold((f64::INFINITY, f64::NEG_INFINITY), span);
    let (first, last) = all().fold((f64::INFINITY, f64::NEG_INFINITY), span);
    if start < end {
        let room = ROOM * (end - start);
        ((start - room).max(first), (end + room).min(last))
    } else if first < last {
        (first, last)
    } else {
        (0.0, 1.0)
    }
}

/// Of every group of points the lowest and the highest, in their order: no peak is lost.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let group = (2 * points.len()).div_ceil(MOST_POINTS).max(1);
    if group <= 2 {
        return points;
    }
    let extremes = |group: &[(f64, f64)]| {
        let by_force = |one: &&(f64, f64), two: &&(f64, f64)| one.1.total_cmp(&two.1);
        let (lo, hi) = (group.iter().min_by(by_force), group.iter().max_by(by_force));
        let mut pair: Vec<(f64, f64)> = lo.into_iter().chain(hi).copied().collect();
        pair.sort_by(|one, two| one.0.total_cmp(&two.0));
        pair
    };
    points.chunks(group).flat_map(extremes).collect()
}
