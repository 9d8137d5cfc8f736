//! A section of the loop that can be simulated from recordings: a block on its own, or the whole facility of a scenario.

use crate::blocks::{BlockKind, Outputs, by_tiles, kept_by_lane, simulate_decimated};
use crate::decimator::Decimator;
use crate::instructions::{InstructionSet, OnLanes};
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::{Field, fields, from_slice};
use softdock_kernels::frame::facility::{Readings, follow};
use softdock_kernels::lanes::Lane;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Parts;
use std::sync::Arc;

/// A section of the loop.
#[derive(Clone, Debug)]
pub enum Section {
    /// A block with measured inputs.
    Block(BlockKind),
    /// Robots, contact and sensor of a scenario.
    Facility(Arc<Plant>),
    /// Contact and sensor of a scenario whose robots are at their references.
    Touch(Arc<Plant>),
}

impl From<BlockKind> for Section {
    fn from(kind: BlockKind) -> Self {
        Self::Block(kind)
    }
}

impl Section {
    /// Whether it is a block of this kind.
    pub fn is(&self, kind: BlockKind) -> bool {
        matches!(self, Self::Block(own) if *own == kind)
    }

    /// The field table of its parameters.
    pub fn parameters(&self) -> Vec<Field> {
        match self {
            Self::Block(kind) => kind.parameters(),
            Self::Facility(_) | Self::Touch(_) => fields::<f64, Params<f64>>(),
        }
    }

    /// The field table of the signals that must be given at every instant.
    pub fn inputs(&self) -> Vec<Field> {
        match self {
            Self::Block(kind) => kind.inputs(),
            Self::Facility(_) | Self::Touch(_) => fields::<f64, Parts<f64>>(),
        }
    }

    /// The field table of the signals that reach it late.
    pub fn late_inputs(&self) -> Vec<Field> {
        match self {
            Self::Block(kind) => kind.late_inputs(),
            Self::Facility(_) | Self::Touch(_) => Vec::new(),
        }
    }

    /// The field table of the outputs.
    pub fn outputs(&self) -> Vec<Field> {
        match self {
            Self::Block(kind) => kind.outputs(),
            Self::Facility(_) | Self::Touch(_) => fields::<f64, Readings<f64>>(),
        }
    }

    /// Simulates it for every recording and every parameter set, in f64 on all cores; see [`simulate_decimated`].
    ///
    /// The recordings of a facility are those that [`follow`] takes.
    pub fn simulate(&self, recordings: &[&Recorded], sets: &[Vec<f64>], decimator: &Decimator) -> Outputs {
        match self {
            Self::Block(kind) => simulate_decimated(*kind, recordings, sets, decimator),
            Self::Facility(plant) => simulate_facility(plant, |p| p, recordings, sets, decimator),
            Self::Touch(plant) => simulate_facility(plant, later_motion, recordings, sets, decimator),
        }
    }
}

/// A late reading is the reading of motions that are commanded later by the same time. Motions are interpolated
/// smoothly; interpolated wrench samples would give a fit local optima at whole samples.
fn later_motion(p: Params<f64>) -> Params<f64> {
    Params { loop_delay: p.loop_delay + p.sensor_delay_error, sensor_delay_error: 0.0, ..p }
}

/// Maps a parameter set to the simulated one.
type Applied = fn(Params<f64>) -> Params<f64>;

fn simulate_facility(
    plant: &Plant,
    applied: Applied,
    recordings: &[&Recorded],
    sets: &[Vec<f64>],
    decimator: &Decimator,
) -> Outputs {
    let instructions = InstructionSet::detect();
    by_tiles(recordings, sets, &|recorded, sets| {
        instructions.run(Facility { plant, applied, recorded, sets, decimator })
    })
}

/// A facility under as many parameter sets as there are lanes, or fewer, through one recording.
struct Facility<'a> {
    plant: &'a Plant,
    applied: Applied,
    recorded: &'a Recorded,
    sets: &'a [Vec<f64>],
    decimator: &'a Decimator,
}

impl OnLanes for Facility<'_> {
    type Output = Vec<Vec<f64>>;
    #[inline(always)]
    fn execute<L: Lane>(self) -> Vec<Vec<f64>> {
        let Facility { plant, applied, recorded, sets, decimator } = self;
        let own = |set: &Vec<f64>| -> Params<f64> {
            let offset = |i: usize| recorded.offsets.get(i).copied().unwrap_or(0.0);
            applied(from_slice(&set.iter().enumerate().map(|(i, value)| value + offset(i)).collect::<Vec<_>>()))
        };
        let mut out = Vec::with_capacity(sets.len());
        for group in sets.chunks(L::WIDTH) {
            let lanes = follow::<L>(plant, recorded, &group.iter().map(own).collect::<Vec<_>>());
            out.extend(kept_by_lane(lanes, recorded.samples(), decimator, group.len()));
        }
        out
    }
}
