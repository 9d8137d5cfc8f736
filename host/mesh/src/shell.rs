//! The shell of a mesh: contact points spread evenly over its faces, with those on sharp edges and corners.
//!
//! Faces are parts of the surface between sharp edges. Each face has points of its own, also on its edges, with the area
//! of the pieces of the face that are nearest to them: all areas together are the surface, whatever the number of points.

use crate::solid::ClosedMesh;
use crate::{of_parry, to_parry};
use parry3d::query::PointQuery;
use softdock_kernels::contact::mesh::ShellPoint;
use softdock_kernels::vector::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// Contact points of a mesh, unless stated.
pub const DEFAULT_POINTS: usize = 500;

/// Most contact points of a mesh.
pub const MOST_POINTS: usize = 5_000;

/// An edge between triangles whose normals differ by more than this angle is sharp \[rad\].
const SHARP: f64 = 0.5;

/// Longest edge of a piece over the spacing of the points.
const PIECE: f64 = 0.4;

/// Distance over the spacing up to which a point covers the surface: about one point for each square of the spacing.
const COVERED: f64 = 0.9;

/// Least distance over the spacing of two points of an edge.
const APART: f64 = 0.6;

/// A small piece of a face.
struct Piece {
    centre: Vec3<f64>,
    normal: Vec3<f64>,
    area: f64,
}

/// Triangles between sharp edges.
struct Face {
    pieces: Vec<Piece>,
    /// Points of its edges, corners first.
    rim: Vec<Vec3<f64>>,
}

/// About so many points; `patch` has the whole stiffness \[m^2\].
pub(crate) fn shell(solid: &ClosedMesh, points: usize, patch: f64) -> Vec<ShellPoint<f64>> {
    let spacing = (solid.area() / points as f64).sqrt();
    let faces = faces(solid, spacing);
    faces.iter().flat_map(|face| face_points(solid, face, spacing, patch)).collect()
}

/// Points of a face: those of its rim, then always the piece that is farthest from all.
fn face_points(solid: &ClosedMesh, face: &Face, spacing: f64, patch: f64) -> Vec<ShellPoint<f64>> {
    let mut places: Vec<Vec3<f64>> = face.rim.clone();
    let mut nearest = vec![(f64::MAX, 0); face.pieces.len()];
    let join = |nearest: &mut [(f64, usize)], number: usize, place: Vec3<f64>| {
        for (piece, known) in face.pieces.iter().zip(nearest) {
            let distance = (piece.centre - place).norm();
            if distance < known.0 {
                *known = (distance, number);
            }
        }
    };
    places.iter().enumerate().for_each(|(number, place)| join(&mut nearest, number, *place));
    loop {
        let farthest = (0..nearest.len()).max_by(|a, b| nearest[*a].0.total_cmp(&nearest[*b].0));
        let Some(farthest) = farthest.filter(|piece| nearest[*piece].0 > COVERED * spacing) else { break };
        places.push(face.pieces[farthest].centre);
        join(&mut nearest, places.len() - 1, face.pieces[farthest].centre);
    }
    let mut cells = vec![(0.0, Vec3::zero(), Vec3::zero()); places.len()];
    for (piece, (_, number)) in face.pieces.iter().zip(&nearest) {
        let (area, centre, normal) = &mut cells[*number];
        *area += piece.area;
        *centre = piece.centre.scale_add(piece.area, *centre);
        *normal = piece.normal.scale_add(piece.area, *normal);
    }
    let mut out = Vec::with_capacity(places.len() + face.rim.len());
    for (number, (area, centre, normal)) in cells.into_iter().enumerate() {
        if area <= 0.0 || normal.norm() <= 0.0 {
            continue;
        }
        let (normal, centroid) = (normal * (1.0 / normal.norm()), centre * (1.0 / area));
        let mut join = |position: Vec3<f64>, area: f64| out.push(ShellPoint { position, normal, share: area / patch });
        // The areas keep their centroids, so that the sum of a depth that is linear over a plane is its integral.
        if number >= face.rim.len() {
            join(on_surface(solid, centroid), area);
        } else {
            // A point of the rim stays there with half its area; the other half lies as far on the other side.
            join(places[number], 0.5 * area);
            join(on_surface(solid, centroid * 2.0 - places[number]), 0.5 * area);
        }
    }
    out
}

fn on_surface(solid: &ClosedMesh, place: Vec3<f64>) -> Vec3<f64> {
    of_parry(solid.mesh().project_local_point(to_parry(place), false).point)
}

/// The faces with their pieces and the points of their rims.
fn faces(solid: &ClosedMesh, spacing: f64) -> Vec<Face> {
    let (mesh, indices) = (solid.mesh(), solid.mesh().indices());
    let corners: Vec<Vec3<f64>> = mesh.vertices().iter().map(|vertex| of_parry(*vertex)).collect();
    let normals: Vec<Vec3<f64>> =
        indices.iter().map(|triangle| normal(&triangle.map(|c| corners[c as usize]))).collect();
    let edges = edges(indices);
    let is_sharp = |sides: &[usize]| is_sharp(&normals, sides);
    let mut face_of: Vec<usize> = (0..indices.len()).collect();
    for sides in edges.values().filter(|sides| !is_sharp(sides)) {
        let [one, two] = [root(&mut face_of, sides[0]), root(&mut face_of, sides[1])];
        face_of[one.max(two)] = one.min(two);
    }
    let roots: Vec<usize> = (0..indices.len()).map(|triangle| root(&mut face_of, triangle)).collect();
    let mut faces: BTreeMap<usize, (Face, BTreeSet<[u32; 2]>)> = BTreeMap::new();
    for (triangle, face) in roots.iter().enumerate() {
        let (own, _) =
            faces.entry(*face).or_insert_with(|| (Face { pieces: Vec::new(), rim: Vec::new() }, BTreeSet::new()));
        cut(indices[triangle].map(|c| corners[c as usize]), PIECE * spacing, &mut own.pieces);
    }
    for (edge, sides) in edges.iter().filter(|(_, sides)| is_sharp(sides)) {
        for triangle in sides {
            faces.get_mut(&roots[*triangle]).expect("every triangle has a face").1.insert(*edge);
        }
    }
    let with_rim = |(mut face, edges): (Face, BTreeSet<[u32; 2]>)| {
        face.rim = rim(&corners, &edges, spacing);
        face
    };
    faces.into_values().map(with_rim).collect()
}

/// The triangles of each edge, two in a closed mesh.
pub(crate) fn edges(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], Vec<usize>> {
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (number, [a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.entry([*from.min(to), *from.max(to)]).or_default().push(number);
        }
    }
    edges
}

/// Whether an edge between two triangles is sharp.
pub(crate) fn is_sharp(normals: &[Vec3<f64>], sides: &[usize]) -> bool {
    normals[sides[0]].dot(normals[sides[1]]) < SHARP.cos()
}

/// The first triangle of a triangle's face; shortens the way to it.
fn root(face_of: &mut [usize], triangle: usize) -> usize {
    let mut at = triangle;
    while face_of[at] != at {
        face_of[at] = face_of[face_of[at]];
        at = face_of[at];
    }
    at
}

pub(crate) fn normal(corners: &[Vec3<f64>; 3]) -> Vec3<f64> {
    let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    across * (1.0 / across.norm().max(f64::MIN_POSITIVE))
}

/// Halves a triangle at its longest edge until its pieces are small.
fn cut(corners: [Vec3<f64>; 3], longest: f64, out: &mut Vec<Piece>) {
    let [a, b, c] = corners;
    let lengths = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
    let longer = (0..3).max_by(|one, two| lengths[*one].total_cmp(&lengths[*two])).expect("three edges");
    if lengths[longer] <= longest {
        let area = 0.5 * (b - a).cross(c - a).norm();
        out.push(Piece { centre: (a + b + c) * (1.0 / 3.0), normal: normal(&corners), area });
        return;
    }
    let [from, to, apex] = [corners[longer], corners[(longer + 1) % 3], corners[(longer + 2) % 3]];
    let middle = (from + to) * 0.5;
    cut([from, middle, apex], longest, out);
    cut([middle, to, apex], longest, out);
}

/// Points along sharp edges: corners first, then evenly, none too near another.
fn rim(corners: &[Vec3<f64>], edges: &BTreeSet<[u32; 2]>, spacing: f64) -> Vec<Vec3<f64>> {
    let mut at: BTreeMap<u32, Vec<Vec3<f64>>> = BTreeMap::new();
    for [a, b] in edges {
        let along = corners[*b as usize] - corners[*a as usize];
        let along = along * (1.0 / along.norm());
        at.entry(*a).or_default().push(along);
        at.entry(*b).or_default().push(-along);
    }
    let is_corner = |away: &[Vec3<f64>]| away.len() != 2 || -away[0].dot(away[1]) < SHARP.cos();
    let first = at.iter().filter(|(_, away)| is_corner(away)).map(|(corner, _)| corners[*corner as usize]);
    let along = edges.iter().flat_map(|[a, b]| {
        let (from, to) = (corners[*a as usize], corners[*b as usize]);
        let steps = ((to - from).norm() / spacing).ceil().max(1.0);
        (0..=steps as usize).map(move |step| from + (to - from) * (step as f64 / steps))
    });
    let mut out: Vec<Vec3<f64>> = Vec::new();
    for place in first.chain(along) {
        if out.iter().all(|other| (*other - place).norm() >= APART * spacing) {
            out.push(place);
        }
    }
    out
}
