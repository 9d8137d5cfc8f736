//! The dead time identified from a session's records equals the one of the emulated facility.

use crate::fixture::{CYCLE, Rig, Setting};
use softdock_kernels::params::Params;
use softdock_kernels::robot::transport;
use softdock_realtime::clock::Virtual;
use softdock_realtime::drive::delay::{DeadTime, DelayClock, Lag, ProtocolTiming, ServoResponse, delays};
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::Relay;
use std::rc::Rc;

const MILLI: Nanos = Nanos::from_millis(1);

/// A docking whose commands have this dead time \[s\]; robots without a lag if `ideal`.
fn setting(travel: f64, ideal: bool) -> Setting {
    let mut setting = Setting::docking();
    let p = &mut setting.params;
    p.loop_delay = setting.plant.timing.loop_delay(p.sensor_delay, travel);
    if ideal {
        (p.robot1_lag, p.robot2_lag) = (0.0, 0.0);
    }
    let configured = transport(&setting.plant, &setting.params, 0.0) * setting.plant.timing.tick();
    assert!((configured - travel).abs() < 1e-12);
    setting
}

/// Returns the records of a session in process; it may end for any reason.
fn in_process(setting: &Setting, cycle: Nanos) -> Vec<CycleRecord> {
    let clock = Rc::new(Virtual::default());
    let bench = InProcessRig::new(setting.world(), clock.clone(), cycle);
    let mut session = Session::new(setting.task(), links(&bench), None, clock).expect("prepared");
    session.go();
    let mut records = Vec::new();
    while !session.cycle(None) {
        records.push(*session.record());
    }
    records
}

fn over_rsi(setting: &Setting) -> Vec<CycleRecord> {
    let mut rig = Rig::new(setting, Relay::default());
    rig.finish();
    rig.records
}

fn measured(
    records: &[CycleRecord],
    stated: ProtocolTiming,
    timing: DelayClock,
    response: ServoResponse,
) -> [DeadTime; 2] {
    delays(records, [stated; 2], timing, [response; 2]).map(|delay| delay.expect("a robot that has moved"))
}

#[track_caller]
fn assert_near(found: &[DeadTime; 2], travel: f64, slack: f64, what: &str) {
    for (robot, delay) in found.iter().enumerate() {
        let ms = |time: f64| time * 1e3;
        println!(
            "{what}: {:.2} ms configured, robot {}: {:.4} ms +- {:.4} ms, {:.1e} unexplained, {:?}",
            ms(travel),
            robot + 1,
            ms(delay.dead_time),
            ms(delay.error),
            delay.residual,
            delay.lag
        );
        assert!((delay.dead_time - travel).abs() < slack, "{what}: {travel} s, {delay:?}");
    }
}

const TRAVELS: [f64; 4] = [0.5e-3, 4.3e-3, 17.2e-3, 40e-3];

#[test]
fn dead_time_in_process_is_within_a_fifth_of_a_millisecond() {
    for travel in TRAVELS {
        let records = in_process(&setting(travel, true), MILLI);
        for timing in [DelayClock::Robot, DelayClock::Ours] {
            let found = measured(&records, ProtocolTiming::one_cycle(MILLI), timing, ServoResponse::None);
            assert_near(&found, travel, 0.2e-3, "in process");
        }
    }
}

#[test]
fn dead_time_over_rsi_is_within_half_a_millisecond() {
    for travel in TRAVELS {
        let records = over_rsi(&setting(travel, true));
        let found = measured(&records, ProtocolTiming::two_cycles(CYCLE), DelayClock::Robot, ServoResponse::None);
        assert_near(&found, travel, 0.5e-3, "over RSI");
    }
}

/// Returns the lag of robot 1 in a draw.
fn lag(p: &Params<f64>) -> Lag {
    Lag::Second { time: p.robot1_lag, damping: p.robot1_lag_damping, zero: p.robot1_lag_zero }
}

#[test]
fn dead_time_behind_the_shipped_lag() {
    let travel = 4.3e-3;
    let setting = setting(travel, false);
    let lag = lag(&setting.params);
    let (here, there) = (in_process(&setting, MILLI), over_rsi(&setting));
    let stated = [ProtocolTiming::one_cycle(MILLI), ProtocolTiming::two_cycles(CYCLE)];
    for (records, stated, what) in [(&here, stated[0], "in process"), (&there, stated[1], "over RSI")] {
        let known = measured(records, stated, DelayClock::Robot, ServoResponse::Known(lag));
        assert_near(&known, travel, 0.5e-3, &format!("{what}, known lag"));
    }
    // A docking is too slow to separate lag and dead time; only their sum is identifiable.
    let fitted = measured(&there, stated[1], DelayClock::Robot, ServoResponse::Second);
    assert_near(&fitted, travel, 5e-3, "over RSI, fitted lag");
    for delay in fitted {
        let whole = delay.of_slow_motion();
        println!("slow motion comes {:.2} ms later", whole * 1e3);
        assert!((whole - travel - lag.delay()).abs() < 1e-3, "{delay:?}");
    }
}
