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

    /// About a point that is so far behind on the z axis.
    #[inline(always)]
    fn slid(self, travel: R) -> Self {
        let (m, f) = (self.moment, self.force);
        Self { moment: vec3(f.y.mul_add(-travel, m.x), f.x.mul_add(travel, m.y), m.z), force: f }
    }

    /// On the inner link, in its axes about its origin.
    #[inline(always)]
    pub(crate) fn inwards(self, link: &ChainLink, turn: Turn<R>) -> Self {
        let own = if link.slides { self.slid(link.travel(turn)) } else { self };
        let force = link.inwards(turn, own.force);
        Self { moment: link.origin.cross_onto(force, link.inwards(turn, own.moment)), force }
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
        let own = if link.slides { self.slid(link.travel(turn), mass) } else { self };
        let first = link.inwards(turn, own.first);
        let inertia = tilted(turned(own.inertia, link.turn(turn)), link.tilt);
        let r = link.origin;
        let mut body = Self { first, inertia };
        for along in [r.x, r.y, r.z] {
            body = body.shifted_along_x(along, mass).cycled();
        }
        body
    }

    /// About a point that is so far behind on the z axis; parallel axes.
    #[inline(always)]
    fn slid(self, travel: R, mass: f64) -> Self {
        let (Vec3 { x, y, z }, inertia) = (self.first, self.inertia);
        let moved = travel * R::lit(mass);
        let across = (z + z + moved) * travel;
        Self {
            first: vec3(x, y, z + moved),
            inertia: Sym3 {
                xx: inertia.xx + across,
                yy: inertia.yy + across,
                xz: x.mul_add(-travel, inertia.xz),
                yz: y.mul_add(-travel, inertia.yz),
                ..inertia
            },
        }
    }

    /// About a point that is so far behind on the x axis; parallel axes.
    #[inline(always)]
    fn shifted_along_x(self, r: f64, mass: f64) -> Self {
        if r == 0.0 {
            return self;
        }
        let (Vec3 { x, y, z }, inertia) = (self.first, self.inertia);
        let across = x.mul_add(R::lit(2.0 * r), R::lit(mass * r * r));
        Self {
            first: vec3(x + R::lit(mass * r), y, z),
            inertia: Sym3 {
                yy: inertia.yy + across,
                zz: inertia.zz + across,
                xy: y.mul_add(R::lit(-r), inertia.xy),
                xz: z.mul_add(R::lit(-r), inertia.xz),
                ..inertia
            },
        }
    }

    /// The same with y called x, z called y, and x called z.
    #[inline(always)]
    fn cycled(self) -> Self {
        Self { first: self.first.cycled(), inertia: self.inertia.cycled() }
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

    /// Resistance to a motion along z: the force that a unit acceleration along z takes.
    #[inline(always)]
    fn along_z(&self) -> Force<R> {
        let (c, m) = (self.coupling, self.translation);
        Force { moment: vec3(c.x.z, c.y.z, c.z.z), force: vec3(m.xz, m.yz, m.zz) }
    }

    /// Resistance to the motion that a link's joint allows.
    #[inline(always)]
    pub(crate) fn resistance(&self, link: &ChainLink) -> Force<R> {
        if link.slides { self.along_z() } else { self.about_z() }
    }

    /// Seen from the inner link behind a free joint that turns; `give` is the resistance about z over minus its own moment.
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

    /// Seen from the inner link behind a joint that moves against a rotor; `give` is the joint's resistance over minus its
    /// own moment, or force along z, and the rotor's.
    #[inline(always)]
    pub(crate) fn inwards_geared(&self, give: Force<R>, link: &ChainLink, turn: Turn<R>) -> Self {
        let own = self.resistance(link);
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
        let left = if link.slides { left.slid(link.travel(turn)) } else { left };
        left.turned(link.turn(turn)).tilted(link.tilt).shifted(link.origin)
    }

    /// About a point that is so far behind on the z axis.
    #[inline(always)]
    fn slid(self, travel: R) -> Self {
        self.cycled().cycled().moved_along_x(travel).cycled()
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
        // R C R^T: columns, then rows.
        let coupling = tilted_columns(tilted_columns(self.coupling, tilt).transposed(), tilt).transposed();
        Self { rotation: tilted(self.rotation, tilt), coupling, translation: tilted(self.translation, tilt) }
    }

    /// About the origin of the axes in which this one's origin is `r`: axis by axis, since links lie along one or two.
    #[inline(always)]
    fn shifted(mut self, r: Vec3<f64>) -> Self {
        for along in [r.x, r.y, r.z] {
            self = self.shifted_along_x(along).cycled();
        }
        self
    }

    /// About a point that is so far behind on the x axis, which may be no way at all.
    #[inline(always)]
    fn shifted_along_x(self, r: f64) -> Self {
        if r == 0.0 { self } else { self.moved_along_x(R::lit(r)) }
    }

    /// About a point that is so far behind on the x axis: `J + [r] C_old + ([r] C_new)^T`.
    #[inline(always)]
    fn moved_along_x(self, r: R) -> Self {
        let (c, m) = (self.coupling, self.translation);
        let y = vec3(m.xz, m.yz, m.zz).scale_add(-r, c.y);
        let z = vec3(m.xy, m.yy, m.yz).scale_add(r, c.z);
        let rotation = Sym3 {
            xx: self.rotation.xx,
            yy: (c.y.z + y.z).mul_add(-r, self.rotation.yy),
            zz: (c.z.y + z.y).mul_add(r, self.rotation.zz),
            xy: c.x.z.mul_add(-r, self.rotation.xy),
            xz: c.x.y.mul_add(r, self.rotation.xz),
            yz: (y.y - c.z.z).mul_add(r, self.rotation.yz),
        };
        Self { rotation, coupling: Mat3 { x: c.x, y, z }, translation: m }
    }

    /// The same with y called x, z called y, and x called z.
    #[inline(always)]
    fn cycled(self) -> Self {
        let Self { rotation, coupling, translation } = self;
        Self { rotation: rotation.cycled(), coupling: coupling.cycled(), translation: translation.cycled() }
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
        let (zero, Turn { cos, sin }) = (R::lit(0.0), Turn::<R>::lit(tilt));
        let [x, y] = self.coupling;
        let (x, y) = (tilt.about_x(x), tilt.about_x(y));
        let (rotation, y, z) = if tilt.is_quarter() {
            let rotation = Sym3 { xx: self.xx, yy: zero, zz: self.yy, xy: zero, xz: self.xy * sin, yz: zero };
            (rotation, Vec3::zero(), y * sin)
        } else {
            let (yy, yz) = (self.yy * cos, self.yy * sin);
            let (xy, xz) = (self.xy * cos, self.xy * sin);
            (Sym3 { xx: self.xx, yy: yy * cos, zz: yz * sin, xy, xz, yz: yz * cos }, y * cos, y * sin)
        };
        Articulated { rotation, coupling: Mat3 { x, y, z }, translation: tilted(self.translation, tilt) }
    }
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

/// The columns of a matrix in the axes from which their own are turned about x by a constant angle.
#[inline(always)]
fn tilted_columns<R: Real>(m: Mat3<R>, tilt: Turn<f64>) -> Mat3<R> {
    Mat3 { x: tilt.about_x(m.x), y: tilt.about_x(m.y), z: tilt.about_x(m.z) }
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
fn tilted<R: Real>(m: Sym3<R>, tilt: Turn<f64>) -> Sym3<R> {
    let Turn { cos: c, sin: s } = Turn::<R>::lit(tilt);
    if tilt.is_quarter() {
        return Sym3 { xx: m.xx, yy: m.zz, zz: m.yy, xy: m.xz * -s, xz: m.xy * s, yz: -m.yz };
    }
    if tilt.is_none() {
        return m;
    }
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
