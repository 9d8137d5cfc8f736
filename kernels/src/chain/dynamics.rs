//! Dynamics of the chain on its free base: composite body, inertial forces, and the articulated-body algorithm.
//!
//! Every link in its own axes about its own origin, accelerations as an accelerometer there would have them. Luh,
//! Walker and Paul (1980) outwards; Featherstone, Rigid Body Dynamics Algorithms (2008), sections 7.2 and 9.4 inwards.

use super::inertia::{Articulated, Force, Rigid};
use super::{Chain, ChainLink, Turn};
use crate::bundle;
use crate::real::Real;
use crate::vector::{Mat3, Sym3, Vec3, vec3};

/// Rate and acceleration of a link's axes, in these axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course<R> {
    pub(crate) rate: Vec3<R>,
    pub(crate) turning: Vec3<R>,
    pub(crate) acceleration: Vec3<R>,
}

/// The arm frozen into one body, and what its joint rates add to that body's momentum; base axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Composite<R> {
    pub(crate) body: Rigid<R>,
    pub(crate) momentum: Force<R>,
}

bundle! {
    /// Motion of part A as the base sees it, the base's chain axes.
    Reach {
        position: Vec3<R>, "m", "origin of part A from the base's centre of mass";
        velocity: Vec3<R>, "m/s", "velocity due to the joints";
        omega: Vec3<R>, "rad/s", "angular velocity due to the joints";
    }
}

/// What torques and wrenches make of the chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response<R, const N: usize> {
    /// Joint accelerations.
    pub(crate) joint: [R; N],
    /// Angular acceleration of the base.
    pub(crate) turning: Vec3<R>,
    /// Inertial force of the whole while no rate changes, about the base's centre of mass.
    pub(crate) drift: Force<R>,
}

/// The configuration: joint turns, and the base's mass and factor on its nominal inertia.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posture<'a, R, const N: usize> {
    pub(crate) chain: &'a Chain,
    pub(crate) turns: &'a [Turn<R>; N],
    pub(crate) base_mass: R,
    pub(crate) base_inertia_scale: R,
}

impl<R: Real> Course<R> {
    /// The matrix that gives the acceleration of a point from its place: `[turning] + [rate]^2`.
    #[inline(always)]
    pub(super) fn field(&self) -> Mat3<R> {
        let (w, a) = (self.rate, self.turning);
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
        Mat3 {
            x: vec3(-(yy + zz), xy + a.z, xz - a.y),
            y: vec3(xy - a.z, -(xx + zz), yz + a.x),
            z: vec3(xz + a.y, yz - a.x, -(xx + yy)),
        }
    }

    /// Of the next link, whose joint moves at `rate` and gains `gain`.
    #[inline(always)]
    fn outwards(&self, field: &Mat3<R>, link: &ChainLink, turn: Turn<R>, rate: R, gain: R) -> Self {
        if link.slides {
            return self.slid(field, link, turn, rate, gain);
        }
        let inner = link.outwards(turn, self.rate);
        let turning = link.outwards(turn, self.turning);
        Self {
            rate: vec3(inner.x, inner.y, inner.z + rate),
            turning: vec3(inner.y.mul_add(rate, turning.x), inner.x.mul_add(-rate, turning.y), turning.z + gain),
            acceleration: link.outwards(turn, field.times_onto(link.origin, self.acceleration)),
        }
    }
}

impl<R: Real> Course<R> {
    /// Of the next link, whose joint slides at `rate` and gains `gain`.
    #[inline(always)]
    fn slid(&self, field: &Mat3<R>, link: &ChainLink, turn: Turn<R>, rate: R, gain: R) -> Self {
        let acceleration = link.outwards(turn, field.times_onto(link.origin, self.acceleration));
        let still =
            Self { rate: link.outwards(turn, self.rate), turning: link.outwards(turn, self.turning), acceleration };
        // What the travel adds in these axes, and Coriolis' acceleration.
        let along = still.field().z.scale_add(link.travel(turn), acceleration);
        let (w, twice) = (still.rate, rate + rate);
        let acceleration = vec3(w.y.mul_add(twice, along.x), w.x.mul_add(-twice, along.y), along.z + gain);
        Self { acceleration, ..still }
    }
}

/// Moment of the inertial forces about the centre of mass: what is skew in `field * moments`.
#[inline(always)]
pub(super) fn turning_moment<R: Real>(field: &Mat3<R>, moments: Sym3<f64>) -> Vec3<R> {
    let (Mat3 { x, y, z }, Sym3 { xx, yy, zz, xy, xz, yz }) = (*field, Sym3::<R>::lit(moments));
    let mut skew = vec3(y.z.mul_add(yy, z.y * -zz), z.x.mul_add(zz, x.z * -xx), x.y.mul_add(xx, y.x * -yy));
    if moments.xy != 0.0 {
        skew = vec3(x.z, -y.z, y.y - x.x).scale_add(xy, skew);
    }
    if moments.xz != 0.0 {
        skew = vec3(-x.y, x.x - z.z, z.y).scale_add(xz, skew);
    }
    if moments.yz != 0.0 {
        skew = vec3(z.z - y.y, y.x, -z.x).scale_add(yz, skew);
    }
    skew
}

/// Inertial force of a link, about its origin.
#[inline(always)]
fn inertial_force<R: Real>(course: &Course<R>, field: &Mat3<R>, link: &ChainLink) -> Force<R> {
    let force = field.times_onto(link.com, course.acceleration) * R::lit(link.mass);
    Force { moment: link.com.cross_onto(force, turning_moment(field, link.moments)), force }
}

impl<R: Real, const N: usize> Posture<'_, R, N> {
    /// The arm as one body, and the momentum of its joint rates.
    #[inline(always)]
    pub(crate) fn composite(&self, rate: &[R; N]) -> Composite<R> {
        let (mut body, mut momentum, mut mass) = (Rigid::<R>::zero(), Force::<R>::zero(), 0.0);
        for i in (0..N).rev() {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            body = body.plus_link(link);
            mass += link.mass;
            let (first, inertia) = (body.first, body.inertia);
            let own = if link.slides {
                let (m, f) = (momentum.moment, momentum.force);
                Force {
                    moment: vec3(first.y.mul_add(rate[i], m.x), first.x.mul_add(-rate[i], m.y), m.z),
                    force: vec3(f.x, f.y, R::lit(mass).mul_add(rate[i], f.z)),
                }
            } else {
                Force {
                    moment: vec3(inertia.xz, inertia.yz, inertia.zz).scale_add(rate[i], momentum.moment),
                    force: vec3(
                        first.y.mul_add(-rate[i], momentum.force.x),
                        first.x.mul_add(rate[i], momentum.force.y),
                        momentum.force.z,
                    ),
                }
            };
            momentum = own.inwards(link, turn);
            body = body.inwards(link, turn, mass);
        }
        Composite { body, momentum }
    }

    /// Where the tool is and how the joints move it.
    #[inline(always)]
    pub(crate) fn reach(&self, rate: &[R; N]) -> Reach<R> {
        let none = Vec3::<R>::zero();
        let mut reach = Reach { position: Vec3::lit(self.chain.tool.position), velocity: none, omega: none };
        for i in (0..N).rev() {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            let (p, v, w) = (reach.position, reach.velocity, reach.omega);
            if link.slides {
                let position = vec3(p.x, p.y, p.z + link.travel(turn));
                reach = Reach {
                    position: link.inwards(turn, position) + Vec3::lit(link.origin),
                    velocity: link.inwards(turn, vec3(v.x, v.y, v.z + rate[i])),
                    omega: link.inwards(turn, w),
                };
                continue;
            }
            let velocity = vec3(p.y.mul_add(-rate[i], v.x), p.x.mul_add(rate[i], v.y), v.z);
            reach = Reach {
                position: link.inwards(turn, p) + Vec3::lit(link.origin),
                velocity: link.inwards(turn, velocity),
                omega: link.inwards(turn, vec3(w.x, w.y, w.z + rate[i])),
            };
        }
        reach
    }

    /// Inertial force of the base, about its origin.
    #[inline(always)]
    pub(crate) fn base_force(&self, base: Course<R>) -> Force<R> {
        let moment = turning_moment(&base.field(), self.chain.base_moments) * self.base_inertia_scale;
        Force { moment, force: base.acceleration * self.base_mass }
    }

    /// Inertial forces of the links, each about its own origin, into `forces`; gives how the last link moves.
    ///
    /// In place, as a copy of what it would return takes lanes as long as a link.
    #[inline(always)]
    pub(crate) fn link_forces(
        &self,
        base: Course<R>,
        rate: &[R; N],
        gain: &[R; N],
        forces: &mut [Force<R>; N],
    ) -> Course<R> {
        let (mut course, mut field) = (base, base.field());
        for i in 0..N {
            let link = &self.chain.links[i];
            course = course.outwards(&field, link, self.turns[i], rate[i], gain[i]);
            field = course.field();
            forces[i] = inertial_force(&course, &field, link);
        }
        course
    }

    /// Moments about the joints of what their links pass on inwards (forces along those that slide), and the base's share.
    #[inline(always)]
    pub(crate) fn passed(&self, forces: &[Force<R>; N], tip: Force<R>) -> ([R; N], Force<R>) {
        let (mut sum, mut joint) = (tip, [R::lit(0.0); N]);
        for i in (0..N).rev() {
            sum = sum.plus(forces[i]);
            joint[i] = if self.chain.links[i].slides { sum.force.z } else { sum.moment.z };
            sum = sum.inwards(&self.chain.links[i], self.turns[i]);
        }
        (joint, sum)
    }

    /// Articulated-body algorithm: joint torques, a wrench `tip` on the last link about its origin in its axes, and
    /// `push` on the base about its centre of mass, while the base turns at `omega`.
    #[inline(always)]
    pub(crate) fn response(
        &self,
        omega: Vec3<R>,
        rate: &[R; N],
        torque: &[R; N],
        tip: Force<R>,
        push: Force<R>,
    ) -> Response<R, N> {
        let zero = R::lit(0.0);
        let still = Course { rate: omega, turning: Vec3::zero(), acceleration: Vec3::zero() };
        let (own, mut links) = (self.base_force(still), [Force::zero(); N]);
        self.link_forces(still, rate, &[zero; N], &mut links);
        let drift = own.plus(self.passed(&links, Force::zero()).1);

        let (mut body, mut load) = (Articulated::zero(), Force { moment: -tip.moment, force: -tip.force });
        let mut joint = [zero; N];
        for i in (0..N).rev() {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            body = body.plus_link(link);
            load = load.plus(links[i]);
            if link.slides {
                let resistance = body.resistance(link);
                let inverse = R::lit(-1.0) / resistance.force.z;
                let give = Force { moment: resistance.moment * inverse, force: resistance.force * inverse };
                let excess = load.force.z - torque[i];
                joint[i] = excess * inverse;
                let left = Force {
                    moment: give.moment.scale_add(excess, load.moment),
                    force: give.force.scale_add(excess, load.force),
                };
                load = left.inwards(link, turn);
                body = body.inwards_geared(give, link, turn);
                links[i] = give;
                continue;
            }
            let resistance = body.about_z();
            let inverse = R::lit(-1.0) / resistance.moment.z;
            let give = Force { moment: resistance.moment * inverse, force: resistance.force * inverse };
            let excess = load.moment.z - torque[i];
            joint[i] = excess * inverse;
            let moment = give.moment.scale_add(excess, load.moment);
            // The joint accelerates until it transmits its own torque alone.
            let left =
                Force { moment: vec3(moment.x, moment.y, torque[i]), force: give.force.scale_add(excess, load.force) };
            load = left.inwards(link, turn);
            body = body.inwards(give, link, turn);
            // The force has been passed on; on the way outwards it is this that is asked for.
            links[i] = give;
        }
        let rest = Force { moment: push.moment - own.moment - load.moment, force: push.force - load.force };
        let (turning, acceleration) = self.on_base(body).solve(rest);
        let joint = self.outwards(turning, acceleration, &links, joint);
        Response { joint, turning, drift }
    }

    /// Inertia of the base about its centre of mass.
    #[inline(always)]
    pub(crate) fn base_inertia(&self) -> Sym3<R> {
        Sym3::<R>::lit(self.chain.base_inertia).map(|e| e * self.base_inertia_scale)
    }

    /// The articulated inertia with the base's own.
    #[inline(always)]
    pub(super) fn on_base(&self, arm: Articulated<R>) -> Articulated<R> {
        let mass = Sym3::diagonal(Vec3::splat(self.base_mass));
        Articulated { rotation: arm.rotation + self.base_inertia(), translation: arm.translation + mass, ..arm }
    }

    /// Joint accelerations on a base that accelerates, from those on a base that does not.
    #[inline(always)]
    fn outwards(&self, turning: Vec3<R>, acceleration: Vec3<R>, give: &[Force<R>; N], mut joint: [R; N]) -> [R; N] {
        let (mut turning, mut acceleration) = (turning, acceleration);
        for i in 0..N {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            let moved = (-link.origin).cross_onto(turning, acceleration);
            (turning, acceleration) = (link.outwards(turn, turning), link.outwards(turn, moved));
            let Force { moment, force } = give[i];
            if link.slides {
                acceleration = slid(turning, acceleration, link.travel(turn));
                joint[i] = joint[i] + moment.dot(turning) + force.dot(acceleration);
                acceleration.z = acceleration.z + joint[i];
                continue;
            }
            let along = moment.x.mul_add(turning.x, moment.y.mul_add(turning.y, force.dot(acceleration)));
            joint[i] = joint[i] + (along - turning.z);
            turning.z = turning.z + joint[i];
        }
        joint
    }
}

/// Acceleration of a point that is so far ahead on the z axis.
#[inline(always)]
pub(super) fn slid<R: Real>(turning: Vec3<R>, acceleration: Vec3<R>, travel: R) -> Vec3<R> {
    let (w, a) = (turning, acceleration);
    vec3(w.y.mul_add(travel, a.x), w.x.mul_add(-travel, a.y), a.z)
}

impl<R: Real> Articulated<R> {
    /// Angular and linear acceleration that a force causes, by `L D L^T`.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "a triangle is walked by row and column")]
    pub(super) fn solve(&self, f: Force<R>) -> (Vec3<R>, Vec3<R>) {
        let (m, c, j, zero) = (self.translation, self.coupling, self.rotation, R::lit(0.0));
        // The lower triangle, translation first; each row ends with the right-hand side.
        let mut rows = [
            [m.xx, zero, zero, zero, zero, zero, f.force.x],
            [m.xy, m.yy, zero, zero, zero, zero, f.force.y],
            [m.xz, m.yz, m.zz, zero, zero, zero, f.force.z],
            [c.x.x, c.x.y, c.x.z, j.xx, zero, zero, f.moment.x],
            [c.y.x, c.y.y, c.y.z, j.xy, j.yy, zero, f.moment.y],
            [c.z.x, c.z.y, c.z.z, j.xz, j.yz, j.zz, f.moment.z],
        ];
        let mut inverse = [zero; 6];
        for column in 0..6 {
            inverse[column] = R::lit(1.0) / rows[column][column];
            for row in column + 1..6 {
                let factor = rows[row][column] * -inverse[column];
                for k in column + 1..=row {
                    rows[row][k] = factor.mul_add(rows[k][column], rows[row][k]);
                }
                rows[row][6] = factor.mul_add(rows[column][6], rows[row][6]);
            }
        }
        let mut x = [zero; 6];
        for column in (0..6).rev() {
            let mut sum = rows[column][6];
            for row in column + 1..6 {
                sum = rows[row][column].mul_add(-x[row], sum);
            }
            x[column] = sum * inverse[column];
        }
        (vec3(x[3], x[4], x[5]), vec3(x[0], x[1], x[2]))
    }
}
