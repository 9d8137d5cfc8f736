//! Attitude control of the base by thruster pulses: each axis fires for a fixed time whenever it leaves its deadband.
//!
//! The switching line is that of a phase plane: error + lead x rate (Sidi, Spacecraft Dynamics and Control (1997), ch. 9).

use crate::bundle;
use crate::model::Thrusters;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::Kinematics;
use crate::vector::{Quat, Vec3, vec3};

bundle! {
    /// The thrusters of a base; written once per tick.
    Firing {
        attitude: Quat<R>, "1", "attitude that is held, base's body axes to inertial axes; 0 before the first tick";
        pulse: Vec3<R>, "1", "ticks that the thrusters of each body axis still fire, with the sign of their torque";
    }
}

/// No thruster has fired.
#[inline(always)]
pub fn no_firing<R: Real>() -> Firing<R> {
    crate::fields::filled(R::lit(0.0))
}

/// The thrusters for the coming tick; `touched` is 1 after the first touch.
#[inline(always)]
pub fn fire<R: Real, const N: usize>(
    m: &Plant,
    s: &Firing<R>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
    touched: R,
) -> Firing<R> {
    let Some(thrusters) = &m.guidance.thrusters else { return *s };
    let fresh = s.attitude.w.mul_add(s.attitude.w, s.attitude.v.dot(s.attitude.v)).lt(R::lit(0.5));
    let attitude = Quat::select(fresh, base, s.attitude);
    let error = attitude.conjugate().compose(base).small_rotation_vector();
    let rate = base.rotate_back(k.axes.times(k.rate));
    let drive = rate.scale_add(R::lit(thrusters.lead), error);
    let on = if thrusters.off_at_touch { R::lit(1.0) - touched } else { R::lit(1.0) };
    let pulse = vec3(
        next_pulse(thrusters, s.pulse.x, drive.x),
        next_pulse(thrusters, s.pulse.y, drive.y),
        next_pulse(thrusters, s.pulse.z, drive.z),
    );
    Firing { attitude, pulse: pulse * on }
}

/// Ticks that an axis still fires: a pulse goes on to its end, and a new one begins outside the deadband.
#[inline(always)]
fn next_pulse<R: Real>(thrusters: &Thrusters, left: R, drive: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let whole = R::lit(f64::from(thrusters.pulse));
    let against = R::select(drive.lt(zero), whole, -whole);
    let begun = R::select(R::lit(thrusters.deadband).lt(drive.abs()), against, zero);
    let rest = R::select(left.lt(zero), left + one, left - one);
    R::select(R::lit(1.5).lt(left.abs()), rest, begun)
}

/// Torque of the thrusters on the base, inertial axes \[N m\].
#[inline(always)]
pub fn thruster_torque<R: Real>(thrusters: &Thrusters, firing: &Firing<R>, base: Quat<R>) -> Vec3<R> {
    let (torque, pulse) = (thrusters.torque, firing.pulse);
    base.rotate(vec3(signed(torque.x, pulse.x), signed(torque.y, pulse.y), signed(torque.z, pulse.z)))
}

/// A torque with the sign of a pulse; none without one.
#[inline(always)]
fn signed<R: Real>(torque: f64, pulse: R) -> R {
    let size = R::select(pulse.abs().lt(R::lit(0.5)), R::lit(0.0), R::lit(torque));
    R::select(pulse.lt(R::lit(0.0)), -size, size)
}
