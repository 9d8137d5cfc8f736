//! The chain on a base with prescribed motion: inverse dynamics, and forward dynamics of joints driven through gears.
//!
//! As in [`super::dynamics`]; a rotor behind its gear resists its own joint's acceleration alone, so that the joint
//! gives way less than freely. No closures here, see [`super::inertia`].

use super::Turn;
use super::dynamics::{Course, Posture, Response, slid};
use super::inertia::{Articulated, Force};
use crate::real::Real;
use crate::vector::{Mat3, Sym3, Vec3, vec3};

/// A point mass that the last link carries besides its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointMass<R> {
    /// Mass \[kg\].
    pub(crate) mass: R,
    /// Place in the last link's axes \[m\].
    pub(crate) place: Vec3<R>,
}

/// Where the links are, in the base's chain axes.
pub(crate) struct Frames<R, const N: usize> {
    /// Origins.
    pub(crate) origin: [Vec3<R>; N],
    /// Unit vectors of the joints.
    pub(crate) joint: [Vec3<R>; N],
    /// Axes of the last link.
    pub(crate) last: Mat3<R>,
}

/// A chain folded into what its base feels: the inward pass of the articulated-body algorithm.
pub(crate) struct Folded<R, const N: usize> {
    give: [Force<R>; N],
    joint: [R; N],
    body: Articulated<R>,
    load: Force<R>,
}

impl<R: Real, const N: usize> Posture<'_, R, N> {
    /// The chain without the body that it stands on.
    #[inline(always)]
    pub(crate) fn led<'a>(chain: &'a super::Chain, turns: &'a [Turn<R>; N]) -> Posture<'a, R, N> {
        Posture { chain, turns, base_mass: R::lit(0.0), base_inertia_scale: R::lit(0.0) }
    }

    /// Where the links are, in a chain whose joints turn.
    #[inline(always)]
    pub(crate) fn frames(&self) -> Frames<R, N> {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let (mut x, mut y, mut z) = (vec3(one, zero, zero), vec3(zero, one, zero), vec3(zero, zero, one));
        let (mut at, mut origin, mut joint) = (Vec3::zero(), [Vec3::zero(); N], [Vec3::zero(); N]);
        for i in 0..N {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            at = Mat3 { x, y, z }.times_onto(link.origin, at);
            let tilt = Turn::<R>::lit(link.tilt);
            (y, z) = (y.scale_add(tilt.cos, z * tilt.sin), z.scale_add(tilt.cos, y * -tilt.sin));
            (x, y) = (x.scale_add(turn.cos, y * turn.sin), y.scale_add(turn.cos, x * -turn.sin));
            (origin[i], joint[i]) = (at, z);
        }
        Frames { origin, joint, last: Mat3 { x, y, z } }
    }

    /// A vector of the base's axes in the last link's.
    #[inline(always)]
    pub(crate) fn in_last(&self, mut v: Vec3<R>) -> Vec3<R> {
        for i in 0..N {
            v = self.chain.links[i].outwards(self.turns[i], v);
        }
        v
    }

    /// Inverse dynamics: joint torques \[N m\] and force on the base \[N\] for these joint rates and accelerations (`gain`).
    ///
    /// `base` is the base's acceleration minus gravity \[m/s^2\].
    #[inline(always)]
    pub(crate) fn torques(&self, rate: &[R; N], gain: &[R; N], base: Vec3<R>) -> ([R; N], Vec3<R>) {
        let mut forces = [Force::zero(); N];
        self.link_forces(led(base), rate, gain, &mut forces);
        let (torque, push) = self.passed(&forces, Force::zero());
        (torque, push.force)
    }

    /// Gravity torques of the joints \[N m\]; `lifted` is the base's acceleration minus gravity \[m/s^2\].
    #[inline(always)]
    pub(crate) fn weight(&self, lifted: Vec3<R>) -> [R; N] {
        let (mut first, mut mass) = ([Vec3::zero(); N], [R::lit(0.0); N]);
        for (i, link) in self.chain.links.iter().enumerate() {
            (first[i], mass[i]) = (Vec3::lit(link.com * link.mass), R::lit(link.mass));
        }
        self.holding(lifted, first, mass)
    }

    /// Torques with which the joints hold a mass that the last link carries; `lifted` as in [`weight`](Self::weight).
    #[inline(always)]
    pub(crate) fn weight_of(&self, carried: PointMass<R>, lifted: Vec3<R>) -> [R; N] {
        let (mut first, mut mass) = ([Vec3::zero(); N], [R::lit(0.0); N]);
        (first[N - 1], mass[N - 1]) = (carried.place * carried.mass, carried.mass);
        self.holding(lifted, first, mass)
    }

    /// Torques that hold masses at rest in a chain whose joints turn, from each link's mass and its first moment.
    ///
    /// By the lever of all that a joint carries, not by what its links pass on: a joint along `lifted` then carries
    /// exactly nothing, where sums of passed moments leave their rounding.
    #[inline(always)]
    fn holding(&self, mut lifted: Vec3<R>, first: [Vec3<R>; N], mass: [R; N]) -> [R; N] {
        let mut felt = [Vec3::zero(); N];
        for (i, felt) in felt.iter_mut().enumerate() {
            lifted = self.chain.links[i].outwards(self.turns[i], lifted);
            *felt = lifted;
        }
        let (mut lever, mut carried, mut torque) = (Vec3::zero(), R::lit(0.0), [R::lit(0.0); N]);
        for i in (0..N).rev() {
            let link = &self.chain.links[i];
            (lever, carried) = (lever + first[i], carried + mass[i]);
            torque[i] = lever.x.mul_add(felt[i].y, lever.y * -felt[i].x);
            lever = link.inwards(self.turns[i], lever) + Vec3::lit(link.origin) * carried;
        }
        torque
    }

    /// The chain under joint torques \[N m\], or forces \[N\] of joints that slide, and a wrench `tip` on the last link, about its origin in its axes.
    ///
    /// `armature` \[kg m^2, kg\] is felt by the joint's own acceleration alone; `base` is how the base moves, its acceleration
    /// minus gravity.
    #[inline(always)]
    pub(crate) fn folded(
        &self,
        rate: &[R; N],
        torque: &[R; N],
        armature: &[R; N],
        tip: Force<R>,
        base: Course<R>,
        carried: Option<PointMass<R>>,
    ) -> Folded<R, N> {
        let zero = R::lit(0.0);
        // What each link needs, until it is passed on; then what its joint gives.
        let mut give = [Force::zero(); N];
        let last = self.link_forces(base, rate, &[zero; N], &mut give);
        let (mut body, mut load) = (Articulated::zero(), Force { moment: -tip.moment, force: -tip.force });
        if let Some(PointMass { mass, place }) = carried {
            let force = (last.acceleration + last.field().times(place)) * mass;
            body = body.plus_point(mass, place);
            load = load.plus(Force { moment: place.cross(force), force });
        }
        let mut joint = [zero; N];
        for i in (0..N).rev() {
            let (link, turn) = (&self.chain.links[i], self.turns[i]);
            body = body.plus_link(link);
            load = load.plus(give[i]);
            let resistance = body.resistance(link);
            let (own, felt) = match link.slides {
                true => (resistance.force.z, load.force.z),
                false => (resistance.moment.z, load.moment.z),
            };
            let inverse = R::lit(-1.0) / (own + armature[i]);
            give[i] = Force { moment: resistance.moment * inverse, force: resistance.force * inverse };
            let excess = felt - torque[i];
            joint[i] = excess * inverse;
            let left = Force {
                moment: give[i].moment.scale_add(excess, load.moment),
                force: give[i].force.scale_add(excess, load.force),
            };
            load = left.inwards(link, turn);
            body = body.inwards_geared(give[i], link, turn);
        }
        Folded { give, joint, body, load }
    }
}

impl<R: Real, const N: usize> Posture<'_, R, N> {
    /// [`response`](Self::response) of joints that are driven through gears: each acceleration takes its `armature`
    /// \[kg m^2\] off the joint's torque.
    #[inline(always)]
    pub(crate) fn response_geared(
        &self,
        omega: Vec3<R>,
        rate: &[R; N],
        (torque, armature): (&[R; N], &[R; N]),
        tip: Force<R>,
        push: Force<R>,
    ) -> Response<R, N> {
        let still = Course { rate: omega, turning: Vec3::zero(), acceleration: Vec3::zero() };
        let (own, mut links) = (self.base_force(still), [Force::zero(); N]);
        self.link_forces(still, rate, &[R::lit(0.0); N], &mut links);
        let drift = own.plus(self.passed(&links, Force::zero()).1);
        let folded = self.folded(rate, torque, armature, tip, still, None);
        let (moment, force) = (push.moment - own.moment - folded.load.moment, push.force - folded.load.force);
        let (turning, acceleration) = self.on_base(folded.body).solve(Force { moment, force });
        Response { joint: folded.accelerations(self, turning, acceleration), turning, drift }
    }
}

/// A base that does not turn; its acceleration minus gravity \[m/s^2\].
#[inline(always)]
pub(crate) fn led<R: Real>(acceleration: Vec3<R>) -> Course<R> {
    Course { rate: Vec3::zero(), turning: Vec3::zero(), acceleration }
}

impl<R: Real, const N: usize> Folded<R, N> {
    /// Acceleration of a carriage under the chain that can move along a direction: its own mass and the force on it.
    #[inline(always)]
    pub(crate) fn slide(&self, along: Vec3<R>, mass: R, force: R) -> R {
        let felt: Sym3<R> = self.body.translation;
        (force - self.load.force.dot(along)) / (felt.times(along).dot(along) + mass)
    }

    /// Outwards again: the joints' accelerations when the base accelerates so, beyond what it was folded with.
    #[inline(always)]
    pub(crate) fn accelerations(&self, posture: &Posture<R, N>, turning: Vec3<R>, base: Vec3<R>) -> [R; N] {
        let (mut turning, mut acceleration, mut joint) = (turning, base, self.joint);
        for (i, joint) in joint.iter_mut().enumerate() {
            let (link, turn) = (&posture.chain.links[i], posture.turns[i]);
            let moved = (-link.origin).cross_onto(turning, acceleration);
            (turning, acceleration) = (link.outwards(turn, turning), link.outwards(turn, moved));
            if link.slides {
                acceleration = slid(turning, acceleration, link.travel(turn));
            }
            let Force { moment, force } = self.give[i];
            *joint = *joint + moment.dot(turning) + force.dot(acceleration);
            if link.slides {
                acceleration.z = acceleration.z + *joint;
            } else {
                turning.z = turning.z + *joint;
            }
        }
        joint
    }
}
