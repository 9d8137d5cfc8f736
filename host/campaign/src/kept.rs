//! Which runs keep their time histories and their contact events.

use crate::campaign::{ContactEventPlan, Keep, TracePlan};
use crate::check::Checker;
use crate::problem::Problem;
use crate::written::At;
use crate::written::campaign::{ContactEventsTable, TracesTable};
use softdock_kernels::model::Timing;
use softdock_kernels::range::Range;

/// Longest separation that may be part of a contact event \[s\].
const LONGEST_GAP: f64 = 10.0;

pub(crate) fn traces(c: &mut Checker, table: &TracesTable, timing: &Timing) -> TracePlan {
    let every_ticks = table.rate.as_ref().map_or(1, |rate| {
        let fastest = 1.0 / timing.tick();
        let rate = c.number(rate, "Hz", Range::within(fastest / 1e6, fastest * (1.0 + 1e-9)));
        (fastest / rate).round().max(1.0) as u32
    });
    let words = table.keep.as_ref().map_or(&[][..], |keep| &keep.value);
    TracePlan { every_ticks, keep: words.iter().filter_map(|word| keep(c, word, false)).collect() }
}

pub(crate) fn contact_events(c: &mut Checker, table: Option<&ContactEventsTable>) -> ContactEventPlan {
    let Some(table) = table else { return ContactEventPlan::default() };
    ContactEventPlan {
        merge_gap: c.number_or(&table.merge_gap, 0.0, "s", Range::within(0.0, LONGEST_GAP)),
        keep: table.keep.value.iter().filter_map(|word| keep(c, word, true)).collect(),
    }
}

/// The runs of a word; `all` only where every run may be kept.
fn keep(c: &mut Checker, written: &At<String>, may_be_all: bool) -> Option<Keep> {
    let (word, count) = match written.value.split_once(':') {
        Some((word, count)) => (word, count.trim().parse::<u32>().ok().filter(|count| (1..=10_000).contains(count))),
        None => (written.value.as_str(), None),
    };
    let keep = match (word, count, written.value.contains(':')) {
        ("all", _, false) if may_be_all => Some(Keep::All),
        ("nominal", _, false) => Some(Keep::Nominal),
        ("failed", _, false) => Some(Keep::Failed),
        ("invalid", _, false) => Some(Keep::Invalid),
        ("worst", Some(count), _) => Some(Keep::Worst(count)),
        ("random", Some(count), _) => Some(Keep::Random(count)),
        _ => None,
    };
    if keep.is_none() {
        let all = if may_be_all { ["all, ", "\"all\", "] } else { ["", ""] };
        let remedy = format!(
            "write {}\"nominal\", \"failed\", \"invalid\", \"worst:20\" or \"random:50\" (N from 1 to 10000)",
            all[1]
        );
        let problem = Problem::at(&c.source, written.span.clone(), "this names no runs")
            .expected(format!("{}nominal, failed, invalid, worst:N or random:N", all[0]))
            .remedy(remedy);
        c.problems.push(problem);
    }
    keep
}
