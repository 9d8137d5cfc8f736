//! Plan: the reproducible list of cases with hidden effect, size, noise and seed.

use crate::plant::{GauntletPlant, PLANTS, plant};
use crate::{GauntletError, Result};
use serde::{Deserialize, Serialize};
use softdock_gauntlet::{EffectCase, NoiseColour};
use softdock_kernels::effects::share_group;

/// Extent of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Minutes: detects regressions.
    Ci,
    /// Hours: states rates with their bounds.
    Full,
}

impl Extent {
    /// Every extent: its word on a command line, its meaning, its value.
    pub const NAMED: [(&'static str, &'static str, Self); 2] = [
        ("ci", "Minutes: detects that a change broke the diagnosis", Self::Ci),
        ("full", "Hours: states rates with their bounds", Self::Full),
    ];

    /// The word on a command line.
    pub fn word(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Machine in which effects are hidden.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MachineKind {
    /// The model with parameters drawn within its tolerances.
    #[default]
    Exact,
    /// The same with three to eight further small deviations from the model.
    Perturbed,
}

impl MachineKind {
    /// Every kind: its word on a command line, its meaning, its value.
    pub const NAMED: [(&'static str, &'static str, Self); 2] = [
        ("exact", "The model, with parameters drawn within its tolerances", Self::Exact),
        ("perturbed", "The same with 3 to 8 further small deviations from the model", Self::Perturbed),
    ];

    /// The word on a command line.
    pub fn word(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// The word before a task in names; none for an exact machine.
    pub fn prefix(self) -> String {
        if self == Self::Exact { String::new() } else { format!("{}.", self.word()) }
    }
}

/// Selection of cases.
#[derive(Clone, Debug)]
pub struct WantedCases {
    /// Extent.
    pub extent: Extent,
    /// Machine.
    pub machine: MachineKind,
    /// Names of plants; all if empty.
    pub plants: Vec<String>,
    /// Draws of every effect and size, instead of those of the extent.
    pub draws: Option<u64>,
}

/// Task of a case: hidden effects and library.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaseTask {
    /// Nothing is hidden.
    Null,
    /// One effect of the library.
    Effect(&'static EffectCase),
    /// A form outside the library.
    Outside(&'static EffectCase),
    /// One effect that is excluded from the library.
    LeftOut(&'static EffectCase),
    /// Two effects that are not confounded.
    Pair(&'static EffectCase, &'static EffectCase),
}

/// Case of a plan.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// The plant.
    pub plant: &'static GauntletPlant,
    /// Machine in which the effects are hidden.
    pub machine: MachineKind,
    /// Task.
    pub task: CaseTask,
    /// Size, in multiples of the detection limit; 0 where nothing is hidden.
    pub multiple: f64,
    /// Number of the draw, from 0.
    pub draw: u64,
    /// Colour of the disturbance.
    pub noise: NoiseColour,
}

/// Sizes, in multiples of the detection limit.
pub const MULTIPLES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 16.0];
/// Sizes of effects that are excluded from the library.
const LEFT_OUT: [f64; 3] = [1.0, 4.0, 16.0];
/// Draws of a plant whose cases take minutes.
const FEW_DRAWS: u64 = 4;
/// Size at which an effect should be named, and size at which a form outside the library should be reported.
const TELLING: f64 = 4.0;
const OBVIOUS: f64 = 16.0;
/// Size of each of two effects.
const PAIRED: f64 = 4.0;
/// Pairs of effects a plant.
const PAIRS: usize = 20;

/// Returns the selected cases, ordered so that any prefix is a representative sample. Cases with the same seed are
/// adjacent.
///
/// # Errors
/// An unknown plant.
pub fn plan(wanted: &WantedCases) -> Result<Vec<Case>> {
    let plants = plants(&wanted.plants, wanted.extent)?;
    let counts: Vec<Counts> = plants.iter().map(|plant| Counts::of(wanted, plant)).collect();
    let most = counts.iter().map(Counts::most).max().unwrap_or(0);
    let of_draw = |draw| plants.iter().zip(&counts).flat_map(move |(plant, counts)| counts.cases(plant, draw));
    Ok((0..most).flat_map(of_draw).collect())
}

/// Plants by their names; without names, all, or the one that takes minutes.
fn plants(names: &[String], extent: Extent) -> Result<Vec<&'static GauntletPlant>> {
    if names.is_empty() {
        return Ok(if extent == Extent::Ci { vec![&PLANTS[0]] } else { PLANTS.iter().collect() });
    }
    let known = || PLANTS.iter().map(|plant| plant.name).collect::<Vec<_>>().join(", ");
    let of = |name: &String| {
        plant(name).ok_or_else(|| GauntletError::Unknown { what: format!("no plant `{name}`; there are {}", known()) })
    };
    names.iter().map(of).collect()
}

/// Draws of nulls, and of everything that is hidden.
struct Counts {
    extent: Extent,
    machine: MachineKind,
    nulls: u64,
    hidden: u64,
}

impl Counts {
    fn of(wanted: &WantedCases, plant: &GauntletPlant) -> Self {
        let WantedCases { extent, machine, .. } = *wanted;
        let (nulls, hidden) = match extent {
            Extent::Ci => (3, 1),
            Extent::Full if plant.slow => (3 * FEW_DRAWS, FEW_DRAWS),
            // 300 nulls without an alarm bound the rate of false alarms by 1 %.
            Extent::Full => (300, 20),
        };
        let (nulls, hidden) = match wanted.draws {
            None => (nulls, hidden),
            Some(draws) if draws < hidden => (nulls.min(3 * draws), draws),
            Some(draws) => (nulls, draws),
        };
        Self { extent, machine, nulls, hidden }
    }

    fn most(&self) -> u64 {
        self.nulls.max(self.hidden)
    }

    /// The cases of a plant's draw.
    fn cases(&self, plant: &'static GauntletPlant, draw: u64) -> Vec<Case> {
        let mut asked = Vec::new();
        if draw < self.nulls {
            asked.push((CaseTask::Null, 0.0));
        }
        if draw < self.hidden {
            asked.extend(match (self.machine, self.extent) {
                (MachineKind::Exact, Extent::Ci) => few(plant),
                (MachineKind::Exact, Extent::Full) => all(plant),
                (MachineKind::Perturbed, Extent::Ci) => perturbed(plant, 2, 1),
                (MachineKind::Perturbed, Extent::Full) => perturbed(plant, 1, PAIRS),
            });
        }
        let (machine, noise) = (self.machine, NoiseColour::ALL[draw as usize % NoiseColour::ALL.len()]);
        asked.into_iter().map(|(task, multiple)| Case { plant, machine, task, multiple, draw, noise }).collect()
    }
}

/// All that can be hidden, in all sizes; of a slow plant in those at which much is asked.
fn all(plant: &'static GauntletPlant) -> Vec<(CaseTask, f64)> {
    let wanted = |multiple: &f64| !plant.slow || *multiple >= TELLING;
    let sizes = |list: &'static [f64]| list.iter().copied().filter(wanted);
    let mut asked = Vec::new();
    for effect in plant.effects() {
        asked.extend(sizes(&MULTIPLES).map(|multiple| (CaseTask::Effect(effect), multiple)));
        asked.extend(sizes(&LEFT_OUT).map(|multiple| (CaseTask::LeftOut(effect), multiple)));
    }
    for form in plant.outside() {
        asked.extend(sizes(&MULTIPLES).map(|multiple| (CaseTask::Outside(form), multiple)));
    }
    asked.extend(pairs(plant, PAIRS).into_iter().map(|(a, b)| (CaseTask::Pair(a, b), PAIRED)));
    asked
}

/// Every other effect at the size where it should be named, and one case of every other task.
fn few(plant: &'static GauntletPlant) -> Vec<(CaseTask, f64)> {
    let mut asked: Vec<(CaseTask, f64)> =
        plant.effects().step_by(2).map(|effect| (CaseTask::Effect(effect), TELLING)).collect();
    // It has many relatives.
    let payload = plant.effects().find(|effect| effect.id == "J14_payload");
    asked.extend(payload.map(|effect| (CaseTask::LeftOut(effect), OBVIOUS)));
    asked.extend(plant.outside().next().map(|form| (CaseTask::Outside(form), OBVIOUS)));
    asked.extend(pairs(plant, 1).into_iter().map(|(a, b)| (CaseTask::Pair(a, b), PAIRED)));
    asked
}

/// Every `step`-th effect at the size where it should be named, and pairs.
fn perturbed(plant: &'static GauntletPlant, step: usize, most: usize) -> Vec<(CaseTask, f64)> {
    let effects = plant.effects().step_by(step).map(|effect| (CaseTask::Effect(effect), TELLING));
    effects.chain(pairs(plant, most).into_iter().map(|(a, b)| (CaseTask::Pair(a, b), PAIRED))).collect()
}

/// Pairs of effects that no group has in common, spread evenly over all such pairs.
fn pairs(plant: &GauntletPlant, most: usize) -> Vec<(&'static EffectCase, &'static EffectCase)> {
    let effects: Vec<&'static EffectCase> = plant.effects().collect();
    let all = (0..effects.len()).flat_map(|a| (a + 1..effects.len()).map(move |b| (a, b)));
    let all: Vec<_> = all.map(|(a, b)| (effects[a], effects[b])).filter(|(a, b)| !share_group(a.id, b.id)).collect();
    let count = most.min(all.len());
    (0..count).map(|k| all[(2 * k + 1) * all.len() / (2 * count)]).collect()
}

impl Case {
    /// Returns the unique id, which is a valid file name.
    pub fn id(&self) -> String {
        let size = if self.multiple > 0.0 { format!(".x{}", self.multiple) } else { String::new() };
        format!("{}{size}.{}", self.subject(), self.draw)
    }

    /// Returns plant and task, without size and draw.
    pub fn subject(&self) -> String {
        let what = match self.task {
            CaseTask::Null => "null".to_owned(),
            CaseTask::Effect(effect) => format!("effect.{}", effect.id),
            CaseTask::Outside(form) => format!("outside.{}", form.id),
            CaseTask::LeftOut(effect) => format!("left_out.{}", effect.id),
            CaseTask::Pair(a, b) => format!("pair.{}+{}", a.id, b.id),
        };
        format!("{}.{}{what}", self.plant.name, self.machine.prefix())
    }

    /// Returns the hidden effects.
    pub fn hidden(&self) -> Vec<&'static EffectCase> {
        match self.task {
            CaseTask::Null => Vec::new(),
            CaseTask::Effect(effect) | CaseTask::Outside(effect) | CaseTask::LeftOut(effect) => vec![effect],
            CaseTask::Pair(a, b) => vec![a, b],
        }
    }

    /// Returns the seed of the recordings. Cases with the same effect and draw differ only in size, and pairs of a draw
    /// only in their effects, so that detection limits are computed once. A perturbed machine has one pair alone: its
    /// perturbations would decide all of them.
    pub fn seed(&self) -> u64 {
        let hidden = match self.task {
            CaseTask::Null => String::new(),
            CaseTask::Effect(effect) | CaseTask::Outside(effect) | CaseTask::LeftOut(effect) => effect.id.to_owned(),
            CaseTask::Pair(a, b) if self.machine == MachineKind::Perturbed => format!("{}+{}", a.id, b.id),
            CaseTask::Pair(..) => "pairs".to_owned(),
        };
        seed(&format!("{} {}{hidden} {}", self.plant.name, self.machine.prefix(), self.draw))
    }
}

/// Returns the seed that belongs to a text: four bytes of its hash, so that any program reads it exactly.
pub(crate) fn seed(text: &str) -> u64 {
    let hash = blake3::hash(text.as_bytes());
    u64::from(u32::from_le_bytes(hash.as_bytes()[..4].try_into().expect("four of 32 bytes")))
}

/// Returns the cases of worker `number` (from 1) of `of` workers. Cases with the same seed stay together, so that no
/// oracle runs twice.
pub fn shard(cases: Vec<Case>, number: usize, of: usize) -> Vec<Case> {
    let (mut group, mut last) = (0, None);
    let mut own = Vec::new();
    for case in cases {
        let key = (case.plant.name, case.seed());
        if last.is_some_and(|last| last != key) {
            group += 1;
        }
        last = Some(key);
        if group % of == number - 1 {
            own.push(case);
        }
    }
    own
}

#[cfg(test)]
mod tests;
