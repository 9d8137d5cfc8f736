//! The stage functions as the frame calls them: each compiled on its own for the lanes' instruction set.

use crate::arm_motion::ArmMotion;
use crate::capture_ring::Ring;
use crate::compensator::Compensation;
use crate::contact::{LatchState, Point, PointContact, PointState};
use crate::fields::Bundle;
use crate::grip::Grip;
use crate::impedance::Admittance;
use crate::lanes::{Lane, Stage};
use crate::load::Load;
use crate::manipulator::cell::{Cell, Drives, SetPoint};
use crate::manipulator::{ArmDrives, DriveParams};
use crate::material::Pair;
use crate::metrics::Metrics;
use crate::model::Finger;
use crate::monitor::{Touch, Watch};
use crate::noise::Normals;
use crate::params::Params;
use crate::plant::{ContactPair, Plant, ShellOfPair};
use crate::robot::Robots;
use crate::sensor::Sensor;
use crate::session::{Asked, Clearance, Observed, Session};
use crate::space::{Actuation, Arm, Bodies, Kinematics, Masses, Motion, Parts, Wrench};
use crate::test_motion::{Followed, Tracking};
use crate::thrusters::Firing;
use crate::vector::Quat;
use std::marker::PhantomData;

/// Wraps stage functions of the same name; `m` is the plant, for those that read it.
///
/// A stage call is a struct with an always-inlined method, not a closure: the compiler need not inline a closure into
/// the function that carries the instruction set, and what is left outside has no vectors.
macro_rules! staged {
    ($(
        $(#[$doc:meta])*
        $module:ident::$name:ident $(<$n:ident>)? ($($m:ident)?; $($argument:ident: $ty:ty),*) -> $result:ty;
    )*) => {
        $(
            $(#[$doc])*
            #[inline(always)]
            #[allow(clippy::too_many_arguments, reason = "a stage names all that it reads")]
            #[allow(clippy::extra_unused_lifetimes, reason = "some stages take nothing by reference")]
            pub fn $name<'a, L: Lane $(, const $n: usize)?>($($m: &'a Plant,)? $($argument: $ty),*) -> $result {
                struct Call<'a, L: Lane $(, const $n: usize)?> {
                    $($m: &'a Plant,)?
                    $($argument: $ty,)*
                    lifetime: PhantomData<&'a L>,
                }
                impl<'a, L: Lane $(, const $n: usize)?> Stage for Call<'a, L $(, $n)?> {
                    type Output = $result;
                    #[inline(always)]
                    fn run(self) -> $result {
                        crate::$module::$name($(self.$m,)? $(self.$argument),*)
                    }
                }
                L::stage(Call { $($m,)? $($argument,)* lifetime: PhantomData })
            }
        )*
    };
}

staged! {
    /// [`crate::start::start`]
    start::start<N>(m; p: &'a Params<L>, masses: &'a Masses<L>) -> Bodies<L, N>;
    /// [`crate::space::kinematics`]
    space::kinematics<N>(m; masses: &'a Masses<L>, s: &'a Bodies<L, N>) -> Kinematics<L, N>;
    /// [`crate::space::update_kinematics`]
    space::update_kinematics<N>(m; masses: &'a Masses<L>, s: &'a Bodies<L, N>, k: &'a mut Kinematics<L, N>) -> ();
    /// [`crate::space::advance_in_place`]
    space::advance_in_place<N>(m; masses: &'a Masses<L>, s: &'a mut Bodies<L, N>, k: &'a Kinematics<L, N>, u: &'a Actuation<L, N>, w: Wrench<L>, back: Wrench<L>) -> ();
    /// [`crate::capture_ring::ring_at`]
    capture_ring::ring_at(m; parts: &'a Parts<L>) -> Ring<L>;
    /// [`crate::capture_ring::on_ring`]
    capture_ring::on_ring(m; s: &'a Ring<L>, parts: &'a Parts<L>) -> Parts<L>;
    /// [`crate::guidance::guide`]
    guidance::guide<N>(m; p: &'a Params<L>, masses: &'a Masses<L>, arm: &'a Arm<L, N>, drives: &'a ArmDrives<L, N>, base: Quat<L>, k: &'a Kinematics<L, N>, touched: L, motion: &'a ArmMotion<L, N>, firing: &'a Firing<L>) -> Actuation<L, N>;
    /// [`crate::contact::contact_point`]
    contact::contact_point(m; of: &'a ContactPair, pair: &'a Pair<L>, parts: &'a Parts<L>, point: Point<L>, state: PointState<L>) -> PointContact<L>;
    /// [`crate::contact::point_on_exact`]
    contact::point_on_exact(m; of: &'a ContactPair, pair: &'a Pair<L>, parts: &'a Parts<L>, point: Point<L>, state: PointState<L>) -> PointContact<L>;
    /// [`crate::contact::shell::touch_shell`]
    contact::touch_shell(m; shell: &'a ShellOfPair, pair: &'a Pair<L>, parts: &'a Parts<L>, state: &'a PointState<L>) -> PointContact<L>;
    /// [`crate::contact::latch`]
    contact::latch(m; p: &'a Params<L>, parts: &'a Parts<L>, closed: L, gripped: L) -> LatchState<L>;
    /// [`crate::contact::with_finger`]
    contact::with_finger(; finger: &'a Finger, parts: &'a Parts<L>, grip: &'a Grip<L>) -> Parts<L>;
    /// [`crate::contact::finger_power`]
    contact::finger_power(; finger: &'a Finger, parts: &'a Parts<L>, grip: &'a Grip<L>, c: &'a PointContact<L>) -> L;
    /// [`crate::contact::of_finger`]
    contact::of_finger(; finger: &'a Finger, parts: &'a Parts<L>, grip: &'a Grip<L>, c: &'a PointContact<L>) -> PointContact<L>;
    /// [`crate::robot::command`]
    robot::command(m; parts: &'a Parts<L>) -> Parts<L>;
    /// [`crate::robot::by_differences`]
    robot::by_differences(m; first: &'a Parts<L>, second: &'a Parts<L>, third: &'a Parts<L>) -> Parts<L>;
    /// [`crate::impedance::displaced`]
    impedance::displaced(m; reference: &'a Parts<L>, s: &'a Admittance<L>) -> Parts<L>;
    /// [`crate::test_motion::with_test`]
    test_motion::with_test(m; p: &'a Params<L>, reference: &'a Parts<L>, time: L) -> Parts<L>;
    /// [`crate::test_motion::followed`]
    test_motion::followed(m; p: &'a Params<L>, s: &'a Tracking<L>) -> Followed<L>;
    /// [`crate::robot::extrapolate`]
    robot::extrapolate(m; parts: &'a Parts<L>, periods: L) -> Parts<L>;
    /// [`crate::robot::on_course`]
    robot::on_course(m; p: &'a Params<L>, reference: &'a Parts<L>) -> Parts<L>;
    /// [`crate::robot::substitute`]
    robot::substitute(m; last: &'a Parts<L>, lost_before: L) -> Parts<L>;
    /// [`crate::robot::interpolate`]
    robot::interpolate(m; first: &'a Parts<L>, second: &'a Parts<L>, third: &'a Parts<L>, place: L) -> Parts<L>;
    /// [`crate::manipulator::cell::drives_at`]
    manipulator::drives_at(; cell: &'a Cell, p: &'a DriveParams<L>, reference: &'a Motion<L>) -> Drives<L>;
    /// [`crate::joint_level::reaction`]
    joint_level::reaction(; parts: &'a Parts<L>, w: Wrench<L>) -> Wrench<L>;
    /// [`crate::sensor::feed_back`]
    sensor::feed_back(; a: Motion<L>, w: Wrench<L>) -> Wrench<L>;
    /// [`crate::session::axes_asked`]
    session::axes_asked(m; reference: &'a Parts<L>) -> Asked<L>;
    /// [`crate::session::range_used`]
    session::range_used(m; asked: &'a Asked<L>, reference: &'a Parts<L>) -> L;
    /// [`crate::session::clearance`]
    session::clearance(m; asked: &'a Asked<L>, reference: &'a Parts<L>) -> Clearance<L>;
    /// [`crate::load::felt`]
    load::felt(m; s: &'a Load<L>, a: Motion<L>, w: Wrench<L>) -> Wrench<L>;
    /// [`crate::compensator::compensate`]
    compensator::compensate(m; p: &'a Params<L>, s: &'a Compensation<L>, now: &'a Parts<L>, past: &'a Parts<L>, measured: Wrench<L>) -> Compensation<L>;
    /// [`crate::noise::normals`]
    noise::normals(; u: L, v: L) -> Normals<L>;
    /// [`crate::monitor::metrics`]
    monitor::metrics<N>(m; s: &'a Watch<L>, bodies: &'a Bodies<L, N>, ring: &'a Ring<L>, followed: &'a Followed<L>, facility: L) -> Metrics<L>;
}

/// Takes over a value where the mask holds.
#[inline(always)]
pub fn set_where<L: Lane, B: Bundle<L>>(mask: L::Mask, state: &mut B, value: &B) {
    struct Call<'a, L: Lane, B> {
        mask: L::Mask,
        state: &'a mut B,
        value: &'a B,
    }
    impl<L: Lane, B: Bundle<L>> Stage for Call<'_, L, B> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.state.set_where(self.mask, self.value);
        }
    }
    L::stage(Call { mask, state, value });
}

/// Stages that carry a state on, in its place: in lanes a copy of what they return costs as much as a tenth of a step.
pub mod in_place {
    use super::*;

    /// Wraps stage functions of the same name; the arguments between the bars are the state.
    macro_rules! staged_in_place {
        ($(
            $(#[$doc:meta])*
            $module:ident::$name:ident $(<$n:ident>)?
            ($($m:ident)?; $($before:ident: $bty:ty),* | $s:ident: $state:ty | $($argument:ident: $ty:ty),*);
        )*) => {
            $(
                $(#[$doc])*
                #[inline(always)]
                #[allow(clippy::too_many_arguments, reason = "a stage names all that it reads")]
                pub fn $name<'a, L: Lane $(, const $n: usize)?>(
                    $($m: &'a Plant,)? $($before: $bty,)* $s: &'a mut $state, $($argument: $ty),*
                ) {
                    struct Call<'a, L: Lane $(, const $n: usize)?> {
                        $($m: &'a Plant,)?
                        $($before: $bty,)*
                        $s: &'a mut $state,
                        $($argument: $ty,)*
                    }
                    impl<'a, L: Lane $(, const $n: usize)?> Stage for Call<'a, L $(, $n)?> {
                        type Output = ();
                        #[inline(always)]
                        fn run(self) {
                            *self.$s = crate::$module::$name(
                                $(self.$m,)? $(self.$before,)* &*self.$s, $(self.$argument),*
                            );
                        }
                    }
                    L::stage(Call { $($m,)? $($before,)* $s, $($argument,)* })
                }
            )*
        };
    }

    staged_in_place! {
        /// [`crate::monitor::gather`]
        monitor::gather(; | sum: Touch<L> | c: &'a PointContact<L>);
        /// [`crate::monitor::observe`]
        monitor::observe(m; | s: Watch<L> | time: L, parts: &'a Parts<L>, simulated: &'a Parts<L>, touch: &'a Touch<L>, latch: &'a LatchState<L>);
        /// [`crate::monitor::finish`]
        monitor::finish(m; | s: Watch<L> | time: L, simulated: &'a Parts<L>, last: L, facility: L);
        /// [`crate::capture_ring::push_ring`]
        capture_ring::push_ring(m; | s: Ring<L> | parts: &'a Parts<L>, w: Wrench<L>);
        /// [`crate::capture_ring::settle_ring`]
        capture_ring::settle_ring(m; | s: Ring<L> |);
        /// [`crate::arm_motion::follow`]
        arm_motion::follow<N>(m; p: &'a Params<L> | s: ArmMotion<L, N> | arm: &'a Arm<L, N>, drives: &'a ArmDrives<L, N>, base: Quat<L>, k: &'a Kinematics<L, N>, felt: &'a Wrench<L>, captured: L, noise: &'a Wrench<L>);
        /// [`crate::thrusters::fire`]
        thrusters::fire<N>(m; | s: Firing<L> | base: Quat<L>, k: &'a Kinematics<L, N>, touched: L);
        /// [`crate::arm_motion::feel`]
        arm_motion::feel(m; | s: Wrench<L> | a: Motion<L>, w: Wrench<L>);
        /// [`crate::session::supervise`]
        session::supervise(m; | s: Session<L> | seen: &'a Observed<L>, cycle: L);
        /// [`crate::robot::robots`]
        robot::robots(m; p: &'a Params<L> | s: Robots<L> | reference: &'a Parts<L>);
        /// [`crate::fixture::push_fixture`]
        fixture::push_fixture(m; p: &'a Params<L> | s: Robots<L> | w: Wrench<L>);
        /// [`crate::manipulator::cell::set_point`]
        manipulator::set_point(; cell: &'a Cell, p: &'a DriveParams<L>, s: &'a Drives<L> | last: SetPoint<L> | reference: &'a Motion<L>);
        /// [`crate::manipulator::cell::drive`]
        manipulator::drive(; cell: &'a Cell, p: &'a DriveParams<L> | s: Drives<L> | reference: &'a SetPoint<L>, load: Wrench<L>);
        /// [`crate::joint_level::held_parts`]
        joint_level::held_parts(m; | s: Robots<L> | drives1: &'a Drives<L>, drives2: &'a Drives<L>);
        /// [`crate::impedance::step_admittance`]
        impedance::step_admittance(m; | s: Admittance<L> | a: Motion<L>, measured: Wrench<L>);
        /// [`crate::test_motion::track`]
        test_motion::track(m; p: &'a Params<L> | s: Tracking<L> | parts: &'a Parts<L>, time: L);
        /// [`crate::load::carry`]
        load::carry(m; | s: Load<L> | a: Motion<L>);
        /// [`crate::sensor::low_pass`]
        sensor::low_pass(m; p: &'a Params<L> | s: Sensor<L> | w: Wrench<L>);
        /// [`crate::sensor::sample`]
        sensor::sample(m; p: &'a Params<L> | s: Sensor<L> | time: L, noise: Wrench<L>);
        /// [`crate::load::without_load`]
        load::without_load(m; p: &'a Params<L>, load: &'a Load<L>, a: Motion<L> | sensor: Sensor<L> |);
    }
}
