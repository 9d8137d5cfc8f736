//! Space stage: a free-floating base with a serial arm, and the free target, under wrenches and torques.
//!
//! Inertial axes; spatial quantities refer to the system's own centre of mass O, in the frame that moves with it
//! (the arm's chain needs no transforms between links then: articulated inertias simply add). State is the total
//! linear momentum and the angular momentum about O, changed only by applied wrenches, so that momentum holds to
//! rounding; the base twist is solved from them after the joint rates (semi-implicit Euler), and attitudes turn by
//! a midpoint rule. Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 7 and 9.

use crate::aba::joint_accelerations;
use crate::bundle;
use crate::math::sin_cos;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::vector::{Mat3, Pose, Quat, Sym3, Vec3, vec3};

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
        angle: [R; N], "rad", "joint angles from the start posture";
        rate: [R; N], "rad/s", "joint rates";
        turn: Vec3<R>, "rad/s", "base rate after the last step; its change with the configuration centres the next turn";
    }
}

bundle! {
    /// The simulated bodies of one loop; written by the space stage.
    Bodies<N> {
        chaser: Body<R>, "1", "base and arm together";
        arm: Arm<R, N>, "1", "joints";
        target: Body<R>, "1", "target";
        impulse: Vec3<R>, "N s", "external impulse so far (thrust, test field)";
        moment_impulse: Vec3<R>, "kg m^2/s", "external moment impulse so far, about the origin";
    }
}

bundle! {
    /// Force and moment; which point and axes is said where it is used.
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
    }
}

bundle! {
    /// What guidance commands; constant over a tick.
    Actuation<N> {
        thrust: Vec3<R>, "N", "force on the base at its centre of mass, inertial axes";
        torque: Vec3<R>, "N m", "torque on the base, inertial axes";
        joint: [R; N], "N m", "joint torques";
    }
}

bundle! {
    /// One link (or the base) in inertial axes, positions from O.
    LinkState {
        axis: Vec3<R>, "1", "joint axis";
        origin: Vec3<R>, "m", "a point of the joint axis";
        com: Vec3<R>, "m", "centre of mass";
        inertia: Sym3<R>, "kg m^2", "inertia about the centre of mass";
        column: Vec3<R>, "kg m^2", "angular momentum about O per unit joint rate, base at rest";
        drift: Vec3<R>, "kg m", "linear momentum per unit joint rate, base at rest";
    }
}

bundle! {
    /// Kinematics of a configuration: what dynamics, guidance and contact all need, computed once.
    Kinematics<N> {
        parts: Parts<R>, "1", "motion of the two parts";
        links: [LinkState<R>; N], "1", "arm links";
        base_com: Vec3<R>, "m", "base centre of mass from O";
        base_inertia: Sym3<R>, "kg m^2", "base inertia, inertial axes";
        mass: R, "kg", "mass of the whole chaser";
        omega: Vec3<R>, "rad/s", "angular velocity of the base";
        velocity: Vec3<R>, "m/s", "velocity of the base-fixed point at O, relative to O";
        inverse_inertia: Sym3<R>, "1", "inverse inertia of the whole chaser about O [1/(kg m^2)]";
        target_inverse_inertia: Sym3<R>, "1", "inverse inertia of the target, inertial axes [1/(kg m^2)]";
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
    }
}

/// The masses that the facility simulates.
#[inline(always)]
pub fn hil_masses<R: Real>(p: &Params<R>) -> Masses<R> {
    let one = R::lit(1.0);
    Masses {
        target_mass: p.target_mass * (one + p.mass_error),
        target_inertia_scale: p.target_inertia_scale * (one + p.inertia_error),
        ..space_masses(p)
    }
}

/// The arm before momentum is known: links with positions from the base's centre of mass, and the tool.
///
/// Joint angles count from the start posture; momentum columns are still to come.
#[inline(always)]
fn chain<R: Real, const N: usize>(
    m: &Plant,
    base: Quat<R>,
    base_axes: Mat3<R>,
    angle: [R; N],
    links: &mut [LinkState<R>; N],
) -> Pose<R> {
    let (mut attitude, mut axes, mut origin) = (base, base_axes, Vec3::zero());
    for i in 0..N {
        origin = origin + axes.times(Vec3::lit(m.links[i].origin.position));
        attitude = about_z(attitude.compose(Quat::lit(m.link_attitudes[i])), angle[i]);
        axes = attitude.matrix();
        links[i].axis = axes.z;
        links[i].origin = origin;
        links[i].com = origin + axes.times(Vec3::lit(m.links[i].com));
        links[i].inertia = Sym3::lit(m.links[i].inertia).rotated(axes);
    }
    let position = origin + axes.times(Vec3::lit(m.tool.position));
    Pose { position, attitude: attitude.compose(Quat::lit(m.tool.attitude)) }
}

/// A rotation followed by a turn about its own z axis.
#[inline(always)]
fn about_z<R: Real>(q: Quat<R>, angle: R) -> Quat<R> {
    let (s, c) = sin_cos(angle * R::lit(0.5));
    let v = vec3(q.v.x.mul_add(c, q.v.y * s), q.v.y.mul_add(c, -(q.v.x * s)), q.v.z.mul_add(c, q.w * s));
    Quat { w: q.w.mul_add(c, -(q.v.z * s)), v }
}

/// Positions, inertias and momentum columns of the chain, and the twists that the momenta imply.
#[inline(always)]
pub fn kinematics<R: Real, const N: usize>(m: &Plant, masses: Masses<R>, s: &Bodies<R, N>) -> Kinematics<R, N> {
    let mut k = crate::fields::filled(R::lit(0.0));
    update_kinematics(m, masses, s, &mut k);
    k
}

/// [`kinematics`] in place: a copy of it in lanes costs as much as a tenth of a step.
#[inline(always)]
pub fn update_kinematics<R: Real, const N: usize>(
    m: &Plant,
    masses: Masses<R>,
    s: &Bodies<R, N>,
    k: &mut Kinematics<R, N>,
) {
    let (axes, rate) = (s.chaser.attitude.matrix(), s.arm.rate);
    let tool = chain(m, s.chaser.attitude, axes, s.arm.angle, &mut k.links);
    k.mass = masses.base_mass + R::lit(m.arm_mass);

    // Centre of mass from the base's own.
    let mut offset = Vec3::zero();
    for i in 0..N {
        offset = k.links[i].com.scale_add(R::lit(m.links[i].mass), offset);
    }
    k.base_com = -(offset * (R::lit(1.0) / k.mass));

    k.base_inertia = Sym3::<R>::lit(m.base_inertia).map(|e| e * masses.base_inertia_scale).rotated(axes);
    let arm_inertia = fill_columns(m, &mut k.links, k.base_com);
    let inertia = arm_inertia + k.base_inertia + Sym3::point_mass(masses.base_mass, k.base_com);
    k.inverse_inertia = inertia.inverse();
    (k.omega, k.velocity) = base_twist(k.inverse_inertia, k.mass, s.chaser.spin, &k.links, rate);

    k.parts.a = tool_motion(&tool, k.base_com, &k.links, rate, k.omega, k.velocity, &s.chaser, k.mass);
    k.target_inverse_inertia = body_inverse_inertia(m, masses, s.target.attitude);
    k.parts.b = seat_motion(m, masses, &s.target, k.target_inverse_inertia);
}

/// Moves the links to O as origin and fills in their momentum columns, from composite inertias from the tip inwards;
/// gives the arm's inertia about O.
#[inline(always)]
fn fill_columns<R: Real, const N: usize>(m: &Plant, links: &mut [LinkState<R>; N], base_com: Vec3<R>) -> Sym3<R> {
    let mut inertia = Sym3::splat(R::lit(0.0));
    let (mut first_moment, mut mass) = (Vec3::zero(), 0.0);
    for i in (0..N).rev() {
        let link = &mut links[i];
        link.origin = link.origin + base_com;
        link.com = link.com + base_com;
        let link_mass = R::lit(m.links[i].mass);
        mass += m.links[i].mass;
        first_moment = link.com.scale_add(link_mass, first_moment);
        inertia = inertia + link.inertia + Sym3::point_mass(link_mass, link.com);
        // A unit rate moves the outboard body with twist (axis, origin x axis) at O.
        let slide = link.origin.cross(link.axis);
        link.column = inertia.times(link.axis) + first_moment.cross(slide);
        link.drift = slide.scale_add(R::lit(mass), link.axis.cross(first_moment));
    }
    inertia
}

/// Base twist at O from the angular momentum and the joint rates, in the frame in which O rests.
#[inline(always)]
fn base_twist<R: Real, const N: usize>(
    inverse_inertia: Sym3<R>,
    mass: R,
    spin: Vec3<R>,
    links: &[LinkState<R>; N],
    rate: [R; N],
) -> (Vec3<R>, Vec3<R>) {
    let (mut rest, mut drift) = (spin, Vec3::zero());
    for i in 0..N {
        rest = links[i].column.scale_add(-rate[i], rest);
        drift = links[i].drift.scale_add(rate[i], drift);
    }
    (inverse_inertia.times(rest), drift * (R::lit(-1.0) / mass))
}

/// Motion of part A: the last link's twist at the tool.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the pieces of a kinematics under construction")]
fn tool_motion<R: Real, const N: usize>(
    tool: &Pose<R>,
    base_com: Vec3<R>,
    links: &[LinkState<R>; N],
    rate: [R; N],
    omega: Vec3<R>,
    velocity: Vec3<R>,
    chaser: &Body<R>,
    mass: R,
) -> Motion<R> {
    let (mut omega, mut velocity) = (omega, velocity);
    for i in 0..N {
        omega = links[i].axis.scale_add(rate[i], omega);
        velocity = links[i].origin.cross(links[i].axis).scale_add(rate[i], velocity);
    }
    let from_com = tool.position + base_com;
    Motion {
        position: chaser.com + (chaser.com_step + from_com),
        attitude: tool.attitude,
        velocity: chaser.momentum.scale_add(R::lit(1.0) / mass, velocity + omega.cross(from_com)),
        omega,
    }
}

/// Inverse inertia of the target in inertial axes.
#[inline(always)]
fn body_inverse_inertia<R: Real>(m: &Plant, masses: Masses<R>, attitude: Quat<R>) -> Sym3<R> {
    let inverse = Sym3::<R>::lit(m.target_inverse_inertia);
    let scale = R::lit(1.0) / masses.target_inertia_scale;
    inverse.map(|e| e * scale).rotated(attitude.matrix())
}

/// Motion of part B: the target's twist at its seat.
#[inline(always)]
fn seat_motion<R: Real>(m: &Plant, masses: Masses<R>, target: &Body<R>, inverse_inertia: Sym3<R>) -> Motion<R> {
    let lever = target.attitude.rotate(Vec3::lit(m.seat.position));
    let omega = inverse_inertia.times(target.spin);
    Motion {
        position: target.com + (target.com_step + lever),
        attitude: target.attitude.compose(Quat::lit(m.seat.attitude)),
        velocity: target.momentum.scale_add(R::lit(1.0) / masses.target_mass, omega.cross(lever)),
        omega,
    }
}

/// One substep of all bodies under a wrench on part A at A's origin (its negative, at the same point, on the target).
#[inline(always)]
pub fn advance<R: Real, const N: usize>(
    m: &Plant,
    masses: Masses<R>,
    s: &Bodies<R, N>,
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
) -> Bodies<R, N> {
    let dt = R::lit(m.timing.substep);
    let point = k.parts.a.position - (s.chaser.com + s.chaser.com_step);
    let acceleration = joint_accelerations(m, masses.base_mass, s.arm.rate, k, u, w, point);
    let mut rate = s.arm.rate;
    for i in 0..N {
        rate[i] = acceleration[i].mul_add(dt, rate[i]);
    }

    let field = gravity(m, s.chaser.com, s.chaser.momentum * (R::lit(1.0) / k.mass)) + Vec3::lit(m.field);
    let push = field.scale_add(k.mass, u.thrust);
    let moment = k.base_com.cross(u.thrust) + u.torque;
    let mut chaser = s.chaser;
    chaser.momentum = (w.force + push).scale_add(dt, chaser.momentum);
    chaser.spin = (w.moment + point.cross(w.force) + moment).scale_add(dt, chaser.spin);
    chaser.com_step = chaser.momentum.scale_add(dt / k.mass, chaser.com_step);
    let (omega, _) = base_twist(k.inverse_inertia, k.mass, chaser.spin, &k.links, rate);
    // What the last step's rate became by the change of configuration alone, half of it again: a midpoint.
    let centred = (k.omega - s.arm.turn).scale_add(R::lit(0.5), omega);
    chaser.attitude = turn(centred, dt).compose(chaser.attitude).normalized();
    let mut angle = s.arm.angle;
    for i in 0..N {
        angle[i] = rate[i].mul_add(dt, angle[i]);
    }

    let centre = s.chaser.com + s.chaser.com_step;
    let (target, target_push) = advance_target(m, masses, &s.target, k, w);
    let target_centre = s.target.com + s.target.com_step;
    Bodies {
        chaser,
        arm: Arm { angle, rate, turn: omega },
        target,
        impulse: (push + target_push).scale_add(dt, s.impulse),
        moment_impulse: (moment + centre.cross(push) + target_centre.cross(target_push))
            .scale_add(dt, s.moment_impulse),
    }
}

/// One substep of the target; also gives the force of gravity on it.
#[inline(always)]
fn advance_target<R: Real, const N: usize>(
    m: &Plant,
    masses: Masses<R>,
    target: &Body<R>,
    k: &Kinematics<R, N>,
    w: Wrench<R>,
) -> (Body<R>, Vec3<R>) {
    let dt = R::lit(m.timing.substep);
    let lever = k.parts.a.position - (target.com + target.com_step);
    let inverse_mass = R::lit(1.0) / masses.target_mass;
    let push = gravity(m, target.com, target.momentum * inverse_mass) * masses.target_mass;
    let mut next = *target;
    next.momentum = (push - w.force).scale_add(dt, target.momentum);
    next.spin = (w.moment + lever.cross(w.force)).scale_add(-dt, target.spin);
    next.com_step = next.momentum.scale_add(dt * inverse_mass, target.com_step);
    // Midpoint rule: the rate at the half-turned attitude turns the whole step.
    let half = turn(k.target_inverse_inertia.times(next.spin), dt * R::lit(0.5)).compose(target.attitude);
    let omega = body_inverse_inertia(m, masses, half).times(next.spin);
    next.attitude = turn(omega, dt).compose(target.attitude).normalized();
    (next, push)
}

/// The rotation by an inertial rate over a time.
#[inline(always)]
fn turn<R: Real>(omega: Vec3<R>, time: R) -> Quat<R> {
    Quat::from_rotation_vector(omega * time)
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
    for body in [&mut s.chaser, &mut s.target] {
        body.com = body.com + body.com_step;
        body.com_step = Vec3::zero();
    }
    s
}
