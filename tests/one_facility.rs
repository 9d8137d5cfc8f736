//! A draw has the same outcome in the campaign and on the robots.

use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::criteria::first_breach;
use softdock_engine::cpu::{CpuEngine, replay};
use softdock_engine::{Engine, Job, RunInput};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::{KeepOut, SessionRules};
use softdock_kernels::outcome::{Finished, Stop};
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::session::{Rule, axes_asked};
use softdock_kernels::vector::{Pose, vec3};
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::prediction::expect;
use softdock_realtime::time::Nanos;
use softdock_test_size::sized;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// How a session ended: the rule that stopped it, or the criterion that failed, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ended {
    Stopped(Rule, f64),
    Failed(&'static str),
    Passed,
}

impl Ended {
    /// The same outcome for the same cause.
    fn is_alike(&self, other: &Self) -> bool {
        self.word() == other.word()
    }

    /// Stopped at the same time, within a cycle \[s\].
    fn is_as_early(&self, other: &Self, cycle: f64) -> bool {
        match (self, other) {
            (Self::Stopped(_, one), Self::Stopped(_, two)) => (one - two).abs() <= cycle * (1.0 + 1e-9),
            _ => true,
        }
    }

    fn word(&self) -> String {
        match self {
            Self::Stopped(rule, _) => format!("stopped by {}", rule.row().id),
            Self::Failed(criterion) => format!("failed {criterion}"),
            Self::Passed => "passed".to_owned(),
        }
    }
}

fn ended(plant: &Plant, stop: Option<Stop>, metrics: &Metrics<f64>, time: f64) -> Ended {
    match (stop, first_breach(&plant.task, metrics)) {
        (Some(stop), _) => Ended::Stopped(stop.rule, time),
        (None, Some((criterion, _))) => Ended::Failed(criterion.id),
        (None, None) => Ended::Passed,
    }
}

#[test]
fn farm_and_drive_give_the_same_outcome_for_the_same_draw() {
    let draws = sized(40, 200);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/probe_drogue.toml");
    let campaign = Campaign::load(&file).expect("the shipped campaign");
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let station = Arc::new(campaign.scenario.station.clone().expect("it names its facility"));
    let input = |run: u64| RunInput::new(run, campaign.draw(run).expect("a draw").params);
    let inputs: Vec<RunInput> = (0..draws).map(input).collect();
    let job = Job::new((*plant).clone(), campaign.seed, true);
    let farm = CpuEngine::new().run(&job, &inputs, &|_| true).expect("the CPU is there");
    let key = philox::key(campaign.seed);
    let cycle = Nanos::from_seconds(plant.timing.tick());
    let pairs: Vec<(Ended, Ended)> = farm
        .par_iter()
        .map(|farm| {
            let params = farm.params;
            let task = SessionTask::new(Arc::clone(&plant), Arc::clone(&station), farm.run, params);
            let drive = expect(&task, key, &params, cycle).expect("in reach");
            let one = ended(&plant, farm.stop, &farm.hil, farm.hil.end_time);
            (one, ended(&plant, drive.stop, &drive.metrics, drive.run_time))
        })
        .collect();
    let differing: Vec<String> = (0..)
        .zip(&pairs)
        .filter(|(_, (one, two))| !(one.is_alike(two) && one.is_as_early(two, cycle.seconds())))
        .map(|(run, pair)| format!("run {run}: {pair:?}"))
        .collect();
    assert!(differing.is_empty(), "{} of {draws} differ:\n{}", differing.len(), differing.join("\n"));
    let kinds = pairs.iter().map(|(one, _)| one.word()).collect::<BTreeSet<_>>();
    assert!(kinds.len() > 3, "passes, failures and several rules: {kinds:?}");
}

/// Rules of the workspace, each alone and so tight that it binds in the shipped campaign.
fn tight_rules(plant: &Plant) -> [(Rule, SessionRules); 4] {
    let angle = axes_asked(plant, &plant.start).least_sine.asin();
    // A sheet between the parts, which both approach.
    let sheet = KeepOut { name: "sheet".to_owned(), frame: Pose::identity(), half: vec3(5e-3, 0.3, 0.3) };
    let none = || SessionRules::NONE;
    [
        (Rule::ToolSpeed, SessionRules { tool_speed: 0.06, ..none() }),
        (Rule::KeepOut, SessionRules { keep_out: vec![sheet], ..none() }),
        (Rule::ArmDistance, SessionRules { arm_distance: 0.38, ..none() }),
        (Rule::Singularity, SessionRules { singularity: angle - 1f64.to_radians(), ..none() }),
    ]
}

#[test]
fn each_rule_of_the_workspace_stops_farm_and_drive_alike() {
    let (campaign, _) = docking(0);
    let shipped = Plant::new(campaign.scenario.model.clone());
    let key = philox::key(campaign.seed);
    let cycle = Nanos::from_seconds(shipped.timing.tick());
    for (rule, rules) in tight_rules(&shipped) {
        let mut model = campaign.scenario.model.clone();
        let mut station = campaign.scenario.station.clone().expect("it names its facility");
        (model.facility.rules, station.rules) = (rules.clone(), rules);
        model.facility.session_robots.as_mut().expect("the robots of its facility").tool_radius = [5e-3; 2];
        let (plant, station) = (Arc::new(Plant::new(model)), Arc::new(station));
        let inputs: Vec<RunInput> =
            (0..sized(24, 200)).map(|run| RunInput::new(run, campaign.draw(run).expect("a draw").params)).collect();
        let job = Job::new((*plant).clone(), campaign.seed, true);
        let farm = CpuEngine::new().run(&job, &inputs, &|_| true).expect("the CPU is there");
        let times: Vec<Option<f64>> = farm
            .par_iter()
            .map(|farm| {
                let (plant, station) = (Arc::clone(&plant), Arc::clone(&station));
                let task = SessionTask::new(plant, station, farm.run, farm.params);
                let drive = expect(&task, key, &farm.params, cycle).expect("in reach");
                let one = ended(&job.plant, farm.stop, &farm.hil, farm.hil.end_time);
                let two = ended(&job.plant, drive.stop, &drive.metrics, drive.run_time);
                let alike = one.is_alike(&two) && one.is_as_early(&two, cycle.seconds());
                assert!(alike, "{rule:?}, run {}: {one:?} in the farm, {two:?} in drive", farm.run);
                if let (Some(farm), Some(drive)) = (farm.stop, drive.stop) {
                    let limit = (rule.row().limit)(&job.plant.facility);
                    let least = matches!(rule, Rule::ArmDistance | Rule::Singularity);
                    let is_beyond = |value: f64| if least { value < limit } else { value > limit };
                    assert!(is_beyond(farm.value) && is_beyond(drive.value), "{farm:?}, {drive:?}, limit {limit}");
                }
                matches!(one, Ended::Stopped(met, _) if met == rule).then_some(()).and(match one {
                    Ended::Stopped(_, time) => Some(time),
                    _ => None,
                })
            })
            .collect();
        let late = times.iter().flatten().filter(|time| **time > 0.1).count();
        println!("{rule:?}: {} of {} stopped, {late} of them after 0.1 s", times.iter().flatten().count(), times.len());
        assert!(late > 3, "{rule:?} stops {late} of {} sessions on their way", times.len());
    }
}

/// The shipped docking campaign, and its first runs.
fn docking(runs: u64) -> (Campaign, Vec<RunInput>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/probe_drogue.toml");
    let campaign = Campaign::load(&file).expect("the shipped campaign");
    let inputs = (0..runs).map(|run| RunInput::new(run, campaign.draw(run).expect("a draw").params)).collect();
    (campaign, inputs)
}

/// The relative positions of the parts on the facility, tick by tick.
fn path(job: &Job, input: RunInput) -> (Finished, Vec<[u64; 3]>) {
    let mut path = Vec::new();
    let finished = replay(job, input, &mut |signals| {
        let gap = signals.parts[1].a.position - signals.parts[1].b.position;
        path.push([gap.x, gap.y, gap.z].map(f64::to_bits));
    });
    (finished, path)
}

#[test]
fn rules_change_no_bit_before_they_stop_a_run() {
    let (campaign, inputs) = docking(12);
    let supervised = Job::new(Plant::new(campaign.scenario.model.clone()), campaign.seed, true);
    let mut free = campaign.scenario.model.clone();
    free.facility.rules = SessionRules::NONE;
    // The robots stay: they are commanded poses, and that changes bits.
    let robots = free.facility.session_robots.as_mut().expect("the robots of its facility");
    robots.limits.iter_mut().for_each(|limit| (limit.lower, limit.upper) = (-1e9, 1e9));
    robots.correction = [1e9; 2];
    let free = Job::new(Plant::new(free), campaign.seed, true);
    let mut stopped = 0;
    for input in inputs {
        let ((one, guarded), (_, whole)) = (path(&supervised, input.clone()), path(&free, input.clone()));
        let end = match one.stop {
            // The signals are those of the loop's end from here on.
            Some(_) => (one.hil.end_time / campaign.scenario.model.timing.tick()).round() as usize,
            None => guarded.len(),
        };
        stopped += usize::from(one.stop.is_some());
        assert!(end > 100 && guarded[..end] == whole[..end], "run {}", input.run);
    }
    assert!((3..12).contains(&stopped), "some sessions are stopped, some not: {stopped}");
}

#[test]
fn passing_session_violates_no_rule() {
    let (campaign, inputs) = docking(60);
    let job = Job::new(Plant::new(campaign.scenario.model.clone()), campaign.seed, true);
    let rows = CpuEngine::new().run(&job, &inputs, &|_| true).expect("the CPU is there");
    let passes = rows.iter().filter(|run| run.stop.is_none() && first_breach(&job.plant.task, &run.hil).is_none());
    let limit = campaign.scenario.model.facility.rules.injected_energy;
    // The rule sees measured quantities, the metric the true ones: they differ by the sensor's delay.
    let worst = passes.clone().map(|run| run.hil.injected_energy).fold(0.0, f64::max);
    assert!(
        passes.count() > 5 && worst < 1.2 * limit,
        "{worst} J injected by a session that passes, {limit} J allowed"
    );
}

#[test]
fn contact_latch_and_interface_force_are_distinguished() {
    let (campaign, inputs) = docking(40);
    let mut model = campaign.scenario.model.clone();
    model.facility.session_robots = None;
    model.facility.rules = SessionRules::NONE;
    let job = Job::new(Plant::new(model), campaign.seed, true);
    let rows = CpuEngine::new().run(&job, &inputs, &|_| true).expect("the CPU is there");
    let mut latched = 0;
    for run in &rows {
        let m = &run.space;
        assert!(
            m.peak_interface_force <= (m.peak_contact_force + m.peak_latch_force) * (1.0 + 1e-12),
            "run {}",
            run.run
        );
        if m.capture_time < 0.0 {
            assert_eq!(
                (m.peak_latch_force, m.peak_latch_force_time),
                (0.0, -1.0),
                "run {}: nothing is latched",
                run.run
            );
            assert_eq!(m.peak_interface_force.to_bits(), m.peak_contact_force.to_bits(), "run {}", run.run);
        } else {
            latched += 1;
            assert!(m.peak_latch_force > 0.0 && m.peak_latch_force_time >= m.capture_time, "run {}", run.run);
        }
        assert!(m.first_contact_impulse <= m.impulse + 1e-12 && m.first_contact_force <= m.peak_contact_force);
        assert_eq!(m.contact_count > 0.0, m.touch_time >= 0.0);
    }
    assert!(latched > 20, "{latched} of 40 are captured in space");
}
