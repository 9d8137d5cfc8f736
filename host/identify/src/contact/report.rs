//! Files of an identification of a contact: table for scenarios, page, JSON summary, text for the terminal.

use super::block::{contact_block, source, words};
use super::estimate::{ContactDetermination, ContactEstimate};
use super::identification::{ContactIdentification, FoundContact, FoundLaw, FoundToss};
use super::law::PredictedTouch;
use super::toss::OpenLoopError;
use crate::Result;
use serde::Serialize;
use serde_json::{Value, json};
use softdock_analysis::number::{digits_of, significant, unit_text};
use softdock_analysis::plots::axis::Axis;
use softdock_analysis::plots::figure::{Figure, Size, colour};
use softdock_analysis::{PageOrigin, render_page};
use softdock_diagnosis::report::result_files::{FiguresAndFiles, readable};
use softdock_results::ResultFile;

/// Bars of a distribution of errors.
const BARS: usize = 24;

#[derive(Serialize)]
struct ContactPage {
    title: String,
    headline: String,
    source: String,
    estimates: Vec<EstimateRow>,
    laws: Vec<LawRow>,
    body: Vec<EstimateRow>,
    errors: Vec<Vec<String>>,
    is_toss: bool,
    figures: Vec<(String, String)>,
    notes: Vec<String>,
    block: String,
}

#[derive(Serialize)]
struct EstimateRow {
    name: String,
    unit: String,
    value: String,
    interval: String,
    verdict: String,
    reason: String,
    determined: bool,
}

#[derive(Serialize)]
struct LawRow {
    name: &'static str,
    error: String,
    difference: String,
    restitution: String,
    chosen: bool,
}

/// Returns table, page and figures of an identification made by `command`.
///
/// # Errors
/// If a figure of the page cannot be drawn.
pub fn contact_files(found: &ContactIdentification, origin: &PageOrigin) -> Result<FiguresAndFiles> {
    let figures = summary(found);
    let files = vec![
        ResultFile::new("contact.toml", contact_block(found, origin)),
        ResultFile::new("identify.html", page(found, origin)?),
        ResultFile::new("identification.json", readable(&figures)),
    ];
    Ok(FiguresAndFiles { figures, files })
}

/// Returns the answer in one sentence.
fn headline(found: &ContactIdentification) -> String {
    let part = |determination: ContactDetermination| -> Vec<&str> {
        let own = found.estimates().iter().filter(|estimate| estimate.determination == determination);
        own.map(|estimate| estimate.key).collect()
    };
    let determined = part(ContactDetermination::Determined);
    let mut open = part(ContactDetermination::Bounded);
    open.extend(part(ContactDetermination::NotDetermined));
    let law = match &found.found {
        FoundContact::Touches(own) => law_words(own),
        FoundContact::Tosses(_) => String::new(),
    };
    let list = |keys: &[&str]| if keys.is_empty() { "none".to_owned() } else { keys.join(", ") };
    let inadequate = found.inadequate().map_or(String::new(), |error| {
        let percent = digits_of(100.0 * error, 3);
        format!(
            "Model inadequate: no law describes the force to better than {percent} %; intervals do not cover that. "
        )
    });
    format!("{inadequate}{law}Determined: {}. Not determined: {}.", list(&determined), list(&open))
}

fn law_words(own: &FoundLaw) -> String {
    let rivals: Vec<&str> = own.rivals().iter().map(|fit| fit.law.word()).collect();
    let best = own.best().law.word();
    match (own.is_given, rivals.as_slice()) {
        (true, _) => format!("Law {best}, as given. "),
        (false, []) => format!("Law {best}. "),
        (false, rivals) => format!("Law {best}; these data do not distinguish it from {}. ", rivals.join(" and ")),
    }
}

fn estimate_row(estimate: &ContactEstimate) -> EstimateRow {
    let interval = estimate.interval.filter(|_| estimate.value.is_some());
    EstimateRow {
        name: estimate.key.to_owned(),
        unit: unit_text(estimate.unit),
        value: estimate.value.map_or("–".to_owned(), |value| significant(value, 4)),
        interval: interval
            .map_or(String::new(), |[low, high]| format!("{} to {}", significant(low, 4), significant(high, 4))),
        verdict: words(estimate),
        reason: estimate.reason.clone(),
        determined: estimate.determination == ContactDetermination::Determined,
    }
}

fn law_rows(own: &FoundLaw) -> Vec<LawRow> {
    let least = own.best().criterion;
    let row = |fit: &super::law::LawFit| LawRow {
        name: fit.law.word(),
        error: digits_of(100.0 * fit.error, 3),
        difference: digits_of(fit.criterion - least, 3),
        restitution: fit.restitution.map_or("–".to_owned(), |restitution| digits_of(restitution, 3)),
        chosen: std::ptr::eq(fit, own.best()),
    };
    own.fits.iter().map(row).collect()
}

fn page(found: &ContactIdentification, origin: &PageOrigin) -> Result<String> {
    let (laws, body, errors, figures) = match &found.found {
        FoundContact::Touches(own) => (law_rows(own), Vec::new(), touch_errors(own), touch_figures(own)?),
        FoundContact::Tosses(own) => {
            let row = |body: &super::toss::BodyEstimate| EstimateRow {
                name: body.name.to_owned(),
                unit: unit_text(body.unit),
                value: significant(body.value, 4),
                interval: format!("{} to {}", significant(body.interval[0], 4), significant(body.interval[1], 4)),
                verdict: String::new(),
                reason: String::new(),
                determined: true,
            };
            (Vec::new(), own.fit.body.iter().map(row).collect(), toss_errors(own), toss_figures(own)?)
        }
    };
    let page = ContactPage {
        title: found.title.clone(),
        headline: headline(found),
        source: source(found),
        estimates: found.estimates().iter().map(estimate_row).collect(),
        laws,
        body,
        errors,
        is_toss: matches!(found.found, FoundContact::Tosses(_)),
        figures,
        notes: found.notes().to_vec(),
        block: contact_block(found, origin),
    };
    Ok(render_page("contact.html", include_str!("../page/contact.html"), origin, &page)?)
}

/// Order of cases by their error: best, median, worst.
fn ranked<T>(all: &[T], error: impl Fn(&T) -> f64) -> [usize; 3] {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|one, other| error(&all[*one]).total_cmp(&error(&all[*other])));
    [order[0], order[order.len() / 2], order[order.len() - 1]]
}

const RANKS: [&str; 3] = ["best", "median", "worst"];

fn touch_errors(own: &FoundLaw) -> Vec<Vec<String>> {
    let row = |name: &str, touches: &[PredictedTouch]| {
        let mean = |of: &dyn Fn(&PredictedTouch) -> f64| touches.iter().map(of).sum::<f64>() / touches.len() as f64;
        let worst = touches.iter().map(|touch| touch.error()).fold(0.0, f64::max);
        let peak = mean(&|touch| touch.peak_error().abs());
        let shown = [mean(&|touch| touch.error()), worst, peak].map(|share| digits_of(100.0 * share, 3));
        [vec![name.to_owned(), touches.len().to_string()], shown.to_vec()].concat()
    };
    let (fitted, held) = (own.predicted(false), own.predicted(true));
    let mut rows = vec![row("fitted", &fitted)];
    if !held.is_empty() {
        rows.push(row("held out", &held));
    }
    rows
}

/// Force over depth of the best, the median and the worst touch, held out if there are any.
fn touch_figures(own: &FoundLaw) -> Result<Vec<(String, String)>> {
    let (held, fitted) = (own.predicted(true), own.predicted(false));
    let (name, all) = if held.is_empty() { ("fitted", fitted) } else { ("held out", held) };
    let surface = own.best().surface.0;
    let mut drawings = Vec::new();
    for (rank, number) in RANKS.iter().zip(ranked(&all, |touch| touch.error())) {
        let found = &all[number];
        let depth = |i: usize| 1e3 * (surface - found.touch.at(i).position.z);
        let line =
            |force: &[f64]| -> Vec<(f64, f64)> { force.iter().enumerate().map(|(i, f)| (depth(i), *f)).collect() };
        let (measured, predicted) = (line(&found.measured), line(&found.predicted));
        let ends = |of: &dyn Fn(&(f64, f64)) -> f64| {
            let all = measured.iter().chain(&predicted).map(of);
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)))
        };
        let ((left, right), (low, high)) = (ends(&|p| p.0), ends(&|p| p.1));
        let x = Axis::linear("depth [mm]", left, right).padded(0.03);
        let y = Axis::linear("normal force [N]", low, high).padded(0.05);
        let svg = Figure::new(format!("{rank} touch"), Size::Third, x, y)
            .line(measured, colour::SPACE, 1.3)
            .line(predicted, colour::FACILITY, 1.0)
            .svg()?;
        let caption = format!(
            "{rank}, {name}: {} at {} s, {} m/s, error {} %",
            found.touch.recording,
            significant(found.touch.start, 4),
            significant(found.touch.closing_speed(), 3),
            digits_of(100.0 * found.error(), 3)
        );
        drawings.push((svg, caption));
    }
    let errors: Vec<f64> = all.iter().map(|touch| 100.0 * touch.error()).collect();
    drawings.push((histogram("relative error of the force [%]", &[(&errors, colour::FACILITY)])?, name.to_owned()));
    Ok(drawings)
}

const PARTS: [[&str; 2]; 2] = [
    ["fitted tosses, the rig's values", "fitted tosses, identified"],
    ["held-out tosses, the rig's values", "held-out tosses, identified"],
];

fn toss_errors(own: &FoundToss) -> Vec<Vec<String>> {
    let row = |name: &str, errors: &[OpenLoopError]| {
        let of = |value: &dyn Fn(&OpenLoopError) -> f64| {
            let mut all: Vec<f64> = errors.iter().map(value).collect();
            all.sort_by(f64::total_cmp);
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            [mean, all[0], all[all.len() / 2], all[all.len() - 1]].map(|value| digits_of(value, 3))
        };
        let (position, rotation) = (of(&|e| 1e3 * e.position_m), of(&|e| e.rotation_rad.to_degrees()));
        [vec![name.to_owned(), errors.len().to_string()], position.to_vec(), rotation.to_vec()].concat()
    };
    let parts = [&own.fitted, &own.held_out].into_iter().zip(PARTS);
    let filled = parts.filter(|(part, _)| !part[0].is_empty());
    filled.flat_map(|(part, names)| [0, 1].map(|set| row(names[set], &part[set]))).collect()
}

/// Distributions of the errors, with the rig's values and with the identified ones.
fn toss_figures(own: &FoundToss) -> Result<Vec<(String, String)>> {
    let (name, part) = match own.held_out[0].is_empty() {
        true => ("fitted tosses", &own.fitted),
        false => ("held-out tosses", &own.held_out),
    };
    let figure = |label: &str, of: fn(&OpenLoopError) -> f64| -> Result<(String, String)> {
        let [before, after] = [0, 1].map(|set| part[set].iter().map(of).collect::<Vec<f64>>());
        let svg = histogram(label, &[(&before, colour::TRUE_FAIL), (&after, colour::FACILITY)])?;
        Ok((svg, format!("{name}, {label}: grey with the rig's values, orange identified")))
    };
    Ok(vec![
        figure("mean position error [mm]", |error| 1e3 * error.position_m)?,
        figure("mean rotation error [deg]", |error| error.rotation_rad.to_degrees())?,
    ])
}

/// Histogram of one or two series over a common axis.
fn histogram(label: &str, series: &[(&Vec<f64>, softdock_analysis::plots::figure::RGBColor)]) -> Result<String> {
    let most = series.iter().flat_map(|(values, _)| values.iter()).copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let width = most / BARS as f64;
    let bars = |values: &[f64]| -> Vec<(f64, f64, f64)> {
        let mut counts = [0.0; BARS];
        values.iter().for_each(|value| counts[((value / width) as usize).min(BARS - 1)] += 1.0);
        counts.iter().enumerate().map(|(i, n)| (i as f64 * width, (i + 1) as f64 * width, *n)).collect()
    };
    let all: Vec<_> = series.iter().map(|(values, _)| bars(values)).collect();
    let highest = all.iter().flatten().map(|bar| bar.2).fold(1.0, f64::max);
    let y = Axis::linear("count", 0.0, 1.05 * highest);
    let mut figure = Figure::new(label, Size::Third, Axis::linear(label, 0.0, most), y);
    for (bars, (_, colour)) in all.into_iter().zip(series) {
        figure = figure.bars(bars, *colour, 0.55);
    }
    Ok(figure.svg()?)
}

/// Returns the JSON summary.
pub fn summary(found: &ContactIdentification) -> Value {
    let common = json!({
        "schema": "contact-identification/1", "rig": found.id, "law": found.law(), "headline": headline(found),
        "complete": found.is_complete(), "adequate": found.inadequate().is_none(), "estimates": found.estimates(), "source": source(found), "notes": found.notes(),
    });
    let own = match &found.found {
        FoundContact::Touches(own) => {
            let touch = |touch: &PredictedTouch| {
                json!({
                    "recording": touch.touch.recording, "start_s": touch.touch.start,
                    "closing_speed_m_s": touch.touch.closing_speed(), "held_out": touch.touch.held_out,
                    "relative_error": touch.error(), "peak_error": touch.peak_error(),
                })
            };
            let part = |held_out: bool| own.predicted(held_out).iter().map(touch).collect::<Vec<_>>();
            let touches = [part(false), part(true)].concat();
            let law = |fit: &super::law::LawFit| {
                json!({
                    "law": fit.law, "relative_error": fit.error, "criterion": fit.criterion, "estimates": fit.estimates,
                    "independent_samples": fit.independent, "surface_m": fit.surface.0,
                    "surface_interval_m": fit.surface.1, "restitution_at_fastest_touch": fit.restitution,
                })
            };
            json!({
                "laws": own.fits.iter().map(law).collect::<Vec<_>>(),
                "indistinguishable": own.rivals().iter().map(|fit| fit.law).collect::<Vec<_>>(),
                "touches": touches,
            })
        }
        FoundContact::Tosses(own) => json!({
            "body": own.fit.body, "parameter_sets": own.fit.sets, "fitted_tosses": own.fit.fitted,
            "errors_fitted": { "rig": own.fitted[0], "identified": own.fitted[1] },
            "errors_held_out": { "rig": own.held_out[0], "identified": own.held_out[1] },
        }),
    };
    let mut all = common;
    let fields = own.as_object().expect("an object").clone();
    all.as_object_mut().expect("an object").extend(fields);
    all
}

/// Returns the table of estimates for the terminal.
pub fn terminal(found: &ContactIdentification) -> String {
    let mut text: String = found.notes().iter().map(|note| format!("{note}\n")).collect();
    text += &format!("{}\n{}\n", headline(found), source(found));
    for estimate in found.estimates() {
        let row = estimate_row(estimate);
        let value = match row.determined {
            true => format!("{} {} ({})", row.value, row.unit.replace('1', ""), row.interval),
            false => format!("{}: {}", row.verdict, row.reason),
        };
        text += &format!("  {:<18} {}\n", row.name, value.replace("  ", " "));
    }
    text.trim_end().to_owned()
}
