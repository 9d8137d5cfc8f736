//! Experiment files: which run of a campaign to drive next, to discriminate between rival hypotheses of a diagnosis.

use crate::campaign::Campaign;
use crate::problem::{Problem, Problems};
use crate::read;
use crate::source::Source;
use crate::written::At;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// Format that this version reads and writes.
pub(crate) const FORMAT: &str = "experiment/1";

/// A run of a campaign that discriminates between rival hypotheses.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExperimentFile {
    /// Format and version of this file: "experiment/1".
    schema: At<String>,
    /// Id of the campaign.
    campaign: At<String>,
    /// Hash of the campaign's files: the run of another state of it may be another.
    campaign_hash: At<String>,
    /// Number of the run.
    run: At<u64>,
    /// How often to drive it.
    repeats: At<u64>,
}

impl Campaign {
    /// The run that an experiment file asks for, and how often.
    ///
    /// # Errors
    /// Everything that is wrong with the file, an experiment of another campaign or of another state of this one.
    pub fn experiment(&self, path: &Path) -> Result<(u64, u64), Problems> {
        let source = Source::read(path, None)?;
        let file: ExperimentFile = read::parse(&source, FORMAT)?;
        let mut wrong: Vec<Problem> = read::check_format(&source, &file.schema, FORMAT).into_iter().collect();
        let mut refuse = |at: &std::ops::Range<usize>, key: &str, what: String, remedy: &str| {
            wrong.push(Problem::at(&source, at.clone(), what).key(key.to_owned()).remedy(remedy.to_owned()));
        };
        if file.campaign.value != self.id {
            let what = format!("an experiment of `{}`, and this is `{}`", file.campaign.value, self.id);
            refuse(&file.campaign.span, "campaign", what, "name the campaign that the diagnosis was given");
        } else if file.campaign_hash.value != self.hash {
            let what = "the campaign's files have changed since: this run may be another".to_owned();
            refuse(&file.campaign_hash.span, "campaign_hash", what, "diagnose again, with the campaign as it is");
        }
        if file.run.value >= self.runs {
            let what = format!("run {} of a campaign of {} runs", file.run.value, self.runs);
            refuse(&file.run.span, "run", what, "diagnose again, with the campaign as it is");
        }
        if file.repeats.value == 0 {
            refuse(&file.repeats.span, "repeats", "an experiment that is never made".to_owned(), "write 1 or more");
        }
        Problems::check(wrong)?;
        Ok((file.run.value, file.repeats.value))
    }

    /// The text of an experiment file; its first line states `why`.
    pub fn experiment_text(&self, why: &str, run: u64, repeats: usize) -> String {
        let Self { id, hash, .. } = self;
        format!(
            "# {why}\nschema = \"{FORMAT}\"\ncampaign = \"{id}\"\ncampaign_hash = \"{hash}\"\nrun = {run}\nrepeats = {repeats}\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_is_read_as_it_was_written_and_by_its_campaign_alone() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
        let [own, other] =
            ["smoke", "plate_impact"].map(|id| crate::load(&root.join(format!("{id}.toml"))).expect("it loads"));
        let file = tempfile::NamedTempFile::new().expect("room");
        let write = |text: &str| std::fs::write(file.path(), text).expect("room");
        let text = own.experiment_text("a lag or a delay", 7, 2);
        write(&text);
        assert_eq!(own.experiment(file.path()).expect("its own"), (7, 2));
        let refused = |campaign: &Campaign| campaign.experiment(file.path()).expect_err("not its own").to_string();
        assert!(refused(&other).contains("an experiment of `smoke`"), "{}", refused(&other));
        write(&text.replace("run = 7", "run = 70000000"));
        assert!(refused(&own).contains("run 70000000"), "{}", refused(&own));
        write(&text.replace(&own.hash, "another"));
        assert!(refused(&own).contains("have changed"), "{}", refused(&own));
    }
}
