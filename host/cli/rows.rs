//! Finished runs as rows of the results: status, agreement, and the outcome of every requirement.

use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::requirement::Requirement;
use softdock_engine::effective_mass::effective_mass;
use softdock_engine::{Job, is_noisy};
use softdock_kernels::fields::to_vec;
use softdock_kernels::metrics::{Metrics, flags};
use softdock_kernels::outcome::Finished;
use softdock_kernels::plant::Plant;
use softdock_results::runs::{Agreement, Outcome, RequirementColumn, RunRow, RunsSchema, Status};

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
        let unstable = run.flags & flags::HIL_UNSTABLE != 0;
        let outcomes = |metrics: &Metrics<f64>, diverged: bool| {
            let outcome =
                |requirement| if invalid { Outcome::default() } else { outcome(requirement, metrics, diverged) };
            self.campaign.requirements.iter().map(outcome).collect::<Vec<_>>()
        };
        let (space_outcomes, hil_outcomes) = (outcomes(&run.space, false), outcomes(&run.hil, unstable));
        let docks = [&run.space, &run.hil].map(|metrics| metrics.success > 0.5);
        let passes = match space_outcomes.as_slice() {
            [] => docks[0],
            outcomes => outcomes.iter().all(|outcome| outcome.pass == Some(true)),
        };
        let status = if passes { Status::Pass } else { Status::Fail };
        RunRow {
            run: run.run,
            outer: self.campaign.outer_of(run.run),
            status: if invalid { Status::Invalid } else { status },
            agreement: if invalid { Agreement::Invalid } else { Agreement::of(docks[0], docks[1]) },
            flags: run.flags,
            inputs: to_vec(&run.params),
            effective_mass: effective_mass(&self.job.plant, run).filter(|mass| mass.is_finite()),
            space: run.space,
            hil: run.hil,
            space_outcomes,
            hil_outcomes,
        }
    }
}

/// How a loop stands to a requirement. A facility that diverged fails; a margin that says otherwise is none.
fn outcome(requirement: &Requirement, metrics: &Metrics<f64>, diverged: bool) -> Outcome {
    let margin = requirement.margin(metrics.available(&requirement.metric));
    let margin = margin.filter(|margin| !(diverged && *margin >= 0.0));
    Outcome { margin, pass: Some(margin.is_some_and(|margin| margin >= 0.0)) }
}

/// A property of the whole campaign, so that no run depends on what is made beside it.
fn needs_noise(campaign: &Campaign) -> bool {
    let dispersed = campaign.dispersions.iter().map(|dispersion| dispersion.name.as_str());
    let derived = campaign.derived.iter().map(|derived| derived.name.as_str());
    is_noisy(&campaign.nominal()) || dispersed.chain(derived).any(|name| NOISE.contains(&name))
}
