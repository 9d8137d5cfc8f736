//! Isolated outliers of recordings: single cells far from neighbours that agree with each other.

/// Quantile of the second differences of a signal, and how many times a damaged cell is off by it at least.
const USUAL: f64 = 0.97;
const OFF: f64 = 15.0;
/// Share of its deviation up to which the cells around a damaged one agree.
const AGREE: f64 = 0.1;

/// Returns the rows of isolated outliers. The two numbers on either side of an outlier agree with each other: an impact
/// or a jump of the motion takes several samples. Rows without a number are passed over.
pub(crate) fn isolated(values: &[f64]) -> Vec<usize> {
    let rows: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let numbers: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
    isolated_numbers(&numbers).into_iter().map(|place| rows[place]).collect()
}

fn isolated_numbers(values: &[f64]) -> Vec<usize> {
    let deviation = |row: usize| (values[row] - 0.5 * (values[row - 1] + values[row + 1])).abs();
    let inner = 2..values.len().saturating_sub(2);
    let mut usual: Vec<f64> = inner.clone().map(deviation).filter(|deviation| deviation.is_finite()).collect();
    if usual.is_empty() {
        return Vec::new();
    }
    usual.sort_by(f64::total_cmp);
    let limit = OFF * usual[((usual.len() - 1) as f64 * USUAL) as usize];
    let is_isolated = |row: &usize| {
        let off = deviation(*row);
        let agree = |a: usize, b: usize| (values[a] - values[b]).abs() < AGREE * off;
        off > limit && agree(row - 1, row + 1) && agree(row - 2, row - 1) && agree(row + 1, row + 2)
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
    fn impacts_jumps_and_late_samples_are_no_outliers() {
        let impact = |i: i32| (-0.5 * (f64::from(i - 1000) / 2.0).powi(2)).exp() * 500.0;
        assert!(isolated(&(0..2000).map(impact).collect::<Vec<_>>()).is_empty(), "an impact of some samples");
        let jump = |i: i32| if i < 1000 { 0.0 } else { 100.0 };
        assert!(isolated(&(0..2000).map(jump).collect::<Vec<_>>()).is_empty(), "a jump");
        let mut late = signal();
        (100..1900).step_by(50).for_each(|row| late[row] = late[row - 1]);
        assert!(isolated(&late).is_empty(), "lost packets");
    }
}
