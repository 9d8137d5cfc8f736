//! A drawing to scale: views with axes in metres, shapes, and labels that keep clear of each other.

use std::fmt::Write;

use softdock_kernels::vector::Vec3;

use crate::number::significant;
use crate::plots::axis::linear_ticks;
use crate::plots::figure::{RGBColor, colour};

/// Size of small and of normal letters, px.
const SMALL: f64 = 11.0;
const NORMAL: f64 = 13.0;

/// Width of a letter over its size, on average.
const LETTER: f64 = 0.56;

/// A rectangle on the page, px: left, top, right, bottom.
type Frame = [f64; 4];

/// Two axes of the contact frame that a view shows, to the right and upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plane {
    /// x and z, seen along +y.
    Side,
    /// x and y, seen along -z.
    Top,
}

impl Plane {
    /// Coordinates of a point in the view \[m\].
    pub(crate) fn project(self, point: Vec3<f64>) -> [f64; 2] {
        match self {
            Self::Side => [point.x, point.z],
            Self::Top => [point.x, point.y],
        }
    }

    /// Direction towards the viewer.
    pub(crate) fn normal(self) -> Vec3<f64> {
        match self {
            Self::Side => Vec3 { x: 0.0, y: -1.0, z: 0.0 },
            Self::Top => Vec3 { x: 0.0, y: 0.0, z: 1.0 },
        }
    }

    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Side => ["x [m]", "z [m]"],
            Self::Top => ["x [m]", "y [m]"],
        }
    }
}

/// How a shape is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    pub(crate) stroke: RGBColor,
    pub(crate) width: f64,
    /// Colour and opacity of the area.
    pub(crate) fill: Option<(RGBColor, f64)>,
    pub(crate) is_dashed: bool,
}

impl Pen {
    /// A solid line.
    pub(crate) fn line(stroke: RGBColor, width: f64) -> Self {
        Self { stroke, width, fill: None, is_dashed: false }
    }

    /// The same with a filled area.
    pub(crate) fn filled(self, opacity: f64) -> Self {
        Self { fill: Some((self.stroke, opacity)), ..self }
    }

    /// The same dashed.
    pub(crate) fn dashed(self) -> Self {
        Self { is_dashed: true, ..self }
    }

    fn attributes(&self) -> String {
        let fill = self.fill.map_or_else(
            || "fill=\"none\"".to_owned(),
            |(fill, opacity)| format!("fill=\"{}\" fill-opacity=\"{opacity}\"", hex(fill)),
        );
        let dash = if self.is_dashed { " stroke-dasharray=\"4 3\"" } else { "" };
        let stroke = if self.width > 0.0 { hex(self.stroke) } else { "none".to_owned() };
        format!("{fill} stroke=\"{stroke}\" stroke-width=\"{}\" stroke-linejoin=\"round\"{dash}", self.width)
    }
}

/// Letters at a place of the page, px.
pub(crate) fn text(out: &mut String, [x, y]: [f64; 2], size: f64, ink: RGBColor, text: &str) {
    let (ink, text) = (hex(ink), escaped(text));
    let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" fill=\"{ink}\">{text}</text>");
}

/// A line or an area through places of the page, px.
pub(crate) fn path(out: &mut String, places: &[[f64; 2]], is_closed: bool, pen: &Pen) {
    let places: Vec<String> = places.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
    let close = if is_closed { "Z" } else { "" };
    let _ = writeln!(out, "<path d=\"M{}{close}\" {}/>", places.join("L"), pen.attributes());
}

/// A circle at a place of the page, px; `class` names what it stands for.
pub(crate) fn circle(out: &mut String, [x, y]: [f64; 2], radius: f64, pen: &Pen, class: &str) {
    let class = if class.is_empty() { String::new() } else { format!("class=\"{class}\" ") };
    let attributes = pen.attributes();
    let _ = writeln!(out, "<circle {class}cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" {attributes}/>");
}

/// An arrow between two places of the page, px.
pub(crate) fn arrow(out: &mut String, from: [f64; 2], to: [f64; 2], pen: &Pen) {
    let step = [to[0] - from[0], to[1] - from[1]];
    let length = step[0].hypot(step[1]);
    if length < 1.0 {
        return;
    }
    let head = (0.35 * length).min(8.0);
    let along = [step[0] / length * head, step[1] / length * head];
    let wing = |side: f64| [to[0] - along[0] - 0.45 * side * along[1], to[1] - along[1] + 0.45 * side * along[0]];
    path(out, &[from, to], false, pen);
    path(out, &[wing(1.0), to, wing(-1.0)], false, pen);
}

/// The whole file from its elements.
pub(crate) fn svg_file(title: &str, [width, height]: [f64; 2], body: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" \
         height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" role=\"img\">\n\
         <title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{body}</svg>\n",
        escaped(title)
    )
}

/// A view to scale; what is drawn in it is cut at its frame.
#[derive(Debug)]
pub(crate) struct View {
    /// Frame, grid, ticks and names of the axes.
    axes: String,
    /// Elements in the order in which they are drawn.
    body: String,
    /// The plane that it shows.
    pub(crate) plane: Plane,
    frame: Frame,
    /// Coordinates at the lower left corner \[m\].
    origin: [f64; 2],
    /// Pixels per metre.
    scale: f64,
    /// Rectangles that labels keep clear of.
    taken: Vec<Frame>,
    labels: Vec<([f64; 2], String, RGBColor)>,
}

impl View {
    /// An empty view with its axes; the point `middle` (metres) lies in the middle of the frame.
    pub(crate) fn new(plane: Plane, frame: Frame, middle: [f64; 2], scale: f64) -> Self {
        let [left, top, right, bottom] = frame;
        let half = [0.5 * (right - left) / scale, 0.5 * (bottom - top) / scale];
        let origin = [middle[0] - half[0], middle[1] - half[1]];
        let (axes, body, taken, labels) = Default::default();
        let mut view = Self { axes, body, plane, frame, origin, scale, taken, labels };
        view.draw_axes([2.0 * half[0], 2.0 * half[1]]);
        view
    }

    /// Frame, grid, ticks and names of the axes.
    fn draw_axes(&mut self, span: [f64; 2]) {
        let [left, top, right, bottom] = self.frame;
        let (grid, ink) = (Pen::line(colour::GRID, 0.8), colour::TEXT);
        let ticks = |axis: usize, pixels: f64| {
            let (lo, hi) = (self.origin[axis], self.origin[axis] + span[axis]);
            let inside = move |tick: &f64| (lo..=hi).contains(tick);
            linear_ticks(lo, hi, ((pixels / 60.0) as usize).max(3)).into_iter().filter(inside).collect::<Vec<_>>()
        };
        let [across, up] = [ticks(0, right - left), ticks(1, bottom - top)];
        for tick in across {
            let (x, label) = (left + (tick - self.origin[0]) * self.scale, number(tick));
            path(&mut self.axes, &[[x, top], [x, bottom]], false, &grid);
            text(&mut self.axes, [x - 0.5 * width_of(&label), bottom + 14.0], SMALL, ink, &label);
        }
        for tick in up {
            let (y, label) = (bottom - (tick - self.origin[1]) * self.scale, number(tick));
            path(&mut self.axes, &[[left, y], [right, y]], false, &grid);
            text(&mut self.axes, [left - 6.0 - width_of(&label), y + 4.0], SMALL, ink, &label);
        }
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        path(&mut self.axes, &corners, true, &Pen::line(colour::FRAME, 0.9));
        let [across, up] = self.plane.names();
        text(&mut self.axes, [0.5 * (left + right) - 0.5 * width_of(across), bottom + 30.0], SMALL, ink, across);
        text(&mut self.axes, [left - 50.0, top - 8.0], SMALL, ink, up);
    }

    /// Place on the page of a point in the contact frame, px.
    pub(crate) fn at(&self, point: Vec3<f64>) -> [f64; 2] {
        let [across, up] = self.plane.project(point);
        let [left, _, _, bottom] = self.frame;
        [left + (across - self.origin[0]) * self.scale, bottom - (up - self.origin[1]) * self.scale]
    }

    /// Length in the scene of so many pixels \[m\].
    pub(crate) fn metres(&self, pixels: f64) -> f64 {
        pixels / self.scale
    }

    /// A line or an area through points of the contact frame.
    pub(crate) fn path(&mut self, points: &[Vec3<f64>], is_closed: bool, pen: &Pen) {
        let places: Vec<_> = points.iter().map(|point| self.at(*point)).collect();
        path(&mut self.body, &places, is_closed, pen);
        if pen.width > 0.0 {
            places.windows(2).for_each(|ends| self.keep_clear(ends[0], ends[1]));
        }
    }

    /// Labels keep clear of a line, px.
    fn keep_clear(&mut self, from: [f64; 2], to: [f64; 2]) {
        const STEP: f64 = 6.0;
        let steps = ((to[0] - from[0]).hypot(to[1] - from[1]) / STEP).ceil().clamp(1.0, 1e3) as u32;
        for step in 0..=steps {
            let share = f64::from(step) / f64::from(steps);
            let [x, y] = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            self.taken.push([x - 1.5, y - 1.5, x + 1.5, y + 1.5]);
        }
    }

    /// A sphere to scale, at least a dot; labels keep clear of it.
    pub(crate) fn sphere(&mut self, centre: Vec3<f64>, radius: f64, pen: &Pen, class: &str) {
        let ([x, y], radius) = (self.at(centre), (radius * self.scale).max(1.5));
        circle(&mut self.body, [x, y], radius, pen, class);
        let half = 0.7 * radius;
        self.taken.push([x - half, y - half, x + half, y + half]);
    }

    /// A dot of so many pixels; labels keep clear of it.
    pub(crate) fn dot(&mut self, point: Vec3<f64>, radius: f64, pen: &Pen) {
        let [x, y] = self.at(point);
        circle(&mut self.body, [x, y], radius, pen, "");
        self.taken.push([x - radius, y - radius, x + radius, y + radius]);
    }

    /// An arrow of so many pixels from a point along a direction of the contact frame; shorter where it is inclined.
    pub(crate) fn arrow(&mut self, from: Vec3<f64>, direction: Vec3<f64>, length: f64, pen: &Pen) {
        let [x, y] = self.at(from);
        let [across, up] = self.plane.project(direction);
        let to = [x + across * length, y - up * length];
        arrow(&mut self.body, [x, y], to, pen);
        let (low, high) = ([x.min(to[0]), y.min(to[1])], [x.max(to[0]), y.max(to[1])]);
        self.taken.push([low[0] - 2.0, low[1] - 2.0, high[0] + 2.0, high[1] + 2.0]);
    }

    /// A label next to a point; it is placed when the view is finished.
    pub(crate) fn label(&mut self, point: Vec3<f64>, label: impl Into<String>, ink: RGBColor) {
        let at = self.at(point);
        self.labels.push((at, label.into(), ink));
    }

    /// The view as elements of the page, cut at its frame, with all labels placed.
    pub(crate) fn finish(mut self, heading: &str, index: usize) -> String {
        let [left, top, right, bottom] = self.frame;
        for (at, label, ink) in std::mem::take(&mut self.labels) {
            self.place_label(at, &label, ink);
        }
        let mut out = String::new();
        text(&mut out, [left, top - 8.0], NORMAL, colour::TEXT, heading);
        let (width, height) = (right - left, bottom - top);
        let (axes, inside) = (&self.axes, &self.body);
        out + &format!(
            "{axes}<clipPath id=\"view{index}\"><rect x=\"{left}\" y=\"{top}\" width=\"{width}\" \
             height=\"{height}\"/></clipPath>\n<g clip-path=\"url(#view{index})\">\n{inside}</g>\n"
        )
    }

    /// Draws a label where it covers least: around its point, near ones first.
    fn place_label(&mut self, [x, y]: [f64; 2], label: &str, ink: RGBColor) {
        let (width, height) = (width_of(label), SMALL);
        let [left, top, right, bottom] = self.frame;
        let box_at = |dx: f64, dy: f64, gap: f64| {
            // The box touches a circle of radius `gap` in the direction (dx, dy).
            let middle = [x + dx * (gap + 0.5 * width), y + dy * (gap + 0.5 * height)];
            [middle[0] - 0.5 * width, middle[1] - 0.5 * height, middle[0] + 0.5 * width, middle[1] + 0.5 * height]
        };
        let sides =
            [(1.0, 0.0), (1.0, -1.0), (0.0, -1.0), (-1.0, -1.0), (-1.0, 0.0), (-1.0, 1.0), (0.0, 1.0), (1.0, 1.0)];
        let gaps = [7.0, 14.0, 22.0, 32.0, 44.0, 58.0];
        let places = gaps.iter().flat_map(|gap| sides.iter().map(|(dx, dy)| box_at(*dx, *dy, *gap)));
        let cost = |place: &Frame| {
            let covered: f64 = self.taken.iter().map(|taken| shared(place, taken)).sum();
            let outside =
                place[0] < left + 2.0 || place[1] < top + 2.0 || place[2] > right - 2.0 || place[3] > bottom - 2.0;
            covered + if outside { 1e6 } else { 0.0 }
        };
        let best =
            places.map(|place| (cost(&place), place)).reduce(|best, next| if next.0 < best.0 { next } else { best });
        let Some((_, place)) = best else { return };
        let nearest = [x.clamp(place[0], place[2]), y.clamp(place[1], place[3])];
        if (nearest[0] - x).hypot(nearest[1] - y) > 16.0 {
            path(&mut self.body, &[[x, y], nearest], false, &Pen::line(colour::FRAME, 0.6));
        }
        let (place_left, baseline, words) = (place[0], place[3] - 2.0, escaped(label));
        // A white seam keeps the letters apart from the lines behind them.
        for paint in [
            "fill=\"none\" stroke=\"#ffffff\" stroke-width=\"3\" aria-hidden=\"true\"".to_owned(),
            format!("fill=\"{}\"", hex(ink)),
        ] {
            let _ = writeln!(
                self.body,
                "<text x=\"{place_left:.1}\" y=\"{baseline:.1}\" font-size=\"{SMALL}\" {paint}>{words}</text>"
            );
        }
        self.taken.push(place);
    }
}

/// Area that two rectangles share, px^2.
fn shared(one: &Frame, two: &Frame) -> f64 {
    let length = |axis: usize| (one[axis + 2].min(two[axis + 2]) - one[axis].max(two[axis])).max(0.0);
    length(0) * length(1)
}

/// Width of a label, px.
fn width_of(label: &str) -> f64 {
    label.chars().count() as f64 * SMALL * LETTER
}

/// A tick as text; rounding of the tick's step is no digit.
fn number(tick: f64) -> String {
    if tick.abs() < 1e-9 { "0".to_owned() } else { significant(tick, 4) }
}

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Text inside an XML element.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
