//! Base parameters: the parameter combinations that joint torques identify, by rank-revealing QR, and their least
//! squares.

use crate::filter::Smoother;
use crate::layout::{INERTIAL, Layout};
use crate::motion::RecordedMotion;
use crate::regressor::rigid_regressor;
use crate::system::{System, rms};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use softdock_campaign::Robot;
use softdock_kernels::philox;

/// Random postures from which the structure is found: far more equations than parameters.
const POSTURES: u32 = 60;

/// Pivots below this share of the greatest belong to dependent columns: the gap lies between 1e-4 and 1e-14.
const DEPENDENT: f64 = 1e-9;

/// Columns below this share of the greatest hold nothing but rounding.
const EMPTY: f64 = 1e-11;

/// Directions of the scaled normal matrix below this share are not determined at all.
const UNDETERMINED: f64 = 1e-14;

/// Which combinations of parameters are identifiable: `beta = map * theta`.
#[derive(Clone, Debug)]
pub struct Base {
    /// Independent parameters, one for each combination.
    pub independent: Vec<usize>,
    /// Base parameters x parameters; unit columns at the independent ones.
    pub map: DMatrix<f64>,
}

impl Base {
    /// Determines the base parameters of a robot from its regressor at random postures, rates and accelerations.
    pub fn of(robot: &Robot) -> Self {
        let layout = Layout::of(robot);
        let mut w = random_regressor(robot, &layout);
        let norms: Vec<f64> = w.column_iter().map(|column| column.norm()).collect();
        // A column of rounding errors, such as a first link's mass, is empty.
        let least = EMPTY * norms.iter().copied().fold(0.0, f64::max);
        let scale: Vec<f64> = norms.into_iter().map(|norm| if norm > least { norm } else { 0.0 }).collect();
        for (mut column, scale) in w.column_iter_mut().zip(&scale) {
            column *= if *scale > 0.0 { 1.0 / scale } else { 0.0 };
        }
        let qr = w.col_piv_qr();
        let mut order = DMatrix::from_fn(1, layout.len(), |_, column| column);
        qr.p().permute_columns(&mut order);
        let r = qr.r();
        let rank = (0..r.nrows()).take_while(|i| r[(*i, *i)].abs() > DEPENDENT * r[(0, 0)].abs()).count();
        let first = r.view((0, 0), (rank, rank)).into_owned();
        let rest = r.view((0, rank), (rank, layout.len() - rank)).into_owned();
        let depend = first.solve_upper_triangular(&rest).expect("pivots above the threshold");
        // Sorted by place, so that reports read in the order of the joints.
        let mut rows: Vec<usize> = (0..rank).collect();
        rows.sort_by_key(|row| order[*row]);
        let independent: Vec<usize> = rows.iter().map(|row| order[*row]).collect();
        let mut map = DMatrix::zeros(rank, layout.len());
        for (line, row) in rows.iter().enumerate() {
            let own = scale[order[*row]];
            map[(line, order[*row])] = 1.0;
            for k in 0..layout.len() - rank {
                let column = order[rank + k];
                let value = depend[(*row, k)] * scale[column] / own;
                map[(line, column)] = if value.abs() > 1e-10 { value } else { 0.0 };
            }
        }
        Self { independent, map }
    }

    /// Returns the number of base parameters.
    pub fn len(&self) -> usize {
        self.independent.len()
    }

    /// Returns whether there are none (a robot without joints).
    pub fn is_empty(&self) -> bool {
        self.independent.is_empty()
    }

    /// Returns parameters with these combinations: the independent ones take the values, the others are zero.
    pub fn spread(&self, beta: &DVector<f64>) -> DVector<f64> {
        let mut theta = DVector::zeros(self.map.ncols());
        self.independent.iter().zip(beta.iter()).for_each(|(place, value)| theta[*place] = *value);
        theta
    }
}

/// Rows of all joints at random states; columns of friction, which depends on its joint alone, are random.
fn random_regressor(robot: &Robot, layout: &Layout) -> DMatrix<f64> {
    let n = layout.joints;
    let mut w = DMatrix::zeros(n * POSTURES as usize, layout.len());
    for k in 0..POSTURES {
        let draw = |what: &str, joint: usize, half: f64| {
            half * (2.0 * philox::uniform(20_261_121, what, u64::from(k), joint as u32) - 1.0)
        };
        let state = |what: &str, half: f64| (0..n).map(|joint| draw(what, joint, half)).collect::<Vec<f64>>();
        let angle = state("angle", 3.0);
        let rows = rigid_regressor(&robot.model, &angle, &state("rate", 2.0), &state("acceleration", 4.0));
        for (j, row) in rows.iter().enumerate() {
            let line = n * k as usize + j;
            for (index, value) in row.iter().enumerate() {
                w[(line, layout.inertial(index / INERTIAL) + index % INERTIAL)] = *value;
            }
            w[(line, layout.rotor(j))] = draw("acceleration", j, 4.0);
            w[(line, layout.coulomb(j))] = draw("coulomb", j, 1.0);
            w[(line, layout.viscous(j))] = draw("rate", j, 2.0);
            w[(line, layout.offset(j))] = 1.0;
            w[(line, layout.stribeck(j))] = draw("stribeck", j, 1.0);
            if let Some(place) = layout.counterweight(j) {
                w[(line, place)] = angle[j].sin();
                w[(line, place + 1)] = angle[j].cos();
            }
        }
    }
    w
}

/// Weighted least squares over the base parameters (paper eq. 8-9).
#[derive(Clone, Debug)]
pub struct LeastSquares {
    /// The combinations.
    pub base: Base,
    /// Their values.
    pub beta: DVector<f64>,
    /// Their covariance, with the residuals' own correlation over time.
    pub covariance: DMatrix<f64>,
    /// Condition number of the weighted regressor with columns of equal norm.
    pub condition: f64,
    /// Root mean square residual of each joint \[N m\].
    pub sigma: Vec<f64>,
}

impl LeastSquares {
    /// Fits with joints weighted by their residuals: first all equal, then by the residuals of that fit.
    pub fn new(system: &System, base: &Base, motions: &[RecordedMotion]) -> Self {
        let mut sigma: Vec<f64> = system.joints.iter().map(|rows| rms(rows.y.iter()).max(1e-9)).collect();
        let reduced: Vec<DMatrix<f64>> =
            system.joints.iter().map(|rows| rows.x.select_columns(&base.independent)).collect();
        let mut answer = None;
        for _ in 0..2 {
            let normal = Normal::new(&reduced, system, &sigma);
            let beta = &normal.inverse * &normal.right;
            for (joint, rows) in system.joints.iter().enumerate() {
                let residual = &rows.y - &reduced[joint] * &beta;
                sigma[joint] = rms(residual.iter()).max(1e-9 * rms(rows.y.iter())).max(1e-12);
            }
            answer = Some((normal, beta));
        }
        let (normal, beta) = answer.expect("two rounds");
        let covariance = covariance(&normal, &reduced, system, &beta, motions);
        Self { base: base.clone(), beta, covariance, condition: normal.condition, sigma }
    }

    /// Returns the standard error of each base parameter.
    pub fn standard_errors(&self) -> DVector<f64> {
        self.covariance.diagonal().map(|variance| variance.max(0.0).sqrt())
    }
}

/// Inverse normal matrix, right-hand side, weights.
struct Normal {
    inverse: DMatrix<f64>,
    right: DVector<f64>,
    weights: Vec<f64>,
    condition: f64,
}

impl Normal {
    fn new(reduced: &[DMatrix<f64>], system: &System, sigma: &[f64]) -> Self {
        let p = reduced[0].ncols();
        let (mut matrix, mut right) = (DMatrix::zeros(p, p), DVector::zeros(p));
        let weights: Vec<f64> = sigma.iter().map(|sigma| 1.0 / (sigma * sigma)).collect();
        for (joint, x) in reduced.iter().enumerate() {
            matrix += x.tr_mul(x) * weights[joint];
            right += x.tr_mul(&system.joints[joint].y) * weights[joint];
        }
        let scale = matrix.diagonal().map(|d: f64| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let scaled = DMatrix::from_diagonal(&scale) * &matrix * DMatrix::from_diagonal(&scale);
        let eigen = SymmetricEigen::new(scaled);
        let greatest = eigen.eigenvalues.max();
        let least = eigen.eigenvalues.min().max(f64::MIN_POSITIVE);
        let inverted = eigen.eigenvalues.map(|value| if value > UNDETERMINED * greatest { 1.0 / value } else { 0.0 });
        let turned = DMatrix::from_diagonal(&scale) * &eigen.eigenvectors;
        let inverse = &turned * DMatrix::from_diagonal(&inverted) * turned.transpose();
        Self { inverse, right, weights, condition: (greatest / least).sqrt() }
    }
}

/// `A^-1 M A^-1` with the residuals' covariance over time in M: filtered residuals are not independent.
///
/// Two estimates of M: from the residuals' own correlation, and from that of filtered white noise of the same size. The
/// first sees physics that the model lacks; but at the slow frequencies of the motion, where parameters have taken a part
/// of the noise with them, it sees too little. Each parameter gets the greater variance.
fn covariance(
    normal: &Normal,
    reduced: &[DMatrix<f64>],
    system: &System,
    beta: &DVector<f64>,
    motions: &[RecordedMotion],
) -> DMatrix<f64> {
    let p = normal.right.len();
    let (mut seen, mut white) = (DMatrix::zeros(p, p), DMatrix::zeros(p, p));
    for (joint, x) in reduced.iter().enumerate() {
        let weight = normal.weights[joint];
        let residual = &system.joints[joint].y - x * beta;
        // Parameters that this joint's equations use up.
        let used = (&normal.inverse * (x.tr_mul(x) * weight)).trace();
        let independent: f64 = motions.iter().map(independent_samples).sum();
        let correction = independent / (independent - used).max(0.1 * independent);
        let scale = weight * weight * correction;
        let mut start = 0;
        for motion in motions {
            let rows = motion.rows();
            let part = x.rows(start, rows).into_owned();
            let own = &residual.as_slice()[start..start + rows];
            seen += part.tr_mul(&correlate(&part, &seen_kernel(motion, own))) * scale;
            white += part.tr_mul(&correlate(&part, &white_kernel(motion, own))) * scale;
            start += rows;
        }
    }
    let around = |middle: DMatrix<f64>| &normal.inverse * middle * &normal.inverse;
    let (seen, white) = (around(seen), around(white));
    let raise = DVector::from_fn(p, |i, _| (white[(i, i)] / seen[(i, i)].max(f64::MIN_POSITIVE)).max(1.0).sqrt());
    DMatrix::from_diagonal(&raise) * seen * DMatrix::from_diagonal(&raise)
}

/// How many independent numbers a smooth series holds.
fn independent_samples(motion: &RecordedMotion) -> f64 {
    match motion.smoother {
        Smoother::LowPass { cutoff } => 2.0 * cutoff * motion.step * motion.rows() as f64,
        Smoother::Fourier { harmonics } => (2 * harmonics + 1) as f64,
    }
}

/// Autocovariance of the residual, from lag 0, under a flat-top window several cut-off times long (Politis 2003).
fn seen_kernel(motion: &RecordedMotion, residual: &[f64]) -> Vec<f64> {
    let n = residual.len();
    match motion.smoother {
        Smoother::Fourier { .. } => white_kernel(motion, residual),
        Smoother::LowPass { cutoff } => {
            let longest = ((4.0 / (cutoff * motion.step)).ceil() as usize).min(n / 4);
            let window = |lag: usize| (2.0 * (1.0 - lag as f64 / longest as f64)).clamp(0.0, 1.0);
            let sum = |lag: usize| (lag..n).map(|i| residual[i] * residual[i - lag]).sum::<f64>() / n as f64;
            (0..longest).map(|lag| window(lag) * sum(lag)).collect()
        }
    }
}

/// Autocovariance of white noise behind the filter, of the residual's size.
///
/// On columns that lie in a Fourier projection themselves it acts as one variance: the noise's power is spread over the
/// harmonics kept.
fn white_kernel(motion: &RecordedMotion, residual: &[f64]) -> Vec<f64> {
    let sum: f64 = residual.iter().map(|r| r * r).sum();
    match motion.smoother {
        Smoother::Fourier { .. } => vec![sum / independent_samples(motion)],
        Smoother::LowPass { cutoff } => {
            let length = ((4.0 / (cutoff * motion.step)).ceil() as usize).min(residual.len() / 4);
            // A unit impulse in the middle, through the filter twice, is the filter's autocovariance.
            let mut impulse = vec![0.0; 4 * length + 1];
            impulse[2 * length] = 1.0;
            let answer = motion.smooth(&motion.smooth(&impulse));
            let scale = sum / residual.len() as f64 / answer[2 * length];
            answer[2 * length..3 * length].iter().map(|value| value * scale).collect()
        }
    }
}

/// The symmetric kernel applied to each column.
fn correlate(x: &DMatrix<f64>, kernel: &[f64]) -> DMatrix<f64> {
    let n = x.nrows();
    let mut out = x * kernel[0];
    for (lag, value) in kernel.iter().enumerate().skip(1).filter(|(lag, _)| *lag < n) {
        let (later, earlier) = (x.rows(lag, n - lag), x.rows(0, n - lag));
        let mut head = out.rows_mut(0, n - lag);
        head += later * *value;
        let mut tail = out.rows_mut(lag, n - lag);
        tail += earlier * *value;
    }
    out
}
