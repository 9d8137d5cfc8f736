//! One body against a plate.

pub mod block;
pub mod hypotheses;

use super::{BlockWithLibrary, DiagnosedPlant, judged_views};
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use softdock_campaign::rig::ContactRig;

/// The contact of a rig.
pub(crate) struct ContactPlant(pub(crate) ContactRig);

impl DiagnosedPlant for ContactPlant {
    fn block(&self, recordings: &Recordings, _: usize, finer: usize) -> MeasuredBlock {
        block::contact_block(&self.0, &recordings.pieces, &|name| recordings.is_held_out(name), finer)
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        hypotheses::effects(block)
    }

    fn views(&self, recordings: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let recorded = |signals: [&'static str; 3]| signals.into_iter().filter(|signal| recordings.has(signal));
        let [inputs, outputs] = [block::POSITIONS, block::FORCES].map(|signals| recorded(signals).collect::<Vec<_>>());
        judged_views(blocks, &inputs, &outputs)
    }
}
