//! Figures of a block: residual over time, spectrum, scatter against measured signals, missing torque.

use crate::Result;
use crate::data::smooth::band_powers;
use crate::inference::fit::Fitted;
use crate::inference::latent::Latent;
use crate::inference::unmodelled::Missing;
use crate::model::block::MeasuredBlock;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict};
use crate::verdict::judged::Judged;
use nalgebra::DMatrix;
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, RGBColor, Size, colour};

/// Points of a line, and of a scatter.
const MOST_POINTS: usize = 400;
const MOST_DOTS: usize = 300;
/// Bands of a spectrum.
const BANDS: usize = 60;
/// Smallest amplitude on the axis of a spectrum, as a share of the largest.
const DYNAMIC_RANGE: f64 = 1e-4;

/// A residual before and after, averaged over the repeats of one held-out experiment.
struct Compared {
    before: DMatrix<f64>,
    /// Only where something was found.
    after: Option<DMatrix<f64>>,
    step: f64,
}

impl Compared {
    /// Both residuals of a channel with their colours; what is drawn last lies on top.
    fn rows(&self, row: usize) -> Vec<(Vec<f64>, RGBColor)> {
        let of = |matrix: &DMatrix<f64>| matrix.row(row).iter().copied().collect();
        let after = self.after.as_ref().map(|after| (of(after), colour::SPACE));
        std::iter::once((of(&self.before), colour::FACILITY)).chain(after).collect()
    }

    fn range(&self, row: usize) -> (f64, f64) {
        ends(self.rows(row).into_iter().flat_map(|(values, _)| values))
    }
}

/// Draws a block with its captions. A block without a finding has one figure: its residual over time.
///
/// # Errors
/// A figure that cannot be drawn.
pub(super) fn drawings(answer: &BlockAnswer, judged: &Judged) -> Result<Vec<(String, String)>> {
    let Judged { block, judgement, outside, .. } = judged;
    let part = block.part(answer.held_out);
    let first = |fitted: &Fitted| part.means(&fitted.values(&block.base)).into_iter().next();
    let after = judged.found(answer).and_then(|candidate| first(&candidate.fitted));
    let Some(before) = first(&judgement.clamped) else {
        return Ok(Vec::new());
    };
    let Some(trial) = block.trials.iter().find(|trial| trial.held_out == answer.held_out) else {
        return Ok(Vec::new());
    };
    let step = block.judged_step(trial);
    let compared = Compared { before, after, step };
    let mut all = Vec::new();
    let has_finding = answer.answer >= DiagnosisVerdict::NoPracticalEffect;
    let shown = if has_finding { block.channels.len() } else { 1 };
    for (row, channel) in block.channels.iter().enumerate().take(shown) {
        let name = format!("{}, {}", answer.block, channel.name);
        all.push((in_time(&name, channel.unit, row, &compared)?, format!("{}: residual over time", channel.name)));
        if !has_finding {
            break;
        }
        all.push((spectrum(&name, row, &compared)?, format!("{}: residual spectrum", channel.name)));
        for (signal, unit, values) in against(block, trial, &compared) {
            let drawing = scatter(&name, channel.unit, row, &compared, (&signal, unit, &values))?;
            all.push((drawing, format!("{}: residual against the {signal}", channel.name)));
        }
    }
    let slides = block.channels.iter().any(|channel| channel.unit == "m");
    // The first recording stands for all; the table of missing torques has every one.
    if let Some(first) = outside.as_ref().and_then(|outside| outside.missing.first()) {
        all.extend(missing(first, slides)?);
    }
    Ok(all)
}

/// The torque that the model lacks, over time and against angle and rate; two standard deviations to either side.
fn missing(missing: &Missing, slides: bool) -> Result<Vec<(String, String)>> {
    let Latent { value, sd } = &missing.torque;
    let name = format!("{}, missing torque", missing.experiment);
    let bounds = value.iter().zip(sd).flat_map(|(value, sd)| [value - 2.0 * sd, value + 2.0 * sd]);
    let (lo, hi) = ends(bounds);
    let (unit, rate, torque) = if slides { ("m", "m/s", "N") } else { ("rad", "rad/s", "N m") };
    let y = || Axis::linear(format!("missing torque [{torque}]"), lo, hi).padded(0.05);
    let samples = || missing.time.iter().zip(value.iter().zip(sd));
    let line = |width: f64| decimated(samples().map(|(t, (v, sd))| (*t, v + width * sd)), MOST_POINTS);
    let x = Axis::linear("time [s]", 0.0, missing.time.last().copied().unwrap_or(1.0));
    let over_time = Figure::new(&name, Size::Half, x, y())
        .line(line(-2.0), colour::FACILITY, 0.6)
        .line(line(2.0), colour::FACILITY, 0.6)
        .line(line(0.0), colour::SPACE, 1.2);
    let against = |place: usize, signal: &str, unit: &str| -> Result<(String, String)> {
        let at = || missing.inputs.iter().map(|inputs| inputs[place]);
        let (lo, hi) = ends(at());
        let x = Axis::linear(format!("measured {signal} [{unit}]"), lo, hi).padded(0.03);
        let points = decimated(at().zip(value.iter().copied()), MOST_DOTS);
        let figure = Figure::new(format!("{name} against {signal}"), Size::Half, x, y());
        Ok((
            figure.points(points, colour::SPACE, 1.8, 0.8).svg()?,
            format!("{}: missing torque against the {signal}", missing.experiment),
        ))
    };
    let over_time = (over_time.svg()?, format!("{}: missing torque, with two standard deviations", missing.experiment));
    Ok(vec![over_time, against(0, "angle", unit)?, against(1, "rate", rate)?])
}

/// Returns at most so many points, at equal distances along the series.
fn decimated(points: impl ExactSizeIterator<Item = (f64, f64)>, most: usize) -> Vec<(f64, f64)> {
    let every = points.len().div_ceil(most).max(1);
    points.step_by(every).collect()
}

/// Returns the signals that a residual is plotted against: position, speed and torque or force, at the decimated
/// samples.
fn against(
    block: &MeasuredBlock,
    trial: &crate::model::block::Trial,
    compared: &Compared,
) -> Vec<(String, &'static str, Vec<f64>)> {
    let every = trial.recorded.stride * block.decimator.every();
    let first = trial.recorded.stride * block.decimator.margin();
    let sampled = |list: &[f64], width: usize, place: usize| -> Vec<f64> {
        (0..compared.before.ncols()).filter_map(|i| list.get((first + i * every) * width + place).copied()).collect()
    };
    let (inputs, late) = (block.section.inputs(), block.section.late_inputs());
    let mut all = Vec::new();
    for (fields, list) in [(&inputs, &trial.recorded.inputs), (&late, &trial.recorded.late)] {
        for (place, field) in fields.iter().enumerate() {
            if ["angle", "rate", "torque"].contains(&field.name.as_str()) {
                let name = if fields.len() == late.len() { "commanded " } else { "measured " };
                all.push((name.to_owned() + &field.name, field.unit, sampled(list, fields.len(), place)));
            }
        }
    }
    all
}

fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)))
}

fn in_time(name: &str, unit: &str, row: usize, compared: &Compared) -> Result<String> {
    let count = compared.before.ncols();
    let (lo, hi) = compared.range(row);
    let x = Axis::linear("time [s]", 0.0, count as f64 * compared.step);
    let mut figure = Figure::new(name, Size::Half, x, Axis::linear(format!("residual [{unit}]"), lo, hi).padded(0.05));
    for (values, colour) in compared.rows(row) {
        let points = (0..count).map(|i| (i as f64 * compared.step, values[i]));
        figure = figure.line(decimated(points, MOST_POINTS), colour, 1.1);
    }
    Ok(figure.svg()?)
}

/// Spectrum of a channel's residual. Amplitudes below a share of the largest are drawn at the lower end of the axis.
fn spectrum(name: &str, row: usize, compared: &Compared) -> Result<String> {
    let width = 0.5 / compared.step / BANDS as f64;
    let line = |(values, colour): (Vec<f64>, RGBColor)| {
        let powers = band_powers(&values, BANDS).into_iter().enumerate();
        let points = powers.map(|(band, power)| ((band as f64 + 0.5) * width, power.sqrt()));
        (points.collect::<Vec<_>>(), colour)
    };
    let lines: Vec<_> = compared.rows(row).into_iter().map(line).collect();
    let (lo, hi) = ends(lines.iter().flat_map(|(points, _)| points).map(|point| point.1));
    let hi = hi.max(f64::MIN_POSITIVE / DYNAMIC_RANGE);
    let lo = lo.max(DYNAMIC_RANGE * hi);
    let x = Axis::linear("frequency [Hz]", 0.0, BANDS as f64 * width);
    let mut figure = Figure::new(format!("{name}, spectrum"), Size::Half, x, Axis::scaled("amplitude", lo, hi, true));
    for (points, colour) in lines {
        let visible = points.into_iter().map(|(frequency, amplitude)| (frequency, amplitude.max(lo))).collect();
        figure = figure.line(visible, colour, 1.1);
    }
    Ok(figure.svg()?)
}

fn scatter(
    name: &str,
    unit: &str,
    row: usize,
    compared: &Compared,
    (signal, signal_unit, values): (&str, &str, &[f64]),
) -> Result<String> {
    let (lo, hi) = ends(values.iter().copied());
    let x = Axis::linear(format!("{signal} [{signal_unit}]"), lo, hi).padded(0.03);
    let (lo, hi) = compared.range(row);
    let y = Axis::linear(format!("residual [{unit}]"), lo, hi).padded(0.05);
    let mut figure = Figure::new(format!("{name} against {signal}"), Size::Half, x, y);
    for (residual, colour) in compared.rows(row) {
        let pairs = values.iter().copied().zip(residual);
        figure = figure.points(decimated(pairs, MOST_DOTS), colour, 1.5, 0.6);
    }
    Ok(figure.svg()?)
}
