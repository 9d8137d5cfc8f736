//! A histogram of times: fixed memory, a few instructions per value, 3 % resolution.

use crate::time::Nanos;
use std::fmt;

/// Buckets per doubling: a power of two.
const STEPS: u64 = 32;
const STEP_BITS: u32 = STEPS.trailing_zeros();
/// Doublings above the exact range: up to 18 minutes.
const DOUBLINGS: usize = 35;
const BUCKETS: usize = (DOUBLINGS + 1) * STEPS as usize;

/// Counts of measured times; allocates only at its creation.
#[derive(Clone)]
pub struct Histogram {
    counts: Box<[u64; BUCKETS]>,
    total: u64,
    max: Nanos,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: Box::new([0; BUCKETS]), total: 0, max: Nanos(0) }
    }
}

impl Histogram {
    /// Adds a time; a negative one counts as 0.
    pub fn add(&mut self, time: Nanos) {
        self.counts[bucket(time.0.max(0) as u64)] += 1;
        self.total += 1;
        self.max = self.max.max(time);
    }

    /// Adds all times of another histogram.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts.iter()).for_each(|(count, more)| *count += more);
        self.total += other.total;
        self.max = self.max.max(other.max);
    }

    /// Returns the number of added times.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Returns upper bound and count of each doubling, from the first to the last non-empty one.
    pub fn doublings(&self) -> impl Iterator<Item = (Nanos, u64)> {
        let counts = |doubling: usize| self.counts[doubling * STEPS as usize..][..STEPS as usize].iter().sum::<u64>();
        let any = |doubling: &usize| counts(*doubling) > 0;
        let (first, last) = ((0..=DOUBLINGS).find(any).unwrap_or(0), (0..=DOUBLINGS).rfind(any).unwrap_or(0));
        (first..=last).map(move |doubling| (Nanos((STEPS << doubling) as i64), counts(doubling)))
    }

    /// Returns the longest time.
    pub fn max(&self) -> Nanos {
        self.max
    }

    /// Returns the quantile of a share (0 to 1), too long by one bucket at most; 0 without values.
    pub fn quantile(&self, share: f64) -> Nanos {
        let wanted = (share * self.total as f64).ceil().max(1.0) as u64;
        let mut below = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            below += count;
            if below >= wanted {
                return upper_end(bucket).min(self.max);
            }
        }
        self.max
    }
}

/// Exact below the first doubling, then this number of buckets in each.
fn bucket(time: u64) -> usize {
    if time < STEPS {
        return time as usize;
    }
    let doubling = time.ilog2() - STEP_BITS;
    let step = (time >> doubling) - STEPS;
    (((u64::from(doubling) + 1) * STEPS + step) as usize).min(BUCKETS - 1)
}

/// Returns the longest time of a bucket.
fn upper_end(bucket: usize) -> Nanos {
    let (doubling, step) = (bucket as u64 / STEPS, bucket as u64 % STEPS);
    let end = if doubling == 0 { step } else { ((STEPS + step + 1) << (doubling - 1)) - 1 };
    Nanos(end as i64)
}

impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = |time: Nanos| time.0 as f64 * 1e-3;
        let [p50, p99, p999] = [0.5, 0.99, 0.999].map(|share| us(self.quantile(share)));
        write!(f, "p50 {p50:.1}, p99 {p99:.1}, p99.9 {p999:.1}, max {:.1} us", us(self.max))
    }
}

impl fmt::Debug for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} times, {self}", self.total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bucket_width_is_within_the_resolution() {
        let mut before = 0;
        for time in (0..2000).chain((11..38).flat_map(|k| [(1u64 << k) - 1, 1 << k, (1 << k) + (1 << (k - 1))])) {
            let (at, end) = (bucket(time), upper_end(bucket(time)).0 as u64);
            assert!(at >= before && end >= time, "{time}: bucket {at} ends at {end}");
            assert!(end - time <= time / STEPS, "{time}: bucket {at} ends at {end}");
            before = at;
        }
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn quantiles_match_sorted_times() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.99), Nanos(0));
        (1..=1000).rev().for_each(|micros| histogram.add(Nanos::from_micros(micros)));
        histogram.add(Nanos(-5));
        for (share, micros) in [(0.5, 500), (0.99, 990), (0.999, 999)] {
            let found = histogram.quantile(share).0 as f64 * 1e-3;
            assert!((f64::from(micros) - 1.0..=f64::from(micros) * 1.04).contains(&found), "{share}: {found} us");
        }
        assert_eq!((histogram.total(), histogram.max()), (1001, Nanos::from_millis(1)));
        let doublings: Vec<_> = histogram.doublings().collect();
        assert_eq!(doublings.iter().map(|(_, count)| count).sum::<u64>(), 1001);
        // The negative time is the first; the last doubling covers 525 us to 1 ms.
        assert_eq!((doublings[0], doublings.last()), ((Nanos(32), 1), Some(&(Nanos(1 << 20), 476))));
        let mut twice = histogram.clone();
        twice.merge(&histogram);
        assert_eq!((twice.total(), twice.quantile(0.5)), (2002, histogram.quantile(0.5)));
    }
}
