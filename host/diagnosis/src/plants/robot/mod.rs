//! Robot: every axis under the load of gravity and of the other axes.

mod axes;
pub mod block;
mod links;

use super::{BlockWithLibrary, DiagnosedPlant, drive};
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::judged::Blocks;
use crate::{DiagnosisError, Result};
use axes::Axes;
use softdock_campaign::rig::RobotRig;
use std::cell::OnceCell;

/// The robot of a rig.
pub(crate) struct RobotPlant {
    rig: RobotRig,
    /// Loads of the axes, computed once for a set of gears.
    axes: OnceCell<Axes>,
    /// How often the axes were judged.
    passes: usize,
}

impl RobotPlant {
    /// Builds the plant, with the gears of the model.
    pub(crate) fn of(rig: RobotRig) -> Self {
        Self { rig, axes: OnceCell::new(), passes: 1 }
    }
}

impl DiagnosedPlant for RobotPlant {
    fn places(&self, _: &Recordings) -> usize {
        self.rig.drives.len()
    }

    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock {
        let loads = &self.axes(recordings).loads;
        let held = |name: &str| recordings.is_held_out(name);
        block::robot_block(&self.rig, place, &recordings.pieces, loads, &held, finer)
    }

    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        drive::hypotheses::effects(block)
    }

    fn dictionary(&self, block: &MeasuredBlock) -> Vec<Hypothesis> {
        drive::dictionary::forms(block)
    }

    fn views(&self, _: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let view = |(block, library): &BlockWithLibrary| {
            let outputs: &[&'static str] = if block.channels.len() > 1 { &["q", "q_link"] } else { &["q"] };
            BlockView::judged(block, library, &["tau"], outputs)
        };
        blocks.iter().map(view).collect()
    }

    /// Every axis must have its angle and its torque.
    fn require(&self, recordings: &Recordings) -> Result<()> {
        for signal in (1..=self.rig.drives.len()).flat_map(|axis| [format!("q.{axis}"), format!("tau.{axis}")]) {
            if !recordings.has(&signal) {
                let what =
                    format!("the robot's model file names no column for `{signal}`: its axis cannot be diagnosed");
                let remedy = format!("add it to [log] there: \"r1.{signal}\" = {{ column = \"...\", unit = \"...\" }}");
                return Err(DiagnosisError::unfit(what, remedy));
            }
        }
        Ok(())
    }

    fn needs_motion(&self) -> bool {
        true
    }

    fn update(&mut self, recordings: &Recordings, all: &Blocks) -> bool {
        self.passes += 1;
        self.passes <= axes::PASSES && self.update_loads(recordings, all)
    }

    fn withhold_at_last(&self, all: &mut Blocks) -> Vec<Finding> {
        axes::withhold_loaded(all)
    }
}
