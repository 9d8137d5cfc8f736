//! Free body under known wrenches.

pub mod block;
pub mod hypotheses;

use super::{BlockWithLibrary, DiagnosedPlant, judged_views};
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use softdock_campaign::rig::BodyRig;

/// The body of a rig.
pub(crate) struct BodyPlant(pub(crate) BodyRig);

impl DiagnosedPlant for BodyPlant {
    fn block(&self, recordings: &Recordings, _: usize, finer: usize) -> MeasuredBlock {
        block::body_block(&self.0, &recordings.pieces, &|name| recordings.is_held_out(name), finer)
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        hypotheses::effects(block)
    }

    fn views(&self, _: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        judged_views(blocks, &block::WRENCH, &block::MOTION.map(|motion| motion.0))
    }
}
