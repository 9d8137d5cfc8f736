//! What lanes keep whose run has ended while their neighbours go on.
//!
//! A tick works in place and copies nothing as long as all lanes are under way, which most ticks are.

use super::{FacilityLanes, Interface, arms::Arms};
use crate::capture_ring::{Ring, has_ring};
use crate::impedance::Admittance;
use crate::lanes::Lane;
use crate::load::Load;
use crate::monitor::Watch;
use crate::plant::Plant;
use crate::robot::Robots;
use crate::sensor::Sensor;
use crate::staged::set_where;
use crate::test_motion::Tracking;

/// What a tick changes of the facility.
pub(super) struct FacilityState<L: Lane> {
    robots: Robots<L>,
    arms: Option<Box<Arms<L>>>,
    sensor: Sensor<L>,
    load: Load<L>,
    admittance: Admittance<L>,
    tracking: Tracking<L>,
    watch: Watch<L>,
    ring: Ring<L>,
}

impl<L: Lane> FacilityLanes<L> {
    /// What a tick of the facility changes.
    #[inline(never)]
    pub(super) fn snapshot(&self, interface: &Interface<L>) -> FacilityState<L> {
        FacilityState {
            robots: self.robots,
            arms: self.arms.clone(),
            sensor: self.sensor,
            load: self.load,
            admittance: self.admittance,
            tracking: self.tracking,
            watch: interface.watch,
            ring: interface.ring,
        }
    }

    /// Puts back what stood before in the lanes outside the mask.
    #[inline(never)]
    pub(super) fn keep(&mut self, m: &Plant, mask: L::Mask, interface: &mut Interface<L>, before: &FacilityState<L>) {
        set_where(!mask, &mut self.robots, &before.robots);
        if let (Some(arms), Some(before)) = (&mut self.arms, &before.arms) {
            arms.keep(mask, before);
        }
        set_where(!mask, &mut self.sensor, &before.sensor);
        set_where(!mask, &mut self.load, &before.load);
        set_where(!mask, &mut self.admittance, &before.admittance);
        set_where(!mask, &mut self.tracking, &before.tracking);
        set_where(!mask, &mut interface.watch, &before.watch);
        if has_ring(m) {
            set_where(!mask, &mut interface.ring, &before.ring);
        }
    }
}
