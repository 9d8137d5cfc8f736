//! Force/torque sensor under known loads.

pub mod block;
pub mod excess_noise;
pub mod hypotheses;
mod quantisation;

use super::{BlockWithLibrary, DiagnosedPlant, judged_views};
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::answer::BlockAnswer;
use excess_noise::excess_noise;
use softdock_campaign::rig::SensorRig;

/// The sensor of a rig.
pub(crate) struct SensorPlant(pub(crate) SensorRig);

impl DiagnosedPlant for SensorPlant {
    fn block(&self, recordings: &Recordings, _: usize, finer: usize) -> MeasuredBlock {
        block::sensor_block(&self.0, &recordings.pieces, &|name| recordings.is_held_out(name), finer)
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        hypotheses::effects(block)
    }

    fn views(&self, recordings: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let mut views = judged_views(blocks, &block::INPUTS, &block::READINGS.map(|reading| reading.0));
        views[0].effects.extend(excess_noise::visible(&self.0, &recordings.pieces));
        views
    }

    fn with_random(
        &self,
        _: &Recordings,
        block: &MeasuredBlock,
        without: &[String],
        answer: BlockAnswer,
    ) -> BlockAnswer {
        match excess_noise(&self.0, block) {
            Some(noise) => answer.with_noise(&noise, without),
            None => answer,
        }
    }

    fn odds_by_repeats(&self, _: &Recordings, block: &dyn Fn() -> MeasuredBlock, _: &str) -> Option<f64> {
        excess_noise(&self.0, &block()).map(|noise| noise.log_odds)
    }
}
