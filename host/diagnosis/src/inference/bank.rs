//! Bank of matched filters: starts of fits, detection threshold, and detectability of effects.
//!
//! Every entry of the bank is an effect of finite size and given form, simulated once; its signatures are its changes
//! of the whitened residuals. Effects that act only beyond a size (backlash, presliding, saturation) have no derivative
//! at zero, so the sizes are finite. After Anau Montel, Alvey and Weniger, PRD 111 (2025) 083013.

use super::evidence::regular;
use super::fit::{Fitted, Simulate};
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::applied;
use nalgebra::{DMatrix, DVector};
use softdock_kernels::philox;
use statrs::distribution::{ContinuousCDF, Normal};
use std::ops::Range;

/// Projector that removes from whitened vectors the part that the free parameters of a fit explain within their priors.
pub struct Projector<'a> {
    jacobian: &'a DMatrix<f64>,
    normal: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl<'a> Projector<'a> {
    /// Builds the projector for all free parameters of a fit.
    pub fn of(fitted: &'a Fitted) -> Self {
        let jacobian = &fitted.jacobian;
        let normal = jacobian.transpose() * jacobian + DMatrix::identity(jacobian.ncols(), jacobian.ncols());
        let normal = regular(normal);
        Self { jacobian, normal }
    }

    /// Returns the part of a vector that they do not explain.
    pub fn reject(&self, vector: &DVector<f64>) -> DVector<f64> {
        vector - self.jacobian * self.normal.solve(&self.jacobian.tr_mul(vector))
    }

    /// What they explain of columns, in as many numbers as there are free ones: products of two columns' are what the
    /// columns' own product loses by [`reject`](Self::reject).
    fn explained(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let products = self.jacobian.transpose() * columns;
        self.normal.l_dirty().solve_lower_triangular(&products).expect("the identity makes it positive definite")
    }
}

/// Form of a hypothesis at a finite size.
#[derive(Clone, Debug, PartialEq)]
pub struct SignatureEntry {
    /// Number of the hypothesis.
    pub hypothesis: usize,
    /// Standardised value `z` of every free parameter of the hypothesis.
    pub form: Vec<f64>,
    /// Its signatures among the bank's: one a size, two where a sine and a cosine belong together.
    signatures: Range<usize>,
    /// `z` of those sizes.
    sizes: Vec<f64>,
    /// Whether the signature's shape changes with the size, so that it counts at this size alone.
    shaped: bool,
    /// Whether sizes below nothing count.
    signed: bool,
}

/// Signatures of all entries of a library.
pub struct Bank {
    entries: Vec<SignatureEntry>,
    signatures: DMatrix<f64>,
    /// Products of signatures with those of the same entry, a column a signature.
    own: DMatrix<f64>,
}

/// Products of a residual with every entry.
pub struct Scores {
    /// Products of signatures and residual.
    products: DVector<f64>,
    /// Products of signatures with those of the same entry, a column a signature.
    own: DMatrix<f64>,
}

/// Gram matrix of all signatures of a bank after the projection of a fit.
pub struct Gram(DMatrix<f64>);

impl Gram {
    /// Builds the matrix from products of signatures that are already projected.
    pub(super) fn of(products: DMatrix<f64>) -> Self {
        Self(products)
    }
}

impl Bank {
    /// Simulates every form of every hypothesis on top of the parameters of the fitted null hypothesis.
    pub fn simulate(library: &[Hypothesis], null: &Fitted, base: &[f64], simulate: &Simulate) -> Self {
        let base = null.values(base);
        let (mut entries, mut sets) = (Vec::new(), Vec::new());
        for (number, hypothesis) in library.iter().enumerate() {
            for form in &hypothesis.forms {
                let first = sets.len();
                sets.extend(hypothesis.sizes.iter().map(|size| alone(&base, hypothesis, form, *size)));
                entries.push(SignatureEntry {
                    hypothesis: number,
                    form: form.clone(),
                    signatures: first..sets.len(),
                    sizes: hypothesis.sizes.iter().map(|size| form[*size]).collect(),
                    shaped: hypothesis.shaped,
                    signed: hypothesis.sizes.iter().all(|size| !hypothesis.unknowns[*size].prior.is_one_sided()),
                });
            }
        }
        let changes: Vec<DVector<f64>> = simulate(&sets).into_iter().map(|with| with - &null.residual).collect();
        let signatures = match changes.is_empty() {
            true => DMatrix::zeros(null.residual.len(), 0),
            false => DMatrix::from_columns(&changes),
        };
        let own = of_same_entry(&entries, &signatures);
        Self { entries, signatures, own }
    }

    /// Returns the entries.
    pub fn entries(&self) -> &[SignatureEntry] {
        &self.entries
    }

    /// Returns the signatures of an entry, one column per size.
    pub fn signatures(&self, entry: &SignatureEntry) -> DMatrix<f64> {
        self.signatures.columns_range(entry.signatures.clone()).into_owned()
    }

    /// Returns the greatest correlation of a hypothesis' signatures with a change of the residuals.
    pub fn correlation(&self, hypothesis: usize, change: &DVector<f64>) -> f64 {
        let own = self.entries.iter().filter(|entry| entry.hypothesis == hypothesis);
        let columns = own.flat_map(|entry| entry.signatures.clone()).map(|place| self.signatures.column(place));
        let of =
            |column: nalgebra::DVectorView<'_, f64>| column.dot(change).abs() / column.norm().max(f64::MIN_POSITIVE);
        columns.map(of).fold(0.0, f64::max) / change.norm().max(f64::MIN_POSITIVE)
    }

    /// Returns the first form of a hypothesis that reproduces `change`, with the multiples of its sizes; `None` if
    /// there is none.
    pub fn imitation(&self, hypothesis: usize, change: &DVector<f64>) -> Option<(&SignatureEntry, Vec<f64>)> {
        let mut own = self.entries.iter().filter(|entry| entry.hypothesis == hypothesis && !entry.shaped);
        let of = |entry: &'_ SignatureEntry| {
            let signatures = self.signatures.columns_range(entry.signatures.clone());
            let gram = signatures.transpose() * signatures;
            let multiples = gram.cholesky()?.solve(&(signatures.transpose() * change));
            let left = change - signatures * &multiples;
            let allowed = entry.signed || multiples.iter().all(|multiple| *multiple >= 0.0);
            let is_alike = left.norm_squared() < UNLIKE * change.norm_squared();
            (allowed && is_alike).then(|| multiples.iter().copied().collect())
        };
        own.find_map(|entry| Some((entry, of(entry)?)))
    }

    /// Computes the products of a fit's residual with every entry.
    pub fn scores(&self, fitted: &Fitted) -> Scores {
        let projector = Projector::of(fitted);
        // A product with the transpose is blocked; `tr_mul` goes column by column, ten times slower here.
        let products = self.signatures.transpose() * projector.reject(&fitted.residual);
        let own = &self.own - of_same_entry(&self.entries, &projector.explained(&self.signatures));
        Scores { products, own }
    }

    /// Returns the Gram matrix of all signatures after the projection of a fit.
    pub fn gram(&self, fitted: &Fitted) -> Gram {
        let explained = Projector::of(fitted).explained(&self.signatures);
        Gram(self.signatures.transpose() * &self.signatures - explained.transpose() * explained)
    }

    /// Returns the log-odds of each hypothesis against the null hypothesis, averaged over its forms and sizes.
    pub fn log_odds(&self, scores: &Scores, hypotheses: usize) -> Vec<f64> {
        let mut sums = vec![LogMean::default(); hypotheses];
        for entry in &self.entries {
            sums[entry.hypothesis].add(entry.log_weight(), entry.log_odds(scores));
        }
        sums.iter().map(LogMean::value).collect()
    }

    /// Returns the greatest log-odds that noise alone gives to any hypothesis, exceeded with probability `rarity`.
    ///
    /// Noise is drawn `NULLS` times in the space of the signatures; beyond the draws the tail is exponential.
    pub fn chance(&self, Gram(gram): &Gram, hypotheses: usize, rarity: f64) -> f64 {
        let count = gram.ncols();
        let jitter = 1e-9 * gram.diagonal().max() + f64::MIN_POSITIVE;
        let Some(factor) = (gram + DMatrix::identity(count, count) * jitter).cholesky() else {
            return f64::INFINITY;
        };
        let noise = DMatrix::from_fn(count, NULLS, |i, draw| gaussian(draw as u64, i as u32));
        let products = factor.l() * noise;
        let own = by_entry(&self.entries, |i, j| gram[(i, j)]);
        let mut scores = Scores { products: DVector::zeros(count), own };
        let mut greatest: Vec<f64> = (0..NULLS)
            .map(|draw| {
                scores.products.copy_from(&products.column(draw));
                self.log_odds(&scores, hypotheses).into_iter().fold(f64::NEG_INFINITY, f64::max)
            })
            .collect();
        greatest.sort_by(f64::total_cmp);
        let tail = &greatest[NULLS - NULLS / 20..];
        let excess = tail.iter().map(|value| value - tail[0]).sum::<f64>() / tail.len() as f64;
        tail[0] + excess * (0.05 / rarity).ln()
    }

    /// Returns all signatures, one column each.
    pub fn all(&self) -> &DMatrix<f64> {
        &self.signatures
    }

    /// Returns the columns of a hypothesis among all signatures; its entries stand next to one another.
    pub fn columns(&self, hypothesis: usize) -> Range<usize> {
        let own = || self.entries.iter().filter(|entry| entry.hypothesis == hypothesis);
        let start = own().map(|entry| entry.signatures.start).min().unwrap_or(0);
        start..own().map(|entry| entry.signatures.end).max().unwrap_or(start)
    }

    /// Returns the expected log-odds of a hypothesis at a plausible size, and the standard deviation of its size in `z`,
    /// by its most visible form; see [`chance`](Self::chance). `power` is what remains of the power of a signature.
    pub fn expected(&self, hypothesis: usize, power: &dyn Fn(usize) -> f64) -> (f64, f64) {
        let own = || self.entries.iter().filter(|entry| entry.hypothesis == hypothesis);
        let mut weights = LogMean::default();
        own().for_each(|entry| weights.add(entry.log_weight(), 0.0));
        let of = |entry: &SignatureEntry| {
            let power = power(entry.signatures.start);
            let odds = entry.expected(power) + entry.log_weight() - weights.weight.ln();
            (odds, entry.sizes[0].abs() / power.sqrt())
        };
        own().map(of).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, f64::INFINITY))
    }
}

impl Scores {
    /// Returns the products for residual variances that exceed the noise by a factor.
    pub fn dispersed(self, factor: f64) -> Self {
        Self { products: self.products / factor, own: self.own / factor }
    }
}

/// Products of columns with those of the same entry.
fn of_same_entry(entries: &[SignatureEntry], columns: &DMatrix<f64>) -> DMatrix<f64> {
    by_entry(entries, |i, j| columns.column(i).dot(&columns.column(j)))
}

/// What is known of pairs of signatures of the same entry: a column a signature, its entry's in rows, as many as the
/// largest entry has.
fn by_entry(entries: &[SignatureEntry], of: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let most = entries.iter().map(|entry| entry.signatures.len()).max().unwrap_or(0);
    let count = entries.iter().map(|entry| entry.signatures.len()).sum();
    let mut all = DMatrix::zeros(most, count);
    for entry in entries {
        for (row, i) in entry.signatures.clone().enumerate() {
            entry.signatures.clone().for_each(|j| all[(row, j)] = of(i, j));
        }
    }
    all
}

/// Largest residual share of a change's power in an imitation.
const UNLIKE: f64 = 0.1;
/// Draws of noise.
const NULLS: usize = 2000;
/// Seed of those draws: the same data give the same threshold.
const SEED: u64 = 2;

/// Standard normal numbers (Box and Muller).
fn gaussian(draw: u64, index: u32) -> f64 {
    let u = philox::uniform(SEED, "noise", draw, 2 * index).max(1e-300);
    let v = philox::uniform(SEED, "noise", draw, 2 * index + 1);
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Parameters with the effect at a form, one of its sizes alone.
fn alone(base: &[f64], hypothesis: &Hypothesis, form: &[f64], size: usize) -> Vec<f64> {
    let z: Vec<f64> =
        (0..form.len()).map(|i| if i != size && hypothesis.sizes.contains(&i) { 0.0 } else { form[i] }).collect();
    applied(base, &hypothesis.unknowns, &z)
}

impl SignatureEntry {
    /// Log-odds of this entry against none; the multiplier of a linear size has its prior, `1 / z` wide.
    fn log_odds(&self, scores: &Scores) -> f64 {
        if self.shaped {
            let place = self.signatures.start;
            return -scores.products[place] - 0.5 * scores.own[(0, place)];
        }
        let (gram, found) = self.own(scores);
        let Some(posterior) = self.posterior(&gram) else {
            return 0.0;
        };
        let multipliers = posterior.solve(&found);
        let log_det = 2.0 * posterior.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let prior: f64 = self.sizes.iter().map(|z| (z * z).ln()).sum();
        let mut odds = 0.5 * (found.dot(&multipliers) - log_det + prior);
        if !self.signed {
            let deviations = multipliers[0] * posterior.l()[(0, 0)];
            odds += (2.0 * Normal::standard().cdf(deviations).max(1e-300)).ln();
        }
        odds
    }

    /// Returns the reduction of chi-squared with the best multiples of the signatures, and those multiples.
    pub fn best(&self, scores: &Scores) -> (f64, Vec<f64>) {
        if self.shaped {
            return (2.0 * self.log_odds(scores), vec![1.0]);
        }
        let (gram, found) = self.own(scores);
        let none = (0.0, vec![0.0; self.sizes.len()]);
        let Some(multiples) = gram.cholesky().map(|cholesky| cholesky.solve(&found)) else {
            return none;
        };
        match !self.signed && multiples.iter().any(|multiple| *multiple < 0.0) {
            true => none,
            false => (found.dot(&multiples), multiples.iter().copied().collect()),
        }
    }

    /// Log-odds of this entry against none if the effect is there with a plausible size, by the power of its signature.
    fn expected(&self, own: f64) -> f64 {
        if self.shaped {
            return 0.5 * own;
        }
        // At z = 1 the signature is 1 / z of the simulated one.
        let (size, prior) = (own / self.sizes[0].powi(2), self.sizes[0].powi(2));
        0.5 * (size * own / (own + prior) - (1.0 + own / prior).ln())
    }

    /// Its own products of signatures, and what it finds in the residual.
    fn own(&self, scores: &Scores) -> (DMatrix<f64>, DVector<f64>) {
        let (first, count) = (self.signatures.start, self.signatures.len());
        let gram = scores.own.view((0, first), (count, count)).into_owned();
        (gram, -scores.products.rows(first, count))
    }

    fn posterior(&self, gram: &DMatrix<f64>) -> Option<nalgebra::Cholesky<f64, nalgebra::Dyn>> {
        let prior = DVector::from_iterator(self.sizes.len(), self.sizes.iter().map(|z| z * z));
        (gram + DMatrix::from_diagonal(&prior)).cholesky()
    }

    /// Prior weight among the entries of its hypothesis: sizes of a ladder by the normal distribution, and by how wide
    /// their steps are.
    fn log_weight(&self) -> f64 {
        if !self.shaped {
            return 0.0;
        }
        let z = self.sizes[0].abs();
        z.ln() - 0.5 * z * z
    }
}

/// Logarithm of a weighted mean of exponentials.
#[derive(Clone, Copy, Debug, Default)]
struct LogMean {
    /// Sum of weights.
    weight: f64,
    /// Logarithm of the weighted sum, once there is one.
    log_sum: Option<f64>,
}

impl LogMean {
    fn add(&mut self, log_weight: f64, log: f64) {
        let term = log_weight + log;
        self.weight += log_weight.exp();
        self.log_sum = Some(match self.log_sum {
            None => term,
            Some(sum) => sum.max(term) + (-(sum - term).abs()).exp().ln_1p(),
        });
    }

    fn value(&self) -> f64 {
        self.log_sum.map_or(f64::NEG_INFINITY, |sum| sum - self.weight.ln())
    }
}
