//! Folder with a data set, the only input of a diagnosis.

use crate::{GauntletError, Result};
use softdock_campaign::{FileKind, Problems, Rig, Scenario, kind};
use softdock_diagnosis::diagnosis::{DiagnosisOptions, Prepared, prepare, prepare_facility};
use softdock_diagnosis::plants::facility::block::FacilityModel;
use softdock_gauntlet::Set;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Temporary folder with model and recordings, removed on drop.
pub(crate) struct RecordingsFolder {
    folder: TempDir,
}

impl RecordingsFolder {
    /// Writes a data set without its truth.
    pub(crate) fn of(set: &Set) -> Result<Self> {
        let folder = tempfile::tempdir().map_err(GauntletError::file(Path::new("a temporary folder")))?;
        set.write(folder.path()).map_err(GauntletError::file(folder.path()))?;
        Ok(Self { folder })
    }

    /// Adds training recordings.
    pub(crate) fn add(&self, recordings: &[(String, String)]) -> Result<()> {
        for (name, text) in recordings {
            let file = self.path().join("training").join(name);
            std::fs::write(&file, text).map_err(GauntletError::file(&file))?;
        }
        Ok(())
    }

    /// Returns its path.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Reads model and recordings of a folder. The held-out recordings are `holdout`, or the folder's own if empty.
pub(crate) fn read(folder: &Path, holdout: &[PathBuf], options: &DiagnosisOptions) -> Result<Prepared> {
    let (model, refused) = (folder.join("model.toml"), |problems: Problems| GauntletError::Model(problems.to_string()));
    let training = files(&folder.join("training"))?;
    let own = if holdout.is_empty() { files(&folder.join("holdout"))? } else { holdout.to_vec() };
    let training: Vec<&Path> = training.iter().map(PathBuf::as_path).collect();
    let own: Vec<&Path> = own.iter().map(PathBuf::as_path).collect();
    if kind(&model).map_err(refused)? == FileKind::Scenario {
        let facility = FacilityModel::Scenario(Box::new(Scenario::load(&model).map_err(refused)?));
        return Ok(prepare_facility(facility, &training, &own, options)?);
    }
    Ok(prepare(Rig::load(&model).map_err(refused)?, &training, &own, options)?)
}

/// Returns the files of a folder, sorted.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = folder.read_dir().map_err(GauntletError::file(folder))?;
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<std::io::Result<_>>()
        .map_err(GauntletError::file(folder))?;
    files.sort();
    Ok(files)
}
