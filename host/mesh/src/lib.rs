//! Meshes of contact parts: read from STL and OBJ, checked, made into what the kernels need.
//!
//! [`Triangles::read`] gives corners and triangles in metres, [`ClosedMesh::check`] refuses what has no inside, and
//! [`prepare`] makes the grid of distances and the shell of contact points. The only crate with parry3d.

mod fault;
mod grid;
mod report;
mod shell;
mod solid;
mod triangles;

pub use fault::MeshFault;
pub use grid::{DEFAULT_CELLS, MOST_NODES};
pub use report::{MeshReport, report};
pub use shell::{DEFAULT_POINTS, MOST_POINTS};
pub use solid::{ClosedMesh, MassProperties};
pub use triangles::{Format, MOST_TRIANGLES, Triangles, ascii_stl};

use parry3d::math::Vector;
use softdock_kernels::contact::mesh::{Ball, Mesh};
use softdock_kernels::vector::{Vec3, vec3};

/// How a mesh is made into grid and shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Edge of a cell of the grid \[m\]; none for the longest edge of the mesh over [`DEFAULT_CELLS`].
    pub resolution: Option<f64>,
    /// The grid reaches so far beyond the mesh at least: the largest radius of a point that meets it \[m\].
    pub margin: f64,
    /// About so many contact points; 0 for none.
    pub points: usize,
    /// Area whose points together have the pair's stiffness and damping \[m^2\].
    pub patch: f64,
}

/// Makes grid and shell of a checked solid.
///
/// # Errors
/// If the grid has more than [`MOST_NODES`] nodes.
pub fn prepare(solid: &ClosedMesh, options: &Options) -> Result<Mesh, MeshFault> {
    let (grid, half_thickness) = grid::grid(solid, options)?;
    let [low, high] = solid.bounds();
    let centre = (low + high) * 0.5;
    let vertices: Vec<Vec3<f64>> = solid.mesh().vertices().iter().map(|vertex| of_parry(*vertex)).collect();
    let radius = vertices.iter().map(|vertex| (*vertex - centre).norm()).fold(0.0, f64::max);
    let shell = if options.points == 0 { Vec::new() } else { shell::shell(solid, options.points, options.patch) };
    let triangles = solid.mesh().indices().to_vec();
    Ok(Mesh { grid, shell, ball: Ball { centre, radius }, half_thickness, vertices, triangles })
}

fn of_parry(v: Vector) -> Vec3<f64> {
    vec3(v.x, v.y, v.z)
}

fn to_parry(v: Vec3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// A place as messages show it.
fn place(v: Vec3<f64>) -> String {
    format!("({:.4}, {:.4}, {:.4}) mm", v.x * 1e3, v.y * 1e3, v.z * 1e3)
}
