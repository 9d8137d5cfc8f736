//! Stratified sample of runs in one pass with bounded memory.

use std::collections::{BTreeMap, BinaryHeap};

use softdock_results::runs::Agreement;

/// A run that the page shows: codes and numbers in the order of the page's columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KeptRun {
    pub(crate) run: u64,
    pub(crate) flags: u32,
    pub(crate) codes: [u8; CODES],
    pub(crate) numbers: Box<[f32]>,
}

/// Codes of a run: agreement; outcome, cause and phase in space; the same on the facility.
pub(crate) const CODES: usize = 7;

/// A group of runs that is sampled for itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stratum {
    FalsePass,
    FalseFail,
    Aborted,
    Invalid,
    TrueFail,
    TruePass,
}

impl Stratum {
    pub(crate) const ALL: [Self; 6] =
        [Self::FalsePass, Self::FalseFail, Self::Aborted, Self::Invalid, Self::TrueFail, Self::TruePass];

    /// The stratum of an agreement.
    pub(crate) fn of(agreement: Agreement) -> Self {
        match agreement {
            Agreement::FalsePass => Self::FalsePass,
            Agreement::FalseFail => Self::FalseFail,
            Agreement::AbortedPass | Agreement::AbortedFail => Self::Aborted,
            Agreement::Invalid => Self::Invalid,
            Agreement::TrueFail => Self::TrueFail,
            Agreement::TruePass => Self::TruePass,
        }
    }

    /// Id in deep links, and its name.
    pub(crate) fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::FalsePass => ("false_pass", "false pass"),
            Self::FalseFail => ("false_fail", "false fail"),
            Self::Aborted => ("aborted", "aborted"),
            Self::Invalid => ("invalid", "invalid"),
            Self::TrueFail => ("true_fail", "true fail"),
            Self::TruePass => ("true_pass", "true pass"),
        }
    }
}

/// A well-mixed number of a run (SplitMix64): the runs with the smallest ones are a random sample.
pub(crate) fn mixed(run: u64) -> u64 {
    let mut z = run.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The runs of the smallest keys, with a bound on their number.
#[derive(Debug)]
pub(crate) struct Smallest<K: Ord> {
    most: usize,
    kept: BinaryHeap<Keyed<K>>,
}

#[derive(Debug)]
struct Keyed<K>(K, KeptRun);

impl<K: Ord> PartialEq for Keyed<K> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl<K: Ord> Eq for Keyed<K> {}

impl<K: Ord> PartialOrd for Keyed<K> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<K: Ord> Ord for Keyed<K> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.cmp(&other.0)
    }
}

impl<K: Ord> Smallest<K> {
    /// At most so many runs.
    pub(crate) fn new(most: usize) -> Self {
        Self { most, kept: BinaryHeap::new() }
    }

    /// Adds a run if its key is among the smallest; the run is built only then.
    pub(crate) fn add(&mut self, key: K, run: impl FnOnce() -> KeptRun) {
        let is_small = self.kept.len() < self.most || self.kept.peek().is_some_and(|greatest| key < greatest.0);
        if self.most > 0 && is_small {
            self.kept.push(Keyed(key, run()));
            if self.kept.len() > self.most {
                self.kept.pop();
            }
        }
    }

    /// The runs, smallest key first.
    pub(crate) fn into_runs(self) -> Vec<KeptRun> {
        self.kept.into_sorted_vec().into_iter().map(|Keyed(_, run)| run).collect()
    }
}

/// Joins strata to at most `most` runs besides those of `always`, ordered by run number.
///
/// Every stratum has the same share of the places; what it does not fill is for the others. Runs of a stratum come in
/// random order.
pub(crate) fn joined(always: Vec<KeptRun>, strata: Vec<Vec<KeptRun>>, most: usize) -> Vec<KeptRun> {
    let mut joined: BTreeMap<u64, KeptRun> = always.into_iter().map(|run| (run.run, run)).collect();
    let mut left = most.saturating_sub(joined.len());
    let mut strata: Vec<_> = strata;
    strata.iter_mut().for_each(|runs| runs.retain(|run| !joined.contains_key(&run.run)));
    // The smallest first: what it does not fill is shared by the rest.
    strata.sort_by_key(Vec::len);
    let count = strata.len();
    for (at, runs) in strata.into_iter().enumerate() {
        let share = left / (count - at);
        let taken = runs.into_iter().take(share);
        for run in taken {
            left -= 1;
            joined.insert(run.run, run);
        }
    }
    joined.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(run: u64) -> KeptRun {
        KeptRun { run, flags: 0, codes: [0; CODES], numbers: Box::default() }
    }

    #[test]
    fn smallest_keys_stay() {
        let mut smallest = Smallest::new(3);
        for key in [5, 1, 9, 3, 7, 2] {
            smallest.add(key, || run(key));
        }
        assert_eq!(smallest.into_runs().iter().map(|run| run.run).collect::<Vec<_>>(), [1, 2, 3]);
    }

    #[test]
    fn rare_strata_are_whole_and_the_rest_fills_the_places() {
        let (rare, common): (Vec<_>, Vec<_>) = ((0..5).map(run).collect(), (100..1_000).map(run).collect());
        let joined = joined(vec![run(50), run(3)], vec![common, rare], 40);
        assert_eq!(joined.len(), 40);
        assert!((0..5).all(|number| joined.iter().any(|run| run.run == number)), "the rare runs are there");
        assert!(joined.iter().any(|run| run.run == 50), "those that are always shown are there");
        assert!(joined.is_sorted_by_key(|run| run.run));
    }
}
