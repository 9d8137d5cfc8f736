//! Time histories for the page: a few traces, thinned without losing a peak, with the poses of the replay.

use serde::Serialize;
use softdock_campaign::requirement::{Requirement, RequirementLimits, SUCCESS};
use softdock_results::traces::{NOMINAL_RUN, Trace};
use std::ops::Range;

use crate::page_data::block::{Array, Block};
use crate::summary::Summary;

/// Traces on the page, at most.
const MOST_TRACES: usize = 12;

/// Groups of instants of a trace: while the parts touch, and the rest of the time.
const GROUPS: [usize; 2] = [220, 60];

/// Share of the time of contact that counts as such before and after it.
const PADDING: f64 = 0.08;

/// A quantity of the trace figures: id, text, unit and its signals, each with the id of its place.
struct Quantity {
    id: &'static str,
    text: &'static str,
    unit: &'static str,
    signals: &'static [(&'static str, &'static str)],
}

const SPACE: &str = "space";
const FACILITY: &str = "facility";

const QUANTITIES: [Quantity; 13] = [
    Quantity {
        id: "contact_force_n",
        text: "contact force",
        unit: "N",
        signals: &[("space_contact_force_n", SPACE), ("hil_contact_force_n", FACILITY)],
    },
    Quantity {
        id: "interface_force_n",
        text: "interface force: contact and latch",
        unit: "N",
        signals: &[("space_interface_force_n", SPACE), ("hil_interface_force_n", FACILITY)],
    },
    Quantity {
        id: "latch_force_n",
        text: "latch force",
        unit: "N",
        signals: &[("space_latch_force_n", SPACE), ("hil_latch_force_n", FACILITY)],
    },
    Quantity {
        id: "sensor_force_n",
        text: "force measured and fed back",
        unit: "N",
        signals: &[("measured_force_n", "measured"), ("fed_back_force_n", "fed back")],
    },
    Quantity {
        id: "contact_moment_n_m",
        text: "contact moment",
        unit: "N m",
        signals: &[("space_contact_moment_n_m", SPACE), ("hil_contact_moment_n_m", FACILITY)],
    },
    Quantity {
        id: "interface_moment_n_m",
        text: "interface moment: contact and latch",
        unit: "N m",
        signals: &[("space_interface_moment_n_m", SPACE), ("hil_interface_moment_n_m", FACILITY)],
    },
    Quantity {
        id: "latch_moment_n_m",
        text: "latch moment",
        unit: "N m",
        signals: &[("space_latch_moment_n_m", SPACE), ("hil_latch_moment_n_m", FACILITY)],
    },
    Quantity {
        id: "relative_position_x_m",
        text: "part A from part B, x",
        unit: "m",
        signals: &[("space_relative_position_x_m", SPACE), ("hil_relative_position_x_m", FACILITY)],
    },
    Quantity {
        id: "relative_position_y_m",
        text: "part A from part B, y",
        unit: "m",
        signals: &[("space_relative_position_y_m", SPACE), ("hil_relative_position_y_m", FACILITY)],
    },
    Quantity {
        id: "relative_position_z_m",
        text: "part A from part B, z",
        unit: "m",
        signals: &[("space_relative_position_z_m", SPACE), ("hil_relative_position_z_m", FACILITY)],
    },
    Quantity {
        id: "relative_velocity_x_m_per_s",
        text: "velocity of part A from part B, x",
        unit: "m/s",
        signals: &[("space_relative_velocity_x_m_per_s", SPACE), ("hil_relative_velocity_x_m_per_s", FACILITY)],
    },
    Quantity {
        id: "injected_energy_j",
        text: "energy injected by the facility",
        unit: "J",
        signals: &[("hil_injected_energy_j", FACILITY)],
    },
    Quantity {
        id: "arm_phase",
        text: "phase of the arm's motion",
        unit: "1",
        signals: &[("space_arm_phase", SPACE), ("hil_arm_phase", FACILITY)],
    },
];

/// Beginnings of the names of the signals that the replay needs.
const POSES: [&str; 8] = [
    "space_base_",
    "space_part_b_",
    "space_joint_",
    "robots_part_",
    "robot1_",
    "robot2_",
    "space_contact_force_",
    "hil_contact_force_",
];

/// A quantity as the page shows it.
#[derive(Debug, Serialize)]
pub(crate) struct ShownQuantity {
    id: &'static str,
    text: &'static str,
    unit: &'static str,
    /// Limits of requirements on its peak.
    limits: Vec<ShownLimit>,
}

#[derive(Debug, Serialize)]
struct ShownLimit {
    requirement: String,
    value: f64,
}

/// A trace on the page.
#[derive(Debug, Serialize)]
pub(crate) struct ShownTrace {
    /// Run number; none for the nominal case.
    run: Option<u64>,
    /// Why it was kept.
    kept_as: String,
    /// Instants of the curves \[s\].
    time: Array,
    /// First and last instant of the contact, with a margin \[s\].
    contact: [f64; 2],
    curves: Vec<ShownCurve>,
    /// Poses of the replay; none in traces of versions that kept none.
    poses: Option<ShownPoses>,
}

#[derive(Debug, Serialize)]
struct ShownCurve {
    quantity: &'static str,
    place: &'static str,
    values: Array,
}

/// Signals of the replay: per column the differences of successive 16-bit numbers between its ends.
#[derive(Debug, Serialize)]
struct ShownPoses {
    /// Instants \[s\].
    time: Array,
    names: Vec<String>,
    /// Ends of each column.
    ranges: Vec<[f64; 2]>,
    /// Column after column.
    steps: Array,
}

/// The quantities that some trace has, with the limits of the requirements.
pub(crate) fn quantities(traces: &[&Trace], requirements: &[Requirement]) -> Vec<ShownQuantity> {
    let limits = |id: &str| {
        let is_of = |requirement: &&Requirement| {
            let column = requirement.metric.column.as_deref().and_then(|column| column.strip_prefix("peak_"));
            column == Some(id)
        };
        let limits = requirements.iter().filter(is_of).flat_map(|requirement| {
            let RequirementLimits { at_least, at_most } = requirement.limits;
            let limit = |value| ShownLimit { requirement: requirement.id.clone(), value };
            at_least.into_iter().chain(at_most).map(limit)
        });
        limits.collect()
    };
    let is_there =
        |quantity: &&Quantity| traces.iter().any(|trace| quantity.signals.iter().any(|own| has(trace, own.0)));
    let shown = |own: &Quantity| ShownQuantity { id: own.id, text: own.text, unit: own.unit, limits: limits(own.id) };
    QUANTITIES.iter().filter(is_there).map(shown).collect()
}

/// Whether a trace has a signal that is not zero all the time; the contact force counts anyway.
fn has(trace: &Trace, signal: &str) -> bool {
    let values = trace.signal(signal);
    values.is_some_and(|values| {
        signal.ends_with("_contact_force_n") || values.iter().flatten().any(|value| *value != 0.0)
    })
}

/// The traces that the page shows: the worst run of each requirement in each loop, the nominal case, then others, worst
/// runs before random ones.
pub(crate) fn chosen<'a>(traces: &'a [Trace], summary: &Summary) -> Vec<&'a Trace> {
    // The worst run of a requirement on success is any that fails: it comes behind those of measured quantities.
    let mut requirements: Vec<_> = summary.requirements.iter().collect();
    requirements.sort_by_key(|own| own.metric == SUCCESS);
    let worst = requirements.into_iter().flat_map(|own| [&own.loops.space, &own.loops.facility]);
    let mut wanted: Vec<u64> = worst.filter_map(|side| side.worst.map(|worst| worst.run)).collect();
    wanted.push(NOMINAL_RUN);
    let mut others: Vec<&Trace> = traces.iter().collect();
    others.sort_by_key(|trace| (!trace.kept_as.starts_with("worst"), trace.run));
    // Every kind of worst run in turn.
    let mut kinds: Vec<&str> = others.iter().map(|trace| trace.kept_as.as_str()).collect();
    kinds.dedup();
    let of_kind =
        |kind: &str, at: usize| others.iter().filter(|trace| trace.kept_as == kind).nth(at).map(|own| own.run);
    let longest = others.len();
    wanted.extend((0..longest).flat_map(|at| kinds.iter().filter_map(move |kind| of_kind(kind, at))).take(longest));
    let mut chosen: Vec<&Trace> = Vec::new();
    for run in wanted {
        let found = traces.iter().find(|trace| trace.run == run);
        if let Some(trace) = found.filter(|_| chosen.iter().all(|own| own.run != run)) {
            chosen.push(trace);
        }
    }
    chosen.retain(|trace| !trace.time.is_empty());
    chosen.truncate(MOST_TRACES);
    chosen
}

/// A trace for the page, its numbers in the block.
pub(crate) fn shown(trace: &Trace, block: &mut Block) -> ShownTrace {
    let contact = contact(trace);
    let groups = groups(&trace.time, contact);
    let time: Vec<f32> = groups.iter().flat_map(|group| instants(&trace.time, group)).map(|time| time as f32).collect();
    let time = block.exact(&time);
    let mut curves = Vec::new();
    for quantity in &QUANTITIES {
        for (signal, place) in quantity.signals.iter().filter(|own| has(trace, own.0)) {
            let values = trace.signal(signal).unwrap_or_default();
            let thinned: Vec<f32> = groups.iter().flat_map(|group| extremes(values, group)).collect();
            curves.push(ShownCurve { quantity: quantity.id, place, values: block.numbers(&thinned) });
        }
    }
    let run = (trace.run != NOMINAL_RUN).then_some(trace.run);
    let poses = poses(trace, &groups, block);
    ShownTrace { run, kept_as: trace.kept_as.clone(), time, contact, curves, poses }
}

/// Sum of the contact forces of both loops at an instant \[N\].
fn force(trace: &Trace, at: usize) -> f64 {
    let of = |signal: &str| trace.signal(signal).and_then(|values| values[at]).unwrap_or(0.0);
    of("space_contact_force_n") + of("hil_contact_force_n")
}

/// First and last instant of the contact with a margin; the whole trace without contact \[s\].
fn contact(trace: &Trace) -> [f64; 2] {
    let (first, last) = (trace.time[0], trace.time[trace.time.len() - 1]);
    let touching = (0..trace.time.len()).filter(|at| force(trace, *at) > 0.0).map(|at| trace.time[at]);
    let ends = touching.fold(None, |ends: Option<(f64, f64)>, time| Some((ends.map_or(time, |ends| ends.0), time)));
    match ends {
        Some((start, end)) if start < end => {
            let padding = PADDING * (end - start);
            [(start - padding).max(first), (end + padding).min(last)]
        }
        _ => [first, last],
    }
}

/// Groups of instants: fine while the parts touch, coarse before and after.
fn groups(time: &[f64], [start, end]: [f64; 2]) -> Vec<Range<usize>> {
    let places = [0, time.partition_point(|t| *t < start), time.partition_point(|t| *t <= end), time.len()];
    let outside = places[1] + time.len() - places[2];
    let mut groups = Vec::new();
    for (at, pair) in places.windows(2).enumerate() {
        let length = pair[1] - pair[0];
        let count = if at == 1 { GROUPS[0] } else { (GROUPS[1] * length).div_ceil(outside.max(1)) };
        let size = length.div_ceil(count.max(1)).max(1);
        groups.extend((pair[0]..pair[1]).step_by(size).map(|from| from..(from + size).min(pair[1])));
    }
    groups
}

/// The instants at which a group's extremes are drawn: one of a single instant, else two.
fn instants(time: &[f64], group: &Range<usize>) -> Vec<f64> {
    match group.len() {
        1 => vec![time[group.start]],
        length => vec![time[group.start], time[group.start + length / 2]],
    }
}

/// The least and the greatest value of a group in their order, one for each of its [`instants`].
fn extremes(values: &[Option<f64>], group: &Range<usize>) -> Vec<f32> {
    let single = |value: Option<f64>| value.map_or(f32::NAN, |value| value as f32);
    if group.len() == 1 {
        return vec![single(values[group.start])];
    }
    let found = group.clone().filter(|at| values[*at].is_some_and(f64::is_finite));
    let by_value = |one: &usize, two: &usize| values[*one].unwrap_or(0.0).total_cmp(&values[*two].unwrap_or(0.0));
    match (found.clone().min_by(by_value), found.max_by(by_value)) {
        (Some(one), Some(two)) => vec![single(values[one.min(two)]), single(values[one.max(two)])],
        _ => vec![f32::NAN; 2],
    }
}

/// Poses and contact forces at one instant of each group: that of the greatest contact force.
fn poses(trace: &Trace, groups: &[Range<usize>], block: &mut Block) -> Option<ShownPoses> {
    let is_pose = |name: &str| POSES.iter().any(|own| name.starts_with(own)) && !is_magnitude(name);
    let signals: Vec<_> = trace.signals.iter().filter(|signal| is_pose(&signal.name)).collect();
    if !signals.iter().any(|signal| signal.name.starts_with("space_base_")) {
        return None;
    }
    let hardest = |group: &Range<usize>| {
        group.clone().reduce(|one, two| if force(trace, two) > force(trace, one) { two } else { one })
    };
    let places: Vec<usize> = groups.iter().filter_map(hardest).collect();
    let time: Vec<f32> = places.iter().map(|at| trace.time[*at] as f32).collect();
    let (mut ranges, mut steps) = (Vec::new(), Vec::new());
    for signal in &signals {
        let values = places.iter().map(|at| signal.values[*at].filter(|value| value.is_finite()).unwrap_or(0.0));
        let values: Vec<f64> = values.collect();
        let (lo, hi) = values.iter().fold((f64::MAX, f64::MIN), |(lo, hi), value| (lo.min(*value), hi.max(*value)));
        let mut before = 0_i16;
        for value in values {
            let share = if hi > lo { (value - lo) / (hi - lo) } else { 0.0 };
            let code = (share * 65_534.0 - 32_767.0).round() as i16;
            steps.push(code.wrapping_sub(before));
            before = code;
        }
        ranges.push([lo, hi]);
    }
    let names = signals.iter().map(|signal| signal.name.clone()).collect();
    Some(ShownPoses { time: block.exact(&time), names, ranges, steps: block.short(&steps) })
}

/// Whether a signal is the magnitude of the contact force, which its components give.
fn is_magnitude(name: &str) -> bool {
    name.ends_with("_contact_force_n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_all_instants_of_a_short_trace() {
        let time: Vec<f64> = (0..10_000).map(|tick| f64::from(tick) * 1e-3).collect();
        let mut values = vec![Some(0.0); time.len()];
        values[4_321] = Some(7.0);
        values[8_765] = Some(-3.0);
        let groups = groups(&time, [4.0, 5.0]);
        assert!(groups.len() <= GROUPS[0] + GROUPS[1] + 2, "{}", groups.len());
        assert_eq!(groups.iter().map(ExactSizeIterator::len).sum::<usize>(), time.len());
        let thinned: Vec<f32> = groups.iter().flat_map(|group| extremes(&values, group)).collect();
        assert!(thinned.contains(&7.0) && thinned.contains(&-3.0));
        assert_eq!(thinned.len(), groups.iter().flat_map(|group| instants(&time, group)).count());
        let short = super::groups(&time[..200], [0.0, 0.2]);
        assert!(short.iter().all(|group| group.len() == 1));
    }
}
