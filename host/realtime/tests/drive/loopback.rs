//! Draws of the docking campaign over RSI and Net F/T on sockets, in real time, compared with the farm's rows.
//!
//! The robots' cycle is 4 ms here and 1 ms in the scenario, which adds some milliseconds of dead time, and the sensor
//! noise differs. The draws are those whose outcome depends on neither; stop times are not compared.

use crate::fixture::{Setting, campaign, farm_run};
use softdock_campaign::criteria::first_breach;
use softdock_campaign::station::Tracking;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Stop;
use softdock_kernels::plant::Plant;
use softdock_realtime::clock::Monotonic;
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::loopback::rsi;
use softdock_realtime::emulation::server::serve;
use softdock_realtime::histogram::Histogram;
use softdock_realtime::log::codes::{StopCause, robot_flags};
use softdock_realtime::time::Nanos;
use softdock_test_size::first;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

const CYCLE: Nanos = Nanos::from_millis(4);
/// Lateness of a cycle of the session or the facility that counts as a disturbance.
const LATE: Nanos = Nanos::from_millis(1);
/// A time in the unreachable future.
const FOREVER: Nanos = Nanos(i64::MAX / 4);
/// Compared draws: the shortest session that is stopped and the shortest that passes, then the rest.
const DRAWS: [u64; 10] = [6, 10, 0, 1, 2, 3, 4, 7, 8, 9];
/// Dead times that must not change the outcome \[s\].
const MORE_DELAY: [f64; 3] = [0.0, 2e-3, 4e-3];
/// Greatest number of repeats of a session that the machine has disturbed.
const MOST_SESSIONS: usize = 5;

/// Returns outcome and cause of a run.
fn ended(plant: &Plant, stop: Option<Stop>, metrics: &Metrics<f64>) -> String {
    match (stop, first_breach(&plant.task, metrics)) {
        (Some(stop), _) => format!("stopped by {}", stop.rule.row().id),
        (None, Some((criterion, _))) => format!("failed {}", criterion.id),
        (None, None) => "passed".to_owned(),
    }
}

/// A session over sockets.
struct Driven {
    ended: String,
    /// Time of the run at its end \[s\].
    time: f64,
    cause: StopCause,
    /// Cycles that began late or without a report, datagrams lost or not sent, answers too late for the controllers.
    disturbances: u64,
}

/// Runs a draw in real time, with its facility in another thread.
fn drive(setting: &Setting) -> Driven {
    let (mut facility, mut sockets, links) = rsi(setting.world(), CYCLE).expect("sockets");
    let (stop, mut lateness) = (AtomicBool::new(false), Histogram::default());
    let mut driven = thread::scope(|scope| {
        scope.spawn(|| serve(&mut facility, &mut sockets, &stop, FOREVER, &mut lateness));
        let mut session = Session::new(setting.task(), links, None, Rc::new(Monotonic)).expect("prepared");
        session.go();
        let mut late = 0;
        while !session.cycle(None) {
            let robot = &session.record().robot_1;
            late += u64::from(robot.flags & robot_flags::FRESH == 0 || robot.lateness > LATE);
        }
        stop.store(true, Ordering::Relaxed);
        let (core, last) = (session.core(), session.record());
        let lost = [last.robot_1.link, last.robot_2.link].map(|link| link.lost + link.stale + link.unsent);
        let answers = u64::from(last.robot_1.late_answers + last.robot_2.late_answers);
        Driven {
            ended: ended(&setting.plant, core.rule_met(), &core.metrics()),
            time: core.progress().time,
            cause: last.cause,
            disturbances: late + last.overruns + lost[0] + lost[1] + answers,
        }
    });
    driven.disturbances += u64::from(lateness.max() > LATE);
    driven
}

/// Returns whether a session of a draw ends as the farm's run; `false` if the machine has disturbed all of them.
///
/// A session that ends differently without a disturbance is an error.
fn is_alike(setting: &Setting) -> bool {
    let Setting { seed, plant, run, params, .. } = setting;
    let farm = farm_run(plant, *seed, *run, *params);
    let expected = ended(plant, farm.stop, &farm.hil);
    for (other, more) in (1..).zip(MORE_DELAY) {
        let params = softdock_kernels::params::Params { loop_delay: params.loop_delay + more, ..*params };
        let other = farm_run(plant, seed + other, *run, params);
        assert_eq!(ended(plant, other.stop, &other.hil), expected, "run {run} depends on noise or {more} s of delay");
    }
    for session in 1..=MOST_SESSIONS {
        let driven = drive(setting);
        let Driven { ended, time, disturbances, cause } = &driven;
        let message = format!(
            "run {run}: farm {expected} at {:.3} s, session {session} {ended} at {time:.3} s ({cause:?}), {disturbances} disturbances",
            farm.hil.end_time
        );
        println!("{message}");
        if *ended == expected && (*cause == StopCause::Completed) == farm.stop.is_none() {
            return true;
        }
        assert!(*disturbances > 0, "{message}");
    }
    false
}

#[test]
fn sessions_over_rsi_on_loopback_agree_with_the_farm() {
    let campaign = campaign("probe_drogue.toml");
    let settings: Vec<Setting> = first(2, DRAWS)
        .map(|run| {
            let mut setting = Setting::draw(&campaign, run);
            // A busy machine loses dozens of cycles; only the end of the run is compared.
            let links = &mut setting.station.links;
            (links.hold_cycles, links.stop_cycles, links.window_cycles, links.catch_up) = (100, 200, 10_000, 10.0);
            links.tracking = Tracking { distance: 1.0, angle: 1.0, time: 1.0 };
            setting
        })
        .collect();
    let alike: Vec<bool> = thread::scope(|scope| {
        let draws: Vec<_> = settings.iter().map(|setting| scope.spawn(|| is_alike(setting))).collect();
        draws.into_iter().map(|draw| draw.join().expect("no session ends otherwise")).collect()
    });
    let found = alike.iter().filter(|alike| **alike).count();
    // A machine that disturbs every session proves nothing; a quiet one shows all draws alike.
    assert!(2 * found >= alike.len(), "only {found} of {} draws had a session without a disturbance", alike.len());
}
