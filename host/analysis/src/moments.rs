//! Mean, standard deviation and range of a sequence of values (Welford's recurrence).

/// Moments of the values so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    pub(crate) count: u64,
    pub(crate) mean: f64,
    squares: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

impl Moments {
    pub(crate) fn add(&mut self, value: f64) {
        (self.lo, self.hi) = if self.count == 0 { (value, value) } else { (self.lo.min(value), self.hi.max(value)) };
        self.count += 1;
        let change = value - self.mean;
        self.mean += change / self.count as f64;
        self.squares += change * (value - self.mean);
    }

    /// Sample standard deviation; 0 for fewer than two values.
    pub(crate) fn deviation(&self) -> f64 {
        if self.count < 2 { 0.0 } else { f64::sqrt(self.squares / (self.count - 1) as f64) }
    }

    /// Variance of the mean, and its degrees of freedom; `None` for fewer than two values.
    pub(crate) fn of_mean(&self) -> Option<(f64, f64)> {
        let (count, free) = (self.count as f64, self.count.checked_sub(1)? as f64);
        (free > 0.0).then(|| (self.squares / free / count, free))
    }
}

/// Quantile of sorted values; 0 without values.
pub(crate) fn sorted_quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}
