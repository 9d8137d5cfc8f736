//! Robot: every axis under the load of gravity and of the other axes.

mod axes;
pub mod block;
mod coupling;
mod links;
mod whole;

use super::{BlockWithLibrary, DiagnosedPlant, drive};
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::inference::identifiability::BlockIdentifiability;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::verdict::answer::BlockAnswer;
use crate::verdict::judged::Blocks;
use crate::{DiagnosisError, Result};
use axes::Axes;
use softdock_campaign::rig::{LOAD_EFFECT, RobotRig};
use std::cell::OnceCell;
use whole::Whole;

/// The robot of a rig.
pub(crate) struct RobotPlant {
    rig: RobotRig,
    /// Effects that are not judged.
    without: Vec<String>,
    /// Errors of the robot as a whole, and the robot with them.
    whole: OnceCell<Whole>,
    /// Loads of the axes, computed once for a set of gears.
    axes: OnceCell<Axes>,
    /// How often the axes were judged.
    passes: usize,
}

impl RobotPlant {
    /// Builds the plant, with the gears of the model.
    pub(crate) fn of(rig: RobotRig) -> Self {
        Self { rig, without: Vec::new(), whole: OnceCell::new(), axes: OnceCell::new(), passes: 1 }
    }

    /// Returns the judgement of the robot as a whole.
    fn whole(&self, recordings: &Recordings) -> &Whole {
        self.whole.get_or_init(|| Whole::of(&self.rig, recordings, &self.without))
    }
}

impl DiagnosedPlant for RobotPlant {
    fn places(&self, _: &Recordings) -> usize {
        self.rig.drives.len()
    }

    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock {
        let loads = &self.axes(recordings).loads;
        let held = |name: &str| recordings.is_held_out(name);
        block::robot_block(&self.whole(recordings).rig, place, &recordings.pieces, loads, &held, finer)
    }

    /// A load at the flange acts on several axes, and is judged in the torques of all.
    fn library(&self, _: &Recordings, _: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        let mut library = drive::hypotheses::effects(block);
        library.retain(|hypothesis| hypothesis.effect.id != LOAD_EFFECT);
        library
    }

    fn exclude(&mut self, without: &[String]) {
        self.without = without.to_vec();
    }

    fn before_blocks(&self, recordings: &Recordings) -> (Vec<BlockAnswer>, Vec<Finding>) {
        let Whole { answer, findings, .. } = self.whole(recordings);
        (answer.iter().cloned().collect(), findings.clone())
    }

    fn identifiability_before_blocks(
        &self,
        recordings: &Recordings,
        _: &[BlockWithLibrary],
    ) -> Option<BlockIdentifiability> {
        self.whole(recordings).identifiability.clone()
    }

    fn dictionary(&self, block: &MeasuredBlock) -> Vec<Hypothesis> {
        drive::dictionary::forms(block)
    }

    fn views(&self, _: &Recordings, blocks: &[BlockWithLibrary]) -> Vec<BlockView> {
        let view = |(block, library): &BlockWithLibrary| {
            let outputs: &[&'static str] = if block.channels.len() > 1 { &["q", "q_link"] } else { &["q"] };
            BlockView::judged(block, library, &["tau"], outputs)
        };
        std::iter::once(whole::view()).chain(blocks.iter().map(view)).collect()
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
