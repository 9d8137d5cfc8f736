//! Recordings of a rig with the experiments that are held out.

use crate::data::grid::Piece;
use std::collections::BTreeSet;

/// Recordings of a rig, training and held out; empty for a facility, whose plant owns its logs.
#[derive(Debug, Default)]
pub(crate) struct Recordings {
    /// The recordings.
    pub(crate) pieces: Vec<Piece>,
    /// Names of the experiments that are held out.
    pub(crate) held_out: BTreeSet<String>,
}

impl Recordings {
    /// Returns whether all recordings have a signal.
    pub(crate) fn has(&self, signal: &str) -> bool {
        self.pieces.iter().all(|piece| piece.signals.contains_key(signal))
    }

    /// Returns whether an experiment is held out.
    pub(crate) fn is_held_out(&self, experiment: &str) -> bool {
        self.held_out.contains(experiment)
    }
}
