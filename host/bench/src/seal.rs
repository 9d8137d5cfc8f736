//! Sealed truth of a case: written before the diagnosis begins, opened and verified for the score.

use crate::oracle::DetectionLimit;
use crate::plan::{Case, CaseTask, MachineKind};
use crate::sizing::Hiding;
use crate::{GauntletError, Result};
use serde::{Deserialize, Serialize};
use softdock_gauntlet::{Parameter, Set};
use softdock_results::write_file;
use std::path::{Path, PathBuf};

/// Truth of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SealedTruth {
    /// The case.
    pub case: String,
    /// Name of the plant.
    pub plant: String,
    /// Machine in which the effects are hidden.
    #[serde(default)]
    pub machine: MachineKind,
    /// Task.
    pub asks: Asks,
    /// Size, in multiples of the detection limit; 0 where nothing is hidden.
    pub multiple: f64,
    /// Seed of its recordings.
    pub seed: u64,
    /// Hidden effects; empty for a null case.
    pub hidden: Vec<Hidden>,
    /// Small deviations of a perturbed machine from the model; empty for an exact one.
    #[serde(default)]
    pub perturbations: Vec<Hidden>,
    /// Nuisance parameters drawn within the model's tolerances.
    pub nuisances: Vec<Number>,
}

/// Expected kind of answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Asks {
    /// No effect, where nothing is hidden.
    Null,
    /// The name of an effect.
    Effect,
    /// The names of two.
    Pair,
    /// Outside the library, for a form that is not in it.
    Outside,
    /// Outside the library, for an effect that is excluded from it.
    LeftOut,
}

/// Hidden effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// The generator's id.
    pub id: String,
    /// Detection limit; `None` if no size in the range of the generator is detectable.
    pub scale: Option<DetectionLimit>,
    /// Parameters; the first is the size.
    pub parameters: Vec<Number>,
}

/// Named value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Number {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit; empty for a pure number.
    pub unit: String,
}

impl SealedTruth {
    /// Builds the truth of a case from its sizes; `set` is `None` for a size beyond the range of the generator.
    pub fn of(case: &Case, hiding: &Hiding, set: Option<&Set>) -> Self {
        let numbers = |list: &[Parameter]| -> Vec<Number> {
            list.iter().map(|p| Number { name: p.name.into(), value: p.value, unit: p.unit.into() }).collect()
        };
        let sealed = |id: &str, scale: &Option<DetectionLimit>| {
            let own = set.and_then(|set| set.truth.hidden.iter().find(|hidden| hidden.id == id));
            let parameters = own.map_or_else(Vec::new, |own| numbers(&own.parameters));
            Hidden { id: id.to_owned(), scale: scale.clone(), parameters }
        };
        let hidden = case.hidden();
        Self {
            case: case.id(),
            plant: case.plant.name.to_owned(),
            machine: case.machine,
            asks: match case.task {
                CaseTask::Null => Asks::Null,
                CaseTask::Effect(_) => Asks::Effect,
                CaseTask::Pair(..) => Asks::Pair,
                CaseTask::Outside(_) => Asks::Outside,
                CaseTask::LeftOut(_) => Asks::LeftOut,
            },
            multiple: case.multiple,
            seed: case.seed(),
            hidden: hidden.iter().zip(&hiding.scales).map(|(effect, scale)| sealed(effect.id, scale)).collect(),
            perturbations: hiding.perturbations.iter().map(|own| sealed(own.id, &None)).collect(),
            nuisances: set.map_or_else(Vec::new, |set| numbers(&set.truth.nuisances)),
        }
    }

    /// Returns the drawn value of a nuisance parameter.
    pub fn nuisance(&self, name: &str) -> Option<f64> {
        self.nuisances.iter().find(|nuisance| nuisance.name == name).map(|nuisance| nuisance.value)
    }
}

/// Returns the path of a sealed truth.
fn place(folder: &Path, case: &str) -> PathBuf {
    folder.join("sealed").join(format!("{case}.json"))
}

/// Writes a truth and returns its hash (BLAKE3, hexadecimal).
///
/// # Errors
/// A folder that cannot be written.
pub fn seal(folder: &Path, truth: &SealedTruth) -> Result<String> {
    let text = serde_json::to_string_pretty(truth).expect("names and numbers") + "\n";
    write_file(&place(folder, &truth.case), text.as_bytes())?;
    Ok(blake3::hash(text.as_bytes()).to_hex().to_string())
}

/// Opens the truth of a case and verifies its hash.
///
/// # Errors
/// A file that is missing, damaged, or not the one that was sealed.
pub fn open(folder: &Path, case: &str, hash: &str) -> Result<SealedTruth> {
    let path = place(folder, case);
    let bytes = softdock_input::read(&path, softdock_input::MAX_TEXT)?;
    if blake3::hash(&bytes).to_hex().as_str() != hash {
        return Err(GauntletError::damaged(&path, "not the truth that was sealed before the diagnosis"));
    }
    serde_json::from_slice(&bytes).map_err(|error| GauntletError::damaged(&path, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Extent, MachineKind, WantedCases, plan};

    #[test]
    fn changed_truth_is_rejected() {
        let folder = tempfile::tempdir().expect("a folder");
        let wanted = WantedCases { extent: Extent::Ci, machine: MachineKind::Exact, plants: Vec::new(), draws: None };
        let case = plan(&wanted).expect("the usual plants")[0];
        let truth = SealedTruth::of(&case, &Hiding::default(), None);
        let hash = seal(folder.path(), &truth).expect("writable");
        assert_eq!(open(folder.path(), &case.id(), &hash).expect("unchanged"), truth);
        let path = place(folder.path(), &case.id());
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::write(&path, text.replace("null", "pair")).expect("writable");
        assert!(open(folder.path(), &case.id(), &hash).expect_err("changed").to_string().contains("sealed"));
    }
}
