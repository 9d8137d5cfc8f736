//! Body tossed onto a plane.

pub mod block;
mod free_run;
pub mod hypotheses;

use super::{BlockWithLibrary, DiagnosedPlant, judged_views};
use crate::data::grid::Piece;
use crate::data::hold_out::Every;
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::answer::BlockAnswer;
use crate::verdict::free_run::FreeRun;
use crate::verdict::judged::Judged;
use softdock_campaign::rig::TossRig;

/// The tossed body of a rig.
pub(crate) struct TossPlant(pub(crate) TossRig);

impl DiagnosedPlant for TossPlant {
    fn block(&self, recordings: &Recordings, _: usize, finer: usize) -> MeasuredBlock {
        block::toss_block(&self.0, &recordings.pieces, &|name| recordings.is_held_out(name), finer)
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        hypotheses::effects(block)
    }

    fn views(&self, _: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        judged_views(blocks, &block::POSES, &block::WAYS.map(|way| way.0))
    }

    /// Every fourth toss: what follows a moment of a toss is not a separate motion.
    fn default_hold_out(&self) -> Option<Every> {
        Some(Every { divisor: 4, rest: 1 })
    }

    fn noise_without_repeats(&self) -> &'static str {
        "the noise is estimated in free flight; impact-to-impact variance counts as unexplained"
    }

    /// Adds the errors of free runs, on held-out tosses if there are any.
    fn complete(&self, recordings: &Recordings, judged: &Judged, answer: BlockAnswer) -> BlockAnswer {
        let own = |piece: &&Piece| recordings.is_held_out(&piece.experiment) == answer.held_out;
        let pieces: Vec<&Piece> = recordings.pieces.iter().filter(own).collect();
        BlockAnswer { free_run: FreeRun::of(&self.0, &pieces, answer.held_out, judged), ..answer }
    }
}
