//! Conversion of finished runs to judged rows.

use rayon::prelude::*;
use softdock_analysis::Judge;
use softdock_campaign::{Campaign, OwnScenario, Problems};
use softdock_engine::effective_mass::effective_mass;
use softdock_engine::{Job, RunInput, is_noisy};
use softdock_kernels::fields::{from_slice, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::Model;
use softdock_kernels::outcome::{Finished, Stop};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_results::runs::{Agreement, Cause, LoopRow, Outcome, Phase, RunRow, RunsSchema, Status};
use softdock_results::traces::NOMINAL_RUN;
use std::borrow::Cow;
use std::sync::Arc;

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

    /// The input of a run, or of the undispersed one; with exactly these values of the parameters, if they are given.
    ///
    /// # Errors
    /// If the scenario's reader refuses the run's values of the campaign's keys.
    pub(crate) fn input(&self, run: u64, given: Option<Params<f64>>) -> Result<RunInput, Problems> {
        if run == NOMINAL_RUN {
            return Ok(RunInput::new(run, given.unwrap_or_else(|| self.campaign.nominal())));
        }
        if !self.campaign.has_keys()
            && let Some(params) = given
        {
            return Ok(RunInput::new(run, params));
        }
        let draw = self.campaign.draw(run)?;
        let plant = draw.own.map(|own| Arc::new(self.own_plant(own.model)));
        Ok(RunInput { run, params: given.unwrap_or(draw.params), plant })
    }

    /// The input of a row's run, with exactly the parameters that were applied.
    ///
    /// # Errors
    /// See [`input`](Self::input).
    pub(crate) fn input_of(&self, row: &RunRow) -> Result<RunInput, Problems> {
        self.input(row.run, Some(params_of(row)))
    }

    /// The plant of a run.
    pub(crate) fn plant_of(&self, run: u64) -> Cow<'_, Plant> {
        self.plant_with(self.own(run))
    }

    /// The plant of a run that has this of the scenario for itself.
    fn plant_with(&self, own: Option<OwnScenario>) -> Cow<'_, Plant> {
        own.map_or(Cow::Borrowed(&self.job.plant), |own| Cow::Owned(self.own_plant(own.model)))
    }

    /// What a run has of the scenario for itself.
    fn own(&self, run: u64) -> Option<OwnScenario> {
        let is_drawn = self.campaign.has_keys() && run != NOMINAL_RUN;
        is_drawn.then(|| self.campaign.draw(run).expect("its input was drawn before").own).flatten()
    }

    fn own_plant(&self, model: Model) -> Plant {
        Plant::new(model).with_effects(self.job.plant.effects)
    }

    /// A finished run as a row of the results.
    pub(crate) fn row(&self, run: &Finished) -> RunRow {
        let own = self.own(run.run);
        let keys = match &own {
            Some(own) => own.keys.clone(),
            None => self.campaign.keys().map(|key| key.nominal).collect(),
        };
        let plant = self.plant_with(own);
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
            inputs: to_vec(&run.params).into_iter().chain(keys).collect(),
            effective_mass: effective_mass(&plant, run).filter(|mass| mass.is_finite()),
            space: unjudged(&run.space, None),
            hil: unjudged(&run.hil, run.stop),
        };
        self.judge.judge(&mut row);
        row
    }
}

/// The parameters that were applied in a row's run.
pub(crate) fn params_of(row: &RunRow) -> Params<f64> {
    // The keys of the scenario stand behind them.
    from_slice(&row.inputs)
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
    campaign.key_ends().iter().chain([&campaign.nominal()]).any(is_noisy)
        || dispersed.chain(derived).any(|name| NOISE.contains(&name))
}
