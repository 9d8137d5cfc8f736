//! Texts of causes: the criterion, rule or flag of an id in the result files.

use softdock_campaign::criteria::Criterion;
use softdock_campaign::rules::sentence;
use softdock_kernels::metrics::flags;
use softdock_kernels::session::{RULES, RuleRow};
use softdock_results::runs::Cause;

use crate::number::with_unit;

/// Cause of a loop that meets the task but not a requirement: its metric is beyond the limit.
pub(crate) const LIMIT: &str = "limit";

/// Likewise: its metric has no value.
pub(crate) const NO_VALUE: &str = "no_value";

fn rule(id: &str) -> Option<&'static RuleRow> {
    RULES.iter().find(|row| row.id == id)
}

/// Returns the text of a cause, with its limit if there is one.
pub fn cause_text(id: &str, limit: Option<f64>) -> String {
    let criterion = match id {
        LIMIT => Some("beyond the requirement's limit"),
        NO_VALUE => Some("the metric has no value"),
        id => Criterion::of(id).map(|criterion| criterion.broken),
    };
    let flag = || flags::TABLE.iter().find(|(_, name, _)| *name == id).map(|(.., meaning)| (*meaning).to_owned());
    let rule = || rule(id).map(|row| sentence(row, limit));
    criterion.map(str::to_owned).or_else(rule).or_else(flag).unwrap_or_else(|| id.to_owned())
}

/// Returns the unit of a cause's value and limit.
pub(crate) fn cause_unit(id: &str) -> &'static str {
    rule(id).map(|row| row.unit).or_else(|| Criterion::of(id).map(|criterion| criterion.unit)).unwrap_or("1")
}

/// Returns a cause as a sentence, with its value, limit, time and phase if known.
pub fn cause_sentence(cause: &Cause) -> String {
    let unit = cause_unit(&cause.id);
    let mut text = cause_text(&cause.id, cause.limit);
    // The sentence of a rule states its limit; a criterion without a number has the limit 1.
    match (cause.value, cause.limit.filter(|_| rule(&cause.id).is_none())) {
        (Some(value), Some(limit)) => {
            text += &format!(": {} with a limit of {}", with_unit(value, unit), with_unit(limit, unit));
        }
        (Some(value), None) => text += &format!(": {}", with_unit(value, unit)),
        (None, _) => {}
    }
    if let Some(time) = cause.time {
        let verb = if cause.value.is_some() { "at" } else { "until" };
        text += &format!(", {verb} {}", with_unit(time, "s"));
    }
    if let Some(phase) = cause.phase {
        text += &format!(", {} phase", phase.word());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::criteria::CRITERIA;
    use softdock_results::runs::Phase;

    #[test]
    fn cause_states_value_limit_time_and_phase() {
        let cause = |id: &str, value: Option<f64>, limit: Option<f64>| Cause {
            id: id.to_owned(),
            time: Some(1.5),
            value,
            limit,
            phase: Some(Phase::Contact),
        };
        assert_eq!(
            cause_sentence(&cause("max_contact_force", Some(312.5), Some(250.0))),
            "contact force above its limit: 312.5 N with a limit of 250 N, at 1.5 s, contact phase"
        );
        assert_eq!(cause_sentence(&cause("capture", None, Some(1.0))), "no capture, until 1.5 s, contact phase");
    }

    #[test]
    fn every_criterion_and_rule_has_text_and_unit() {
        for criterion in CRITERIA {
            assert_ne!(cause_text(criterion.id, None), criterion.id);
            assert_eq!(cause_unit(criterion.id), criterion.unit);
        }
        for row in RULES {
            assert_ne!(cause_text(row.id, Some(1.0)), row.id);
            assert_eq!(cause_unit(row.id), row.unit);
        }
        assert_eq!(cause_text("space_penetration", None), "the space loop passed the penetration limit");
    }
}
