//! Materials of a contact pair: its normal law and its properties.

use crate::bundle;

bundle! {
    /// Properties of a contact pair: the mounted parts may differ from those in space.
    Pair {
        stiffness: R, "N/m", "normal stiffness K (N/m^n)";
        damping: R, "N s/m", "linear damping b";
        dissipation: R, "s/m", "dissipation a of K d^n (1 + a d')";
        friction: R, "1", "Coulomb friction coefficient";
        bristle_stiffness: R, "N/m", "tangential stiffness before slip";
        bristle_damping: R, "N s/m", "tangential damping before slip";
        exponent_error: R, "1", "error e of the exponent: the spring times (d / 1 mm)^e";
        stribeck: R, "1", "share s of the friction that falls with the sliding speed";
        stribeck_speed: R, "m/s", "sliding speed at which that share has fallen to 1/e";
        anisotropy: R, "1", "share a by which friction is higher along part B's y axis and lower across it";
        adhesion: R, "N", "tension of a point before it separates";
    }
}

/// The normal contact law: force over depth d and sink rate d'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalLaw {
    /// F = K d + b d'. Its force jumps to b d' at the touch.
    Linear,
    /// F = K d^n (1 + a d') (Hunt and Crossley 1975).
    Power {
        /// The exponent n: 1, 1.5 (Hertz) or any other above 0.
        exponent: f64,
    },
    /// F = K d^n (1 + a v_s / v d') with the speed of approach v of each touch: the restitution is the same at every speed
    /// (Lankarani and Nikravesh 1990; Flores et al. 2011). The dissipation a is that of a touch at v_s.
    Rebound {
        /// The exponent n.
        exponent: f64,
        /// Speed v_s of the slowest touch \[m/s\]: a slower one is damped as one of this speed.
        slowest: f64,
    },
    /// F = K d^n + b s d', with the cubic step s that rises from 0 at the touch to 1 at the depth `ramp` (the IMPACT
    /// function of ADAMS).
    Impact {
        /// The exponent n.
        exponent: f64,
        /// Depth of the full damping \[m\].
        ramp: f64,
    },
    /// F = K d + b d', and K_s (d - s)^m beside it beyond the stroke s: a bumper that meets its stop.
    Stop {
        /// The stroke s \[m\].
        stroke: f64,
        /// Stiffness K_s of the stop \[N/m^m\].
        stiffness: f64,
        /// Exponent m of the stop.
        exponent: f64,
    },
}

impl NormalLaw {
    /// Whether the damping b damps it, and not the dissipation a.
    pub fn is_viscous(&self) -> bool {
        matches!(self, Self::Linear | Self::Impact { .. } | Self::Stop { .. })
    }

    /// Whether its force jumps to b d' at the touch.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::Linear | Self::Stop { .. })
    }

    /// Returns the law in words, with the properties of a pair.
    pub fn text(&self, pair: &Pair<f64>) -> String {
        let (k, b, a) = (pair.stiffness, pair.damping, pair.dissipation);
        match *self {
            Self::Linear => format!("F = K d + b d', K = {k:.3e} N/m, b = {b:.3e} N s/m"),
            Self::Power { exponent: n } => format!("F = K d^{n} (1 + a d'), K = {k:.3e} N/m^{n}, a = {a:.3e} s/m"),
            Self::Rebound { exponent: n, slowest } => {
                format!("F = K d^{n} (1 + D d'/v), K = {k:.3e} N/m^{n}, D = {:.4}", a * slowest)
            }
            Self::Impact { exponent: n, ramp } => {
                let ramp = (1e6 * ramp).round() / 1e3;
                format!("F = K d^{n} + b s d', K = {k:.3e} N/m^{n}, b = {b:.3e} N s/m from {ramp} mm on")
            }
            Self::Stop { stroke, stiffness, exponent: m } => {
                let stroke = (1e6 * stroke).round() / 1e3;
                format!(
                    "F = K d + b d', K = {k:.3e} N/m, b = {b:.3e} N s/m, stop of {stiffness:.3e} N/m^{m} beyond {stroke} mm"
                )
            }
        }
    }

    /// Whether a contact keeps the speed of approach of its touch.
    pub fn needs_approach(&self) -> bool {
        matches!(self, Self::Rebound { .. })
    }

    /// Returns the greatest slope \[N/m\] and damping \[N s/m\] up to a depth \[m\].
    pub fn slope_and_damping(&self, pair: &Pair<f64>, depth: f64) -> [f64; 2] {
        let k = pair.stiffness;
        let slope = |n: f64| k * n * depth.powf(n - 1.0);
        match *self {
            Self::Linear => [k, pair.damping],
            Self::Power { exponent: n } | Self::Rebound { exponent: n, .. } => {
                [slope(n), k * depth.powf(n) * pair.dissipation]
            }
            Self::Impact { exponent: n, .. } => [slope(n), pair.damping],
            Self::Stop { stroke, stiffness, exponent } => {
                let beyond = (depth - stroke).max(0.0);
                let stop = if beyond > 0.0 { stiffness * exponent * beyond.powf(exponent - 1.0) } else { 0.0 };
                [k + stop, pair.damping]
            }
        }
    }
}
