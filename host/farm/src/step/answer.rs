//! JSON of the stepping results: SI units, names with their unit.

use super::text::cause_words;
use super::{Draws, LOOPS, LoopDraws, Nominal, RANGES, REPORTED, Reported, Stepped, SteppedFacility};
use serde_json::{Map, Value, json};
use softdock_analysis::cause_sentence;
use softdock_campaign::overlap::keys;
use softdock_kernels::contact::overlap::Overlap;
use softdock_kernels::metrics::flags;
use softdock_results::runs::{Cause, LoopRow, OUTCOME_WORDS, Outcome};

impl Stepped {
    /// All of it, facility by facility; entries of points and solids count from 1, as in the scenario.
    pub fn json(&self) -> Value {
        json!({
            "is_asked": self.asked.is_some(),
            "expected_wall_time_s": self.facilities.iter().map(|facility| facility.wall_time.total()).sum::<f64>(),
            "facilities": self.facilities.iter().map(facility).collect::<Vec<_>>(),
        })
    }
}

fn facility(facility: &SteppedFacility) -> Value {
    let time = &facility.wall_time;
    json!({
        "variant": facility.name,
        "start": facility.start.as_ref().map(|start| pair(start, None)),
        "max_depth_m": facility.max_depth,
        "nominal": nominal(&facility.nominal),
        "draws": draws(&facility.draws),
        "wall_time": {
            "device": time.device, "expected_s": time.total(),
            "runs_s": time.runs, "repetitions_s": time.repetitions, "traces_s": time.traces,
            "contact_events_s": time.contact_events,
        },
    })
}

/// A contact point and a solid; `depth_m` is negative where they are apart.
fn pair(pair: &Overlap, run: Option<u64>) -> Value {
    let [point, solid] = keys(pair);
    let mut value = json!({ "point": point, "solid": solid, "depth_m": pair.depth });
    if let Some(run) = run {
        value["run"] = json!(run);
    }
    value
}

/// Field of a metric with its unit.
fn key(name: &str, unit: &str) -> String {
    format!("{name}_{}", unit.to_lowercase())
}

fn nominal(nominal: &Nominal) -> Value {
    let mut value = Map::new();
    for (name, side, touch) in nominal.loops() {
        value.insert(name.to_owned(), of_loop(side, touch));
    }
    let flags = |bits: u32| nominal.flags(bits).map(|flag| flag.1).collect::<Vec<_>>();
    value.insert("invalid_flags".to_owned(), json!(flags(flags::INVALID)));
    value.insert("other_flags".to_owned(), json!(flags(!flags::INVALID)));
    value.insert("stepping_time_s".to_owned(), json!(nominal.seconds));
    Value::Object(value)
}

fn of_loop(side: &LoopRow, touch: Option<&Overlap>) -> Value {
    let mut value = Map::new();
    for Reported { name, unit, time, .. } in &REPORTED {
        value.insert(key(name, unit), json!(side.metrics.available(name)));
        if let Some(time) = time {
            value.insert(key(time, "s"), json!(side.metrics.available(time)));
        }
    }
    let touch = touch.map(|pair| {
        let (place, [point, solid]) = (pair.place, keys(pair));
        json!({ "point": point, "solid": solid, "place_in_b_m": [place.x, place.y, place.z] })
    });
    value.insert("touch".to_owned(), json!(touch));
    value.insert("outcome".to_owned(), json!(side.outcome.word()));
    let cause = side.cause.as_ref().map(|cause| {
        json!({
            "id": cause.id, "text": cause_sentence(cause), "time_s": cause.time, "value": cause.value,
            "limit": cause.limit, "phase": cause.phase.map(|phase| phase.word()),
        })
    });
    value.insert("cause".to_owned(), json!(cause));
    Value::Object(value)
}

fn draws(draws: &Draws) -> Value {
    let mut value = json!({
        "count": draws.rows.len(),
        "device": draws.device,
        "stepping_time_s": draws.seconds,
        "overlapping_starts": draws.overlapping,
        "deepest_start": draws.deepest.as_ref().map(|(run, deepest)| pair(deepest, Some(*run))),
    });
    for (name, side) in LOOPS.iter().zip(&draws.loops) {
        value[*name] = of_draws(side);
    }
    value
}

fn of_draws(side: &LoopDraws) -> Value {
    let outcomes: Map<String, Value> =
        OUTCOME_WORDS.iter().zip(side.outcomes).map(|(word, count)| ((*word).to_owned(), json!(count))).collect();
    let cause = |(cause, outcome, runs): &(Cause, Outcome, u64)| json!({ "outcome": outcome.word(), "id": cause.id, "text": cause_words(cause), "limit": cause.limit, "runs": runs });
    let range = |(reported, range): (&Reported, &Option<[f64; 3]>)| {
        let range = range.map(|[min, median, max]| json!({ "min": min, "median": median, "max": max }));
        (key(reported.name, reported.unit), json!(range))
    };
    let ranges: Map<String, Value> = REPORTED[..RANGES].iter().zip(&side.ranges).map(range).collect();
    json!({
        "outcomes": outcomes,
        "causes": side.causes.iter().map(cause).collect::<Vec<_>>(),
        "ranges": ranges,
    })
}
