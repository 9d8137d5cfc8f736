//! Plan: the reproducible list of cases with hidden effect, size, noise and seed.

use crate::plant::{GauntletPlant, PLANTS, plant};
use crate::{GauntletError, Result};
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

/// Selection of cases.
#[derive(Clone, Debug)]
pub struct WantedCases {
    /// Extent.
    pub extent: Extent,
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
    nulls: u64,
    hidden: u64,
}

impl Counts {
    fn of(wanted: &WantedCases, plant: &GauntletPlant) -> Self {
        let (extent, nulls, hidden) = match wanted.extent {
            Extent::Ci => (Extent::Ci, 3, 1),
            Extent::Full if plant.slow => (Extent::Full, 3 * FEW_DRAWS, FEW_DRAWS),
            // 300 nulls without an alarm bound the rate of false alarms by 1 %.
            Extent::Full => (Extent::Full, 300, 20),
        };
        match wanted.draws {
            None => Self { extent, nulls, hidden },
            Some(draws) if draws < hidden => Self { extent, nulls: nulls.min(3 * draws), hidden: draws },
            Some(draws) => Self { extent, nulls, hidden: draws },
        }
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
            asked.extend(if self.extent == Extent::Ci { few(plant) } else { all(plant) });
        }
        let noise = NoiseColour::ALL[draw as usize % NoiseColour::ALL.len()];
        asked.into_iter().map(|(task, multiple)| Case { plant, task, multiple, draw, noise }).collect()
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
        format!("{}.{what}", self.plant.name)
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
    /// only in their effects, so that detection limits are computed once.
    pub fn seed(&self) -> u64 {
        let hidden = match self.task {
            CaseTask::Null => "",
            CaseTask::Effect(effect) | CaseTask::Outside(effect) | CaseTask::LeftOut(effect) => effect.id,
            CaseTask::Pair(..) => "pairs",
        };
        let text = format!("{} {hidden} {}", self.plant.name, self.draw);
        let hash = blake3::hash(text.as_bytes());
        // Four bytes: a seed that can be read, typed and kept exactly by any program.
        u64::from(u32::from_le_bytes(hash.as_bytes()[..4].try_into().expect("four of 32 bytes")))
    }
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
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn full(plants: &[&str]) -> Vec<Case> {
        let plants = plants.iter().map(|name| (*name).to_owned()).collect();
        plan(&WantedCases { extent: Extent::Full, plants, draws: None }).expect("plants that there are")
    }

    #[test]
    fn case_ids_are_unique_and_a_quick_plant_has_300_nulls() {
        let cases = full(&[]);
        let ids: BTreeSet<String> = cases.iter().map(Case::id).collect();
        assert_eq!(ids.len(), cases.len());
        assert!(ids.iter().all(|id| id.chars().all(|c| c.is_ascii_alphanumeric() || "._+".contains(c))), "{ids:?}");
        let nulls = cases.iter().filter(|case| case.task == CaseTask::Null && case.plant.name == "drive");
        let colours = NoiseColour::ALL.map(|colour| nulls.clone().filter(|case| case.noise == colour).count());
        assert_eq!(colours, [100; 3]);
    }

    #[test]
    fn slow_plant_has_four_draws_of_detectable_effects() {
        let cases = full(&["facility"]);
        let draws =
            |task: &dyn Fn(&CaseTask) -> bool| cases.iter().filter(|case| task(&case.task)).map(|case| case.draw).max();
        assert_eq!(draws(&|task| matches!(task, CaseTask::Effect(_))), Some(3));
        assert_eq!(draws(&|task| *task == CaseTask::Null), Some(11));
        assert!(cases.iter().all(|case| case.task == CaseTask::Null || [4.0, 16.0].contains(&case.multiple)));
    }

    #[test]
    fn shards_share_the_plan_and_keep_a_seed_together() {
        let cases = full(&["drive"]);
        let shards: Vec<Vec<Case>> = (1..=3).map(|number| shard(cases.clone(), number, 3)).collect();
        let ids: BTreeSet<String> = shards.iter().flatten().map(Case::id).collect();
        assert_eq!((ids.len(), shards.iter().map(Vec::len).sum::<usize>()), (cases.len(), cases.len()));
        let seeds = |cases: &Vec<Case>| cases.iter().map(Case::seed).collect::<BTreeSet<u64>>();
        assert!(seeds(&shards[0]).is_disjoint(&seeds(&shards[1])));
    }

    #[test]
    fn paired_effects_share_no_group() {
        let pairs = pairs(&PLANTS[0], PAIRS);
        assert_eq!(pairs.len(), PAIRS);
        assert!(pairs.iter().all(|(a, b)| !share_group(a.id, b.id)));
    }

    #[test]
    fn unknown_plant_is_rejected_with_the_list_of_plants() {
        let wanted = WantedCases { extent: Extent::Ci, plants: vec!["wheel".to_owned()], draws: None };
        let message = plan(&wanted).expect_err("no such plant").to_string();
        assert!(message.contains("wheel") && message.contains("drive"), "{message}");
    }
}
