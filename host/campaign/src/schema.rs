//! JSON Schemas of files for editors: words, units, ranges and examples beside the structure.
//!
//! They are written with keywords that draft 7 and 2020-12 share, since editors of TOML read the older draft.

use crate::ranges::in_words;
use crate::unit_pattern::{any_pattern, pattern};
use crate::units::{noun, suggestions};
use crate::written::key_values::{COUNTS_OF_KEYS, KEYS_OF_DISTRIBUTIONS, UNITS_OF_KEYS, WORDS_OF_KEYS};
use crate::written::{self, PARAMETER};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};
use softdock_kernels::effects::{BENCH_EFFECTS, EFFECTS};
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::params::{Params, row_of};
use std::collections::BTreeMap;

/// A kind of file.
#[derive(Clone, Copy, Debug)]
pub struct SchemaKind {
    /// Word of the command line.
    pub word: &'static str,
    /// What the files hold.
    pub content: &'static str,
    /// Format and version that the files state.
    format: &'static str,
    schema: fn() -> schemars::Schema,
}

/// Every kind of file with keys.
pub const SCHEMA_KINDS: [SchemaKind; 7] = [
    SchemaKind {
        word: "campaign",
        content: "Dispersions, requirements, metrics",
        format: crate::load::FORMAT,
        schema: generated::<written::campaign::CampaignFile>,
    },
    SchemaKind {
        word: "scenario",
        content: "The simulated task and its facility",
        format: crate::scenario::FORMAT,
        schema: generated::<written::scenario::ScenarioFile>,
    },
    SchemaKind {
        word: "facility",
        content: "The real robots, their limits, the sensor, the rules of a session",
        format: crate::station::FORMAT,
        schema: generated::<written::station::StationFile>,
    },
    SchemaKind {
        word: "robot",
        content: "An industrial robot",
        format: crate::robot::FORMAT,
        schema: generated::<written::robot::RobotFile>,
    },
    SchemaKind {
        word: "rig",
        content: "A test rig whose recordings are diagnosed",
        format: crate::rig::FORMAT,
        schema: generated::<written::rig::RigFile>,
    },
    SchemaKind {
        word: "effects",
        content: "Hidden effects of an emulated facility",
        format: crate::effects::FORMAT,
        schema: generated::<crate::effects::EffectsFile>,
    },
    SchemaKind {
        word: "experiment",
        content: "The run to drive next, as a diagnosis proposes it",
        format: crate::experiment::FORMAT,
        schema: generated::<crate::experiment::ExperimentFile>,
    },
];

fn generated<T: JsonSchema>() -> schemars::Schema {
    let settings = SchemaSettings::draft07().with(|settings| settings.definitions_path = "/$defs".into());
    settings.into_generator().into_root_schema_for::<T>()
}

impl SchemaKind {
    /// The JSON Schema of the files.
    pub fn text(&self) -> String {
        let (mut tables, mut quantities) = self.tables();
        if self.word == "campaign" {
            conditions(&mut tables, &mut quantities);
        }
        if let "campaign" | "effects" = self.word {
            replacements(self.word == "campaign", &mut tables, &mut quantities);
        }
        serde_json::to_string_pretty(&whole(tables, quantities)).expect("a schema is plain JSON")
    }

    /// The tables of the files with what their keys hold, and the kinds of quantities that they refer to.
    fn tables(&self) -> (BTreeMap<String, Value>, BTreeMap<String, Value>) {
        let mut root = (self.schema)().to_value();
        remove_nulls(&mut root);
        let (mut tables, mut quantities) = (take_tables(root), BTreeMap::new());
        for (name, table) in &mut tables {
            self.complete(name, table, &mut quantities);
        }
        (tables, quantities)
    }

    /// Adds to a table what its keys hold.
    fn complete(&self, name: &str, table: &mut Value, quantities: &mut BTreeMap<String, Value>) {
        let Some(properties) = table.get_mut("properties").and_then(Value::as_object_mut) else { return };
        let is_own = |kind: &str, of: &str| (kind == "*" || kind == self.word) && of == name;
        for (kind, of, unit, keys) in UNITS_OF_KEYS {
            for key in keys.split(' ').filter(|_| is_own(kind, of)) {
                if let Some(property) = properties.get_mut(key) {
                    refer(property, &defined(unit, quantities));
                }
            }
        }
        for (kind, of, key, words) in WORDS_OF_KEYS {
            if let (true, Some(property)) = (is_own(kind, of), properties.get_mut(*key)) {
                set_words(property, words);
            }
        }
        for (kind, of, key, least, most) in COUNTS_OF_KEYS {
            if let (true, Some(Value::Object(property))) = (is_own(kind, of), properties.get_mut(*key)) {
                property.insert("minimum".to_owned(), json!(least));
                property.insert("maximum".to_owned(), json!(most));
            }
        }
        for property in properties.values_mut() {
            let parameter = property.as_object_mut().and_then(|property| property.remove(PARAMETER));
            if let Some(name) = parameter.as_ref().and_then(Value::as_str) {
                set_parameter(property, name, quantities);
            }
        }
        if name.is_empty() {
            properties["schema"] = json!({ "description": "Format and version of this file.", "const": self.format });
            if let Some(id) = properties.get_mut("id") {
                id["pattern"] = json!("^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$");
            }
        }
        if name == "EffectTable" {
            let ids = EFFECTS.iter().chain(BENCH_EFFECTS).map(|effect| effect.id).chain(["dictionary"]);
            properties["id"]["enum"] = ids.collect();
        }
        if let "TracesTable" | "ContactEventsTable" = name {
            let all = if name == "TracesTable" { "" } else { "all|" };
            let pattern =
                format!(r"^({all}nominal|failed|invalid|worst:\s*[1-9][0-9]{{0,4}}|random:\s*[1-9][0-9]{{0,4}})$");
            properties["keep"]["items"]["pattern"] = json!(pattern);
        }
    }
}

/// The tables of a schema by their names; that of the file itself has none.
fn take_tables(mut root: Value) -> BTreeMap<String, Value> {
    let defined = root.as_object_mut().and_then(|root| root.remove("$defs"));
    let defined = defined.and_then(|tables| tables.as_object().cloned()).unwrap_or_default();
    defined.into_iter().chain([(String::new(), root)]).collect()
}

/// A schema of tables and kinds of quantities.
fn whole(mut tables: BTreeMap<String, Value>, quantities: BTreeMap<String, Value>) -> Value {
    let mut root = tables.remove("").unwrap_or_default();
    // The quantity of any kind stands beside the others.
    let any = json!({
        "description": "A pure number, or a text with number and unit: \"0.5 mm\", \"1500 N/m\", \"4 deg\", \"50 %\".",
        "type": ["number", "string"],
        "pattern": any_pattern(),
    });
    tables.insert("Quantity".to_owned(), any);
    tables.extend(quantities);
    let (mut open, mut used) = (references(&root), BTreeMap::new());
    while let Some(name) = open.pop() {
        if let Some(table) = tables.remove(&name) {
            open.extend(references(&table));
            used.insert(name, table);
        }
    }
    root["$defs"] = Value::Object(used.into_iter().collect());
    root
}

/// The names of the definitions that a schema refers to.
fn references(value: &Value) -> Vec<String> {
    match value {
        Value::Object(object) => {
            let own = object.get("$ref").and_then(Value::as_str).and_then(|name| name.strip_prefix("#/$defs/"));
            object.values().flat_map(references).chain(own.map(str::to_owned)).collect()
        }
        Value::Array(items) => items.iter().flat_map(references).collect(),
        _ => Vec::new(),
    }
}

/// Describes the keys of a scenario that a campaign's variant or an effects file replaces: each in quotes with its whole path.
fn replacements(of_facility: bool, tables: &mut BTreeMap<String, Value>, quantities: &mut BTreeMap<String, Value>) {
    let scenario = SCHEMA_KINDS.iter().find(|kind| kind.word == "scenario").expect("a kind of file");
    let (of_scenario, own) = scenario.tables();
    let mut keys = Map::new();
    let root = &of_scenario[""];
    if of_facility {
        paths("facility", &root["properties"]["facility"], &of_scenario, &mut keys);
        keys.remove("facility");
    } else {
        let properties = root["properties"].as_object().into_iter().flatten();
        properties.for_each(|(key, property)| paths(key, property, &of_scenario, &mut keys));
    }
    if let Some(table) = tables.get_mut("Replacements") {
        table["properties"] = Value::Object(keys);
        table["additionalProperties"] = json!(false);
        table.as_object_mut().map(|table| table.remove("propertyNames"));
    }
    tables.extend(of_scenario.into_iter().filter(|(name, _)| !name.is_empty() && name != "Quantity"));
    quantities.extend(own);
}

/// Adds a key and all keys inside it by their paths; the items of lists have no paths.
fn paths(path: &str, property: &Value, tables: &BTreeMap<String, Value>, keys: &mut Map<String, Value>) {
    keys.insert(path.to_owned(), property.clone());
    let named =
        |value: &Value| value["$ref"].as_str().and_then(|name| name.strip_prefix("#/$defs/")).map(str::to_owned);
    let table = named(property).or_else(|| named(&property["allOf"][0])).and_then(|name| tables.get(&name));
    let inside = table.and_then(|table| table["properties"].as_object()).into_iter().flatten();
    inside.for_each(|(key, property)| paths(&format!("{path}.{key}"), property, tables, keys));
}

/// Removes the null that a key without a value has in Rust: in TOML such a key is not written.
fn remove_nulls(value: &mut Value) {
    match value {
        Value::Object(object) => {
            if let Some(Value::Array(types)) = object.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    object.insert("type".to_owned(), only);
                }
            }
            let choices = object.get("anyOf").and_then(Value::as_array).cloned().unwrap_or_default();
            let real: Vec<Value> = choices.iter().filter(|choice| choice["type"] != "null").cloned().collect();
            if real.len() < choices.len() {
                object.remove("anyOf");
                let rest = if let [only] = real.as_slice() { ("allOf", json!([only])) } else { ("anyOf", json!(real)) };
                object.insert(rest.0.to_owned(), rest.1);
            }
            if object.get("default").is_some_and(Value::is_null) {
                object.remove("default");
            }
            // A format of Rust that editors do not know.
            object.remove("format");
            object.values_mut().for_each(remove_nulls);
        }
        Value::Array(items) => items.iter_mut().for_each(remove_nulls),
        _ => {}
    }
}

/// The name of a kind of quantity among the definitions, which is added; `unit` as in [`UNITS_OF_KEYS`].
fn defined(unit: &str, quantities: &mut BTreeMap<String, Value>) -> String {
    if unit.contains('|') {
        let names: Vec<String> = unit.split('|').map(|unit| defined(unit, quantities)).collect();
        let either = names.join("_or_");
        let choices: Vec<Value> = names.iter().map(|name| reference(name)).collect();
        quantities.insert(either.clone(), json!({ "anyOf": choices }));
        return either;
    }
    let (unit, is_positive) = unit.strip_prefix('+').map_or((unit, false), |unit| (unit, true));
    if unit == "share" {
        let percent = r"^\s*(?:100(?:\.0*)?|[0-9]{1,2}(?:\.[0-9]*)?)\s*%\s*$|^\s*(?:1(?:\.0*)?|0?\.[0-9]+|0)\s*$";
        let schema = json!({
            "description": "A share from 0 to 1, or in per cent.",
            "anyOf": [{ "type": "number", "minimum": 0, "maximum": 1 }, { "type": "string", "pattern": percent }],
            "examples": [0.9, "90 %"],
        });
        quantities.insert("share".to_owned(), schema);
        return "share".to_owned();
    }
    let what = noun(unit).trim_start_matches("an ").trim_start_matches("a ");
    let sign = if is_positive { "_not_negative" } else { "" };
    let suffix = unit.replace('/', " per ").replace(['^', '(', ')'], "");
    let suffix = if unit == "1" {
        String::new()
    } else {
        format!("_{}", suffix.split_whitespace().collect::<Vec<_>>().join("_"))
    };
    let name = format!("{}{suffix}{sign}", what.replace(' ', "_"));
    let mut text = pattern(unit);
    if is_positive {
        // A sign before the number.
        text = text.replacen("[-+]?", "[+]?", 1);
    }
    let schema = if unit == "1" {
        let number = if is_positive { json!({ "type": "number", "minimum": 0 }) } else { json!({ "type": "number" }) };
        json!({
            "description": "A pure number.", "anyOf": [number, { "type": "string", "pattern": text }],
            "examples": [0.5, "50 %"],
        })
    } else {
        let examples = suggestions(unit).split(", ").take(2).map(|unit| format!("1.5 {unit}")).collect::<Vec<_>>();
        let description = format!("{} with its unit: {}.", capital(what), suggestions(unit));
        json!({ "description": description, "type": "string", "pattern": text, "examples": examples })
    };
    quantities.insert(name.clone(), schema);
    name
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

/// Replaces the quantity of any kind in a property by one of a kind.
fn refer(property: &mut Value, name: &str) {
    match property {
        Value::Object(object) => match object.get("$ref").and_then(Value::as_str) {
            Some("#/$defs/Quantity") => drop(object.insert("$ref".to_owned(), reference(name)["$ref"].clone())),
            Some("#/$defs/QuantityOrList") => {
                object.remove("$ref");
                object.insert(
                    "anyOf".to_owned(),
                    json!([reference(name), { "type": "array", "items": reference(name) }]),
                );
            }
            _ => object.values_mut().for_each(|inner| refer(inner, name)),
        },
        Value::Array(items) => items.iter_mut().for_each(|inner| refer(inner, name)),
        _ => {}
    }
}

/// Lists the words of a property, or of the items of a list.
fn set_words(property: &mut Value, words: &str) {
    let fallback = words.split(' ').find_map(|word| word.strip_prefix('*'));
    let words: Vec<&str> = words.split(' ').map(|word| word.trim_start_matches('*')).collect();
    let holder = if property["items"].is_object() { &mut property["items"] } else { &mut *property };
    holder["enum"] = json!(words);
    if let Some(fallback) = fallback {
        property["default"] = json!(fallback);
    }
}

/// The row of a parameter of a run, or of a component of a vector; of a drive, that of robot 1.
fn parameter_row(name: &str) -> Option<&'static Field> {
    let names = [name.to_owned(), format!("{name}_x"), format!("robot1_{name}"), format!("robot1_{name}_x")];
    names.iter().find_map(|name| row_of(name))
}

/// Gives a property unit, range and meaning of a parameter.
fn set_parameter(property: &mut Value, name: &str, quantities: &mut BTreeMap<String, Value>) {
    let Some((row, range)) = parameter_row(name).and_then(|row| Some((row, row.range?))) else { return };
    let is_positive = range.min >= 0.0;
    let unit = format!("{}{}", if is_positive { "+" } else { "" }, row.unit);
    refer(property, &defined(&unit, quantities));
    let Some(object) = property.as_object_mut() else { return };
    let text = object.get("description").and_then(Value::as_str).unwrap_or_default();
    let range_text = format!("{text} Legal: {}.", in_words(range, row.unit));
    object.insert("description".to_owned(), json!(range_text));
    let is_vector = object.get("items").is_some();
    if is_vector {
        object.insert("minItems".to_owned(), json!(3));
        object.insert("maxItems".to_owned(), json!(3));
    }
    // A range of texts with units cannot be stated.
    if row.unit == "1" {
        let holder = if is_vector { object.get_mut("items").and_then(Value::as_object_mut) } else { Some(object) };
        if let Some(holder) = holder {
            wrap_reference(holder);
            holder.insert("minimum".to_owned(), json!(range.min));
            holder.insert("maximum".to_owned(), json!(range.max));
        }
    }
}

/// Puts a reference where draft 7 reads what stands beside it.
fn wrap_reference(holder: &mut Map<String, Value>) {
    if let Some(reference) = holder.remove("$ref") {
        holder.insert("allOf".to_owned(), json!([{ "$ref": reference }]));
    }
}

/// What a campaign's keys hold depending on other keys: units by target and metric, keys by the kind of a distribution.
fn conditions(tables: &mut BTreeMap<String, Value>, quantities: &mut BTreeMap<String, Value>) {
    let parameters = fields::<f64, Params<f64>>();
    let mut names: Vec<String> = parameters.iter().map(|field| field.name.clone()).collect();
    let vectors = parameters.iter().filter_map(|field| Some(crate::ranges::vector_name(&field.name)?.to_owned()));
    let mut vectors: Vec<String> = vectors.collect();
    vectors.dedup();
    names.extend(vectors);
    let target = json!({ "anyOf": [{ "enum": names }, { "pattern": r"^scenario\." }] });
    let metrics = fields::<f64, Metrics<f64>>();
    let metric_names: Vec<&str> = metrics.iter().map(|field| field.name.as_str()).chain(["success"]).collect();
    let rates: Vec<&str> = crate::requirement::RATES.iter().map(|row| row.0).collect();
    if let Some(dispersion) = tables.get_mut("DispersionTable") {
        dispersion["properties"]["target"]["anyOf"] = target["anyOf"].clone();
        dispersion["properties"]["targets"]["items"]["anyOf"] = target["anyOf"].clone();
        let by_unit = by_unit(&parameters, true);
        let rule = |(unit, names): (&&str, &Vec<String>)| {
            let name = defined(unit, quantities);
            let (one, list) = (reference(&name), json!({ "type": "array", "items": reference(&name) }));
            let either = json!({ "anyOf": [one, list] });
            let keys = json!({
                "value": one, "min": one, "max": one, "mode": one, "scale": one, "values": list, "mean": either, "sigma": either,
            });
            let then = json!({ "properties": { "dist": { "properties": keys } } });
            condition("target", &json!({ "enum": names }), then)
        };
        dispersion["allOf"] = by_unit.iter().map(rule).collect();
        dispersion["properties"]["target"]["examples"] = json!(["loop_delay", "contact_friction", "offset"]);
    }
    if let Some(derived) = tables.get_mut("DerivedTable") {
        derived["properties"]["target"]["enum"] = parameters.iter().map(|field| json!(field.name)).collect();
    }
    if let Some(distribution) = tables.get_mut("DistributionTable") {
        let rule = |(kind, keys): &(&str, &str)| {
            condition("kind", &json!({ "const": kind }), json!({ "required": keys.split(' ').collect::<Vec<_>>() }))
        };
        distribution["allOf"] = KEYS_OF_DISTRIBUTIONS.iter().map(rule).collect();
    }
    if let Some(requirement) = tables.get_mut("RequirementTable") {
        let limit = |(unit, names): (&&str, &Vec<String>)| {
            let name = reference(&defined(unit, quantities));
            let then = json!({ "properties": { "at_most": name, "at_least": name } });
            condition("metric", &json!({ "enum": names }), then)
        };
        let mut rules: Vec<Value> = by_unit(&metrics, false).iter().map(limit).collect();
        let is_agreement = json!({ "const": "agreement" });
        let mut rule = condition("subject", &is_agreement, json!({ "properties": { "metric": { "enum": rates } } }));
        rule["else"] = json!({ "required": ["probability"] });
        rules.push(rule);
        requirement["allOf"] = json!(rules);
    }
    // Without custom metrics only the monitor's have names.
    if let Some(root) = tables.get_mut("") {
        let known: Vec<&str> = metric_names.into_iter().chain(rates).collect();
        let metric = json!({ "properties": { "metric": { "enum": known } } });
        root["if"] = json!({ "not": { "required": ["metric"] } });
        root["then"] = json!({ "properties": { "requirement": { "items": metric } } });
    }
}

/// A rule for tables in which a key holds something.
fn condition(key: &str, holds: &Value, then: Value) -> Value {
    json!({ "if": { "properties": { key: holds }, "required": [key] }, "then": then })
}

/// The names of fields, and of whole vectors, by their units.
fn by_unit(fields: &[Field], with_vectors: bool) -> BTreeMap<&'static str, Vec<String>> {
    let mut units: BTreeMap<&'static str, Vec<String>> = BTreeMap::new();
    for field in fields {
        let names = units.entry(field.unit).or_default();
        names.push(field.name.clone());
        let vector = crate::ranges::vector_name(&field.name).filter(|_| with_vectors);
        if let Some(vector) = vector.filter(|vector| !names.iter().any(|name| name == vector)) {
            names.push(vector.to_owned());
        }
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::quantity;
    use crate::{Campaign, Setting, Settings};
    use std::path::Path;

    fn schema(word: &str) -> Value {
        let kind = SCHEMA_KINDS.iter().find(|kind| kind.word == word).expect("a kind");
        serde_json::from_str(&kind.text()).expect("JSON")
    }

    #[test]
    fn every_row_names_a_key_of_a_schema() {
        let schemas = SCHEMA_KINDS.map(|kind| (kind.word, schema(kind.word)));
        let has = |kind: &str, table: &str, key: &str| {
            let mut kinds = schemas.iter().filter(|(own, _)| kind == "*" || *own == kind);
            kinds.any(|(_, schema)| {
                let table = if table.is_empty() { schema } else { &schema["$defs"][table] };
                table["properties"][key].is_object()
            })
        };
        for (kind, table, unit, keys) in UNITS_OF_KEYS {
            for unit in unit.split('|').map(|unit| unit.trim_start_matches('+')) {
                assert!(unit == "share" || quantity(&format!("1 {unit}"), unit) == Ok(1.0), "{unit}");
            }
            for key in keys.split(' ') {
                assert!(has(kind, table, key), "{kind} {table} {key}");
            }
        }
        let words = WORDS_OF_KEYS.iter().map(|(kind, table, key, _)| (kind, table, key));
        let counts = COUNTS_OF_KEYS.iter().map(|(kind, table, key, ..)| (kind, table, key));
        for (kind, table, key) in words.chain(counts) {
            assert!(has(kind, table, key), "{kind} {table} {key}");
        }
    }

    /// What the reader of a shipped campaign expects in place of a set value.
    fn expected(key: &str, campaign: &str) -> String {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns").join(campaign);
        let setting: Setting = format!("{key}=qqq").parse().expect("KEY=VALUE");
        let problems = Campaign::load_set(&file, None, &Settings::new(vec![setting]).expect("one")).map(|_| ());
        problems.expect_err(key).iter().next().expect("never empty").expected.clone()
    }

    #[test]
    fn words_are_those_that_the_reader_takes() {
        let keys = [
            ("backend", "ExecutionTable", "execution.backend", "smoke.toml"),
            ("invalid", "ExecutionTable", "execution.invalid", "smoke.toml"),
            ("method", "SamplingTable", "sampling.method", "smoke.toml"),
            ("class", "DispersionTable", "dispersion[1].class", "smoke.toml"),
            ("kind", "DistributionTable", "dispersion[1].dist.kind", "smoke.toml"),
            ("subject", "RequirementTable", "requirement[1].subject", "smoke.toml"),
            ("law", "ContactTable", "scenario.contact.law", "smoke.toml"),
            ("shape", "SolidTable", "scenario.part_b.solid[1].shape", "smoke.toml"),
            ("law", "ControllerTable", "scenario.arm.controller.law", "probe_drogue.toml"),
            ("kind", "CompensatorTable", "scenario.facility.compensator.kind", "smoke.toml"),
            ("feedforward", "JointLevelTable", "scenario.facility.joint_level.feedforward", "smoke_joint.toml"),
            ("waveform", "TestMotionTable", "scenario.facility.test_motion.waveform", "facility_sine.toml"),
        ];
        for (key, table, path, campaign) in keys {
            let row = WORDS_OF_KEYS.iter().find(|row| (row.1, row.2) == (table, key)).expect("a row");
            let words = row.3.replace('*', "").replace(' ', ", ");
            assert_eq!(expected(path, campaign), words, "{path}");
        }
    }

    #[test]
    fn units_are_those_that_the_reader_takes() {
        let keys = [
            ("timing.time_limit", "TimingTable", "time_limit", "smoke.toml"),
            ("base.mass", "BaseTable", "mass", "smoke.toml"),
            ("contact.stiffness", "ContactTable", "stiffness", "smoke.toml"),
            ("latch.depth", "LatchTable", "depth", "smoke.toml"),
            ("latch.angle", "LatchTable", "angle", "smoke.toml"),
            ("latch.speed", "LatchTable", "speed", "smoke.toml"),
            ("start.gap", "StartTable", "gap", "smoke.toml"),
            ("part_b.solid[1].mouth", "SolidTable", "mouth", "smoke.toml"),
            ("task.max_depth", "TaskTable", "max_depth", "smoke.toml"),
            ("soft_capture.stiffness", "SoftCaptureTable", "stiffness", "soft_capture.toml"),
            ("soft_capture.damping", "SoftCaptureTable", "damping", "soft_capture.toml"),
            ("soft_capture.turn", "SoftCaptureTable", "turn", "soft_capture.toml"),
        ];
        for (path, table, key, campaign) in keys {
            let of_key = |row: &&(&str, &str, &str, &str)| row.1 == table && row.3.split(' ').any(|own| own == key);
            let unit = UNITS_OF_KEYS.iter().find(of_key).expect("a row").2.trim_start_matches('+');
            let shown = expected(&format!("scenario.{path}"), campaign);
            assert!(shown.starts_with(noun(unit)), "{path}: {shown}, not {}", noun(unit));
        }
    }

    #[test]
    fn every_kind_of_distribution_has_its_keys() {
        let row = WORDS_OF_KEYS.iter().find(|row| row.1 == "DistributionTable").expect("a row");
        let kinds: Vec<&str> = KEYS_OF_DISTRIBUTIONS.iter().map(|row| row.0).collect();
        assert_eq!(row.3.split(' ').collect::<Vec<_>>(), kinds);
    }
}
