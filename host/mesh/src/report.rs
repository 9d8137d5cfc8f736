//! What `check` states of a mesh: size, memory, and how well its grid keeps its surface.

use crate::solid::{ClosedMesh, MassProperties};
use softdock_kernels::contact::mesh::Mesh;
use softdock_kernels::vector::Vec3;

/// Most places at which the surface is compared.
const MOST_SAMPLES: usize = 4_000;

/// Cells from a sharp edge within which the interpolation rounds it.
const NEAR_EDGE: f64 = 2.0;

/// Numbers of a prepared mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshReport {
    /// Triangles.
    pub triangles: usize,
    /// Volume \[m^3\].
    pub volume: f64,
    /// Area \[m^2\].
    pub area: f64,
    /// Lengths along x, y and z \[m\].
    pub size: Vec3<f64>,
    /// Contact points.
    pub points: usize,
    /// Cells of the grid.
    pub cells: usize,
    /// Edge of a cell \[m\].
    pub cell: f64,
    /// Memory of the grid and the shell in the kernels \[bytes\].
    pub bytes: usize,
    /// Greatest distance that the grid gives on the faces, away from sharp edges \[m\].
    pub error_of_faces: f64,
    /// The same at the sharp edges and corners \[m\].
    pub error_of_edges: f64,
    /// For a density that is given.
    pub mass: Option<MassProperties>,
}

impl MeshReport {
    /// A resolution at which the faces are as accurate as `error` \[m\]: their error goes with the square of the cell.
    pub fn resolution_for(&self, error: f64) -> f64 {
        self.cell * (error / self.error_of_faces.max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Compares a prepared mesh with its surface; `density` in kg/m^3.
pub fn report(solid: &ClosedMesh, mesh: &Mesh, density: Option<f64>) -> MeshReport {
    let [low, high] = solid.bounds();
    let edges = sharp_edges(mesh);
    let (mut of_faces, mut of_edges) = (0.0_f64, 0.0_f64);
    for place in samples(mesh) {
        let error = mesh.grid.read(place).distance.abs();
        let is_near = edges.iter().any(|edge| distance_to(edge, place) < NEAR_EDGE * mesh.grid.cell);
        let most = if is_near { &mut of_edges } else { &mut of_faces };
        *most = most.max(error);
    }
    for place in edges.iter().flatten() {
        of_edges = of_edges.max(mesh.grid.read(*place).distance.abs());
    }
    let words = mesh.grid.table.values.len() + softdock_kernels::contact::mesh::SHELL_WORDS * mesh.shell.len();
    MeshReport {
        triangles: solid.triangles(),
        volume: solid.volume(),
        area: solid.area(),
        size: high - low,
        points: mesh.shell.len(),
        cells: mesh.grid.cells(),
        cell: mesh.grid.cell,
        bytes: size_of::<f32>() * words,
        error_of_faces: of_faces,
        error_of_edges: of_edges,
        mass: density.map(|density| solid.mass_properties(density)),
    }
}

/// Places on the surface: of every triangle as many as its share of the area, at least one of large meshes' every nth.
fn samples(mesh: &Mesh) -> impl Iterator<Item = Vec3<f64>> {
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| mesh.vertices[corner as usize]);
    let area = |[a, b, c]: [Vec3<f64>; 3]| 0.5 * (b - a).cross(c - a).norm();
    let total: f64 = mesh.triangles.iter().map(|triangle| area(corners(triangle))).sum();
    let every = mesh.triangles.len().div_ceil(MOST_SAMPLES);
    mesh.triangles.iter().step_by(every).flat_map(move |triangle| {
        let [a, b, c] = corners(triangle);
        let count = (area([a, b, c]) / total * MOST_SAMPLES as f64).round().max(1.0) as usize;
        // Places by the generalised golden ratio (Roberts, 2018), folded into the triangle.
        (1..=count).map(move |number| {
            let number = number as f64;
            let (mut u, mut v) =
                ((0.5 + number * 0.754_877_666_246_692_7).fract(), (0.5 + number * 0.569_840_290_998_053_3).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            a + (b - a) * u + (c - a) * v
        })
    })
}

/// Ends of the edges between triangles that are sharp, as of the shell.
fn sharp_edges(mesh: &Mesh) -> Vec<[Vec3<f64>; 2]> {
    let corner = |index: u32| mesh.vertices[index as usize];
    let normals: Vec<Vec3<f64>> =
        mesh.triangles.iter().map(|triangle| crate::shell::normal(&triangle.map(corner))).collect();
    let edges = crate::shell::edges(&mesh.triangles);
    let sharp = edges.iter().filter(|(_, sides)| crate::shell::is_sharp(&normals, sides));
    sharp.map(|(edge, _)| edge.map(corner)).collect()
}

fn distance_to([from, to]: &[Vec3<f64>; 2], place: Vec3<f64>) -> f64 {
    let along = *to - *from;
    let share = ((place - *from).dot(along) / along.dot(along)).clamp(0.0, 1.0);
    (along.scale_add(share, *from) - place).norm()
}
