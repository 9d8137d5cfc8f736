//! Screening: a bank of matched filters finds where fits should start, and what the data can show at all.
//!
//! Every entry of the bank is an effect of finite size and given form, simulated once; its signature is what it changes
//! in the whitened residuals. Effects that act only beyond a size (backlash, presliding, saturation) have no derivative
//! at nothing, which is why the sizes are finite.

use super::fit::Fitted;
use nalgebra::{DMatrix, DVector};

/// Removes from whitened vectors what nuisances could explain within their tolerance.
pub struct Projector {
    jacobian: DMatrix<f64>,
    normal: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl Projector {
    /// Of the nuisances of a fitted null hypothesis.
    pub fn of(null: &Fitted) -> Self {
        let jacobian = null.jacobian.clone();
        let normal = jacobian.tr_mul(&jacobian) + DMatrix::identity(jacobian.ncols(), jacobian.ncols());
        let normal = normal.cholesky().expect("the identity makes it positive definite");
        Self { jacobian, normal }
    }

    /// The part of a vector that no nuisance explains.
    pub fn reject(&self, v: &DVector<f64>) -> DVector<f64> {
        if self.jacobian.ncols() == 0 {
            return v.clone();
        }
        v - &self.jacobian * self.normal.solve(&self.jacobian.tr_mul(v))
    }
}

/// What a matched filter says.
#[derive(Clone, Debug, PartialEq)]
pub struct Match {
    /// Gain in chi-squared at the best size.
    pub statistic: f64,
    /// The best size of each signature, in units of the size that was simulated.
    pub sizes: Vec<f64>,
}

/// Takes one form at the size that it has: a signature whose shape depends on its size.
pub fn taken(projector: &Projector, signature: &DVector<f64>, residual: &DVector<f64>) -> Match {
    let with = residual + signature;
    let square = |v: &DVector<f64>| projector.reject(v).dot(v);
    Match { statistic: square(residual) - square(&with), sizes: vec![1.0] }
}

/// Matches one form: `signatures` of its sizes (two where a sine and a cosine belong together), and the residual of the
/// null hypothesis; sizes below nothing count only where they are `signed`.
pub fn matched(projector: &Projector, signatures: &[DVector<f64>], residual: &DVector<f64>, signed: bool) -> Match {
    let count = signatures.len();
    let rejected: Vec<DVector<f64>> = signatures.iter().map(|g| projector.reject(g)).collect();
    let gram = DMatrix::from_fn(count, count, |i, j| rejected[i].dot(&signatures[j]));
    let found = DVector::from_fn(count, |i, _| -rejected[i].dot(residual));
    let none = Match { statistic: 0.0, sizes: vec![0.0; count] };
    let Some(sizes) = gram.cholesky().map(|cholesky| cholesky.solve(&found)) else {
        return none;
    };
    if !signed && sizes.iter().any(|size| *size < 0.0) {
        return none;
    }
    Match { statistic: found.dot(&sizes), sizes: sizes.iter().copied().collect() }
}
