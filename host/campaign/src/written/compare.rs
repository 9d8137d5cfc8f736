//! Variants of the facility and their comparison as written.

use super::campaign::DerivedTable;
use super::{At, Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use std::fmt;

/// One facility: the scenario's, with some keys replaced.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct VariantTable {
    /// Name, also of its results folder: letters, digits, - and _.
    pub(crate) name: At<String>,
    /// One line for people; default the name.
    pub(crate) title: Option<At<String>>,
    /// Keys of the scenario's `[facility]` in quotes, each with its new value: `{ "facility.loop_delay" = "8 ms" }`.
    #[serde(default)]
    pub(crate) set: Replacements,
    /// Parameters that follow from others in this variant, besides or instead of the campaign's.
    #[serde(default)]
    pub(crate) derived: Vec<DerivedTable>,
}

/// The keys that are replaced; their values are read as parts of the scenario.
#[derive(Debug, Default)]
pub(crate) struct Replacements(pub(crate) Vec<At<String>>);

impl<'de> Deserialize<'de> for Replacements {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Keys;
        impl<'de> Visitor<'de> for Keys {
            type Value = Replacements;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("keys of the scenario in quotes, { \"facility.loop_delay\" = \"8 ms\" }")
            }
            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Replacements, M::Error> {
                let mut keys = Vec::new();
                while let Some(key) = map.next_key::<At<String>>()? {
                    map.next_value::<IgnoredAny>().map_err(M::Error::custom)?;
                    keys.push(key);
                }
                Ok(Replacements(keys))
            }
        }
        deserializer.deserialize_map(Keys)
    }
}

impl JsonSchema for Replacements {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Replacements".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Keys of the scenario's [facility] in quotes, each with its new value.",
            "type": "object",
            "propertyNames": { "pattern": "^facility" }
        })
    }
}

/// How the variants are compared on the page.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompareTable {
    /// Dispersed or derived parameter along which rates and metrics are shown.
    pub(crate) along: Option<At<String>>,
    /// Ends of the bands along it, ascending; default eight bands over all that is drawn.
    pub(crate) edges: Option<Quantities>,
    /// Metrics of the facility's loop whose median and spread are shown.
    #[serde(default)]
    pub(crate) metrics: Vec<At<String>>,
    /// A cell of a map is trusted if its rate of wrong verdicts is, with 95 % confidence, at most this; default 10 %.
    pub(crate) trust: Option<Quantity>,
    /// Maps over two dispersed parameters.
    #[serde(default)]
    pub(crate) map: Vec<MapTable>,
}

/// A map of cells, one for every variant.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MapTable {
    /// Dispersed or derived parameter along the horizontal axis.
    pub(crate) x: At<String>,
    /// Dispersed or derived parameter along the vertical axis.
    pub(crate) y: At<String>,
    /// Number of cells along x and along y; default 6 and 6.
    pub(crate) cells: Option<At<Vec<At<u64>>>>,
    /// Dispersed parameter that cuts the map into several, and into how many; default 3.
    pub(crate) slice: Option<At<String>>,
    /// Number of slices.
    pub(crate) slices: Option<At<u64>>,
    /// Metric of the facility's loop whose median is mapped; without it the share of wrong verdicts.
    pub(crate) metric: Option<At<String>>,
    /// A line to draw into it: the value of y in SI units, as an expression of parameters.
    pub(crate) line: Option<At<String>>,
    /// What the line is.
    pub(crate) line_name: Option<At<String>>,
}
