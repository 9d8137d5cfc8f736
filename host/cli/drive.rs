//! `softdock drive`: one run on real or emulated robots, and its metrics beside what the model expects.

use crate::address::Address;
use crate::args::DriveArgs;
use crate::band::{self, Line};
use crate::links::{self, Addresses};
use crate::realtime::{apply, own};
use crate::secret::with_secret;
use crate::serve::{Served, serve};
use crate::words::{Exit, explain, refuse, say, warn};
use miette::IntoDiagnostic;
use serde_json::{Value, json};
use softdock_analysis::number::{percent, with_unit};
use softdock_campaign::criteria::succeeds;
use softdock_campaign::rules;
use softdock_campaign::{Campaign, Scenario, Station};
use softdock_kernels::outcome::Stop;
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Wrench;
use softdock_realtime::clock::{Clock, Monotonic, Virtual};
use softdock_realtime::drive::checklist::{Answer, Check, Checklist};
use softdock_realtime::drive::core::{Task, Unprepared};
use softdock_realtime::drive::guard::Alarm;
use softdock_realtime::drive::runner::{Alarms, Keeping, run};
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::world::World;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::evidence::{Circumstances, Evidence};
use softdock_realtime::log::mcap::{Attachment, Setup};
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::scene::Scene;
use softdock_realtime::log::topics::default_names;
use softdock_realtime::log::writer::LogWriter;
use softdock_realtime::signals::{LinkFault, axis_name};
use softdock_realtime::time::Nanos;
use softdock_realtime::view::model::{Budgets, View};
use softdock_realtime::view::{Controls, feed, show};
use std::fs;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// What the evidence keeps before a stop.
const EVIDENCE_SPAN: Nanos = Nanos::from_millis(2000);

/// Everything that a drive is made of before its links are open.
struct Plan {
    campaign_file: PathBuf,
    /// In the place of the campaign's scenario.
    model_file: Option<PathBuf>,
    facility_file: PathBuf,
    campaign: Campaign,
    task: Task,
    repeat: u64,
    /// The facility that stands in for a real one.
    emulated: (Arc<Plant>, Params<f64>),
    addresses: Addresses,
    out: PathBuf,
    in_virtual_time: bool,
    /// Armed robots move as soon as every check has passed.
    go_after_check: bool,
    priority: u8,
    core: Option<usize>,
}

/// How the cycle's thread ended.
struct Ended {
    last: CycleRecord,
    refusal: Option<Check>,
    /// The checks of the start-up.
    checklist: Checklist,
    /// How far robot 1 has moved its part back after the stop \[m\].
    retracted: Option<f64>,
    faults: [Option<LinkFault>; 3],
    metrics: softdock_kernels::metrics::Metrics<f64>,
    /// The session's rule that was met.
    stop: Option<Stop>,
    /// When the session was stopped, since its start, and why.
    stopped: Option<(Nanos, Alarm)>,
    /// Greatest distance \[m\] and angle \[rad\] of each robot's tool from its command.
    worst_tracking: [[f64; 2]; 2],
    /// Greatest share of its limit that a torque without an explanation has had, robots 1 and 2.
    worst_torques: [f64; 2],
    /// Records that the log has kept and lost.
    kept: [u64; 2],
}

/// Drives a run.
pub(crate) fn drive(args: &DriveArgs) -> miette::Result<Exit> {
    let plan = plan(args)?;
    if let Some(folder) = &args.rsi_config {
        return write_rsi_configurations(&plan, folder);
    }
    if args.arm
        && !args.go_after_check
        && args.serve.is_none()
        && !(std::io::stdin().is_terminal() && std::io::stdout().is_terminal())
    {
        let remedy = "run it in a terminal, where the key g lets the robots move, or add --serve or --go-after-check";
        return Err(refuse("nobody can say GO here: this is no terminal", remedy));
    }
    tell(&plan);
    // One process drives a robot; the lock ends with this one, however that ends.
    let _locks = if plan.addresses.any_real() { own(&plan.task.station, &plan.addresses)? } else { Vec::new() };
    fs::create_dir_all(&plan.out).into_diagnostic()?;
    let ended = cycle_to_the_end(&plan, args.serve.as_deref()).inspect_err(|_| {
        // Nothing was driven: an empty log would only be in the way. What is there besides it stays.
        let _ = fs::remove_file(plan.out.join("log.mcap"));
        let _ = fs::remove_dir(&plan.out);
    })?;
    leave_traces(&plan, &ended, args)
}

/// The files that tell KUKA controllers where to send what.
fn write_rsi_configurations(plan: &Plan, folder: &Path) -> miette::Result<Exit> {
    let files = links::rsi_configurations(&plan.addresses, &plan.task.station)?;
    if files.is_empty() {
        return Err(refuse(
            "none of the robots speaks RSI",
            "write --robot1 rsi://ADDRESS:PORT with this machine's address",
        ));
    }
    fs::create_dir_all(folder).into_diagnostic()?;
    for (name, text) in files {
        let path = folder.join(name);
        fs::write(&path, text).into_diagnostic()?;
        say(format!("{}", path.display()));
    }
    Ok(Exit::Done)
}

fn plan(args: &DriveArgs) -> miette::Result<Plan> {
    let campaign = Campaign::load_with(&args.campaign, args.model.as_deref()).map_err(explain)?;
    let station = facility_of(&campaign.scenario, args.facility.as_deref())?;
    refuse_other_rules(&campaign.scenario, &station)?;
    let (run, repeats) = run_asked(&campaign, args.experiment.as_deref(), args.run)?;
    if let Some(repeats) = repeats.filter(|repeats| args.repeat > *repeats) {
        warn(format!("the experiment asks for {repeats} repeats, and this is number {}", args.repeat));
    }
    let addresses = Addresses::parse(&args.robot1, &args.robot2, &args.ft)?;
    refuse_unnamed(args.arm, &addresses, &station)?;
    if args.virtual_time && addresses.any_real() {
        let remedy = "leave --virtual away: real robots have the time of the clock on the wall";
        return Err(refuse("virtual time is for emulated robots alone", remedy));
    }
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let emulated = !addresses.any_real();
    let task = Task {
        armed: args.arm,
        // Emulated robots need nobody's leave to move to the start.
        to_start: args.to_start || emulated || !args.arm,
        check_only: args.check,
        retract: args.retract.map_or(0.0, |millimetres| millimetres * 1e-3),
        ..Task::new(plant, Arc::new(station), run, campaign.draw(run).params)
    };
    if args.effects.is_some() && addresses.any_real() {
        return Err(refuse("secret effects are for emulated facilities alone", "give them to `softdock emulate`"));
    }
    let (model, params) = with_secret(&campaign.scenario, args.effects.as_deref(), task.params)?;
    let repeat = if args.repeat > 1 { format!("_{}", args.repeat) } else { String::new() };
    let name = if args.check {
        // Checks are repeated: each has a folder of its own.
        format!("check_{}_{}", campaign.id, since_epoch()?.0 / 1_000_000_000)
    } else {
        format!("drive_{}_{run}{repeat}", campaign.id)
    };
    let out = args.out.clone().unwrap_or_else(|| Path::new("results").join(name));
    if args.rsi_config.is_none() && out.join("log.mcap").exists() {
        let remedy = "give another folder with --out, or remove this one: a log is never written over";
        return Err(refuse(format!("`{}` holds the log of a drive already", out.display()), remedy));
    }
    Ok(Plan {
        campaign_file: args.campaign.clone(),
        model_file: args.model.clone(),
        facility_file: task.station.path().to_owned(),
        campaign,
        repeat: args.repeat,
        emulated: (Arc::new(Plant::new(model)), params),
        task,
        addresses,
        out,
        in_virtual_time: args.virtual_time,
        go_after_check: args.go_after_check,
        priority: args.priority,
        core: args.core,
    })
}

/// The facility of a scenario, or the one that is named in its place.
pub(crate) fn facility_of(scenario: &Scenario, named: Option<&Path>) -> miette::Result<Station> {
    match (named, &scenario.station) {
        (Some(file), _) => Station::load(file).map_err(explain),
        (None, Some(station)) => Ok(station.clone()),
        (None, None) => Err(refuse(
            format!("the scenario {} names no facility", scenario.id),
            "write file = \"../facilities/reference.toml\" in its [facility], or add --facility FILE",
        )),
    }
}

/// A campaign's answer holds for the rules that it was judged by: no session is driven under others.
fn refuse_other_rules(scenario: &Scenario, station: &Station) -> miette::Result<()> {
    let judged = |station: &Station| {
        let robots = station.session_robots();
        let capsules = robots.level.robot.capsules;
        (station.rules.clone(), station.end_at_capture, robots.limits, robots.correction, robots.tool_radius, capsules)
    };
    if scenario.station.as_ref().is_some_and(|own| judged(own) == judged(station)) {
        return Ok(());
    }
    let message =
        format!("{} is judged by other session rules than those of {}", scenario.id, station.path().display());
    Err(refuse(
        message,
        "name this facility file in the scenario's [facility] (file = \"...\"), and run the campaign again",
    ))
}

/// The run that an experiment asks for, and how often, or the one of a number.
pub(crate) fn run_asked(
    campaign: &Campaign,
    experiment: Option<&Path>,
    number: Option<u64>,
) -> miette::Result<(u64, Option<u64>)> {
    if let Some(file) = experiment {
        let (run, repeats) = campaign.experiment(file).map_err(explain)?;
        return Ok((run, Some(repeats)));
    }
    let run = number.unwrap_or_default();
    if run >= campaign.runs {
        let message = format!("run {run} of a campaign of {} runs", campaign.runs);
        return Err(refuse(message, format!("take one of 0 to {}", campaign.runs - 1)));
    }
    Ok((run, None))
}

/// Motion of a real robot needs its name and the address that it speaks from.
fn refuse_unnamed(armed: bool, addresses: &Addresses, station: &Station) -> miette::Result<()> {
    if !armed {
        return Ok(());
    }
    if !addresses.any_real() {
        return Err(refuse("nothing here can be armed: all links are emulated", "leave --arm away"));
    }
    for (index, (address, robot)) in addresses.all.iter().zip(&station.robots).enumerate() {
        let listens = matches!(address.scheme.as_str(), "rsi" | "egm");
        if listens && robot.address.is_none() && address.from()?.is_none() {
            let message = format!("robot {} would take commands from whoever answers first", index + 1);
            let remedy =
                format!("write robot{}.address in the facility file, or ?from=IP behind its address", index + 1);
            return Err(refuse(message, remedy));
        }
    }
    Ok(())
}

/// What will be done, and what stops it; printed before anything moves.
fn tell(plan: &Plan) {
    let (task, station) = (&plan.task, &plan.task.station);
    let mode = mode_in_words(plan);
    say(format!("{}  run {}  {mode}", plan.campaign.id, task.run));
    for (index, (robot, address)) in station.robots.iter().zip(&plan.addresses.all).enumerate() {
        let Address { scheme, place, .. } = address;
        say(format!("  robot {}   {}  {scheme}://{place}", index + 1, robot.name));
    }
    say(limits_in_words(task));
}

fn mode_in_words(plan: &Plan) -> &'static str {
    match (plan.task.armed, plan.addresses.any_real()) {
        _ if plan.task.check_only => "checks alone: nothing moves",
        (true, _) => "ARMED: the robots will move",
        (false, true) => "dry run: the real robots are asked for nothing, emulated ones move in their place",
        (false, false) => "emulated robots in process",
    }
}

fn limits_in_words(task: &Task) -> String {
    let station = &task.station;
    let links = &station.links;
    let degrees = |pick: fn(&softdock_campaign::station::AxisLimits) -> f64| {
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
        rules::in_force(&task.plant.facility).join("\n            "),
    )
}

/// The cycle in a thread of its own, the view in this one.
fn cycle_to_the_end(plan: &Plan, page: Option<&str>) -> miette::Result<Ended> {
    let controls = Arc::new(Controls::default());
    let page = page.map(|address| serve(address, &controls, about(plan)?)).transpose()?;
    let board = page.as_ref().map(Served::board);
    if let Some(page) = &page {
        say(format!("  page      http://{}/", page.address()));
    }
    let alarms = Arc::new(Alarms { signals: AtomicU32::new(0), panicked: AtomicBool::new(false) });
    listen(&alarms, &controls);
    let (samples_in, samples) = feed();
    // The log's thread first: it must not inherit the cycle's priority.
    let log = LogWriter::create(&plan.out.join("log.mcap"), &setup(plan)?).into_diagnostic()?;
    let budgets = budgets(plan);
    std::thread::scope(|scope| {
        let (for_cycle, for_alarms, for_page) = (Arc::clone(&controls), Arc::clone(&alarms), board.clone());
        let cycle = scope.spawn(move || {
            let ended = cycle_thread(plan, log, samples_in, &for_cycle, &for_alarms);
            if let (Ok(ended), Some(board)) = (&ended, &for_page) {
                board.finish(answer(plan, ended));
            }
            for_cycle.end();
            ended
        });
        let mut watch = |view: &View| board.iter().for_each(|board| board.show(view));
        if let Err(error) = show(samples, budgets, &controls, &mut watch) {
            warn(format!("the view has failed ({error}); the run goes on, Ctrl-C stops it"));
        }
        cycle.join().map_err(|_| refuse("the cycle's thread has failed", "report this with the log"))?
    })
}

/// SIGINT, SIGTERM and panics of any thread end in a controlled stop.
fn listen(alarms: &Arc<Alarms>, controls: &Arc<Controls>) {
    let (for_signals, view) = (Arc::clone(alarms), Arc::clone(controls));
    // Without a handler the signal ends the process, and the controllers' own time-outs stop the robots.
    let _ = ctrlc::set_handler(move || {
        for_signals.signals.fetch_add(1, Ordering::Relaxed);
        view.leave();
    });
    let (for_panics, before) = (Arc::clone(alarms), std::panic::take_hook());
    std::panic::set_hook(Box::new(move |info| {
        for_panics.panicked.store(true, Ordering::Relaxed);
        before(info);
    }));
}

fn cycle_thread(
    plan: &Plan,
    log: LogWriter,
    samples: softdock_realtime::view::model::Feed,
    controls: &Controls,
    alarms: &Alarms,
) -> miette::Result<Ended> {
    let clock: Rc<dyn Clock> = if plan.in_virtual_time { Rc::new(Virtual::default()) } else { Rc::new(Monotonic) };
    let task = &plan.task;
    // The first repeat has the farm's own noise.
    let key = philox::key(plan.campaign.seed.wrapping_add((plan.repeat - 1) << 32));
    let world = || {
        World::new(&plan.emulated.0, &task.station, key, task.run, &plan.emulated.1, Wrench::zero())
            .map_err(|(robot, why)| refuse(format!("robot {robot} cannot stand there: {why:?}"), "move its base"))
    };
    if !plan.in_virtual_time {
        apply(plan.priority, plan.core)?;
    }
    let (moved, exercised) = links::open(&plan.addresses, task.armed, &task.station, world, Rc::clone(&clock))?;
    let cycle = moved.robots[0].capabilities().cycle;
    let evidence = Evidence::new(EVIDENCE_SPAN, cycle);
    let mut session = Session::new(task.clone(), moved, exercised, clock).into_diagnostic()?;
    session.begun_at(since_epoch()?);
    if plan.go_after_check {
        session.go();
    }
    let mut keeping = Keeping { log: Some(log), evidence, feed: Some(samples) };
    run(&mut session, &mut keeping, controls, alarms);
    let Keeping { log, evidence, .. } = keeping;
    let totals = log.expect("the log was handed in").finish().into_diagnostic()?;
    let core = session.core();
    let ended = Ended {
        last: *session.record(),
        refusal: core.refusal(),
        checklist: *core.checklist(),
        retracted: core.retracted(),
        faults: session.faults(),
        metrics: core.metrics(),
        stop: core.rule_met(),
        stopped: core.stopped(),
        worst_tracking: core.worst_tracking(),
        worst_torques: core.worst_torques(),
        kept: [totals.written.records, totals.dropped],
    };
    // At once: whoever looks at the view still, or is killed there, has them.
    write_evidence(plan, &ended, evidence)?;
    write_answer(plan, &answer(plan, &ended))?;
    Ok(ended)
}

/// The wall clock \[ns since the Unix epoch\].
fn since_epoch() -> miette::Result<Nanos> {
    Ok(Nanos(SystemTime::now().duration_since(UNIX_EPOCH).into_diagnostic()?.as_nanos() as i64))
}

/// What the page shows of a session that never changes.
fn about(plan: &Plan) -> miette::Result<Value> {
    let (task, station) = (&plan.task, &plan.task.station);
    let robots = station.robots.iter().zip(&plan.addresses.all);
    let robots = robots.enumerate().map(|(index, (robot, address))| {
        format!("Robot {}: {}, {}://{}", index + 1, robot.name, address.scheme, address.place)
    });
    let links = &station.links;
    Ok(json!({
        "campaign": plan.campaign.id, "run": task.run, "mode": mode_in_words(plan), "armed": task.armed,
        "began_unix_s": since_epoch()?.seconds(), "robots": robots.collect::<Vec<_>>(),
        "rules": rules::in_force(&task.plant.facility),
        "links": format!(
            "links: more than {} lost or untaken cycles in a row, more than {} in {} s; a tool more than {:.1} mm + {} s x \
             commanded speed from its command; sensor older than {:.1} ms",
            links.hold_cycles, links.window_cycles, links.window, links.tracking.distance * 1e3, links.tracking.time,
            links.sensor_age * 1e3,
        ),
    }))
}

fn budgets(plan: &Plan) -> Budgets {
    let rules = &plan.task.station.rules;
    Budgets { force_n: rules.force, energy_j: rules.injected_energy }
}

fn setup(plan: &Plan) -> miette::Result<Setup> {
    let started = since_epoch()?;
    let draw = json!({
        "run": plan.task.run,
        "seed": plan.campaign.seed,
        "parameters": band::parameters(&plan.task.params),
    });
    let file =
        |name: &str, data: Vec<u8>| Attachment { name: name.to_owned(), media_type: "text/plain".to_owned(), data };
    let mut provenance = std::collections::BTreeMap::new();
    for (key, value) in [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("campaign_id", plan.campaign.id.clone()),
        ("campaign_hash", plan.campaign.hash.clone()),
        ("seed", plan.campaign.seed.to_string()),
        ("run", plan.task.run.to_string()),
        ("repeat", plan.repeat.to_string()),
        ("cycle_ns", plan.addresses.cycle()?.0.to_string()),
        ("to_start", plan.task.to_start.to_string()),
        ("armed", plan.task.armed.to_string()),
        ("check_only", plan.task.check_only.to_string()),
        ("retract_m", plan.task.retract.to_string()),
        ("clock", clock_in_words(plan).to_owned()),
    ] {
        provenance.insert(key.to_owned(), value);
    }
    provenance.insert("campaign".to_owned(), plan.campaign_file.display().to_string());
    provenance.insert("facility".to_owned(), plan.facility_file.display().to_string());
    provenance.extend(plan.model_file.iter().map(|model| ("model".to_owned(), model.display().to_string())));
    let axis_names = default_names();
    let scene = Scene::new(&plan.task.plant, &plan.task.station, &axis_names);
    Ok(Setup {
        started,
        scene: Some(scene.map_err(Unprepared::from).into_diagnostic()?),
        axis_names,
        attachments: vec![
            file("scenario.toml", plan.campaign.scenario.text().as_bytes().to_vec()),
            file("facility.toml", plan.task.station.text().as_bytes().to_vec()),
            file("draw.json", crate::words::json(&draw).into_bytes()),
        ],
        provenance,
    })
}

fn clock_in_words(plan: &Plan) -> &'static str {
    if plan.in_virtual_time { "virtual" } else { "CLOCK_MONOTONIC" }
}

/// The last seconds of all signals.
fn write_evidence(plan: &Plan, ended: &Ended, evidence: Evidence) -> miette::Result<()> {
    let remarks = ended.refusal.map(|refusal| refusal.to_string()).or_else(|| stop_in_words(plan, ended));
    let circumstances = Circumstances {
        limits: limits_in_words(&plan.task),
        clock: clock_in_words(plan).to_owned(),
        remarks: remarks.unwrap_or_default(),
    };
    let mut file = std::io::BufWriter::new(fs::File::create(plan.out.join("evidence.csv")).into_diagnostic()?);
    evidence.write(&mut file, &circumstances).into_diagnostic()
}

fn write_answer(plan: &Plan, answer: &Value) -> miette::Result<()> {
    fs::write(plan.out.join("drive.json"), crate::words::json(answer)).into_diagnostic()
}

/// What a session was stopped for: robot, value and limit, where they can be said.
fn stop_in_words(plan: &Plan, ended: &Ended) -> Option<String> {
    if let Some(stop) = ended.stop {
        return Some(rule_in_words(plan, stop));
    }
    let (time, alarm) = ended.stopped?;
    let found = alarm.found?;
    let axis = found.axis.map_or_else(String::new, |axis| format!(", {}", axis_name(axis)));
    let robot = found.robot.map_or_else(String::new, |robot| format!("robot {}{axis}: ", robot + 1));
    let [value, limit] = [found.value, found.limit].map(|value| with_unit(value, found.unit));
    Some(format!("{robot}{value}, {limit} is allowed, at {:.3} s of the session", time.seconds()))
}

/// The answer of a session, before it is compared with what the model expects.
fn answer(plan: &Plan, ended: &Ended) -> Value {
    let rule = ended.stop.map(|stop| {
        let row = stop.rule.row();
        json!({
            "id": row.id, "value": stop.value, "limit": (row.limit)(&plan.task.plant.facility), "unit": row.unit,
        })
    });
    let stop = ended.stopped.map(stop_json);
    let (last, outcome) = (&ended.last, outcome(plan, ended));
    let robot = |r: usize| {
        let record = softdock_realtime::drive::start::moved(last)[r];
        let real = [&last.robot_1, &last.robot_2][r];
        json!({
            "lost_reports": real.link.lost + real.link.overtaken, "late_answers": real.late_answers,
            "untaken_answers": record.wire.untaken, "unsent_answers": real.link.unsent,
            "foreign_datagrams": real.link.foreign, "malformed_datagrams": real.link.malformed,
            "worst_torque_share": ended.worst_torques[r], "worst_tracking_m": ended.worst_tracking[r][0], "worst_tracking_rad": ended.worst_tracking[r][1],
        })
    };
    json!({
        "campaign": plan.campaign.id, "run": plan.task.run, "armed": plan.task.armed,
        "began_unix_s": last.wall_offset.seconds(), "cause": last.cause.word(), "outcome": outcome.word(),
        "rule": rule, "stop": stop, "refusal": ended.refusal.map(|refusal| refusal.to_string()),
        "success": outcome == Outcome::Pass, "retracted_m": ended.retracted,
        "checks": ended.checklist.checks().iter().map(check_json).collect::<Vec<_>>(),
        "validity": {
            "robot_1": robot(0), "robot_2": robot(1), "lost_samples": last.ft.link.lost, "overruns": last.overruns,
            "log_records_lost": ended.kept[1],
        },
    })
}

/// What a session was stopped for, and when, for programs and for the page.
pub(crate) fn stop_json((time, alarm): (Nanos, Alarm)) -> Value {
    let found = alarm.found;
    json!({
        "cause": alarm.cause.word(), "time_s": time.seconds(),
        "robot": found.and_then(|found| found.robot).map(|robot| robot + 1),
        "axis": found.and_then(|found| found.axis).map(axis_name),
        "value": found.map(|found| found.value), "limit": found.map(|found| found.limit),
        "unit": found.map(|found| found.unit),
    })
}

/// A check of the start-up for programs.
fn check_json(check: &Check) -> Value {
    let row = check.what.row();
    json!({
        "id": row.id, "subject": check.subject(), "title": row.title, "answer": check.answer().word(),
        "value": Some(check.value).filter(|value| value.is_finite()), "limit": check.limit,
        "unit": row.unit.si(check.axis),
    })
}

/// The checks of the start-up as a table, failed ones marked.
fn checklist_text(list: &Checklist) -> String {
    let colours = std::io::stdout().is_terminal();
    let mark = |answer: Answer| match (answer, colours) {
        (Answer::Passed, true) => "\x1b[32mok    \x1b[0m",
        (Answer::Failed, true) => "\x1b[31mFAILED\x1b[0m",
        (Answer::Passed, false) => "ok    ",
        (Answer::Failed, false) => "FAILED",
        (Answer::Open, _) => "-     ",
    };
    let line = |check: &Check| {
        let (row, answer) = (check.what.row(), check.answer());
        let remedy = if answer == Answer::Failed { format!("\n       {}", row.remedy) } else { String::new() };
        let [value, limit] = [check.value_text(), check.limit_text()];
        format!("{} {:<16} {:<66} {value:>14}   {limit}{remedy}", mark(answer), check.subject(), row.title)
    };
    list.checks().iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Log, metrics beside their prediction.
fn leave_traces(plan: &Plan, ended: &Ended, args: &DriveArgs) -> miette::Result<Exit> {
    let log = plan.out.join("log.mcap");
    band::export(&log, &plan.out.join("log.parquet"))?;
    let cause = ended.last.cause;
    if plan.task.check_only {
        return Ok(report_checks(plan, ended, args));
    }
    say(format!("stopped by {}: {}", cause.word(), cause.meaning()));
    if let Some(words) = stop_in_words(plan, ended) {
        say(format!("           {words}"));
    }
    if let Some(way) = ended.retracted {
        say(format!("           robot 1 has moved its part back by {:.1} mm", way * 1e3));
    }
    for (link, fault) in ["robot 1", "robot 2", "the sensor"].iter().zip(ended.faults) {
        if let Some(fault) = fault {
            say(format!("           {link}: {fault}"));
        }
    }
    say(format!("log        {}  {} cycles, {} dropped", log.display(), ended.kept[0], ended.kept[1]));
    say(format!("evidence   {}", plan.out.join("evidence.csv").display()));
    if let Some(refusal) = ended.refusal {
        warn(format!("{:?}", refuse("the drive did not begin", refusal)));
        return Ok(Exit::Incomplete);
    }
    if args.no_band {
        return Ok(outcome(plan, ended).exit());
    }
    let cycle = plan.addresses.cycle()?;
    let expected = band::compare(&plan.campaign, &plan.task, cycle, &ended.metrics, args.band_runs)?;
    report(plan, ended, &expected, args)
}

/// The answer of `--check`.
fn report_checks(plan: &Plan, ended: &Ended, args: &DriveArgs) -> Exit {
    if args.json {
        say(crate::words::json(&answer(plan, ended)));
    } else {
        say(checklist_text(&ended.checklist));
        let checks = ended.checklist.checks();
        let count = |answer: Answer| checks.iter().filter(|check| check.answer() == answer).count();
        let [passed, failed, open] = [Answer::Passed, Answer::Failed, Answer::Open].map(count);
        say(format!("\n{passed} checks passed, {failed} failed, {open} without an answer; nothing has moved"));
    }
    if outcome(plan, ended) == Outcome::Checked { Exit::Done } else { Exit::Incomplete }
}

/// A rule that was met, with its limit and the value that met it.
fn rule_in_words(plan: &Plan, stop: Stop) -> String {
    let row = stop.rule.row();
    let limit = (row.limit)(&plan.task.plant.facility);
    format!("{}: {}; the value was {}", row.id, rules::sentence(row, Some(limit)), with_unit(stop.value, row.unit))
}

/// How a session has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Completed, and every criterion of the task is met.
    Pass,
    /// Completed, and some criterion is not met.
    Fail,
    /// Stopped before its end: no verdict.
    NotCompleted,
    /// Not begun.
    Refused,
    /// The checks were asked for, and have passed.
    Checked,
}

impl Outcome {
    fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotCompleted => "not_completed",
            Self::Refused => "refused",
            Self::Checked => "checked",
        }
    }

    /// The exit code, whatever the options.
    fn exit(self) -> Exit {
        match self {
            Self::Pass | Self::Checked => Exit::Done,
            Self::Fail => Exit::NotVerified,
            Self::NotCompleted | Self::Refused => Exit::Incomplete,
        }
    }
}

fn outcome(plan: &Plan, ended: &Ended) -> Outcome {
    match ended.last.cause {
        _ if ended.refusal.is_some() => Outcome::Refused,
        StopCause::Checked => Outcome::Checked,
        StopCause::Completed if succeeds(&plan.task.plant.task, &ended.metrics) => Outcome::Pass,
        StopCause::Completed => Outcome::Fail,
        _ => Outcome::NotCompleted,
    }
}

fn report(plan: &Plan, ended: &Ended, band: &band::Band, args: &DriveArgs) -> miette::Result<Exit> {
    let inside = band.lines.iter().filter(|line| line.inside()).count();
    let mut json = answer(plan, ended);
    json["predicted_success"] = json!(band.success);
    json["predictions"] = json!(band.runs);
    json["metrics"] = band.lines.iter().map(Line::json).collect();
    write_answer(plan, &json)?;
    if args.json {
        say(crate::words::json(&json));
    } else {
        let verdict = match outcome(plan, ended) {
            Outcome::Pass => "PASS",
            Outcome::Fail => "FAIL",
            Outcome::NotCompleted | Outcome::Refused | Outcome::Checked => "NOT COMPLETED, no verdict",
        };
        say(format!(
            "\nthe run    {verdict}; the model passes {} of {} drives of this draw",
            percent(band.success),
            band.runs
        ));
        say(format!("{:<24} {:>14} {:>14} {:>14}", "metric", "this run", "95 % from", "to"));
        for line in &band.lines {
            let mark = if line.inside() { "" } else { "  OUTSIDE" };
            let value = |v: f64| with_unit(v, line.unit);
            say(format!(
                "{:<24} {:>14} {:>14} {:>14}{mark}",
                line.name,
                value(line.value),
                value(line.lo),
                value(line.hi)
            ));
        }
        say(format!("{inside} of {} metrics inside what the model expects", band.lines.len()));
    }
    Ok(outcome(plan, ended).exit())
}
