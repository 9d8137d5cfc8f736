//! Devices that fail during a campaign: files on disk, end of the command, failover.

use crate::finish::finish;
use crate::folder::ResultsFolder;
use crate::make::{RunOptions, make_missing};
use crate::observer::{Cancel, Context, Silent};
use crate::outcome::Incomplete;
use crate::part::Part;
use crate::run_engine::RunEngine;
use softdock_campaign::Campaign;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::gpu::{Adapters, GpuEngine};
use softdock_engine::{Choice, Engine, EngineError, Job, RunInput};
use softdock_kernels::outcome::{Finished, Stop};
use softdock_kernels::session::Rule;
use softdock_results::runs::{Agreement, Outcome};
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex};

/// Returns a context without observer and without cancellation.
fn context() -> Context<'static> {
    static CANCEL: LazyLock<Cancel> = LazyLock::new(Cancel::default);
    Context { observer: &Silent, cancel: &CANCEL }
}

fn whole_campaign() -> RunOptions {
    RunOptions::default()
}

fn every_other_shard() -> RunOptions {
    RunOptions { part: Part { index: 0, count: 2 }, ..RunOptions::default() }
}

/// A GPU whose device is destroyed in the middle of one of its batches.
struct Fragile {
    engine: GpuEngine,
    good_batches: u32,
}

impl Fragile {
    fn after(good_batches: u32) -> Box<Self> {
        let engine = GpuEngine::new(Adapters::Any).expect("tests/run.sh installs lavapipe, a software adapter");
        Box::new(Self { engine, good_batches })
    }
}

impl Engine for Fragile {
    fn device(&self) -> String {
        self.engine.device()
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        let destroy = self.engine.breaker();
        let breaks = self.good_batches == 0;
        self.good_batches = self.good_batches.saturating_sub(1);
        self.engine.run(job, runs, &|ended| {
            if breaks {
                destroy();
            }
            progress(ended)
        })
    }
}

/// The smoke campaign in eight shards of eight runs. They end one after the other, so that a batch has a middle.
fn campaign(folder: &Path) -> Campaign {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
    std::fs::create_dir_all(folder.join("scenarios")).expect("a folder");
    std::fs::copy(shipped.join("scenarios/smoke.toml"), folder.join("scenarios/smoke.toml")).expect("the scenario");
    let text = std::fs::read_to_string(shipped.join("smoke.toml")).expect("the campaign");
    let file = folder.join("smoke.toml");
    std::fs::write(&file, text.replace("shard_runs = 32", "shard_runs = 8")).expect("written");
    softdock_campaign::load(&file).expect("it loads")
}

/// CPU lanes that the user stops after so many runs, and what they were asked for.
struct Interrupted {
    runs: usize,
    asked: Arc<Mutex<Vec<u64>>>,
}

impl Engine for Interrupted {
    fn device(&self) -> String {
        CpuEngine::new().device()
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        let made = &runs[..runs.len().min(self.runs)];
        self.runs -= made.len();
        self.asked.lock().expect("no holder panics").extend(made.iter().map(|run| run.run));
        let finished = CpuEngine::new().run(job, made, progress)?;
        if made.len() == runs.len() { Ok(finished) } else { Err(EngineError::Stopped { finished }) }
    }
}

#[test]
fn interrupted_campaigns_repeat_no_run_and_give_the_same_shards() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let campaign = campaign(temporary.path());
    let claimed =
        |name: &str| ResultsFolder::claim(&temporary.path().join(name), campaign.clone(), context()).expect("claimed");
    let (whole, stopped) = (claimed("whole"), claimed("stopped"));
    let asked = Arc::new(Mutex::new(Vec::new()));
    let engine = |runs| RunEngine::with(&campaign, Box::new(Interrupted { runs, asked: Arc::clone(&asked) }));
    assert!(make_missing(&whole, &whole_campaign(), &mut engine(64), context()).is_ok());
    asked.lock().expect("no holder panics").clear();
    for (runs, shards, kept) in [(11, 1, 3), (2, 1, 5), (5, 2, 2), (46, 8, 0)] {
        assert!(make_missing(&stopped, &whole_campaign(), &mut engine(runs), context()).is_ok());
        let index = stopped.shards().expect("a folder");
        assert!(index.foreign.is_empty(), "{:?}", index.foreign);
        let partial = softdock_results::partial::partial_runs(&stopped.path).expect("a folder");
        assert_eq!((index.complete.len(), partial), (shards, kept), "after {runs} runs more");
    }
    let mut asked = asked.lock().expect("no holder panics").clone();
    asked.sort_unstable();
    assert_eq!(asked, (0..64).collect::<Vec<_>>(), "each run once");
    for shard in 0..8 {
        let [one, two] = [&whole, &stopped]
            .map(|folder| std::fs::read(softdock_results::shards::shard_path(&folder.path, shard)).expect("a shard"));
        assert!(one == two, "shard {shard}");
    }
    assert!(!stopped.path.join("partial").exists());
}

/// Backend of every shard that is there.
fn backends(folder: &ResultsFolder) -> Vec<(u32, String)> {
    let index = folder.shards().expect("a folder");
    assert!(index.foreign.is_empty(), "{:?}", index.foreign);
    index.complete.into_iter().map(|(shard, file)| (shard, file.backend)).collect()
}

fn of(backend: &str, shards: &[u32]) -> Vec<(u32, String)> {
    shards.iter().map(|shard| (*shard, backend.to_owned())).collect()
}

#[test]
fn lost_gpu_loses_no_finished_shard_and_the_command_resumes() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let campaign = campaign(temporary.path());
    let folder = ResultsFolder::claim(&temporary.path().join("out"), campaign.clone(), context()).expect("claimed");
    let mut engine = RunEngine::with(&campaign, Fragile::after(1));
    // Every other shard, so that each is a batch of its own: the first is written, the second is lost.
    let end = make_missing(&folder, &every_other_shard(), &mut engine, context()).expect("no other error");
    assert_eq!(end, Some(Incomplete::DeviceFailed));
    assert_eq!(backends(&folder), of("gpu", &[0]));
    let written = std::fs::read(folder.path.join("runs/shard=00000.parquet")).expect("the shard");
    // The same command: a new device makes the missing runs and keeps the existing ones.
    let mut engine = RunEngine::open(&campaign, Choice::Gpu, context()).expect("lavapipe");
    assert!(make_missing(&folder, &whole_campaign(), &mut engine, context()).is_ok());
    assert_eq!(backends(&folder), of("gpu", &[0, 1, 2, 3, 4, 5, 6, 7]));
    assert_eq!(std::fs::read(folder.path.join("runs/shard=00000.parquet")).expect("the shard"), written);
}

#[test]
fn cpu_completes_a_campaign_after_gpu_loss_and_records_it() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let campaign = campaign(temporary.path());
    let folder = ResultsFolder::claim(&temporary.path().join("out"), campaign.clone(), context()).expect("claimed");
    let mut engine = RunEngine::with_failover(&campaign, Fragile::after(2), context());
    assert!(make_missing(&folder, &every_other_shard(), &mut engine, context()).is_ok());
    assert_eq!(backends(&folder), [of("gpu", &[0, 2]), of("cpu", &[4, 6])].concat());
    assert!(make_missing(&folder, &whole_campaign(), &mut engine, context()).is_ok());
    let summary = finish(&folder, folder.shards().expect("a folder"), context()).expect("judged");
    let made: Vec<_> = summary.completeness.devices.iter().map(|made| (made.backend.as_str(), made.shards)).collect();
    assert_eq!(made, [("cpu", 6), ("gpu", 2)]);
    assert!(softdock_analysis::verdict_text(&summary).contains("rows of two backends"));
    let page = std::fs::read_to_string(folder.path.join("report.html")).expect("the page");
    assert!(page.contains("The rows come from two backends"));
    // The f64 comparison is of the GPU's rows alone: four of its sixteen, a quarter.
    assert_eq!(summary.parity.expect("repeated runs").runs, 4);
}

#[test]
fn agreement_counts_requirements_and_ignores_aborted_sessions() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut campaign = campaign(folder.path());
    // A requirement that asks for more than the task.
    let force =
        campaign.requirements.iter_mut().find(|r| r.metric.name == "peak_contact_force").expect("a limit on the force");
    force.limits.at_most = Some(300.0);
    let builder = crate::rows::RowBuilder::new(&campaign);
    let input = RunInput::new(0, campaign.draw(0).expect("a draw").params);
    let made = CpuEngine::new().run(&builder.job, &[input], &|_| true).expect("the CPU is there");
    let mut run = made[0];
    run.hil = run.space;
    assert_eq!(builder.row(&run).agreement, Agreement::TruePass, "the run docks, and meets every requirement");
    // A requirement that fails on the facility alone, while the task succeeds on both.
    assert!(campaign.scenario.model.task.max_contact_force > 350.0);
    run.hil.peak_contact_force = 350.0;
    let row = builder.row(&run);
    assert_eq!((row.hil.outcome, row.agreement), (Outcome::Pass, Agreement::FalseFail));
    // A rule that stops the session.
    run.stop = Some(Stop { rule: Rule::InjectedEnergy, value: 0.7 });
    let row = builder.row(&run);
    let cause = row.hil.cause.expect("a cause");
    assert_eq!((row.hil.outcome, row.agreement), (Outcome::Aborted, Agreement::AbortedPass));
    assert_eq!((cause.id.as_str(), cause.value, cause.time), ("injected_energy", Some(0.7), Some(run.hil.end_time)));
    assert!(row.hil.requirements.iter().all(|result| result.pass.is_none()), "no answer to any requirement");
}

/// CPU lanes that record what they were asked for.
struct Recording {
    device: &'static str,
    asked: Arc<Mutex<Vec<u64>>>,
}

impl Engine for Recording {
    fn device(&self) -> String {
        self.device.to_owned()
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        self.asked.lock().expect("no holder panics").extend(runs.iter().map(|run| run.run));
        CpuEngine::new().run(job, runs, progress)
    }
}

#[test]
fn writers_of_one_folder_run_each_run_once() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let campaign = campaign(temporary.path());
    let asked = Arc::new(Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                let folder = ResultsFolder::claim(&temporary.path().join("out"), campaign.clone(), context());
                let folder = folder.expect("claimed");
                let recording = Recording { device: "cpu f64", asked: Arc::clone(&asked) };
                let mut engine = RunEngine::with(&campaign, Box::new(recording));
                assert_eq!(make_missing(&folder, &whole_campaign(), &mut engine, context()).expect("no error"), None);
                assert!(folder.shards().expect("a folder").is_complete(), "whoever ends has waited for the others");
            });
        }
    });
    let mut asked = asked.lock().expect("no holder panics").clone();
    asked.sort_unstable();
    assert_eq!(asked, (0..64).collect::<Vec<_>>());
}

/// CPU lanes that report so many runs as finished and are lost then, as a GPU.
struct LostAfter(usize);

impl Engine for LostAfter {
    fn device(&self) -> String {
        "a GPU that fails".to_owned()
    }

    fn lanes(&self) -> usize {
        8
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        CpuEngine::new().run(job, &runs[..self.0], progress)?;
        Err(EngineError::DeviceLost("a test".to_owned()))
    }
}

#[test]
fn finished_runs_of_a_lost_batch_are_on_disk_and_not_repeated() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let campaign = campaign(temporary.path());
    let folder = ResultsFolder::claim(&temporary.path().join("out"), campaign.clone(), context()).expect("claimed");
    let options = RunOptions { save_every: std::time::Duration::ZERO, ..RunOptions::default() };
    let mut engine = RunEngine::with(&campaign, Box::new(LostAfter(27)));
    assert_eq!(
        make_missing(&folder, &options, &mut engine, context()).expect("no error"),
        Some(Incomplete::DeviceFailed)
    );
    let partial = softdock_results::partial::partial_runs(&folder.path).expect("a folder");
    assert_eq!((backends(&folder).len(), partial), (3, 3), "three shards of eight runs, and three runs more");
    // The device is back.
    let asked = Arc::new(Mutex::new(Vec::new()));
    let recording = Recording { device: "a GPU that fails", asked: Arc::clone(&asked) };
    let mut engine = RunEngine::with(&campaign, Box::new(recording));
    assert_eq!(make_missing(&folder, &options, &mut engine, context()).expect("no error"), None);
    assert_eq!(*asked.lock().expect("no holder panics"), (27..64).collect::<Vec<_>>());
    assert!(folder.shards().expect("a folder").is_complete());
}

#[test]
fn campaign_with_keys_of_the_scenario_repeats_its_runs_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    campaign(folder.path());
    let file = folder.path().join("smoke.toml");
    let text = std::fs::read_to_string(&file).expect("the campaign");
    let key = "\n[[dispersion]]\ntarget = \"scenario.latch.depth\"\n\
               dist = { kind = \"triangular\", min = \"4 mm\", mode = \"5 mm\", max = \"12 mm\" }\n";
    std::fs::write(&file, text.replace("keep = [", "keep = [\"nominal\", ") + key).expect("written");
    let keyed = softdock_campaign::load(&file).unwrap_or_else(|problems| panic!("{problems}"));
    assert!(matches!(RunEngine::open(&keyed, Choice::Gpu, context()), Err(EngineError::OwnPlants)));

    let results = folder.path().join("results");
    let ended = crate::run::run(keyed.clone(), &results, &RunOptions::default(), context()).expect("it runs");
    assert!(ended.incomplete.is_none());
    let rows = ResultsFolder::open(&results).expect("a folder").shards().expect("shards");
    let row = rows.read_run(3).expect("readable").expect("run 3");
    assert_eq!(row.inputs.last(), keyed.draw(3).expect("a draw").inputs().last(), "the row states the key's value");
    for run in [0, 3] {
        let repeated = crate::replay::replay_run(&results, run, None).expect("it repeats");
        assert!(!repeated.is_wrong() && repeated.text().contains("equal, bit for bit"), "{}", repeated.text());
    }

    // The undispersed run is the scenario's, whatever the keys.
    let plain = softdock_campaign::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/smoke.toml"));
    let plain = plain.expect("the shipped campaign");
    let made = |campaign: &Campaign| {
        let builder = crate::rows::RowBuilder::new(campaign);
        let input = builder.input(softdock_results::traces::NOMINAL_RUN, None).expect("no draw");
        softdock_engine::cpu::replay(&builder.job, input, &mut |_| ())
    };
    assert_eq!(made(&keyed), made(&plain));
}
