//! A campaign: the file checked, with its scenario, dispersions and requirements.

use crate::cases::Cases;
use crate::check::Checker;
use crate::compare::Comparison;
use crate::derived::{self, Derived};
use crate::dispersion::{Correlation, Dispersion};
use crate::expression::Bounds;
use crate::metric::CustomMetric;
use crate::outcome_map::OutcomeMap;
use crate::ranges::MOST_RUNS;
use crate::requirement::{AgreementRequirement, Requirement};
use crate::scenario::Scenario;
use crate::scenario_key::{Extra, ScenarioKey};
use crate::source::Source;
use crate::variant::Variant;
use softdock_kernels::effects::EffectSet;
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::params::Params;
use std::ops::Range as Span;
use std::path::{Path, PathBuf};

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

/// Runs whose time histories or contact events are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Every run; contact events only.
    All,
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
pub struct TracePlan {
    /// Every how many ticks a row is written.
    pub every_ticks: u32,
    /// Of which runs.
    pub keep: Vec<Keep>,
}

/// Contact events to keep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactEventPlan {
    /// Separations of at most this time do not end an event \[s\].
    pub merge_gap: f64,
    /// Of which runs; none: no file.
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
    /// The file that replaces the campaign's scenario.
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
    pub traces: TracePlan,
    /// Contact events to keep.
    pub contact_events: ContactEventPlan,
    /// The facilities to compare; if there are any, the runs are made on them and not on the scenario's own.
    pub variants: Vec<Variant>,
    /// How they are compared.
    pub comparison: Comparison,
    /// Maps of the runs' outcomes.
    pub outcome_maps: Vec<OutcomeMap>,
    /// What is drawn besides the parameters.
    pub(crate) extras: Vec<Extra>,
    /// Parameters of the scenario with each of its dispersed keys at its ends.
    pub(crate) key_ends: Vec<Params<f64>>,
    /// The campaign file's text.
    pub text: String,
    /// blake3 of campaign, scenario, URDF and tables, in hexadecimal.
    pub hash: String,
    pub(crate) files: Vec<PathBuf>,
    /// The files in which the command line has set values.
    pub(crate) edited: Vec<Source>,
    /// Inputs in the place of the draws, and the hash without them.
    pub(crate) cases: Option<(Cases, String)>,
}

impl Campaign {
    /// What expressions may name: the parameters and, behind them, what is drawn besides.
    pub(crate) fn fields(&self) -> Vec<Field> {
        fields::<f64, Params<f64>>().into_iter().chain(self.extras.iter().map(Extra::field)).collect()
    }

    /// The keys of the scenario that each run has for itself.
    pub fn keys(&self) -> impl Iterator<Item = &ScenarioKey> {
        self.extras.iter().filter_map(Extra::key)
    }

    /// Whether each run has a scenario of its own.
    pub fn has_keys(&self) -> bool {
        self.keys().next().is_some()
    }

    /// The scenario's key behind a field; `None` for a parameter or a variable.
    pub fn key_of(&self, field: usize) -> Option<&ScenarioKey> {
        let extra = field.checked_sub(fields::<f64, Params<f64>>().len())?;
        self.extras.get(extra)?.key()
    }

    /// Place of a field among the inputs of a run, [`Draw::inputs`](crate::Draw::inputs); `None` for a variable.
    pub fn input_place(&self, field: usize) -> Option<usize> {
        let parameters = fields::<f64, Params<f64>>().len();
        let Some(extra) = field.checked_sub(parameters) else { return Some(field) };
        self.extras.get(extra)?.key()?;
        Some(parameters + self.extras[..extra].iter().filter_map(Extra::key).count())
    }

    /// Parameters that a run can have by its keys of the scenario, besides those of the nominal run.
    pub fn key_ends(&self) -> &[Params<f64>] {
        &self.key_ends
    }

    /// Whether a dispersion or a derived value is written at a place of the file.
    pub(crate) fn sets_at(&self, place: &Span<usize>) -> bool {
        let dispersed = self.dispersions.iter().any(|dispersion| dispersion.place == *place);
        dispersed || self.derived.iter().any(|derived| derived.place == *place)
    }

    /// Every file that was read: the campaign's own first, then scenario, URDF and tables.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The text of one of its files in which the command line has set values; `None` if the file was read as it is.
    pub fn edited_text(&self, file: &Path) -> Option<&str> {
        self.edited.iter().find(|edited| edited.path() == file).map(Source::text)
    }

    /// The same campaign with another number of runs and another seed.
    #[must_use]
    pub fn with_sample(self, runs: u64, seed: u64) -> Self {
        Self { runs, seed, ..self }
    }

    /// The campaign on one of its variants alone: the same draws, without variants.
    pub fn on_variant(&self, variant: &Variant) -> Self {
        let (scenario, derived) = (variant.scenario.clone(), variant.derived.clone());
        let key_ends = variant.key_ends.clone();
        let text = format!("{} {} {}", self.hash, variant.name, scenario.robot_text().unwrap_or(""));
        let text = scenario.mesh_hashes().into_iter().fold(text, |text, hash| text + " " + &hash);
        Self {
            id: self.id_of(variant),
            title: format!("{}: {}", self.title, variant.title),
            hash: blake3::hash(text.as_bytes()).to_hex().to_string(),
            scenario,
            derived,
            key_ends,
            variants: Vec::new(),
            ..self.clone()
        }
    }

    /// Id of the campaign on one of its variants.
    pub fn id_of(&self, variant: &Variant) -> String {
        format!("{}/{}", self.id, variant.name)
    }

    /// The variant with the id of a campaign.
    pub fn variant_of_id(&self, id: &str) -> Option<&Variant> {
        self.variants.iter().find(|variant| self.id_of(variant) == id)
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

    /// The effects that any of its runs may have: a property of the whole campaign, so that no run depends on what is
    /// made beside it.
    pub fn effects(&self) -> EffectSet {
        let dispersed = self.dispersions.iter().map(|dispersion| dispersion.name.as_str());
        let derived = self.derived.iter().map(|derived| derived.name.as_str());
        let of = |p: &Params<f64>| EffectSet::of(p, &self.scenario.model.timing);
        let nominal = self.key_ends.iter().map(of).fold(of(&self.nominal()), EffectSet::or);
        dispersed.chain(derived).map(EffectSet::switched_by).fold(nominal, EffectSet::or)
    }

    /// Least and greatest value of every parameter.
    pub(crate) fn bounds(&self, c: &mut Checker) -> Vec<Bounds> {
        let mut bounds: Vec<Bounds> = self.undispersed().iter().map(|v| Bounds { least: *v, greatest: *v }).collect();
        for dispersion in &self.dispersions {
            let (least, greatest) = dispersion.distribution.reach();
            bounds[dispersion.field] = Bounds { least, greatest };
        }
        derived::bounds(c, &self.derived, &mut bounds);
        bounds
    }
}
