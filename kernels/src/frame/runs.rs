//! Entry of runs into the lanes of a tile, and their removal when both loops have ended.

use super::facility_lanes::ResetFacility;
use super::{Loops, Tile, one};
use crate::arm_motion::no_motion;
use crate::capture_ring::has_ring;
use crate::contact::{hil_pair, space_pair};
use crate::fields::Bundle;
use crate::frame::facility_lanes::SidePair;
use crate::grip::no_grip;
use crate::lanes::{Lane, Stage};
use crate::metrics::Metrics;
use crate::outcome::{EndState, Finished};
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::mounted_parts;
use crate::space::{Wrench, hil_masses, space_masses};
use crate::staged::{followed, kinematics, metrics, ring_at, start};
use crate::thrusters::no_firing;

/// [`Tile::reset`], compiled for the lanes.
struct Reset<'a, L: Lane, const N: usize> {
    tile: &'a mut Tile<L, N>,
    m: &'a Plant,
    fresh: L::Mask,
}

impl<L: Lane, const N: usize> Stage for Reset<'_, L, N> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.tile.reset(self.m, self.fresh);
    }
}

impl<L: Lane, const N: usize> Tile<L, N> {
    /// Lanes that could take a run.
    pub fn free_lanes(&self) -> impl Iterator<Item = usize> + '_ {
        self.facility.runs.iter().enumerate().filter(|(_, run)| run.is_none()).map(|(lane, _)| lane)
    }

    /// Puts runs into free lanes.
    #[inline(never)]
    pub fn load(&mut self, m: &Plant, entering: &[(usize, u64, Params<f64>)]) {
        let fresh = self.facility.enter(entering);
        L::stage(Reset { tile: self, m, fresh });
    }

    /// Starts the runs of the lanes in the mask.
    #[inline(always)]
    pub(super) fn reset(&mut self, m: &Plant, fresh: L::Mask) {
        let p = &self.facility.params;
        let sides: [(_, SidePair<L>); 2] = [(space_masses(p), space_pair), (hil_masses(p), hil_pair)];
        for (side, (masses, pair)) in [&mut self.space, &mut self.hil].into_iter().zip(sides) {
            side.masses.set_where(fresh, &masses);
            side.bodies.set_where(fresh, &start(m, p, &side.masses));
            side.interface.reset(m, p, pair, fresh);
            side.motion.set_where(fresh, &no_motion());
            side.interface.grip.set_where(fresh, &no_grip());
            side.firing.set_where(fresh, &no_firing());
            side.felt.set_where(fresh, &Wrench::zero());
        }
        if self.facility.batch.loops == Loops::SpaceOnly {
            self.hil.interface.watch.done = L::lit(1.0);
        }
        let parts = kinematics(m, &self.hil.masses, &self.hil.bodies).parts;
        L::stage(ResetFacility { facility: &mut self.facility, m, parts: &parts, fresh });
        if has_ring(m) {
            let mounts = [
                kinematics(m, &self.space.masses, &self.space.bodies).parts,
                mounted_parts(m, &self.facility.params, &self.facility.robots),
            ];
            for (side, mount) in [&mut self.space, &mut self.hil].into_iter().zip(&mounts) {
                side.interface.ring.set_where(fresh, &ring_at(m, mount));
            }
        }
    }

    /// Takes out the runs whose both loops have ended.
    #[inline(never)]
    pub fn take_finished(&mut self, m: &Plant, out: &mut Vec<Finished>) {
        let done = |lane: usize| {
            self.space.interface.watch.done.lane(lane) > 0.0 && self.hil.interface.watch.done.lane(lane) > 0.0
        };
        let ended: Vec<usize> =
            (0..L::WIDTH).filter(|lane| self.facility.runs[*lane].is_some() && done(*lane)).collect();
        if ended.is_empty() {
            return;
        }
        let seen = followed(m, &self.facility.params, &self.facility.tracking);
        let space =
            metrics(m, &self.space.interface.watch, &self.space.bodies, &self.space.interface.ring, &seen, L::lit(0.0));
        let hil = metrics(m, &self.hil.interface.watch, &self.hil.bodies, &self.hil.interface.ring, &seen, L::lit(1.0));
        let end_state = self.end_state();
        for lane in ended {
            let metrics = [one::<L, Metrics<L>, _>(&space, lane), one(&hil, lane)];
            let end = one::<L, EndState<L>, _>(&end_state, lane);
            let run = self.facility.runs[lane].take().expect("only lanes with a run end");
            out.push(Finished::new(m, run, one(&self.facility.params, lane), metrics, &end));
        }
    }
}
