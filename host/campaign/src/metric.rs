//! Metrics that requirements may name: task success, those of the monitor, and custom ones.
//!
//! A custom metric is an expression over the monitor's metrics of one loop, the effective mass, the applied
//! parameters and custom metrics above it, in SI. Its unit is checked. Where one of these has no value, or the result is
//! no finite number, the metric has no value, and a requirement on it fails.

use crate::check::Checker;
use crate::expression::{self, Expression, Measure};
use crate::units::{self, UnitError};
use crate::written::campaign::MetricTable;
use softdock_kernels::fields::{Field, fields, from_slice, to_vec};
use softdock_kernels::metrics::{Metrics, Presence};
use softdock_kernels::params::Params;
use std::sync::LazyLock;

/// Metric of a loop that is no number of the monitor: 1 if every criterion of the task holds, 0 if not; not available
/// where the session was aborted.
pub const SUCCESS: &str = "success";

/// Name in expressions of the effective mass along the contact normal at first touch \[kg\].
const EFFECTIVE_MASS: &str = "effective_mass";

/// Beginnings of the names of columns that each loop has besides its metrics.
const TAKEN: [&str; 4] = ["outcome", "cause", "margin_", "pass_"];

/// A metric that a campaign defines.
#[derive(Clone, Debug, PartialEq)]
pub struct CustomMetric {
    /// Name, as requirements and columns use it.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What it is, for reports.
    pub text: String,
    /// The expression as written.
    pub formula: String,
    expression: Expression,
}

impl CustomMetric {
    /// Name of its column without the prefix of the loop (`impulse_share`, `lost_speed_m_per_s`).
    pub fn column(&self) -> String {
        let suffix = column_suffix(&self.unit);
        if suffix.is_empty() { self.name.clone() } else { format!("{}_{suffix}", self.name) }
    }
}

/// Where the value of a metric is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MetricSource {
    /// Task success.
    Success,
    /// A field of the monitor's metrics: its place in the field table, and when it has a value.
    Monitor(usize, Presence),
    /// A custom metric: its place among them.
    Custom(usize),
}

/// A metric that a requirement names.
#[derive(Clone, Debug, PartialEq)]
pub struct MetricRef {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Where its value is found.
    pub source: MetricSource,
    /// Name of its column without the prefix of the loop; task success has none.
    pub column: Option<String>,
}

impl MetricRef {
    /// Every metric that a requirement may name.
    pub fn all(own: &[CustomMetric]) -> Vec<Self> {
        let success =
            Self { name: SUCCESS.to_owned(), unit: "1".to_owned(), source: MetricSource::Success, column: None };
        let monitor = fields::<f64, Metrics<f64>>().into_iter().enumerate().map(|(at, field)| Self {
            source: MetricSource::Monitor(at, Presence::of(&field)),
            column: Some(field.column()),
            unit: field.unit.to_owned(),
            name: field.name,
        });
        let own = own.iter().enumerate().map(|(at, metric)| Self {
            source: MetricSource::Custom(at),
            column: Some(metric.column()),
            unit: metric.unit.clone(),
            name: metric.name.clone(),
        });
        std::iter::once(success).chain(monitor).chain(own).collect()
    }

    /// The metric of a name.
    pub fn of(name: &str, own: &[CustomMetric]) -> Option<Self> {
        Self::all(own).into_iter().find(|metric| metric.name == name)
    }

    /// Its value in a loop that gave an answer; `own` are the values of the custom metrics.
    pub fn value(&self, succeeds: bool, metrics: &Metrics<f64>, own: &[Option<f64>]) -> Option<f64> {
        match self.source {
            MetricSource::Success => Some(f64::from(u8::from(succeeds))),
            MetricSource::Monitor(at, presence) => metrics.if_present(presence, to_vec(metrics)[at]),
            MetricSource::Custom(at) => own[at],
        }
    }
}

/// When each metric of the monitor has a value, in the order of its field table; found once, not for every run.
static PRESENCE: LazyLock<Vec<Presence>> =
    LazyLock::new(|| fields::<f64, Metrics<f64>>().iter().map(Presence::of).collect());

/// Values of a campaign's custom metrics in one loop of a run.
///
/// `effective_mass` \[kg\] is that at first touch; `inputs` are the applied parameters in the order of the field table
/// of `Params`.
pub fn custom_values(
    own: &[CustomMetric],
    metrics: &Metrics<f64>,
    effective_mass: Option<f64>,
    inputs: &[f64],
) -> Vec<Option<f64>> {
    if own.is_empty() {
        return Vec::new();
    }
    let monitor = PRESENCE.iter().zip(to_vec(metrics)).map(|(presence, value)| metrics.if_present(*presence, value));
    // The keys of the scenario behind them have no names in expressions.
    let parameters = to_vec(&from_slice::<f64, Params<f64>>(inputs));
    let parameters = parameters.iter().map(|value| Some(*value).filter(|value| value.is_finite()));
    let mut known: Vec<Option<f64>> = monitor.chain([effective_mass]).chain(parameters).collect();
    let first = known.len();
    for metric in own {
        let is_known = metric.expression.names().iter().all(|name| known[*name].is_some());
        let values: Vec<f64> = known.iter().map(|value| value.unwrap_or(f64::NAN)).collect();
        let value = is_known.then(|| metric.expression.value(&values));
        known.push(value.filter(|value| value.is_finite()));
    }
    known.split_off(first)
}

/// Checks the custom metrics of a campaign file.
pub(crate) fn read(c: &mut Checker, tables: &[MetricTable]) -> Vec<CustomMetric> {
    let mass = Field::new(EFFECTIVE_MASS, "kg", "effective mass at first touch");
    let known = fields::<f64, Metrics<f64>>().into_iter().chain([mass]).chain(fields::<f64, Params<f64>>());
    let mut names: Vec<(String, String)> = known.map(|field| (field.name, field.unit.to_owned())).collect();
    let mut own: Vec<CustomMetric> = Vec::new();
    for table in tables {
        let noted = c.problems.len();
        let name = identifier(c, table, &names);
        let unit = unit(c, table);
        let words: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
        let parsed = expression::parse(&table.expr.value, &words);
        let expression = match parsed {
            Ok(expression) => expression,
            Err(fault) => {
                // The text begins behind its quote.
                let start = table.expr.span.start + 1;
                let remedy = fault.remedy.replace(
                    "write a parameter's name, as in the list that `dispersion.target` takes",
                    "write the name of a metric of the monitor, of a parameter, or of a metric above",
                );
                c.refuse(
                    &(start + fault.place.start..start + fault.place.end),
                    fault.message.replace("there is no parameter", "there is no metric or parameter"),
                    remedy,
                );
                continue;
            }
        };
        check_unit(c, table, &expression, &names, &unit);
        if c.problems.len() > noted {
            continue;
        }
        names.push((name.clone(), unit.clone()));
        let text = table.text.as_ref().map_or_else(|| format!("= {}", table.expr.value), |text| text.value.clone());
        own.push(CustomMetric { name, unit, text, formula: table.expr.value.clone(), expression });
    }
    own
}

fn identifier(c: &mut Checker, table: &MetricTable, names: &[(String, String)]) -> String {
    let name = &table.name.value;
    let legal = |(at, letter): (usize, char)| {
        letter == '_' && at > 0 || letter.is_ascii_lowercase() || letter.is_ascii_digit() && at > 0
    };
    if name.is_empty() || name.len() > 64 || !name.chars().enumerate().all(legal) {
        let remedy = "write lower-case letters, digits and _, a letter first, 64 at most";
        c.refuse(&table.name.span, "this cannot be the name of a metric", remedy);
    } else if name == SUCCESS || names.iter().any(|(other, _)| other == name) {
        let message = format!("`{name}` is a metric or a parameter already");
        c.refuse(&table.name.span, message, "choose another name");
    } else if TAKEN.iter().any(|taken| name.starts_with(taken)) {
        c.refuse(&table.name.span, "the runs table has columns of this name", "choose another name");
    }
    name.clone()
}

fn unit(c: &mut Checker, table: &MetricTable) -> String {
    let unit = table.unit.value.trim().to_owned();
    let problem = match units::is_coherent(&unit) {
        Ok(true) => return unit,
        Ok(false) => format!("`{unit}` is no SI unit without a factor"),
        Err(UnitError::Foreign { symbol, .. } | UnitError::Unknown { symbol: _, near: Some(symbol) }) => {
            format!("this unit is not read; near it: {symbol}")
        }
        Err(_) => "this unit is not read".to_owned(),
    };
    let remedy =
        "values are in SI: write \"N\", \"N s\", \"m/s\", \"1\", ...; a requirement may state its limit in any unit";
    c.refuse(&table.unit.span, problem, remedy);
    "1".to_owned()
}

fn check_unit(c: &mut Checker, table: &MetricTable, expression: &Expression, names: &[(String, String)], unit: &str) {
    let measures: Vec<Measure> =
        names.iter().map(|(_, unit)| Measure::of(units::dimension(unit).unwrap_or_default())).collect();
    let remedy = "numbers in an expression have no unit: divide and multiply quantities, compare like with like";
    match expression.value(&measures).unit() {
        Err(fault) => c.refuse(&table.expr.span, fault.to_string(), remedy),
        Ok(found) if Ok(found) == units::dimension(unit).map(units::Dimension::without_angle).ok_or(()) => {}
        Ok(found) => {
            let message = format!("the expression has the unit {}, not {unit}", found.text());
            c.refuse(
                &table.expr.span,
                message,
                format!("write unit = \"{}\", or correct the expression", found.text()),
            );
        }
    }
}

/// Suffix of a column of a unit: `n_s_per_m`; empty for pure numbers.
fn column_suffix(unit: &str) -> String {
    let word = |part: &str| {
        let symbols = part.split([' ', '*', '·']).filter(|symbol| !symbol.is_empty() && *symbol != "1");
        symbols.map(|symbol| symbol.replace(['^', '(', ')'], "").to_lowercase()).collect::<Vec<_>>().join("_")
    };
    let mut parts = unit.split('/');
    let numerator = word(parts.next().unwrap_or(""));
    let divisors = parts.map(|part| format!("per_{}", word(part)));
    std::iter::once(numerator).filter(|word| !word.is_empty()).chain(divisors).collect::<Vec<_>>().join("_")
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::fields::{filled, unit_suffix};

    #[test]
    fn no_metric_has_the_name_of_a_parameter() {
        let names = |fields: Vec<Field>| fields.into_iter().map(|field| field.name).collect::<Vec<_>>();
        let (metrics, parameters) = (names(fields::<f64, Metrics<f64>>()), names(fields::<f64, Params<f64>>()));
        assert!(metrics.iter().all(|name| !parameters.contains(name) && name != SUCCESS && name != EFFECTIVE_MASS));
        assert!(!parameters.iter().any(|name| name == SUCCESS || name == EFFECTIVE_MASS));
    }

    #[test]
    fn column_suffixes_are_those_of_the_monitors_columns() {
        for field in fields::<f64, Params<f64>>().iter().chain(&fields::<f64, Metrics<f64>>()) {
            assert_eq!(column_suffix(field.unit), unit_suffix(field.unit), "{}", field.unit);
        }
        assert_eq!(column_suffix("N/kg"), "n_per_kg");
    }

    fn custom(name: &str, unit: &str, text: &str) -> CustomMetric {
        let monitor = fields::<f64, Metrics<f64>>().into_iter().map(|field| field.name);
        let parameters = fields::<f64, Params<f64>>().into_iter().map(|field| field.name);
        let names: Vec<String> = monitor.chain([EFFECTIVE_MASS.to_owned()]).chain(parameters).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).chain(["first"]).collect();
        let expression = expression::parse(text, &names).expect(text);
        CustomMetric {
            name: name.to_owned(),
            unit: unit.to_owned(),
            text: String::new(),
            formula: text.to_owned(),
            expression,
        }
    }

    #[test]
    fn custom_metrics_are_computed_in_order_and_have_no_value_where_an_argument_has_none() {
        let all = [
            custom("first", "m/s", "impulse / effective_mass"),
            custom("second", "m/s", "first - closing_speed"),
            custom("third", "s", "capture_time - touch_time"),
            custom("fourth", "1", "1 / impulse"),
        ];
        let metrics = Metrics { impulse: 6.0, touch_time: 1.0, capture_time: -1.0, ..filled(0.0) };
        let inputs = to_vec(&Params { closing_speed: 0.5, ..Params::null() });
        let values = custom_values(&all, &metrics, Some(3.0), &inputs);
        assert_eq!(values, [Some(2.0), Some(1.5), None, Some(1.0 / 6.0)]);
        let still = Metrics { impulse: 0.0, ..metrics };
        assert_eq!(custom_values(&all, &still, None, &inputs), [None, None, None, None], "1/0 is no number");
    }
}
