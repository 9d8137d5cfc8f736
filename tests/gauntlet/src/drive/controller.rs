//! The joint's sampled position controller, one call per period.

use super::nominal::{
    COULOMB, COULOMB_SPEED, FILTER_HZ, GRAVITY, LINK_INERTIA, MOTOR_INERTIA, PERIOD, POSITION_GAIN, TORQUE_LIMIT,
    VELOCITY_GAIN, VISCOUS,
};
use std::f64::consts::TAU;

/// The controller's memory.
pub(crate) struct Controller {
    /// Share of the filtered velocity kept from tick to tick.
    keep: f64,
    /// Filtered velocity \[rad/s\] and the last measured angle \[rad\].
    velocity: f64,
    last: Option<f64>,
}

impl Controller {
    pub(crate) fn new() -> Self {
        Self { keep: (-TAU * FILTER_HZ * PERIOD).exp(), velocity: 0.0, last: None }
    }

    /// Torque command \[N m\] from the received reference (angle, rate, acceleration) and the measured angle \[rad\].
    pub(crate) fn torque(&mut self, [angle, rate, acceleration]: [f64; 3], measured: f64) -> f64 {
        let difference = (measured - self.last.unwrap_or(measured)) / PERIOD;
        self.velocity = self.keep * self.velocity + (1.0 - self.keep) * difference;
        self.last = Some(measured);
        let feedforward = (MOTOR_INERTIA + LINK_INERTIA) * acceleration
            + VISCOUS * rate
            + COULOMB * (rate / COULOMB_SPEED).tanh()
            + GRAVITY * angle.cos();
        let feedback = POSITION_GAIN * (angle - measured) + VELOCITY_GAIN * (rate - self.velocity);
        (feedback + feedforward).clamp(-TORQUE_LIMIT, TORQUE_LIMIT)
    }
}
