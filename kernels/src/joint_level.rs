//! Robot stage at the joint level: both robots with their drives, controllers and links, in place of the lag.
//!
//! Robot 1 stands on the rail and is told what the rail leaves of part A's motion; contact pushes both robots.

use crate::manipulator::cell::{self, Cell, Drives, SetPoint};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::robot::{Axes, Robots, mounted_parts, rail_share};
use crate::space::{Parts, Wrench};
use crate::vector::Vec3;

/// One substep of robot 1 at the joint level; `load` is the wrench on part A about its origin, laboratory axes.
#[inline(always)]
pub fn drive1<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Drives<R>,
    aim: &SetPoint<R>,
    at: &Robots<R>,
    load: Wrench<R>,
) -> Drives<R> {
    let push = m.facility.rail.map_or(Vec3::zero(), |rail| Vec3::lit(rail.axis) * at.robot1.rail_acceleration);
    cell::drive(&cells(m)[0], &p.robot1, s, aim, load, push)
}

/// One substep of robot 2 at the joint level; `load` is the wrench on part A about A's origin, its negative acts on B.
#[inline(always)]
pub fn drive2<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Drives<R>,
    aim: &SetPoint<R>,
    at: &Robots<R>,
    load: Wrench<R>,
) -> Drives<R> {
    let parts = mounted_parts(m, at);
    let lever = parts.a.position - parts.b.position;
    let own = Wrench { force: -load.force, moment: -(load.moment + lever.cross(load.force)) };
    cell::drive(&cells(m)[1], &p.robot2, s, aim, own, Vec3::zero())
}

/// The parts where the joints hold them, on the rail as it is.
#[inline(always)]
pub fn held_parts<R: Real>(m: &Plant, s: &Robots<R>, drives1: &Drives<R>, drives2: &Drives<R>) -> Robots<R> {
    let cells = cells(m);
    Robots {
        robot1: Axes { motion: cell::held_part(&cells[0], drives1), ..s.robot1 },
        robot2: Axes { motion: cell::held_part(&cells[1], drives2), ..s.robot2 },
        limited: s.limited.max(drives1.limited).max(drives2.limited),
    }
}

/// The robots of the joint level.
#[inline(always)]
fn cells(m: &Plant) -> &[Cell; 2] {
    m.cells.as_ref().expect("only the joint level has cells")
}

/// Set-point of robot 1 for a tick.
#[inline(always)]
pub fn set_point1<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Drives<R>,
    last: &SetPoint<R>,
    told: &Parts<R>,
) -> SetPoint<R> {
    cell::set_point(&cells(m)[0], &p.robot1, s, last, &rail_share(m, told.a).2)
}

/// Set-point of robot 2 for a tick.
#[inline(always)]
pub fn set_point2<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Drives<R>,
    last: &SetPoint<R>,
    told: &Parts<R>,
) -> SetPoint<R> {
    cell::set_point(&cells(m)[1], &p.robot2, s, last, &told.b)
}

/// Robot 1 on its first command.
#[inline(always)]
pub fn drives_at1<R: Real>(m: &Plant, p: &Params<R>, told: &Parts<R>) -> Drives<R> {
    cell::drives_at(&cells(m)[0], &p.robot1, &rail_share(m, told.a).2)
}

/// Robot 2 on its first command.
#[inline(always)]
pub fn drives_at2<R: Real>(m: &Plant, p: &Params<R>, told: &Parts<R>) -> Drives<R> {
    cell::drives_at(&cells(m)[1], &p.robot2, &told.b)
}
