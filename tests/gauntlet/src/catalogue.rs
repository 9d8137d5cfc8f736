//! Rigs, their effects, and requests for hidden effects.

use crate::error::Error;
use crate::{body, command, contact, drive, facility, robot, sensor};

/// Simulated test rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rig {
    /// One geared joint under gravity with its sampled position controller.
    Drive {
        /// Whether the link has an encoder of its own.
        link_encoder: bool,
    },
    /// Three coupled axes of a robot, effects in its shoulder.
    Robot,
    /// A body pushed, slid and bounced against a plate.
    Contact,
    /// A six-axis force/torque sensor under known loads.
    Sensor,
    /// Commands as sent and as received.
    Command,
    /// A free body under known wrenches.
    Body,
    /// Whole loop: simulated bodies, robots with real parts, and the sensor between them.
    Facility,
}

/// Direction in which an effect grows with its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stronger {
    /// The effect grows with its size and vanishes at 0.
    Larger,
    /// The size is a limit or a frequency: the effect vanishes at infinity.
    Smaller,
}

/// Effect that a rig can hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectCase {
    /// Catalogue id (`C1_transport_delay`), or the name of a form outside the catalogue.
    pub id: &'static str,
    /// The parameter that a size sets.
    pub parameter: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// A plausible size, in that unit.
    pub size: f64,
    /// Smallest size of the rig, in that unit: below it a spring or a filter is too fast for the integration step.
    pub smallest: f64,
    /// Largest size of the rig, in that unit.
    pub largest: f64,
    /// Direction in which the effect grows.
    pub stronger: Stronger,
    /// The law, in a few words.
    pub law: &'static str,
}

impl EffectCase {
    /// An effect that grows with its size; twenty times a plausible size is still shown.
    pub(crate) const fn growing(
        id: &'static str,
        (parameter, size, unit): (&'static str, f64, &'static str),
        law: &'static str,
    ) -> Self {
        Self { id, parameter, unit, size, smallest: 0.0, largest: 20.0 * size, stronger: Stronger::Larger, law }
    }

    /// An effect that fades as its size grows.
    pub(crate) const fn limit(
        id: &'static str,
        (parameter, size, unit): (&'static str, f64, &'static str),
        law: &'static str,
    ) -> Self {
        Self { id, parameter, unit, size, smallest: 0.0, largest: f64::MAX, stronger: Stronger::Smaller, law }
    }

    /// The same with a smallest size.
    pub(crate) const fn from(mut self, smallest: f64) -> Self {
        self.smallest = smallest;
        self
    }

    /// The same with another largest size.
    pub(crate) const fn up_to(mut self, largest: f64) -> Self {
        self.largest = largest;
        self
    }
}

/// Returns the effects of the catalogue that a rig can hide.
pub fn effects(rig: Rig) -> &'static [EffectCase] {
    match rig {
        Rig::Drive { .. } => drive::EFFECTS,
        Rig::Robot => robot::EFFECTS,
        Rig::Contact => contact::EFFECTS,
        Rig::Sensor => sensor::EFFECTS,
        Rig::Command => command::EFFECTS,
        Rig::Body => body::EFFECTS,
        Rig::Facility => facility::EFFECTS,
    }
}

/// Returns the forms outside the catalogue that a rig can hide; no name of the library is right for them.
pub fn outside(rig: Rig) -> &'static [EffectCase] {
    match rig {
        Rig::Drive { .. } => drive::OUTSIDE,
        Rig::Robot => robot::OUTSIDE,
        Rig::Contact => contact::OUTSIDE,
        Rig::Sensor => sensor::OUTSIDE,
        Rig::Command => command::OUTSIDE,
        Rig::Body => body::OUTSIDE,
        Rig::Facility => facility::OUTSIDE,
    }
}

/// Effect to hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// Id of an [`EffectCase`].
    pub id: &'static str,
    /// Value of its parameter, in its unit.
    pub size: f64,
}

/// Named value with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
}

impl Parameter {
    pub(crate) const fn new(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value, unit }
    }
}

/// The hidden effects, checked against their rig.
#[derive(Clone)]
pub(crate) struct Sizes(Vec<(EffectCase, f64)>);

impl Sizes {
    /// # Errors
    /// An id that the rig does not have, an id named twice, a size that is no positive number or out of the case's range.
    pub(crate) fn check(rig: Rig, hidden: &[Hidden]) -> Result<Self, Error> {
        let all: Vec<EffectCase> = effects(rig).iter().chain(outside(rig)).copied().collect();
        let mut sizes: Vec<(EffectCase, f64)> = Vec::new();
        for &Hidden { id, size } in hidden {
            let Some(case) = all.iter().find(|case| case.id == id) else {
                let known = all.iter().map(|case| case.id).collect();
                return Err(Error::UnknownEffect { id: id.into(), known });
            };
            if sizes.iter().any(|(case, _)| case.id == id) {
                return Err(Error::Repeated { id });
            }
            if !(size > 0.0 && size >= case.smallest && size <= case.largest) {
                return Err(Error::Size { size, case: *case });
            }
            sizes.push((*case, size));
        }
        Ok(Self(sizes))
    }

    /// Nothing hidden.
    pub(crate) fn none() -> Self {
        Self(Vec::new())
    }

    /// Size of an effect; 0 where it is not hidden.
    pub(crate) fn of(&self, id: &str) -> f64 {
        self.0.iter().find(|(case, _)| case.id == id).map_or(0.0, |(_, size)| *size)
    }

    /// Size of an effect that a large number removes; infinity where it is not hidden.
    pub(crate) fn limit(&self, id: &str) -> f64 {
        self.0.iter().find(|(case, _)| case.id == id).map_or(f64::INFINITY, |(_, size)| *size)
    }

    /// What is hidden.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &(EffectCase, f64)> {
        self.0.iter()
    }
}
