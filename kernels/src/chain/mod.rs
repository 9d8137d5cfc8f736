//! The arm as a chain of links, each in axes of its own joint: constants that are found once, when a plant is made.
//!
//! Link axes: z along the link's own joint, x across it and the next one. Neighbours then differ by a shift, a turn
//! about x by a constant angle and a turn about z by the joint's: the cheapest transforms there are, and most
//! constants of usual arms are exactly 0 or 1, which branches on the model make use of: lanes would multiply by them,
//! and the tracer's constants choose the branch. McMillan and Orin, IEEE Trans. Robotics and Automation 11 (1995) 841;
//! unlike Denavit-Hartenberg frames, origins stay at the joints, so that nearly parallel axes do no harm.
//!
//! A joint turns about its z axis or slides along it; which one is a constant of the link, and a chain whose joints all
//! turn has the terms of turns alone. A joint that slides keeps its constant turn; its travel has the place of the turn
//! in arrays of [`Turn`], see `ChainLink::travel`.

pub(crate) mod driven;
pub(crate) mod dynamics;
pub(crate) mod inertia;
#[cfg(test)]
mod tests;

use crate::bundle;
use crate::real::Real;
use crate::vector::{Mat3, Pose, Quat, Sym3, Vec3, vec3};

/// One arm link with the joint at its origin; the joint turns about the link's z axis, or slides along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Pose of the link frame in the parent's frame at joint angle 0, or travel 0.
    pub origin: Pose<f64>,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the link frame \[m\].
    pub com: Vec3<f64>,
    /// Inertia about the centre of mass, link axes \[kg m^2\].
    pub inertia: Sym3<f64>,
}

/// Below this a cosine, a sine or a length of the order of a metre is rounding.
pub(crate) const ROUNDING: f64 = 1e-14;

/// The arm's constants; link 0 of the text is the base, whose axes are chosen to suit the first joint.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Links from the base outwards.
    pub links: Vec<ChainLink>,
    /// Rotation from the base's chain axes to its body axes; the origin is the base's centre of mass.
    pub root: Quat<f64>,
    /// Nominal inertia of the base about its centre of mass, chain axes \[kg m^2\].
    pub base_inertia: Sym3<f64>,
    /// The same as second moments: the integral of `r r^T` \[kg m^2\].
    pub base_moments: Sym3<f64>,
    /// Pose of part A in the last link's axes.
    pub tool: Pose<f64>,
    /// The rotation of `tool` as a matrix.
    pub tool_axes: Mat3<f64>,
    /// Mass of all links \[kg\].
    pub mass: f64,
}

/// One link.
#[derive(Clone, Copy, Debug)]
pub struct ChainLink {
    /// The joint slides along z, it does not turn.
    pub slides: bool,
    /// Origin in the inner link's axes, of a joint that slides at the start posture \[m\].
    pub origin: Vec3<f64>,
    /// Turn about the inner link's x axis, from its z axis to this one's.
    pub tilt: Turn<f64>,
    /// The same turn by half its angle.
    pub half_tilt: Turn<f64>,
    /// Angle about z at the start posture, from the inner link's x axis to this one's \[rad\].
    pub start_angle: f64,
    /// The turn by that angle.
    pub start_turn: Turn<f64>,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass, own axes \[m\].
    pub com: Vec3<f64>,
    /// Second moments of mass about the centre of mass, own axes: the integral of `r r^T` \[kg m^2\].
    pub moments: Sym3<f64>,
    /// Inertia about the origin, own axes \[kg m^2\].
    pub inertia: Sym3<f64>,
}

bundle! {
    /// A turn about a coordinate axis.
    Turn {
        cos: R, "1", "cosine";
        sin: R, "1", "sine";
    }
}

impl Chain {
    /// The chain of links; `start` has each one's pose in its parent at the start posture, `tool` is part A's pose in
    /// the last link's frame, `base_inertia` about the base's origin. All joints turn.
    pub(crate) fn new(links: &[Link], start: &[Pose<f64>], tool: Pose<f64>, base_inertia: Sym3<f64>) -> Self {
        let mut poses = vec![Pose::identity()];
        for pose in start {
            poses.push(poses[poses.len() - 1].compose(*pose));
        }
        let axes = chain_axes(&poses);
        let links: Vec<_> = (1..poses.len()).map(|i| ChainLink::new(&links[i - 1], i, &poses, &axes)).collect();
        let root = quaternion(axes[0]);
        let last = links.iter().fold(root, |inner, link| link.turned(inner, Turn::of_angle(0.5 * link.start_angle)));
        let (end, end_axes) = (poses[poses.len() - 1].compose(tool), axes[axes.len() - 1]);
        let attitude = last.conjugate().compose(end.attitude);
        let arm = end.position - poses[poses.len() - 1].position;
        let tool = Pose {
            position: end_axes.transposed_times(arm).map(clean),
            attitude: Quat { w: clean(attitude.w), v: attitude.v.map(clean) },
        };
        let matrix = attitude.matrix();
        let tool_axes = Mat3 { x: matrix.x.map(clean), y: matrix.y.map(clean), z: matrix.z.map(clean) };
        let base_inertia = without_rounding(base_inertia.rotated(axes[0].transposed()));
        let mass = links.iter().map(|link| link.mass).sum();
        Self { links, root, base_inertia, base_moments: second_moments(base_inertia), tool, tool_axes, mass }
    }
}

/// Axes of the base and of every link at the start posture, in the base's body axes.
fn chain_axes(poses: &[Pose<f64>]) -> Vec<Mat3<f64>> {
    let own: Vec<_> = poses.iter().map(|pose| pose.attitude.matrix()).collect();
    if own.len() == 1 {
        return own;
    }
    let last = own.len() - 1;
    let mut axes = vec![own[0]; own.len()];
    let mut inner = own[1].x;
    for i in 1..=last {
        let z = own[i].z;
        let normal = if i < last { z.cross(own[i + 1].z) } else { own[i].x };
        // Of parallel axes any normal will do; the inner link's spares an angle.
        let x = if normal.norm() < 1e-15 { inner } else { normal };
        let x = z.scale_add(-x.dot(z) / z.dot(z), x);
        let x = x * (1.0 / x.norm());
        axes[i] = Mat3 { x, y: z.cross(x), z };
        inner = x;
    }
    axes[0] = axes[1];
    axes
}

impl ChainLink {
    /// Of the link that is number `i` counted from the base.
    fn new(link: &Link, i: usize, poses: &[Pose<f64>], axes: &[Mat3<f64>]) -> Self {
        let (inner, own) = (axes[i - 1], axes[i]);
        // From the model's link axes to those of the chain.
        let rotation = own.transposed().compose(poses[i].attitude.matrix());
        let com = rotation.times(link.com).map(clean);
        let central = without_rounding(link.inertia.rotated(rotation));
        let tilt = inner.z.cross(own.z).dot(inner.x).atan2(inner.z.dot(own.z));
        let start_angle = inner.x.cross(own.x).dot(own.z).atan2(inner.x.dot(own.x));
        Self {
            slides: false,
            origin: inner.transposed_times(poses[i].position - poses[i - 1].position).map(clean),
            tilt: Turn::of_angle(tilt),
            half_tilt: Turn::of_angle(0.5 * tilt),
            start_angle: clean(start_angle),
            start_turn: Turn::of_angle(start_angle),
            mass: link.mass,
            com,
            moments: second_moments(central),
            inertia: central + Sym3::point_mass(link.mass, com),
        }
    }

    /// The attitude of this link from the inner link's and half the turn about z.
    #[inline(always)]
    pub(crate) fn turned<R: Real>(&self, inner: Quat<R>, half: Turn<R>) -> Quat<R> {
        about_z(about_x(inner, Turn::lit(self.half_tilt)), half)
    }

    /// What an array of turns has for a joint that slides by a travel \[m\].
    #[inline(always)]
    pub(crate) fn slid<R: Real>(travel: R) -> Turn<R> {
        Turn { cos: R::lit(1.0), sin: travel }
    }

    /// Travel of a joint that slides from the start posture \[m\]; `joint` is its place in an array of turns.
    #[inline(always)]
    pub(crate) fn travel<R: Real>(&self, joint: Turn<R>) -> R {
        joint.sin
    }

    /// The turn about z of a joint, which one that slides does not change; `joint` is its place in an array of turns.
    #[inline(always)]
    pub(crate) fn turn<R: Real>(&self, joint: Turn<R>) -> Turn<R> {
        if self.slides { Turn::lit(self.start_turn) } else { joint }
    }

    /// A vector of this link's axes in the inner link's.
    #[inline(always)]
    pub(crate) fn inwards<R: Real>(&self, turn: Turn<R>, v: Vec3<R>) -> Vec3<R> {
        let turn = self.turn(turn);
        self.tilt.about_x(turn.about_z(v))
    }

    /// A vector of the inner link's axes in this link's.
    #[inline(always)]
    pub(crate) fn outwards<R: Real>(&self, turn: Turn<R>, v: Vec3<R>) -> Vec3<R> {
        let (v, turn) = (self.tilt.back().about_x(v), self.turn(turn));
        vec3(v.x.mul_add(turn.cos, v.y * turn.sin), v.y.mul_add(turn.cos, v.x * -turn.sin), v.z)
    }
}

impl Turn<f64> {
    /// The turn by an angle \[rad\], with exact quarters.
    pub(crate) fn of_angle(angle: f64) -> Self {
        let (sin, cos) = (clean(angle.sin()), clean(angle.cos()));
        // Exactly 0 and 1, or the axes would not stay square.
        let one = |value: f64, other: f64| if other == 0.0 { value.signum() } else { value };
        Self { cos: one(cos, sin), sin: one(sin, cos) }
    }

    /// Whether it is a quarter turn: such a one only changes places and signs.
    #[inline(always)]
    pub(crate) fn is_quarter(self) -> bool {
        self.cos == 0.0
    }

    /// Whether nothing turns.
    #[inline(always)]
    pub(crate) fn is_none(self) -> bool {
        self.sin == 0.0 && self.cos > 0.0
    }

    /// The turn that undoes it.
    #[inline(always)]
    fn back(self) -> Self {
        Self { cos: self.cos, sin: -self.sin }
    }

    /// A vector turned about x.
    #[inline(always)]
    pub(crate) fn about_x<R: Real>(self, v: Vec3<R>) -> Vec3<R> {
        let Turn { cos, sin } = Turn::<R>::lit(self);
        if self.is_quarter() {
            vec3(v.x, v.z * -sin, v.y * sin)
        } else if self.is_none() {
            v
        } else {
            vec3(v.x, v.y.mul_add(cos, v.z * -sin), v.y.mul_add(sin, v.z * cos))
        }
    }
}

impl<R: Real> Turn<R> {
    /// A constant of the model as a turn of this scalar.
    #[inline(always)]
    pub(crate) fn lit(turn: Turn<f64>) -> Self {
        Self { cos: R::lit(turn.cos), sin: R::lit(turn.sin) }
    }

    /// Twice the turn.
    #[inline(always)]
    pub(crate) fn doubled(self) -> Self {
        let twice = self.sin + self.sin;
        Self { cos: twice.mul_add(-self.sin, R::lit(1.0)), sin: twice * self.cos }
    }

    /// The turn and another one about the same axis.
    #[inline(always)]
    pub(crate) fn and(self, o: Self) -> Self {
        let sin = self.sin.mul_add(o.cos, self.cos * o.sin);
        Self { cos: self.cos.mul_add(o.cos, self.sin * -o.sin), sin }
    }

    /// A vector turned about z.
    #[inline(always)]
    pub(crate) fn about_z(self, v: Vec3<R>) -> Vec3<R> {
        vec3(v.x.mul_add(self.cos, v.y * -self.sin), v.x.mul_add(self.sin, v.y * self.cos), v.z)
    }
}

/// A rotation followed by a turn about its own z axis, given by half its angle.
#[inline(always)]
fn about_z<R: Real>(q: Quat<R>, half: Turn<R>) -> Quat<R> {
    let (c, s) = (half.cos, half.sin);
    let v = vec3(q.v.x.mul_add(c, q.v.y * s), q.v.y.mul_add(c, q.v.x * -s), q.v.z.mul_add(c, q.w * s));
    Quat { w: q.w.mul_add(c, q.v.z * -s), v }
}

/// A rotation followed by a turn about its own x axis, given by half its angle.
#[inline(always)]
fn about_x<R: Real>(q: Quat<R>, half: Turn<R>) -> Quat<R> {
    let (c, s) = (half.cos, half.sin);
    let v = vec3(q.v.x.mul_add(c, q.w * s), q.v.y.mul_add(c, q.v.z * s), q.v.z.mul_add(c, q.v.y * -s));
    Quat { w: q.w.mul_add(c, q.v.x * -s), v }
}

/// An inertia whose products of inertia are zero where they are rounding.
fn without_rounding(inertia: Sym3<f64>) -> Sym3<f64> {
    let small = ROUNDING * (inertia.xx + inertia.yy + inertia.zz);
    inertia.map(|e| if e.abs() < small { 0.0 } else { e })
}

/// The integral of `r r^T` over a body whose inertia is the integral of `|r|^2 1 - r r^T`.
fn second_moments(inertia: Sym3<f64>) -> Sym3<f64> {
    let half = 0.5 * (inertia.xx + inertia.yy + inertia.zz);
    let Sym3 { xx, yy, zz, xy, xz, yz } = inertia;
    Sym3 { xx: half - xx, yy: half - yy, zz: half - zz, xy: -xy, xz: -xz, yz: -yz }
}

/// The unit quaternion of a rotation matrix, from its largest component.
fn quaternion(m: Mat3<f64>) -> Quat<f64> {
    let trace = m.x.x + m.y.y + m.z.z;
    let squares = [trace, m.x.x, m.y.y, m.z.z].map(|d| if d == trace { 1.0 + trace } else { 1.0 + 2.0 * d - trace });
    let products = [
        [squares[0], m.y.z - m.z.y, m.z.x - m.x.z, m.x.y - m.y.x],
        [m.y.z - m.z.y, squares[1], m.x.y + m.y.x, m.z.x + m.x.z],
        [m.z.x - m.x.z, m.x.y + m.y.x, squares[2], m.y.z + m.z.y],
        [m.x.y - m.y.x, m.z.x + m.x.z, m.y.z + m.z.y, squares[3]],
    ];
    let largest = (0..4).max_by(|a, b| squares[*a].total_cmp(&squares[*b])).expect("four components");
    let [w, x, y, z] = products[largest].map(|product| clean(0.5 * product / squares[largest].sqrt()));
    Quat { w, v: vec3(x, y, z) }
}

/// A number of the order of 1 without its rounding about zero.
pub(crate) fn clean(value: f64) -> f64 {
    if value.abs() < ROUNDING { 0.0 } else { value }
}
