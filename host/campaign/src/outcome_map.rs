//! Maps of outcomes: a dot for each run over two dispersed parameters, with lines to compare it with.

use crate::check::Checker;
use crate::compare::{Axes, Bands, bands, line, line_points};
use crate::written::campaign::{CampaignFile, OutcomeMapTable};

/// A map of outcomes over two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct OutcomeMap {
    /// What it shows.
    pub title: String,
    /// Along the horizontal axis; one band.
    pub x: Bands,
    /// Along the vertical axis; one band.
    pub y: Bands,
    /// Lines over it.
    pub lines: Vec<MapLine>,
}

/// A line over a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapLine {
    /// What it is.
    pub name: String,
    /// Its points, SI.
    pub points: Vec<(f64, f64)>,
}

/// Reads the tables `[[outcome_map]]`.
pub(crate) fn read(c: &mut Checker, file: &CampaignFile, axes: &Axes) -> Vec<OutcomeMap> {
    file.outcome_map.iter().filter_map(|table| map(c, table, axes)).collect()
}

fn map(c: &mut Checker, table: &OutcomeMapTable, axes: &Axes) -> Option<OutcomeMap> {
    let (x, y) = (bands(c, &table.x, 1, axes), bands(c, &table.y, 1, axes));
    let written: Vec<_> = table.line.iter().map(|own| (&own.name, line(c, &own.expr, axes.fields))).collect();
    let (x, y) = (x?, y?);
    let lines = written.into_iter().filter_map(|(name, expression)| {
        let points = line_points(&expression?, &x, None, axes);
        Some(MapLine { name: name.value.clone(), points })
    });
    let lines = lines.collect();
    Some(OutcomeMap { title: table.title.value.clone(), x, y, lines })
}
