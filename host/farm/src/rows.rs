//! Conversion of finished runs to judged rows.

use rayon::prelude::*;
use softdock_analysis::Judge;
use softdock_campaign::Campaign;
use softdock_engine::effective_mass::effective_mass;
use softdock_engine::{Job, RunInput, is_noisy};
use softdock_kernels::fields::{from_slice, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::Model;
use softdock_kernels::outcome::{Finished, Stop};
use softdock_kernels::plant::Plant;
use softdock_results::runs::{Agreement, Cause, LoopRow, Outcome, Phase, RunRow, RunsSchema, Status};

/// Parameters that need random numbers inside the loop.
const NOISE: [&str; 4] = ["delay_jitter", "drop_probability", "sensor_noise_force", "sensor_noise_moment"];

/// Builds the rows of a campaign's runs: their physics, criteria and columns.
pub(crate) struct RowBuilder<'a> {
    campaign: &'a Campaign,
    /// Common job of the runs.
    pub(crate) job: Job,
    /// Criteria.
    judge: Judge<'a>,
    /// The columns of the rows.
    pub(crate) schema: RunsSchema,
}

impl<'a> RowBuilder<'a> {
    /// Prepares a campaign.
    pub(crate) fn new(campaign: &'a Campaign) -> Self {
        let plant = Plant::new(campaign.scenario.model.clone()).with_effects(campaign.effects());
        Self {
            campaign,
            job: Job::new(plant, campaign.seed, needs_noise(campaign)),
            judge: Judge::of(campaign),
            schema: Judge::of(campaign).schema(),
        }
    }

    /// Finished runs as rows.
    pub(crate) fn rows(&self, finished: &[Finished]) -> Vec<RunRow> {
        finished.par_iter().map(|run| self.row(run)).collect()
    }

    /// A finished run as a row of the results.
    pub(crate) fn row(&self, run: &Finished) -> RunRow {
        let unjudged = |metrics: &Metrics<f64>, stop: Option<Stop>| LoopRow {
            outcome: if stop.is_some() { Outcome::Aborted } else { Outcome::Pass },
            cause: stop.map(|stop| met(&self.job.plant, metrics, stop)),
            metrics: *metrics,
            custom_metrics: Vec::new(),
            requirements: Vec::new(),
        };
        let mut row = RunRow {
            run: run.run,
            outer: self.campaign.outer_of(run.run),
            status: Status::Invalid,
            agreement: Agreement::Invalid,
            flags: run.flags,
            inputs: to_vec(&run.params),
            effective_mass: effective_mass(&self.job.plant, run).filter(|mass| mass.is_finite()),
            space: unjudged(&run.space, None),
            hil: unjudged(&run.hil, run.stop),
        };
        self.judge.judge(&mut row);
        row
    }
}

/// A row's run with exactly the inputs that were applied.
pub(crate) fn input_of(row: &RunRow) -> RunInput {
    RunInput { run: row.run, params: from_slice(&row.inputs) }
}

/// The rule that stopped a session.
fn met(model: &Model, metrics: &Metrics<f64>, stop: Stop) -> Cause {
    let (row, time) = (stop.rule.row(), metrics.end_time);
    Cause {
        id: row.id.to_owned(),
        time: Some(time),
        value: Some(stop.value),
        limit: Some((row.limit)(&model.facility)),
        phase: Some(Phase::at(time, metrics)),
    }
}

/// A property of the whole campaign, so that no run depends on what is made beside it.
fn needs_noise(campaign: &Campaign) -> bool {
    let dispersed = campaign.dispersions.iter().map(|dispersion| dispersion.name.as_str());
    let derived = campaign.derived.iter().map(|derived| derived.name.as_str());
    is_noisy(&campaign.nominal()) || dispersed.chain(derived).any(|name| NOISE.contains(&name))
}
