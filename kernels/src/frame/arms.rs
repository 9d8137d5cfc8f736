//! The robots in the frame: those that lag, or joint by joint; the twin of `wgsl/robots_lag.wgsl` and `robots_joint.wgsl`.

use super::{FacilityLanes, zero_wrench};
use crate::fields::filled;
use crate::lanes::Lane;
use crate::manipulator::cell::{Drives, SetPoint, first_set_point};
use crate::plant::Plant;
use crate::space::{Parts, Wrench};
use crate::staged::{drives_at, in_place, reaction, set_where};

/// Both robots joint by joint, and the wrench on part A that the next substep feels.
#[derive(Clone)]
pub(super) struct Arms<L: Lane> {
    pub(super) drives: [Drives<L>; 2],
    pub(super) set: [SetPoint<L>; 2],
    pub(super) push: Wrench<L>,
}

impl<L: Lane> Arms<L> {
    /// Before the first run.
    pub(super) fn idle() -> Self {
        let zero = L::lit(0.0);
        Self { drives: [filled(zero); 2], set: [filled(zero); 2], push: zero_wrench() }
    }

    /// Puts back what stood before in the lanes outside the mask.
    #[inline(always)]
    pub(super) fn keep(&mut self, mask: L::Mask, before: &Self) {
        for i in 0..2 {
            set_where(!mask, &mut self.drives[i], &before.drives[i]);
            set_where(!mask, &mut self.set[i], &before.set[i]);
        }
        set_where(!mask, &mut self.push, &before.push);
    }
}

impl<L: Lane> FacilityLanes<L> {
    /// The controllers take a tick's command.
    #[inline(always)]
    pub(super) fn take_command(&mut self, m: &Plant, reference: &Parts<L>) {
        if let Some(arms) = &mut self.arms {
            let ([cell1, cell2], p) = (m.robots(), &self.params);
            in_place::set_point(cell1, &p.robot1, &arms.drives[0], &mut arms.set[0], &reference.a);
            in_place::set_point(cell2, &p.robot2, &arms.drives[1], &mut arms.set[1], &reference.b);
        }
    }

    /// One substep of both robots and the rail.
    #[inline(always)]
    pub(super) fn move_robots(&mut self, m: &Plant, reference: &Parts<L>) {
        let Some(arms) = &mut self.arms else {
            in_place::robots(m, &self.params, &mut self.robots, reference);
            return;
        };
        let ([cell1, cell2], p) = (m.robots(), &self.params);
        let push_b = reaction(&crate::robot::mounted_parts(m, p, &self.robots), arms.push);
        in_place::drive(cell1, &p.robot1, &mut arms.drives[0], &arms.set[0], arms.push);
        in_place::drive(cell2, &p.robot2, &mut arms.drives[1], &arms.set[1], push_b);
        in_place::held_parts(m, &mut self.robots, &arms.drives[0], &arms.drives[1]);
    }

    /// The wrench on part A, laboratory axes, that the next substep feels.
    #[inline(always)]
    pub(super) fn push_robots(&mut self, w: Wrench<L>) {
        if let Some(arms) = &mut self.arms {
            arms.push = w;
        }
    }

    /// Puts the robots of the lanes in the mask on their first command.
    #[inline(never)]
    pub(super) fn place_robots(&mut self, m: &Plant, reference: &Parts<L>, fresh: L::Mask) {
        let mut placed = crate::robot::robots_at(m, reference);
        if let Some(arms) = &mut self.arms {
            let ([cell1, cell2], p) = (m.robots(), &self.params);
            let drives = [drives_at(cell1, &p.robot1, &reference.a), drives_at(cell2, &p.robot2, &reference.b)];
            let set = [first_set_point(&drives[0]), first_set_point(&drives[1])];
            in_place::held_parts(m, &mut placed, &drives[0], &drives[1]);
            let before = std::mem::replace(&mut **arms, Arms { drives, set, push: zero_wrench() });
            arms.keep(fresh, &before);
        }
        set_where(fresh, &mut self.robots, &placed);
    }
}
