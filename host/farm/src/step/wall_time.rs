//! Expected wall time of a campaign, extrapolated from the measured time of a few draws.

use super::{Draws, Nominal};
use crate::run_engine::RunEngine;
use softdock_campaign::Campaign;
use softdock_campaign::campaign::Keep;
use softdock_results::runs::{RunRow, Status};

/// Expected wall time of a campaign, without reading and writing files.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WallTime {
    /// The runs \[s\].
    pub(super) runs: f64,
    /// Runs repeated in f64: parity and step size \[s\].
    pub(super) repetitions: f64,
    /// Time histories that are kept \[s\].
    pub(super) traces: f64,
    /// Runs repeated for their contact events \[s\].
    pub(super) contact_events: f64,
    /// Where the runs are made.
    pub(super) device: String,
}

impl WallTime {
    /// All of it \[s\].
    pub(super) fn total(&self) -> f64 {
        self.runs + self.repetitions + self.traces + self.contact_events
    }
}

/// How fast a device steps draws: its lanes side by side, and what the draws ask of them.
struct Pace {
    lanes: f64,
    /// Mean and greatest simulated time of a draw \[s\].
    mean: f64,
    longest: f64,
    /// Wall time of a second of simulated time with all lanes at work.
    rate: f64,
}

impl Pace {
    fn of(draws: &Draws, lanes: usize) -> Self {
        let ends: Vec<f64> = draws.rows.iter().map(end_of).collect();
        let mean = ends.iter().sum::<f64>() / ends.len().max(1) as f64;
        let longest = ends.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let mut pace = Self { lanes: lanes as f64, mean, longest, rate: 1.0 };
        pace.rate = draws.seconds / pace.seconds(draws.rows.len() as u64);
        pace
    }

    /// Wall time of a batch \[s\]: a lane that is free takes the next run, and the last ones wait for the longest run.
    fn seconds(&self, runs: u64) -> f64 {
        let rounds = runs as f64 / self.lanes;
        let simulated = match runs {
            0 => 0.0,
            _ if rounds <= 1.0 => self.longest,
            _ => rounds * self.mean + (self.longest - self.mean),
        };
        simulated * self.rate
    }

    /// Wall time of runs that are made batch by batch \[s\].
    fn batches(&self, runs: u64, batch: u64) -> f64 {
        (runs / batch) as f64 * self.seconds(batch) + self.seconds(runs % batch)
    }
}

/// Simulated time until both loops of a run have ended \[s\].
fn end_of(row: &RunRow) -> f64 {
    let ends = [row.space.metrics.end_time, row.hil.metrics.end_time];
    ends.into_iter().filter(|end| end.is_finite()).fold(0.0, f64::max)
}

/// The expected wall time, from draws on the CPU and, if the runs are made elsewhere, from draws there.
pub(super) fn expected(
    campaign: &Campaign,
    nominal: &Nominal,
    on_cpu: (&Draws, &RunEngine),
    elsewhere: Option<(&Draws, &RunEngine)>,
) -> WallTime {
    let cpu = Pace::of(on_cpu.0, on_cpu.1.lanes());
    let batch = |engine: &RunEngine| campaign.execution.shard_runs * engine.batch_shards() as u64;
    let runs = match elsewhere {
        None => cpu.batches(campaign.runs, batch(on_cpu.1)),
        Some((draws, engine)) => Pace::of(draws, engine.lanes()).batches(campaign.runs, batch(engine)),
    };
    // At half the substep a run costs twice as much; what a GPU made is stepped in f64 once more, to be compared.
    let half_step = campaign.half_step_runs();
    let parity = (campaign.execution.parity * campaign.runs as f64).ceil() as u64;
    let more = if elsewhere.is_some() { cpu.seconds(half_step) + cpu.seconds(parity) } else { 0.0 };
    let draws = elsewhere.map_or(on_cpu.0, |(draws, _)| draws);
    // A run that is stepped in one lane, with all threads at work.
    let alone =
        nominal.seconds / end_of(&nominal.row).max(f64::MIN_POSITIVE) * cpu.mean / rayon::current_num_threads() as f64;
    WallTime {
        runs,
        repetitions: 2.0 * cpu.seconds(half_step) + more,
        traces: kept(campaign, &campaign.traces.keep, draws) * alone,
        // A substep with a recorder of contacts costs about as much as one with the signals of its tick.
        contact_events: kept(campaign, &campaign.contact_events.keep, draws) * alone,
        device: draws.device.clone(),
    }
}

/// Expected number of runs that are kept.
fn kept(campaign: &Campaign, keep: &[Keep], draws: &Draws) -> f64 {
    let share = |status: Status| {
        let count = draws.rows.iter().filter(|row| row.status == status).count();
        count as f64 / draws.rows.len().max(1) as f64
    };
    let runs = campaign.runs as f64;
    let of = |keep: &Keep| match keep {
        Keep::All => runs,
        Keep::Nominal => 1.0,
        Keep::Failed => share(Status::Fail) * runs,
        Keep::Invalid => share(Status::Invalid) * runs,
        Keep::Worst(count) => 2.0 * f64::from(*count) * campaign.requirements.len() as f64,
        Keep::Random(count) => f64::from(*count),
    };
    keep.iter().map(of).sum::<f64>().min(runs + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws of 1 and 3 s on two lanes: 3 s for a round, then 2 s for each round more.
    #[test]
    fn a_batch_waits_for_its_longest_run() {
        let pace = Pace { lanes: 2.0, mean: 2.0, longest: 3.0, rate: 0.5 };
        assert_eq!([0, 1, 2, 4, 20].map(|runs| pace.seconds(runs)), [0.0, 1.5, 1.5, 2.5, 10.5]);
        assert_eq!(pace.batches(9, 4), 2.5 + 2.5 + 1.5);
    }
}
