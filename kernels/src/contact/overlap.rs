//! Overlap of the parts at a given pose: contact points of each against solids of the other, in f64.

use crate::contact::distance::solid_distance;
use crate::contact::profile::Surface;
use crate::contact_parts::{ContactPoint, Side};
use crate::params::Params;
use crate::plant::{Plant, PointSource, PreparedSolid};
use crate::space::{Parts, kinematics, space_masses};
use crate::start::start;
use crate::vector::{Vec3, vec3};
use crate::with_joints;

/// Step aside from the axis of a hole \[m\].
const ASIDE: f64 = 1e-9;

/// How deep a contact point of one part lies in a solid of the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The part with the point.
    pub side: Side,
    /// What the point belongs to.
    pub source: PointSource,
    /// Index of the solid in the other part.
    pub solid: usize,
    /// Depth of the sphere in the solid, negative where they are apart \[m\].
    pub depth: f64,
    /// Point of the sphere that lies deepest in the solid (or next to it), part B's frame \[m\].
    pub place: Vec3<f64>,
    /// Unit normal out of the solid there, part B's frame.
    pub normal: Vec3<f64>,
}

/// The pair of a contact point and a solid that overlaps most, or that is nearest if none overlaps.
///
/// The physics takes the same distance, but for points far from a mesh; its depth of a point is that of the deepest solid.
/// `None` if no point meets a solid.
pub fn deepest_overlap(m: &Plant, parts: &Parts<f64>) -> Option<Overlap> {
    let of_points = m.contacts.iter().map(|contact| (contact.pair, contact.source, contact.point));
    let of_shells = m.shells.iter().flat_map(|shell| {
        let sphere = |position: Vec3<f64>| ContactPoint { position, radius: 0.0 };
        shell.points.iter().map(move |point| (shell.pair, shell.source, sphere(point.position)))
    });
    let pairs = of_points.chain(of_shells).flat_map(|(pair, source, point)| {
        let of = &m.pairs[pair];
        let side = of.points_of;
        let [own, other] = match side {
            Side::A => [parts.a, parts.b],
            Side::B => [parts.b, parts.a],
        };
        let from_other = (own.position - other.position) + own.attitude.rotate(point.position);
        let centre = other.attitude.rotate_back(from_other);
        of.solids.iter().map(move |prepared| {
            let distance = match &prepared.surface {
                Surface::Mesh(grid) => grid.upper_bound(prepared.to_local(centre)),
                _ => solid_distance(prepared, centre).distance,
            };
            let normal = outward_normal(prepared, centre);
            let place = normal.scale_add(-point.radius, centre);
            // From the frame of the part with the solid into that of part B.
            let turned = |direction: Vec3<f64>| parts.b.attitude.rotate_back(other.attitude.rotate(direction));
            let origin = parts.b.attitude.rotate_back(other.position - parts.b.position);
            Overlap {
                side,
                source,
                solid: prepared.index,
                depth: point.radius - distance,
                place: origin + turned(place),
                normal: turned(normal),
            }
        })
    });
    pairs.reduce(|most, next| if next.depth > most.depth { next } else { most })
}

/// Unit normal out of a solid at a point; on the axis of a hole, where all directions are equal, one of them.
fn outward_normal(solid: &PreparedSolid, point: Vec3<f64>) -> Vec3<f64> {
    let asides = [Vec3::zero(), vec3(0.0, 0.0, ASIDE), vec3(0.0, ASIDE, 0.0)];
    let normals = asides.map(|aside| solid_distance(solid, point + aside).normal);
    normals.into_iter().find(|normal| (normal.norm() - 1.0).abs() < 1e-6).unwrap_or(normals[0])
}

/// Motion of the parts at the start of a run in space, inertial axes.
pub fn start_parts(m: &Plant, p: &Params<f64>) -> Parts<f64> {
    with_joints!(m.joints(), of_start(m, p))
}

fn of_start<const N: usize>(m: &Plant, p: &Params<f64>) -> Parts<f64> {
    let masses = space_masses(p);
    kinematics(m, &masses, &start::<f64, N>(m, p, &masses)).parts
}

/// Distance by which part A must stand back along -x of the contact frame so that no parts overlap \[m\].
///
/// 0 if none overlap; `None` if `most` is not enough. Exact to a micrometre where the overlap falls all the way.
pub fn retreat(m: &Plant, parts: &Parts<f64>, most: f64) -> Option<f64> {
    let overlaps = |back: f64| {
        let mut moved = *parts;
        moved.a.position = moved.a.position - vec3(back, 0.0, 0.0);
        deepest_overlap(m, &moved).is_some_and(|overlap| overlap.depth > 0.0)
    };
    if !overlaps(0.0) {
        return Some(0.0);
    }
    let (mut low, mut high) = (0.0, 1e-3);
    while overlaps(high) {
        if high >= most {
            return None;
        }
        (low, high) = (high, (2.0 * high).min(most));
    }
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if overlaps(middle) { low = middle } else { high = middle }
    }
    Some(high)
}
