//! A campaign: the file checked, with its scenario, dispersions and requirements.

use crate::cases::Cases;
use crate::check::Checker;
use crate::compare::{self, Comparison};
use crate::derived::{self, Derived};
use crate::dispersion::{Class, Correlation, Dispersion, DispersionReader};
use crate::expression::Bounds;
use crate::found::FoundEffect;
use crate::metric::{self, CustomMetric};
use crate::problem::{Problem, Problems};
use crate::ranges::Range;
use crate::requirement::{self, AgreementRequirement, Requirement};
use crate::scenario::Scenario;
use crate::source::Source;
use crate::stability::Extremes;
use crate::variant::{self, Variant};
use crate::written::At;
use crate::written::campaign::{CampaignFile, ExecutionTable, TracesTable};
use crate::{derived as derived_values, idle, read};
use softdock_kernels::effects::EffectSet;
use softdock_kernels::fields::{Field, fields, from_slice};
use softdock_kernels::model::Timing;
use softdock_kernels::params::Params;
use std::ops::Range as Span;
use std::path::{Path, PathBuf};

/// Format that this version reads.
pub(crate) const FORMAT: &str = "campaign/2";

/// Most runs, and most runs in a shard.
pub(crate) const MOST_RUNS: u64 = 1_000_000_000;
const MOST_SHARD_RUNS: u64 = 1_000_000;

/// Most shards: files of one folder.
pub const MOST_SHARDS: u64 = 1_000_000;

/// Runs that are repeated at half the substep unasked: enough to see a difference, cheap beside any campaign.
const UNASKED_HALF_STEP_RUNS: u64 = 200;

/// Points of a Sobol' sequence for which there are direction numbers.
const SOBOL_POINTS: u64 = 1 << 16;

/// Where the runs are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// A real GPU if there is one, else the CPU.
    Auto,
    /// The GPU.
    Gpu,
    /// The CPU.
    Cpu,
}

/// What an invalid run counts as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// A failure.
    CountAsFailure,
    /// Reported beside the verdict.
    ReportOnly,
}

/// How the samples are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Independent draws, as sign-off statistics need.
    Random,
    /// Each input's strata are met once; for exploring.
    LatinHypercube,
    /// A scrambled Sobol' sequence fills all inputs together evenly; for exploring.
    Sobol,
}

impl Method {
    /// Most runs that the method can draw.
    pub fn most_runs(self) -> u64 {
        if self == Self::Sobol { SOBOL_POINTS } else { MOST_RUNS }
    }
}

/// How the runs are executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Execution {
    /// Where.
    pub backend: Backend,
    /// Share of the runs that is repeated in f64 and compared, 0..1.
    pub parity: f64,
    /// Share of the runs that is repeated in f64 at half the substep, 0..1; `None`: as parity, but few.
    pub half_step: Option<f64>,
    /// Runs in a shard.
    pub shard_runs: u64,
    /// What an invalid run counts as.
    pub invalid: Invalid,
}

/// Runs whose time histories are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The undispersed run.
    Nominal,
    /// Every run that fails a requirement.
    Failed,
    /// Every invalid run.
    Invalid,
    /// This many runs of least margin, per requirement.
    Worst(u32),
    /// This many runs, evenly spread over the run numbers.
    Random(u32),
}

/// Time histories to keep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Traces {
    /// Every how many ticks a row is written.
    pub every_ticks: u32,
    /// Of which runs.
    pub keep: Vec<Keep>,
}

/// A checked campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Name, also of the results folder.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of runs.
    pub runs: u64,
    /// The task and the facility.
    pub scenario: Scenario,
    /// The file that stands in the place of the scenario which the campaign names.
    pub model: Option<PathBuf>,
    /// How the runs are executed.
    pub execution: Execution,
    /// How the samples are drawn.
    pub method: Method,
    /// What varies.
    pub dispersions: Vec<Dispersion>,
    /// What hangs together.
    pub correlations: Vec<Correlation>,
    /// What follows from it, in order.
    pub derived: Vec<Derived>,
    /// Outer draws, if anything is epistemic.
    pub outer_draws: Option<u32>,
    /// Custom metrics, each over those above it.
    pub metrics: Vec<CustomMetric>,
    /// What must hold in single runs, in space or on the facility.
    pub requirements: Vec<Requirement>,
    /// What must hold of the agreement of the facility with space.
    pub agreement: Vec<AgreementRequirement>,
    /// Time histories to keep.
    pub traces: Traces,
    /// The facilities to compare; if there are any, the runs are made on them and not on the scenario's own.
    pub variants: Vec<Variant>,
    /// How they are compared.
    pub comparison: Comparison,
    /// Names of the variables that expressions use besides the parameters.
    pub(crate) variables: Vec<String>,
    /// The campaign file's text.
    pub text: String,
    /// blake3 of campaign, scenario, URDF and tables, in hexadecimal.
    pub hash: String,
    pub(crate) files: Vec<PathBuf>,
    /// Inputs in the place of the draws, and the hash without them.
    pub(crate) cases: Option<(Cases, String)>,
}

impl Campaign {
    /// Reads a campaign file and everything that it names.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::load_with(path, None)
    }

    /// The same with another scenario in the place of the one that the file names: an extended model.
    ///
    /// # Errors
    /// See [`load`](Self::load).
    pub fn load_with(path: &Path, model: Option<&Path>) -> Result<Self, Problems> {
        let source = Source::read(path, None)?;
        let file: CampaignFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let scenario = match model {
            Some(model) => Scenario::load(model),
            None => scenario(&mut c, &file.scenario),
        };
        let scenario = match scenario {
            Ok(scenario) => scenario,
            Err(problems) => {
                c.problems.extend(problems);
                return Err(Problems::check(c.problems).expect_err("at least the scenario's problems"));
            }
        };
        let campaign = Campaign { model: model.map(Path::to_owned), ..check(&mut c, &file, scenario) };
        Problems::check(std::mem::take(&mut c.problems))?;
        if file.variant.is_empty() {
            campaign.check_steps(&c.source)?;
            return Ok(campaign);
        }
        campaign.with_variants(&mut c, &file)
    }

    /// The campaign with its variants, each as sound as a campaign alone.
    fn with_variants(mut self, c: &mut Checker, file: &CampaignFile) -> Result<Self, Problems> {
        let fields = self.fields();
        let variants = variant::read(c, file, &self, &fields);
        Problems::check(std::mem::take(&mut c.problems))?;
        variant::refuse_idle(c, &variants);
        Problems::check(std::mem::take(&mut c.problems))?;
        for variant in &variants {
            variant.campaign.check_steps(&c.source)?;
            let files = variant.campaign.scenario.sources().map(|source| source.path().to_owned());
            let new: Vec<PathBuf> = files.filter(|file| !self.files.contains(file)).collect();
            self.files.extend(new);
        }
        let files = self.files.clone();
        self.variants = variants;
        self.variants.iter_mut().for_each(|variant| variant.campaign.files.clone_from(&files));
        Ok(self)
    }

    /// What expressions may name: the parameters and, behind them, the campaign's variables.
    fn fields(&self) -> Vec<Field> {
        let variable = |name: &String| Field { name: name.clone(), unit: "1", meaning: "variable of the campaign" };
        fields::<f64, Params<f64>>().into_iter().chain(self.variables.iter().map(variable)).collect()
    }

    /// Whether a dispersion or a derived value stands at a place of the file.
    pub(crate) fn sets_at(&self, place: &Span<usize>) -> bool {
        let dispersed = self.dispersions.iter().any(|dispersion| dispersion.place == *place);
        dispersed || self.derived.iter().any(|derived| derived.place == *place)
    }

    /// Every file that was read: the campaign's own first, then scenario, URDF and tables.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The same campaign with another number of runs and another seed, in all its variants.
    pub fn with_sample(mut self, runs: u64, seed: u64) -> Self {
        (self.runs, self.seed) = (runs, seed);
        for variant in &mut self.variants {
            (variant.campaign.runs, variant.campaign.seed) = (runs, seed);
        }
        self
    }

    /// The same campaign over the posterior of what a diagnosis found: so many draws of it, each for its share of the runs.
    #[must_use]
    pub fn over_posterior(mut self, draws: u32) -> Self {
        self.outer_draws.get_or_insert(draws);
        self
    }

    /// How many runs are repeated at half the substep.
    pub fn half_step_runs(&self) -> u64 {
        let of = |share: f64| (share * self.runs as f64).ceil() as u64;
        self.execution.half_step.map_or_else(|| of(self.execution.parity).min(UNASKED_HALF_STEP_RUNS), of)
    }

    /// The same campaign at half the substep: the periods of command and sensor stay.
    pub fn at_half_step(&self) -> Self {
        let mut halved = self.clone();
        let model = &mut halved.scenario.model;
        model.timing.substep *= 0.5;
        model.timing.substeps *= 2;
        model.facility.sensor_substeps *= 2;
        halved
    }

    /// Dispersions may need a finer step, or leave less delay, than the nominal run.
    fn check_steps(&self, source: &Source) -> Result<(), Problems> {
        let mut unused = Checker::new(source.clone());
        let bounds = self.bounds(&mut unused);
        // Variables stand behind the parameters and are left out.
        let ends = |end: fn(&Bounds) -> f64| from_slice(&bounds.iter().map(end).collect::<Vec<_>>());
        let extremes = Extremes { least: ends(|b| b.least), greatest: ends(|b| b.greatest) };
        self.scenario.check_steps(&extremes, |parameter| {
            let dispersed = self.dispersions.iter().find(|d| d.name == parameter).map(|d| d.place.clone());
            let derived = || self.derived.iter().find(|d| d.name == parameter).map(|d| d.place.clone());
            dispersed.or_else(derived).map(|place| (source.clone(), place))
        })
    }

    /// The effects that any of its runs may have: a property of the whole campaign, so that no run depends on what is
    /// made beside it.
    pub fn effects(&self) -> EffectSet {
        let dispersed = self.dispersions.iter().map(|dispersion| dispersion.name.as_str());
        let derived = self.derived.iter().map(|derived| derived.name.as_str());
        let nominal = EffectSet::of(&self.nominal(), &self.scenario.model.timing);
        dispersed.chain(derived).map(EffectSet::switched_by).fold(nominal, EffectSet::or)
    }

    /// Least and greatest value of every parameter.
    pub(crate) fn bounds(&self, c: &mut Checker) -> Vec<Bounds> {
        let mut bounds: Vec<Bounds> = self.undispersed().iter().map(|v| Bounds { least: *v, greatest: *v }).collect();
        for dispersion in &self.dispersions {
            let (least, greatest) = dispersion.distribution.reach();
            bounds[dispersion.field] = Bounds { least, greatest };
        }
        derived_values::bounds(c, &self.derived, &mut bounds);
        bounds
    }
}

fn scenario(c: &mut Checker, written: &At<String>) -> Result<Scenario, Problems> {
    let path = c.source.sibling(&written.value);
    let source = Source::read(&path, Some((&c.source, written.span.clone())))?;
    Scenario::from_source(source)
}

/// The campaign, with harmless values where there are problems.
fn check(c: &mut Checker, file: &CampaignFile, scenario: Scenario) -> Campaign {
    let table = fields::<f64, Params<f64>>();
    let parameters = table.len();
    let (dispersions, correlations, tables) = Default::default();
    let mut reader = DispersionReader { c, fields: table, dispersions, correlations, tables };
    for dispersion in &file.dispersion {
        reader.dispersion(dispersion);
    }
    for correlation in &file.correlation {
        reader.correlation(correlation);
    }
    let DispersionReader { fields, dispersions, correlations, tables, .. } = reader;
    let derived = derived::read(c, &fields, &file.derived.iter().collect::<Vec<_>>(), &dispersions);
    let runs = c.count(&file.runs, 1, MOST_RUNS);
    let (execution, method) = (execution(c, &file.execution), method(c, file));
    let shards = runs.div_ceil(execution.shard_runs.max(1));
    if shards > MOST_SHARDS {
        let span = file.execution.shard_runs.as_ref().map_or(file.runs.span.clone(), |written| written.span.clone());
        let remedy = format!("write shard_runs = {} or more", runs.div_ceil(MOST_SHARDS));
        c.refuse(&span, format!("this gives {shards} shards, more than {MOST_SHARDS}"), remedy);
    }
    let outer_draws = outer(c, file, runs, &dispersions, &scenario);
    let metrics = metric::read(c, &file.metric);
    let (requirements, agreement) = requirement::read(c, &file.requirement, &metrics);
    let campaign = Campaign {
        id: c.name(&file.id),
        title: file.title.value.clone(),
        seed: file.seed.value,
        runs,
        execution,
        method,
        outer_draws,
        metrics,
        requirements,
        agreement,
        traces: traces(c, &file.traces, &scenario.model.timing),
        text: c.source.text().to_owned(),
        hash: hash(&c.source, &scenario, &tables),
        files: std::iter::once(&c.source)
            .chain(scenario.sources())
            .chain(&tables)
            .map(|s| s.path().to_owned())
            .collect(),
        scenario,
        model: None,
        dispersions,
        correlations,
        derived,
        variants: Vec::new(),
        comparison: Comparison::default(),
        cases: None,
        variables: fields[parameters..].iter().map(|field| field.name.clone()).collect(),
    };
    let bounds = campaign.bounds(c);
    // With variants each of them has its own answer.
    if file.variant.is_empty() {
        idle::targets(&campaign, &bounds).iter().for_each(|target| target.refuse(c));
    }
    let comparison = compare::read(c, file, &campaign, &fields);
    Campaign { comparison, ..campaign }
}

fn execution(c: &mut Checker, table: &ExecutionTable) -> Execution {
    let backends = [("auto", Backend::Auto), ("gpu", Backend::Gpu), ("cpu", Backend::Cpu)];
    let invalid = [("count-as-failure", Invalid::CountAsFailure), ("report-only", Invalid::ReportOnly)];
    Execution {
        backend: table.backend.as_ref().map_or(Backend::Auto, |written| c.choice(written, &backends)),
        parity: c.number_or(&table.parity, 0.005, "1", Range::within(0.0, 1.0)),
        half_step: table.half_step.as_ref().map(|written| c.number(written, "1", Range::within(0.0, 1.0))),
        shard_runs: table.shard_runs.as_ref().map_or(1000, |written| c.count(written, 1, MOST_SHARD_RUNS)),
        invalid: table.invalid.as_ref().map_or(Invalid::CountAsFailure, |written| c.choice(written, &invalid)),
    }
}

fn method(c: &mut Checker, file: &CampaignFile) -> Method {
    let Some(written) = &file.sampling.method else {
        return Method::Random;
    };
    let lhs = Method::LatinHypercube;
    let words = [("random", Method::Random), ("sobol", Method::Sobol), ("lhs", lhs), ("latin_hypercube", lhs)];
    let method = c.choice(written, &words);
    if file.runs.value > method.most_runs() {
        let message = format!("a Sobol' sequence has {} points, fewer than the runs", method.most_runs());
        c.refuse(&written.span, message, "lower runs, or write method = \"lhs\" or \"random\"");
    }
    method
}

fn outer(
    c: &mut Checker,
    file: &CampaignFile,
    runs: u64,
    dispersions: &[Dispersion],
    scenario: &Scenario,
) -> Option<u32> {
    let epistemic = dispersions.iter().find(|dispersion| dispersion.class == Class::Epistemic);
    let uncertain = scenario.found.iter().any(FoundEffect::is_uncertain);
    match (&file.outer, epistemic) {
        (Some(outer), other) if other.is_some() || uncertain => {
            Some(c.count(&outer.value.draws, 1, runs.min(u64::from(u32::MAX / 2))) as u32)
        }
        (Some(outer), _) => {
            c.refuse(
                &outer.span,
                "no dispersion is epistemic, and no effect of the scenario is uncertain",
                "remove [outer], or mark a dispersion with class = \"epistemic\"",
            );
            None
        }
        (None, Some(dispersion)) => {
            let message = format!("`{}` is epistemic, but there is no outer loop", dispersion.name);
            c.refuse(&dispersion.place.clone(), message, "add a table [outer] with draws = 20");
            None
        }
        (None, None) => None,
    }
}

fn traces(c: &mut Checker, table: &TracesTable, timing: &Timing) -> Traces {
    let every_ticks = table.rate.as_ref().map_or(1, |rate| {
        let fastest = 1.0 / timing.tick();
        let rate = c.number(rate, "Hz", Range::within(fastest / 1e6, fastest * (1.0 + 1e-9)));
        (fastest / rate).round().max(1.0) as u32
    });
    let words = table.keep.as_ref().map_or(&[][..], |keep| &keep.value);
    Traces { every_ticks, keep: words.iter().filter_map(|word| keep(c, word)).collect() }
}

fn keep(c: &mut Checker, written: &At<String>) -> Option<Keep> {
    let (word, count) = match written.value.split_once(':') {
        Some((word, count)) => (word, count.trim().parse::<u32>().ok().filter(|count| (1..=10_000).contains(count))),
        None => (written.value.as_str(), None),
    };
    let keep = match (word, count, written.value.contains(':')) {
        ("nominal", _, false) => Some(Keep::Nominal),
        ("failed", _, false) => Some(Keep::Failed),
        ("invalid", _, false) => Some(Keep::Invalid),
        ("worst", Some(count), _) => Some(Keep::Worst(count)),
        ("random", Some(count), _) => Some(Keep::Random(count)),
        _ => None,
    };
    if keep.is_none() {
        let problem = Problem::at(&c.source, written.span.clone(), "this names no runs")
            .expected("nominal, failed, invalid, worst:N or random:N")
            .remedy("write \"nominal\", \"failed\", \"invalid\", \"worst:20\" or \"random:50\" (N from 1 to 10000)");
        c.problems.push(problem);
    }
    keep
}

/// Every text with its role and length, so that no two sets of files share a hash by running together.
fn hash(campaign: &Source, scenario: &Scenario, tables: &[Source]) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut add = |role: &str, text: &str| {
        for part in [role, text] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
    };
    add("campaign", campaign.text());
    add("scenario", scenario.text());
    add("urdf", scenario.urdf_text().unwrap_or(""));
    if let Some(robot) = scenario.robot_text() {
        add("robot", robot);
    }
    scenario.station_texts().for_each(|text| add("facility", text));
    for table in tables {
        add("table", table.text());
    }
    hasher.finalize().to_hex().to_string()
}
