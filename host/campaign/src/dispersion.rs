//! What varies from run to run: distributions of parameters, and how they hang together.

use crate::check::{Checker, span_of};
use crate::covariance;
use crate::distribution::{Distribution, kept_share};
use crate::key_path::PREFIX;
use crate::ranges::{in_words, legal, vector_name};
use crate::scenario_key::{Extra, ScenarioKey};
use crate::source::Source;
use crate::suggest::did_you_mean;
use crate::units::{noun, quantity, show, suggestions};
use crate::written::campaign::{CorrelationTable, DispersionTable, DistributionTable, OneOrMore};
use crate::written::{At, Quantity};
use nalgebra::DMatrix;
use softdock_kernels::fields::Field;
use softdock_kernels::params;
use softdock_kernels::range::Range;
use std::ops::Range as Span;

/// Whether a value varies or is only unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Varies from run to run.
    Aleatory,
    /// Fixed but unknown: drawn once per outer draw.
    Epistemic,
}

/// One dispersed parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Dispersion {
    /// Index into the field table of `Params`; behind its end, a variable of the campaign or a key of the scenario.
    pub field: usize,
    /// Name of the parameter or variable, also that of its random stream.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Its distribution.
    pub distribution: Distribution,
    /// Varies, or is only unknown.
    pub class: Class,
    /// Where the figures come from, as stated.
    pub source: Option<String>,
    /// Place of the distribution in the campaign file.
    pub(crate) place: Span<usize>,
}

/// Dispersions that are drawn together through a Gaussian copula.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// Indices of the dispersions.
    pub members: Vec<usize>,
    /// Lower triangular factor of the normal scores' correlation matrix, row by row.
    pub factor: Vec<Vec<f64>>,
}

/// Reads all dispersions; the files of tables are added to `tables`.
pub(crate) struct DispersionReader<'a> {
    pub(crate) c: &'a mut Checker,
    /// The scenario, of which keys may be dispersed.
    pub(crate) scenario: &'a Source,
    /// The parameters, and behind them what is drawn besides.
    pub(crate) fields: Vec<Field>,
    /// What is drawn besides the parameters.
    pub(crate) extras: Vec<Extra>,
    pub(crate) dispersions: Vec<Dispersion>,
    pub(crate) correlations: Vec<Correlation>,
    pub(crate) tables: Vec<Source>,
}

/// Bound for means and deviations that the legal range of the draws does not bound already.
const ANY: f64 = 1e15;

/// Shapes of beta and Weibull distributions: below, whole draws vanish in rounding; above, the distribution is a constant.
const SHAPE: Range = Range::within(0.1, 1e3);

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Constant,
    Normal,
    Uniform,
    TruncatedNormal,
    LogUniform,
    Triangular,
    Beta,
    Weibull,
    Arcsine,
    Discrete,
    MultivariateNormal,
    Table,
}

const KINDS: &[(&str, Kind)] = &[
    ("constant", Kind::Constant),
    ("normal", Kind::Normal),
    ("uniform", Kind::Uniform),
    ("truncnormal", Kind::TruncatedNormal),
    ("loguniform", Kind::LogUniform),
    ("triangular", Kind::Triangular),
    ("beta", Kind::Beta),
    ("weibull", Kind::Weibull),
    ("arcsine", Kind::Arcsine),
    ("discrete", Kind::Discrete),
    ("mvnormal", Kind::MultivariateNormal),
    ("table", Kind::Table),
];

impl DispersionReader<'_> {
    pub(crate) fn dispersion(&mut self, table: &DispersionTable) {
        let Some(kind) = self.kind(&table.dist.value) else { return };
        let class = table.class.as_ref().map_or(Class::Aleatory, |class| {
            self.c.choice(class, &[("aleatory", Class::Aleatory), ("epistemic", Class::Epistemic)])
        });
        let Some(targets) = self.targets(table, kind) else { return };
        let source = table.source.as_ref().map(|source| source.value.clone());
        let distributions = if kind == Kind::MultivariateNormal {
            self.multivariate(&table.dist, &targets)
        } else {
            let field = &self.fields[targets[0]];
            let (unit, range) = (field.unit, legal_draws(&field.name));
            self.distribution(kind, &table.dist.value, unit, range).into_iter().collect()
        };
        for (field, distribution) in targets.into_iter().zip(distributions) {
            let row = &self.fields[field];
            let (name, unit, source) = (row.name.clone(), row.unit, source.clone());
            self.check_reach(&name, unit, &distribution, &table.dist.span);
            let place = table.dist.span.clone();
            self.dispersions.push(Dispersion { field, name, unit, distribution, class, source, place });
        }
    }

    /// The kind, if its keys are complete.
    fn kind(&mut self, dist: &DistributionTable) -> Option<Kind> {
        let noted = self.c.problems.len();
        let kind = self.c.choice(&dist.kind, KINDS);
        if self.c.problems.len() > noted {
            return None;
        }
        use Kind::*;
        let needs = |name, span, kinds: &[Kind]| (name, span, kinds.contains(&kind), kinds.contains(&kind));
        let takes = |name, span, of: Kind| (name, span, kind == of, false);
        let several = kind == MultivariateNormal;
        let (covariance, sigma) = (span_of(&dist.covariance), span_of(&dist.sigma));
        let of_matrix = several && covariance.is_some();
        let bounded = [Uniform, TruncatedNormal, LogUniform, Triangular, Beta, Arcsine];
        let keys = [
            needs("value", span_of(&dist.value), &[Constant]),
            needs("values", span_of(&dist.values), &[Discrete]),
            takes("weights", span_of(&dist.weights), Discrete),
            needs("mean", span_of(&dist.mean), &[Normal, TruncatedNormal, MultivariateNormal]),
            match several {
                true => ("sigma", sigma, true, covariance.is_none()),
                false => needs("sigma", sigma, &[Normal, TruncatedNormal]),
            },
            ("min", span_of(&dist.min), bounded.contains(&kind) || kind == Weibull, bounded.contains(&kind)),
            needs("mode", span_of(&dist.mode), &[Triangular]),
            needs("max", span_of(&dist.max), &bounded),
            needs("a", span_of(&dist.a), &[Beta]),
            needs("b", span_of(&dist.b), &[Beta]),
            needs("scale", span_of(&dist.scale), &[Weibull]),
            needs("shape", span_of(&dist.shape), &[Weibull]),
            takes("corr", span_of(&dist.corr), MultivariateNormal),
            takes("covariance", covariance, MultivariateNormal),
            needs("file", span_of(&dist.file), &[Table]),
            needs("column", span_of(&dist.column), &[Table]),
            ("unit", span_of(&dist.unit), kind == Table || of_matrix, kind == Table),
        ];
        self.c.keys_of_kind(&dist.kind, &keys).then_some(kind)
    }

    /// Field indices of the targets.
    fn targets(&mut self, table: &DispersionTable, kind: Kind) -> Option<Vec<usize>> {
        let many = kind == Kind::MultivariateNormal;
        match (&table.target, &table.targets, &table.variable) {
            (None, None, Some(variable)) if !many => self.variable(variable).map(|field| vec![field]),
            (Some(target), None, None) => self.target(target, many),
            (None, Some(targets), None) if many => {
                let found: Option<Vec<_>> = targets.value.iter().map(|target| self.target(target, false)).collect();
                let found = found?.concat();
                if found.is_empty() {
                    self.c.refuse(&targets.span, "no targets", "name at least one parameter");
                }
                (!found.is_empty()).then_some(found)
            }
            (None, Some(targets), None) => {
                let message = "only mvnormal has several targets";
                self.c.refuse(&targets.span, message, "write target = \"...\", and one [[dispersion]] per parameter");
                None
            }
            _ => {
                let remedy = "write target = \"target_mass\", or targets = [\"offset_y\", \"offset_z\"] for mvnormal";
                self.c.refuse(&table.dist.span, "a dispersion has one `target`, or `targets`", remedy);
                None
            }
        }
    }

    /// A pure number of the campaign's own, under a name that nothing else has.
    fn variable(&mut self, written: &At<String>) -> Option<usize> {
        let name = written.value.as_str();
        let letters = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let fault = if name.is_empty() || !letters || name.starts_with(|c: char| c.is_ascii_digit()) {
            Some(("this cannot be a variable", "write letters, digits and _, a letter first"))
        } else if self.fields.iter().any(|f| f.name == name || vector_name(&f.name) == Some(name)) {
            Some(("this name is taken", "write target = \"...\" to disperse a parameter, or choose another name"))
        } else {
            None
        };
        if let Some((message, remedy)) = fault {
            self.c.refuse(&written.span, message, remedy);
            return None;
        }
        Some(self.extra(Extra::Variable(name.to_owned())))
    }

    /// A key of the scenario.
    fn key(&mut self, target: &At<String>) -> Option<usize> {
        let key = match ScenarioKey::find(self.scenario, &target.value) {
            Ok(key) => key,
            Err((message, remedy)) => {
                self.c.refuse(&target.span, message, remedy);
                return None;
            }
        };
        let twin =
            self.extras.iter().filter_map(Extra::key).find(|other| other.overlaps(&key)).map(|other| &other.path);
        if let Some(twin) = twin {
            let message = format!("`{}` is dispersed twice: here and as `{twin}`", target.value);
            self.c.refuse(&target.span, message, "remove one of these dispersions");
            return None;
        }
        Some(self.extra(Extra::Key(key)))
    }

    fn extra(&mut self, extra: Extra) -> usize {
        self.fields.push(extra.field());
        self.extras.push(extra);
        self.fields.len() - 1
    }

    /// A parameter that nothing else sets; a whole vector where one is allowed.
    fn target(&mut self, target: &At<String>, vector: bool) -> Option<Vec<usize>> {
        let name = target.value.as_str();
        if name.starts_with(PREFIX) {
            return self.key(target).map(|field| vec![field]);
        }
        let is_component = |field: &&Field| vector_name(&field.name) == Some(name);
        let components: Vec<usize> =
            self.fields.iter().enumerate().filter(|(_, f)| is_component(f)).map(|(index, _)| index).collect();
        if !vector && !components.is_empty() {
            let remedy = format!("write \"{name}_x\", \"{name}_y\" or \"{name}_z\", or use kind = \"mvnormal\"");
            self.c.refuse(&target.span, format!("`{name}` is a vector"), remedy);
            return None;
        }
        let found = if components.is_empty() { vec![find(self.c, &self.fields, target)?] } else { components };
        if let Some(twin) = self.dispersions.iter().find(|other| found.contains(&other.field)) {
            let line = self.c.source.line_column(twin.place.start).0;
            let message = format!("`{}` is dispersed twice", twin.name);
            self.c.refuse(&target.span, message, format!("remove this dispersion or the one in line {line}"));
            return None;
        }
        Some(found)
    }

    fn distribution(&mut self, kind: Kind, dist: &DistributionTable, unit: &str, range: Range) -> Option<Distribution> {
        let noted = self.c.problems.len();
        let (any, positive) = (Range::size(ANY), Range::above(0.0, ANY));
        let c = &mut *self.c;
        let distribution = match kind {
            Kind::Constant => Distribution::Constant { value: bound(c, &dist.value, unit, range) },
            Kind::Normal => Distribution::Normal {
                mean: one(c, &dist.mean, unit, range),
                sigma: one(c, &dist.sigma, unit, positive),
            },
            Kind::Uniform => {
                Distribution::Uniform { min: bound(c, &dist.min, unit, range), max: bound(c, &dist.max, unit, range) }
            }
            Kind::TruncatedNormal => Distribution::TruncatedNormal {
                mean: one(c, &dist.mean, unit, any),
                sigma: one(c, &dist.sigma, unit, positive),
                min: bound(c, &dist.min, unit, range),
                max: bound(c, &dist.max, unit, range),
            },
            Kind::LogUniform => {
                // A logarithm begins above zero, wherever the legal range does.
                let range = if range.min < 0.0 || range.contains(0.0) { Range::above(0.0, range.max) } else { range };
                Distribution::LogUniform {
                    min: bound(c, &dist.min, unit, range),
                    max: bound(c, &dist.max, unit, range),
                }
            }
            Kind::Triangular => Distribution::Triangular {
                min: bound(c, &dist.min, unit, range),
                mode: bound(c, &dist.mode, unit, range),
                max: bound(c, &dist.max, unit, range),
            },
            Kind::Beta => Distribution::Beta {
                a: bound(c, &dist.a, "1", SHAPE),
                b: bound(c, &dist.b, "1", SHAPE),
                min: bound(c, &dist.min, unit, range),
                max: bound(c, &dist.max, unit, range),
            },
            Kind::Weibull => Distribution::Weibull {
                scale: bound(c, &dist.scale, unit, positive),
                shape: bound(c, &dist.shape, "1", SHAPE),
                min: bound(c, &dist.min, unit, range),
            },
            Kind::Arcsine => {
                Distribution::Arcsine { min: bound(c, &dist.min, unit, range), max: bound(c, &dist.max, unit, range) }
            }
            Kind::Discrete => self.discrete(dist, unit, range)?,
            Kind::MultivariateNormal => return None,
            Kind::Table => Distribution::Table { values: self.table(dist, unit, range)? },
        };
        self.check_bounds(dist, &distribution, unit);
        (self.c.problems.len() == noted).then_some(distribution)
    }

    fn check_bounds(&mut self, dist: &DistributionTable, distribution: &Distribution, unit: &str) {
        let (min, max) = distribution.reach();
        let Some(written) = &dist.max else { return };
        if min >= max {
            let remedy = format!("write max above min ({}), or kind = \"constant\"", show(min, unit));
            self.c.refuse(&written.span, "max is not above min", remedy);
        } else if let Distribution::TruncatedNormal { mean, sigma, .. } = distribution
            && kept_share(*mean, *sigma, min, max) < 1e-9
        {
            let remedy = "move min and max towards the mean, or raise sigma";
            self.c.refuse(&written.span, "the bounds cut away the whole distribution", remedy);
        } else if let (Distribution::Triangular { mode, .. }, Some(written)) = (distribution, &dist.mode)
            && !(min..=max).contains(mode)
        {
            let message = format!("mode {} is not from min to max", show(*mode, unit));
            let remedy = format!("write mode from {} to {}", show(min, unit), show(max, unit));
            self.c.refuse(&written.span, message, remedy);
        }
    }

    /// Values with their weights.
    fn discrete(&mut self, dist: &DistributionTable, unit: &str, range: Range) -> Option<Distribution> {
        let (noted, written) = (self.c.problems.len(), dist.values.as_ref()?);
        if written.value.len() < 2 {
            self.c.refuse(&written.span, "a discrete distribution has two values or more", "use kind = \"constant\"");
            return None;
        }
        let values: Vec<f64> = written.value.iter().map(|value| self.c.number(value, unit, range)).collect();
        let weights = match &dist.weights {
            Some(weights) => self.c.list(weights, values.len(), "1", Range::above(0.0, ANY)),
            None => vec![1.0; values.len()],
        };
        if self.c.problems.len() > noted {
            return None;
        }
        for (place, value) in values.iter().enumerate() {
            if values[..place].contains(value) {
                let message = format!("the value {} occurs twice", show(*value, unit));
                self.c.refuse(&written.value[place].span, message, "write it once, and its whole weight in weights");
                return None;
            }
        }
        Some(Distribution::discrete(values.into_iter().zip(weights).collect()))
    }

    /// Normal and Weibull distributions are not bounded: what they can reach must be legal.
    fn check_reach(&mut self, name: &str, unit: &str, distribution: &Distribution, span: &Span<usize>) {
        let (range, (least, greatest)) = (legal_draws(name), distribution.reach());
        if !(range.contains(least) && range.contains(greatest)) {
            let message = format!(
                "draws of `{name}` reach from {} to {}, beyond its legal range",
                show(least, unit),
                show(greatest, unit)
            );
            let bounded = match distribution {
                Distribution::Weibull { .. } => "lower scale, raise shape, or use kind = \"beta\"",
                _ => "use kind = \"truncnormal\"",
            };
            let remedy = format!("{bounded} with min and max ({})", in_words(range, unit));
            self.c.refuse(span, message, remedy);
        }
    }

    fn table(&mut self, dist: &DistributionTable, si: &str, range: Range) -> Option<Vec<f64>> {
        let (file, column, unit) = (dist.file.as_ref()?, dist.column.as_ref()?, dist.unit.as_ref()?);
        if quantity(&format!("1 {}", unit.value), si).is_err() {
            let remedy = format!("write a unit of {}: {}", noun(si), suggestions(si));
            self.c.refuse(&unit.span, "this is not a unit of the target", remedy);
            return None;
        }
        if !file.value.to_lowercase().ends_with(".csv") {
            let remedy = "write the column to a CSV file with a header; Parquet tables are not read here";
            self.c.refuse(&file.span, "only CSV tables are read", remedy);
            return None;
        }
        let path = self.c.source.sibling(&file.value);
        let values = Source::read(&path, Some((&self.c.source, file.span.clone()))).and_then(|source| {
            let values = crate::table::column(&source, &column.value, &unit.value, si, range);
            self.tables.push(source);
            values
        });
        values.map_err(|problems| self.c.problems.extend(problems)).ok()
    }

    fn multivariate(&mut self, dist: &At<DistributionTable>, targets: &[usize]) -> Vec<Distribution> {
        let noted = self.c.problems.len();
        let table = &dist.value;
        let means = self.several(&table.mean, targets, false);
        let first = self.dispersions.len();
        let members: Vec<usize> = (first..first + targets.len()).collect();
        let sigmas = match &table.covariance {
            Some(file) => {
                let Some((sigmas, factor)) = self.covariance(table, file, targets) else { return Vec::new() };
                if targets.len() > 1 {
                    self.correlations.push(Correlation { members, factor });
                }
                sigmas
            }
            None => {
                let sigmas = self.several(&table.sigma, targets, true);
                if let Some(corr) = &table.corr
                    && let Some(factor) = factor(self.c, &corr.value, &corr.span, targets.len(), |pearson| pearson)
                {
                    self.correlations.push(Correlation { members, factor });
                }
                sigmas
            }
        };
        if self.c.problems.len() > noted {
            return Vec::new();
        }
        means.into_iter().zip(sigmas).map(|(mean, sigma)| Distribution::Normal { mean, sigma }).collect()
    }

    /// Standard deviations and the factor of the correlation matrix, from the file of a covariance matrix.
    fn covariance(
        &mut self,
        table: &DistributionTable,
        file: &At<String>,
        targets: &[usize],
    ) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
        for (name, span) in [("sigma", span_of(&table.sigma)), ("corr", span_of(&table.corr))] {
            if let Some(span) = span {
                let remedy = format!("remove `{name}`, or remove `covariance`");
                self.c.refuse(&span, format!("`{name}` is in the covariance file already"), remedy);
                return None;
            }
        }
        let mut scales = Vec::new();
        for target in targets {
            let field = &self.fields[*target];
            let written = table.unit.as_ref().map_or(field.unit, |unit| unit.value.as_str());
            let scale = if written == "1" && field.unit == "1" {
                Ok(1.0)
            } else {
                quantity(&format!("1 {written}"), field.unit)
            };
            match (scale, &table.unit) {
                (Ok(scale), _) => scales.push(scale),
                (Err(_), Some(unit)) => {
                    let message = format!("this is not a unit of `{}`", field.name);
                    let remedy = format!(
                        "write a unit of {}: {}; or remove `unit` and write the file in SI units",
                        noun(field.unit),
                        suggestions(field.unit)
                    );
                    self.c.refuse(&unit.span, message, remedy);
                    return None;
                }
                // A unit of the table of parameters has the factor 1.
                (Err(_), None) => scales.push(1.0),
            }
        }
        let names: Vec<&str> = targets.iter().map(|target| self.fields[*target].name.as_str()).collect();
        let path = self.c.source.sibling(&file.value);
        let read = Source::read(&path, Some((&self.c.source, file.span.clone()))).and_then(|source| {
            let found = covariance::read(&source, &names, &scales);
            self.tables.push(source);
            found
        });
        read.map_err(|problems| self.c.problems.extend(problems)).ok()
    }

    /// One mean or deviation per target.
    fn several(&mut self, written: &Option<At<OneOrMore>>, targets: &[usize], deviation: bool) -> Vec<f64> {
        let Some(written) = written else { return Vec::new() };
        let items: Vec<Quantity> = match &written.value {
            OneOrMore::More(items) => items.clone(),
            OneOrMore::One(scalar) => vec![At { value: scalar.clone(), span: written.span.clone() }],
        };
        if items.len() != targets.len() {
            let message = format!("{} values for {} targets", items.len(), targets.len());
            self.c.refuse(&written.span, message, format!("write {} values in brackets", targets.len()));
            return Vec::new();
        }
        let rows = items.iter().zip(targets);
        rows.map(|(item, field)| {
            let field = &self.fields[*field];
            let range = if deviation { Range::above(0.0, ANY) } else { legal_draws(&field.name) };
            self.c.number(item, field.unit, range)
        })
        .collect()
    }

    /// A group with rank correlations.
    pub(crate) fn correlation(&mut self, table: &CorrelationTable) {
        let mut members: Vec<usize> = Vec::new();
        for target in &table.targets.value {
            let index = self.dispersions.iter().position(|d| d.name == target.value);
            let fault = match index {
                None => Some(("is not dispersed", "add a [[dispersion]] for it above")),
                Some(i) if members.contains(&i) => Some(("is named twice", "name it once")),
                Some(i) if self.correlations.iter().any(|group| group.members.contains(&i)) => {
                    Some(("is in another group already", "join the groups into one matrix"))
                }
                Some(i) if matches!(self.dispersions[i].distribution, Distribution::Constant { .. }) => {
                    Some(("is constant", "leave it out"))
                }
                Some(i) if members.first().is_some_and(|f| self.dispersions[*f].class != self.dispersions[i].class) => {
                    Some(("has another class than the first target", "correlate parameters of one class"))
                }
                Some(_) => None,
            };
            match (fault, index) {
                (Some((message, remedy)), _) => {
                    return self.c.refuse(&target.span, format!("`{}` {message}", target.value), remedy);
                }
                (None, index) => members.extend(index),
            }
        }
        // Spearman's rank correlation of a Gaussian copula is (6/pi) asin(rho/2).
        let to_normal = |rank: f64| 2.0 * (std::f64::consts::PI * rank / 6.0).sin();
        if let Some(factor) = factor(self.c, &table.matrix.value, &table.matrix.span, members.len(), to_normal) {
            self.correlations.push(Correlation { members, factor });
        }
    }
}

/// The legal range of what may be drawn: of a parameter its own, of all else any.
fn legal_draws(name: &str) -> Range {
    let is_parameter = params::row_of(name).is_some();
    if is_parameter { legal(name) } else { Range::size(ANY) }
}

/// The field that a target names.
pub(crate) fn find(c: &mut Checker, fields: &[Field], target: &At<String>) -> Option<usize> {
    let found = fields.iter().position(|field| field.name == target.value);
    if found.is_none() {
        let names = fields.iter().flat_map(|f| [f.name.as_str(), vector_name(&f.name).unwrap_or(&f.name)]);
        let names: Vec<&str> = names.collect();
        let all = || fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ");
        let remedy = did_you_mean(&target.value, &names).unwrap_or_else(|| format!("write one of: {}", all()));
        c.refuse(&target.span, format!("there is no parameter `{}`", target.value), remedy);
    }
    found
}

fn bound(c: &mut Checker, written: &Option<Quantity>, unit: &str, range: Range) -> f64 {
    c.number_or(written, 0.0, unit, range)
}

fn one(c: &mut Checker, written: &Option<At<OneOrMore>>, unit: &str, range: Range) -> f64 {
    match written {
        Some(At { value: OneOrMore::One(scalar), span }) => c.scalar(scalar, span, unit, range),
        Some(At { span, .. }) => {
            c.refuse(span, "a list where one value belongs", "write one value, or kind = \"mvnormal\"");
            1.0
        }
        None => 1.0,
    }
}

/// The lower triangular factor of a checked correlation matrix.
fn factor(
    c: &mut Checker,
    rows: &[Vec<f64>],
    span: &Span<usize>,
    count: usize,
    to_normal: impl Fn(f64) -> f64,
) -> Option<Vec<Vec<f64>>> {
    let shape = rows.len() == count && rows.iter().all(|row| row.len() == count);
    let legal = |i: usize, j: usize| {
        let r = rows[i][j];
        (-1.0..=1.0).contains(&r) && (r - rows[j][i]).abs() < 1e-12 && (i != j || r == 1.0)
    };
    let all_legal = shape && (0..count).all(|i| (0..count).all(|j| legal(i, j)));
    if !all_legal {
        let remedy =
            format!("write {count} rows of {count} numbers from -1 to 1: symmetric, with ones on the diagonal");
        c.refuse(span, "this is not a correlation matrix", remedy);
        return None;
    }
    let matrix = DMatrix::from_fn(count, count, |i, j| if i == j { 1.0 } else { to_normal(rows[i][j]) });
    let lower = covariance::lower_factor(matrix);
    if lower.is_none() {
        let remedy = "weaken the correlations: no set of variables has all of these at once";
        c.refuse(span, "this correlation matrix is not positive definite", remedy);
    }
    lower
}
