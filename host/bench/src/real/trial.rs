//! Trials of the gauntlet in measured recordings: a changed copy of model and recordings, and its diagnosis.

use crate::real::cases::{RealCase, RealTask, cases};
use crate::real::forms::Joint;
use crate::real::sets::MeasuredSet;
use crate::real::table::MeasuredTable;
use crate::real::untouched::UntouchedChange;
use crate::record::{Ledger, RecordedAnswer, measured};
use crate::trial::{Found, answer};
use crate::{GauntletError, Result};
use serde::{Deserialize, Serialize};
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Share of the torque that counts as unexplained where the recordings are too slow for a torque error.
const UNKNOWN_SHARE: f64 = 0.1;

/// Effect that was planted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantedEffect {
    /// Id in the library of the diagnosis.
    pub id: String,
    /// Block; empty for any.
    pub block: String,
    /// Parameter that states its size.
    pub field: String,
    /// Planted size, SI; `None` if only its name is compared.
    pub size: Option<f64>,
    /// Whether the parameter is the model's value and the planted one together.
    pub on_nominal: bool,
}

/// Finished case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RealRecord {
    /// The case.
    pub case: String,
    /// The set.
    pub set: String,
    /// Planted effects.
    pub planted: Vec<PlantedEffect>,
    /// Answer.
    pub answer: RecordedAnswer,
    /// Relative torque error by block: what the model leaves unexplained.
    pub unexplained: BTreeMap<String, f64>,
    /// Computing time of the diagnosis \[s\].
    pub seconds: f64,
}

/// Recordings and model of a set, ready to be changed.
struct Copied {
    rig: String,
    tables: BTreeMap<PathBuf, MeasuredTable>,
}

/// Runs a case on the measured data in a folder; `base` is the record of the unchanged set, once there is one.
///
/// # Errors
/// Recordings that are missing, files that cannot be written. A rejection by the diagnosis is an answer.
pub fn run(case: &RealCase, data: &Path, base: Option<&RealRecord>) -> Result<RealRecord> {
    let folder = tempfile::tempdir().map_err(GauntletError::file(Path::new("a temporary folder")))?;
    let planted = lay_out(case, data, base, folder.path())?;
    let hold_out_experiments = case.set.hold_out_experiments.and_then(|every| every.parse().ok());
    let options =
        DiagnosisOptions { hold_out_from: hold_out_from(case), hold_out_experiments, ..DiagnosisOptions::default() };
    let start = Instant::now();
    let Found { answer, unexplained, .. } = answer(folder.path(), &options);
    let seconds = start.elapsed().as_secs_f64();
    Ok(RealRecord { case: case.id(), set: case.set.name.to_owned(), planted, answer, unexplained, seconds })
}

/// Returns all finished cases of all workers, each once, sorted by name.
///
/// # Errors
/// A file that cannot be read, a line that is damaged.
pub fn finished(folder: &Path) -> Result<Vec<RealRecord>> {
    let all: BTreeMap<String, RealRecord> =
        measured(folder)?.into_iter().map(|record: RealRecord| (record.case.clone(), record)).collect();
    Ok(all.into_values().collect())
}

/// Runs the cases that no worker has finished, and the unchanged sets that they need, until they are done or `stopped`
/// holds.
///
/// # Errors
/// As [`run`].
pub fn run_missing(
    cases: &[RealCase],
    data: &Path,
    ledger: &Ledger,
    stopped: &dyn Fn() -> bool,
    report: &mut dyn FnMut(usize, usize, &RealRecord),
) -> Result<()> {
    let mut known = finished(ledger.folder())?;
    let is_known = |known: &[RealRecord], id: &str| known.iter().any(|record| record.case == id);
    let missing: Vec<&RealCase> = cases.iter().filter(|case| !is_known(&known, &case.id())).collect();
    for (number, case) in missing.iter().enumerate() {
        if stopped() {
            return Ok(());
        }
        let unchanged = RealCase { set: case.set, task: RealTask::Base };
        for case in [&unchanged, case] {
            if !is_known(&known, &case.id()) {
                let base = known.iter().find(|record| record.case == unchanged.id());
                let record = run(case, data, base)?;
                ledger.measured(&record)?;
                known.push(record);
            }
        }
        report(number + 1, missing.len(), known.last().expect("just run"));
    }
    Ok(())
}

/// Writes model and recordings of a case into a folder, after the diagnosis of the unchanged set, to which sizes refer;
/// returns the command that diagnoses them.
///
/// # Errors
/// As [`run`], and a name of no case.
pub fn lay_out_case(id: &str, data: &Path, folder: &Path) -> Result<String> {
    let all = cases(|set| set.is_in(data));
    let unknown = || GauntletError::Unknown { what: format!("no case `{id}` of the sets below {}", data.display()) };
    let case = all.iter().find(|case| case.id() == id).ok_or_else(unknown)?;
    let base = run(&RealCase { set: case.set, task: RealTask::Base }, data, None)?;
    std::fs::create_dir_all(folder).map_err(GauntletError::file(folder))?;
    lay_out(case, data, Some(&base), folder)?;
    let held_out = match (hold_out_from(case), case.set.hold_out_experiments, case.set.holdout) {
        (Some(from), ..) => format!(" --hold-out-from {from}"),
        (_, Some(every), _) => format!(" --hold-out-experiments {every}"),
        (.., []) => String::new(),
        _ => format!(" --holdout {}/holdout/*", folder.display()),
    };
    let folder = folder.display();
    Ok(format!("softdock diagnose {folder}/model.toml {folder}/training/*{held_out}"))
}

/// Writes model and recordings of a case into a folder; returns what is planted.
///
/// # Errors
/// As [`run`].
pub fn lay_out(case: &RealCase, data: &Path, base: Option<&RealRecord>, folder: &Path) -> Result<Vec<PlantedEffect>> {
    let set = case.set;
    let mut copied = Copied { rig: set.rig.to_owned(), tables: BTreeMap::new() };
    if let RealTask::Model(model) = case.task {
        let [from, to] = model.replaced;
        if !copied.rig.contains(from) {
            return Err(GauntletError::Model(format!("{} has no text `{from}`", set.name)));
        }
        copied.rig = copied.rig.replace(from, to);
    }
    let rig = loaded(set, &copied.rig, folder)?;
    let names: BTreeSet<&str> = rig.log.values().map(|column| column.name.as_str()).collect();
    let files = |part: &'static str, names: &'static [&'static str]| names.iter().map(move |name| (part, *name));
    for (part, name) in files("training", set.training).chain(files("holdout", set.holdout)) {
        let mut table = MeasuredTable::read(&data.join(set.folder).join(name))?;
        table.keep(&names);
        copied.tables.insert(Path::new(part).join(name), table);
    }
    let planted = copied.plant(case, &rig, base)?;
    let untouched = if let RealTask::Untouched(change) = case.task { Some(change) } else { None };
    copied.write(untouched, set, &rig, folder)?;
    Ok(planted)
}

impl Copied {
    /// Plants the effects of a case.
    fn plant(&mut self, case: &RealCase, rig: &Rig, base: Option<&RealRecord>) -> Result<Vec<PlantedEffect>> {
        if let RealTask::Model(model) = case.task {
            let (id, field) = (model.id.to_owned(), model.field.to_owned());
            return Ok(vec![PlantedEffect { id, block: String::new(), field, size: model.value, on_nominal: false }]);
        }
        let RealTask::Forms(joint, forms, places, multiple) = case.task else { return Ok(Vec::new()) };
        let own = Joint { rig, end: joint.end };
        let first = Path::new("training").join(case.set.training[0]);
        let unexplained = base.and_then(|base| {
            let of = |(block, _): &(&String, &f64)| joint.block.is_empty() || **block == joint.block;
            base.unexplained.iter().find(of).map(|(_, error)| *error)
        });
        let mut planted = Vec::new();
        for form in places.of(forms) {
            let size = form.change.size(
                &self.tables[&first],
                own,
                multiple,
                unexplained.unwrap_or(UNKNOWN_SHARE),
                tolerance(rig, form.field),
            )?;
            self.tables.values_mut().try_for_each(|table| form.change.plant(table, own, size))?;
            let (id, field) = (form.id.to_owned(), form.field.to_owned());
            let (block, on_nominal) = (joint.block.to_owned(), form.on_nominal);
            planted.push(PlantedEffect { id, block, field, size: Some(size.value), on_nominal });
        }
        Ok(planted)
    }

    /// Writes model and recordings, whose form a change changes.
    fn write(&mut self, change: Option<UntouchedChange>, set: &MeasuredSet, rig: &Rig, folder: &Path) -> Result<()> {
        let text = change.map_or_else(|| Ok(self.rig.clone()), |change| change.rig(&self.rig))?;
        let model = folder.join("model.toml");
        std::fs::write(&model, text).map_err(GauntletError::file(&model))?;
        for (number, (name, table)) in self.tables.iter_mut().enumerate() {
            if let Some(change) = change {
                let clock = rig.log.get("t").map_or("", |column| column.name.as_str());
                change.table(table, set.rig, clock)?;
            }
            let name = match change {
                Some(UntouchedChange::FilesRenamed) => {
                    let part = name.parent().unwrap_or(Path::new(""));
                    part.join(format!("experiment_{}.csv", number + 1))
                }
                _ => name.clone(),
            };
            let path = folder.join(name);
            let parent = path.parent().unwrap_or(folder);
            std::fs::create_dir_all(parent).map_err(GauntletError::file(parent))?;
            let text = table.text(change.map_or(',', UntouchedChange::separator));
            std::fs::write(&path, text).map_err(GauntletError::file(&path))?;
        }
        let holdout = folder.join("holdout");
        std::fs::create_dir_all(&holdout).map_err(GauntletError::file(&holdout))
    }
}

/// Tolerance of a drive's parameter, SI; 0 without one. A motor's inertia and an inertia error of its link are one.
fn tolerance(rig: &Rig, field: &str) -> f64 {
    let RigModel::Drive(drive) = &rig.plant else { return 0.0 };
    let is_own = |name: &str| name == field || (field == "inertia_error" && name == "motor_inertia");
    drive.tolerance.iter().filter(|(name, _)| is_own(name)).map(|(_, tolerance)| *tolerance).fold(0.0, f64::max)
}

/// The time from which recordings are held out, on their clock.
fn hold_out_from(case: &RealCase) -> Option<f64> {
    case.set.hold_out_from.map(|from| match case.task {
        RealTask::Untouched(change) => change.shifted(from),
        _ => from,
    })
}

/// Writes a model file with the files that it names, and reads it.
fn loaded(set: &MeasuredSet, rig: &str, folder: &Path) -> Result<Rig> {
    let model = folder.join("model.toml");
    let files = set.beside.iter().map(|(name, text)| (folder.join(name), *text)).chain([(model.clone(), rig)]);
    for (path, text) in files {
        std::fs::write(&path, text).map_err(GauntletError::file(&path))?;
    }
    Rig::load(&model).map_err(|problems| GauntletError::Model(problems.to_string()))
}
