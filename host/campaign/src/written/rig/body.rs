//! The model file of a free body as written.

use crate::written::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

/// A free body without gravity under known wrenches, a recorded wrench acting from its stamp to the next. Wrench,
/// acceleration of the origin and rate in body axes, moments about their origin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyTable {
    /// Mass of the whole.
    pub(crate) mass: Quantity,
    /// Its centre of mass along x; default the origin.
    pub(crate) centre_x: Option<Quantity>,
    /// Its centre of mass along y; default the origin.
    pub(crate) centre_y: Option<Quantity>,
    /// Its centre of mass along z; default the origin.
    pub(crate) centre_z: Option<Quantity>,
    /// Moment of inertia about the centre of mass, about x.
    pub(crate) inertia_x: Quantity,
    /// Moment of inertia about the centre of mass, about y.
    pub(crate) inertia_y: Quantity,
    /// Moment of inertia about the centre of mass, about z.
    pub(crate) inertia_z: Quantity,
}
