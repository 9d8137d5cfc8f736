//! Maps of outcomes: a dot for each run over two inputs, coloured by what became of it, with lines to compare it with.

use plotters::style::RGBColor;
use serde::Serialize;
use softdock_campaign::compare::Bands;
use softdock_campaign::outcome_map::OutcomeMap;
use softdock_results::columns::{NO_CAUSE, input};

use crate::Result;
use crate::causes::cause_text;
use crate::number::{axis_label, grouped, shown_in};
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};
use crate::plots::sample::Sample;

/// Dots of each colour, at most.
const MOST_DOTS: usize = 4_000;

/// Colours of the causes, the most frequent first; what is left over has the last.
const CAUSES: [RGBColor; 6] = {
    let [_, blue, vermilion, _, pink, orange, _, violet] = colour::VARIANTS;
    [vermilion, blue, pink, orange, violet, colour::TRUE_FAIL]
};

/// Colours of the lines.
const LINES: [RGBColor; 3] = [colour::LIMIT, RGBColor(0x99, 0x22, 0x22), RGBColor(0x22, 0x55, 0x99)];

/// A map in both loops.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct OutcomeFigures {
    title: String,
    /// Colours of dots and lines, the same in both loops.
    dots: Vec<KeyEntry>,
    lines: Vec<KeyEntry>,
    figures: Vec<Drawing>,
}

/// A colour with its meaning.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct KeyEntry {
    colour: String,
    text: String,
}

impl KeyEntry {
    fn new(colour: RGBColor, text: String) -> Self {
        let RGBColor(red, green, blue) = colour;
        Self { colour: format!("#{red:02x}{green:02x}{blue:02x}"), text }
    }
}

/// The figures of a map, in space and on the facility.
pub(crate) fn outcome_figures(sample: &Sample, map: &OutcomeMap) -> Result<OutcomeFigures> {
    let causes = causes(sample);
    let colour_of = |cause: &str| match causes.iter().position(|own| own == cause) {
        None => colour::TRUE_PASS,
        Some(place) => CAUSES[place.min(CAUSES.len() - 1)],
    };
    let mut dots = vec![KeyEntry::new(colour::TRUE_PASS, "pass".to_owned())];
    dots.extend(causes.iter().map(|cause| KeyEntry::new(colour_of(cause), cause_text(cause, None))));
    let coloured = || map.lines.iter().zip(LINES.into_iter().cycle());
    let mut figures = Vec::new();
    for (side, place) in [(0, "in space"), (1, "on the facility")] {
        let runs = points(sample, map, side);
        let mut figure = Figure::new(format!("{}, {place}", map.title), Size::Half, axis(&map.x).0, axis(&map.y).0);
        let mut counts = Vec::new();
        for cause in [NO_CAUSE].into_iter().chain(causes.iter().map(String::as_str)) {
            let own: Vec<(f64, f64)> = runs.iter().filter(|(_, own)| *own == cause).map(|(at, _)| *at).collect();
            let name = if cause == NO_CAUSE { "pass".to_owned() } else { format!("`{cause}`") };
            counts.push(format!("{} {name}", grouped(own.len() as u64)));
            let stride = own.len().div_ceil(MOST_DOTS).max(1);
            figure = figure.points(own.into_iter().step_by(stride).collect(), colour_of(cause), 2.6, 0.85);
        }
        for (line, colour) in coloured() {
            for piece in inside(map, &line.points) {
                figure = figure.line(piece, colour, 1.6);
            }
        }
        let caption = format!("{}: {}.", place[..1].to_uppercase() + &place[1..], counts.join(", "));
        figures.push(Drawing { svg: figure.svg()?, caption });
    }
    let lines = coloured().map(|(line, colour)| KeyEntry::new(colour, line.name.clone())).collect();
    Ok(OutcomeFigures { title: map.title.clone(), dots, lines, figures })
}

/// All causes of runs that do not pass in either loop, the most frequent first.
fn causes(sample: &Sample) -> Vec<String> {
    let mut found: Vec<(&str, usize)> = Vec::new();
    for cause in sample.causes.iter().flatten().map(String::as_str).filter(|cause| *cause != NO_CAUSE) {
        match found.iter_mut().find(|(own, _)| *own == cause) {
            Some((_, count)) => *count += 1,
            None => found.push((cause, 1)),
        }
    }
    found.sort_by(|one, two| two.1.cmp(&one.1).then(one.0.cmp(two.0)));
    found.into_iter().map(|(cause, _)| cause.to_owned()).collect()
}

/// Places of the kept runs in the map, with their causes.
fn points<'a>(sample: &'a Sample, map: &OutcomeMap, side: usize) -> Vec<((f64, f64), &'a str)> {
    let values = |bands: &Bands| {
        let column = input(&bands.field);
        let found = sample.inputs.iter().find(|own| own.column == column.name());
        (found.map(|own| own.values.as_slice()).unwrap_or_default(), axis(bands).1)
    };
    let ((x, to_x), (y, to_y)) = (values(&map.x), values(&map.y));
    let causes = sample.causes[side].iter().map(String::as_str);
    x.iter().zip(y).map(|(x, y)| (to_x * x, to_y * y)).zip(causes).collect()
}

/// Pieces of a line that lie in the map.
fn inside(map: &OutcomeMap, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let ((x, to_x), (y, to_y)) = (axis(&map.x), axis(&map.y));
    let shown: Vec<(f64, f64)> = points.iter().map(|(at, value)| (to_x * at, to_y * value)).collect();
    let pieces = shown.split(|(at, value)| !(x.contains(*at) && y.contains(*value)));
    pieces.filter(|piece| piece.len() > 1).map(<[_]>::to_vec).collect()
}

fn axis(bands: &Bands) -> (Axis, f64) {
    let (lo, hi) = (bands.edges[0], bands.edges[bands.edges.len() - 1]);
    let (factor, unit) =
        if bands.field.unit == "rad" { (1f64.to_degrees(), "deg") } else { shown_in(bands.field.unit, hi) };
    let label = axis_label(&bands.field.name.replace('_', " "), unit);
    (Axis::scaled(label, factor * lo, factor * hi, bands.logarithmic), factor)
}
