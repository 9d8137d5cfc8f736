//! The model file of a tossed body as written.

use crate::written::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

/// A box that is tossed onto a plane: pose of its middle in world axes, z up, the plane at z = 0. Each corner is a spring
/// that gives back the square of the restitution of the work done on it, with Coulomb friction.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TossTable {
    /// Mass.
    pub(crate) mass: Quantity,
    /// Moment of inertia about the middle, about every axis.
    pub(crate) inertia: Quantity,
    /// Half the edge of the box.
    pub(crate) half_width: Quantity,
    /// Radius of its corners; default sharp.
    pub(crate) corner_radius: Option<Quantity>,
    /// Speed after a blow over that before.
    pub(crate) restitution: Quantity,
    /// Friction coefficient.
    pub(crate) friction: Quantity,
    /// Stiffness of a corner against the plane, at a depth of 1 mm: stiff, so that a blow is short.
    pub(crate) stiffness: Quantity,
    /// Gravity along -z of the world; default standard gravity.
    pub(crate) gravity: Option<Quantity>,
}
