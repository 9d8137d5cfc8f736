//! Quantisation of a sensor's reading, detected in the raw readings: all readings are whole multiples of the step, so
//! that they are in phase with it.

use crate::model::block::{MeasuredBlock, Quantisation, ReadingSteps, Trial};
use rayon::prelude::*;
use statrs::statistics::Statistics;
use std::f64::consts::TAU;
use std::ops::Range;

/// Number of raw readings of a channel for the detection.
const FEW: usize = 250;
/// Steps of a reading that its greatest value holds at least.
const LEAST_STEPS: f64 = 10.0;
/// Most steps a newton that are tried, and share of the greatest power from which on they may be in phase.
const MOST_DENSITIES: f64 = 5000.0;
const IN_PHASE: f64 = 0.8;
/// Largest number of reported steps.
const MOST_STEPS: usize = 6;
/// Refinements of a step, each so many times as fine as the one before.
const REFINEMENTS: usize = 3;
const FINER: i32 = 20;
/// Readings lie on steps if they lie nearer to them than this share of the healthy noise, which would blur them as far,
/// and than this share of a step: of readings that lie anywhere (0.29 of a step) some lie a little nearer to one of the
/// many that are tried.
const SHARP: f64 = 0.5;
const IN_STEP: f64 = 0.24;

/// Name as an effect.
pub(crate) const NAME: &str = "quantisation";
/// Name of the size parameter.
pub(crate) const SIZE: &str = "resolution";
/// Channels of the forces, and of the moments.
pub(crate) const FORCES: Range<usize> = 0..3;
pub(crate) const MOMENTS: Range<usize> = 3..6;

/// Readings of a channel before the tool's share was taken off.
fn raw(block: &MeasuredBlock, trial: &Trial, channel: usize) -> impl Iterator<Item = f64> {
    let width = block.section.inputs().len();
    let tool = trial.recorded.inputs.iter().skip(channel).step_by(width * trial.recorded.stride);
    trial.measured[channel].iter().zip(tool).map(|(reading, tool)| reading + tool)
}

/// Greatest raw reading of some channels.
pub(crate) fn raw_peak(block: &MeasuredBlock, channels: Range<usize>) -> f64 {
    let of = |channel: usize| block.trials.iter().flat_map(move |trial| raw(block, trial, channel));
    channels.flat_map(of).fold(0.0, |peak, reading| reading.abs().max(peak))
}

/// Steps that all raw readings of some channels of one kind lie on: the largest such, sharper than the healthy noise of
/// those channels lets any wrench be read that is not rounded. `None` if they lie on none, or that noise is not known.
fn on_steps(block: &MeasuredBlock, channels: Range<usize>) -> Option<Step> {
    let healthy = *block.known_noise.get(channels.start)?;
    let phases = Phases::of(block, channels.clone());
    let seen = phases.seen(raw_peak(block, channels), healthy);
    seen.into_iter().find(|step| phases.blur(step.size) < f64::min(SHARP * healthy, IN_STEP * step.size))
}

/// Steps that the raw forces lie on, and the raw moments.
pub(crate) fn of_both(block: &MeasuredBlock) -> [Option<Step>; 2] {
    [FORCES, MOMENTS].map(|channels| on_steps(block, channels))
}

/// Quantisation of a sensor's readings.
pub(crate) const QUANTISATION: Quantisation = Quantisation { name: NAME, size: SIZE, steps: reading_steps };

/// Steps of all channels. The size is that of the forces, in N, or that of the moments over the sensor's lever where
/// those alone lie on steps.
fn reading_steps(block: &MeasuredBlock) -> Option<ReadingSteps> {
    let both @ [force, moment] = of_both(block);
    let by_moment = || Some(moment?.size / block.base[block.field("lever")]);
    let size = force.map(|step| step.size).or_else(by_moment)?;
    let steps = both.into_iter().flat_map(|step| [step.map_or(0.0, |step| step.size); 3]).collect();
    Some(ReadingSteps { steps, size })
}

/// Steps in which the raw force may be read, the largest first, down to some size.
///
/// A fit finds a step only from nearby, where the reading's last step is in phase. Other errors, such as a bias, shift
/// the steps of the model but not those of the reading.
pub(crate) fn seen_steps(block: &MeasuredBlock, greatest: f64, least: f64) -> Vec<f64> {
    Phases::of(block, FORCES).seen(greatest, least).into_iter().map(|step| step.size).collect()
}

/// Quantisation step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Its size, in the readings' unit.
    pub size: f64,
    /// Half the width of its 95 % interval.
    pub resolution: f64,
}

impl Step {
    /// Variance of rounding to it where repeats meet it in any phase: the most that it can be between repeats of a wrench
    /// that moves through steps, and more than where it rests on one.
    pub(crate) fn variance(self) -> f64 {
        self.size * self.size / 12.0
    }
}

/// Raw readings per channel, whose phase relative to a step is computed.
struct Phases {
    readings: Vec<Vec<f64>>,
}

impl Phases {
    /// Of one recording of each experiment that is learnt from, evenly thinned.
    fn of(block: &MeasuredBlock, channels: Range<usize>) -> Self {
        let few = |channel: usize| {
            let all: Vec<f64> = block.firsts(false).into_iter().flat_map(|trial| raw(block, trial, channel)).collect();
            all.iter().step_by((all.len() / FEW).max(1)).copied().collect()
        };
        Self { readings: channels.map(few).collect() }
    }

    /// Squares of the length of the mean phase of each channel, 0 to 1, at so many steps a unit.
    fn concentrations(&self, density: f64) -> impl Iterator<Item = f64> {
        self.readings.iter().map(move |own| {
            let waves = own.iter().map(|reading| (TAU * density * reading).sin_cos());
            let (sin, cos) = waves.fold((0.0, 0.0), |sum, wave| (sum.0 + wave.0, sum.1 + wave.1));
            (sin * sin + cos * cos) / (own.len() as f64).powi(2)
        })
    }

    fn power(&self, density: f64) -> f64 {
        self.concentrations(density).sum()
    }

    /// Standard deviation of how far the readings of the channel that is furthest off lie from whole steps, had they a
    /// normal distribution about them.
    fn blur(&self, step: f64) -> f64 {
        let least = self.concentrations(1.0 / step).fold(1.0, f64::min);
        step / TAU * (-least.ln()).max(0.0).sqrt()
    }

    /// A step of such a size, and what that is known to: a line through the readings over their numbers of steps.
    fn step(&self, size: f64) -> Step {
        let about_mean =
            |own: &Vec<f64>| own.iter().map(|reading| reading / size).population_variance() * own.len() as f64;
        let lever = self.readings.iter().map(about_mean).sum::<f64>().sqrt();
        Step { size, resolution: 1.959_964 * self.blur(size) / lever }
    }

    /// Steps that are in phase with the readings, the largest first: all whole multiples of a step are, wherever they
    /// begin. From some size to a tenth of the greatest reading.
    fn seen(&self, greatest: f64, least: f64) -> Vec<Step> {
        let (first, last, apart) = (LEAST_STEPS / greatest, least.recip(), 0.2 / greatest);
        let count = ((last - first) / apart).clamp(0.0, MOST_DENSITIES) as usize;
        let powers: Vec<f64> = (0..=count).into_par_iter().map(|k| self.power(first + k as f64 * apart)).collect();
        let most = powers.iter().copied().fold(0.0, f64::max);
        let is_peak = |k: &usize| {
            let beside = |j: Option<usize>| j.and_then(|j| powers.get(j)).copied().unwrap_or(0.0);
            powers[*k] >= beside(k.checked_sub(1)).max(beside(Some(k + 1))) && powers[*k] > IN_PHASE * most
        };
        let refined = |k: usize| {
            let (mut density, mut apart) = (first + k as f64 * apart, apart);
            for _ in 0..REFINEMENTS {
                apart /= f64::from(FINER);
                let near = (-FINER..=FINER).map(|i| density + f64::from(i) * apart);
                let by_power = near.map(|density| (self.power(density), density));
                density = by_power.max_by(|a, b| a.0.total_cmp(&b.0)).expect("several densities").1;
            }
            self.step(density.recip())
        };
        (0..=count).filter(is_peak).take(MOST_STEPS).map(refined).collect()
    }
}
