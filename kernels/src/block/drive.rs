//! A joint's drive, from commanded torque to motion.
//!
//! The drive is simulated under the measured torque and held to the measured motion by a weak observer, a spring and a
//! damper on the motor that stand far below every effect: what is left between measured and simulated angle is what the
//! model lacks, and the encoder's noise stays at the output, where it does not depend on the parameters. The damper also
//! calms a gear's resonance, which the torque's noise would excite. Angles count from the measured one, so that single
//! precision resolves what an encoder does.
//! Numbers count at the joint's side of the gear; for a prismatic joint read m for rad and N for N m.

mod friction;
mod gear;

use self::friction::Sliding;
use self::gear::{flank, gear_torque, wind};
use super::Block;
use super::forms::Forms;
use crate::bundle;
use crate::fields::filled;
use crate::manipulator::bristle;
use crate::math::{exp, lagged_along, sin_cos};
use crate::range::UNLIMITED;
use crate::real::Real;
use std::f64::consts::TAU;

bundle! {
    /// A drive's values, effects and what may differ unnoticed.
    DriveValues {
        motor_inertia: R, "kg m^2", "inertia of rotor and gear input";
        inertia_error: R, "kg m^2", "inertia of the link beyond the model's";
        coulomb: R, "N m", "Coulomb friction";
        coulomb_asymmetry: R, "N m", "Coulomb friction forwards beyond that backwards, half of it";
        viscous: R, "N m s/rad", "viscous friction";
        stribeck: R, "N m", "static friction beyond Coulomb's";
        stribeck_speed: R, "rad/s", "speed at which the static part has fallen to 1/e";
        presliding_travel: R, "rad", "travel in which the distance to sliding friction falls to 1/e";
        bristle_damping: R, "N m s/rad", "friction per rate at which the bristles bend";
        load_coefficient: R, "1", "Coulomb friction per torque that loads the gear";
        load_inertial: R, "1", "share of the torque for accelerations, its own and other axes', that counts as load";
        warm_loss: R, "1", "natural logarithm of the factor by which viscous friction falls until the drive is warm";
        warm_up: R, "s", "time constant of the warming up";
        compliance: R, "rad/(N m)", "compliance of the gear";
        gear_damping: R, "1", "damping ratio of the link on its gear";
        half_backlash: R, "rad", "half of the gear's backlash";
        ripple_sin: R, "N m", "torque ripple in phase with the sine of the motor's angle";
        ripple_cos: R, "N m", "torque ripple in phase with its cosine";
        ripple_cycles: R, "1/rad", "radians of the ripple's phase per radian of the joint";
        wave_sin: R, "rad", "transmission error in phase with the sine of the motor's angle";
        wave_cos: R, "rad", "transmission error in phase with its cosine";
        wave_cycles: R, "1/rad", "radians of its phase per radian of the joint";
        torque_constant_error: R, "1", "relative error of the torque constant";
        current_lag: R, "s", "time constant of the current loop";
        torque_limit: R, "N m", "greatest torque of the motor";
        payload: R, "kg", "mass at the payload's place beyond the model's";
        gravity_cos: R, "N m", "gravity torque beyond the model's, times cos q";
        gravity_sin: R, "N m", "gravity torque beyond the model's, times sin q";
        cable_stiffness: R, "N m/rad", "spring of cables and hoses";
        cable_centre: R, "rad", "joint angle at which their torque is zero";
        cable_hysteresis: R, "N m", "half the width of their hysteresis";
        cable_travel: R, "rad", "travel in which their hysteresis turns to 1/e";
        offset: R, "N m", "torque that the drive reports without giving it";
        clock_offset: R, "s", "delay of the torque against its time stamp";
        link_zero: R, "rad", "angle that an encoder behind the gear reads where the motor's reads zero";
        link_age: R, "s", "age of the samples of an encoder behind the gear, beyond that of the motor's";
        form: Forms<R>, "1", "outside the catalogue";
    }
}

bundle! {
    /// Measured and modelled signals of a drive at an instant.
    DriveMotion {
        angle: R, "rad", "motor angle";
        rate: R, "rad/s", "motor rate";
        acceleration: R, "rad/s^2", "motor acceleration";
        weight: R, "N m", "torque of gravity against the link by the model";
        coupling: R, "N m", "torque of the other axes' motion against the link by the model";
        inertia: R, "kg m^2", "inertia of the link about the joint by the model";
        payload_weight: R, "m^2/s^2", "torque of a kilogram at the payload's place but for its inertia, N m/kg";
        payload_inertia: R, "m^2", "inertia of a kilogram at the payload's place, kg m^2/kg";
        time: R, "s", "time since the drive was switched on";
        travel: R, "rad", "motor angle gained since the instant before";
    }
}

bundle! {
    /// Commanded torque as the drive's log has it.
    Torque {
        torque: R, "N m", "torque at the joint's side";
    }
}

bundle! {
    /// What is hidden in a drive.
    DriveHidden {
        centre: R, "rad", "angle of motor and link, weighted by their inertias, beyond the measured motor's";
        centre_rate: R, "rad/s", "rate of that weighted angle, half a step later";
        centre_acceleration: R, "rad/s^2", "its acceleration";
        windup: R, "rad", "motor angle less link angle, transmission error included";
        windup_rate: R, "rad/s", "its rate";
        pull: R, "N m", "torque that the gear would transmit if it were rigid";
        commanded: R, "N m", "commanded torque, within the motor's limit";
        given: R, "N m", "torque behind the current loop";
        bristles: R, "N m", "torque of the friction's bristles";
        cable: R, "1", "state of the cables' hysteresis, -1 to 1";
    }
}

bundle! {
    /// Output of a drive's model for a recording.
    DriveOutput {
        lead: R, "rad", "motor angle beyond the measured one";
        twist: R, "rad", "link angle less motor angle";
    }
}

impl DriveValues<f64> {
    /// A drive without friction, elasticity, errors or limits, and without a rotor.
    pub fn null() -> Self {
        let mut values: Self = filled(0.0);
        (values.stribeck_speed, values.presliding_travel, values.cable_travel) = (0.02, 1e-4, 0.02);
        (values.warm_up, values.gear_damping, values.torque_limit) = (1000.0, 0.05, UNLIMITED);
        values
    }
}

/// Angular frequency of the observer that holds the simulated drive to the measured motion \[rad/s\]; critically damped.
pub const OBSERVER: f64 = TAU * 10.0;

/// Least inertia of a link, as a share of the motor's: machines of any size are simulated alike.
const LIGHTEST: f64 = 2e-4;

/// A joint's drive, from torque to motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveBlock;

impl Block for DriveBlock {
    type Params<R: Real> = DriveValues<R>;
    type State<R: Real> = DriveHidden<R>;
    type Input<R: Real> = DriveMotion<R>;
    type Late<R: Real> = Torque<R>;
    type Output<R: Real> = DriveOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &DriveValues<R>, _time: R) -> R {
        p.clock_offset
    }

    #[inline(always)]
    fn start<R: Real>(&self, p: &DriveValues<R>, u: &DriveMotion<R>, late: &Torque<R>) -> DriveHidden<R> {
        let zero = R::lit(0.0);
        let inertia = Inertia::of(p, u);
        let resting_load = resting_load(p, u);
        let moving_load = moving_load(u, inertia.link, &Wave::of(p, u));
        let pull = u.acceleration.mul_add(inertia.link, resting_load + moving_load);
        let given = limited(p, late.torque);
        let windup = pull.mul_add(p.compliance, flank(pull, p.half_backlash));
        DriveHidden {
            centre: -(inertia.share() * windup),
            centre_rate: u.rate,
            centre_acceleration: u.acceleration,
            windup,
            windup_rate: zero,
            pull,
            commanded: given,
            given,
            bristles: resting(p, u, given, pull, resting_load, inertia),
            cable: zero,
        }
    }

    /// Drift, then kick: the rate lives half a step after the angle, which makes the step exact to second order.
    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &DriveValues<R>,
        s: &DriveHidden<R>,
        u: &DriveMotion<R>,
        late: &Torque<R>,
    ) -> DriveHidden<R> {
        let dt = R::lit(step);
        let inertia = Inertia::of(p, u);
        let centre = s.centre_rate.mul_add(dt, -u.travel) + s.centre;
        let centre_rate = s.centre_acceleration.mul_add(dt * R::lit(0.5), s.centre_rate);
        let motor_rate = s.windup_rate.mul_add(inertia.share(), centre_rate);
        let moved = s.windup_rate.mul_add(inertia.share(), s.centre_rate) * dt;
        let cable = cables(p, s, moved);
        let commanded = limited(p, late.torque);
        let given = lagged_along(step, p.current_lag, s.given, s.commanded, commanded);

        let wave = Wave::of(p, u);
        let gear = gear_torque(p, s, inertia.reduced());
        let resting_load = resting_load(p, u);
        let bearing = bearing(p, gear, s.cable.mul_add(p.cable_hysteresis, resting_load));
        let sliding = Sliding::of(p, u, direction(moved), motor_rate, bearing);
        let bristles = sliding.approached(s.bristles, moved);
        let bending = sliding.bent(bristles - s.bristles) * R::lit(1.0 / step);
        let drag = bending.mul_add(p.bristle_damping, drag(p, u, motor_rate));
        let behind = -s.windup_rate.mul_add(dt, s.windup).mul_add(inertia.share(), centre);
        let slower = u.rate - motor_rate;
        let observer = behind.mul_add(R::lit(OBSERVER * OBSERVER), slower * R::lit(2.0 * OBSERVER)) * inertia.whole();
        // What the gear passes on comes back by its ratio, which waves with the transmission error.
        let driving = applied(p, u, given) - bristles - drag + observer - wave.slope * s.pull;
        let load = cable.mul_add(p.cable_hysteresis, resting_load + moving_load(u, inertia.link, &wave));
        let pull = (driving / inertia.motor + load / inertia.link) * inertia.reduced();
        let (windup, windup_rate) = wind(step, p, s, inertia.reduced(), pull);
        let centre_acceleration = (driving - load) / inertia.whole();
        DriveHidden {
            centre,
            centre_rate: centre_acceleration.mul_add(dt, s.centre_rate),
            centre_acceleration,
            windup,
            windup_rate,
            pull,
            commanded,
            given,
            bristles,
            cable,
        }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &DriveValues<R>,
        s: &DriveHidden<R>,
        u: &DriveMotion<R>,
        _late: &Torque<R>,
    ) -> DriveOutput<R> {
        let lead = s.windup.mul_add(Inertia::of(p, u).share(), s.centre);
        // So long ago, by the motion as it is now.
        let since = u.acceleration.mul_add(p.link_age * R::lit(-0.5), u.rate) * p.link_age;
        DriveOutput { lead, twist: p.link_zero - s.windup + Wave::of(p, u).angle - since }
    }
}

/// Inertias on both sides of the gear.
#[derive(Clone, Copy)]
struct Inertia<R> {
    motor: R,
    link: R,
}

impl<R: Real> Inertia<R> {
    #[inline(always)]
    fn of(p: &DriveValues<R>, u: &DriveMotion<R>) -> Self {
        let link = u.payload_inertia.mul_add(p.payload, u.inertia + p.inertia_error);
        Self { motor: p.motor_inertia, link: link.max(p.motor_inertia * R::lit(LIGHTEST)) }
    }

    /// Of both together.
    #[inline(always)]
    fn whole(&self) -> R {
        self.motor + self.link
    }

    /// The link's share of the whole.
    #[inline(always)]
    fn share(&self) -> R {
        self.link / self.whole()
    }

    /// Of motor and link against one another.
    #[inline(always)]
    fn reduced(&self) -> R {
        self.motor * self.share()
    }
}

/// Torque within the motor's limit.
#[inline(always)]
fn limited<R: Real>(p: &DriveValues<R>, torque: R) -> R {
    torque.min(p.torque_limit).max(-p.torque_limit)
}

/// 1 forwards, -1 backwards, 0 at rest.
#[inline(always)]
fn direction<R: Real>(rate: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    R::select(zero.lt(rate), one, R::select(rate.lt(zero), -one, zero))
}

/// Torque of the motor: what it was given, as the drive's scale has it, and the ripple.
#[inline(always)]
fn applied<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>, given: R) -> R {
    let net = p.form.given(given) - p.offset;
    net.mul_add(p.torque_constant_error, net + ripple(p, u))
}

/// Torque ripple.
#[inline(always)]
fn ripple<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>) -> R {
    if (p.ripple_sin.abs() + p.ripple_cos.abs()).is_absent() {
        return R::lit(0.0);
    }
    let (sin, cos) = sin_cos(u.angle * p.ripple_cycles);
    sin.mul_add(p.ripple_sin, cos * p.ripple_cos)
}

/// Torque that presses on bearings and teeth: the load at rest, and a share of the rest of what the gear transmits.
#[inline(always)]
fn bearing<R: Real>(p: &DriveValues<R>, gear: R, resting_load: R) -> R {
    (gear - resting_load).mul_add(p.load_inertial, resting_load)
}

/// Dry friction where a recording starts: what holds the torques in balance, within what friction can hold.
#[inline(always)]
fn resting<R: Real>(
    p: &DriveValues<R>,
    u: &DriveMotion<R>,
    given: R,
    pull: R,
    resting_load: R,
    inertia: Inertia<R>,
) -> R {
    let bearing = bearing(p, pull, resting_load);
    let most = |way: f64| Sliding::of(p, u, R::lit(way), u.rate, bearing).level;
    let rest = applied(p, u, given) - pull - drag(p, u, u.rate) - u.acceleration * inertia.motor;
    rest.min(most(1.0)).max(most(-1.0))
}

/// Friction that grows with the rate, and what forms outside the catalogue resist with.
#[inline(always)]
fn drag<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>, rate: R) -> R {
    (p.viscous * thinning(p, u.time)).mul_add(rate, p.form.resisting(u.angle, rate))
}

/// Factor by which viscous friction has fallen: lubricants thin as they warm up, dry friction hardly changes
/// (Bittencourt et al. 2010).
#[inline(always)]
fn thinning<R: Real>(p: &DriveValues<R>, time: R) -> R {
    if p.warm_loss.is_absent() {
        return R::lit(1.0);
    }
    let warmth = R::lit(1.0) - exp(-(time / p.warm_up));
    exp(-(p.warm_loss * warmth))
}

/// The gear's transmission error, its derivative by the motor's angle, and its second derivative by time.
struct Wave<R> {
    angle: R,
    slope: R,
    acceleration: R,
}

impl<R: Real> Wave<R> {
    #[inline(always)]
    fn of(p: &DriveValues<R>, u: &DriveMotion<R>) -> Self {
        let zero = R::lit(0.0);
        if (p.wave_sin.abs() + p.wave_cos.abs()).is_absent() {
            return Self { angle: zero, slope: zero, acceleration: zero };
        }
        let (sin, cos) = sin_cos(u.angle * p.wave_cycles);
        let angle = sin.mul_add(p.wave_sin, cos * p.wave_cos);
        let slope = (cos * p.wave_sin - sin * p.wave_cos) * p.wave_cycles;
        let speed = u.rate * p.wave_cycles;
        Self { angle, slope, acceleration: slope * u.acceleration - speed * speed * angle }
    }
}

/// Torque that it takes to hold the link where it is, the cables' hysteresis left out: what the model says, and the
/// effects behind the gear.
#[inline(always)]
fn resting_load<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>) -> R {
    let spring = (u.angle - p.cable_centre) * p.cable_stiffness;
    u.weight + u.payload_weight.mul_add(p.payload, gravity(p, u.angle) + spring)
}

/// Torque against the link by the motion of other axes and by the transmission error.
#[inline(always)]
fn moving_load<R: Real>(u: &DriveMotion<R>, inertia: R, wave: &Wave<R>) -> R {
    wave.acceleration.mul_add(inertia, u.coupling)
}

/// Gravity torque beyond the model's.
#[inline(always)]
fn gravity<R: Real>(p: &DriveValues<R>, angle: R) -> R {
    if (p.gravity_cos.abs() + p.gravity_sin.abs()).is_absent() {
        return R::lit(0.0);
    }
    let (sin, cos) = sin_cos(angle);
    cos.mul_add(p.gravity_cos, sin * p.gravity_sin)
}

/// State of the cables' hysteresis after a displacement.
#[inline(always)]
fn cables<R: Real>(p: &DriveValues<R>, s: &DriveHidden<R>, displacement: R) -> R {
    if p.cable_hysteresis.is_absent() {
        return s.cable;
    }
    bristle(s.cable, displacement, p.cable_travel)
}
