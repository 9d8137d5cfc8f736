//! Simulates blocks of the loop from their recordings, many parameter sets at once, on CPU lanes.

use crate::cpu::InstructionSet;
use rayon::prelude::*;
use softdock_kernels::block::body::FreeBody;
use softdock_kernels::block::command::Command;
use softdock_kernels::block::contact::Contact;
use softdock_kernels::block::controller::Controller;
use softdock_kernels::block::drive::Drive;
use softdock_kernels::block::sensor::Sensor;
use softdock_kernels::block::toss::Toss;
use softdock_kernels::block::{Block, Recorded, replay};
use softdock_kernels::fields::{Bundle, Field, fields};
use softdock_kernels::lanes::Lane;

/// A block that can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
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

/// Carries an expression out with the block of a kind.
macro_rules! with_block {
    ($kind:expr, $block:ident => $body:expr) => {
        match $kind {
            Kind::Drive => {
                let $block = &Drive;
                $body
            }
            Kind::Controller => {
                let $block = &Controller;
                $body
            }
            Kind::Sensor => {
                let $block = &Sensor;
                $body
            }
            Kind::Contact => {
                let $block = &Contact;
                $body
            }
            Kind::Command => {
                let $block = &Command;
                $body
            }
            Kind::Body => {
                let $block = &FreeBody;
                $body
            }
            Kind::Toss => {
                let $block = &Toss;
                $body
            }
        }
    };
}

impl Kind {
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
        with_block!(self, block => softdock_kernels::block::kernel::kernel(block, step))
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
/// `sets` in the order of [`Kind::parameters`]; the result holds, recording by recording and set by set, the outputs
/// sample by sample.
pub fn simulate(kind: Kind, recordings: &[&Recorded], sets: &[Vec<f64>]) -> Outputs {
    let instructions = InstructionSet::detect();
    with_block!(kind, block => on_lanes(instructions, block, recordings, sets))
}

fn on_lanes<B: Block>(instructions: InstructionSet, block: &B, recordings: &[&Recorded], sets: &[Vec<f64>]) -> Outputs {
    let each = |recorded: &&Recorded| -> Vec<Vec<f64>> {
        sets.par_chunks(softdock_kernels::lanes::WIDTH)
            .flat_map_iter(|chunk| dispatch(instructions, block, recorded, chunk))
            .collect()
    };
    recordings.par_iter().map(each).collect()
}

/// As many parameter sets as there are lanes, or fewer, through one recording.
#[inline(always)]
fn tile<L: Lane, B: Block>(block: &B, recorded: &Recorded, sets: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut out = Vec::with_capacity(sets.len());
    for group in sets.chunks(L::WIDTH) {
        let mut field = 0;
        let p = B::Params::read(&mut || {
            field += 1;
            // Lanes without a set of their own repeat the first.
            L::gather(|lane| group.get(lane).unwrap_or(&group[0])[field - 1])
        });
        let lanes = replay::<L, B>(block, recorded, &p);
        out.extend((0..group.len()).map(|lane| lanes.iter().map(|value| value.lane(lane)).collect()));
    }
    out
}

/// One entry point per instruction set, each compiled for it.
macro_rules! entry_points {
    ($($name:ident: $lanes:ty, $features:literal;)*) => {
        $(
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = $features)]
            fn $name<B: Block>(block: &B, recorded: &Recorded, sets: &[Vec<f64>]) -> Vec<Vec<f64>> {
                tile::<$lanes, B>(block, recorded, sets)
            }
        )*
    };
}

entry_points! {
    tile_avx512: softdock_kernels::lanes::avx512::Lanes, "avx512f,avx512dq,avx2,fma";
    tile_avx2: softdock_kernels::lanes::avx2::Lanes, "avx2,fma";
}

fn dispatch<B: Block>(
    instructions: InstructionSet,
    block: &B,
    recorded: &Recorded,
    sets: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    match instructions {
        // SAFETY: the instruction set was detected.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { tile_avx512(block, recorded, sets) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { tile_avx2(block, recorded, sets) },
        #[cfg(not(target_arch = "x86_64"))]
        InstructionSet::Plain => tile::<softdock_kernels::lanes::plain::Lanes, B>(block, recorded, sets),
        _ => tile::<f64, B>(block, recorded, sets),
    }
}
