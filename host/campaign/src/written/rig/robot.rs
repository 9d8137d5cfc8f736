//! A robot for diagnosis, as written.

use crate::written::{At, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;

/// A robot, axis by axis; the columns of its recordings stand in its own model file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotTable {
    /// The robot's model file, as `softdock identify robot` writes it.
    pub(crate) model: At<String>,
    /// Period over which the controllers hold a torque, which so acts half of it later on the average; default 0 s.
    pub(crate) period: Option<Quantity>,
    /// Treats the gears as rigid and without backlash, whatever that file states; default false.
    pub(crate) rigid_gears: Option<At<bool>>,
    /// Treats friction as Coulomb and viscous, whatever that file states; default false.
    pub(crate) plain_friction: Option<At<bool>>,
}
