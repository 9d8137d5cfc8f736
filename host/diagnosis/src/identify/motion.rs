//! A recording made ready: smooth angles with their derivatives, torques passed through the same filter.

use crate::identify::filter::{Smoother, period_mean};
use crate::identify::log::Recording;
use crate::{Error, Result};
use softdock_kernels::manipulator::bristle;

/// How recordings are made ready.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation {
    /// Cut-off of the low-pass, or highest frequency of the Fourier series \[Hz\].
    pub cutoff: f64,
    /// Period of a periodic motion \[s\]; `None` if it is not periodic.
    pub period: Option<f64>,
}

/// One motion; columns by joint, all of the same length.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Name of the recording.
    pub name: String,
    /// Sampling period \[s\].
    pub step: f64,
    /// What smoothed it.
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

impl Motion {
    /// Smooths a recording; a periodic one is averaged over its whole periods first.
    pub fn new(recording: &Recording, preparation: &Preparation) -> Result<Self> {
        let step = recording.step;
        if preparation.cutoff >= 0.4 / step {
            let what = format!(
                "{}: a cut-off of {} Hz needs more than the recording's {:.0} samples per second",
                recording.name,
                preparation.cutoff,
                1.0 / step
            );
            return Err(Error::unfit(what, "lower --cutoff, or record faster"));
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

    /// Number of samples.
    pub fn rows(&self) -> usize {
        self.angle.first().map_or(0, Vec::len)
    }

    /// Presliding states of a joint for a travel \[rad\]; the first passage starts relaxed, a periodic one as it ends.
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

    /// A column of a model passed through the filter of the torques.
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
        return Err(Error::unfit(what, "state the period of the motion exactly, or leave out --period"));
    }
    if whole as usize > recording.rows() {
        let have = recording.rows() as f64 * recording.step;
        let what = format!("{}: {have:.3} s are shorter than one period of {period} s", recording.name);
        return Err(Error::unfit(what, "record at least one whole period, better five, or leave out --period"));
    }
    Ok(whole as usize)
}
