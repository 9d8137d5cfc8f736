//! Guidance stage: base thrust during the approach and the arm's controller, once per tick.

use crate::arm_motion::{ArmMotion, of_phase, on_encoders};
use crate::arm_plan::ArmPlan;
use crate::chain::dynamics::Course;
use crate::chain::inertia::Force;
use crate::manipulator::ArmDrives;
use crate::model::{ArmControl, Brakes, Thrust};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Actuation, Arm, Kinematics, Masses, Parts, Wrench, mount_course, on_last_link, posture};
use crate::thrusters::{Firing, thruster_torque};
use crate::vector::{Quat, Vec3, vec3};

/// Thrust and joint torques for the coming tick; `touched` is 1 after the first touch, when thrust ends.
///
/// `motion` is what the arm's plan wants now; without a plan the controller holds the start posture. `firing` are the
/// thrusters.
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
    motion: &ArmMotion<R, N>,
    firing: &Firing<R>,
) -> Actuation<R, N> {
    let (thrust, mut torque) = approach(m, p.closing_speed, &k.parts, touched);
    if let Some(thrusters) = &m.guidance.thrusters {
        torque = torque + thruster_torque(thrusters, firing, base);
    }
    let arm = &on_encoders(m, arm, drives);
    let joint = match &m.guidance.plan {
        None => holding(m, masses, arm, base, k, (thrust, torque)),
        Some(plan) => following(m, plan, masses, arm, base, k, (thrust, torque), motion),
    };
    let braked = match m.brakes {
        Brakes::Open => R::lit(0.0),
        Brakes::Closed => R::lit(1.0),
        Brakes::CloseAtTouch => touched,
    };
    Actuation { braked, thrust, torque, joint }
}

/// Joint torques that hold the start posture, or part A's start pose on the base.
#[inline(always)]
fn holding<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
    push: (Vec3<R>, Vec3<R>),
) -> [R; N] {
    match m.guidance.arm {
        ArmControl::JointPd { stiffness, damping } => {
            let (mut spring, mut damper) = ([R::lit(0.0); N], [R::lit(0.0); N]);
            for i in 0..N {
                (spring[i], damper[i]) = (R::lit(stiffness[i]), R::lit(damping[i]));
            }
            joint_pd(arm, &spring, &damper)
        }
        ArmControl::ComputedTorque { bandwidth, damping_ratio } => {
            let (spring, brake) = (R::lit(-bandwidth * bandwidth), R::lit(-2.0 * damping_ratio * bandwidth));
            let mut wanted = [R::lit(0.0); N];
            for (i, wanted) in wanted.iter_mut().enumerate() {
                *wanted = spring.mul_add(arm.angle[i], brake * arm.rate[i]);
            }
            inverse_dynamics(m, masses, arm.rate, k, push.0, push.1, wanted)
        }
        ArmControl::CartesianImpedance { stiffness, damping, rotation_stiffness, rotation_damping, joint_damping } => {
            let gains = ImpedanceGains {
                stiffness: R::lit(stiffness),
                damping: R::lit(damping),
                rotation_stiffness: R::lit(rotation_stiffness),
                rotation_damping: R::lit(rotation_damping),
                joint_damping: R::lit(joint_damping),
            };
            let reach = &k.reach;
            let error = base.rotate(Vec3::lit(m.tool_start.position)) - k.axes.times(reach.position);
            let turn = base.compose(Quat::lit(m.tool_start.attitude)).compose(k.parts.a.attitude.conjugate());
            let (velocity, omega) = (k.axes.times(reach.velocity), k.axes.times(reach.omega));
            let error = PoseError { error, twist: turn.small_rotation_vector(), velocity, omega };
            cartesian_impedance(m, masses, arm, k, gains, error)
        }
    }
}

/// Joint torques that follow what the plan wants, each phase with its own controller.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a stage names all that it reads")]
fn following<R: Real, const N: usize>(
    m: &Plant,
    plan: &ArmPlan,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
    push: (Vec3<R>, Vec3<R>),
    motion: &ArmMotion<R, N>,
) -> [R; N] {
    let (phase, mut torque) = (motion.phase, [R::lit(0.0); N]);
    let mut error = *arm;
    for i in 0..N {
        error.angle[i] = arm.angle[i] - motion.angle[i];
        error.rate[i] = arm.rate[i] - motion.rate[i];
    }
    if uses(plan, |control| matches!(control, ArmControl::JointPd { .. })) {
        let (mut spring, mut damper) = ([R::lit(0.0); N], [R::lit(0.0); N]);
        for i in 0..N {
            spring[i] = of_phase(plan, phase, |phase| match phase.control {
                ArmControl::JointPd { stiffness, .. } => stiffness[i],
                _ => 0.0,
            });
            damper[i] = of_phase(plan, phase, |phase| match phase.control {
                ArmControl::JointPd { damping, .. } => damping[i],
                _ => 0.0,
            });
        }
        torque = joint_pd(&error, &spring, &damper);
    }
    if uses(plan, |control| matches!(control, ArmControl::ComputedTorque { .. })) {
        let spring = of_phase(plan, phase, |phase| match phase.control {
            ArmControl::ComputedTorque { bandwidth, .. } => -bandwidth * bandwidth,
            _ => 0.0,
        });
        let brake = of_phase(plan, phase, |phase| match phase.control {
            ArmControl::ComputedTorque { bandwidth, damping_ratio } => -2.0 * damping_ratio * bandwidth,
            _ => 0.0,
        });
        let mut wanted = motion.gain;
        for (i, wanted) in wanted.iter_mut().enumerate() {
            *wanted = *wanted + spring.mul_add(error.angle[i], brake * error.rate[i]);
        }
        let own = inverse_dynamics(m, masses, arm.rate, k, push.0, push.1, wanted);
        torque = where_used(plan, phase, |control| matches!(control, ArmControl::ComputedTorque { .. }), own, torque);
    }
    if uses(plan, ArmControl::is_cartesian) {
        let gains = impedance_gains(plan, phase);
        let reach = &k.reach;
        let place = base.rotate(motion.place.position) - k.axes.times(reach.position);
        let turn = base.compose(motion.place.attitude).compose(k.parts.a.attitude.conjugate());
        let error = PoseError {
            error: place,
            twist: turn.small_rotation_vector(),
            velocity: k.axes.times(reach.velocity) - base.rotate(motion.velocity),
            omega: k.axes.times(reach.omega) - base.rotate(motion.omega),
        };
        let own = cartesian_impedance(m, masses, arm, k, gains, error);
        torque = where_used(plan, phase, ArmControl::is_cartesian, own, torque);
    }
    torque
}

/// Whether a phase has a controller of a kind.
fn uses(plan: &ArmPlan, is: fn(&ArmControl) -> bool) -> bool {
    plan.phases.iter().any(|phase| is(&phase.control))
}

/// Torques of a kind of controller in the phases that have it, others in the rest.
#[inline(always)]
fn where_used<R: Real, const N: usize>(
    plan: &ArmPlan,
    phase: R,
    is: fn(&ArmControl) -> bool,
    own: [R; N],
    other: [R; N],
) -> [R; N] {
    let on = R::lit(0.5).lt(of_phase(plan, phase, |phase| if is(&phase.control) { 1.0 } else { 0.0 }));
    let mut torque = own;
    for i in 0..N {
        torque[i] = R::select(on, own[i], other[i]);
    }
    torque
}

/// Gains of the impedance, of the phase.
#[inline(always)]
fn impedance_gains<R: Real>(plan: &ArmPlan, phase: R) -> ImpedanceGains<R> {
    ImpedanceGains {
        stiffness: of_phase(plan, phase, |phase| impedance_of(&phase.control)[0]),
        damping: of_phase(plan, phase, |phase| impedance_of(&phase.control)[1]),
        rotation_stiffness: of_phase(plan, phase, |phase| impedance_of(&phase.control)[2]),
        rotation_damping: of_phase(plan, phase, |phase| impedance_of(&phase.control)[3]),
        joint_damping: of_phase(plan, phase, |phase| impedance_of(&phase.control)[4]),
    }
}

/// The numbers of an impedance in the order of [`ImpedanceGains`]; 0 for another controller.
fn impedance_of(control: &ArmControl) -> [f64; 5] {
    match *control {
        ArmControl::CartesianImpedance { stiffness, damping, rotation_stiffness, rotation_damping, joint_damping } => {
            [stiffness, damping, rotation_stiffness, rotation_damping, joint_damping]
        }
        _ => [0.0; 5],
    }
}

/// Spring and damper of each joint on what it lacks.
#[inline(always)]
fn joint_pd<R: Real, const N: usize>(error: &Arm<R, N>, stiffness: &[R; N], damping: &[R; N]) -> [R; N] {
    let mut torque = [R::lit(0.0); N];
    for i in 0..N {
        torque[i] = -(stiffness[i].mul_add(error.angle[i], damping[i] * error.rate[i]));
    }
    torque
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

/// Gains of a spring and damper between part A and its wanted pose; see [`ArmControl::CartesianImpedance`].
struct ImpedanceGains<R> {
    stiffness: R,
    damping: R,
    rotation_stiffness: R,
    rotation_damping: R,
    joint_damping: R,
}

/// How part A is off its wanted pose, as the base sees it, inertial axes.
struct PoseError<R> {
    /// From part A to its wanted place \[m\].
    error: Vec3<R>,
    /// From its attitude to the wanted one, a rotation vector \[rad\].
    twist: Vec3<R>,
    /// Its velocity beyond the wanted one \[m/s\].
    velocity: Vec3<R>,
    /// Its angular velocity beyond the wanted one \[rad/s\].
    omega: Vec3<R>,
}

/// Spring and damper between the end-effector and its wanted pose on the base, through the transposed Jacobian.
#[inline(always)]
fn cartesian_impedance<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    k: &Kinematics<R, N>,
    gains: ImpedanceGains<R>,
    e: PoseError<R>,
) -> [R; N] {
    let force = e.velocity.scale_add(-gains.damping, e.error * gains.stiffness);
    let moment = e.omega.scale_add(-gains.rotation_damping, e.twist * gains.rotation_stiffness);
    let tip = on_last_link(m, &k.parts.a, Wrench { force, moment });
    let (mut torque, _) = posture(m, masses, &k.turns).passed(&[Force::zero(); N], tip);
    for (i, torque) in torque.iter_mut().enumerate() {
        *torque = arm.rate[i].mul_add(-gains.joint_damping, *torque);
    }
    torque
}
