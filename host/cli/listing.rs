//! `softdock params`, `metrics`, `effects` and `signals`: what can be written in files, and what results hold.

use crate::terminal::{Exit, Failure, Format, Outcome};
use clap::Args;
use serde_json::{Value, json};
use softdock_campaign::suggest::{did_you_mean, names_for};
use softdock_campaign::{Campaign, legal_range};
use softdock_farm::signal_rows;
use softdock_kernels::effects::{EFFECTS, Effect, EffectParameter, Null};
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::metrics::{Metrics, Presence};
use softdock_kernels::params::{Params, row_of};
use softdock_kernels::plant::Plant;
use std::path::PathBuf;

/// Arguments of a command that lists a table.
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    /// Word in name or meaning.
    word: Option<String>,
}

/// A table for people and programs: a line for each row.
pub(crate) struct Listing {
    /// Names of the columns.
    pub(crate) head: &'static [&'static str],
    /// Numbers and texts, in the order of the columns.
    pub(crate) rows: Vec<Vec<Value>>,
}

impl Listing {
    /// Prints the rows as JSON, or as aligned lines with a last line.
    pub(crate) fn print(&self, format: &Format, last: &str) {
        format.print(|| self.json(), || self.text() + last);
    }

    fn json(&self) -> Value {
        let row = |row: &Vec<Value>| -> Value {
            self.head
                .iter()
                .map(|name| (*name).to_owned())
                .zip(row.iter().cloned())
                .collect::<serde_json::Map<_, _>>()
                .into()
        };
        self.rows.iter().map(row).collect()
    }

    fn text(&self) -> String {
        let head = self.head.iter().map(|name| (*name).to_owned()).collect();
        let cells: Vec<Vec<String>> =
            std::iter::once(head).chain(self.rows.iter().map(|row| row.iter().map(cell).collect())).collect();
        let width = |column: usize| cells.iter().map(|row| row[column].chars().count()).max().unwrap_or_default();
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        let line = |row: &Vec<String>| -> String {
            let padded: String = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}  ")).collect();
            padded.trim_end().to_owned() + "\n"
        };
        cells.iter().map(line).collect()
    }
}

/// A value as a cell of the text.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number.as_f64().map_or_else(String::new, short),
        Value::Array(items) => items.iter().map(cell).collect::<Vec<_>>().join(" to "),
        other => other.to_string(),
    }
}

/// A number with as few digits as it needs.
fn short(number: f64) -> String {
    let is_plain = number == 0.0 || (1e-3..1e6).contains(&number.abs());
    if is_plain { format!("{number}") } else { format!("{number:e}") }
}

/// A finite number as JSON; null where there is no limit.
fn finite(number: f64) -> Value {
    if number.is_finite() { json!(number) } else { Value::Null }
}

/// The rows of which a name or the meaning holds a word, or which the word stands for; all rows without a word.
pub(crate) fn search<'a, T, const N: usize>(
    rows: Vec<T>,
    word: Option<&str>,
    kind: &str,
    names: impl Fn(&T) -> [&'a str; N],
    meaning: impl Fn(&T) -> &'a str,
) -> Result<Vec<T>, Failure> {
    let Some(word) = word else { return Ok(rows) };
    let small = word.to_lowercase();
    let stands_for = names_for(word);
    let holds = |row: &T| {
        let is_named = names(row).iter().any(|name| name.to_lowercase().contains(&small) || stands_for.contains(name));
        is_named || meaning(row).to_lowercase().contains(&small)
    };
    let all: Vec<&str> = rows.iter().flat_map(&names).collect();
    let near = did_you_mean(word, &all).unwrap_or_default();
    let found: Vec<T> = rows.into_iter().filter(holds).collect();
    if found.is_empty() {
        let remedy = format!("{near} without a word the command lists all");
        return Err(Failure::new(format!("no {kind} has `{word}` in its name or meaning"), remedy.trim_start()));
    }
    Ok(found)
}

/// The rows of a table of fields that hold a word.
fn field_rows<'a>(table: &'a [Field], args: &ListArgs, kind: &str) -> Result<Vec<&'a Field>, Failure> {
    search(table.iter().collect(), args.word.as_deref(), kind, |field| [field.name.as_str()], |field| field.meaning)
}

pub(crate) fn params(args: &ListArgs, format: &Format) -> Outcome {
    let table = fields::<f64, Params<f64>>();
    let row = |field: &&Field| {
        let (least, most) = legal_range(&field.name);
        let range = json!([finite(least), finite(most)]);
        vec![json!(field.name), json!(field.unit), range, finite(field.null), json!(field.meaning)]
    };
    let rows = field_rows(&table, args, "parameter")?.iter().map(row).collect();
    Listing { head: &["name", "unit", "range", "null", "meaning"], rows }.print(format, "");
    Ok(Exit::Done)
}

pub(crate) fn metrics(args: &ListArgs, format: &Format) -> Outcome {
    let table = fields::<f64, Metrics<f64>>();
    let row = |field: &&Field| {
        let value = match Presence::of(field) {
            Presence::Always => "always",
            Presence::Happened => "if it happened",
            Presence::Tested => "with a test motion",
        };
        vec![json!(field.name), json!(field.unit), json!(value), json!(field.meaning)]
    };
    let rows = field_rows(&table, args, "metric")?.iter().map(row).collect();
    Listing { head: &["name", "unit", "value", "meaning"], rows }.print(format, "");
    Ok(Exit::Done)
}

pub(crate) fn effects(args: &ListArgs, format: &Format) -> Outcome {
    let found = search(
        EFFECTS.iter().collect(),
        args.word.as_deref(),
        "effect",
        |row| [row.id, row.component],
        |row| row.name,
    )?;
    let row = |effect: &&Effect| {
        let parameters: Vec<String> = effect.parameters.iter().map(parameter).collect();
        vec![json!(effect.id), json!(effect.component), json!(effect.name), json!(parameters.join(", "))]
    };
    let rows = found.iter().map(row).collect();
    Listing { head: &["id", "component", "meaning", "parameters (null; plausible size)"], rows }.print(format, "");
    Ok(Exit::Done)
}

/// A parameter of an effect with its null value and a plausible size.
fn parameter(parameter: &EffectParameter) -> String {
    let row = row_of(parameter.field);
    let unit = row.map_or("1", |row| row.unit);
    let null = match parameter.null {
        Null::OfRow => row.map_or_else(String::new, |row| short(row.null)),
        Null::OwnDelay => "the loop's own delay".to_owned(),
        Null::Any => "shapes it".to_owned(),
    };
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    format!("{} ({null}; {}{unit})", parameter.field, short(parameter.scale))
}

/// Arguments of the list of signals.
#[derive(Args, Debug)]
pub(crate) struct SignalsArgs {
    /// Word in name or meaning.
    word: Option<String>,
    /// List also the poses of this campaign: its base, arm, parts and robots.
    #[arg(long, value_name = "FILE")]
    campaign: Option<PathBuf>,
}

pub(crate) fn signals(args: &SignalsArgs, format: &Format) -> Outcome {
    let campaign = args.campaign.as_deref().map(Campaign::load).transpose()?;
    let plant = campaign.map(|campaign| Plant::new(campaign.scenario.model));
    let table = signal_rows(plant.as_ref());
    let rows = table.iter().collect();
    let found = search(rows, args.word.as_deref(), "signal", |row| [row.0.as_str()], |row| row.2.as_str())?;
    let rows = found.iter().map(|(name, unit, meaning)| vec![json!(name), json!(unit), json!(meaning)]).collect();
    let last = match plant {
        Some(_) => "",
        None => "\nwith --campaign FILE also the poses of base, arm, parts and robots",
    };
    Listing { head: &["column", "unit", "meaning"], rows }.print(format, last);
    Ok(Exit::Done)
}
