//! Errors of free runs of tosses: speed after the first impact, and rest position.
//!
//! Each toss is simulated from its first measured state only. Errors are medians over the tosses with bootstrap
//! intervals over tosses: for a body that lands on an edge, no model predicts the side to which it falls.

use crate::data::grid::Piece;
use crate::data::median;
use crate::data::state::{BodyState, Poses};
use crate::plants::toss::block::{StateNoise, clear, free_run};
use crate::verdict::estimates::parameters;
use crate::verdict::free_run::{ErrorReduction, FittedEffect, FreeRun, Median};
use crate::verdict::judged::Judged;
use nalgebra::Vector3;
use softdock_campaign::rig::TossRig;
use softdock_engine::blocks::{BlockKind, simulate};
use softdock_kernels::philox;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;
/// Seed of the bootstrap: the same data give the same interval.
const SEED: u64 = 4;
/// Smallest number of tosses for an interval.
const FEWEST: usize = 5;

impl FreeRun {
    /// Computes the errors with the nominal constants and with the best admissible hypothesis, named or not; `None` if
    /// too few tosses determine both.
    pub fn of(rig: &TossRig, pieces: &[&Piece], held_out: bool, judged: &Judged) -> Option<Self> {
        let base = &judged.block.base;
        let best = judged.judgement.ranking.iter().find(|candidate| candidate.admissible);
        let sets = [base.clone(), best.map_or_else(|| base.clone(), |best| best.fitted.values(base))];
        let hypotheses = best.into_iter().flat_map(|best| best.hypotheses.iter().map(move |number| (best, *number)));
        let with = hypotheses.map(|(best, number)| {
            let own = &judged.library[number];
            FittedEffect { id: own.effect.id, name: own.name, parameters: parameters(best, own, false) }
        });
        let poses: Vec<Poses> = pieces.iter().map(|piece| Poses::of(piece)).collect();
        let noise = StateNoise::of(rig, poses.iter());
        let tosses: Vec<Toss> = poses.iter().filter_map(|poses| Toss::of(rig, poses, &noise)).collect();
        let runs: Vec<_> = tosses.iter().map(|toss| free_run(&toss.begin, toss.frames, toss.step)).collect();
        let outputs = simulate(BlockKind::Toss, &runs.iter().collect::<Vec<_>>(), &sets);
        let (mut speeds, mut velocities, mut rests) = (Vec::new(), Vec::new(), Vec::new());
        for (toss, outputs) in tosses.iter().zip(&outputs) {
            speeds.extend(toss.rebound_errors(outputs, |simulated, measured| simulated.norm() - measured.norm()));
            velocities.extend(toss.rebound_errors(outputs, |simulated, measured| (simulated - measured).norm()));
            rests.extend(toss.rest_errors(outputs));
        }
        let tosses = [speeds.len(), rests.len()];
        let enough = tosses.iter().all(|count| *count >= FEWEST);
        enough.then(|| Self {
            tosses,
            held_out,
            rebound_speed: compared(&speeds),
            rebound_velocity: compared(&velocities),
            rest_position: compared(&rests),
            with: with.collect(),
        })
    }
}

/// A toss as it was measured.
struct Toss {
    begin: BodyState,
    /// Frames from there on, and from one to the next \[s\].
    frames: usize,
    step: f64,
    /// First smooth frame after the first blow, from the begin on, and the velocity there.
    rebound: Option<(usize, Vector3<f64>)>,
    /// How far the body came until the recording's end, if it rests there.
    rest: Option<Vector3<f64>>,
}

/// Mean speed \[m/s\] over the last frames, and how many, below which a body rests.
const AT_REST: f64 = 0.02;
const LAST: usize = 8;
/// Least speed \[m/s\] that an error is related to.
const SLOWEST: f64 = 0.2;

impl Toss {
    /// `None` of a toss that does not begin in free flight.
    fn of(rig: &TossRig, poses: &Poses, noise: &StateNoise) -> Option<Self> {
        let smooth = |frame: &usize| poses.state(*frame).filter(|state| noise.is_smooth(state));
        let last = poses.frames() - 1;
        let first = (0..last).find(|frame| clear(rig, poses, *frame, *frame) && smooth(frame).is_some())?;
        let begin = smooth(&first)?;
        let blow = (first..last).find(|frame| !clear(rig, poses, *frame, *frame) && smooth(frame).is_none());
        let after = blow.and_then(|blow| (blow..last).find(|frame| smooth(frame).is_some()));
        let rebound = after.and_then(|frame| Some((frame - first, smooth(&frame)?.velocity)));
        let end = (poses.position[last] - poses.position[last - LAST.min(last)]) / (LAST as f64 * poses.step);
        let rest = (end.norm() < AT_REST).then(|| poses.position[last] - begin.position);
        Some(Self { begin, frames: last - first, step: poses.step, rebound, rest })
    }

    /// Errors of the velocity after the first blow, before and after, over the measured speed.
    fn rebound_errors(
        &self,
        outputs: &[Vec<f64>],
        error: impl Fn(Vector3<f64>, Vector3<f64>) -> f64,
    ) -> Option<[f64; 2]> {
        let (frame, measured) = self.rebound.filter(|rebound| rebound.1.norm() > SLOWEST)?;
        Some([0, 1].map(|set| error(output(&outputs[set], frame, 6), measured).abs() / measured.norm()))
    }

    /// Distances of the places of rest, before and after.
    fn rest_errors(&self, outputs: &[Vec<f64>]) -> Option<[f64; 2]> {
        let rest = self.rest?;
        Some([0, 1].map(|set| (output(&outputs[set], self.frames, 0) - rest).xy().norm()))
    }
}

/// Three numbers of a frame's outputs.
fn output(outputs: &[f64], frame: usize, first: usize) -> Vector3<f64> {
    let width = BlockKind::Toss.outputs().len();
    Vector3::from_column_slice(&outputs[frame * width + first..][..3])
}

/// Medians of errors before and after, and of what is gained, with their intervals.
fn compared(errors: &[[f64; 2]]) -> ErrorReduction {
    let of = |f: &dyn Fn([f64; 2]) -> f64| {
        let medians = |draw: &dyn Fn(usize) -> usize| {
            [0, 1].map(|k| median((0..errors.len()).map(|i| errors[draw(i)][k]).collect()))
        };
        let resample = |number: usize| {
            let draw = |i: usize| {
                let u = philox::uniform(SEED, "tosses", number as u64, i as u32);
                ((errors.len() as f64 * u) as usize).min(errors.len() - 1)
            };
            f(medians(&draw))
        };
        let mut all: Vec<f64> = (0..RESAMPLES).map(resample).collect();
        all.sort_by(f64::total_cmp);
        Median { value: f(medians(&|i| i)), lo: all[RESAMPLES / 40], hi: all[RESAMPLES - 1 - RESAMPLES / 40] }
    };
    ErrorReduction { before: of(&|m| m[0]), after: of(&|m| m[1]), gain: of(&|m| 1.0 - m[1] / m[0]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halved_errors_give_a_gain_of_one_half_within_the_interval() {
        let errors: Vec<[f64; 2]> = (0..80).map(|i| f64::from(i % 20) / 20.0 + 0.1).map(|e| [e, 0.5 * e]).collect();
        let found = compared(&errors);
        assert!((found.before.value - 0.575).abs() < 1e-12 && (found.gain.value - 0.5).abs() < 1e-12, "{found:?}");
        assert!(found.before.lo < 0.575 && found.before.hi > 0.575 && found.gain.lo > 0.4999, "{found:?}");
        assert!(found.before.hi - found.before.lo < 0.4 && found.after.hi < found.before.lo, "{found:?}");
    }
}
