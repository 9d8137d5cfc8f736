//! Drives of the arm in space: motors with limits and friction, gears, stops and brakes, between controller and joints.
//!
//! Gear and friction are those of the facility's robots. A rotor resists the relative acceleration of its joint alone:
//! what it takes of the angular momentum by its own spin, 1/n of the reflected inertia for a gear ratio n, is left out
//! (Spong, J. Dyn. Sys. Meas. Control 109 (1987) 310).

use super::drive::{Geared, Geartrain, gear, moved};
use super::{Drive, DriveParams, Friction, JointState};
use crate::bundle;
use crate::effects::EffectSet;
use crate::fields::filled;
use crate::real::Real;

/// The drive of one joint of the arm in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmDrive {
    /// Motor and gear.
    pub drive: Drive,
    /// Friction at the joint's side of the gear; its stiffness before sliding is not used.
    pub friction: Friction,
    /// Travel in which dry friction, the brake's too, comes 1/e closer to its whole size \[rad\].
    pub presliding_travel: f64,
    /// Speed beyond which the motor only slows down \[rad/s\].
    pub speed_limit: f64,
    /// Ends of the joint's motion, if it has any.
    pub stops: Option<Stops>,
    /// Dry friction of the closed brake \[N m\].
    pub brake: f64,
}

/// Ends of a joint's motion: springs that only push back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stops {
    /// Angle at which the lower one begins, from the start posture \[rad\].
    pub lower: f64,
    /// Angle at which the upper one begins, from the start posture \[rad\].
    pub upper: f64,
    /// Stiffness \[N m/rad\].
    pub stiffness: f64,
    /// Damping \[N m s/rad\].
    pub damping: f64,
}

bundle! {
    /// What the drives of the joints keep; all of it counted behind the gears.
    ArmDrives<N> {
        windup: [R; N], "rad", "motor angle less joint angle";
        motor_rate: [R; N], "rad/s", "motor rate";
        slip: [R; N], "1", "presliding state of the friction, -1 to 1";
    }
}

/// What the drives do to the joints in a substep.
pub(crate) struct Driven<R, const N: usize> {
    /// Torques on joints that do not accelerate \[N m\].
    pub(crate) torque: [R; N],
    /// What their accelerations take off these \[kg m^2\].
    pub(crate) armature: [R; N],
    geared: [Geared<R>; N],
    slip: [R; N],
}

/// Drives as they were built: the errors of the facility's robots are none of theirs.
#[inline(always)]
fn as_built<R: Real>() -> DriveParams<R> {
    let one = R::lit(1.0);
    DriveParams {
        gear_ratio: one,
        gear_compliance: one,
        backlash: one,
        presliding: one,
        stribeck: one,
        ..filled(R::lit(0.0))
    }
}

/// Motors, gears and stops under the controller's torques; `braked` is 1 while the brakes are closed.
#[inline(always)]
pub(crate) fn driven<R: Real, const N: usize>(
    drives: &[ArmDrive],
    substep: f64,
    s: &ArmDrives<R, N>,
    angle: &[R; N],
    rate: &[R; N],
    wanted: &[R; N],
    braked: R,
) -> Driven<R, N> {
    let (zero, p) = (R::lit(0.0), as_built::<R>());
    let idle = Geared { torque: zero, armature: zero, impulse: zero, inertia: zero };
    let mut driven = Driven { torque: [zero; N], armature: [zero; N], geared: [idle; N], slip: s.slip };
    for i in 0..N {
        let own = &drives[i];
        let torque = motor(own, s.motor_rate[i], wanted[i]) * (R::lit(1.0) - braked);
        let state = JointState {
            angle: angle[i],
            rate: rate[i],
            windup: s.windup[i],
            motor_rate: s.motor_rate[i],
            torque,
            slip: s.slip[i],
            ..filled(zero)
        };
        let train = Geartrain {
            drive: &own.drive,
            friction: &own.friction,
            travel: own.presliding_travel,
            substep,
            effects: EffectSet::NONE,
        };
        let brake = if own.brake > 0.0 { Some(braked * R::lit(own.brake)) } else { None };
        let (geared, slip) = gear(train, &p, &state, zero, zero, torque, brake);
        driven.torque[i] = geared.torque + stopped(own, angle[i], rate[i]);
        driven.armature[i] = geared.armature;
        driven.geared[i] = geared;
        driven.slip[i] = slip;
    }
    driven
}

/// Torque of the motor: cut at its limit, and none that drives the joint beyond its greatest speed.
#[inline(always)]
fn motor<R: Real>(own: &ArmDrive, rate: R, wanted: R) -> R {
    let zero = R::lit(0.0);
    let mut torque = wanted;
    if own.drive.torque_limit.is_finite() {
        let limit = R::lit(own.drive.torque_limit);
        torque = torque.min(limit).max(-limit);
    }
    if own.speed_limit.is_finite() {
        let limit = R::lit(own.speed_limit);
        torque = R::select(limit.lt(rate), torque.min(zero), torque);
        torque = R::select(rate.lt(-limit), torque.max(zero), torque);
    }
    torque
}

/// Torque of the stops on the joint.
#[inline(always)]
fn stopped<R: Real>(own: &ArmDrive, angle: R, rate: R) -> R {
    let zero = R::lit(0.0);
    let Some(Stops { lower, upper, stiffness, damping }) = own.stops else { return zero };
    let (spring, damper) = (R::lit(stiffness), rate * R::lit(damping));
    let above = angle - R::lit(upper);
    let below = R::lit(lower) - angle;
    let down = R::select(zero.lt(above), above.mul_add(spring, damper).max(zero), zero);
    let up = R::select(zero.lt(below), below.mul_add(spring, -damper).max(zero), zero);
    up - down
}

/// The drives after the substep, from the joints' accelerations; angles and rates are those before it.
#[inline(always)]
pub(crate) fn carried_on<R: Real, const N: usize>(
    substep: f64,
    s: &mut ArmDrives<R, N>,
    angle: &[R; N],
    rate: &[R; N],
    driven: &Driven<R, N>,
    acceleration: &[R; N],
) {
    for i in 0..N {
        let state = JointState {
            angle: angle[i],
            rate: rate[i],
            windup: s.windup[i],
            motor_rate: s.motor_rate[i],
            ..filled(R::lit(0.0))
        };
        let next = moved(substep, &state, driven.geared[i], acceleration[i]);
        (s.windup[i], s.motor_rate[i], s.slip[i]) = (next.windup, next.motor_rate, driven.slip[i]);
    }
}
