//! Effects on a reference's way to a controller: delay, lag, clock, hold, rate limit.

use super::{Hypothesis, Shelf};
use crate::block::MeasuredBlock;
use crate::inference::unknown::{Prior, Role};

/// The effects of a controller that has been measured.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    let references = || block.trials.iter().flat_map(|trial| trial.recorded.late.chunks(5));
    let fastest = references().fold(0.0_f64, |peak, r| peak.max(r[1].abs()));
    let late = Prior::Positive { scale: 5e-3 };
    shelf.add("C1_transport_delay", "transport delay of the command", &[("delay", late, Role::Size)], &[0.5], &[]);
    shelf.add("C2_lag", "lag of the command", &[("lag", late, Role::Size)], &[0.5], &[]);
    let skew = Prior::Normal { mean: 0.0, sd: 2e-4 };
    shelf.add("C5_clock_skew", "skew of the clocks", &[("clock_skew", skew, Role::Size)], &[1.0], &[]);
    shelf.add("C6_hold", "hold of the command between packets", &[("hold", late, Role::Size)], &[0.4, 0.8, 1.6], &[]);
    let limit = Prior::Below { top: fastest, share: 0.2 };
    shelf.add(
        "C7_rate_limit",
        "limit of the command's rate",
        &[("rate_limit", limit, Role::Size)],
        &[0.3, 1.0, 3.0],
        &[],
    );
    shelf.all
}
