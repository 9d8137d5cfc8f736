//! Simulates blocks of the loop from their recordings, many parameter sets at once, on CPU lanes.

use crate::decimator::Decimator;
use crate::instructions::{InstructionSet, OnLanes};
use rayon::prelude::*;
use softdock_kernels::block::body::BodyBlock;
use softdock_kernels::block::command::CommandBlock;
use softdock_kernels::block::contact::ContactBlock;
use softdock_kernels::block::controller::ControllerBlock;
use softdock_kernels::block::drive::DriveBlock;
use softdock_kernels::block::sensor::SensorBlock;
use softdock_kernels::block::toss::TossBlock;
use softdock_kernels::block::{Block, Recorded, replay};
use softdock_kernels::fields::{Bundle, Field, fields};
use softdock_kernels::lanes::{Lane, WIDTH};
use softdock_kernels::real::Real;

/// A block that can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BlockKind {
    /// A joint's drive, from torque to motion.
    Drive,
    /// A joint's controller, from reference to torque.
    Controller,
    /// A force/torque sensor, from wrench to reading.
    Sensor,
    /// A contact, from relative motion to force.
    Contact,
    /// A command's way, from sender to receiver.
    Command,
    /// A free body, from wrench to motion.
    Body,
    /// A tossed body, from measured states to the next.
    Toss,
}

/// Evaluates an expression with the block of a kind.
macro_rules! with_block {
    ($kind:expr, $block:ident => $body:expr) => {
        match $kind {
            BlockKind::Drive => {
                let $block = &DriveBlock;
                $body
            }
            BlockKind::Controller => {
                let $block = &ControllerBlock;
                $body
            }
            BlockKind::Sensor => {
                let $block = &SensorBlock;
                $body
            }
            BlockKind::Contact => {
                let $block = &ContactBlock;
                $body
            }
            BlockKind::Command => {
                let $block = &CommandBlock;
                $body
            }
            BlockKind::Body => {
                let $block = &BodyBlock;
                $body
            }
            BlockKind::Toss => {
                let $block = &TossBlock;
                $body
            }
        }
    };
}

impl BlockKind {
    /// The field table of the block's parameters.
    pub fn parameters(self) -> Vec<Field> {
        fn of<B: Block>(_: &B) -> Vec<Field> {
            fields::<f64, B::Params<f64>>()
        }
        with_block!(self, block => of(block))
    }

    /// The field table of the signals that must be given at every instant.
    pub fn inputs(self) -> Vec<Field> {
        fn of<B: Block>(_: &B) -> Vec<Field> {
            fields::<f64, B::Input<f64>>()
        }
        with_block!(self, block => of(block))
    }

    /// The field table of the signals that reach the block late.
    pub fn late_inputs(self) -> Vec<Field> {
        fn of<B: Block>(_: &B) -> Vec<Field> {
            fields::<f64, B::Late<f64>>()
        }
        with_block!(self, block => of(block))
    }

    /// The WGSL module that simulates the block with a step \[s\].
    pub fn kernel(self, step: f64) -> String {
        with_block!(self, block => softdock_tracer::block_kernel::kernel(block, step))
    }

    /// The field table of the outputs.
    pub fn outputs(self) -> Vec<Field> {
        fn of<B: Block>(_: &B) -> Vec<Field> {
            fields::<f64, B::Output<f64>>()
        }
        with_block!(self, block => of(block))
    }
}

/// Outputs by recording and parameter set, each list sample by sample in the order of the field table.
pub type Outputs = Vec<Vec<Vec<f64>>>;

/// Simulates a block for every recording and every parameter set, in f64 on all cores.
///
/// `sets` in the order of [`BlockKind::parameters`]; the result holds, recording by recording and set by set, the outputs
/// sample by sample.
pub fn simulate(kind: BlockKind, recordings: &[&Recorded], sets: &[Vec<f64>]) -> Outputs {
    simulate_decimated(kind, recordings, sets, &Decimator::none())
}

/// The same, of which only what a decimator keeps is given.
pub fn simulate_decimated(
    kind: BlockKind,
    recordings: &[&Recorded],
    sets: &[Vec<f64>],
    decimator: &Decimator,
) -> Outputs {
    let instructions = InstructionSet::detect();
    with_block!(kind, block => by_tiles(recordings, sets, &|recorded, sets| {
        instructions.run(Tile { block, recorded, sets, decimator, compared: None })
    }))
}

/// A recording of a block with what was read of its outputs.
pub struct Reading<'a> {
    /// The inputs.
    pub recorded: &'a Recorded,
    /// What was read, sample by sample in the order of the field table of the outputs.
    pub outputs: Vec<f64>,
}

/// Dead zone of readings: distances from the truth that carry no information, output by output.
pub struct Tolerance {
    /// The distance, in the output's unit.
    pub half: Vec<f64>,
    /// Share of what lies within it that counts.
    pub within: f64,
}

impl Tolerance {
    /// What counts of a residual of an output.
    #[inline(always)]
    pub fn beyond<R: Real>(&self, output: usize, residual: R) -> R {
        let half = R::lit(self.half[output]);
        residual - residual.max(-half).min(half) * R::lit(1.0 - self.within)
    }
}

/// Simulates a block for every reading and every parameter set, in f64 on all cores: what a decimator keeps of what was
/// read less what was simulated, as far as it is beyond a tolerance.
pub fn beyond(
    kind: BlockKind,
    readings: &[Reading],
    sets: &[Vec<f64>],
    decimator: &Decimator,
    tolerance: &Tolerance,
) -> Outputs {
    let instructions = InstructionSet::detect();
    with_block!(kind, block => by_tiles(readings, sets, &|Reading { recorded, outputs }, sets| {
        instructions.run(Tile { block, recorded, sets, decimator, compared: Some((outputs, tolerance)) })
    }))
}

/// Runs tiles of as many parameter sets as there are lanes on all cores.
pub(crate) fn by_tiles<R: Sync>(
    recordings: &[R],
    sets: &[Vec<f64>],
    tile: &(impl Fn(&R, &[Vec<f64>]) -> Vec<Vec<f64>> + Sync),
) -> Outputs {
    let each = |recorded: &R| -> Vec<Vec<f64>> {
        sets.par_chunks(WIDTH).flat_map_iter(|chunk| tile(recorded, chunk)).collect()
    };
    recordings.par_iter().map(each).collect()
}

/// As many parameter sets as there are lanes, or fewer, through one recording.
struct Tile<'a, B> {
    block: &'a B,
    recorded: &'a Recorded,
    sets: &'a [Vec<f64>],
    decimator: &'a Decimator,
    /// What was read, where the outputs are compared with it.
    compared: Option<(&'a [f64], &'a Tolerance)>,
}

impl<B: Block> OnLanes for Tile<'_, B> {
    type Output = Vec<Vec<f64>>;
    #[inline(always)]
    fn execute<L: Lane>(self) -> Vec<Vec<f64>> {
        let mut out = Vec::with_capacity(self.sets.len());
        for group in self.sets.chunks(L::WIDTH) {
            let mut field = 0;
            let p = B::Params::read(&mut || {
                field += 1;
                let offset = self.recorded.offsets.get(field - 1).copied().unwrap_or(0.0);
                // Lanes without a set of their own repeat the first.
                L::gather(|lane| group.get(lane).unwrap_or(&group[0])[field - 1] + offset)
            });
            let mut lanes = replay::<L, B>(self.block, self.recorded, &p);
            if let Some((read, tolerance)) = self.compared {
                compare(&mut lanes, read, tolerance);
            }
            out.extend(kept_by_lane(lanes, self.recorded.samples(), self.decimator, group.len()));
        }
        out
    }
}

/// Puts what is beyond a tolerance of what was read in the place of what was simulated.
///
/// Loops, no closures: as in [`lane_by_lane`].
#[inline(always)]
fn compare<L: Lane>(lanes: &mut [L], read: &[f64], tolerance: &Tolerance) {
    let channels = tolerance.half.len();
    for (sample, read) in lanes.chunks_exact_mut(channels).zip(read.chunks_exact(channels)) {
        for (output, (value, read)) in sample.iter_mut().zip(read).enumerate() {
            *value = tolerance.beyond(output, L::lit(*read) - *value);
        }
    }
}

/// What a decimator keeps of so many samples, for each of the first lanes.
#[inline(always)]
pub(crate) fn kept_by_lane<L: Lane>(
    lanes: Vec<L>,
    samples: usize,
    decimator: &Decimator,
    count: usize,
) -> Vec<Vec<f64>> {
    let channels = lanes.len() / samples;
    lane_by_lane(&decimator.pass(lanes, channels), count)
}

/// The numbers of each of the first lanes.
///
/// Loops, no closures: these would be functions of their own, without the instruction set that the lanes are read by.
#[inline(always)]
fn lane_by_lane<L: Lane>(lanes: &[L], count: usize) -> Vec<Vec<f64>> {
    let mut all = vec![vec![0.0; lanes.len()]; count];
    for (place, value) in lanes.iter().enumerate() {
        for (lane, own) in all.iter_mut().enumerate() {
            own[place] = value.lane(lane);
        }
    }
    all
}
