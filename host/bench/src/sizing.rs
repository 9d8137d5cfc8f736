//! Sizes of a case: hidden effects in multiples of their detection limits, and the perturbations of its machine.

use crate::Result;
use crate::oracle::{DetectionLimit, Oracle, multiplied};
use crate::plan::{Case, MachineKind, seed};
use crate::plant::{GauntletPlant, hides_others, is_random};
use crate::record::{Ledger, ScaleLine, scales};
use softdock_gauntlet::{EffectCase, Hidden, NoiseColour, Perturbation, Stronger, perturbations};

/// Hidden effects of a case with their sizes, and the perturbations of its machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hiding {
    /// Detection limit of each hidden effect.
    pub(crate) scales: Vec<Option<DetectionLimit>>,
    /// `None` if the sizes are beyond the range of the generator.
    pub(crate) hidden: Option<Vec<Hidden>>,
    /// Perturbations; empty for an exact machine.
    pub(crate) perturbations: Vec<Hidden>,
}

impl Hiding {
    /// Returns hidden effects and perturbations; `None` if the sizes are beyond the range of the generator.
    pub(crate) fn all(&self) -> Option<Vec<Hidden>> {
        let hidden = self.hidden.as_ref()?;
        Some(hidden.iter().chain(&self.perturbations).copied().collect())
    }
}

/// Oracles of the last seed, and the detection limits of all workers.
#[derive(Default)]
pub(crate) struct Oracles<'a> {
    ledger: Option<&'a Ledger>,
    limits: Vec<ScaleLine>,
    asked: Vec<Asked>,
}

/// Recordings without the hidden effect, in which its detection limit is determined.
struct Setting<'a> {
    plant: &'static GauntletPlant,
    noise: NoiseColour,
    seed: u64,
    perturbations: &'a [Hidden],
    /// Other hidden effects that act as noise.
    masks: &'a [Hidden],
}

/// Detection limit of an effect on the recordings of a seed.
struct Asked {
    seed: u64,
    effect: &'static EffectCase,
    /// Perturbations, and other hidden effects that act as noise.
    beside: Vec<Hidden>,
    oracle: Oracle,
    scale: Option<DetectionLimit>,
}

impl Asked {
    fn of(setting: &Setting<'_>, effect: &'static EffectCase) -> Result<Self> {
        let beside = setting.beside();
        let oracle = Oracle::of(setting.plant, effect, &beside, setting.noise, setting.seed)?;
        let scale = oracle.scale()?;
        Ok(Self { seed: setting.seed, effect, beside, oracle, scale })
    }
}

impl Setting<'_> {
    fn beside(&self) -> Vec<Hidden> {
        self.perturbations.iter().chain(self.masks).copied().collect()
    }

    /// Returns the line of a detection limit.
    fn line(&self, Asked { effect, oracle, scale, .. }: &Asked) -> ScaleLine {
        ScaleLine {
            plant: self.plant.name.to_owned(),
            effect: effect.id.to_owned(),
            seed: self.seed,
            perturbations: self.perturbations.iter().map(|own| own.id.to_owned()).collect(),
            scale: scale.clone(),
            tolerance: oracle.tolerance(),
        }
    }

    /// Returns whether a line has the detection limit of an effect in these recordings.
    fn is_of(&self, effect: &EffectCase, line: &ScaleLine) -> bool {
        let perturbations = self.perturbations.iter().map(|own| own.id);
        (line.plant.as_str(), line.effect.as_str(), line.seed) == (self.plant.name, effect.id, self.seed)
            && perturbations.eq(line.perturbations.iter().map(String::as_str))
    }
}

impl<'a> Oracles<'a> {
    /// Builds the oracles that record their limits in a ledger.
    ///
    /// # Errors
    /// A ledger that cannot be read.
    pub(crate) fn of(ledger: &'a Ledger) -> Result<Self> {
        Ok(Self { ledger: Some(ledger), limits: scales(ledger.folder())?, asked: Vec::new() })
    }

    /// Returns the sizes of a case's effects and the perturbations of its machine. Masking effects come first, noise
    /// before all, because they act as noise on the others.
    pub(crate) fn sized(&mut self, case: &Case) -> Result<Hiding> {
        let perturbations = self.perturbations(case)?;
        let mut order: Vec<(usize, &'static EffectCase)> = case.hidden().into_iter().enumerate().collect();
        order.sort_by_key(|(_, effect)| (!is_random(effect.id), !hides_others(effect.id)));
        let (mut masks, mut sized) = (Vec::new(), Vec::new());
        for (place, effect) in order {
            let (plant, noise, seed) = (case.plant, case.noise, case.seed());
            let setting = Setting { plant, noise, seed, perturbations: &perturbations, masks: &masks };
            let floor = self.floor(&setting, effect)?;
            let (scale, size) = self.size(&setting, effect, floor.as_ref(), case.multiple)?;
            let hidden = size.map(|size| Hidden { id: effect.id, size });
            masks.extend(hidden.filter(|_| hides_others(effect.id)));
            sized.push((place, scale, hidden));
        }
        sized.sort_by_key(|(place, ..)| *place);
        let (scales, hidden): (_, Vec<_>) = sized.into_iter().map(|(_, scale, hidden)| (scale, hidden)).unzip();
        Ok(Hiding { scales, hidden: hidden.into_iter().collect(), perturbations })
    }

    /// Returns the perturbations of a case's machine. Those of its hidden effects are excluded.
    fn perturbations(&mut self, case: &Case) -> Result<Vec<Hidden>> {
        if case.machine == MachineKind::Exact {
            return Ok(Vec::new());
        }
        let excluded: Vec<&str> = case.hidden().iter().map(|effect| effect.id).collect();
        let drawn = perturbations(case.plant.rig, case.seed(), &excluded);
        drawn.iter().map(|own| self.perturbation(case.plant, own)).collect()
    }

    /// Returns the detection limit of an effect in an exact machine, in one set of recordings a plant.
    fn reference(&mut self, plant: &'static GauntletPlant, effect: &'static EffectCase) -> Result<ScaleLine> {
        let seed = seed(&format!("{} perturbations", plant.name));
        let setting = Setting { plant, noise: NoiseColour::FirstOrder, seed, perturbations: &[], masks: &[] };
        self.limit(&setting, effect)
    }

    /// Returns the least detection limit in a perturbed machine, which is that in an exact one: perturbations that exhaust
    /// the tolerances make a further effect evident, but not identifiable.
    fn floor(&mut self, setting: &Setting<'_>, effect: &'static EffectCase) -> Result<Option<DetectionLimit>> {
        if setting.perturbations.is_empty() {
            return Ok(None);
        }
        Ok(self.reference(setting.plant, effect)?.scale)
    }

    /// Returns a perturbation with its size: its share of the detection limit in an exact machine, or of the tolerance
    /// of the model where that is less.
    fn perturbation(&mut self, plant: &'static GauntletPlant, own: &Perturbation) -> Result<Hidden> {
        let Perturbation { effect, share } = *own;
        let ScaleLine { scale, tolerance, .. } = self.reference(plant, effect)?;
        // What no size makes detectable is small at a plausible one.
        let limit = scale.map_or(effect.size, |scale| scale.size);
        let size = share * tolerance.map_or(limit, |tolerance| tolerance.min(limit));
        Ok(Hidden { id: effect.id, size: size.max(effect.smallest) })
    }

    /// Returns the detection limit of an effect, at least as large as `floor`, and the size at a multiple of it.
    fn size(
        &mut self,
        setting: &Setting<'_>,
        effect: &'static EffectCase,
        floor: Option<&DetectionLimit>,
        multiple: f64,
    ) -> Result<(Option<DetectionLimit>, Option<f64>)> {
        // For a limit, only the oracle determines the size at a multiple.
        if setting.masks.is_empty() && effect.stronger == Stronger::Larger {
            let scale = self.limit(setting, effect)?.scale.map(|scale| raised(effect, scale, floor));
            let size = scale.as_ref().and_then(|scale| multiplied(effect, scale, multiple));
            return Ok((scale, size));
        }
        let asked = self.asked(setting, effect)?;
        let scale = asked.scale.clone().map(|scale| raised(effect, scale, floor));
        let size = scale.as_ref().map_or(Ok(None), |scale| asked.oracle.multiple(scale, multiple))?;
        Ok((scale, size))
    }

    /// Returns the detection limit of an effect without masks, from the records of all workers if one has it.
    fn limit(&mut self, setting: &Setting<'_>, effect: &'static EffectCase) -> Result<ScaleLine> {
        if let Some(line) = self.limits.iter().find(|line| setting.is_of(effect, line)) {
            return Ok(line.clone());
        }
        let line = setting.line(self.asked(setting, effect)?);
        self.ledger.map_or(Ok(()), |ledger| ledger.scale(&line))?;
        self.limits.push(line.clone());
        Ok(line)
    }

    /// Returns the oracle of an effect.
    fn asked(&mut self, setting: &Setting<'_>, effect: &'static EffectCase) -> Result<&Asked> {
        self.asked.retain(|asked| asked.seed == setting.seed);
        let beside = setting.beside();
        let known = |asked: &Asked| asked.effect.id == effect.id && asked.beside == beside;
        let place = match self.asked.iter().position(known) {
            Some(place) => place,
            None => {
                self.asked.push(Asked::of(setting, effect)?);
                self.asked.len() - 1
            }
        };
        Ok(&self.asked[place])
    }
}

/// Returns a detection limit of at least as much effect as another.
fn raised(effect: &EffectCase, own: DetectionLimit, floor: Option<&DetectionLimit>) -> DetectionLimit {
    let Some(floor) = floor else { return own };
    let size = match effect.stronger {
        Stronger::Larger => own.size.max(floor.size),
        Stronger::Smaller => own.size.min(floor.size),
    };
    DetectionLimit { size, inseparable: own.inseparable.or_else(|| floor.inseparable.clone()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_gauntlet::effects;

    #[test]
    fn limit_in_a_perturbed_machine_is_never_of_less_effect_than_in_an_exact_one() {
        let plant = crate::plant::plant("drive").expect("a plant");
        let limit = |size| DetectionLimit { size, inseparable: None };
        for (id, sizes, expected) in [("C2_lag", [1.0, 2.0], 2.0), ("C7_rate_limit", [1.0, 2.0], 1.0)] {
            let effect = effects(plant.rig).iter().find(|own| own.id == id).expect("one of its effects");
            for [own, floor] in [sizes, [sizes[1], sizes[0]]] {
                assert_eq!(raised(effect, limit(own), Some(&limit(floor))).size, expected, "{id}");
            }
            assert_eq!(raised(effect, limit(3.0), None).size, 3.0, "an exact machine has no floor");
        }
    }
}
