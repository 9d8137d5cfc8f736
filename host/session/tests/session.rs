//! Sessions without a terminal, in virtual time, on emulated robots.

use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::feed::Samples;
use softdock_realtime::drive::runner::Alarms;
use softdock_realtime::view::model::Budgets;
use softdock_session::SessionError;
use softdock_session::answer::{SessionAnswer, SessionOutcome};
use softdock_session::operator::{Operator, SessionNotice, Unwatched};
use softdock_session::plan::{RunChoice, SessionMode, SessionOptions, SessionPlan};
use softdock_session::replay::{ReplayFiles, SessionLog};
use softdock_session::rights::CycleRights;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// Run 1244 of the shipped campaign in virtual time.
fn options(out: &Path) -> SessionOptions {
    SessionOptions {
        campaign: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml"),
        model: None,
        facility: None,
        run: RunChoice::Number(1244),
        repeat: 1,
        effects: None,
        robots: ["emulated://", "emulated://"].map(str::to_owned),
        sensor: "emulated://".to_owned(),
        mode: SessionMode::DryRun,
        retract: 0.0,
        go_after_check: false,
        to_start: false,
        virtual_time: true,
        rights: CycleRights { priority: 0, core: None },
        out: Some(out.to_owned()),
    }
}

/// Counts the cycles, and keeps the answer.
#[derive(Default)]
struct Counting {
    cycles: AtomicU32,
    answer: Mutex<Option<SessionAnswer>>,
}

impl Operator for Counting {
    fn notice(&self, notice: &SessionNotice) {
        panic!("nothing real is opened: {notice}");
    }

    fn watch(&self, mut samples: Samples, budgets: Budgets, controls: &Controls) {
        assert!(budgets.force_n > 0.0 && budgets.energy_j > 0.0, "{budgets:?}");
        loop {
            let ended = controls.ended();
            let seen = std::iter::from_fn(|| samples.next_sample()).count();
            self.cycles.fetch_add(seen as u32, Ordering::Relaxed);
            if ended {
                return;
            }
            std::thread::yield_now();
        }
    }

    fn answered(&self, answer: &SessionAnswer) {
        *self.answer.lock().expect("no holder panics") = Some(answer.clone());
    }
}

#[test]
fn operator_gets_the_answer_that_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("drive");
    let plan = SessionPlan::new(options(&out)).expect("a plan");
    let operator = Counting::default();
    let ended = plan.run(&operator, &Controls::default(), &Alarms::default()).expect("it runs");
    assert_eq!(ended.outcome(&plan), SessionOutcome::Pass);
    assert!(operator.cycles.load(Ordering::Relaxed) > 0, "cycles are shown");
    let answer = operator.answer.lock().expect("no holder panics").take().expect("an answer");
    assert_eq!(answer, ended.answer(&plan));
    let written = std::fs::read_to_string(out.join("drive.json")).expect("the file");
    assert_eq!(written, serde_json::to_string_pretty(&serde_json::json!(answer)).expect("string keys"));
    // The same log, replayed.
    let log = SessionLog::read(&out.join("log.mcap")).expect("a log");
    let replay = log.replay(&ReplayFiles::default()).expect("it replays");
    assert_eq!(replay.replayed.equal, ended.log_records);
    assert!(replay.replayed.first.is_none() && log.ends_early().is_none());
    // A log is never overwritten.
    let again = plan.run(&Unwatched, &Controls::default(), &Alarms::default());
    assert!(matches!(again, Err(SessionError::Refused { .. })));
    assert!(out.join("log.mcap").is_file());
}

#[test]
fn stop_or_signal_ends_a_session_without_a_verdict() {
    let folder = tempfile::tempdir().expect("a folder");
    let (stop, signal) = (Controls::default(), Alarms::default());
    stop.request_stop();
    signal.signals.fetch_add(1, Ordering::Relaxed);
    for (name, controls, alarms) in [("operator", &stop, &Alarms::default()), ("signal", &Controls::default(), &signal)]
    {
        let plan = SessionPlan::new(options(&folder.path().join(name))).expect("a plan");
        let ended = plan.run(&Unwatched, controls, alarms).expect("it runs");
        assert_eq!(ended.outcome(&plan), SessionOutcome::NotCompleted);
        assert_eq!(ended.answer(&plan).cause, name);
    }
}

#[test]
fn contradicting_options_are_refused_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("never");
    let refused = |change: fn(&mut SessionOptions), reason: &str| {
        let mut options = options(&out);
        change(&mut options);
        let error = SessionPlan::new(options).err().expect("it is refused");
        assert!(error.to_string().contains(reason) && error.remedy().is_some(), "{error}");
    };
    refused(|options| options.mode = SessionMode::Armed, "all links are emulated");
    refused(|options| options.robots[0] = "rsi://127.0.0.1".to_owned(), "virtual time");
    refused(|options| options.run = RunChoice::Number(2_000), "run 2000 of a campaign of 2000 runs");
    refused(|options| options.sensor = "rsi://127.0.0.1".to_owned(), "not a sensor protocol");
    assert!(!out.exists());
}
