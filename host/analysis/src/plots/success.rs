//! Success probability along one dispersed input, with exact bands, in space and on the facility.

use crate::Result;
use crate::exact::{READING_CONFIDENCE, clopper_pearson};
use crate::number::axis_label;
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};
use crate::plots::sample::{Input, Sample};

/// Bins of a curve, at most.
const MOST_BINS: usize = 16;

/// Runs of a bin, at least: fewer give bands as wide as the figure.
const FEWEST_RUNS: usize = 40;

/// One bin: where it lies, runs, and successes in space and on the facility.
struct Bin {
    centre: f64,
    runs: u64,
    passed: [u64; 2],
}

/// The figure of one input, or `None` if the input does not vary or there are too few runs.
pub(crate) fn success_figure(sample: &Sample, input: &Input) -> Result<Option<Drawing>> {
    let bins = bins(sample, input);
    if bins.len() < 3 {
        return Ok(None);
    }
    let name = &input.name;
    let x = Axis::fitting(axis_label(name, &input.unit), input.moments.lo, input.moments.hi);
    let mut figure =
        Figure::new(format!("Success against {name}"), Size::Third, x, Axis::linear("task success", 0.0, 1.0));
    for (side, colour) in [(0, colour::SPACE), (1, colour::FACILITY)] {
        let share = |bin: &Bin| (bin.centre, bin.passed[side] as f64 / bin.runs as f64);
        let band = |bin: &Bin| {
            let interval = clopper_pearson(bin.passed[side], bin.runs, READING_CONFIDENCE);
            (bin.centre, interval.lo, interval.hi)
        };
        let bands: Vec<_> = bins.iter().map(band).collect();
        figure = figure.band(&bands, colour, 0.18).line(bins.iter().map(share).collect(), colour, 1.6);
    }
    Ok(Some(Drawing { svg: figure.svg()?, caption: input.meaning.clone() }))
}

/// Groups of runs along the input: one per value if it takes few, else groups of equal size.
fn bins(sample: &Sample, input: &Input) -> Vec<Bin> {
    let mut order: Vec<usize> = (0..sample.runs()).filter(|row| input.values[*row].is_finite()).collect();
    order.sort_by(|one, two| input.values[*one].total_cmp(&input.values[*two]));
    let same = |one: &usize, two: &usize| input.values[*one] == input.values[*two];
    let groups: Vec<&[usize]> = if order.chunk_by(same).take(MOST_BINS + 1).count() <= MOST_BINS {
        order.chunk_by(same).collect()
    } else {
        let bins = (order.len() / FEWEST_RUNS).clamp(1, MOST_BINS);
        order.chunks(order.len().div_ceil(bins)).collect()
    };
    let bin = |rows: &[usize]| Bin {
        centre: rows.iter().map(|row| input.values[*row]).sum::<f64>() / rows.len() as f64,
        runs: rows.len() as u64,
        passed: [0, 1].map(|side| rows.iter().filter(|row| sample.success[side][**row]).count() as u64),
    };
    groups.into_iter().map(bin).collect()
}
