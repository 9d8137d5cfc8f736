//! Sets of effects: what no run of a batch has need not be computed.

use super::{EFFECTS, Effect, EffectParameter, Null};
use crate::fields::{fields, to_vec};
use crate::params::Params;
use crate::timing::Timing;

/// An effect by its place in [`EFFECTS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectId(usize);

impl EffectId {
    /// The effect of the given id; meant for constants, where an id that is not in the table does not compile.
    ///
    /// # Panics
    /// If no effect has that id.
    pub const fn of(id: &str) -> Self {
        let mut index = 0;
        while index < EFFECTS.len() {
            if same(EFFECTS[index].id, id) {
                return Self(index);
            }
            index += 1;
        }
        panic!("no effect has this id")
    }

    /// Its row of the table.
    pub const fn effect(self) -> &'static Effect {
        &EFFECTS[self.0]
    }
}

const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut index = 0;
    while index < a.len() && index < b.len() && a[index] == b[index] {
        index += 1;
    }
    index == a.len() && index == b.len()
}

/// Some of the effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet(u128);

const _: () = assert!(EFFECTS.len() <= u128::BITS as usize, "a set has a bit for each effect");

impl EffectSet {
    /// All of them.
    pub const ALL: Self = Self(u128::MAX);
    /// None of them.
    pub const NONE: Self = Self(0);

    /// Those that a run with these parameters has.
    pub fn of(p: &Params<f64>, timing: &Timing) -> Self {
        let (table, values) = (fields::<f64, Params<f64>>(), to_vec(p));
        let value = |name: &str| table.iter().position(|field| field.name == name).map(|index| values[index]);
        let is_off = |p: &EffectParameter| p.null_value(timing).is_some_and(|null| value(p.field) != Some(null));
        Self::of_those(|effect| effect.parameters.iter().any(is_off))
    }

    /// Those that are there or not by a parameter's value.
    pub fn switched_by(field: &str) -> Self {
        let switches = |p: &EffectParameter| p.field == field && p.null != Null::Any;
        Self::of_those(|effect| effect.parameters.iter().any(switches))
    }

    fn of_those(belongs: impl Fn(&Effect) -> bool) -> Self {
        let bit = |(index, effect): (usize, &Effect)| if belongs(effect) { 1 << index } else { 0 };
        Self(EFFECTS.iter().enumerate().map(bit).fold(0, |all, bit: u128| all | bit))
    }

    /// Those of either set.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether an effect is one of them.
    #[inline(always)]
    pub const fn has(self, effect: EffectId) -> bool {
        self.0 >> effect.0 & 1 == 1
    }

    /// Its effects, in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = &'static Effect> {
        EFFECTS.iter().enumerate().filter(move |(index, _)| self.has(EffectId(*index))).map(|(_, effect)| effect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: Timing = Timing { substep: 1e-3, substeps: 1, max_ticks: 1 };

    #[test]
    fn a_set_holds_what_is_off_its_null() {
        let none = EffectSet::of(&Params::null(), &TIMING);
        assert_eq!(none.iter().count(), 0, "{:?}", none.iter().map(|effect| effect.id).collect::<Vec<_>>());
        let p = Params { contact_stiffness_error: 0.1, contact_stribeck_speed: 7.0, ..Params::null() };
        let some = EffectSet::of(&p, &TIMING);
        assert!(some.has(EffectId::of("K1_stiffness")) && !some.has(EffectId::of("K5_stribeck")));
        let more = some.or(EffectSet::switched_by("contact_stribeck"));
        let ids: Vec<_> = more.iter().map(|effect| effect.id).collect();
        assert_eq!(ids, ["K1_stiffness", "K5_stribeck"]);
        assert_eq!(EffectSet::switched_by("contact_stribeck_speed").iter().count(), 0);
    }
}
