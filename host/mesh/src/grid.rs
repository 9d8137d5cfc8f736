//! The grid of signed distances of a mesh.

use crate::fault::MeshFault;
use crate::solid::ClosedMesh;
use crate::{Options, of_parry, to_parry};
use parry3d::query::{PointQuery, PointQueryWithLocation};
use rayon::prelude::*;
use softdock_kernels::contact::mesh::Grid;
use softdock_kernels::lookup::LookupTable;
use softdock_kernels::vector::vec3;

/// Cells along the longest edge of a mesh, unless a resolution is stated.
pub const DEFAULT_CELLS: f64 = 160.0;

/// Most nodes of a grid: its last index is a whole number of single precision, and 64 MiB are half a WebGPU binding.
pub const MOST_NODES: usize = (1 << 24) - 1;

/// Most nodes of a grid whose resolution is not stated: 32 MiB.
const MOST_DEFAULT_NODES: usize = 1 << 23;

/// Cells between the mesh with its margin and the faces of the grid: the gradient has neighbours there.
const RIM: f64 = 2.0;

/// The nearest triangle of a node bounds the search of the next, but for rounding.
const ROUNDING: f64 = 1.0 + 1e-9;

/// The grid, and the greatest depth inside the mesh \[m\].
pub(crate) fn grid(solid: &ClosedMesh, options: &Options) -> Result<(Grid, f64), MeshFault> {
    let [low, high] = solid.bounds();
    let size = high - low;
    let longest = size.x.max(size.y).max(size.z);
    let nodes = |cell: f64| {
        let along = |size: f64| ((size + 2.0 * options.margin) / cell + 2.0 * RIM).ceil() + 1.0;
        [along(size.x), along(size.y), along(size.z)]
    };
    let count = |cell: f64| nodes(cell).iter().product::<f64>();
    let cell = match options.resolution {
        Some(cell) if count(cell) > MOST_NODES as f64 => {
            let least = coarsened(cell, MOST_NODES, count);
            let message = format!("a resolution of {:.4} mm gives {:.0} nodes", cell * 1e3, count(cell));
            let remedy =
                format!("write a resolution of at least \"{:.4} mm\": {MOST_NODES} nodes at most", least * 1e3);
            return Err(MeshFault::new(message, remedy));
        }
        Some(cell) => cell,
        None => coarsened(longest / DEFAULT_CELLS, MOST_DEFAULT_NODES, count),
    };
    let nodes = nodes(cell).map(|count| count as usize);
    // The mesh in the middle: what rounding up to whole cells adds lies on both sides.
    let span = vec3(nodes[0] as f64 - 1.0, nodes[1] as f64 - 1.0, nodes[2] as f64 - 1.0) * cell;
    let origin = (low + high) * 0.5 - span * 0.5;
    let layers: Vec<Vec<f32>> = (0..nodes[2])
        .into_par_iter()
        .map(|z| {
            let rows = (0..nodes[1]).flat_map(|y| {
                let start = origin + vec3(0.0, y as f64, z as f64) * cell;
                row(solid, start, cell, nodes[0])
            });
            rows.collect()
        })
        .collect();
    let values = layers.concat();
    let deepest = values.iter().copied().fold(0.0, f32::min);
    let table = LookupTable { values: values.into(), offset: 0 };
    Ok((Grid { origin, cell, nodes, margin: options.margin + cell, table }, -f64::from(deepest)))
}

/// The least cell, growing from `cell` by hundredths, with at most so many nodes.
fn coarsened(cell: f64, most: usize, count: impl Fn(f64) -> f64) -> f64 {
    let mut cell = cell;
    while count(cell) > most as f64 {
        cell *= 1.01;
    }
    cell
}

/// Distances along x. The nearest triangle of a node is most often that of the next: its distance bounds the search.
fn row(solid: &ClosedMesh, start: softdock_kernels::vector::Vec3<f64>, cell: f64, nodes: usize) -> Vec<f32> {
    let (mesh, mut last) = (solid.mesh(), None);
    let at = |index: usize| start + vec3(index as f64 * cell, 0.0, 0.0);
    let of = |index: usize| {
        let place = to_parry(at(index));
        let bound = last.map_or(f64::MAX, |triangle| mesh.triangle(triangle).distance_to_local_point(place, true));
        let near = mesh.project_local_point_and_get_location_with_max_dist(place, false, bound * ROUNDING);
        let (projection, (triangle, _)) =
            near.unwrap_or_else(|| mesh.project_local_point_and_get_location(place, false));
        let distance = (of_parry(projection.point) - at(index)).norm();
        last = Some(triangle);
        (if projection.is_inside { -distance } else { distance }) as f32
    };
    (0..nodes).map(of).collect()
}
