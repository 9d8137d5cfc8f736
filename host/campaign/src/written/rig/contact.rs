//! The model file of a contact bench as written.

use crate::written::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

/// A point on a body against a plate; z is the plate's normal, out of the plate, and z = 0 its surface. Force of the
/// plate on the body: `stiffness d (d / 1 mm)^(exponent - 1) + damping d'` at a depth d > 0, never pulling; friction
/// against the sliding, up to `friction` times the normal force.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactTable {
    /// Normal stiffness, at a depth of 1 mm.
    pub(crate) stiffness: Quantity,
    /// Exponent of force over depth; default 1.
    pub(crate) exponent: Option<Quantity>,
    /// Normal damping; default none.
    pub(crate) damping: Option<Quantity>,
    /// Depth over which the damping sets in; default at once.
    pub(crate) damping_onset: Option<Quantity>,
    /// Friction coefficient; default none.
    pub(crate) friction: Option<Quantity>,
    /// Travel in which friction comes 1/e closer to sliding; default 0.1 mm.
    pub(crate) presliding_travel: Option<Quantity>,
    /// Tension that the parts bear before they part; default none.
    pub(crate) adhesion: Option<Quantity>,
    /// Distance at which it has gone; default 0.1 mm.
    pub(crate) adhesion_range: Option<Quantity>,
    /// Compliance of the plate's mount; default rigid.
    pub(crate) fixture_compliance: Option<Quantity>,
    /// Frequency of the plate on its mount; default 100 Hz.
    pub(crate) fixture_frequency: Option<Quantity>,
    /// Its damping ratio; default 2 %.
    pub(crate) fixture_damping: Option<Quantity>,
    /// Time constant of the force sensor's low-pass; default none.
    pub(crate) sensor_lag: Option<Quantity>,
}
