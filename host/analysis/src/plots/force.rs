//! The limited quantity over time of the kept runs, in space and on the facility; without limits the contact force.

use softdock_campaign::requirement::{Requirement, RequirementLimits};
use softdock_results::traces::{NOMINAL_RUN, Trace};

use crate::Result;
use crate::number::with_unit;
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};

/// Points of a line on the page; between them the extremes are kept.
const MOST_POINTS: usize = 600;

/// Figures of the worst runs of one requirement on one loop, at most.
const MOST_OF_A_KIND: usize = 2;

/// Figures of random runs, at most.
const MOST_RANDOM: usize = 2;

/// Multiple of the peak in space above which the facility's force exceeds the axis: a diverging facility has no scale.
const HIGHEST: f64 = 6.0;

/// Share of the time of contact that is shown before and after it.
const PADDING: f64 = 0.08;

/// What a figure draws: a quantity of both loops, and the limits of a requirement on it.
struct Quantity {
    /// Words on the axis.
    name: String,
    unit: String,
    /// Signals in space and on the facility.
    signals: [String; 2],
    /// Limits on the magnitude.
    limits: Vec<f64>,
}

/// Quantity of a trace that was kept for no limit on a force or moment.
const CONTACT_FORCE: &str = "contact_force";

impl Quantity {
    /// What a trace was kept for: the quantity that its requirement limits, or else the contact force.
    fn of(trace: &Trace, requirements: &[Requirement]) -> Self {
        let id = trace.kept_as.strip_prefix("worst ").map(|id| id.trim_end_matches(" on the facility"));
        let requirement = requirements.iter().find(|requirement| Some(requirement.id.as_str()) == id);
        requirement.and_then(|requirement| Self::limited(trace, requirement)).unwrap_or_else(|| Self {
            name: CONTACT_FORCE.replace('_', " "),
            unit: "N".to_owned(),
            signals: ["space", "hil"].map(|side| format!("{side}_{CONTACT_FORCE}_n")),
            limits: Vec::new(),
        })
    }

    /// The quantity of which a metric is the peak: `peak_QUANTITY` belongs to the signal `QUANTITY` of each loop.
    fn limited(trace: &Trace, requirement: &Requirement) -> Option<Self> {
        let column = requirement.metric.column.as_ref()?.strip_prefix("peak_")?;
        let signals = ["space", "hil"].map(|side| format!("{side}_{column}"));
        signals.iter().all(|signal| trace.signal(signal).is_some()).then(|| {
            let RequirementLimits { at_least, at_most } = requirement.limits;
            let name = requirement.metric.name.trim_start_matches("peak_").replace('_', " ");
            let limits = at_least.into_iter().chain(at_most).collect();
            Self { name, unit: requirement.unit().to_owned(), signals, limits }
        })
    }
}

/// Nominal, then the worst run of each requirement on each loop, then random runs; runs without the signal are left out.
pub(crate) fn force_figures(traces: &[Trace], requirements: &[Requirement]) -> Result<Vec<Drawing>> {
    let kept = |kind: &str, most: usize| {
        let kind = kind.to_owned();
        traces.iter().filter(move |trace| trace.kept_as == kind).take(most)
    };
    let worst = requirements.iter().flat_map(|requirement| {
        let id = &requirement.id;
        [format!("worst {id}"), format!("worst {id} on the facility")]
    });
    let worst: Vec<&Trace> = worst.flat_map(|kind| kept(&kind, MOST_OF_A_KIND).collect::<Vec<_>>()).collect();
    let mut drawings = Vec::new();
    for trace in kept("nominal", 1).chain(worst).chain(kept("random", MOST_RANDOM)) {
        drawings.extend(force_figure(trace, &Quantity::of(trace, requirements))?);
    }
    Ok(drawings)
}

fn force_figure(trace: &Trace, quantity: &Quantity) -> Result<Option<Drawing>> {
    let [Some(space), Some(facility)] = [&quantity.signals[0], &quantity.signals[1]].map(|name| points(trace, name))
    else {
        return Ok(None);
    };
    let (start, end) = time_of_contact(&space, &facility);
    let [peak, facility_peak] =
        [&space, &facility].map(|points| points.iter().map(|point| point.1).fold(0.0, f64::max));
    let exceeds = peak > 0.0 && facility_peak > HIGHEST * peak;
    let highest = if exceeds { HIGHEST * peak } else { facility_peak.max(peak) };
    let highest = quantity.limits.iter().copied().fold(highest, f64::max);
    let name = match trace.run {
        NOMINAL_RUN => "Nominal case".to_owned(),
        run => format!("Run {run}"),
    };
    let shown =
        |points: Vec<(f64, f64)>| thinned(points.into_iter().filter(|(t, _)| (start..=end).contains(t)).collect());
    let x = Axis::linear("time [s]", start, end);
    let label = format!("{} [{}]", quantity.name, quantity.unit);
    let y = Axis::linear(label, 0.0, if highest > 0.0 { 1.08 * highest } else { 1.0 });
    let mut figure = Figure::new(format!("{}, {name}", quantity.name), Size::Half, x, y)
        .line(shown(facility), colour::FACILITY, 1.3)
        .line(shown(space), colour::SPACE, 1.3);
    for limit in &quantity.limits {
        figure = figure.line(vec![(start, *limit), (end, *limit)], colour::FALSE_PASS, 1.0);
    }
    let svg = figure.svg()?;
    let kept = if trace.kept_as == "nominal" { String::new() } else { format!(" ({})", trace.kept_as) };
    let limit: String =
        quantity.limits.iter().map(|limit| format!(" Limit {}.", with_unit(*limit, &quantity.unit))).collect();
    let note = if exceeds {
        format!(" The facility exceeds the axis range; its peak is {}.", with_unit(facility_peak, &quantity.unit))
    } else {
        String::new()
    };
    Ok(Some(Drawing { svg, caption: format!("{name}{kept}.{limit}{note}") }))
}

fn points(trace: &Trace, signal: &str) -> Option<Vec<(f64, f64)>> {
    let values = trace.signal(signal)?;
    Some(trace.time.iter().zip(values).filter_map(|(time, value)| Some((*time, (*value)?))).collect())
}

/// Returns the time from the first to the last contact in either loop, with padding; the whole trace without contact.
fn time_of_contact(space: &[(f64, f64)], facility: &[(f64, f64)]) -> (f64, f64) {
    let all = || space.iter().chain(facility);
    let touching = all().filter(|(_, force)| *force > 0.0);
    let span = |(lo, hi): (f64, f64), (time, _): &(f64, f64)| (lo.min(*time), hi.max(*time));
    let (start, end) = touching.fold((f64::INFINITY, f64::NEG_INFINITY), span);
    let (first, last) = all().fold((f64::INFINITY, f64::NEG_INFINITY), span);
    if start < end {
        let padding = PADDING * (end - start);
        ((start - padding).max(first), (end + padding).min(last))
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
