//! True gain of an answer's model, which requires the truth.

use crate::record::TrueGain;
use crate::recordings_folder::{files, read};
use crate::{GauntletError, Result};
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_diagnosis::inference::noise::Noise;
use softdock_diagnosis::model::block::MeasuredBlock;
use softdock_diagnosis::verdict::judged::Judged;
use softdock_gauntlet::Further;
use std::path::Path;

/// Returns the true gain of a block's best hypothesis, on further recordings of the held-out motion and of an
/// unrecorded motion. `folder` is the diagnosed one; its held-out recordings are unchanged.
///
/// # Errors
/// Files that cannot be written or read.
pub(crate) fn true_gain(folder: &Path, judged: &Judged, further: &Further) -> Result<Option<TrueGain>> {
    let Judged { block, judgement, .. } = judged;
    let Some(best) = judgement.ranking.iter().find(|candidate| candidate.admissible) else {
        return Ok(None);
    };
    let sets = [judgement.clamped.values(&block.base), best.fitted.values(&block.base)];
    let of = |name: &str, recordings: &[(String, String)]| -> Result<f64> {
        let subfolder = folder.join(name);
        std::fs::create_dir_all(&subfolder).map_err(GauntletError::file(&subfolder))?;
        for (file, text) in recordings {
            std::fs::write(subfolder.join(file), text).map_err(GauntletError::file(&subfolder))?;
        }
        let blocks = read(folder, &files(&subfolder)?, &DiagnosisOptions::default())?.blocks(1);
        let own = blocks.into_iter().find(|(own, _)| own.name == block.name);
        let (mut own, _) = own.ok_or_else(|| GauntletError::Model(format!("no block {}", block.name)))?;
        own.decimator = block.decimator.clone();
        Ok(gain(&own, &judgement.noise, &sets))
    };
    Ok(Some(TrueGain { held_out: of("further", &further.holdout)?, fresh: of("fresh", &further.fresh)? }))
}

/// Returns the relative reduction of the held-out residuals' root mean square from the first parameter set to the
/// second, compensated for propagated input noise.
fn gain(block: &MeasuredBlock, noise: &Noise, sets: &[Vec<f64>; 2]) -> f64 {
    let part = block.part(true);
    let residuals = part.whitened(noise, sets);
    let carried = part.carried(noise, sets);
    let power = |i: usize| residuals[i].norm_squared() / residuals[i].len() as f64 - carried[i].max(0.0);
    1.0 - (power(1) / power(0)).sqrt()
}
