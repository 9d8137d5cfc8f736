//! One pass over a campaign's runs for the page: exact counts of all runs, and a stratified sample of them.
//!
//! Memory does not grow with the number of runs. Edges of bins are quantiles of the first [`HEAD`] runs; counts are of all.

use std::collections::{BTreeMap, BTreeSet};

use softdock_kernels::fields::Field;
use softdock_results::Table;
use softdock_results::columns::{
    AGREEMENT, ColumnError, ColumnHandle, FLAGS, Loop, RUN, Texts, Words, input_named, parameter_of,
};
use softdock_results::runs::{Agreement, Outcome, PHASE_WORDS, Phase, metric_fields};

use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::moments::Moments;
use crate::page_data::counts::Counts;
use crate::page_data::strata::{CODES, KeptRun, Smallest, Stratum, joined, mixed};
use crate::tally::metric_column;
use crate::{AnalysisError, Result};

/// Runs whose values place the edges of bins.
pub(crate) const HEAD: usize = 16_384;

/// Numbers of the sample, rows times columns; five significant digits of one take about three bytes of the page.
const MOST_NUMBERS: usize = 190_000;

/// Least and greatest number of runs in the sample.
const SAMPLE: [usize; 2] = [1_500, 8_000];

/// Worst runs of a requirement in one loop that are always in the sample.
const WORST: usize = 10;

/// Metrics of the page besides those of requirements and those that the campaign defines.
const METRICS: [&str; 20] = [
    "touch_time",
    "approach_speed",
    "restitution",
    "contact_count",
    "contact_duration",
    "impulse",
    "peak_contact_force",
    "peak_interface_force",
    "peak_contact_moment",
    "peak_depth",
    "capture_time",
    "capture_offset",
    "miss_distance",
    "insertion",
    "injected_energy",
    "tracking_gain",
    "tracking_lag",
    "tracking_error",
    "tracking_overshoot",
    "end_time",
];

/// Metrics whose largest size over all runs is reported.
pub(crate) const CONSERVED: [(Loop, &str); 4] = [
    (Loop::Space, "linear_momentum_error"),
    (Loop::Space, "angular_momentum_error"),
    (Loop::Hil, "linear_momentum_error"),
    (Loop::Hil, "angular_momentum_error"),
];

/// What a column of the page holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Group {
    /// Dispersed or applied input.
    Input,
    /// Metric of a loop.
    Metric,
    /// Margin of a requirement in a loop.
    Margin,
    /// Time, value or limit of the cause of a loop.
    Cause,
}

/// A column of numbers.
#[derive(Clone, Debug)]
pub(crate) struct NumberColumn {
    /// Name in the results.
    pub(crate) name: String,
    /// Name as text, without prefix and unit.
    pub(crate) label: String,
    /// SI unit.
    pub(crate) unit: String,
    pub(crate) meaning: String,
    pub(crate) group: Group,
    /// The loop, unless it is an input.
    pub(crate) side: Option<Loop>,
    /// Of all runs; of inputs alone.
    pub(crate) moments: Moments,
}

/// The runs that the page shows, with what was counted over all of them.
#[derive(Default)]
pub(crate) struct PageRuns {
    pub(crate) columns: Vec<NumberColumn>,
    /// Number of dispersed inputs, which are the first columns.
    pub(crate) inputs: usize,
    /// Ids of causes; the first stands for none.
    pub(crate) causes: Vec<String>,
    /// The sample, in the order of run numbers.
    pub(crate) sample: Vec<KeptRun>,
    /// Runs of each stratum among all runs, in the order of [`Stratum::ALL`].
    pub(crate) strata: [u64; Stratum::ALL.len()],
    /// Runs drawn evenly from all, for quantiles.
    pub(crate) even: Vec<KeptRun>,
    pub(crate) counts: Counts,
    /// Largest size of the [`CONSERVED`] metrics over all runs.
    pub(crate) conserved: [f64; CONSERVED.len()],
}

impl PageRuns {
    /// Reads the runs of a campaign once; `inputs` are names of the dispersed columns.
    ///
    /// # Errors
    /// If the runs cannot be read, or lack a column.
    pub(crate) fn read(content: &Content, facts: &CampaignFacts, inputs: &[String]) -> Result<Self> {
        let described = content.shards.columns()?;
        let lacks = |error: &ColumnError| AnalysisError::of_column(&content.results, error);
        let columns = columns(&described, facts, inputs).map_err(|error| lacks(&error))?;
        let names: Vec<String> = names(&columns);
        let traced = content.traces.kept.iter().map(|trace| trace.run).collect();
        let mut pass = Pass::new(columns, inputs.len(), facts, traced);
        for batch in content.shards.read_columns(&names) {
            pass.add(&batch?).map_err(|error| lacks(&error))?;
        }
        Ok(pass.finish())
    }

    /// Place of a column of numbers.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The dispersed inputs.
    pub(crate) fn dispersed(&self) -> &[NumberColumn] {
        &self.columns[..self.inputs]
    }
}

/// Columns that are read besides the numbers.
fn names(columns: &[NumberColumn]) -> Vec<String> {
    let mut names: BTreeSet<String> = [RUN.name(), AGREEMENT.name(), FLAGS.name()].map(str::to_owned).into();
    for side in Loop::BOTH {
        names.extend([side.outcome().into_name(), side.cause().into_name(), side.cause_phase().into_name()]);
    }
    names.extend(conserved().map(ColumnHandle::into_name));
    names.extend(columns.iter().map(|column| column.name.clone()));
    names.into_iter().collect()
}

fn conserved() -> impl Iterator<Item = ColumnHandle<f64>> {
    CONSERVED.into_iter().map(|(side, metric)| side.metric_named(metric))
}

/// Inputs, causes, margins and metrics, each once.
fn columns(
    described: &Table,
    facts: &CampaignFacts,
    inputs: &[String],
) -> std::result::Result<Vec<NumberColumn>, ColumnError> {
    let mut columns: Vec<NumberColumn> = Vec::new();
    let mut push = |name: String, label: Option<String>, group: Group, side: Option<Loop>| {
        if columns.iter().any(|column| column.name == name) {
            return Ok(());
        }
        let own = described.column(&name).ok_or_else(|| ColumnError::Missing(name.clone()))?;
        let label = label.unwrap_or_else(|| input_label(&name, &own.description));
        let (unit, meaning) = (own.unit.clone(), own.description.clone());
        columns.push(NumberColumn { name, label, unit, meaning, group, side, moments: Moments::default() });
        Ok(())
    };
    for input in inputs {
        push(input.clone(), None, Group::Input, None)?;
    }
    push(input_named("loop_delay").into_name(), None, Group::Input, None)?;
    for side in Loop::BOTH {
        for (column, label) in [
            (side.cause_time(), "cause, time"),
            (side.cause_value(), "cause, value"),
            (side.cause_limit(), "cause, limit"),
        ] {
            push(column.into_name(), Some(label.to_owned()), Group::Cause, Some(side))?;
        }
    }
    for requirement in facts.requirements {
        for side in Loop::BOTH {
            let label = format!("margin of {}", requirement.id);
            push(side.margin(&requirement.column_id()).into_name(), Some(label), Group::Margin, Some(side))?;
            if let Some(column) = metric_column(side, requirement) {
                let label = requirement.metric.name.replace('_', " ");
                push(column.into_name(), Some(label), Group::Metric, Some(side))?;
            }
        }
    }
    let fields = metric_fields();
    for name in METRICS {
        let field: &Field = fields.iter().find(|field| field.name == name).expect("a metric of the table");
        for side in Loop::BOTH {
            if let Some(column) = side.metric(field) {
                push(column.into_name(), Some(name.replace('_', " ")), Group::Metric, Some(side))?;
            }
        }
    }
    for column in described.columns.iter().filter(|column| column.source == softdock_results::runs::CUSTOM_SOURCE) {
        for side in Loop::BOTH {
            if let Some(own) = side.strip(&column.name).filter(|own| !own.starts_with("margin_")) {
                push(column.name.clone(), Some(own.replace('_', " ")), Group::Metric, Some(side))?;
            }
        }
    }
    Ok(columns)
}

/// The name of an input column as text, without prefix and unit; that of a key of the scenario is its path.
fn input_label(column: &str, description: &str) -> String {
    let path = || description.trim_matches('`').trim_start_matches("scenario.").to_owned();
    parameter_of(column).map_or_else(path, |field| field.name.replace('_', " "))
}

/// The pass under way.
struct Pass {
    runs: PageRuns,
    /// Places of the margins: per requirement in space, on the facility.
    margins: Vec<[usize; 2]>,
    traced: BTreeSet<u64>,
    /// The runs of `traced`.
    of_traces: Vec<KeptRun>,
    strata: Vec<Smallest<u64>>,
    even: Smallest<u64>,
    /// Per margin column.
    worst: Vec<Smallest<(u64, u64)>>,
    places: BTreeMap<String, u8>,
    most: usize,
}

/// The columns of one batch.
struct Batch<'a> {
    run: &'a [u64],
    flags: &'a [u32],
    agreement: Words<'a, Agreement>,
    outcome: [Words<'a, Outcome>; 2],
    cause: [Texts<'a>; 2],
    phase: [Words<'a, Option<Phase>>; 2],
    numbers: Vec<&'a [Option<f64>]>,
}

impl Pass {
    fn new(columns: Vec<NumberColumn>, inputs: usize, facts: &CampaignFacts, traced: BTreeSet<u64>) -> Self {
        let most = (MOST_NUMBERS / columns.len().max(1)).clamp(SAMPLE[0], SAMPLE[1]);
        let place = |name: &str| columns.iter().position(|column| column.name == name);
        let margins: Vec<[usize; 2]> = facts
            .requirements
            .iter()
            .map(|requirement| {
                Loop::BOTH.map(|side| place(side.margin(&requirement.column_id()).name()).expect("a column"))
            })
            .collect();
        Self {
            strata: Stratum::ALL.iter().map(|_| Smallest::new(most)).collect(),
            even: Smallest::new(most),
            worst: margins.iter().flatten().map(|_| Smallest::new(WORST)).collect(),
            places: BTreeMap::new(),
            of_traces: Vec::new(),
            runs: PageRuns {
                counts: Counts::new(inputs, margins.len()),
                columns,
                inputs,
                causes: vec![softdock_results::columns::NO_CAUSE.to_owned()],
                ..PageRuns::default()
            },
            margins,
            traced,
            most,
        }
    }

    fn add(&mut self, table: &Table) -> std::result::Result<(), ColumnError> {
        let [space, hil] = Loop::BOTH;
        let number = |column: &NumberColumn| table.get(&ColumnHandle::<f64>::named(column.name.clone()));
        let batch = Batch {
            run: table.get(&RUN)?,
            flags: table.get(&FLAGS)?,
            agreement: table.get(&AGREEMENT)?,
            outcome: [table.get(&space.outcome())?, table.get(&hil.outcome())?],
            cause: [table.get(&space.cause())?, table.get(&hil.cause())?],
            phase: [table.get(&space.cause_phase())?, table.get(&hil.cause_phase())?],
            numbers: self.runs.columns.iter().map(number).collect::<std::result::Result<_, _>>()?,
        };
        for (column, largest) in conserved().zip(&mut self.runs.conserved) {
            *largest = table.get(&column)?.iter().flatten().fold(*largest, |most, value| most.max(value.abs()));
        }
        let inputs =
            self.runs.columns.iter_mut().zip(&batch.numbers).filter(|(column, _)| column.group == Group::Input);
        for (column, values) in inputs {
            values.iter().flatten().for_each(|value| column.moments.add(*value));
        }
        (0..table.rows()).for_each(|row| self.add_row(&batch, row));
        Ok(())
    }

    fn add_row(&mut self, batch: &Batch, row: usize) {
        let (run, agreement) = (batch.run[row], batch.agreement.at(row));
        let stratum = Stratum::of(agreement);
        self.runs.strata[stratum as usize] += 1;
        let success = [0, 1].map(|side: usize| batch.outcome[side].at(row) == Outcome::Pass);
        let inputs = batch.numbers[..self.runs.inputs].iter().map(|values| values[row].unwrap_or(f64::NAN));
        let margins = self.margins.iter().map(|sides| sides.map(|column| batch.numbers[column][row]));
        self.runs.counts.add(inputs, margins, agreement, success);
        let cause: [u8; 2] = [0, 1].map(|side: usize| self.cause_code(batch.cause[side].at(row)));
        let kept = || {
            let code = |side: usize| {
                let phase = batch.phase[side].at(row).map_or(PHASE_WORDS.len() as u8 - 1, |phase| phase as u8);
                [batch.outcome[side].at(row) as u8, cause[side], phase]
            };
            let ([a, b, c], [d, e, f]) = (code(0), code(1));
            let codes: [u8; CODES] = [agreement as u8, a, b, c, d, e, f];
            let numbers = batch.numbers.iter().map(|values| values[row].map_or(f32::NAN, |value| value as f32));
            KeptRun { run, flags: batch.flags[row], codes, numbers: numbers.collect() }
        };
        self.strata[stratum as usize].add(mixed(run), kept);
        self.even.add(mixed(run), kept);
        for (column, worst) in self.margins.iter().flatten().zip(&mut self.worst) {
            if let Some(margin) = batch.numbers[*column][row].filter(|_| stratum != Stratum::Invalid) {
                worst.add((ordered(margin), run), kept);
            }
        }
        if self.traced.contains(&run) {
            self.of_traces.push(kept());
        }
    }

    /// Code of a cause; those beyond 255 share the last one.
    fn cause_code(&mut self, id: &str) -> u8 {
        if id == self.runs.causes[0] {
            return 0;
        }
        if let Some(code) = self.places.get(id) {
            return *code;
        }
        let code = self.runs.causes.len().min(255) as u8;
        if usize::from(code) == self.runs.causes.len() {
            self.runs.causes.push(id.to_owned());
        }
        self.places.insert(id.to_owned(), code);
        code
    }

    fn finish(self) -> PageRuns {
        let mut runs = self.runs;
        runs.counts.close();
        let always = self.of_traces.into_iter().chain(self.worst.into_iter().flat_map(Smallest::into_runs)).collect();
        runs.sample = joined(always, self.strata.into_iter().map(Smallest::into_runs).collect(), self.most);
        runs.even = self.even.into_runs();
        runs
    }
}

/// A number in the order of `f64::total_cmp`.
fn ordered(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_of_numbers_is_kept() {
        let values = [f64::NEG_INFINITY, -3.0, -1e-9, 0.0, 1e-9, 2.5, f64::INFINITY];
        assert!(values.map(ordered).is_sorted());
    }
}
