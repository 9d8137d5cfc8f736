//! Keys of the scenario that a campaign disperses: where they stand, their units, and the scenario with values of a run.

use crate::key_path::{Fault, Step, steps};
use crate::problem::Problems;
use crate::read;
use crate::scenario::{FORMAT, Scenario};
use crate::source::Source;
use crate::suggest::{did_you_mean, suggestion};
use crate::units::{quantity, si_unit_of};
use softdock_kernels::fields::{Field, unit_suffix};
use std::ops::Range as Span;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Tables and keys that are the same in all runs, each with the reason.
const COMMON: [(&str, &str); 6] = [
    ("timing", "all runs of a campaign have the same steps and the same time limit"),
    ("task", "the criteria are the same for all runs: judge other limits with [[requirement]]"),
    ("schema", "it is no number of the task"),
    ("id", "it is no number of the task"),
    ("title", "it is no number of the task"),
    ("effect", "an effect that was identified has its own uncertainty: disperse the parameter"),
];

/// A number of the scenario file that has a value of its own in each run.
#[derive(Clone, Debug)]
pub struct ScenarioKey {
    /// Its path as the campaign writes it, with `scenario.` before it.
    pub path: String,
    /// SI unit.
    pub unit: &'static str,
    /// Value that the scenario writes, SI.
    pub nominal: f64,
    steps: Vec<Step>,
    /// Places of the values in the file.
    places: Vec<Span<usize>>,
    form: Form,
}

/// How a number stands in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// `"5 mm"`.
    Text,
    /// `0.5`.
    Float,
    /// `8`.
    Integer,
}

/// What a campaign draws besides parameters; its fields stand behind those of the parameters.
#[derive(Clone, Debug)]
pub(crate) enum Extra {
    /// A variable of the campaign, by its name.
    Variable(String),
    /// A key of the scenario.
    Key(ScenarioKey),
}

impl Extra {
    /// The key of the scenario; `None` for a variable.
    pub(crate) fn key(&self) -> Option<&ScenarioKey> {
        match self {
            Self::Key(key) => Some(key),
            Self::Variable(_) => None,
        }
    }

    pub(crate) fn field(&self) -> Field {
        match self {
            Self::Variable(name) => Field::new(name, "1", "variable of the campaign"),
            Self::Key(key) => key.field(),
        }
    }
}

impl ScenarioKey {
    /// The column of its values in a runs table.
    pub fn column(&self) -> String {
        column(&self.path, self.unit)
    }

    /// Its row among the inputs of a campaign.
    pub(crate) fn field(&self) -> Field {
        Field::new(&self.path, self.unit, "key of the scenario")
    }
}

/// `in_scenario_contact_pair_1_stiffness_n_per_m`.
fn column(path: &str, unit: &str) -> String {
    let words = path.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|word| !word.is_empty());
    let name = words.collect::<Vec<_>>().join("_");
    match unit_suffix(unit) {
        "" => format!("in_{name}"),
        suffix => format!("in_{name}_{suffix}"),
    }
}

impl ScenarioKey {
    /// The key of a scenario at a path that begins with [`PREFIX`](crate::key_path::PREFIX).
    pub(crate) fn find(source: &Source, path: &str) -> Result<Self, Fault> {
        let steps = steps(path)?;
        if let Some(Step::Key(first)) = steps.first()
            && let Some((_, why)) = COMMON.iter().find(|(key, _)| key == first)
        {
            return Err((format!("`{path}` cannot vary from run to run: {why}"), "disperse another key".into()));
        }
        let behind = read::overlay_text(source);
        let table = read::overlaid_table(source, FORMAT, &behind).expect("the scenario was read");
        let mut table = DeValue::Table(table.into_inner());
        let mut found: Option<Self> = None;
        for place in places(&mut table, &steps, path)? {
            let (unit, nominal, form) = number(place.get_ref()).ok_or_else(|| not_a_number(place.get_ref(), path))?;
            let own = || Self { path: path.to_owned(), unit, nominal, steps: steps.clone(), places: Vec::new(), form };
            let first = found.get_or_insert_with(own);
            first.places.push(place.span());
            if (unit, form) != (first.unit, first.form) {
                let message = format!("the items of `{path}` are not written as quantities of one kind");
                return Err((message, "write a [[dispersion]] for each, by its number".into()));
            }
        }
        Ok(found.expect("a path leads to a value"))
    }

    /// Whether another key sets one of the same values.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.places.iter().any(|place| other.places.contains(place))
    }

    /// A value as the scenario would write it.
    fn written(&self, value: f64) -> String {
        match self.form {
            Form::Text if self.unit == "1" => format!("\"{value}\""),
            Form::Text => format!("\"{value} {}\"", self.unit),
            Form::Integer if value.fract() == 0.0 => format!("{value:.0}"),
            Form::Float | Form::Integer => format!("{value:?}"),
        }
    }
}

impl Scenario {
    /// The scenario with these values of its keys, SI.
    ///
    /// # Errors
    /// Whatever the scenario's reader refuses.
    pub(crate) fn with_keys(&self, values: &[(&ScenarioKey, f64)]) -> Result<Self, Problems> {
        let texts: Vec<String> = values.iter().map(|(key, value)| key.written(*value)).collect();
        let behind = read::overlay_text(self.source());
        let table = read::overlaid_table(self.source(), FORMAT, &behind)?;
        let span = table.span();
        let mut table = DeValue::Table(table.into_inner());
        for ((key, _), text) in values.iter().zip(&texts) {
            for place in places(&mut table, &key.steps, &key.path).expect("found when the campaign was read") {
                *place.get_mut() = DeValue::parse(text).expect("a number").into_inner();
            }
        }
        let DeValue::Table(table) = table else { unreachable!("it was a table") };
        self.read_again(Spanned::new(span, table))
    }
}

/// The values at a path; several where an item is named and others have the same name.
fn places<'t, 'i>(
    table: &'t mut DeValue<'i>,
    steps: &[Step],
    path: &str,
) -> Result<Vec<&'t mut Spanned<DeValue<'i>>>, Fault> {
    let (Some(Step::Key(first)), DeValue::Table(table)) = (steps.first(), table) else {
        unreachable!("a path begins with a key of the file")
    };
    let mut found = vec![in_table(table, first, path)?];
    for step in &steps[1..] {
        let mut next = Vec::new();
        for value in found {
            next.extend(inside(value, step, path)?);
        }
        found = next;
    }
    Ok(found)
}

fn in_table<'t, 'i>(table: &'t mut DeTable<'i>, key: &str, path: &str) -> Result<&'t mut Spanned<DeValue<'i>>, Fault> {
    let names: Vec<String> = table.iter().map(|(key, _)| key.get_ref().to_string()).collect();
    table.get_mut(key).ok_or_else(|| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let remedy = did_you_mean(key, &names).map_or_else(
            || "write its nominal value in the scenario first: only what stands there is dispersed".to_owned(),
            |question| format!("{question} Only what the scenario writes is dispersed"),
        );
        (format!("the scenario does not write `{key}` of `{path}`"), remedy)
    })
}

/// What a step finds in a value.
fn inside<'t, 'i>(
    value: &'t mut Spanned<DeValue<'i>>,
    step: &Step,
    path: &str,
) -> Result<Vec<&'t mut Spanned<DeValue<'i>>>, Fault> {
    let fault = |what: String, remedy: &str| (format!("`{path}`: {what}"), remedy.to_owned());
    match (value.get_mut(), step) {
        (DeValue::Table(table), Step::Key(key)) => Ok(vec![in_table(table, key, path)?]),
        (DeValue::Array(list), step) => in_list(list, step, path),
        (_, Step::Key(key)) => Err(fault(format!("the value before `{key}` has no keys"), "end the path there")),
        (_, Step::Item(_) | Step::Named(_)) => Err(fault("this is no list".into(), "remove the brackets")),
    }
}

fn in_list<'t, 'i>(
    list: &'t mut DeArray<'i>,
    step: &Step,
    path: &str,
) -> Result<Vec<&'t mut Spanned<DeValue<'i>>>, Fault> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let count = list.len();
    let item = match step {
        Step::Item(at) => *at,
        Step::Named(name) => return named(list, name, path),
        Step::Key(axis) if count == 3 && AXES.contains(&axis.as_str()) => {
            AXES.iter().take_while(|own| *own != axis).count()
        }
        Step::Key(key) => {
            let remedy = "write the number or the name of an item in brackets, as pair[1] or solid[bumper]; x, y and z name \
                          the components of a vector";
            return Err((format!("`{path}`: `{key}` is asked of a list"), remedy.to_owned()));
        }
    };
    let found = list.get_mut(item).map(|found| vec![found]);
    found.ok_or_else(|| {
        let message = format!("`{path}`: there is no item {}, the list has {count}", item + 1);
        (message, format!("write a number from 1 to {count}"))
    })
}

/// The items of a list with a name.
fn named<'t, 'i>(
    list: &'t mut DeArray<'i>,
    name: &str,
    path: &str,
) -> Result<Vec<&'t mut Spanned<DeValue<'i>>>, Fault> {
    let name_of = |item: &Spanned<DeValue>| {
        let name = item.get_ref().as_table()?.get("name")?.get_ref().as_str()?;
        Some(name.to_owned())
    };
    let names: Vec<String> = list.iter().filter_map(name_of).collect();
    let named: Vec<_> = list.iter_mut().filter(|item| name_of(item).as_deref() == Some(name)).collect();
    if named.is_empty() {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        let remedy = match known.as_slice() {
            [] => "the items have no names: write a number from 1".to_owned(),
            known => suggestion(name, known),
        };
        return Err((format!("`{path}`: no item has the name `{name}`"), remedy));
    }
    Ok(named)
}

/// SI unit, value and form of a number as written.
fn number(value: &DeValue) -> Option<(&'static str, f64, Form)> {
    match value {
        DeValue::String(text) => {
            let unit = si_unit_of(text)?;
            Some((unit, quantity(text, unit).ok()?, Form::Text))
        }
        DeValue::Float(number) => Some(("1", number.as_str().parse().ok()?, Form::Float)),
        DeValue::Integer(number) => Some(("1", number.as_str().parse().ok()?, Form::Integer)),
        _ => None,
    }
}

fn not_a_number(value: &DeValue, path: &str) -> Fault {
    match value {
        DeValue::Array(_) => (
            format!("`{path}` is a list"),
            format!("name one of its numbers: {path}[1]{}", ", or .x, .y, .z of a vector"),
        ),
        DeValue::Table(_) => (format!("`{path}` is a table"), "name a key of it".to_owned()),
        _ => (format!("`{path}` is no number"), "disperse a number; a choice between words needs a variant".to_owned()),
    }
}

#[cfg(test)]
mod tests;
