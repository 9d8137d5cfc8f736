//! The model file of a sensor bench as written.

use crate::written::{Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;

/// A six-axis force/torque sensor under known loads. All vectors in sensor axes; wrenches act on the sensor, moments
/// about its origin. The recorded wrench is what is left when the tool's weight and inertia are taken off.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    /// Mass of the tool between sensor and load, as the compensation has it; default none.
    pub(crate) tool_mass: Option<Quantity>,
    /// Its centre of mass; default the origin.
    pub(crate) tool_centre: Option<Quantities>,
    /// Its moments of inertia about the centre of mass, along the sensor's axes; default none.
    pub(crate) tool_inertia: Option<Quantities>,
    /// Gravity along -z of the world; default standard gravity.
    pub(crate) gravity: Option<Quantity>,
    /// Greatest force that is read; default unlimited.
    pub(crate) range_force: Option<Quantity>,
    /// Greatest moment that is read; default a tenth of a metre times `range_force`.
    pub(crate) range_moment: Option<Quantity>,
    /// Standard deviation of the noise of a force at rest, healthy; if it is not known no noise is called too much.
    pub(crate) noise_force: Option<Quantity>,
    /// The same of a moment.
    pub(crate) noise_moment: Option<Quantity>,
}
