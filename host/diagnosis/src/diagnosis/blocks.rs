//! Blocks that the channels of a model allow, each with its library.

use crate::diagnosis::{Prepared, Subject};
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::plants::body::block::body_block;
use crate::plants::command::block::command_block;
use crate::plants::command::packets;
use crate::plants::contact::block::contact_block;
use crate::plants::drive::block::drive_block;
use crate::plants::drive::controller::controller_block;
use crate::plants::facility::block::{motion_section, wrench_section};
use crate::plants::robot::block::robot_block;
use crate::plants::sensor::block::sensor_block;
use crate::plants::toss::block::toss_block;
use crate::plants::{body, command, contact, drive, facility, sensor, toss};
use softdock_campaign::rig::{ControllerRig, DriveRig, RigModel};

impl Prepared {
    /// All blocks, simulated in steps so many times finer than usual.
    pub fn blocks(&self, finer: usize) -> Vec<(MeasuredBlock, Vec<Hypothesis>)> {
        (0..self.places()).map(|place| self.block(place, finer)).collect()
    }

    /// How many blocks there are.
    pub(super) fn places(&self) -> usize {
        match self.plant() {
            None => 2,
            Some(RigModel::Drive(rig)) if self.controller(rig).is_some() => 2,
            Some(RigModel::Robot(rig)) => rig.drives.len(),
            Some(RigModel::Command(rig)) if !rig.echoed => 0,
            Some(_) => 1,
        }
    }

    /// The block at a place, simulated in steps so many times finer than usual.
    pub(super) fn block(&self, place: usize, finer: usize) -> (MeasuredBlock, Vec<Hypothesis>) {
        let held = |experiment: &str| self.held_out.contains(experiment);
        let (rig, pieces) = match &self.subject {
            Subject::Facility(model, logs) => {
                let scenario = &model.scenario().model;
                return match place {
                    0 => self.with(motion_section(model, logs, &held, finer), |b| {
                        facility::hypotheses::of_motion(b, scenario)
                    }),
                    _ => self.with(wrench_section(model, logs, &held, finer), |b| {
                        facility::hypotheses::of_wrench(b, scenario)
                    }),
                };
            }
            Subject::Rig(rig, pieces) => (rig, pieces),
        };
        match &rig.plant {
            RigModel::Drive(rig) => match self.controller(rig).filter(|_| place == 0) {
                Some(own) => {
                    self.with(controller_block(rig, own, pieces, &held), drive::controller_hypotheses::effects)
                }
                None => self.with(drive_block(rig, pieces, &held, finer, &self.torque), drive::hypotheses::effects),
            },
            RigModel::Robot(rig) => {
                let loads = &self.axes(rig).loads;
                self.with(robot_block(rig, place, pieces, loads, &held, finer), drive::hypotheses::effects)
            }
            RigModel::Sensor(rig) => self.with(sensor_block(rig, pieces, &held, finer), sensor::hypotheses::effects),
            RigModel::Contact(rig) => self.with(contact_block(rig, pieces, &held, finer), contact::hypotheses::effects),
            RigModel::Command(rig) => self.with(command_block(rig, pieces, &held, finer), |block| {
                command::hypotheses::effects(block, packets::hold(pieces))
            }),
            RigModel::Body(rig) => self.with(body_block(rig, pieces, &held, finer), body::hypotheses::effects),
            RigModel::Toss(rig) => self.with(toss_block(rig, pieces, &held, finer), toss::hypotheses::effects),
        }
    }

    /// A drive's controller, if what it was asked is known.
    fn controller<'r>(&self, rig: &'r DriveRig) -> Option<&'r ControllerRig> {
        rig.controller.as_ref().filter(|_| self.has("ref"))
    }

    /// A block by the simulator that was chosen, with its library.
    fn with(
        &self,
        block: MeasuredBlock,
        library: impl Fn(&MeasuredBlock) -> Vec<Hypothesis>,
    ) -> (MeasuredBlock, Vec<Hypothesis>) {
        let block = MeasuredBlock { simulator: self.simulator.clone(), ..block };
        let library = library(&block);
        (block, library)
    }
}
