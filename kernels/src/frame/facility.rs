//! The facility alone: robots, contact and sensor along recorded references of the parts, one parameter set a lane.
//!
//! With recorded references it shows the errors of robots, contact and sensor together; with the robots' measured
//! motions and ideal robots, those of contact and sensor alone.

use super::{Batch, FacilityLanes, Interface, Loops, zero_wrench};
use crate::block::{Recorded, Row, Samples};
use crate::bundle;
use crate::fields::{Bundle, fields};
use crate::frame::observer::Unobserved;
use crate::lanes::Lane;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::robot::{extrapolate, parts_by_axes};
use crate::space::{Parts, Wrench};
use crate::vector::{Quat, Vec3};

bundle! {
    /// What a facility measures at the end of a tick.
    Readings {
        place_a: Vec3<R>, "m", "origin of part A on robot 1, laboratory";
        turn_a: Vec3<R>, "rad", "rotation of part A from the nominal start, its axes there";
        place_b: Vec3<R>, "m", "origin of part B on robot 2, laboratory";
        turn_b: Vec3<R>, "rad", "rotation of part B from the nominal start, its axes there";
        force: Vec3<R>, "N", "force on part A, its axes";
        moment: Vec3<R>, "N m", "moment on part A about its origin, its axes";
    }
}

/// What is read of parts and wrench.
///
/// Here and in [`follow`] no closures: they would be functions of their own, without the instruction set of the lanes.
#[inline(always)]
pub fn readings<R: Real>(start: &Parts<f64>, parts: &Parts<R>, wrench: Wrench<R>) -> Readings<R> {
    Readings {
        place_a: parts.a.position,
        turn_a: turn(start.a.attitude, parts.a.attitude),
        place_b: parts.b.position,
        turn_b: turn(start.b.attitude, parts.b.attitude),
        force: wrench.force,
        moment: wrench.moment,
    }
}

/// How far a part has turned, by its own axes.
#[inline(always)]
fn turn<R: Real>(from: Quat<f64>, to: Quat<R>) -> Vec3<R> {
    Quat { w: R::lit(from.w), v: Vec3::lit(from.v * -1.0) }.compose(to).small_rotation_vector()
}

/// Readings of the facility, tick by tick in the order of [`Readings`], each for all lanes.
///
/// The rows of the recording are the laboratory motions of [`Parts`]: the first one where the robots are at the start,
/// the others the references at the end of each tick.
#[inline(always)]
pub fn follow<L: Lane>(m: &Plant, recorded: &Recorded, sets: &[Params<f64>]) -> Vec<L> {
    let entering: Vec<_> = (0..L::WIDTH).map(|lane| (lane, 0, *sets.get(lane).unwrap_or(&sets[0]))).collect();
    let batch = Batch { key: [0; 2], noisy: false, loops: Loops::Both };
    let (mut facility, mut interface) = FacilityLanes::<L>::alone(m, batch, &entering);
    let start = m.start;
    facility.begin(m, &reference(recorded, 0), &reference(recorded, 1));
    let mut out = Vec::with_capacity(recorded.samples() * fields::<f64, Readings<f64>>().len());
    let mut wrench = zero_wrench();
    for row in 0..recorded.instants {
        if row > 0 {
            wrench = facility.follow(m, &mut interface, &reference(recorded, row));
        }
        if row % recorded.stride == 0 {
            let parts = parts_by_axes(m, &facility.robots);
            readings(&start, &parts, wrench).write(&mut Samples(&mut out));
        }
    }
    out
}

/// References of the parts in a row of a recording.
#[inline(always)]
fn reference<R: Real>(recorded: &Recorded, row: usize) -> Parts<R> {
    let width = recorded.inputs.len() / recorded.instants;
    Parts::read(&mut Row::new(&recorded.inputs[row * width..(row + 1) * width]))
}

impl<L: Lane> FacilityLanes<L> {
    /// Robots at their measured poses, between the first reference and the one before.
    fn begin(&mut self, m: &Plant, at: &Parts<L>, first: &Parts<L>) {
        let all = L::lit(0.0).lt(L::lit(1.0));
        for age in 1..self.slots {
            let past = extrapolate(m, first, L::lit(-(age as f64)));
            self.commands.put((self.step + self.slots - age) % self.slots, &past, all);
        }
        self.place_robots(m, at, all);
    }

    /// One tick towards the motions that the parts shall have at its end; gives the wrench that is measured then.
    #[inline(always)]
    pub(super) fn follow(&mut self, m: &Plant, interface: &mut Interface<L>, reference: &Parts<L>) -> Wrench<L> {
        let all = L::lit(0.0).lt(L::lit(1.0));
        let now = self.now(m);
        let jitter = self.transmit(m, reference, all);
        self.tick_facility(m, interface, reference, now, jitter, all, &mut Unobserved);
        let wrench = self.arriving_wrench(m, all);
        self.end_tick();
        wrench
    }
}
