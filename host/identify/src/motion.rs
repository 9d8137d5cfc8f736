//! Preprocessed recording: smoothed angles with their derivatives, and torques through the same filter.

use crate::filter::{Smoother, period_mean};
use crate::log::Recording;
use crate::{DiagnosisError, Result};
use softdock_kernels::manipulator::bristle;

/// Options of the preprocessing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation {
    /// Cut-off of the low-pass, or highest frequency of the Fourier series \[Hz\].
    pub cutoff: f64,
    /// Period of a periodic motion \[s\]; `None` if it is not periodic.
    pub period: Option<f64>,
}

/// Preprocessed motion; one column per joint, all of equal length.
#[derive(Clone, Debug)]
pub struct RecordedMotion {
    /// Name of the recording.
    pub name: String,
    /// Sampling period \[s\].
    pub step: f64,
    /// Smoother that was applied.
    pub smoother: Smoother,
    /// Angles \[rad\].
    pub angle: Vec<Vec<f64>>,
    /// Rates \[rad/s\].
    pub rate: Vec<Vec<f64>>,
    /// Accelerations \[rad/s^2\].
    pub acceleration: Vec<Vec<f64>>,
    /// Torques at the joints' side \[N m\].
    pub torque: Vec<Vec<f64>>,
}

impl RecordedMotion {
    /// Smooths a recording; a periodic recording is first averaged over its whole periods.
    pub fn new(recording: &Recording, preparation: &Preparation) -> Result<Self> {
        let step = recording.step;
        if preparation.cutoff >= 0.4 / step {
            let what = format!(
                "{}: a cut-off of {} Hz needs more than the recording's {:.0} samples per second",
                recording.name,
                preparation.cutoff,
                1.0 / step
            );
            return Err(DiagnosisError::unfit(what, "lower --cutoff, or record at a higher rate"));
        }
        let (smoother, period) = match preparation.period {
            None => (Smoother::LowPass { cutoff: preparation.cutoff }, None),
            Some(period) => {
                let samples = whole_period(recording, period)?;
                (Smoother::Fourier { harmonics: (preparation.cutoff * period).floor() as usize }, Some(samples))
            }
        };
        let ready = |series: &Vec<f64>| period.map_or_else(|| series.clone(), |period| period_mean(series, period));
        let torque = recording.torque.iter().map(|series| smoother.smooth(&ready(series), step)).collect();
        let mut motion = Self {
            name: recording.name.clone(),
            step,
            smoother,
            angle: Vec::new(),
            rate: Vec::new(),
            acceleration: Vec::new(),
            torque,
        };
        for series in &recording.angle {
            let [angle, rate, acceleration] = smoother.derivatives(&ready(series), step);
            motion.angle.push(angle);
            motion.rate.push(rate);
            motion.acceleration.push(acceleration);
        }
        Ok(motion)
    }

    /// Returns the number of samples.
    pub fn rows(&self) -> usize {
        self.angle.first().map_or(0, Vec::len)
    }

    /// Returns the presliding states of a joint for a travel \[rad\]; a periodic motion starts with its final state.
    pub fn slip(&self, joint: usize, travel: f64) -> Vec<f64> {
        let angle = &self.angle[joint];
        let pass = |start: f64, before: f64| {
            let mut at = (start, before);
            let states = angle.iter().map(|now| {
                at = (bristle(at.0, now - at.1, travel), *now);
                at.0
            });
            states.collect::<Vec<f64>>()
        };
        let first = pass(0.0, angle[0]);
        match self.smoother {
            Smoother::LowPass { .. } => first,
            Smoother::Fourier { .. } => pass(first[first.len() - 1], angle[angle.len() - 1]),
        }
    }

    /// Applies the filter of the torques to a regressor column.
    pub fn smooth(&self, column: &[f64]) -> Vec<f64> {
        self.smoother.smooth(column, self.step)
    }
}

/// Samples of a period; it must be a whole number of them and fit into the recording.
fn whole_period(recording: &Recording, period: f64) -> Result<usize> {
    let samples = period / recording.step;
    let whole = samples.round();
    if (samples - whole).abs() > 0.05 || whole < 10.0 {
        let what = format!(
            "{}: a period of {period} s is not a whole number of steps of {:.6} s",
            recording.name, recording.step
        );
        return Err(DiagnosisError::unfit(what, "state the period of the motion exactly, or omit --period"));
    }
    if whole as usize > recording.rows() {
        let have = recording.rows() as f64 * recording.step;
        let what = format!("{}: {have:.3} s are shorter than one period of {period} s", recording.name);
        return Err(DiagnosisError::unfit(what, "record at least one whole period, better five, or omit --period"));
    }
    Ok(whole as usize)
}
