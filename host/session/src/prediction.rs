//! Prediction of a session: the same draw on facilities as dispersed by the campaign.

use crate::answer::{EndedSession, SessionAnswer};
use crate::error::Result;
use crate::files::readable;
use crate::plan::SessionPlan;
use rayon::prelude::*;
use serde::Serialize;
use softdock_campaign::criteria::succeeds;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::philox;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::prediction::{PredictedRun, expect};
use softdock_realtime::log::codes::StopCause;

/// Metrics that a facility does not measure, or that are undefined for a single run.
const UNMEASURED: [&str; 15] = [
    "peak_leg_force",
    "peak_leg_stroke",
    "end_time",
    "peak_depth",
    "linear_momentum_error",
    "angular_momentum_error",
    "tracking_gain",
    "tracking_lag",
    "tracking_error",
    "tracking_overshoot",
    "restitution",
    "jam_duration",
    "jam_push",
    "jam_moment",
    "jam_squeeze",
];

/// A metric of the run with its 95 % prediction interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricBand {
    /// Name.
    pub name: String,
    /// Unit of the three values.
    pub unit: &'static str,
    /// The run's value.
    pub value: f64,
    /// 2.5 % quantile of the predictions.
    pub lo: f64,
    /// 97.5 % quantile of the predictions.
    pub hi: f64,
    /// Whether the run's value lies in the interval.
    pub inside: bool,
}

/// The prediction of a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionPrediction {
    /// Share of the predictions that meet every criterion of the task.
    pub predicted_success: f64,
    /// Number of predictions.
    pub predictions: u64,
    /// The run's metrics, each with its interval.
    pub metrics: Vec<MetricBand>,
}

/// The answer of a session with its prediction; the last state of `drive.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictedAnswer {
    /// The session's own answer.
    #[serde(flatten)]
    pub answer: SessionAnswer,
    /// Prediction of the model.
    #[serde(flatten)]
    pub prediction: SessionPrediction,
}

impl SessionPlan {
    /// Compares an ended session with `runs` predictions of other draws, and writes the result to `drive.json`.
    ///
    /// # Errors
    /// If the run cannot be predicted on these robots, or the file cannot be written.
    pub fn predict(&self, ended: &EndedSession, runs: u64) -> Result<PredictedAnswer> {
        let prediction = self.prediction(&ended.metrics, runs)?;
        let predicted = PredictedAnswer { answer: ended.answer(self), prediction };
        std::fs::write(self.out.join("drive.json"), readable(&predicted)?)?;
        Ok(predicted)
    }

    fn prediction(&self, metrics: &Metrics<f64>, runs: u64) -> Result<SessionPrediction> {
        let (campaign, task, cycle) = (&self.campaign, &self.task, self.addresses.cycle()?);
        let key = philox::key(campaign.seed);
        let all: Vec<(Metrics<f64>, bool)> = (0..runs)
            .into_par_iter()
            .map(|k| {
                // The draws after this one, so that the result is reproducible.
                let facility = campaign.draw((task.run + 1 + k) % campaign.runs)?.params;
                let expected = expect(task, key, &facility, cycle)?;
                Ok((expected.metrics, passes(task, &expected)))
            })
            .collect::<Result<_>>()?;
        let columns: Vec<Vec<f64>> = all.iter().map(|(metrics, _)| to_vec(metrics)).collect();
        let lines = fields::<f64, Metrics<f64>>().into_iter().zip(to_vec(metrics)).enumerate();
        let lines = lines.filter(|(_, (field, _))| is_measured(&field.name)).map(|(i, (field, value))| {
            let mut sorted: Vec<f64> = columns.iter().map(|row| row[i]).collect();
            sorted.sort_by(f64::total_cmp);
            let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
            let (lo, hi) = (at(0.025), at(0.975));
            MetricBand { name: field.name, unit: field.unit, value, lo, hi, inside: (lo..=hi).contains(&value) }
        });
        let predicted_success = all.iter().filter(|(_, passes)| *passes).count() as f64 / runs as f64;
        Ok(SessionPrediction { predicted_success, predictions: runs, metrics: lines.collect() })
    }
}

/// Whether a session gives the metric of this name.
pub fn is_measured(name: &str) -> bool {
    !(UNMEASURED.contains(&name) || name.starts_with("peak_") && name.ends_with("_time"))
}

/// Whether a predicted run is completed and meets every criterion of the task.
fn passes(task: &SessionTask, predicted: &PredictedRun) -> bool {
    predicted.last.cause == StopCause::Completed && succeeds(&task.plant.task, &predicted.metrics)
}
