//! Detection limit of an effect: the smallest size at which an oracle that knows the hidden effect reaches the required
//! evidence, lead and gain, on the same data with the same noise.
//!
//! The signature of an effect is the difference of the whitened residuals of two noiseless recordings, of the same
//! motion if the effect acts on the readings alone. Half its square after the projection of the nuisance parameters is
//! the expected log-odds (the Asimov data set of Cowan et al. 2011). This needs no library, so that forms outside it
//! have a limit, too. Rivals are taken at the forms of the bank, and confounded ones at their best size. A fit may
//! bring them slightly closer, so the limit is rather strict for a diagnosis. Zero-mean effects change no noiseless
//! recording: their limit follows from the differences of repeats, without rivals and gain.

mod healthy;

use crate::plant::{From, GauntletPlant, hides_others, is_random};
use crate::recordings_folder::{RecordingsFolder, read};
use crate::{GauntletError, Result};
use healthy::Healthy;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_diagnosis::inference::adequacy::gain_interval;
use softdock_diagnosis::inference::bank::{Bank, SignatureEntry};
use softdock_diagnosis::inference::fit::Fitted;
use softdock_diagnosis::model::block::MeasuredBlock;
use softdock_diagnosis::model::hypothesis::Hypothesis;
use softdock_diagnosis::threshold;
use softdock_gauntlet::{EffectCase, Hidden, NoiseColour, Set, Stronger, generate, unmoved};
use std::cell::RefCell;

/// Log-odds of the oracle beyond the detection threshold.
const BEYOND: f64 = 3.0;
/// Lead of the oracle's hypothesis over the nearest rival, in log-odds.
const LEAD: f64 = 6.0;
/// Gain on held-out motion that the oracle's whole interval must exceed.
const GAIN: f64 = 0.01;
/// z-score at which nuisance parameters are clamped.
const CLAMP: f64 = 3.0;
/// Factor between two sizes of the first search, and ratio at which it ends.
const STRIDE: f64 = 2.0;
const CLOSE: f64 = 1.08;
/// The same where the size is a limit, whose effect sets in all at once.
const CLOSE_LIMIT: f64 = 1.01;
/// Iterations of a rival's best size.
const IMITATIONS: usize = 2;
/// Largest number of sizes in the first search. An effect that is detectable at all of them gets the least.
const MOST: usize = 14;

/// Detection limit of an effect, with its nearest rival if inseparable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectionLimit {
    /// Smallest detectable size, in the effect's unit.
    pub size: f64,
    /// Rival that is confounded at every size: then an ambiguous answer that lists the truth is right.
    pub inseparable: Option<String>,
}

/// Expected evidence of an effect of a size.
#[derive(Clone, Debug, PartialEq)]
struct Expected {
    size: f64,
    /// Root of the chi-squared that no nuisance explains.
    strength: f64,
    /// Log-odds against the clamped null hypothesis, beyond the threshold.
    beyond: f64,
    /// Lead over the nearest rival, and its name.
    lead: f64,
    rival: String,
    /// Lower bound of the held-out gain.
    gain: f64,
}

impl Expected {
    fn is_present(&self) -> bool {
        self.beyond >= BEYOND && self.gain > GAIN
    }

    fn is_detectable(&self) -> bool {
        self.is_present() && self.lead >= LEAD
    }
}

/// Oracle of an effect on the data of a seed.
pub struct Oracle {
    plant: &'static GauntletPlant,
    case: &'static EffectCase,
    /// Other hidden effects, those of them that change noiseless recordings, and the noise.
    beside: Vec<Hidden>,
    lasting: Vec<Hidden>,
    noise: NoiseColour,
    seed: u64,
    healthy: Healthy,
    library: Vec<Hypothesis>,
    bank: Bank,
    /// Detection threshold in log-odds.
    threshold: f64,
    /// Root of the residual sum of squares of the noiseless recordings without a hidden effect.
    own_misfit: f64,
    asked: RefCell<Vec<Expected>>,
}

impl Oracle {
    /// Builds the oracle of an effect, on recordings with other effects: those that act as noise, and the perturbations
    /// of the machine. The misfit by these is no evidence of the effect and raises its limit.
    ///
    /// # Errors
    /// Recordings that cannot be made or used.
    pub fn of(
        plant: &'static GauntletPlant,
        case: &'static EffectCase,
        beside: &[Hidden],
        noise: NoiseColour,
        seed: u64,
    ) -> Result<Self> {
        let (block, library) = block(plant, case.id, &generate(plant.rig, beside, noise, seed)?)?;
        let lasting: Vec<Hidden> = beside.iter().filter(|own| !hides_others(own.id)).copied().collect();
        let (still, _) = self::block(plant, case.id, &unmoved(plant.rig, &lasting, seed)?)?;
        let beside = beside.to_vec();
        let healthy = Healthy::of(&block, still)?;
        let bank = healthy.bank(&library);
        let threshold = threshold(&bank, &bank.gram(&healthy.null), library.len());
        let own_misfit = healthy.unexplained(&healthy.null.residual).sqrt();
        let asked = RefCell::default();
        Ok(Self { plant, case, beside, lasting, noise, seed, healthy, library, bank, threshold, own_misfit, asked })
    }

    /// Returns the detection limit; `None` if no size in the range of the generator is detectable.
    ///
    /// # Errors
    /// As [`Oracle::of`].
    pub fn scale(&self) -> Result<Option<DetectionLimit>> {
        let detectable = self.smallest(Expected::is_detectable)?;
        if let Some(size) = detectable {
            return Ok(Some(DetectionLimit { size, inseparable: None }));
        }
        let Some(size) = self.smallest(Expected::is_present)? else {
            return Ok(None);
        };
        Ok(Some(DetectionLimit { size, inseparable: Some(self.expected(size)?.rival) }))
    }

    /// Returns the size with `multiple` times the effect of the detection limit: the size times `multiple`, or, for a
    /// limit, the size whose signature after the projection is `multiple` times as large.
    ///
    /// # Errors
    /// As [`Oracle::of`].
    pub fn multiple(&self, scale: &DetectionLimit, multiple: f64) -> Result<Option<f64>> {
        if self.case.stronger == Stronger::Larger {
            return Ok(multiplied(self.case, scale, multiple));
        }
        if multiple == 1.0 {
            return Ok(Some(scale.size));
        }
        let strength = multiple * self.expected(scale.size)?.strength;
        self.smallest(|expected| expected.strength >= strength)
    }

    /// Returns the tolerance of the model on what the effect changes, in the effect's unit: the smallest of its
    /// parameters; `None` if the model has none.
    pub fn tolerance(&self) -> Option<f64> {
        let unknowns = &self.healthy.null.unknowns;
        let fields = self.plant.aliases(self.case.id).flat_map(|own| own.fields.iter().map(|name| (own.from, name)));
        let of = fields.filter_map(|(from, name)| {
            let own = unknowns.iter().find(|unknown| unknown.name == *name)?;
            let one = (own.prior.value(1.0) - own.prior.value(0.0)).abs();
            let nominal = own.prior.value(0.0).abs();
            Some(if matches!(from, From::Scaled(_)) { one / nominal } else { one })
        });
        of.min_by(f64::total_cmp)
    }

    /// The size of least effect at which something holds that holds for all sizes of more effect.
    fn smallest(&self, holds: impl Fn(&Expected) -> bool) -> Result<Option<f64>> {
        let more = |size: f64, factor: f64| match self.case.stronger {
            Stronger::Larger => size * factor,
            Stronger::Smaller => size / factor,
        };
        let mut enough = self.case.size;
        for _ in 0..MOST {
            if holds(&self.expected(enough)?) {
                break;
            }
            match within(self.case, more(enough, STRIDE)) {
                Some(size) => enough = size,
                None => return Ok(None),
            }
        }
        if !holds(&self.expected(enough)?) {
            return Ok(None);
        }
        let mut few = enough;
        for _ in 0..MOST {
            let Some(size) = within(self.case, more(few, 1.0 / STRIDE)) else { return Ok(Some(few)) };
            few = size;
            if !holds(&self.expected(few)?) {
                break;
            }
            enough = few;
        }
        let close = if self.case.stronger == Stronger::Larger { CLOSE } else { CLOSE_LIMIT };
        while (few / enough).max(enough / few) > close {
            let middle = (few * enough).sqrt();
            if holds(&self.expected(middle)?) { enough = middle } else { few = middle }
        }
        Ok(Some(enough))
    }

    /// Returns the expected evidence of a size, cached.
    fn expected(&self, size: f64) -> Result<Expected> {
        if let Some(known) = self.asked.borrow().iter().find(|known| known.size == size) {
            return Ok(known.clone());
        }
        let hidden = Hidden { id: self.case.id, size };
        let expected = match is_random(self.case.id) {
            true => self.repeated(hidden)?,
            false => {
                let all: Vec<Hidden> = self.lasting.iter().copied().chain([hidden]).collect();
                let (moved, _) = block(self.plant, self.case.id, &unmoved(self.plant.rig, &all, self.seed)?)?;
                let [learn, test] = self.healthy.changed(moved, CLAMP);
                self.judged(size, &learn, &test)
            }
        };
        self.asked.borrow_mut().push(expected.clone());
        Ok(expected)
    }

    /// Returns the expected evidence of a zero-mean effect, from the differences of repeats.
    fn repeated(&self, hidden: Hidden) -> Result<Expected> {
        let (id, size) = (hidden.id, hidden.size);
        let all: Vec<Hidden> = self.beside.iter().copied().chain([hidden]).collect();
        let recordings = RecordingsFolder::of(&generate(self.plant.rig, &all, self.noise, self.seed)?)?;
        let odds = read(recordings.path(), &[], &DiagnosisOptions::default())?.odds_by_repeats(id).unwrap_or(0.0);
        let (strength, rival) = ((2.0 * odds.max(0.0)).sqrt(), String::new());
        Ok(Expected { size, strength, beyond: odds - self.threshold, lead: f64::INFINITY, rival, gain: f64::INFINITY })
    }

    /// Returns the expected evidence from the signature of an effect.
    fn judged(&self, size: f64, learn: &DVector<f64>, test: &DVector<f64>) -> Expected {
        let z = self.healthy.placed(learn, CLAMP);
        let left_clamped = self.evident(learn, &z);
        let left = self.evident(learn, &self.healthy.placed(learn, f64::INFINITY));
        // A size is plausible up to about the generator's own; a limit has no scale.
        let z_of_size = if self.case.stronger == Stronger::Larger { size / self.case.size } else { 1.0 };
        let occam = 0.5 * (1.0 + left / (z_of_size * z_of_size)).ln() + 0.5 * z_of_size.min(CLAMP).powi(2);
        let (lead, rival) = self.nearest(learn, left, 0.5 * left - occam);
        let gain = self.gain(test, &z).min(self.gain(test, &DVector::zeros(z.len())));
        Expected { size, strength: left.sqrt(), beyond: 0.5 * left_clamped - occam - self.threshold, lead, rival, gain }
    }

    /// Returns the lower bound of the gain on held-out motion against a model with nuisance parameters moved by the
    /// effect, and without that movement.
    fn gain(&self, test: &DVector<f64>, z: &DVector<f64>) -> f64 {
        let Healthy { held_out, held_out_jacobian, .. } = &self.healthy;
        let without = held_out + test + held_out_jacobian * z;
        gain_interval([held_out.as_slice(), without.as_slice()], [0.0; 2])[0]
    }

    /// Returns the chi-squared of a change after the projection of the nuisance parameters and their prior penalty. The
    /// misfit without a hidden effect is no evidence.
    fn evident(&self, change: &DVector<f64>, z: &DVector<f64>) -> f64 {
        let left = (change + &self.healthy.null.jacobian * z).norm();
        ((left - 2.0_f64.sqrt() * self.own_misfit).max(0.0).powi(2) + self.healthy.prior_penalty(z)).max(0.0)
    }

    /// Returns the lead of the oracle's log-odds over the best rival, nuisance parameters beyond their priors included.
    fn nearest(&self, change: &DVector<f64>, left: f64, own: f64) -> (f64, String) {
        // Others share in what is evident as they do in all.
        let share = (left / self.healthy.unexplained(change).max(f64::MIN_POSITIVE)).sqrt();
        let moved = Fitted { residual: change * share.min(1.0), ..self.healthy.null.clone() };
        let odds = self.bank.log_odds(&self.bank.scores(&moved), self.library.len());
        let rivals = self.library.iter().zip(odds).enumerate();
        let rivals = rivals.filter(|(_, (hypothesis, _))| !self.plant.is_right(self.case.id, hypothesis.effect.id));
        let named = rivals.map(|(number, (hypothesis, odds))| {
            (odds.max(self.imitated(number, &moved).unwrap_or(0.0)), hypothesis.effect.id)
        });
        let (odds, rival) = named.fold((0.0, "nuisances"), |best, other| if other.0 > best.0 { other } else { best });
        (own - odds, rival.to_owned())
    }

    /// Returns the log-odds of a confounded rival at its best size (a lag and a delay are the more confounded the
    /// shorter they are); `None` if it is not confounded.
    fn imitated(&self, rival: usize, moved: &Fitted) -> Option<f64> {
        // Measured less simulated: what moves the one as a rival moves the other.
        let moved_by = -&moved.residual;
        let mut own = self.library[rival].clone();
        own.forms = vec![resized(&own, self.bank.imitation(rival, &moved_by)?)];
        for _ in 0..IMITATIONS {
            own.forms = vec![resized(&own, self.healthy.bank(std::slice::from_ref(&own)).imitation(0, &moved_by)?)];
        }
        let bank = self.healthy.bank(&[own]);
        Some(bank.log_odds(&bank.scores(moved), 1)[0])
    }
}

/// The form of an entry with its sizes so many times as large.
fn resized(hypothesis: &Hypothesis, (entry, multiples): (&SignatureEntry, Vec<f64>)) -> Vec<f64> {
    let mut form = entry.form.clone();
    hypothesis.sizes.iter().zip(multiples).for_each(|(size, multiple)| form[*size] *= multiple);
    form
}

/// Returns the multiple of the detection limit of an effect that grows with its size; `None` beyond the range of the
/// generator.
pub fn multiplied(case: &EffectCase, scale: &DetectionLimit, multiple: f64) -> Option<f64> {
    within(case, scale.size * multiple)
}

/// Returns a size, if it is within the range of the generator.
fn within(case: &EffectCase, size: f64) -> Option<f64> {
    (size >= case.smallest && size <= case.largest).then_some(size)
}

/// The block of a data set where something hidden acts.
fn block(plant: &GauntletPlant, hidden: &str, set: &Set) -> Result<(MeasuredBlock, Vec<Hypothesis>)> {
    let recordings = RecordingsFolder::of(set)?;
    let blocks = read(recordings.path(), &[], &DiagnosisOptions::default())?.blocks(1);
    let name = plant.block(hidden);
    let own = blocks.into_iter().find(|(block, _)| block.name == name);
    own.ok_or_else(|| GauntletError::Model(format!("no block {name} of {hidden}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_gauntlet::effects;
    use softdock_test_size::first;

    /// By how many tolerances a nuisance is off with an effect of the smallest size, and how many of these a data set drew.
    fn off(id: &str, nuisance: &str, tolerance: f64, seed: u64) -> [f64; 2] {
        let plant = crate::plant::plant("contact").expect("a plant");
        let case = effects(plant.rig).iter().find(|case| case.id == id).expect("one of its effects");
        let oracle = Oracle::of(plant, case, &[], NoiseColour::FirstOrder, seed).expect("recordings of use");
        let size = oracle.scale().expect("recordings of use").expect("a size that shows").size;
        let null = &oracle.healthy.null;
        let place = null.unknowns.iter().position(|own| own.name == nuisance).expect("one of its nuisances");
        [null.z[place] + size / tolerance, null.z[place]]
    }

    #[test]
    fn detection_limit_of_a_delay_exceeds_its_confusion_with_a_lag() {
        let plant = crate::plant::plant("drive").expect("a plant");
        let size = |id: &str| {
            let case = effects(plant.rig).iter().find(|case| case.id == id).expect("one of its effects");
            let oracle = Oracle::of(plant, case, &[], NoiseColour::FirstOrder, 3).expect("recordings of use");
            let scale = oracle.scale().expect("recordings of use").expect("a size that shows");
            (scale.size, oracle.expected(scale.size).expect("recordings of use").rival)
        };
        for (id, other) in first(1, [("C1_transport_delay", "C2_lag"), ("C2_lag", "C1_transport_delay")]) {
            let (size, rival) = size(id);
            // They differ by half the square of a phase: at a few hertz by a thousandth for a lag of a millisecond.
            assert!((5e-4..4e-3).contains(&size) && rival == other, "{id}: {size} s, {rival}");
        }
    }

    #[test]
    fn effect_equal_to_a_nuisance_is_detectable_only_beyond_its_tolerance() {
        // Three tolerances are plausible, six are not. The drawn values count.
        let cases = [("K7_surface_offset", "surface", 5e-6), ("K1_stiffness", "stiffness", 2e3)];
        for (id, nuisance, tolerance) in first(1, cases) {
            let all = [5, 6].map(|seed| off(id, nuisance, tolerance, seed));
            assert!(all.iter().all(|[whole, _]| (3.0..6.0).contains(whole)), "{id}: {all:?}");
            assert!((all[0][1] - all[1][1]).abs() > 0.5, "{id}: seeds that draw otherwise: {all:?}");
        }
    }
}
