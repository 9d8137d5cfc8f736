//! Units in which the author of a campaign writes its quantities.

use crate::campaign::Campaign;
use crate::units::{quantity, unit_of};
use toml::Value;

/// The unit of one quantity, as the campaign file writes it.
#[derive(Clone, Debug, PartialEq)]
pub struct AuthorUnit {
    /// Parameter, key of the scenario, or metric.
    pub name: String,
    /// Whether it is a metric.
    pub is_metric: bool,
    /// The unit as written.
    pub unit: String,
    /// SI value of one such unit.
    pub in_si: f64,
}

/// SI value of one unit; `None` if it does not measure the same as the SI unit.
///
/// ```
/// assert_eq!(softdock_campaign::in_si("kN", "N"), Some(1000.0));
/// assert_eq!(softdock_campaign::in_si("ms", "N"), None);
/// ```
pub fn in_si(unit: &str, si: &str) -> Option<f64> {
    quantity(&format!("1 {unit}"), si).ok()
}

impl Campaign {
    /// Units of the dispersed quantities and of the metrics of requirements, as the campaign file writes them; those in
    /// SI, and quantities without a unit, are left out.
    pub fn author_units(&self) -> Vec<AuthorUnit> {
        let table: toml::Table = self.text.parse().unwrap_or_default();
        let entries = |key: &str| {
            let entries = table.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
            entries.into_iter().filter_map(|entry| entry.as_table().cloned())
        };
        let word = |entry: &toml::Table, key: &str| entry.get(key).and_then(Value::as_str).map(str::to_owned);
        let mut units: Vec<AuthorUnit> = Vec::new();
        let mut add = |name: String, is_metric: bool, si: &str, value: Option<&Value>| {
            let Some(unit) = value.and_then(first_unit).filter(|unit| unit != si) else { return };
            let Some(in_si) = in_si(&unit, si) else { return };
            if in_si != 1.0 && !units.iter().any(|other| other.name == name && other.is_metric == is_metric) {
                units.push(AuthorUnit { name, is_metric, unit, in_si });
            }
        };
        for entry in entries("dispersion") {
            let named = word(&entry, "target").or_else(|| word(&entry, "variable"));
            let dispersion = self.dispersions.iter().find(|dispersion| Some(&dispersion.name) == named.as_ref());
            if let Some(dispersion) = dispersion {
                add(dispersion.name.clone(), false, dispersion.unit, entry.get("dist"));
            }
        }
        for entry in entries("requirement") {
            let id = word(&entry, "id");
            if let Some(requirement) = self.requirements.iter().find(|requirement| Some(&requirement.id) == id.as_ref())
            {
                let limit = entry.get("at_most").or_else(|| entry.get("at_least"));
                add(requirement.metric.name.clone(), true, requirement.unit(), limit);
            }
        }
        units
    }
}

/// The unit of the first quantity in a value.
fn first_unit(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => unit_of(text).filter(|unit| !unit.is_empty()).map(str::to_owned),
        Value::Array(values) => values.iter().find_map(first_unit),
        Value::Table(values) => values.values().find_map(first_unit),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn units_are_those_of_the_file() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
        let campaign = Campaign::load(&root.join("probe_drogue.toml")).unwrap();
        let units = campaign.author_units();
        let of = |name: &str| units.iter().find(|unit| unit.name == name).map(|unit| (unit.unit.as_str(), unit.in_si));
        assert_eq!(of("loop_delay"), Some(("ms", 1e-3)));
        assert_eq!(of("offset_y"), Some(("mm", 1e-3)));
        assert_eq!(of("tilt_x"), Some(("deg", std::f64::consts::PI / 180.0)));
        assert_eq!(of("sensor_gain_force_x"), Some(("%", 0.01)));
        // SI is no other unit.
        assert_eq!((of("closing_speed"), of("target_mass"), of("contact_friction")), (None, None, None));
    }
}
