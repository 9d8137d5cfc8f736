//! The legal range of every dispersible parameter, for nominal values and draws alike.

use crate::units::show;
use softdock_kernels::delay_line::MAX_DELAY_S;
use softdock_kernels::params::UNLIMITED;

/// From `min` to `max`; `above` excludes `min` itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) min: f64,
    pub(crate) max: f64,
    above: bool,
}

impl Range {
    /// Both ends included.
    pub(crate) const fn within(min: f64, max: f64) -> Self {
        Self { min, max, above: false }
    }

    /// Above `min`, up to `max`.
    pub(crate) const fn above(min: f64, max: f64) -> Self {
        Self { min, max, above: true }
    }

    /// `-size` to `size`.
    pub(crate) const fn size(size: f64) -> Self {
        Self::within(-size, size)
    }

    pub(crate) fn contains(&self, value: f64) -> bool {
        value <= self.max && if self.above { value > self.min } else { value >= self.min }
    }

    /// "above 0 kg, at most 1e7 kg".
    pub(crate) fn words(&self, unit: &str) -> String {
        let low = if self.above { "above" } else { "at least" };
        format!("{low} {}, at most {}", show(self.min, unit), show(self.max, unit))
    }
}

/// Most runs of a campaign.
pub(crate) const MOST_RUNS: u64 = 1_000_000_000;

/// Half a turn: attitudes and angles.
const HALF_TURN: f64 = std::f64::consts::PI;

/// A quarter turn: beyond it the start's rotation vector is no longer exact to rounding.
const QUARTER_TURN: f64 = std::f64::consts::FRAC_PI_2;

/// Largest lengths, speeds and so on that a contact task can have: wide, but far from the overflow of f32 squares.
pub(crate) const LENGTH: f64 = 1e3;
pub(crate) const SPEED: f64 = 1e2;
pub(crate) const RATE: f64 = 1e2;
pub(crate) const MASS: f64 = 1e7;
pub(crate) const INERTIA: f64 = 1e9;
pub(crate) const FORCE: f64 = 1e9;
pub(crate) const STIFFNESS: f64 = 1e12;
pub(crate) const DAMPING: f64 = 1e9;
pub(crate) const ANGLE: f64 = 4.0 * HALF_TURN;

/// One row per field of `Params`; a vector's row holds for each component.
const RANGES: &[(&str, Range)] = &[
    ("closing_speed", Range::size(SPEED)),
    ("drift", Range::size(SPEED)),
    ("offset", Range::size(LENGTH)),
    ("tilt", Range::size(QUARTER_TURN)),
    ("chaser_rate", Range::size(RATE)),
    ("target_rate", Range::size(RATE)),
    ("base_mass", Range::above(0.0, MASS)),
    ("base_inertia_scale", Range::above(0.0, 1e3)),
    ("target_mass", Range::above(0.0, MASS)),
    ("target_inertia_scale", Range::above(0.0, 1e3)),
    ("contact_stiffness", Range::within(0.0, STIFFNESS)),
    ("contact_damping", Range::within(0.0, DAMPING)),
    ("contact_dissipation", Range::within(0.0, 1e4)),
    ("contact_friction", Range::within(0.0, 10.0)),
    ("bristle_stiffness", Range::within(0.0, STIFFNESS)),
    ("bristle_damping", Range::within(0.0, DAMPING)),
    ("latch_stiffness", Range::within(0.0, STIFFNESS)),
    ("latch_damping", Range::within(0.0, DAMPING)),
    ("latch_rotation_stiffness", Range::within(0.0, STIFFNESS)),
    ("latch_rotation_damping", Range::within(0.0, DAMPING)),
    // Relative errors: the erroneous value must stay physical.
    ("mass_error", Range::above(-1.0, 10.0)),
    ("inertia_error", Range::above(-1.0, 10.0)),
    ("target_com_error", Range::size(LENGTH)),
    // The structure of the target keeps a part of its mass, and a tick of 1 ms follows the modes.
    ("slosh_share", Range::within(0.0, 0.45)),
    ("slosh_frequency", Range::within(0.0, 50.0)),
    ("slosh_damping", Range::within(0.0, 1.0)),
    ("appendage_share", Range::within(0.0, 0.45)),
    ("appendage_frequency", Range::within(0.0, 50.0)),
    ("appendage_damping", Range::within(0.0, 1.0)),
    ("contact_stiffness_error", Range::within(-1.0, 10.0)),
    ("contact_damping_error", Range::within(-1.0, 10.0)),
    ("contact_friction_error", Range::within(-1.0, 10.0)),
    ("contact_exponent_error", Range::within(-0.5, 2.0)),
    ("contact_stribeck", Range::within(-1.0, 10.0)),
    ("contact_stribeck_speed", Range::above(0.0, SPEED)),
    ("contact_anisotropy", Range::size(1.0)),
    ("contact_adhesion", Range::within(0.0, FORCE)),
    ("fixture_compliance", Range::within(0.0, 1.0)),
    ("fixture_frequency", Range::within(0.0, 1e3)),
    ("fixture_damping", Range::within(0.0, 10.0)),
    ("loop_delay", Range::within(0.0, MAX_DELAY_S)),
    ("delay_jitter", Range::within(0.0, MAX_DELAY_S / 8.0)),
    ("drop_probability", Range::within(0.0, 1.0)),
    ("clock_skew", Range::size(0.1)),
    ("command_hold", Range::within(0.0, MAX_DELAY_S)),
    ("tool_speed_limit", Range::above(0.0, UNLIMITED)),
    ("tool_rotation_limit", Range::above(0.0, UNLIMITED)),
    ("test_amplitude", Range::within(0.0, 10.0)),
    ("test_frequency", Range::above(0.0, 100.0)),
    ("robot1_lag", Range::within(0.0, 10.0)),
    ("robot1_lag_damping", Range::within(0.0, 100.0)),
    ("robot1_lag_zero", Range::within(0.0, 10.0)),
    ("robot2_lag", Range::within(0.0, 10.0)),
    ("robot2_lag_damping", Range::within(0.0, 100.0)),
    ("robot2_lag_zero", Range::within(0.0, 10.0)),
    ("robot_position_gain", Range::within(0.0, 1e3)),
    ("robot_velocity_feedforward", Range::within(0.0, 2.0)),
    ("robot_velocity_gain", Range::within(0.0, 100.0)),
    ("robot_gear_ratio", Range::within(0.1, 10.0)),
    ("robot_coulomb_error", Range::within(-1.0, 10.0)),
    ("robot_viscous_error", Range::within(-1.0, 10.0)),
    ("robot_stribeck", Range::within(0.0, 100.0)),
    ("robot_presliding", Range::within(0.0, 1e4)),
    ("robot_load_friction", Range::within(0.0, 1.0)),
    ("robot_coulomb_asymmetry", Range::size(1.0)),
    ("robot_cold_friction", Range::within(-1.0, 10.0)),
    ("robot_warm_up", Range::above(0.0, 1e6)),
    ("robot_cable_stiffness", Range::within(0.0, 100.0)),
    ("robot_cable_hysteresis", Range::within(0.0, 100.0)),
    ("robot_gear_compliance", Range::within(0.0, 1e3)),
    ("robot_backlash", Range::within(0.0, 1e3)),
    ("robot_transmission_error", Range::within(0.0, 0.1)),
    ("robot_torque_ripple", Range::within(0.0, 1.0)),
    ("robot_torque_constant_error", Range::above(-1.0, 10.0)),
    ("robot_torque_offset", Range::size(1.0)),
    ("robot_torque_limit_cut", Range::within(0.0, 1.0)),
    ("robot_speed_limit_cut", Range::within(0.0, 1.0)),
    ("robot_payload_error", Range::within(0.0, 1e4)),
    ("robot_payload_place", Range::size(LENGTH)),
    ("robot_current_lag", Range::within(0.0, 1.0)),
    ("robot_model_inertia_error", Range::within(-1.0, 10.0)),
    ("robot_model_gravity_error", Range::within(-1.0, 10.0)),
    ("robot_model_friction_error", Range::within(-1.0, 10.0)),
    ("place_error", Range::size(0.1)),
    ("rail_lag", Range::within(0.0, 10.0)),
    ("rail_lag_damping", Range::within(0.0, 100.0)),
    ("sensor_delay", Range::within(0.0, MAX_DELAY_S)),
    ("sensor_delay_error", Range::size(MAX_DELAY_S)),
    ("sensor_lag", Range::within(0.0, 10.0)),
    ("sensor_noise_force", Range::within(0.0, FORCE)),
    ("sensor_noise_moment", Range::within(0.0, FORCE)),
    ("sensor_bias_force", Range::size(FORCE)),
    ("sensor_bias_moment", Range::size(FORCE)),
    ("sensor_drift_force", Range::size(FORCE)),
    ("sensor_drift_moment", Range::size(FORCE)),
    ("tare_error_force", Range::size(FORCE)),
    ("tare_error_moment", Range::size(FORCE)),
    ("load_mass_error", Range::within(-1.0, 10.0)),
    ("load_centre_error", Range::size(LENGTH)),
    ("sensor_gain_force", Range::within(-1.0, 10.0)),
    ("sensor_gain_moment", Range::within(-1.0, 10.0)),
    ("sensor_crosstalk", Range::size(10.0)),
    ("sensor_resolution_force", Range::within(0.0, FORCE)),
    ("sensor_resolution_moment", Range::within(0.0, FORCE)),
    ("sensor_range_force", Range::above(0.0, UNLIMITED)),
    ("sensor_range_moment", Range::above(0.0, UNLIMITED)),
    ("compensator_delay", Range::within(0.0, MAX_DELAY_S)),
    ("compensator_lag", Range::within(0.0, 10.0)),
    ("compensator_stiffness", Range::within(0.0, STIFFNESS)),
    ("compensator_margin", Range::within(-1.0, 100.0)),
    ("compensator_damping", Range::within(0.0, DAMPING)),
    ("compensator_energy", Range::within(0.0, UNLIMITED)),
    ("compensator_threshold", Range::within(0.0, FORCE)),
];

/// The name that both robots' drives have in common (`robot_backlash` of `robot1_backlash`), a whole vector's.
fn either_robot(field: &str) -> Option<String> {
    ["robot1_", "robot2_"]
        .iter()
        .find_map(|one| field.strip_prefix(one))
        .map(|rest| format!("robot_{}", vector_name(rest).unwrap_or(rest)))
}

/// The whole vector's name of a component (`offset` of `offset_y`).
pub(crate) fn vector_name(field: &str) -> Option<&str> {
    ["_x", "_y", "_z"].iter().find_map(|suffix| field.strip_suffix(suffix))
}

/// The legal range of a field of `Params`.
pub(crate) fn legal(field: &str) -> Range {
    let row = |name: &str| RANGES.iter().find(|row| row.0 == name).map(|row| row.1);
    let shared = || row(&either_robot(field)?);
    row(field)
        .or_else(|| row(vector_name(field)?))
        .or_else(shared)
        .expect("every field of Params has a row: see the test")
}

/// Least and greatest legal value of a field of `Params`, in its unit.
///
/// # Panics
/// If there is no such field.
pub fn legal_range(field: &str) -> (f64, f64) {
    let range = legal(field);
    (range.min, range.max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::fields::fields;
    use softdock_kernels::params::Params;

    #[test]
    fn every_field_has_one_row_and_every_row_a_field() {
        let fields = fields::<f64, Params<f64>>();
        for field in &fields {
            let exact = RANGES.iter().filter(|row| row.0 == field.name).count();
            let whole = RANGES.iter().filter(|row| Some(row.0) == vector_name(&field.name)).count();
            let shared = RANGES.iter().filter(|row| either_robot(&field.name).as_deref() == Some(row.0)).count();
            assert_eq!(exact + whole + shared, 1, "{}", field.name);
        }
        for (name, range) in RANGES {
            let names =
                |f: &str| f == *name || vector_name(f) == Some(name) || either_robot(f).as_deref() == Some(name);
            assert!(fields.iter().any(|f| names(&f.name)), "{name}");
            assert!(range.min < range.max, "{name}");
        }
    }

    #[test]
    fn null_parameters_are_legal() {
        let values = softdock_kernels::fields::to_vec(&Params::null());
        for (field, value) in fields::<f64, Params<f64>>().iter().zip(values) {
            assert!(legal(&field.name).contains(value), "{} = {value}", field.name);
        }
    }
}
