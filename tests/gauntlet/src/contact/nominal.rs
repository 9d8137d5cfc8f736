//! The nominal contact rig: its numbers, the tolerances on them, and the text of the model file.

/// Body \[kg\].
pub(crate) const MASS: f64 = 40.0;
/// Contact stiffness \[N/m\] and damping \[N s/m\].
pub(crate) const STIFFNESS: f64 = 1e5;
pub(crate) const DAMPING: f64 = 200.0;
/// Friction coefficient, and the travel over which friction rises to it \[m\].
pub(crate) const FRICTION: f64 = 0.2;
pub(crate) const PRESLIDING_TRAVEL: f64 = 5e-5;
/// Lateral carriage that slides the body: stiffness \[N/m\] and damping \[N s/m\].
pub(crate) const CARRIAGE_STIFFNESS: f64 = 1e5;
pub(crate) const CARRIAGE_DAMPING: f64 = 4000.0;

/// Tolerances: standard deviations of the nuisance parameters: shares, but m, N and s where a unit stands.
pub(crate) mod tolerance {
    pub(crate) const STIFFNESS: f64 = 0.02;
    pub(crate) const DAMPING: f64 = 0.1;
    pub(crate) const FRICTION: f64 = 0.03;
    pub(crate) const PRESLIDING_TRAVEL: f64 = 0.2;
    /// \[m\]
    pub(crate) const SURFACE: f64 = 5e-6;
    /// \[N\]
    pub(crate) const BIAS: f64 = 0.2;
    /// \[s\]
    pub(crate) const CLOCK_OFFSET: f64 = 2e-4;
}

/// The model file's text.
pub(crate) const MODEL: &str = r#"schema = "rig/1"
kind = "contact"
id = "bench-plate"

# A body on air cushions against a plate; z is the plate's normal, out of the plate, and z = 0 its surface.
# Force: stiffness d + damping d' at a depth d > 0, never pulling; friction against the sliding, up to friction N.
[contact]
stiffness = "100000 N/m"
exponent = 1
damping = "200 N s/m"
damping_onset = "0.01 mm"         # the damping sets in over this depth
friction = 0.2
presliding_travel = "0.05 mm"

# The body has 40 kg; a carriage on a spring of 100000 N/m and a damper of 4000 N s/m slides it.

# Tolerances: standard deviations of the nuisance parameters.
[tolerance]
stiffness = "2 %"
damping = "10 %"
damping_onset = "30 %"
friction = "3 %"
presliding_travel = "20 %"
surface = "0.005 mm"
bias_force = "0.2 N"              # each axis
clock_offset = "0.2 ms"           # force channels against motion channels

# 2 kHz; position of the contact point, force of the plate on the body.
[log]
"t" = { column = "t_s", unit = "s" }
"push" = { column = "push_n", unit = "N" }
"carriage.x" = { column = "carriage_x_m", unit = "m" }
"carriage.y" = { column = "carriage_y_m", unit = "m" }
"position.x" = { column = "x_m", unit = "m" }
"position.y" = { column = "y_m", unit = "m" }
"position.z" = { column = "z_m", unit = "m" }
"force.x" = { column = "fx_n", unit = "N" }
"force.y" = { column = "fy_n", unit = "N" }
"force.z" = { column = "fz_n", unit = "N" }
"#;
