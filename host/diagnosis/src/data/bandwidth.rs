//! Bandwidth of the signal: the frequency up to which the mean of repeats exceeds their noise.

use crate::data::grid::Piece;
use crate::data::smooth::band_powers;
use std::collections::BTreeMap;

/// Decimation factor without repeats.
const DEFAULT_STEPS: usize = 4;
/// Largest decimation factor.
const MOST_STEPS: usize = 25;
/// Bands in which the power is compared, from nothing to the Nyquist frequency: as many as four samples each allow.
const BANDS: usize = 50;
const FEWEST_BANDS: usize = 10;

/// Returns the decimation factor of a signal, at least 2: the smallest that keeps the frequencies at which the mean of
/// repeats exceeds their noise.
///
/// Higher frequencies contain only noise.
pub(crate) fn judged_steps(pieces: &[Piece], signal: &str) -> usize {
    highest(pieces, signal).map_or(DEFAULT_STEPS, |highest| ((0.4 / highest) as usize).clamp(2, MOST_STEPS))
}

/// Returns the highest frequency, in cycles per sample, at which the mean of repeats exceeds their noise; `None`
/// without repeats or if none does.
pub(crate) fn highest(pieces: &[Piece], signal: &str) -> Option<f64> {
    let mut repeats: BTreeMap<&str, Vec<&[f64]>> = BTreeMap::new();
    for piece in pieces {
        if let Some(samples) = piece.signals.get(signal) {
            repeats.entry(&piece.experiment).or_default().push(samples);
        }
    }
    repeats.values().filter_map(|list| highest_common(list)).max_by(f64::total_cmp)
}

/// Returns the highest frequency, in cycles per sample, at which the mean of repeats has more power than its noise.
fn highest_common(repeats: &[&[f64]]) -> Option<f64> {
    let count = repeats.len();
    let n = repeats.iter().map(|list| list.len()).min()?;
    let bands = BANDS.min(n / 4);
    if count < 2 || bands < FEWEST_BANDS {
        return None;
    }
    let mean: Vec<f64> = (0..n).map(|i| repeats.iter().map(|list| list[i]).sum::<f64>() / count as f64).collect();
    let mut noise = vec![0.0; bands];
    for list in repeats {
        let rest: Vec<f64> = (0..n).map(|i| list[i] - mean[i]).collect();
        // Of the mean of so many repeats, from deviations with one degree of freedom less.
        let share = 1.0 / (count * (count - 1)) as f64;
        noise.iter_mut().zip(band_powers(&rest, bands)).for_each(|(sum, power)| *sum += share * power);
    }
    let signal = band_powers(&mean, bands);
    let above = (0..bands).take_while(|band| signal[*band] > 2.0 * noise[*band]).count();
    (above > 0).then_some(0.5 * above as f64 / bands as f64)
}
