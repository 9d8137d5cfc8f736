//! Whole facility: command to motion, and motion to wrench.

pub mod block;
pub mod hypotheses;
mod sessions;

use super::{BlockWithLibrary, DiagnosedPlant};
use crate::data::drive_log::DriveLog;
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::inference::identifiability::{BlockIdentifiability, Determination, IdentifiabilityRow};
use crate::inference::judge::misfits_with;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::model::place;
use crate::verdict::answer::BlockAnswer;
use crate::verdict::judged::{Blocks, Judged};
use block::{FacilityModel, MOTION, WRENCH, motion_section, wrench_section};
use softdock_kernels::effects::{EFFECTS, Effect, EffectBlock, row_of};
use softdock_kernels::fields::fields;
use softdock_kernels::params::Params;
use std::collections::{BTreeMap, BTreeSet};

/// A facility with the logs of its drives.
pub(crate) struct FacilityPlant {
    /// Its model.
    pub(crate) model: FacilityModel,
    /// Logs of its drives, training and held out.
    pub(crate) logs: Vec<DriveLog>,
    /// Parameters that all drives share, whatever the campaign draws for each, by the effects that have them.
    shared: BTreeMap<&'static str, BTreeSet<usize>>,
}

/// Share of the misfit that a common value must leave at most, to replace the draws of a campaign.
const LEFT: f64 = 0.5;

impl FacilityPlant {
    /// Builds the plant of a facility.
    pub(crate) fn of(model: FacilityModel, logs: Vec<DriveLog>) -> Self {
        Self { model, logs, shared: BTreeMap::new() }
    }

    /// Returns a section in which all drives have the nominal values of parameters.
    fn with_shared<'f>(mut block: MeasuredBlock, fields: impl IntoIterator<Item = &'f usize>) -> MeasuredBlock {
        for field in fields {
            block.trials.iter_mut().for_each(|trial| trial.recorded.offsets[*field] = 0.0);
        }
        block
    }

    /// Returns the effect, with its parameters, whose common value explains the drives best: a facility has one delay,
    /// and a campaign that disperses it draws another for each run. `None` if the draws explain them as well.
    fn best_shared(&self, judged: &Judged) -> Option<(&'static str, BTreeSet<usize>)> {
        let block = &judged.block;
        let is_drawn = |field: &usize| block.trials.iter().any(|trial| trial.recorded.offsets[*field] != 0.0);
        let tried = judged.library.iter().filter_map(|hypothesis| {
            let fields = hypothesis.unknowns.iter().map(|unknown| unknown.field);
            let drawn: BTreeSet<usize> = fields.filter(is_drawn).collect();
            let shared = (!drawn.is_empty()).then(|| Self::with_shared(block.clone(), &drawn))?;
            let [draws, common] = misfits_with([block, &shared], hypothesis)?;
            Some((common / draws, hypothesis.effect.id, drawn))
        });
        let (left, id, fields) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (left < LEFT).then_some((id, fields))
    }
}

impl DiagnosedPlant for FacilityPlant {
    /// Motion, and contact with sensor where drives for both training and validation have run.
    fn places(&self, recordings: &Recordings) -> usize {
        let has_run =
            |held_out: bool| self.logs.iter().any(|log| log.has_run && recordings.is_held_out(&log.name) == held_out);
        if has_run(false) && has_run(true) { 2 } else { 1 }
    }

    fn block(&self, recordings: &Recordings, place: usize, finer: usize) -> MeasuredBlock {
        let held = |name: &str| recordings.is_held_out(name);
        let block = match place {
            0 => motion_section(&self.model, &self.logs, &held, finer),
            _ => wrench_section(&self.model, &self.logs, &held, finer),
        };
        Self::with_shared(block, self.shared.values().flatten())
    }

    fn library(&self, _: &Recordings, place: usize, block: &MeasuredBlock) -> Vec<Hypothesis> {
        let scenario = &self.model.scenario().model;
        match place {
            0 => hypotheses::of_motion(block, scenario),
            _ => hypotheses::of_wrench(block, scenario),
        }
    }

    fn before_blocks(&self, recordings: &Recordings) -> (Vec<BlockAnswer>, Vec<Finding>) {
        let finding = || Finding {
            recording: self.model.scenario().id.clone(),
            what: "contact and sensor are not judged: that takes a training and a held-out drive whose runs began"
                .to_owned(),
        };
        (Vec::new(), (self.places(recordings) == 1).then(finding).into_iter().collect())
    }

    /// Lists the effects that no signal of a drive shows.
    fn identifiability_before_blocks(
        &self,
        _: &Recordings,
        blocks: &[BlockWithLibrary],
    ) -> Option<BlockIdentifiability> {
        let judged: BTreeSet<&str> =
            blocks.iter().flat_map(|(_, library)| library).map(|hypothesis| hypothesis.effect.id).collect();
        // Robots have either a lag or drives with joints, by the scenario.
        let hidden = EFFECTS.iter().filter(|effect| effect.block != EffectBlock::Robot && !judged.contains(effect.id));
        let fields = fields::<f64, Params<f64>>();
        let row = |effect: &Effect| {
            let size = &effect.parameters[0];
            let field = fields.iter().find(|field| field.name == size.field);
            IdentifiabilityRow {
                id: Some(effect.id),
                name: effect.name,
                parameter: size.field.to_owned(),
                unit: field.map_or("1", |field| field.unit),
                plausible: size.scale,
                deviation: f64::INFINITY,
                log_odds: 0.0,
                determination: Determination::Not,
                session: None,
            }
        };
        let rows = hidden.map(row).collect();
        Some(BlockIdentifiability { block: place::FACILITY.name, rows, confounded: Vec::new() })
    }

    fn session(&self, id: &str) -> Option<&'static str> {
        sessions::session(id)
    }

    fn views(&self, _: &Recordings, sections: &[BlockWithLibrary]) -> Vec<BlockView> {
        let view = |place: usize, inputs: &[&'static str], outputs: &[&'static str]| {
            let (block, library) = &sections[place];
            BlockView::judged(block, library, inputs, outputs)
        };
        let all = [(&["commands"], &MOTION[..]), (&["motion of the parts"], &WRENCH[..])];
        let own = all.into_iter().zip(0..sections.len());
        own.map(|((inputs, outputs), place)| view(place, inputs, outputs)).collect()
    }

    /// Gives all drives one value of what their campaign draws for each, where that explains the drives better. Without
    /// repeats the noise is what the richest hypothesis leaves: drives that none explains do not look unexplained.
    fn update(&mut self, _: &Recordings, all: &Blocks) -> bool {
        let found: Vec<_> = all.judged.iter().filter_map(|judged| self.best_shared(judged)).collect();
        let is_new = !found.is_empty();
        found.into_iter().for_each(|(effect, fields)| self.shared.entry(effect).or_default().extend(fields));
        is_new
    }

    fn withhold_at_last(&self, _: &mut Blocks) -> Vec<Finding> {
        let finding = |effect: &&'static str| Finding {
            recording: self.model.scenario().id.clone(),
            what: format!(
                "{} ({effect}): the drives share one value; the campaign's draws of it, another for each run, do not describe \
                 them and are not used",
                row_of(effect).map_or_else(String::new, Effect::words)
            ),
        };
        self.shared.keys().map(finding).collect()
    }

    /// An emulated facility moves in the steps of its scenario.
    fn keeps_usual_steps(&self) -> bool {
        true
    }
}
