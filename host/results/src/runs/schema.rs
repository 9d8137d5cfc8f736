//! The runs contract: how runs become columns and come back.

use softdock_kernels::fields::{Field, fields, from_slice, to_vec};
use softdock_kernels::metrics::{Metrics, Presence};
use softdock_kernels::params::Params;

use super::{
    AGREEMENT_WORDS, Agreement, Cause, LoopRow, OUTCOME_WORDS, Outcome, PHASE_WORDS, Phase, RequirementResult, RunRow,
    STATUS_WORDS, Status,
};
use crate::table::{Column, ColumnKind, Table, Values};

/// What the runs table must know of a requirement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RequirementColumn {
    /// The id as column names carry it (`arm_con_110`).
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

/// The columns of a campaign's runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunsSchema {
    custom_metrics: Vec<CustomMetricColumn>,
    requirements: Vec<RequirementColumn>,
}

/// Source of the columns of a campaign's custom metrics.
const CUSTOM_SOURCE: &str = "campaign, custom metric";

/// The two loops of a run; prefix of the columns and place in words.
#[derive(Clone, Copy)]
pub(crate) enum Loop {
    Space,
    Hil,
}

impl Loop {
    pub(crate) const BOTH: [Self; 2] = [Self::Space, Self::Hil];

    pub(crate) fn prefix(self) -> &'static str {
        ["space", "hil"][self as usize]
    }

    pub(crate) fn place(self) -> &'static str {
        ["in space", "on the facility"][self as usize]
    }

    fn of(self, row: &RunRow) -> &LoopRow {
        [&row.space, &row.hil][self as usize]
    }

    /// Name of one of its columns.
    fn column(self, name: &str) -> String {
        format!("{}_{name}", self.prefix())
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

/// Whether the columns of a loop (`space`, `hil`) hold a metric: in space no energy can be injected.
pub fn has_metric(side: &str, metric: &str) -> bool {
    side == Loop::Hil.prefix() || metric != "injected_energy"
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
        let kept = |field: &Field| has_metric(side.prefix(), &field.name);
        let described = fields.into_iter().enumerate().map(|(at, field)| {
            let presence = Metrics::presence(&field.name);
            Self { field, at, presence }
        });
        described.filter(|metric| kept(&metric.field)).collect()
    }

    /// Its value among those of a loop.
    pub(crate) fn value(&self, all: &Metrics<f64>, scalars: &[f64]) -> Option<f64> {
        all.told(self.presence, scalars[self.at])
    }

    /// The number that stands for "not available" in memory.
    fn missing(&self) -> f64 {
        if self.presence == Presence::Always { f64::NAN } else { -1.0 }
    }
}

impl RunsSchema {
    /// The schema of a campaign with these custom metrics and these requirements.
    pub fn new(custom_metrics: Vec<CustomMetricColumn>, requirements: Vec<RequirementColumn>) -> Self {
        Self { custom_metrics, requirements }
    }

    /// The schema of a runs table, from its columns.
    pub fn of_table(table: &Table) -> Self {
        let requirement = |column: &Column| {
            let id = column.name.strip_prefix("space_margin_")?;
            Some(RequirementColumn { id: id.to_owned(), unit: column.unit.clone() })
        };
        let (space, place) = (Loop::Space.column(""), format!(", {}", Loop::Space.place()));
        let own = |column: &Column| {
            let name = column.name.strip_prefix(&space).filter(|_| column.source == CUSTOM_SOURCE)?;
            let meaning = column.description.strip_suffix(&place).unwrap_or(&column.description);
            Some(CustomMetricColumn { column: name.to_owned(), unit: column.unit.clone(), meaning: meaning.to_owned() })
        };
        Self {
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
            let name = format!("in_{}", field.column());
            column(name, field.unit, field.meaning, "campaign, as applied", ColumnKind::Input, values)
        }));
        let effective = Values::F64(rows.iter().map(|row| row.effective_mass).collect());
        let meaning = "effective mass along the contact normal at first touch";
        columns.push(column("effective_mass_kg", "kg", meaning, "monitor", ColumnKind::Metric, effective));
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
    pub fn rows(&self, table: &Table) -> Result<Vec<RunRow>, String> {
        let lacking = |name: &str| format!("no column `{name}` of the expected type");
        let numbers = |name: String| table.f64s(&name).ok_or_else(|| lacking(&name));
        let inputs = input_fields().into_iter().map(|field| numbers(format!("in_{}", field.column())));
        let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
        let effective = numbers("effective_mass_kg".to_owned())?;
        let [space, hil] = Loop::BOTH.map(|side| self.read_loop(table, side));
        let (mut space, mut hil) = (space?.into_iter(), hil?.into_iter());
        let run = table.u64s("run").ok_or_else(|| lacking("run"))?;
        let outer = table.u32s("outer").ok_or_else(|| lacking("outer"))?;
        let flags = table.u32s("flags").ok_or_else(|| lacking("flags"))?;
        let status = table.column("status").ok_or_else(|| lacking("status"))?;
        let agreement = table.column("agreement").ok_or_else(|| lacking("agreement"))?;
        let word = |column: &'_ Column, row| column.values.word(row).unwrap_or_default().to_owned();
        (0..table.rows())
            .map(|row| {
                let status = Status::from_word(&word(status, row)).ok_or_else(|| lacking("status"))?;
                let agreement = Agreement::from_word(&word(agreement, row)).ok_or_else(|| lacking("agreement"))?;
                Ok(RunRow {
                    run: run[row],
                    outer: outer[row],
                    status,
                    agreement,
                    flags: flags[row],
                    inputs: inputs.iter().map(|values| values[row].unwrap_or(f64::NAN)).collect(),
                    effective_mass: effective[row],
                    space: space.next().ok_or_else(|| lacking("space_outcome"))?,
                    hil: hil.next().ok_or_else(|| lacking("hil_outcome"))?,
                })
            })
            .collect()
    }

    fn read_loop(&self, table: &Table, side: Loop) -> Result<Vec<LoopRow>, String> {
        let (metrics, requirements) = (read_metrics(table, side)?, self.read_results(table, side)?);
        let own = self.custom_metrics.iter().map(|own| {
            let name = side.column(&own.column);
            table.f64s(&name).ok_or_else(|| format!("no column `{name}`"))
        });
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
            let values = Values::F64(rows.iter().map(|row| side.of(row).custom_metrics[at]).collect());
            let meaning = format!("{}, {}", own.meaning, side.place());
            column(side.column(&own.column), &own.unit, &meaning, CUSTOM_SOURCE, ColumnKind::Metric, values)
        });
        own.collect()
    }

    fn read_results(&self, table: &Table, side: Loop) -> Result<Vec<Vec<RequirementResult>>, String> {
        let mut rows = vec![Vec::with_capacity(self.requirements.len()); table.rows()];
        for requirement in &self.requirements {
            let [margin, pass] = requirement_columns(side.prefix(), &requirement.id);
            let margins = table.f64s(&margin).ok_or_else(|| format!("no column `{margin}`"))?;
            let passes = table.bools(&pass).ok_or_else(|| format!("no column `{pass}`"))?;
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
        column("run", "1", "run number", "campaign", ColumnKind::Key, run),
        column("outer", "1", "number of the outer draw of the epistemic inputs", "campaign", ColumnKind::Key, outer),
        column("status", "1", status_meaning, "monitor", ColumnKind::Status, status),
        column("agreement", "1", agreement_meaning, "monitor", ColumnKind::Status, agreement),
        column("flags", "bits", "findings of the run, one bit each", "monitor", ColumnKind::Status, flags),
    ]
}

/// Word of a cause column for a loop that passes.
const NO_CAUSE: &str = "none";

/// How a loop ended, and why.
fn outcome_columns(rows: &[RunRow], side: Loop) -> Vec<Column> {
    let outcomes = rows.iter().map(|row| side.of(row).outcome as u32).collect();
    let causes: Vec<Option<&Cause>> = rows.iter().map(|row| side.of(row).cause.as_ref()).collect();
    let ids = causes.iter().map(|cause| cause.map_or(NO_CAUSE, |cause| cause.id.as_str()));
    let phase = |cause: &Option<&Cause>| cause.and_then(|cause| cause.phase).map_or(3, |phase| phase as u32);
    let number = |of: fn(&Cause) -> Option<f64>| Values::F64(causes.iter().map(|cause| cause.and_then(of)).collect());
    let place = side.place();
    let all = [
        (
            "outcome",
            "1",
            "pass, fail, aborted (a rule stopped the session: no answer) or invalid",
            Values::words(&OUTCOME_WORDS, outcomes),
        ),
        ("cause", "1", "criterion, rule or flag by which the loop did not pass", Values::words_of(ids)),
        ("cause_time_s", "s", "time of it", number(|cause| cause.time)),
        ("cause_value", "1", "its value, SI units of the criterion or rule", number(|cause| cause.value)),
        ("cause_limit", "1", "its limit, SI units of the criterion or rule", number(|cause| cause.limit)),
        (
            "cause_phase",
            "1",
            "phase of the run in which it was",
            Values::words(&PHASE_WORDS, causes.iter().map(phase).collect()),
        ),
    ];
    let described = all.into_iter().map(|(name, unit, meaning, values)| {
        column(side.column(name), unit, &format!("{meaning}, {place}"), "monitor", ColumnKind::Status, values)
    });
    described.collect()
}

fn read_outcomes(table: &Table, side: Loop) -> Result<Vec<(Outcome, Option<Cause>)>, String> {
    let lacking = |name: &str| format!("no column `{name}` of the expected type");
    let words = |name: &str| table.column(&side.column(name)).ok_or_else(|| lacking(&side.column(name)));
    let numbers = |name: &str| table.f64s(&side.column(name)).ok_or_else(|| lacking(&side.column(name)));
    let (outcomes, ids, phases) = (words("outcome")?, words("cause")?, words("cause_phase")?);
    let [times, values, limits] = [numbers("cause_time_s")?, numbers("cause_value")?, numbers("cause_limit")?];
    let row = |row: usize| {
        let word = outcomes.values.word(row).unwrap_or_default();
        let outcome = Outcome::from_word(word).ok_or_else(|| lacking(&side.column("outcome")))?;
        let cause = ids.values.word(row).filter(|id| *id != NO_CAUSE).map(|id| Cause {
            id: id.to_owned(),
            time: times[row],
            value: values[row],
            limit: limits[row],
            phase: phases.values.word(row).and_then(Phase::from_word),
        });
        Ok((outcome, cause))
    };
    (0..table.rows()).map(row).collect()
}

fn metric_columns(rows: &[RunRow], side: Loop) -> Vec<Column> {
    let scalars: Vec<Vec<f64>> = rows.iter().map(|row| to_vec(&side.of(row).metrics)).collect();
    let metric = |metric: MetricColumn| {
        let all = rows.iter().zip(&scalars);
        let values = Values::F64(all.map(|(row, scalars)| metric.value(&side.of(row).metrics, scalars)).collect());
        let name = side.column(&metric.field.column());
        let meaning = format!("{}, {}", metric.field.meaning, side.place());
        column(name, metric.field.unit, &meaning, "monitor", ColumnKind::Metric, values)
    };
    MetricColumn::all(side).into_iter().map(metric).collect()
}

fn read_metrics(table: &Table, side: Loop) -> Result<Vec<Metrics<f64>>, String> {
    let mut rows = vec![vec![0.0; metric_fields().len()]; table.rows()];
    for metric in MetricColumn::all(side) {
        let name = side.column(&metric.field.column());
        let values = table.f64s(&name).ok_or_else(|| format!("no column `{name}`"))?;
        for (row, value) in rows.iter_mut().zip(values) {
            row[metric.at] = value.unwrap_or(metric.missing());
        }
    }
    Ok(rows.iter().map(|scalars| from_slice(scalars)).collect())
}

/// Names of a requirement's margin and pass columns in a loop, "space" or "hil"; `id` as in column names.
pub fn requirement_columns(side: &str, id: &str) -> [String; 2] {
    [format!("{side}_margin_{id}"), format!("{side}_pass_{id}")]
}

fn margin_column(rows: &[RunRow], at: usize, requirement: &RequirementColumn, side: Loop) -> Column {
    let values = Values::F64(rows.iter().map(|row| side.of(row).requirements[at].margin).collect());
    let meaning = format!("distance to the requirement's limit, positive inside, {}", side.place());
    let [name, _] = requirement_columns(side.prefix(), &requirement.id);
    column(name, &requirement.unit, &meaning, "requirement", ColumnKind::Margin, values)
}

fn pass_column(rows: &[RunRow], at: usize, requirement: &RequirementColumn, side: Loop) -> Column {
    let values = Values::Bool(rows.iter().map(|row| side.of(row).requirements[at].pass).collect());
    let meaning = format!("whether the requirement holds, {}", side.place());
    let [_, name] = requirement_columns(side.prefix(), &requirement.id);
    column(name, "1", &meaning, "requirement", ColumnKind::Verdict, values)
}
