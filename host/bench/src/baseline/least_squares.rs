//! Least squares of a fixed structure: every parameter of the nominal plant is fitted, and the one that differs most
//! significantly from the mean of the healthy sessions is named.

use super::signals::{Sample, Signals, direction};
use nalgebra::{DMatrix, DVector};

/// The parameters that are linear in the torque, by the effects that they stand for.
const NAMES: [&str; 6] = [
    "J15_link_inertia",
    "J2_viscous",
    "J1_coulomb",
    "J16_gravity_compensation",
    "J16_gravity_compensation",
    "J18_drive_offset",
];
/// z-score from which a difference is significant: one in two thousand for six parameters.
const SIGNIFICANT: f64 = 4.0;
/// Longest lag of the autocorrelation, in samples.
const LONGEST: usize = 200;

/// Returns the effect whose parameter differs most significantly; `None` if none does.
pub(super) fn name(signals: &Signals, healthy: &[Signals]) -> Option<&'static str> {
    let own = Fit::of(signals)?;
    let others: Vec<Fit> = healthy.iter().map(Fit::of).collect::<Option<_>>()?;
    let (tolerance, count) = (tolerances(signals), others.len() as f64);
    let significance = |k: usize| {
        let mean = others.iter().map(|other| other.values[k]).sum::<f64>() / count;
        let variance = (own.variance[k] + tolerance[k] * tolerance[k]) * (1.0 + 1.0 / count);
        (own.values[k] - mean).abs() / variance.sqrt()
    };
    let best = (0..NAMES.len()).max_by(|a, b| significance(*a).total_cmp(&significance(*b)))?;
    (significance(best) > SIGNIFICANT).then_some(NAMES[best])
}

/// Returns the tolerances of the parameters; the torque constant scales them all.
fn tolerances(signals: &Signals) -> [f64; 6] {
    let rig = &signals.rig;
    let of = |name: &str| rig.tolerance.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, sd)| *sd);
    let scale = of("torque_constant_error");
    let inertia = scale * (rig.values.motor_inertia + rig.link_inertia);
    let gravity = scale * rig.gravity_torque;
    [inertia, of("viscous"), of("coulomb"), gravity, gravity, of("offset")]
}

/// Fitted parameters with their variances.
struct Fit {
    values: DVector<f64>,
    variance: Vec<f64>,
}

impl Fit {
    /// Fits the parameters; `None` if the motion does not identify them.
    fn of(signals: &Signals) -> Option<Self> {
        let samples = &signals.samples;
        let columns = DMatrix::from_fn(samples.len(), NAMES.len(), |i, k| row(&samples[i])[k]);
        let torque = DVector::from_iterator(samples.len(), samples.iter().map(|sample| sample.torque[0]));
        let normal = (columns.tr_mul(&columns)).cholesky()?;
        let values = normal.solve(&columns.tr_mul(&torque));
        let residual = torque - &columns * &values;
        let power = residual.norm_squared() / (samples.len() - NAMES.len()) as f64 * memory(residual.as_slice());
        let variance = normal.inverse().diagonal().iter().map(|v| v * power).collect();
        Some(Self { values, variance })
    }
}

fn row(sample: &Sample) -> [f64; 6] {
    let [q, v, a, ..] = sample.angle;
    [a, v, direction(v), q.cos(), q.sin(), 1.0]
}

/// Returns the factor by which autocorrelation of the residuals increases a variance: the sum of correlations up to the
/// first negative one.
fn memory(residual: &[f64]) -> f64 {
    let power: f64 = residual.iter().map(|r| r * r).sum();
    let correlation = |lag: usize| residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    1.0 + 2.0 * (1..LONGEST.min(residual.len())).map(correlation).take_while(|r| *r > 0.0).sum::<f64>()
}
