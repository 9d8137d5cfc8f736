//! Rows of a variant's runs for a comparison, read in one pass.

use std::path::Path;

use softdock_campaign::compare::Comparison;
use softdock_kernels::fields::Field;
use softdock_results::Table;
use softdock_results::columns::{AGREEMENT, ColumnError, ColumnHandle, Loop, RUN, input};
use softdock_results::runs::Agreement;
use softdock_results::shards::ShardIndex;

use crate::{AnalysisError, Result};

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
    columns: Vec<ColumnHandle<f64>>,
}

impl Columns {
    pub(super) fn of(plan: &Comparison) -> Self {
        let along = plan.along.iter();
        let axes = plan.maps.iter().flat_map(|map| [&map.x, &map.y].into_iter().chain(&map.slice));
        let inputs = along.chain(axes).map(|axis| input(&axis.field));
        let mapped = plan.maps.iter().filter_map(|map| map.metric.as_ref());
        let metrics = plan.metrics.iter().chain(mapped).map(|(name, _)| Loop::Hil.metric_named(name));
        let mut columns: Vec<ColumnHandle<f64>> = Vec::new();
        for column in inputs.chain(metrics) {
            if !columns.contains(&column) {
                columns.push(column);
            }
        }
        Self { columns }
    }

    /// Place of an input.
    pub(super) fn input(&self, field: &Field) -> usize {
        self.place(&input(field))
    }

    /// Place of a metric of the facility's loop.
    pub(super) fn metric(&self, name: &str) -> usize {
        self.place(&Loop::Hil.metric_named(name))
    }

    fn place(&self, column: &ColumnHandle<f64>) -> usize {
        self.columns.iter().position(|own| own == column).expect("a column of the plan")
    }

    /// All runs of a results folder, by run number.
    pub(super) fn read(&self, results: &Path, index: &ShardIndex) -> Result<Vec<Row>> {
        let fixed = [RUN.name(), AGREEMENT.name()].into_iter();
        let names: Vec<String> = fixed.chain(self.columns.iter().map(ColumnHandle::name)).map(str::to_owned).collect();
        let mut rows = Vec::new();
        for batch in index.read_columns(&names) {
            self.add(&batch?, &mut rows).map_err(|error| AnalysisError::of_column(results, &error))?;
        }
        rows.sort_by_key(|row: &Row| row.run);
        Ok(rows)
    }

    fn add(&self, table: &Table, rows: &mut Vec<Row>) -> std::result::Result<(), ColumnError> {
        let (run, agreement) = (table.get(&RUN)?, table.get(&AGREEMENT)?);
        let columns = self.columns.iter().map(|column| table.get(column));
        let columns = columns.collect::<std::result::Result<Vec<_>, _>>()?;
        rows.extend(run.iter().enumerate().map(|(row, run)| Row {
            run: *run,
            agreement: agreement.at(row),
            values: columns.iter().map(|column| column[row].unwrap_or(f64::NAN)).collect(),
        }));
        Ok(())
    }
}
