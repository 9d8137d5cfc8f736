//! What can only be measured with the truth at hand: the gain that an answer's model truly brings.

use crate::exhibit::{files, read_exact};
use crate::record::TrueGain;
use crate::{Error, Result};
use nalgebra::DVector;
use softdock_diagnosis::block::MeasuredBlock;
use softdock_diagnosis::diagnosis::Judged;
use softdock_diagnosis::inference::noise::Noise;
use softdock_gauntlet::Expected;
use std::collections::BTreeSet;
use std::path::Path;

/// The true gain of a block's best explanation: the means of ever more recordings in place of those that it was judged by,
/// and a motion that no recording shows. `folder` is the diagnosed one; the held-out recordings in it are left alone.
///
/// # Errors
/// Files that cannot be written or read.
pub(crate) fn true_gain(folder: &Path, judged: &Judged, expected: &Expected) -> Result<Option<TrueGain>> {
    let Judged { block, judgement, .. } = judged;
    let Some(best) = judgement.ranking.iter().find(|candidate| candidate.sound) else {
        return Ok(None);
    };
    let sets = [judgement.clamped.values(&block.base), best.fitted.values(&block.base)];
    let repeats = repeats(block);
    let of = |name: &str, recordings: &[(String, String)], scale: f64, noise_power: f64| -> Result<f64> {
        let truth = folder.join(name);
        std::fs::create_dir_all(&truth).map_err(Error::file(&truth))?;
        for (file, text) in recordings {
            std::fs::write(truth.join(file), text).map_err(Error::file(&truth))?;
        }
        let blocks = read_exact(folder, &files(&truth)?)?.blocks(1);
        let own = blocks.into_iter().find(|(own, _)| own.name == block.name);
        let (mut own, _) = own.ok_or_else(|| Error::Model(format!("no block {}", block.name)))?;
        own.decimator = block.decimator.clone();
        Ok(gain(&own, &judgement.noise, &sets, [scale, noise_power]))
    };
    let own = block.part(true).noise_power(&judgement.noise, &block.base);
    let held_out = of("expected", &expected.holdout, 1.0, own)?;
    let fresh = of("fresh", &[("fresh_1.csv".to_owned(), expected.fresh.clone())], repeats, 1.0)?;
    Ok(Some(TrueGain { held_out, fresh }))
}

/// Repeats of a held-out motion, whose mean is judged; one where every recording is an experiment of its own.
fn repeats(block: &MeasuredBlock) -> f64 {
    let held_out = || block.trials.iter().filter(|trial| trial.held_out).map(|trial| &trial.experiment);
    let experiments: BTreeSet<&String> = held_out().collect();
    held_out().count() as f64 / experiments.len().max(1) as f64
}

/// By how much the root mean square of held-out residuals, so many times as strong, falls from the first parameter set to
/// the second, noise of some power added to both.
fn gain(block: &MeasuredBlock, noise: &Noise, sets: &[Vec<f64>; 2], [scale, noise_power]: [f64; 2]) -> f64 {
    let power = |residual: &DVector<f64>| noise_power + scale * residual.norm_squared() / residual.len() as f64;
    let residuals = block.part(true).whitened(noise, sets);
    1.0 - (power(&residuals[1]) / power(&residuals[0])).sqrt()
}
