//! One joint's drive: velocity loop, current loop, motor with friction, gear with backlash, elasticity and errors.

use super::{Joint, Levels, bristle};
use crate::bundle;
use crate::math::{exp, sin_cos};
use crate::real::Real;

/// Torque ripple has so many cycles in a turn of the motor: six poles times two.
const RIPPLE_CYCLES: f64 = 12.0;

bundle! {
    /// What is dispersible in the drives of one robot: all its joints together.
    DriveParams {
        position_gain: R, "1/s", "gain of the position loops";
        velocity_feedforward: R, "1", "share of the commanded joint rate that the position loops add";
        velocity_gain: R, "1", "factor on the gains of the velocity loops";
        gear_ratio: R, "1", "factor on all gear ratios: reflected inertia goes with its square, limits of torque and acceleration with it, of speed against it";
        coulomb_error: R, "1", "relative error of the Coulomb friction";
        viscous_error: R, "1", "relative error of the viscous friction";
        stribeck: R, "1", "factor on the static friction beyond Coulomb's; 0 = none";
        presliding: R, "1", "factor on the travel before sliding; 0 = friction at once";
        load_friction: R, "1", "Coulomb friction per torque that the gear transmits; 0 = none";
        gear_compliance: R, "1", "factor on the compliance of the gears; 0 = rigid";
        backlash: R, "1", "factor on the backlash of the gears; 0 = none";
        transmission_error: R, "rad", "amplitude of the gears' transmission error, once a turn of the motor; 0 = none";
        torque_ripple: R, "1", "amplitude of the motors' ripple as a share of their greatest torque; 0 = none";
        torque_constant_error: R, "1", "relative error of the motors' torque constant";
        current_lag: R, "s", "time constant of the current loops; 0 = none";
        model_inertia_error: R, "1", "relative error of the feedforward's inertial torques";
        model_gravity_error: R, "1", "relative error of the feedforward's gravity torques";
        model_friction_error: R, "1", "relative error of the feedforward's friction torques";
    }
}

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
    impulse: R,
    /// Inertia of the rotor \[kg m^2\].
    inertia: R,
}

/// What the velocity loop is told for a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference<R> {
    /// Motor speed \[rad/s\].
    pub(crate) speed: R,
    /// Torque that the feedforward adds \[N m\].
    pub(crate) torque: R,
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
    joint: &Joint,
    servo: &VelocityLoop,
    start: f64,
    dt: f64,
    p: &DriveParams<R>,
    s: &JointState<R>,
    told: Reference<R>,
) -> (JointState<R>, Geared<R>, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let limit = R::lit(joint.drive.torque_limit) * p.gear_ratio;
    let error = told.speed - s.motor_rate;
    let gain = p.velocity_gain * R::lit(servo.gain);
    let integral = (error * gain).mul_add(R::lit(dt / servo.integral_time), s.integral);
    let wanted = error.mul_add(gain, integral + told.torque);
    let cut = wanted.min(limit).max(-limit);
    let limited = R::select(wanted.lt(cut) | cut.lt(wanted), one, zero);
    // An integrator at the limit stands still.
    let integral = R::select(zero.lt(limited), s.integral, integral);
    let share = one - exp(-(R::lit(dt) / p.current_lag.max(R::lit(1e-9))));
    let torque = R::select(p.current_lag.le(zero), cut, (cut - s.torque).mul_add(share, s.torque));

    let motor_angle = s.angle + s.windup + R::lit(start);
    let turned = motor_angle * (p.gear_ratio * R::lit(joint.drive.gear_ratio));
    let ripple = sin_cos(turned * R::lit(RIPPLE_CYCLES)).0 * (p.torque_ripple * limit);
    let applied = torque.mul_add(p.torque_constant_error, torque) + ripple;

    let (gear, slip) = gear(joint, dt, p, s, turned, applied);
    (JointState { torque, integral, slip, ..*s }, gear, limited)
}

/// Friction and gear: an elastic gear is stepped explicitly, a rigid one (or one too stiff for the substep) implicitly.
#[inline(always)]
fn gear<R: Real>(
    joint: &Joint,
    dt: f64,
    p: &DriveParams<R>,
    s: &JointState<R>,
    turned: R,
    applied: R,
) -> (Geared<R>, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let drive = &joint.drive;
    let compliance = p.gear_compliance * R::lit(1.0 / drive.gear_stiffness);
    // The gear's own wave once a motor turn, then the dead zone of its backlash.
    let wound = sin_cos(turned).0.mul_add(p.transmission_error, s.windup);
    let half = p.backlash * R::lit(0.5 * drive.backlash);
    let play = wound.min(half).max(-half);
    let engaged = half.le(zero) | half.lt(wound.abs());
    let stretch = wound - play;

    let load = R::select(compliance.le(zero), s.torque, stretch / R::select(compliance.le(zero), one, compliance));
    let (friction, slip) = friction(joint, dt, p, s, load);

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
fn friction<R: Real>(joint: &Joint, dt: f64, p: &DriveParams<R>, s: &JointState<R>, load: R) -> (R, R) {
    let own = Levels::<R>::of(&joint.friction);
    let levels = Levels {
        coulomb: own.coulomb.mul_add(p.coulomb_error, own.coulomb),
        viscous: own.viscous.mul_add(p.viscous_error, own.viscous),
        stribeck: own.stribeck * p.stribeck,
        load_coefficient: own.load_coefficient + p.load_friction,
        ..own
    };
    // A travel of 0 is friction at once, either way.
    let travel = (p.presliding * R::lit(joint.friction.presliding_travel())).max(R::lit(1e-12));
    let slip = bristle(s.slip, s.motor_rate * R::lit(dt), travel);
    (levels.torque(slip, s.motor_rate, load), slip)
}

/// The joint after the substep, from the acceleration that the chain found.
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
