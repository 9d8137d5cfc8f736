//! Comparison of the diagnosis with the baseline methods on the same cases.

use super::Scored;
use crate::outcome::AnswerGrade;
use crate::seal::Asks;
use serde::Serialize;
use softdock_analysis::Share;

/// Results of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodRow {
    /// The method.
    pub method: String,
    /// Right names of single effects at detectable sizes.
    pub right: Share,
    /// Wrong names among all its cases.
    pub wrong: Share,
    /// False alarms: names where nothing is hidden.
    pub alarms: Share,
    /// Mean computing time \[s\].
    pub seconds: f64,
}

/// Returns the results of the diagnosis and of the baseline methods on the same cases.
pub(super) fn methods(asked: &[&Scored]) -> Vec<MethodRow> {
    let given: Vec<&Scored> = asked.iter().copied().filter(|scored| !scored.record.baselines.is_empty()).collect();
    let Some(first) = given.first() else {
        return Vec::new();
    };
    let names = first.record.baselines.iter().map(|baseline| baseline.method.as_str());
    let ours = |scored: &Scored| (scored.outcome.unwrap_or(AnswerGrade::Missed), scored.record.cost.diagnosis);
    let other = |scored: &Scored, name: &str| {
        let own = scored.record.baselines.iter().find(|baseline| baseline.method == name);
        own.map_or((AnswerGrade::Missed, 0.0), |own| (of_name(scored, own.named.as_deref()), own.seconds))
    };
    std::iter::once(method("softdock diagnose", &given, &ours))
        .chain(names.map(|name| method(name, &given, &|scored| other(scored, name))))
        .collect()
}

/// Returns the results of a method from the grade and computing time of each answer.
fn method(name: &str, given: &[&Scored], worth: &dyn Fn(&Scored) -> (AnswerGrade, f64)) -> MethodRow {
    let share = |cases: &[&Scored], outcome: AnswerGrade| {
        let hits = cases.iter().filter(|scored| worth(scored).0 == outcome).count();
        Share::of(hits as u64, cases.len() as u64)
    };
    let (nulls, hidden): (Vec<&Scored>, Vec<&Scored>) =
        given.iter().copied().partition(|scored| scored.truth.asks == Asks::Null);
    let detectable =
        hidden.iter().copied().filter(|scored| scored.truth.asks == Asks::Effect && scored.truth.multiple >= 2.0);
    MethodRow {
        method: name.to_owned(),
        right: share(&detectable.collect::<Vec<_>>(), AnswerGrade::Right),
        wrong: share(&hidden, AnswerGrade::Wrong),
        alarms: share(&nulls, AnswerGrade::Wrong),
        seconds: given.iter().map(|scored| worth(scored).1).sum::<f64>() / given.len() as f64,
    }
}

/// Grades a name without further information.
fn of_name(scored: &Scored, named: Option<&str>) -> AnswerGrade {
    let is_right = |name: &str| scored.truth.hidden.iter().any(|hidden| scored.plant.is_right(&hidden.id, name));
    match (named, scored.truth.asks) {
        (None, Asks::Null) => AnswerGrade::Right,
        (None, _) => AnswerGrade::Missed,
        (Some(name), Asks::Pair) if is_right(name) => AnswerGrade::Partly,
        (Some(name), _) if is_right(name) => AnswerGrade::Right,
        (Some(_), _) => AnswerGrade::Wrong,
    }
}
