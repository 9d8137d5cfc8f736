//! Observation of the contacts of a loop, substep by substep; without an observer nothing of it is compiled in.

use crate::contact::{PointContact, PointState};
use crate::lanes::Lane;
use crate::material::Pair;
use crate::plant::Plant;
use crate::space::Parts;

/// Receives every contact of a loop in every substep in which a run of the tile is under way.
///
/// It observes only: no number of a run depends on it.
pub trait ContactObserver<L: Lane> {
    /// One contact point or shell: its index among the contact states ([`Plant::contact_states`]), what it kept before
    /// the substep, and what it does in it. A contact that is open has no force.
    fn contact(&mut self, index: usize, before: &PointState<L>, contact: &PointContact<L>);

    /// All contacts of the substep that begins at `time` \[s\] have been shown. `parts` are the motions of the parts that
    /// touch: inertial axes in space, laboratory axes on the facility.
    fn substep(&mut self, m: &Plant, pairs: &[Pair<L>], time: L, parts: &Parts<L>);
}

/// No observer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl<L: Lane> ContactObserver<L> for Unobserved {
    #[inline(always)]
    fn contact(&mut self, _index: usize, _before: &PointState<L>, _contact: &PointContact<L>) {}

    #[inline(always)]
    fn substep(&mut self, _m: &Plant, _pairs: &[Pair<L>], _time: L, _parts: &Parts<L>) {}
}
