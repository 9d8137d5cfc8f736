//! Hyper-parameters by cross-validation within the fitted recordings: weight of the a-priori robot, friction shapes.

use crate::consistent::RobotPrior;
use crate::motion::RecordedMotion;
use crate::system::{FrictionShape, Rows, System};
use nalgebra::{DMatrix, DVector};

/// Blocks of consecutive samples; each is predicted from the others.
const FOLDS: usize = 5;

/// Presliding travels that are tried \[rad\]: from the encoder's resolution to the gears' wind-up.
const TRAVELS: [f64; 5] = [1e-5, 3e-5, 1e-4, 3e-4, 1e-3];

/// Stribeck speeds that are tried \[rad/s\].
const SPEEDS: [f64; 3] = [0.01, 0.02, 0.05];

/// Weights of the a-priori robot that are tried, half a decade apart.
const LAMBDAS: [f64; 13] = [1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 3.0, 10.0];

/// Weight while shapes are compared.
const SEARCH_LAMBDA: f64 = 1e-2;

/// Sums of squares and products of one joint over one block.
#[derive(Clone, Debug)]
struct Sums {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
    yy: f64,
}

/// The sums of all joints and blocks: enough to fit and to judge any weight.
#[derive(Clone, Debug)]
pub struct Folds {
    /// By joint, then by block.
    sums: Vec<Vec<Sums>>,
    rows: usize,
    weights: Vec<f64>,
}

/// Cross-validation errors of a weight.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossValidationScore {
    /// Weight of the a-priori robot.
    pub lambda: f64,
    /// Relative error of each joint on blocks that were not fitted.
    pub errors: Vec<f64>,
}

impl CrossValidationScore {
    /// Returns the criterion: the mean over the joints.
    pub fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len() as f64
    }
}

impl Folds {
    /// Computes the sums of a system with joints weighted by the inverse of these residuals \[N m\].
    pub fn new(system: &System, sigma: &[f64]) -> Self {
        let sums = system.joints.iter().map(|rows| joint_sums(rows, &system.lengths)).collect();
        let weights = sigma.iter().map(|sigma| 1.0 / (sigma * sigma)).collect();
        Self { sums, rows: system.lengths.iter().sum(), weights }
    }

    /// Weighted normal equations per row, without one block if one is named.
    fn normal(&self, without: Option<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let p = self.sums[0][0].xy.len();
        let (mut h, mut g) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for (sums, weight) in self.sums.iter().zip(&self.weights) {
            for (_, block) in sums.iter().enumerate().filter(|(fold, _)| Some(*fold) != without) {
                h += &block.xx * *weight;
                g += &block.xy * *weight;
            }
        }
        let share = if without.is_some() { 1.0 - 1.0 / FOLDS as f64 } else { 1.0 };
        let scale = 1.0 / (self.rows as f64 * share);
        (h * scale, g * scale)
    }

    /// Returns the physically consistent parameters fitted to all blocks.
    pub fn fit(&self, prior: &RobotPrior, lambda: f64) -> DVector<f64> {
        let (h, g) = self.normal(None);
        prior.solve(&h, &g, lambda, &prior.theta)
    }

    /// Returns the errors of predicting each block from the others.
    pub fn score(&self, prior: &RobotPrior, lambda: f64) -> CrossValidationScore {
        let mut squares = vec![0.0; self.sums.len()];
        for fold in 0..FOLDS {
            let (h, g) = self.normal(Some(fold));
            let theta = prior.solve(&h, &g, lambda, &prior.theta);
            for (sum, blocks) in squares.iter_mut().zip(&self.sums) {
                let b = &blocks[fold];
                *sum += (b.yy - 2.0 * b.xy.dot(&theta) + theta.dot(&(&b.xx * &theta))).max(0.0);
            }
        }
        let error = |(sum, blocks): (&f64, &Vec<Sums>)| {
            let whole: f64 = blocks.iter().map(|block| block.yy).sum();
            (sum / whole.max(f64::MIN_POSITIVE)).sqrt()
        };
        CrossValidationScore { lambda, errors: squares.iter().zip(&self.sums).map(error).collect() }
    }

    /// Returns the cross-validation errors of all weights.
    pub fn scores(&self, prior: &RobotPrior) -> Vec<CrossValidationScore> {
        LAMBDAS.iter().map(|lambda| self.score(prior, *lambda)).collect()
    }

    /// Chooses each joint's friction shape in turn and sets it in the system.
    pub fn choose_shapes(
        &mut self,
        system: &mut System,
        motions: &[RecordedMotion],
        prior: &RobotPrior,
        shapes: &mut [FrictionShape],
    ) {
        let mut best = self.score(prior, SEARCH_LAMBDA).mean();
        for (joint, chosen) in shapes.iter_mut().enumerate() {
            let mut kept = (*chosen, self.sums[joint].clone());
            for travel in TRAVELS {
                for speed in SPEEDS {
                    let shape = FrictionShape { travel, speed };
                    system.set_shape(motions, joint, shape);
                    self.sums[joint] = joint_sums(&system.joints[joint], &system.lengths);
                    let score = self.score(prior, SEARCH_LAMBDA).mean();
                    if score < best {
                        best = score;
                        kept = (shape, self.sums[joint].clone());
                    }
                }
            }
            (*chosen, self.sums[joint]) = kept;
            system.set_shape(motions, joint, *chosen);
        }
    }
}

/// Sums per block; every motion is cut into the same number of blocks.
fn joint_sums(rows: &Rows, lengths: &[usize]) -> Vec<Sums> {
    let p = rows.x.ncols();
    let empty = Sums { xx: DMatrix::zeros(p, p), xy: DVector::zeros(p), yy: 0.0 };
    let mut sums = vec![empty; FOLDS];
    let mut start = 0;
    for length in lengths {
        for (fold, sum) in sums.iter_mut().enumerate() {
            let (from, to) = (start + fold * length / FOLDS, start + (fold + 1) * length / FOLDS);
            let (x, y) = (rows.x.rows(from, to - from), rows.y.rows(from, to - from));
            sum.xx += x.tr_mul(&x);
            sum.xy += x.tr_mul(&y);
            sum.yy += y.norm_squared();
        }
        start += length;
    }
    sums
}
