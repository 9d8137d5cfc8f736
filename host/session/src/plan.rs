//! Plans a session before its links open: reads files, compares rules, checks addresses.

use crate::addresses::FacilityAddresses;
use crate::error::{Result, SessionError};
use crate::hidden_effects::with_effects;
use crate::rights::CycleRights;
use softdock_campaign::station::AxisLimits;
use softdock_campaign::{Campaign, Scenario, Station, rules};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::links::{LinkNotice, check_arming};
use softdock_realtime::time::Nanos;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Permission of a session to move real robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionMode {
    /// No real robot moves: the real links are exercised, and emulated robots move in their place.
    DryRun,
    /// The start-up checks only: nothing moves.
    CheckOnly,
    /// The commands move real robots.
    Armed,
}

impl SessionMode {
    /// Returns the mode of a request; checks alone move nothing, even if the robots may move.
    pub fn new(check_only: bool, armed: bool) -> Self {
        match (check_only, armed) {
            (true, _) => Self::CheckOnly,
            (false, true) => Self::Armed,
            (false, false) => Self::DryRun,
        }
    }
}

/// Selects a run of a campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunChoice {
    /// The run of this number.
    Number(u64),
    /// The run that an experiment file states.
    Experiment(PathBuf),
}

/// Reads a retraction distance in millimetres, 1 to 500; returns metres.
///
/// # Errors
/// If the text is no such number.
pub fn parse_retraction(text: &str) -> std::result::Result<f64, String> {
    let distance: f64 = text.parse().map_err(|_| "write a number of millimetres, 1 to 500".to_owned())?;
    if (1.0..=500.0).contains(&distance) { Ok(1e-3 * distance) } else { Err("write 1 to 500 millimetres".to_owned()) }
}

/// Request for a session.
#[derive(Clone, Debug)]
pub struct SessionOptions {
    /// Campaign file.
    pub campaign: PathBuf,
    /// Scenario file in place of the campaign's.
    pub model: Option<PathBuf>,
    /// Facility file in place of the scenario's, with the same rules.
    pub facility: Option<PathBuf>,
    /// The run.
    pub run: RunChoice,
    /// Number of this repeat of the run, from 1: emulated links have other noise in each.
    pub repeat: u64,
    /// Hidden effects of the emulated facility.
    pub effects: Option<PathBuf>,
    /// Addresses of robots 1 and 2.
    pub robots: [String; 2],
    /// Address of the sensor.
    pub sensor: String,
    /// Permission to move real robots.
    pub mode: SessionMode,
    /// Distance by which robot 1 retracts its part along the approach after a stop \[m\]; 0: none.
    pub retract: f64,
    /// Whether armed robots move as soon as every check has passed, without GO.
    pub go_after_check: bool,
    /// Whether real robots away from the start of the run are moved there.
    pub to_start: bool,
    /// Whether the session runs in virtual time; emulated robots only.
    pub virtual_time: bool,
    /// Rights of the cycle's thread.
    pub rights: CycleRights,
    /// Results folder; `results/drive_ID_RUN` if not given.
    pub out: Option<PathBuf>,
}

/// A checked session, ready to run.
pub struct SessionPlan {
    /// The request.
    pub(crate) options: SessionOptions,
    pub(crate) campaign: Campaign,
    pub(crate) task: SessionTask,
    /// The facility that emulates the real one.
    pub(crate) emulated: (Arc<Plant>, Params<f64>),
    pub(crate) addresses: FacilityAddresses,
    pub(crate) out: PathBuf,
    repeats: Option<u64>,
}

impl SessionPlan {
    /// Reads the files of a session and checks the request.
    ///
    /// # Errors
    /// If a file cannot be used, the facility has other rules than the campaign, the robots may not be armed, or
    /// options contradict each other.
    pub fn new(options: SessionOptions) -> Result<Self> {
        let campaign = Campaign::load_with(&options.campaign, options.model.as_deref())?;
        campaign.refuse_for("a session")?;
        let station = facility_of(&campaign.scenario, options.facility.as_deref())?;
        refuse_other_rules(&campaign.scenario, &station)?;
        let (run, repeats) = chosen_run(&campaign, &options.run)?;
        let [one, two] = &options.robots;
        let addresses = FacilityAddresses::parse([one, two], &options.sensor)?;
        let armed = options.mode == SessionMode::Armed;
        if armed {
            check_arming(addresses.all(), &station)?;
        }
        let any_real = addresses.any_real();
        if options.virtual_time && any_real {
            let remedy = "remove --virtual: real robots run in real time";
            return Err(SessionError::refused("virtual time is for emulated robots only", remedy));
        }
        let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
        let task = SessionTask {
            armed,
            // Emulated robots may always move to the start.
            to_start: options.to_start || !any_real || !armed,
            check_only: options.mode == SessionMode::CheckOnly,
            retract: options.retract,
            ..SessionTask::new(plant, Arc::new(station), run, campaign.draw(run)?.params)
        };
        if options.effects.is_some() && any_real {
            let remedy = "pass the effects file to `softdock emulate`";
            return Err(SessionError::refused("hidden effects are for emulated facilities only", remedy));
        }
        let (model, params) = with_effects(&campaign.scenario, options.effects.as_deref(), task.params)?;
        let out = match &options.out {
            Some(out) => out.clone(),
            None => default_folder(&options, &campaign, run)?,
        };
        let emulated = (Arc::new(Plant::new(model)), params);
        Ok(Self { options, campaign, task, emulated, addresses, out, repeats })
    }

    /// Returns the campaign.
    pub fn campaign(&self) -> &Campaign {
        &self.campaign
    }

    /// Returns the task of the session.
    pub fn task(&self) -> &SessionTask {
        &self.task
    }

    /// Returns the addresses of robots and sensor.
    pub fn addresses(&self) -> &FacilityAddresses {
        &self.addresses
    }

    /// Returns the results folder.
    pub fn folder(&self) -> &Path {
        &self.out
    }

    /// Returns a warning if this repeat is beyond the number that the experiment file requests.
    pub fn repeat_warning(&self) -> Option<String> {
        let (repeats, repeat) = (self.repeats?, self.options.repeat);
        (repeat > repeats).then(|| format!("the experiment requests {repeats} repeats, and this is number {repeat}"))
    }

    /// Writes the configuration files that the robots' controllers need for these addresses into `folder`; returns
    /// their paths.
    ///
    /// # Errors
    /// If no robot has such a file, an address lacks a field of the file, or a file cannot be written.
    pub fn write_configurations(&self, folder: &Path, report: &dyn Fn(LinkNotice)) -> Result<Vec<PathBuf>> {
        let files = self.addresses.configurations(&self.task.station, report)?;
        if files.is_empty() {
            let remedy = "write --robot1 rsi://ADDRESS:PORT with this machine's address";
            return Err(SessionError::refused("none of the robots uses RSI", remedy));
        }
        std::fs::create_dir_all(folder)?;
        let write = |(name, text): (String, String)| -> Result<PathBuf> {
            std::fs::write(folder.join(&name), text)?;
            Ok(folder.join(name))
        };
        files.into_iter().map(write).collect()
    }

    /// Checks that the results folder holds no log: a log is never overwritten.
    ///
    /// # Errors
    /// If it holds one.
    pub fn check_folder(&self) -> Result<()> {
        if self.out.join("log.mcap").exists() {
            let remedy = "name another folder with --out, or remove this one: a log is never overwritten";
            let what = format!("`{}` already holds the log of a session", self.out.display());
            return Err(SessionError::refused(what, remedy));
        }
        Ok(())
    }

    /// Returns the mode in one line.
    pub fn mode_text(&self) -> &'static str {
        match (self.options.mode, self.addresses.any_real()) {
            (SessionMode::CheckOnly, _) => "checks only: nothing moves",
            (SessionMode::Armed, _) => "ARMED: the robots will move",
            (SessionMode::DryRun, true) => {
                "dry run: real robots get no motion commands, emulated ones move in their place"
            }
            (SessionMode::DryRun, false) => "emulated robots in process",
        }
    }

    /// Returns the limits of axes and links, and the rules that stop the session: several lines.
    pub fn limits_text(&self) -> String {
        let station = &self.task.station;
        let links = &station.links;
        let degrees = |pick: fn(&AxisLimits) -> f64| {
            let joints = station.limits[..6].iter().map(|limit| format!("{:.0}", pick(limit).to_degrees()));
            joints.collect::<Vec<_>>().join(" ")
        };
        format!(
            "  limits    {} deg/s  {} deg/s^2  rail {:.2} m/s\n  links     more than {} lost cycles ({}: the link is dead)  \
             sensor older than {:.1} ms\n  stops on  {}\n            this is no emergency stop: keep the button at hand",
            degrees(|limit| limit.speed),
            degrees(|limit| limit.acceleration),
            station.limits[6].speed,
            links.hold_cycles,
            links.stop_cycles,
            links.sensor_age * 1e3,
            rules::in_force(&self.task.plant.facility).join("\n            "),
        )
    }

    /// Returns the session's clock, as named in log and evidence.
    pub(crate) fn clock_text(&self) -> &'static str {
        if self.options.virtual_time { "virtual" } else { "CLOCK_MONOTONIC" }
    }
}

/// Returns the facility of a scenario, or the named one in its place.
pub(crate) fn facility_of(scenario: &Scenario, named: Option<&Path>) -> Result<Station> {
    match (named, &scenario.station) {
        (Some(file), _) => Ok(Station::load(file)?),
        (None, Some(station)) => Ok(station.clone()),
        (None, None) => Err(SessionError::refused(
            format!("the scenario {} names no facility", scenario.id),
            "write file = \"../facilities/reference.toml\" in its [facility], or add --facility FILE",
        )),
    }
}

/// Refuses a facility with other rules than those of the campaign: its verdict holds for its own rules only.
fn refuse_other_rules(scenario: &Scenario, station: &Station) -> Result<()> {
    let judged = |station: &Station| {
        let robots = station.session_robots();
        let capsules = robots.level.robot.capsules;
        (station.rules.clone(), station.end_at_capture, robots.limits, robots.correction, robots.tool_radius, capsules)
    };
    if scenario.station.as_ref().is_some_and(|own| judged(own) == judged(station)) {
        return Ok(());
    }
    Err(SessionError::refused(
        format!("{} is judged by other session rules than those of {}", scenario.id, station.path().display()),
        "name this facility file in the scenario's [facility] (file = \"...\"), and run the campaign again",
    ))
}

/// Returns the selected run, and the repeats that an experiment requests.
pub(crate) fn chosen_run(campaign: &Campaign, choice: &RunChoice) -> Result<(u64, Option<u64>)> {
    match choice {
        RunChoice::Experiment(file) => {
            let (run, repeats) = campaign.experiment(file)?;
            Ok((run, Some(repeats)))
        }
        RunChoice::Number(run) if *run < campaign.runs => Ok((*run, None)),
        RunChoice::Number(run) => Err(SessionError::refused(
            format!("run {run} of a campaign of {} runs", campaign.runs),
            format!("take one of 0 to {}", campaign.runs - 1),
        )),
    }
}

/// Returns the default results folder of a session. Checks are repeated: each has its own folder.
fn default_folder(options: &SessionOptions, campaign: &Campaign, run: u64) -> Result<PathBuf> {
    let repeat = if options.repeat > 1 { format!("_{}", options.repeat) } else { String::new() };
    let name = match options.mode {
        SessionMode::CheckOnly => format!("check_{}_{}", campaign.id, since_epoch()?.0 / 1_000_000_000),
        SessionMode::DryRun | SessionMode::Armed => format!("drive_{}_{run}{repeat}", campaign.id),
    };
    Ok(Path::new("results").join(name))
}

/// Returns the wall clock \[ns since the Unix epoch\].
pub(crate) fn since_epoch() -> io::Result<Nanos> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_err(io::Error::other)?;
    Ok(Nanos(since.as_nanos() as i64))
}
