//! Causes in words: the criterion, rule or flag behind an id of the result files.

use softdock_campaign::criteria::Criterion;
use softdock_kernels::metrics::flags;
use softdock_kernels::session::{RULES, RuleRow};

fn rule(id: &str) -> Option<&'static RuleRow> {
    RULES.iter().find(|row| row.id == id)
}

/// What a cause is, as the rest of a sentence.
pub(crate) fn cause_text(id: &str) -> String {
    let criterion = match id {
        "capture" => Some("no capture"),
        "touch" => Some("no touch"),
        "max_contact_force" => Some("contact force above its limit"),
        "max_interface_force" => Some("interface force above its limit"),
        "max_time" => Some("too late"),
        "max_restitution" => Some("restitution above its limit"),
        "limit" => Some("beyond the requirement's limit"),
        "no_value" => Some("the metric has no value"),
        _ => None,
    };
    let flag = || flags::TABLE.iter().find(|(_, name, _)| *name == id).map(|(.., meaning)| (*meaning).to_owned());
    let rule = || rule(id).map(|row| format!("{} beyond its limit", row.quantity));
    criterion.map(str::to_owned).or_else(rule).or_else(flag).unwrap_or_else(|| id.to_owned())
}

/// Unit of a cause's value and limit.
pub(crate) fn cause_unit(id: &str) -> &'static str {
    rule(id).map(|row| row.unit).or_else(|| Criterion::of(id).map(|criterion| criterion.unit)).unwrap_or("1")
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::criteria::CRITERIA;

    #[test]
    fn every_criterion_and_every_rule_has_words_and_a_unit() {
        for criterion in CRITERIA {
            assert_ne!(cause_text(criterion.id), criterion.id);
            assert_eq!(cause_unit(criterion.id), criterion.unit);
        }
        for row in RULES {
            assert!(cause_text(row.id).starts_with(row.quantity));
            assert_eq!(cause_unit(row.id), row.unit);
        }
        assert_eq!(cause_text("space_penetration"), "the space loop passed the penetration limit");
    }
}
