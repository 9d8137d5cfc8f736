//! The report of one graphics card: its speed over lanes, parity with f64, loss of the device, and a campaign by phases.

use crate::error::{FarmError, Result};
use crate::make::RunOptions;
use crate::manifest::Build;
use crate::observer::{Context, Note, Observer, Work};
use crate::outcome::Shown;
use serde::Serialize;
use softdock_analysis::parity::Parity;
use softdock_campaign::Campaign;
use softdock_engine::bench::{Scene, Windows, device_peak, speed};
use softdock_engine::gpu::{Adapters, GpuEngine, MOST_LANES};
use softdock_engine::{Choice, Engine, EngineError, Job, RunInput, is_noisy};
use softdock_kernels::outcome::Finished;
use softdock_kernels::plant::Plant;
use softdock_results::write_file;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

/// Least number of runs that are repeated in f64.
const PARITY_RUNS: f64 = 1000.0;

/// Lanes of the batch whose device is destroyed; twice as many runs, so that it needs more than one dispatch.
const LOSS_LANES: usize = 1024;

/// What is measured.
#[derive(Clone, Debug)]
pub struct CardOptions {
    /// Numbers of lanes.
    pub lanes: Vec<usize>,
    /// Length and number of the windows of each speed.
    pub windows: Windows,
    /// Whether a software driver counts as a card.
    pub accepts_software: bool,
}

impl CardOptions {
    /// 1,024 to 65,536 lanes in windows of 1 s, on a real GPU.
    pub fn full() -> Self {
        let lanes = (10..=16).map(|power| 1 << power).collect();
        Self { lanes, windows: Windows::FULL, accepts_software: false }
    }
}

/// What one card does; [`CardReport::faults`] is empty if it may be used.
#[derive(Clone, Debug, Serialize)]
pub struct CardReport {
    /// Format of this report.
    pub schema: &'static str,
    /// The build of softdock.
    pub softdock: Build,
    /// Card, interface and driver.
    pub device: String,
    /// Whether it is a software driver on the host's cores.
    pub is_software: bool,
    /// f32 peak, measured in the same call \[flop/s\].
    pub peak_flop_per_s: f64,
    /// Ticks per second by scene and number of lanes.
    pub rates: Vec<CardRate>,
    /// What follows the loss of the device.
    pub loss: DeviceLoss,
    /// A campaign on the card.
    pub campaign: CardCampaign,
    /// Reasons not to use the card.
    pub faults: Vec<String>,
}

/// Speed of one scene with a number of lanes.
#[derive(Clone, Debug, Serialize)]
pub struct CardRate {
    /// `ideal` (space alone), `lag` (both loops, lagging robots), `joint` (both loops, robots joint by joint).
    pub scene: &'static str,
    /// Runs side by side.
    pub lanes: usize,
    /// Ticks per second over all of them.
    pub ticks_per_s: f64,
    /// Time to compile the kernel \[s\].
    pub compilation_s: f64,
    /// Share of the f32 peak, where the operations are counted: the ideal scene.
    pub share_of_peak: Option<f64>,
}

/// What followed the destruction of the device during a batch.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceLoss {
    /// The error that the batch returned; none if it returned rows.
    pub error: Option<String>,
    /// Whether a new device gave the same rows as before, bit for bit.
    pub rows_are_equal: bool,
    /// Seconds from the destruction to the end of the repeated batch.
    pub recovery_s: f64,
}

/// A campaign on the card.
#[derive(Clone, Debug, Serialize)]
pub struct CardCampaign {
    /// Id of the campaign.
    pub id: String,
    /// Number of runs.
    pub runs: u64,
    /// Seconds of the whole, from the campaign to its page.
    pub seconds: f64,
    /// Seconds of each phase.
    pub phases: Vec<CardPhase>,
    /// Runs repeated in f64.
    pub parity: Option<Parity>,
    /// Whether it is complete.
    pub is_complete: bool,
}

/// Time of one phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CardPhase {
    /// `run`, `parity`, `half step`, and `rest`: kernels, judgement, time histories, files, page.
    pub name: &'static str,
    /// Runs that it makes; none for the rest.
    pub runs: Option<u64>,
    /// Time \[s\].
    pub seconds: f64,
}

/// Measures the first card and runs the campaign on it in the folder `results`, which must not exist.
///
/// # Errors
/// If there is no card, the card fails where it is not asked to, or the campaign cannot be run.
pub fn card_report(campaign: Campaign, results: &Path, options: &CardOptions, context: Context) -> Result<CardReport> {
    let adapters = if options.accepts_software { Adapters::Any } else { Adapters::Hardware };
    let mut engine = GpuEngine::new(adapters)?;
    let (device, is_software) = (engine.device(), engine.is_software());
    let peak = device_peak(&engine)?;
    let rates = rates(&mut engine, options, peak)?;
    drop(engine);
    let loss = lose_device(&campaign, adapters)?;
    let campaign = timed_campaign(campaign, results, context)?;
    let faults = faults(&loss, &campaign);
    let schema = "card/1";
    let softdock = Build::own();
    Ok(CardReport { schema, softdock, device, is_software, peak_flop_per_s: peak, rates, loss, campaign, faults })
}

fn rates(engine: &mut GpuEngine, options: &CardOptions, peak: f64) -> Result<Vec<CardRate>> {
    let mut rates = Vec::new();
    for (name, scene) in [("ideal", Scene::IdealStep), ("lag", Scene::HilLoop), ("joint", Scene::JointLoop)] {
        for lanes in &options.lanes {
            engine.set_lanes(*lanes);
            let windows = options.windows;
            let speed = speed(engine, scene, *lanes as u64, windows.seconds, windows.repeats)?;
            let share = (scene == Scene::IdealStep).then(|| speed.ticks * scene.flops() as f64 / peak);
            rates.push(CardRate {
                scene: name,
                lanes: *lanes,
                ticks_per_s: speed.ticks,
                compilation_s: speed.first,
                share_of_peak: share,
            });
        }
    }
    engine.set_lanes(MOST_LANES);
    Ok(rates)
}

/// Destroys the device during a batch of the campaign, opens it again and repeats the batch.
fn lose_device(campaign: &Campaign, adapters: Adapters) -> Result<DeviceLoss> {
    let runs = (0..campaign.runs.min(2 * LOSS_LANES as u64)).map(|place| campaign.run_at(place));
    let inputs = runs.map(|run| Ok(RunInput::new(run, campaign.draw(run)?.params)));
    let inputs: Vec<RunInput> = inputs.collect::<Result<_>>()?;
    let noisy = inputs.iter().any(|input| is_noisy(&input.params));
    let plant = Plant::new(campaign.scenario.model.clone()).with_effects(campaign.effects());
    let job = Job::new(plant, campaign.seed, noisy);
    let open = || -> std::result::Result<GpuEngine, EngineError> {
        let mut engine = GpuEngine::new(adapters)?;
        engine.set_lanes(LOSS_LANES);
        Ok(engine)
    };
    let before = open()?.run(&job, &inputs, &|_| true)?;
    let mut lost = open()?;
    let destroy = lost.breaker();
    let destroyed = Mutex::new(None);
    let ended = lost.run(&job, &inputs, &|_: &[Finished]| {
        destroyed.lock().expect("no holder panics").get_or_insert_with(Instant::now);
        destroy();
        true
    });
    drop(lost);
    let after = open()?.run(&job, &inputs, &|_| true)?;
    let since = destroyed.into_inner().expect("no holder panics");
    Ok(DeviceLoss {
        error: ended.err().map(|error| error.to_string()),
        rows_are_equal: after == before,
        recovery_s: since.map_or(0.0, |since| since.elapsed().as_secs_f64()),
    })
}

fn timed_campaign(mut campaign: Campaign, results: &Path, context: Context) -> Result<CardCampaign> {
    if results.exists() {
        let message = format!("`{}` exists, and the time of a campaign counts from its first run", results.display());
        return Err(FarmError::refused(message, "name a folder that does not exist"));
    }
    let share = PARITY_RUNS / campaign.runs as f64;
    campaign.execution.parity = campaign.execution.parity.max(share).min(1.0);
    let (id, runs) = (campaign.id.clone(), campaign.runs);
    let timer = PhaseTimer { inner: context.observer, begun: Mutex::default(), phases: Mutex::default() };
    let began = Instant::now();
    let options = RunOptions { choice: Choice::Gpu, ..RunOptions::default() };
    let ended = crate::run(campaign, results, &options, Context { observer: &timer, cancel: context.cancel })?;
    let seconds = began.elapsed().as_secs_f64();
    let is_complete = ended.incomplete.is_none();
    let parity = match ended.shown {
        Shown::Campaign(summary) => summary.parity,
        Shown::Nothing | Shown::Variants(_) => None,
    };
    let mut phases = timer.phases.into_inner().expect("no holder panics");
    let rest = seconds - phases.iter().map(|phase| phase.seconds).sum::<f64>();
    phases.push(CardPhase { name: "rest", runs: None, seconds: rest });
    Ok(CardCampaign { id, runs, seconds, phases, parity, is_complete })
}

fn faults(loss: &DeviceLoss, campaign: &CardCampaign) -> Vec<String> {
    let mut faults = Vec::new();
    if loss.error.is_none() {
        faults.push("a batch whose device was destroyed returned rows".to_owned());
    }
    if !loss.rows_are_equal {
        faults.push("a new device gives other rows than the one before".to_owned());
    }
    if !campaign.is_complete {
        faults.push("the campaign is not complete".to_owned());
    }
    match &campaign.parity {
        None => faults.push("the campaign has no runs in f64 to compare with".to_owned()),
        Some(parity) => {
            let unexplained = parity.flips.iter().filter(|flip| flip.within_three_rms == Some(false) && !flip.diverged);
            let runs: Vec<String> = unexplained.map(|flip| format!("{} ({})", flip.run, flip.column)).collect();
            if !runs.is_empty() {
                faults.push(format!("verdicts differ from f64 beyond rounding in runs {}", runs.join(", ")));
            }
        }
    }
    faults
}

/// Measures the time of every kind of work and passes the calls on.
struct PhaseTimer<'a> {
    inner: &'a dyn Observer,
    begun: Mutex<Option<(Instant, u64)>>,
    phases: Mutex<Vec<CardPhase>>,
}

impl Observer for PhaseTimer<'_> {
    fn begin(&self, work: Work, total: u64) {
        *self.begun.lock().expect("no holder panics") = Some((Instant::now(), total));
        self.inner.begin(work, total);
    }

    fn progress(&self, work: Work, done: u64) {
        self.inner.progress(work, done);
    }

    fn end(&self, work: Work) {
        if let Some((began, runs)) = self.begun.lock().expect("no holder panics").take() {
            let seconds = began.elapsed().as_secs_f64();
            let phase = CardPhase { name: work.name(), runs: Some(runs), seconds };
            self.phases.lock().expect("no holder panics").push(phase);
        }
        self.inner.end(work);
    }

    fn note(&self, note: &Note) {
        self.inner.note(note);
    }
}

impl CardReport {
    /// Writes `card.json` in a folder.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("a report has text keys only") + "\n";
        Ok(write_file(&folder.join("card.json"), text.as_bytes())?)
    }

    /// As tables for a terminal.
    pub fn text(&self) -> String {
        let mut out = format!("{}\npeak {:.1} Gflop/s in f32\n\n", self.device, self.peak_flop_per_s / 1e9);
        out += &format!("{:<6} {:>7} {:>14} {:>12} {:>8}\n", "scene", "lanes", "ticks/s", "compile s", "of peak");
        for rate in &self.rates {
            let share = rate.share_of_peak.map_or(String::new(), |share| format!("{:.1} %", 100.0 * share));
            let (scene, lanes, ticks, compilation) = (rate.scene, rate.lanes, rate.ticks_per_s, rate.compilation_s);
            out += &format!("{scene:<6} {lanes:>7} {ticks:>14.0} {compilation:>12.2} {share:>8}\n");
        }
        let loss = &self.loss;
        let equal = if loss.rows_are_equal { "equal" } else { "different" };
        out += &format!(
            "\ndevice loss: {}; rows of a new device {equal}, {:.2} s\n",
            loss.error.as_deref().unwrap_or("no error"),
            loss.recovery_s
        );
        let campaign = &self.campaign;
        out += &format!("\n{}, {} runs: {:.1} s\n", campaign.id, campaign.runs, campaign.seconds);
        for phase in &campaign.phases {
            let runs = phase.runs.map_or(String::new(), |runs| format!("{runs} runs"));
            out += &format!("  {:<10} {:>9.1} s  {runs}\n", phase.name, phase.seconds);
        }
        if let Some(parity) = &campaign.parity {
            let (runs, flipped) = (parity.runs, parity.flipped.count);
            out += &format!("  parity: {flipped} of {runs} runs have another verdict in f64\n");
        }
        for fault in &self.faults {
            out += &format!("\nFAULT: {fault}");
        }
        out.trim_end().to_owned()
    }
}
