//! The nominal drive: its numbers, the tolerances on them, and the text of the model file.

/// Rotor and gear, joint side \[kg m^2\].
pub(crate) const MOTOR_INERTIA: f64 = 10.0;
/// Link \[kg m^2\].
pub(crate) const LINK_INERTIA: f64 = 15.0;
/// Coulomb friction \[N m\].
pub(crate) const COULOMB: f64 = 20.0;
/// Viscous friction \[N m s/rad\].
pub(crate) const VISCOUS: f64 = 30.0;
/// Bristle deflection at which the friction slides \[rad\].
pub(crate) const PRESLIDING_TRAVEL: f64 = 0.0002;
/// Gravity torque with the link horizontal (q = 0) \[N m\].
pub(crate) const GRAVITY: f64 = 60.0;
/// Where a payload sits \[m\].
pub(crate) const PAYLOAD_RADIUS: f64 = 0.8;

/// Controller's period \[s\].
pub(crate) const PERIOD: f64 = 0.001;
/// Bandwidth \[Hz\] and damping ratio of the position loop, from which the gains below follow: J w^2 and 2 z J w.
#[cfg(test)]
pub(crate) const LOOP: (f64, f64) = (6.0, 0.7);
/// Position gain \[N m/rad\].
pub(crate) const POSITION_GAIN: f64 = 35_530.0;
/// Velocity gain \[N m s/rad\].
pub(crate) const VELOCITY_GAIN: f64 = 1_319.0;
/// Corner of the velocity's filter \[Hz\].
pub(crate) const FILTER_HZ: f64 = 100.0;
/// Speed over which the feedforward's Coulomb torque changes sign \[rad/s\].
pub(crate) const COULOMB_SPEED: f64 = 0.02;
/// Limit of the commanded torque \[N m\].
pub(crate) const TORQUE_LIMIT: f64 = 800.0;

/// Tolerances: standard deviations of the nuisance parameters: shares, but N m for the offset and s for the clock.
pub(crate) mod tolerance {
    pub(crate) const COULOMB: f64 = 0.03;
    pub(crate) const VISCOUS: f64 = 0.03;
    pub(crate) const TORQUE_CONSTANT: f64 = 0.005;
    pub(crate) const OFFSET: f64 = 0.3;
    pub(crate) const CLOCK_OFFSET: f64 = 0.0002;
    pub(crate) const PRESLIDING_TRAVEL: f64 = 0.2;
}

/// The model file's text.
pub(crate) fn text(link_encoder: bool) -> String {
    let link = if link_encoder { "\"q_link\" = { column = \"ql_rad\", unit = \"rad\" }\n" } else { "" };
    format!("{MODEL}{link}")
}

const MODEL: &str = r#"schema = "rig/1"
kind = "drive"
id = "bench-joint"

# One revolute joint. A recording starts as the brake opens: everything at rest, the reference at the measured angle.
[drive]
motion = "revolute"
motor_inertia = "10 kg m^2"       # joint side, gear included
link_inertia = "15 kg m^2"
coulomb = "20 N m"
viscous = "30 N m s/rad"
presliding_travel = "0.0002 rad"  # friction rises to its sliding level over this
gravity_torque = "60 N m"         # times cos(q - gravity_angle), against positive q
gravity_angle = "0 rad"
payload_radius = "0.8 m"

# Tolerances: standard deviations of the nuisance parameters.
[tolerance]
coulomb = "3 %"
viscous = "3 %"
torque_constant = "0.5 %"
offset = "0.3 N m"
clock_offset = "0.2 ms"           # torque channel against motion channel
presliding_travel = "20 %"

# torque = position_gain (ref - q) + velocity_gain (ref' - w) + feedforward, held over a period;
# w[k] = p w[k-1] + (1 - p) (q[k] - q[k-1]) / period with p = exp(-2 pi derivative_filter period).
# The reference is streamed with its rate ref' and acceleration ref''.
[controller]
period = "1 ms"
position_gain = "35530 N m/rad"
velocity_gain = "1319 N m s/rad"
derivative_filter = "100 Hz"
torque_limit = "800 N m"

# inertia ref'' + viscous ref' + coulomb tanh(ref' / coulomb_speed) + gravity_torque cos(ref - gravity_angle)
[controller.feedforward]
inertia = "25 kg m^2"
viscous = "30 N m s/rad"
coulomb = "20 N m"
coulomb_speed = "0.02 rad/s"
gravity_torque = "60 N m"
gravity_angle = "0 rad"

# 250 Hz, every fourth tick of the controller; t goes on from recording to recording.
[log]
"t" = { column = "t_s", unit = "s" }
"ref" = { column = "ref_rad", unit = "rad" }
"q" = { column = "q_rad", unit = "rad" }
"tau" = { column = "tau_nm", unit = "N m" }
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// The number in the text's line `key = "number unit"`, the n-th such line.
    fn written(key: &str, nth: usize) -> f64 {
        let start = format!("{key} = \"");
        let line = MODEL.lines().filter_map(|line| line.strip_prefix(&start)).nth(nth).expect(key);
        line.split([' ', '"']).next().and_then(|number| number.parse().ok()).expect("a number")
    }

    #[test]
    fn model_text_matches_the_rig() {
        let plant = [
            ("motor_inertia", MOTOR_INERTIA),
            ("link_inertia", LINK_INERTIA),
            ("coulomb", COULOMB),
            ("viscous", VISCOUS),
            ("presliding_travel", PRESLIDING_TRAVEL),
            ("gravity_torque", GRAVITY),
            ("payload_radius", PAYLOAD_RADIUS),
            ("period", PERIOD * 1e3),
            ("position_gain", POSITION_GAIN),
            ("velocity_gain", VELOCITY_GAIN),
            ("derivative_filter", FILTER_HZ),
            ("torque_limit", TORQUE_LIMIT),
            ("inertia", MOTOR_INERTIA + LINK_INERTIA),
            ("coulomb_speed", COULOMB_SPEED),
            ("torque_constant", tolerance::TORQUE_CONSTANT * 100.0),
            ("offset", tolerance::OFFSET),
            ("clock_offset", tolerance::CLOCK_OFFSET * 1e3),
        ];
        for (key, value) in plant {
            assert_eq!(written(key, 0), value, "{key}");
        }
        assert_eq!(written("coulomb", 1), tolerance::COULOMB * 100.0);
        assert_eq!(written("viscous", 1), tolerance::VISCOUS * 100.0);
        assert_eq!(written("presliding_travel", 1), tolerance::PRESLIDING_TRAVEL * 100.0);
        for (key, value) in [("coulomb", COULOMB), ("viscous", VISCOUS), ("gravity_torque", GRAVITY)] {
            let feedforward = written(key, if key == "gravity_torque" { 1 } else { 2 });
            assert_eq!(feedforward, value, "{key} of the feedforward");
        }
    }

    #[test]
    fn gains_match_the_loop_bandwidth() {
        let (hz, damping) = LOOP;
        let (inertia, omega) = (MOTOR_INERTIA + LINK_INERTIA, TAU * hz);
        assert!((POSITION_GAIN / (inertia * omega * omega) - 1.0).abs() < 1e-4);
        assert!((VELOCITY_GAIN / (2.0 * damping * inertia * omega) - 1.0).abs() < 1e-3);
    }
}
