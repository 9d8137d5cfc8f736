//! Space stage: a free-floating base with a serial arm, and the free target, under wrenches and torques.
//!
//! Inertial axes; spatial quantities refer to the system's own centre of mass O, in the frame that moves with it
//! (the arm's chain needs no transforms between links then: articulated inertias simply add). State is the total
//! linear momentum and the angular momentum about O, changed only by applied wrenches, so that momentum holds to
//! rounding; the base twist is solved from them after the joint rates (semi-implicit Euler), and attitudes turn by
//! a midpoint rule. Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 7 and 9.

use crate::bundle;
use crate::chain::driven::led;
use crate::chain::dynamics::{Composite, Course, Posture, Reach};
use crate::chain::inertia::Force;
use crate::chain::{ChainLink, Turn};
use crate::manipulator::{ArmDrives, carried_on, driven};
use crate::math::sin_cos;
use crate::modes::{MODES, Mode, Sway, hil_modes, recoil, swayed};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::vector::{Mat3, Quat, Sym3, Vec3, vec3};
use std::ops::{Add, Neg, Sub};

bundle! {
    /// A free body, or a whole free-floating chain seen from outside; inertial axes.
    Body {
        com: Vec3<R>, "m", "centre of mass at the tick's start, contact frame";
        com_step: Vec3<R>, "m", "motion of the centre of mass since the tick's start (keeps f32 from freezing)";
        attitude: Quat<R>, "1", "rotation from body (base) axes to inertial axes";
        momentum: Vec3<R>, "kg m/s", "linear momentum";
        spin: Vec3<R>, "kg m^2/s", "angular momentum about the centre of mass";
    }
}

bundle! {
    /// The arm's joints.
    Arm<N> {
        angle: [R; N], "rad", "joint angles from the start posture; metres of a joint that slides";
        rate: [R; N], "rad/s", "joint rates; metres per second of a joint that slides";
        turn: Vec3<R>, "rad/s", "base rate after the last step; its change with the configuration centres the next turn";
    }
}

bundle! {
    /// The simulated bodies of one loop; written by the space stage.
    Bodies<N> {
        chaser: Body<R>, "1", "base and arm together";
        arm: Arm<R, N>, "1", "joints";
        drives: ArmDrives<R, N>, "1", "drives of the joints";
        target: Body<R>, "1", "target, with what sways in it";
        sway: [Sway<R>; MODES], "1", "hidden modes of the target: slosh, then the appendage", of "P2_slosh", "P3_appendage";
        impulse: Vec3<R>, "N s", "external impulse so far (thrust, test field)";
        moment_impulse: Vec3<R>, "kg m^2/s", "external moment impulse so far, about the origin";
    }
}

bundle! {
    /// Force and moment; its user states point and axes.
    Wrench {
        force: Vec3<R>, "N", "force";
        moment: Vec3<R>, "N m", "moment";
    }
}

bundle! {
    /// Pose and twist of a part's frame, inertial axes.
    Motion {
        position: Vec3<R>, "m", "origin of the part's frame";
        attitude: Quat<R>, "1", "rotation from the part's axes to inertial axes";
        velocity: Vec3<R>, "m/s", "velocity of the frame's origin";
        omega: Vec3<R>, "rad/s", "angular velocity";
    }
}

bundle! {
    /// The two contact parts.
    Parts {
        a: Motion<R>, "1", "part A, on the end-effector";
        b: Motion<R>, "1", "part B, on the target";
    }
}

bundle! {
    /// Inertial properties of a loop's bodies: the facility's simulation may be wrong about them.
    Masses {
        base_mass: R, "kg", "mass of the base";
        base_inertia_scale: R, "1", "factor on the base's nominal inertia";
        target_mass: R, "kg", "mass of the target";
        target_inertia_scale: R, "1", "factor on the target's nominal inertia";
        target_com: Vec3<R>, "m", "centre of mass of the target from its nominal one, body axes";
        modes: [Mode<R>; MODES], "1", "hidden modes of the target: slosh, then the appendage";
    }
}

bundle! {
    /// What guidance commands; constant over a tick.
    Actuation<N> {
        thrust: Vec3<R>, "N", "force on the base at its centre of mass, inertial axes";
        torque: Vec3<R>, "N m", "torque on the base, inertial axes";
        joint: [R; N], "N m", "joint torques; forces in newtons along joints that slide";
        braked: R, "1", "1 while the arm's brakes are closed";
    }
}

bundle! {
    /// Kinematics of a configuration: what dynamics, guidance and contact all need, computed once.
    ///
    /// Chain axes are the base's as the arm's first joint likes them (see [`crate::chain`]).
    Kinematics<N> {
        parts: Parts<R>, "1", "motion of the two parts";
        turns: [Turn<R>; N], "1", "turns of the joints; travels of those that slide";
        axes: Mat3<R>, "1", "rotation from the base's chain axes to inertial axes";
        com: Vec3<R>, "m", "the chaser's centre of mass O from the base's own, chain axes";
        mass: R, "kg", "mass of the whole chaser";
        rate: Vec3<R>, "rad/s", "angular velocity of the base, chain axes";
        inverse_inertia: Sym3<R>, "1", "inverse inertia of the whole chaser about O, chain axes [1/(kg m^2)]";
        reach: Reach<R>, "1", "motion of part A as the base sees it";
        target_axes: Mat3<R>, "1", "rotation from the target's body axes to inertial axes";
    }
}

impl<R: Real> Wrench<R> {
    /// No force and no moment.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { force: Vec3::zero(), moment: Vec3::zero() }
    }

    /// `self * s + o`, fused.
    #[inline(always)]
    pub fn scale_add(self, s: R, o: Self) -> Self {
        Self { force: self.force.scale_add(s, o.force), moment: self.moment.scale_add(s, o.moment) }
    }
}

impl<R: Real> Add for Wrench<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { force: self.force + o.force, moment: self.moment + o.moment }
    }
}

impl<R: Real> Neg for Wrench<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { force: -self.force, moment: -self.moment }
    }
}

impl<R: Real> Sub for Wrench<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { force: self.force - o.force, moment: self.moment - o.moment }
    }
}

/// The true masses: the loop in space.
#[inline(always)]
pub fn space_masses<R: Real>(p: &Params<R>) -> Masses<R> {
    Masses {
        base_mass: p.base_mass,
        base_inertia_scale: p.base_inertia_scale,
        target_mass: p.target_mass,
        target_inertia_scale: p.target_inertia_scale,
        target_com: Vec3::zero(),
        modes: crate::fields::filled(R::lit(0.0)),
    }
}

/// The masses that the facility simulates.
#[inline(always)]
pub fn hil_masses<R: Real>(p: &Params<R>) -> Masses<R> {
    let one = R::lit(1.0);
    Masses {
        target_mass: p.target_mass * (one + p.mass_error),
        target_inertia_scale: p.target_inertia_scale * (one + p.inertia_error),
        target_com: p.target_com_error,
        modes: hil_modes(p),
        ..space_masses(p)
    }
}

/// Positions, inertias and momenta of the chain, and the twists that the momenta imply.
///
/// A held base stands still at `chaser.com`, its own centre of mass: the chaser has neither momentum nor inertia there.
#[inline(always)]
pub fn kinematics<R: Real, const N: usize>(m: &Plant, masses: &Masses<R>, s: &Bodies<R, N>) -> Kinematics<R, N> {
    let mut k = crate::fields::filled(R::lit(0.0));
    update_kinematics(m, masses, s, &mut k);
    k
}

/// [`kinematics`] in place: a copy of it in lanes costs as much as a tenth of a step.
#[inline(always)]
pub fn update_kinematics<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &Bodies<R, N>,
    k: &mut Kinematics<R, N>,
) {
    let root = s.chaser.attitude.compose(Quat::lit(m.chain.root));
    k.axes = root.matrix();
    let mut last = root;
    for i in 0..N {
        let link = &m.chain.links[i];
        if link.slides {
            last = link.turned(last, Turn::lit(Turn::of_angle(0.5 * link.start_angle)));
            k.turns[i] = ChainLink::slid(s.arm.angle[i]);
            continue;
        }
        let (sin, cos) = sin_cos((s.arm.angle[i] + R::lit(link.start_angle)) * R::lit(0.5));
        let half = Turn { cos, sin };
        last = link.turned(last, half);
        k.turns[i] = half.doubled();
    }

    let attitude = last.compose(Quat::lit(m.chain.tool.attitude));
    k.parts.a =
        if m.held.base { on_held_base(m, masses, s, k, attitude) } else { on_free_base(m, masses, s, k, attitude) };
    k.target_axes = s.target.attitude.matrix();
    k.parts.b = seat_motion(m, masses, s, k.target_axes);
}

/// Motion of part A, whose attitude is given, as the momenta and the joint rates imply it; mass, inertia and rate of the
/// chaser go into `k`.
#[inline(always)]
fn on_free_base<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &Bodies<R, N>,
    k: &mut Kinematics<R, N>,
    attitude: Quat<R>,
) -> Motion<R> {
    k.mass = masses.base_mass + R::lit(m.chain.mass);
    let posture = posture(m, masses, &k.turns);
    let Composite { body, momentum } = posture.composite(&s.arm.rate);
    let inverse_mass = R::lit(1.0) / k.mass;
    k.com = body.first * inverse_mass;
    let about_base = body.inertia + posture.base_inertia();
    k.inverse_inertia = (about_base + Sym3::point_mass(-k.mass, k.com)).inverse();
    // Angular momentum of the joint rates about O, O at rest.
    let joints = momentum.moment - k.com.cross(momentum.force);
    k.rate = k.inverse_inertia.times(k.axes.transposed_times(s.chaser.spin) - joints);

    k.reach = posture.reach(&s.arm.rate);
    let lever = k.reach.position - k.com;
    let slide = k.reach.velocity - momentum.force * inverse_mass;
    Motion {
        position: s.chaser.com + (s.chaser.com_step + k.axes.times(lever)),
        attitude,
        velocity: s.chaser.momentum.scale_add(inverse_mass, k.axes.times(k.rate.cross(lever) + slide)),
        omega: k.axes.times(k.rate + k.reach.omega),
    }
}

/// The same on a base that stands still: `k` has no inertia, no rate, and its centre of mass in the base's own.
#[inline(always)]
fn on_held_base<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &Bodies<R, N>,
    k: &mut Kinematics<R, N>,
    attitude: Quat<R>,
) -> Motion<R> {
    let none = Vec3::zero();
    (k.mass, k.com, k.rate) = (masses.base_mass + R::lit(m.chain.mass), none, none);
    k.inverse_inertia = Sym3::splat(R::lit(0.0));
    k.reach = posture(m, masses, &k.turns).reach(&s.arm.rate);
    Motion {
        position: s.chaser.com + k.axes.times(k.reach.position),
        attitude,
        velocity: k.axes.times(k.reach.velocity),
        omega: k.axes.times(k.reach.omega),
    }
}

/// The chaser's configuration for the chain's dynamics.
#[inline(always)]
pub(crate) fn posture<'a, R: Real, const N: usize>(
    m: &'a Plant,
    masses: &Masses<R>,
    turns: &'a [Turn<R>; N],
) -> Posture<'a, R, N> {
    let Masses { base_mass, base_inertia_scale, .. } = *masses;
    Posture { chain: &m.chain, turns, base_mass, base_inertia_scale }
}

/// Angular velocity of the target from its angular momentum, inertial axes.
#[inline(always)]
fn target_rate<R: Real>(m: &Plant, masses: &Masses<R>, axes: Mat3<R>, spin: Vec3<R>) -> Vec3<R> {
    let own = Sym3::lit(m.target_inverse_inertia).times(axes.transposed_times(spin));
    axes.times(own * (R::lit(1.0) / masses.target_inertia_scale))
}

/// Part B's origin from the target's centre of mass, body axes.
#[inline(always)]
pub(crate) fn seat_lever<R: Real>(m: &Plant, masses: &Masses<R>) -> Vec3<R> {
    Vec3::lit(m.seat.position) - masses.target_com
}

/// Motion of part B: the target's twist at its seat; a held target stands still, and nothing sways in it.
#[inline(always)]
fn seat_motion<R: Real, const N: usize>(m: &Plant, masses: &Masses<R>, s: &Bodies<R, N>, axes: Mat3<R>) -> Motion<R> {
    let target = &s.target;
    let lever = axes.times(seat_lever(m, masses));
    if m.held.target {
        let attitude = target.attitude.compose(Quat::lit(m.seat.attitude));
        return Motion { position: target.com + lever, attitude, velocity: Vec3::zero(), omega: Vec3::zero() };
    }
    let (shift, velocity) = recoil(m.effects, &masses.modes, &s.sway);
    let omega = target_rate(m, masses, axes, target.spin);
    Motion {
        position: target.com + (target.com_step + (lever + shift)),
        attitude: target.attitude.compose(Quat::lit(m.seat.attitude)),
        velocity: target.momentum.scale_add(R::lit(1.0) / masses.target_mass, omega.cross(lever) + velocity),
        omega,
    }
}

/// A wrench on part A at its origin, inertial axes, as the last link feels it.
#[inline(always)]
pub(crate) fn on_last_link<R: Real>(m: &Plant, a: &Motion<R>, w: Wrench<R>) -> Force<R> {
    let (part, tool) = (a.attitude.matrix(), Mat3::<R>::lit(m.chain.tool_axes));
    let force = tool.times(part.transposed_times(w.force));
    let moment = tool.times(part.transposed_times(w.moment));
    Force { moment: moment + Vec3::lit(m.chain.tool.position).cross(force), force }
}

/// One substep of all bodies under a wrench on part A at A's origin (its negative, at the same point, on the target).
#[inline(always)]
pub fn advance<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &Bodies<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
) -> Bodies<R, N> {
    let mut next = *s;
    advance_in_place(m, masses, &mut next, k, u, w, w);
    next
}

/// [`advance`] in place, where the target takes the negative of another wrench about A's origin than `w`: of `back`, which
/// the legs of a soft capture ring pass on.
#[inline(always)]
pub fn advance_in_place<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &mut Bodies<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
    back: Wrench<R>,
) {
    let dt = R::lit(m.timing.substep);
    let target_centre = s.target.com + s.target.com_step;
    let on_chaser = if m.held.base {
        advance_on_mount(m, masses, s, k, u, w);
        -on_origin(&k.parts.a, w)
    } else {
        advance_chaser(m, masses, s, k, u, w)
    };
    let on_target = if m.held.target {
        on_origin(&k.parts.a, back)
    } else {
        let push = advance_target(m, masses, &mut s.target, k, back);
        let pushed = back.force * -(R::lit(1.0) / masses.target_mass);
        s.sway = swayed(m.effects, dt, &masses.modes, &s.sway, pushed);
        Wrench { force: push, moment: target_centre.cross(push) }
    };
    let external = on_chaser + on_target;
    s.impulse = external.force.scale_add(dt, s.impulse);
    s.moment_impulse = external.moment.scale_add(dt, s.moment_impulse);
}

/// A wrench on part A at A's origin as force and moment about the contact frame's origin, inertial axes: what the mount of
/// a held target gives the account of momentum, and its negative what that of a held base gives.
#[inline(always)]
fn on_origin<R: Real>(a: &Motion<R>, w: Wrench<R>) -> Wrench<R> {
    Wrench { force: w.force, moment: w.moment + a.position.cross(w.force) }
}

/// One substep of the free chaser; gives the external force on it and its moment about the contact frame's origin.
#[inline(always)]
fn advance_chaser<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &mut Bodies<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
) -> Wrench<R> {
    let dt = R::lit(m.timing.substep);
    let inverse_mass = R::lit(1.0) / k.mass;
    let chaser = &mut s.chaser;
    let centre = chaser.com + chaser.com_step;
    let base_com = -k.axes.times(k.com);
    let field = gravity(m, chaser.com, chaser.momentum * inverse_mass) + Vec3::lit(m.field);
    let push = field.scale_add(k.mass, u.thrust);
    let moment = base_com.cross(u.thrust) + u.torque;
    let turning = w.moment + (k.parts.a.position - centre).cross(w.force) + moment;
    chaser.momentum = (w.force + push).scale_add(dt, chaser.momentum);
    chaser.spin = turning.scale_add(dt, chaser.spin);
    chaser.com_step = chaser.momentum.scale_add(dt * inverse_mass, chaser.com_step);

    let (joint, gain) = accelerations(m, masses, &s.arm, &mut s.drives, k, u, w, turning);
    let arm = &mut s.arm;
    advance_joints(dt, arm, &joint);
    // The rate that the new momentum and joint rates would mean at this configuration.
    let omega = k.axes.times(gain.scale_add(dt, k.rate));
    // What the last step's rate became by the change of configuration alone, half of it again: a midpoint.
    let centred = (k.axes.times(k.rate) - arm.turn).scale_add(R::lit(0.5), omega);
    chaser.attitude = chaser.attitude.turned(centred * dt);
    arm.turn = omega;
    Wrench { force: push, moment: moment + centre.cross(push) }
}

/// One substep of the arm on a held base; the field acts on its links.
#[inline(always)]
fn advance_on_mount<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    s: &mut Bodies<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
) {
    if N == 0 {
        return;
    }
    let (dt, none) = (R::lit(m.timing.substep), Vec3::zero());
    let (posture, tip, mount) = (posture(m, masses, &k.turns), on_last_link(m, &k.parts.a, w), mount_course(m, k));
    let arm = &mut s.arm;
    let joint = if m.drives.is_empty() {
        let folded = posture.folded(&arm.rate, &u.joint, &[R::lit(0.0); N], tip, mount, None);
        folded.accelerations(&posture, none, none)
    } else {
        let dt = m.timing.substep;
        let driven = driven(&m.drives, dt, &s.drives, &arm.angle, &arm.rate, &u.joint, u.braked);
        let folded = posture.folded(&arm.rate, &driven.torque, &driven.armature, tip, mount, None);
        let joint = folded.accelerations(&posture, none, none);
        carried_on(dt, &mut s.drives, &arm.angle, &arm.rate, &driven, &joint);
        joint
    };
    advance_joints(dt, arm, &joint);
}

/// How a held base moves for the chain's dynamics: not at all, its acceleration less the field's.
#[inline(always)]
pub(crate) fn mount_course<R: Real, const N: usize>(m: &Plant, k: &Kinematics<R, N>) -> Course<R> {
    led(-k.axes.transposed_times(Vec3::lit(m.field)))
}

/// Rates and angles of the joints after a substep, semi-implicit.
#[inline(always)]
fn advance_joints<R: Real, const N: usize>(dt: R, arm: &mut Arm<R, N>, joint: &[R; N]) {
    for (i, joint) in joint.iter().enumerate() {
        arm.rate[i] = joint.mul_add(dt, arm.rate[i]);
        arm.angle[i] = arm.rate[i].mul_add(dt, arm.angle[i]);
    }
}

/// Joint accelerations under actuation and a wrench on part A, and what the base's rate gains per second if the
/// configuration is taken to stand still; `turning` is the moment of all that about O, inertial axes. The drives go on.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a stage names all that it reads")]
fn accelerations<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    arm: &Arm<R, N>,
    drives: &mut ArmDrives<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
    turning: Vec3<R>,
) -> ([R; N], Vec3<R>) {
    if N == 0 {
        return (arm.rate, k.inverse_inertia.times(k.axes.transposed_times(turning)));
    }
    let push = Force { moment: k.axes.transposed_times(u.torque), force: k.axes.transposed_times(u.thrust) };
    let tip = on_last_link(m, &k.parts.a, w);
    let posture = posture(m, masses, &k.turns);
    let response = if m.drives.is_empty() {
        posture.response(k.rate, &arm.rate, &u.joint, tip, push)
    } else {
        let dt = m.timing.substep;
        let driven = driven(&m.drives, dt, drives, &arm.angle, &arm.rate, &u.joint, u.braked);
        let response = posture.response_geared(k.rate, &arm.rate, (&driven.torque, &driven.armature), tip, push);
        carried_on(dt, drives, &arm.angle, &arm.rate, &driven, &response.joint);
        response
    };
    let drift = response.drift.moment - k.com.cross(response.drift.force);
    (response.joint, response.turning + k.inverse_inertia.times(drift))
}

/// One substep of the target; gives the force of gravity on it.
#[inline(always)]
fn advance_target<R: Real, const N: usize>(
    m: &Plant,
    masses: &Masses<R>,
    target: &mut Body<R>,
    k: &Kinematics<R, N>,
    w: Wrench<R>,
) -> Vec3<R> {
    let dt = R::lit(m.timing.substep);
    let lever = k.parts.a.position - (target.com + target.com_step);
    let inverse_mass = R::lit(1.0) / masses.target_mass;
    let push = gravity(m, target.com, target.momentum * inverse_mass) * masses.target_mass;
    target.momentum = (push - w.force).scale_add(dt, target.momentum);
    target.spin = (w.moment + lever.cross(w.force)).scale_add(-dt, target.spin);
    target.com_step = target.momentum.scale_add(dt * inverse_mass, target.com_step);
    // Midpoint rule: the rate at the half-turned attitude turns the whole step.
    let rate = target_rate(m, masses, k.target_axes, target.spin);
    let half = target.attitude.turned(rate * (dt * R::lit(0.5)));
    target.attitude = target.attitude.turned(target_rate(m, masses, half.matrix(), target.spin) * dt);
    push
}

/// Clohessy-Wiltshire relative gravity at a centre of mass \[m/s^2\].
#[inline(always)]
fn gravity<R: Real>(m: &Plant, position: Vec3<R>, velocity: Vec3<R>) -> Vec3<R> {
    if m.orbit_rate == 0.0 {
        return Vec3::zero();
    }
    let (n, axes) = (m.orbit_rate, Quat::lit(m.orbit_axes));
    let (r, v) = (axes.rotate_back(position), axes.rotate_back(velocity));
    let a = vec3(r.x.mul_add(R::lit(3.0 * n * n), v.y * R::lit(2.0 * n)), v.x * R::lit(-2.0 * n), r.z * R::lit(-n * n));
    axes.rotate(a)
}

/// Closes a tick: the centres of mass take over their steps.
#[inline(always)]
pub fn settle<R: Real, const N: usize>(mut s: Bodies<R, N>) -> Bodies<R, N> {
    settle_in_place(&mut s);
    s
}

/// [`settle`] in place.
#[inline(always)]
pub fn settle_in_place<R: Real, const N: usize>(s: &mut Bodies<R, N>) {
    for body in [&mut s.chaser, &mut s.target] {
        body.com = body.com + body.com_step;
        body.com_step = Vec3::zero();
    }
}
