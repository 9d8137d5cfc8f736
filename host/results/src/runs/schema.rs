//! The runs contract: how runs become columns and come back.

use softdock_kernels::fields::{Field, fields, from_slice, to_vec};
use softdock_kernels::metrics::{Metrics, Presence};
use softdock_kernels::params::Params;

use super::{
    AGREEMENT_WORDS, Cause, LoopRow, OUTCOME_WORDS, Outcome, PHASE_WORDS, RequirementResult, RunRow, STATUS_WORDS,
};
use crate::runs::columns::{
    self, AGREEMENT, ColumnError, ColumnHandle, EFFECTIVE_MASS, FLAGS, Loop, NO_CAUSE, OUTER, RUN, STATUS,
};
use crate::table::{Column, ColumnKind, Table, Values};

/// What the runs table must know of a requirement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RequirementColumn {
    /// The id as in column names (`arm_con_110`).
    pub id: String,
    /// Unit of the margin.
    pub unit: String,
}

/// What the runs table must know of a custom metric of the campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CustomMetricColumn {
    /// Name of the column without the prefix of the loop, with its unit as a suffix.
    pub column: String,
    /// Unit.
    pub unit: String,
    /// What it is.
    pub meaning: String,
}

/// What the runs table must know of a key of the scenario that each run has for itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyColumn {
    /// Name of the column, with its unit as a suffix.
    pub column: String,
    /// Unit.
    pub unit: String,
    /// Which key it is.
    pub meaning: String,
}

/// The columns of a campaign's runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunsSchema {
    keys: Vec<KeyColumn>,
    custom_metrics: Vec<CustomMetricColumn>,
    requirements: Vec<RequirementColumn>,
}

/// Source of the columns of keys of the scenario.
const KEY_SOURCE: &str = "campaign, key of the scenario";

/// Source of the columns of a campaign's custom metrics.
pub const CUSTOM_SOURCE: &str = "campaign, custom metric";

/// The row of a loop.
fn of(side: Loop, row: &RunRow) -> &LoopRow {
    match side {
        Loop::Space => &row.space,
        Loop::Hil => &row.hil,
    }
}

/// The field table of the inputs.
pub fn input_fields() -> Vec<Field> {
    fields::<f64, Params<f64>>()
}

/// The field table of the metrics.
pub fn metric_fields() -> Vec<Field> {
    fields::<f64, Metrics<f64>>()
}

/// One metric as the files know it.
pub(crate) struct MetricColumn {
    pub(crate) field: Field,
    /// Position in the bundle.
    at: usize,
    presence: Presence,
}

impl MetricColumn {
    /// The metrics that a loop's columns hold.
    pub(crate) fn all(side: Loop) -> Vec<Self> {
        let fields = metric_fields();
        let kept = |field: &Field| side.has_metric(&field.name);
        let described = fields.into_iter().enumerate().map(|(at, field)| {
            let presence = Presence::of(&field);
            Self { field, at, presence }
        });
        described.filter(|metric| kept(&metric.field)).collect()
    }

    /// Its value among those of a loop.
    pub(crate) fn value(&self, all: &Metrics<f64>, scalars: &[f64]) -> Option<f64> {
        all.if_present(self.presence, scalars[self.at])
    }

    /// The number that stands for "not available" in memory.
    fn missing(&self) -> f64 {
        if self.presence == Presence::Always { f64::NAN } else { -1.0 }
    }
}

impl RunsSchema {
    /// The schema of a campaign with these keys of the scenario, custom metrics and requirements.
    pub fn new(
        keys: Vec<KeyColumn>,
        custom_metrics: Vec<CustomMetricColumn>,
        requirements: Vec<RequirementColumn>,
    ) -> Self {
        Self { keys, custom_metrics, requirements }
    }

    /// The schema of a runs table, from its columns.
    pub fn of_table(table: &Table) -> Self {
        let requirement = |column: &Column| {
            let id = Loop::Space.margin_id(&column.name)?;
            Some(RequirementColumn { id: id.to_owned(), unit: column.unit.clone() })
        };
        let place = format!(", {}", Loop::Space.place());
        let own = |column: &Column| {
            let name = Loop::Space.strip(&column.name).filter(|_| column.source == CUSTOM_SOURCE)?;
            let meaning = column.description.strip_suffix(&place).unwrap_or(&column.description);
            Some(CustomMetricColumn { column: name.to_owned(), unit: column.unit.clone(), meaning: meaning.to_owned() })
        };
        let key = |column: &Column| KeyColumn {
            column: column.name.clone(),
            unit: column.unit.clone(),
            meaning: column.description.clone(),
        };
        Self {
            keys: table.columns.iter().filter(|column| column.source == KEY_SOURCE).map(key).collect(),
            custom_metrics: table.columns.iter().filter_map(own).collect(),
            requirements: table.columns.iter().filter_map(requirement).collect(),
        }
    }

    /// The requirements, in column order.
    pub fn requirements(&self) -> &[RequirementColumn] {
        &self.requirements
    }

    /// Rows to columns.
    pub fn table(&self, rows: &[RunRow]) -> Table {
        let mut columns = head(rows);
        columns.extend(input_fields().into_iter().enumerate().map(|(at, field)| {
            let values = Values::F64(rows.iter().map(|row| Some(row.inputs[at])).collect());
            column(
                columns::input(&field).into_name(),
                field.unit,
                field.meaning,
                "campaign, as applied",
                ColumnKind::Input,
                values,
            )
        }));
        let parameters = columns.len() - head(&[]).len();
        columns.extend(self.keys.iter().enumerate().map(|(at, key)| {
            let values = Values::F64(rows.iter().map(|row| Some(row.inputs[parameters + at])).collect());
            column(&key.column, &key.unit, &key.meaning, KEY_SOURCE, ColumnKind::Input, values)
        }));
        let effective = Values::F64(rows.iter().map(|row| row.effective_mass).collect());
        let meaning = "effective mass along the contact normal at first touch";
        columns.push(column(EFFECTIVE_MASS.name(), "kg", meaning, "monitor", ColumnKind::Metric, effective));
        columns.extend(Loop::BOTH.into_iter().flat_map(|side| outcome_columns(rows, side)));
        columns.extend(Loop::BOTH.into_iter().flat_map(|side| metric_columns(rows, side)));
        columns.extend(Loop::BOTH.into_iter().flat_map(|side| self.custom_columns(rows, side)));
        for (at, requirement) in self.requirements.iter().enumerate() {
            columns.extend(Loop::BOTH.into_iter().map(|side| margin_column(rows, at, requirement, side)));
            columns.extend(Loop::BOTH.into_iter().map(|side| pass_column(rows, at, requirement, side)));
        }
        Table { columns }
    }

    /// Columns to rows, or what the table lacks.
    pub fn rows(&self, table: &Table) -> Result<Vec<RunRow>, ColumnError> {
        let keys = self.keys.iter().map(|key| ColumnHandle::named(key.column.clone()));
        let inputs = input_fields().iter().map(columns::input).chain(keys).collect::<Vec<_>>();
        let inputs = inputs.iter().map(|column| table.get(column));
        let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
        let effective = table.get(&EFFECTIVE_MASS)?;
        let [space, hil] = Loop::BOTH.map(|side| self.read_loop(table, side));
        let loops = space?.into_iter().zip(hil?);
        let (run, outer, flags) = (table.get(&RUN)?, table.get(&OUTER)?, table.get(&FLAGS)?);
        let (status, agreement) = (table.get(&STATUS)?, table.get(&AGREEMENT)?);
        let rows = loops.enumerate().map(|(row, (space, hil))| RunRow {
            run: run[row],
            outer: outer[row],
            status: status.at(row),
            agreement: agreement.at(row),
            flags: flags[row],
            inputs: inputs.iter().map(|values| values[row].unwrap_or(f64::NAN)).collect(),
            effective_mass: effective[row],
            space,
            hil,
        });
        Ok(rows.collect())
    }

    fn read_loop(&self, table: &Table, side: Loop) -> Result<Vec<LoopRow>, ColumnError> {
        let (metrics, requirements) = (read_metrics(table, side)?, self.read_results(table, side)?);
        let own = self.custom_metrics.iter().map(|own| table.get(&side.metric_column(&own.column)));
        let own = own.collect::<Result<Vec<_>, _>>()?;
        let outcomes = read_outcomes(table, side)?;
        let rows = outcomes.into_iter().zip(metrics).zip(requirements).enumerate();
        Ok(rows
            .map(|(row, (((outcome, cause), metrics), requirements))| {
                let custom_metrics = own.iter().map(|values| values[row]).collect();
                LoopRow { outcome, cause, metrics, custom_metrics, requirements }
            })
            .collect())
    }

    fn custom_columns(&self, rows: &[RunRow], side: Loop) -> Vec<Column> {
        let own = self.custom_metrics.iter().enumerate().map(|(at, own)| {
            let values = Values::F64(rows.iter().map(|row| of(side, row).custom_metrics[at]).collect());
            let meaning = format!("{}, {}", own.meaning, side.place());
            column(
                side.metric_column(&own.column).into_name(),
                &own.unit,
                &meaning,
                CUSTOM_SOURCE,
                ColumnKind::Metric,
                values,
            )
        });
        own.collect()
    }

    fn read_results(&self, table: &Table, side: Loop) -> Result<Vec<Vec<RequirementResult>>, ColumnError> {
        let mut rows = vec![Vec::with_capacity(self.requirements.len()); table.rows()];
        for requirement in &self.requirements {
            let margins = table.get(&side.margin(&requirement.id))?;
            let passes = table.get(&side.pass(&requirement.id))?;
            for (row, (margin, pass)) in rows.iter_mut().zip(margins.iter().zip(passes)) {
                row.push(RequirementResult { margin: *margin, pass: *pass });
            }
        }
        Ok(rows)
    }
}

fn column(
    name: impl Into<String>,
    unit: &str,
    description: &str,
    source: &str,
    kind: ColumnKind,
    values: Values,
) -> Column {
    let (unit, description, source) = (unit.to_owned(), description.to_owned(), source.to_owned());
    Column { name: name.into(), unit, description, source, kind, values }
}

fn head(rows: &[RunRow]) -> Vec<Column> {
    let run = Values::U64(rows.iter().map(|row| row.run).collect());
    let outer = Values::U32(rows.iter().map(|row| row.outer).collect());
    let status = Values::words(&STATUS_WORDS, rows.iter().map(|row| row.status as u32).collect());
    let agreement = Values::words(&AGREEMENT_WORDS, rows.iter().map(|row| row.agreement as u32).collect());
    let flags = Values::U32(rows.iter().map(|row| row.flags).collect());
    let status_meaning = "pass: every requirement on space holds (without any: the task succeeds in space); invalid: the numbers cannot be trusted";
    let agreement_meaning =
        "the facility's verdict against the verdict of space: the task's criteria and every requirement on space";
    vec![
        column(RUN.name(), "1", "run number", "campaign", ColumnKind::Key, run),
        column(
            OUTER.name(),
            "1",
            "number of the outer draw of the epistemic inputs",
            "campaign",
            ColumnKind::Key,
            outer,
        ),
        column(STATUS.name(), "1", status_meaning, "monitor", ColumnKind::Status, status),
        column(AGREEMENT.name(), "1", agreement_meaning, "monitor", ColumnKind::Status, agreement),
        column(FLAGS.name(), "bits", "findings of the run, one bit each", "monitor", ColumnKind::Status, flags),
    ]
}

/// How a loop ended, and why.
fn outcome_columns(rows: &[RunRow], side: Loop) -> Vec<Column> {
    let outcomes = rows.iter().map(|row| of(side, row).outcome as u32).collect();
    let causes: Vec<Option<&Cause>> = rows.iter().map(|row| of(side, row).cause.as_ref()).collect();
    let ids = causes.iter().map(|cause| cause.map_or(NO_CAUSE, |cause| cause.id.as_str()));
    let phase = |cause: &Option<&Cause>| cause.and_then(|cause| cause.phase).map_or(3, |phase| phase as u32);
    let number = |of: fn(&Cause) -> Option<f64>| Values::F64(causes.iter().map(|cause| cause.and_then(of)).collect());
    let place = side.place();
    let all = [
        (
            side.outcome().into_name(),
            "1",
            "pass, fail, aborted (a rule stopped the session: no answer) or invalid",
            Values::words(&OUTCOME_WORDS, outcomes),
        ),
        (
            side.cause().into_name(),
            "1",
            "criterion, rule or flag by which the loop did not pass",
            Values::words_of(ids),
        ),
        (side.cause_time().into_name(), "s", "time of it", number(|cause| cause.time)),
        (
            side.cause_value().into_name(),
            "1",
            "its value, SI units of the criterion or rule",
            number(|cause| cause.value),
        ),
        (
            side.cause_limit().into_name(),
            "1",
            "its limit, SI units of the criterion or rule",
            number(|cause| cause.limit),
        ),
        (
            side.cause_phase().into_name(),
            "1",
            "phase of the run in which it was",
            Values::words(&PHASE_WORDS, causes.iter().map(phase).collect()),
        ),
    ];
    let described = all.into_iter().map(|(name, unit, meaning, values)| {
        column(name, unit, &format!("{meaning}, {place}"), "monitor", ColumnKind::Status, values)
    });
    described.collect()
}

fn read_outcomes(table: &Table, side: Loop) -> Result<Vec<(Outcome, Option<Cause>)>, ColumnError> {
    let (outcomes, ids, phases) =
        (table.get(&side.outcome())?, table.get(&side.cause())?, table.get(&side.cause_phase())?);
    let (times, values, limits) =
        (table.get(&side.cause_time())?, table.get(&side.cause_value())?, table.get(&side.cause_limit())?);
    let cause = |row: usize| Cause {
        id: ids.at(row).to_owned(),
        time: times[row],
        value: values[row],
        limit: limits[row],
        phase: phases.at(row),
    };
    let row = |row: usize| (outcomes.at(row), (ids.at(row) != NO_CAUSE).then(|| cause(row)));
    Ok((0..table.rows()).map(row).collect())
}

fn metric_columns(rows: &[RunRow], side: Loop) -> Vec<Column> {
    let scalars: Vec<Vec<f64>> = rows.iter().map(|row| to_vec(&of(side, row).metrics)).collect();
    let metric = |metric: MetricColumn| {
        let all = rows.iter().zip(&scalars);
        let values = Values::F64(all.map(|(row, scalars)| metric.value(&of(side, row).metrics, scalars)).collect());
        let name = side.metric_column(&metric.field.column()).into_name();
        let meaning = format!("{}, {}", metric.field.meaning, side.place());
        column(name, metric.field.unit, &meaning, "monitor", ColumnKind::Metric, values)
    };
    MetricColumn::all(side).into_iter().map(metric).collect()
}

fn read_metrics(table: &Table, side: Loop) -> Result<Vec<Metrics<f64>>, ColumnError> {
    let mut rows = vec![vec![0.0; metric_fields().len()]; table.rows()];
    for metric in MetricColumn::all(side) {
        let values = table.get(&side.metric_column(&metric.field.column()))?;
        for (row, value) in rows.iter_mut().zip(values) {
            row[metric.at] = value.unwrap_or(metric.missing());
        }
    }
    Ok(rows.iter().map(|scalars| from_slice(scalars)).collect())
}

fn margin_column(rows: &[RunRow], at: usize, requirement: &RequirementColumn, side: Loop) -> Column {
    let values = Values::F64(rows.iter().map(|row| of(side, row).requirements[at].margin).collect());
    let meaning = format!("distance to the requirement's limit, positive inside, {}", side.place());
    column(
        side.margin(&requirement.id).into_name(),
        &requirement.unit,
        &meaning,
        "requirement",
        ColumnKind::Margin,
        values,
    )
}

fn pass_column(rows: &[RunRow], at: usize, requirement: &RequirementColumn, side: Loop) -> Column {
    let values = Values::Bool(rows.iter().map(|row| of(side, row).requirements[at].pass).collect());
    let meaning = format!("whether the requirement holds, {}", side.place());
    column(side.pass(&requirement.id).into_name(), "1", &meaning, "requirement", ColumnKind::Verdict, values)
}
