//! Discriminating experiment of rivals: the motion of a bank, within the envelope that the rig has shown, whose
//! recordings the rivals predict most differently.
//!
//! The expected log-odds of a motion are what the other rival, with its numbers refitted within what is known of them,
//! still misses of a rival's prediction; the lesser of both directions counts (T-optimality: Atkinson and Fedorov 1975).

use crate::inference::judge::Candidate;
use crate::inference::noise::Noise;
use crate::model::block::MeasuredBlock;
use crate::model::unknown::applied;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Smallest number of repeats, and the total time that limits them: three minutes.
const FEWEST: usize = 3;
const MOST: usize = 30;
/// How long a motion lasts \[s\].
const LASTS: f64 = 6.0;
/// Time over which a motion sets in and dies away \[s\].
const FADE: f64 = 0.5;
/// Sufficient expected log-odds, which determine the number of repeats: with the noise's standard deviation of `sqrt(2
/// E)`, nine of ten times the rivals are separated.
const ENOUGH: f64 = 8.0;
/// Expected log-odds below which no experiment of the bank is worth its time.
const WORTH: f64 = 3.0;
/// Difference quotients are taken over this share of a standard deviation.
const STEP: f64 = 2e-3;

/// Motion to record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProposedExperiment {
    /// What it is, in a few words.
    pub motion: String,
    /// Number of repeats.
    pub repeats: usize,
    /// Expected log-odds of all repeats between the two rivals that are separated least.
    pub expected_log_odds: f64,
    /// Run of the campaign, for a drive of a facility.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<u64>,
    /// Sampling period \[s\].
    #[serde(skip)]
    pub step: f64,
    /// Path: angle \[rad\] or position \[m\] at each sample; empty for a drive of a facility.
    #[serde(skip)]
    pub path: Vec<f64>,
}

impl ProposedExperiment {
    /// Returns whether the expected log-odds are sufficient; otherwise these sensors do not separate the rivals.
    pub fn separates(&self) -> bool {
        self.expected_log_odds >= WORTH
    }

    /// Returns the name of the file that describes it.
    pub fn file(&self) -> &'static str {
        if self.run.is_some() { "experiment.toml" } else { "experiment.csv" }
    }

    /// Returns the path as CSV: time and reference.
    pub fn csv(&self) -> String {
        let row = |(i, q): (usize, &f64)| format!("{:.6},{q:.9}\n", i as f64 * self.step);
        self.path.iter().enumerate().map(row).fold(String::from("t,ref\n"), |all, row| all + &row)
    }
}

/// Envelope of a joint's recorded motion; proposed motions stay within it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Envelope {
    /// Least and greatest angle \[rad\] or place \[m\].
    pub range: (f64, f64),
    /// Greatest rate.
    pub rate: f64,
    /// Greatest acceleration.
    pub acceleration: f64,
    /// Sampling period \[s\].
    pub step: f64,
}

/// Returns the motion of the bank that separates the rivals best. `block_of` builds the rivals' block for a path that
/// is followed without error.
pub fn best(
    envelope: &Envelope,
    rivals: &[&Candidate],
    noise: &Noise,
    block_of: &dyn Fn(&[f64]) -> MeasuredBlock,
) -> Option<ProposedExperiment> {
    let all = bank(envelope).into_iter().map(|(motion, path)| (block_of(&path), (motion, path)));
    let Best { which: (motion, path), repeats, expected_log_odds } = best_of(all, rivals, noise, FEWEST)?;
    Some(ProposedExperiment { motion, repeats, expected_log_odds, run: None, step: envelope.step, path })
}

/// Returns the rehearsed drive that separates the rivals best, from the rivals' block and the run number of each.
pub(crate) fn best_drive(
    rehearsed: Vec<(MeasuredBlock, u64)>,
    rivals: &[&Candidate],
    noise: &Noise,
) -> Option<ProposedExperiment> {
    let Best { which: run, repeats, expected_log_odds } = best_of(rehearsed.into_iter(), rivals, noise, 1)?;
    let motion = format!("run {run} of the campaign");
    Some(ProposedExperiment { motion, repeats, expected_log_odds, run: Some(run), step: 0.0, path: Vec::new() })
}

/// Recording that separates the rivals best, with its repeats and expected log-odds.
struct Best<T> {
    which: T,
    repeats: usize,
    expected_log_odds: f64,
}

/// The best of recordings that are given by the rivals' block for each, repeated no less than so often.
fn best_of<T>(
    all: impl Iterator<Item = (MeasuredBlock, T)>,
    rivals: &[&Candidate],
    noise: &Noise,
    fewest: usize,
) -> Option<Best<T>> {
    let seen = |(block, which): (MeasuredBlock, T)| {
        let views: Vec<View> = rivals.iter().map(|rival| View::of(rival, &block, noise)).collect();
        (apart(&views, fewest), views, which)
    };
    let (_, views, which) = all.map(seen).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let repeats = (fewest..MOST).find(|repeats| apart(&views, *repeats) >= ENOUGH).unwrap_or(MOST);
    Some(Best { which, repeats, expected_log_odds: apart(&views, repeats) })
}

/// Returns the expected log-odds of `repeats` repeats between the two rivals that are separated least.
fn apart(views: &[View], repeats: usize) -> f64 {
    let pairs = (0..views.len()).flat_map(|a| (0..views.len()).map(move |b| (a, b))).filter(|(a, b)| a != b);
    pairs.map(|(a, b)| views[a].missed_by(&views[b], repeats as f64)).fold(f64::INFINITY, f64::min)
}

/// Whitened prediction of a recording by a rival, with its sensitivities and the precision of its parameters.
struct View {
    prediction: DVector<f64>,
    jacobian: DMatrix<f64>,
    known: DMatrix<f64>,
}

impl View {
    fn of(rival: &Candidate, block: &MeasuredBlock, noise: &Noise) -> Self {
        let (unknowns, z) = (&rival.fitted.unknowns, &rival.fitted.z);
        let mut sets = vec![applied(&block.base, unknowns, z)];
        sets.extend((0..z.len()).map(|column| {
            let mut moved = z.clone();
            moved[column] += STEP;
            applied(&block.base, unknowns, &moved)
        }));
        let mut all = block.part(false).whitened(noise, &sets).into_iter();
        let prediction = all.next().expect("one a set");
        let columns: Vec<DVector<f64>> = all.map(|moved| (moved - &prediction) / STEP).collect();
        let jacobian =
            if columns.is_empty() { DMatrix::zeros(prediction.len(), 0) } else { DMatrix::from_columns(&columns) };
        let covariance = rival.evidence.covariance.clone();
        let known = covariance.try_inverse().unwrap_or_else(|| DMatrix::identity(z.len(), z.len()));
        Self { prediction, jacobian, known }
    }

    /// Log-odds by which another rival misses this one's prediction of so many repeats, refitted within what is known of
    /// its numbers.
    fn missed_by(&self, other: &Self, repeats: f64) -> f64 {
        let apart = &self.prediction - &other.prediction;
        let whole = 0.5 * repeats * apart.norm_squared();
        if other.jacobian.ncols() == 0 {
            return whole;
        }
        let gradient = other.jacobian.transpose() * &apart * repeats;
        let normal = other.jacobian.transpose() * &other.jacobian * repeats + &other.known;
        normal.cholesky().map_or(0.0, |normal| whole - 0.5 * gradient.dot(&normal.solve(&gradient)))
    }
}

/// A motion without its size, over time \[s\].
type Shape = Box<dyn Fn(f64) -> f64>;

/// Motions, each as large as the envelope allows.
fn bank(envelope: &Envelope) -> Vec<(String, Vec<f64>)> {
    let mut shapes: Vec<(String, Shape)> = Vec::new();
    for frequency in [0.2, 0.5, 1.0, 2.0, 4.0, 8.0] {
        shapes.push((format!("sine of {frequency} Hz"), Box::new(move |t| (TAU * frequency * t).sin())));
    }
    shapes.push(("multisine up to 4 Hz".to_owned(), Box::new(multisine)));
    shapes.push(("slow triangle with a chirp from 1 to 7 Hz".to_owned(), Box::new(triangle_with_chirp)));
    shapes.push(("slow triangle".to_owned(), Box::new(|t| triangle(t / LASTS))));
    shapes.push(("steps with rests between them".to_owned(), Box::new(steps)));
    let (lo, hi) = envelope.range;
    let places = [("the middle", 0.5), ("the lower end", 0.2), ("the upper end", 0.8)];
    let mut all = Vec::new();
    for (name, shape) in &shapes {
        for (place, share) in places {
            all.push((format!("{name} about {place} of the range"), scaled(envelope, lo + share * (hi - lo), shape)));
        }
        // Reversals far smaller than the range: what acts in a short travel shows nowhere else.
        let small = Envelope { range: (0.495 * (hi + lo) + 0.01 * lo, 0.495 * (hi + lo) + 0.01 * hi), ..*envelope };
        all.push((format!("small {name}"), scaled(&small, 0.5 * (hi + lo), shape)));
    }
    all
}

/// A shape about a place, as large as range, rate and acceleration allow.
fn scaled(envelope: &Envelope, about: f64, shape: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let step = envelope.step;
    let count = (LASTS / step) as usize;
    let fade = |t: f64| smooth(t.min(LASTS - t) / FADE);
    let unit: Vec<f64> = (0..=count).map(|i| fade(i as f64 * step) * shape(i as f64 * step)).collect();
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
    let size = most(&mut unit.iter().copied());
    let rate = most(&mut unit.windows(2).map(|w| (w[1] - w[0]) / step));
    let acceleration = most(&mut unit.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]) / (step * step)));
    let amplitude = (about - envelope.range.0).min(envelope.range.1 - about);
    let scale = (amplitude / size).min(envelope.rate / rate).min(envelope.acceleration / acceleration);
    unit.into_iter().map(|value| about + scale * value).collect()
}

/// Eight sines with phases that keep the peak low (Schroeder 1970).
fn multisine(t: f64) -> f64 {
    (1..=8).map(f64::from).map(|k| (TAU * 0.5 * k * t - PI * k * (k - 1.0) / 8.0).sin()).sum()
}

/// A triangle of period 1 with rounded corners.
fn triangle(t: f64) -> f64 {
    (0..4).map(|k| f64::from(2 * k + 1)).map(|n| (TAU * n * t).sin() * (PI * n / 2.0).sin() / (n * n)).sum()
}

fn triangle_with_chirp(t: f64) -> f64 {
    triangle(t / LASTS) + 0.05 * (TAU * (t + 0.5 * t * t)).sin()
}

/// Share of a step's time in which it moves.
const MOVING: f64 = 0.6;

/// Up, up, down, down, with rests.
fn steps(t: f64) -> f64 {
    let levels = [0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0];
    let place = t / LASTS * 8.0;
    let (from, share) = (place.floor().clamp(0.0, 7.0), place - place.floor().clamp(0.0, 7.0));
    let [a, b] = [levels[from as usize], levels[from as usize + 1]];
    a + smooth(share / MOVING) * (b - a)
}

/// From 0 to 1 with rate, acceleration and jerk of zero at both ends: a torque that jumps between two samples reads as
/// whatever interpolates them.
fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s.powi(4) * (35.0 - s * (84.0 - s * (70.0 - 20.0 * s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_of_the_bank_stays_within_the_envelope() {
        let envelope = Envelope { range: (0.1, 1.2), rate: 1.1, acceleration: 15.0, step: 0.004 };
        let all = bank(&envelope);
        assert_eq!(all.len(), 40);
        for (name, path) in &all {
            let outside = path.iter().any(|q| *q < 0.1 - 1e-9 || *q > 1.2 + 1e-9);
            let rate = path.windows(2).map(|w| ((w[1] - w[0]) / 0.004).abs()).fold(0.0, f64::max);
            let bend = path.windows(3).map(|w| ((w[2] - 2.0 * w[1] + w[0]) / 1.6e-5).abs()).fold(0.0, f64::max);
            assert!(!outside && rate < 1.1 + 1e-9 && bend < 15.0 + 1e-6, "{name}: {rate} {bend}");
            assert!((path[0] - path[path.len() - 1]).abs() < 1e-9, "{name} ends where it began");
        }
    }

    #[test]
    fn no_motion_of_the_bank_jumps_in_acceleration() {
        let envelope = Envelope { range: (0.1, 1.2), rate: 1.1, acceleration: 15.0, step: 0.004 };
        for (name, path) in bank(&envelope) {
            let bends: Vec<f64> = path.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
            let most = bends.iter().fold(0.0_f64, |most, bend| most.max(bend.abs()));
            let jump = bends.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            // A sine of 8 Hz changes by a fifth of its peak from one sample to the next.
            assert!(bends[0].abs() < 0.01 * most && jump < 0.25 * most, "{name}: {}", jump / most);
        }
    }
}
