//! What a case leaves: one line of JSON, appended and flushed when the case is done.

use crate::oracle::DetectionLimit;
use crate::{GauntletError, Result};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use softdock_diagnosis::answer::DiagnosisVerdict;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a diagnosis says at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordedVerdict {
    /// The recordings cannot be judged.
    Refused,
    /// Nothing is wrong.
    NoEffect,
    /// Hardly anything is wrong.
    NoPracticalEffect,
    /// These causes.
    Named,
    /// One of these causes.
    Ambiguous,
    /// Something that is in no library.
    NotInLibrary,
}

impl From<DiagnosisVerdict> for RecordedVerdict {
    fn from(verdict: DiagnosisVerdict) -> Self {
        match verdict {
            DiagnosisVerdict::NoEffect => Self::NoEffect,
            DiagnosisVerdict::NoPracticalEffect => Self::NoPracticalEffect,
            DiagnosisVerdict::Named => Self::Named,
            DiagnosisVerdict::Ambiguous => Self::Ambiguous,
            DiagnosisVerdict::NotInLibrary => Self::NotInLibrary,
        }
    }
}

/// The answer to a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedAnswer {
    /// The verdict.
    pub said: RecordedVerdict,
    /// The causes that it names or lists, the most probable first.
    pub effects: Vec<NamedCause>,
    /// The blocks with their verdicts.
    pub blocks: Vec<(String, RecordedVerdict)>,
    /// Whether it says that a cause that looks alike was not in the library.
    pub partner_missing: bool,
    /// The experiment that it proposes, in words.
    pub experiment: Option<String>,
    /// Held-out gain where most was found: value and 95 % interval.
    pub gain: Option<[f64; 3]>,
    /// 95 % interval of the gain on a motion that was not recorded.
    #[serde(default)]
    pub gain_elsewhere: Option<[f64; 2]>,
    /// Why the recordings cannot be judged.
    pub refusal: Option<String>,
}

/// A cause of an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedCause {
    /// The library's id.
    pub id: String,
    /// The block where it is found.
    pub block: String,
    /// Stated probability.
    pub p: f64,
    /// Its numbers.
    pub parameters: BTreeMap<String, RecordedEstimate>,
}

/// A number of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedEstimate {
    /// Best value, SI.
    pub value: f64,
    /// 95 % interval.
    pub lo: f64,
    /// Its upper end.
    pub hi: f64,
    /// Standard deviation by the curvature of the likelihood and the priors alone: the Cramer-Rao value.
    pub sd: f64,
    /// What the model file says.
    pub nominal: f64,
}

/// What the answer's model gains on ever more recordings, against the model as it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueGain {
    /// On the held-out motion.
    pub held_out: f64,
    /// On a motion that no recording shows.
    pub fresh: f64,
}

/// What another method says of the same recordings: names, none where it finds nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// The method.
    pub method: String,
    /// The name that it gives first.
    pub named: Option<String>,
    /// What it costs \[s\].
    pub seconds: f64,
}

/// What a case cost \[s\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The diagnosis.
    pub diagnosis: f64,
    /// Everything else: oracle, recordings, true gain, baselines.
    pub rest: f64,
}

/// A finished case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// The case.
    pub case: String,
    /// Hash of its sealed truth.
    pub sealed: String,
    /// The answer; none if the case cannot be asked, as no size that the bench can show is as large as the case wants.
    pub answer: Option<RecordedAnswer>,
    /// The answers with the recordings of the experiments that ambiguous answers proposed, one experiment after the other.
    #[serde(default)]
    pub after: Vec<RecordedAnswer>,
    /// True gain, where something was named that explains the data.
    pub gain: Option<TrueGain>,
    /// Other methods.
    pub baselines: Vec<Baseline>,
    /// Cost.
    pub cost: Cost,
}

impl CaseRecord {
    /// A case that is not answered yet, with the hash of its sealed truth.
    pub fn of(case: String, sealed: String) -> Self {
        let (after, baselines) = (Vec::new(), Vec::new());
        Self { case, sealed, answer: None, after, gain: None, baselines, cost: Cost::default() }
    }
}

/// The line that is written before a diagnosis begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SealLine {
    /// The case.
    pub case: String,
    /// Hash of its sealed truth.
    pub sealed: String,
}

/// The smallest size of an effect that could be told in the recordings of a seed, as an oracle found it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScaleLine {
    /// The plant.
    pub plant: String,
    /// The generator's id of the effect.
    pub effect: String,
    /// The seed.
    pub seed: u64,
    /// That size; none where no size of the bench's range can be told.
    pub scale: Option<DetectionLimit>,
}

/// Name of the files with seals, with finished cases and with scales, one of each a worker.
const SEALS: &str = "seals";
const ANSWERS: &str = "answers";
const SCALES: &str = "scales";

/// What one worker appends to.
pub struct Ledger {
    folder: PathBuf,
    worker: String,
}

impl Ledger {
    /// In a results folder, for a worker of several.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn open(folder: &Path, number: usize, of: usize) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(GauntletError::file(folder))?;
        Ok(Self { folder: folder.to_owned(), worker: format!("{number}-{of}") })
    }

    /// The results folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes down that a truth is sealed.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn seal(&self, line: &SealLine) -> Result<()> {
        self.append(SEALS, line)
    }

    /// Writes a finished case down.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(&self, record: &CaseRecord) -> Result<()> {
        self.append(ANSWERS, record)
    }

    /// Writes a scale down, so that no worker asks for it again.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn scale(&self, line: &ScaleLine) -> Result<()> {
        self.append(SCALES, line)
    }

    fn append(&self, what: &str, line: &impl Serialize) -> Result<()> {
        let path = self.folder.join(format!("{what}-{}.jsonl", self.worker));
        let text = serde_json::to_string(line).expect("names and numbers") + "\n";
        let open = || -> std::io::Result<File> { OpenOptions::new().create(true).append(true).open(&path) };
        // One call for the whole line: what a killed worker leaves is a line or its beginning.
        open().and_then(|mut file| file.write_all(text.as_bytes())).map_err(GauntletError::file(&path))
    }
}

/// Ids of the cases that are done.
///
/// # Errors
/// A file that cannot be read, a line that is damaged.
pub fn done(folder: &Path) -> Result<BTreeSet<String>> {
    Ok(records(folder)?.into_iter().map(|record| record.case).collect())
}

/// All finished cases of all workers, each once and by its id.
///
/// # Errors
/// As [`done`].
pub fn records(folder: &Path) -> Result<Vec<CaseRecord>> {
    let all: BTreeMap<String, CaseRecord> =
        lines(folder, ANSWERS)?.into_iter().map(|record: CaseRecord| (record.case.clone(), record)).collect();
    Ok(all.into_values().collect())
}

/// Hashes of the truths as they were sealed before the diagnoses.
///
/// # Errors
/// As [`done`].
pub fn seals(folder: &Path) -> Result<BTreeMap<String, String>> {
    Ok(lines(folder, SEALS)?.into_iter().map(|line: SealLine| (line.case, line.sealed)).collect())
}

/// The scales that oracles have found for any worker.
///
/// # Errors
/// As [`done`].
pub fn scales(folder: &Path) -> Result<Vec<ScaleLine>> {
    lines(folder, SCALES)
}

/// The lines of all workers' files. A last line without its end was being written when its worker was killed.
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
        let [one, two] = [1, 2].map(|number| Ledger::open(folder.path(), number, 2).expect("room"));
        one.finish(&record("a")).expect("room");
        two.finish(&record("b")).expect("room");
        let path = folder.path().join("answers-2-2.jsonl");
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::write(&path, text + "{\"case\": \"c").expect("room");
        assert_eq!(done(folder.path()).expect("whole lines"), ["a".to_owned(), "b".to_owned()].into());
        std::fs::write(&path, "{\"case\": \"c\n").expect("room");
        let message = done(folder.path()).expect_err("a damaged line").to_string();
        assert!(message.contains("line 1"), "{message}");
    }
}
