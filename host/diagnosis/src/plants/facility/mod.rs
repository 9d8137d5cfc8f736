//! Whole facility: command to motion, and motion to wrench.

pub mod block;
pub mod hypotheses;

use super::{BlockWithLibrary, DiagnosedPlant};
use crate::data::drive_log::DriveLog;
use crate::data::recordings::Recordings;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use block::{FacilityModel, MOTION, WRENCH, motion_section, wrench_section};

/// A facility with the logs of its drives.
pub(crate) struct FacilityPlant {
    /// Its model.
    pub(crate) model: FacilityModel,
    /// Logs of its drives, training and held out.
    pub(crate) logs: Vec<DriveLog>,
}

impl DiagnosedPlant for FacilityPlant {
    fn places(&self, _: &Recordings) -> usize {
        2
    }

    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock {
        let held = |name: &str| recordings.is_held_out(name);
        match place {
            0 => motion_section(&self.model, &self.logs, &held, finer),
            _ => wrench_section(&self.model, &self.logs, &held, finer),
        }
    }

    fn library(&self, _: &Recordings, place: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        let scenario = &self.model.scenario().model;
        match place {
            0 => hypotheses::of_motion(block, scenario),
            _ => hypotheses::of_wrench(block, scenario),
        }
    }

    fn views(&self, _: &Recordings, sections: &[BlockWithLibrary]) -> Vec<BlockView> {
        let view = |place: usize, inputs: &[&'static str], outputs: &[&'static str]| {
            let (block, library) = &sections[place];
            BlockView::judged(block, library, inputs, outputs)
        };
        vec![view(0, &["commands"], &MOTION), view(1, &["motion of the parts"], &WRENCH)]
    }

    /// An emulated facility moves in the steps of its scenario.
    fn keeps_usual_steps(&self) -> bool {
        true
    }
}
