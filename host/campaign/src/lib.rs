//! Campaign, scenario and robot files: read as written, checked into types that cannot be wrong, drawn run by run.

mod arm;
pub mod arm_notes;
mod author_units;
pub mod campaign;
pub mod cases;
mod check;
pub mod columns;
pub mod compare;
pub mod contact_names;
pub mod contact_notes;
mod covariance;
pub mod criteria;
pub mod derived;
pub mod difference;
pub mod dispersion;
pub mod distribution;
mod effects;
mod experiment;
mod expression;
mod given;
mod histogram;
mod identified;
mod inertia;
pub mod inverse_kinematics;
mod kept;
mod key_ends;
mod key_path;
mod load;
pub mod manifest;
mod mesh;
pub mod metric;
mod mobility;
mod mount;
mod no_effect;
pub mod outcome_map;
pub mod overlap;
mod placement;
mod problem;
mod ranges;
mod read;
pub mod requirement;
pub mod rig;
pub mod ring_notes;
pub mod robot;
pub mod rules;
mod sampling;
mod scenario;
mod scenario_key;
mod schema;
mod set_values;
mod source;
mod stability;
pub mod station;
pub mod suggest;
mod table;
mod unit_pattern;
mod units;
pub mod urdf;
mod variant;
mod written;

pub use author_units::{AuthorUnit, in_si};
pub use campaign::Campaign;
pub use cases::Cases;
pub use check::FILL_IN;
pub use compare::Comparison;
pub use histogram::histograms;
pub use identified::IdentifiedEffect;
pub use problem::{Problem, Problems};
pub use ranges::legal_range;
pub use rig::Rig;
pub use robot::Robot;
pub use sampling::{Draw, OwnScenario};
pub use scenario::Scenario;
pub use scenario::contact::rebound_restitution;
pub use scenario_key::ScenarioKey;
pub use schema::{SCHEMA_KINDS, SchemaKind};
pub use source::settings::{Setting, Settings};
pub use station::Station;
pub use variant::Variant;

use std::path::Path;

/// Reads a campaign file and everything that it names.
pub fn load(path: &Path) -> Result<Campaign, Problems> {
    Campaign::load(path)
}

/// Reads a scenario file and the arm that it names.
pub fn load_scenario(path: &Path) -> Result<Scenario, Problems> {
    Scenario::load(path)
}

/// What a file of this project is, by its `schema`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A campaign.
    Campaign,
    /// A scenario.
    Scenario,
    /// Anything else: its reader reports what is wrong.
    Other,
}

/// Returns the kind of a file.
///
/// # Errors
/// If it cannot be read.
pub fn kind(path: &Path) -> Result<FileKind, Problems> {
    let source = source::Source::read(path, None)?;
    let is_shallow = softdock_input::toml_depth(source.text()).is_ok();
    let table: Option<toml::Table> = is_shallow.then(|| source.text().parse().ok()).flatten();
    let schema = table.as_ref().and_then(|table| table.get("schema")).and_then(toml::Value::as_str);
    Ok(match schema.and_then(|schema| schema.split('/').next()) {
        Some("campaign") => FileKind::Campaign,
        Some("scenario") => FileKind::Scenario,
        _ => FileKind::Other,
    })
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod effects_tests;
