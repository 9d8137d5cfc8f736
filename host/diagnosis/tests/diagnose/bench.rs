//! Recordings of the gauntlet's benches, whose generator shares no code with the fitter, and their diagnosis.

use softdock_campaign::Rig;
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, Prepared, prepare};
use softdock_diagnosis::report::extend;
use softdock_diagnosis::verdict::answer::{BlockAnswer, DiagnosisVerdict};
use softdock_diagnosis::verdict::judged::Judged;
pub(crate) use softdock_gauntlet::Rig as Kind;
use softdock_gauntlet::{Hidden, NoiseColour, Set, generate};
use softdock_kernels::effects::{code, share_group};
use softdock_test_size::is_full;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A bench's folder: model file, recordings to learn from, recordings to judge by.
pub(crate) struct Bench {
    folder: TempDir,
}

impl Bench {
    /// A drive with hidden effects.
    pub(crate) fn drive(hidden: &[(&'static str, f64)], seed: u64) -> Self {
        Self::drive_in(NoiseColour::FirstOrder, hidden, seed)
    }

    /// The same in noise of a colour.
    pub(crate) fn drive_in(noise: NoiseColour, hidden: &[(&'static str, f64)], seed: u64) -> Self {
        Self::of(Kind::Drive { link_encoder: false }, noise, hidden, seed)
    }

    /// A drive in records of full length in every check, for what shows late or from repeat to repeat.
    pub(crate) fn long_drive(hidden: &[(&'static str, f64)], seed: u64) -> Self {
        Self::long(Kind::Drive { link_encoder: false }, hidden, seed)
    }

    /// A bench of any kind in records of full length in every check.
    pub(crate) fn long(kind: Kind, hidden: &[(&'static str, f64)], seed: u64) -> Self {
        Self::write(&set(kind, NoiseColour::FirstOrder, hidden, seed))
    }

    /// A bench of any kind; in the short check the beginnings of two repeats of every experiment.
    pub(crate) fn of(kind: Kind, noise: NoiseColour, hidden: &[(&'static str, f64)], seed: u64) -> Self {
        let set = set(kind, noise, hidden, seed);
        Self::write(&if is_full() { set } else { set.shortened(2, 0.6) })
    }

    fn write(set: &Set) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        set.write(folder.path()).expect("writable");
        Self { folder }
    }

    pub(crate) fn model(&self) -> PathBuf {
        self.folder.path().join("model.toml")
    }

    /// The model file with some of its text replaced.
    pub(crate) fn with_model(self, from: &str, to: &str) -> Self {
        let text = std::fs::read_to_string(self.model()).expect("a model");
        assert!(text.contains(from), "{from} is not in the model file");
        std::fs::write(self.model(), text.replacen(from, to, 1)).expect("writable");
        self
    }

    /// Every recording with its text changed.
    pub(crate) fn with_recordings(self, change: impl Fn(&str) -> String) -> Self {
        self.rewrite("training", &change);
        self.with_held_out(change)
    }

    /// The held-out recordings with their text changed.
    pub(crate) fn with_held_out(self, change: impl Fn(&str) -> String) -> Self {
        self.rewrite("holdout", change);
        self
    }

    fn rewrite(&self, folder: &str, change: impl Fn(&str) -> String) {
        for file in self.files(folder) {
            let text = std::fs::read_to_string(&file).expect("a recording");
            std::fs::write(file, change(&text)).expect("writable");
        }
    }

    /// Files of one of its folders, sorted.
    fn files(&self, name: &str) -> Vec<PathBuf> {
        let folder = self.folder.path().join(name).read_dir().expect("a folder");
        let mut files: Vec<PathBuf> = folder.map(|entry| entry.expect("a file").path()).collect();
        files.sort();
        files
    }

    /// Its recordings, ready to be judged.
    pub(crate) fn prepared(&self, options: &DiagnosisOptions) -> Result<Prepared, DiagnosisError> {
        let rig = Rig::load(&self.model()).expect("a legal model");
        let (learn, test) = (self.files("training"), self.files("holdout"));
        let learn: Vec<&Path> = learn.iter().map(PathBuf::as_path).collect();
        let test: Vec<&Path> = test.iter().map(PathBuf::as_path).collect();
        prepare(rig, &learn, &test, options)
    }

    pub(crate) fn diagnose_with(&self, options: &DiagnosisOptions) -> Result<(Diagnosis, Vec<Judged>), DiagnosisError> {
        self.prepared(options)?.diagnose()
    }

    /// What the short check leaves out of the library: effects that are none of these, and in no group of the catalogue
    /// with one of them.
    pub(crate) fn strangers(&self, known: &[&str]) -> Vec<String> {
        if is_full() {
            return Vec::new();
        }
        let share = |a: &str, b: &str| code(a) == code(b) || share_group(a, b);
        let views = self.prepared(&DiagnosisOptions::default()).expect("good recordings").isolability;
        let ids = views.iter().flat_map(|view| view.effects.iter());
        ids.filter(|id| !known.iter().any(|known| share(known, id))).map(|id| (*id).to_owned()).collect()
    }

    pub(crate) fn diagnose(&self) -> Diagnosis {
        self.diagnose_with(&DiagnosisOptions::default()).expect("good recordings").0
    }

    /// The bench with the model that a diagnosis extends.
    pub(crate) fn extended(self, diagnosis: &Diagnosis) -> Self {
        let text = std::fs::read_to_string(self.model()).expect("a model");
        let extended = extend::extended(&text, diagnosis, false).expect("an answer that names something");
        std::fs::write(self.model(), extended).expect("writable");
        self
    }
}

fn set(kind: Kind, noise: NoiseColour, hidden: &[(&'static str, f64)], seed: u64) -> Set {
    let hidden: Vec<Hidden> = hidden.iter().map(|(id, size)| Hidden { id, size: *size }).collect();
    generate(kind, &hidden, noise, seed).expect("a legal size")
}

/// The drive's answer.
pub(crate) fn drive(diagnosis: &Diagnosis) -> &BlockAnswer {
    diagnosis.blocks.iter().find(|block| block.block == "R3 torque to motion").expect("the drive is judged")
}

/// Asserts that exactly these effects are named, and that what they leave is noise.
pub(crate) fn assert_named(diagnosis: &Diagnosis, ids: &[&str]) {
    let found: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
    assert_eq!((diagnosis.answer, &found[..]), (DiagnosisVerdict::Named, ids));
    let gain = diagnosis.gain.expect("held-out motion");
    assert!(gain.lo > 0.01 && gain.hi < 1.0 && diagnosis.residual.after < 1.14, "{gain:?} {:?}", diagnosis.residual);
}
