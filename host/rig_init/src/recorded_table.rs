//! Columns of a log with the meaning of their names.

use crate::figures::extent;
use crate::names::{ColumnName, Meaning, Origin};
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::data::table::{Gaps, Named, Wanted, column_names};
use std::path::Path;

/// Fewest rows of a log from which anything is derived.
const FEWEST: usize = 20;
/// What to do about a log without usable columns.
const REMEDY: &str = "name a CSV file with a header, or a Parquet file, whose columns hold numbers";

/// A column of numbers.
#[derive(Clone, Debug)]
pub(crate) struct LogColumn {
    pub(crate) name: String,
    pub(crate) parsed: ColumnName,
    /// As recorded; missing cells are NaN.
    pub(crate) values: Vec<f64>,
}

impl LogColumn {
    /// Least and greatest finite value.
    pub(crate) fn extent(&self) -> (f64, f64) {
        extent(&self.values)
    }
}

/// A log.
#[derive(Clone, Debug)]
pub(crate) struct RecordedTable {
    /// The file's name.
    pub(crate) file: String,
    pub(crate) columns: Vec<LogColumn>,
    /// Columns without numbers.
    pub(crate) unread: Vec<String>,
}

impl RecordedTable {
    /// Reads every column of numbers of a log.
    pub(crate) fn read(path: &Path) -> Result<Self, DiagnosisError> {
        let mut names = column_names(path)?;
        let mut seen = std::collections::BTreeSet::new();
        names.retain(|name| !name.is_empty() && seen.insert(name.clone()));
        let read = |names: &[String]| {
            let columns = names.iter().map(|name| (name.as_str(), name.as_str())).collect();
            Wanted { columns, named: Named::Agreed(REMEDY), gaps: Gaps::Kept, order: &[] }
                .read(path)
                .map(|table| table.columns)
        };
        let (mut columns, mut unread, mut failure) = (Vec::new(), Vec::new(), None);
        match read(&names) {
            Ok(values) => columns = names.into_iter().zip(values).collect(),
            // A column of texts spoils the others only if they are read together.
            Err(_) => {
                for name in names {
                    match read(std::slice::from_ref(&name)) {
                        Ok(mut values) => columns.push((name, values.remove(0))),
                        Err(error) => {
                            unread.push(name);
                            failure.get_or_insert(error);
                        }
                    }
                }
            }
        }
        if columns.is_empty() {
            return Err(failure.unwrap_or_else(|| DiagnosisError::log(path, None, "there is no column", REMEDY)));
        }
        let rows = columns[0].1.len();
        if rows < FEWEST {
            let what = format!("{rows} rows: nothing can be derived from fewer than {FEWEST}");
            return Err(DiagnosisError::log(path, None, what, "name a longer recording"));
        }
        let columns = columns.into_iter().filter(|(_, values)| values.iter().any(|value| value.is_finite()));
        let of_name = |(name, values): (String, Vec<f64>)| LogColumn { parsed: ColumnName::of(&name), name, values };
        let mut columns: Vec<LogColumn> = columns.map(of_name).collect();
        number_axes(&mut columns);
        let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { file, columns, unread })
    }

    pub(crate) fn rows(&self) -> usize {
        self.columns[0].values.len()
    }

    /// Columns of a meaning.
    pub(crate) fn of(&self, meaning: Meaning) -> impl Iterator<Item = &LogColumn> {
        self.columns.iter().filter(move |column| column.parsed.meaning == Some(meaning))
    }

    /// The column of a joint's quantity from the first origin that has one.
    pub(crate) fn joint(&self, meaning: Meaning, axis: Option<u32>, origins: &[Origin]) -> Option<&LogColumn> {
        origins.iter().find_map(|origin| {
            self.of(meaning).find(|column| {
                let parsed = &column.parsed;
                parsed.axis == axis && parsed.origin == *origin && parsed.component.is_none()
            })
        })
    }

    /// The column of a component of a vector; `reference` selects known values.
    pub(crate) fn component(&self, meaning: Meaning, component: char, reference: bool) -> Option<&LogColumn> {
        self.of(meaning).find(|column| {
            let parsed = &column.parsed;
            parsed.component == Some(component) && (parsed.origin == Origin::Reference) == reference
        })
    }

    /// Whether all components of a vector are recorded.
    pub(crate) fn has_vector(&self, meaning: Meaning, components: &str, reference: bool) -> bool {
        components.chars().all(|component| self.component(meaning, component, reference).is_some())
    }
}

/// Counts axes from 1; columns that name joints by words are numbered in their order.
fn number_axes(columns: &mut [LogColumn]) {
    let joint = |column: &LogColumn| column.parsed.component.is_none();
    if columns.iter().any(|column| joint(column) && column.parsed.axis == Some(0)) {
        columns.iter_mut().filter_map(|column| column.parsed.axis.as_mut()).for_each(|axis| *axis += 1);
    }
    let quantities =
        [Meaning::Position, Meaning::Rate, Meaning::Acceleration, Meaning::Torque, Meaning::Current, Meaning::Voltage];
    for meaning in quantities {
        for origin in [Origin::Plain, Origin::Measured, Origin::Reference, Origin::Link] {
            let unnumbered = |column: &&mut LogColumn| {
                let parsed = &column.parsed;
                let is_joint = parsed.axis.is_none() && parsed.component.is_none();
                is_joint && parsed.meaning == Some(meaning) && parsed.origin == origin
            };
            let mut found: Vec<&mut LogColumn> = columns.iter_mut().filter(unnumbered).collect();
            if found.len() > 1 {
                found.iter_mut().zip(1..).for_each(|(column, number)| column.parsed.axis = Some(number));
            }
        }
    }
}
