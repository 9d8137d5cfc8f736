//! Guidance stage: base thrust during the approach and the arm's controller, once per tick.

use crate::chain::dynamics::Course;
use crate::chain::inertia::Force;
use crate::manipulator::ArmDrives;
use crate::model::{ArmControl, Brakes, Thrust};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Actuation, Arm, Kinematics, Masses, Parts, Wrench, mount_course, on_last_link, posture};
use crate::vector::{Quat, Vec3, vec3};

/// Thrust and joint torques for the coming tick; `touched` is 1 after the first touch, when thrust ends.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a stage names all that it reads")]
pub fn guide<R: Real, const N: usize>(
    m: &Plant,
    p: &Params<R>,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    drives: &ArmDrives<R, N>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
    touched: R,
) -> Actuation<R, N> {
    let (thrust, torque) = approach(m, p.closing_speed, &k.parts, touched);
    let arm = &seen(m, arm, drives);
    let joint = match m.guidance.arm {
        ArmControl::JointPd { stiffness, damping } => {
            let mut torque = [R::lit(0.0); N];
            for i in 0..N {
                torque[i] = -(R::lit(stiffness[i]).mul_add(arm.angle[i], R::lit(damping[i]) * arm.rate[i]));
            }
            torque
        }
        ArmControl::ComputedTorque { bandwidth, damping_ratio } => {
            let (spring, brake) = (R::lit(-bandwidth * bandwidth), R::lit(-2.0 * damping_ratio * bandwidth));
            let mut wanted = [R::lit(0.0); N];
            for (i, wanted) in wanted.iter_mut().enumerate() {
                *wanted = spring.mul_add(arm.angle[i], brake * arm.rate[i]);
            }
            inverse_dynamics(m, masses, arm.rate, k, thrust, torque, wanted)
        }
        ArmControl::CartesianImpedance { .. } => cartesian_impedance(m, masses, arm, base, k),
    };
    let braked = match m.brakes {
        Brakes::Open => R::lit(0.0),
        Brakes::Closed => R::lit(1.0),
        Brakes::CloseAtTouch => touched,
    };
    Actuation { braked, thrust, torque, joint }
}

/// The joints as their encoders show them: on the motors, where there are any.
#[inline(always)]
fn seen<R: Real, const N: usize>(m: &Plant, arm: &Arm<R, N>, drives: &ArmDrives<R, N>) -> Arm<R, N> {
    let mut seen = *arm;
    if !m.drives.is_empty() {
        for i in 0..N {
            seen.angle[i] = arm.angle[i] + drives.windup[i];
            seen.rate[i] = drives.motor_rate[i];
        }
    }
    seen
}

/// PD of part A towards part B: speed along the axis, place across it, attitude; nothing after touch.
#[inline(always)]
fn approach<R: Real>(m: &Plant, closing_speed: R, parts: &Parts<R>, touched: R) -> (Vec3<R>, Vec3<R>) {
    let Thrust::Approach {
        speed_gain,
        lateral_stiffness,
        lateral_damping,
        attitude_stiffness,
        attitude_damping,
        max_force,
        max_torque,
    } = m.guidance.thrust
    else {
        return (Vec3::zero(), Vec3::zero());
    };
    let (a, b) = (&parts.a, &parts.b);
    let gap = b.attitude.rotate_back(a.position - b.position);
    let slide = b.attitude.rotate_back(a.velocity - b.velocity);
    let (spring, damper) = (R::lit(lateral_stiffness), R::lit(lateral_damping));
    let force = vec3(
        R::lit(speed_gain) * (closing_speed - slide.x),
        -(spring.mul_add(gap.y, damper * slide.y)),
        -(spring.mul_add(gap.z, damper * slide.z)),
    );
    let relative = a.attitude.compose(b.attitude.conjugate());
    let twist = relative.small_rotation_vector();
    let torque = (a.omega - b.omega).scale_add(R::lit(-attitude_damping), twist * R::lit(-attitude_stiffness));
    let on = R::lit(1.0) - touched;
    (b.attitude.rotate(force.clamp(R::lit(max_force))) * on, torque.clamp(R::lit(max_torque)) * on)
}

/// Joint torques that give the wanted joint accelerations while the base floats freely, or is held.
///
/// About the system's centre of mass the base's reaction splits into rotation and translation.
#[inline(always)]
fn inverse_dynamics<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    rate: [R; N],
    k: &Kinematics<R, N>,
    thrust: Vec3<R>,
    torque: Vec3<R>,
    wanted: [R; N],
) -> [R; N] {
    let posture = posture(m, masses, &k.turns);
    if m.held.base {
        let mut forces = [Force::zero(); N];
        posture.link_forces(mount_course(m, k), &rate, &wanted, &mut forces);
        return posture.passed(&forces, Force::zero()).0;
    }
    let none = Vec3::zero();
    let held = Course { rate: k.rate, turning: none, acceleration: none };
    let mut forces = [Force::zero(); N];
    posture.link_forces(held, &rate, &wanted, &mut forces);
    let total = posture.base_force(held).plus(posture.passed(&forces, Force::zero()).1);
    // What is left of thrust and torque accelerates the whole; its centre of mass is at `com` from the base's.
    let force = k.axes.transposed_times(thrust) - total.force;
    let moment = k.axes.transposed_times(torque) - total.moment - k.com.cross(force);
    let turning = k.inverse_inertia.times(moment);
    let acceleration = force * (R::lit(1.0) / k.mass) - turning.cross(k.com);
    posture.link_forces(Course { turning, acceleration, ..held }, &rate, &wanted, &mut forces);
    posture.passed(&forces, Force::zero()).0
}

/// Spring and damper between the end-effector and its start pose on the base, through the transposed Jacobian.
#[inline(always)]
fn cartesian_impedance<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
) -> [R; N] {
    let ArmControl::CartesianImpedance { stiffness, damping, rotation_stiffness, rotation_damping, joint_damping } =
        m.guidance.arm
    else {
        return [R::lit(0.0); N];
    };
    let reach = &k.reach;
    let error = base.rotate(Vec3::lit(m.tool_start.position)) - k.axes.times(reach.position);
    let turn = base.compose(Quat::lit(m.tool_start.attitude)).compose(k.parts.a.attitude.conjugate());
    let twist = turn.small_rotation_vector();
    let force = k.axes.times(reach.velocity).scale_add(R::lit(-damping), error * R::lit(stiffness));
    let moment = k.axes.times(reach.omega).scale_add(R::lit(-rotation_damping), twist * R::lit(rotation_stiffness));
    let tip = on_last_link(m, &k.parts.a, Wrench { force, moment });
    let (mut torque, _) = posture(m, masses, &k.turns).passed(&[Force::zero(); N], tip);
    for (i, torque) in torque.iter_mut().enumerate() {
        *torque = arm.rate[i].mul_add(R::lit(-joint_damping), *torque);
    }
    torque
}
