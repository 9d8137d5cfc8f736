//! What the parts are made of: points, solids, materials by pair, fingers and latch; plain f64 in SI.

use crate::material::{NormalLaw, Pair};
use crate::mesh::Mesh;
use crate::vector::{Pose, Vec3};
use std::sync::Arc;

/// One of the two parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The part on the end-effector.
    A,
    /// The part on the target.
    B,
}

impl Side {
    /// Both parts.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// The other part.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// A part in its own frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartShape {
    /// Contact points besides those of the solids.
    pub points: Vec<ContactPoint>,
    /// Solids; the part is their union.
    pub solids: Vec<Solid>,
}

impl PartShape {
    /// All its points and solids.
    pub fn members(&self) -> Members {
        Members { points: (0..self.points.len()).collect(), solids: (0..self.solids.len()).collect() }
    }
}

/// The parts and how they push: contact points of each against the solids of the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Part A.
    pub a: PartShape,
    /// Part B.
    pub b: PartShape,
    /// The normal force of the points and solids that are in no material pair; its properties are in
    /// [`Params`](crate::params::Params).
    pub law: NormalLaw,
    /// Points and solids with properties of their own. No point and solid are together in two of them.
    pub pairs: Vec<MaterialPair>,
    /// Radius of the contact patch of their points, for friction against spinning; 0 = none \[m\].
    pub patch_radius: f64,
    /// The contact may pull and never opens (the linear oracles only).
    pub bilateral: bool,
    /// The capture latch, if there is one.
    pub latch: Option<Latch>,
    /// Members of part A that move in its frame as its grip closes; none: part A is rigid.
    pub fingers: Vec<Finger>,
}

/// What moves together in part A's frame as its grip closes.
#[derive(Clone, Debug, PartialEq)]
pub struct Finger {
    /// Members of part A.
    pub members: Members,
    /// Way from open to closed, part A's axes \[m\].
    pub travel: Vec3<f64>,
}

impl Contact {
    /// One of the parts.
    pub fn part(&self, side: Side) -> &PartShape {
        match side {
            Side::A => &self.a,
            Side::B => &self.b,
        }
    }
}

/// Points and solids of a part, by their indices in its [`PartShape`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// Contact points.
    pub points: Vec<usize>,
    /// Solids, with the contact points that they have.
    pub solids: Vec<usize>,
}

/// Points and solids of both parts that meet with properties of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialPair {
    /// Of part A.
    pub a: Members,
    /// Of part B.
    pub b: Members,
    /// The normal force.
    pub law: NormalLaw,
    /// Its nominal properties.
    pub properties: Pair<f64>,
    /// Radius of the contact patch of its points, for friction against spinning; 0 = none \[m\].
    pub patch_radius: f64,
}

impl MaterialPair {
    /// What it has of a part.
    pub fn members(&self, side: Side) -> &Members {
        match side {
            Side::A => &self.a,
            Side::B => &self.b,
        }
    }
}

/// A contact point: a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Centre in the part's frame \[m\].
    pub position: Vec3<f64>,
    /// Radius \[m\]; 0 is a point.
    pub radius: f64,
}

/// A solid with a signed distance; `frame` places it in its part.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Pose of the solid in its part's frame.
    pub frame: Pose<f64>,
    /// Its shape.
    pub shape: Shape,
}

/// Shapes, each in its own frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Half space x >= 0: its face looks towards -x.
    Plane,
    /// A ball about the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// A box about the origin.
    Box {
        /// Half edge lengths \[m\].
        half: Vec3<f64>,
    },
    /// A cylinder with round ends about x, its middle at the origin.
    Capsule {
        /// Radius \[m\].
        radius: f64,
        /// Distance between the centres of the ends \[m\].
        length: f64,
        /// Contact points along the axis, both ends among them.
        points: usize,
    },
    /// A cylinder about x, its middle at the origin.
    Cylinder {
        /// Radius \[m\].
        radius: f64,
        /// Length \[m\].
        length: f64,
        /// Contact points on each rim.
        points: usize,
    },
    /// A solid frustum about x, from x = 0 to x = length.
    Frustum {
        /// Radius at x = 0, above 0 \[m\].
        front: f64,
        /// Radius at x = length, above 0 \[m\].
        back: f64,
        /// Length \[m\].
        length: f64,
        /// Contact points on each rim.
        points: usize,
    },
    /// A ring about x with a round cross-section.
    Ring {
        /// Radius of the circle of its tube's centre \[m\].
        radius: f64,
        /// Radius of the tube \[m\].
        tube: f64,
        /// Contact points on the circle.
        points: usize,
    },
    /// A hollow cone (drogue) about the x axis that opens towards -x: material outside the cone surface between
    /// the mouth at x = 0 and the bottom at x = depth, closed by the bottom disc.
    Cone {
        /// Radius of the mouth \[m\].
        mouth: f64,
        /// Radius of the bottom \[m\].
        bottom: f64,
        /// Depth from mouth to bottom \[m\].
        depth: f64,
    },
    /// A blind round hole about the x axis in the half space x >= 0, with a chamfer at its mouth.
    Bore {
        /// Radius of the hole \[m\].
        radius: f64,
        /// Depth of the hole \[m\].
        depth: f64,
        /// Width and height of the 45 degree chamfer \[m\]; 0 = none.
        chamfer: f64,
        /// Contact points on the edge of the hole, behind the chamfer.
        points: usize,
    },
    /// A closed mesh of triangles.
    Mesh(Arc<Mesh>),
}

/// Half thickness of a solid without another side \[m\].
pub const ENDLESS: f64 = 1e3;

impl Shape {
    /// Ends along x of a shape that is not endless \[m\].
    pub fn ends(&self) -> [f64; 2] {
        match *self {
            Self::Plane => [0.0, 0.0],
            Self::Sphere { .. } | Self::Ring { .. } => [0.0, 0.0],
            Self::Box { half } => [-half.x, half.x],
            Self::Capsule { length, .. } | Self::Cylinder { length, .. } => [-0.5 * length, 0.5 * length],
            Self::Frustum { length, .. } => [0.0, length],
            Self::Cone { depth, .. } | Self::Bore { depth, .. } => [0.0, depth],
            Self::Mesh(ref mesh) => mesh.ends(|vertex| vertex.x),
        }
    }

    /// Greatest distance of its surface from x; 0 for a plane \[m\].
    pub fn across(&self) -> f64 {
        match *self {
            Self::Plane => 0.0,
            Self::Sphere { radius } | Self::Capsule { radius, .. } | Self::Cylinder { radius, .. } => radius,
            Self::Box { half } => half.y.hypot(half.z),
            Self::Frustum { front, back, .. } => front.max(back),
            Self::Ring { radius, tube, .. } => radius + tube,
            Self::Cone { mouth, .. } => mouth,
            Self::Bore { radius, chamfer, .. } => radius + chamfer,
            Self::Mesh(ref mesh) => mesh.ends(|vertex| vertex.y.hypot(vertex.z))[1],
        }
    }

    /// Radius about the origin within which it is; of a plane and of the face around a hole only the hole \[m\].
    pub fn reach(&self) -> f64 {
        let [front, back] = self.ends();
        match self {
            Self::Box { half } => half.norm(),
            Self::Mesh(mesh) => mesh.ends(|vertex| vertex.norm())[1],
            _ => front.abs().max(back).max(self.across()),
        }
    }

    /// Depth beyond which the other side of the shape is nearer \[m\]; [`ENDLESS`] for one without another side.
    pub fn half_thickness(&self) -> f64 {
        match *self {
            Self::Plane | Self::Cone { .. } | Self::Bore { .. } => ENDLESS,
            Self::Sphere { radius } | Self::Capsule { radius, .. } => radius,
            Self::Box { half } => half.x.min(half.y).min(half.z),
            Self::Cylinder { radius, length, .. } => radius.min(0.5 * length),
            Self::Frustum { front, back, length, .. } => (0.5 * (front + back)).min(0.5 * length),
            Self::Ring { tube, .. } => tube,
            Self::Mesh(ref mesh) => mesh.half_thickness,
        }
    }

    /// Whether it is a mesh with contact points.
    pub fn has_shell(&self) -> bool {
        matches!(self, Self::Mesh(mesh) if !mesh.shell.is_empty())
    }

    /// Whether its contact points are spheres that have its whole surface.
    pub fn is_round(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Capsule { .. } | Self::Ring { .. })
    }
}

/// The gate and the hold of a capture latch. It closes when part A's latch point is inside the gate, and then
/// holds A's latch frame to B's seat frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Latch {
    /// Latch point in part A's frame \[m\].
    pub point: Vec3<f64>,
    /// Seat in part B's frame \[m\].
    pub seat: Vec3<f64>,
    /// The gate is open while the latch point is within this axial distance of the seat \[m\].
    pub depth: f64,
    /// ... and within this radial distance of the seat's axis \[m\].
    pub offset: f64,
    /// ... and the axes of A and B differ by less than this angle \[rad\].
    pub angle: f64,
    /// ... and the latch point moves slower than this relative to the seat \[m/s\].
    pub speed: f64,
    /// Latches that close together and hold at places of their own; none: the latch holds at its point.
    pub hooks: Vec<Hook>,
    /// ... and each hook that works is within this distance of its seat \[m\].
    pub hook_reach: f64,
}

/// One of several latches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hook {
    /// Its point in part A's frame \[m\].
    pub point: Vec3<f64>,
    /// Its seat in part B's frame \[m\].
    pub seat: Vec3<f64>,
}
