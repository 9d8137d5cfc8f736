//! Record of a case: one line of JSON, appended and flushed when the case is done.

use crate::oracle::DetectionLimit;
use crate::{GauntletError, Result};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Verdict of a diagnosis in a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordedVerdict {
    /// The recordings were rejected.
    Refused,
    /// No effect.
    NoEffect,
    /// No verdict: another block, itself unexplained, may cause the residual.
    Withheld,
    /// No practical effect.
    NoPracticalEffect,
    /// Named causes.
    Named,
    /// One of several causes.
    Ambiguous,
    /// A cause outside the library.
    NotInLibrary,
    /// An inadequate model: what explains these recordings best is impossible or implausible.
    ModelInadequate,
}

impl RecordedVerdict {
    /// Returns whether it is a model error without a cause.
    pub fn is_open(self) -> bool {
        matches!(self, Self::NotInLibrary | Self::ModelInadequate)
    }
}

impl From<DiagnosisVerdict> for RecordedVerdict {
    fn from(verdict: DiagnosisVerdict) -> Self {
        match verdict {
            DiagnosisVerdict::NoEffect => Self::NoEffect,
            DiagnosisVerdict::Withheld => Self::Withheld,
            DiagnosisVerdict::NoPracticalEffect => Self::NoPracticalEffect,
            DiagnosisVerdict::Named => Self::Named,
            DiagnosisVerdict::Ambiguous => Self::Ambiguous,
            DiagnosisVerdict::NotInLibrary => Self::NotInLibrary,
            DiagnosisVerdict::ModelInadequate => Self::ModelInadequate,
        }
    }
}

/// Answer for a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedAnswer {
    /// The verdict.
    #[serde(rename = "said")]
    pub verdict: RecordedVerdict,
    /// Named or listed causes, the most probable first.
    pub effects: Vec<NamedCause>,
    /// Causes that an inadequate model leaves possible: id and block. They are no answer.
    #[serde(default)]
    pub possible: Vec<(String, String)>,
    /// Blocks with their verdicts.
    pub blocks: Vec<(String, RecordedVerdict)>,
    /// Whether a confounded cause was excluded from the library.
    pub partner_missing: bool,
    /// Description of the proposed experiment.
    pub experiment: Option<String>,
    /// Held-out gain of the block with the most severe verdict: value and 95 % interval.
    pub gain: Option<[f64; 3]>,
    /// 95 % interval of the gain on an unrecorded motion.
    #[serde(default)]
    pub gain_elsewhere: Option<[f64; 2]>,
    /// Reason of the rejection.
    pub refusal: Option<String>,
}

/// Cause of an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedCause {
    /// Id in the library.
    pub id: String,
    /// Block in which it acts.
    pub block: String,
    /// Stated probability.
    pub p: f64,
    /// Parameters.
    pub parameters: BTreeMap<String, RecordedEstimate>,
}

/// Parameter estimate of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedEstimate {
    /// Best value, SI.
    pub value: f64,
    /// Lower bound of the 95 % interval.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
    /// Standard deviation by the curvature of the likelihood and the priors alone: the Cramer-Rao value.
    pub sd: f64,
    /// Nominal value.
    pub nominal: f64,
}

/// True gain of the answer's model over the nominal model, on further recordings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueGain {
    /// On the held-out motion.
    pub held_out: f64,
    /// On an unrecorded motion.
    pub fresh: f64,
}

/// Answer of a baseline method for the same recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// The method.
    pub method: String,
    /// First name; `None` without a finding.
    pub named: Option<String>,
    /// Computing time \[s\].
    pub seconds: f64,
}

/// Computing time of a case \[s\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The diagnosis.
    pub diagnosis: f64,
    /// Everything else: oracle, recordings, true gain, baselines.
    pub rest: f64,
}

/// Finished case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// The case.
    pub case: String,
    /// Hash of its sealed truth.
    pub sealed: String,
    /// Answer; `None` if the size of the case is beyond the range of the generator.
    pub answer: Option<RecordedAnswer>,
    /// Answers with the recordings of proposed experiments, one experiment after the other.
    #[serde(default)]
    pub after: Vec<RecordedAnswer>,
    /// True gain, if a named cause explains the data.
    pub gain: Option<TrueGain>,
    /// Baseline methods.
    pub baselines: Vec<Baseline>,
    /// Computing time.
    pub cost: Cost,
}

impl CaseRecord {
    /// Builds the record of a case without an answer, with the hash of its sealed truth.
    pub fn of(case: String, sealed: String) -> Self {
        let (after, baselines) = (Vec::new(), Vec::new());
        Self { case, sealed, answer: None, after, gain: None, baselines, cost: Cost::default() }
    }
}

/// Line with the seal, written before a diagnosis begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SealLine {
    /// The case.
    pub case: String,
    /// Hash of its sealed truth.
    pub sealed: String,
}

/// Line with the detection limit of an effect in the recordings of a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScaleLine {
    /// The plant.
    pub plant: String,
    /// The generator's id of the effect.
    pub effect: String,
    /// The seed.
    pub seed: u64,
    /// The generator's ids of the perturbations of the machine; their sizes follow from the seed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub perturbations: Vec<String>,
    /// Detection limit; `None` if no size in the range of the generator is detectable.
    pub scale: Option<DetectionLimit>,
    /// Tolerance of the model on what the effect changes, in the effect's unit; `None` if the model has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

/// Prefixes of the files with seals, finished cases and detection limits, one of each per worker.
const SEALS: &str = "seals";
const ANSWERS: &str = "answers";
const SCALES: &str = "scales";
const MEASURED: &str = "measured";

/// Files that a worker appends to.
pub struct Ledger {
    folder: PathBuf,
    worker: String,
}

impl Ledger {
    /// Opens the files of a worker in a results folder.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn open(folder: &Path, number: usize, of: usize) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(GauntletError::file(folder))?;
        Ok(Self { folder: folder.to_owned(), worker: format!("{number}-{of}") })
    }

    /// Returns the results folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Records a seal.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn seal(&self, line: &SealLine) -> Result<()> {
        self.append(SEALS, line)
    }

    /// Records a finished case.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(&self, record: &CaseRecord) -> Result<()> {
        self.append(ANSWERS, record)
    }

    /// Records a detection limit for all workers.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn scale(&self, line: &ScaleLine) -> Result<()> {
        self.append(SCALES, line)
    }

    /// Records a finished case in measured recordings.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn measured(&self, record: &impl Serialize) -> Result<()> {
        self.append(MEASURED, record)
    }

    fn append(&self, what: &str, line: &impl Serialize) -> Result<()> {
        let path = self.folder.join(format!("{what}-{}.jsonl", self.worker));
        let text = serde_json::to_string(line).expect("names and numbers") + "\n";
        let open = || -> std::io::Result<File> { OpenOptions::new().create(true).append(true).open(&path) };
        // One call for the whole line: a killed worker writes a line or its beginning.
        open().and_then(|mut file| file.write_all(text.as_bytes())).map_err(GauntletError::file(&path))
    }
}

/// Returns the ids of finished cases.
///
/// # Errors
/// A file that cannot be read, a line that is damaged.
pub fn done(folder: &Path) -> Result<BTreeSet<String>> {
    Ok(records(folder)?.into_iter().map(|record| record.case).collect())
}

/// Returns all finished cases of all workers, each once, sorted by id.
///
/// # Errors
/// As [`done`].
pub fn records(folder: &Path) -> Result<Vec<CaseRecord>> {
    let all: BTreeMap<String, CaseRecord> =
        lines(folder, ANSWERS)?.into_iter().map(|record: CaseRecord| (record.case.clone(), record)).collect();
    Ok(all.into_values().collect())
}

/// Returns the hashes of the sealed truths.
///
/// # Errors
/// As [`done`].
pub fn seals(folder: &Path) -> Result<BTreeMap<String, String>> {
    Ok(lines(folder, SEALS)?.into_iter().map(|line: SealLine| (line.case, line.sealed)).collect())
}

/// Returns the detection limits of all workers.
///
/// # Errors
/// As [`done`].
pub fn scales(folder: &Path) -> Result<Vec<ScaleLine>> {
    lines(folder, SCALES)
}

/// Returns the finished cases in measured recordings.
///
/// # Errors
/// As [`done`].
pub(crate) fn measured<T: DeserializeOwned>(folder: &Path) -> Result<Vec<T>> {
    lines(folder, MEASURED)
}

/// Returns the lines of all workers' files. A last line without its end was interrupted and is ignored.
fn lines<T: DeserializeOwned>(folder: &Path, what: &str) -> Result<Vec<T>> {
    let mut all = Vec::new();
    for path in crate::recordings_folder::files(folder)? {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if !name.starts_with(what) || !name.ends_with(".jsonl") {
            continue;
        }
        let text = softdock_input::read_text(&path, softdock_input::MAX_TABLE)?;
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for (number, line) in whole.lines().enumerate() {
            let parsed = serde_json::from_str(line);
            all.push(parsed.map_err(|error| GauntletError::damaged(&path, format!("line {}: {error}", number + 1)))?);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(case: &str) -> CaseRecord {
        CaseRecord::of(case.to_owned(), String::new())
    }

    #[test]
    fn finished_cases_are_known_after_a_crash() {
        let folder = tempfile::tempdir().expect("a folder");
        let [one, two] = [1, 2].map(|number| Ledger::open(folder.path(), number, 2).expect("writable"));
        one.finish(&record("a")).expect("writable");
        two.finish(&record("b")).expect("writable");
        let path = folder.path().join("answers-2-2.jsonl");
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::write(&path, text + "{\"case\": \"c").expect("writable");
        assert_eq!(done(folder.path()).expect("whole lines"), ["a".to_owned(), "b".to_owned()].into());
        std::fs::write(&path, "{\"case\": \"c\n").expect("writable");
        let message = done(folder.path()).expect_err("a damaged line").to_string();
        assert!(message.contains("line 1"), "{message}");
    }
}
