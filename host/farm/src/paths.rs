//! Paths of campaigns' files: without `.` and `..`, and as names below a folder.

use softdock_campaign::Campaign;
use std::path::{Component, Path, PathBuf};

/// A path from the root, without `.` and `..`.
pub(crate) fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in std::path::absolute(path).unwrap_or(path.to_owned()).components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(out.pop()),
            part => out.push(part),
        }
    }
    out
}

/// A file of a campaign, with its name below `campaign/`.
#[derive(Clone, Debug)]
pub(crate) struct NamedFile {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    /// Its text where the command line has set values in it; else the file has it.
    text: Option<String>,
}

impl NamedFile {
    /// The file's bytes, with the values that the command line has set.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn bytes(&self) -> std::result::Result<Vec<u8>, softdock_input::InputError> {
        let text = self.text.as_ref().map(|text| Ok(text.clone().into_bytes()));
        text.unwrap_or_else(|| softdock_input::read(&self.path, softdock_input::MAX_BINARY))
    }
}

/// The files of a campaign, its own first.
pub(crate) fn named_files(campaign: &Campaign) -> Vec<NamedFile> {
    let files: Vec<PathBuf> = campaign.files().iter().map(|file| normal(file)).collect();
    let root = common_root(&files);
    let named = |(file, path): (&PathBuf, PathBuf)| {
        let name = slashed(path.strip_prefix(&root).unwrap_or(&path));
        NamedFile { name, path, text: campaign.edited_text(file).map(str::to_owned) }
    };
    campaign.files().iter().zip(files.iter().cloned()).map(named).collect()
}

/// The files of a campaign that lie below a folder.
pub(crate) fn named_below(folder: &Path) -> Vec<NamedFile> {
    files_below(folder).into_iter().map(|(name, path)| NamedFile { name, path, text: None }).collect()
}

/// All files below a folder, by their names in it; what cannot be read is omitted.
pub(crate) fn files_below(folder: &Path) -> Vec<(String, PathBuf)> {
    let (mut open, mut files) = (vec![(String::new(), folder.to_owned())], Vec::new());
    let mut seen = std::collections::BTreeSet::new();
    while let Some((prefix, folder)) = open.pop() {
        // Links may lead in a circle.
        if !seen.insert(folder.canonicalize().unwrap_or_else(|_| folder.clone())) {
            continue;
        }
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            match entry.path() {
                path if path.is_dir() => open.push((format!("{name}/"), path)),
                path => files.push((name, path)),
            }
        }
    }
    files.sort();
    files
}

/// The deepest folder that holds all files.
fn common_root(files: &[PathBuf]) -> PathBuf {
    let mut folders = files.iter().filter_map(|file| file.parent());
    let first = folders.next().unwrap_or(Path::new("")).to_owned();
    folders.fold(first, |root, folder| {
        let shared = root.components().zip(folder.components()).take_while(|(one, two)| one == two);
        shared.map(|(one, _)| one).collect()
    })
}

/// A relative path as it is written on every system.
fn slashed(path: &Path) -> String {
    path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}
