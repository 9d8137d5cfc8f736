//! Geometry of the replay: parts, arm, bodies and robots as lists of numbers.

use serde::Serialize;
use softdock_kernels::model::{Model, PartShape, Shape, Side};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::{Pose, Vec3};

/// Triangles of a mesh on the page, at most; a larger one is drawn as the box around it.
const MOST_TRIANGLES: usize = 3_000;

/// Position \[m\] and attitude quaternion x, y, z, w of a frame in the frame around it.
pub(crate) type Place = [f64; 7];

/// All that the replay draws.
#[derive(Debug, Serialize)]
pub(crate) struct Scene {
    parts: [Part; 2],
    /// Radius within which the parts are \[m\].
    reach: f64,
    /// Joints of the space manipulator from the base outwards.
    joints: Vec<ArmJoint>,
    /// Part A in the frame of the last link.
    tool: Place,
    /// Part B in the target's frame.
    seat: Place,
    /// Edges of the solid boxes with the nominal masses and inertias of base and target \[m\].
    boxes: [[f64; 3]; 2],
    /// Robots of the facility, if its file states them.
    robots: Option<[Robot; 2]>,
    latch: Option<[[f64; 3]; 2]>,
}

#[derive(Debug, Serialize)]
struct Part {
    /// Contact points: place and radius \[m\].
    points: Vec<([f64; 3], f64)>,
    solids: Vec<Solid>,
}

#[derive(Debug, Serialize)]
struct Solid {
    place: Place,
    #[serde(flatten)]
    shape: Form,
}

/// Shape of a solid; lengths in metres, round ones about x.
#[derive(Debug, Serialize)]
#[serde(tag = "shape", rename_all = "snake_case")]
enum Form {
    Plane,
    Sphere {
        radius: f64,
    },
    Box {
        half: [f64; 3],
    },
    Capsule {
        radius: f64,
        length: f64,
    },
    /// From the first to the last place along x, with the radius at both.
    Frustum {
        along: [f64; 2],
        radii: [f64; 2],
    },
    Ring {
        radius: f64,
        tube: f64,
    },
    /// Hole in a face: places along x and radii from the rim inwards.
    Hole {
        outline: Vec<[f64; 2]>,
    },
    Mesh {
        vertices: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
    },
}

#[derive(Debug, Serialize)]
struct ArmJoint {
    origin: Place,
    slides: bool,
}

#[derive(Debug, Serialize)]
struct Robot {
    base: Place,
    joints: Vec<RobotJoint>,
    capsules: Vec<LinkCapsule>,
    /// The part in the frame of the last link.
    tool: Place,
    /// Direction of its rail in the laboratory, if it stands on one.
    rail: Option<[f64; 3]>,
}

#[derive(Debug, Serialize)]
struct RobotJoint {
    origin: Place,
    sign: f64,
}

#[derive(Debug, Serialize)]
struct LinkCapsule {
    joint: usize,
    from: [f64; 3],
    to: [f64; 3],
    radius: f64,
}

fn xyz(v: Vec3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}

fn place(pose: &Pose<f64>) -> Place {
    let (p, q) = (pose.position, pose.attitude);
    [p.x, p.y, p.z, q.v.x, q.v.y, q.v.z, q.w]
}

/// The scene of a plant.
pub(crate) fn scene(plant: &Plant) -> Scene {
    let model: &Model = plant;
    let nominal: &Params<f64> = &model.nominal;
    let contact = &model.contact;
    let joint = |(number, link): (usize, &softdock_kernels::model::Link)| ArmJoint {
        origin: place(&link.origin),
        slides: model.slides(number),
    };
    let reach = |part: &PartShape| {
        let points = part.points.iter().map(|point| point.position.norm() + point.radius);
        let solids = part.solids.iter().map(|solid| solid.frame.position.norm() + solid.shape.reach());
        points.chain(solids.filter(|reach| reach.is_finite())).fold(0.02, f64::max)
    };
    Scene {
        parts: Side::BOTH.map(|side| part(contact.part(side))),
        reach: reach(&contact.a).max(reach(&contact.b)),
        joints: model.links.iter().enumerate().map(joint).collect(),
        tool: place(&model.tool),
        seat: place(&model.seat),
        boxes: [(nominal.base_mass, model.base_inertia), (nominal.target_mass, model.target_inertia)]
            .map(|(mass, inertia)| edges(mass, [inertia.xx, inertia.yy, inertia.zz])),
        robots: robots(model),
        latch: contact.latch.as_ref().map(|latch| [xyz(latch.point), xyz(latch.seat)]),
    }
}

/// Edges of a solid box with a mass \[kg\] and moments of inertia about its axes \[kg m^2\].
fn edges(mass: f64, [xx, yy, zz]: [f64; 3]) -> [f64; 3] {
    let edge = |sum: f64| (6.0 * sum / mass.max(1e-9)).max(0.0).sqrt().max(0.02);
    [edge(yy + zz - xx), edge(zz + xx - yy), edge(xx + yy - zz)]
}

fn part(shape: &PartShape) -> Part {
    Part {
        points: shape.points.iter().map(|point| (xyz(point.position), point.radius)).collect(),
        solids: shape
            .solids
            .iter()
            .map(|solid| Solid { place: place(&solid.frame), shape: form(&solid.shape) })
            .collect(),
    }
}

fn form(shape: &Shape) -> Form {
    match shape {
        Shape::Plane => Form::Plane,
        Shape::Sphere { radius } => Form::Sphere { radius: *radius },
        Shape::Box { half } => Form::Box { half: xyz(*half) },
        Shape::Capsule { radius, length, .. } => Form::Capsule { radius: *radius, length: *length },
        Shape::Cylinder { radius, length, .. } => {
            Form::Frustum { along: [-0.5 * length, 0.5 * length], radii: [*radius; 2] }
        }
        Shape::Frustum { front, back, length, .. } => Form::Frustum { along: [0.0, *length], radii: [*front, *back] },
        Shape::Ring { radius, tube, .. } => Form::Ring { radius: *radius, tube: *tube },
        Shape::Cone { mouth, bottom, depth } => {
            Form::Hole { outline: vec![[0.0, *mouth], [*depth, *bottom], [*depth, 0.0]] }
        }
        Shape::Bore { radius, depth, chamfer, .. } => {
            Form::Hole { outline: vec![[0.0, radius + chamfer], [*chamfer, *radius], [*depth, *radius], [*depth, 0.0]] }
        }
        Shape::Mesh(mesh) if mesh.triangles.len() <= MOST_TRIANGLES => Form::Mesh {
            vertices: mesh.vertices.iter().map(|vertex| xyz(*vertex).map(|number| number as f32)).collect(),
            triangles: mesh.triangles.clone(),
        },
        Shape::Mesh(mesh) => {
            let most = |axis: fn(&Vec3<f64>) -> f64| mesh.vertices.iter().map(axis).map(f64::abs).fold(0.0, f64::max);
            Form::Box { half: [most(|v| v.x), most(|v| v.y), most(|v| v.z)] }
        }
    }
}

fn robots(model: &Model) -> Option<[Robot; 2]> {
    let facility = &model.facility;
    let driven = facility.session_robots.as_ref().map(|robots| &robots.level);
    let level = facility.joint_level.as_ref().or(driven)?;
    let joints = || level.robot.joints.iter();
    let capsule = |own: &softdock_kernels::manipulator::Capsule| LinkCapsule {
        joint: own.joint,
        from: xyz(own.axis.from),
        to: xyz(own.axis.to),
        radius: own.radius,
    };
    Some([0, 1].map(|robot: usize| Robot {
        base: place(&level.mounts[robot].base),
        joints: joints().map(|joint| RobotJoint { origin: place(&joint.link.origin), sign: joint.sign }).collect(),
        capsules: level.robot.capsules.iter().map(capsule).collect(),
        tool: place(&level.mounts[robot].tool),
        rail: facility.rail.filter(|_| robot == 0).map(|rail| xyz(rail.axis)),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_has_the_given_inertia() {
        let (mass, [a, b, c]) = (12.0, [0.4, 1.0, 2.0]);
        let about = |one: f64, two: f64| mass / 12.0 * (one * one + two * two);
        let found = edges(mass, [about(b, c), about(a, c), about(a, b)]);
        for (found, edge) in found.into_iter().zip([a, b, c]) {
            assert!((found - edge).abs() < 1e-12, "{found} and {edge}");
        }
    }
}
