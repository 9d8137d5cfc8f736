//! The stage functions as the frame calls them: each compiled on its own for the lanes' instruction set.

use crate::contact::{LatchState, Pair, Point, PointContact};
use crate::lanes::Lane;
use crate::metrics::Metrics;
use crate::monitor::{Touch, Watch};
use crate::noise::Normals;
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::{Reference, Robots};
use crate::sensor::Sensor;
use crate::space::{Actuation, Arm, Bodies, Kinematics, Masses, Motion, Parts, Wrench};
use crate::vector::{Quat, Vec3};

/// Wraps stage functions of the same name.
macro_rules! staged {
    ($($(#[$doc:meta])* $module:ident::$name:ident $(<$n:ident>)? ($($argument:ident: $ty:ty),*) -> $result:ty;)*) => {
        $(
            $(#[$doc])*
            #[inline(always)]
            #[allow(clippy::too_many_arguments, reason = "a stage names all that it reads")]
            pub fn $name<L: Lane $(, const $n: usize)?>($($argument: $ty),*) -> $result {
                L::stage(|| crate::$module::$name($($argument),*))
            }
        )*
    };
}

staged! {
    /// [`crate::start::start`]
    start::start<N>(m: &Plant, p: Params<L>, masses: Masses<L>) -> Bodies<L, N>;
    /// [`crate::space::kinematics`]
    space::kinematics<N>(m: &Plant, masses: Masses<L>, s: Bodies<L, N>) -> Kinematics<L, N>;
    /// [`crate::space::advance`]
    space::advance<N>(m: &Plant, masses: Masses<L>, s: Bodies<L, N>, k: Kinematics<L, N>, u: Actuation<L, N>, w: Wrench<L>) -> Bodies<L, N>;
    /// [`crate::guidance::guide`]
    guidance::guide<N>(m: &Plant, p: Params<L>, masses: Masses<L>, arm: Arm<L, N>, base: Quat<L>, k: Kinematics<L, N>, touched: L) -> Actuation<L, N>;
    /// [`crate::contact::contact_point`]
    contact::contact_point(m: &Plant, pair: Pair<L>, parts: Parts<L>, point: Point<L>, bristle: Vec3<L>) -> PointContact<L>;
    /// [`crate::contact::latch`]
    contact::latch(m: &Plant, p: Params<L>, parts: Parts<L>, closed: L) -> LatchState<L>;
    /// [`crate::robot::command`]
    robot::command(m: &Plant, parts: Parts<L>) -> Parts<L>;
    /// [`crate::robot::carry_on`]
    robot::carry_on(m: &Plant, parts: Parts<L>, periods: L) -> Parts<L>;
    /// [`crate::robot::substitute`]
    robot::substitute(m: &Plant, last: Parts<L>, lost_before: L) -> Parts<L>;
    /// [`crate::robot::interpolate`]
    robot::interpolate(m: &Plant, r: Reference<L>) -> Parts<L>;
    /// [`crate::robot::robots`]
    robot::robots(m: &Plant, p: Params<L>, s: Robots<L>, told: Parts<L>) -> Robots<L>;
    /// [`crate::sensor::feed_back`]
    sensor::feed_back(a: Motion<L>, w: Wrench<L>) -> Wrench<L>;
    /// [`crate::sensor::low_pass`]
    sensor::low_pass(m: &Plant, p: Params<L>, s: Sensor<L>, w: Wrench<L>) -> Sensor<L>;
    /// [`crate::sensor::sample`]
    sensor::sample(m: &Plant, p: Params<L>, s: Sensor<L>, noise: Wrench<L>) -> Sensor<L>;
    /// [`crate::noise::normals`]
    noise::normals(u: L, v: L) -> Normals<L>;
    /// [`crate::monitor::gather`]
    monitor::gather(sum: Touch<L>, c: PointContact<L>) -> Touch<L>;
    /// [`crate::monitor::observe`]
    monitor::observe(m: &Plant, s: Watch<L>, time: L, parts: Parts<L>, simulated: Parts<L>, touch: Touch<L>, latch: LatchState<L>) -> Watch<L>;
    /// [`crate::monitor::finish`]
    monitor::finish(m: &Plant, s: Watch<L>, time: L, simulated: Parts<L>, last: L) -> Watch<L>;
    /// [`crate::monitor::metrics`]
    monitor::metrics<N>(m: &Plant, s: Watch<L>, bodies: Bodies<L, N>, created: L) -> Metrics<L>;
}
