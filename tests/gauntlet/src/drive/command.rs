//! The path of the reference from where it is sent (and logged) to the controller.

use super::nominal::PERIOD;
use crate::catalogue::Sizes;
use crate::motion::Reference;

/// What may happen to a reference on its way.
pub(crate) struct CommandPath {
    /// Dead time \[s\].
    delay: f64,
    /// Dead time per commanded torque \[s/(N m)\].
    delay_per_torque: f64,
    /// Time constant of a first-order lag \[s\].
    lag: f64,
    /// Share by which the sender's clock is slow.
    skew: f64,
    /// Period over which the reference is held \[s\].
    hold: f64,
    /// Greatest rate \[rad/s\].
    rate_limit: f64,
    /// Acceleration behind the lag, and what went into it last \[rad/s^2\].
    lagged: f64,
    before: f64,
    /// Angle behind the limit \[rad\].
    limited: f64,
}

/// Torque \[N m\] at which a load-dependent delay has the size that names it.
const DELAY_TORQUE: f64 = 100.0;

impl CommandPath {
    /// A path at rest at an angle \[rad\].
    pub(crate) fn new(sizes: &Sizes, angle: f64) -> Self {
        Self {
            delay: sizes.of("C1_transport_delay"),
            delay_per_torque: sizes.of("load_dependent_delay") / DELAY_TORQUE,
            lag: sizes.of("C2_lag"),
            skew: sizes.of("C5_skew"),
            hold: sizes.of("C6_hold"),
            rate_limit: sizes.limit("C7_rate_limit"),
            lagged: 0.0,
            before: 0.0,
            limited: angle,
        }
    }

    /// The reference (angle, rate, acceleration) that the controller receives at a time \[s\] of the record, called once
    /// per period; the torque \[N m\] is the last one commanded.
    pub(crate) fn received(&mut self, motion: &dyn Reference, time: f64, torque: f64) -> [f64; 3] {
        let sent = if self.hold > 0.0 { (time / self.hold + 1e-9).floor() * self.hold } else { time };
        let delay = self.delay + self.delay_per_torque * torque.abs();
        let reference = motion.at(sent * (1.0 - self.skew) - delay);
        let reference = self.through_lag(reference);
        self.through_limit(reference)
    }

    /// First-order lag, exact for an acceleration that is linear between ticks; rate and angle follow from
    /// T x_l' + x_l = x, so that the three belong together.
    fn through_lag(&mut self, [angle, rate, acceleration]: [f64; 3]) -> [f64; 3] {
        if self.lag == 0.0 {
            return [angle, rate, acceleration];
        }
        let keep = (-PERIOD / self.lag).exp();
        let behind = self.lag * (acceleration - self.before) / PERIOD;
        self.lagged = acceleration - behind + keep * (self.lagged - self.before + behind);
        self.before = acceleration;
        let lagged_rate = rate - self.lag * self.lagged;
        [angle - self.lag * lagged_rate, lagged_rate, self.lagged]
    }

    /// The angle runs after the reference no faster than the limit; while it does, rate and acceleration are its own.
    fn through_limit(&mut self, [angle, rate, acceleration]: [f64; 3]) -> [f64; 3] {
        let step = self.rate_limit * PERIOD;
        let wanted = angle - self.limited;
        if wanted.abs() <= step {
            self.limited = angle;
            return [angle, rate, acceleration];
        }
        self.limited += step.copysign(wanted);
        [self.limited, self.rate_limit.copysign(wanted), 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{Hidden, Rig};
    use crate::motion::{Motion, sine};

    fn received(id: &'static str, size: f64, time: f64) -> [f64; 3] {
        let sizes = Sizes::check(Rig::Drive { link_encoder: false }, &[Hidden { id, size }]).expect("an effect");
        let motion = Motion { centre: 0.2, waves: vec![sine(0.1, 1.0, 0.0)] };
        let mut path = CommandPath::new(&sizes, 0.2);
        let ticks = (time / PERIOD).round() as usize;
        (0..=ticks).fold([0.0; 3], |_, tick| path.received(&motion, tick as f64 * PERIOD, -50.0))
    }

    fn sent(time: f64) -> [f64; 3] {
        Motion { centre: 0.2, waves: vec![sine(0.1, 1.0, 0.0)] }.at(time)
    }

    fn near(a: [f64; 3], b: [f64; 3], bound: f64) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < bound), "{a:?} {b:?}");
    }

    #[test]
    fn timing_effects_shift_the_times() {
        near(received("C1_transport_delay", 0.0037, 2.5), sent(2.4963), 1e-12);
        near(received("load_dependent_delay", 0.004, 2.5), sent(2.498), 1e-12);
        near(received("C5_skew", 0.001, 2.5), sent(2.4975), 1e-12);
        near(received("C6_hold", 0.008, 2.503), sent(2.496), 1e-12);
    }

    #[test]
    fn lag_response_to_a_sine_is_exact() {
        // 1/(T s + 1) at 1 Hz, fade long over: 0.2 + A g sin(w t - atan(w T)).
        let (omega, lag, time) = (std::f64::consts::TAU, 0.05_f64, 2.6);
        let gain = 0.1 / (1.0 + (omega * lag).powi(2)).sqrt();
        let (sin, cos) = (omega * time - (omega * lag).atan()).sin_cos();
        let expected = [0.2 + gain * sin, gain * omega * cos, -gain * omega * omega * sin];
        near(received("C2_lag", lag, time), expected, 1e-5);
    }

    #[test]
    fn rate_limit_limits_the_rate() {
        let [angle, rate, acceleration] = received("C7_rate_limit", 0.3, 2.02);
        assert!((angle - sent(2.02)[0]).abs() > 0.001 && rate == 0.3 && acceleration == 0.0);
    }
}
