//! Torque between the samples of a log: selects, among the torques that the controller may have commanded, the one that
//! explains the motion, and withholds the verdict if none does.

use super::DrivePlant;
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::inference::adequacy::ADEQUATE;
use crate::model::block::MeasuredBlock;
use crate::plants::drive::block::drive_block;
use crate::verdict::answer::Residual;
use crate::verdict::judged::{Blocks, is_explained};
use softdock_engine::blocks::BlockKind;

/// Share of the controller's misfit that may be left where its torque between the samples is known.
const NEARLY_NOTHING: f64 = 1e-3;

impl DrivePlant {
    /// Returns, for each recording, the torque among those that the log allows with the least residual of the motion: a
    /// jump one period late is an impulse, which the drive's angle shows besides the nuisance parameters.
    pub(super) fn moving(&self, recordings: &Recordings, finer: usize, allowed: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let held = |experiment: &str| recordings.is_held_out(experiment);
        let most = allowed.iter().map(Vec::len).max().unwrap_or(0);
        let nth = |n: usize| -> Vec<Vec<f64>> { allowed.iter().map(|own| own[n.min(own.len() - 1)].clone()).collect() };
        let block = |n: usize| drive_block(&self.rig, &recordings.pieces, &held, finer, &nth(n));
        let blocks: Vec<MeasuredBlock> = (0..most).map(block).collect();
        let Some(set) = blocks.first().map(settled) else { return Vec::new() };
        let left: Vec<Vec<f64>> = blocks.iter().map(|block| block.misfits(&set)).collect();
        let least = |trial: usize| {
            (0..allowed[trial].len()).min_by(|a, b| left[*a][trial].total_cmp(&left[*b][trial])).expect("one at least")
        };
        let best: Vec<usize> = (0..allowed.len()).map(least).collect();
        allowed.into_iter().zip(best).map(|(mut own, best)| own.swap_remove(best)).collect()
    }
}

/// Withholds the verdict on the drive where neither the controller's torque nor the drive's motion is explained: a
/// torque jump between two samples is an unknown impulse. No cause is named in a controller whose torque does not
/// explain the motion.
pub(super) fn withhold(all: &mut Blocks, prismatic: bool) -> Option<Finding> {
    let place = |kind: BlockKind| all.judged.iter().position(|own| own.block.section.is(kind));
    let (Some(asked), Some(moved)) = (place(BlockKind::Controller), place(BlockKind::Drive)) else { return None };
    let periods = all.judged[asked].block.trials.iter().map(|trial| trial.recorded.stride).max().unwrap_or(1);
    let Residual { before, after } = all.answers[asked].residual;
    let is_known = periods == 1 || after.powi(2) <= ADEQUATE.max(NEARLY_NOTHING * before.powi(2));
    if is_known || is_explained(&all.answers[moved]) {
        return None;
    }
    let what = format!(
        "no cause explains the motion, but torque steps between the samples of the log may: the controller is \
         unexplained, and the log has only one in {periods} of its periods; no verdict on the drive; log every period"
    );
    let finding = all.withhold(moved, what);
    let answer = &mut all.answers[asked];
    if answer.answer.names() {
        *answer = all.judged[asked].looked_outside(answer.clone().without_name(), prismatic);
    }
    Some(finding)
}

/// Returns the block's parameters with fitted nuisance parameters; the nominal ones if the noise is not identifiable.
fn settled(block: &MeasuredBlock) -> Vec<f64> {
    let learn = block.part(false);
    let Some(noise) = learn.noise(&block.base) else { return block.base.clone() };
    learn.shortcut(&noise, &block.base).null().values(&block.base)
}
