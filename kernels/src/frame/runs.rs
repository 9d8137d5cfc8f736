//! Runs enter the lanes of a tile, and leave them when both their loops have ended.

use super::facility_lanes::ResetFacility;
use super::{Loops, Tile, one};
use crate::contact::{hil_pair, space_pair};
use crate::fields::Bundle;
use crate::lanes::{Lane, Stage};
use crate::metrics::Metrics;
use crate::monitor::Watch;
use crate::outcome::{Finished, RunEnd, Stop, run_flags};
use crate::params::Params;
use crate::plant::Plant;
use crate::space::{hil_masses, space_masses};
use crate::staged::{followed, kinematics, metrics, start};

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
        let pairs = [(space_masses(p), space_pair(p)), (hil_masses(p), hil_pair(p))];
        for (side, (masses, pair)) in [&mut self.space, &mut self.hil].into_iter().zip(pairs) {
            side.masses.set_where(fresh, &masses);
            side.bodies.set_where(fresh, &start(m, p, &side.masses));
            side.interface.reset(&pair, fresh);
        }
        if self.facility.batch.loops == Loops::SpaceOnly {
            self.hil.interface.watch.done = L::lit(1.0);
        }
        let parts = kinematics(m, &self.hil.masses, &self.hil.bodies).parts;
        L::stage(ResetFacility { facility: &mut self.facility, m, parts: &parts, fresh });
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
        let space = metrics(m, &self.space.interface.watch, &self.space.bodies, &seen, L::lit(0.0));
        let hil = metrics(m, &self.hil.interface.watch, &self.hil.bodies, &seen, L::lit(1.0));
        for lane in ended {
            let (space, hil) = (one::<L, Metrics<L>, _>(&space, lane), one(&hil, lane));
            out.push(Finished {
                run: self.facility.runs[lane].take().expect("only lanes with a run end"),
                params: one(&self.facility.params, lane),
                flags: self.flags(m, lane, &space, &hil),
                stop: self.stop(lane),
                space,
                hil,
                touch: [one(&self.space.interface.watch.normal, lane), one(&self.space.interface.watch.lever, lane)],
            });
        }
    }

    /// What stopped the session of a lane's run.
    fn stop(&self, lane: usize) -> Option<Stop> {
        let (watch, session) = (&self.hil.interface.watch, &self.facility.session);
        let [unstable, speed, rule, value] = [watch.unstable, watch.end_speed, session.rule, session.value];
        Stop::of([unstable, speed, rule, value].map(|number| number.lane(lane)))
    }

    fn flags(&self, m: &Plant, lane: usize, space: &Metrics<f64>, hil: &Metrics<f64>) -> u32 {
        let at = |value: L| value.lane(lane);
        let watch = |w: &Watch<L>| (at(w.unstable) > 0.0, at(w.contact_work), at(w.absorbed));
        run_flags(
            m,
            RunEnd {
                space: *space,
                hil: *hil,
                space_watch: watch(&self.space.interface.watch),
                hil_unstable: at(self.hil.interface.watch.unstable) > 0.0,
                saturated: at(self.facility.sensor.saturated) > 0.0,
                limited: at(self.facility.robots.limited) > 0.0,
                dropped: at(self.facility.dropped) > 0.0,
            },
        )
    }
}
