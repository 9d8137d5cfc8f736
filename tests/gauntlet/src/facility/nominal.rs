//! The nominal facility: its numbers, the tolerances on them, and the scenario text.

use crate::space::Vector;

/// Chaser and target: mass \[kg\], principal moments of inertia \[kg m^2\], place of the part in body axes \[m\].
pub(crate) const CHASER: (f64, Vector, Vector) = (400.0, [60.0, 70.0, 70.0], [0.3, 0.0, 0.0]);
pub(crate) const TARGET: (f64, Vector, Vector) = (300.0, [40.0, 45.0, 45.0], [-0.3, 0.0, 0.0]);
/// Radius of the ball that is part A \[m\].
pub(crate) const RADIUS: f64 = 0.025;

/// Stiffness \[N/m^1.5\], dissipation \[s/m\], friction coefficient.
pub(crate) const STIFFNESS: f64 = 4e5;
pub(crate) const EXPONENT: f64 = 1.5;
pub(crate) const DISSIPATION: f64 = 2.0;
pub(crate) const FRICTION: f64 = 0.15;

/// Share of the relative translation that robot 1 makes.
pub(crate) const SHARE: f64 = 0.5;
/// Response of both robots w^2 (1 + T s) / (s^2 + 2 z w s + w^2): 1/w \[s\], z, T \[s\].
pub(crate) const RESPONSE: [f64; 3] = [0.014, 1.4, 0.02];
/// Dead time of the whole loop and of the sensor in it, time constant of the sensor's low-pass \[s\].
pub(crate) const LOOP_DELAY: f64 = 0.006;
pub(crate) const SENSOR_DELAY: f64 = 0.001;
pub(crate) const SENSOR_LAG: f64 = 5e-4;

/// One standard deviation of what the time stamps of command and measurement may be off unnoticed \[s\].
pub(crate) const CLOCK_OFFSET: f64 = 1e-4;

/// The scenario file's text.
pub(crate) const MODEL: &str = r#"schema = "scenario/2"
id = "hil-plate"
title = "A ball on a free chaser meets a plate on a free target, aslant"

# How each drive begins stands in its own log; [start] is one of them.
[timing]
substep = "0.25 ms"
tick = "1 ms"
time_limit = "2 s"

[base]
mass = "400 kg"
inertia = { ixx = "60 kg m^2", iyy = "70 kg m^2", izz = "70 kg m^2" }

[part_a]
position = ["0.3 m", "0 m", "0 m"]

[[part_a.point]]
position = ["0 m", "0 m", "0 m"]
radius = "25 mm"

[target]
mass = "300 kg"
inertia = { ixx = "40 kg m^2", iyy = "45 kg m^2", izz = "45 kg m^2" }

[part_b]
position = ["-0.3 m", "0 m", "0 m"]

[[part_b.solid]]
shape = "plane"

[contact]
law = "power"                      # F = K d^n (1 + a d')
exponent = 1.5
stiffness = "4e5 N/m"              # K, in N/m^1.5
dissipation = "2 s/m"
friction = 0.15
bristle_stiffness = "2e5 N/m"
bristle_damping = "5000 N s/m"

[start]
gap = "35 mm"
closing_speed = "60 mm/s"

[facility]
session_rules = "none"
loop_delay = "6 ms"
robot1_share = 0.5
robot1 = { lag = "14 ms", damping = 1.4, zero = "20 ms" }
robot2 = { lag = "14 ms", damping = 1.4, zero = "20 ms" }
unstable_speed = "5 m/s"

[facility.sensor]
period = "1 ms"
delay = "1 ms"                     # a part of the loop delay
lag = "0.5 ms"
noise_force = "0.3 N"
noise_moment = "0.03 N m"

[task]
capture = false
touch = true
max_depth = "50 mm"
"#;
