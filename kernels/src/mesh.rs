//! Meshes as solids: a grid of signed distances, and a shell of contact points with their areas; made by the loader.

use crate::bundle;
use crate::lookup::LookupTable;
use crate::real::Real;
use crate::vector::{Vec3, vec3};

bundle! {
    /// A contact point of a mesh's shell: a place on its surface that stands for the area around it.
    ShellPoint {
        position: Vec3<R>, "m", "place on the surface";
        normal: Vec3<R>, "1", "unit normal out of the mesh";
        share: R, "1", "its area over that which has the pair's stiffness and damping";
    }
}

/// Words of a shell point in the kernels' tables.
pub const SHELL_WORDS: usize = 8;

/// Signed distances (positive outside) at the nodes of a grid of cubes, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// The first node \[m\].
    pub origin: Vec3<f64>,
    /// Edge of a cell \[m\].
    pub cell: f64,
    /// Nodes along x, y and z, at least 2 each.
    pub nodes: [usize; 3],
    /// The mesh is at least so far from the grid's faces \[m\].
    pub margin: f64,
    /// The distances \[m\].
    pub table: LookupTable,
}

/// Distance at a point and its gradient, both of the interpolation.
#[derive(Clone, Copy, Debug)]
pub struct Interpolated<R> {
    /// Distance \[m\].
    pub distance: R,
    /// Unit vector along the gradient; zero where there is none.
    pub normal: Vec3<R>,
}

impl Grid {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.nodes.iter().map(|nodes| nodes - 1).product()
    }

    /// Trilinear interpolation and its own gradient, so that the force of a spring is the gradient of its energy.
    ///
    /// Beyond the grid the distance is that to the grid's nearest face and the margin: a lower bound.
    #[inline(always)]
    pub fn read<R: Real>(&self, point: Vec3<R>) -> Interpolated<R> {
        let (zero, last) = (R::lit(0.0), self.nodes.map(|nodes| (nodes - 1) as f64));
        let place = (point - Vec3::lit(self.origin)) * R::lit(1.0 / self.cell);
        let within = place.zip(vec3(last[0], last[1], last[2]), |at, last| at.max(zero).min(R::lit(last)));
        let beyond = (place - within).norm();
        let corner = within.zip(vec3(last[0], last[1], last[2]), |at, last| at.floor().min(R::lit(last - 1.0)));
        let share = within - corner;
        let [row, layer] = [self.nodes[0], self.nodes[0] * self.nodes[1]];
        let index = corner.z.mul_add(R::lit(layer as f64), corner.y.mul_add(R::lit(row as f64), corner.x));
        let at = |step: usize| R::look_up(&self.table, index, step);
        let between = |low: R, high: R, share: R| (high - low).mul_add(share, low);
        // Along x on four edges, then along y on two, then along z.
        let [a, b] = [[at(0), at(1)], [at(row), at(row + 1)]];
        let [c, d] = [[at(layer), at(layer + 1)], [at(layer + row), at(layer + row + 1)]];
        let rise = |edge: [R; 2]| edge[1] - edge[0];
        let on = |edge: [R; 2]| between(edge[0], edge[1], share.x);
        let (low, high) = ([on(a), on(b)], [on(c), on(d)]);
        let gradient = vec3(
            between(between(rise(a), rise(b), share.y), between(rise(c), rise(d), share.y), share.z),
            between(rise(low), rise(high), share.z),
            between(high[0], high[1], share.y) - between(low[0], low[1], share.y),
        );
        let inside = between(between(low[0], low[1], share.y), between(high[0], high[1], share.y), share.z);
        let outside = beyond.mul_add(R::lit(self.cell), R::lit(self.margin));
        Interpolated {
            distance: R::select(zero.lt(beyond), outside, inside),
            normal: gradient * (R::lit(1.0) / gradient.norm().max(R::lit(1e-20))),
        }
    }
}

impl Grid {
    /// Distance at a place, beyond the grid an upper bound: for figures and messages.
    pub fn upper_bound(&self, point: Vec3<f64>) -> f64 {
        let last = vec3(self.nodes[0], self.nodes[1], self.nodes[2]).map(|nodes| (nodes - 1) as f64 * self.cell);
        // A hair inside: rounding must not put a place on a face beyond it.
        let hair = 1e-9 * self.cell;
        let within = (point - self.origin).zip(last, |at, last| at.clamp(hair, last - hair)) + self.origin;
        self.read(within).distance + (point - within).norm()
    }
}

/// A ball that contains something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre \[m\].
    pub centre: Vec3<f64>,
    /// Its radius \[m\].
    pub radius: f64,
}

/// A closed mesh of triangles in its own frame, prepared for contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Distances to it.
    pub grid: Grid,
    /// Its contact points; none if only the points of the other part meet it.
    pub shell: Vec<ShellPoint<f64>>,
    /// Contains the mesh.
    pub ball: Ball,
    /// Greatest depth inside it: deeper in, another side is nearer \[m\].
    pub half_thickness: f64,
    /// Corners of its triangles \[m\].
    pub vertices: Vec<Vec3<f64>>,
    /// Its triangles, by their corners, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Ends along an axis of its frame \[m\].
    pub fn ends(&self, of: impl Fn(&Vec3<f64>) -> f64) -> [f64; 2] {
        let values = self.vertices.iter().map(of);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of a function of the place.
    fn grid(nodes: [usize; 3], of: impl Fn(Vec3<f64>) -> f64) -> Grid {
        let (origin, cell) = (vec3(-0.2, 0.1, 0.3), 0.05);
        let places = (0..nodes[2]).flat_map(|z| (0..nodes[1]).flat_map(move |y| (0..nodes[0]).map(move |x| [x, y, z])));
        let at = |[x, y, z]: [usize; 3]| origin + vec3(x as f64, y as f64, z as f64) * cell;
        let values = places.map(|place| of(at(place)) as f32).collect::<Vec<_>>();
        Grid { origin, cell, nodes, margin: 0.02, table: LookupTable { values: values.into(), offset: 0 } }
    }

    #[test]
    fn plane_is_read_exactly_everywhere_inside() {
        let normal = vec3(0.48, 0.6, 0.64);
        let grid = grid([5, 4, 6], |place| normal.dot(place) - 0.3);
        for point in
            [vec3(-0.199, 0.101, 0.301), vec3(-0.07, 0.21, 0.44), vec3(-0.001, 0.249, 0.549), vec3(-0.1, 0.15, 0.35)]
        {
            let read = grid.read(point);
            assert!((read.distance - (normal.dot(point) - 0.3)).abs() < 1e-7, "{read:?}");
            assert!((read.normal - normal).norm() < 1e-5, "{read:?}");
        }
    }

    #[test]
    fn normal_is_along_the_gradient_of_the_interpolated_distance() {
        let grid = grid([5, 4, 6], |place| (place - vec3(-0.1, 0.2, 0.4)).norm() - 0.05);
        let (point, step) = (vec3(-0.043, 0.177, 0.512), 1e-6);
        let slope =
            |aside: Vec3<f64>| (grid.read(point + aside).distance - grid.read(point - aside).distance) / (2.0 * step);
        let gradient = vec3(slope(vec3(step, 0.0, 0.0)), slope(vec3(0.0, step, 0.0)), slope(vec3(0.0, 0.0, step)));
        let normal = grid.read(point).normal;
        assert!((gradient * (1.0 / gradient.norm()) - normal).norm() < 1e-8, "{gradient:?} {normal:?}");
    }

    #[test]
    fn distance_beyond_the_grid_lies_between_its_bounds() {
        // A ball whose surface is the margin away from the nearest faces.
        let centre = vec3(-0.1, 0.175, 0.425);
        let grid = grid([5, 4, 6], |place| (place - centre).norm() - 0.055);
        for point in [vec3(-0.4, 0.2, 0.4), vec3(0.3, 0.9, 0.4), vec3(-0.1, 0.175, 5.0), vec3(f64::MAX, 0.0, 0.0)] {
            let distance = grid.read(point).distance;
            let exact = (point - centre).norm() - 0.055;
            assert!(distance >= grid.margin && distance <= exact, "{point:?}: {distance}");
            assert!(grid.upper_bound(point) >= exact * (1.0 - 1e-12), "{point:?}: {}", grid.upper_bound(point));
        }
    }
}
