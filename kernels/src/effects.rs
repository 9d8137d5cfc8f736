//! The effect table: every named phenomenon by which the facility may differ from space, one row each.
//!
//! Ids, groups and forms are those of the catalogue of effects. At its null value an effect changes nothing,
//! bit for bit; a test walks the table and proves it. A new effect is one row here and one term in its stage.

mod bench;
mod command;
mod contact;
mod groups;
mod robot;
mod sensor;
mod set;
mod space;

use crate::params;
use crate::timing::Timing;

pub use bench::BENCH_EFFECTS;
pub use groups::{GROUPS, Group};
pub use set::{EffectId, EffectSet};

/// The number of an effect in the catalogue (`J3`): a generator and a fitter may name the same row differently.
pub fn code(id: &str) -> &str {
    id.split('_').next().unwrap_or(id)
}

/// Whether two effects look alike in data: some group has both.
pub fn share_group(a: &str, b: &str) -> bool {
    GROUPS.iter().any(|group| group.id != "own" && group.has(a) && group.has(b))
}

/// The block of the loop that an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectBlock {
    /// Between the simulation computer and the robots.
    Command,
    /// Robots and rail.
    Robot,
    /// Force/torque sensor.
    Sensor,
    /// The parts mounted on the robots.
    Contact,
    /// The simulated bodies.
    Space,
}

/// The value of a parameter that removes its effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Null {
    /// That of the parameter's row ([`Field::null`](crate::fields::Field::null)).
    OfRow,
    /// The loop's own dead time, which no parameter can undercut ([`Timing::own_delay`]).
    OwnDelay,
    /// None: the parameter shapes the effect (a speed, a frequency), and another one switches it on.
    Any,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// Field of [`Params`](crate::params::Params); a vector's components are listed one by one.
    pub field: &'static str,
    /// The value that removes the effect.
    pub null: Null,
    /// A plausible size, in the field's unit.
    pub scale: f64,
}

/// One named phenomenon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// Catalogue id (`C1_transport_delay`).
    pub id: &'static str,
    /// Where it acts.
    pub block: EffectBlock,
    /// The part that has it.
    pub component: &'static str,
    /// What it is, in a few words, beside its component.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Where the plausible size comes from.
    pub source: &'static str,
    /// The rows of [`GROUPS`] that it belongs to, the main one first: effects of one group are confounded in some data.
    pub groups: &'static [&'static str],
}

/// The rows of each block, in the order of the loop.
const BLOCKS: [(EffectBlock, &[Row]); 5] = [
    (EffectBlock::Command, command::ROWS),
    (EffectBlock::Robot, robot::ROWS),
    (EffectBlock::Sensor, sensor::ROWS),
    (EffectBlock::Contact, contact::ROWS),
    (EffectBlock::Space, space::ROWS),
];

const COUNT: usize = {
    let (mut count, mut block) = (0, 0);
    while block < BLOCKS.len() {
        count += BLOCKS[block].1.len();
        block += 1;
    }
    count
};

/// A form outside the catalogue, as a diagnosis writes it into an extended model; a drive alone can have it.
pub const DICTIONARY: Effect = Effect {
    id: "dictionary",
    block: EffectBlock::Robot,
    component: "drive",
    name: "a form outside the catalogue",
    parameters: &[],
    source: "the data from which it was identified",
    groups: &["own"],
};

/// All effects that the loop has.
pub const EFFECTS: &[Effect] = &{
    let mut all = [command::ROWS[0].of(EffectBlock::Command); COUNT];
    let (mut next, mut block) = (0, 0);
    while block < BLOCKS.len() {
        let (name, rows) = BLOCKS[block];
        let mut index = 0;
        while index < rows.len() {
            all[next] = rows[index].of(name);
            (next, index) = (next + 1, index + 1);
        }
        block += 1;
    }
    all
};

impl EffectParameter {
    /// Returns the value that removes the effect from a loop of this timing; `None` for a parameter that shapes it.
    ///
    /// # Panics
    /// If no parameter has this name.
    pub fn null_value(&self, timing: &Timing) -> Option<f64> {
        match self.null {
            Null::OfRow => Some(params::row_of(self.field).expect("a parameter of the table").null),
            Null::OwnDelay => Some(timing.own_delay()),
            Null::Any => None,
        }
    }
}

impl Effect {
    /// Returns component and name (`gear: backlash`).
    pub fn words(&self) -> String {
        format!("{}: {}", self.component, self.name)
    }
}

/// Returns the row of an effect in any table; `None` for an unknown id.
pub fn row_of(id: &str) -> Option<&'static Effect> {
    EFFECTS.iter().chain(BENCH_EFFECTS).chain([&DICTIONARY]).find(|effect| effect.id == id)
}

/// An effect as its block's file writes it.
#[derive(Clone, Copy)]
struct Row {
    id: &'static str,
    groups: &'static [&'static str],
    component: &'static str,
    name: &'static str,
    parameters: &'static [EffectParameter],
    source: &'static str,
}

impl Row {
    const fn of(self, block: EffectBlock) -> Effect {
        let Self { id, groups, component, name, parameters, source } = self;
        Effect { id, block, component, name, parameters, source, groups }
    }
}

const fn row(
    id: &'static str,
    groups: &'static [&'static str],
    component: &'static str,
    name: &'static str,
    parameters: &'static [EffectParameter],
    source: &'static str,
) -> Row {
    Row { id, groups, component, name, parameters, source }
}

/// A parameter that removes its effect at its null value.
const fn at(field: &'static str, scale: f64) -> EffectParameter {
    EffectParameter { field, null: Null::OfRow, scale }
}

/// A parameter that shapes its effect.
const fn shape(field: &'static str, scale: f64) -> EffectParameter {
    EffectParameter { field, null: Null::Any, scale }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_row_names_parameters_and_groups_of_several() {
        for effect in EFFECTS {
            assert!(!effect.groups.is_empty(), "{} has no group", effect.id);
            effect.groups.iter().for_each(|id| assert!(GROUPS.iter().any(|group| group.id == *id), "{id}"));
            for parameter in effect.parameters {
                assert!(params::row_of(parameter.field).is_some(), "no parameter {}", parameter.field);
            }
        }
        let ids: BTreeSet<&str> = EFFECTS.iter().chain(BENCH_EFFECTS).map(|effect| effect.id).collect();
        assert_eq!(ids.len(), EFFECTS.len() + BENCH_EFFECTS.len(), "an id twice");
        for group in GROUPS {
            let members = EFFECTS.iter().filter(|effect| effect.groups.contains(&group.id)).count();
            assert!(members > 1, "{} has {members} members", group.id);
        }
    }
}
