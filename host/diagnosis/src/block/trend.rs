//! What repeats differ by because the session goes on: a trend, not noise.

use nalgebra::{DMatrix, DVector};

/// Takes a growth that all series share off them, channel by channel: least squares on each series' age \[s\].
///
/// Left in, a drift would pass for noise of the lowest frequencies and hide itself and every constant.
pub(super) fn removed(series: &mut [DMatrix<f64>], ages: &[f64]) {
    let weight: f64 = series.iter().zip(ages).map(|(x, age)| x.ncols() as f64 * age * age).sum();
    let Some(channels) = series.first().map(DMatrix::nrows).filter(|_| weight > 0.0) else {
        return;
    };
    let mut growth = DVector::zeros(channels);
    for (x, age) in series.iter().zip(ages) {
        growth += x.column_sum() * (age / weight);
    }
    for (x, age) in series.iter_mut().zip(ages) {
        x.column_iter_mut().for_each(|mut column| column -= &growth * *age);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_common_growth_is_taken_off_and_nothing_else() {
        let wave = |t: usize| (0.3 * t as f64).sin();
        let ages = [-40.0, 3.0, 37.0];
        let mut series: Vec<DMatrix<f64>> =
            ages.iter().map(|age| DMatrix::from_fn(2, 210, |c, t| wave(t) + 0.02 * age * c as f64)).collect();
        removed(&mut series, &ages);
        for x in &series {
            assert!((0..210).all(|t| (x[(0, t)] - wave(t)).abs() < 1e-9 && (x[(1, t)] - wave(t)).abs() < 1e-9));
        }
    }
}
