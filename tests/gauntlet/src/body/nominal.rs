//! The nominal free body: its numbers, the tolerances on them, and the text of the model file.

use crate::space::Vector;

/// Mass \[kg\] and moments of inertia about the centre of mass \[kg m^2\]; the centre is the origin of the body's axes.
pub(crate) const MASS: f64 = 300.0;
pub(crate) const INERTIA: Vector = [90.0, 110.0, 100.0];

/// Tolerances: standard deviations of the nuisance parameters.
pub(crate) mod tolerance {
    /// Share.
    pub(crate) const MASS: f64 = 0.003;
    /// Share, each axis.
    pub(crate) const INERTIA: f64 = 0.01;
    /// \[m\], each axis.
    pub(crate) const CENTRE: f64 = 0.001;
    /// \[m/s^2\] and \[rad/s\], each axis.
    pub(crate) const ACCELEROMETER_BIAS: f64 = 2e-4;
    pub(crate) const GYROSCOPE_BIAS: f64 = 2e-5;
    /// \[s\]
    pub(crate) const CLOCK_OFFSET: f64 = 2e-4;
}

/// The model file's text.
pub(crate) const MODEL: &str = r#"schema = "rig/1"
kind = "body"
id = "bench-body"

# A free body without gravity, at rest at the start. Wrench, acceleration (of the axes' origin) and rate in body axes,
# moments about the origin; position of the origin in the world, and the quaternion turns body axes into world axes.
[body]
mass = "300 kg"
centre_x = "0 m"
centre_y = "0 m"
centre_z = "0 m"
inertia_x = "90 kg m^2"           # about the centre of mass
inertia_y = "110 kg m^2"
inertia_z = "100 kg m^2"

# Tolerances: standard deviations of the nuisance parameters.
[tolerance]
mass = "0.3 %"
inertia = "1 %"                   # each axis
centre = "1 mm"                   # each axis
accelerometer_bias = "0.0002 m/s^2"
gyroscope_bias = "0.00002 rad/s"
clock_offset = "0.2 ms"           # wrench channels against motion channels

# 250 Hz; a wrench acts from its stamp to the next. t goes on from recording to recording.
[log]
"t" = { column = "t_s", unit = "s" }
"force.x" = { column = "f_x_n", unit = "N" }
"force.y" = { column = "f_y_n", unit = "N" }
"force.z" = { column = "f_z_n", unit = "N" }
"moment.x" = { column = "m_x_nm", unit = "N m" }
"moment.y" = { column = "m_y_nm", unit = "N m" }
"moment.z" = { column = "m_z_nm", unit = "N m" }
"position.x" = { column = "x_m", unit = "m" }
"position.y" = { column = "y_m", unit = "m" }
"position.z" = { column = "z_m", unit = "m" }
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
"#;
