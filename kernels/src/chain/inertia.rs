//! Rigid and articulated inertias of the chain, carried from joint to joint by axial turns and shifts.
//!
//! No closures here: in lanes the compiler need not inline them into the function that has the instruction set.

use super::{ChainLink, Turn};
use crate::real::Real;
use crate::vector::{Mat3, Sym3, Vec3, vec3};

/// A force or a momentum: linear part, and moment about the origin of its axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Force<R> {
    pub(crate) moment: Vec3<R>,
    pub(crate) force: Vec3<R>,
}

/// A rigid body without its mass: first moment and inertia about the origin of its axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rigid<R> {
    pub(crate) first: Vec3<R>,
    pub(crate) inertia: Sym3<R>,
}

/// Articulated inertia about the origin of its axes: moment = J w + C^T v, force = C w + M v.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Articulated<R> {
    pub(crate) rotation: Sym3<R>,
    pub(crate) coupling: Mat3<R>,
    pub(crate) translation: Sym3<R>,
}

/// What is left of an articulated inertia once a joint about z has given way: nothing resists a turn about z.
#[derive(Clone, Copy, Debug)]
struct Released<R> {
    xx: R,
    yy: R,
    xy: R,
    coupling: [Vec3<R>; 2],
    translation: Sym3<R>,
}

impl<R: Real> Force<R> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { moment: Vec3::zero(), force: Vec3::zero() }
    }

    #[inline(always)]
    pub(crate) fn plus(self, o: Self) -> Self {
        Self { moment: self.moment + o.moment, force: self.force + o.force }
    }

    /// On the inner link, in its axes about its origin.
    #[inline(always)]
    pub(crate) fn inwards(self, link: &ChainLink, turn: Turn<R>) -> Self {
        let force = link.inwards(turn, self.force);
        Self { moment: link.inwards(turn, self.moment) + Vec3::lit(link.origin).cross(force), force }
    }
}

impl<R: Real> Rigid<R> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { first: Vec3::zero(), inertia: Sym3::splat(R::lit(0.0)) }
    }

    #[inline(always)]
    pub(crate) fn plus_link(self, link: &ChainLink) -> Self {
        Self { first: self.first + Vec3::lit(link.com * link.mass), inertia: self.inertia + Sym3::lit(link.inertia) }
    }

    /// Seen from the inner link, in its axes about its origin; `mass` is that of the body.
    #[inline(always)]
    pub(crate) fn inwards(self, link: &ChainLink, turn: Turn<R>, mass: f64) -> Self {
        let r = link.origin;
        let first = link.inwards(turn, self.first);
        let inertia = tilted(turned(self.inertia, turn), Turn::lit(link.tilt));
        // Parallel axes, from the origin outside: m (|r|^2 1 - r r^T) + 2 (r.h) 1 - r h^T - h r^T.
        let inertia = inertia + Sym3::lit(Sym3::point_mass(mass, r));
        let r = Vec3::<R>::lit(r);
        let (x, y, z) = (r.x * first.x, r.y * first.y, r.z * first.z);
        let (xx, yy, zz) = (y + z, x + z, x + y);
        Self {
            first: first + Vec3::lit(link.origin * mass),
            inertia: Sym3 {
                xx: inertia.xx + (xx + xx),
                yy: inertia.yy + (yy + yy),
                zz: inertia.zz + (zz + zz),
                xy: first.x.mul_add(-r.y, first.y.mul_add(-r.x, inertia.xy)),
                xz: first.x.mul_add(-r.z, first.z.mul_add(-r.x, inertia.xz)),
                yz: first.y.mul_add(-r.z, first.z.mul_add(-r.y, inertia.yz)),
            },
        }
    }
}

impl<R: Real> Articulated<R> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let (zero, none) = (R::lit(0.0), Vec3::zero());
        let coupling = Mat3 { x: none, y: none, z: none };
        Self { rotation: Sym3::splat(zero), coupling, translation: Sym3::splat(zero) }
    }

    /// With a rigid link fixed to it.
    #[inline(always)]
    pub(crate) fn plus_link(self, link: &ChainLink) -> Self {
        self.plus_body(R::lit(link.mass), Vec3::lit(link.com * link.mass), Sym3::lit(link.inertia))
    }

    /// With a point mass fixed to it.
    #[inline(always)]
    pub(crate) fn plus_point(self, mass: R, place: Vec3<R>) -> Self {
        self.plus_body(mass, place * mass, Sym3::point_mass(mass, place))
    }

    /// With a body of the given mass, first moment and inertia about the origin fixed to it.
    #[inline(always)]
    fn plus_body(self, m: R, h: Vec3<R>, inertia: Sym3<R>) -> Self {
        let Mat3 { x, y, z } = self.coupling;
        Self {
            rotation: self.rotation + inertia,
            // Columns of the cross product matrix of -h.
            coupling: Mat3 {
                x: vec3(x.x, x.y - h.z, x.z + h.y),
                y: vec3(y.x + h.z, y.y, y.z - h.x),
                z: vec3(z.x - h.y, z.y + h.x, z.z),
            },
            translation: self.translation + Sym3::diagonal(Vec3::splat(m)),
        }
    }

    /// Resistance to a turn about z: the force that a unit acceleration about z takes.
    #[inline(always)]
    pub(crate) fn about_z(&self) -> Force<R> {
        Force { moment: vec3(self.rotation.xz, self.rotation.yz, self.rotation.zz), force: self.coupling.z }
    }

    /// Seen from the inner link behind a free joint; `give` is the resistance about z over minus its own moment.
    #[inline(always)]
    pub(crate) fn inwards(&self, give: Force<R>, link: &ChainLink, turn: Turn<R>) -> Self {
        self.released(give).turned(turn).tilted(link.tilt).shifted(link.origin)
    }

    #[inline(always)]
    fn released(&self, give: Force<R>) -> Released<R> {
        let (g, own) = (give.moment, self.about_z());
        Released {
            xx: g.x.mul_add(own.moment.x, self.rotation.xx),
            yy: g.y.mul_add(own.moment.y, self.rotation.yy),
            xy: g.x.mul_add(own.moment.y, self.rotation.xy),
            coupling: [own.force.scale_add(g.x, self.coupling.x), own.force.scale_add(g.y, self.coupling.y)],
            translation: self.translation.plus_outer(give.force, own.force),
        }
    }

    /// Seen from the inner link behind a joint that moves against a rotor; `give` is the resistance about z over minus its
    /// own moment and the rotor's.
    #[inline(always)]
    pub(crate) fn inwards_geared(&self, give: Force<R>, link: &ChainLink, turn: Turn<R>) -> Self {
        let own = self.about_z();
        let (c, g) = (self.coupling, give.moment);
        let coupling = Mat3 {
            x: own.force.scale_add(g.x, c.x),
            y: own.force.scale_add(g.y, c.y),
            z: own.force.scale_add(g.z, c.z),
        };
        let left = Self {
            rotation: self.rotation.plus_outer(g, own.moment),
            coupling,
            translation: self.translation.plus_outer(give.force, own.force),
        };
        left.turned(turn).tilted(link.tilt).shifted(link.origin)
    }

    /// In the axes from which these are turned about z.
    #[inline(always)]
    fn turned(self, turn: Turn<R>) -> Self {
        let Mat3 { x, y, z } = self.coupling;
        let [x, y] = turned_columns([x, y], turn);
        let coupling = Mat3 { x, y, z: turn.about_z(z) };
        Self { rotation: turned(self.rotation, turn), coupling, translation: turned(self.translation, turn) }
    }

    /// In the axes from which these are turned about x by a constant angle.
    #[inline(always)]
    fn tilted(self, tilt: Turn<f64>) -> Self {
        let tilt = Turn::<R>::lit(tilt);
        let Mat3 { x, y, z } = self.coupling;
        let (x, y, z) = (tilt.about_x(x), tilt.about_x(y), tilt.about_x(z));
        let coupling = Mat3 { x, y: y.scale_add(tilt.cos, z * -tilt.sin), z: y.scale_add(tilt.sin, z * tilt.cos) };
        Self { rotation: tilted(self.rotation, tilt), coupling, translation: tilted(self.translation, tilt) }
    }

    /// About the origin of the axes in which this one's origin is `r`.
    #[inline(always)]
    fn shifted(self, r: Vec3<f64>) -> Self {
        let r = Vec3::<R>::lit(r);
        let (c, m) = (self.coupling, self.translation);
        let (mx, my, mz) = (vec3(m.xx, m.xy, m.xz), vec3(m.xy, m.yy, m.yz), vec3(m.xz, m.yz, m.zz));
        let coupling = Mat3 {
            x: my.scale_add(-r.z, mz.scale_add(r.y, c.x)),
            y: mz.scale_add(-r.x, mx.scale_add(r.z, c.y)),
            z: mx.scale_add(-r.y, my.scale_add(r.x, c.z)),
        };
        // J + [r] C_old + ([r] C_new)^T.
        let both = Mat3 { x: c.x + coupling.x, y: c.y + coupling.y, z: c.z + coupling.z };
        let j = self.rotation;
        let rotation = Sym3 {
            xx: cross_x(r, both.x, j.xx),
            yy: cross_y(r, both.y, j.yy),
            zz: cross_z(r, both.z, j.zz),
            xy: cross_x(r, c.y, cross_y(r, coupling.x, j.xy)),
            xz: cross_x(r, c.z, cross_z(r, coupling.x, j.xz)),
            yz: cross_y(r, c.z, cross_z(r, coupling.y, j.yz)),
        };
        Self { rotation, coupling, translation: m }
    }
}

impl<R: Real> Released<R> {
    /// In the axes from which these are turned about z.
    #[inline(always)]
    fn turned(self, turn: Turn<R>) -> Self {
        let plane = turned(Sym3 { xx: self.xx, yy: self.yy, xy: self.xy, ..Sym3::splat(R::lit(0.0)) }, turn);
        let coupling = turned_columns(self.coupling, turn);
        let translation = turned(self.translation, turn);
        Self { xx: plane.xx, yy: plane.yy, xy: plane.xy, coupling, translation }
    }

    /// In the axes from which these are turned about x by a constant angle.
    #[inline(always)]
    fn tilted(self, tilt: Turn<f64>) -> Articulated<R> {
        let tilt = Turn::<R>::lit(tilt);
        let [x, y] = self.coupling;
        let (x, y) = (tilt.about_x(x), tilt.about_x(y));
        let (yy, yz) = (self.yy * tilt.cos, self.yy * tilt.sin);
        Articulated {
            rotation: Sym3 {
                xx: self.xx,
                yy: yy * tilt.cos,
                zz: yz * tilt.sin,
                xy: self.xy * tilt.cos,
                xz: self.xy * tilt.sin,
                yz: yz * tilt.cos,
            },
            coupling: Mat3 { x, y: y * tilt.cos, z: y * tilt.sin },
            translation: tilted(self.translation, tilt),
        }
    }
}

/// The x component of `r` x `v`, added to a number.
#[inline(always)]
fn cross_x<R: Real>(r: Vec3<R>, v: Vec3<R>, onto: R) -> R {
    v.y.mul_add(-r.z, v.z.mul_add(r.y, onto))
}

/// The y component of `r` x `v`, added to a number.
#[inline(always)]
fn cross_y<R: Real>(r: Vec3<R>, v: Vec3<R>, onto: R) -> R {
    v.z.mul_add(-r.x, v.x.mul_add(r.z, onto))
}

/// The z component of `r` x `v`, added to a number.
#[inline(always)]
fn cross_z<R: Real>(r: Vec3<R>, v: Vec3<R>, onto: R) -> R {
    v.x.mul_add(-r.y, v.y.mul_add(r.x, onto))
}

/// The x and y columns of a matrix in the axes from which its own are turned about z.
#[inline(always)]
fn turned_columns<R: Real>([x, y]: [Vec3<R>; 2], turn: Turn<R>) -> [Vec3<R>; 2] {
    let (ss, cs) = (turn.sin * turn.sin, turn.cos * turn.sin);
    let (difference, sum) = (x.x - y.y, x.y + y.x);
    let along = ss.mul_add(difference, cs * sum);
    let across = cs.mul_add(difference, -ss * sum);
    [
        vec3(x.x - along, x.y + across, x.z.mul_add(turn.cos, y.z * -turn.sin)),
        vec3(y.x + across, y.y + along, x.z.mul_add(turn.sin, y.z * turn.cos)),
    ]
}

/// A tensor in the axes from which its own are turned about z; written as its change, which costs least.
#[inline(always)]
fn turned<R: Real>(m: Sym3<R>, turn: Turn<R>) -> Sym3<R> {
    let (ss, cs) = (turn.sin * turn.sin, turn.cos * turn.sin);
    let (difference, twice) = (m.xx - m.yy, m.xy + m.xy);
    let along = ss.mul_add(difference, cs * twice);
    Sym3 {
        xx: m.xx - along,
        yy: m.yy + along,
        zz: m.zz,
        xy: cs.mul_add(difference, twice.mul_add(-ss, m.xy)),
        xz: m.xz.mul_add(turn.cos, m.yz * -turn.sin),
        yz: m.xz.mul_add(turn.sin, m.yz * turn.cos),
    }
}

/// A tensor in the axes from which its own are turned about x by a constant angle.
#[inline(always)]
fn tilted<R: Real>(m: Sym3<R>, tilt: Turn<R>) -> Sym3<R> {
    let (c, s) = (tilt.cos, tilt.sin);
    // Rows of R M.
    let (yy, yz) = (m.yy.mul_add(c, m.yz * -s), m.yz.mul_add(c, m.zz * -s));
    let (zy, zz) = (m.yy.mul_add(s, m.yz * c), m.yz.mul_add(s, m.zz * c));
    Sym3 {
        xx: m.xx,
        yy: yy.mul_add(c, yz * -s),
        zz: zy.mul_add(s, zz * c),
        xy: m.xy.mul_add(c, m.xz * -s),
        xz: m.xy.mul_add(s, m.xz * c),
        yz: yy.mul_add(s, yz * c),
    }
}
