//! Linear regression of the torques of all axes with Gaussian priors: evidence, estimates and their covariance in closed
//! form.

use super::terms::{CALIBRATION, Terms};
use crate::inference::autocorrelation::{CorrelationTime, power};
use nalgebra::{DMatrix, DVector};

/// Samples of an axis in a recording: the torque that the model lacks, then the terms per unit.
pub(super) type AxisRows = DMatrix<f64>;

/// A recording: its axes.
pub(super) struct Sampled {
    /// Whether it is held out.
    pub(super) held_out: bool,
    /// Rows of each axis.
    pub(super) axes: Vec<AxisRows>,
    /// Samples in a second.
    pub(super) rate: f64,
}

/// Products of the training rows of an axis: of all terms with each other and with the torque that the model lacks.
struct Products {
    /// Lacking torque and terms: the whole Gram matrix.
    gram: DMatrix<f64>,
    samples: f64,
}

/// Noise of each axis: what all terms together leave, and the share of its samples that are independent.
#[derive(Clone, Debug)]
pub(super) struct AxisNoise {
    /// Mean square \[N^2 m^2\].
    pub(super) power: f64,
    /// Weight of a sample: independent share over the mean square.
    weight: f64,
}

/// Regression of a robot's recordings.
pub(super) struct Regression<'a> {
    terms: &'a Terms,
    products: Vec<Products>,
    pub(super) noise: Vec<AxisNoise>,
}

/// Fit of a set of common terms beside the calibration.
pub(super) struct Fit {
    /// Log marginal likelihood, up to a constant that all fits share.
    pub(super) evidence: f64,
    /// Common terms in the fit.
    pub(super) places: Vec<usize>,
    /// Their values and covariance, SI.
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Calibration values of each axis, SI.
    calibration: Vec<[f64; CALIBRATION]>,
}

impl<'a> Regression<'a> {
    /// Builds the regression from the training recordings; the noise is what all terms together leave.
    pub(super) fn of(terms: &'a Terms, recordings: &[Sampled]) -> Self {
        let axes = terms.calibration.len();
        let training = || recordings.iter().filter(|recording| !recording.held_out);
        let product = |axis: usize| {
            let mut all = Products { gram: DMatrix::zeros(0, 0), samples: 0.0 };
            for rows in training().map(|recording| &recording.axes[axis]) {
                let gram = rows.transpose() * rows;
                all.gram = if all.samples == 0.0 { gram } else { all.gram + gram };
                all.samples += rows.nrows() as f64;
            }
            all
        };
        let products: Vec<Products> = (0..axes).map(product).collect();
        let power = |products: &Products| products.gram[(0, 0)] / products.samples;
        let noise = products.iter().map(|own| AxisNoise { power: power(own), weight: power(own).recip() }).collect();
        let mut regression = Self { terms, products, noise };
        let everything: Vec<usize> = (0..terms.deviations.len()).collect();
        for _ in 0..ROUNDS {
            regression.learn_noise(&everything, recordings);
        }
        regression
    }

    /// Takes what a fit leaves for noise: no probability beyond what the model's own misfit allows.
    pub(super) fn learn_noise(&mut self, places: &[usize], recordings: &[Sampled]) {
        let fit = self.fit(places);
        let own = |axis: usize| {
            let training = recordings.iter().filter(|recording| !recording.held_out);
            let rest = |recording: &Sampled| DMatrix::from_rows(&[fit.rest(&recording.axes[axis], axis).transpose()]);
            let mut series: Vec<DMatrix<f64>> = training.map(rest).collect();
            // The longest recording limits the lags.
            series.sort_by_key(|own| std::cmp::Reverse(own.ncols()));
            let power = power(&series, 0);
            AxisNoise { power, weight: CorrelationTime::of(&series).independent_for_mean / power }
        };
        self.noise = (0..self.products.len()).map(own).collect();
    }

    /// Fits some common terms beside the calibration of all axes.
    pub(super) fn fit(&self, places: &[usize]) -> Fit {
        let axes = self.products.len();
        let calibrated = axes * CALIBRATION;
        let count = calibrated + places.len();
        let deviation = |place: usize| match place.checked_sub(calibrated) {
            Some(common) => self.terms.deviations[places[common]],
            None => self.terms.calibration[place / CALIBRATION][place % CALIBRATION],
        };
        let (mut precision, mut right) = (DMatrix::identity(count, count), DVector::zeros(count));
        for (axis, Products { gram, .. }) in self.products.iter().enumerate() {
            let own = (0..CALIBRATION).map(|term| (axis * CALIBRATION + term, 1 + term));
            let common = places.iter().enumerate().map(|(k, place)| (calibrated + k, 1 + CALIBRATION + place));
            let all: Vec<(usize, usize)> = own.chain(common).collect();
            let weight = self.noise[axis].weight;
            for (to, from) in &all {
                right[*to] += weight * deviation(*to) * gram[(*from, 0)];
                for (other, column) in &all {
                    precision[(*to, *other)] += weight * deviation(*to) * gram[(*from, *column)] * deviation(*other);
                }
            }
        }
        // A unit matrix and products of rows: positive definite.
        let factor = precision.cholesky().expect("prior precision of 1");
        let z = factor.solve(&right);
        let logarithm: f64 = factor.l_dirty().diagonal().iter().map(|own: &f64| own.ln()).sum();
        let evidence = 0.5 * right.dot(&z) - logarithm;
        let scale = DVector::from_fn(count, |place, _| deviation(place));
        let whole = factor.inverse();
        let common = |i: usize, j: usize| {
            let (i, j) = (calibrated + i, calibrated + j);
            scale[i] * whole[(i, j)] * scale[j]
        };
        let value = |place: usize| scale[place] * z[place];
        Fit {
            evidence,
            places: places.to_vec(),
            values: DVector::from_fn(places.len(), |k, _| value(calibrated + k)),
            covariance: DMatrix::from_fn(places.len(), places.len(), common),
            calibration: (0..axes).map(|axis| std::array::from_fn(|term| value(axis * CALIBRATION + term))).collect(),
        }
    }

    /// Returns the standard deviation of a common term that the recordings alone allow, in its unit.
    pub(super) fn deviation(&self, place: usize) -> f64 {
        let (prior, posterior) = (self.terms.deviations[place].powi(2), self.fit(&[place]).covariance[(0, 0)]);
        (posterior.recip() - prior.recip()).max(0.0).sqrt().recip()
    }

    /// Returns the expected log-odds of a cause of one prior standard deviation against the calibration alone.
    pub(super) fn expected(&self, places: &[usize]) -> f64 {
        let fit = self.fit(places);
        let precision = fit.covariance.clone().try_inverse();
        let shares = |precision: &DMatrix<f64>| {
            let scale = |k: usize| self.terms.deviations[places[k]];
            let own = DMatrix::from_fn(places.len(), places.len(), |i, j| scale(i) * precision[(i, j)] * scale(j));
            let determinant = own.determinant().max(1.0).ln();
            0.5 * ((own.trace() - places.len() as f64) - determinant)
        };
        precision.as_ref().map_or(0.0, shares)
    }
}

/// Rounds in which noise and fit determine each other.
const ROUNDS: usize = 3;

impl Fit {
    /// Returns the torque of an axis that the fit lacks.
    pub(super) fn rest(&self, rows: &AxisRows, axis: usize) -> DVector<f64> {
        let mut rest = rows.column(0).into_owned();
        for (term, value) in self.calibration[axis].iter().enumerate() {
            rest.axpy(-value, &rows.column(1 + term), 1.0);
        }
        for (place, value) in self.places.iter().zip(self.values.iter()) {
            rest.axpy(-value, &rows.column(1 + CALIBRATION + place), 1.0);
        }
        rest
    }

    /// Returns the values of some of its common terms, with their covariance.
    pub(super) fn of(&self, terms: std::ops::Range<usize>) -> (Vec<f64>, DMatrix<f64>) {
        let own: Vec<usize> = (0..self.places.len()).filter(|k| terms.contains(&self.places[*k])).collect();
        let values = own.iter().map(|k| self.values[*k]).collect();
        (values, DMatrix::from_fn(own.len(), own.len(), |i, j| self.covariance[(own[i], own[j])]))
    }
}
