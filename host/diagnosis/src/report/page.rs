//! HTML page of a diagnosis: one self-contained file that starts with the answer.

use crate::Result;
use crate::data::quality;
use crate::data::smooth::band_powers;
use crate::diagnosis::Diagnosis;
use crate::inference::fit::Fitted;
use crate::inference::judge::NoiseFrom;
use crate::inference::latent::Latent;
use crate::inference::unmodelled::Missing;
use crate::model::block::MeasuredBlock;
use crate::model::isolability;
use crate::report::template::render;
use crate::report::text;
use crate::report::text::{behaviour, estimated, headline, ruled_out_by, torque_error, verdict};
use crate::verdict::answer::{BlockAnswer, EffectFound};
use crate::verdict::free_run::FittedEffect;
use crate::verdict::judged::Judged;
use nalgebra::DMatrix;
use serde::Serialize;
use softdock_analysis::STYLE;
use softdock_analysis::number::significant;
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, RGBColor, Size, colour};

/// Points of a line on the page.
const MOST_POINTS: usize = 700;
/// Bands of a spectrum.
const BANDS: usize = 60;

#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    version: &'static str,
    title: String,
    headline: String,
    reasons: &'a [String],
    data_quality: Vec<String>,
    findings: Vec<(String, String)>,
    isolability: String,
    experiment: Option<String>,
    proposed: Option<String>,
    blocks: Vec<BlockRows>,
    numbers: Vec<(String, String)>,
    command: String,
}

#[derive(Serialize)]
struct BlockRows {
    name: String,
    answer: &'static str,
    residual: String,
    torque_error: String,
    free_run: String,
    nearest: Vec<EffectRow>,
    inadequate: Vec<String>,
    possible: Vec<EffectRow>,
    effects: Vec<EffectRow>,
    strained: Vec<(String, String)>,
    ruled_out: Vec<[String; 3]>,
    not_visible: Vec<[String; 3]>,
    alike: Vec<String>,
    partner_missing: String,
    behaviour: String,
    drawings: Vec<(String, String)>,
}

#[derive(Serialize)]
struct EffectRow {
    id: String,
    name: String,
    p: String,
    parameters: Vec<(String, String)>,
}

impl EffectRow {
    fn of(effect: &EffectFound) -> Self {
        Self {
            id: effect.id.to_owned(),
            name: effect.name.to_owned(),
            p: significant(effect.p, 3),
            parameters: effect.parameters.iter().map(|(name, e)| (name.clone(), estimated(e))).collect(),
        }
    }
}

/// Renders the page as HTML; `command` is the command that reproduces it.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn page(title: &str, diagnosis: &Diagnosis, judged: &[Judged], command: &str) -> Result<String> {
    // Answers that need no fit of a block have no judgement.
    let rows = |answer: &BlockAnswer| block_rows(answer, judged.iter().find(|own| own.block.name == answer.block));
    let mut blocks: Vec<&BlockAnswer> = diagnosis.blocks.iter().collect();
    // The most severe verdict first.
    blocks.sort_by_key(|answer| std::cmp::Reverse(answer.answer));
    let page = Page {
        style: STYLE,
        version: env!("CARGO_PKG_VERSION"),
        title: title.to_owned(),
        headline: headline(diagnosis),
        reasons: &diagnosis.reasons,
        data_quality: quality::lines(&diagnosis.data_quality),
        findings: diagnosis.findings.iter().map(|f| (f.recording.clone(), f.what.clone())).collect(),
        isolability: isolability::text(&diagnosis.isolability),
        experiment: diagnosis.experiment.clone(),
        proposed: diagnosis.proposed.as_ref().map(text::proposed),
        blocks: blocks.into_iter().map(rows).collect::<Result<_>>()?,
        numbers: numbers(diagnosis, judged),
        command: command.to_owned(),
    };
    render("diagnosis.html", include_str!("page/diagnosis.html"), &page)
}

/// How the noise was found and how exact the simulation is, block by block.
fn numbers(diagnosis: &Diagnosis, judged: &[Judged]) -> Vec<(String, String)> {
    let of = |(judged, error): (&Judged, &f64)| {
        let judgement = &judged.judgement;
        let noise = match judgement.noise_from {
            NoiseFrom::Repeats => "repeats",
            NoiseFrom::Quiet => "contact-free stretches",
            NoiseFrom::Richest => "the residual of the richest hypothesis",
        };
        let text = format!(
            "{} whitened samples; noise from {noise}, autoregression of order {}; halving the step changes the residual by {} \
             of the noise power; detection threshold: log-odds {}",
            judgement.samples,
            judgement.noise.order(),
            significant(*error, 2),
            significant(judgement.threshold, 3)
        );
        (judgement.block.to_owned(), text)
    };
    judged.iter().zip(&diagnosis.numerical_error).map(of).collect()
}

fn block_rows(answer: &BlockAnswer, judged: Option<&Judged>) -> Result<BlockRows> {
    let residual = |value: Option<f64>| value.map_or(String::new(), |value| significant(value, 3));
    Ok(BlockRows {
        name: answer.block.to_owned(),
        answer: verdict(answer.answer),
        residual: text::residual(answer),
        torque_error: answer.torque_error.as_ref().map_or(String::new(), torque_error),
        free_run: answer.free_run.as_ref().map_or(String::new(), text::free_run),
        nearest: nearest(answer),
        inadequate: answer.inadequate.clone(),
        possible: answer.possible.iter().map(EffectRow::of).collect(),
        effects: answer.effects.iter().map(EffectRow::of).collect(),
        strained: answer.nuisances_beyond_prior.iter().map(|(name, z)| (name.clone(), significant(*z, 2))).collect(),
        ruled_out: answer
            .ruled_out
            .iter()
            .map(|out| [out.id.to_owned(), ruled_out_by(out), residual(out.residual)])
            .collect(),
        not_visible: answer
            .not_visible
            .iter()
            .map(|hidden| [hidden.id.to_owned(), hidden.name.to_owned(), significant(hidden.log_odds, 2)])
            .collect(),
        alike: answer.confounded.iter().map(|[a, b]| format!("{a} and {b}")).collect(),
        partner_missing: answer.partner_missing.join(", "),
        behaviour: answer.form.as_ref().map_or(String::new(), behaviour),
        drawings: judged.map_or(Ok(Vec::new()), |judged| drawings(answer, judged))?,
    })
}

/// What a model of free runs has after, where that was not named.
fn nearest(answer: &BlockAnswer) -> Vec<EffectRow> {
    let all = answer.free_run.iter().filter(|_| answer.effects.is_empty()).flat_map(|run| &run.with);
    let row = |own: &FittedEffect| EffectRow {
        id: own.id.to_owned(),
        name: own.name.to_owned(),
        p: String::new(),
        parameters: own.parameters.iter().map(|(name, e)| (name.clone(), estimated(e))).collect(),
    };
    all.map(row).collect()
}

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

fn drawings(answer: &BlockAnswer, judged: &Judged) -> Result<Vec<(String, String)>> {
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
    for (row, channel) in block.channels.iter().enumerate() {
        let name = format!("{}, {}", answer.block, channel.name);
        all.push((in_time(&name, channel.unit, row, &compared)?, format!("{}: residual over time", channel.name)));
        all.push((spectrum(&name, row, &compared)?, format!("{}: residual spectrum", channel.name)));
        for (signal, unit, values) in against(block, trial, &compared) {
            let drawing = scatter(&name, channel.unit, row, &compared, (&signal, unit, &values))?;
            all.push((drawing, format!("{}: residual against the {signal}", channel.name)));
        }
    }
    let slides = block.channels.iter().any(|channel| channel.unit == "m");
    all.extend(
        outside
            .iter()
            .flat_map(|outside| &outside.missing)
            .map(|m| missing(m, slides))
            .collect::<Result<Vec<_>>>()?
            .concat(),
    );
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
    let line =
        |width: f64| missing.time.iter().zip(value.iter().zip(sd)).map(|(t, (v, sd))| (*t, v + width * sd)).collect();
    let x = Axis::linear("time [s]", 0.0, missing.time.last().copied().unwrap_or(1.0));
    let over_time = Figure::new(&name, Size::Half, x, y())
        .line(line(-2.0), colour::FACILITY, 0.6)
        .line(line(2.0), colour::FACILITY, 0.6)
        .line(line(0.0), colour::SPACE, 1.2);
    let against = |place: usize, signal: &str, unit: &str| -> Result<(String, String)> {
        let at = || missing.inputs.iter().map(|inputs| inputs[place]);
        let (lo, hi) = ends(at());
        let x = Axis::linear(format!("measured {signal} [{unit}]"), lo, hi).padded(0.03);
        let points = at().zip(value.iter().copied()).collect();
        let figure = Figure::new(format!("{name} against {signal}"), Size::Half, x, y());
        Ok((
            figure.points(points, colour::SPACE, 1.8, 0.8).svg()?,
            format!("{}: missing torque against the {signal}", missing.experiment),
        ))
    };
    let over_time = (over_time.svg()?, format!("{}: missing torque, with two standard deviations", missing.experiment));
    Ok(vec![over_time, against(0, "angle", unit)?, against(1, "rate", rate)?])
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
        let points = (0..count).step_by(count.div_ceil(MOST_POINTS).max(1));
        figure = figure.line(points.map(|i| (i as f64 * compared.step, values[i])).collect(), colour, 1.1);
    }
    Ok(figure.svg()?)
}

fn spectrum(name: &str, row: usize, compared: &Compared) -> Result<String> {
    let width = 0.5 / compared.step / BANDS as f64;
    let line = |(values, colour): (Vec<f64>, RGBColor)| {
        let powers = band_powers(&values, BANDS).into_iter().enumerate();
        let points = powers.map(|(band, power)| ((band as f64 + 0.5) * width, power.max(1e-300).sqrt()));
        (points.collect::<Vec<_>>(), colour)
    };
    let lines: Vec<_> = compared.rows(row).into_iter().map(line).collect();
    let (lo, hi) = ends(lines.iter().flat_map(|(points, _)| points).map(|point| point.1));
    let x = Axis::linear("frequency [Hz]", 0.0, BANDS as f64 * width);
    let mut figure = Figure::new(format!("{name}, spectrum"), Size::Half, x, Axis::scaled("amplitude", lo, hi, true));
    for (points, colour) in lines {
        figure = figure.line(points, colour, 1.1);
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
        let pairs = values.iter().zip(&residual).step_by(values.len().div_ceil(MOST_POINTS).max(1));
        figure = figure.points(pairs.map(|(value, residual)| (*value, *residual)).collect(), colour, 1.5, 0.6);
    }
    Ok(figure.svg()?)
}
