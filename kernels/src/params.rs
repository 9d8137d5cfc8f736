//! The dispersible parameters of one run: what a campaign may draw, with units, frames and null values.
//!
//! Every row is a legal dispersion target; its Parquet column is `in_` + [`Field::column`](crate::fields::Field::column).
//! Physical values go to both loops; the `_error` rows and everything of the facility touch the HIL loop alone.

use crate::bundle;
use crate::fields::{Field, fields, from_slice};
use crate::range::{
    DAMPING, FORCE, LENGTH, MASS, MAX_DELAY_S, MOST_HOOKS, QUARTER_TURN, RATE, Range, SPEED, STIFFNESS, UNLIMITED,
};
use crate::vector::Vec3;
use std::collections::HashMap;
use std::sync::OnceLock;

bundle! {
    /// What is dispersible in the drives of one robot: all its joints together.
    DriveParams {
        position_gain: R, "1/s", in Range::within(0.0, 1e3), null 1.0, "gain of the position loops";
        velocity_feedforward: R, "1", in Range::within(0.0, 2.0), "share of the commanded joint rate that the position loops add";
        velocity_gain: R, "1", in Range::within(0.0, 100.0), null 1.0, "factor on the gains of the velocity loops";
        gear_ratio: R, "1", in Range::within(0.1, 10.0), null 1.0, "factor on all gear ratios: reflected inertia is proportional to its square, limits of torque and acceleration to it, limits of speed to its inverse";
        coulomb_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the Coulomb friction";
        viscous_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the viscous friction";
        stribeck: R, "1", in Range::within(0.0, 100.0), "factor on the static friction beyond Coulomb's; 0 = none";
        presliding: R, "1", in Range::within(0.0, 1e4), "factor on the travel before sliding; 0 = friction at once";
        load_friction: R, "1", in Range::within(0.0, 1.0), "Coulomb friction per torque that the gear transmits; 0 = none";
        coulomb_asymmetry: R, "1", in Range::size(1.0), "relative difference of the Coulomb friction: forwards higher, backwards lower; 0 = none";
        cold_friction: R, "1", in Range::within(-1.0, 10.0), "share by which dry and viscous friction are higher at the start than when warm; 0 = none";
        warm_up: R, "s", in Range::above(0.0, 1e6), null 1800.0, "time in which that share falls to 1/e";
        cable_stiffness: R, "1", in Range::within(0.0, 100.0), "spring of cables and hoses about the start posture, as a share of the joint's Coulomb friction per radian (per metre on the rail); 0 = none";
        cable_hysteresis: R, "1", in Range::within(0.0, 100.0), "hysteresis of cables and hoses, half its width as a share of the joint's Coulomb friction; 0 = none";
        gear_compliance: R, "1", in Range::within(0.0, 1e3), "factor on the compliance of the gears; 0 = rigid";
        backlash: R, "1", in Range::within(0.0, 1e3), "factor on the backlash of the gears; 0 = none";
        transmission_error: R, "rad", in Range::within(0.0, 0.1), "amplitude of the gears' transmission error, once a turn of the motor; 0 = none";
        torque_ripple: R, "1", in Range::within(0.0, 1.0), "amplitude of the motors' ripple as a share of their greatest torque; 0 = none";
        torque_constant_error: R, "1", in Range::above(-1.0, 10.0), "relative error of the motors' torque constant";
        torque_offset: R, "1", in Range::size(1.0), "offset torque of the motors as a share of their greatest torque; 0 = none";
        torque_limit_cut: R, "1", in Range::within(0.0, 1.0), "share by which the motors' greatest torque is lower; 0 = none";
        speed_limit_cut: R, "1", in Range::within(0.0, 1.0), "share by which the joints' greatest speed is lower; 0 = none";
        payload_error: R, "kg", in Range::within(0.0, 1e4), "point mass on the part that the feedforward does not know; 0 = none";
        payload_place: Vec3<R>, "m", in Range::size(LENGTH), "place of that mass, part's frame";
        current_lag: R, "s", in Range::within(0.0, 1.0), "time constant of the current loops; 0 = none";
        model_inertia_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the feedforward's inertial torques";
        model_gravity_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the feedforward's gravity torques";
        model_friction_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the feedforward's friction torques";
    }
}

bundle! {
    /// One run's parameters; SI units.
    Params {
        closing_speed: R, "m/s", in Range::size(SPEED), "speed of part A towards part B along the approach axis (+x of the contact frame) at the start";
        drift: Vec3<R>, "m/s", in Range::size(SPEED), "additional velocity of part A relative to part B at the start, contact frame";
        offset: Vec3<R>, "m", in Range::size(LENGTH), "displacement of part A from its nominal start, contact frame";
        tilt: Vec3<R>, "rad", in Range::size(QUARTER_TURN), "rotation vector of the chaser from its nominal attitude, contact frame";
        chaser_rate: Vec3<R>, "rad/s", in Range::size(RATE), "angular velocity of the chaser at the start, contact frame";
        target_rate: Vec3<R>, "rad/s", in Range::size(RATE), "angular velocity of the target at the start, contact frame";
        camera_offset: Vec3<R>, "m", in Range::size(1.0), "constant error of part B's place as the arm's camera sees it, part A's axes";
        camera_tilt: Vec3<R>, "rad", in Range::size(1.0), "constant error of part B's attitude as the arm's camera sees it, a rotation vector in part A's axes";

        base_mass: R, "kg", in Range::above(0.0, MASS), null 1.0, "mass of the chaser's base, without the arm";
        base_inertia_scale: R, "1", in Range::above(0.0, 1e3), null 1.0, "factor on the base's nominal inertia";
        target_mass: R, "kg", in Range::above(0.0, MASS), null 1.0, "mass of the free target";
        target_inertia_scale: R, "1", in Range::above(0.0, 1e3), null 1.0, "factor on the target's nominal inertia";

        contact_stiffness: R, "N/m", in Range::within(0.0, STIFFNESS), "normal contact stiffness K (unit N/m^n for exponent n)";
        contact_damping: R, "N s/m", in Range::within(0.0, DAMPING), "linear normal contact damping b of F = K d + b d'";
        contact_dissipation: R, "s/m", in Range::within(0.0, 1e4), "dissipation a of F = K d^n (1 + a d')";
        contact_friction: R, "1", in Range::within(0.0, 10.0), "Coulomb friction coefficient of the contact pair";
        bristle_stiffness: R, "N/m", in Range::within(0.0, STIFFNESS), "tangential stiffness of a contact before it slips";
        bristle_damping: R, "N s/m", in Range::within(0.0, DAMPING), "tangential damping of a contact before it slips";
        latch_stiffness: R, "N/m", in Range::within(0.0, STIFFNESS), "translational stiffness of a closed latch";
        latch_damping: R, "N s/m", in Range::within(0.0, DAMPING), "translational damping of a closed latch";
        latch_rotation_stiffness: R, "N m/rad", in Range::within(0.0, STIFFNESS), "rotational stiffness of a closed latch";
        latch_rotation_damping: R, "N m s/rad", in Range::within(0.0, DAMPING), "rotational damping of a closed latch";
        latch_failed: R, "1", in Range::within(0.0, MOST_HOOKS as f64), "number of the hook of the latch that neither closes nor holds; 0 = all work";

        // Relative errors: the erroneous value must stay physical.
        mass_error: R, "1", in Range::above(-1.0, 10.0), "relative error of the target mass in the facility's simulation";
        inertia_error: R, "1", in Range::above(-1.0, 10.0), "relative error of the target inertia in the facility's simulation";
        target_com_error: Vec3<R>, "m", in Range::size(LENGTH), "error of the target's centre of mass in the facility's simulation, target's body axes";
        // The structure of the target keeps a part of its mass, and a tick of 1 ms follows the modes.
        slosh_share: R, "1", in Range::within(0.0, 0.45), "share of the simulated target's mass that sways in its tank; 0 = none";
        slosh_frequency: R, "Hz", in Range::within(0.0, 50.0), null 0.5, "frequency of the sloshing mass in a fixed target";
        slosh_damping: R, "1", in Range::within(0.0, 1.0), null 0.02, "damping ratio of the sloshing mass";
        appendage_share: R, "1", in Range::within(0.0, 0.45), "share of the simulated target's mass on a flexible appendage; 0 = none";
        appendage_frequency: R, "Hz", in Range::within(0.0, 50.0), null 3.0, "frequency of the appendage on a fixed target";
        appendage_damping: R, "1", in Range::within(0.0, 1.0), null 0.005, "damping ratio of the appendage";
        contact_stiffness_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the contact stiffness of the parts mounted on the robots";
        contact_exponent_error: R, "1", in Range::within(-0.5, 2.0), "error of the exponent of force over depth of the mounted parts: the spring times (d / 1 mm)^e";
        contact_damping_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the contact damping of the parts mounted on the robots";
        contact_friction_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the friction of the parts mounted on the robots";
        contact_stribeck: R, "1", in Range::within(-1.0, 10.0), "share s by which the mounted parts' friction is higher at rest: mu (1 + s exp(-|v| / v_s)); 0 = none";
        contact_stribeck_speed: R, "m/s", in Range::above(0.0, SPEED), null 0.01, "sliding speed v_s at which that share has fallen to 1/e";
        contact_anisotropy: R, "1", in Range::size(1.0), "share a by which the mounted parts' friction is higher along part B's y axis and lower across it: mu (1 + a cos 2 theta); 0 = none";
        contact_adhesion: R, "N", in Range::within(0.0, FORCE), "tension of each contact point of the mounted parts before it separates; 0 = none";
        fixture_compliance: R, "m/N", in Range::within(0.0, 1.0), "compliance of part B's mount on robot 2, each translation; 0 = rigid";
        fixture_frequency: R, "Hz", in Range::within(0.0, 1e3), null 40.0, "frequency of part B on its mount";
        fixture_damping: R, "1", in Range::within(0.0, 10.0), null 0.02, "damping ratio of part B on its mount";

        loop_delay: R, "s", in Range::within(0.0, MAX_DELAY_S), "whole effective dead time of the HIL loop: command transport, sensor, stage order and half the hold";
        delay_jitter: R, "s", in Range::within(0.0, MAX_DELAY_S / 8.0), "standard deviation of the command transport delay, per packet";
        drop_probability: R, "1", in Range::within(0.0, 1.0), "probability that a command packet is lost";
        clock_skew: R, "1", in Range::size(0.1), "growth of the command delay with time, seconds per second; 0 = none";
        command_hold: R, "s", in Range::within(0.0, MAX_DELAY_S), "period over which the robots hold a command (pose and twist) instead of interpolating; 0 = none";
        tool_speed_limit: R, "m/s", in Range::above(0.0, UNLIMITED), null UNLIMITED, "greatest speed of a robot's tool along each laboratory axis";
        tool_rotation_limit: R, "rad/s", in Range::above(0.0, UNLIMITED), null UNLIMITED, "greatest rotation speed of a robot's tool about each laboratory axis";

        robot1_lag: R, "s", in Range::within(0.0, 10.0), "1/w of robot 1's response w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2); 0 = ideal";
        robot1_lag_damping: R, "1", in Range::within(0.0, 100.0), null 1.0, "damping ratio z of robot 1's response";
        robot1_lag_zero: R, "s", in Range::within(0.0, 10.0), "time constant T_z of the zero of robot 1's response";
        robot2_lag: R, "s", in Range::within(0.0, 10.0), "1/w of robot 2's response; 0 = ideal";
        robot2_lag_damping: R, "1", in Range::within(0.0, 100.0), null 1.0, "damping ratio z of robot 2's response";
        robot2_lag_zero: R, "s", in Range::within(0.0, 10.0), "time constant T_z of the zero of robot 2's response";
        place_error: Vec3<R>, "m", in Range::size(0.1), "error of part A's place on its robot, laboratory axes: repeatability, a surface that is not where it should be";
        test_amplitude: R, "m", in Range::within(0.0, 10.0), "amplitude of the test motion";
        test_frequency: R, "Hz", in Range::above(0.0, 100.0), null 1.0, "frequency of the test motion; a run takes half a period";

        robot1: DriveParams<R>, "1", "robot 1 at the joint level";
        robot2: DriveParams<R>, "1", "robot 2 at the joint level";
        rail_lag: R, "s", in Range::within(0.0, 10.0), "1/w of the rail's response; 0 = ideal";
        rail_lag_damping: R, "1", in Range::within(0.0, 100.0), null 1.0, "damping ratio z of the rail's response";

        sensor_delay: R, "s", in Range::within(0.0, MAX_DELAY_S), "delay of the measured wrench, a part of loop_delay";
        sensor_delay_error: R, "s", in Range::size(MAX_DELAY_S), "delay of the measured wrench beyond sensor_delay and loop_delay";
        sensor_lag: R, "s", in Range::within(0.0, 10.0), "time constant of the sensor's first-order low-pass; 0 = none";
        sensor_noise_force: R, "N", in Range::within(0.0, FORCE), "standard deviation of the force noise per sample and axis";
        sensor_noise_moment: R, "N m", in Range::within(0.0, FORCE), "standard deviation of the moment noise per sample and axis";
        sensor_bias_force: Vec3<R>, "N", in Range::size(FORCE), "force bias, sensor frame";
        sensor_bias_moment: Vec3<R>, "N m", in Range::size(FORCE), "moment bias, sensor frame";
        sensor_drift_force: Vec3<R>, "N/s", in Range::size(FORCE), "drift of the force, sensor frame: grows from nothing at the start";
        sensor_drift_moment: Vec3<R>, "N m/s", in Range::size(FORCE), "drift of the moment, sensor frame: grows from nothing at the start";
        tare_error_force: Vec3<R>, "N", in Range::size(FORCE), "error of the tare's mean of samples, force, sensor frame";
        tare_error_moment: Vec3<R>, "N m", in Range::size(FORCE), "error of the tare's mean of samples, moment, sensor frame";
        load_mass_error: R, "1", in Range::within(-1.0, 10.0), "relative error of the mass that the facility takes the sensor's load to have";
        load_centre_error: Vec3<R>, "m", in Range::size(LENGTH), "error of the centre that the facility takes the sensor's load to have, part A's axes";
        sensor_gain_force: Vec3<R>, "1", in Range::within(-1.0, 10.0), "relative gain error of the force, sensor frame";
        sensor_gain_moment: Vec3<R>, "1", in Range::within(-1.0, 10.0), "relative gain error of the moment, sensor frame";
        sensor_crosstalk: R, "1", in Range::size(10.0), "factor on the facility's crosstalk matrix";
        sensor_resolution_force: R, "N", in Range::within(0.0, FORCE), "force quantisation step; 0 = none";
        sensor_resolution_moment: R, "N m", in Range::within(0.0, FORCE), "moment quantisation step; 0 = none";
        sensor_range_force: R, "N", in Range::above(0.0, UNLIMITED), null UNLIMITED, "force at which the sensor saturates";
        sensor_range_moment: R, "N m", in Range::above(0.0, UNLIMITED), null UNLIMITED, "moment at which the sensor saturates";

        compensator_delay: R, "s", in Range::within(0.0, MAX_DELAY_S), "delay that the compensator assumes: of the lead, of the prediction, of the virtual damping";
        compensator_lag: R, "s", in Range::within(0.0, 10.0), "time constant of the low-pass on the compensator's derivative; 0 = none";
        compensator_stiffness: R, "N/m", in Range::within(0.0, STIFFNESS), "contact stiffness that the compensator assumes";
        compensator_margin: R, "1", in Range::within(-1.0, 100.0), "share by which virtual damping, or a lead that was switched up, exceeds what the assumed delay asks for";
        compensator_damping: R, "N s/m", in Range::within(0.0, DAMPING), "contact damping whose loss the compensator's energy observer allows for";
        compensator_energy: R, "J", in Range::within(0.0, UNLIMITED), null UNLIMITED, "energy that the facility may inject in a contact before the compensator injects damping";
        compensator_threshold: R, "N", in Range::within(0.0, FORCE), "measured force above which the compensator takes the parts to touch";
    }
}

impl Params<f64> {
    /// A parameter set that changes nothing: every parameter at the null value of its row.
    ///
    /// Scenario files overwrite what they state; everything unstated stays at its null value.
    pub fn null() -> Self {
        static NULLS: OnceLock<Vec<f64>> = OnceLock::new();
        let nulls = NULLS.get_or_init(|| fields::<f64, Self>().iter().map(|field| field.null).collect());
        from_slice(nulls)
    }
}

/// The row of a parameter; `None` for an unknown name.
pub fn row_of(name: &str) -> Option<&'static Field> {
    static ROWS: OnceLock<HashMap<String, Field>> = OnceLock::new();
    let rows = || fields::<f64, Params<f64>>().into_iter().map(|field| (field.name.clone(), field)).collect();
    ROWS.get_or_init(rows).get(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_a_range_that_contains_its_null_value() {
        for field in fields::<f64, Params<f64>>() {
            let range = field.range.unwrap_or_else(|| panic!("{} has no range", field.name));
            assert!(range.min < range.max && range.contains(field.null), "{}: {range:?}", field.name);
        }
    }
}
