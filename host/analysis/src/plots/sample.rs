//! Data for the figures of a campaign, read in one pass: moments of all runs, values of a bounded number of them.

use std::path::Path;

use softdock_results::Table;
use softdock_results::runs::{Agreement, Outcome, input_fields, requirement_columns};

use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::moments::Moments;
use crate::tally::LOOPS;
use crate::{Error, Result};

/// Runs whose values are kept; of a larger campaign every second, third ... run is kept, which is a random sample
/// as long as runs are independent. 100,000 runs of 40 columns are 64 MB.
const MOST_RUNS: u64 = 100_000;

/// Columns whose largest size over all runs is reported.
pub(crate) const CONSERVED: [&str; 4] = [
    "space_linear_momentum_error_kg_m_per_s",
    "space_angular_momentum_error_kg_m2_per_s",
    "hil_linear_momentum_error_kg_m_per_s",
    "hil_angular_momentum_error_kg_m2_per_s",
];

/// Metrics of a test motion of the robots; null in campaigns without one.
pub(crate) const TRACKING: [&str; 4] =
    ["hil_tracking_gain", "hil_tracking_lag_rad", "hil_tracking_error_m", "hil_tracking_overshoot"];

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
    /// Per requirement: space, facility.
    pub(crate) margins: Vec<[Vec<Option<f64>>; 2]>,
    pub(crate) inputs: Vec<Input>,
    pub(crate) delay: Vec<f64>,
    pub(crate) injected_energy: Vec<Option<f64>>,
    /// The [`TRACKING`] columns.
    pub(crate) tracking: [Vec<Option<f64>>; TRACKING.len()],
    /// Largest size of the [`CONSERVED`] columns over all runs.
    pub(crate) conserved: [f64; CONSERVED.len()],
}

impl Sample {
    /// Reads the runs of a campaign; `inputs` are column names.
    pub(crate) fn read(content: &Content, facts: &CampaignFacts, inputs: &[String]) -> Result<Self> {
        let (index, results) = (&content.shards, content.results.as_path());
        let described = index.columns()?;
        let input = |name: &String| {
            let column = described.column(name).ok_or_else(|| lacking(results, name))?;
            Ok(Input {
                column: name.clone(),
                name: in_words(name),
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
        for batch in index.read_columns(&columns(facts, inputs)) {
            sample.add(&batch?, facts).map_err(|name| lacking(results, &name))?;
        }
        Ok(sample)
    }

    /// Number of kept runs.
    pub(crate) fn runs(&self) -> usize {
        self.agreement.len()
    }

    /// Adds a batch; an error is the name of a column that is not what it should be.
    fn add(&mut self, table: &Table, facts: &CampaignFacts) -> std::result::Result<(), String> {
        let numbers = |name: &str| table.f64s(name).ok_or_else(|| name.to_owned());
        let run = table.u64s("run").ok_or("run")?;
        let kept: Vec<usize> = (0..table.rows()).filter(|row| run[*row].is_multiple_of(self.stride)).collect();
        let agreement = table.column("agreement").ok_or("agreement")?;
        for row in &kept {
            let word = agreement.values.word(*row).and_then(Agreement::from_word);
            self.agreement.push(word.ok_or("agreement")?);
        }
        for (side, success) in LOOPS.into_iter().zip(&mut self.success) {
            let name = format!("{side}_outcome");
            let outcomes = table.column(&name).ok_or(name)?;
            let passes = |row: &usize| outcomes.values.word(*row) == Some(Outcome::Pass.word());
            success.extend(kept.iter().map(passes));
        }
        for (requirement, margins) in facts.requirements.iter().zip(&mut self.margins) {
            for (side, margins) in LOOPS.into_iter().zip(margins) {
                let [name, _] = requirement_columns(side, &requirement.column_id());
                let values = numbers(&name)?;
                margins.extend(kept.iter().map(|row| values[*row]));
            }
        }
        for input in &mut self.inputs {
            let values = numbers(&input.column)?;
            values.iter().flatten().for_each(|value| input.moments.add(*value));
            input.values.extend(kept.iter().map(|row| values[*row].unwrap_or(f64::NAN)));
        }
        let (delay, energy) = (numbers("in_loop_delay_s")?, numbers("hil_injected_energy_j")?);
        self.delay.extend(kept.iter().map(|row| delay[*row].unwrap_or(f64::NAN)));
        self.injected_energy.extend(kept.iter().map(|row| energy[*row]));
        for (name, kept_values) in TRACKING.into_iter().zip(&mut self.tracking) {
            let values = numbers(name)?;
            kept_values.extend(kept.iter().map(|row| values[*row]));
        }
        for (name, largest) in CONSERVED.into_iter().zip(&mut self.conserved) {
            *largest = numbers(name)?.iter().flatten().fold(*largest, |most, value| most.max(value.abs()));
        }
        Ok(())
    }
}

fn columns(facts: &CampaignFacts, inputs: &[String]) -> Vec<String> {
    let fixed = ["run", "agreement", "space_outcome", "hil_outcome", "in_loop_delay_s", "hil_injected_energy_j"];
    let mut names: Vec<String> = fixed.into_iter().chain(CONSERVED).chain(TRACKING).map(str::to_owned).collect();
    for requirement in facts.requirements {
        names.extend(LOOPS.map(|side| requirement_columns(side, &requirement.column_id())[0].clone()));
    }
    names.extend(inputs.iter().cloned());
    names
}

/// The name of an input column in words, without prefix and unit.
fn in_words(column: &str) -> String {
    let known = input_fields().into_iter().find(|field| column.strip_prefix("in_") == Some(&field.column()));
    known.map_or(column.to_owned(), |field| field.name).replace('_', " ")
}

fn lacking(results: &Path, name: &str) -> Error {
    Error::Results { path: results.to_owned(), what: format!("no column `{name}` of the expected type") }
}
