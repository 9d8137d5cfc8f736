//! Repeats: recordings of one motion. A common name suggests them; the recorded motion decides.

use crate::data::grid::{Finding, Piece};
use std::collections::BTreeMap;

/// Signals that repeats share, by the beginnings of their names: commands and motion, not what the plant makes of them.
const MOTION: [&str; 7] = ["ref", "sent", "q", "position", "orientation", "carriage", "angle"];
/// Root mean square by which repeats may differ, as a share of the signal's standard deviation.
const ALIKE: f64 = 0.2;

/// Gives recordings that share a name, but not their motion, separate names; returns what was found.
pub(crate) fn separate_motions(pieces: &mut [Piece]) -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for place in 0..pieces.len() {
        let own = &pieces[place];
        let first = pieces.iter().find(|first| first.experiment == own.experiment && first.repeat != own.repeat);
        let Some(first) = first.filter(|first| first.repeat < own.repeat && !is_repeat(first, own)) else { continue };
        let (name, experiment) = (format!("{}_{}", own.experiment, own.repeat), own.experiment.clone());
        let what = format!(
            "no repeat of {experiment}_{}: its motion is another, although the names differ by a number alone",
            first.repeat
        );
        findings.push(Finding { recording: name.clone(), what });
        let repeat = own.repeat;
        for piece in pieces.iter_mut().filter(|piece| piece.experiment == experiment && piece.repeat == repeat) {
            (piece.experiment, piece.repeat) = (name.clone(), 1);
        }
    }
    findings
}

/// Returns whether two recordings have the same motion; without a signal of it their name decides. Directions of one vector
/// are compared together: a direction that does not move has noise alone.
fn is_repeat(first: &Piece, other: &Piece) -> bool {
    let is_motion = |name: &String| MOTION.iter().any(|start| name.starts_with(start)) && !name.contains("force");
    let mut vectors: BTreeMap<&str, [f64; 2]> = BTreeMap::new();
    for (name, values) in first.signals.iter().filter(|(name, _)| is_motion(name)) {
        let Some(other) = other.signals.get(name) else { continue };
        let count = values.len().min(other.len());
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let [spread, apart] = vectors.entry(name.split('.').next().unwrap_or(name)).or_default();
        *spread += values[..count].iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        *apart += values[..count].iter().zip(other).map(|(value, other)| (value - other).powi(2)).sum::<f64>();
    }
    vectors.values().all(|[spread, apart]| *apart <= ALIKE * ALIKE * spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(repeat: usize, rate: f64, offset: f64) -> Piece {
        let angle = |i: i32| (rate * f64::from(i)).sin() + offset;
        let signals = BTreeMap::from([("q".to_owned(), (0..500).map(angle).collect())]);
        Piece { experiment: "x".to_owned(), repeat, start: 0.0, offset: 0.0, step: 0.01, signals }
    }

    #[test]
    fn direction_that_does_not_move_is_no_other_motion() {
        let with_noise = |repeat: usize| {
            let noise = |i: i32| 1e-6 * (f64::from(i) * (12.9898 + repeat as f64)).sin();
            let mut own = piece(repeat, 0.03, 0.0);
            let moving = own.signals.remove("q").expect("its angle");
            own.signals.insert("position.x".to_owned(), (0..500).map(noise).collect());
            own.signals.insert("position.z".to_owned(), moving);
            own
        };
        assert!(separate_motions(&mut [with_noise(1), with_noise(2)]).is_empty());
    }

    #[test]
    fn motion_decides_on_repeats() {
        let mut pieces = [piece(1, 0.03, 0.0), piece(2, 0.03, 0.01), piece(3, 0.05, 0.0)];
        let findings = separate_motions(&mut pieces);
        let names: Vec<(&str, usize)> = pieces.iter().map(|piece| (piece.experiment.as_str(), piece.repeat)).collect();
        assert_eq!(names, [("x", 1), ("x", 2), ("x_3", 1)]);
        assert!(matches!(&findings[..], [finding] if finding.recording == "x_3"), "{findings:?}");
    }
}
