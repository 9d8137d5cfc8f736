//! Effects in the force/torque sensor.

use super::{Row, at, limit, row};

pub(super) const ROWS: &[Row] = &[
    row(
        "S1_bias",
        "G6",
        "sensor bias",
        &[
            at("sensor_bias_force_x", 2.0),
            at("sensor_bias_force_y", 2.0),
            at("sensor_bias_force_z", 2.0),
            at("sensor_bias_moment_x", 0.2),
            at("sensor_bias_moment_y", 0.2),
            at("sensor_bias_moment_z", 0.2),
        ],
        "0.1 % of full scale",
    ),
    row(
        "S2_drift",
        "G6",
        "sensor drift",
        &[
            at("sensor_drift_force_x", 0.05),
            at("sensor_drift_force_y", 0.05),
            at("sensor_drift_force_z", 0.05),
            at("sensor_drift_moment_x", 0.005),
            at("sensor_drift_moment_y", 0.005),
            at("sensor_drift_moment_z", 0.005),
        ],
        "engineering judgement: newtons in the minutes after switching on",
    ),
    row(
        "S3_gain",
        "G5",
        "sensor gain error",
        &[
            at("sensor_gain_force_x", 0.02),
            at("sensor_gain_force_y", 0.02),
            at("sensor_gain_force_z", 0.02),
            at("sensor_gain_moment_x", 0.02),
            at("sensor_gain_moment_y", 0.02),
            at("sensor_gain_moment_z", 0.02),
        ],
        "calibration certificates, 1-2 %",
    ),
    row("S4_crosstalk", "G6", "sensor crosstalk", &[at("sensor_crosstalk", 0.02)], "calibration certificates, 1-2 %"),
    row(
        "S5_low_pass",
        "G1",
        "low-pass and delay of the sensor",
        &[at("sensor_lag", 0.002), at("sensor_delay_error", 0.001)],
        "JR3 filters 31-500 Hz; the delay is engineering judgement",
    ),
    row(
        "S6_quantisation",
        "own",
        "quantisation and saturation of the sensor",
        &[
            at("sensor_resolution_force", 0.5),
            at("sensor_resolution_moment", 0.05),
            limit("sensor_range_force", 2000.0),
            limit("sensor_range_moment", 200.0),
        ],
        "data sheets of 2 kN class sensors",
    ),
    row(
        "S7_noise",
        "G9",
        "sensor noise",
        &[at("sensor_noise_force", 1.0), at("sensor_noise_moment", 0.1)],
        "0.1-0.5 % of full scale",
    ),
    row(
        "S8_load",
        "G6",
        "error of the load compensation: weight and inertia of part A behind the sensor",
        &[
            at("load_mass_error", 0.02),
            at("load_centre_error_x", 0.005),
            at("load_centre_error_y", 0.005),
            at("load_centre_error_z", 0.005),
        ],
        "engineering judgement: a weighing to 2 %, a balance to 5 mm",
    ),
    row(
        "S9_tare",
        "G6",
        "error of the tare before the run",
        &[
            at("tare_error_force_x", 0.1),
            at("tare_error_force_y", 0.1),
            at("tare_error_force_z", 0.1),
            at("tare_error_moment_x", 0.01),
            at("tare_error_moment_y", 0.01),
            at("tare_error_moment_z", 0.01),
        ],
        "noise of a sample over the root of a hundred samples",
    ),
];
