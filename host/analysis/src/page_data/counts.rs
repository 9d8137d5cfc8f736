//! Exact counts over all runs: along each input, over pairs of inputs, and over the margins of the requirements.

use serde::Serialize;
use softdock_results::runs::Agreement;

use crate::exact::{READING_CONFIDENCE, clopper_pearson};
use crate::moments::sorted_quantile;
use crate::page_data::block::{Array, Block};
use crate::page_data::pass::{HEAD, NumberColumn};

/// Bins of a curve, at most.
const MOST_BINS: usize = 16;

/// Runs of a bin among the head, at least: fewer give bands as wide as the figure.
const FEWEST_RUNS: usize = 40;

/// Bins of an input in a map over two inputs, at most.
const MAP_BINS: usize = 10;

/// Inputs that are mapped in pairs, at most: the most influential ones.
const MAPPED: usize = 12;

/// Bars of a histogram of margins.
const BARS: usize = 96;

/// Share of the margins cut off at each end, so that one wild run does not flatten the rest.
const CUT: f64 = 0.005;

/// Quartile ranges beyond the quartiles at which the axis of a histogram ends: a facility that diverges in many runs has
/// margins of any size.
const FENCE: f64 = 4.0;

/// What is counted in a bin besides the runs.
pub(crate) const COUNTED: [(&str, &str); 5] = [
    ("space", "success in space"),
    ("facility", "success on the facility"),
    ("aborted", "aborted session"),
    ("false_pass", "false pass"),
    ("false_fail", "false fail"),
];

/// Runs of a bin, and those with each of [`COUNTED`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tallied {
    runs: u64,
    of: [u64; COUNTED.len()],
}

/// What counts of a run.
type Seen = [bool; COUNTED.len()];

fn seen(agreement: Agreement, success: [bool; 2]) -> Seen {
    let aborted = matches!(agreement, Agreement::AbortedPass | Agreement::AbortedFail);
    [success[0], success[1], aborted, agreement == Agreement::FalsePass, agreement == Agreement::FalseFail]
}

impl Tallied {
    fn add(&mut self, seen: &Seen) {
        self.runs += 1;
        for (count, seen) in self.of.iter_mut().zip(seen) {
            *count += u64::from(*seen);
        }
    }
}

/// Bins along an input: `edges` lie between them.
#[derive(Clone, Debug, Default)]
struct Bins {
    edges: Vec<f64>,
    counts: Vec<Tallied>,
    sums: Vec<f64>,
}

impl Bins {
    /// Bins of about equal numbers of runs; one per value if there are few.
    fn of(sorted: &[f64], most: usize) -> Self {
        let mut distinct = sorted.to_vec();
        distinct.dedup();
        let edges: Vec<f64> = if distinct.len() <= most {
            distinct.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
        } else {
            let bins = (sorted.len() / FEWEST_RUNS).clamp(1, most);
            let mut edges: Vec<f64> = (1..bins).map(|bin| sorted[bin * sorted.len() / bins]).collect();
            edges.dedup();
            edges
        };
        let count = edges.len() + 1;
        Self { edges, counts: vec![Tallied::default(); count], sums: vec![0.0; count] }
    }

    fn bin(&self, value: f64) -> usize {
        self.edges.partition_point(|edge| *edge <= value)
    }

    fn add(&mut self, value: f64, seen: &Seen) {
        let bin = self.bin(value);
        self.counts[bin].add(seen);
        self.sums[bin] += value;
    }

    /// Share of the variance of an event that the input explains alone (first-order sensitivity index), less what chance
    /// gives; 0 for an event without variance.
    fn index(&self, event: usize) -> f64 {
        let runs: u64 = self.counts.iter().map(|bin| bin.runs).sum();
        let mean = self.counts.iter().map(|bin| bin.of[event]).sum::<u64>() as f64 / runs.max(1) as f64;
        let variance = mean * (1.0 - mean);
        let between: f64 = self
            .counts
            .iter()
            .filter(|bin| bin.runs > 0)
            .map(|bin| bin.runs as f64 * (bin.of[event] as f64 / bin.runs as f64 - mean).powi(2))
            .sum();
        let chance = self.edges.len() as f64 / runs.max(1) as f64;
        if variance > 0.0 { (between / runs as f64 / variance - chance).max(0.0) } else { 0.0 }
    }
}

/// Counts over two inputs: rows of the second.
#[derive(Clone, Debug)]
struct PairCounts {
    inputs: [usize; 2],
    counts: Vec<Tallied>,
}

/// Histogram of the margins of a requirement in both loops.
#[derive(Clone, Debug, Default)]
struct Margins {
    /// Ends of the axis; none if the margins take fewer than three values.
    range: Option<[f64; 2]>,
    bars: [Vec<u64>; 2],
    below: [u64; 2],
    above: [u64; 2],
    missing: [u64; 2],
}

impl Margins {
    fn new(head: &[Vec<f64>; 2]) -> Self {
        let range = range(head).map(|(lo, hi)| {
            let (lo, hi) = (lo.min(0.0), hi.max(0.0));
            let padding = 0.03 * (hi - lo);
            [lo - padding, hi + padding]
        });
        Self { range, bars: [vec![0; BARS], vec![0; BARS]], ..Self::default() }
    }

    fn add(&mut self, margins: [Option<f64>; 2]) {
        let Some([lo, hi]) = self.range else { return };
        for (side, margin) in margins.into_iter().enumerate() {
            match margin {
                None => self.missing[side] += 1,
                Some(margin) if margin < lo => self.below[side] += 1,
                Some(margin) if margin > hi => self.above[side] += 1,
                Some(margin) => {
                    let bar = (BARS as f64 * (margin - lo) / (hi - lo)) as usize;
                    self.bars[side][bar.min(BARS - 1)] += 1;
                }
            }
        }
    }
}

/// The range that the margins of both loops fill, without outliers; `None` for verdicts in disguise.
fn range(margins: &[Vec<f64>; 2]) -> Option<(f64, f64)> {
    let sorted = |values: &Vec<f64>| {
        let mut values = values.clone();
        values.sort_by(f64::total_cmp);
        values
    };
    let filled: Vec<Vec<f64>> = margins.iter().filter(|values| !values.is_empty()).map(sorted).collect();
    let ranges = filled.iter().map(|sorted| {
        let [first, third] = [0.25, 0.75].map(|share| sorted_quantile(sorted, share));
        let fence = if third > first { FENCE * (third - first) } else { f64::INFINITY };
        let [lo, hi] = [CUT, 1.0 - CUT].map(|share| sorted_quantile(sorted, share));
        (lo.max(first - fence), hi.min(third + fence))
    });
    let (lo, hi) = ranges.reduce(|one, two| (one.0.min(two.0), one.1.max(two.1)))?;
    let mut distinct: Vec<f64> = filled.into_iter().flatten().collect();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    (distinct.len() > 2).then_some((lo, hi))
}

/// A run of the head.
struct HeadRun {
    inputs: Vec<f64>,
    margins: Vec<[Option<f64>; 2]>,
    seen: Seen,
}

/// All counts; the first runs wait until the edges are known.
#[derive(Default)]
pub(crate) struct Counts {
    inputs: usize,
    requirements: usize,
    head: Vec<HeadRun>,
    is_placed: bool,
    curves: Vec<Bins>,
    /// Bins of the mapped inputs, by their places among the inputs.
    mapped: Vec<(usize, Bins)>,
    pairs: Vec<PairCounts>,
    margins: Vec<Margins>,
}

impl Counts {
    /// Counts for so many inputs and requirements.
    pub(crate) fn new(inputs: usize, requirements: usize) -> Self {
        Self { inputs, requirements, ..Self::default() }
    }

    /// Counts a run: its inputs (NaN if missing), its margins in both loops, its agreement and success in both loops.
    pub(crate) fn add(
        &mut self,
        inputs: impl Iterator<Item = f64>,
        margins: impl Iterator<Item = [Option<f64>; 2]>,
        agreement: Agreement,
        success: [bool; 2],
    ) {
        let run = HeadRun { inputs: inputs.collect(), margins: margins.collect(), seen: seen(agreement, success) };
        if self.is_placed {
            self.count(&run);
            return;
        }
        self.head.push(run);
        if self.head.len() == HEAD {
            self.close();
        }
    }

    /// Places the edges by the head and counts it.
    pub(crate) fn close(&mut self) {
        if self.is_placed {
            return;
        }
        self.is_placed = true;
        let head = std::mem::take(&mut self.head);
        let sorted = |input: usize| {
            let mut values: Vec<f64> =
                head.iter().map(|run| run.inputs[input]).filter(|value| value.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        self.curves = (0..self.inputs).map(|input| Bins::of(&sorted(input), MOST_BINS)).collect();
        let margins_of = |requirement: usize| {
            [0, 1].map(|side| head.iter().filter_map(|run| run.margins[requirement][side]).collect::<Vec<_>>())
        };
        self.margins = (0..self.requirements).map(|requirement| Margins::new(&margins_of(requirement))).collect();
        // The influence on the head decides which inputs are mapped.
        let mut trial = self.curves.clone();
        for run in &head {
            for (bins, value) in trial.iter_mut().zip(&run.inputs).filter(|(_, value)| value.is_finite()) {
                bins.add(*value, &run.seen);
            }
        }
        let mut order: Vec<usize> = (0..self.inputs).filter(|input| !trial[*input].edges.is_empty()).collect();
        let influence = |input: usize| influence(&trial[input]);
        order.sort_by(|one, two| influence(*two).total_cmp(&influence(*one)).then(one.cmp(two)));
        order.truncate(MAPPED);
        self.mapped = order.iter().map(|input| (*input, Bins::of(&sorted(*input), MAP_BINS))).collect();
        for (at, (one, bins)) in self.mapped.iter().enumerate() {
            for (two, others) in &self.mapped[at + 1..] {
                let cells = bins.counts.len() * others.counts.len();
                self.pairs.push(PairCounts { inputs: [*one, *two], counts: vec![Tallied::default(); cells] });
            }
        }
        for run in &head {
            self.count(run);
        }
    }

    fn count(&mut self, run: &HeadRun) {
        for (bins, value) in self.curves.iter_mut().zip(&run.inputs).filter(|(_, value)| value.is_finite()) {
            bins.add(*value, &run.seen);
        }
        for (margins, own) in self.margins.iter_mut().zip(&run.margins) {
            margins.add(*own);
        }
        let place = |(input, bins): &(usize, Bins)| {
            let value = run.inputs[*input];
            value.is_finite().then(|| (bins.bin(value), bins.counts.len()))
        };
        let places: Vec<Option<(usize, usize)>> = self.mapped.iter().map(place).collect();
        let mut pairs = self.pairs.iter_mut();
        for (at, one) in places.iter().enumerate() {
            for (two, pair) in places[at + 1..].iter().zip(&mut pairs) {
                if let (Some((x, columns)), Some((y, _))) = (one, two) {
                    pair.counts[y * columns + x].add(&run.seen);
                }
            }
        }
    }

    /// The curves along the inputs, the most influential first; those with fewer than three bins are left out.
    pub(crate) fn curves(&self, columns: &[NumberColumn], block: &mut Block) -> Vec<Curve> {
        let mut curves: Vec<Curve> = self
            .curves
            .iter()
            .zip(columns)
            .enumerate()
            .filter(|(_, (bins, _))| bins.counts.iter().filter(|bin| bin.runs > 0).count() > 2)
            .map(|(column, (bins, own))| curve(column, bins, own, block))
            .collect();
        curves.sort_by(|one, two| two.influence.total_cmp(&one.influence).then(one.column.cmp(&two.column)));
        curves
    }

    /// The maps over pairs of inputs.
    pub(crate) fn maps(&self, columns: &[NumberColumn], block: &mut Block) -> Maps {
        let axis = |(column, bins): &(usize, Bins)| {
            let moments = &columns[*column].moments;
            let edges = [moments.lo].into_iter().chain(bins.edges.iter().copied()).chain([moments.hi]).collect();
            MapAxis { column: *column, edges }
        };
        let numbers = |pair: &PairCounts| {
            pair.counts.iter().flat_map(|cell| [cell.runs].into_iter().chain(cell.of)).collect::<Vec<u64>>()
        };
        Maps {
            axes: self.mapped.iter().map(axis).collect(),
            pairs: self
                .pairs
                .iter()
                .map(|pair| Pair { columns: pair.inputs, counts: block.whole(&numbers(pair)) })
                .collect(),
        }
    }

    /// The histograms of the margins, in the order of the requirements.
    pub(crate) fn histograms(&self) -> Vec<Option<Histogram>> {
        let histogram = |margins: &Margins| {
            margins.range.map(|range| Histogram {
                range,
                bars: margins.bars.clone(),
                below: margins.below,
                above: margins.above,
                missing: margins.missing,
            })
        };
        self.margins.iter().map(histogram).collect()
    }
}

/// Greatest first-order index of the success in space and on the facility.
fn influence(bins: &Bins) -> f64 {
    bins.index(0).max(bins.index(1))
}

fn curve(column: usize, bins: &Bins, own: &NumberColumn, block: &mut Block) -> Curve {
    let filled: Vec<usize> = (0..bins.counts.len()).filter(|bin| bins.counts[*bin].runs > 0).collect();
    let single = |values: Vec<f64>, block: &mut Block| {
        block.numbers(&values.into_iter().map(|value| value as f32).collect::<Vec<_>>())
    };
    let edge = |at: Option<usize>, end: f64| at.and_then(|at| bins.edges.get(at).copied()).unwrap_or(end);
    let shares = (0..COUNTED.len())
        .map(|event| {
            let of = |bin: &usize| {
                let Tallied { runs, of } = bins.counts[*bin];
                let interval = clopper_pearson(of[event], runs, READING_CONFIDENCE);
                [of[event] as f64 / runs as f64, interval.lo, interval.hi]
            };
            single(filled.iter().flat_map(of).collect(), block)
        })
        .collect();
    Curve {
        column,
        index: std::array::from_fn(|event| bins.index(event)),
        influence: influence(bins),
        centres: single(filled.iter().map(|bin| bins.sums[*bin] / bins.counts[*bin].runs as f64).collect(), block),
        ends: single(
            filled
                .iter()
                .flat_map(|bin| [edge(bin.checked_sub(1), own.moments.lo), edge(Some(*bin), own.moments.hi)])
                .collect(),
            block,
        ),
        runs: block.whole(&filled.iter().map(|bin| bins.counts[*bin].runs).collect::<Vec<_>>()),
        shares,
    }
}

/// Shares of [`COUNTED`] along an input.
#[derive(Debug, Serialize)]
pub(crate) struct Curve {
    /// Place of the input among the columns of numbers.
    column: usize,
    /// First-order sensitivity index of each of [`COUNTED`].
    index: [f64; COUNTED.len()],
    /// Greatest index of the success in both loops.
    influence: f64,
    /// Mean of the input in each bin.
    centres: Array,
    /// Lower and upper end of each bin.
    ends: Array,
    /// Runs of each bin.
    runs: Array,
    /// Per event: share, lower and upper end of its interval for each bin.
    shares: Vec<Array>,
}

/// Counts over pairs of inputs.
#[derive(Debug, Serialize)]
pub(crate) struct Maps {
    axes: Vec<MapAxis>,
    pairs: Vec<Pair>,
}

/// An input with the edges of its bins, both ends included.
#[derive(Debug, Serialize)]
struct MapAxis {
    column: usize,
    edges: Vec<f64>,
}

/// A pair of inputs: per cell, rows of the second input, the runs and those with each of [`COUNTED`].
#[derive(Debug, Serialize)]
struct Pair {
    columns: [usize; 2],
    counts: Array,
}

/// Histogram of the margins of a requirement: space, facility.
#[derive(Debug, Serialize)]
pub(crate) struct Histogram {
    range: [f64; 2],
    bars: [Vec<u64>; 2],
    below: [u64; 2],
    above: [u64; 2],
    missing: [u64; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Success in space where the first input is above a half; the second has no influence.
    fn counts(runs: usize) -> Counts {
        let mut counts = Counts::new(2, 1);
        for run in 0..runs {
            let x = (run % 1_000) as f64 / 1_000.0;
            let y = (run * 7 % 999) as f64 / 999.0;
            let pass = x >= 0.5;
            let agreement = Agreement::of(pass, Some(pass));
            counts.add([x, y].into_iter(), [[Some(x - 0.5), None]].into_iter(), agreement, [pass, pass]);
        }
        counts.close();
        counts
    }

    #[test]
    fn every_run_is_counted_beyond_the_head() {
        let runs = HEAD + 5_000;
        let counts = counts(runs);
        for bins in &counts.curves {
            assert_eq!(bins.counts.iter().map(|bin| bin.runs).sum::<u64>(), runs as u64);
        }
        assert_eq!(counts.pairs[0].counts.iter().map(|cell| cell.runs).sum::<u64>(), runs as u64);
        let margins = &counts.margins[0];
        let seen = margins.bars[0].iter().sum::<u64>() + margins.below[0] + margins.above[0];
        assert_eq!((seen, margins.missing[1]), (runs as u64, runs as u64));
    }

    #[test]
    fn influential_input_ranks_first() {
        let counts = counts(4_000);
        assert!(influence(&counts.curves[0]) > 0.8, "{}", influence(&counts.curves[0]));
        assert!(influence(&counts.curves[1]) < 0.05, "{}", influence(&counts.curves[1]));
        assert_eq!(counts.mapped[0].0, 0);
    }

    #[test]
    fn few_values_have_a_bin_each() {
        let bins = Bins::of(&[1.0, 1.0, 2.0, 4.0], 16);
        assert_eq!(bins.edges, [1.5, 3.0]);
        assert_eq!([1.0, 2.0, 4.0].map(|value| bins.bin(value)), [0, 1, 2]);
    }
}
