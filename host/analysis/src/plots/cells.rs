//! Maps over two parameters: a tile for each cell, its share of wrong verdicts or the median of a metric in it.

use plotters::style::RGBColor;
use softdock_campaign::compare::{Bands, CellMap};

use crate::Result;
use crate::compare::{Map, MapCell};
use crate::exact::Share;
use crate::number::significant;
use crate::number::{axis_label, shown_in};
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, FigureTile, Size, colour};

/// Ends of the colour scales: light where the number is small.
const FEW_WRONG: [f64; 3] = [252.0, 247.0, 238.0];
const MANY_WRONG: [f64; 3] = [140.0, 20.0, 60.0];
const MANY_ABORTED: [f64; 3] = [96.0, 78.0, 150.0];
const LEAST: [f64; 3] = [247.0, 250.0, 252.0];
const GREATEST: [f64; 3] = [10.0, 70.0, 120.0];

/// A cell without runs.
const EMPTY: RGBColor = RGBColor(0xF2, 0xF2, 0xF0);

/// What a map shows of its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Share of wrong verdicts.
    Wrong,
    /// Share of aborted sessions.
    Aborted,
    /// Median of a metric.
    Median,
}

/// The map of one variant; `range` holds the least and greatest median of the metric over all variants.
pub(crate) fn cells_figure(name: &str, plan: &CellMap, map: &Map, shown: Shown, range: (f64, f64)) -> Result<String> {
    let ((x, to_x), (y, to_y)) = (axis(&plan.x), axis(&plan.y));
    let mut tiles = Vec::new();
    for (row, cells) in map.cells.iter().enumerate() {
        for (column, cell) in cells.iter().enumerate() {
            let (colour, label) = match shown {
                Shown::Median => of_metric(cell, range),
                Shown::Wrong => of_share(&cell.wrong, (FEW_WRONG, MANY_WRONG)),
                Shown::Aborted => of_share(&cell.aborted, (LEAST, MANY_ABORTED)),
            };
            tiles.push(FigureTile {
                x: (to_x * map.x.edges[column], to_x * map.x.edges[column + 1]),
                y: (to_y * map.y.edges[row], to_y * map.y.edges[row + 1]),
                colour,
                label,
                framed: cell.trusted && shown == Shown::Wrong,
            });
        }
    }
    let inside = |(at, value): &(f64, f64)| x.contains(to_x * at) && y.contains(to_y * value);
    let line: Vec<_> = plan.line.iter().filter(|point| inside(point)).map(|(at, v)| (to_x * at, to_y * v)).collect();
    let mut figure = Figure::new(format!("map of {name}"), Size::Third, x.clone(), y.clone()).tiles(tiles);
    if !line.is_empty() {
        figure = figure.line(line, colour::LIMIT, 1.6);
    }
    figure.svg()
}

/// Least and greatest median over the maps of all variants.
pub(crate) fn medians<'a>(maps: impl Iterator<Item = &'a Map>) -> (f64, f64) {
    let values = maps.flat_map(|map| map.cells.iter().flatten()).filter_map(|cell| cell.median);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)))
}

fn axis(bands: &Bands) -> (Axis, f64) {
    let (lo, hi) = (bands.edges[0], bands.edges[bands.edges.len() - 1]);
    let (factor, unit) = shown_in(bands.field.unit, hi);
    let label = axis_label(&bands.field.name.replace('_', " "), unit);
    (Axis::scaled(label, factor * lo, factor * hi, bands.logarithmic), factor)
}

fn of_share(share: &Share, (few, many): ([f64; 3], [f64; 3])) -> (RGBColor, String) {
    match share.cases {
        0 => (EMPTY, String::new()),
        cases => {
            let share = share.count as f64 / cases as f64;
            // The root shows differences among the small shares, which decide on trust.
            (between(few, many, share.sqrt()), format!("{:.0}", 100.0 * share))
        }
    }
}

fn of_metric(cell: &MapCell, (lo, hi): (f64, f64)) -> (RGBColor, String) {
    let Some(median) = cell.median else { return (EMPTY, String::new()) };
    let share = if hi > lo { (median - lo) / (hi - lo) } else { 0.0 };
    (between(LEAST, GREATEST, share), significant(median, 2))
}

fn between(from: [f64; 3], to: [f64; 3], share: f64) -> RGBColor {
    let mix = |index: usize| (from[index] + share.clamp(0.0, 1.0) * (to[index] - from[index])).round() as u8;
    RGBColor(mix(0), mix(1), mix(2))
}
