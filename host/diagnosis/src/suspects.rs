//! Channels that fit the model far better by another unit or with the other sign: mistakes that no effect explains.

use crate::block::drive::drive_block;
use crate::recording::grid::{Finding, Piece};
use softdock_campaign::rig::DriveRig;

/// Factors by which a channel may be wrong, in words.
const FACTORS: [(f64, &str); 9] = [
    (-1.0, "with its sign reversed"),
    (2.0, "times 2"),
    (0.5, "times 0.5"),
    (9.80665, "times 9.81, as if it stood in kgf"),
    (1.0 / 9.80665, "divided by 9.81"),
    (180.0 / std::f64::consts::PI, "times 180/pi, as if degrees and radians were swapped"),
    (std::f64::consts::PI / 180.0, "times pi/180, as if it stood in degrees"),
    (1e3, "times 1000"),
    (1e-3, "divided by 1000"),
];

/// Mean square of the whitened residual above which a channel is suspected at all, and below which a factor is believed.
const SUSPICIOUS: f64 = 4.0;

/// What a drive's channels are suspected of.
pub(crate) fn suspects(rig: &DriveRig, pieces: &[Piece]) -> Vec<Finding> {
    let Some(as_is) = misfit(rig, pieces).filter(|misfit| *misfit > SUSPICIOUS) else {
        return Vec::new();
    };
    let mut findings = Vec::new();
    for signal in ["tau", "q"] {
        let tried = FACTORS.iter().filter_map(|(factor, words)| {
            let scaled: Vec<Piece> = pieces.iter().map(|piece| scaled(piece, signal, *factor)).collect();
            Some((misfit(rig, &scaled)?, words))
        });
        if let Some((least, words)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|best| best.0 < SUSPICIOUS) {
            let drop = as_is / least;
            let what = format!(
                "`{signal}` fits the model {drop:.0} times better {words}: check its unit, scale and sign in [log]"
            );
            findings.push(Finding { recording: "all recordings".to_owned(), what });
        }
    }
    findings
}

/// Mean square of the whitened residual at the model's own parameters; `None` if the noise cannot be told.
fn misfit(rig: &DriveRig, pieces: &[Piece]) -> Option<f64> {
    let block = drive_block(rig, pieces, &|_| false, 1, &[]);
    let part = block.part(false);
    let noise = part.noise(&block.base)?;
    let residual = part.whitened(&noise, std::slice::from_ref(&block.base)).remove(0);
    Some(residual.norm_squared() / residual.len() as f64).filter(|misfit| misfit.is_finite())
}

fn scaled(piece: &Piece, signal: &str, factor: f64) -> Piece {
    let mut piece = piece.clone();
    if let Some(values) = piece.signals.get_mut(signal) {
        values.iter_mut().for_each(|value| *value *= factor);
    }
    piece
}
