//! What lanes keep whose run has ended while their neighbours go on.
//!
//! A tick works in place and copies nothing as long as all lanes are under way, which most ticks are.

use super::{Tile, arms::Arms, choose};
use crate::impedance::Yielding;
use crate::lanes::Lane;
use crate::load::Load;
use crate::monitor::Watch;
use crate::robot::Robots;
use crate::sensor::Sensor;
use crate::test_motion::Tracking;

/// What a tick changes of the facility.
pub(super) struct FacilityState<L: Lane> {
    robots: Robots<L>,
    arms: Option<Box<Arms<L>>>,
    sensor: Sensor<L>,
    load: Load<L>,
    yielding: Yielding<L>,
    tracking: Tracking<L>,
    watch: Watch<L>,
}

impl<L: Lane, const N: usize> Tile<L, N> {
    /// What a tick of the facility changes.
    #[inline(never)]
    pub(super) fn facility(&self) -> FacilityState<L> {
        FacilityState {
            robots: self.robots,
            arms: self.arms.clone(),
            sensor: self.sensor,
            load: self.load,
            yielding: self.yielding,
            tracking: self.tracking,
            watch: self.hil.watch,
        }
    }

    /// Puts back what stood before in the lanes outside the mask.
    #[inline(never)]
    pub(super) fn keep_facility(&mut self, mask: L::Mask, before: &FacilityState<L>) {
        self.robots = choose(mask, &self.robots, &before.robots);
        if let (Some(arms), Some(before)) = (&mut self.arms, &before.arms) {
            arms.keep(mask, before);
        }
        self.sensor = choose(mask, &self.sensor, &before.sensor);
        self.load = choose(mask, &self.load, &before.load);
        self.yielding = choose(mask, &self.yielding, &before.yielding);
        self.tracking = choose(mask, &self.tracking, &before.tracking);
        self.hil.watch = choose(mask, &self.hil.watch, &before.watch);
    }
}
