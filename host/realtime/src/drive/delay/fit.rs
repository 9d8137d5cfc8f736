//! Least squares for dead time and lag: Levenberg-Marquardt with numerical derivatives.

use super::response::Lag;
use super::{Axis, DeadTime, ServoResponse};

/// Greatest number of unknowns: dead time and three of a lag.
const MOST: usize = 4;
/// Greatest number of iterations.
const STEPS: usize = 60;
/// A fit ends when its cost falls by less than this share in an iteration.
const DONE: f64 = 1e-10;
/// Residual floor of the axis weights \[rad\], \[m\]: the last decimal of a protocol.
const FLOOR: f64 = 1e-8;

type Unknowns = [f64; MOST];
type Normal = [[f64; MOST]; MOST];

/// Fits dead time and lag of a robot to its moving axes; `None` without any.
pub(super) fn fit(axes: &[Axis], response: ServoResponse) -> Option<DeadTime> {
    let samples: usize = axes.iter().map(|axis| axis.measured.len()).sum();
    if axes.is_empty() || samples <= 2 * MOST {
        return None;
    }
    let mut problem = Problem { axes, response, weights: vec![1.0; axes.len()] };
    let mut best = problem.best();
    // Axes follow with different accuracy (contact, encoder noise): weights come from their residuals.
    problem.weigh(&best.unknowns);
    best = problem.descend(best.unknowns);
    let count = (samples - problem.count()) as f64;
    let residuals = problem.residuals(&best.unknowns);
    let variance = best.cost / count * spread(&residuals, axes);
    let error = invert(&best.normal, problem.count()).map_or(f64::NAN, |inverse| (inverse[0][0] * variance).sqrt());
    let plain = Problem { weights: vec![1.0; axes.len()], ..problem }.residuals(&best.unknowns);
    let residual = (plain.iter().map(|r| r * r).sum::<f64>() / samples as f64).sqrt();
    Some(DeadTime { dead_time: best.unknowns[0], error, lag: lag_of(response, &best.unknowns), residual, samples })
}

/// Returns the ratio of residuals to independent residuals: (1 + r) / (1 - r) of their correlation r.
fn spread(residuals: &[f64], axes: &[Axis]) -> f64 {
    let (mut own, mut next, mut at) = (0.0, 0.0, 0);
    for axis in axes {
        let one = &residuals[at..at + axis.measured.len()];
        at += one.len();
        own += one.iter().map(|r| r * r).sum::<f64>();
        next += one.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
    }
    let r = (next / own).clamp(0.0, 0.9999);
    (1.0 + r) / (1.0 - r)
}

/// Logarithms keep the times positive.
fn lag_of(response: ServoResponse, unknowns: &Unknowns) -> Option<Lag> {
    let [_, time, damping, zero] = *unknowns;
    match response {
        ServoResponse::None => None,
        ServoResponse::Known(lag) => Some(lag),
        ServoResponse::First => Some(Lag::First { time: time.exp() }),
        ServoResponse::Second => Some(Lag::Second { time: time.exp(), damping: damping.exp(), zero }),
    }
}

/// A point of the descent: unknowns, weighted sum of squares, matrix of the normal equations.
struct Place {
    unknowns: Unknowns,
    cost: f64,
    normal: Normal,
}

struct Problem<'a> {
    axes: &'a [Axis],
    response: ServoResponse,
    weights: Vec<f64>,
}

impl Problem<'_> {
    fn count(&self) -> usize {
        match self.response {
            ServoResponse::None | ServoResponse::Known(_) => 1,
            ServoResponse::First => 2,
            ServoResponse::Second => MOST,
        }
    }

    /// Returns the best descent from several starts: dead time and lag are partly confounded.
    fn best(&self) -> Place {
        let whole =
            Problem { response: ServoResponse::None, weights: self.weights.clone(), ..*self }.descend([0.0; MOST]);
        let starts: Vec<Unknowns> = match self.response {
            ServoResponse::None => return whole,
            ServoResponse::Known(_) => vec![[0.0; MOST]],
            ServoResponse::First => {
                let lag = whole.unknowns[0].max(1e-3);
                vec![[0.1 * lag, (0.9 * lag).ln(), 0.0, 0.0], [0.8 * lag, (0.2 * lag).ln(), 0.0, 0.0]]
            }
            ServoResponse::Second => {
                let lag = whole.unknowns[0].max(1e-3);
                let start = |dead: f64, damping: f64, zero: f64| {
                    // The dead time at low frequency is tau + 2 z / w - T_z.
                    let time = (lag * (1.0 - dead) + zero * lag) / (2.0 * damping);
                    [dead * lag, time.ln(), damping.ln(), zero * lag]
                };
                vec![start(0.1, 0.8, 0.0), start(0.7, 1.0, 0.0), start(0.1, 2.5, 0.7)]
            }
        };
        let places = starts.into_iter().map(|start| self.descend(start));
        places.min_by(|one, two| one.cost.total_cmp(&two.cost)).unwrap_or(whole)
    }

    fn weigh(&mut self, unknowns: &Unknowns) {
        self.weights.fill(1.0);
        let residuals = self.residuals(unknowns);
        let mut at = 0;
        for (axis, weight) in self.axes.iter().zip(&mut self.weights) {
            let one = &residuals[at..at + axis.measured.len()];
            at += one.len();
            let square = one.iter().map(|r| r * r).sum::<f64>() / one.len() as f64;
            *weight = 1.0 / square.sqrt().max(FLOOR);
        }
    }

    /// Returns the weighted residuals of all axes, less a constant offset per axis (mounting, zeros).
    fn residuals(&self, unknowns: &Unknowns) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.axes.iter().map(|axis| axis.measured.len()).sum());
        let lag = lag_of(self.response, unknowns);
        for (axis, weight) in self.axes.iter().zip(&self.weights) {
            let begin = out.len();
            let output = axis.course.behind(lag);
            let expected = output.delayed(axis.measured.iter().map(|(time, _)| *time), unknowns[0]);
            out.extend(expected.zip(&axis.measured).map(|(expected, (_, place))| place - expected));
            let mean = out[begin..].iter().sum::<f64>() / axis.measured.len() as f64;
            out[begin..].iter_mut().for_each(|residual| *residual = (*residual - mean) * weight);
        }
        out
    }

    /// Descends from a start.
    fn descend(&self, start: Unknowns) -> Place {
        let count = self.count();
        let square = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
        let mut residuals = self.residuals(&start);
        let mut place = Place { unknowns: start, cost: square(&residuals), normal: [[0.0; MOST]; MOST] };
        let mut damping = 1e-3;
        let mut slopes = self.slopes(&place.unknowns);
        for _ in 0..STEPS {
            let right: Unknowns = std::array::from_fn(|i| slopes.get(i).map_or(0.0, |slope| -dot(slope, &residuals)));
            place.normal = normal(&slopes);
            let mut damped = place.normal;
            (0..count).for_each(|i| damped[i][i] *= 1.0 + damping);
            let Some(inverse) = invert(&damped, count) else {
                break;
            };
            let step: Unknowns = std::array::from_fn(|i| (0..count).map(|k| inverse[i][k] * right[k]).sum());
            let there = std::array::from_fn(|i| place.unknowns[i] + bounded(i, step[i]));
            let tried = self.residuals(&there);
            let cost = square(&tried);
            if cost.is_nan() || cost >= place.cost {
                damping *= 10.0;
                if damping > 1e9 {
                    break;
                }
                continue;
            }
            let fallen = 1.0 - cost / place.cost;
            (place.unknowns, place.cost, residuals) = (there, cost, tried);
            slopes = self.slopes(&place.unknowns);
            place.normal = normal(&slopes);
            damping = (damping * 0.1).max(1e-12);
            if fallen < DONE {
                break;
            }
        }
        place
    }

    /// Returns the derivatives of the residuals by every unknown.
    fn slopes(&self, unknowns: &Unknowns) -> Vec<Vec<f64>> {
        let along = |i: usize| {
            // Dead time and zero in seconds, time and damping in the logarithm.
            let step = if i == 0 || i == 3 { 2e-4 } else { 1e-4 };
            let at = |sign: f64| {
                let mut moved = *unknowns;
                moved[i] += sign * step;
                self.residuals(&moved)
            };
            let (ahead, behind) = (at(1.0), at(-1.0));
            ahead.iter().zip(&behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * step)).collect()
        };
        (0..self.count()).map(along).collect()
    }
}

/// Limits a step to the validity of the linearisation: 20 ms, or a factor of 2.
fn bounded(unknown: usize, step: f64) -> f64 {
    let most = if unknown == 0 || unknown == 3 { 0.02 } else { 0.7 };
    step.clamp(-most, most)
}

fn dot(one: &[f64], two: &[f64]) -> f64 {
    one.iter().zip(two).map(|(a, b)| a * b).sum()
}

fn normal(slopes: &[Vec<f64>]) -> Normal {
    let mut out = [[0.0; MOST]; MOST];
    for (i, one) in slopes.iter().enumerate() {
        for (k, two) in slopes.iter().enumerate() {
            out[i][k] = dot(one, two);
        }
    }
    out
}

/// Returns the inverse of the leading `count` rows and columns of a positive definite matrix (Gauss-Jordan).
fn invert(matrix: &Normal, count: usize) -> Option<Normal> {
    let mut left = *matrix;
    let mut right: Normal = std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
    for i in 0..count {
        let pivot = left[i][i];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        for k in 0..count {
            (left[i][k], right[i][k]) = (left[i][k] / pivot, right[i][k] / pivot);
        }
        let (row, image) = (left[i], right[i]);
        for other in (0..count).filter(|other| *other != i) {
            let factor = left[other][i];
            for k in 0..count {
                left[other][k] -= factor * row[k];
                right[other][k] -= factor * image[k];
            }
        }
    }
    Some(right)
}
