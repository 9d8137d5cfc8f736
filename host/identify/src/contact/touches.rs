//! Touches of a contact recording: windows around each press or impact, with smoothed motion and measured force.

use crate::Result;
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::data::grid::{self, Piece};
use softdock_diagnosis::data::smooth::{SmoothedSignal, band_powers, motion};
use softdock_engine::contact_law::PointMotion;
use softdock_kernels::vector::vec3;
use std::path::Path;

/// Force above which the parts touch: share of the range of a recording's normal force, and standard deviations of noise.
const TOUCH_SHARE: f64 = 0.02;
const TOUCH_NOISE: f64 = 6.0;
/// Gaps shorter than this share of the touch before them do not end it: a force that chatters about the threshold.
const SHORT_GAP: f64 = 0.1;
/// Samples and share of a touch that its window has to either side, up to the middle of a gap.
const MARGIN: usize = 8;
const MARGIN_SHARE: f64 = 0.2;
/// Fewest samples of a touch.
const FEWEST: usize = 8;
/// Frequency bands in which motion and noise are compared.
const BANDS: usize = 64;
/// Power over that of noise in a band with motion, and how far the pass band goes beyond the last such band.
const ABOVE_NOISE: f64 = 6.0;
const BEYOND: f64 = 1.5;
/// Least pass band in cycles per sample.
const LEAST_BAND: f64 = 0.02;
/// Longest step between the instants of an evaluation \[s\].
const LONGEST_STEP: f64 = 1e-3;

/// A press or an impact: motion of the point relative to the plate, and measured force.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Recording or experiment that it is of.
    pub recording: String,
    /// Time of its first sample in that recording \[s\].
    pub start: f64,
    /// Sampling period of the force \[s\].
    pub step: f64,
    /// Instants of the motion per sample.
    pub finer: usize,
    /// Motion at these instants.
    pub motion: Vec<PointMotion>,
    /// Measured forces x, y, z of the plate on the point \[N\]; zero where not recorded.
    pub force: Vec<[f64; 3]>,
    /// Sample of the first contact.
    pub first: usize,
    /// Whether it is held out of the fit.
    pub held_out: bool,
}

impl Touch {
    /// Returns the speed of approach at its begin \[m/s\].
    pub fn closing_speed(&self) -> f64 {
        -self.motion[self.first * self.finer].velocity.z
    }

    /// Returns the way into the plate from the first contact to the greatest force \[m\].
    fn deepest(&self) -> f64 {
        let greatest =
            (self.first..self.force.len()).max_by(|one, two| self.force[*one][2].total_cmp(&self.force[*two][2]));
        self.at(self.first).position.z - self.at(greatest.expect("a touch has samples")).position.z
    }

    /// Returns the motion at a sample of the force.
    pub fn at(&self, sample: usize) -> PointMotion {
        self.motion[sample * self.finer]
    }
}

/// All touches of the recordings.
#[derive(Clone, Debug)]
pub struct Touches {
    /// The touches in the order of the recordings.
    pub all: Vec<Touch>,
    /// Whether the lateral force along x and y was recorded.
    pub lateral: [bool; 2],
    /// What was assumed or changed when the recordings were read.
    pub notes: Vec<String>,
}

/// Lateral signals: force and position.
const LATERAL: [(&str, &str); 2] = [("force.x", "position.x"), ("force.y", "position.y")];

impl Touches {
    /// Reads the recordings of a contact rig and holds out a share of the touches, evenly spread.
    ///
    /// # Errors
    /// A recording that cannot be read, or too few touches.
    pub fn read(rig: &Rig, logs: &[&Path], hold_out: f64) -> Result<Self> {
        assert!(matches!(rig.plant, RigModel::Contact(_)), "the caller reads contact rigs here");
        let (mut pieces, mut notes) = (Vec::new(), Vec::new());
        for path in logs {
            let (read, findings) = grid::read(path, rig)?;
            pieces.extend(read);
            notes.extend(findings.into_iter().map(|finding| format!("{}: {}", finding.recording, finding.what)));
        }
        let lateral = LATERAL.map(|(force, place)| {
            pieces.iter().all(|piece| piece.signals.contains_key(force) && piece.signals.contains_key(place))
        });
        let mut all: Vec<Touch> = pieces.iter().flat_map(|piece| touches(piece, lateral)).collect();
        if all.is_empty() {
            return Err(DiagnosisError::unfit(
                "no recording has a touch: the normal force does not rise above its noise",
                "check the column and the sign of `force.z` in [log]: it is the force of the plate on the body, out of \
                 the plate",
            ));
        }
        let outwards = all.iter().filter(|touch| touch.deepest() <= 0.0).count();
        if 2 * outwards > all.len() {
            let what = format!(
                "in {outwards} of {} touches the point moves out of the plate while the force rises",
                all.len()
            );
            let remedy =
                "check the sign of `position.z` in [log]: it points out of the plate; a depth needs scale = -1";
            return Err(DiagnosisError::unfit(what, remedy));
        }
        hold_out_evenly(&mut all, hold_out)?;
        Ok(Self { all, lateral, notes })
    }

    /// Returns the touches that are fitted, or those that are held out.
    pub fn part(&self, held_out: bool) -> Vec<&Touch> {
        self.all.iter().filter(|touch| touch.held_out == held_out).collect()
    }
}

/// Marks a share of the touches as held out, evenly spread over their order.
fn hold_out_evenly(all: &mut [Touch], share: f64) -> Result<()> {
    let count = (share * all.len() as f64).round() as usize;
    if share > 0.0 && (count == 0 || count == all.len()) {
        let what = format!("{} touches cannot be divided: --hold-out {share} holds out {count} of them", all.len());
        return Err(DiagnosisError::unfit(what, "record more touches, or write --hold-out 0"));
    }
    let total = all.len();
    for (place, touch) in all.iter_mut().enumerate() {
        touch.held_out = (place + 1) * count / total > place * count / total;
    }
    Ok(())
}

/// The touches of a piece.
fn touches(piece: &Piece, lateral: [bool; 2]) -> Vec<Touch> {
    let normal = &piece.signals["force.z"];
    let finer = (piece.step / LONGEST_STEP).ceil().max(1.0) as usize;
    let still = vec![0.0; piece.samples()];
    let axis = |name: &str| smoothed(piece.signals.get(name).unwrap_or(&still), piece.step, finer);
    let mut axes = [axis("position.x"), axis("position.y"), axis("position.z")];
    if let Some(rate) = piece.signals.get("rate.z") {
        axes[2].rate = smoothed(rate, piece.step, finer).value;
    }
    let bounds = windows(normal);
    let margin = |from: usize, to: usize| MARGIN.max((MARGIN_SHARE * (to - from) as f64) as usize);
    let touch = |(number, (from, to)): (usize, &(usize, usize))| {
        let before = number.checked_sub(1).map_or(0, |before| (bounds[before].1 + from).div_ceil(2));
        let after = bounds.get(number + 1).map_or(piece.samples(), |after| (to + after.0) / 2);
        let margin = margin(*from, *to);
        let (begin, end) = (from.saturating_sub(margin).max(before), (to + margin).min(after));
        let instants = begin * finer..=(end - 1) * finer;
        let at = |i: usize| {
            let of = |values: [&Vec<f64>; 3]| vec3(values[0][i], values[1][i], values[2][i]);
            let [x, y, z] = &axes;
            PointMotion { position: of([&x.value, &y.value, &z.value]), velocity: of([&x.rate, &y.rate, &z.rate]) }
        };
        let side = |axis: usize, i: usize| if lateral[axis] { piece.signals[LATERAL[axis].0][i] } else { 0.0 };
        Touch {
            recording: piece.experiment.clone(),
            start: piece.start + begin as f64 * piece.step,
            step: piece.step,
            finer,
            motion: instants.map(at).collect(),
            force: (begin..end).map(|i| [side(0, i), side(1, i), normal[i]]).collect(),
            first: from - begin,
            held_out: false,
        }
    };
    bounds.iter().enumerate().map(touch).collect()
}

/// First sample of each touch, and the one after its last.
fn windows(force: &[f64]) -> Vec<(usize, usize)> {
    let mut sorted = force.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[sorted.len() / 20], sorted[sorted.len() - 1]);
    let mut steps: Vec<f64> = force.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    // The median step of white noise is 0.954 standard deviations; most samples lie beside the impacts or change little.
    let noise = steps[steps.len() / 2] / 0.954;
    let threshold = low + (TOUCH_SHARE * (high - low)).max(TOUCH_NOISE * noise);
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (i, value) in force.iter().enumerate() {
        if *value <= threshold {
            continue;
        }
        match found.last_mut() {
            Some((from, to)) if i <= *to + 1 + (SHORT_GAP * (*to - *from) as f64) as usize => *to = i + 1,
            _ => found.push((i, i + 1)),
        }
    }
    found.retain(|(from, to)| to - from >= FEWEST);
    found
}

/// A signal with its rate, up to the frequency to which it stands out of its noise.
fn smoothed(samples: &[f64], step: f64, finer: usize) -> SmoothedSignal {
    let bands = BANDS.min(samples.len() / 4).max(2);
    let powers = band_powers(samples, bands);
    let mut upper: Vec<f64> = powers[bands / 2..].to_vec();
    upper.sort_by(f64::total_cmp);
    let floor = upper[upper.len() / 4];
    let last = powers.iter().rposition(|power| *power > ABOVE_NOISE * floor).map_or(0, |last| last + 1);
    let band = (BEYOND * 0.5 * last as f64 / bands as f64).clamp(LEAST_BAND, 0.5);
    motion(samples, step, band / step, finer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_the_pulses() {
        let mut force: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i % 3)).collect();
        (100..160).for_each(|i| force[i] = 5.0);
        // Chatter within a touch does not divide it.
        force[120] = 0.0;
        (500..520).for_each(|i| force[i] = 2.0);
        assert_eq!(windows(&force), [(100, 160), (500, 520)]);
        assert!(windows(&vec![1.0; 300]).is_empty(), "a constant force is no touch");
    }

    #[test]
    fn held_out_touches_are_spread() {
        let touch = |_| Touch {
            recording: String::new(),
            start: 0.0,
            step: 1e-3,
            finer: 1,
            motion: Vec::new(),
            force: Vec::new(),
            first: 0,
            held_out: false,
        };
        let mut all: Vec<Touch> = (0..10).map(touch).collect();
        hold_out_evenly(&mut all, 0.3).expect("divisible");
        let held: Vec<usize> = (0..10).filter(|place| all[*place].held_out).collect();
        assert_eq!(held, [3, 6, 9]);
        assert!(hold_out_evenly(&mut all[..1], 0.3).is_err() && hold_out_evenly(&mut all[..1], 0.0).is_ok());
    }
}
