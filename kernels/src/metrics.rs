//! What a run is judged by: the metrics of one loop, written by the monitor stage, read by requirements.

use crate::bundle;
use crate::fields::Field;

/// Null of a metric whose event may never happen: it is negative then.
const NEVER: f64 = -1.0;
/// Null of a metric that only a test motion gives.
const UNTESTED: f64 = f64::NEG_INFINITY;

bundle! {
    /// Metrics of one loop; the same table for the loop in space and the loop on the facility.
    ///
    /// A time or a ratio that never happened is negative here and null in Parquet ([`Metrics::available`]); the null value
    /// of a row states when it has none.
    Metrics {
        touch_time: R, "s", null NEVER, "time of the first touch; null without one";
        approach_speed: R, "m/s", null NEVER, "normal speed of approach at the first touch; null without one";
        restitution: R, "1", null NEVER, "greatest normal speed of separation after the first contact over the speed of approach; null without a bounce";
        rebound_speed: R, "m/s", null NEVER, "greatest normal speed of separation after the first contact, before the second; null without a bounce";
        contact_count: R, "1", "number of contacts";
        contact_duration: R, "s", "time during which the parts touched";
        impulse: R, "N s", "integral of the contact force's magnitude, latch excluded";
        first_contact_duration: R, "s", null NEVER, "duration of the first contact; null without one";
        first_contact_impulse: R, "N s", null NEVER, "integral of the contact force's magnitude over the first contact; null without one";
        first_contact_force: R, "N", null NEVER, "largest contact force of the first contact; null without one";
        peak_contact_force: R, "N", "largest contact force, latch excluded";
        peak_latch_force: R, "N", "largest force of the latch";
        peak_interface_force: R, "N", "largest sum of contact and latch force: the load of a cell at the interface";
        peak_contact_moment: R, "N m", "largest moment of the contact about part A's origin, latch excluded";
        peak_latch_moment: R, "N m", "largest moment of the latch about part A's origin";
        peak_interface_moment: R, "N m", "largest sum of contact and latch moment about part A's origin";
        peak_contact_force_time: R, "s", null NEVER, "time of the largest contact force; null without one";
        peak_latch_force_time: R, "s", null NEVER, "time of the largest latch force; null without one";
        peak_interface_force_time: R, "s", null NEVER, "time of the largest interface force; null without one";
        peak_contact_moment_time: R, "s", null NEVER, "time of the largest contact moment; null without one";
        peak_latch_moment_time: R, "s", null NEVER, "time of the largest latch moment; null without one";
        peak_interface_moment_time: R, "s", null NEVER, "time of the largest interface moment; null without one";
        peak_depth: R, "m", "largest penetration of the parts; near the middle of a thin solid, task.max_depth is added";
        capture_time: R, "s", null NEVER, "time at which the latch closed; null without capture";
        capture_offset: R, "m", null NEVER, "radial offset of the latch point when the latch closed; null without capture";
        miss_distance: R, "m", null NEVER, "least distance of the latch point from its seat; null without a latch";
        insertion: R, "m", "farthest that part A's origin came beyond part B's, along part B's x axis";
        jam_duration: R, "s", "longest time that part A stood between opposite contacts; 0 without task.min_insertion";
        jam_push: R, "N", null NEVER, "contact force during that time, which balances the push; null without a jam";
        jam_moment: R, "N m", null NEVER, "contact moment about part A's origin then; null without a jam";
        jam_squeeze: R, "N", null NEVER, "force with which opposite contacts pressed each other then; null without a jam";
        peak_leg_force: R, "N", "largest force of a leg of the soft capture ring, stops included; 0 without a ring";
        peak_leg_stroke: R, "m", "largest change of a leg's length from the start; 0 without a ring";
        separation_time: R, "s", null NEVER, "time of the last separation; null without one";
        separation_speed: R, "m/s", "normal speed of separation at the end of the run (negative = closing)";
        linear_momentum_error: R, "kg m/s", "change of total linear momentum beyond the external impulses";
        angular_momentum_error: R, "kg m^2/s", "change of total angular momentum beyond the external moments";
        injected_energy: R, "J", "energy injected by the facility: space port minus hardware port; 0 in space";
        tracking_gain: R, "1", null UNTESTED, "amplitude of the robots over that of the test motion; null without a test";
        tracking_lag: R, "rad", null UNTESTED, "phase of the robots behind the test motion; null without a test";
        tracking_error: R, "m", null UNTESTED, "root mean square of the robots' place less that of the test motion; null without a test";
        tracking_overshoot: R, "1", null UNTESTED, "greatest speed of the robots over that of the test motion, less 1; null without a test";
        end_time: R, "s", "time at which the loop ended";
    }
}

/// One row for each flag of a run: bit, name, whether it makes a run invalid, meaning.
macro_rules! flags {
    ($($bit:literal $name:ident $word:literal $is_invalid:literal $meaning:literal;)*) => {
        /// Flag bits of a run; a set bit in [`flags::INVALID`] makes the run invalid, the others are findings.
        pub mod flags {
            $(#[doc = $meaning] pub const $name: u32 = 1 << $bit;)*

            /// The bits that make a run invalid.
            pub const INVALID: u32 = $(if $is_invalid { $name } else { 0 })|*;

            /// Bit, name and meaning of every flag.
            pub const TABLE: &[(u32, &str, &str)] = &[$(($name, $word, $meaning)),*];
        }
    };
}

flags! {
    0 SPACE_NON_FINITE "space_non_finite" true "a non-finite number in the space loop";
    1 HIL_NON_FINITE "hil_non_finite" true "a non-finite number in the HIL loop, which had not diverged";
    2 SPACE_ENERGY_JUMP "space_energy_jump" true "the space loop gained energy that nothing put in";
    3 SPACE_PENETRATION "space_penetration" true "the space loop passed the penetration limit";
    4 HIL_UNSTABLE "hil_unstable" false "the HIL loop diverged: its session is aborted";
    5 SENSOR_SATURATED "sensor_saturated" false "the sensor saturated";
    6 ROBOT_SPEED_LIMIT "robot_speed_limit" false "a robot ran into its speed limit";
    7 PACKET_DROPPED "packet_dropped" false "at least one command packet was dropped";
    8 RETRIED "retried" false "first invalid, then repeated in f64";
    9 HIL_PENETRATION "hil_penetration" true "the HIL loop passed the penetration limit, and nothing stopped its session";
}

/// When a metric has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// In every run.
    Always,
    /// Where its event happened; it is negative elsewhere.
    Happened,
    /// Where the robots followed a test motion; the gain is negative where they did not.
    Tested,
}

impl Presence {
    /// When the metric of a row has a value.
    pub fn of(row: &Field) -> Self {
        match row.null {
            NEVER => Self::Happened,
            UNTESTED => Self::Tested,
            _ => Self::Always,
        }
    }
}

impl Metrics<f64> {
    /// The value of one of these metrics; `None` where it is not available.
    pub fn if_present(&self, presence: Presence, value: f64) -> Option<f64> {
        let is_there = match presence {
            Presence::Always => true,
            Presence::Happened => value >= 0.0,
            Presence::Tested => self.tracking_gain >= 0.0,
        };
        (value.is_finite() && is_there).then_some(value)
    }

    /// The value of a metric by its field name, or `None` if it is not available (or unknown).
    pub fn available(&self, name: &str) -> Option<f64> {
        let rows = crate::fields::fields::<f64, Self>();
        let (row, value) = rows.iter().zip(crate::fields::to_vec(self)).find(|(row, _)| row.name == name)?;
        self.if_present(Presence::of(row), value)
    }
}
