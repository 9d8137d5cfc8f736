//! A requirement to be signed: on single runs in space or on the facility, or on the agreement of the two.

use crate::check::{Checker, span_of};
use crate::metric::{CustomMetric, MetricRef};
use crate::suggest::suggestion;
use crate::units::show;
use crate::written::campaign::RequirementTable;
use softdock_kernels::range::Range;

pub use crate::metric::SUCCESS;

/// On which loop a requirement on single runs is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// In space: the requirement that the facility is to answer, and counts in the agreement.
    Space,
    /// On the facility: a demand on the test itself. An aborted session does not meet it.
    Facility,
}

impl Subject {
    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Space => "space",
            Self::Facility => "facility",
        }
    }
}

/// Limits of a metric, SI; at least one is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequirementLimits {
    /// Passes at or above this.
    pub at_least: Option<f64>,
    /// Passes at or below this.
    pub at_most: Option<f64>,
}

impl RequirementLimits {
    /// Distance to the nearer limit, positive inside.
    pub fn margin(self, value: f64) -> f64 {
        let below = self.at_most.map_or(f64::INFINITY, |limit| limit - value);
        let above = self.at_least.map_or(f64::INFINITY, |limit| value - limit);
        below.min(above)
    }

    /// The limit that a value lies beyond, or else the nearer one.
    pub fn nearer(self, value: f64) -> Option<f64> {
        match (self.at_least, self.at_most) {
            (Some(least), Some(most)) => Some(if most - value < value - least { most } else { least }),
            (least, most) => least.or(most),
        }
    }

    /// `at least 1 N and at most 5 N`.
    pub fn text(self, unit: &str) -> String {
        let side = |word: &str, limit: Option<f64>| limit.map(|limit| format!("{word} {}", show(limit, unit)));
        let sides = [side("at least", self.at_least), side("at most", self.at_most)];
        sides.into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }
}

/// A checked requirement on single runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Id as in the user's documents (`ARM-CON-110`).
    pub id: String,
    /// The requirement's text.
    pub text: String,
    /// Where it must hold.
    pub subject: Subject,
    /// The metric that is judged.
    pub metric: MetricRef,
    /// Its limits.
    pub limits: RequirementLimits,
    /// Share of cases that must pass, 0..1.
    pub probability: f64,
    /// Confidence of the demonstration, 0..1.
    pub confidence: f64,
}

impl Requirement {
    /// Distance to the limit, positive inside; `None` if the metric is not available.
    pub fn margin(&self, value: Option<f64>) -> Option<f64> {
        value.map(|value| self.limits.margin(value))
    }

    /// Unit of the metric, its limits and margins (SI).
    pub fn unit(&self) -> &str {
        &self.metric.unit
    }

    /// Id as it appears in column names (`arm_con_110`).
    pub fn column_id(&self) -> String {
        column_id(&self.id)
    }

    /// The requirement as a sentence with its numbers.
    pub fn sentence(&self) -> String {
        let place = match self.subject {
            Subject::Space => "in space",
            Subject::Facility => "on the facility (an aborted session counts as a failure)",
        };
        let share = |value: f64| show(100.0 * value, "%");
        format!(
            "{} {place} is {} in {} of cases, with {} confidence",
            self.metric.name,
            self.limits.text(self.unit()),
            share(self.probability),
            share(self.confidence)
        )
    }
}

/// A rate of wrong or missing answers of the facility.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// Runs that fail in space and pass on the facility, among those that fail in space.
    FalsePass,
    /// Runs that pass in space and fail on the facility, among those that pass in space.
    FalseFail,
    /// Runs whose session was aborted, among all.
    Abort,
}

/// Word in files, rate, and what it is.
pub const RATES: [(&str, Rate, &str); 3] = [
    ("false_pass_rate", Rate::FalsePass, "of the runs that fail in space, those that the facility passes"),
    ("false_fail_rate", Rate::FalseFail, "of the runs that pass in space, those that the facility fails"),
    ("abort_rate", Rate::Abort, "of all runs, those whose session is aborted"),
];

impl Rate {
    /// The word in files.
    pub fn word(self) -> &'static str {
        RATES[self as usize].0
    }

    /// What it is.
    pub fn meaning(self) -> &'static str {
        RATES[self as usize].2
    }
}

/// A checked requirement on the agreement of the facility with space.
#[derive(Clone, Debug, PartialEq)]
pub struct AgreementRequirement {
    /// Id as in the user's documents.
    pub id: String,
    /// The requirement's text.
    pub text: String,
    /// The rate that is judged.
    pub rate: Rate,
    /// Its limit, 0..1.
    pub at_most: f64,
    /// Confidence of the demonstration, 0..1.
    pub confidence: f64,
}

impl AgreementRequirement {
    /// The requirement as a sentence with its numbers.
    pub fn sentence(&self) -> String {
        let share = |value: f64| show(100.0 * value, "%");
        let (limit, confidence) = (share(self.at_most), share(self.confidence));
        format!("{} is at most {limit}, with {confidence} confidence: {}", self.rate.word(), self.rate.meaning())
    }
}

fn column_id(id: &str) -> String {
    id.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}

/// A share of cases that runs can demonstrate; beyond it rare-event methods only estimate.
const SHARE: Range = Range::above(0.0, 0.999_999);

/// Where a requirement is judged, as written.
#[derive(Clone, Copy, PartialEq)]
enum Written {
    Runs(Subject),
    Agreement,
}

/// Checks the requirements of a campaign file: those on single runs, and those on the agreement.
pub(crate) fn read(
    c: &mut Checker,
    tables: &[RequirementTable],
    own: &[CustomMetric],
) -> (Vec<Requirement>, Vec<AgreementRequirement>) {
    let subjects = [
        ("space", Written::Runs(Subject::Space)),
        ("facility", Written::Runs(Subject::Facility)),
        ("agreement", Written::Agreement),
    ];
    let (mut runs, mut agreement) = (Vec::new(), Vec::new());
    let mut ids: Vec<String> = Vec::new();
    for table in tables {
        check_id(c, table, &mut ids);
        match c.choice(&table.subject, &subjects) {
            Written::Runs(subject) => runs.extend(on_runs(c, table, subject, own)),
            Written::Agreement => agreement.extend(on_agreement(c, table)),
        }
    }
    (runs, agreement)
}

fn check_id(c: &mut Checker, table: &RequirementTable, ids: &mut Vec<String>) {
    let id = &table.id.value;
    if id.trim().is_empty() {
        c.refuse(&table.id.span, "the id is empty", "write the id of the requirements document");
    } else if let Some(twin) = ids.iter().find(|other| column_id(other) == column_id(id)) {
        let message = format!("this id has the same columns as `{twin}`");
        c.refuse(&table.id.span, message, "give every requirement an id of its own (letters and digits count)");
    }
    ids.push(id.clone());
}

fn on_runs(c: &mut Checker, table: &RequirementTable, subject: Subject, own: &[CustomMetric]) -> Option<Requirement> {
    let name = &table.metric.value;
    let Some(metric) = MetricRef::of(name, own) else {
        let all = MetricRef::all(own);
        let names: Vec<&str> = all.iter().map(|metric| metric.name.as_str()).collect();
        let remedy = if RATES.iter().any(|(rate, ..)| rate == name) {
            "a rate is judged with subject = \"agreement\"".to_owned()
        } else {
            suggestion(name, &names)
        };
        c.refuse(&table.metric.span, format!("there is no metric `{name}`"), remedy);
        return None;
    };
    let Some(probability) = &table.probability else {
        let message = "a requirement on single runs needs its probability";
        c.refuse(&table.id.span, message, "add probability = \"99 %\": the share of cases that must pass");
        return None;
    };
    Some(Requirement {
        id: table.id.value.clone(),
        text: table.text.value.clone(),
        subject,
        limits: limits(c, table, &metric.unit),
        metric,
        probability: c.number(probability, "1", SHARE),
        confidence: c.number(&table.confidence, "1", SHARE),
    })
}

fn limits(c: &mut Checker, table: &RequirementTable, unit: &str) -> RequirementLimits {
    let any = Range::size(1e15);
    let [at_least, at_most] =
        [&table.at_least, &table.at_most].map(|limit| limit.as_ref().map(|limit| c.number(limit, unit, any)));
    match (at_least, at_most) {
        (None, None) => c.refuse(&table.id.span, "no limit", "give at_most, at_least, or both"),
        (Some(least), Some(most)) if least >= most => {
            let span = span_of(&table.at_least).unwrap_or(table.id.span.clone());
            let message = format!("at_least {} is not below at_most {}", show(least, unit), show(most, unit));
            c.refuse(&span, message, "write the lower limit as at_least and the upper one as at_most");
        }
        _ => {}
    }
    RequirementLimits { at_least, at_most }
}

fn on_agreement(c: &mut Checker, table: &RequirementTable) -> Option<AgreementRequirement> {
    let noted = c.problems.len();
    let rates = RATES.map(|(word, rate, _)| (word, rate));
    let rate = c.choice(&table.metric, &rates);
    for (key, written) in [("at_least", &table.at_least), ("probability", &table.probability)] {
        if let Some(span) = span_of(written) {
            let message = format!("a requirement on the agreement does not take `{key}`");
            c.refuse(&span, message, "remove it; at_most limits the rate, and confidence states the level");
        }
    }
    let Some(at_most) = &table.at_most else {
        c.refuse(&table.id.span, "no limit", "add at_most = \"5 %\": the greatest rate that is accepted");
        return None;
    };
    let at_most = c.number(at_most, "1", Range::within(1e-6, 1.0));
    let confidence = c.number(&table.confidence, "1", SHARE);
    let (id, text) = (table.id.value.clone(), table.text.value.clone());
    (c.problems.len() == noted).then_some(AgreementRequirement { id, text, rate, at_most, confidence })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_margin_is_the_distance_to_the_nearer_limit() {
        let both = RequirementLimits { at_least: Some(1.0), at_most: Some(5.0) };
        for (value, margin, nearer) in
            [(0.0, -1.0, 1.0), (1.0, 0.0, 1.0), (2.0, 1.0, 1.0), (4.5, 0.5, 5.0), (7.0, -2.0, 5.0)]
        {
            assert_eq!((both.margin(value), both.nearer(value)), (margin, Some(nearer)), "{value}");
        }
        let most = RequirementLimits { at_least: None, at_most: Some(5.0) };
        assert_eq!((most.margin(7.0), most.nearer(7.0)), (-2.0, Some(5.0)));
        assert_eq!(both.text("N"), "at least 1 N and at most 5 N");
    }

    #[test]
    fn every_rate_is_at_its_place_in_the_table() {
        for (word, rate, _) in RATES {
            assert_eq!(rate.word(), word);
        }
    }
}
