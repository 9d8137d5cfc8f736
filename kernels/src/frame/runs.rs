//! Runs enter the lanes of a tile, and leave them when both their loops have ended.

use super::{Loops, Tile, one, zero_wrench};
use crate::compensator::new_compensation;
use crate::contact::{hil_pair, space_pair};
use crate::fields::Bundle;
use crate::impedance::not_yielding;
use crate::lanes::{Lane, MOST_LANES, Stage};
use crate::load::{load_at, sensor_at};
use crate::metrics::Metrics;
use crate::monitor::{Watch, new_watch};
use crate::outcome::{Finished, RunEnd, run_flags};
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::{mounted_parts, transport};
use crate::space::{hil_masses, space_masses};
use crate::staged::{carry_on, command, followed, kinematics, metrics, start};
use crate::test_motion::no_tracking;
use crate::vector::Vec3;

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
        self.runs.iter().enumerate().filter(|(_, run)| run.is_none()).map(|(lane, _)| lane)
    }

    /// Puts runs into free lanes.
    #[inline(never)]
    pub fn load(&mut self, m: &Plant, entering: &[(usize, u64, Params<f64>)]) {
        let (mut fresh, mut values) = ([0.0; MOST_LANES], [const { Vec::new() }; MOST_LANES]);
        for (lane, run, params) in entering {
            self.runs[*lane] = Some(*run);
            (fresh[*lane], values[*lane]) = (1.0, crate::fields::to_vec(params));
        }
        let mut old = crate::fields::to_vec::<L, _>(&self.params).into_iter().enumerate();
        self.params = Params::read(&mut || {
            let (field, old) = old.next().expect("as many as before");
            L::gather(|lane| values[lane].get(field).copied().unwrap_or_else(|| old.lane(lane)))
        });
        let fresh = L::lit(0.5).lt(L::gather(|lane| fresh[lane]));
        L::stage(Reset { tile: self, m, fresh });
    }

    /// Starts the runs of the lanes in the mask.
    #[inline(always)]
    pub(super) fn reset(&mut self, m: &Plant, fresh: L::Mask) {
        let (p, zero) = (&self.params, L::lit(0.0));
        let pairs = [(space_masses(p), space_pair(p)), (hil_masses(p), hil_pair(p))];
        for (side, (masses, pair)) in [&mut self.space, &mut self.hil].into_iter().zip(pairs) {
            side.masses.set_where(fresh, &masses);
            side.pair.set_where(fresh, &pair);
            side.bodies.set_where(fresh, &start(m, p, &side.masses));
            side.watch.set_where(fresh, &new_watch());
            side.bristles.iter_mut().for_each(|b| *b = Vec3::select(fresh, Vec3::zero(), *b));
        }
        if self.batch.loops == Loops::SpaceOnly {
            self.hil.watch.done = L::lit(1.0);
        }
        let told = command(m, &kinematics(m, &self.hil.masses, &self.hil.bodies).parts);
        // The line is full of the start carried backwards; the newest entry is one tick old.
        for age in 1..self.slots {
            let past = carry_on(m, &told, L::lit(-(age as f64)));
            self.commands.put((self.step + self.slots - age) % self.slots, &past, fresh);
            self.wrenches.put((self.step + self.slots - age) % self.slots, &zero_wrench(), fresh);
        }
        let at = carry_on(m, &told, -(transport(m, &self.params, zero) + L::lit(1.0)));
        self.place_robots(m, &at, fresh);
        let a = mounted_parts(m, &self.params, &self.robots).a;
        let load = load_at(m, &self.params, a);
        let sensor = sensor_at(m, &load, a);
        self.load.set_where(fresh, &load);
        self.sensor.set_where(fresh, &sensor);
        self.held.set_where(fresh, &zero_wrench());
        self.compensation.set_where(fresh, &new_compensation());
        self.lost = L::select(fresh, zero, self.lost);
        self.dropped = L::select(fresh, zero, self.dropped);
        self.tracking.set_where(fresh, &no_tracking());
        self.yielding.set_where(fresh, &not_yielding());
        self.tick = L::select(fresh, zero, self.tick);
    }

    /// Takes out the runs whose both loops have ended.
    #[inline(never)]
    pub fn take_finished(&mut self, m: &Plant, out: &mut Vec<Finished>) {
        let done = |lane: usize| self.space.watch.done.lane(lane) > 0.0 && self.hil.watch.done.lane(lane) > 0.0;
        let ended: Vec<usize> = (0..L::WIDTH).filter(|lane| self.runs[*lane].is_some() && done(*lane)).collect();
        if ended.is_empty() {
            return;
        }
        let seen = followed(m, &self.params, &self.tracking);
        let space = metrics(m, &self.space.watch, &self.space.bodies, &seen, L::lit(0.0));
        let hil = metrics(m, &self.hil.watch, &self.hil.bodies, &seen, L::lit(1.0));
        for lane in ended {
            let (space, hil) = (one::<L, Metrics<L>, _>(&space, lane), one(&hil, lane));
            out.push(Finished {
                run: self.runs[lane].take().expect("only lanes with a run end"),
                params: one(&self.params, lane),
                flags: self.flags(m, lane, &space, &hil),
                space,
                hil,
                touch: [one(&self.space.watch.normal, lane), one(&self.space.watch.lever, lane)],
            });
        }
    }

    fn flags(&self, m: &Plant, lane: usize, space: &Metrics<f64>, hil: &Metrics<f64>) -> u32 {
        let at = |value: L| value.lane(lane);
        let watch = |w: &Watch<L>| (at(w.unstable) > 0.0, at(w.contact_work), at(w.absorbed));
        run_flags(
            m,
            RunEnd {
                space: *space,
                hil: *hil,
                space_watch: watch(&self.space.watch),
                hil_unstable: at(self.hil.watch.unstable) > 0.0,
                saturated: at(self.sensor.saturated) > 0.0,
                limited: at(self.robots.limited) > 0.0,
                dropped: at(self.dropped) > 0.0,
            },
        )
    }
}
