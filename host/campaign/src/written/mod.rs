//! Files as written: what may stand where, before any meaning is checked.

pub(crate) mod campaign;
pub(crate) mod compare;
pub(crate) mod effect;
pub(crate) mod facility;
pub(crate) mod joint_level;
pub(crate) mod key_values;
pub(crate) mod rig;
pub(crate) mod robot;
pub(crate) mod scenario;
pub(crate) mod station;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

/// A value with its place in the file.
#[derive(Clone, Debug)]
pub(crate) struct At<T> {
    pub(crate) value: T,
    pub(crate) span: Range<usize>,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        Ok(Self { span: spanned.span(), value: spanned.into_inner() })
    }
}

/// In the schema the place does not show.
impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }
    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// A key that holds a parameter of a run.
#[derive(Clone, Copy)]
pub(crate) enum ParameterKey<'a> {
    /// A number.
    Number(&'a Quantity),
    /// The three numbers of a vector.
    Vector(&'a Quantities),
}

/// What the type of a key holds of a parameter; `None` where it is not written.
pub(crate) trait HoldsParameter {
    fn key(&self) -> Option<ParameterKey<'_>>;
}

impl HoldsParameter for Quantity {
    fn key(&self) -> Option<ParameterKey<'_>> {
        Some(ParameterKey::Number(self))
    }
}

impl HoldsParameter for Option<Quantity> {
    fn key(&self) -> Option<ParameterKey<'_>> {
        self.as_ref().map(ParameterKey::Number)
    }
}

impl HoldsParameter for Option<Quantities> {
    fn key(&self) -> Option<ParameterKey<'_>> {
        self.as_ref().map(ParameterKey::Vector)
    }
}

/// What a property of a schema states about the parameter of its key, for [`crate::schema`].
pub(crate) const PARAMETER: &str = "x-parameter";

/// Marks a key of a table that holds a parameter.
pub(crate) fn mark_parameter(schema: &mut Schema, key: &str, parameter: &str) {
    let property = schema.get_mut("properties").and_then(|properties| properties.get_mut(key)?.as_object_mut());
    if let Some(property) = property {
        property.insert(PARAMETER.to_owned(), parameter.into());
    }
}

/// Declares tables of a file, one row for each key: `key: type,`, and `key: type => parameter,` where the key holds a field
/// of the bundle that the table's head names. Of a table that stands in several places a key names a parameter for each.
macro_rules! file_table {
    ($(
        $(#[$meta:meta])*
        $name:ident of $bundle:ident {
            $($(#[$key_meta:meta])* $key:ident: $ty:ty $(=> $($parameter:ident)|+)?,)*
        }
    )*) => {$(
        $(#[$meta])*
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(transform = $name::mark_parameters)]
        pub(crate) struct $name {
            $($(#[$key_meta])* pub(crate) $key: $ty,)*
        }

        impl $name {
            /// Marks in the schema of the table which keys hold a parameter.
            fn mark_parameters(schema: &mut schemars::Schema) {
                $($($crate::written::mark_parameter(schema, stringify!($key), [$(stringify!($parameter)),+][0]);)?)*
            }

            /// The keys that are written and hold a parameter, with its name; `place` counts the places of the table.
            pub(crate) fn parameters(&self, place: usize) -> Vec<(&'static str, $crate::written::ParameterKey<'_>)> {
                // Each name is a field.
                $($($(let _ = |bundle: $bundle<f64>| bundle.$parameter;)+)?)*
                let keys = [$($((&[$(stringify!($parameter)),+][..], $crate::written::HoldsParameter::key(&self.$key)),)?)*];
                keys.into_iter().filter_map(|(names, key)| Some((names[place], key?))).collect()
            }
        }
    )*};
}

pub(crate) use file_table;

/// A number with its unit as a text, or a bare number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Scalar {
    /// `0.25` or `3`.
    Number(f64),
    /// `"0.25 mm"`.
    Text(String),
}

struct ScalarVisitor;

impl Visitor<'_> for ScalarVisitor {
    type Value = Scalar;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, as a text with its unit if it has a dimension")
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Scalar, E> {
        Ok(Scalar::Number(value as f64))
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Scalar, E> {
        Ok(Scalar::Number(value))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Scalar, E> {
        Ok(Scalar::Text(value.to_owned()))
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ScalarVisitor)
    }
}

impl JsonSchema for Scalar {
    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "description": "A pure number, or a text with number and unit: \"0.5 mm\", \"1500 N/m\", \"4 deg\", \"50 %\".",
            "type": ["number", "string"],
            "pattern": "^\\s*[-+]?[0-9.]"
        })
    }
}

/// A number with its unit and its place in the file.
pub(crate) type Quantity = At<Scalar>;

/// Several of them in brackets.
pub(crate) type Quantities = At<Vec<Quantity>>;
