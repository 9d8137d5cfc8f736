//! Signs and units of recordings, checked without a model's parameters: a drive that yields energy, a torque without a
//! sign, a rate that contradicts the attitude.

use crate::data::grid::{Finding, Piece};
use crate::data::smooth::motion;
use crate::data::state::Poses;
use crate::{DiagnosisError, Result};
use nalgebra::{DMatrix, DVector, Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Highest frequency of the torques and motions that are compared \[Hz\].
const CUTOFF: f64 = 8.0;
/// Share of a recording at either end that is not compared: smoothing rings there.
const ENDS: f64 = 0.05;
/// Rate below which the direction of motion is open, as a share of its root mean square.
const SLOW: f64 = 0.05;
/// Standard errors by which a physical parameter is negative, and by which the other must not be positive.
const NEGATIVE: f64 = -10.0;
const POSITIVE: f64 = 3.0;
/// Share of the greatest torque below which a torque without a sign meets zero, and how often it does so at least.
const NEAR_ZERO: f64 = 0.03;
const MEETINGS: usize = 4;
/// Correlation above which a rate follows the attitude, and relative tolerance of its factor.
const FOLLOWS: f64 = 0.9;
const ALIKE: f64 = 0.1;
/// Factors of a rate by common errors.
const RATES: [(f64, &str); 5] = [
    (-1.0, "its sign is reversed"),
    (180.0 / PI, "it is in degrees and declared in radians"),
    (PI / 180.0, "it is in radians and declared in degrees"),
    (30.0 / PI, "it is in rpm and declared in rad/s"),
    (PI / 30.0, "it is in rad/s and declared in rpm"),
];
/// Factors of an inertia by common errors.
const INERTIAS: [(f64, &str); 6] = [
    (180.0 / PI, "the position is in radians and declared in degrees"),
    (PI / 180.0, "the position is in degrees and declared in radians"),
    (1e3, "the torque is a thousand times too large, or the position too small"),
    (1e-3, "the position is a thousand times too large, or the torque too small"),
    (9.80665, "the torque is in N m and declared in kgf m"),
    (1.0 / 9.80665, "the torque is in kgf m and declared in N m"),
];

/// Checks recordings; `inertia` is that of a single drive by its model.
///
/// # Errors
/// A torque without a sign, a reversed sign, a rate in another unit: every answer would be wrong.
pub(crate) fn check(pieces: &[Piece], inertia: Option<f64>) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let Some(first) = pieces.first() else { return Ok(findings) };
    for torque in first.signals.keys().filter(|name| *name == "tau" || name.starts_with("tau.")) {
        let angle = torque.replacen("tau", "q", 1);
        if !pieces.iter().all(|piece| piece.signals.contains_key(torque) && piece.signals.contains_key(&angle)) {
            continue;
        }
        unsigned(pieces, torque, &angle)?;
        let Some(drive) = PassiveDrive::of(pieces, torque, &angle) else { continue };
        drive.check_sign(torque, &angle)?;
        let ratio = inertia.filter(|_| drive.inertia[1] > -NEGATIVE).map(|nominal| drive.inertia[0] / nominal);
        if let Some((ratio, what)) = ratio.and_then(|ratio| Some((ratio, error_of(&INERTIAS, ratio)?))) {
            let what = format!(
                "the inertia by `{torque}` and `{angle}` is {ratio:.4} times that of the model, as if {what}: check their \
                 units in [log]"
            );
            findings.push(Finding { recording: "all recordings".to_owned(), what });
        }
    }
    rates(pieces)?;
    commanded(pieces)?;
    Ok(findings)
}

/// Refuses commands that change in no recording: nothing follows them.
fn commanded(pieces: &[Piece]) -> Result<()> {
    let is_constant =
        |piece: &Piece| piece.signals.get("sent").is_some_and(|values| values.iter().all(|value| *value == values[0]));
    if !pieces.iter().all(is_constant) {
        return Ok(());
    }
    let remedy = "record a motion, or check the column of `sent` in [log]";
    Err(DiagnosisError::unfit("`sent` is constant in every recording".to_owned(), remedy))
}

/// The common error with a factor.
fn error_of(errors: &[(f64, &'static str)], ratio: f64) -> Option<&'static str> {
    errors.iter().find(|(factor, _)| (ratio / factor - 1.0).abs() < ALIKE).map(|error| error.1)
}

/// Refuses a torque that meets zero and never changes its sign, although the velocity does.
fn unsigned(pieces: &[Piece], torque: &str, angle: &str) -> Result<()> {
    let torques = || pieces.iter().map(|piece| &piece.signals[torque]);
    let most = torques().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
    if torques().flatten().any(|value| *value < 0.0) || most == 0.0 {
        return Ok(());
    }
    let is_near = |value: f64| value < NEAR_ZERO * most;
    let meetings = |values: &Vec<f64>| values.windows(2).filter(|pair| !is_near(pair[0]) && is_near(pair[1])).count();
    let turns = |piece: &Piece| {
        let rate = motion(&piece.signals[angle], piece.step, cutoff(piece), 1).rate;
        rate.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count()
    };
    let meets: usize = torques().map(meetings).sum();
    if meets < MEETINGS || pieces.iter().map(turns).sum::<usize>() < MEETINGS {
        return Ok(());
    }
    let what = format!(
        "`{torque}` is unsigned: it meets zero {meets} times and never changes its sign, although `{angle}` reverses"
    );
    Err(DiagnosisError::unfit(what, "record the torque or current with its sign"))
}

fn cutoff(piece: &Piece) -> f64 {
    CUTOFF.min(0.4 / piece.step)
}

/// Inertia and friction of a drive by its torque and motion, with nothing known.
struct PassiveDrive {
    /// Inertia, and that in standard errors.
    inertia: [f64; 2],
    /// Mean power of the friction in standard errors.
    friction: f64,
}

impl PassiveDrive {
    /// Least squares over inertia, viscous and Coulomb friction, offset and weight; `None` if the motion does not
    /// determine them.
    fn of(pieces: &[Piece], torque: &str, angle: &str) -> Option<Self> {
        let (mut rows, mut torques): (Vec<[f64; 6]>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut independent = 0.0;
        for piece in pieces {
            let cutoff = cutoff(piece);
            let q = motion(&piece.signals[angle], piece.step, cutoff, 1);
            let tau = motion(&piece.signals[torque], piece.step, cutoff, 1).value;
            let rms = (q.rate.iter().map(|rate| rate * rate).sum::<f64>() / q.rate.len() as f64).sqrt();
            let ends = (ENDS * tau.len() as f64) as usize;
            independent += (tau.len() - 2 * ends) as f64 * 2.0 * cutoff * piece.step;
            for (i, torque) in tau.iter().enumerate().take(tau.len() - ends).skip(ends) {
                let (v, slow) = (q.rate[i], q.rate[i].abs() < SLOW * rms);
                let direction = if slow { 0.0 } else { v.signum() };
                let (sin, cos) = q.value[i].sin_cos();
                rows.push([q.acceleration[i], v, direction, 1.0, sin, cos]);
                torques.push(*torque);
            }
        }
        let table = DMatrix::from_fn(rows.len(), 6, |row, column| rows[row][column]);
        let scale: Vec<f64> = table.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
        let scaled = DMatrix::from_fn(rows.len(), 6, |row, column| table[(row, column)] / scale[column]);
        let known = DVector::from_vec(torques);
        // A ridge far below every determined direction: offset and weight may coincide on a short way.
        let gram = scaled.tr_mul(&scaled) + DMatrix::identity(6, 6) * 1e-9;
        let inverse = gram.cholesky()?.inverse();
        let solution = &inverse * scaled.tr_mul(&known);
        // Low-passed samples are not independent.
        let share = known.len() as f64 / independent;
        let variance = (&known - &scaled * &solution).norm_squared() / known.len() as f64 * share;
        let of = |column: usize| {
            [solution[column] / scale[column], solution[column] / (variance * inverse[(column, column)]).sqrt()]
        };
        // Mean power of the friction, linear in its two parameters.
        let mut power = DVector::zeros(6);
        for row in &rows {
            power[1] += row[1] * row[1] / scale[1];
            power[2] += row[1] * row[2] / scale[2];
        }
        let friction = power.dot(&solution) / (variance * (power.transpose() * &inverse * &power)[(0, 0)]).sqrt();
        let found = Self { inertia: of(0), friction };
        (found.inertia[1].is_finite() && friction.is_finite()).then_some(found)
    }

    /// Refuses a drive whose inertia or friction is negative and neither is positive: it would yield energy.
    fn check_sign(&self, torque: &str, angle: &str) -> Result<()> {
        let (least, most) = (self.inertia[1].min(self.friction), self.inertia[1].max(self.friction));
        if least > NEGATIVE || most > POSITIVE {
            return Ok(());
        }
        let what = format!(
            "the sign of `{torque}` or of `{angle}` is reversed: their inertia is {:.1} and their friction {:.1} standard \
             errors from zero",
            self.inertia[1], self.friction
        );
        Err(DiagnosisError::unfit(what, "write scale = -1 for one of the two in [log]"))
    }
}

/// Refuses rates that are a common factor off the rates of the attitude.
fn rates(pieces: &[Piece]) -> Result<()> {
    for (axis, name) in ["rate.x", "rate.y", "rate.z"].into_iter().enumerate() {
        let (mut own, mut both, mut attitude) = (0.0, 0.0, 0.0);
        for piece in pieces.iter().filter(|piece| piece.signals.contains_key(name)) {
            let Some(poses) = attitudes(piece) else { return Ok(()) };
            for frame in 0..poses.frames() {
                if let Some(state) = poses.state(frame) {
                    let (rate, measured) = (state.rate[axis], piece.signals[name][frame]);
                    (own, both, attitude) = (own + measured * measured, both + measured * rate, attitude + rate * rate);
                }
            }
        }
        if own == 0.0 || attitude == 0.0 || both.abs() < FOLLOWS * (own * attitude).sqrt() {
            continue;
        }
        let factor = both / attitude;
        if let Some(what) = error_of(&RATES, factor) {
            let what = format!("`{name}` is {factor:.3} times the rate of `orientation`: {what}");
            return Err(DiagnosisError::unfit(what, "correct the unit or the scale of its column in [log]"));
        }
    }
    Ok(())
}

/// Attitudes of a recording; `None` without a quaternion.
fn attitudes(piece: &Piece) -> Option<Poses> {
    let parts: Vec<&Vec<f64>> =
        ["w", "x", "y", "z"].iter().filter_map(|axis| piece.signals.get(&format!("orientation.{axis}"))).collect();
    let [w, x, y, z] = parts[..] else { return None };
    let attitude = |i| UnitQuaternion::from_quaternion(Quaternion::new(w[i], x[i], y[i], z[i]));
    let attitude = (0..piece.samples()).map(attitude).collect();
    Some(Poses { step: piece.step, position: vec![Vector3::zeros(); piece.samples()], attitude })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// A body that swings about x, with its rate times a factor.
    fn swing(factor: f64) -> Piece {
        let time = |i: i32| f64::from(i) * 0.01;
        let of = |value: &dyn Fn(f64) -> f64| (0..600).map(|i| value(time(i))).collect::<Vec<f64>>();
        let angle = |t: f64| 0.8 * (2.0 * t).sin();
        let signals = BTreeMap::from([
            ("orientation.w".to_owned(), of(&|t| (0.5 * angle(t)).cos())),
            ("orientation.x".to_owned(), of(&|t| (0.5 * angle(t)).sin())),
            ("orientation.y".to_owned(), of(&|_| 0.0)),
            ("orientation.z".to_owned(), of(&|_| 0.0)),
            ("rate.x".to_owned(), of(&|t| factor * 1.6 * (2.0 * t).cos())),
        ]);
        Piece { experiment: "x".to_owned(), repeat: 1, start: 0.0, offset: 0.0, step: 0.01, signals }
    }

    #[test]
    fn rate_in_another_unit_or_sign_than_the_attitude_is_refused() {
        assert_eq!(check(&[swing(1.0)], None).expect("a rate in rad/s"), Vec::new());
        for (factor, word) in [(-1.0, "reversed"), (180.0 / PI, "in degrees"), (30.0 / PI, "in rpm")] {
            let error = check(&[swing(factor)], None).expect_err("refused").to_string();
            assert!(error.contains("`rate.x`") && error.contains(word), "{error}");
        }
    }
}
