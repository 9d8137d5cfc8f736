//! Block from one measured state to the next of a tossed body, from its recordings.
//!
//! Recordings are cut into segments of a few frames. Each segment is simulated from its measured initial state, so that
//! errors do not propagate through several impacts (multiple shooting with the states held at their measured values). A
//! segment begins where a parabola through five frames has a residual at noise level: near an impact the velocity is
//! unknown. The noise is estimated in free flight. An impact amplifies the error of the initial state; segments are
//! weighted accordingly.

use crate::data::grid::Piece;
use crate::data::state::{BodyState, Poses, RATE_NOISE, REACH};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use nalgebra::{DMatrix, UnitQuaternion, Vector3};
use softdock_campaign::rig::TossRig;
use softdock_engine::blocks::{BlockKind, simulate};
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;

/// Longest step of the simulation \[s\].
const LONGEST_STEP: f64 = 2e-4;
/// Length of a segment \[s\]: a blow with the flight after it, and seldom a second one.
const SEGMENT: f64 = 0.054;
/// A state is smooth if the residual of its parabola is at most this many times that of free flight.
const SMOOTH: f64 = 4.0;
/// A corner is clear of the plane from this height on, in half widths.
const CLEAR: f64 = 0.2;
/// Largest number of training segments, and of held-out segments: more would not add information within the model
/// error.
const MOST_SEGMENTS: usize = 400;
/// A body that moves and turns less in a segment rests: \[m, rad\], and in standard deviations of what flight shows.
const AT_REST: [f64; 2] = [1e-3, 1e-2];
const UNSEEN: f64 = 6.0;

/// Input signals.
pub const POSES: [&str; 7] =
    ["position.x", "position.y", "position.z", "orientation.w", "orientation.x", "orientation.y", "orientation.z"];
/// Compared signals, in the order of the block's outputs.
pub const WAYS: [(&str, &str); 6] =
    [("way.x", "m"), ("way.y", "m"), ("way.z", "m"), ("turn.x", "rad"), ("turn.y", "rad"), ("turn.z", "rad")];

/// Builds the block from the recordings of a tossed body. `held_out` decides by the name of the experiment.
pub fn toss_block(rig: &TossRig, pieces: &[Piece], held_out: &dyn Fn(&str) -> bool, finer: usize) -> MeasuredBlock {
    let base = to_vec(&rig.values);
    let tosses: Vec<(Poses, bool)> =
        pieces.iter().map(|piece| (Poses::of(piece), held_out(&piece.experiment))).collect();
    let noise = StateNoise::of(rig, tosses.iter().map(|toss| &toss.0));
    let part = |held_out: bool| -> Option<Trial> {
        let own = tosses.iter().filter(|toss| toss.1 == held_out);
        let all: Vec<Segment> = own.flat_map(|toss| segments(&toss.0, &noise)).collect();
        trial(&spread(&all), held_out, finer, &noise, &base)
    };
    let trials = [part(false), part(true)].into_iter().flatten().collect();
    let channel =
        |(output, row): (usize, &(&'static str, &'static str))| MeasuredOutput { name: row.0, output, unit: row.1 };
    let channels = WAYS.iter().enumerate().map(channel).collect();
    MeasuredBlock {
        trials,
        stands_alone: true,
        quiet: quiet(rig, tosses.iter().map(|toss| &toss.0)),
        ..MeasuredBlock::of(BlockKind::Toss.into(), place::TOSS.name, base, &rig.tolerance, channels)
    }
}

/// Measurement noise of a state.
#[derive(Clone, Copy, Debug)]
pub struct StateNoise {
    /// Standard deviation of a frame's position \[m\], each axis.
    pub position: f64,
    /// The same of an attitude \[rad\].
    pub attitude: f64,
}

impl StateNoise {
    /// Estimates the noise from the residuals of parabolas in free flight, or in all frames if there is none.
    pub fn of<'a>(rig: &TossRig, tosses: impl Iterator<Item = &'a Poses> + Clone) -> Self {
        let left = |flying: bool| -> Vec<[f64; 2]> {
            let of = |poses: &'a Poses| {
                let frames = (0..poses.frames()).filter(move |frame| !flying || clear(rig, poses, *frame, *frame));
                frames.filter_map(|frame| poses.state(frame)).map(|state| state.left).collect::<Vec<_>>()
            };
            tosses.clone().flat_map(of).collect()
        };
        let all = Some(left(true)).filter(|left| !left.is_empty()).unwrap_or_else(|| left(false));
        let median = |k: usize| {
            let mut values: Vec<f64> = all.iter().map(|left| left[k]).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE)
        };
        Self { position: median(0), attitude: median(1) }
    }

    /// Standard deviations of a way \[m\] and a turn \[rad\] in free flight, by the errors of begin and end.
    fn of_flight(&self, frames: usize) -> [f64; 2] {
        let grown = RATE_NOISE * frames as f64;
        [self.position, self.attitude].map(|own| own * (2.0 + grown * grown).sqrt())
    }

    /// Returns whether the residual of a state's parabola is that of free flight.
    pub fn is_smooth(&self, state: &BodyState) -> bool {
        state.left[0] < SMOOTH * self.position && state.left[1] < SMOOTH * self.attitude
    }
}

/// Returns whether no corner is near the plane in the frames of the states `from` to `to`.
pub fn clear(rig: &TossRig, poses: &Poses, from: usize, to: usize) -> bool {
    let half = rig.values.half_width;
    let lowest = |frame: usize| {
        let up = poses.attitude[frame].inverse() * Vector3::z();
        poses.position[frame].z - half * up.abs().sum()
    };
    from >= REACH
        && to + REACH < poses.frames()
        && (from - REACH..=to + REACH).all(|frame| lowest(frame) > CLEAR * half)
}

/// Frames of a segment.
fn length(step: f64) -> usize {
    ((SEGMENT / step).round() as usize).max(2)
}

/// A segment: the state that it begins with, and how far the body comes and turns in it.
#[derive(Clone, Copy)]
struct Segment {
    state: BodyState,
    way: Vector3<f64>,
    turn: Vector3<f64>,
    /// Length \[s\], and frames in it.
    frames: usize,
    step: f64,
}

/// The segments of a toss, one after the other; what rests is left out.
fn segments(poses: &Poses, noise: &StateNoise) -> Vec<Segment> {
    let frames = length(poses.step);
    let flight = noise.of_flight(frames);
    let least: [f64; 2] = std::array::from_fn(|k| AT_REST[k].max(UNSEEN * flight[k]));
    let mut all = Vec::new();
    let mut frame = REACH;
    while frame + frames < poses.frames() {
        let state = poses.state(frame).filter(|state| noise.is_smooth(state));
        let end = frame + frames;
        let Some(state) = state else {
            frame += 1;
            continue;
        };
        let way = poses.position[end] - state.position;
        let turn = (state.attitude.inverse() * poses.attitude[end]).scaled_axis();
        if way.norm() > least[0] || turn.norm() > least[1] {
            all.push(Segment { state, way, turn, frames, step: poses.step });
        }
        frame = end;
    }
    all
}

/// Inputs at an instant.
const ROW: usize = 16;
/// Smallest number of flights that determine the noise of six channels.
const FEWEST_FLIGHTS: usize = 20;

/// Some of the segments, evenly spread, where they are more than needed.
fn spread(all: &[Segment]) -> Vec<Segment> {
    let count = all.len().min(MOST_SEGMENTS);
    (0..count).map(|number| all[number * all.len() / count]).collect()
}

/// Segments one after the other as one recording; `None` of none.
fn trial(segments: &[Segment], held_out: bool, finer: usize, noise: &StateNoise, base: &[f64]) -> Option<Trial> {
    let first = segments.first()?;
    let each = (first.step / LONGEST_STEP).ceil() as usize;
    let layout = Layout { frames: first.frames, frame: first.step, each };
    let states: Vec<BodyState> = segments.iter().map(|segment| segment.state).collect();
    let weights = weights(&layout, &states, noise, base);
    let measured = |channel: usize| {
        let of = |(segment, weight): (&Segment, &[f64; 2])| match channel {
            0..3 => segment.way[channel] * weight[0],
            _ => segment.turn[channel - 3] * weight[1],
        };
        // The recording begins with no way behind it.
        std::iter::once(0.0).chain(segments.iter().zip(&weights).map(of)).collect()
    };
    Some(Trial {
        experiment: if held_out { "tosses held out" } else { "tosses" }.to_owned(),
        held_out,
        recorded: Layout { each: each * finer, ..layout }.recorded(&states, &weights),
        measured: (0..WAYS.len()).map(measured).collect(),
    })
}

/// How segments lie in a recording.
#[derive(Clone, Copy)]
struct Layout {
    /// Frames of a segment.
    frames: usize,
    /// Time from one to the next \[s\].
    frame: f64,
    /// Steps of the simulation in it.
    each: usize,
}

impl Layout {
    /// Segments that begin with some states; the weights stand where a segment ends.
    fn recorded(&self, states: &[BodyState], weights: &[[f64; 2]]) -> Recorded {
        let stride = self.frames * self.each;
        let instants = states.len() * stride + 1;
        let mut inputs = vec![0.0; instants * ROW];
        for (number, (state, weight)) in states.iter().zip(weights).enumerate() {
            inputs[number * stride * ROW..][..ROW - 2].copy_from_slice(&begin(state));
            inputs[((number + 1) * stride + 1) * ROW - 2..][..2].copy_from_slice(weight);
        }
        let step = self.frame / self.each as f64;
        Recorded {
            step,
            instants,
            stride,
            inputs,
            late: (0..instants).map(|i| i as f64 * step).collect(),
            offsets: Vec::new(),
        }
    }
}

/// How much each segment's way and turn weigh: the error that they would have in flight, over the error that they have as
/// the model carries the error of the segment's begin on.
fn weights(layout: &Layout, states: &[BodyState], noise: &StateNoise, base: &[f64]) -> Vec<[f64; 2]> {
    let own = [noise.position, noise.attitude];
    let rates = own.map(|noise| noise * RATE_NOISE / layout.frame);
    let recorded = |states: &[BodyState]| layout.recorded(states, &vec![[1.0; 2]; states.len()]);
    let moved = |number: usize| {
        let (kind, by) = (number / 3, |size: f64| Vector3::ith(number % 3, size));
        let of = |state: &BodyState| match kind {
            0 => BodyState { position: state.position + by(own[0]), ..*state },
            1 => BodyState { attitude: state.attitude * UnitQuaternion::from_scaled_axis(by(own[1])), ..*state },
            2 => BodyState { velocity: state.velocity + by(rates[0]), ..*state },
            _ => BodyState { rate: state.rate + by(rates[1]), ..*state },
        };
        recorded(&states.iter().map(of).collect::<Vec<_>>())
    };
    let all: Vec<Recorded> = std::iter::once(recorded(states)).chain((0..12).map(moved)).collect();
    let outputs = simulate(BlockKind::Toss, &all.iter().collect::<Vec<_>>(), &[base.to_vec()]);
    let flight = noise.of_flight(layout.frames);
    let width = BlockKind::Toss.outputs().len();
    let of = |segment: usize| {
        let change = |moved: usize, k: usize| -> f64 {
            let at = |i: usize| (segment + 1) * width + 3 * k + i;
            (0..3).map(|i| (outputs[moved][0][at(i)] - outputs[0][0][at(i)]).powi(2)).sum::<f64>() / 3.0
        };
        // The end is measured, too.
        let variance = |k: usize| (1..13).map(|moved| change(moved, k)).sum::<f64>() + own[k].powi(2);
        [0, 1].map(|k| (flight[k] / variance(k).sqrt()).min(1.0))
    };
    (0..states.len()).map(of).collect()
}

/// The inputs at an instant where a segment begins with a state, without the weights.
fn begin(state: &BodyState) -> [f64; ROW - 2] {
    let (p, q, v, w) = (state.position, state.attitude, state.velocity, state.rate);
    [1.0, p.x, p.y, p.z, q.w, q.i, q.j, q.k, v.x, v.y, v.z, w.x, w.y, w.z]
}

/// Returns the inputs of a free run from a measured state, with way and turn since then at each of `frames` frames.
pub fn free_run(state: &BodyState, frames: usize, frame: f64) -> Recorded {
    let each = (frame / LONGEST_STEP).ceil() as usize;
    let layout = Layout { frames, frame, each };
    let mut run = Recorded { stride: each, ..layout.recorded(std::slice::from_ref(state), &[[1.0; 2]]) };
    run.inputs.chunks_exact_mut(ROW).for_each(|row| row[ROW - 2..].fill(1.0));
    run
}

/// Returns the residuals of free flight against a steady fall and turn, which are noise alone, segment by segment.
fn quiet<'a>(rig: &TossRig, tosses: impl Iterator<Item = &'a Poses> + Clone) -> Vec<DMatrix<f64>> {
    let mut all: Vec<(f64, [Vector3<f64>; 2])> = Vec::new();
    for poses in tosses {
        let frames = length(poses.step);
        let mut from = REACH;
        while let Some(state) = poses.state(from).filter(|_| clear(rig, poses, from, from + frames)) {
            let time = frames as f64 * poses.step;
            let way = poses.position[from + frames] - state.position - state.velocity * time;
            let turn = (state.attitude.inverse() * poses.attitude[from + frames]).scaled_axis() - state.rate * time;
            all.push((0.5 * time * time, [way, turn]));
            from += frames;
        }
    }
    if all.len() < FEWEST_FLIGHTS {
        return Vec::new();
    }
    // The fall is what all have in common.
    let fall = all.iter().map(|(share, [way, _])| way / *share).sum::<Vector3<f64>>() / all.len() as f64;
    let rest = |(share, [way, turn]): &(f64, [Vector3<f64>; 2])| {
        let way = way - fall * *share;
        DMatrix::from_column_slice(WAYS.len(), 1, &[way.x, way.y, way.z, turn.x, turn.y, turn.z])
    };
    all.iter().map(rest).collect()
}
