//! Judgement of runs: outcome and cause of both loops, custom metrics, requirements, status and agreement.
//!
//! A run is judged by its row alone: applied inputs, metrics of both loops, flags, and the rule that stopped the
//! session. No run is simulated, so finished runs can be judged again by other criteria and requirements.

use softdock_campaign::criteria::first_breach;
use softdock_campaign::metric::{CustomMetric, custom_values};
use softdock_campaign::requirement::{Requirement, Subject};
use softdock_campaign::{Campaign, ScenarioKey};
use softdock_kernels::metrics::{Metrics, flags};
use softdock_kernels::model::Task;
use softdock_results::runs::{
    Agreement, Cause, CustomMetricColumn, KeyColumn, LoopRow, Outcome, Phase, RequirementColumn, RequirementResult,
    RunRow, RunsSchema, Status,
};

/// Criteria by which the runs of a campaign are judged.
#[derive(Clone, Debug)]
pub struct Judge<'a> {
    task: &'a Task,
    metrics: &'a [CustomMetric],
    requirements: &'a [Requirement],
    keys: Vec<KeyColumn>,
}

impl<'a> Judge<'a> {
    /// Returns the criteria, custom metrics and requirements of a campaign.
    pub fn of(campaign: &'a Campaign) -> Self {
        let (metrics, requirements) = (&campaign.metrics, &campaign.requirements);
        let key = |key: &ScenarioKey| KeyColumn {
            column: key.column(),
            unit: key.unit.to_owned(),
            meaning: format!("`{}`", key.path),
        };
        Self { task: &campaign.scenario.model.task, metrics, requirements, keys: campaign.keys().map(key).collect() }
    }

    /// Returns the columns of the judged runs.
    pub fn schema(&self) -> RunsSchema {
        let own = |metric: &CustomMetric| CustomMetricColumn {
            column: metric.column(),
            unit: metric.unit.clone(),
            meaning: metric.text.clone(),
        };
        let requirement = |r: &Requirement| RequirementColumn { id: r.column_id(), unit: r.unit().to_owned() };
        let custom_metrics = self.metrics.iter().map(own).collect();
        RunsSchema::new(self.keys.clone(), custom_metrics, self.requirements.iter().map(requirement).collect())
    }

    /// Judges a run by its inputs, metrics, flags and, for an aborted session, its cause.
    pub fn judge(&self, row: &mut RunRow) {
        let invalid = row.flags & flags::INVALID != 0;
        for side in [&mut row.space, &mut row.hil] {
            if invalid {
                (side.outcome, side.cause) = (Outcome::Invalid, Some(invalidity(row.flags)));
            } else if side.outcome != Outcome::Aborted {
                (side.outcome, side.cause) = self.by_task(&side.metrics);
            }
            side.custom_metrics = custom_values(self.metrics, &side.metrics, row.effective_mass, &row.inputs);
            side.requirements = self.requirements.iter().map(|requirement| result(requirement, side)).collect();
        }
        let on_space = |requirement: &Requirement| requirement.subject == Subject::Space;
        let holds = |side: &LoopRow| {
            let results = self.requirements.iter().zip(&side.requirements);
            results.filter(|(requirement, _)| on_space(requirement)).all(|(_, result)| result.pass == Some(true))
        };
        let verdict = |side: &LoopRow| side.outcome == Outcome::Pass && holds(side);
        let passes =
            if self.requirements.iter().any(on_space) { holds(&row.space) } else { row.space.outcome == Outcome::Pass };
        let answer = (row.hil.outcome != Outcome::Aborted).then(|| verdict(&row.hil));
        (row.status, row.agreement) = match (invalid, passes) {
            (true, _) => (Status::Invalid, Agreement::Invalid),
            (false, true) => (Status::Pass, Agreement::of(verdict(&row.space), answer)),
            (false, false) => (Status::Fail, Agreement::of(verdict(&row.space), answer)),
        };
    }

    /// Judges a loop by the criteria of the task.
    fn by_task(&self, metrics: &Metrics<f64>) -> (Outcome, Option<Cause>) {
        let Some((criterion, breach)) = first_breach(self.task, metrics) else { return (Outcome::Pass, None) };
        let cause = Cause {
            id: criterion.id.to_owned(),
            time: Some(breach.time),
            value: breach.value,
            limit: (criterion.limit)(self.task),
            phase: Some(Phase::at(breach.time, metrics)),
        };
        (Outcome::Fail, Some(cause))
    }
}

/// Returns the first flag that makes a run invalid.
fn invalidity(set: u32) -> Cause {
    let flag = flags::TABLE.iter().find(|(bit, ..)| set & flags::INVALID & bit != 0);
    let id = flag.map_or("", |(_, name, _)| name).to_owned();
    Cause { id, time: None, value: None, limit: None, phase: None }
}

/// Returns the result of a requirement in a loop; none for an invalid run or an aborted session.
fn result(requirement: &Requirement, side: &LoopRow) -> RequirementResult {
    if matches!(side.outcome, Outcome::Aborted | Outcome::Invalid) {
        return RequirementResult::default();
    }
    let value = requirement.metric.value(side.outcome == Outcome::Pass, &side.metrics, &side.custom_metrics);
    let margin = requirement.margin(value);
    RequirementResult { margin, pass: Some(margin.is_some_and(|margin| margin >= 0.0)) }
}
