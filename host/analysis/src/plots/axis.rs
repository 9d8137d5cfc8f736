//! Axes: linear, logarithmic, and linear around zero but logarithmic far from it.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::number::significant;

/// How values are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Positive values only.
    Log,
    /// Inverse hyperbolic sine: linear within this size, logarithmic beyond, for values of both signs.
    SymLog(f64),
}

/// One axis of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub(crate) label: String,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    pub(crate) scale: Scale,
}

/// Ratio of largest to smallest value beyond which a positive quantity is shown on a logarithmic axis.
const LOG_RATIO: f64 = 10.0;

impl Axis {
    /// A linear axis; an empty range is widened.
    pub fn linear(label: impl Into<String>, lo: f64, hi: f64) -> Self {
        let half = if hi > lo { 0.0 } else { 0.5 * lo.abs().max(1e-12) };
        Self { label: label.into(), lo: lo - half, hi: hi.max(lo) + half, scale: Scale::Linear }
    }

    /// Logarithmic if the quantity is positive and spans more than a decade.
    pub fn fitting(label: impl Into<String>, lo: f64, hi: f64) -> Self {
        let scale = if lo > 0.0 && hi / lo > LOG_RATIO { Scale::Log } else { Scale::Linear };
        Self { scale, ..Self::linear(label, lo, hi) }
    }

    /// Returns the axis with padding at both ends, if it is linear.
    pub fn padded(self, share: f64) -> Self {
        let padding = share * (self.hi - self.lo);
        Self { lo: self.lo - padding, hi: self.hi + padding, ..self }
    }

    /// A linear or a logarithmic axis from end to end.
    pub fn scaled(label: impl Into<String>, lo: f64, hi: f64, logarithmic: bool) -> Self {
        let scale = if logarithmic { Scale::Log } else { Scale::Linear };
        Self { scale, ..Self::linear(label, lo, hi) }
    }

    /// The value in the middle between two, as it is drawn.
    pub(crate) fn middle(&self, (lo, hi): (f64, f64)) -> f64 {
        if self.scale == Scale::Log { (lo * hi).sqrt() } else { 0.5 * (lo + hi) }
    }

    pub(crate) fn contains(&self, value: f64) -> bool {
        (self.lo..=self.hi).contains(&value)
    }

    fn transform(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.max(f64::MIN_POSITIVE).log10(),
            Scale::SymLog(size) => (value / size).asinh(),
        }
    }

    /// Round values inside the range, about so many.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let ticks = match self.scale {
            Scale::Linear => linear_ticks(self.lo, self.hi, most),
            Scale::Log => log_ticks(self.lo, self.hi, most),
            Scale::SymLog(size) => symlog_ticks(size, self.lo, self.hi, most),
        };
        ticks.into_iter().filter(|tick| self.contains(*tick)).collect()
    }
}

/// Steps of 1, 2 or 5 times a power of ten.
pub(crate) fn linear_ticks(lo: f64, hi: f64, most: usize) -> Vec<f64> {
    let raw = (hi - lo) / most.max(2) as f64;
    let power = 10.0f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= raw);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((lo / step - 1e-9).ceil() as i64, (hi / step + 1e-9).floor() as i64);
    (first..=last).map(|number| number as f64 * step).collect()
}

/// Returns 1, 2, 5 in every decade if they fit, otherwise the decades.
fn log_ticks(lo: f64, hi: f64, most: usize) -> Vec<f64> {
    let decades = (lo.log10().floor() as i32)..=(hi.log10().ceil() as i32);
    let with = |factors: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|decade| factors.iter().map(move |factor| factor * 10.0f64.powi(decade)));
        all.filter(|tick| (lo..=hi).contains(tick)).collect()
    };
    let choices = [with(&[1.0, 2.0, 5.0]), with(&[1.0, 3.0]), with(&[1.0])];
    let [finest, middle, coarse] = choices;
    [finest, middle].into_iter().find(|ticks| ticks.len() <= most).unwrap_or_else(|| thinned(coarse, most))
}

/// Zero and powers of ten on both sides.
fn symlog_ticks(size: f64, lo: f64, hi: f64, most: usize) -> Vec<f64> {
    let powers = |end: f64| -> Vec<f64> {
        let first = size.log10().round() as i32;
        let last = end.max(size).log10().floor() as i32;
        thinned((first..=last).map(|decade| 10.0f64.powi(decade)).collect(), most / 2)
    };
    let below = powers(-lo).into_iter().rev().map(|tick| -tick);
    below.chain([0.0]).chain(powers(hi)).collect()
}

fn thinned(ticks: Vec<f64>, most: usize) -> Vec<f64> {
    let stride = ticks.len().div_ceil(most.max(1)).max(1);
    ticks.into_iter().step_by(stride).collect()
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (start, end): (i32, i32)) -> i32 {
        let (lo, hi) = (self.transform(self.lo), self.transform(self.hi));
        let share = ((self.transform(*value) - lo) / (hi - lo)).clamp(0.0, 1.0);
        start + (share * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.bold_points())
    }

    fn range(&self) -> Range<f64> {
        self.lo..self.hi
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        // Long numbers would not fit beside an axis.
        if value.abs() >= 1e5 { format!("{value:e}") } else { significant(*value, 6) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(Axis::linear("", -0.3, 1.1).ticks(4), [0.0, 0.5, 1.0]);
        assert_eq!(Axis::linear("", 0.004, 0.04).ticks(4), [0.01, 0.02, 0.03, 0.04]);
        assert_eq!(Axis::fitting("", 5.0e3, 1.1e5).ticks(5), [5.0e3, 1.0e4, 2.0e4, 5.0e4, 1.0e5]);
        assert_eq!(Axis::fitting("", 1.0e-9, 1.0).ticks(5), [1.0e-9, 1.0e-7, 1.0e-5, 1.0e-3, 1.0e-1]);
        let axis = Axis { scale: Scale::SymLog(1.0), ..Axis::linear("", -15.0, 2.0e3) };
        assert_eq!(axis.ticks(8), [-10.0, -1.0, 0.0, 1.0, 10.0, 100.0, 1000.0]);
    }

    #[test]
    fn an_empty_range_is_widened() {
        let axis = Axis::linear("", 3.0, 3.0);
        assert!(axis.lo < 3.0 && axis.hi > 3.0);
        assert_eq!(axis.map(&3.0, (0, 100)), 50);
    }
}
