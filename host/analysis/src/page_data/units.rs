//! Units in which the page shows numbers: the campaign author's, or else of a readable size.

use std::collections::BTreeMap;

use toml::{Table, Value};

/// Units with their SI unit and the factor from it.
const UNITS: [(&str, &str, f64); 24] = [
    ("um", "m", 1e6),
    ("mm", "m", 1e3),
    ("cm", "m", 1e2),
    ("km", "m", 1e-3),
    ("mm/s", "m/s", 1e3),
    ("cm/s", "m/s", 1e2),
    ("us", "s", 1e6),
    ("ms", "s", 1e3),
    ("min", "s", 1.0 / 60.0),
    ("deg", "rad", 180.0 / std::f64::consts::PI),
    ("mrad", "rad", 1e3),
    ("deg/s", "rad/s", 180.0 / std::f64::consts::PI),
    ("mrad/s", "rad/s", 1e3),
    ("mN", "N", 1e3),
    ("kN", "N", 1e-3),
    ("kN/m", "N/m", 1e-3),
    ("N/mm", "N/m", 1e-3),
    ("mN m", "N m", 1e3),
    ("kN m", "N m", 1e-3),
    ("mJ", "J", 1e3),
    ("kJ", "J", 1e-3),
    ("g", "kg", 1e3),
    ("t", "kg", 1e-3),
    ("%", "1", 1e2),
];

/// Units that are read more easily than the SI unit of small values, with the least size of those that need none.
const READABLE: [(&str, f64); 6] =
    [("mm", 0.5), ("mm/s", 0.5), ("ms", 0.5), ("deg", f64::INFINITY), ("deg/s", f64::INFINITY), ("mJ", 0.01)];

/// A unit with its factor from SI.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct ShownUnit {
    pub(crate) unit: String,
    pub(crate) factor: f64,
}

/// The units that a campaign's author wrote, by target and metric.
pub(crate) fn of_author(campaign: &str) -> BTreeMap<String, String> {
    let mut units = BTreeMap::new();
    let Ok(file) = campaign.parse::<Table>() else { return units };
    let tables = |key: &str| file.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    for (kind, key) in [("dispersion", "target"), ("requirement", "metric")] {
        for table in tables(kind) {
            let name = table.get(key).and_then(Value::as_str).map(str::to_owned);
            if let (Some(name), Some(unit)) = (name, unit_in(&table)) {
                units.entry(name).or_insert(unit);
            }
        }
    }
    units
}

/// The unit of the first quantity of a table in a known unit.
fn unit_in(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => {
            let (number, unit) = text.trim().split_once(' ')?;
            let is_known = UNITS.iter().any(|row| row.0 == unit.trim());
            (number.parse::<f64>().is_ok() && is_known).then(|| unit.trim().to_owned())
        }
        Value::Array(values) => values.iter().find_map(unit_in),
        // The probability of a requirement is no value of its metric.
        Value::Table(table) => table
            .iter()
            .filter(|(key, _)| !["probability", "confidence", "text", "source"].contains(&key.as_str()))
            .find_map(|(_, value)| unit_in(value)),
        _ => None,
    }
}

/// The unit for values up to a size: the author's where it measures the same, else one of a readable size.
pub(crate) fn shown(si: &str, author: Option<&String>, largest: f64) -> Option<ShownUnit> {
    let row = |unit: &str| UNITS.iter().find(|row| row.0 == unit && row.1 == si);
    let readable =
        || READABLE.iter().find_map(|(unit, enough)| row(unit).filter(|_| largest > 0.0 && largest < *enough));
    let found = author.and_then(|unit| row(unit)).or_else(readable)?;
    Some(ShownUnit { unit: found.0.replace("um", "\u{b5}m").replace("us", "\u{b5}s"), factor: found.2 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_the_author_are_found_and_fit_their_quantity() {
        let campaign = r#"
            [[dispersion]]
            target = "loop_delay"
            dist = { kind = "loguniform", min = "2 ms", max = "80 ms" }
            source = "4 ms to 80 ms"
            [[requirement]]
            metric = "peak_contact_force"
            text = "at most 250 N"
            at_most = "0.25 kN"
            probability = "95 %"
        "#;
        let units = of_author(campaign);
        assert_eq!(units["loop_delay"], "ms");
        assert_eq!(units["peak_contact_force"], "kN");
        let unit = |si, author: Option<&str>, largest| {
            shown(si, author.map(str::to_owned).as_ref(), largest).map(|shown| shown.unit)
        };
        assert_eq!(unit("s", Some("ms"), 2.0).as_deref(), Some("ms"));
        assert_eq!(unit("m", Some("ms"), 0.01).as_deref(), Some("mm"), "a unit of another quantity is not used");
        assert_eq!(unit("m", None, 3.0), None);
        assert!(of_author("no = [toml").is_empty());
    }
}
