//! Rows of a variant's runs for a comparison, read in one pass.

use std::path::Path;

use softdock_campaign::compare::Comparison;
use softdock_kernels::fields::fields;
use softdock_kernels::metrics::Metrics;
use softdock_results::Table;
use softdock_results::runs::Agreement;
use softdock_results::shards::ShardIndex;

use crate::{Error, Result};

/// Run with its verdicts, inputs and metrics.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) run: u64,
    pub(super) agreement: Agreement,
    /// Values of the requested columns, in their order; NaN if missing.
    pub(super) values: Vec<f64>,
}

impl Row {
    pub(super) fn is_valid(&self) -> bool {
        self.agreement != Agreement::Invalid
    }

    pub(super) fn is_aborted(&self) -> bool {
        self.agreement.is_aborted()
    }

    /// Returns whether the facility has a verdict.
    pub(super) fn is_answered(&self) -> bool {
        self.agreement.facility_passes().is_some()
    }

    pub(super) fn is_wrong(&self) -> bool {
        matches!(self.agreement, Agreement::FalsePass | Agreement::FalseFail)
    }

    pub(super) fn passes_in_space(&self) -> bool {
        self.agreement.space_passes() == Some(true)
    }

    pub(super) fn passes_on_facility(&self) -> bool {
        self.agreement.facility_passes() == Some(true)
    }
}

/// Columns of a comparison: index of each input and metric in a row's values.
pub(super) struct Columns {
    names: Vec<String>,
}

impl Columns {
    pub(super) fn of(plan: &Comparison) -> Self {
        let along = plan.along.iter().map(|bands| bands.field.column());
        let axes = plan
            .maps
            .iter()
            .flat_map(|map| [&map.x, &map.y].into_iter().chain(&map.slice))
            .map(|axis| axis.field.column());
        let inputs = along.chain(axes).map(|column| format!("in_{column}"));
        let mapped = plan.maps.iter().filter_map(|map| map.metric.as_ref());
        let metrics = plan.metrics.iter().chain(mapped).map(|(name, _)| metric_column(name));
        let mut names: Vec<String> = Vec::new();
        for name in inputs.chain(metrics) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        Self { names }
    }

    /// Place of an input.
    pub(super) fn input(&self, column: &str) -> usize {
        self.place(&format!("in_{column}"))
    }

    /// Place of a metric of the facility's loop.
    pub(super) fn metric(&self, name: &str) -> usize {
        self.place(&metric_column(name))
    }

    fn place(&self, name: &str) -> usize {
        self.names.iter().position(|own| own == name).expect("a column of the plan")
    }

    /// All runs of a results folder, by run number.
    pub(super) fn read(&self, results: &Path, index: &ShardIndex) -> Result<Vec<Row>> {
        let names: Vec<String> =
            ["run", "agreement"].map(str::to_owned).into_iter().chain(self.names.iter().cloned()).collect();
        let mut rows = Vec::new();
        for batch in index.read_columns(&names) {
            self.add(&batch?, &mut rows).map_err(|name| Error::Results {
                path: results.to_owned(),
                what: format!("no column `{name}` of the expected type"),
            })?;
        }
        rows.sort_by_key(|row: &Row| row.run);
        Ok(rows)
    }

    /// Adds a batch; the error is the name of an invalid column.
    fn add(&self, table: &Table, rows: &mut Vec<Row>) -> std::result::Result<(), String> {
        let run = table.u64s("run").ok_or("run")?;
        let agreement = table.column("agreement").ok_or("agreement")?;
        let columns: Vec<&[Option<f64>]> = self
            .names
            .iter()
            .map(|name| table.f64s(name).ok_or_else(|| name.clone()))
            .collect::<std::result::Result<_, _>>()?;
        for (row, run) in run.iter().enumerate() {
            let word = agreement.values.word(row).and_then(Agreement::from_word);
            let values = columns.iter().map(|column| column[row].unwrap_or(f64::NAN)).collect();
            rows.push(Row { run: *run, agreement: word.ok_or("agreement")?, values });
        }
        Ok(())
    }
}

fn metric_column(name: &str) -> String {
    let metric = fields::<f64, Metrics<f64>>().into_iter().find(|metric| metric.name == name);
    format!("hil_{}", metric.map_or(name.to_owned(), |metric| metric.column()))
}
