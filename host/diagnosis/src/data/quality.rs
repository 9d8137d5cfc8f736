//! Data quality of recordings: rate, jitter, gaps and missing numbers of each signal, quantisation, saturation, constant
//! signals.

use crate::data::clock::{EvenRecording, SignalTable};
use serde::Serialize;
use softdock_analysis::number::significant;
use std::collections::BTreeMap;

/// Samples of a value that occur once or more for a signal to be quantised: its numbers are few.
const SAMPLES_PER_VALUE: usize = 4;
/// Fewest different values of a quantised signal.
const FEWEST_VALUES: usize = 3;
/// Fewest samples of a stay at an extreme value, and share of all samples in such stays, that show saturation.
const STAY: usize = 4;
const STAYS: f64 = 0.005;
/// Quantisation steps by which a signal enters a saturated stay at least: a smooth peak is entered by one.
const ENTRY: f64 = 3.0;
/// Jitter that the text states, as a share of a step.
const LEAST_JITTER: f64 = 1e-3;
/// Names of recordings and signals that a line of the text lists.
const LISTED: usize = 2;

/// Quality of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingQuality {
    /// The recording's name.
    pub recording: String,
    /// Number of rows.
    pub rows: usize,
    /// Rate to which the signals are resampled \[Hz\].
    pub rate_hz: f64,
    /// Number of segments between gaps.
    pub segments: usize,
    /// Its signals.
    pub signals: BTreeMap<String, SignalQuality>,
}

/// Quality of a signal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SignalQuality {
    /// Rate as recorded \[Hz\].
    pub rate_hz: f64,
    /// Standard deviation of the clock's steps \[s\].
    pub jitter_s: f64,
    /// Number of gaps.
    pub gaps: usize,
    /// Number of rows without a number, isolated outliers among them.
    pub missing: usize,
    /// Quantisation step, SI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantisation: Option<f64>,
    /// Saturation: extreme value, SI, at which the signal stays while others move.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturated: Option<Saturation>,
    /// Whether all numbers are equal.
    pub constant: bool,
}

/// Saturation of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Saturation {
    /// Value at which it stays, SI.
    pub value: f64,
    /// Number of samples in its stays.
    pub samples: usize,
}

impl RecordingQuality {
    /// Determines the quality of a recording from its signals as recorded and its clocks.
    pub(crate) fn of(recording: &str, rows: usize, signals: &SignalTable, even: &EvenRecording) -> Self {
        let of = |(name, values): (&String, &Vec<f64>)| {
            let clock = &even.clocks[name];
            let numbers: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
            let quality = SignalQuality {
                rate_hz: clock.step.recip(),
                jitter_s: clock.jitter,
                gaps: clock.spans.len().saturating_sub(1),
                missing: clock.missing,
                quantisation: quantisation(&numbers),
                saturated: saturation(&numbers),
                constant: numbers.iter().all(|value| *value == numbers[0]),
            };
            (name.clone(), quality)
        };
        Self {
            recording: recording.to_owned(),
            rows,
            rate_hz: even.step.recip(),
            segments: even.segments.len(),
            signals: signals.iter().map(of).collect(),
        }
    }

    /// The quality in words, without the recording's name.
    fn words(&self) -> String {
        let jitter = self.signals.values().map(|own| own.jitter_s * own.rate_hz).fold(0.0, f64::max);
        let jitter = if jitter < LEAST_JITTER {
            "no jitter".to_owned()
        } else {
            format!("jitter {} % of a step", significant(100.0 * jitter, 2))
        };
        let mut words = vec![format!("{} Hz, {jitter}", significant(self.rate_hz, 4))];
        words.push(match self.segments {
            1 => "no gaps".to_owned(),
            many => format!("{many} segments between gaps"),
        });
        let of = |what: &dyn Fn(&SignalQuality) -> Option<String>| {
            let all = self.signals.iter().filter_map(|(name, own)| Some(format!("`{name}` {}", what(own)?)));
            let all: Vec<String> = all.collect();
            let more = if all.len() > LISTED { format!(" and {} more", all.len() - LISTED) } else { String::new() };
            (!all.is_empty()).then(|| all[..all.len().min(LISTED)].join(", ") + &more)
        };
        let in_steps = |own: &SignalQuality| Some(format!("in steps of {}", significant(own.quantisation?, 3)));
        let is_cut = |own: &SignalQuality| {
            let Saturation { value, samples } = own.saturated?;
            Some(format!("saturated at {} in {samples} samples", significant(value, 4)))
        };
        let is_constant = |own: &SignalQuality| own.constant.then(|| "constant".to_owned());
        words.extend([of(&in_steps), of(&is_cut), of(&is_constant)].into_iter().flatten());
        words.join("; ")
    }
}

/// Returns the report on recordings, a line for all with the same quality; SI units.
pub fn lines(all: &[RecordingQuality]) -> Vec<String> {
    let mut lines: Vec<(String, Vec<&str>)> = Vec::new();
    for own in all {
        let words = own.words();
        match lines.iter_mut().find(|line| line.0 == words) {
            Some(line) => line.1.push(&own.recording),
            None => lines.push((words, vec![&own.recording])),
        }
    }
    let line = |(words, names): (String, Vec<&str>)| {
        let more = if names.len() > LISTED { format!(" and {} more", names.len() - LISTED) } else { String::new() };
        format!("{}{more}: {words}", names[..names.len().min(LISTED)].join(", "))
    };
    lines.into_iter().map(line).collect()
}

/// Returns the step of a signal whose numbers are few; `None` if it has no steps.
fn quantisation(numbers: &[f64]) -> Option<f64> {
    let mut values = numbers.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() < FEWEST_VALUES || values.len() * SAMPLES_PER_VALUE > numbers.len() {
        return None;
    }
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    Some(steps[steps.len() / 2])
}

/// Returns the saturation of a signal at its greatest or least value, which it enters by a jump of several of its usual
/// least changes and holds for several samples.
fn saturation(numbers: &[f64]) -> Option<Saturation> {
    let extremes = [numbers.iter().copied().fold(0.0, f64::max), numbers.iter().copied().fold(0.0, f64::min)];
    let mut changes: Vec<f64> = numbers.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|x| *x > 0.0).collect();
    changes.sort_by(f64::total_cmp);
    let least = *changes.get(changes.len() / 20)?;
    let at = |value: f64| {
        let mut samples = 0;
        let mut from = 0;
        while from < numbers.len() {
            let count = numbers[from..].iter().take_while(|number| **number == value).count();
            // The last whole change before the limit.
            let entered = from > 1 && (numbers[from - 1] - numbers[from - 2]).abs() > ENTRY * least;
            samples += if count >= STAY && entered { count } else { 0 };
            from += count.max(1);
        }
        Saturation { value, samples }
    };
    let found = extremes.into_iter().filter(|value| *value != 0.0).map(at);
    found.max_by_key(|own| own.samples).filter(|own| own.samples as f64 > STAYS * numbers.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(samples: usize, change: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..samples).map(|i| change(10.0 * (0.02 * i as f64).sin())).collect()
    }

    #[test]
    fn steps_are_found_in_quantised_signals_alone() {
        assert_eq!(quantisation(&sine(3000, |x| x)), None);
        let step = quantisation(&sine(3000, |x| (x / 0.25).round() * 0.25)).expect("steps");
        assert!((step - 0.25).abs() < 1e-12);
        assert_eq!(quantisation(&[1.0; 500]), None, "a constant");
    }

    #[test]
    fn clipped_peaks_are_saturation_and_smooth_ones_are_not() {
        let cut = saturation(&sine(3000, |x| x.clamp(-12.0, 8.0))).expect("a limit");
        assert!(cut.value == 8.0 && cut.samples > 500, "{cut:?}");
        assert_eq!(saturation(&sine(3000, |x| x)), None);
        assert_eq!(saturation(&sine(3000, |x| (x / 0.25).round() * 0.25)), None, "quantised");
        assert_eq!(saturation(&sine(3000, |x| x.max(0.0))), None, "a contact that is open");
        assert_eq!(saturation(&[3.0; 500]), None, "a constant");
    }
}
