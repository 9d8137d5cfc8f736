//! How large an effect must be before anybody could tell it: the smallest size at which one who knows what is hidden
//! reaches the evidence, the lead and the gain that an answer needs, on the same data with the same noise.
//!
//! What an effect changes in the whitened residuals is the difference of two recordings without noise. Behind what the
//! nuisances explain of it, half its square is the log-odds to expect (Cowan et al. 2011 call such data the Asimov data
//! set). Nothing of this needs the effect to be in a library, so that forms outside have a size too.

use crate::exhibit::{Exhibit, read};
use crate::plant::{Plant, is_random};
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use softdock_diagnosis::block::MeasuredBlock;
use softdock_diagnosis::diagnosis::Options;
use softdock_diagnosis::inference::adequacy::adequacy;
use softdock_diagnosis::inference::bank::{Bank, Projector};
use softdock_diagnosis::inference::fit::{Fitted, Start, fit};
use softdock_diagnosis::inference::noise::Noise;
use softdock_diagnosis::inference::unknown::applied;
use softdock_diagnosis::library::Hypothesis;
use softdock_gauntlet::{EffectCase, Hidden, NoiseColour, Stronger, exact, generate};
use std::cell::RefCell;

/// Log-odds from which on an effect counts as present; the threshold of the data may be higher by what chance finds.
const THRESHOLD: f64 = 5.0;
/// How far beyond the threshold the oracle's log-odds must be.
const BEYOND: f64 = 3.0;
/// By how much the oracle's hypothesis must lead the nearest rival.
const LEAD: f64 = 6.0;
/// Gain on held-out motion that the oracle's whole interval must exceed.
const GAIN: f64 = 0.01;
/// Tolerances beyond which no nuisance may explain an effect away.
const CLAMP: f64 = 3.0;
/// Step of difference quotients, in standard deviations.
const STEP: f64 = 2e-3;
/// Factor between two sizes of the first search, and ratio at which it ends.
const STRIDE: f64 = 2.0;
const CLOSE: f64 = 1.08;
/// The same where the size is a limit, whose effect sets in all at once.
const CLOSE_LIMIT: f64 = 1.01;
/// Sizes of the first search, at most.
const MOST: usize = 14;

/// The smallest size that can be told, and what it rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// That size, in the effect's unit.
    pub size: f64,
    /// The rival that stays too near at every size: then an ambiguous answer that lists the truth is right.
    pub inseparable: Option<String>,
    /// Whether it is a plausible size instead: an effect without a mean changes nothing that an oracle could compare.
    pub nominal: bool,
}

/// What is to be expected of an effect of some size.
#[derive(Clone, Debug, PartialEq)]
struct Expected {
    size: f64,
    /// Root of the chi-squared that no nuisance explains.
    strength: f64,
    /// Log-odds against the clamped null hypothesis.
    log_odds: f64,
    /// Lead over the nearest rival, and its name.
    lead: f64,
    rival: String,
    /// Lower bound of the held-out gain.
    gain: f64,
}

impl Expected {
    fn is_present(&self) -> bool {
        self.log_odds >= THRESHOLD + BEYOND && self.gain > GAIN
    }

    fn is_told(&self) -> bool {
        self.is_present() && self.lead >= LEAD
    }
}

/// An oracle for one effect on the data of one seed.
pub struct Oracle {
    plant: &'static Plant,
    case: &'static EffectCase,
    seed: u64,
    block: MeasuredBlock,
    library: Vec<Hypothesis>,
    noise: Noise,
    /// The null hypothesis on the recordings with nothing hidden, and its parameters.
    null: Fitted,
    values: Vec<f64>,
    bank: Bank,
    /// Whitened held-out residuals under it, and their derivatives by its nuisances.
    held_out: DVector<f64>,
    held_out_jacobian: DMatrix<f64>,
    /// Whitened residuals without noise where nothing is hidden: to learn from, held out.
    unmoved: [DVector<f64>; 2],
    asked: RefCell<Vec<Expected>>,
}

impl Oracle {
    /// Sets an oracle up for an effect.
    ///
    /// # Errors
    /// Recordings that cannot be made or used.
    pub fn of(plant: &'static Plant, case: &'static EffectCase, noise: NoiseColour, seed: u64) -> Result<Self> {
        let (block, library) = block(plant, case.id, &generate(plant.rig, &[], noise, seed)?)?;
        let (learn, test) = (block.part(false), block.part(true));
        let mut deviations = learn.deviations(&block.base);
        deviations.extend(test.deviations(&block.base));
        let noise = Noise::fit(&deviations).ok_or_else(|| Error::Model(format!("{} has no noise", block.name)))?;
        let unknowns = block.nuisances.clone();
        let start = Start { hypothesis: 0, z: vec![0.0; unknowns.len()], unknowns };
        let shortcut = learn.shortcut(&noise, &block.base);
        let quick = |sets: &[Vec<f64>]| shortcut.whitened(sets);
        let null = fit(vec![start], &block.base, &quick).remove(0);
        let bank = Bank::simulate(&library, &null, &block.base, &quick);
        let values = null.values(&block.base);
        let moved = |column: usize| {
            let mut z = null.z.clone();
            z[column] += STEP;
            applied(&block.base, &null.unknowns, &z)
        };
        let sets: Vec<Vec<f64>> = std::iter::once(values.clone()).chain((0..null.z.len()).map(moved)).collect();
        let mut residuals = test.whitened(&noise, &sets);
        let held_out = residuals.remove(0);
        let columns: Vec<DVector<f64>> = residuals.into_iter().map(|with| (with - &held_out) / STEP).collect();
        let held_out_jacobian =
            if columns.is_empty() { DMatrix::zeros(held_out.len(), 0) } else { DMatrix::from_columns(&columns) };
        let unmoved = [DVector::zeros(0), DVector::zeros(0)];
        drop((learn, test));
        let asked = RefCell::default();
        let mut oracle = Self {
            plant,
            case,
            seed,
            block,
            library,
            noise,
            null,
            values,
            bank,
            held_out,
            held_out_jacobian,
            unmoved,
            asked,
        };
        oracle.unmoved = oracle.residuals(&[])?;
        Ok(oracle)
    }

    /// Whitened residuals without noise, at the null hypothesis: to learn from, held out.
    fn residuals(&self, hidden: &[Hidden]) -> Result<[DVector<f64>; 2]> {
        let (mut block, _) = block(self.plant, self.case.id, &exact(self.plant.rig, hidden, self.seed)?)?;
        // Judged at the samples that the noise of the recordings allows.
        block.decimator = self.block.decimator.clone();
        let of = |held_out| block.part(held_out).whitened(&self.noise, std::slice::from_ref(&self.values)).remove(0);
        Ok([of(false), of(true)])
    }

    /// The smallest size that can be told; none where no size of the bench's range can.
    ///
    /// # Errors
    /// As [`Oracle::of`].
    pub fn scale(&self) -> Result<Option<Scale>> {
        let told = self.smallest(Expected::is_told)?;
        if let Some(size) = told {
            return Ok(Some(Scale { size, inseparable: None, nominal: false }));
        }
        let Some(size) = self.smallest(Expected::is_present)? else {
            return Ok(None);
        };
        Ok(Some(Scale { size, inseparable: Some(self.expected(size)?.rival), nominal: false }))
    }

    /// The size whose effect is so many times that of another size: the size itself so many times, unless it is a limit,
    /// which has no multiples; then the size at which so many times as much is left behind the nuisances.
    ///
    /// # Errors
    /// As [`Oracle::of`].
    pub fn multiple(&self, scale: &Scale, multiple: f64) -> Result<Option<f64>> {
        if self.case.stronger == Stronger::Larger || scale.nominal {
            return Ok(within(self.case, scale.size * multiple));
        }
        if multiple == 1.0 {
            return Ok(Some(scale.size));
        }
        let strength = multiple * self.expected(scale.size)?.strength;
        self.smallest(|expected| expected.strength >= strength)
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

    /// What is to be expected of a size; asked once.
    fn expected(&self, size: f64) -> Result<Expected> {
        if let Some(known) = self.asked.borrow().iter().find(|known| known.size == size) {
            return Ok(known.clone());
        }
        let [learn, test] = self.residuals(&[Hidden { id: self.case.id, size }])?;
        let expected = self.judged(size, &(learn - &self.unmoved[0]), &(test - &self.unmoved[1]));
        self.asked.borrow_mut().push(expected.clone());
        Ok(expected)
    }

    /// From what an effect changes in the whitened residuals to what is to be expected of it.
    fn judged(&self, size: f64, learn: &DVector<f64>, test: &DVector<f64>) -> Expected {
        let columns = DMatrix::from_columns(std::slice::from_ref(learn));
        let left = learn.dot(&Projector::of(&self.null).reject(&columns).column(0));
        let z = self.clamped(learn);
        let left_clamped = (learn + &self.null.jacobian * &z).norm_squared() + z.norm_squared();
        // A size is plausible up to about the bench's own; a limit has no scale.
        let z_of_size = if self.case.stronger == Stronger::Larger { size / self.case.size } else { 1.0 };
        let occam = 0.5 * (1.0 + left / (z_of_size * z_of_size)).ln() + 0.5 * z_of_size.min(CLAMP).powi(2);
        let (lead, rival) = self.nearest(learn, 0.5 * left - occam);
        let without = &self.held_out + test + &self.held_out_jacobian * &z;
        let held_out = self.held_out.as_slice();
        let gain = adequacy(held_out, held_out, without.as_slice()).gain_lo;
        Expected { size, strength: left.sqrt(), log_odds: 0.5 * left_clamped - occam, lead, rival, gain }
    }

    /// Where the nuisances go to explain a change of the residuals, none beyond what is plausible.
    fn clamped(&self, change: &DVector<f64>) -> DVector<f64> {
        let jacobian = &self.null.jacobian;
        let size = jacobian.ncols();
        let normal = jacobian.tr_mul(jacobian) + DMatrix::identity(size, size);
        let gradient = jacobian.tr_mul(change);
        let mut z = DVector::zeros(size);
        let mut held = vec![false; size];
        loop {
            let free: Vec<usize> = (0..size).filter(|i| !held[*i]).collect();
            if free.is_empty() {
                return z;
            }
            let own = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[(free[i], free[j])]);
            let pull = |i: usize| {
                let others: f64 = (0..size).filter(|j| held[*j]).map(|j| normal[(i, j)] * z[j]).sum();
                -gradient[i] - others
            };
            let right = DVector::from_iterator(free.len(), free.iter().map(|i| pull(*i)));
            let solved = own.cholesky().map_or_else(|| DVector::zeros(free.len()), |own| own.solve(&right));
            for (place, i) in free.iter().enumerate() {
                z[*i] = solved[place].clamp(-CLAMP, CLAMP);
                held[*i] |= solved[place].abs() > CLAMP;
            }
            if free.iter().all(|i| !held[*i]) {
                return z;
            }
        }
    }

    /// The lead of the oracle's log-odds over the best other explanation, nuisances beyond their tolerance being one.
    fn nearest(&self, change: &DVector<f64>, own: f64) -> (f64, String) {
        let moved = Fitted { residual: change.clone(), ..self.null.clone() };
        let odds = self.bank.log_odds(&self.bank.scores(&moved), self.library.len());
        let rivals = self.library.iter().zip(odds);
        let rivals = rivals.filter(|(hypothesis, _)| !self.plant.is_right(self.case.id, hypothesis.effect.id));
        let named = rivals.map(|(hypothesis, odds)| (odds, hypothesis.effect.id));
        let (odds, rival) = named.fold((0.0, "nuisances"), |best, other| if other.0 > best.0 { other } else { best });
        (own - odds, rival.to_owned())
    }
}

/// The scale of an effect that no difference of recordings shows: a plausible size.
pub fn nominal(case: &EffectCase) -> Option<Scale> {
    is_random(case.id).then(|| Scale { size: case.size, inseparable: None, nominal: true })
}

/// A size, if the bench can show it.
pub fn within(case: &EffectCase, size: f64) -> Option<f64> {
    (size >= case.smallest && size <= case.largest).then_some(size)
}

/// The block of a data set where something hidden acts.
fn block(plant: &Plant, hidden: &str, set: &softdock_gauntlet::Set) -> Result<(MeasuredBlock, Vec<Hypothesis>)> {
    let exhibit = Exhibit::of(set)?;
    let blocks = read(exhibit.path(), &[], &Options::default())?.blocks(1);
    let name = plant.block(hidden);
    let own = blocks.into_iter().find(|(block, _)| block.name == name);
    own.ok_or_else(|| Error::Model(format!("no block {name} of {hidden}")))
}
