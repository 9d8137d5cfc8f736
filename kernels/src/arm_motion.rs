//! Motion of the arm in space: phases with guards, moves from rest to rest, the camera, the arm's own force sensor.
//!
//! Once per tick the stage [`follow`] ends phases and leads the wanted posture and pose on; the controllers of
//! [`crate::guidance`] follow them. A move has the least time that its limits of speed, acceleration and jerk allow from
//! rest to rest (the double-S profile of Biagiotti and Melchiorri, Trajectory Planning (2008), sec. 3.4).

use crate::arm_plan::{ArmGuard, ArmPhase, ArmPlan, Camera, Compliance, Goal, IMAGES, Pace};
use crate::bundle;
use crate::fields::filled;
use crate::grip::Grip;
use crate::large_rotation::{from_turn, rotation_vector};
use crate::manipulator::ArmDrives;
use crate::math::power;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Arm, Kinematics, Motion, Wrench};
use crate::vector::{Pose, Quat, Vec3, vec3};

bundle! {
    /// A frame in the base's body axes.
    Placement {
        position: Vec3<R>, "m", "origin, from the base's centre of mass";
        attitude: Quat<R>, "1", "rotation from the frame to the base's body axes";
    }
}

bundle! {
    /// What the arm keeps of its plan, and what it is to do now; written once per tick.
    ArmMotion<N> {
        phase: R, "1", "phase, from 0";
        ticks: R, "1", "ticks since the start";
        since: R, "s", "time since the phase began";
        duration: R, "s", "time that the phase's move takes";
        from: Placement<R>, "1", "part A as it was wanted, or was, when the phase began";
        from_angle: [R; N], "rad", "the same of the joints, from the start posture";
        place: Placement<R>, "1", "wanted pose of part A";
        velocity: Vec3<R>, "m/s", "its velocity, base's body axes";
        omega: Vec3<R>, "rad/s", "its angular velocity, base's body axes";
        angle: [R; N], "rad", "wanted angles of the joints, from the start posture";
        rate: [R; N], "rad/s", "their rates";
        gain: [R; N], "1", "their accelerations [rad/s^2]";
        shift: Vec3<R>, "m", "how far the wanted pose has given way, its own axes";
        turn: Vec3<R>, "rad", "the same as a rotation vector";
        shift_rate: Vec3<R>, "m/s", "rate of the shift";
        turn_rate: Vec3<R>, "rad/s", "rate of the turn";
        grip: Grip<R>, "1", "fingers of part A";
        closes: R, "1", "1 while they are to be closed";
        image_age: R, "1", "ticks since the last image";
        images: [Placement<R>; IMAGES], "1", "part B in the last images, the newest first";
        sight: Placement<R>, "1", "part B as the arm takes it to be";
    }
}

impl<R: Real> Placement<R> {
    /// This frame, then a frame in it.
    #[inline(always)]
    fn compose(self, inner: Pose<f64>) -> Self {
        Self {
            position: self.position + self.attitude.rotate(Vec3::lit(inner.position)),
            attitude: self.attitude.compose(Quat::lit(inner.attitude)),
        }
    }

    #[inline(always)]
    fn select(mask: R::Mask, then: Self, other: Self) -> Self {
        Self {
            position: Vec3::select(mask, then.position, other.position),
            attitude: Quat::select(mask, then.attitude, other.attitude),
        }
    }
}

/// The arm before the first tick.
#[inline(always)]
pub fn no_motion<R: Real, const N: usize>() -> ArmMotion<R, N> {
    filled(R::lit(0.0))
}

/// The joints as their encoders show them: on the motors, where there are any.
#[inline(always)]
pub(crate) fn on_encoders<R: Real, const N: usize>(m: &Plant, arm: &Arm<R, N>, drives: &ArmDrives<R, N>) -> Arm<R, N> {
    let mut seen = *arm;
    if !m.drives.is_empty() {
        for i in 0..N {
            seen.angle[i] = arm.angle[i] + drives.windup[i];
            seen.rate[i] = drives.motor_rate[i];
        }
    }
    seen
}

/// A constant that each phase has its own of.
#[inline(always)]
pub(crate) fn of_phase<R: Real>(plan: &ArmPlan, phase: R, constant: impl Fn(&ArmPhase) -> f64) -> R {
    let mut last = constant(&plan.phases[0]);
    let mut picked = R::lit(last);
    for (i, of) in plan.phases.iter().enumerate().skip(1) {
        let own = constant(of);
        // What stays the same from phase to phase costs nothing.
        if own != last {
            picked = R::select(R::lit(i as f64 - 0.5).lt(phase), R::lit(own), picked);
        }
        last = own;
    }
    picked
}

/// A constant of each phase's compliance; 0 without one.
#[inline(always)]
fn of_compliance<R: Real>(plan: &ArmPlan, phase: R, constant: impl Fn(&Compliance) -> f64) -> R {
    of_phase(plan, phase, |phase| phase.compliance.as_ref().map_or(0.0, &constant))
}

/// Where a lane is in the phase of an index.
#[inline(always)]
pub(crate) fn is_in<R: Real>(phase: R, index: usize) -> R::Mask {
    (phase - R::lit(index as f64)).abs().lt(R::lit(0.5))
}

/// One substep of the arm's own force sensor: the wrench on part A at its origin, part A's axes.
#[inline(always)]
pub fn feel<R: Real>(m: &Plant, felt: &Wrench<R>, a: Motion<R>, w: Wrench<R>) -> Wrench<R> {
    let lag = m.guidance.plan.as_ref().map_or(0.0, |plan| plan.sensor_lag);
    let now = Wrench { force: a.attitude.rotate_back(w.force), moment: a.attitude.rotate_back(w.moment) };
    if lag == 0.0 {
        return now;
    }
    let share = R::lit(-(-m.timing.substep / lag).exp_m1());
    (now - *felt).scale_add(share, *felt)
}

/// Ends phases and leads what is wanted on by a tick.
///
/// `felt` is what the arm's sensor shows, `captured` is 1 once the latch has closed, `noise` has normal deviates.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a stage names all that it reads")]
pub fn follow<R: Real, const N: usize>(
    m: &Plant,
    p: &Params<R>,
    s: &ArmMotion<R, N>,
    arm: &Arm<R, N>,
    drives: &ArmDrives<R, N>,
    base: Quat<R>,
    k: &Kinematics<R, N>,
    felt: &Wrench<R>,
    captured: R,
    noise: &Wrench<R>,
) -> ArmMotion<R, N> {
    let Some(plan) = &m.guidance.plan else { return *s };
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let fresh = s.ticks.lt(R::lit(0.5));
    let joints = on_encoders(m, arm, drives);
    let to_base = base.conjugate();
    let a = Placement {
        position: to_base.rotate(k.axes.times(k.reach.position)),
        attitude: to_base.compose(k.parts.a.attitude),
    };
    let mut next = *s;
    if let Some(camera) = &plan.camera {
        let lever = k.parts.b.position - k.parts.a.position + k.axes.times(k.reach.position);
        let b = Placement { position: to_base.rotate(lever), attitude: to_base.compose(k.parts.b.attitude) };
        look(m, p, camera, &mut next, a, b, fresh, noise);
    }

    let time = s.since + R::lit(m.timing.tick());
    next.phase = R::select(fresh, zero, next_phase(plan, s, time, felt, captured));
    let begins = fresh | R::lit(0.5).lt((next.phase - s.phase).abs());
    next.since = R::select(begins, zero, time);
    next.ticks = s.ticks + one;

    // A controller of the same kind goes on from what was wanted, another one from what is.
    let leads_pose = |phase: &ArmPhase| f64::from(u8::from(phase.control.is_cartesian()));
    let (before, now) = (of_phase(plan, s.phase, leads_pose), of_phase(plan, next.phase, leads_pose));
    let cartesian = R::lit(0.5).lt(now);
    let same = (before - now).abs().lt(R::lit(0.5)) & !fresh;
    let wanted = Placement::select(same & cartesian, s.place, a);
    next.from = Placement::select(begins, wanted, s.from);
    for i in 0..N {
        let wanted = R::select(same & !cartesian, s.angle[i], joints.angle[i]);
        next.from_angle[i] = R::select(begins, wanted, s.from_angle[i]);
    }

    if plan.grip_time > 0.0 {
        lead_fingers(m, plan, &mut next);
    }

    let (mut goal, mut goal_angle) = (next.from, next.from_angle);
    for (index, phase) in plan.phases.iter().enumerate() {
        let on = is_in(next.phase, index);
        match phase.goal {
            Goal::Hold => {}
            Goal::Joints(angles) => {
                for i in 0..N {
                    goal_angle[i] = R::select(on, R::lit(angles[i]), goal_angle[i]);
                }
            }
            Goal::Base(pose) => {
                let pose = Placement { position: Vec3::lit(pose.position), attitude: Quat::lit(pose.attitude) };
                goal = Placement::select(on, pose, goal);
            }
            Goal::PartB(pose) => goal = Placement::select(on, next.sight.compose(pose), goal),
        }
    }
    let shift = goal.position - next.from.position;
    let turn = rotation_vector(next.from.attitude.conjugate().compose(goal.attitude));
    let pace = |phase: &ArmPhase| phase.pace.speed / phase.pace.turn_speed;
    let mut length = shift.norm().max(turn.norm() * of_phase(plan, next.phase, pace));
    let mut way = zero;
    for (goal, from) in goal_angle.iter().zip(&next.from_angle) {
        way = way.max((*goal - *from).abs());
    }
    length = R::select(cartesian, length, way);
    let course = course(plan, next.phase, length, next.since);
    next.duration = course.duration;
    for (i, goal) in goal_angle.iter().enumerate() {
        let way = *goal - next.from_angle[i];
        next.angle[i] = way.mul_add(course.share, next.from_angle[i]);
        next.rate[i] = way * course.rate;
        next.gain[i] = way * course.gain;
    }
    next.place.position = shift.scale_add(course.share, next.from.position);
    next.place.attitude = next.from.attitude.compose(from_turn(turn * course.share));
    next.velocity = shift * course.rate;
    next.omega = next.from.attitude.rotate(turn * course.rate);
    if plan.phases.iter().any(|phase| phase.compliance.is_some()) {
        let none = Vec3::zero();
        next.shift = Vec3::select(begins, none, s.shift);
        next.turn = Vec3::select(begins, none, s.turn);
        give_way(m, plan, &mut next, felt);
    }
    next
}

/// Takes an image every period, and takes part B to be where the newest image that has arrived shows it.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a stage names all that it reads")]
fn look<R: Real, const N: usize>(
    m: &Plant,
    p: &Params<R>,
    camera: &Camera,
    s: &mut ArmMotion<R, N>,
    a: Placement<R>,
    b: Placement<R>,
    fresh: R::Mask,
    noise: &Wrench<R>,
) {
    let (period, delay) = (f64::from(camera.period), f64::from(camera.delay));
    let takes = fresh | R::lit(period - 1.5).lt(s.image_age);
    s.image_age = R::select(takes, R::lit(0.0), s.image_age + R::lit(1.0));
    let error = noise.force.scale_add(R::lit(camera.noise_position), p.camera_offset);
    let tilt = noise.moment.scale_add(R::lit(camera.noise_rotation), p.camera_tilt);
    let image = Placement {
        position: b.position + a.attitude.rotate(error),
        attitude: from_turn(a.attitude.rotate(tilt)).compose(b.attitude),
    };
    for j in (0..IMAGES).rev() {
        let older = if j == 0 { image } else { Placement::select(fresh, image, s.images[j - 1]) };
        s.images[j] = Placement::select(takes, older, s.images[j]);
    }
    let mut arrived = s.images[IMAGES - 1];
    for j in (0..IMAGES - 1).rev() {
        let has = R::lit(delay - period * j as f64 - 0.5).lt(s.image_age);
        arrived = Placement::select(has, s.images[j], arrived);
    }
    s.sight = if camera.smoothing > 0.0 {
        let share = R::lit(-(-m.timing.tick() / camera.smoothing).exp_m1());
        let turned = s.sight.attitude.small_rotation_to(arrived.attitude);
        let smooth = Placement {
            position: (arrived.position - s.sight.position).scale_add(share, s.sight.position),
            attitude: s.sight.attitude.turned(turned * share),
        };
        Placement::select(fresh, arrived, smooth)
    } else {
        arrived
    };
}

/// The phase after a tick: that of the first guard that holds.
#[inline(always)]
fn next_phase<R: Real, const N: usize>(
    plan: &ArmPlan,
    s: &ArmMotion<R, N>,
    time: R,
    felt: &Wrench<R>,
    captured: R,
) -> R {
    let force = felt.force.norm();
    let mut next = s.phase;
    for (index, phase) in plan.phases.iter().enumerate() {
        let on = is_in(s.phase, index);
        for guard in phase.guards.iter().rev() {
            let ArmGuard { arrived, captured: latched, gripped, force: above, force_below, after, next: to } = *guard;
            let mut holds = on;
            if arrived {
                holds = holds & s.duration.le(time);
            }
            if latched {
                holds = holds & R::lit(0.5).lt(captured);
            }
            if gripped {
                holds = holds & (s.grip.share - s.closes).abs().lt(R::lit(1e-3));
            }
            if let Some(limit) = above {
                holds = holds & R::lit(limit).le(force);
            }
            if let Some(limit) = force_below {
                holds = holds & force.lt(R::lit(limit));
            }
            if let Some(limit) = after {
                holds = holds & R::lit(limit).le(time);
            }
            next = R::select(holds, R::lit(to as f64), next);
        }
    }
    next
}

/// Fingers on their way, at a constant speed.
#[inline(always)]
fn lead_fingers<R: Real, const N: usize>(m: &Plant, plan: &ArmPlan, s: &mut ArmMotion<R, N>) {
    let (zero, one, tick) = (R::lit(0.0), R::lit(1.0), R::lit(m.timing.tick()));
    for (index, phase) in plan.phases.iter().enumerate() {
        if let Some(closes) = phase.closes {
            s.closes = R::select(is_in(s.phase, index), if closes { one } else { zero }, s.closes);
        }
    }
    let share = s.grip.rate.mul_add(tick, s.grip.share);
    let fastest = R::lit(1.0 / plan.grip_time);
    let rate = ((s.closes - share) * R::lit(1.0 / m.timing.tick())).min(fastest).max(-fastest);
    s.grip = Grip { share, rate };
}

/// A move at a time: the share of the way that lies behind, and how that changes.
#[derive(Clone, Copy, Debug)]
struct Course<R> {
    /// Time of the whole move \[s\].
    duration: R,
    /// Share of the way, 0 to 1.
    share: R,
    /// Its rate \[1/s\].
    rate: R,
    /// Its acceleration \[1/s^2\].
    gain: R,
}

impl Pace {
    /// Times of jerk and of acceleration in a move that reaches the greatest speed \[s\].
    fn ramps(&self) -> (f64, f64) {
        let Self { speed, acceleration, jerk, .. } = *self;
        if speed * jerk < acceleration * acceleration {
            let ramp = (speed / jerk).sqrt();
            (ramp, 2.0 * ramp)
        } else {
            let ramp = acceleration / jerk;
            (ramp, ramp + speed / acceleration)
        }
    }
}

/// The move of a phase over a way (m, or rad for joints) at a time after its begin.
#[inline(always)]
fn course<R: Real>(plan: &ArmPlan, phase: R, length: R, time: R) -> Course<R> {
    let (zero, half) = (R::lit(0.0), R::lit(0.5));
    let length = length.max(R::lit(1e-12));
    let speed = of_phase(plan, phase, |phase| phase.pace.speed);
    let acceleration = of_phase(plan, phase, |phase| phase.pace.acceleration);
    let jerk = of_phase(plan, phase, |phase| phase.pace.jerk);
    let full =
        (of_phase(plan, phase, |phase| phase.pace.ramps().0), of_phase(plan, phase, |phase| phase.pace.ramps().1));
    let ramp = of_phase(plan, phase, |phase| phase.pace.acceleration / phase.pace.jerk);
    let reaching = of_phase(plan, phase, |phase| 2.0 * phase.pace.acceleration.powi(3) / phase.pace.jerk.powi(2));

    // Three kinds of moves: one that reaches the greatest speed, one that reaches the greatest acceleration alone, and
    // one that reaches neither.
    let cruise = length / speed - full.1;
    let (is_fast, is_long) = (zero.le(cruise), reaching.le(length));
    let quarter = half * ramp;
    let long = quarter + quarter.mul_add(quarter, length / acceleration).sqrt();
    let short = power(length * half / jerk, 1.0 / 3.0);
    let ramp = R::select(is_fast, full.0, R::select(is_long, ramp, short));
    let rise = R::select(is_fast, full.1, R::select(is_long, long, short + short));
    let cruise = cruise.max(zero);
    let top = jerk * ramp;
    let peak = top * (rise - ramp);
    let duration = rise + rise + cruise;

    // The way back to the end is the way from the start, mirrored.
    let left = duration - time;
    let second = left.lt(time);
    let t = time.min(left).max(zero);
    let rest = rise - t;
    let sixth = R::lit(1.0 / 6.0);
    let (square, rest_square) = (t * t, rest * rest);
    let jerked = t.lt(ramp);
    let even = t.lt(rise - ramp);
    let rising = t.lt(rise);
    let way = R::select(
        jerked,
        jerk * t * square * sixth,
        R::select(
            even,
            top * (half * (square - ramp * t) + ramp * ramp * sixth),
            R::select(
                rising,
                peak.mul_add(half * rise - rest, jerk * rest * rest_square * sixth),
                peak * (t - half * rise),
            ),
        ),
    );
    let pace = R::select(
        jerked,
        half * jerk * square,
        R::select(even, top * (t - half * ramp), R::select(rising, peak - half * jerk * rest_square, peak)),
    );
    let gain = R::select(jerked, jerk * t, R::select(even, top, R::select(rising, jerk * rest, zero)));
    let whole = peak * (rise + cruise);
    let inverse = R::lit(1.0) / whole;
    let share = R::select(second, whole - way, way) * inverse;
    Course {
        duration,
        share: R::select(duration.le(time), R::lit(1.0), share),
        rate: pace * inverse,
        gain: R::select(second, -gain, gain) * inverse,
    }
}

/// One tick of a wanted pose that gives way to the measured wrench; rates are taken implicitly, so that no damping is
/// too much for the tick.
#[inline(always)]
fn give_way<R: Real, const N: usize>(m: &Plant, plan: &ArmPlan, s: &mut ArmMotion<R, N>, felt: &Wrench<R>) {
    let dt = R::lit(m.timing.tick());
    let measured = stacked(felt.force, felt.moment);
    let (mut place, mut rate) = (stacked(s.shift, s.turn), stacked(s.shift_rate, s.turn_rate));
    for i in 0..6 {
        let inverse_mass: R = of_compliance(plan, s.phase, |own| own.inverse_mass[i]);
        let damping = of_compliance(plan, s.phase, |own| own.damping[i]);
        let stiffness = of_compliance(plan, s.phase, |own| own.stiffness[i]);
        let press = of_compliance(plan, s.phase, |own| own.press[i]);
        let step = dt * inverse_mass;
        let push = measured[i] + press - stiffness * place[i];
        let resisted = (damping + stiffness * dt).mul_add(step, R::lit(1.0));
        let moved = step.mul_add(push, rate[i]) / resisted;
        rate[i] = R::select(R::lit(0.0).lt(inverse_mass), moved, R::lit(0.0));
        place[i] = rate[i].mul_add(dt, place[i]);
    }
    (s.shift, s.turn) = (vec3(place[0], place[1], place[2]), vec3(place[3], place[4], place[5]));
    (s.shift_rate, s.turn_rate) = (vec3(rate[0], rate[1], rate[2]), vec3(rate[3], rate[4], rate[5]));
    let axes = s.place.attitude;
    s.place.position = s.place.position + axes.rotate(s.shift);
    s.velocity = s.velocity + axes.rotate(s.shift_rate);
    s.place.attitude = axes.compose(from_turn(s.turn));
    s.omega = s.omega + axes.rotate(s.turn_rate);
}

#[inline(always)]
fn stacked<R: Real>(a: Vec3<R>, b: Vec3<R>) -> [R; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}
