//! Monitor stage: peaks, events, energies and the end of a loop; and the metrics that follow from them.

use crate::bundle;
use crate::capture_ring::{Ring, has_ring, ring_momenta};
use crate::contact::{LatchState, PointContact, sliding_velocity};
use crate::metrics::Metrics;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Bodies, Parts, Wrench};
use crate::test_motion::Followed;
use crate::vector::Vec3;

bundle! {
    /// All points of part A together; the most loaded point stands for the direction.
    Touch {
        wrench: Wrench<R>, "1", "contact wrench on part A about A's origin, inertial axes";
        force: R, "N", "largest normal force of a point";
        sum: R, "N", "normal forces of all points, whatever their directions";
        depth: R, "m", "largest overlap";
        normal: Vec3<R>, "1", "normal at the most loaded point";
        lever: Vec3<R>, "m", "most loaded point from A's origin";
        finger_power: R, "1", "power in W of the contact on the motion of part A's fingers in its frame";
    }
}

bundle! {
    /// A peak and when it was.
    Peak {
        square: R, "1", "square of the greatest magnitude";
        time: R, "s", "time of it, -1 before";
    }
}

bundle! {
    /// Part A standing between opposite contacts of part B; kept where an insertion is judged.
    Jam {
        begin: R, "s", "time at which it came to stand, -1 while it moves";
        duration: R, "s", "longest time that it stood";
        push: R, "N", "contact force of that time, the push that is balanced";
        moment: R, "N m", "contact moment about part A's origin then";
        squeeze: R, "N", "force with which opposite contacts pressed each other then";
    }
}

bundle! {
    /// What the monitor remembers of one loop.
    Watch {
        touch_time: R, "s", "time of the first touch, -1 before";
        normal: Vec3<R>, "1", "normal at the first touch, inertial axes";
        lever: Vec3<R>, "m", "contact point at the first touch from A's origin, inertial axes";
        approach_speed: R, "m/s", "normal speed of the simulated parts at the first touch, -1 before";
        touching: R, "1", "1 while the parts push each other";
        contacts: R, "1", "number of contacts that have begun";
        bounces: R, "1", "number of separations";
        separated_at: R, "s", "time of the last separation";
        separation_speed: R, "m/s", "normal speed of separation now";
        best_separation: R, "m/s", "largest of it between the first touch and the second";
        contact_duration: R, "s", "time in contact";
        impulse: R, "N s", "integral of the contact force's magnitude";
        first_duration: R, "s", "duration of the first contact";
        first_impulse: R, "N s", "its impulse";
        first_peak: R, "N", "its largest contact force";
        contact_force: Peak<R>, "1", "contact force";
        latch_force: Peak<R>, "1", "latch force";
        interface_force: Peak<R>, "1", "sum of both";
        contact_moment: Peak<R>, "1", "moment of the contact";
        latch_moment: Peak<R>, "1", "moment of the latch";
        interface_moment: Peak<R>, "1", "sum of both";
        peak_depth: R, "m", "largest depth";
        closed: R, "1", "1 once the latch has closed";
        capture_time: R, "s", "time of capture, -1 before";
        capture_offset: R, "m", "radial offset at capture, -1 before";
        miss_distance: R, "m", "least distance of the latch point from its seat";
        insertion: R, "m", "farthest that part A's origin came beyond part B's, along part B's x axis";
        jam: Jam<R>, "1", "part A standing in part B";
        contact_work: R, "J", "work of the contact (latch excluded) on the parts";
        absorbed: R, "J", "largest energy stored in the contact";
        push: Wrench<R>, "1", "contact wrench of the last substep (latch excluded), for the work of the next";
        port_energy: R, "J", "energy through the port on the simulated side";
        hardware_energy: R, "J", "energy through the port on the hardware side";
        done: R, "1", "1 once the loop has ended";
        unstable: R, "1", "1 if the loop ended by divergence";
        end_speed: R, "m/s", "relative speed of the simulated parts at the end";
        end_time: R, "s", "time of the end";
    }
}

impl<R: Real> Peak<R> {
    /// Nothing yet.
    #[inline(always)]
    fn none() -> Self {
        Self { square: R::lit(0.0), time: R::lit(-1.0) }
    }

    /// With one more value.
    #[inline(always)]
    fn with(self, value: Vec3<R>, time: R) -> Self {
        let square = value.dot(value);
        let more = self.square.lt(square);
        Self { square: R::select(more, square, self.square), time: R::select(more, time, self.time) }
    }

    /// The greatest magnitude.
    #[inline(always)]
    pub fn value(self) -> R {
        self.square.sqrt()
    }
}

/// 1 after the first touch.
#[inline(always)]
pub fn touched<R: Real>(watch: &Watch<R>) -> R {
    R::select(R::lit(0.0).le(watch.touch_time), R::lit(1.0), R::lit(0.0))
}

/// Nothing touches.
#[inline(always)]
pub fn no_touch<R: Real>() -> Touch<R> {
    let (zero, none) = (R::lit(0.0), Vec3::zero());
    Touch {
        wrench: Wrench::zero(),
        force: zero,
        sum: zero,
        depth: R::lit(-1.0e3),
        normal: none,
        lever: none,
        finger_power: zero,
    }
}

/// With one point more.
#[inline(always)]
pub fn gather<R: Real>(sum: &Touch<R>, c: &PointContact<R>) -> Touch<R> {
    let more = sum.force.abs().lt(c.force.abs());
    Touch {
        wrench: sum.wrench + c.wrench,
        force: R::select(more, c.force, sum.force),
        sum: sum.sum + c.force,
        depth: sum.depth.max(c.depth),
        normal: Vec3::select(more, c.normal, sum.normal),
        lever: Vec3::select(more, c.lever, sum.lever),
        finger_power: sum.finger_power,
    }
}

/// Contact and latch together.
#[inline(always)]
pub fn total_wrench<R: Real>(touch: &Touch<R>, latch: &LatchState<R>) -> Wrench<R> {
    touch.wrench + latch.wrench
}

/// Power of a wrench on part A (and its opposite on part B) into the relative motion.
#[inline(always)]
pub fn port_power<R: Real>(parts: &Parts<R>, w: Wrench<R>) -> R {
    let slide = sliding_velocity(&parts.a, &parts.b, Vec3::zero());
    w.force.dot(slide) + w.moment.dot(parts.a.omega - parts.b.omega)
}

/// A watch before the start.
#[inline(always)]
pub fn new_watch<R: Real>() -> Watch<R> {
    let (zero, never, none) = (R::lit(0.0), R::lit(-1.0), Vec3::zero());
    Watch {
        touch_time: never,
        normal: none,
        lever: none,
        approach_speed: never,
        touching: zero,
        contacts: zero,
        bounces: zero,
        separated_at: never,
        separation_speed: zero,
        best_separation: zero,
        contact_duration: zero,
        impulse: zero,
        first_duration: zero,
        first_impulse: zero,
        first_peak: zero,
        contact_force: Peak::none(),
        latch_force: Peak::none(),
        interface_force: Peak::none(),
        contact_moment: Peak::none(),
        latch_moment: Peak::none(),
        interface_moment: Peak::none(),
        peak_depth: zero,
        closed: zero,
        capture_time: never,
        capture_offset: never,
        miss_distance: R::lit(FAR),
        insertion: R::lit(-FAR),
        jam: Jam { begin: never, duration: zero, push: never, moment: never, squeeze: never },
        contact_work: zero,
        absorbed: zero,
        push: Wrench::zero(),
        port_energy: zero,
        hardware_energy: zero,
        done: zero,
        unstable: zero,
        end_speed: zero,
        end_time: zero,
    }
}

/// Farther than any latch point is from its seat \[m\].
const FAR: f64 = 1.0e6;

/// One substep of contact: `parts` are those that touch, `simulated` those whose bounce counts.
#[inline(always)]
pub fn observe<R: Real>(
    m: &Plant,
    s: &Watch<R>,
    time: R,
    parts: &Parts<R>,
    simulated: &Parts<R>,
    touch: &Touch<R>,
    latch: &LatchState<R>,
) -> Watch<R> {
    let (zero, one, dt) = (R::lit(0.0), R::lit(1.0), R::lit(m.timing.substep));
    let on = zero.lt(touch.force.abs());
    let first = on & s.touch_time.lt(zero);
    let was = zero.lt(s.touching);
    let (begins, ends) = (on & !was & !first, was & !on);
    let normal = Vec3::select(first, touch.normal, s.normal);
    let lever = Vec3::select(first, touch.lever, s.lever);
    let separation = sliding_velocity(&simulated.a, &simulated.b, lever).dot(normal);
    let contacts = R::select(begins | first, s.contacts + one, s.contacts);
    let touched = first | zero.le(s.touch_time);
    let open = touched & contacts.lt(R::lit(1.5));
    let in_first = on & contacts.lt(R::lit(1.5));
    let force = touch.wrench.force.norm();
    let total = total_wrench(touch, latch);
    // The parts came here with this substep's velocity under the mean of the last wrench and this one.
    let half = |old: Vec3<R>, new: Vec3<R>| (old + new) * R::lit(0.5);
    let mean =
        Wrench { force: half(s.push.force, touch.wrench.force), moment: half(s.push.moment, touch.wrench.moment) };
    let step_work = port_power(parts, mean) * dt;
    let mut work = s.contact_work + step_work;
    if !m.contact.fingers.is_empty() {
        work = touch.finger_power.mul_add(dt, work);
    }
    let closes = zero.lt(latch.closed) & s.closed.le(zero);
    let advance = parts.b.attitude.rotate_back(parts.a.position - parts.b.position).x;
    Watch {
        touch_time: R::select(first, time, s.touch_time),
        normal,
        lever,
        approach_speed: R::select(first, -separation, s.approach_speed),
        touching: R::select(on, one, zero),
        contacts,
        bounces: R::select(ends, s.bounces + one, s.bounces),
        separated_at: R::select(ends, time, s.separated_at),
        separation_speed: R::select(touched, separation, s.separation_speed),
        best_separation: R::select(open, s.best_separation.max(separation), s.best_separation),
        contact_duration: R::select(on, s.contact_duration + dt, s.contact_duration),
        impulse: force.mul_add(dt, s.impulse),
        first_duration: R::select(in_first, s.first_duration + dt, s.first_duration),
        first_impulse: R::select(in_first, force.mul_add(dt, s.first_impulse), s.first_impulse),
        first_peak: R::select(in_first, s.first_peak.max(force), s.first_peak),
        contact_force: s.contact_force.with(touch.wrench.force, time),
        latch_force: s.latch_force.with(latch.wrench.force, time),
        interface_force: s.interface_force.with(total.force, time),
        contact_moment: s.contact_moment.with(touch.wrench.moment, time),
        latch_moment: s.latch_moment.with(latch.wrench.moment, time),
        interface_moment: s.interface_moment.with(total.moment, time),
        peak_depth: s.peak_depth.max(touch.depth),
        closed: latch.closed,
        capture_time: R::select(closes, time, s.capture_time),
        capture_offset: R::select(closes, latch.offset, s.capture_offset),
        miss_distance: s.miss_distance.min(latch.distance),
        insertion: s.insertion.max(advance),
        jam: if is_insertion(m) { jammed(&s.jam, time, parts, touch) } else { s.jam },
        contact_work: work,
        absorbed: s.absorbed.max(-work),
        push: touch.wrench,
        hardware_energy: port_power(parts, latch.wrench).mul_add(dt, s.hardware_energy + step_work),
        ..*s
    }
}

/// Whether the task is an insertion.
fn is_insertion(m: &Plant) -> bool {
    m.task.min_insertion.is_finite()
}

/// Slower than this a part stands \[m/s\].
const STANDING: f64 = 1e-4;

/// Share of the contact forces that opposite contacts of a part that jams have at least against each other.
const OPPOSITE: f64 = 0.25;

/// Part A stands where opposite contacts press it: their forces take each other away, and what is left balances the push.
#[inline(always)]
fn jammed<R: Real>(s: &Jam<R>, time: R, parts: &Parts<R>, touch: &Touch<R>) -> Jam<R> {
    let (zero, never) = (R::lit(0.0), R::lit(-1.0));
    let net = touch.wrench.force.norm();
    let squeeze = touch.sum - net;
    let speed = sliding_velocity(&parts.a, &parts.b, Vec3::zero()).norm();
    let stands = speed.lt(R::lit(STANDING)) & (touch.sum * R::lit(OPPOSITE)).lt(squeeze);
    let stood = zero.le(s.begin);
    let begin = R::select(stands, R::select(stood, s.begin, time), never);
    let duration = R::select(stands, time - begin, zero);
    let longest = s.duration.lt(duration);
    Jam {
        begin,
        duration: s.duration.max(duration),
        push: R::select(longest, net, s.push),
        moment: R::select(longest, touch.wrench.moment.norm(), s.moment),
        squeeze: R::select(longest, squeeze, s.squeeze),
    }
}

/// Whether the loop is over, once per tick; `last` is 1 in the last tick, `facility` on the facility.
#[inline(always)]
pub fn finish<R: Real>(m: &Plant, s: &Watch<R>, time: R, simulated: &Parts<R>, last: R, facility: R) -> Watch<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let since = |event: R| time - event;
    let apart = zero.lt(s.bounces) & s.touching.le(zero);
    let parted = apart & R::lit(finite(m.task.end_after_separation)).lt(since(s.separated_at));
    let [in_space, on_facility] = m.task.end_after_capture;
    let hold = R::select(zero.lt(facility), R::lit(finite(on_facility)), R::lit(finite(in_space)));
    let captured = zero.le(s.capture_time) & hold.lt(since(s.capture_time));
    let speed = sliding_velocity(&simulated.a, &simulated.b, Vec3::zero()).norm();
    // Not "greater than": the comparison must also catch a NaN.
    let calm = speed.le(R::lit(m.facility.unstable_speed));
    let over = parted | captured | zero.lt(last) | !calm;
    let ends = over & s.done.le(zero);
    Watch {
        done: R::select(over, one, s.done),
        unstable: R::select(ends & !calm, one, s.unstable),
        end_speed: R::select(ends, speed, s.end_speed),
        end_time: R::select(ends, time, s.end_time),
        ..*s
    }
}

/// An unused limit as a number that f32 can hold and a run cannot reach.
fn finite(limit: f64) -> f64 {
    limit.min(1.0e9)
}

/// Metrics of a finished loop; `facility` is 1 on the facility, where the ports may differ and robots follow, and where the
/// ring is hardware that the simulated bodies know nothing of.
#[inline(always)]
pub fn metrics<R: Real, const N: usize>(
    m: &Plant,
    s: &Watch<R>,
    bodies: &Bodies<R, N>,
    ring: &Ring<R>,
    followed: &Followed<R>,
    facility: R,
) -> Metrics<R> {
    let (zero, one, never) = (R::lit(0.0), R::lit(1.0), R::lit(-1.0));
    let bounced = zero.lt(s.bounces) & zero.lt(s.approach_speed);
    let restitution = s.best_separation / R::select(bounced, s.approach_speed, one);
    let touched = zero.le(s.touch_time);
    let (mut linear, mut angular) = momentum_errors(bodies);
    let mut injected = s.port_energy - s.hardware_energy;
    if has_ring(m) {
        let (own, own_spin) = ring_momenta(ring);
        linear = own.scale_add(one - facility, linear);
        angular = own_spin.scale_add(one - facility, angular);
        injected = injected - ring.work;
    }
    let miss = if m.contact.latch.is_some() { s.miss_distance } else { never };
    Metrics {
        touch_time: s.touch_time,
        approach_speed: s.approach_speed,
        restitution: R::select(bounced, restitution, never),
        rebound_speed: R::select(bounced, s.best_separation, never),
        contact_count: s.contacts,
        contact_duration: s.contact_duration,
        impulse: s.impulse,
        first_contact_duration: R::select(touched, s.first_duration, never),
        first_contact_impulse: R::select(touched, s.first_impulse, never),
        first_contact_force: R::select(touched, s.first_peak, never),
        peak_contact_force: s.contact_force.value(),
        peak_latch_force: s.latch_force.value(),
        peak_interface_force: s.interface_force.value(),
        peak_contact_moment: s.contact_moment.value(),
        peak_latch_moment: s.latch_moment.value(),
        peak_interface_moment: s.interface_moment.value(),
        peak_contact_force_time: s.contact_force.time,
        peak_latch_force_time: s.latch_force.time,
        peak_interface_force_time: s.interface_force.time,
        peak_contact_moment_time: s.contact_moment.time,
        peak_latch_moment_time: s.latch_moment.time,
        peak_interface_moment_time: s.interface_moment.time,
        peak_depth: s.peak_depth.max(zero),
        capture_time: s.capture_time,
        capture_offset: s.capture_offset,
        miss_distance: miss,
        insertion: s.insertion,
        jam_duration: s.jam.duration,
        jam_push: s.jam.push,
        jam_moment: s.jam.moment,
        jam_squeeze: s.jam.squeeze,
        peak_leg_force: ring.peak_force,
        peak_leg_stroke: ring.peak_stroke,
        separation_time: s.separated_at,
        separation_speed: s.separation_speed,
        linear_momentum_error: linear.norm(),
        angular_momentum_error: angular.norm(),
        injected_energy: injected * facility,
        tracking_gain: R::select(zero.lt(facility), followed.gain, never),
        tracking_lag: followed.lag * facility,
        tracking_error: followed.error * facility,
        tracking_overshoot: followed.overshoot * facility,
        end_time: s.end_time,
    }
}

/// Total momenta against the account of start and external impulses.
#[inline(always)]
fn momentum_errors<R: Real, const N: usize>(b: &Bodies<R, N>) -> (Vec3<R>, Vec3<R>) {
    let place = |body: &crate::space::Body<R>| body.com + body.com_step;
    let linear = b.chaser.momentum + b.target.momentum - b.impulse;
    let angular = (b.chaser.spin + place(&b.chaser).cross(b.chaser.momentum))
        + (b.target.spin + place(&b.target).cross(b.target.momentum))
        - b.moment_impulse;
    (linear, angular)
}
