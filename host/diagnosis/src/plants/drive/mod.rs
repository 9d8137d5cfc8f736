//! One joint with its drive and controller.

pub mod block;
pub mod controller;
pub mod controller_hypotheses;
pub mod dictionary;
pub mod hypotheses;
mod torque;
pub(crate) mod unit_checks;

use super::{BlockWithLibrary, DiagnosedPlant, Follower};
use crate::data::grid::{Finding, Piece};
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::model::place;
use crate::verdict::answer::BlockAnswer;
use crate::verdict::judged::{Blocks, Judged};
use crate::{DiagnosisError, Result};
use block::{drive_block, followed};
use controller::{controller_block, torques_between};
use softdock_campaign::rig::{ControllerRig, DriveRig};
use softdock_engine::blocks::BlockKind;

/// The drive of a rig.
pub(crate) struct DrivePlant {
    rig: DriveRig,
    /// Torque of each recording between the log's samples too, once its controller is understood.
    torque: Vec<Vec<f64>>,
}

impl DrivePlant {
    /// Builds the plant, with the torque as logged.
    pub(crate) fn of(rig: DriveRig) -> Self {
        Self { rig, torque: Vec::new() }
    }

    /// The controller, if its reference is recorded.
    fn controller(&self, recordings: &Recordings) -> Option<&ControllerRig> {
        self.rig.controller.as_ref().filter(|_| recordings.has("ref"))
    }
}

impl DiagnosedPlant for DrivePlant {
    fn places(&self, recordings: &Recordings) -> usize {
        if self.controller(recordings).is_some() { 2 } else { 1 }
    }

    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock {
        let (pieces, held) = (&recordings.pieces, |name: &str| recordings.is_held_out(name));
        match self.controller(recordings).filter(|_| place == 0) {
            Some(own) => controller_block(&self.rig, own, pieces, &held),
            None => drive_block(&self.rig, pieces, &held, finer, &self.torque),
        }
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        match block.section.is(BlockKind::Controller) {
            true => controller_hypotheses::effects(block),
            false => hypotheses::effects(block),
        }
    }

    fn dictionary(&self, block: &MeasuredBlock) -> Vec<Hypothesis> {
        dictionary::forms(block)
    }

    fn views(&self, recordings: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let mut views: Vec<BlockView> = Vec::new();
        let outputs: &[&str] = if recordings.has("q_link") { &["q", "q_link"] } else { &["q"] };
        for (block, library) in blocks {
            let is_drive = block.section.is(BlockKind::Drive);
            let (inputs, outputs): (&[&str], &[&str]) =
                if is_drive { (&["tau"], outputs) } else { (&["ref", "q"], &["tau"]) };
            views.push(BlockView::judged(block, library, inputs, outputs));
        }
        if views.len() == 1 {
            let missing: &[&str] = if recordings.has("ref") { &["[controller] in the model file"] } else { &["ref"] };
            views.insert(0, BlockView::closed(place::CONTROLLER.name, &["ref", "q"], &["tau"], missing));
        }
        views
    }

    fn require(&self, recordings: &Recordings) -> Result<()> {
        for signal in ["q", "tau"] {
            if !recordings.has(signal) {
                let what =
                    format!("the [log] of the model file names no column for `{signal}`: no block can be diagnosed");
                return Err(DiagnosisError::unfit(
                    what,
                    format!("add it: \"{signal}\" = {{ column = \"...\", unit = \"...\" }}"),
                ));
            }
        }
        Ok(())
    }

    fn is_prismatic(&self) -> bool {
        self.rig.prismatic
    }

    fn needs_motion(&self) -> bool {
        true
    }

    fn before_blocks(&self, recordings: &Recordings) -> (Vec<BlockAnswer>, Vec<Finding>) {
        (Vec::new(), unit_checks::check_units(&self.rig, &recordings.pieces))
    }

    /// Takes the torque between the log's samples from the controller, if its block is explained.
    fn learn(&mut self, recordings: &Recordings, finer: usize, judged: &Judged, answer: &BlockAnswer) {
        if let Some(found) = judged.found(answer).filter(|_| judged.block.section.is(BlockKind::Controller)) {
            self.torque = self.moving(recordings, finer, torques_between(&judged.block, found));
        }
    }

    fn withhold(&self, all: &mut Blocks) -> Vec<Finding> {
        torque::withhold(all, self.rig.prismatic).into_iter().collect()
    }

    fn follower<'a>(&'a self, block: &'a MeasuredBlock, like: &'a Piece, start: f64) -> Option<Follower<'a>> {
        Some(Box::new(move |path| {
            let mut piece = followed(&self.rig, start, like.step, path);
            piece.signals.retain(|name, _| like.signals.contains_key(name));
            match &self.rig.controller {
                Some(controller) if block.section.is(BlockKind::Controller) => {
                    controller_block(&self.rig, controller, &[piece], &|_| false)
                }
                _ => drive_block(&self.rig, &[piece], &|_| false, 1, &[]),
            }
        }))
    }
}
