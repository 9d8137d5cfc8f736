//! The rules of a session in words.

use crate::units::show;
use softdock_kernels::model::Facility;
use softdock_kernels::session::{RULES, Rule, RuleRow};

/// What a rule stops a session on, with its limit (SI; angles are shown in degrees); without one, in general.
pub fn sentence(row: &RuleRow, limit: Option<f64>) -> String {
    let limit = match (limit, row.unit) {
        (None, _) => "its limit".to_owned(),
        (Some(angle), "rad") => show(angle.to_degrees(), "deg"),
        (Some(limit), unit) => show(limit, unit),
    };
    row.stops_on.replace("{}", &limit)
}

/// The rules that are in force on a facility, each with its limit; keep-out boxes by their names.
pub fn in_force(facility: &Facility) -> Vec<String> {
    let limits = RULES.iter().map(|row| (row, (row.limit)(facility)));
    let stated = limits.filter(|(_, limit)| limit.is_finite()).map(|(row, limit)| {
        let names: Vec<&str> = facility.rules.keep_out.iter().map(|keep_out| keep_out.name.as_str()).collect();
        let boxes = if row.rule == Rule::KeepOut { format!(": {}", names.join(", ")) } else { String::new() };
        sentence(row, Some(limit)) + &boxes
    });
    stated.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_stated_with_its_limit() {
        let row = |id: &str| RULES.iter().find(|row| row.id == id).expect(id);
        assert_eq!(
            sentence(row("following_rotation"), Some(5_f64.to_radians())),
            "a tool turned by more than 5 deg from its command"
        );
        assert_eq!(sentence(row("force"), None), "a measured force above its limit");
        assert_eq!(sentence(row("sensor_saturation"), Some(0.0)), "a saturated channel of the sensor");
        let page = include_str!("../../../campaigns/README.md");
        for row in RULES {
            assert!(page.contains(&format!("`{}`", row.id)), "campaigns/README.md does not name {}", row.id);
            assert!(!sentence(&row, Some(1.0)).contains(['{', '}']));
        }
    }
}
