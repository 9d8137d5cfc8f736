//! Robot stage at the joint level: both robots with their drives, controllers and links, in place of the lag.
//!
//! Robot 1 stands on the rail; contact pushes both robots. What one robot does by itself is [`crate::manipulator::cell`].

use crate::manipulator::cell::{Drives, held_part};
use crate::plant::Plant;
use crate::real::Real;
use crate::robot::{Axes, Robots};
use crate::space::{Motion, Parts, Wrench};

/// The parts where the joints and the rail hold them; part B's mount stays as it is.
#[inline(always)]
pub fn held_parts<R: Real>(m: &Plant, s: &Robots<R>, drives1: &Drives<R>, drives2: &Drives<R>) -> Robots<R> {
    let [cell1, cell2] = m.robots();
    let axes = |(motion, [rail, rail_rate]): (Motion<R>, [R; 2])| Axes { motion, rail, rail_rate };
    Robots {
        robot1: axes(held_part(cell1, drives1)),
        robot2: axes(held_part(cell2, drives2)),
        limited: drives1.limited.max(drives2.limited),
        ..*s
    }
}

/// The contact's wrench on part B about B's origin, from the one on part A about A's.
#[inline(always)]
pub fn reaction<R: Real>(parts: &Parts<R>, w: Wrench<R>) -> Wrench<R> {
    let lever = parts.a.position - parts.b.position;
    Wrench { force: -w.force, moment: -(w.moment + lever.cross(w.force)) }
}
