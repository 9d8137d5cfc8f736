//! The scene as URDF.

use crate::ExportedScene;
use crate::lathe::Surface;
use crate::tree::{SceneFrame, SceneJoint, SceneShape, SceneTree};
use crate::xml::{Xml, numbers, upright, vector};
use softdock_kernels::model::Shape;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_realtime::log::scene::roll_pitch_yaw;
use softdock_results::ResultFile;

/// Half edges of the plate that stands for an unlimited plane \[m\].
pub(crate) const PLATE: Vec3<f64> = Vec3 { x: 0.005, y: 1.0, z: 1.0 };

/// Returns the URDF of a scene, and the meshes that it names.
///
/// Base and target have floating joints; positions of the others count as in the campaign.
pub fn urdf_files(tree: &SceneTree) -> ExportedScene {
    let mut meshes = Vec::new();
    let mut notes = Vec::new();
    let mut xml = Xml::new();
    xml.element("robot", &[("name", &tree.id)], |xml| {
        for frame in &tree.frames {
            link(xml, frame, &mut meshes, &mut notes);
        }
        for frame in &tree.frames {
            joint(xml, tree, frame);
        }
        notes.push("URDF has no contact laws, drives and latches: they are left out".to_owned());
        notes.push("limits of joints are not part of a scenario: the URDF allows a full turn, or 10 m".to_owned());
        notes.iter().for_each(|note| xml.comment(note));
    });
    let mut files = vec![ResultFile::new(format!("{}.urdf", tree.id), xml.text())];
    files.extend(meshes);
    ExportedScene { files, notes }
}

fn link(xml: &mut Xml, frame: &SceneFrame, meshes: &mut Vec<ResultFile>, notes: &mut Vec<String>) {
    xml.element("link", &[("name", &frame.name)], |xml| {
        if let Some(inertial) = frame.inertial.filter(|inertial| inertial.mass > 0.0) {
            xml.element("inertial", &[], |xml| {
                origin(xml, &Pose { position: inertial.com, attitude: Quat::identity() });
                xml.empty("mass", &[("value", &inertial.mass.to_string())]);
                let i = inertial.inertia;
                let values = [i.xx, i.xy, i.xz, i.yy, i.yz, i.zz].map(|value| value.to_string());
                let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
                let pairs: Vec<(&str, &str)> = names.into_iter().zip(values.iter().map(String::as_str)).collect();
                xml.empty("inertia", &pairs);
            });
        }
        for shape in &frame.shapes {
            for (place, geometry) in geometries(shape, meshes, notes) {
                for kind in ["visual", "collision"] {
                    xml.element(kind, &[], |xml| {
                        origin(xml, &place);
                        xml.element("geometry", &[], |xml| {
                            let (name, attributes) = &geometry;
                            let pairs: Vec<(&str, &str)> =
                                attributes.iter().map(|(key, value)| (*key, value.as_str())).collect();
                            xml.empty(name, &pairs);
                        });
                    });
                }
            }
        }
    });
}

/// An element with its attributes.
type Geometry = (&'static str, Vec<(&'static str, String)>);

/// The geometries of a solid, each in its place.
fn geometries(shape: &SceneShape, meshes: &mut Vec<ResultFile>, notes: &mut Vec<String>) -> Vec<(Pose<f64>, Geometry)> {
    let place = &shape.place;
    let sphere = |radius: f64| ("sphere", vec![("radius", radius.to_string())]);
    let cylinder =
        |radius: f64, length: f64| ("cylinder", vec![("radius", radius.to_string()), ("length", length.to_string())]);
    let block = |half: Vec3<f64>| ("box", vec![("size", vector(half * 2.0))]);
    match &shape.shape {
        Shape::Sphere { radius } => vec![(*place, sphere(*radius))],
        Shape::Box { half } => vec![(*place, block(*half))],
        Shape::Cylinder { radius, length, .. } => vec![(upright(place), cylinder(*radius, *length))],
        Shape::Capsule { radius, length, .. } => {
            let end = |side: f64| {
                let offset = Pose { position: vec3(0.5 * side * length, 0.0, 0.0), attitude: Quat::identity() };
                (place.compose(offset), sphere(*radius))
            };
            vec![(upright(place), cylinder(*radius, *length)), end(-1.0), end(1.0)]
        }
        Shape::Plane => {
            notes.push(format!("`{}` is an unlimited plane: a plate of 2 m stands for it", shape.name));
            let inwards = Pose { position: vec3(PLATE.x, 0.0, 0.0), attitude: Quat::identity() };
            vec![(place.compose(inwards), block(PLATE))]
        }
        other => match Surface::of(other) {
            Some(surface) => {
                let file = format!("{}.obj", shape.name);
                meshes.push(ResultFile::new(file.clone(), surface.obj()));
                vec![(*place, ("mesh", vec![("filename", file)]))]
            }
            None => Vec::new(),
        },
    }
}

fn joint(xml: &mut Xml, tree: &SceneTree, frame: &SceneFrame) {
    let Some(parent) = frame.parent else { return };
    let (kind, axis) = match frame.joint {
        SceneJoint::Fixed => ("fixed", None),
        SceneJoint::Free => ("floating", None),
        SceneJoint::Turns(axis) => ("revolute", Some((axis, std::f64::consts::TAU))),
        SceneJoint::Slides(axis) => ("prismatic", Some((axis, 10.0))),
    };
    xml.element("joint", &[("name", &format!("{}_joint", frame.name)), ("type", kind)], |xml| {
        origin(xml, &frame.origin);
        xml.empty("parent", &[("link", &tree.frames[parent].name)]);
        xml.empty("child", &[("link", &frame.name)]);
        if let Some((axis, limit)) = axis {
            xml.empty("axis", &[("xyz", &vector(axis))]);
            let (lower, upper) = ((-limit).to_string(), limit.to_string());
            xml.empty("limit", &[("lower", &lower), ("upper", &upper), ("effort", "1e6"), ("velocity", "1e3")]);
        }
    });
}

fn origin(xml: &mut Xml, pose: &Pose<f64>) {
    let angles = roll_pitch_yaw(pose.attitude);
    let (xyz, rpy) = (vector(pose.position), numbers(&[angles.x, angles.y, angles.z]));
    xml.empty("origin", &[("xyz", &xyz), ("rpy", &rpy)]);
}
