//! `summary.json` and `report.html`: one self-contained page that opens from disk and prints cleanly.

use std::path::{Path, PathBuf};

use minijinja::value::Serde;
use serde::Serialize;
use softdock_campaign::outcome_map::OutcomeMap;
use softdock_results::write_file;

use crate::Result;
use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::number::{significant, with_unit};
use crate::plots::Drawing;
use crate::plots::energy::energy_figure;
use crate::plots::force::force_figures;
use crate::plots::margin::margin_figures;
use crate::plots::outcomes::{OutcomeFigures, outcome_figures};
use crate::plots::sample::{CONSERVED, Sample};
use crate::plots::success::success_figure;
use crate::plots::tracking::{TrackingRow, tracking_figures, tracking_rows};
use crate::reading::agreement_reading;
use crate::summary::Summary;
use crate::templates::{STYLE, environment};

/// Dispersed parameter, as in the campaign file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportedDispersion {
    /// Target in the campaign file.
    pub target: String,
    /// Column of the runs (`in_loop_delay_s`).
    pub column: String,
    /// Distribution with its parameters and units.
    pub distribution: String,
    /// `aleatory`, `epistemic` or `derived`.
    pub class: String,
    /// Where the distribution comes from.
    pub source: String,
}

/// Named value, for the report's small tables.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// Name.
    pub name: String,
    /// Its value, with unit.
    pub value: String,
}

/// Inputs of the report page besides the summary.
#[derive(Clone, Debug)]
pub struct ReportInput<'a> {
    /// The campaign.
    pub campaign: CampaignFacts<'a>,
    /// The content of the results folder.
    pub content: &'a Content,
    /// Maps of outcomes.
    pub outcome_maps: &'a [OutcomeMap],
    /// One row per dispersed parameter.
    pub dispersions: Vec<ReportedDispersion>,
    /// Configuration: scenario, model, step sizes, hashes.
    pub configuration: Vec<Fact>,
    /// Commands that repeat the campaign, one per line.
    pub commands: Vec<String>,
    /// The criteria of the task, each as the rest of a sentence.
    pub criteria: Vec<String>,
    /// The rules that stop a session on the facility, each as the rest of a sentence.
    pub rules: Vec<String>,
}

/// A dispersion as the page shows it: asked and drawn.
#[derive(Serialize)]
struct DispersionRow {
    target: String,
    unit: String,
    distribution: String,
    class: String,
    source: String,
    mean: String,
    deviation: String,
    range: String,
}

/// Values of the template.
#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    summary: &'a Summary,
    campaign_text: &'a str,
    reading: Vec<String>,
    requirement_figures: Vec<RequirementFigures>,
    success: Vec<Drawing>,
    outcome_maps: Vec<OutcomeFigures>,
    energy: Option<Drawing>,
    forces: Vec<Drawing>,
    tracking: Vec<TrackingRow>,
    tracking_figures: Vec<Drawing>,
    dispersions: Vec<DispersionRow>,
    conserved: Vec<Fact>,
    stride: u64,
    kept: u64,
    configuration: &'a [Fact],
    commands: &'a [String],
    criteria: &'a [String],
    rules: &'a [String],
}

/// Figures of one requirement.
#[derive(Serialize)]
struct RequirementFigures {
    id: String,
    text: String,
    figures: Vec<Drawing>,
}

/// The text of `summary.json`.
pub fn summary_text(summary: &Summary) -> String {
    serde_json::to_string_pretty(summary).expect("a summary has string keys only") + "\n"
}

/// Writes `summary.json` below the results folder.
///
/// # Errors
/// If the file cannot be written.
pub fn write_summary(results: &Path, summary: &Summary) -> Result<PathBuf> {
    let path = results.join("summary.json");
    write_file(&path, summary_text(summary).as_bytes())?;
    Ok(path)
}

/// Writes `report.html` below the results folder.
pub fn write_report(input: &ReportInput, summary: &Summary) -> Result<PathBuf> {
    let path = input.content.results.join("report.html");
    write_file(&path, report_page(input, summary)?.as_bytes())?;
    Ok(path)
}

/// The page as text.
pub fn report_page(input: &ReportInput, summary: &Summary) -> Result<String> {
    let columns: Vec<String> = input.dispersions.iter().map(|dispersion| dispersion.column.clone()).collect();
    let sample = match summary.completeness.runs_done {
        0 => Sample::default(),
        _ => Sample::read(input.content, &input.campaign, &columns, !input.outcome_maps.is_empty())?,
    };
    let mut success = Vec::new();
    for column in &sample.inputs {
        success.extend(success_figure(&sample, column)?);
    }
    let page = Page {
        style: STYLE,
        summary,
        campaign_text: input.campaign.text,
        reading: agreement_reading(summary),
        requirement_figures: requirement_figures(input, summary, &sample)?,
        success,
        outcome_maps: input.outcome_maps.iter().map(|map| outcome_figures(&sample, map)).collect::<Result<_>>()?,
        energy: energy_figure(&sample)?,
        forces: force_figures(&input.content.traces.kept, input.campaign.requirements)?,
        tracking: tracking_rows(&sample),
        tracking_figures: tracking_figures(&sample)?,
        dispersions: dispersion_rows(input, &sample),
        conserved: conserved(&sample),
        stride: sample.stride,
        kept: sample.runs() as u64,
        configuration: &input.configuration,
        commands: &input.commands,
        criteria: &input.criteria,
        rules: &input.rules,
    };
    Ok(environment()?.get_template("report.html")?.render(Serde(&page))?)
}

fn requirement_figures(input: &ReportInput, summary: &Summary, sample: &Sample) -> Result<Vec<RequirementFigures>> {
    let mut all = Vec::new();
    let judged = input.campaign.requirements.iter().zip(&summary.requirements);
    for ((requirement, judged), margins) in judged.zip(&sample.margins) {
        let tolerance = judged.loops.space.tolerance_limit.map(|limit| limit.margin);
        let figures = margin_figures(&requirement.id, requirement.unit(), margins, tolerance)?;
        all.push(RequirementFigures {
            id: requirement.id.clone(),
            text: requirement.text.clone(),
            figures: figures.into_iter().flatten().collect(),
        });
    }
    Ok(all)
}

fn dispersion_rows(input: &ReportInput, sample: &Sample) -> Vec<DispersionRow> {
    let row = |(at, dispersion): (usize, &ReportedDispersion)| {
        let drawn = sample.inputs.get(at);
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| significant(value, 4));
        let moments = drawn.map(|input| input.moments);
        DispersionRow {
            target: dispersion.target.clone(),
            unit: drawn.map_or("-".to_owned(), |input| input.unit.clone()),
            distribution: dispersion.distribution.clone(),
            class: dispersion.class.clone(),
            source: dispersion.source.clone(),
            mean: number(moments.map(|moments| moments.mean)),
            deviation: number(moments.map(|moments| moments.deviation())),
            range: format!(
                "{} to {}",
                number(moments.map(|moments| moments.lo)),
                number(moments.map(|moments| moments.hi))
            ),
        }
    };
    input.dispersions.iter().enumerate().map(row).collect()
}

/// Largest momentum error of each loop over all runs.
fn conserved(sample: &Sample) -> Vec<Fact> {
    const NAMES: [(&str, &str); CONSERVED.len()] = [
        ("largest change of linear momentum beyond the impulses, in space", "kg m/s"),
        ("largest change of angular momentum beyond the moments, in space", "kg m^2/s"),
        ("largest change of linear momentum beyond the impulses, on the facility", "kg m/s"),
        ("largest change of angular momentum beyond the moments, on the facility", "kg m^2/s"),
    ];
    let fact =
        |((name, unit), value): ((&str, &str), f64)| Fact { name: name.to_owned(), value: with_unit(value, unit) };
    NAMES.into_iter().zip(sample.conserved).map(fact).collect()
}
