//! The block of a command's way against closed forms.

use super::command::{CommandBlock, CommandValues};
use super::{Recorded, replay};

const STEP: f64 = 1e-3;

/// What is received of a command, every millisecond over two seconds.
fn received(p: CommandValues<f64>, command: impl Fn(f64) -> [f64; 2]) -> Vec<f64> {
    let instants = 2001;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for i in 0..instants {
        let t = i as f64 * STEP;
        let [value, second] = command(t);
        inputs.extend([1.0, t]);
        late.extend([value, 0.5 * STEP * STEP * second]);
    }
    let recorded = Recorded { step: STEP, instants, stride: 1, inputs, late, offsets: Vec::new() };
    replay::<f64, CommandBlock>(&CommandBlock, &recorded, &p)
}

/// A sine of 12 Hz and its second derivative.
fn sine(t: f64) -> [f64; 2] {
    let omega = 12.0 * std::f64::consts::TAU;
    [0.1 * (omega * t).sin(), -0.1 * omega * omega * (omega * t).sin()]
}

fn ramp(t: f64) -> [f64; 2] {
    [t, 0.0]
}

/// The greatest departure from a law once the start is forgotten.
fn departure(received: &[f64], law: impl Fn(f64) -> f64) -> f64 {
    received.iter().enumerate().skip(200).map(|(i, value)| (value - law(i as f64 * STEP)).abs()).fold(0.0, f64::max)
}

#[test]
fn delays_add_up_to_any_share_of_a_step() {
    let p = CommandValues { transport_delay: 2e-3, delay: 3.4e-4, clock_offset: -1e-4, ..CommandValues::null() };
    assert!(departure(&received(p, sine), |t| sine(t - 2.24e-3)[0]) < 4e-6);
    let fast = CommandValues { clock_skew: 1e-3, ..p };
    assert!(departure(&received(fast, sine), |t| sine(t - 2.24e-3 - 1e-3 * t)[0]) < 4e-6);
}

#[test]
fn a_hold_shows_what_was_sent_a_delay_before_it_was_taken() {
    let held = CommandValues { transport_delay: 2.4e-3, hold: 4e-3, hold_share: 1.0, ..CommandValues::null() };
    let p = CommandValues { hold_phase: 2.4e-3, ..held };
    assert!(departure(&received(p, ramp), |t| ((t - 2.4e-3) / 4e-3).floor() * 4e-3) < 1e-9);
    // Jitter moves an edge to either side of a tick: half of the samples are past it.
    let values = received(CommandValues { hold_phase: 2e-3, blur: 1e-4, ..held }, ramp);
    let at = |i: usize| values[i] + 2.4e-3;
    assert!((at(1002) - 1.0).abs() < 1e-9 && (at(1003) - 1.002).abs() < 1e-9, "{:?}", &values[1000..1004]);
}

#[test]
fn a_lag_follows_its_law_and_a_limit_limits() {
    let lag = 3e-3;
    let omega = 12.0 * std::f64::consts::TAU;
    let (gain, phase) = (1.0 / (1.0 + (omega * lag).powi(2)).sqrt(), (omega * lag).atan());
    let p = CommandValues { lag, ..CommandValues::null() };
    assert!(departure(&received(p, sine), |t| 0.1 * gain * (omega * t - phase).sin()) < 2e-5);
    let limited = received(CommandValues { rate_limit: 0.5, ..CommandValues::null() }, ramp);
    assert!(departure(&limited, |t| 0.5 * t) < 1e-9);
    let late = received(CommandValues { rate_limit: 0.5, limit_lag: 2e-5, ..CommandValues::null() }, ramp);
    assert!(departure(&late, |t| 0.5 * (t - 2e-5)) < 1e-9);
}

/// Behind a ramp by the lag and the band; after a stop it keeps the band's distance.
#[test]
fn a_servo_stays_a_dead_band_behind_and_settles_with_an_offset() {
    let (lag, dead_band, position_offset) = (3e-2, 0.01, 0.04);
    let p = CommandValues { lag, dead_band, position_offset, ..CommandValues::null() };
    let behind = |t: f64| position_offset - dead_band + t - lag;
    let stop = |t: f64| [t.min(1.0), 0.0];
    for (i, value) in received(p, stop).iter().enumerate().skip(500) {
        let t = i as f64 * STEP;
        let due = if t < 1.0 { behind(t) } else { 1.0 + position_offset - dead_band };
        let allowed = if (1.0..1.3).contains(&t) { lag } else { 1e-5 };
        assert!((value - due).abs() < allowed, "{t}: {value} for {due}");
    }
    // Without a lag it is a play: a command within the band moves nothing.
    let play = CommandValues { dead_band, ..CommandValues::null() };
    assert!(received(play, |t| [0.009 * (40.0 * t).sin(), 0.0]).iter().all(|value| value.abs() < 1e-12));
}

/// A limiter removes the peaks of a command with jitter: a limited command is late by about one standard deviation of the
/// jitter, at any rate.
#[test]
fn jitter_delays_a_limited_command() {
    let jitter = 2e-5;
    let start = |t: f64| 0.2 * (6.0 * t - (6.0 * t).sin());
    let normal = |i: usize, run: u64| {
        (0..12).map(|k| crate::philox::uniform(3, "restless", run * 10_000 + i as u64, k)).sum::<f64>() - 6.0
    };
    let limit = 1.5;
    let limited = |run: Option<u64>| {
        let (mut at, mut sum, mut count) = (0.0, 0.0, 0);
        for i in 0..500 {
            let late = run.map_or(0.0, |run| jitter * normal(i, run));
            let way: f64 = start(i as f64 * STEP - late) - at;
            at += way.clamp(-limit * STEP, limit * STEP);
            if way > limit * STEP && i > 400 {
                (sum, count) = (sum + at, count + 1);
            }
        }
        sum / f64::from(count)
    };
    let runs = 200;
    let lag = (0..runs).map(|run| (limited(None) - limited(Some(run))) / limit).sum::<f64>() / runs as f64;
    assert!((0.5..2.0).contains(&(lag / jitter)), "{lag}");
}

#[test]
fn null_effects_change_no_bit() {
    let p = CommandValues { transport_delay: 2e-3, ..CommandValues::null() };
    assert_eq!(received(p, sine), received(CommandValues { hold: 4e-3, hold_phase: 1e-3, blur: 1e-4, ..p }, sine));
}
