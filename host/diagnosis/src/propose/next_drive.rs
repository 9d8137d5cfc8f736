//! Run to drive next, if the drives of a facility do not discriminate between several causes.

use crate::Result;
use crate::data::drive_log::DriveLog;
use crate::model::block::MeasuredBlock;
use crate::plants::facility::block::{FacilityModel, motion_section, wrench_section};
use crate::propose::experiment::{ProposedExperiment, best_drive};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict};
use crate::verdict::decide::rivals;
use crate::verdict::judged::Judged;
use std::path::Path;

/// Returns the run that separates the rivals of an ambiguous answer best, from runs rehearsed on an emulated facility
/// (number and log of each); `None` if the answer is not ambiguous.
///
/// # Errors
/// A log that cannot be read.
pub(crate) fn next_drive(
    model: &FacilityModel,
    answers: &[BlockAnswer],
    judged: &[Judged],
    rehearsed: &[(u64, &Path)],
) -> Result<Option<ProposedExperiment>> {
    let Some(place) = answers.iter().position(|answer| answer.answer == DiagnosisVerdict::Ambiguous) else {
        return Ok(None);
    };
    let Judged { block, library, judgement, .. } = &judged[place];
    let rivals = rivals(block, library, judgement);
    let blocks: Result<Vec<(MeasuredBlock, u64)>> = rehearsed
        .iter()
        .map(|(run, log)| {
            let log = [DriveLog::read(log, model.scenario().model.timing.tick(), &mut Vec::new())?];
            let own = match place {
                0 => motion_section(model, &log, &|_| false, 1),
                _ => wrench_section(model, &log, &|_| false, 1),
            };
            let (decimator, simulator) = (block.decimator.clone(), block.simulator.clone());
            Ok((MeasuredBlock { decimator, simulator, ..own }, *run))
        })
        .collect();
    Ok(if rivals.len() > 1 { best_drive(blocks?, &rivals, &judgement.noise) } else { None })
}
