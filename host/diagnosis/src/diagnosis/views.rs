//! Isolability from the signals of each plant, before any data are read.

use crate::diagnosis::{Prepared, facility};
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::plants::body::block as body;
use crate::plants::command::block as command;
use crate::plants::command::{packets, timing};
use crate::plants::contact::block as contact;
use crate::plants::sensor::block as sensor;
use crate::plants::sensor::excess_noise as variance;
use crate::plants::toss::block as toss;
use crate::{DiagnosisError, Result};
use softdock_campaign::rig::{CommandRig, RigModel, RobotRig, SensorRig};
use softdock_engine::blocks::BlockKind;
use std::collections::BTreeSet;

impl Prepared {
    /// The rows of the isolability matrix, block by block.
    ///
    /// # Errors
    /// A signal that the plant cannot be judged without, an id that is in no library.
    pub(super) fn views(&self) -> Result<Vec<BlockView>> {
        let views = match self.plant() {
            None => facility::views(&self.blocks(1)),
            Some(RigModel::Drive(_)) => self.drive_views()?,
            Some(RigModel::Robot(rig)) => self.robot_views(rig)?,
            Some(RigModel::Sensor(rig)) => self.sensor_views(rig),
            Some(RigModel::Contact(_)) => self.only_view(&contact::POSITIONS, &contact::FORCES),
            Some(RigModel::Command(rig)) => self.command_views(rig),
            Some(RigModel::Body(_)) => self.only_view(&body::WRENCH, &body::MOTION.map(|motion| motion.0)),
            Some(RigModel::Toss(_)) => self.only_view(&toss::POSES, &toss::WAYS.map(|way| way.0)),
        };
        let known: BTreeSet<&str> = views.iter().flat_map(|view| view.effects.iter().copied()).collect();
        if let Some(id) = self.without.iter().find(|id| !known.contains(id.as_str())) {
            let known: Vec<&str> = known.into_iter().collect();
            return Err(DiagnosisError::unfit(
                format!("no block has an effect `{id}`"),
                format!("write one of: {}", known.join(", ")),
            ));
        }
        Ok(views)
    }

    /// Of a rig with one block, whose signals the model file must name.
    fn only_view(&self, inputs: &[&'static str], outputs: &[&'static str]) -> Vec<BlockView> {
        let of =
            |(block, library): &(MeasuredBlock, Vec<Hypothesis>)| BlockView::judged(block, library, inputs, outputs);
        self.blocks(1).iter().map(of).collect()
    }

    fn sensor_views(&self, rig: &SensorRig) -> Vec<BlockView> {
        let mut views = self.only_view(&sensor::INPUTS, &sensor::READINGS.map(|reading| reading.0));
        views[0].effects.extend(variance::visible(rig, self.pieces()));
        views
    }

    fn command_views(&self, rig: &CommandRig) -> Vec<BlockView> {
        let mut views = self.only_view(&command::INPUTS, &command::OUTPUTS);
        views[0].effects.extend(packets::visible(rig, self.pieces()));
        views.extend(timing::views(self.pieces()));
        views
    }

    /// Of every axis, which must have its angle and its torque.
    fn robot_views(&self, rig: &RobotRig) -> Result<Vec<BlockView>> {
        for signal in (1..=rig.drives.len()).flat_map(|axis| [format!("q.{axis}"), format!("tau.{axis}")]) {
            if !self.has(&signal) {
                let what =
                    format!("the robot's model file names no column for `{signal}`: its axis cannot be diagnosed");
                let remedy = format!("add it to [log] there: \"r1.{signal}\" = {{ column = \"...\", unit = \"...\" }}");
                return Err(DiagnosisError::unfit(what, remedy));
            }
        }
        let view = |(block, library): &(MeasuredBlock, Vec<Hypothesis>)| {
            let outputs: &[&'static str] = if block.channels.len() > 1 { &["q", "q_link"] } else { &["q"] };
            BlockView::judged(block, library, &["tau"], outputs)
        };
        Ok(self.blocks(1).iter().map(view).collect())
    }

    fn drive_views(&self) -> Result<Vec<BlockView>> {
        for signal in ["q", "tau"] {
            if !self.has(signal) {
                let what =
                    format!("the [log] of the model file names no column for `{signal}`: no block can be diagnosed");
                return Err(DiagnosisError::unfit(
                    what,
                    format!("add it: \"{signal}\" = {{ column = \"...\", unit = \"...\" }}"),
                ));
            }
        }
        let mut views: Vec<BlockView> = Vec::new();
        let outputs: &[&str] = if self.has("q_link") { &["q", "q_link"] } else { &["q"] };
        for (block, library) in self.blocks(1) {
            let is_drive = block.section.is(BlockKind::Drive);
            let (inputs, outputs): (&[&str], &[&str]) =
                if is_drive { (&["tau"], outputs) } else { (&["ref", "q"], &["tau"]) };
            views.push(BlockView::judged(&block, &library, inputs, outputs));
        }
        if views.len() == 1 {
            let missing: &[&str] = if self.has("ref") { &["[controller] in the model file"] } else { &["ref"] };
            views.insert(0, BlockView::closed("R2 reference to torque", &["ref", "q"], &["tau"], missing));
        }
        Ok(views)
    }
}
