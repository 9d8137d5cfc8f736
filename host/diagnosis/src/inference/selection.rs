//! Stability selection: terms of a linear model that random halves of the data select consistently.
//!
//! After Meinshausen and Buehlmann, J. R. Stat. Soc. B 72 (2010) 417. Halves consist of whole stretches of the data,
//! because neighbouring samples are correlated. Terms are added while they raise the evidence.

use nalgebra::{DMatrix, DVector};
use softdock_kernels::philox;

/// Stretches that the data are cut into.
const STRETCHES: usize = 40;
/// Halves that are drawn.
const HALVES: usize = 100;
/// Seed of the draws: the same data give the same selection.
const SEED: u64 = 3;
/// Share of the halves that must pick a term.
const STABLE: f64 = 0.8;
/// Log-odds that a term must gain beyond its prior.
const PAYS: f64 = 5.0;

/// Whitened residuals and their derivatives.
pub struct Linear<'a> {
    /// Residuals at the values `z`.
    pub residual: &'a DVector<f64>,
    /// Derivatives with respect to the parameters that are always in the model, one column each, per prior standard
    /// deviation.
    pub known: &'a DMatrix<f64>,
    /// Values of these parameters.
    pub z: &'a [f64],
    /// Derivatives of each term, one column per size, per prior standard deviation.
    pub terms: &'a [DMatrix<f64>],
    /// Factor by which residual variances exceed the noise's.
    pub dispersion: f64,
}

/// Selected term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picked {
    /// Its number among the terms.
    pub term: usize,
    /// Share of the halves that select it.
    pub share: f64,
}

/// Returns the terms that most halves of the data select.
pub fn stable(model: &Linear) -> Vec<Picked> {
    let moments = Moments::of(model);
    let mut counts = vec![0_usize; model.terms.len()];
    for half in 0..HALVES {
        for term in moments.half(half).picked() {
            counts[term] += 1;
        }
    }
    let share = |(term, count): (usize, usize)| Picked { term, share: count as f64 / HALVES as f64 };
    counts.into_iter().enumerate().map(share).filter(|picked| picked.share >= STABLE).collect()
}

/// Second moments of residuals and columns, stretch by stretch.
struct Moments {
    stretches: Vec<DMatrix<f64>>,
    z: DVector<f64>,
    /// First and past the last column of each term.
    places: Vec<(usize, usize)>,
}

impl Moments {
    fn of(model: &Linear) -> Self {
        let mut columns = model.known.clone();
        let mut places = Vec::new();
        for term in model.terms {
            let first = columns.ncols();
            columns = columns.resize_horizontally(first + term.ncols(), 0.0);
            columns.columns_mut(first, term.ncols()).copy_from(term);
            places.push((first, columns.ncols()));
        }
        // The residual comes last.
        let count = columns.ncols();
        columns = columns.resize_horizontally(count + 1, 0.0);
        columns.column_mut(count).copy_from(model.residual);
        let rows = columns.nrows();
        let stretch = |i: usize| {
            let (from, to) = (i * rows / STRETCHES, (i + 1) * rows / STRETCHES);
            let own = columns.rows(from, to - from).into_owned();
            own.transpose() * own / model.dispersion
        };
        let stretches = (0..STRETCHES).map(stretch).collect();
        Self { stretches, z: DVector::from_column_slice(model.z), places }
    }

    /// The moments of one half of the stretches.
    fn half(&self, number: usize) -> Half<'_> {
        let mut order: Vec<usize> = (0..STRETCHES).collect();
        order.sort_by(|a, b| {
            let place = |i: &usize| philox::uniform(SEED, "half", number as u64, *i as u32);
            place(a).total_cmp(&place(b))
        });
        let size = self.stretches[0].ncols();
        let sum = order[..STRETCHES / 2].iter().fold(DMatrix::zeros(size, size), |sum, i| sum + &self.stretches[*i]);
        Half { sum, moments: self }
    }
}

/// One half of the data.
struct Half<'a> {
    sum: DMatrix<f64>,
    moments: &'a Moments,
}

impl Half<'_> {
    /// Terms added one by one, each time the one whose evidence gains most.
    fn picked(&self) -> Vec<usize> {
        let price = PAYS + (self.moments.places.len() as f64).ln();
        let mut picked = Vec::new();
        let mut evidence = self.evidence(&picked);
        loop {
            let left = (0..self.moments.places.len()).filter(|term| !picked.contains(term));
            let with = |term: usize| {
                let mut more = picked.clone();
                more.push(term);
                (self.evidence(&more), more)
            };
            match left.map(with).max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((value, more)) if value > evidence + price => (evidence, picked) = (value, more),
                _ => return picked,
            }
        }
    }

    /// log evidence of a choice of terms, up to a constant; all unknowns have standard normal priors.
    fn evidence(&self, picked: &[usize]) -> f64 {
        let known = self.moments.z.len();
        let own = picked.iter().flat_map(|term| self.moments.places[*term].0..self.moments.places[*term].1);
        let columns: Vec<usize> = (0..known).chain(own).collect();
        let (size, residual) = (columns.len(), self.sum.ncols() - 1);
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        let precision = DMatrix::from_fn(size, size, |i, j| self.sum[(columns[i], columns[j])] + unit(i, j));
        let slope = |i: usize| if i < known { self.moments.z[i] } else { 0.0 };
        let gradient = DVector::from_fn(size, |i, _| self.sum[(columns[i], residual)] + slope(i));
        let Some(cholesky) = precision.cholesky() else {
            return f64::NEG_INFINITY;
        };
        let log_det: f64 = 2.0 * cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        0.5 * (gradient.dot(&cholesky.solve(&gradient)) - log_det)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(cycles: f64) -> DVector<f64> {
        DVector::from_fn(4000, |i, _| (std::f64::consts::TAU * cycles * i as f64 / 4000.0).sin())
    }

    fn noise(stream: &str) -> DVector<f64> {
        // Twelve uniform numbers less six: nearly normal, of unit size.
        let one = |i: usize| (0..12).map(|k| philox::uniform(9, stream, i as u64, k)).sum::<f64>() - 6.0;
        DVector::from_fn(4000, |i, _| one(i))
    }

    #[test]
    fn only_present_terms_are_selected() {
        let known = DMatrix::from_columns(&[wave(3.0)]);
        let terms: Vec<DMatrix<f64>> = (5..15).map(|c| DMatrix::from_columns(&[wave(f64::from(c))])).collect();
        let residual = noise("a") + wave(3.0) * 2.0 - wave(7.0) * 0.4 + wave(12.0) * 0.3;
        let model = Linear { residual: &residual, known: &known, z: &[0.0], terms: &terms, dispersion: 1.0 };
        let picked: Vec<usize> = stable(&model).iter().map(|picked| picked.term).collect();
        assert_eq!(picked, [2, 7]);
        let nothing = noise("b");
        assert!(stable(&Linear { residual: &nothing, ..model }).is_empty());
    }
}
