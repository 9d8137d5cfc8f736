//! Finished runs as rows of the results: outcome and cause of both loops, every requirement, status and agreement.

use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::criteria::first_breach;
use softdock_campaign::requirement::{Requirement, SUCCESS};
use softdock_engine::effective_mass::effective_mass;
use softdock_engine::{Job, is_noisy};
use softdock_kernels::fields::to_vec;
use softdock_kernels::metrics::{Metrics, flags};
use softdock_kernels::model::Model;
use softdock_kernels::outcome::{Finished, Stop};
use softdock_kernels::plant::Plant;
use softdock_results::runs::{
    Agreement, Cause, LoopRow, Outcome, Phase, RequirementColumn, RequirementResult, RunRow, RunsSchema, Status,
};

/// Parameters that need random numbers inside the loop.
const NOISE: [&str; 4] = ["delay_jitter", "drop_probability", "sensor_noise_force", "sensor_noise_moment"];

/// What the rows of a campaign have in common.
pub(crate) struct Ledger<'a> {
    campaign: &'a Campaign,
    /// What the runs have in common.
    pub(crate) job: Job,
    /// The columns of the rows.
    pub(crate) schema: RunsSchema,
}

impl<'a> Ledger<'a> {
    /// Prepares a campaign.
    pub(crate) fn new(campaign: &'a Campaign) -> Self {
        let requirement = |r: &Requirement| RequirementColumn { id: r.column_id(), unit: r.unit.to_owned() };
        let plant = Plant::new(campaign.scenario.model.clone()).with_effects(campaign.effects());
        Self {
            campaign,
            job: Job::new(plant, campaign.seed, needs_noise(campaign)),
            schema: RunsSchema::new(campaign.requirements.iter().map(requirement).collect()),
        }
    }

    /// Finished runs as rows.
    pub(crate) fn rows(&self, finished: &[Finished]) -> Vec<RunRow> {
        finished.par_iter().map(|run| self.row(run)).collect()
    }

    /// A finished run as a row of the results.
    pub(crate) fn row(&self, run: &Finished) -> RunRow {
        let invalid = run.flags & flags::INVALID != 0;
        let model = &self.job.plant;
        let space = self.loop_row(run, &run.space, by_task(model, &run.space));
        let aborted = run.stop.map(|stop| by_rule(model, run, stop));
        let hil = self.loop_row(run, &run.hil, aborted.unwrap_or_else(|| by_task(model, &run.hil)));
        let holds = |side: &LoopRow| side.requirements.iter().all(|result| result.pass == Some(true));
        let passes = if self.campaign.requirements.is_empty() { space.outcome == Outcome::Pass } else { holds(&space) };
        let status = if passes { Status::Pass } else { Status::Fail };
        let verdict = |side: &LoopRow| side.outcome == Outcome::Pass && holds(side);
        let answer = (hil.outcome != Outcome::Aborted).then(|| verdict(&hil));
        RunRow {
            run: run.run,
            outer: self.campaign.outer_of(run.run),
            status: if invalid { Status::Invalid } else { status },
            agreement: if invalid { Agreement::Invalid } else { Agreement::of(verdict(&space), answer) },
            flags: run.flags,
            inputs: to_vec(&run.params),
            effective_mass: effective_mass(&self.job.plant, run).filter(|mass| mass.is_finite()),
            space,
            hil,
        }
    }

    /// A loop with its outcome and the results of all requirements; an invalid run has none.
    fn loop_row(&self, run: &Finished, metrics: &Metrics<f64>, ended: (Outcome, Option<Cause>)) -> LoopRow {
        let requirements = self.campaign.requirements.iter();
        if run.flags & flags::INVALID != 0 {
            let id =
                flags::TABLE.iter().find(|(bit, ..)| run.flags & flags::INVALID & bit != 0).map_or("", |flag| flag.1);
            let cause = Cause { id: id.to_owned(), time: None, value: None, limit: None, phase: None };
            let requirements = requirements.map(|_| RequirementResult::default()).collect();
            return LoopRow { outcome: Outcome::Invalid, cause: Some(cause), metrics: *metrics, requirements };
        }
        let (outcome, cause) = ended;
        let results = requirements.map(|requirement| result(requirement, metrics, outcome)).collect();
        LoopRow { outcome, cause, metrics: *metrics, requirements: results }
    }
}

/// A loop judged by the criteria of its task.
fn by_task(model: &Model, metrics: &Metrics<f64>) -> (Outcome, Option<Cause>) {
    let Some((criterion, breach)) = first_breach(&model.task, metrics) else { return (Outcome::Pass, None) };
    let cause = Cause {
        id: criterion.id.to_owned(),
        time: Some(breach.time),
        value: breach.value,
        limit: (criterion.limit)(&model.task),
        phase: Some(Phase::at(breach.time, metrics)),
    };
    (Outcome::Fail, Some(cause))
}

/// A session that a rule stopped.
fn by_rule(model: &Model, run: &Finished, stop: Stop) -> (Outcome, Option<Cause>) {
    let (row, time) = (stop.rule.row(), run.hil.end_time);
    let cause = Cause {
        id: row.id.to_owned(),
        time: Some(time),
        value: Some(stop.value),
        limit: Some((row.limit)(&model.facility)),
        phase: Some(Phase::at(time, &run.hil)),
    };
    (Outcome::Aborted, Some(cause))
}

/// How a loop meets a requirement. An aborted session gives no answer.
fn result(requirement: &Requirement, metrics: &Metrics<f64>, outcome: Outcome) -> RequirementResult {
    if outcome == Outcome::Aborted {
        return RequirementResult::default();
    }
    let value = match requirement.metric.as_str() {
        SUCCESS => Some(f64::from(u8::from(outcome == Outcome::Pass))),
        metric => metrics.available(metric),
    };
    let margin = requirement.margin(value);
    RequirementResult { margin, pass: Some(margin.is_some_and(|margin| margin >= 0.0)) }
}

/// A property of the whole campaign, so that no run depends on what is made beside it.
fn needs_noise(campaign: &Campaign) -> bool {
    let dispersed = campaign.dispersions.iter().map(|dispersion| dispersion.name.as_str());
    let derived = campaign.derived.iter().map(|derived| derived.name.as_str());
    is_noisy(&campaign.nominal()) || dispersed.chain(derived).any(|name| NOISE.contains(&name))
}
