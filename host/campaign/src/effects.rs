//! An effects file: keys of a scenario that an emulated facility has other values for, unknown to those who drive it.

use crate::problem::Problems;
use crate::read;
use crate::scenario::Scenario;
use crate::source::Source;
use crate::source::overlay::Overlay;
use crate::written::At;
use crate::written::compare::Replacements;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// Format that this version reads.
pub(crate) const FORMAT: &str = "effects/1";

/// Differences of an emulated facility from its scenario.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EffectsFile {
    /// Format and version of this file: "effects/1".
    schema: At<String>,
    /// Keys of the scenario in quotes, each with its new value.
    set: Replacements,
}

impl Scenario {
    /// The scenario with the keys that an effects file replaces.
    ///
    /// # Errors
    /// Everything that is wrong with the effects file, or with the scenario that it makes.
    pub fn with_effects(&self, path: &Path) -> Result<Self, Problems> {
        let source = Source::read(path, None)?;
        let file: EffectsFile = read::parse(&source, FORMAT)?;
        Problems::check(read::check_format(&source, &file.schema, FORMAT).into_iter().collect())?;
        let keys = file.set.0.iter().map(|key| key.value.clone()).collect();
        Self::from_source(self.source().with(Overlay::of_effects(&source, keys)))
    }
}
