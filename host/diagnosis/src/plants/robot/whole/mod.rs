//! Errors of the robot as a whole, from the torques of all axes at once.
//!
//! The torques that the model lacks are regressed on the calibration of every axis and on causes that load several axes:
//! a mass at the flange, a tilted base, coupled motors of the wrist. Each set of causes has its evidence in closed form,
//! with the noise that all terms together leave. The alternative is separate errors of every axis. Causes that
//! win must be physically possible, and must hold on held-out motion.

mod answer;
mod regression;
mod terms;

use crate::data::grid::{Finding, Piece};
use crate::data::recordings::Recordings;
use crate::data::smooth::{SmoothedSignal, motion};
use crate::inference::identifiability::BlockIdentifiability;
use crate::model::isolability::BlockView;
use crate::model::place::ROBOT;
use crate::plants::robot::coupling::Instant;
use crate::plants::robot::links::at;
use crate::verdict::answer::BlockAnswer;
use nalgebra::DMatrix;
use regression::{Regression, Sampled};
use softdock_campaign::rig::RobotRig;
use softdock_kernels::with_joints;
use std::collections::BTreeSet;
use terms::{Cause, Extent, Kind, Terms, Variants};

/// Cut-off of torques and motions \[Hz\], and its largest share of the Nyquist frequency.
const CUTOFF: f64 = 10.0;
const BAND: f64 = 0.8;
/// Samples per period of the cut-off frequency.
const DENSITY: f64 = 2.0;
/// Time that is left out at both ends, where the low-pass rings \[s\], and shortest recording in multiples of it.
const ENDS: f64 = 0.3;
const SHORTEST: f64 = 6.0;
/// Log-odds of a cause against none, and of each cause of several.
pub(super) const THRESHOLD: f64 = 5.0;
/// Complexity penalty of each cause: one of several is likely to fit best by chance.
const PENALTY: f64 = 3.0;
/// Times that a load is placed anew.
const PLACINGS: usize = 3;
/// Most causes of a robot as a whole.
const MOST: usize = 3;

/// Errors of a robot as a whole.
pub(super) struct Whole {
    /// The answer; `None` for recordings that are too short.
    pub(super) answer: Option<BlockAnswer>,
    /// Which causes the motions determine; `None` without an answer.
    pub(super) identifiability: Option<BlockIdentifiability>,
    /// Why there is none.
    pub(super) findings: Vec<Finding>,
    /// The robot with the named errors.
    pub(super) rig: RobotRig,
}

impl Whole {
    /// Judges the robot as a whole; `without` lists effects that are not judged.
    pub(super) fn of(rig: &RobotRig, recordings: &Recordings, without: &[String]) -> Self {
        with_joints!(rig.drives.len(), judged(rig, recordings, without))
    }

    /// Place of the load that was found, in flange axes \[m\].
    fn place(&self) -> Option<[f64; 3]> {
        let load = self.answer.as_ref()?.effects.iter().find(|effect| effect.id == answer::effect(Kind::Load).0)?;
        Some(["payload_place_x", "payload_place_y", "payload_place_z"].map(|name| load.parameters[name].value))
    }
}

/// Returns the isolability of the effects of the robot as a whole.
pub(super) fn view() -> BlockView {
    let effects = [Kind::Load, Kind::Tilt, Kind::Coupling(1, 1.0)].map(|kind| answer::effect(kind).0);
    BlockView {
        block: ROBOT.name,
        inputs: vec!["q of all axes"],
        outputs: vec!["tau of all axes"],
        missing: Vec::new(),
        effects: effects.to_vec(),
    }
}

fn judged<const N: usize>(rig: &RobotRig, recordings: &Recordings, without: &[String]) -> Whole {
    let long = |piece: &&Piece| piece.samples() as f64 * piece.step > SHORTEST * ENDS;
    let pieces: Vec<&Piece> = recordings.pieces.iter().filter(long).collect();
    let held = |piece: &Piece| recordings.is_held_out(&piece.experiment);
    if !pieces.iter().any(|piece| !held(piece)) || !pieces.iter().any(|piece| held(piece)) {
        let what = "the recordings are too short to judge causes that load several axes".to_owned();
        let findings = vec![Finding { recording: ROBOT.name.to_owned(), what }];
        return Whole { answer: None, identifiability: None, findings, rig: rig.clone() };
    }
    let motions: Vec<Motion<N>> = pieces.iter().map(|piece| Motion::of(piece)).collect();
    let extents = extents(&motions);
    let is_judged = |kind| without.iter().all(|id| *id != answer::effect(kind).0);
    let about = |place: [f64; 3]| {
        let (terms, variants) = (Terms::of(rig, &extents, place, &is_judged), Variants::of(&rig.model, place));
        let sampled = |(piece, motion): (&&Piece, &Motion<N>)| Sampled {
            held_out: held(piece),
            axes: motion.rows(rig, &variants, &terms, &extents),
            rate: 1.0 / (piece.step * motion.each as f64),
        };
        let sampled: Vec<Sampled> = pieces.iter().zip(&motions).map(sampled).collect();
        answer::whole(rig, &terms, Regression::of(&terms, &sampled), &sampled)
    };
    // The inertia of a load is no linear term: it is that of the load where it was found before.
    let mut whole = about([0.0; 3]);
    for _ in 0..PLACINGS {
        let Some(place) = whole.place() else { break };
        whole = about(place);
    }
    whole
}

/// Low-passed motion and torque of all axes in a recording.
struct Motion<const N: usize> {
    axes: [SmoothedSignal; N],
    torques: [Vec<f64>; N],
    step: f64,
    cutoff: f64,
    /// Samples from one judged one to the next.
    each: usize,
}

impl<const N: usize> Motion<N> {
    fn of(piece: &Piece) -> Self {
        let cutoff = CUTOFF.min(BAND * 0.5 / piece.step);
        let smooth =
            |name: &str, axis: usize| motion(&piece.signals[&format!("{name}.{}", axis + 1)], piece.step, cutoff, 1);
        Self {
            axes: std::array::from_fn(|axis| smooth("q", axis)),
            torques: std::array::from_fn(|axis| smooth("tau", axis).value),
            step: piece.step,
            cutoff,
            each: ((1.0 / (DENSITY * cutoff * piece.step)) as usize).max(1),
        }
    }

    fn at(&self, k: usize) -> Instant<N> {
        Instant {
            angle: at(&self.axes, k, |own| &own.value),
            rate: at(&self.axes, k, |own| &own.rate),
            acceleration: at(&self.axes, k, |own| &own.acceleration),
            torque: std::array::from_fn(|axis| self.torques[axis][k]),
        }
    }

    /// The terms of every axis, low-passed like the torques, at the judged samples.
    fn rows(&self, rig: &RobotRig, variants: &Variants, terms: &Terms, extents: &[Extent]) -> Vec<DMatrix<f64>> {
        let count = self.torques[0].len();
        let instants: Vec<[Vec<f64>; N]> =
            (0..count).map(|k| terms::rows(rig, variants, terms, extents, &self.at(k))).collect();
        let ends = (ENDS / self.step) as usize;
        let judged: Vec<usize> = (ends..count - ends).step_by(self.each).collect();
        let of_axis = |axis: usize| {
            let columns = (0..instants[0][axis].len()).map(|term| {
                let series: Vec<f64> = instants.iter().map(|instant| instant[axis][term]).collect();
                let passed = match series.iter().all(|own| *own == series[0]) {
                    true => series,
                    false => motion(&series, self.step, self.cutoff, 1).value,
                };
                nalgebra::DVector::from_iterator(judged.len(), judged.iter().map(|k| passed[*k]))
            });
            DMatrix::from_columns(&columns.collect::<Vec<_>>())
        };
        (0..N).map(of_axis).collect()
    }
}

fn extents<const N: usize>(motions: &[Motion<N>]) -> Vec<Extent> {
    let of = |axis: usize| {
        let mean_square = |series: &dyn Fn(&Motion<N>) -> Vec<f64>| {
            let all: Vec<f64> = motions.iter().flat_map(series).collect();
            (all.iter().map(|own| own * own).sum::<f64>() / all.len() as f64).sqrt()
        };
        let rates = motions.iter().flat_map(|motion| &motion.axes[axis].rate);
        Extent {
            torque: mean_square(&|motion| motion.torques[axis].clone()),
            rate: mean_square(&|motion| motion.axes[axis].rate.clone()),
            fastest: rates.fold(0.0, |most, rate| most.max(rate.abs())),
        }
    };
    (0..N).map(of).collect()
}

/// Sets of causes: none, each, and several; couplings of one axis with different ratios exclude each other.
fn sets(causes: &[Cause]) -> Vec<BTreeSet<usize>> {
    let compatible = |set: &BTreeSet<usize>, own: usize| {
        !set.iter().any(|other| match (causes[*other].kind, causes[own].kind) {
            (Kind::Coupling(a, _), Kind::Coupling(b, _)) => a == b,
            _ => false,
        })
    };
    let mut all = vec![BTreeSet::new()];
    let mut from = 0;
    for _ in 0..=MOST {
        let to = all.len();
        for k in from..to {
            let first = all[k].last().map_or(0, |last| last + 1);
            for own in first..causes.len() {
                if compatible(&all[k], own) {
                    let mut set = all[k].clone();
                    set.insert(own);
                    all.push(set);
                }
            }
        }
        from = to;
    }
    all
}

/// Common terms of a set of causes.
fn places(causes: &[Cause], set: &BTreeSet<usize>) -> Vec<usize> {
    set.iter().flat_map(|cause| causes[*cause].terms.clone()).collect()
}

#[cfg(test)]
mod tests;
