//! Transmission of a command from sender to receiver.

pub mod block;
pub mod hypotheses;
pub(crate) mod packets;
pub(crate) mod timing;

use super::{BlockWithLibrary, DiagnosedPlant, judged_views};
use crate::data::grid::{Finding, Piece};
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::answer::BlockAnswer;
use softdock_campaign::rig::CommandRig;

/// The command of a rig.
pub(crate) struct CommandPlant(pub(crate) CommandRig);

impl DiagnosedPlant for CommandPlant {
    /// Without an echo only events are timed.
    fn places(&self, _: &Recordings) -> usize {
        usize::from(self.0.echoed)
    }

    fn block(&self, recordings: &Recordings, _: usize, finer: usize) -> MeasuredBlock {
        block::command_block(&self.0, &recordings.pieces, &|name| recordings.is_held_out(name), finer)
    }

    fn library(&self, recordings: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        hypotheses::effects(block, packets::hold(&recordings.pieces), self.0.is_servo)
    }

    fn views(&self, recordings: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let mut views = judged_views(blocks, &block::INPUTS, &block::OUTPUTS);
        views[0].effects.extend(packets::visible(&self.0, &recordings.pieces));
        views.extend(timing::views(&recordings.pieces));
        views
    }

    fn is_prismatic(&self) -> bool {
        self.0.prismatic
    }

    fn without_blocks(&self, pieces: &[Piece]) -> Option<(String, Vec<BlockView>)> {
        (!self.0.echoed).then(|| (timing::reason(pieces), timing::views(pieces)))
    }

    fn before_blocks(&self, recordings: &Recordings) -> (Vec<BlockAnswer>, Vec<Finding>) {
        timing::answers(&self.0, &recordings.pieces)
    }

    fn with_random(
        &self,
        recordings: &Recordings,
        block: &MeasuredBlock,
        without: &[String],
        answer: BlockAnswer,
    ) -> BlockAnswer {
        packets::with_random(&self.0, &recordings.pieces, block, without, answer)
    }

    fn odds_by_repeats(&self, recordings: &Recordings, block: &dyn Fn() -> MeasuredBlock, id: &str) -> Option<f64> {
        packets::odds(&self.0, &recordings.pieces, &block(), id)
    }
}
