//! Page and JSON summary of an identification.

use crate::Result;
use crate::layout::Layout;
use crate::published_errors::PublishedErrors;
use crate::{Identification, RecordingComparison, TorqueComparison};
use serde::Serialize;
use serde_json::{Value, json};
use softdock_analysis::number::{digits_of, significant, unit_text};
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, Size, colour};
use softdock_analysis::{PageOrigin, render_page};

/// Points of a line on the page.
const MOST_POINTS: usize = 700;

/// Standard errors of a 95 % interval.
const TWO_SIDED: f64 = 1.96;

#[derive(Serialize)]
struct Page {
    title: String,
    fitted: String,
    validated: String,
    joints: Vec<String>,
    errors: Vec<ErrorRow>,
    remains: Vec<RemainRow>,
    recordings: Vec<Figures>,
    parameters: Vec<ParameterRow>,
    base: Vec<BaseRow>,
    scores: Vec<ScoreRow>,
    elasticity: Vec<ElasticityRow>,
    facts: Vec<(String, String)>,
}

#[derive(Serialize)]
struct ErrorRow {
    name: String,
    recording: String,
    percent: Vec<String>,
    known: bool,
}

#[derive(Serialize)]
struct RemainRow {
    recording: String,
    joint: String,
    rms: String,
    motor: String,
    lag_one: String,
    ljung_box: String,
    white: bool,
}

#[derive(Serialize)]
struct Figures {
    name: String,
    drawings: Vec<(String, String)>,
}

#[derive(Serialize)]
struct ParameterRow {
    joint: String,
    values: Vec<(String, String)>,
}

#[derive(Serialize)]
struct BaseRow {
    name: String,
    unit: String,
    value: String,
    error: String,
    share: String,
    consistent: String,
    prior: String,
    excited: bool,
}

#[derive(Serialize)]
struct ScoreRow {
    lambda: String,
    mean: String,
    errors: Vec<String>,
    chosen: bool,
}

#[derive(Serialize)]
struct ElasticityRow {
    joint: String,
    difference: String,
    lag: String,
    by_lag: String,
    stiffness: String,
    by_load: String,
    believed: bool,
}

/// Renders the page as HTML; `command` is the command that reproduces it.
pub fn page(found: &Identification, marks: &[PublishedErrors], origin: &PageOrigin) -> Result<String> {
    let names: Vec<String> = found.robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let list =
        |compared: &[RecordingComparison]| compared.iter().map(|c| c.name.clone()).collect::<Vec<_>>().join(", ");
    let all = || found.fitted.iter().chain(&found.validated);
    let page = Page {
        title: found.robot.title.clone(),
        fitted: list(&found.fitted),
        validated: list(&found.validated),
        errors: error_rows(found, marks),
        remains: all().flat_map(|compared| remain_rows(found, compared)).collect(),
        recordings: all().map(|compared| figures(&names, compared)).collect::<Result<_>>()?,
        parameters: names.iter().enumerate().map(|(i, name)| parameter_row(found, i, name)).collect(),
        base: base_rows(found),
        scores: score_rows(found),
        elasticity: elasticity_rows(found),
        facts: facts(found),
        joints: names,
    };
    Ok(render_page("identify.html", include_str!("page/identify.html"), origin, &page)?)
}

fn percent(share: f64) -> String {
    digits_of(100.0 * share, 3)
}

fn error_rows(found: &Identification, marks: &[PublishedErrors]) -> Vec<ErrorRow> {
    let row = |name: &str, compared: &RecordingComparison, error: fn(&TorqueComparison) -> f64| ErrorRow {
        name: name.to_owned(),
        recording: compared.name.clone(),
        percent: compared.joints.iter().map(|joint| percent(error(joint))).collect(),
        known: false,
    };
    let mut rows = Vec::new();
    for (kind, compared) in
        found.fitted.iter().map(|c| ("fitted", c)).chain(found.validated.iter().map(|c| ("predicted", c)))
    {
        rows.push(row(&format!("{kind}: this model"), compared, |joint| joint.relative_error));
        let plain = format!("{kind}: weighted least squares over base parameters alone");
        rows.push(row(&plain, compared, |joint| joint.plain_error));
    }
    let recording = found.validated.last().map_or_else(String::new, |compared| compared.name.clone());
    rows.extend(marks.iter().map(|mark| ErrorRow {
        name: format!("known: {}", mark.name),
        recording: recording.clone(),
        percent: mark.percent.iter().map(|percent| significant(*percent, 4)).collect(),
        known: true,
    }));
    rows
}

fn remain_rows(found: &Identification, compared: &RecordingComparison) -> Vec<RemainRow> {
    let row = |(index, joint): (usize, &TorqueComparison)| RemainRow {
        recording: compared.name.clone(),
        joint: found.robot.joints[index].name.clone(),
        rms: significant(joint.residual_rms, 3),
        motor: significant(joint.residual_rms / found.robot.model.joints[index].drive.gear_ratio, 3),
        lag_one: digits_of(joint.whiteness.lag_one, 2),
        ljung_box: format!("{:.0}", joint.whiteness.ljung_box),
        white: joint.whiteness.p_value > 0.05,
    };
    compared.joints.iter().enumerate().map(row).collect()
}

/// Measured and predicted torque over time, and their difference, joint by joint.
fn figures(names: &[String], compared: &RecordingComparison) -> Result<Figures> {
    let stride = compared.joints[0].measured.len().div_ceil(MOST_POINTS).max(1);
    let mut drawings = Vec::new();
    for (name, joint) in names.iter().zip(&compared.joints) {
        let line = |series: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            let points = (0..joint.measured.len()).step_by(stride);
            points.map(|i| (i as f64 * compared.step, series(i))).collect()
        };
        let (measured, predicted) = (line(&|i| joint.measured[i]), line(&|i| joint.predicted[i]));
        let rest = line(&|i| joint.measured[i] - joint.predicted[i]);
        let ends = [&measured, &predicted, &rest].into_iter().flatten();
        let (lo, hi) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(p.1), hi.max(p.1)));
        let x = Axis::linear("time [s]", 0.0, joint.measured.len() as f64 * compared.step);
        let y = Axis::linear("torque at the joint [N m]", lo, hi).padded(0.05);
        let svg = Figure::new(format!("{name}, {}", compared.name), Size::Half, x, y)
            .line(rest, colour::TRUE_FAIL, 1.0)
            .line(measured, colour::SPACE, 1.3)
            .line(predicted, colour::FACILITY, 1.0)
            .svg()?;
        drawings.push((svg, format!("{name}: relative error {} %", percent(joint.relative_error))));
    }
    Ok(Figures { name: compared.name.clone(), drawings })
}

fn parameter_row(found: &Identification, joint: usize, name: &str) -> ParameterRow {
    let layout = &found.layout;
    let places = [layout.inertial(joint) + 9, layout.rotor(joint), layout.coulomb(joint)];
    let more = [layout.stribeck(joint), layout.viscous(joint), layout.offset(joint)];
    let value = |place: usize| (significant(found.theta[place], 4), significant(found.prior_theta[place], 4));
    let mut values: Vec<(String, String)> = places.into_iter().chain(more).map(value).collect();
    let shape = found.shapes[joint];
    let friction = &found.prior.model.joints[joint].friction;
    values.push((significant(shape.travel, 2), significant(friction.presliding_travel(), 2)));
    values.push((significant(shape.speed, 2), significant(friction.stribeck_speed, 2)));
    ParameterRow { joint: name.to_owned(), values }
}

/// Base parameters: least squares with 95 % intervals beside the consistent and the a-priori values of the same sums.
fn base_rows(found: &Identification) -> Vec<BaseRow> {
    let ls = &found.least_squares;
    let (consistent, prior) = (&ls.base.map * &found.theta, &ls.base.map * &found.prior_theta);
    let errors = ls.standard_errors();
    let row = |(index, place): (usize, &usize)| {
        let (name, unit) = found.layout.name(*place);
        let half = TWO_SIDED * errors[index];
        BaseRow {
            name: combination(&found.layout, ls, index, name),
            unit: unit_text(unit),
            value: significant(ls.beta[index], 4),
            error: significant(half, 3),
            share: significant(100.0 * half / ls.beta[index].abs().max(f64::MIN_POSITIVE), 2),
            consistent: significant(consistent[index], 4),
            prior: significant(prior[index], 4),
            excited: half < ls.beta[index].abs(),
        }
    };
    ls.base.independent.iter().enumerate().map(row).collect()
}

/// Returns the text of a parameter combination.
fn combination(layout: &Layout, ls: &crate::base::LeastSquares, index: usize, name: String) -> String {
    let others = ls.base.map.row(index);
    let parts = others.iter().enumerate().filter(|(at, factor)| *at != ls.base.independent[index] && **factor != 0.0);
    let parts: Vec<String> = parts
        .map(|(at, factor)| {
            let sign = if *factor < 0.0 { "−" } else { "+" };
            let size = if (factor.abs() - 1.0).abs() < 1e-9 {
                String::new()
            } else {
                format!("{} ", significant(factor.abs(), 3))
            };
            format!(" {sign} {size}{}", layout.name(at).0)
        })
        .collect();
    name + &parts.concat()
}

fn score_rows(found: &Identification) -> Vec<ScoreRow> {
    let row = |score: &crate::choose::CrossValidationScore| ScoreRow {
        lambda: significant(score.lambda, 2),
        mean: percent(score.mean()),
        errors: score.errors.iter().map(|error| percent(*error)).collect(),
        chosen: score.lambda == found.score.lambda,
    };
    found.scores.iter().map(row).collect()
}

fn elasticity_rows(found: &Identification) -> Vec<ElasticityRow> {
    let row = |row: &crate::elasticity::Elasticity| ElasticityRow {
        joint: found.robot.joints[row.joint].name.clone(),
        difference: digits_of(row.difference_rad.to_degrees(), 3),
        lag: digits_of(1e3 * row.lag_s, 3),
        by_lag: percent(row.explained_by_lag),
        stiffness: significant(row.stiffness_n_m_per_rad, 3),
        by_load: percent(row.explained_by_load),
        believed: row.is_believed(),
    };
    found.elasticity.iter().map(row).collect()
}

fn facts(found: &Identification) -> Vec<(String, String)> {
    let ls = &found.least_squares;
    let excited = base_rows(found).iter().filter(|row| row.excited).count();
    [
        (
            "parameters",
            format!("{} ({} a joint, {} more)", found.layout.len(), 13, found.layout.len() - 13 * found.layout.joints),
        ),
        ("base parameters", ls.base.len().to_string()),
        ("of these, 95 % interval narrower than the value", excited.to_string()),
        ("condition number of the weighted regressor, columns of equal norm", significant(ls.condition, 3)),
        ("weight of the a-priori robot", significant(found.score.lambda, 2)),
        ("mean relative error in cross-validation", format!("{} %", percent(found.score.mean()))),
        ("model", format!("{} ({})", found.prior.id, found.prior.file)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into()
}

/// Returns the JSON summary.
pub fn summary(found: &Identification, marks: &[PublishedErrors]) -> Value {
    let compared = |compared: &RecordingComparison| {
        json!({
            "recording": compared.name,
            "joints": compared.joints.iter().zip(&found.robot.joints).map(|(joint, facts)| json!({
                "joint": facts.name, "relative_error": joint.relative_error, "plain_error": joint.plain_error,
                "residual_rms_n_m": joint.residual_rms, "whiteness": joint.whiteness,
            })).collect::<Vec<_>>(),
        })
    };
    let errors = found.least_squares.standard_errors();
    let base = |(index, place): (usize, &usize)| {
        let (name, unit) = found.layout.name(*place);
        json!({ "name": name, "unit": unit, "value": found.least_squares.beta[index], "standard_error": errors[index] })
    };
    json!({
        "robot": found.robot.id,
        "lambda": found.score.lambda,
        "cross_validation": found.score.errors,
        "condition": found.least_squares.condition,
        "base_parameters": found.least_squares.base.independent.iter().enumerate().map(base).collect::<Vec<_>>(),
        "fitted": found.fitted.iter().map(compared).collect::<Vec<_>>(),
        "validated": found.validated.iter().map(compared).collect::<Vec<_>>(),
        "marks_percent": marks,
        "elasticity": found.elasticity,
        "notes": found.notes,
    })
}

/// Returns the table of errors for the terminal.
pub fn terminal(found: &Identification, marks: &[PublishedErrors]) -> String {
    let mut text: String = found.notes.iter().map(|note| format!("{note}\n")).collect();
    text += &format!("{:<86}", "relative torque error [%]");
    // Columns are as wide as the longest name.
    let widths: Vec<usize> = found.robot.joints.iter().map(|joint| joint.name.chars().count().max(5) + 2).collect();
    for (joint, width) in found.robot.joints.iter().zip(&widths) {
        text += &format!("{:>width$}", joint.name);
    }
    for row in error_rows(found, marks) {
        text += &format!("\n  {:<84}", format!("{} ({})", row.name, row.recording));
        for (percent, width) in row.percent.iter().zip(&widths) {
            text += &format!("{percent:>width$}");
        }
    }
    text
}
