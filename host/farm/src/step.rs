//! `check` steps the model: overlap at the start, the nominal case, draws, and the expected wall time.

mod answer;
mod text;
mod wall_time;

use crate::error::{FarmError, Result};
use crate::observer::{Context, Note, Progress, Work};
use crate::rows::{RowBuilder, params_of};
use crate::run_engine::{RunEngine, counting};
use rayon::prelude::*;
use softdock_campaign::{Campaign, Variant};
use softdock_engine::{Choice, EngineError, RunInput, cpu};
use softdock_kernels::contact::overlap::{Overlap, deepest_overlap, start_parts};
use softdock_kernels::metrics::flags;
use softdock_kernels::outcome::Signals;
use softdock_results::runs::{Cause, LoopRow, Outcome, RunRow};
use softdock_results::traces::NOMINAL_RUN;
use std::time::Instant;
use wall_time::{WallTime, expected};

/// A metric that `check` reports: its field name, words, unit, and the field of its time, if it has one.
struct Reported {
    name: &'static str,
    words: &'static str,
    unit: &'static str,
    time: Option<&'static str>,
}

/// The metrics of the nominal case; the first four have their ranges over the draws.
const REPORTED: [Reported; 6] = [
    Reported { name: "touch_time", words: "first touch", unit: "s", time: None },
    Reported {
        name: "peak_contact_force",
        words: "peak contact force",
        unit: "N",
        time: Some("peak_contact_force_time"),
    },
    Reported { name: "peak_latch_force", words: "peak latch force", unit: "N", time: Some("peak_latch_force_time") },
    Reported {
        name: "peak_interface_force",
        words: "peak interface force",
        unit: "N",
        time: Some("peak_interface_force_time"),
    },
    Reported { name: "capture_time", words: "capture", unit: "s", time: None },
    Reported { name: "end_time", words: "end of the run", unit: "s", time: None },
];

/// Of how many metrics the draws give a range.
const RANGES: usize = 4;

/// Names of the two loops in keys and in text.
const LOOPS: [&str; 2] = ["space", "facility"];

/// Result of stepping a campaign, for its facility or for each of its variants.
pub struct Stepped {
    facilities: Vec<SteppedFacility>,
    /// Draws that the user asked for; none: one round of the CPU's lanes.
    asked: Option<u64>,
    /// Whether the draws ran on another device than the campaign's runs may.
    is_other_device: bool,
}

/// Result of stepping a facility.
struct SteppedFacility {
    /// Name of the variant, if the campaign has variants.
    name: Option<String>,
    /// The deepest overlap at the nominal start, or the nearest pair.
    start: Option<Overlap>,
    /// Penetration limit of the task \[m\].
    max_depth: f64,
    nominal: Nominal,
    draws: Draws,
    wall_time: WallTime,
}

/// The nominal case, stepped in f64.
struct Nominal {
    row: RunRow,
    /// Where the parts first touched, in space and on the facility; none without a touch that lasts to a tick's end.
    touches: [Option<Overlap>; 2],
    /// Wall time of stepping it with its signals \[s\].
    seconds: f64,
}

/// Draws spread over the campaign.
struct Draws {
    rows: Vec<RunRow>,
    loops: [LoopDraws; 2],
    /// Draws whose parts overlap at the start.
    overlapping: u64,
    /// The deepest overlap at a start, or the nearest pair, and its run.
    deepest: Option<(u64, Overlap)>,
    device: String,
    /// Wall time of all of them \[s\].
    seconds: f64,
}

/// Results of the draws in a loop.
struct LoopDraws {
    /// Counts in the order of `OUTCOME_WORDS`.
    outcomes: [u64; 4],
    /// The first of each kind of cause with outcome and count, most frequent first.
    causes: Vec<(Cause, Outcome, u64)>,
    /// Least, median and greatest value of the first [`REPORTED`] metrics over the valid draws that have one.
    ranges: [Option<[f64; 3]>; RANGES],
}

/// Steps the nominal case and draws of a campaign; with variants, of each of them.
///
/// Without `asked` it steps one round of the CPU's lanes, otherwise `asked` draws on the backend of `choice`.
///
/// # Errors
/// If no engine can make the runs.
pub fn step(campaign: &Campaign, asked: Option<u64>, choice: Choice, context: Context) -> Result<Stepped> {
    let variants = campaign.variants.iter();
    let on_variant =
        |variant: &Variant| facility(Some(variant.name.clone()), &campaign.on_variant(variant), asked, choice, context);
    let mut facilities = variants.map(on_variant).collect::<Result<Vec<_>>>()?;
    if facilities.is_empty() {
        facilities.push(facility(None, campaign, asked, choice, context)?);
    }
    Ok(Stepped { facilities, asked, is_other_device: asked.is_none() && choice != Choice::Cpu })
}

fn facility(
    name: Option<String>,
    campaign: &Campaign,
    asked: Option<u64>,
    choice: Choice,
    context: Context,
) -> Result<SteppedFacility> {
    let mut on_cpu = RunEngine::reference(campaign);
    let nominal = nominal(campaign, &on_cpu);
    let plant = on_cpu.builder.job.plant.clone();
    let start = deepest_overlap(&plant, &start_parts(&plant, &campaign.nominal()));
    let other = match asked {
        Some(_) if choice != Choice::Cpu => other_device(campaign, choice, context)?,
        _ => None,
    };
    let round = asked.filter(|_| other.is_none()).unwrap_or(on_cpu.lanes() as u64);
    let by_cpu = draws(campaign, &mut on_cpu, round, context)?;
    let (draws, wall_time) = match other {
        None => {
            let wall_time = expected(campaign, &nominal, (&by_cpu, &on_cpu), None);
            (by_cpu, wall_time)
        }
        Some(mut engine) => {
            let own = draws(campaign, &mut engine, asked.unwrap_or(1), context)?;
            let wall_time = expected(campaign, &nominal, (&by_cpu, &on_cpu), Some((&own, &engine)));
            (own, wall_time)
        }
    };
    Ok(SteppedFacility { name, start, max_depth: plant.task.max_depth, nominal, draws, wall_time })
}

/// The campaign's GPU, if it has one here; its kernel is compiled by a first run.
fn other_device<'a>(campaign: &'a Campaign, choice: Choice, context: Context<'a>) -> Result<Option<RunEngine<'a>>> {
    let mut engine = match RunEngine::open(campaign, choice, context) {
        Ok(engine) => engine,
        Err(error @ EngineError::NoAdapter(_)) => {
            context.note(Note::NoAdapter(error));
            return Ok(None);
        }
        Err(error) => return Err(error.into()),
    };
    if engine.backend() == "cpu" {
        return Ok(None);
    }
    engine.make_numbered(&[0], &|_, _| true)?;
    Ok(Some(engine))
}

/// Steps the nominal case and finds where the parts first touch.
fn nominal(campaign: &Campaign, engine: &RunEngine) -> Nominal {
    let job = &engine.builder.job;
    let mut seen: [Option<(f64, Overlap)>; 2] = [None, None];
    let mut see = |signals: &Signals| {
        // The parts of the simulation touch in space, those that the robots hold touch on the facility.
        let loops = [(signals.contact[0], &signals.parts[0]), (signals.contact[1], &signals.mounted)];
        for (seen, (contact, parts)) in seen.iter_mut().zip(loops) {
            if seen.is_none() && contact.force.norm() > 0.0 {
                *seen = deepest_overlap(&job.plant, parts).map(|pair| (signals.time, pair));
            }
        }
    };
    let begin = Instant::now();
    let finished = cpu::replay(job, RunInput::new(NOMINAL_RUN, campaign.nominal()), &mut see);
    let seconds = begin.elapsed().as_secs_f64();
    let row = engine.builder.row(&finished);
    let tick = job.plant.timing.tick();
    // A later contact is not the first one, which then was shorter than a tick.
    let first = |seen: Option<(f64, Overlap)>, side: &LoopRow| {
        seen.filter(|(time, _)| *time <= side.metrics.touch_time + 1.5 * tick).map(|(_, pair)| pair)
    };
    let touches = [first(seen[0], &row.space), first(seen[1], &row.hil)];
    Nominal { row, touches, seconds }
}

/// Steps draws that are spread over the campaign.
fn draws(campaign: &Campaign, engine: &mut RunEngine, count: u64, context: Context) -> Result<Draws> {
    let count = count.clamp(1, campaign.runs.max(1));
    let run = |index: u64| (u128::from(index) * u128::from(campaign.runs) / u128::from(count)) as u64;
    let runs: Vec<u64> = (0..count).map(run).collect();
    let begin = Instant::now();
    let progress = Progress::new(context, Work::Step, count);
    let (rows, is_whole) = engine.make_numbered(&runs, &counting(&progress))?;
    drop(progress);
    if !is_whole {
        return Err(FarmError::Cancelled);
    }
    let seconds = begin.elapsed().as_secs_f64();
    let starts = starts(&engine.builder, &rows);
    let overlapping = starts.iter().filter(|(_, pair)| pair.depth > 0.0).count() as u64;
    let deepest = starts.into_iter().reduce(|most, next| if next.1.depth > most.1.depth { next } else { most });
    let loops = [LoopDraws::of(rows.iter().map(|row| &row.space)), LoopDraws::of(rows.iter().map(|row| &row.hil))];
    Ok(Draws { rows, loops, overlapping, deepest, device: engine.device(), seconds })
}

/// The deepest overlap at the start of every draw, or its nearest pair.
fn starts(builder: &RowBuilder, rows: &[RunRow]) -> Vec<(u64, Overlap)> {
    let pair = |row: &RunRow| {
        let plant = builder.plant_of(row.run);
        let parts = start_parts(&plant, &params_of(row));
        deepest_overlap(&plant, &parts).map(|pair| (row.run, pair))
    };
    rows.par_iter().filter_map(pair).collect()
}

impl LoopDraws {
    fn of<'a>(sides: impl Iterator<Item = &'a LoopRow> + Clone) -> Self {
        let mut outcomes = [0; 4];
        sides.clone().for_each(|side| outcomes[side.outcome as usize] += 1);
        let mut causes: Vec<(Cause, Outcome, u64)> = Vec::new();
        for (side, cause) in sides.clone().filter_map(|side| Some((side, side.cause.as_ref()?))) {
            match causes.iter_mut().find(|(own, outcome, _)| *outcome == side.outcome && own.id == cause.id) {
                Some((.., count)) => *count += 1,
                None => causes.push((cause.clone(), side.outcome, 1)),
            }
        }
        causes.sort_by_key(|(.., count)| std::cmp::Reverse(*count));
        let valid = sides.filter(|side| side.outcome != Outcome::Invalid);
        let range = |reported: &Reported| {
            let mut values: Vec<f64> = valid.clone().filter_map(|side| side.metrics.available(reported.name)).collect();
            values.sort_by(f64::total_cmp);
            let (first, last) = (*values.first()?, *values.last()?);
            let median = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
            Some([first, median, last])
        };
        Self { outcomes, causes, ranges: std::array::from_fn(|at| range(&REPORTED[at])) }
    }
}

impl Nominal {
    /// Both loops by their names.
    fn loops(&self) -> [(&'static str, &LoopRow, Option<&Overlap>); 2] {
        let [space, facility] = &self.touches;
        [(LOOPS[0], &self.row.space, space.as_ref()), (LOOPS[1], &self.row.hil, facility.as_ref())]
    }

    /// Names and meanings of the flags of a set of bits.
    fn flags(&self, bits: u32) -> impl Iterator<Item = &'static (u32, &'static str, &'static str)> {
        let set = self.row.flags & bits;
        flags::TABLE.iter().filter(move |(bit, ..)| set & bit != 0)
    }
}
