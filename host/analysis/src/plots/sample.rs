//! Data for the figures of a campaign, read in one pass: moments of all runs, values of a bounded number of them.

use softdock_results::Table;
use softdock_results::columns::{AGREEMENT, ColumnError, ColumnHandle, Loop, RUN, input_named, parameter_of};
use softdock_results::runs::{Agreement, Outcome};

use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::moments::Moments;
use crate::{AnalysisError, Result};

/// Runs whose values are kept; of a larger campaign every second, third ... run is kept, which is a random sample
/// as long as runs are independent. 100,000 runs of 40 columns are 64 MB.
const MOST_RUNS: u64 = 100_000;

/// Metrics whose largest size over all runs is reported.
pub(crate) const CONSERVED: [(Loop, &str); 4] = [
    (Loop::Space, "linear_momentum_error"),
    (Loop::Space, "angular_momentum_error"),
    (Loop::Hil, "linear_momentum_error"),
    (Loop::Hil, "angular_momentum_error"),
];

/// Metrics of the robots' response to a test motion; null in campaigns without one.
pub(crate) const TRACKING: [&str; 4] = ["tracking_gain", "tracking_lag", "tracking_error", "tracking_overshoot"];

/// A dispersed input.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub(crate) column: String,
    /// Name as text.
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) meaning: String,
    /// Of all runs.
    pub(crate) moments: Moments,
    /// Of the kept runs.
    pub(crate) values: Vec<f64>,
}

/// The kept runs, column by column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sample {
    /// Every so many runs one is kept.
    pub(crate) stride: u64,
    pub(crate) agreement: Vec<Agreement>,
    /// Task success: space, facility; an aborted session and an invalid run have none.
    pub(crate) success: [Vec<bool>; 2],
    /// Cause of each kept run that does not pass: space, facility; read only for maps of outcomes.
    pub(crate) causes: [Vec<String>; 2],
    /// Per requirement: space, facility.
    pub(crate) margins: Vec<[Vec<Option<f64>>; 2]>,
    pub(crate) inputs: Vec<Input>,
    pub(crate) delay: Vec<f64>,
    pub(crate) injected_energy: Vec<Option<f64>>,
    /// The [`TRACKING`] metrics.
    pub(crate) tracking: [Vec<Option<f64>>; TRACKING.len()],
    /// Largest size of the [`CONSERVED`] metrics over all runs.
    pub(crate) conserved: [f64; CONSERVED.len()],
}

impl Sample {
    /// Reads the runs of a campaign; `inputs` are column names, and `causes` asks for the causes of runs that do not pass.
    pub(crate) fn read(content: &Content, facts: &CampaignFacts, inputs: &[String], causes: bool) -> Result<Self> {
        let (index, results) = (&content.shards, content.results.as_path());
        let described = index.columns()?;
        let input = |name: &String| {
            let column = described
                .column(name)
                .ok_or_else(|| AnalysisError::of_column(results, &ColumnError::Missing(name.clone())))?;
            Ok(Input {
                column: name.clone(),
                name: in_words(name, &column.description),
                unit: column.unit.clone(),
                meaning: column.description.clone(),
                moments: Moments::default(),
                values: Vec::new(),
            })
        };
        let mut sample = Self {
            stride: facts.plan.runs.div_ceil(MOST_RUNS).max(1),
            margins: facts.requirements.iter().map(|_| [Vec::new(), Vec::new()]).collect(),
            inputs: inputs.iter().map(input).collect::<Result<_>>()?,
            ..Self::default()
        };
        for batch in index.read_columns(&columns(facts, inputs, causes)) {
            sample.add(&batch?, facts, causes).map_err(|error| AnalysisError::of_column(results, &error))?;
        }
        Ok(sample)
    }

    /// Number of kept runs.
    pub(crate) fn runs(&self) -> usize {
        self.agreement.len()
    }

    /// Adds a batch.
    fn add(&mut self, table: &Table, facts: &CampaignFacts, causes: bool) -> std::result::Result<(), ColumnError> {
        let run = table.get(&RUN)?;
        let kept: Vec<usize> = (0..table.rows()).filter(|row| run[*row].is_multiple_of(self.stride)).collect();
        let agreement = table.get(&AGREEMENT)?;
        self.agreement.extend(kept.iter().map(|row| agreement.at(*row)));
        for (side, success) in Loop::BOTH.into_iter().zip(&mut self.success) {
            let outcomes = table.get(&side.outcome())?;
            success.extend(kept.iter().map(|row| outcomes.at(*row) == Outcome::Pass));
        }
        for (side, kept_causes) in Loop::BOTH.into_iter().zip(&mut self.causes).filter(|_| causes) {
            let found = table.get(&side.cause())?;
            kept_causes.extend(kept.iter().map(|row| found.at(*row).to_owned()));
        }
        for (requirement, margins) in facts.requirements.iter().zip(&mut self.margins) {
            for (side, margins) in Loop::BOTH.into_iter().zip(margins) {
                let values = table.get(&side.margin(&requirement.column_id()))?;
                margins.extend(kept.iter().map(|row| values[*row]));
            }
        }
        for input in &mut self.inputs {
            let values = table.get(&ColumnHandle::<f64>::named(input.column.clone()))?;
            values.iter().flatten().for_each(|value| input.moments.add(*value));
            input.values.extend(kept.iter().map(|row| values[*row].unwrap_or(f64::NAN)));
        }
        let (delay, energy) = (table.get(&delay())?, table.get(&injected_energy())?);
        self.delay.extend(kept.iter().map(|row| delay[*row].unwrap_or(f64::NAN)));
        self.injected_energy.extend(kept.iter().map(|row| energy[*row]));
        for (column, kept_values) in tracking().zip(&mut self.tracking) {
            let values = table.get(&column)?;
            kept_values.extend(kept.iter().map(|row| values[*row]));
        }
        for (column, largest) in conserved().zip(&mut self.conserved) {
            *largest = table.get(&column)?.iter().flatten().fold(*largest, |most, value| most.max(value.abs()));
        }
        Ok(())
    }
}

fn delay() -> ColumnHandle<f64> {
    input_named("loop_delay")
}

fn injected_energy() -> ColumnHandle<f64> {
    Loop::Hil.metric_named("injected_energy")
}

fn tracking() -> impl Iterator<Item = ColumnHandle<f64>> {
    TRACKING.into_iter().map(|metric| Loop::Hil.metric_named(metric))
}

fn conserved() -> impl Iterator<Item = ColumnHandle<f64>> {
    CONSERVED.into_iter().map(|(side, metric)| side.metric_named(metric))
}

/// Names of all columns that are read.
fn columns(facts: &CampaignFacts, inputs: &[String], causes: bool) -> Vec<String> {
    let mut names = vec![RUN.name().to_owned(), AGREEMENT.name().to_owned()];
    names.extend(Loop::BOTH.map(|side| side.outcome().into_name()));
    if causes {
        names.extend(Loop::BOTH.map(|side| side.cause().into_name()));
    }
    let numbers = [delay(), injected_energy()].into_iter().chain(conserved()).chain(tracking());
    names.extend(numbers.map(ColumnHandle::into_name));
    for requirement in facts.requirements {
        names.extend(Loop::BOTH.map(|side| side.margin(&requirement.column_id()).into_name()));
    }
    names.extend(inputs.iter().cloned());
    names
}

/// The name of an input column in words, without prefix and unit; that of a key of the scenario is its path.
fn in_words(column: &str, description: &str) -> String {
    let path = || description.trim_matches('`').trim_start_matches("scenario.").to_owned();
    parameter_of(column).map_or_else(path, |field| field.name.replace('_', " "))
}
