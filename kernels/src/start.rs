//! Start of a run: bodies at their dispersed initial poses and twists.

use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Arm, Bodies, Body, Masses, kinematics, seat_lever};
use crate::vector::{Mat3, Quat, Sym3, Vec3, vec3};

/// The bodies at the start: the chaser displaced by `offset` and turned by `tilt` about part A's origin, part A
/// moving at `closing_speed` and `drift` relative to part B, the target turning about its centre of mass.
///
/// A free chaser moves towards a target that turns in place; before a held base the target moves towards part A.
#[inline(always)]
pub fn start<R: Real, const N: usize>(m: &Plant, p: &Params<R>, masses: &Masses<R>) -> Bodies<R, N> {
    let zero = R::lit(0.0);
    // The target's part B stands where it stands, wherever its centre of mass is taken to be.
    let centre = Vec3::lit(m.target_pose.position) + Quat::lit(m.target_pose.attitude).rotate(masses.target_com);
    let mut s = Bodies {
        chaser: still(Vec3::zero(), Quat::lit(m.base_pose.attitude)),
        arm: Arm { angle: [zero; N], rate: [zero; N], turn: Vec3::zero() },
        drives: crate::fields::filled(zero),
        target: still(centre, Quat::lit(m.target_pose.attitude)),
        sway: crate::fields::filled(zero),
        impulse: Vec3::zero(),
        moment_impulse: Vec3::zero(),
    };
    // The chaser turns about part A's origin, which its nominal pose puts at `tool`.
    let tool = Vec3::lit(m.base_pose.position) + s.chaser.attitude.rotate(Vec3::lit(m.tool_start.position));
    s.chaser.attitude = Quat::from_rotation_vector(p.tilt).compose(s.chaser.attitude);
    let turned = kinematics(m, masses, &s);
    s.chaser.com = tool + p.offset - turned.parts.a.position;

    let target_rate = if m.held.target { Vec3::zero() } else { p.target_rate };
    let seat_lever = s.target.attitude.rotate(seat_lever(m, masses));
    if !m.held.target {
        let target_inertia = Sym3::<R>::lit(m.target_inertia).map(|e| e * masses.target_inertia_scale);
        s.target.spin = spin(turned.target_axes, target_inertia, target_rate);
    }
    let closing = vec3(p.closing_speed, zero, zero);
    if !m.held.base {
        s.chaser.spin = spin(turned.axes, turned.inverse_inertia.inverse(), p.chaser_rate);
        let tool_velocity = target_rate.cross(seat_lever) + closing + p.drift;
        s.chaser.momentum = (tool_velocity - p.chaser_rate.cross(turned.parts.a.position)) * turned.mass;
        s.arm.turn = p.chaser_rate;
    } else if !m.held.target {
        s.target.momentum = (target_rate.cross(seat_lever) + closing + p.drift) * -masses.target_mass;
    }

    s.impulse = s.chaser.momentum + s.target.momentum;
    s.moment_impulse = s.chaser.spin + s.chaser.com.cross(s.chaser.momentum) + s.target.spin;
    if m.held.base {
        s.moment_impulse = s.moment_impulse + s.target.com.cross(s.target.momentum);
    }
    s
}

/// A body at rest.
#[inline(always)]
fn still<R: Real>(com: Vec3<R>, attitude: Quat<R>) -> Body<R> {
    Body { com, com_step: Vec3::zero(), attitude, momentum: Vec3::zero(), spin: Vec3::zero() }
}

/// Angular momentum of a body whose own axes and inertia in them are given.
#[inline(always)]
fn spin<R: Real>(axes: Mat3<R>, inertia: Sym3<R>, omega: Vec3<R>) -> Vec3<R> {
    axes.times(inertia.times(axes.transposed_times(omega)))
}
