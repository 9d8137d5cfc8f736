//! Blocks that the channels of a model allow, each with its library.

use super::{Prepared, Subject};
use crate::block::MeasuredBlock;
use crate::block::body::body_block;
use crate::block::command::command_block;
use crate::block::contact::contact_block;
use crate::block::controller::controller_block;
use crate::block::drive::drive_block;
use crate::block::facility::{motion_section, wrench_section};
use crate::block::robot::robot_block;
use crate::block::sensor::sensor_block;
use crate::block::toss::toss_block;
use crate::library::{self, Hypothesis};
use crate::packets;
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
                    0 => self
                        .with(motion_section(model, logs, &held, finer), |b| library::facility::of_motion(b, scenario)),
                    _ => self
                        .with(wrench_section(model, logs, &held, finer), |b| library::facility::of_wrench(b, scenario)),
                };
            }
            Subject::Rig(rig, pieces) => (rig, pieces),
        };
        match &rig.plant {
            RigModel::Drive(rig) => match self.controller(rig).filter(|_| place == 0) {
                Some(own) => self.with(controller_block(rig, own, pieces, &held), library::controller::effects),
                None => self.with(drive_block(rig, pieces, &held, finer, &self.torque), library::drive::effects),
            },
            RigModel::Robot(rig) => {
                let loads = &self.axes(rig).loads;
                self.with(robot_block(rig, place, pieces, loads, &held, finer), library::drive::effects)
            }
            RigModel::Sensor(rig) => self.with(sensor_block(rig, pieces, &held, finer), library::sensor::effects),
            RigModel::Contact(rig) => self.with(contact_block(rig, pieces, &held, finer), library::contact::effects),
            RigModel::Command(rig) => self.with(command_block(rig, pieces, &held, finer), |block| {
                library::command::effects(block, packets::hold(pieces))
            }),
            RigModel::Body(rig) => self.with(body_block(rig, pieces, &held, finer), library::body::effects),
            RigModel::Toss(rig) => self.with(toss_block(rig, pieces, &held, finer), library::toss::effects),
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
