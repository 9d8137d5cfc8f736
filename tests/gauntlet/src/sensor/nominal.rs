//! The nominal sensor rig: its numbers, the tolerances on them, and the text of the model file.

use crate::space::Vector;

/// Tool between sensor and load \[kg\], its centre of mass in sensor axes \[m\], moments of inertia about it \[kg m^2\].
pub(crate) const TOOL_MASS: f64 = 5.0;
pub(crate) const TOOL_CENTRE: Vector = [0.01, 0.0, 0.09];
pub(crate) const TOOL_INERTIA: Vector = [0.02, 0.02, 0.015];

/// Tolerances: standard deviations of the nuisance parameters.
pub(crate) mod tolerance {
    /// \[N\] and \[N m\], each axis.
    pub(crate) const BIAS_FORCE: f64 = 0.2;
    pub(crate) const BIAS_MOMENT: f64 = 0.02;
    /// Share, all axes alike.
    pub(crate) const GAIN: f64 = 0.002;
    /// \[kg\]
    pub(crate) const TOOL_MASS: f64 = 0.005;
    /// \[s\]
    pub(crate) const CLOCK_OFFSET: f64 = 2e-4;
}

/// The model file's text.
pub(crate) const MODEL: &str = r#"schema = "rig/1"
kind = "sensor"
id = "bench-sensor"

# A six-axis force/torque sensor under known loads. All vectors in sensor axes; wrenches act on the sensor, moments about
# its origin. The recorded wrench is what is left when the tool's weight and inertia are taken off.
[sensor]
tool_mass = "5 kg"
tool_centre = ["0.01 m", "0 m", "0.09 m"]
tool_inertia = ["0.02 kg m^2", "0.02 kg m^2", "0.015 kg m^2"]  # about the tool's centre of mass
gravity = "9.80665 m/s^2"         # along -z of the world
noise_force = "0.32 N"            # at rest, healthy
noise_moment = "0.032 N m"

# Tolerances: standard deviations of the nuisance parameters.
[tolerance]
bias_force = "0.2 N"              # each axis
bias_moment = "0.02 N m"
gain = "0.2 %"
tool_mass = "0.005 kg"
clock_offset = "0.2 ms"           # sensor against reference and motion

# 1 kHz; t goes on from recording to recording. The quaternion turns sensor axes into world axes; the acceleration is
# that of the sensor's origin, gravity left out.
[log]
"t" = { column = "t_s", unit = "s" }
"reference.force.x" = { column = "f_ref_x_n", unit = "N" }
"reference.force.y" = { column = "f_ref_y_n", unit = "N" }
"reference.force.z" = { column = "f_ref_z_n", unit = "N" }
"reference.moment.x" = { column = "m_ref_x_nm", unit = "N m" }
"reference.moment.y" = { column = "m_ref_y_nm", unit = "N m" }
"reference.moment.z" = { column = "m_ref_z_nm", unit = "N m" }
"orientation.w" = { column = "qw", unit = "1" }
"orientation.x" = { column = "qx", unit = "1" }
"orientation.y" = { column = "qy", unit = "1" }
"orientation.z" = { column = "qz", unit = "1" }
"acceleration.x" = { column = "ax_m_per_s2", unit = "m/s^2" }
"acceleration.y" = { column = "ay_m_per_s2", unit = "m/s^2" }
"acceleration.z" = { column = "az_m_per_s2", unit = "m/s^2" }
"rate.x" = { column = "wx_rad_per_s", unit = "rad/s" }
"rate.y" = { column = "wy_rad_per_s", unit = "rad/s" }
"rate.z" = { column = "wz_rad_per_s", unit = "rad/s" }
"force.x" = { column = "f_x_n", unit = "N" }
"force.y" = { column = "f_y_n", unit = "N" }
"force.z" = { column = "f_z_n", unit = "N" }
"moment.x" = { column = "m_x_nm", unit = "N m" }
"moment.y" = { column = "m_y_nm", unit = "N m" }
"moment.z" = { column = "m_z_nm", unit = "N m" }
"#;
