//! One joint's drive: velocity loop, current loop, motor with friction, gear with backlash, elasticity and errors.

use super::{Drive, Friction, Joint, Levels, bristle};
use crate::bundle;
use crate::effects::{EffectId, EffectSet};
use crate::math::{exp, lagged, sin_cos};
use crate::params::DriveParams;
use crate::real::Real;

/// Torque ripple has so many cycles in a turn of the motor: six poles times two.
const RIPPLE_CYCLES: f64 = 12.0;

/// Travel in which the hysteresis of the cables turns to 1/e \[rad\]: they are soft against any gear.
const CABLE_TRAVEL: f64 = 0.02;

const TEMPERATURE: EffectId = EffectId::of("J6_temperature");
const RIPPLE: EffectId = EffectId::of("J9_torque_ripple");
const WAVE: EffectId = EffectId::of("J10_transmission_error");
const SATURATION: EffectId = EffectId::of("J13_saturation");
const CABLE: EffectId = EffectId::of("J17_cable_drag");
const OFFSET: EffectId = EffectId::of("J18_drive_offset");

bundle! {
    /// The state of one joint's drive; the motor's side is counted behind the gear.
    JointState {
        angle: R, "rad", "joint angle behind the gear, from the start posture (m for a rail, and so on)";
        rate: R, "rad/s", "joint rate behind the gear";
        windup: R, "rad", "motor angle less joint angle";
        motor_rate: R, "rad/s", "motor rate";
        torque: R, "N m", "torque of the motor";
        integral: R, "N m", "integral part of the velocity loop";
        slip: R, "1", "presliding state of the friction, -1 to 1";
        cable: R, "1", "state of the cables' hysteresis, -1 to 1", of "J17_cable_drag";
    }
}

/// The gear's torque as the chain's next step sees it: `torque - armature * acceleration`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geared<R> {
    /// Torque on the joint if it does not accelerate \[N m\].
    pub(crate) torque: R,
    /// What its acceleration takes off it \[kg m^2\].
    pub(crate) armature: R,
    /// Impulse of the motor's own side over the substep, its momentum included \[N m s\].
    pub(super) impulse: R,
    /// Inertia of the rotor \[kg m^2\].
    pub(super) inertia: R,
}

/// Set point of the velocity loop for a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference<R> {
    /// Motor speed \[rad/s\].
    pub(crate) speed: R,
    /// Torque that the feedforward adds \[N m\].
    pub(crate) torque: R,
    /// What is left of the cold drive's additional friction, 1 to 0.
    pub(crate) cold: R,
}

/// A joint, or the rail, as its drive's stages see it.
#[derive(Clone, Copy)]
pub(crate) struct Axis<'a> {
    /// Link, motor, gear, friction.
    pub(crate) joint: &'a Joint,
    /// Its velocity loop.
    pub(crate) servo: &'a VelocityLoop,
    /// Angle at the start posture \[rad\].
    pub(crate) start: f64,
    /// Substep \[s\].
    pub(crate) substep: f64,
    /// The effects that a run may have.
    pub(crate) effects: EffectSet,
}

/// Gear and friction of a joint.
#[derive(Clone, Copy)]
pub(super) struct Geartrain<'a> {
    /// Motor and gear.
    pub(super) drive: &'a Drive,
    /// Friction.
    pub(super) friction: &'a Friction,
    /// Travel in which its presliding state comes 1/e closer to sliding \[rad\].
    pub(super) travel: f64,
    /// Substep \[s\].
    pub(super) substep: f64,
    /// The effects that a run may have.
    pub(super) effects: EffectSet,
}

impl Axis<'_> {
    fn train(&self) -> Geartrain<'_> {
        let Joint { drive, friction, .. } = self.joint;
        let travel = friction.presliding_travel();
        Geartrain { drive, friction, travel, substep: self.substep, effects: self.effects }
    }

    /// Greatest torque of the motor \[N m\].
    #[inline(always)]
    fn torque_limit<R: Real>(&self, p: &DriveParams<R>) -> R {
        let limit = R::lit(self.joint.drive.torque_limit) * p.gear_ratio;
        if self.effects.has(SATURATION) { limit * (R::lit(1.0) - p.torque_limit_cut) } else { limit }
    }

    /// Greatest speed of the joint \[rad/s\]; another gear lets the motor turn no faster.
    #[inline(always)]
    pub(crate) fn speed_limit<R: Real>(&self, p: &DriveParams<R>) -> R {
        let limit = R::lit(self.joint.limits.speed) / p.gear_ratio;
        if self.effects.has(SATURATION) { limit * (R::lit(1.0) - p.speed_limit_cut) } else { limit }
    }
}

/// Gains of one joint's velocity loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityLoop {
    /// Torque per speed error \[N m s/rad\].
    pub gain: f64,
    /// Integral time \[s\]; infinite = none.
    pub integral_time: f64,
}

/// Control and motor up to the gear: what the drive would do over a substep; and 1 where its torque is at its limit.
#[inline(always)]
pub(crate) fn motor<R: Real>(
    axis: Axis,
    p: &DriveParams<R>,
    s: &JointState<R>,
    reference: Reference<R>,
) -> (JointState<R>, Geared<R>, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let (servo, dt, limit) = (axis.servo, axis.substep, axis.torque_limit(p));
    let error = reference.speed - s.motor_rate;
    let gain = p.velocity_gain * R::lit(servo.gain);
    let integral = (error * gain).mul_add(R::lit(dt / servo.integral_time), s.integral);
    let wanted = error.mul_add(gain, integral + reference.torque);
    let cut = wanted.min(limit).max(-limit);
    let limited = R::select(wanted.lt(cut) | cut.lt(wanted), one, zero);
    // An integrator at the limit stands still.
    let integral = R::select(zero.lt(limited), s.integral, integral);
    let torque = lagged(dt, p.current_lag, s.torque, cut);

    let motor_angle = s.angle + s.windup + R::lit(axis.start);
    let turned = motor_angle * (p.gear_ratio * R::lit(axis.joint.drive.gear_ratio));
    let mut applied = torque.mul_add(p.torque_constant_error, torque);
    if axis.effects.has(RIPPLE) {
        applied = applied + sin_cos(turned * R::lit(RIPPLE_CYCLES)).0 * (p.torque_ripple * limit);
    }
    if axis.effects.has(OFFSET) {
        applied = p.torque_offset.mul_add(limit, applied);
    }
    let (gear, slip) = gear(axis.train(), p, s, reference.cold, turned, applied, None);
    (JointState { torque, integral, slip, ..*s }, gear, limited)
}

/// Friction and gear: an elastic gear is stepped explicitly, a rigid one (or one too stiff for the substep) implicitly.
///
/// `brake` is further dry friction of the motor.
#[inline(always)]
pub(super) fn gear<R: Real>(
    train: Geartrain,
    p: &DriveParams<R>,
    s: &JointState<R>,
    cold: R,
    turned: R,
    applied: R,
    brake: Option<R>,
) -> (Geared<R>, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let (drive, dt) = (train.drive, train.substep);
    let compliance = p.gear_compliance * R::lit(1.0 / drive.gear_stiffness);
    // The gear's own wave once a motor turn, then the dead zone of its backlash.
    let wave = train.effects.has(WAVE);
    let wound = if wave { sin_cos(turned).0.mul_add(p.transmission_error, s.windup) } else { s.windup };
    let half = p.backlash * R::lit(0.5 * drive.backlash);
    let play = wound.min(half).max(-half);
    let engaged = half.le(zero) | half.lt(wound.abs());
    let stretch = wound - play;

    let load = R::select(compliance.le(zero), s.torque, stretch / R::select(compliance.le(zero), one, compliance));
    let (friction, slip) = friction(train, p, s, cold, load, brake);

    let inertia = p.gear_ratio * p.gear_ratio * R::lit(drive.reflected_inertia());
    let impulse = (applied - friction).mul_add(R::lit(dt), inertia * s.motor_rate);
    // 1 where the spring between rotor and joint is too quick for an explicit step, w dt > 1/4.
    let implicit = R::select((inertia * compliance).lt(R::lit(16.0 * dt * dt)), one, zero);
    let reach = implicit.mul_add(R::lit(dt), compliance * R::lit(drive.gear_damping));
    let scale = one / inertia.mul_add(compliance, reach * R::lit(dt));
    let torque = inertia.mul_add(stretch, reach * (impulse - inertia * s.rate)) * scale;
    let armature = inertia * reach * R::lit(dt) * scale;
    let geared = Geared {
        torque: R::select(engaged, torque, zero),
        armature: R::select(engaged, armature, zero),
        impulse,
        inertia,
    };
    (geared, slip)
}

/// Friction torque against the motor's motion, and the presliding state after the substep.
#[inline(always)]
fn friction<R: Real>(
    train: Geartrain,
    p: &DriveParams<R>,
    s: &JointState<R>,
    cold: R,
    load: R,
    brake: Option<R>,
) -> (R, R) {
    let own = Levels::<R>::of(train.friction);
    let coulomb = own.coulomb.mul_add(p.coulomb_error, own.coulomb);
    let levels = Levels {
        coulomb: match brake {
            Some(brake) => coulomb + brake,
            None => coulomb,
        },
        viscous: own.viscous.mul_add(p.viscous_error, own.viscous),
        stribeck: own.stribeck * p.stribeck,
        load_coefficient: own.load_coefficient + p.load_friction,
        ..own
    };
    // A travel of 0 is friction at once, either way.
    let travel = (p.presliding * R::lit(train.travel)).max(R::lit(1e-12));
    let slip = bristle(s.slip, s.motor_rate * R::lit(train.substep), travel);
    let mut torque = levels.torque(slip, s.motor_rate, load);
    if train.effects.has(OFFSET) {
        // F_c (1 + a sign v), the sign that of the bristle.
        torque = slip.abs().mul_add(levels.coulomb * p.coulomb_asymmetry, torque);
    }
    if train.effects.has(TEMPERATURE) {
        torque = torque.mul_add(p.cold_friction * cold, torque);
    }
    (torque, slip)
}

/// The time since the start after a further tick \[s\], and what is left of a cold drive's additional friction before
/// it, 1 to 0.
#[inline(always)]
pub(crate) fn cold<R: Real>(effects: EffectSet, p: &DriveParams<R>, age: R, tick: R) -> (R, R) {
    if !effects.has(TEMPERATURE) {
        return (age, R::lit(0.0));
    }
    (age + tick, exp(-(age / p.warm_up.max(R::lit(1e-9)))))
}

/// Torque of cables and hoses on the joint, behind the gear, and the state of their hysteresis after the substep.
#[inline(always)]
pub(crate) fn cable<R: Real>(axis: Axis, p: &DriveParams<R>, s: &JointState<R>) -> (R, R) {
    if !axis.effects.has(CABLE) {
        return (R::lit(0.0), s.cable);
    }
    let state = bristle(s.cable, s.rate * R::lit(axis.substep), R::lit(CABLE_TRAVEL));
    let pull = s.angle.mul_add(p.cable_stiffness, state * p.cable_hysteresis);
    (pull * R::lit(-axis.joint.friction.coulomb), state)
}

/// The joint after the substep, from the chain's acceleration.
#[inline(always)]
pub(crate) fn moved<R: Real>(dt: f64, s: &JointState<R>, geared: Geared<R>, acceleration: R) -> JointState<R> {
    let dt = R::lit(dt);
    let torque = geared.torque - geared.armature * acceleration;
    let motor_rate = (geared.impulse - torque * dt) / geared.inertia;
    let rate = acceleration.mul_add(dt, s.rate);
    JointState {
        angle: rate.mul_add(dt, s.angle),
        windup: (motor_rate - rate).mul_add(dt, s.windup),
        rate,
        motor_rate,
        ..*s
    }
}

#[cfg(test)]
#[path = "drive_tests.rs"]
mod tests;
