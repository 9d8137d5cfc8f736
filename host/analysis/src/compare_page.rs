//! `compare.json` and `compare.html`: the variants' verdicts, rates along a parameter, and maps.

use std::path::{Path, PathBuf};

use serde::Serialize;
use softdock_campaign::compare::{Bands, CellMap, Comparison};
use softdock_results::write_file;

use crate::Result;
use crate::compare::{Band, Compared, ComparedVariant, Spread, Wrong, short_times, times};
use crate::exact::Share;
use crate::number::{axis_label, shown_in};
use crate::number::{digits_of, significant, unit_text};
use crate::plots::Drawing;
use crate::plots::bands::{aborted_figure, colour_of, metric_figure, wrong_figure};
use crate::plots::cells::{Shown, cells_figure, medians};
use crate::templates::{PageOrigin, render_page};

/// Values of the template.
#[derive(Serialize)]
struct Page<'a> {
    compared: &'a Compared,
    variants: Vec<Line>,
    /// Rules that aborted sessions, with the runs of each variant.
    aborts: Vec<(String, Vec<u64>)>,
    along: Option<Along>,
    spreads: Vec<SpreadTable>,
    maps: Vec<MapRow>,
    campaign_text: &'a str,
    commands: &'a [String],
}

/// A variant's line of the first table.
#[derive(Serialize)]
struct Line {
    colour: String,
    wrong: String,
    aborted: String,
    factor: String,
}

/// Rates along a parameter.
#[derive(Serialize)]
struct Along {
    parameter: String,
    bands: Vec<String>,
    /// Per variant and band.
    wrong: Vec<Vec<RateCell>>,
    /// Of the wrong verdicts and of the aborted sessions, if there are any.
    figures: Vec<Drawing>,
    metrics: Vec<Drawing>,
}

/// Cell of the table of bands.
#[derive(Serialize)]
struct RateCell {
    share: String,
    interval: String,
    factor: String,
    false_pass: String,
    false_fail: String,
    aborted: String,
}

/// Spread of a metric, per variant.
#[derive(Serialize)]
struct SpreadTable {
    metric: String,
    unit: String,
    rows: Vec<[String; 5]>,
}

/// One map for every variant.
#[derive(Serialize)]
struct MapRow {
    what: String,
    line_name: String,
    trust: bool,
    figures: Vec<Drawing>,
}

/// Writes `compare.json` and `compare.html` into the campaign's results folder.
pub fn write_compare(
    results: &Path,
    plan: &Comparison,
    compared: &Compared,
    campaign_text: &str,
    commands: &[String],
) -> Result<PathBuf> {
    let mut json = serde_json::to_string_pretty(compared).expect("a comparison has string keys only");
    json.push('\n');
    write_file(&results.join("compare.json"), json.as_bytes())?;
    let path = results.join("compare.html");
    write_file(&path, compare_page(plan, compared, campaign_text, commands)?.as_bytes())?;
    Ok(path)
}

/// The page as text.
pub fn compare_page(
    plan: &Comparison,
    compared: &Compared,
    campaign_text: &str,
    commands: &[String],
) -> Result<String> {
    let line = |(index, variant): (usize, &ComparedVariant)| {
        let colour = colour_of(index);
        Line {
            colour: format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2),
            wrong: percent(&variant.wrong.share),
            aborted: percent(&variant.agreement.abort_rate),
            factor: variant.wrong.factor.as_ref().map_or("–".to_owned(), times),
        }
    };
    let mut maps = Vec::new();
    for (index, map) in plan.maps.iter().enumerate() {
        let shown = match map.metric {
            Some(_) => &[Shown::Median][..],
            None if compared.any_aborted() => &[Shown::Wrong, Shown::Aborted],
            None => &[Shown::Wrong],
        };
        for shown in shown {
            maps.push(map_row(map, index, &compared.variants, *shown)?);
        }
    }
    let page = Page {
        compared,
        variants: compared.variants.iter().enumerate().map(line).collect(),
        aborts: compared.abort_causes(),
        along: along(compared)?,
        spreads: spread_tables(&compared.variants),
        maps,
        campaign_text,
        commands,
    };
    let origin = PageOrigin { version: &compared.version, commit: &compared.commit, command: "" };
    render_page("compare.html", include_str!("page/compare.html"), &origin, &page)
}

fn percent(share: &Share) -> String {
    match share.cases {
        0 => "–".to_owned(),
        cases => format!("{:.1}\u{a0}%", 100.0 * share.count as f64 / cases as f64),
    }
}

fn ends(share: &Share) -> String {
    format!("{:.1} to {:.1}\u{a0}%", 100.0 * share.interval.lo, 100.0 * share.interval.hi)
}

fn along(compared: &Compared) -> Result<Option<Along>> {
    let Some(cut) = &compared.along else { return Ok(None) };
    let (factor, unit) = shown_in(cut.unit, cut.edges[cut.edges.len() - 1]);
    let number = |edge: f64| significant(factor * edge, 3);
    let bands =
        cut.edges.windows(2).map(|pair| format!("{} to {} {}", number(pair[0]), number(pair[1]), unit_text(unit)));
    let count = compared.variants.first().map_or(0, |variant| variant.metrics.len());
    let metrics = (0..count).map(|metric| metric_figure(cut, &compared.variants, metric));
    let wrong = compared.any_wrong().then(|| wrong_figure(cut, &compared.variants));
    let aborted = compared.any_aborted().then(|| aborted_figure(cut, &compared.variants));
    Ok(Some(Along {
        parameter: cut.parameter.replace('_', " "),
        bands: bands.collect(),
        wrong: compared.variants.iter().map(|variant| variant.bands.iter().map(rate_cell).collect()).collect(),
        figures: wrong.into_iter().chain(aborted).collect::<Result<_>>()?,
        metrics: metrics.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect(),
    }))
}

fn rate_cell(band: &Band) -> RateCell {
    let Wrong { share, factor, .. } = &band.wrong;
    RateCell {
        share: percent(share),
        interval: ends(share),
        factor: factor.as_ref().map_or(String::new(), short_times),
        false_pass: format!("{} of {}", band.false_pass_rate.count, band.false_pass_rate.cases),
        false_fail: format!("{} of {}", band.false_fail_rate.count, band.false_fail_rate.cases),
        aborted: percent(&band.aborted),
    }
}

fn spread_tables(variants: &[ComparedVariant]) -> Vec<SpreadTable> {
    let Some(first) = variants.first() else { return Vec::new() };
    let number = |value: Option<f64>| value.map_or("–".to_owned(), |value| digits_of(value, 3));
    let row = |variant: &ComparedVariant, spread: &Spread| {
        [variant.name.clone(), number(spread.lo), number(spread.median), number(spread.hi), spread.runs.to_string()]
    };
    let table = |(index, metric): (usize, &Spread)| SpreadTable {
        metric: metric.metric.replace('_', " "),
        unit: unit_text(metric.unit),
        rows: variants.iter().map(|variant| row(variant, &variant.metrics[index])).collect(),
    };
    first.metrics.iter().enumerate().map(table).collect()
}

fn map_row(plan: &CellMap, index: usize, variants: &[ComparedVariant], shown: Shown) -> Result<MapRow> {
    let range = medians(variants.iter().map(|variant| &variant.maps[index]));
    let figure = |variant: &ComparedVariant| {
        let map = &variant.maps[index];
        let cells = map.cells.iter().map(Vec::len).sum::<usize>();
        let caption = match shown {
            Shown::Median | Shown::Aborted => variant.name.clone(),
            Shown::Wrong => format!("{}: {} of {cells} cells trusted", variant.name, map.trusted),
        };
        Ok(Drawing { svg: cells_figure(&variant.name, plan, map, shown, range)?, caption })
    };
    let what = match &plan.metric {
        Some((name, unit)) => format!("Median of {}", axis_label(&name.replace('_', " "), unit)),
        None if shown == Shown::Aborted => "Aborted sessions, per cent".to_owned(),
        None => "Wrong verdicts, per cent of those that are given".to_owned(),
    };
    let words = |bands: &Bands| bands.field.name.replace('_', " ");
    let slice = plan.slice.as_ref().map_or(String::new(), |slice| {
        let [lo, hi] = [0, 1].map(|end| significant(slice.edges[end], 3));
        format!(", {} {lo} to {hi} {}", words(slice), unit_text(slice.field.unit))
    });
    Ok(MapRow {
        what: format!("{what} over {} and {}{slice}", words(&plan.x), words(&plan.y)),
        line_name: plan.line_name.clone(),
        trust: shown == Shown::Wrong,
        figures: variants.iter().map(figure).collect::<Result<_>>()?,
    })
}
