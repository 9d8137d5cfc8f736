//! White noise of moving series, estimated from sample-to-sample differences.

/// Median of the size of a standard normal number.
const MEDIAN: f64 = 0.6745;

/// Standard deviation of the white noise that all series have, by their differences of an order: the higher it is, the less
/// motion gives to them. The median is not misled by blows. 0 for none.
pub(crate) fn by_differences<'a>(series: impl Iterator<Item = &'a [f64]>, order: usize) -> f64 {
    let step = |x: Vec<f64>| -> Vec<f64> { x.windows(2).map(|pair| pair[1] - pair[0]).collect() };
    let differences = |series: &[f64]| (0..order).fold(series.to_vec(), |x, _| step(x));
    let mut sizes: Vec<f64> = series.flat_map(differences).map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    // The squares of their weights, binomial coefficients, sum up to (2n)! / n!^2.
    let power = (1..=order).fold(1.0, |power, k| power * (order + k) as f64 / k as f64);
    sizes.get(sizes.len() / 2).copied().unwrap_or(0.0) / (MEDIAN * f64::sqrt(power))
}
