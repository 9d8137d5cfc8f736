//! Discriminating experiment of an ambiguous answer: a motion within the envelope of the joint.

use crate::data::grid::Piece;
use crate::data::recordings::Recordings;
use crate::data::smooth::motion;
use crate::model::block::MeasuredBlock;
use crate::plants::DiagnosedPlant;
use crate::propose::experiment::{self, Envelope, ProposedExperiment};
use crate::verdict::decide::rivals;
use crate::verdict::judged::Judged;

/// Cut-off of the motions by which the envelope is measured, in cycles a sample: noise is no acceleration.
const STEADY: f64 = 0.08;

/// Returns the motion that separates the rivals of an ambiguous block; `None` if its plant follows no path.
pub(crate) fn proposed(
    plant: &dyn DiagnosedPlant,
    recordings: &Recordings,
    judged: &Judged,
) -> Option<ProposedExperiment> {
    let Judged { block, library, judgement, .. } = judged;
    let first = recordings.pieces.first()?;
    // It will be recorded after all others, by a drive as warm as these have left it.
    let end = recordings.pieces.iter().map(Piece::end).fold(first.start, f64::max);
    let follower = plant.follower(block, first, end)?;
    let rivals = rivals(block, library, judgement);
    if rivals.len() < 2 {
        return None;
    }
    let block_of = |path: &[f64]| MeasuredBlock { decimator: block.decimator.clone(), ..follower(path) };
    experiment::best(&envelope(&recordings.pieces, first.step), &rivals, &judgement.noise, &block_of)
}

/// What the recordings show that the joint can do.
fn envelope(pieces: &[Piece], step: f64) -> Envelope {
    let motions = pieces.iter().map(|piece| motion(&piece.signals["q"], piece.step, STEADY / piece.step, 1));
    let mut envelope = Envelope { range: (f64::INFINITY, f64::NEG_INFINITY), rate: 0.0, acceleration: 0.0, step };
    for motion in motions {
        let most = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let (lo, hi) = envelope.range;
        let range = motion.value.iter().fold((lo, hi), |(lo, hi), q| (lo.min(*q), hi.max(*q)));
        let (rate, acceleration) = (most(&motion.rate), most(&motion.acceleration));
        envelope = Envelope {
            range,
            rate: rate.max(envelope.rate),
            acceleration: acceleration.max(envelope.acceleration),
            step,
        };
    }
    envelope
}
