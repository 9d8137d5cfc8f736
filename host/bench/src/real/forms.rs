//! Effects that are planted in measured recordings: torques of a form, delays, lags, clock skew.

use crate::real::table::MeasuredTable;
use crate::{GauntletError, Result};
use softdock_campaign::Rig;
use softdock_campaign::columns::RecordedColumn;
use std::f64::consts::PI;

/// Cut-off of the motion by which planted torques are computed \[Hz\].
const CUTOFF: f64 = 20.0;
/// Shortest smoothing, in samples.
const SHORTEST: f64 = 1.2;
/// Travel over which a planted friction changes its sign, as a share of the range of the motion.
const PRESLIDING: f64 = 2e-4;
/// Speed over which planted static friction decays, as a share of the greatest speed.
const STATIC: f64 = 0.03;
/// Periods of a planted torque ripple over the range of the motion.
const RIPPLE_PERIODS: f64 = 9.0;
/// Tolerances beyond which a parameter is no calibration.
const OUTSIDE: f64 = 5.0;

/// Torque that a machine would need besides, for the same motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TorqueForm {
    /// Coulomb friction.
    Coulomb,
    /// Viscous friction.
    Viscous,
    /// Static friction beyond Coulomb's.
    Static,
    /// Friction that depends on the direction.
    Direction,
    /// Constant torque.
    Offset,
    /// Weight.
    Gravity,
    /// Spring.
    Cable,
    /// Ripple by angle.
    Ripple,
    /// Inertia.
    Inertia,
    /// Torque in proportion to the recorded one: another torque constant.
    Gain,
}

/// Change of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlantedChange {
    /// Torque of a form, added to the recorded one; sizes in multiples of the torque that the unchanged set leaves
    /// unexplained (root mean square), at least five tolerances of the model.
    Torque(TorqueForm),
    /// Delay of the response; sizes in rows.
    Delay,
    /// The other clock runs fast; sizes in rows over the whole recording.
    Skew,
}

/// Motion of a joint.
struct JointMotion {
    position: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
}

/// Range and greatest speed of the motion to which forms refer, the same in all recordings of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionScale {
    range: f64,
    fastest: f64,
}

impl JointMotion {
    fn scale(&self) -> MotionScale {
        let (least, most) = ends(&self.position);
        let fastest = self.rate.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        MotionScale { range: most - least, fastest }
    }

    /// Low-passed with a Gaussian, differentiated by central differences.
    fn of(time: &[f64], position: &[f64]) -> Self {
        let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
        let width = (1.0 / (2.0 * PI * CUTOFF) / step).max(SHORTEST);
        let position = smoothed(position, width);
        let rate = derivative(time, &position);
        let acceleration = derivative(time, &smoothed(&rate, width));
        Self { position, rate, acceleration }
    }

    /// Coulomb friction of one with presliding: an exponential over a travel, which is held at rest.
    fn friction(&self, travel: f64) -> Vec<f64> {
        let (mut state, mut before) = (0.0, self.position[0]);
        let step = |position: &f64| {
            let moved = position - before;
            before = *position;
            state = moved.signum() - (moved.signum() - state) * (-moved.abs() / travel).exp();
            state
        };
        self.position.iter().map(step).collect()
    }

    /// Torque of a form with a size of one.
    fn torque(&self, form: TorqueForm, MotionScale { range, fastest }: MotionScale, recorded: &[f64]) -> Vec<f64> {
        let friction = self.friction(PRESLIDING * range);
        let direction = |i: usize| friction[i];
        let of = |i: usize| match form {
            TorqueForm::Coulomb => direction(i),
            TorqueForm::Viscous => self.rate[i],
            TorqueForm::Static => direction(i) * (-(self.rate[i] / (STATIC * fastest)).powi(2)).exp(),
            TorqueForm::Direction => direction(i).abs(),
            TorqueForm::Offset => 1.0,
            TorqueForm::Gravity => self.position[i].cos(),
            TorqueForm::Cable => self.position[i],
            TorqueForm::Ripple => (2.0 * PI * RIPPLE_PERIODS * self.position[i] / range).sin(),
            TorqueForm::Inertia => self.acceleration[i],
            TorqueForm::Gain => recorded[i],
        };
        (0..self.rate.len()).map(of).collect()
    }
}

impl PlantedChange {
    /// Returns the planted parameter in SI units: `multiple` of what the unchanged set leaves unexplained, as a share of
    /// the torque, or of a row; `joint` ends the names of a robot's signals (`.3`), and `tolerance` is the model's of the
    /// parameter, 0 without one.
    ///
    /// # Errors
    /// A signal that the rig or the recording does not have.
    pub(crate) fn size(
        self,
        table: &MeasuredTable,
        joint: Joint,
        multiple: f64,
        unexplained: f64,
        tolerance: f64,
    ) -> Result<PlantedSize> {
        let rows = table.rows.len() - 1;
        let Self::Torque(form) = self else {
            let unit = if self == Self::Skew { (rows as f64).recip() } else { joint.step(table)? };
            return Ok(PlantedSize { value: multiple * unit, scale: None });
        };
        let recorded = table.signal(joint.column("tau")?)?;
        let motion = joint.motion(table)?;
        let scale = motion.scale();
        let unit = motion.torque(form, scale, &recorded);
        // A constant part is one with the drive's offset.
        let power = if form == TorqueForm::Offset { root_mean_square(&unit) } else { deviation(&unit) };
        let value = (multiple * unexplained * root_mean_square(&recorded) / power).max(OUTSIDE * tolerance);
        Ok(PlantedSize { value, scale: Some(scale) })
    }

    /// Plants the change of a size into a recording.
    ///
    /// # Errors
    /// As [`PlantedChange::size`].
    pub(crate) fn plant(self, table: &mut MeasuredTable, joint: Joint, planted: PlantedSize) -> Result<()> {
        let size = planted.value;
        let (column, values): (_, Vec<f64>) = match self {
            Self::Torque(form) => {
                let column = joint.column("tau")?;
                let recorded = table.signal(column)?;
                let motion = joint.motion(table)?;
                let unit = motion.torque(form, planted.scale.unwrap_or_else(|| motion.scale()), &recorded);
                (column, recorded.iter().zip(&unit).map(|(own, unit)| own + size * unit).collect())
            }
            Self::Delay => {
                let (column, rows) = (joint.command()?, (size / joint.step(table)?).round() as usize);
                let values = table.signal(column)?;
                // An earlier command is a later response.
                (column, (0..values.len()).map(|i| values[(i + rows).min(values.len() - 1)]).collect())
            }
            Self::Skew => {
                let clock = joint.column("received.t")?;
                (clock, table.signal(clock)?.iter().map(|value| value * (1.0 + size)).collect())
            }
        };
        table.set(column, &values)
    }
}

/// Size of a planted effect, SI, with the motion to which its form refers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlantedSize {
    pub(crate) value: f64,
    scale: Option<MotionScale>,
}

/// Joint of a rig: the end of the names of its signals, empty for the only one.
#[derive(Clone, Copy)]
pub(crate) struct Joint<'a> {
    pub(crate) rig: &'a Rig,
    pub(crate) end: &'a str,
}

impl<'a> Joint<'a> {
    fn column(self, signal: &str) -> Result<&'a RecordedColumn> {
        let name = format!("{signal}{}", self.end);
        let missing = || GauntletError::Unknown { what: format!("{} has no signal `{name}`", self.rig.id) };
        self.rig.log.get(&name).ok_or_else(missing)
    }

    /// The command or its event.
    fn command(self) -> Result<&'a RecordedColumn> {
        self.rig.log.get("sent.event").map_or_else(|| self.column("sent"), Ok)
    }

    fn time(self, table: &MeasuredTable) -> Result<Vec<f64>> {
        let missing = || GauntletError::Unknown { what: format!("{} has no signal `t`", self.rig.id) };
        table.signal(self.rig.log.get("t").ok_or_else(missing)?)
    }

    fn step(self, table: &MeasuredTable) -> Result<f64> {
        let time = self.time(table)?;
        Ok((time[time.len() - 1] - time[0]) / (time.len() - 1) as f64)
    }

    fn motion(self, table: &MeasuredTable) -> Result<JointMotion> {
        Ok(JointMotion::of(&self.time(table)?, &table.signal(self.column("q")?)?))
    }
}

/// Values low-passed with a Gaussian of a width in samples.
fn smoothed(values: &[f64], width: f64) -> Vec<f64> {
    let reach = (4.0 * width).ceil() as i64;
    let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / width).powi(2)).exp()).collect();
    let last = values.len() as i64 - 1;
    let of = |i: i64| {
        // A symmetric part of the kernel keeps a straight line straight up to the ends.
        let own = reach.min(i).min(last - i);
        let part = (-own..=own).map(|k| (kernel[(k + reach) as usize], values[(i + k) as usize]));
        let (sum, weight) = part.fold((0.0, 0.0), |(sum, weight), (k, value)| (sum + k * value, weight + k));
        sum / weight
    };
    (0..=last).map(of).collect()
}

/// Central differences.
fn derivative(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let of = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        (values[after] - values[before]) / (time[after] - time[before])
    };
    (0..=last).map(of).collect()
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Root mean square about the mean.
fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    root_mean_square(&values.iter().map(|value| value - mean).collect::<Vec<f64>>())
}

fn ends(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(*value), hi.max(*value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of 1 Hz and its derivatives by their closed forms.
    #[test]
    fn motion_of_a_sine_agrees_with_its_derivatives() {
        let time: Vec<f64> = (0..4000).map(|i| f64::from(i) * 1e-3).collect();
        let w = 2.0 * PI;
        let motion = JointMotion::of(&time, &time.iter().map(|t| (w * t).sin()).collect::<Vec<_>>());
        for i in (200..3800).step_by(37) {
            let (sin, cos) = (w * time[i]).sin_cos();
            assert!((motion.rate[i] - w * cos).abs() < 0.005 * w, "{i}");
            assert!((motion.acceleration[i] + w * w * sin).abs() < 0.01 * w * w, "{i}");
        }
    }

    /// Friction of a sine is a rectangle: its mean power over a period is that over the sliding.
    #[test]
    fn planted_friction_changes_its_sign_at_reversals() {
        let time: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let motion = JointMotion::of(&time, &time.iter().map(|t| (PI * t).sin()).collect::<Vec<_>>());
        let friction = motion.friction(1e-4);
        for i in (100..1900).filter(|i| (i - 500) % 1000 > 20 && (i + 500) % 1000 < 980) {
            assert!((friction[i] - motion.rate[i].signum()).abs() < 0.01, "{i}: {}", friction[i]);
        }
    }
}
