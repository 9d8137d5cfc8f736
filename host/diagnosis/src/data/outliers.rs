//! Isolated outliers of recordings: cells far from neighbours that agree with each other.

use crate::data::median;

/// Quantile of the second differences of a signal, and how many times a damaged cell is off by it at least.
const USUAL: f64 = 0.97;
const OFF: f64 = 8.0;
/// Share of its deviation by which the course around a damaged cell bends at most.
const AGREE: f64 = 0.1;

/// Samples to either side of one that a position is compared with.
const AROUND: usize = 3;
/// How many times their median deviation from their median a position is off by at least.
const BEYOND: f64 = 10.0;

/// Returns the rows of isolated outliers of a position: those of any signal, and up to three in a row or close to each
/// other, since no body leaves its course for some samples and is back.
pub(crate) fn isolated_positions(values: &[f64]) -> Vec<usize> {
    in_rows(values, |numbers| {
        let Some(limit) = limit(numbers) else { return Vec::new() };
        let is_off = |place: &usize| {
            let around = &numbers[place - AROUND..=place + AROUND];
            let middle = median(around.to_vec());
            let off = (numbers[*place] - middle).abs();
            off > limit && off > BEYOND * median(around.iter().map(|value| (value - middle).abs()).collect())
        };
        let inner = AROUND..numbers.len().saturating_sub(AROUND);
        let mut found: Vec<usize> = inner.filter(is_off).chain(isolated_numbers(numbers)).collect();
        found.sort_unstable();
        found.dedup();
        found
    })
}

/// Returns the rows of isolated outliers. The numbers on either side of an outlier lie on one smooth course: an impact or a
/// jump of the motion takes several samples. An outlier lies beyond both of its neighbours: a lost packet repeats the
/// one before it. Rows without a number are passed over.
pub(crate) fn isolated(values: &[f64]) -> Vec<usize> {
    in_rows(values, isolated_numbers)
}

/// The rows of what is found among the numbers of a signal.
fn in_rows(values: &[f64], find: impl Fn(&[f64]) -> Vec<usize>) -> Vec<usize> {
    let rows: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let numbers: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
    find(&numbers).into_iter().map(|place| rows[place]).collect()
}

/// Distance of the middle one of three samples from the middle of its neighbours.
fn bend([before, at, after]: [f64; 3]) -> f64 {
    (at - 0.5 * (before + after)).abs()
}

fn deviation(values: &[f64], row: usize) -> f64 {
    bend([values[row - 1], values[row], values[row + 1]])
}

/// Distance beyond which a sample is off; `None` for too few samples.
fn limit(values: &[f64]) -> Option<f64> {
    let inner = 2..values.len().saturating_sub(2);
    let mut usual: Vec<f64> = inner.map(|row| deviation(values, row)).filter(|own| own.is_finite()).collect();
    usual.sort_by(f64::total_cmp);
    let last = usual.len().checked_sub(1)?;
    Some(OFF * usual[(last as f64 * USUAL) as usize])
}

fn isolated_numbers(values: &[f64]) -> Vec<usize> {
    let Some(limit) = limit(values) else { return Vec::new() };
    let inner = 2..values.len().saturating_sub(2);
    let is_isolated = |row: &usize| {
        let (row, off) = (*row, deviation(values, *row));
        // On either side of what belongs here the course is as smooth as usual: an impact is not.
        let [left, right] = [values[row - 1], values[row + 1]];
        let here = 0.5 * (left + right);
        let before = bend([values[row - 2], left, here]);
        let after = bend([here, right, values[row + 2]]);
        let beyond = (left.min(right) - values[row]).max(values[row] - left.max(right));
        beyond > limit && before.max(after) < AGREE * off
    };
    inner.filter(is_isolated).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slow sine with noise and quantisation.
    fn signal() -> Vec<f64> {
        let noise = |i: u32| (f64::from(i) * 12.9898).sin();
        (0..2000).map(|i| (1e3 * ((f64::from(i) * 0.01).sin() + 0.003 * noise(i))).round() / 1e3).collect()
    }

    #[test]
    fn isolated_outliers_are_found_and_nothing_else() {
        assert!(isolated(&signal()).is_empty());
        let mut damaged = signal();
        for (row, value) in [(300, 1e6), (700, 0.0), (1001, -damaged[1001]), (1500, 1000.0 * damaged[1500])] {
            damaged[row] = value;
        }
        assert_eq!(isolated(&damaged), [300, 700, 1001, 1500]);
    }

    #[test]
    fn outliers_between_empty_cells_are_found() {
        let mut sparse: Vec<f64> = signal().into_iter().flat_map(|value| [value, f64::NAN]).collect();
        assert!(isolated(&sparse).is_empty());
        sparse[600] = 1e6;
        assert_eq!(isolated(&sparse), [600]);
    }

    #[test]
    fn neighbouring_outliers_of_a_position_are_found() {
        assert!(isolated_positions(&signal()).is_empty());
        let mut damaged = signal();
        for (row, value) in
            [(300, 4e4), (301, 1.5e5), (700, -999.0), (702, 1e30), (1500, 0.0), (1501, -999.0), (1502, 1e30)]
        {
            damaged[row] = value;
        }
        assert_eq!(isolated_positions(&damaged), [300, 301, 700, 702, 1500, 1501, 1502]);
        let jump = |i: i32| if i < 1000 { 0.0 } else { 100.0 };
        assert!(isolated_positions(&(0..2000).map(jump).collect::<Vec<_>>()).is_empty(), "a jump");
        let stands = |i: i32| if i < 1000 { 0.0 } else { f64::from(i - 1000).powi(2) };
        assert!(isolated_positions(&(0..1100).map(stands).collect::<Vec<_>>()).is_empty(), "a start from rest");
    }

    #[test]
    fn impacts_jumps_and_late_samples_are_no_outliers() {
        let impact = |i: i32| (-0.5 * (f64::from(i - 1000) / 2.0).powi(2)).exp() * 500.0;
        assert!(isolated(&(0..2000).map(impact).collect::<Vec<_>>()).is_empty(), "an impact of some samples");
        let jump = |i: i32| if i < 1000 { 0.0 } else { 100.0 };
        assert!(isolated(&(0..2000).map(jump).collect::<Vec<_>>()).is_empty(), "a jump");
        let mut late = signal();
        (100..1900).step_by(50).for_each(|row| late[row] = late[row - 1]);
        assert!(isolated(&late).is_empty(), "lost packets");
        let ramp = |i: i32| f64::from(i) + 0.01 * (f64::from(i) * 12.9898).sin();
        let mut lost: Vec<f64> = (0..2000).map(ramp).collect();
        (100..1900).step_by(300).for_each(|row| lost[row] = lost[row - 1]);
        (250..1900).step_by(600).for_each(|row| lost[row + 1] = lost[row - 1]);
        (250..1900).step_by(600).for_each(|row| lost[row] = lost[row - 1]);
        assert!(isolated(&lost).is_empty(), "lost packets of a ramp");
        assert!(isolated_positions(&lost).is_empty(), "lost packets of a moving position");
    }
}
