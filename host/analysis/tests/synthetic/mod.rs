//! A made-up docking campaign: the facility adds energy with delay and stiffness, and so misjudges some runs.

use std::path::Path;

use softdock_analysis::{CampaignFacts, InvalidRuns};
use softdock_campaign::metric::MetricRef;
use softdock_campaign::requirement::{Requirement, RequirementLimits, Subject};
use softdock_kernels::fields::{from_slice, to_vec};
use softdock_kernels::metrics::{Metrics, flags};
use softdock_kernels::params::Params;
use softdock_results::parity::{HALF_STEP, PARITY, RepeatedRow, write_repetition};
use softdock_results::runs::{
    Agreement, Cause, LoopRow, Outcome, Phase, RequirementColumn, RequirementResult, RunRow, RunsSchema, Status,
    metric_fields,
};
use softdock_results::shards::{Provenance, ShardIndex, ShardPlan, write_shard};
use softdock_results::traces::{NOMINAL_RUN, Signal, Trace, write_trace};

/// Every so many runs one is invalid.
const INVALID_EVERY: u64 = 997;

/// The campaign's plan.
pub(crate) fn plan(runs: u64) -> ShardPlan {
    ShardPlan { runs, shard_runs: 500 }
}

/// A limit on the force and one on the duration of the capture.
pub(crate) fn requirements() -> Vec<Requirement> {
    let requirement = |id: &str, text: &str, metric: &str, limit, probability| Requirement {
        id: id.to_owned(),
        text: text.to_owned(),
        subject: Subject::Space,
        metric: MetricRef::of(metric, &[]).expect("a metric"),
        limits: RequirementLimits { at_least: None, at_most: Some(limit) },
        probability,
        confidence: 0.9,
    };
    vec![
        requirement("DCK-010", "Peak contact force shall not exceed 400 N.", "peak_contact_force", 400.0, 0.9),
        requirement("DCK-020", "Capture completes within 22 s.", "capture_time", 22.0, 0.8),
    ]
}

/// What the analysis must know.
pub(crate) fn facts(requirements: &[Requirement], runs: u64) -> CampaignFacts<'_> {
    CampaignFacts {
        id: "probe_drogue_made_up",
        title: "Probe into drogue, made-up data",
        text: "schema = \"campaign/2\"\nid = \"probe_drogue_made_up\"\nseed = 20261121\nruns = 4000\n",
        hash: "9f1c2d7be0a4",
        seed: 20_261_121,
        version: "0.1.0",
        commit: "0123456789ab",
        plan: plan(runs),
        invalid: InvalidRuns::CountAsFailures,
        independent_runs: true,
        given_cases: false,
        extensions: &[],
        judgements: &[],
        requirements,
        agreement: &[],
    }
}

/// Where the files say they come from.
pub(crate) fn provenance() -> Provenance {
    Provenance {
        origin: facts(&[], 0).origin(),
        backend: "gpu".to_owned(),
        device: "NVIDIA H200 (Vulkan)".to_owned(),
        more: vec![("kernel_hash".to_owned(), "77aa".to_owned())],
    }
}

/// The schema of the runs.
pub(crate) fn schema() -> RunsSchema {
    let column = |requirement: &Requirement| RequirementColumn {
        id: requirement.column_id(),
        unit: requirement.unit().to_owned(),
    };
    RunsSchema::new(Vec::new(), Vec::new(), requirements().iter().map(column).collect())
}

/// A uniform number of [0, 1) from a run and a stream (SplitMix64).
pub(crate) fn uniform(run: u64, stream: u64) -> f64 {
    let mut z = (run * 64 + stream + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn null_metrics() -> Metrics<f64> {
    from_slice(&vec![0.0; metric_fields().len()])
}

/// The draw of a run.
fn draw(run: u64) -> Params<f64> {
    let mut params = Params::null();
    params.closing_speed = 0.02 + 0.06 * uniform(run, 0);
    params.loop_delay = 0.004 + 0.036 * uniform(run, 1);
    params.contact_stiffness = 5.0e3 * f64::powf(20.0, uniform(run, 2));
    params.contact_friction = 0.05 + 0.35 * uniform(run, 3);
    params.target_mass = 400.0 + 1_600.0 * uniform(run, 4);
    params.offset.y = 0.1 * (uniform(run, 5) + uniform(run, 6) + uniform(run, 7) - 1.5);
    params
}

/// One loop: force and capture of a mass on a spring, with a restitution that the delay raises.
fn metrics(params: &Params<f64>, run: u64, delay: f64) -> Metrics<f64> {
    let mut metrics = null_metrics();
    let mass = 0.8 * params.target_mass;
    let w = f64::sqrt(params.contact_stiffness / mass);
    metrics.restitution = 0.6 * f64::exp(0.8 * w * delay);
    metrics.peak_contact_force = mass * w * params.closing_speed * (1.0 + 0.3 * w * delay);
    metrics.approach_speed = params.closing_speed;
    metrics.touch_time = 0.5 / params.closing_speed.max(1e-3) * 0.6;
    metrics.capture_time = metrics.touch_time + 4.0 * metrics.restitution + 3.0 * uniform(run, 9);
    let miss = params.offset.y.abs() * (1.0 + params.contact_friction);
    let captured = miss < 0.115 && metrics.restitution < 1.15;
    if !captured {
        metrics.capture_time = -1.0;
    }
    metrics.injected_energy = 0.5 * mass * params.closing_speed.powi(2) * (f64::exp(9.0 * w * delay) - 1.0);
    metrics.end_time = 40.0;
    metrics
}

/// A run.
pub(crate) fn row(run: u64) -> RunRow {
    let params = draw(run);
    let mut space = metrics(&params, run, 0.0);
    let mut hil = metrics(&params, run, params.loop_delay);
    // A rubbing rig holds some parts that would slip off in space.
    if !docks(&space) && !docks(&hil) && hil.peak_contact_force < 550.0 && uniform(run, 10) < 0.3 {
        hil.capture_time = hil.touch_time + 5.0;
    }
    space.injected_energy = 0.0;
    let invalid = run % INVALID_EVERY == INVALID_EVERY - 1;
    let stopped = hil.injected_energy > STOP_ENERGY;
    let ended = |metrics: Metrics<f64>, stopped: bool| {
        let (outcome, cause) = match (invalid, stopped, docks(&metrics)) {
            (true, ..) => (Outcome::Invalid, Some(cause("space_non_finite", None))),
            (_, true, _) => {
                (Outcome::Aborted, Some(cause("injected_energy", Some((metrics.injected_energy, STOP_ENERGY)))))
            }
            (.., false) => (Outcome::Fail, Some(cause("capture", None))),
            _ => (Outcome::Pass, None),
        };
        let judge = |requirement: &Requirement| {
            if invalid || stopped {
                return RequirementResult::default();
            }
            let margin = requirement.margin(metrics.available(&requirement.metric.name));
            RequirementResult { margin, pass: Some(margin.is_some_and(|margin| margin >= 0.0)) }
        };
        let requirements = requirements().iter().map(judge).collect();
        LoopRow { outcome, cause, metrics, custom_metrics: Vec::new(), requirements }
    };
    let (space, hil) = (ended(space, false), ended(hil, stopped));
    let holds = |side: &LoopRow| side.requirements.iter().all(|result| result.pass == Some(true));
    let verdict = |side: &LoopRow| side.outcome == Outcome::Pass && holds(side);
    let status = if holds(&space) { Status::Pass } else { Status::Fail };
    let answer = (!stopped).then(|| verdict(&hil));
    RunRow {
        run,
        outer: 0,
        status: if invalid { Status::Invalid } else { status },
        agreement: if invalid { Agreement::Invalid } else { Agreement::of(verdict(&space), answer) },
        flags: if invalid { flags::SPACE_NON_FINITE | flags::RETRIED } else { hil_flags(&hil.metrics) },
        inputs: to_vec(&params),
        effective_mass: Some(0.8 * params.target_mass),
        space,
        hil,
    }
}

/// Injected energy that stops a session \[J\].
const STOP_ENERGY: f64 = 30.0;

/// The made-up task: capture without too much force.
fn docks(metrics: &Metrics<f64>) -> bool {
    metrics.capture_time >= 0.0 && metrics.peak_contact_force < 550.0
}

fn cause(id: &str, numbers: Option<(f64, f64)>) -> Cause {
    let (value, limit) = numbers.unzip();
    Cause { id: id.to_owned(), time: Some(9.0), value, limit, phase: Some(Phase::Contact) }
}

fn hil_flags(hil: &Metrics<f64>) -> u32 {
    if hil.restitution > 1.15 { flags::HIL_UNSTABLE } else { 0 }
}

/// Writes some shards of a campaign of so many runs.
pub(crate) fn write_shards(results: &Path, runs: u64, shards: impl Iterator<Item = u32>) {
    for shard in shards {
        let rows = plan(runs).range(shard).map(row).collect();
        write_shard(results, shard, &schema(), rows, &provenance()).expect("a shard");
    }
}

/// Writes a whole campaign with repeated runs and traces.
pub(crate) fn write_campaign(results: &Path, runs: u64) {
    write_shards(results, runs, 0..plan(runs).shards());
    let own = provenance();
    let index = ShardIndex::scan(results, plan(runs), &own.origin).expect("a folder");
    let pairs = (0..100).map(|run| {
        let (mut backend, truth) = (row(run * 7), row(run * 7));
        backend.space.metrics.peak_contact_force += 0.02 * (uniform(run, 20) - 0.5);
        backend.hil.metrics.peak_contact_force += 0.05 * (uniform(run, 21) - 0.5);
        backend.space.requirements[0].margin = backend.space.requirements[0].margin.map(|margin| margin + 0.004);
        if run == 40 {
            backend.hil.requirements[0].pass = backend.hil.requirements[0].pass.map(|pass| !pass);
        }
        if run == 41 {
            backend.hil.requirements[0].pass = backend.hil.requirements[0].pass.map(|pass| !pass);
            backend.flags ^= flags::HIL_UNSTABLE;
        }
        RepeatedRow { first: backend, second: truth }
    });
    write_repetition(&PARITY, results, &schema(), pairs.collect(), &own, &index).expect("a parity table");
    let halved = (0..50).map(|run| {
        let (first, mut second) = (row(run * 9), row(run * 9));
        second.space.metrics.peak_contact_force += 0.3;
        RepeatedRow { first, second }
    });
    write_repetition(&HALF_STEP, results, &schema(), halved.collect(), &own, &index).expect("a half-step table");
    for (run, kept_as) in
        [(NOMINAL_RUN, "nominal"), (12, "worst DCK-010"), (99, "worst DCK-020"), (700, "random"), (1_500, "random")]
    {
        write_trace(results, &trace(run, kept_as), &own, &index).expect("a trace");
    }
}

/// Bounces of decaying force, in space and, a little later and harder, on the facility.
fn trace(run: u64, kept_as: &str) -> Trace {
    let seed = run % 10_000;
    let time: Vec<f64> = (0..20_000).map(|tick| f64::from(tick) * 1.0e-3).collect();
    let force = |start: f64, decay: f64, peak: f64| {
        let bounce = move |t: &f64| {
            let since = t - start;
            let number = (since / 0.6).floor();
            let phase = since - number * 0.6;
            let inside = since >= 0.0 && phase < 0.25 && number < 6.0;
            Some(if inside {
                peak * f64::powf(decay, number) * f64::sin(phase / 0.25 * std::f64::consts::PI)
            } else {
                0.0
            })
        };
        time.iter().map(bounce).collect::<Vec<_>>()
    };
    let peak = 120.0 + 150.0 * uniform(seed, 30);
    let signal = |name: &str, place: &str, values| Signal {
        name: name.to_owned(),
        unit: "N".to_owned(),
        description: format!("magnitude of the contact force, {place}"),
        values,
    };
    let start = 8.0 + uniform(seed, 31);
    let signals = vec![
        signal("space_contact_force_n", "in space", force(start, 0.6, peak)),
        signal("hil_contact_force_n", "on the facility", force(start + 0.016, 0.8, 1.12 * peak)),
    ];
    Trace { run, kept_as: kept_as.to_owned(), time, signals }
}
