//! Commands before the lag and the rate limit that follow the packets: their differences between repeats come from the
//! packets.

use crate::verdict::answer::EffectFound;
use softdock_kernels::block::command::CommandValues;
use softdock_kernels::block::low_pass::LowPass;

/// Share of a limit from which on a rate counts as limited.
const AT_LIMIT: f64 = 0.99;
/// Share of a limit that jitter alone does not reach.
const WELL_BELOW: f64 = 0.8;

/// Lag and limit between the packets and the effective command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Behind {
    /// Time constant of the lag \[s\], 0 without one.
    lag: f64,
    /// Greatest rate \[rad/s\].
    rate_limit: f64,
}

impl Behind {
    /// As a model has it.
    pub(super) fn of(values: &CommandValues<f64>) -> Self {
        Self { lag: values.lag, rate_limit: values.rate_limit }
    }

    /// The same with what was found.
    pub(super) fn with(self, effects: &[EffectFound]) -> Self {
        let value = |field: &str, own: f64| {
            let estimate = effects.iter().find_map(|effect| effect.parameters.get(field));
            estimate.map_or(own, |estimate| estimate.value)
        };
        Self { lag: value("lag", self.lag), rate_limit: value("rate_limit", self.rate_limit) }
    }

    /// The commands \[rad\] that become these behind the lag, row by row of a step \[s\].
    pub(super) fn arrived(&self, received: &[f64], step: f64) -> Vec<f64> {
        if self.lag <= 0.0 {
            return received.to_vec();
        }
        let [keep, old, new] = self.shares(step);
        let mut arrived = received.first().copied().into_iter().collect::<Vec<f64>>();
        for pair in received.windows(2) {
            let before = arrived[arrived.len() - 1];
            arrived.push((pair[1] - keep * pair[0] - old * before) / new);
        }
        arrived
    }

    /// Factor by which taking the lag off makes independent errors larger: of an autoregression of first order that sums
    /// each error and, negative, the one before.
    pub(super) fn magnified(&self, step: f64) -> f64 {
        if self.lag <= 0.0 {
            return 1.0;
        }
        let [keep, old, new] = self.shares(step);
        let again = old / new;
        ((1.0 + keep * keep + 2.0 * keep * again) / (1.0 - again * again)).sqrt() / new
    }

    /// What is left after a step of the lag's output, and the shares that the commands before and after it have.
    fn shares(&self, step: f64) -> [f64; 3] {
        let of = LowPass::of(step, self.lag);
        [of.after(0.0, 0.0, 0.0, 1.0), of.after(1.0, 0.0, 0.0, 0.0), of.after(0.0, 1.0, 0.0, 0.0)]
    }

    /// Whether a change within a step \[s\] is the limit's, not the command's.
    pub(super) fn limits(&self, change: f64, step: f64) -> bool {
        change.abs() > AT_LIMIT * self.rate_limit * step
    }

    /// Returns whether a command of this rate \[rad/s\] stays below the limit despite jitter of the packets.
    pub(super) fn spares(&self, rate: f64) -> bool {
        rate < WELL_BELOW * self.rate_limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lag_is_removed_exactly_with_losses() {
        let (step, lag) = (1e-3, 3.3e-3);
        let low_pass = LowPass::of(step, lag);
        // A ramp on which some packets got lost.
        let sent: Vec<f64> = (0..200).map(|k| if k % 17 == 5 { f64::from(k - 1) } else { f64::from(k) }).collect();
        let mut received = vec![sent[0]];
        for pair in sent.windows(2) {
            received.push(low_pass.after(pair[0], pair[1], 0.0, received[received.len() - 1]));
        }
        let arrived = Behind { lag, rate_limit: 1e9 }.arrived(&received, step);
        assert!(arrived.iter().zip(&sent).all(|(own, sent)| (own - sent).abs() < 1e-6));
    }

    #[test]
    fn error_magnification_is_as_stated() {
        let (step, behind) = (1e-3, Behind { lag: 2.5e-3, rate_limit: 1e9 });
        let draw = |k: u32| softdock_kernels::philox::uniform(7, "errors", 0, k) - 0.5;
        let errors: Vec<f64> = (0..20_000).map(draw).collect();
        let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
        let grown = (power(&behind.arrived(&errors, step)) / power(&errors)).sqrt();
        assert!((grown / behind.magnified(step) - 1.0).abs() < 0.05, "{grown} {}", behind.magnified(step));
    }
}
