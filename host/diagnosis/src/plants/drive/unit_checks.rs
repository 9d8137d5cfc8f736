//! Unit and sign checks: channels that fit the model far better with another unit or sign.

use crate::data::grid::{Finding, Piece};
use crate::inference::noise::Noise;
use crate::model::block::MeasuredBlock;
use crate::plants::drive::block::drive_block;
use softdock_campaign::rig::DriveRig;

/// Possible unit and sign errors: factor and description.
const FACTORS: [(f64, &str); 9] = [
    (-1.0, "with its sign reversed"),
    (2.0, "times 2"),
    (0.5, "times 0.5"),
    (9.80665, "times 9.81, as if recorded in kgf"),
    (1.0 / 9.80665, "divided by 9.81"),
    (180.0 / std::f64::consts::PI, "times 180/pi, as if degrees and radians were exchanged"),
    (std::f64::consts::PI / 180.0, "times pi/180, as if recorded in degrees"),
    (1e3, "times 1000"),
    (1e-3, "divided by 1000"),
];

/// Mean square of the whitened residual above which channels are checked, and below which a factor is reported.
const SUSPICIOUS: f64 = 4.0;
/// The same of one recording alone, above which a factor is not tried on all.
const HARDLY: f64 = 40.0;

/// Returns the channels of a drive with a suspected unit or sign error.
pub(crate) fn check_units(rig: &DriveRig, pieces: &[Piece]) -> Vec<Finding> {
    let Some((as_is, noise)) = misfit(rig, pieces).filter(|(misfit, _)| *misfit > SUSPICIOUS) else {
        return Vec::new();
    };
    let mut findings = Vec::new();
    for signal in ["tau", "q"] {
        let may = |factor: &f64| first_misfit(rig, &pieces[0], &noise, signal, *factor) < HARDLY;
        let tried = FACTORS.iter().filter(|(factor, _)| may(factor)).filter_map(|(factor, words)| {
            let scaled: Vec<Piece> = pieces.iter().map(|piece| scaled(piece, signal, *factor)).collect();
            Some((misfit(rig, &scaled)?.0, words))
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

/// Returns the mean square of the whitened residual at the nominal parameters, and the noise; `None` if the noise is
/// not identifiable.
fn misfit(rig: &DriveRig, pieces: &[Piece]) -> Option<(f64, Noise)> {
    let block = drive_block(rig, pieces, &|_| false, 1, &[]);
    let noise = block.part(false).noise(&block.base)?;
    Some((mean_square(&block, &noise), noise)).filter(|(misfit, _)| misfit.is_finite())
}

/// The same of one recording with a signal scaled, by the noise of all as they are; that of a scaled angle is scaled, too.
fn first_misfit(rig: &DriveRig, piece: &Piece, noise: &Noise, signal: &str, factor: f64) -> f64 {
    let block = drive_block(rig, &[scaled(piece, signal, factor)], &|_| false, 1, &[]);
    let own = if signal == "q" { factor } else { 1.0 };
    mean_square(&block, noise) / (own * own)
}

fn mean_square(block: &MeasuredBlock, noise: &Noise) -> f64 {
    let residual = block.part(false).whitened(noise, std::slice::from_ref(&block.base)).remove(0);
    residual.norm_squared() / residual.len() as f64
}

fn scaled(piece: &Piece, signal: &str, factor: f64) -> Piece {
    let mut piece = piece.clone();
    if let Some(values) = piece.signals.get_mut(signal) {
        values.iter_mut().for_each(|value| *value *= factor);
    }
    piece
}
