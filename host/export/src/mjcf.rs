//! The scene as MJCF, for MuJoCo.

use crate::ExportedScene;
use crate::lathe::Surface;
use crate::tree::{Inertial, SceneJoint, SceneShape, SceneTree};
use crate::urdf::PLATE;
use crate::xml::{Xml, numbers, quaternion, upright, vector};
use softdock_kernels::model::Shape;
use softdock_kernels::vector::Sym3;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_results::ResultFile;

/// Mass of a moving frame without one \[kg\]: MuJoCo moves no body without mass.
const LEAST_MASS: f64 = 1e-3;

/// Moments of inertia of such a frame \[kg m^2\].
const LEAST_INERTIA: f64 = 1e-6;

/// What MJCF has no counterpart for.
const LEFT_OUT: &str =
    "contact laws, drives and latches are left out; MuJoCo's own contact and the nominal friction stand for them";

/// Returns the MJCF of a scene, and the meshes that it names; the key frame `start` has the start posture.
///
/// `friction` is the Coulomb coefficient of the parts, `timestep` in seconds.
pub fn mjcf_files(tree: &SceneTree, friction: f64, timestep: f64) -> ExportedScene {
    let mut scene = Scene { tree, friction, meshes: Vec::new(), notes: Vec::new(), positions: Vec::new() };
    let mut xml = Xml::new();
    xml.element("mujoco", &[("model", &tree.id)], |xml| {
        xml.empty("compiler", &[("angle", "radian"), ("inertiafromgeom", "false"), ("autolimits", "false")]);
        xml.empty("option", &[("timestep", &timestep.to_string()), ("gravity", "0 0 0")]);
        xml.element("worldbody", &[], |xml| scene.children(xml, 0));
        xml.element("asset", &[], |xml| {
            for mesh in &scene.meshes {
                let name = mesh.name.trim_end_matches(".obj");
                xml.empty("mesh", &[("name", name), ("file", &mesh.name)]);
            }
        });
        xml.element("keyframe", &[], |xml| {
            xml.empty("key", &[("name", "start"), ("qpos", &numbers(&scene.positions))]);
        });
        scene.notes.push(LEFT_OUT.to_owned());
        scene.notes.iter().for_each(|note| xml.comment(note));
    });
    let Scene { meshes, notes, .. } = scene;
    let mut files = vec![ResultFile::new(format!("{}.xml", tree.id), xml.text())];
    files.extend(meshes);
    ExportedScene { files, notes }
}

struct Scene<'a> {
    tree: &'a SceneTree,
    friction: f64,
    meshes: Vec<ResultFile>,
    notes: Vec<String>,
    /// Positions of the start, in the order of the bodies.
    positions: Vec<f64>,
}

impl Scene<'_> {
    fn children(&mut self, xml: &mut Xml, parent: usize) {
        let own = (0..self.tree.frames.len()).filter(|at| self.tree.frames[*at].parent == Some(parent));
        own.collect::<Vec<_>>().into_iter().for_each(|at| self.body(xml, at));
    }

    fn body(&mut self, xml: &mut Xml, at: usize) {
        let frame = &self.tree.frames[at];
        let (pos, quat) = (vector(frame.origin.position), quaternion(frame.origin.attitude));
        xml.element("body", &[("name", &frame.name), ("pos", &pos), ("quat", &quat)], |xml| {
            let name = format!("{}_joint", frame.name);
            match frame.joint {
                SceneJoint::Fixed => {}
                SceneJoint::Free => {
                    xml.empty("freejoint", &[("name", &name)]);
                    let Pose { position: p, attitude: q } = frame.origin;
                    self.positions.extend([p.x, p.y, p.z, q.w, q.v.x, q.v.y, q.v.z]);
                }
                SceneJoint::Turns(axis) => self.joint(xml, &name, "hinge", axis, frame.start),
                SceneJoint::Slides(axis) => self.joint(xml, &name, "slide", axis, frame.start),
            }
            let given = frame.inertial.filter(|inertial| inertial.mass > 0.0);
            let is_moving = frame.joint != SceneJoint::Fixed;
            if given.is_none() && is_moving {
                self.notes.push(format!("`{}` has no mass: {LEAST_MASS} kg, since MuJoCo needs one", frame.name));
            }
            let least = Inertial {
                mass: LEAST_MASS,
                com: Vec3::zero(),
                inertia: Sym3::diagonal(vec3(LEAST_INERTIA, LEAST_INERTIA, LEAST_INERTIA)),
            };
            if let Some(inertial) = given.or(is_moving.then_some(least)) {
                let i = inertial.inertia;
                let full = numbers(&[i.xx, i.yy, i.zz, i.xy, i.xz, i.yz]);
                let (pos, mass) = (vector(inertial.com), inertial.mass.to_string());
                xml.empty("inertial", &[("pos", &pos), ("mass", &mass), ("fullinertia", &full)]);
            }
            for shape in &frame.shapes {
                self.geometry(xml, &frame.name, shape);
            }
            self.children(xml, at);
        });
    }

    fn joint(&mut self, xml: &mut Xml, name: &str, kind: &str, axis: Vec3<f64>, start: f64) {
        xml.empty("joint", &[("name", name), ("type", kind), ("axis", &vector(axis))]);
        self.positions.push(start);
    }

    fn geometry(&mut self, xml: &mut Xml, frame: &str, shape: &SceneShape) {
        let place = &shape.place;
        let inwards = Pose { position: vec3(PLATE.x, 0.0, 0.0), attitude: Quat::identity() };
        let mut mesh = String::new();
        let mut is_hull = true;
        let (kind, place, size) = match &shape.shape {
            Shape::Sphere { radius } => ("sphere", *place, numbers(&[*radius])),
            Shape::Box { half } => ("box", *place, vector(*half)),
            Shape::Cylinder { radius, length, .. } => ("cylinder", upright(place), numbers(&[*radius, 0.5 * length])),
            Shape::Capsule { radius, length, .. } => ("capsule", upright(place), numbers(&[*radius, 0.5 * length])),
            Shape::Plane => {
                self.notes.push(format!("`{}` is an unlimited plane: a plate of 2 m stands for it", shape.name));
                ("box", place.compose(inwards), vector(PLATE))
            }
            other => {
                let Some(surface) = Surface::of(other) else { return };
                is_hull = matches!(other, Shape::Frustum { .. });
                mesh.clone_from(&shape.name);
                self.meshes.push(ResultFile::new(format!("{}.obj", shape.name), surface.obj()));
                ("mesh", *place, String::new())
            }
        };
        if !is_hull {
            self.notes.push(format!("`{}` is drawn only: MuJoCo would collide its convex hull", shape.name));
        }
        // Parts collide with each other, and with nothing else.
        let (own, other) = match frame {
            "part_a" if is_hull => ("1", "2"),
            "part_b" if is_hull => ("2", "1"),
            _ => ("0", "0"),
        };
        let (pos, quat) = (vector(place.position), quaternion(place.attitude));
        let friction = numbers(&[self.friction, 0.005, 0.0001]);
        let mut attributes = vec![("name", shape.name.as_str()), ("type", kind)];
        attributes.extend([("pos", pos.as_str()), ("quat", &quat), ("contype", own), ("conaffinity", other)]);
        attributes.push(("friction", &friction));
        attributes.push(if mesh.is_empty() { ("size", &size) } else { ("mesh", &mesh) });
        xml.empty("geom", &attributes);
    }
}
