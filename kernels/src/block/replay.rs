//! The frame around a block: steps it through a recording, one parameter set a lane; its twin is `wgsl/replay.wgsl`.

use super::Block;
use crate::fields::{Bundle, Sink, Source};
use crate::lanes::{Lane, WIDTH};
use crate::real::Real;

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
    /// By how much the parameters of this recording differ from those of any set, in the order of the field table: what
    /// is known to be another run's. Empty where nothing does.
    pub offsets: Vec<f64>,
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
    let mut out = Vec::new();
    let mut state = None;
    for i in 0..recorded.instants {
        let u = B::Input::read(&mut Row::new(&recorded.inputs[i * row..(i + 1) * row]));
        let v = B::Late::read(&mut late_at::<L, B>(block, recorded, p, i));
        let s = match state {
            None => block.start(p, &u, &v),
            Some(s) => block.advance(recorded.step, p, &s, &u, &v),
        };
        if i % recorded.stride == 0 {
            block.output(p, &s, &u, &v).write(&mut Samples(&mut out));
            if i == 0 {
                // As many numbers as the first sample has.
                out.reserve_exact(out.len() * (recorded.samples() - 1));
            }
        }
        state = Some(s);
    }
    out
}

/// One instant's signals, the same in all lanes.
pub(crate) struct Row<'a> {
    values: &'a [f64],
    field: usize,
}

impl<'a> Row<'a> {
    /// The signals of an instant, in the order of their field table.
    pub(crate) fn new(values: &'a [f64]) -> Self {
        Self { values, field: 0 }
    }
}

impl<L: Real> Source<L> for Row<'_> {
    #[inline(always)]
    fn next(&mut self) -> L {
        self.field += 1;
        L::lit(self.values[self.field - 1])
    }
}

/// Outputs, one after the other.
pub(crate) struct Samples<'a, L>(pub(crate) &'a mut Vec<L>);

impl<L> Sink<L> for Samples<'_, L> {
    #[inline(always)]
    fn put(&mut self, value: L) {
        self.0.push(value);
    }
}

/// Signals as they reach a block, at a moment of its own for each lane: between two instants linear, before the first
/// one held.
struct Late<'a, L> {
    values: &'a [f64],
    /// First field of the newer and of the older instant, lane by lane.
    newer: [usize; WIDTH],
    older: [usize; WIDTH],
    /// Whether all lanes have these in common, as most do: then one load serves all.
    common: bool,
    /// How far the moment lies from the newer towards the older.
    share: L,
    field: usize,
}

#[inline(always)]
fn late_at<'a, L: Lane, B: Block>(block: &B, recorded: &'a Recorded, p: &B::Params<L>, instant: usize) -> Late<'a, L> {
    let row = recorded.late.len() / recorded.instants;
    let lateness = block.lateness(p, L::lit(instant as f64 * recorded.step)) * L::lit(1.0 / recorded.step);
    let whole = lateness.floor();
    let last = recorded.instants as i64 - 1;
    let common = !L::any(!(whole - L::lit(whole.lane(0))).abs().le(L::lit(0.0)));
    let (mut newer, mut older) = ([0; WIDTH], [0; WIDTH]);
    for lane in 0..if common { 1 } else { L::WIDTH } {
        let place = instant as i64 - whole.lane(lane) as i64;
        newer[lane] = place.clamp(0, last) as usize * row;
        older[lane] = (place - 1).clamp(0, last) as usize * row;
    }
    Late { values: &recorded.late, newer, older, common, share: lateness - whole, field: 0 }
}

impl<L: Lane> Source<L> for Late<'_, L> {
    #[inline(always)]
    fn next(&mut self) -> L {
        let at = |places: &[usize; WIDTH], lane: usize| self.values[places[lane] + self.field];
        let (newer, older) = match self.common {
            true => (L::lit(at(&self.newer, 0)), L::lit(at(&self.older, 0))),
            false => (L::gather(|lane| at(&self.newer, lane)), L::gather(|lane| at(&self.older, lane))),
        };
        self.field += 1;
        (older - newer).mul_add(self.share, newer)
    }
}
