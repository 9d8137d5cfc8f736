//! Plants: each with its blocks, hypotheses, views and random effects, in a folder of its name.
//!
//! A new plant is a folder with an implementation of `DiagnosedPlant`, and a row in `of_rig`.

pub mod body;
pub mod command;
pub mod contact;
pub mod drive;
pub mod facility;
pub mod robot;
pub mod sensor;
pub mod toss;

use crate::Result;
use crate::data::grid::{Finding, Piece};
use crate::data::hold_out::Every;
use crate::data::recordings::Recordings;
use crate::inference::identifiability::BlockIdentifiability;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::answer::BlockAnswer;
use crate::verdict::judged::{Blocks, Judged};
use softdock_campaign::rig::RigModel;

/// Returns the plant of a rig.
pub(crate) fn of_rig(model: RigModel) -> Box<dyn DiagnosedPlant> {
    match model {
        RigModel::Drive(rig) => Box::new(drive::DrivePlant::of(*rig)),
        RigModel::Robot(rig) => Box::new(robot::RobotPlant::of(*rig)),
        RigModel::Sensor(rig) => Box::new(sensor::SensorPlant(*rig)),
        RigModel::Contact(rig) => Box::new(contact::ContactPlant(*rig)),
        RigModel::Command(rig) => Box::new(command::CommandPlant(*rig)),
        RigModel::Body(rig) => Box::new(body::BodyPlant(*rig)),
        RigModel::Toss(rig) => Box::new(toss::TossPlant(*rig)),
    }
}

/// A block with its library.
pub(crate) type BlockWithLibrary = (MeasuredBlock, Vec<Hypothesis>);

/// Block that a path of the joint would record.
pub(crate) type Follower<'a> = Box<dyn Fn(&[f64]) -> MeasuredBlock + 'a>;

/// Plant that recordings are compared with: its blocks and libraries, its needs of the recordings, and the effects that
/// no fit of a block shows.
pub(crate) trait DiagnosedPlant {
    /// Returns how many blocks there are.
    fn places(&self, _recordings: &Recordings) -> usize {
        1
    }

    /// Returns the block at a place, simulated in steps `finer` times shorter than usual.
    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock;

    /// Returns the hypotheses of the block at a place.
    fn library(&self, recordings: &Recordings, place: usize, block: &MeasuredBlock) -> Vec<Hypothesis>;

    /// Returns the forms outside the catalogue that an unexplained residual of a block may have.
    fn dictionary(&self, _block: &MeasuredBlock) -> Vec<Hypothesis> {
        Vec::new()
    }

    /// Returns the isolability of its blocks, which come in the order of their places.
    fn views(&self, recordings: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView>;

    /// Checks that the recordings have the signals without which no block can be built.
    ///
    /// # Errors
    /// A missing signal.
    fn require(&self, _recordings: &Recordings) -> Result<()> {
        Ok(())
    }

    /// Returns whether its coordinate is a length, so that units of angles read as units of lengths.
    fn is_prismatic(&self) -> bool {
        false
    }

    /// Returns whether a channel that never changes is an error.
    fn needs_motion(&self) -> bool {
        false
    }

    /// Returns the experiments that are held out unless the user selects others.
    fn default_hold_out(&self) -> Option<Every> {
        None
    }

    /// Returns the source of the noise estimate without repeats.
    fn noise_without_repeats(&self) -> &'static str {
        "the noise is estimated from the residual of the richest hypothesis"
    }

    /// Returns the views of recordings that no block fits, with the reason why their answers are provisional; `None` if
    /// there are blocks.
    fn without_blocks(&self, _pieces: &[Piece]) -> Option<(String, Vec<BlockView>)> {
        None
    }

    /// Excludes effects from what is judged without a block; libraries of blocks are filtered elsewhere.
    fn exclude(&mut self, _without: &[String]) {}

    /// Returns answers and findings that need no block.
    fn before_blocks(&self, _recordings: &Recordings) -> (Vec<BlockAnswer>, Vec<Finding>) {
        (Vec::new(), Vec::new())
    }

    /// Returns the identifiability of effects that need no block.
    fn identifiability_before_blocks(
        &self,
        _recordings: &Recordings,
        _blocks: &[BlockWithLibrary],
    ) -> Option<BlockIdentifiability> {
        None
    }

    /// Returns the session that determines an effect, where that of its group is none of this plant's.
    fn session(&self, _id: &str) -> Option<&'static str> {
        None
    }

    /// Returns whether its usual steps are kept where they explain the recordings better than shorter ones.
    fn keeps_usual_steps(&self) -> bool {
        false
    }

    /// Applies a judged block to the blocks that follow; `finer` as for [`block`](Self::block).
    fn learn(&mut self, _recordings: &Recordings, _finer: usize, _judged: &Judged, _answer: &BlockAnswer) {}

    /// Returns an answer with what simulations of the whole recordings add.
    fn complete(&self, _recordings: &Recordings, _judged: &Judged, answer: BlockAnswer) -> BlockAnswer {
        answer
    }

    /// Returns an answer with the zero-mean effects, which repeats show; `without` lists excluded effects.
    fn with_random(
        &self,
        _recordings: &Recordings,
        _block: &MeasuredBlock,
        _without: &[String],
        answer: BlockAnswer,
    ) -> BlockAnswer {
        answer
    }

    /// Returns the log-odds of a zero-mean effect from repeat-to-repeat variance; `None` if the recordings do not
    /// determine them. `block` builds the first block.
    fn odds_by_repeats(&self, _recordings: &Recordings, _block: &dyn Fn() -> MeasuredBlock, _id: &str) -> Option<f64> {
        None
    }

    /// Withholds verdicts on blocks whose residual another block may cause, after each pass; returns the reasons.
    fn withhold(&self, _all: &mut Blocks) -> Vec<Finding> {
        Vec::new()
    }

    /// Applies identified effects that change other blocks; returns `false` if the blocks are unchanged.
    fn update(&mut self, _recordings: &Recordings, _all: &Blocks) -> bool {
        false
    }

    /// Withholds verdicts after the last pass; returns the reasons.
    fn withhold_at_last(&self, _all: &mut Blocks) -> Vec<Finding> {
        Vec::new()
    }

    /// Returns how a path of the joint would be recorded in a block, at the rate and with the signals of a recording,
    /// from the time `start` \[s\]; `None` if no motion can be proposed.
    fn follower<'a>(&'a self, _block: &'a MeasuredBlock, _like: &'a Piece, _start: f64) -> Option<Follower<'a>> {
        None
    }
}

/// Returns the views of plants whose model files must name all signals.
fn judged_views(blocks: &[BlockWithLibrary], inputs: &[&'static str], outputs: &[&'static str]) -> Vec<BlockView> {
    blocks.iter().map(|(block, library)| BlockView::judged(block, library, inputs, outputs)).collect()
}
