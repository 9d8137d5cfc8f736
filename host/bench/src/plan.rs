//! The list of cases: what is hidden, how large, in which noise, from which seed; the same for everybody.

use crate::plant::{PLANTS, Plant, plant, share_group};
use crate::{Error, Result};
use softdock_gauntlet::{EffectCase, NoiseColour};

/// How many cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Minutes: enough to notice that something broke.
    Ci,
    /// Hours: enough to state rates with their bounds.
    Full,
}

/// Which cases are wanted.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// How many.
    pub extent: Extent,
    /// Names of plants; all if empty.
    pub plants: Vec<String>,
    /// Draws of every effect and size, where not the extent's own.
    pub draws: Option<u64>,
}

/// What a case hides and asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// Nothing is hidden.
    Null,
    /// One effect of the library.
    Effect(&'static EffectCase),
    /// A form that no library has.
    Outside(&'static EffectCase),
    /// One effect that is taken out of the library.
    LeftOut(&'static EffectCase),
    /// Two effects that do not look alike.
    Pair(&'static EffectCase, &'static EffectCase),
}

/// One case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// The plant.
    pub plant: &'static Plant,
    /// What it hides.
    pub task: Task,
    /// Size, in multiples of the smallest that an oracle could tell; 0 where nothing is hidden.
    pub multiple: f64,
    /// Number of the draw, from 0.
    pub draw: u64,
    /// Colour of the disturbance.
    pub noise: NoiseColour,
}

/// Sizes that are asked, in multiples of the smallest that an oracle could tell.
pub const MULTIPLES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 16.0];
/// Sizes at which an effect is asked that is not in the library.
const LEFT_OUT: [f64; 3] = [1.0, 4.0, 16.0];
/// Size of each of two effects.
const PAIRED: f64 = 4.0;
/// Pairs of effects a plant.
const PAIRS: usize = 20;

/// The cases that are wanted, ordered so that any beginning of the list is a fair sample of it; cases that share their
/// recordings' seed follow one another.
///
/// # Errors
/// A plant that there is not.
pub fn plan(wanted: &Wanted) -> Result<Vec<Case>> {
    let plants = plants(&wanted.plants, wanted.extent)?;
    let counts = Counts::of(wanted);
    let mut cases = Vec::new();
    for draw in 0..counts.most() {
        for plant in &plants {
            cases.extend(counts.cases(plant, draw));
        }
    }
    Ok(cases)
}

/// Plants by their names; without names, all, or the one that takes minutes.
fn plants(names: &[String], extent: Extent) -> Result<Vec<&'static Plant>> {
    if names.is_empty() {
        return Ok(if extent == Extent::Ci { vec![&PLANTS[0]] } else { PLANTS.iter().collect() });
    }
    let known = || PLANTS.iter().map(|plant| plant.name).collect::<Vec<_>>().join(", ");
    let of = |name: &String| {
        plant(name).ok_or_else(|| Error::Unknown { what: format!("no plant `{name}`; there are {}", known()) })
    };
    names.iter().map(of).collect()
}

/// Draws of each kind of case.
struct Counts {
    extent: Extent,
    nulls: u64,
    effects: u64,
    left_out: u64,
    outside: u64,
    pairs: u64,
}

impl Counts {
    fn of(wanted: &Wanted) -> Self {
        let own = match wanted.extent {
            Extent::Ci => Self { extent: Extent::Ci, nulls: 3, effects: 1, left_out: 1, outside: 1, pairs: 1 },
            // 300 nulls without an alarm bound the rate of false alarms by 1 %.
            Extent::Full => {
                Self { extent: Extent::Full, nulls: 300, effects: 20, left_out: 20, outside: 20, pairs: 20 }
            }
        };
        match wanted.draws {
            None => own,
            Some(draws) => {
                let nulls = if draws >= own.effects { own.nulls } else { 3 * draws };
                Self { nulls, effects: draws, left_out: draws, outside: draws, pairs: draws, ..own }
            }
        }
    }

    fn most(&self) -> u64 {
        [self.nulls, self.effects, self.left_out, self.outside, self.pairs].into_iter().max().unwrap_or(0)
    }

    /// The cases of a plant's draw.
    fn cases(&self, plant: &'static Plant, draw: u64) -> Vec<Case> {
        let case = |task: Task, multiple: f64| {
            let noise = NoiseColour::ALL[draw as usize % NoiseColour::ALL.len()];
            Case { plant, task, multiple, draw, noise }
        };
        let mut cases = Vec::new();
        if draw < self.nulls {
            cases.push(case(Task::Null, 0.0));
        }
        for (number, effect) in plant.effects().enumerate() {
            if draw < self.effects {
                let asked: &[f64] = if self.extent == Extent::Ci { &MULTIPLES[3..4] } else { &MULTIPLES };
                let chosen = self.extent == Extent::Full || number % CI_STRIDE == 0;
                cases.extend(asked.iter().filter(|_| chosen).map(|multiple| case(Task::Effect(effect), *multiple)));
            }
            if draw < self.left_out {
                let asked: &[f64] = if self.extent == Extent::Ci { &LEFT_OUT[2..] } else { &LEFT_OUT };
                let chosen = self.extent == Extent::Full || number == CI_LEFT_OUT;
                cases.extend(asked.iter().filter(|_| chosen).map(|multiple| case(Task::LeftOut(effect), *multiple)));
            }
        }
        if draw < self.outside {
            for (number, form) in plant.outside().enumerate() {
                let asked: &[f64] = if self.extent == Extent::Ci { &MULTIPLES[4..] } else { &MULTIPLES };
                let chosen = self.extent == Extent::Full || number == 0;
                cases.extend(asked.iter().filter(|_| chosen).map(|multiple| case(Task::Outside(form), *multiple)));
            }
        }
        if draw < self.pairs {
            let most = if self.extent == Extent::Ci { 1 } else { PAIRS };
            cases.extend(pairs(plant, most).into_iter().map(|(a, b)| case(Task::Pair(a, b), PAIRED)));
        }
        cases
    }
}

/// Of so many effects the small size asks one.
const CI_STRIDE: usize = 2;
/// The effect that it takes out of the library: the payload of a drive, which has many relatives.
const CI_LEFT_OUT: usize = 13;

/// Pairs of effects that no group has in common, spread evenly over all such pairs.
fn pairs(plant: &Plant, most: usize) -> Vec<(&'static EffectCase, &'static EffectCase)> {
    let effects: Vec<&'static EffectCase> = plant.effects().collect();
    let all = (0..effects.len()).flat_map(|a| (a + 1..effects.len()).map(move |b| (a, b)));
    let all: Vec<_> = all.map(|(a, b)| (effects[a], effects[b])).filter(|(a, b)| !share_group(a.id, b.id)).collect();
    let count = most.min(all.len());
    (0..count).map(|k| all[(2 * k + 1) * all.len() / (2 * count)]).collect()
}

impl Case {
    /// What tells it from all others; a legal file name.
    pub fn id(&self) -> String {
        let size = if self.multiple > 0.0 { format!(".x{}", self.multiple) } else { String::new() };
        format!("{}{size}.{}", self.subject(), self.draw)
    }

    /// Plant and task, whatever the size and the draw.
    pub fn subject(&self) -> String {
        let what = match self.task {
            Task::Null => "null".to_owned(),
            Task::Effect(effect) => format!("effect.{}", effect.id),
            Task::Outside(form) => format!("outside.{}", form.id),
            Task::LeftOut(effect) => format!("left_out.{}", effect.id),
            Task::Pair(a, b) => format!("pair.{}+{}", a.id, b.id),
        };
        format!("{}.{what}", self.plant.name)
    }

    /// Ids of what is hidden.
    pub fn hidden(&self) -> Vec<&'static EffectCase> {
        match self.task {
            Task::Null => Vec::new(),
            Task::Effect(effect) | Task::Outside(effect) | Task::LeftOut(effect) => vec![effect],
            Task::Pair(a, b) => vec![a, b],
        }
    }

    /// Seed of the recordings: cases that hide the same in the same draw differ in size alone.
    pub fn seed(&self) -> u64 {
        let hidden: Vec<&str> = self.hidden().iter().map(|effect| effect.id).collect();
        let text = format!("{} {} {}", self.plant.name, hidden.join("+"), self.draw);
        let hash = blake3::hash(text.as_bytes());
        // Four bytes: a seed that can be read, typed and kept exactly by any program.
        u64::from(u32::from_le_bytes(hash.as_bytes()[..4].try_into().expect("four of 32 bytes")))
    }
}

/// The part of a plan that belongs to one of several workers, the first being number 1. Cases that share their recordings'
/// seed stay together, so that no oracle is asked twice.
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
        plan(&Wanted { extent: Extent::Full, plants, draws: None }).expect("plants that there are")
    }

    #[test]
    fn every_case_has_an_id_of_its_own_and_every_plant_its_300_nulls() {
        let cases = full(&[]);
        let ids: BTreeSet<String> = cases.iter().map(Case::id).collect();
        assert_eq!(ids.len(), cases.len());
        assert!(ids.iter().all(|id| id.chars().all(|c| c.is_ascii_alphanumeric() || "._+".contains(c))), "{ids:?}");
        let nulls = cases.iter().filter(|case| case.task == Task::Null && case.plant.name == "drive");
        let colours = NoiseColour::ALL.map(|colour| nulls.clone().filter(|case| case.noise == colour).count());
        assert_eq!(colours, [100; 3]);
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
    fn pairs_look_nothing_alike() {
        let pairs = pairs(&PLANTS[0], PAIRS);
        assert_eq!(pairs.len(), PAIRS);
        assert!(pairs.iter().all(|(a, b)| !share_group(a.id, b.id)));
    }

    #[test]
    fn a_plant_that_there_is_not_is_refused_with_those_that_there_are() {
        let wanted = Wanted { extent: Extent::Ci, plants: vec!["wheel".to_owned()], draws: None };
        let message = plan(&wanted).expect_err("no such plant").to_string();
        assert!(message.contains("wheel") && message.contains("drive"), "{message}");
    }
}
