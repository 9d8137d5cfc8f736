//! Smoothing, derivatives and regression of logged signals.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Time over which a signal is smoothed, to either side \[s\].
const HALF_WINDOW: f64 = 0.025;

/// A signal with its derivatives, smoothed by a parabola around each sample.
#[derive(Clone, Debug)]
pub(crate) struct Smoothed {
    pub(crate) value: Vec<f64>,
    pub(crate) rate: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

/// Smooths a signal over `HALF_WINDOW` to either side, then differentiates it over a third of that: value and derivatives
/// pass nearly the same low-pass. At the ends and beside missing cells all is NaN.
pub(crate) fn smoothed(time: &[f64], values: &[f64], step: f64) -> Smoothed {
    let half = ((HALF_WINDOW / step).ceil() as usize).clamp(3, 60);
    let value = parabolas(time, values, step, half).value;
    Smoothed { value: value.clone(), ..parabolas(time, &value, step, half / 3) }
}

/// Fits a parabola over `half` samples to either side of every sample.
fn parabolas(time: &[f64], values: &[f64], step: f64, half: usize) -> Smoothed {
    let rows = values.len();
    let none = vec![f64::NAN; rows];
    let mut out = Smoothed { value: none.clone(), rate: none.clone(), acceleration: none };
    for row in half..rows.saturating_sub(half) {
        let (from, to) = (row - half, row + half + 1);
        let span = time[to - 1] - time[from];
        // A longer span holds a pause of the clock.
        if !(span > 0.0 && span < 3.0 * step * (2 * half) as f64) {
            continue;
        }
        let (mut square, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for i in from..to {
            let t = (time[i] - time[row]) / span;
            let powers = Vector3::new(1.0, t, t * t);
            square += powers * powers.transpose();
            right += powers * values[i];
        }
        if let Some(fit) = square.lu().solve(&right) {
            out.value[row] = fit[0];
            out.rate[row] = fit[1] / span;
            out.acceleration[row] = 2.0 * fit[2] / (span * span);
        }
    }
    out
}

/// A linear regression.
#[derive(Clone, Debug)]
pub(crate) struct Regression {
    pub(crate) coefficients: Vec<f64>,
    /// Standard errors, as if samples were independent.
    pub(crate) errors: Vec<f64>,
    /// Root mean square of the residual over that of the signal.
    pub(crate) unexplained: f64,
}

/// Fits `y` by the columns over the rows without missing numbers; none if they are too few or not independent.
pub(crate) fn regress(columns: &[Vec<f64>], y: &[f64]) -> Option<Regression> {
    let is_whole = |row: &usize| y[*row].is_finite() && columns.iter().all(|column| column[*row].is_finite());
    let rows: Vec<usize> = (0..y.len()).filter(is_whole).collect();
    if rows.len() < 5 * columns.len() + 10 {
        return None;
    }
    // Columns of equal size keep the condition of the normal matrix small.
    let size = |column: &Vec<f64>| rows.iter().map(|row| column[*row].powi(2)).sum::<f64>().sqrt();
    let sizes: Vec<f64> = columns.iter().map(size).collect();
    if sizes.iter().any(|size| *size <= 0.0) {
        return None;
    }
    let matrix = DMatrix::from_fn(rows.len(), columns.len(), |i, j| columns[j][rows[i]] / sizes[j]);
    let right = DVector::from_iterator(rows.len(), rows.iter().map(|row| y[*row]));
    let square = matrix.transpose() * &matrix;
    let inverse = square.cholesky()?.inverse();
    let scaled = &inverse * (matrix.transpose() * &right);
    let residual = &right - &matrix * &scaled;
    let variance = residual.norm_squared() / (rows.len() - columns.len()) as f64;
    let worst = (0..columns.len()).map(|j| inverse[(j, j)]).fold(0.0, f64::max);
    (worst < 1e8).then(|| Regression {
        coefficients: (0..columns.len()).map(|j| scaled[j] / sizes[j]).collect(),
        errors: (0..columns.len()).map(|j| (variance * inverse[(j, j)]).sqrt() / sizes[j]).collect(),
        unexplained: residual.norm() / right.norm().max(f64::MIN_POSITIVE),
    })
}

/// Slope of `y` over `x` through the origin and the share of `y` that it does not explain.
pub(crate) fn slope(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let fit = regress(std::slice::from_ref(&x.to_vec()), y)?;
    Some((fit.coefficients[0], fit.unexplained))
}

/// Root mean square of the finite values.
pub(crate) fn rms(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    (finite.iter().map(|value| value * value).sum::<f64>() / finite.len().max(1) as f64).sqrt()
}

/// Least and greatest finite value.
pub(crate) fn extent(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)))
}

/// Median of the finite values; NaN without any.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite.get(finite.len() / 2).copied().unwrap_or(f64::NAN)
}

/// A number with four digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if value.abs() < 1e-4 || value.abs() >= 1e7 { format!("{value:.3e}") } else { text.to_owned() }
}
