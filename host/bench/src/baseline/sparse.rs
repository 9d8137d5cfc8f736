//! Sparse regression of the discrepancy in the manner of PySINDy: a library with the exact form of every effect,
//! thresholded least squares over bootstrapped samples, and no name if a healthy plant has as large a discrepancy.
//!
//! Brunton, Proctor and Kutz, PNAS 113 (2016); Fasel, Kutz, Brunton and Brunton, Proc. R. Soc. A 478 (2022).

use super::signals::{Sample, Signals, direction};
use nalgebra::{DMatrix, DVector};
use softdock_kernels::manipulator::GRAVITY;
use softdock_kernels::philox;

/// Power of the discrepancy over the greatest of the healthy sessions from which on something is there.
const EXCESS: f64 = 1.1;
/// Bootstraps, and the share of them that must keep a term.
const BOOTSTRAPS: u64 = 20;
const KEPT: f64 = 0.6;
/// A term is dropped whose share of the discrepancy's root mean square is less.
const THRESHOLD: f64 = 0.1;
/// Rounds of thresholding.
const ROUNDS: usize = 10;
/// Weight of the coefficients' squares, in shares of the samples.
const RIDGE: f64 = 1e-4;
/// Decimation factor: neighbouring samples are redundant.
const EVERY: usize = 4;
/// Speed at which static friction has fallen to 1/e \[rad/s\], given as prior information.
const STRIBECK_SPEED: f64 = 0.03;
/// Periods of ripples that are tried \[1/rad\].
const PERIODS: std::ops::RangeInclusive<u32> = 20..=70;
/// Seed of the bootstrap.
const SEED: u64 = 3;

/// A term: the effect that it stands for, and its value at a sample.
type Term = (&'static str, Box<dyn Fn(&Sample) -> f64>);

/// Returns the effect whose terms make most of the discrepancy; `None` if a healthy plant has as large a discrepancy.
pub(super) fn name(signals: &Signals, healthy: &[Signals]) -> Option<&'static str> {
    let plant = Discrepancy::of(signals, healthy, |sample| sample.unexplained, plant_terms(signals));
    let controller = Discrepancy::of(signals, healthy, |sample| sample.unasked, controller_terms(signals));
    let most = if plant.excess > controller.excess { plant } else { controller };
    if most.excess < EXCESS { None } else { most.name() }
}

/// Returns the terms of the plant. The measured torque is excluded: it correlates with every other term, and nearly
/// every effect would be named a torque constant.
fn plant_terms(signals: &Signals) -> Vec<Term> {
    let radius = signals.rig.payload_radius;
    let link = signals.rig.link_inertia;
    let mut terms: Vec<Term> = vec![
        ("J18_drive_offset", Box::new(|_| 1.0)),
        ("J17_cable_drag", Box::new(|s| s.angle[0])),
        ("J2_viscous", Box::new(|s| s.angle[1])),
        ("quadratic_drag", Box::new(|s| s.angle[1] * s.angle[1].abs())),
        ("cubic_drag", Box::new(|s| s.angle[1].powi(3))),
        ("J1_coulomb", Box::new(|s| direction(s.angle[1]))),
        ("J3_stribeck", Box::new(|s| direction(s.angle[1]) * (-s.angle[1].abs() / STRIBECK_SPEED).exp())),
        ("J15_link_inertia", Box::new(|s| s.angle[2])),
        ("J14_payload", Box::new(move |s| radius * radius * s.angle[2] + GRAVITY * radius * s.angle[0].cos())),
        ("J16_gravity_compensation", Box::new(|s| s.angle[0].cos())),
        ("J12_current_loop", Box::new(|s| s.torque[1])),
        ("J5_load_friction", Box::new(|s| s.angle[0].cos().abs() * direction(s.angle[1]))),
        ("J8_elasticity", Box::new(move |s| link * s.angle[4])),
    ];
    for periods in PERIODS.map(f64::from) {
        terms.push(("J9_torque_ripple", Box::new(move |s| (periods * s.angle[0]).sin())));
        terms.push(("J9_torque_ripple", Box::new(move |s| (periods * s.angle[0]).cos())));
    }
    terms
}

/// Returns the terms of the reference, as the gains of the controller propagate them.
fn controller_terms(signals: &Signals) -> Vec<Term> {
    let gains = signals.rig.controller.as_ref().map(|c| [c.values.position_gain, c.values.velocity_gain]);
    let [position, velocity] = gains.unwrap_or_default();
    vec![
        ("C1_transport_delay", Box::new(move |s| position * s.reference[1] + velocity * s.reference[2])),
        ("C2_lag", Box::new(move |s| position * s.reference[2])),
        ("C5_clock_skew", Box::new(move |s| s.time * (position * s.reference[1] + velocity * s.reference[2]))),
        ("J18_drive_offset", Box::new(|_| 1.0)),
    ]
}

/// Torque that the nominal model does not explain, with its candidate terms.
struct Discrepancy {
    names: Vec<&'static str>,
    /// Terms at the samples, each of unit root mean square.
    columns: DMatrix<f64>,
    target: DVector<f64>,
    /// Its power over the greatest of the healthy sessions.
    excess: f64,
}

impl Discrepancy {
    fn of(signals: &Signals, healthy: &[Signals], target: fn(&Sample) -> f64, terms: Vec<Term>) -> Self {
        let power = |signals: &Signals| {
            signals.samples.iter().map(|s| target(s).powi(2)).sum::<f64>() / signals.samples.len() as f64
        };
        let samples: Vec<&Sample> = signals.samples.iter().step_by(EVERY).collect();
        let mut columns = DMatrix::from_fn(samples.len(), terms.len(), |i, k| terms[k].1(samples[i]));
        for mut column in columns.column_iter_mut() {
            let size = (column.norm_squared() / samples.len() as f64).sqrt();
            column /= size.max(f64::MIN_POSITIVE);
        }
        Self {
            names: terms.iter().map(|(name, _)| *name).collect(),
            target: DVector::from_iterator(samples.len(), samples.iter().map(|s| target(s))),
            columns,
            excess: power(signals) / healthy.iter().map(power).fold(0.0, f64::max),
        }
    }

    /// Of the terms that most bootstraps keep, the one that explains most by itself (its error reduction ratio: Billings,
    /// Nonlinear system identification, 2013): coefficients of terms that go together mean nothing one by one.
    fn name(&self) -> Option<&'static str> {
        let fits: Vec<DVector<f64>> = (0..BOOTSTRAPS).map(|draw| self.thresholded(&self.resampled(draw))).collect();
        let kept = |k: &usize| fits.iter().filter(|fit| fit[*k] != 0.0).count() as f64 >= KEPT * BOOTSTRAPS as f64;
        let explained = self.columns.tr_mul(&self.target);
        let best =
            (0..self.names.len()).filter(kept).max_by(|a, b| explained[*a].abs().total_cmp(&explained[*b].abs()))?;
        Some(self.names[best])
    }

    /// How often each sample is drawn in a bootstrap.
    fn resampled(&self, draw: u64) -> Vec<f64> {
        let count = self.target.len();
        let mut weights = vec![0.0; count];
        for i in 0..count {
            let u = philox::uniform(SEED, "sparse bootstrap", draw, i as u32);
            weights[((u * count as f64) as usize).min(count - 1)] += 1.0;
        }
        weights
    }

    /// Sequentially thresholded least squares with weights of the samples.
    fn thresholded(&self, weights: &[f64]) -> DVector<f64> {
        let weighted =
            DMatrix::from_fn(self.columns.nrows(), self.columns.ncols(), |i, k| weights[i] * self.columns[(i, k)]);
        let (gram, right) = (weighted.tr_mul(&self.columns), weighted.tr_mul(&self.target));
        let least = THRESHOLD * (self.target.norm_squared() / self.target.len() as f64).sqrt();
        let mut kept: Vec<usize> = (0..self.names.len()).collect();
        let mut fit = DVector::zeros(self.names.len());
        for _ in 0..ROUNDS {
            let ridge = RIDGE * self.target.len() as f64;
            let own = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
                gram[(kept[i], kept[j])] + if i == j { ridge } else { 0.0 }
            });
            let own_right = DVector::from_iterator(kept.len(), kept.iter().map(|k| right[*k]));
            let Some(solved) = own.cholesky().map(|own| own.solve(&own_right)) else { return fit };
            fit.fill(0.0);
            kept.iter().zip(solved.iter()).filter(|(_, x)| x.abs() >= least).for_each(|(k, x)| fit[*k] = *x);
            let left: Vec<usize> = kept.iter().copied().filter(|k| fit[*k] != 0.0).collect();
            if left.len() == kept.len() || left.is_empty() {
                return fit;
            }
            kept = left;
        }
        fit
    }
}
