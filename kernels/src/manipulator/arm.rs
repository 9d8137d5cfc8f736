//! A robot's links as a chain in axes of their own joints, on the robot's base.

use super::Manipulator;
use crate::chain::dynamics::Posture;
use crate::chain::{Chain, ROUNDING, Turn};
use crate::math::sin_cos;
use crate::model::Link;
use crate::real::Real;
use crate::vector::{Pose, Quat, Sym3, Vec3, vec3};

/// The chain, whose joints turn by +q, and what stands still beside it.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    /// Links at the angles 0 of the robot.
    pub(crate) chain: Chain,
    /// From the base's axes to the chain's there.
    pub(crate) from_base: Quat<f64>,
    /// Acceleration that a base at rest feels, against free fall, in the chain's axes there \[m/s^2\].
    pub(crate) lifted: Vec3<f64>,
}

impl Arm {
    /// The arm of a robot that holds a part at the pose `tool` in its last link's frame.
    pub(crate) fn new(robot: &Manipulator, tool: Pose<f64>) -> Self {
        // Frames whose joints turn backwards lie on their heads.
        let turned = |sign: f64| if sign < 0.0 { Quat { w: 0.0, v: vec3(1.0, 0.0, 0.0) } } else { Quat::identity() };
        let mut inner = Quat::identity();
        let mut links = Vec::with_capacity(robot.joints.len());
        for joint in &robot.joints {
            let own = turned(joint.sign);
            let Link { origin, mass, com, inertia } = joint.link;
            let origin = Pose {
                position: inner.rotate_back(origin.position),
                attitude: inner.conjugate().compose(origin.attitude).compose(own),
            };
            let inertia = inertia.rotated(own.matrix().transposed());
            links.push(Link { origin, mass, com: own.rotate_back(com), inertia });
            inner = own;
        }
        let start: Vec<_> = links.iter().map(|link| link.origin).collect();
        let tool =
            Pose { position: inner.rotate_back(tool.position), attitude: inner.conjugate().compose(tool.attitude) };
        let chain = Chain::new(&links, &start, tool, Sym3::splat(0.0));
        let from_base = chain.root.conjugate();
        // Exactly along an upright axis 1: no posture loads that one, not even by rounding.
        let small = ROUNDING * robot.gravity.norm();
        let lifted = from_base.rotate(-robot.gravity).map(|e| if e.abs() < small { 0.0 } else { e });
        Self { chain, from_base, lifted }
    }

    /// Turns of the joints at angles \[rad\].
    #[inline(always)]
    pub(crate) fn turns<R: Real, const N: usize>(&self, angle: [R; N]) -> [Turn<R>; N] {
        let mut turns = [Turn::lit(Turn { cos: 1.0, sin: 0.0 }); N];
        for i in 0..N {
            // By half the angle, as the part's pose needs it too; the start's turn is apart, for the sake of f32.
            let (sin, cos) = sin_cos(angle[i] * R::lit(0.5));
            turns[i] = Turn { cos, sin }.doubled().and(Turn::lit(self.chain.links[i].start_turn));
        }
        turns
    }

    /// The chain at the joints' turns.
    #[inline(always)]
    pub(crate) fn posture<'a, R: Real, const N: usize>(&'a self, turns: &'a [Turn<R>; N]) -> Posture<'a, R, N> {
        Posture::led(&self.chain, turns)
    }
}
