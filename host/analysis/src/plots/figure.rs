//! A thin figure: axes and layers, drawn by plotters as SVG that stands inside a page.

use plotters::coord::cartesian::Cartesian2d;
use plotters::prelude::{
    ChartBuilder, ChartContext, Circle, Color, IntoDrawingArea, IntoFont, PathElement, Polygon, Rectangle, SVGBackend,
    ShapeStyle, Text,
};
pub use plotters::style::RGBColor;
use plotters::style::TextStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::plots::axis::Axis;
use crate::{AnalysisError, Result};

/// Plotters places at whole pixels: it draws so many times larger, and the page scales back.
const SCALE: u32 = 4;

/// Colours that remain distinct for colour-blind readers and in grey print (Okabe and Ito; Tol).
pub mod colour {
    use super::RGBColor;
    /// The loop in space; what is measured.
    pub const SPACE: RGBColor = RGBColor(0x00, 0x72, 0xB2);
    /// The loop on the facility; what a model predicts.
    pub const FACILITY: RGBColor = RGBColor(0xD5, 0x5E, 0x00);
    /// Only the facility passes.
    pub const FALSE_PASS: RGBColor = RGBColor(0xAA, 0x33, 0x77);
    /// Both fail.
    pub const TRUE_FAIL: RGBColor = RGBColor(0xA0, 0xA0, 0xA0);
    /// Frame of what is to be trusted.
    pub const TRUSTED: RGBColor = RGBColor(0x00, 0x7A, 0x5A);
    /// Facilities side by side.
    pub const VARIANTS: [RGBColor; 8] = [
        RGBColor(0x22, 0x22, 0x22),
        RGBColor(0x00, 0x72, 0xB2),
        RGBColor(0xD5, 0x5E, 0x00),
        RGBColor(0x00, 0x9E, 0x73),
        RGBColor(0xCC, 0x79, 0xA7),
        RGBColor(0xE6, 0x9F, 0x00),
        RGBColor(0x56, 0xB4, 0xE9),
        RGBColor(0x7F, 0x3C, 0x8D),
    ];
    /// Limits.
    pub const LIMIT: RGBColor = RGBColor(0x22, 0x22, 0x22);
    /// Grid lines.
    pub const GRID: RGBColor = RGBColor(0xE6, 0xE6, 0xE3);
    /// Frame.
    pub const FRAME: RGBColor = RGBColor(0x8A, 0x8A, 0x86);
    /// Letters on dark ground.
    pub const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);
    /// Letters.
    pub const TEXT: RGBColor = RGBColor(0x33, 0x33, 0x33);
}

/// Width and height of a figure on the page, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// The page's width.
    Wide,
    /// Two side by side.
    Half,
    /// Three side by side.
    Third,
}

impl Size {
    fn pixels(self) -> (u32, u32) {
        match self {
            Self::Wide => (1_000, 340),
            Self::Half => (490, 270),
            Self::Third => (320, 215),
        }
    }
}

/// One thing drawn between the axes, in data units.
#[derive(Clone, Debug)]
enum Layer {
    Line { points: Vec<(f64, f64)>, colour: RGBColor, width: f64 },
    Area { outline: Vec<(f64, f64)>, colour: RGBColor, opacity: f64 },
    Bars { bars: Vec<(f64, f64, f64)>, colour: RGBColor, opacity: f64 },
    Points { points: Vec<(f64, f64)>, colour: RGBColor, radius: f64, opacity: f64 },
    Tiles { tiles: Vec<FigureTile> },
}

/// A rectangle of a map with its number in it.
#[derive(Clone, Debug)]
pub struct FigureTile {
    /// Left and right end.
    pub x: (f64, f64),
    /// Lower and upper end.
    pub y: (f64, f64),
    /// Fill.
    pub colour: RGBColor,
    /// What stands in it.
    pub label: String,
    /// Whether it is framed.
    pub framed: bool,
}

impl FigureTile {
    /// Letters that can be read on the fill.
    fn ink(&self) -> &'static RGBColor {
        let RGBColor(r, g, b) = self.colour;
        let light = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        if light > 140.0 { &colour::TEXT } else { &colour::PAPER }
    }
}

/// A figure under construction.
#[derive(Clone, Debug)]
pub struct Figure {
    title: String,
    size: Size,
    x: Axis,
    y: Axis,
    layers: Vec<Layer>,
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

impl Figure {
    /// An empty figure; the title is for screen readers and error messages, the caption stands on the page.
    pub fn new(title: impl Into<String>, size: Size, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), size, x, y, layers: Vec::new() }
    }

    /// A line through points.
    pub fn line(mut self, points: Vec<(f64, f64)>, colour: RGBColor, width: f64) -> Self {
        self.layers.push(Layer::Line { points, colour, width });
        self
    }

    /// A filled area between a lower and an upper line: x, lower, upper.
    pub fn band(mut self, points: &[(f64, f64, f64)], colour: RGBColor, opacity: f64) -> Self {
        let upper = points.iter().map(|(x, _, hi)| (*x, *hi));
        let lower = points.iter().rev().map(|(x, lo, _)| (*x, *lo));
        self.layers.push(Layer::Area { outline: upper.chain(lower).collect(), colour, opacity });
        self
    }

    /// Bars from the x axis: left, right, height.
    pub fn bars(mut self, bars: Vec<(f64, f64, f64)>, colour: RGBColor, opacity: f64) -> Self {
        self.layers.push(Layer::Bars { bars, colour, opacity });
        self
    }

    /// Dots.
    pub fn points(mut self, points: Vec<(f64, f64)>, colour: RGBColor, radius: f64, opacity: f64) -> Self {
        self.layers.push(Layer::Points { points, colour, radius, opacity });
        self
    }

    /// Rectangles with their numbers.
    pub fn tiles(mut self, tiles: Vec<FigureTile>) -> Self {
        self.layers.push(Layer::Tiles { tiles });
        self
    }

    /// The figure as an inline SVG element.
    pub fn svg(&self) -> Result<String> {
        let (width, height) = self.size.pixels();
        let mut out = String::new();
        self.draw(&mut out, (width * SCALE, height * SCALE))
            .map_err(|error| AnalysisError::Figure { figure: self.title.clone(), what: error.to_string() })?;
        Ok(inline(&out, &self.title, width))
    }

    fn draw(&self, out: &mut String, pixels: (u32, u32)) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let root = SVGBackend::with_string(out, pixels).into_drawing_area();
        let y_labels = if self.size == Size::Third { 46 } else { 58 };
        let mut chart = ChartBuilder::on(&root)
            .margin_top(10 * SCALE)
            .margin_right(14 * SCALE)
            .x_label_area_size(36 * SCALE)
            .y_label_area_size(y_labels * SCALE)
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        let (x_ticks, y_ticks) = match self.size {
            Size::Wide => (10, 6),
            Size::Half => (6, 6),
            Size::Third => (4, 5),
        };
        let font = |size: f64| ("sans-serif", size * f64::from(SCALE) * FONT_FACTOR).into_font().color(&colour::TEXT);
        chart
            .configure_mesh()
            .x_labels(x_ticks)
            .y_labels(y_ticks)
            .max_light_lines(0)
            .bold_line_style(stroke(colour::GRID, 0.8))
            .axis_style(stroke(colour::FRAME, 0.9))
            .label_style(font(10.5))
            .axis_desc_style(font(11.5))
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .set_all_tick_mark_size(3 * SCALE)
            .draw()?;
        for layer in &self.layers {
            self.draw_layer(&mut chart, layer)?;
        }
        drop(chart);
        root.present()?;
        Ok(())
    }

    fn draw_layer(&self, chart: &mut Chart, layer: &Layer) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let inside = |(x, y): &(f64, f64)| self.x.contains(*x) && self.y.contains(*y);
        match layer {
            Layer::Line { points, colour, width } => {
                chart.draw_series([PathElement::new(points.clone(), stroke(*colour, *width))])?;
            }
            Layer::Area { outline, colour, opacity } => {
                chart.draw_series([Polygon::new(outline.clone(), colour.mix(*opacity).filled())])?;
            }
            Layer::Bars { bars, colour, opacity } => {
                let style = colour.mix(*opacity).filled();
                let bars = bars.iter().filter(|(.., height)| *height > 0.0);
                chart.draw_series(bars.map(|(x0, x1, height)| Rectangle::new([(*x0, 0.0), (*x1, *height)], style)))?;
            }
            Layer::Points { points, colour, radius, opacity } => {
                let style = colour.mix(*opacity).filled();
                let radius = (radius * f64::from(SCALE)).round() as u32;
                let dots = points.iter().filter(|point| inside(point));
                chart.draw_series(dots.map(|point| Circle::new(*point, radius, style)))?;
            }
            Layer::Tiles { tiles } => {
                let corners = |tile: &FigureTile| [(tile.x.0, tile.y.0), (tile.x.1, tile.y.1)];
                chart.draw_series(tiles.iter().map(|tile| Rectangle::new(corners(tile), tile.colour.filled())))?;
                let framed = tiles.iter().filter(|tile| tile.framed);
                let frame = stroke(colour::TRUSTED, 2.2);
                chart.draw_series(framed.map(|tile| Rectangle::new(corners(tile), frame)))?;
                chart.draw_series(tiles.iter().map(|tile| self.tile_label(tile)))?;
            }
        }
        Ok(())
    }

    /// The number of a tile, in its middle.
    fn tile_label(&self, tile: &FigureTile) -> Text<'static, (f64, f64), String> {
        let middle = (self.x.middle(tile.x), self.y.middle(tile.y));
        let font = ("sans-serif", 9.5 * f64::from(SCALE) * FONT_FACTOR).into_font();
        let style = TextStyle::from(font).color(tile.ink()).pos(Pos::new(HPos::Center, VPos::Center));
        Text::new(tile.label.clone(), middle, style)
    }
}

/// Plotters divides font sizes by this when it writes SVG.
const FONT_FACTOR: f64 = 1.24;

fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * f64::from(SCALE)).round() as u32)
}

/// Strips what only a file of its own needs, so that the element scales with the page and names no address.
fn inline(svg: &str, title: &str, width: u32) -> String {
    let body = svg.find("viewBox").and_then(|at| svg[at..].find('>').map(|end| (at, at + end)));
    let Some((start, end)) = body else { return svg.to_owned() };
    let view = svg[start..end].split(" xmlns").next().unwrap_or_default();
    let title = title.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    format!("<svg {view} style=\"width:{width}px\" role=\"img\" aria-label=\"{title}\"{}", &svg[end..])
}
