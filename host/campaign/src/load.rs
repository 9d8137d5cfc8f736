//! Reads a campaign file with everything that it names, and checks it.

use crate::campaign::{Backend, Campaign, Execution, Invalid, MOST_SHARDS, Method};
use crate::check::Checker;
use crate::compare::{self, Comparison};
use crate::derived;
use crate::dispersion::{Class, Dispersion, DispersionReader};
use crate::expression::Bounds;
use crate::identified::IdentifiedEffect;
use crate::kept;
use crate::key_path::PREFIX;
use crate::metric;
use crate::no_effect::{self, IneffectiveKey};
use crate::outcome_map;
use crate::problem::Problems;
use crate::ranges::MOST_RUNS;
use crate::read;
use crate::requirement;
use crate::scenario::Scenario;
use crate::scenario_key::ScenarioKey;
use crate::source::Source;
use crate::source::settings::{SetFile, Settings};
use crate::stability::Extremes;
use crate::variant;
use crate::written::campaign::{CampaignFile, ExecutionTable};
use softdock_kernels::fields::{fields, from_slice};
use softdock_kernels::params::Params;
use softdock_kernels::range::Range;
use std::path::{Path, PathBuf};

/// Format that this version reads.
pub(crate) const FORMAT: &str = "campaign/2";

/// Most runs in a shard.
const MOST_SHARD_RUNS: u64 = 1_000_000;

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
        Self::load_set(path, model, &Settings::default())
    }

    /// The same with values of the command line in the place of those that campaign, scenario and facility file write.
    ///
    /// # Errors
    /// See [`load`](Self::load); a problem with such a value names `--set`.
    pub fn load_set(path: &Path, model: Option<&Path>, settings: &Settings) -> Result<Self, Problems> {
        Self::of_source(Source::read(path, None)?, model, settings)
    }

    /// The same of a text in the place of the file `path`, which need not exist: paths in the text are relative to it.
    ///
    /// # Errors
    /// See [`load_set`](Self::load_set).
    pub fn load_text(path: &Path, text: String, model: Option<&Path>, settings: &Settings) -> Result<Self, Problems> {
        Self::of_source(Source::given(path.to_owned(), text), model, settings)
    }

    fn of_source(source: Source, model: Option<&Path>, settings: &Settings) -> Result<Self, Problems> {
        let source = settings.apply(SetFile::Campaign, source)?;
        let file: CampaignFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let scenario = match model {
            Some(model) => Source::read(model, None),
            None => {
                Source::read(&c.source.sibling(&file.scenario.value), Some((&c.source, file.scenario.span.clone())))
            }
        };
        let scenario =
            scenario.and_then(|source| settings.apply(SetFile::Scenario, source)).and_then(Scenario::from_source);
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

    /// The campaign with its variants, each checked like a campaign alone.
    fn with_variants(mut self, c: &mut Checker, file: &CampaignFile) -> Result<Self, Problems> {
        self.variants = variant::read(c, file, &self.scenario, &self.dispersions, &self.fields());
        Problems::check(std::mem::take(&mut c.problems))?;
        self.refuse_keys_of_variants(c, file);
        let alone = self.variants.iter().map(|variant| self.on_variant(variant).with_key_ends(c));
        let alone: Vec<Self> = alone.collect();
        self.variants.iter_mut().zip(&alone).for_each(|(variant, alone)| variant.key_ends.clone_from(&alone.key_ends));
        refuse_ineffective(c, &alone);
        Problems::check(std::mem::take(&mut c.problems))?;
        for variant in &alone {
            variant.check_steps(&c.source)?;
            let sources = variant.scenario.sources().map(Source::path);
            let files = sources.chain(variant.scenario.mesh_files()).map(Path::to_owned);
            let new: Vec<PathBuf> = files.filter(|file| !self.files.contains(file)).collect();
            self.files.extend(new);
        }
        Ok(self)
    }

    /// Refuses a key that a variant replaces and a dispersion gives each run: one of them would do nothing.
    fn refuse_keys_of_variants(&self, c: &mut Checker, file: &CampaignFile) {
        for replaced in file.variant.iter().flat_map(|table| &table.set.0) {
            let inside = |key: &&ScenarioKey| {
                let path = key.path.strip_prefix(PREFIX).unwrap_or(&key.path);
                let rest = path.strip_prefix(replaced.value.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            };
            if let Some(key) = self.keys().find(inside) {
                let message = format!("`{}` is dispersed: every run has a value of its own", key.path);
                c.refuse(&replaced.span, message, "remove it here, or remove that dispersion");
            }
        }
    }

    /// Dispersions may need a finer step, or have less delay, than the nominal run.
    pub(crate) fn check_steps(&self, source: &Source) -> Result<(), Problems> {
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
}

/// The campaign, with harmless values where there are problems.
fn check(c: &mut Checker, file: &CampaignFile, scenario: Scenario) -> Campaign {
    let table = fields::<f64, Params<f64>>();
    let parameters = table.len();
    let (extras, dispersions, correlations, tables) = Default::default();
    let scenario_file = scenario.source().clone();
    let mut reader =
        DispersionReader { c, scenario: &scenario_file, fields: table, extras, dispersions, correlations, tables };
    for dispersion in &file.dispersion {
        reader.dispersion(dispersion);
    }
    for correlation in &file.correlation {
        reader.correlation(correlation);
    }
    let DispersionReader { fields, extras, dispersions, correlations, tables, .. } = reader;
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
        traces: kept::traces(c, &file.traces, &scenario.model.timing),
        contact_events: kept::contact_events(c, file.contact_events.as_ref()),
        text: c.source.text().to_owned(),
        edited: std::iter::once(&c.source).chain(scenario.sources()).filter(|file| file.is_edited()).cloned().collect(),
        hash: hash(&c.source, &scenario, &tables),
        files: std::iter::once(&c.source)
            .chain(scenario.sources())
            .chain(&tables)
            .map(Source::path)
            .chain(scenario.mesh_files())
            .map(Path::to_owned)
            .collect(),
        scenario,
        model: None,
        dispersions,
        correlations,
        derived,
        variants: Vec::new(),
        comparison: Comparison::default(),
        outcome_maps: Vec::new(),
        cases: None,
        extras,
        key_ends: Vec::new(),
    };
    let campaign = if file.variant.is_empty() { campaign.with_key_ends(c) } else { campaign };
    let bounds = campaign.bounds(c);
    // With variants each of them has its own answer.
    if file.variant.is_empty() {
        no_effect::targets(&campaign, &bounds).iter().for_each(|target| target.refuse(c));
    }
    let axes = compare::Axes {
        fields: &fields,
        parameters,
        dispersions: &campaign.dispersions,
        derived: &campaign.derived,
        undispersed: campaign.undispersed(),
        bounds: &bounds,
    };
    let comparison = compare::read(c, file, &axes);
    let outcome_maps = outcome_map::read(c, file, &axes);
    Campaign { comparison, outcome_maps, ..campaign }
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
    let uncertain = scenario.identified.iter().any(IdentifiedEffect::is_uncertain);
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

/// Refuses what has no effect in any variant that has it.
fn refuse_ineffective(c: &mut Checker, variants: &[Campaign]) {
    let mut all: Vec<(IneffectiveKey, usize)> = Vec::new();
    for variant in variants {
        let bounds = variant.bounds(c);
        for target in no_effect::targets(variant, &bounds) {
            match all.iter_mut().find(|(other, _)| other.place == target.place) {
                Some((_, count)) => *count += 1,
                None => all.push((target, 1)),
            }
        }
    }
    for (target, count) in all {
        let holders = variants.iter().filter(|variant| variant.sets_at(&target.place)).count();
        if count == holders {
            target.refuse(c);
        }
    }
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
    scenario.mesh_hashes().iter().for_each(|hash| add("mesh", hash));
    hasher.finalize().to_hex().to_string()
}
