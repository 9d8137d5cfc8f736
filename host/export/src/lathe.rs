//! Triangles of solids of revolution about x, as OBJ files.

use softdock_kernels::model::Shape;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Triangles around a solid, and around the tube of a ring.
const AROUND: usize = 48;

/// A closed surface: vertices \[m\], and triangles with outward normals.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Surface {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[usize; 3]>,
}

impl Surface {
    /// The surface of a shape that formats have no primitive for; `None` for the others.
    ///
    /// Holes are the walls of a block of their own depth and twice their largest radius.
    pub(crate) fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Frustum { front, back, length, .. } => {
                Some(Self::turned(&[[0.0, 0.0], [0.0, *front], [*length, *back], [*length, 0.0]]))
            }
            Shape::Ring { radius, tube, .. } => {
                let circle = (0..=AROUND / 2).map(|at| {
                    let angle = TAU * at as f64 / (AROUND / 2) as f64;
                    [-tube * angle.cos(), radius + tube * angle.sin()]
                });
                Some(Self::turned(&circle.collect::<Vec<_>>()))
            }
            Shape::Cone { mouth, bottom, depth } => {
                Some(Self::hole(&[[0.0, *mouth], [*depth, *bottom]], *depth, mouth.max(*bottom)))
            }
            Shape::Bore { radius, depth, chamfer, .. } => {
                let rim = radius + chamfer;
                let wall = [[0.0, rim], [*chamfer, *radius], [*depth, *radius]];
                Some(Self::hole(if *chamfer > 0.0 { &wall } else { &wall[1..] }, *depth, rim))
            }
            Shape::Mesh(mesh) => Some(Self {
                vertices: mesh.vertices.iter().map(|vertex| [vertex.x, vertex.y, vertex.z]).collect(),
                triangles: mesh.triangles.iter().map(|triangle| triangle.map(|at| at as usize)).collect(),
            }),
            Shape::Plane
            | Shape::Sphere { .. }
            | Shape::Box { .. }
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. } => None,
        }
    }

    /// Material around a blind hole: outside, floor behind the hole, walls inwards.
    fn hole(wall: &[[f64; 2]], depth: f64, widest: f64) -> Self {
        let floor = 0.2 * depth;
        let outside = 2.0 * widest;
        let mut outline = vec![[depth, 0.0]];
        outline.extend(wall.iter().rev());
        outline.extend([[0.0, outside], [depth + floor, outside], [depth + floor, 0.0]]);
        Self::turned(&outline)
    }

    /// The surface of an outline of places along x and radii, which runs clockwise: from the least x outwards to the greatest.
    fn turned(outline: &[[f64; 2]]) -> Self {
        let mut surface = Self::default();
        let rings: Vec<Vec<usize>> = outline.iter().map(|[x, radius]| surface.ring(*x, *radius)).collect();
        for pair in rings.windows(2) {
            let (one, two) = (&pair[0], &pair[1]);
            for at in 0..AROUND {
                let next = (at + 1) % AROUND;
                let corner = |ring: &[usize], at: usize| ring[at % ring.len()];
                let (a, b, c, d) = (corner(one, at), corner(one, next), corner(two, next), corner(two, at));
                for triangle in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = triangle;
                    if p != q && q != r && r != p {
                        surface.triangles.push(triangle);
                    }
                }
            }
        }
        surface
    }

    /// Vertices around x; a single one on the axis.
    fn ring(&mut self, x: f64, radius: f64) -> Vec<usize> {
        let first = self.vertices.len();
        let count = if radius > 0.0 { AROUND } else { 1 };
        for at in 0..count {
            let (sin, cos) = (TAU * at as f64 / AROUND as f64).sin_cos();
            self.vertices.push([x, radius * cos, radius * sin]);
        }
        (first..first + count).collect()
    }

    /// Enclosed volume \[m^3\].
    #[cfg(test)]
    fn volume(&self) -> f64 {
        let of = |[a, b, c]: &[usize; 3]| {
            let [a, b, c] = [a, b, c].map(|at| self.vertices[*at]);
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        self.triangles.iter().map(of).sum::<f64>() / 6.0
    }

    /// The text of an OBJ file.
    pub(crate) fn obj(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.vertices {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn surfaces_enclose_the_volume_of_their_solid() {
        // A polygon of 48 corners has this share of its circle's area.
        let share = (TAU / AROUND as f64).sin() * AROUND as f64 / TAU;
        let volume = |shape: Shape| Surface::of(&shape).expect("a surface").volume();
        let frustum = volume(Shape::Frustum { front: 0.1, back: 0.3, length: 0.5, points: 0 });
        let exact = PI * 0.5 / 3.0 * (0.01 + 0.03 + 0.09) * share;
        assert!((frustum / exact - 1.0).abs() < 1e-12, "{frustum} and {exact}");
        let ring = volume(Shape::Ring { radius: 0.5, tube: 0.05, points: 0 });
        let exact = 2.0 * PI * PI * 0.5 * 0.0025;
        assert!((ring / exact - 1.0).abs() < 0.02, "{ring} and {exact}");
        // A block of radius 0.8 and height 0.6 without the hole.
        let cone = volume(Shape::Cone { mouth: 0.4, bottom: 0.1, depth: 0.5 });
        let exact = (PI * 0.64 * 0.6 - PI * 0.5 / 3.0 * (0.16 + 0.04 + 0.01)) * share;
        assert!((cone / exact - 1.0).abs() < 1e-12, "{cone} and {exact}");
        let bore = volume(Shape::Bore { radius: 0.1, depth: 0.5, chamfer: 0.02, points: 0 });
        let chamfer = PI * 0.02 / 3.0 * (0.0144 + 0.012 + 0.01);
        let exact = (PI * 0.24 * 0.24 * 0.6 - chamfer - PI * 0.01 * 0.48) * share;
        assert!((bore / exact - 1.0).abs() < 1e-12, "{bore} and {exact}");
    }
}
