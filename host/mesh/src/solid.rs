//! A mesh that has an inside: closed, oriented outwards, free of crossings.

use crate::fault::MeshFault;
use crate::triangles::Triangles;
use crate::{of_parry, place, to_parry};
use parry3d::math::Vector;
use parry3d::query::PointQuery;
use parry3d::shape::{TriMesh, TriMeshFlags, Triangle};
use softdock_kernels::vector::{Sym3, Vec3};
use std::collections::HashMap;

/// Thinner than this share of its longest edge a mesh has no volume.
const FLAT: f64 = 1e-9;

/// A checked mesh.
#[derive(Clone, Debug)]
pub struct ClosedMesh {
    mesh: TriMesh,
    volume: f64,
}

/// Mass and its distribution, for a uniform density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the mesh's frame \[m\].
    pub centre: Vec3<f64>,
    /// Inertia about the centre of mass, axes of the mesh's frame \[kg m^2\].
    pub inertia: Sym3<f64>,
}

impl ClosedMesh {
    /// Checks a mesh.
    ///
    /// # Errors
    /// If it has a hole, an edge of more than two triangles, neighbours that are oriented against each other, no volume,
    /// an inside that is outside, or triangles that cross.
    pub fn check(triangles: &Triangles) -> Result<Self, MeshFault> {
        closed(triangles)?;
        let volume = volume(triangles);
        let size = extent(triangles);
        if volume.abs() <= FLAT * size * size * size {
            let remedy = "give the part a thickness, or use `shape = \"plane\"` for a wall";
            return Err(MeshFault::new(format!("the mesh has a volume of {:.3e} mm^3", volume * 1e9), remedy));
        }
        if volume < 0.0 {
            let message = format!("the normals point inwards: the mesh has a volume of {:.4e} mm^3", volume * 1e9);
            return Err(MeshFault::new(message, "flip the orientation of all faces, and export the part again"));
        }
        let vertices: Vec<Vector> = triangles.vertices.iter().map(|vertex| to_parry(*vertex)).collect();
        let mesh = TriMesh::with_flags(vertices, triangles.triangles.clone(), TriMeshFlags::ORIENTED)
            .map_err(|error| MeshFault::new(format!("this is no mesh of a solid: {error}"), REPAIR))?;
        let solid = Self { mesh, volume };
        solid.free_of_crossings()?;
        Ok(solid)
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Lowest and highest corner of the box around it \[m\].
    pub fn bounds(&self) -> [Vec3<f64>; 2] {
        let bounds = self.mesh.local_aabb();
        [of_parry(bounds.mins), of_parry(bounds.maxs)]
    }

    /// Volume \[m^3\].
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Area of the surface \[m^2\].
    pub fn area(&self) -> f64 {
        self.mesh.triangles().map(|triangle| triangle.area()).sum()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.mesh.num_triangles()
    }

    /// Signed distance of a place, positive outside \[m\].
    pub fn distance(&self, at: Vec3<f64>) -> f64 {
        let at = to_parry(at);
        let projection = self.mesh.project_local_point(at, false);
        let distance = (projection.point - at).length();
        if projection.is_inside { -distance } else { distance }
    }

    /// Mass properties for a density \[kg/m^3\].
    pub fn mass_properties(&self, density: f64) -> MassProperties {
        let of =
            parry3d::mass_properties::MassProperties::from_trimesh(density, self.mesh.vertices(), self.mesh.indices());
        let tensor = of.reconstruct_inertia_matrix();
        let (x, y, z) = (tensor.x_axis, tensor.y_axis, tensor.z_axis);
        let inertia = Sym3 { xx: x.x, yy: y.y, zz: z.z, xy: x.y, xz: x.z, yz: y.z };
        MassProperties { mass: of.mass(), centre: of_parry(of.local_com), inertia }
    }

    /// Refuses triangles that cross others which share no corner with them.
    fn free_of_crossings(&self) -> Result<(), MeshFault> {
        let indices = self.mesh.indices();
        for (number, triangle) in self.mesh.triangles().enumerate() {
            let own = indices[number];
            let bounds = triangle.local_aabb();
            for other in self.mesh.bvh().intersect_aabb(&bounds).filter(|other| *other as usize > number) {
                if indices[other as usize].iter().any(|corner| own.contains(corner)) {
                    continue;
                }
                if let Some(at) = crossing(&triangle, &self.mesh.triangle(other)) {
                    let (one, two, at) = (number + 1, other + 1, place(of_parry(at)));
                    let message = format!("triangles {one} and {two} cross at {at}: the mesh intersects itself");
                    return Err(MeshFault::new(
                        message,
                        "unite overlapping bodies in the CAD program, and export them as one",
                    ));
                }
            }
        }
        Ok(())
    }
}

const REPAIR: &str = "repair the mesh in the CAD program (close holes, merge equal vertices), and export it again";

/// Where an edge of one triangle goes through the other.
///
/// Lengths of any size: no bound but zero. An edge along the plane of the other triangle, as flat faces have them, does not go
/// through it.
fn crossing(one: &Triangle, two: &Triangle) -> Option<Vector> {
    let through = |edges: &Triangle, face: &Triangle| {
        let corners = [face.a, face.b, face.c].map(of_parry);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        edges.edges().into_iter().find_map(|edge| {
            let [from, to] = [edge.a, edge.b].map(of_parry);
            let [before, behind] = [from, to].map(|end| normal.dot(end - corners[0]));
            if before * behind > 0.0 || before == behind {
                return None;
            }
            let at = (to - from).scale_add(before / (before - behind), from);
            let is_left = |k: usize| {
                let side = corners[(k + 1) % 3] - corners[k];
                side.cross(at - corners[k]).dot(normal) >= 0.0
            };
            (0..3).all(is_left).then(|| to_parry(at))
        })
    };
    through(one, two).or_else(|| through(two, one))
}

/// Every edge has two triangles, which run along it in opposite directions.
fn closed(mesh: &Triangles) -> Result<(), MeshFault> {
    let mut edges: HashMap<[u32; 2], [usize; 2]> = HashMap::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    let at = |edge: &[u32; 2]| {
        let [a, b] = edge.map(|corner| place(mesh.vertices[corner as usize]));
        format!("from {a} to {b}")
    };
    // The first in the order of the file, so that the message stays the same.
    let first =
        |is_bad: fn(&[usize; 2]) -> bool| edges.iter().filter(|(_, sides)| is_bad(sides)).map(|(edge, _)| edge).min();
    let count = |is_bad: fn(&[usize; 2]) -> bool| edges.values().filter(|sides| is_bad(sides)).count();
    let is_open = |sides: &[usize; 2]| sides[0] + sides[1] == 1;
    if let Some(edge) = first(is_open) {
        let message =
            format!("the mesh has a hole: {} edges have one triangle, the first {}", count(is_open), at(edge));
        return Err(MeshFault::new(message, REPAIR));
    }
    let is_branched = |sides: &[usize; 2]| sides[0] + sides[1] > 2;
    if let Some(edge) = first(is_branched) {
        let (count, at) = (count(is_branched), at(edge));
        let message =
            format!("the mesh has no unique inside: {count} edges have more than two triangles, the first {at}");
        return Err(MeshFault::new(
            message,
            "unite bodies that share an edge, or separate them, and export the part again",
        ));
    }
    let is_turned = |sides: &[usize; 2]| sides[0] != sides[1];
    if let Some(edge) = first(is_turned) {
        let (count, at) = (count(is_turned), at(edge));
        let message =
            format!("neighbouring triangles are oriented against each other along {count} edges, the first {at}");
        return Err(MeshFault::new(
            message,
            "let the CAD program orient all faces outwards, and export the part again",
        ));
    }
    Ok(())
}

/// Volume by the divergence theorem, negative if the triangles look inwards \[m^3\].
fn volume(mesh: &Triangles) -> f64 {
    let origin = mesh.vertices[0];
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| mesh.vertices[corner as usize] - origin);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of).sum()
}

/// Longest edge of the box around the mesh \[m\].
fn extent(mesh: &Triangles) -> f64 {
    let along = |of: fn(&Vec3<f64>) -> f64| {
        let [low, high] = mesh.vertices.iter().map(of).fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(v), h.max(v)]);
        high - low
    };
    along(|v| v.x).max(along(|v| v.y)).max(along(|v| v.z))
}
