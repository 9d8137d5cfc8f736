//! `summary.json` and `report.html`: one self-contained page that opens from disk and prints cleanly.

use std::path::{Path, PathBuf};

use serde::Serialize;
use softdock_campaign::outcome_map::OutcomeMap;
use softdock_kernels::plant::Plant;
use softdock_results::arrow_table::OtherUnit;
use softdock_results::write_file;

use crate::Result;
use crate::content::Content;
use crate::facts::CampaignFacts;
use crate::number::{significant, with_unit};
use crate::page_data::pass::{CONSERVED, PageRuns};
use crate::page_data::{PageInput, page_data};
use crate::reading::agreement_reading;
use crate::summary::Summary;
use crate::templates::{APP, PageOrigin, render_with};
use crate::tracking::{TrackingRow, tracking_rows};

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
    /// The scenario's constants, for the replay in three dimensions; without them the page has none.
    pub plant: Option<Plant>,
    /// Columns in the units of the campaign's author.
    pub author_units: Vec<OtherUnit>,
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
    summary: &'a Summary,
    campaign_text: &'a str,
    reading: Vec<String>,
    tracking: Vec<TrackingRow>,
    dispersions: Vec<DispersionRow>,
    conserved: Vec<Fact>,
    /// Data of the interactive part; none without runs.
    data: Option<Data>,
    maps: usize,
    traces: usize,
    configuration: &'a [Fact],
    commands: &'a [String],
    criteria: &'a [String],
    rules: &'a [String],
}

/// Data of the interactive part.
#[derive(Serialize)]
struct Data {
    head: String,
    block: String,
    shown: u64,
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
    let runs = match summary.completeness.runs_done {
        0 => None,
        _ => Some(PageRuns::read(input.content, &input.campaign, &columns)?),
    };
    let data_input = PageInput {
        facts: &input.campaign,
        summary,
        traces: &input.content.traces.kept,
        author_units: &input.author_units,
        outcome_maps: input.outcome_maps,
        plant: input.plant.as_ref(),
    };
    let data = runs.as_ref().map(|runs| {
        let data = page_data(&data_input, runs);
        Data { head: data.head, block: data.block, shown: runs.sample.len() as u64 }
    });
    let page = Page {
        summary,
        campaign_text: input.campaign.text,
        reading: agreement_reading(summary),
        tracking: runs.as_ref().map(tracking_rows).unwrap_or_default(),
        dispersions: dispersion_rows(input, runs.as_ref()),
        conserved: conserved(runs.as_ref()),
        data,
        maps: input.outcome_maps.len(),
        traces: input.content.traces.kept.len(),
        configuration: &input.configuration,
        commands: &input.commands,
        criteria: &input.criteria,
        rules: &input.rules,
    };
    let origin = PageOrigin { version: &summary.version, commit: &summary.commit, command: "" };
    render_with(APP, "report.html", include_str!("page/report.html"), &origin, &page)
}

fn dispersion_rows(input: &ReportInput, runs: Option<&PageRuns>) -> Vec<DispersionRow> {
    let row = |(at, dispersion): (usize, &ReportedDispersion)| {
        let drawn = runs.and_then(|runs| runs.dispersed().get(at));
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
fn conserved(runs: Option<&PageRuns>) -> Vec<Fact> {
    const NAMES: [(&str, &str); CONSERVED.len()] = [
        ("largest change of linear momentum beyond the impulses, in space", "kg m/s"),
        ("largest change of angular momentum beyond the moments, in space", "kg m^2/s"),
        ("largest change of linear momentum beyond the impulses, on the facility", "kg m/s"),
        ("largest change of angular momentum beyond the moments, on the facility", "kg m^2/s"),
    ];
    let fact =
        |((name, unit), value): ((&str, &str), f64)| Fact { name: name.to_owned(), value: with_unit(value, unit) };
    let values = runs.map_or([0.0; CONSERVED.len()], |runs| runs.conserved);
    NAMES.into_iter().zip(values).map(fact).collect()
}
