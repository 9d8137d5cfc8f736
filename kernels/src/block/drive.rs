//! A joint's drive between the torque that it was told and the motion that it made.
//!
//! The drive is simulated under the measured torque and held to the measured motion by a weak observer, a spring and a
//! damper on the motor that stand far below every effect: what is left between measured and simulated angle is what the
//! model lacks, and the encoder's noise stays at the output, where it does not depend on the parameters. The damper also
//! calms a gear's resonance, which the torque's noise would excite. Angles count from the measured one, so that single
//! precision resolves what an encoder does.
//! Numbers count at the joint's side of the gear; for a prismatic joint read m for rad and N for N m.

use super::Block;
use super::forms::Forms;
use crate::bundle;
use crate::fields::filled;
use crate::manipulator::bristle;
use crate::math::{exp, lagged_along, sin_cos};
use crate::params::UNLIMITED;
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
        presliding_travel: R, "rad", "travel in which Coulomb friction comes 1/e closer to sliding";
        bristle_damping: R, "N m s/rad", "friction per rate at which the bristles bend";
        load_coefficient: R, "1", "Coulomb friction per torque that loads the gear";
        load_inertial: R, "1", "share of the torque for the link's acceleration that counts as load";
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
        cable_centre: R, "rad", "joint angle at which they pull neither way";
        cable_hysteresis: R, "N m", "half the width of their hysteresis";
        cable_travel: R, "rad", "travel in which their hysteresis turns to 1/e";
        offset: R, "N m", "torque that the drive reports without giving it";
        clock_offset: R, "s", "how much later the torque acts than its time stamp says";
        link_zero: R, "rad", "angle that an encoder behind the gear reads where the motor's reads zero";
        link_age: R, "s", "age of the samples of an encoder behind the gear, beyond that of the motor's";
        form: Forms<R>, "1", "outside the catalogue";
    }
}

bundle! {
    /// What is measured of a drive at an instant, with what the model says of it.
    DriveMotion {
        angle: R, "rad", "motor angle";
        rate: R, "rad/s", "motor rate";
        acceleration: R, "rad/s^2", "motor acceleration";
        load: R, "N m", "torque against the link by the model, its own inertia left out";
        inertia: R, "kg m^2", "inertia of the link about the joint by the model";
        payload_weight: R, "m^2/s^2", "torque of the weight of a kilogram at the payload's place, N m/kg";
        payload_inertia: R, "m^2", "inertia of a kilogram at the payload's place, kg m^2/kg";
        time: R, "s", "time since the drive was switched on";
        travel: R, "rad", "motor angle gained since the instant before";
    }
}

bundle! {
    /// The torque that a drive was told, as its log has it.
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
        told: R, "N m", "torque that was told, within the motor's limit";
        given: R, "N m", "torque behind the current loop";
        bristles: R, "N m", "torque of the friction's bristles";
        cable: R, "1", "state of the cables' hysteresis, -1 to 1";
    }
}

bundle! {
    /// What a drive's model says of a recording.
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

/// Least compliance that counts \[rad/(N m)\]: a gear without any is rigid far beyond this.
const RIGID: f64 = 1e-12;

/// Least inertia of a link \[kg m^2\].
const LIGHTEST: f64 = 1e-3;

/// A joint's drive, from torque to motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drive;

impl Block for Drive {
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
        let load = load(p, u, inertia.link, zero);
        let pull = u.acceleration.mul_add(inertia.link, load);
        let given = limited(p, late.torque);
        let windup = pull.mul_add(p.compliance, flank(pull, p.half_backlash));
        DriveHidden {
            centre: -(inertia.share() * windup),
            centre_rate: u.rate,
            centre_acceleration: u.acceleration,
            windup,
            windup_rate: zero,
            pull,
            told: given,
            given,
            bristles: resting(p, u, given, load, inertia),
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
        let cable = bristle(s.cable, moved, p.cable_travel);
        let told = limited(p, late.torque);
        let given = lagged_along(step, p.current_lag, s.given, s.told, told);

        let gear = gear_torque(p, s, inertia.reduced());
        let static_load = load(p, u, inertia.link, s.cable);
        let bearing = (gear - static_load).mul_add(p.load_inertial, static_load);
        let sliding = Sliding::of(p, u, direction(moved), motor_rate, bearing);
        let bristles = sliding.approached(s.bristles, moved);
        let bending = sliding.bent(bristles - s.bristles) * R::lit(1.0 / step);
        let drag = bending.mul_add(p.bristle_damping, drag(p, u, motor_rate));
        let behind = -s.windup_rate.mul_add(dt, s.windup).mul_add(inertia.share(), centre);
        let slower = u.rate - motor_rate;
        let observer = behind.mul_add(R::lit(OBSERVER * OBSERVER), slower * R::lit(2.0 * OBSERVER)) * inertia.whole();
        // What the gear passes on comes back by its ratio, which waves with the transmission error.
        let driving = applied(p, u, given) - bristles - drag + observer - wave(p, u).slope * s.pull;
        let load = load(p, u, inertia.link, cable);
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
            told,
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
        DriveOutput { lead, twist: p.link_zero - s.windup + wave(p, u).angle - since }
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
        Self { motor: p.motor_inertia, link: link.max(R::lit(LIGHTEST)) }
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
    let (sin, cos) = sin_cos(u.angle * p.ripple_cycles);
    let ripple = sin.mul_add(p.ripple_sin, cos * p.ripple_cos);
    let net = p.form.given(given) - p.offset;
    net.mul_add(p.torque_constant_error, net + ripple)
}

/// Dry friction on the motor's side: where it settles when the drive slides on in a direction, and over which travel.
///
/// The bristles come to their level over a travel, so that friction lags behind the speed (Canudas de Wit 1995). Their
/// stiffness is what Coulomb friction and its presliding travel make it, whatever the level: the higher that is, the
/// further they bend.
#[derive(Clone, Copy)]
struct Sliding<R> {
    level: R,
    travel: R,
    compliance: R,
}

/// Least and greatest travel, as shares of the nominal one.
const TRAVELS: [f64; 2] = [0.05, 20.0];

impl<R: Real> Sliding<R> {
    /// Of a direction (1, -1, or 0 at rest), at a rate and under a torque that loads the gear.
    #[inline(always)]
    fn of(p: &DriveValues<R>, u: &DriveMotion<R>, direction: R, rate: R, bearing: R) -> Self {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let weakening = exp(-(rate.abs() / p.stribeck_speed));
        let dry = weakening.mul_add(p.stribeck, bearing.abs().mul_add(p.load_coefficient, p.coulomb));
        let dry = dry + p.form.dry(u.angle) + direction * p.coulomb_asymmetry;
        // Without any Coulomb friction there is no stiffness to keep.
        let known = zero.lt(p.coulomb);
        let reference = R::select(known, p.coulomb, one);
        let share = (dry / reference).max(R::lit(TRAVELS[0])).min(R::lit(TRAVELS[1]));
        let travel = p.presliding_travel * R::select(known, share, one);
        Self { level: direction * dry, travel, compliance: p.presliding_travel / reference }
    }

    /// Friction after a displacement.
    #[inline(always)]
    fn approached(&self, friction: R, displacement: R) -> R {
        let kept = exp(-(displacement.abs() / self.travel));
        (friction - self.level).mul_add(kept, self.level)
    }

    /// What the bristles bend by while their torque changes.
    #[inline(always)]
    fn bent(&self, change: R) -> R {
        change * self.compliance
    }
}

/// Dry friction where a recording starts: what holds the torques in balance, within what friction can hold.
#[inline(always)]
fn resting<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>, given: R, load: R, inertia: Inertia<R>) -> R {
    let bearing = (u.acceleration * inertia.link).mul_add(p.load_inertial, load);
    let most = |way: f64| Sliding::of(p, u, R::lit(way), u.rate, bearing).level;
    let rest = applied(p, u, given) - load - drag(p, u, u.rate) - u.acceleration * inertia.whole();
    rest.min(most(1.0)).max(most(-1.0))
}

/// Friction that grows with the rate, and what forms outside the catalogue resist with.
#[inline(always)]
fn drag<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>, rate: R) -> R {
    // Lubricants thin as they warm up; dry friction hardly changes (Bittencourt et al. 2010).
    let warmth = R::lit(1.0) - exp(-(u.time / p.warm_up));
    (p.viscous * exp(-(p.warm_loss * warmth))).mul_add(rate, p.form.resisting(u.angle, rate))
}

/// The gear's transmission error, its derivative by the motor's angle, and its second derivative by time.
struct Wave<R> {
    angle: R,
    slope: R,
    acceleration: R,
}

#[inline(always)]
fn wave<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>) -> Wave<R> {
    let (sin, cos) = sin_cos(u.angle * p.wave_cycles);
    let angle = sin.mul_add(p.wave_sin, cos * p.wave_cos);
    let slope = (cos * p.wave_sin - sin * p.wave_cos) * p.wave_cycles;
    let speed = u.rate * p.wave_cycles;
    Wave { angle, slope, acceleration: slope * u.acceleration - speed * speed * angle }
}

/// Torque against the link, its own inertia left out: what the model says, and the effects behind the gear.
#[inline(always)]
fn load<R: Real>(p: &DriveValues<R>, u: &DriveMotion<R>, inertia: R, cable: R) -> R {
    let (sin, cos) = sin_cos(u.angle);
    let gravity = cos.mul_add(p.gravity_cos, sin * p.gravity_sin);
    let spring = (u.angle - p.cable_centre).mul_add(p.cable_stiffness, cable * p.cable_hysteresis);
    let loads = u.payload_weight.mul_add(p.payload, gravity + spring);
    u.load + wave(p, u).acceleration.mul_add(inertia, loads)
}

/// The flank that carries a torque; without one the middle of the play.
#[inline(always)]
fn flank<R: Real>(torque: R, half_backlash: R) -> R {
    let one = R::lit(1.0);
    torque.min(one).max(-one) * half_backlash
}

/// The link on its gear.
struct Gear<R> {
    compliance: R,
    /// Angular frequency of the link on the gear with the motor held \[rad/s\].
    frequency: R,
    damping: R,
}

impl<R: Real> Gear<R> {
    #[inline(always)]
    fn of(p: &DriveValues<R>, inertia: R) -> Self {
        let compliance = p.compliance.max(R::lit(RIGID));
        let frequency = R::lit(1.0) / (inertia * compliance).sqrt();
        Self { compliance, frequency, damping: p.gear_damping.min(R::lit(0.99)) }
    }

    /// Windup at rest under a torque, on the flank at `side`.
    #[inline(always)]
    fn rest(&self, torque: R, side: R) -> R {
        torque.mul_add(self.compliance, side)
    }
}

/// Torque that the gear transmits.
#[inline(always)]
fn gear_torque<R: Real>(p: &DriveValues<R>, s: &DriveHidden<R>, inertia: R) -> R {
    let gear = Gear::of(p, inertia);
    let stretch = s.windup - s.windup.min(p.half_backlash).max(-p.half_backlash);
    let damper = gear.damping * R::lit(2.0) * gear.frequency * inertia;
    let torque = stretch / gear.compliance + damper * s.windup_rate;
    // Teeth with a gap push and never pull.
    let (zero, loose) = (R::lit(0.0), R::lit(0.0).lt(p.half_backlash));
    let pushed = R::select(s.windup.lt(zero), torque.min(zero), torque.max(zero));
    R::select(engaged(p, s.windup), R::select(loose, pushed, torque), zero)
}

#[inline(always)]
fn engaged<R: Real>(p: &DriveValues<R>, windup: R) -> R::Mask {
    p.half_backlash.le(R::lit(0.0)) | p.half_backlash.le(windup.abs())
}

/// Windup and its rate after a step over which the pull goes from `s.pull` to `pull` in a straight line.
///
/// Free in the play until a flank is met, then the exact motion of a damped spring: no step limit, however stiff.
#[inline(always)]
fn wind<R: Real>(step: f64, p: &DriveValues<R>, s: &DriveHidden<R>, inertia: R, pull: R) -> (R, R) {
    let (zero, half, step) = (R::lit(0.0), R::lit(0.5), R::lit(step));
    let free = R::select(engaged(p, s.windup), zero, step);
    let acceleration = (s.pull + pull) * half / inertia;
    let reached = acceleration.mul_add(free * free * half, s.windup_rate.mul_add(free, s.windup));
    let past = p.half_backlash.lt(reached.abs());
    let side = R::select(reached.lt(zero), -p.half_backlash, p.half_backlash);
    let way = reached - s.windup;
    let met = free * ((side - s.windup) / R::select(past, way, R::lit(1.0)));
    let flight = R::select(past, met.max(zero).min(free), free);
    let windup = acceleration.mul_add(flight * flight * half, s.windup_rate.mul_add(flight, s.windup));
    let rate = acceleration.mul_add(flight, s.windup_rate);

    let gear = Gear::of(p, inertia);
    let slope = (pull - s.pull) / step;
    let behind = gear.damping * R::lit(2.0) / gear.frequency * slope;
    let side = windup.min(p.half_backlash).max(-p.half_backlash);
    let met_pull = slope.mul_add(flight, s.pull);
    let apart = (windup - gear.rest(met_pull - behind, side), rate - slope * gear.compliance);
    let (place, speed) = swing(&gear, step - flight, apart);
    let swung = (place + gear.rest(pull - behind, side), speed + slope * gear.compliance);
    let still_free = step.le(flight);
    (R::select(still_free, windup, swung.0), R::select(still_free, rate, swung.1))
}

/// Free vibration about rest: place and speed after a time.
#[inline(always)]
fn swing<R: Real>(gear: &Gear<R>, time: R, (place, speed): (R, R)) -> (R, R) {
    let decay = gear.damping * gear.frequency;
    let damped = gear.frequency * (R::lit(1.0) - gear.damping * gear.damping).sqrt();
    let (sin, cos) = sin_cos(damped * time);
    let kept = exp(-(decay * time));
    let quarter = (decay.mul_add(place, speed)) / damped;
    let quarter_speed = (gear.frequency * gear.frequency).mul_add(place, decay * speed) / damped;
    (kept * (place * cos + quarter * sin), kept * (speed * cos - quarter_speed * sin))
}
