//! Block from reference to torque of a joint controller, from recordings of a rig.

use crate::data::bandwidth::judged_steps;
use crate::data::grid::Piece;
use crate::data::smooth::motion;
use crate::inference::judge::Candidate;
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use crate::model::unknown::applied;
use softdock_campaign::rig::{ControllerRig, DriveRig};
use softdock_engine::blocks::{BlockKind, simulate};
use softdock_engine::decimator::Decimator;
use softdock_kernels::block::Recorded;
use softdock_kernels::block::controller::ControllerValues;
use softdock_kernels::fields::to_vec;

/// Builds the block from the recordings of a controller, one step per controller period. `held_out` decides by the name
/// of the experiment.
pub fn controller_block(
    rig: &DriveRig,
    controller: &ControllerRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
) -> MeasuredBlock {
    let trial = |piece: &Piece| trial(controller, piece, held_out(&piece.experiment));
    let period = pieces.first().map_or(controller.period, |piece| piece.step / steps(controller, piece) as f64);
    let base = to_vec(&ControllerValues { period, ..controller.values });
    let clock: Vec<_> = rig.tolerance.iter().copied().filter(|(name, _)| *name == "clock_offset").collect();
    let channels = vec![MeasuredOutput { name: "torque", output: 0, unit: if rig.prismatic { "N" } else { "N m" } }];
    MeasuredBlock {
        trials: pieces.iter().map(trial).collect(),
        decimator: Decimator::new(judged_steps(pieces, "tau")),
        ..MeasuredBlock::of(BlockKind::Controller.into(), place::CONTROLLER.name, base, &clock, channels)
    }
}

/// Returns the torques of each recording at every controller period that are consistent with the log, the most probable
/// first. Each is the controller's torque by a fit plus the measured remainder, band-limited between the log's samples.
/// The last one is interpolated from the measurement alone and does not depend on the fit.
///
/// A held or limited reference makes the torque jump between two samples of the log, which no interpolation shows. The
/// recording determines when the jump occurs and which stamp shows it first; the period between two samples is
/// determined by the motion alone.
pub fn torques_between(block: &MeasuredBlock, found: &Candidate) -> Vec<Vec<Vec<f64>>> {
    let sets = nearby(block, found);
    let each = |trial: &Trial| {
        let stride = trial.recorded.stride;
        let recorded = Recorded { stride: 1, ..trial.recorded.clone() };
        let beyond = |asked: &[f64]| -> Vec<f64> {
            trial.measured[0].iter().zip(asked.iter().step_by(stride)).map(|(tau, asked)| tau - asked).collect()
        };
        let left = |asked: &[f64]| beyond(asked).iter().map(|tau| tau * tau).sum::<f64>();
        let tried = simulate(BlockKind::Controller, &[&recorded], &sets).remove(0).into_iter();
        let mut tried: Vec<(f64, Vec<f64>)> = tried.map(|asked| (left(&asked), asked)).collect();
        let own = tried[0].0;
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let step = trial.recorded.step * stride as f64;
        let whole = |mut asked: Vec<f64>| {
            let beyond = motion(&beyond(&asked), step, 0.5 / step, stride).value;
            asked.iter_mut().zip(beyond).for_each(|(asked, beyond)| *asked += beyond);
            asked
        };
        let nothing = vec![0.0; tried[0].1.len()];
        different(tried, own, trial.measured[0].len()).into_iter().chain([nothing]).map(whole).collect()
    };
    block.trials.iter().map(each).collect()
}

/// By how many powers of the noise of one sample a torque may be worse than the fit's own, for a log that allows both.
const ALLOWED: f64 = 10.0;
/// Standard deviations of the noise by which two torques must differ somewhere to be two.
const DIFFERENT: f64 = 10.0;
/// Largest number of distinct torques per recording.
const MOST: usize = 16;

/// Returns the torques that the log allows and that differ from each other, from torques with their residual sums of
/// squares over `samples` samples, the best first; `own` is that of the fit.
fn different(tried: Vec<(f64, Vec<f64>)>, own: f64, samples: usize) -> Vec<Vec<f64>> {
    let power = own / samples as f64;
    let mut all: Vec<Vec<f64>> = Vec::new();
    for (_, asked) in tried.into_iter().take_while(|(left, _)| *left <= own + ALLOWED * power) {
        let far = |own: &Vec<f64>| own.iter().zip(&asked).any(|(a, b)| (a - b).powi(2) > DIFFERENT.powi(2) * power);
        if all.len() < MOST && all.iter().all(far) {
            all.push(asked);
        }
    }
    all
}

/// Parameters of a fit, and with each number moved within what it may be off by.
fn nearby(block: &MeasuredBlock, found: &Candidate) -> Vec<Vec<f64>> {
    let Candidate { fitted, deviations, .. } = found;
    let moved = |place: usize, share: f64| {
        let mut z = fitted.z.clone();
        z[place] = fitted.unknowns[place].prior.allowed(z[place] + share * deviations[place]);
        applied(&block.base, &fitted.unknowns, &z)
    };
    let steps = (-20..=20).map(|k| 0.2 * f64::from(k));
    let moves = (0..fitted.z.len()).flat_map(|place| steps.clone().map(move |share| (place, share)));
    std::iter::once(fitted.values(&block.base)).chain(moves.map(|(place, share)| moved(place, share))).collect()
}

/// Periods of the controller in one of the log.
fn steps(controller: &ControllerRig, piece: &Piece) -> usize {
    (piece.step / controller.period).round().max(1.0) as usize
}

fn trial(controller: &ControllerRig, piece: &Piece, held_out: bool) -> Trial {
    let each = steps(controller, piece);
    let nyquist = 0.5 / piece.step;
    let q = motion(&piece.signals["q"], piece.step, nyquist, each);
    let r = motion(&piece.signals["ref"], piece.step, nyquist, each);
    let f = controller.feedforward;
    let mut late = Vec::with_capacity(r.value.len() * 5);
    for i in 0..r.value.len() {
        let (sin, cos) = (r.value[i] - f.gravity_angle).sin_cos();
        late.extend([r.value[i], r.rate[i], r.acceleration[i], f.gravity_torque * cos, -f.gravity_torque * sin]);
    }
    let instants = q.value.len();
    // The controller runs a period ahead of its log.
    let next = (0..instants).map(|i| (i + 1).min(instants - 1));
    let inputs = next.flat_map(|i| [q.value[i], q.rate[i]]).collect();
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded {
            step: piece.step / each as f64,
            instants,
            stride: each,
            inputs,
            late,
            offsets: Vec::new(),
        },
        measured: vec![piece.signals["tau"].clone()],
    }
}
