//! Discriminating experiment of an ambiguous answer: a motion within the envelope of the joint.

use crate::data::grid::Piece;
use crate::data::smooth::motion;
use crate::diagnosis::Prepared;
use crate::model::block::MeasuredBlock;
use crate::plants::drive::block::{drive_block, followed};
use crate::plants::drive::controller::controller_block;
use crate::propose::experiment;
use crate::propose::experiment::{Envelope, ProposedExperiment};
use crate::verdict::decide::rivals;
use crate::verdict::judged::Judged;
use softdock_campaign::rig::RigModel;
use softdock_engine::blocks::BlockKind;

/// Cut-off of the motions by which the envelope is measured, in cycles a sample: noise is no acceleration.
const STEADY: f64 = 0.08;

impl Prepared {
    /// Returns the motion that separates the rivals of an ambiguous block, if its plant is a drive.
    pub(super) fn proposed(&self, judged: &Judged) -> Option<ProposedExperiment> {
        let Some(RigModel::Drive(rig)) = self.plant() else {
            return None;
        };
        let Judged { block, library, judgement, .. } = judged;
        let rivals = rivals(block, library, judgement);
        let first = self.pieces().first().filter(|_| rivals.len() > 1)?;
        // It will be recorded after all others, by a drive as warm as these have left it.
        let end = self.pieces().iter().map(Piece::end).fold(first.start, f64::max);
        let block_of = |path: &[f64]| {
            let mut piece = followed(rig, end, first.step, path);
            piece.signals.retain(|name, _| first.signals.contains_key(name));
            let own = match &rig.controller {
                Some(controller) if block.section.is(BlockKind::Controller) => {
                    controller_block(rig, controller, &[piece], &|_| false)
                }
                _ => drive_block(rig, &[piece], &|_| false, 1, &[]),
            };
            MeasuredBlock { decimator: block.decimator.clone(), ..own }
        };
        experiment::best(&self.envelope(first.step), &rivals, &judgement.noise, &block_of)
    }

    /// What the recordings show that the joint can do.
    fn envelope(&self, step: f64) -> Envelope {
        let motions = self.pieces().iter().map(|piece| motion(&piece.signals["q"], piece.step, STEADY / piece.step, 1));
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
}
