//! The nominal scene as a tree of frames.

use softdock_kernels::manipulator::cell::Mount;
use softdock_kernels::model::{Model, PartShape, Shape, Side};
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::Sym3;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_realtime::log::scene::z_towards;

/// How a frame moves in its parent, beyond its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneJoint {
    /// Not at all.
    Fixed,
    /// As a free body.
    Free,
    /// It turns about an axis of its own \[rad\].
    Turns(Vec3<f64>),
    /// It slides along an axis of its own \[m\].
    Slides(Vec3<f64>),
}

/// Mass properties of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the frame \[m\].
    pub com: Vec3<f64>,
    /// Inertia about the centre of mass, axes of the frame \[kg m^2\].
    pub inertia: Sym3<f64>,
}

/// A solid, in the frame of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneShape {
    /// Name, unique in the scene.
    pub name: String,
    /// Place in the body's frame.
    pub place: Pose<f64>,
    /// The solid.
    pub shape: Shape,
}

/// A frame of the scene.
#[derive(Clone, Debug)]
pub struct SceneFrame {
    /// Name, unique in the scene: `base`, `link_1`, `part_a`.
    pub name: String,
    /// Its parent's place in the tree; none for the root.
    pub parent: Option<usize>,
    /// Pose in the parent with the joint at zero. For a free frame, that of the start.
    pub origin: Pose<f64>,
    /// How it moves.
    pub joint: SceneJoint,
    /// Position of the joint at the start \[rad, m\].
    pub start: f64,
    /// Mass properties; none for a frame without mass.
    pub inertial: Option<Inertial>,
    /// Solids.
    pub shapes: Vec<SceneShape>,
}

impl SceneFrame {
    /// Pose in the parent at a position of the joint \[rad, m\].
    pub fn pose(&self, position: f64) -> Pose<f64> {
        let motion = match self.joint {
            SceneJoint::Fixed | SceneJoint::Free => Pose::identity(),
            SceneJoint::Turns(axis) => {
                let (sin, cos) = (0.5 * position).sin_cos();
                Pose { position: Vec3::zero(), attitude: Quat { w: cos, v: axis * sin } }
            }
            SceneJoint::Slides(axis) => Pose { position: axis * position, attitude: Quat::identity() },
        };
        self.origin.compose(motion)
    }
}

/// The scene: parents stand before their children.
#[derive(Clone, Debug)]
pub struct SceneTree {
    /// Id of the scenario.
    pub id: String,
    /// The frames; the first is the root.
    pub frames: Vec<SceneFrame>,
    /// Whether part B rides on a soft capture ring; the tree has it at rest on the target.
    pub rides_on_ring: bool,
}

/// The root frame, inertial.
pub(crate) const WORLD: &str = "world";

/// Frame in which the facility's robots stand.
pub(crate) const LABORATORY: &str = "laboratory";

impl SceneTree {
    /// The base with its arm, part A, the target with part B, and the facility's robots if its file states them.
    pub fn of(id: &str, plant: &Plant) -> Self {
        let model: &Model = plant;
        let root = frame(WORLD, None, Pose::identity(), SceneJoint::Fixed);
        let mut tree = Self { id: id.to_owned(), frames: vec![root], rides_on_ring: model.ring.is_some() };
        let nominal = &model.nominal;
        let body = |mass: f64, inertia: Sym3<f64>| Some(Inertial { mass, com: Vec3::zero(), inertia });
        let base = frame("base", Some(0), model.base_pose, SceneJoint::Free);
        let mut last = tree.push(SceneFrame { inertial: body(nominal.base_mass, model.base_inertia), ..base });
        for (at, link) in model.links.iter().enumerate() {
            let axis = vec3(0.0, 0.0, 1.0);
            let joint = if model.slides(at) { SceneJoint::Slides(axis) } else { SceneJoint::Turns(axis) };
            let inertial = Some(Inertial { mass: link.mass, com: link.com, inertia: link.inertia });
            let start = model.start_angles.get(at).copied().unwrap_or_default();
            let own = frame(&format!("link_{}", at + 1), Some(last), link.origin, joint);
            last = tree.push(SceneFrame { inertial, start, ..own });
        }
        tree.part("part_a", last, model.tool, model.contact.part(Side::A));
        let target = frame("target", Some(0), model.target_pose, SceneJoint::Free);
        let target = tree.push(SceneFrame { inertial: body(nominal.target_mass, model.target_inertia), ..target });
        tree.part("part_b", target, model.seat, model.contact.part(Side::B));
        tree.robots(model);
        tree
    }

    /// The frame of a name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.frames.iter().position(|frame| frame.name == name)
    }

    /// Pose of a frame in the root, with the joints at these positions, one for each frame.
    pub fn world_pose(&self, frame: usize, position: &dyn Fn(usize) -> f64) -> Pose<f64> {
        let own = self.frames[frame].pose(position(frame));
        self.frames[frame].parent.map_or(own, |parent| self.world_pose(parent, position).compose(own))
    }

    fn push(&mut self, frame: SceneFrame) -> usize {
        self.frames.push(frame);
        self.frames.len() - 1
    }

    fn part(&mut self, name: &str, parent: usize, place: Pose<f64>, shape: &PartShape) {
        let points = shape.points.iter().enumerate().map(|(at, point)| SceneShape {
            name: format!("{name}_point_{}", at + 1),
            place: Pose { position: point.position, attitude: Quat::identity() },
            shape: Shape::Sphere { radius: point.radius.max(SMALLEST) },
        });
        let solids = shape.solids.iter().enumerate().map(|(at, solid)| SceneShape {
            name: format!("{name}_solid_{}", at + 1),
            place: solid.frame,
            shape: solid.shape.clone(),
        });
        let shapes = points.chain(solids).collect();
        self.push(SceneFrame { shapes, ..frame(name, Some(parent), place, SceneJoint::Fixed) });
    }

    fn robots(&mut self, model: &Model) {
        let facility = &model.facility;
        let driven = facility.session_robots.as_ref().map(|robots| &robots.level);
        let Some(level) = facility.joint_level.as_ref().or(driven) else { return };
        let laboratory = self.push(frame(LABORATORY, Some(0), Pose::identity(), SceneJoint::Fixed));
        for (number, mount) in level.mounts.iter().enumerate() {
            let name = |rest: &str| format!("robot{}_{rest}", number + 1);
            let mut last = laboratory;
            if let Some(rail) = facility.rail.filter(|_| number == 0) {
                last = self.push(frame(&name("rail"), Some(last), Pose::identity(), SceneJoint::Slides(rail.axis)));
            }
            let Mount { base, tool, .. } = mount;
            last = self.push(frame(&name("base"), Some(last), *base, SceneJoint::Fixed));
            for (at, joint) in level.robot.joints.iter().enumerate() {
                let link = &joint.link;
                let turns = SceneJoint::Turns(vec3(0.0, 0.0, joint.sign));
                let own = frame(&name(&format!("axis_{}", at + 1)), Some(last), link.origin, turns);
                let capsules = level.robot.capsules.iter().filter(|capsule| capsule.joint == at);
                let shapes = capsules.enumerate().map(|(count, capsule)| SceneShape {
                    name: name(&format!("axis_{}_capsule_{}", at + 1, count + 1)),
                    place: along(capsule.axis.from, capsule.axis.to),
                    shape: Shape::Capsule {
                        radius: capsule.radius,
                        length: (capsule.axis.to - capsule.axis.from).norm(),
                        points: 0,
                    },
                });
                let inertial = Inertial { mass: link.mass, com: link.com, inertia: link.inertia };
                last = self.push(SceneFrame { inertial: Some(inertial), shapes: shapes.collect(), ..own });
            }
            self.push(frame(&name("part"), Some(last), *tool, SceneJoint::Fixed));
        }
    }
}

/// Radius at which a contact point is drawn, at least \[m\].
const SMALLEST: f64 = 0.002;

fn frame(name: &str, parent: Option<usize>, origin: Pose<f64>, joint: SceneJoint) -> SceneFrame {
    SceneFrame { name: name.to_owned(), parent, origin, joint, start: 0.0, inertial: None, shapes: Vec::new() }
}

/// The middle of a segment, with x along it.
fn along(from: Vec3<f64>, to: Vec3<f64>) -> Pose<f64> {
    let (way, position) = (to - from, (from + to) * 0.5);
    if way.norm() == 0.0 {
        return Pose { position, attitude: Quat::identity() };
    }
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let x_to_z = Quat { w: half, v: vec3(0.0, -half, 0.0) };
    Pose { position, attitude: z_towards(way).compose(x_to_z) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn capsule_lies_along_its_segment() {
        for to in [vec3(1.0, 2.0, -0.5), vec3(-1.0, 0.0, 0.0), vec3(0.0, 0.0, -3.0)] {
            let from = vec3(0.2, 0.1, 0.0);
            let place = along(from, to);
            let half = 0.5 * (to - from).norm();
            let end = place.position + place.attitude.rotate(vec3(half, 0.0, 0.0));
            assert!((end - to).norm() < 1e-12, "{end:?}");
        }
    }
}
