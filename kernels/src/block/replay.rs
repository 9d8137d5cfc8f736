//! The frame around a block: steps it through a recording, one parameter set a lane; its twin is `wgsl/replay.wgsl`.

use super::Block;
use crate::fields::Bundle;
use crate::lanes::Lane;
use crate::real::Real;

/// More lanes than any lane type has.
const MOST_LANES: usize = 64;

/// A recording on the grid of a block's steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Step of the grid \[s\].
    pub step: f64,
    /// Number of instants.
    pub instants: usize,
    /// Every so many steps the block is asked for its outputs, the first time at the start.
    pub stride: usize,
    /// Inputs, instant by instant, in the order of the block's field table.
    pub inputs: Vec<f64>,
    /// Late inputs likewise.
    pub late: Vec<f64>,
}

impl Recorded {
    /// How often the block is asked for its outputs.
    pub fn samples(&self) -> usize {
        self.instants.div_ceil(self.stride)
    }
}

/// Steps a block through a recording, one parameter set a lane; outputs sample by sample in the order of the field
/// table, each for all lanes.
#[inline(always)]
pub fn replay<L: Lane, B: Block>(block: &B, recorded: &Recorded, p: &B::Params<L>) -> Vec<L> {
    let row = recorded.inputs.len() / recorded.instants;
    let input = |i: usize| -> B::Input<L> { lifted(&recorded.inputs[i * row..(i + 1) * row]) };
    let late = |i: usize| -> B::Late<L> { late_at::<L, B>(block, recorded, p, i) };
    let mut s = block.start(p, &input(0), &late(0));
    let mut out = Vec::with_capacity(recorded.samples() * 2);
    for i in 0..recorded.instants {
        let (u, v) = (input(i), late(i));
        if i > 0 {
            s = block.advance(recorded.step, p, &s, &u, &v);
        }
        if i % recorded.stride == 0 {
            block.output(p, &s, &u, &v).write(&mut |value| out.push(value));
        }
    }
    out
}

/// The late signals as they reach the block at an instant: between two instants linear, before the first one held.
#[inline(always)]
fn late_at<L: Lane, B: Block>(block: &B, recorded: &Recorded, p: &B::Params<L>, instant: usize) -> B::Late<L> {
    let row = recorded.late.len() / recorded.instants;
    let lateness = block.lateness(p, L::lit(instant as f64 * recorded.step)) * L::lit(1.0 / recorded.step);
    let whole = lateness.floor();
    let share = lateness - whole;
    let mut places = [[0; 2]; MOST_LANES];
    for (lane, place) in places.iter_mut().enumerate().take(L::WIDTH) {
        let newer = instant as i64 - whole.lane(lane) as i64;
        *place = [newer, newer - 1].map(|at| at.clamp(0, recorded.instants as i64 - 1) as usize * row);
    }
    let mut field = 0;
    B::Late::read(&mut || {
        let newer = L::gather(|lane| recorded.late[places[lane][0] + field]);
        let older = L::gather(|lane| recorded.late[places[lane][1] + field]);
        field += 1;
        (older - newer).mul_add(share, newer)
    })
}

/// The same numbers in all lanes.
#[inline(always)]
fn lifted<L: Real, T: Bundle<L>>(values: &[f64]) -> T {
    let mut values = values.iter();
    T::read(&mut || L::lit(*values.next().expect("a row as long as the field table")))
}
