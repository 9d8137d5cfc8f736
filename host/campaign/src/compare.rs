//! How the variants of a campaign are compared: bands along a parameter, metrics, maps, and what is to be trusted.

use crate::check::Checker;
use crate::derived::Derived;
use crate::dispersion::Dispersion;
use crate::distribution::Distribution;
use crate::expression::{self, Bounds, Expression};
use crate::ranges::legal;
use crate::suggest::suggestion;
use crate::written::At;
use crate::written::campaign::CampaignFile;
use crate::written::compare::{CompareTable, MapTable};
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::range::Range;

/// Bands and cells unless the file states another.
const BANDS: usize = 8;
const CELLS: [u64; 2] = [6, 6];
const SLICES: u64 = 3;

/// Rate of wrong verdicts up to which a cell counts as valid unless the file states another.
const TRUST: f64 = 0.1;

/// Points of a line in a map.
const LINE_POINTS: usize = 200;

/// What the comparison page shows besides the verdicts.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Bands of a parameter.
    pub along: Option<Bands>,
    /// Metrics of the facility's loop: names and units.
    pub metrics: Vec<(String, &'static str)>,
    /// Greatest rate of wrong verdicts with which a cell is trusted.
    pub trust: f64,
    /// Maps over two parameters.
    pub maps: Vec<CellMap>,
}

impl Default for Comparison {
    fn default() -> Self {
        Self { along: None, metrics: Vec::new(), trust: TRUST, maps: Vec::new() }
    }
}

/// A parameter cut into bands.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    /// The parameter.
    pub field: Field,
    /// Ends of the bands, ascending, SI.
    pub edges: Vec<f64>,
    /// Whether it is shown on a logarithmic axis.
    pub logarithmic: bool,
}

impl Bands {
    /// The value at a share of the way from end to end, on the scale on which it is shown.
    pub(crate) fn between(&self, share: f64) -> f64 {
        let (min, max) = (self.edges[0], self.edges[self.edges.len() - 1]);
        if self.logarithmic { min * (max / min).powf(share) } else { min + share * (max - min) }
    }
}

/// A map of cells over two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct CellMap {
    /// Along the horizontal axis.
    pub x: Bands,
    /// Along the vertical axis.
    pub y: Bands,
    /// Parameter to whose band the runs of the map are confined.
    pub slice: Option<Bands>,
    /// Metric whose median is mapped, and its unit; without one the share of wrong verdicts.
    pub metric: Option<(String, &'static str)>,
    /// A line in the map.
    pub line: Vec<(f64, f64)>,
    /// What the line is.
    pub line_name: String,
}

/// What of a campaign can stand on an axis, and the values of all else there.
pub(crate) struct Axes<'a> {
    /// The parameters and, behind them, the campaign's variables.
    pub(crate) fields: &'a [Field],
    /// Number of parameters.
    pub(crate) parameters: usize,
    pub(crate) dispersions: &'a [Dispersion],
    pub(crate) derived: &'a [Derived],
    /// Undispersed value of every field.
    pub(crate) undispersed: Vec<f64>,
    /// Least and greatest value of every field.
    pub(crate) bounds: &'a [Bounds],
}

/// Reads the table; without it the comparison shows verdicts alone.
pub(crate) fn read(c: &mut Checker, file: &CampaignFile, axes: &Axes) -> Comparison {
    let Some(written) = &file.compare else { return Comparison::default() };
    if file.variant.is_empty() {
        c.refuse(
            &written.span,
            "there is nothing to compare",
            "remove [compare], or add a [[variant]] for each facility",
        );
    }
    let table = &written.value;
    Comparison {
        along: along(c, table, axes),
        metrics: table.metrics.iter().filter_map(|name| metric(c, name)).collect(),
        trust: c.number_or(&table.trust, TRUST, "1", Range::above(0.0, 1.0)),
        maps: table.map.iter().flat_map(|map| cell_maps(c, map, axes).unwrap_or_default()).collect(),
    }
}

fn along(c: &mut Checker, table: &CompareTable, axes: &Axes) -> Option<Bands> {
    let Some(name) = &table.along else {
        if let Some(edges) = &table.edges {
            c.refuse(&edges.span, "the parameter of these bands is missing", "add along = \"loop_delay\"");
        }
        return None;
    };
    let mut bands = bands(c, name, BANDS, axes)?;
    if let Some(written) = &table.edges {
        let range = legal(&bands.field.name);
        bands.edges = written.value.iter().map(|edge| c.number(edge, bands.field.unit, range)).collect();
        if bands.edges.len() < 2 || bands.edges.windows(2).any(|pair| pair[0] >= pair[1]) {
            c.refuse(
                &written.span,
                "these are no ends of bands",
                "write two or more values, each above the one before",
            );
        }
    }
    Some(bands)
}

/// So many bands of a dispersed parameter, even on the scale on which it is drawn.
pub(crate) fn bands(c: &mut Checker, name: &At<String>, count: usize, axes: &Axes) -> Option<Bands> {
    let dispersed: Vec<&Dispersion> = axes.dispersions.iter().filter(|d| d.field < axes.parameters).collect();
    let found = dispersed.iter().find(|dispersion| dispersion.name == name.value);
    let derived = axes.derived.iter().find(|derived| derived.name == name.value && derived.field < axes.parameters);
    let (field, min, max) = match (found, derived) {
        (Some(found), _) => {
            let reach = |share: f64| found.distribution.quantile(share);
            let (min, max) = match found.distribution {
                // The ends of distributions without bounds hold nothing.
                Distribution::Normal { .. } => (reach(0.005), reach(0.995)),
                Distribution::Weibull { min, .. } => (min, reach(0.995)),
                _ => found.distribution.reach(),
            };
            (found.field, min, max)
        }
        (None, Some(derived)) => {
            let Bounds { least, greatest } = axes.bounds[derived.field];
            (derived.field, least, greatest)
        }
        (None, None) => {
            let names = dispersed.iter().map(|dispersion| dispersion.name.as_str());
            let names: Vec<&str> = names.chain(axes.derived.iter().map(|derived| derived.name.as_str())).collect();
            c.refuse(&name.span, format!("`{}` is not dispersed", name.value), suggestion(&name.value, &names));
            return None;
        }
    };
    if min >= max {
        c.refuse(&name.span, format!("`{}` is always the same", name.value), "name a parameter that varies");
        return None;
    }
    let logarithmic = min > 0.0 && max / min >= 5.0;
    let whole = Bands { field: axes.fields[field].clone(), edges: vec![min, max], logarithmic };
    let edges = (0..=count).map(|index| whole.between(index as f64 / count as f64)).collect();
    Some(Bands { edges, ..whole })
}

fn metric(c: &mut Checker, name: &At<String>) -> Option<(String, &'static str)> {
    let metrics = fields::<f64, Metrics<f64>>();
    let found = metrics.iter().find(|metric| metric.name == name.value);
    if found.is_none() {
        let names: Vec<&str> = metrics.iter().map(|metric| metric.name.as_str()).collect();
        let message = format!("there is no metric `{}`", name.value);
        c.refuse(&name.span, message, suggestion(&name.value, &names));
    }
    found.map(|metric| (metric.name.clone(), metric.unit))
}

/// The map, or one for every slice.
fn cell_maps(c: &mut Checker, table: &MapTable, axes: &Axes) -> Option<Vec<CellMap>> {
    let cells = match &table.cells {
        Some(At { value, span }) if value.len() != 2 => {
            c.refuse(span, "a map has two numbers of cells", "write cells = [6, 6]: along x and along y");
            CELLS
        }
        Some(At { value, .. }) => [0, 1].map(|axis: usize| c.count(&value[axis], 2, 40)),
        None => CELLS,
    };
    let x = bands(c, &table.x, cells[0] as usize, axes)?;
    let y = bands(c, &table.y, cells[1] as usize, axes)?;
    let metric = table.metric.as_ref().and_then(|name| metric(c, name));
    if let (Some(name), None) = (&table.line_name, &table.line) {
        c.refuse(&name.span, "this names a line that is not there", "add line = \"...\", y as an expression of x");
    }
    let line_name = table.line_name.as_ref().map_or(String::new(), |name| name.value.clone());
    let line = table.line.as_ref().and_then(|written| line(c, written, axes.fields));
    let slices = slices(c, table, axes)?;
    let map = |slice: Option<Bands>| {
        let line = line.as_ref().map_or(Vec::new(), |line| line_points(line, &x, slice.as_ref(), axes));
        CellMap { x: x.clone(), y: y.clone(), slice, metric: metric.clone(), line, line_name: line_name.clone() }
    };
    Some(slices.into_iter().map(map).collect())
}

/// The bands into which a map is cut, each alone; one `None` without any.
fn slices(c: &mut Checker, table: &MapTable, axes: &Axes) -> Option<Vec<Option<Bands>>> {
    let Some(name) = &table.slice else {
        if let Some(count) = &table.slices {
            c.refuse(
                &count.span,
                "the parameter of these slices is missing",
                "add slice = \"target_mass\", or remove this",
            );
        }
        return Some(vec![None]);
    };
    let count = table.slices.as_ref().map_or(SLICES, |count| c.count(count, 1, 12)) as usize;
    let whole = bands(c, name, count, axes)?;
    let slice = |pair: &[f64]| Some(Bands { edges: pair.to_vec(), ..whole.clone() });
    Some(whole.edges.windows(2).map(slice).collect())
}

/// A line as written: y in SI units over the campaign's parameters.
pub(crate) fn line(c: &mut Checker, written: &At<String>, fields: &[Field]) -> Option<Expression> {
    let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
    let parsed = expression::parse(&written.value, &names);
    parsed
        .map_err(|fault| {
            let start = written.span.start + 1;
            c.refuse(&(start + fault.place.start..start + fault.place.end), fault.message, fault.remedy);
        })
        .ok()
}

/// The line over the map's x axis, in the middle of its slice; all other parameters have their undispersed values.
pub(crate) fn line_points(line: &Expression, x: &Bands, slice: Option<&Bands>, axes: &Axes) -> Vec<(f64, f64)> {
    let place = |bands: &Bands| axes.fields.iter().position(|field| field.name == bands.field.name).expect("a field");
    let mut values = axes.undispersed.clone();
    if let Some(slice) = slice {
        values[place(slice)] = slice.between(0.5);
    }
    let swept = place(x);
    let point = |index: usize| {
        values[swept] = x.between(index as f64 / LINE_POINTS as f64);
        for derived in axes.derived {
            values[derived.field] = derived.expression.value(&values);
        }
        (values[swept], line.value(&values))
    };
    (0..=LINE_POINTS).map(point).filter(|(_, y)| y.is_finite()).collect()
}
