//! The screen drawn to a terminal in memory, the text lines, and the keys.

use super::*;
use crate::drive::feed::{RING_SAMPLES, Sample, feed};
use crate::log::codes::{LimitKind, Phase, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, TOOL};
use crate::log::sample;
use crate::log::table::Logged;
use crate::time::Nanos;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

const BUDGETS: Budgets = Budgets { force_n: 200.0, energy_j: 0.5 };

fn after(cycles: u64) -> View {
    let mut view = View::new(BUDGETS);
    (0..cycles).for_each(|n| view.take(&Sample::of(&sample::cycle(n))));
    view
}

/// Returns the screen as text, line by line.
fn drawn(view: &View, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
    terminal.draw(|frame| screen::draw(frame, view)).expect("a picture");
    let buffer = terminal.backend().buffer();
    let row = |y: u16| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
    (0..height).map(row).collect()
}

#[track_caller]
fn assert_shows(screen: &[String], text: &str) {
    assert!(screen.iter().any(|line| line.contains(text)), "no `{text}` in\n{}", screen.join("\n"));
}

#[test]
fn screen_shows_the_loop() {
    let mut record = sample::cycle(900);
    record.flags |= cycle_flags::ARMED;
    record.robot_2.limit_used[6] = 0.93;
    record.contact_energy = 0.25;
    let mut view = after(900);
    view.take(&Sample::of(&record));
    let screen = drawn(&view, 80, 24);
    for text in [
        " contact   0.900 s  cycle 900  ARMED: robots move",
        "measured force 37.5 N (peak 37.5, limit 200), moment 0.75 N m",
        "tracking error robot 1     2.000 mm",
        "tracking error robot 2     0.000 mm",
        "age of sensor sample        0.30 ms",
        "energy 0.250/0.5 J",
        "us                p50    p99     max",
        "lateness           11     23      23",
        "round trip 1      271    291     291",
        "lost 0 stale 0 late 0 over 0",
        "limits of robot 1",
        "rail    93 %",
        "s or space  controlled stop (no emergency stop)",
    ] {
        assert_shows(&screen, text);
    }
    assert!(screen.iter().any(|line| line.contains('█')), "a history of the force");
}

#[test]
fn screen_shows_a_stop_and_its_cause() {
    let mut view = after(100);
    view.set_controls(1, false);
    assert_shows(&drawn(&view, 80, 24), "stop requested");
    assert_shows(&drawn(&view, 80, 24), "s again  end the protocols at once");
    let mut record = sample::stopping(100);
    record.robot_1.limits.set(LimitKind::Box, TOOL);
    record.log_dropped = 12;
    view.take(&Sample::of(&record));
    view.set_controls(1, true);
    let screen = drawn(&view, 80, 24);
    for text in [
        " stopping ",
        "stop: a command outside the limits of an axis",
        "velocity",
        "tool: box",
        "q  close",
        "the log has lost 12 records",
    ] {
        assert_shows(&screen, text);
    }
    assert!(screen.iter().all(|line| !line.contains("controlled stop (no")));
}

#[test]
fn any_record_draws_at_any_size() {
    let mut view = View::new(BUDGETS);
    drawn(&view, 80, 24);
    view.take(&Sample::of(&CycleRecord::BLANK));
    assert_shows(&drawn(&view, 80, 24), "no robot");
    for seed in 0..200 {
        view.take(&Sample::of(&sample::any(seed)));
        drawn(&view, 20 + (seed % 150) as u16, 1 + (seed % 60) as u16);
        lines::line(&view);
    }
}

#[test]
fn percentiles_use_nearest_rank_and_maximum_is_kept() {
    let mut view = View::new(BUDGETS);
    let late = |micros: i64| {
        let mut record = sample::cycle(0);
        record.robot_1.lateness = Nanos::from_micros(micros);
        Sample::of(&record)
    };
    view.take(&late(5_000));
    (1..=20_000).for_each(|n| view.take(&late(n % 100 + 1)));
    let found = view.lateness(0);
    let expected = (Nanos::from_micros(50), Nanos::from_micros(99), Nanos::from_micros(5_000));
    assert_eq!((found.p50, found.p99, found.max), expected);
}

#[test]
fn force_history_keeps_short_peaks() {
    let mut view = View::new(BUDGETS);
    for n in 0..1_000_u64 {
        let mut record = sample::cycle(n);
        record.ft.compensated.force = softdock_kernels::vector::vec3(if n == 555 { 90.0 } else { 1.0 }, 0.0, 0.0);
        view.take(&Sample::of(&record));
    }
    let history: Vec<f64> = view.force_history(200).collect();
    assert_eq!(history, [1.0, 1.0, 1.0, 1.0, 1.0, 90.0, 1.0, 1.0, 1.0, 1.0]);
    assert_eq!(view.force_history(3).count(), 3);
    assert_eq!(view.peak_measured_force, 90.0);
}

#[test]
fn keys_stop_a_session_and_close_the_view_only_after_it() {
    let key = |code, modifiers| KeyEvent::new(code, modifiers);
    let plain = |letter| key(KeyCode::Char(letter), KeyModifiers::NONE);
    let control_c = key(KeyCode::Char('c'), KeyModifiers::CONTROL);
    for stop in [plain('s'), plain(' '), plain('S'), control_c] {
        assert_eq!(meaning(stop, false), Some(Key::Stop));
    }
    assert_eq!(meaning(plain('g'), false), Some(Key::Go));
    assert_eq!(meaning(plain('g'), true), None);
    assert_eq!(meaning(plain('q'), false), None, "a running session's view stays open");
    assert_eq!(meaning(plain('q'), true), Some(Key::Close));
    assert_eq!(meaning(control_c, true), Some(Key::Close));
    assert_eq!(meaning(plain('c'), false), None);
    let released = KeyEvent { kind: KeyEventKind::Release, ..plain('s') };
    assert_eq!(meaning(released, false), None);
}

#[test]
fn lines_without_a_terminal_end_with_the_cause() {
    let (mut feed, mut samples) = feed();
    (0..700).for_each(|n| feed.push(&sample::cycle(n)));
    let mut last = sample::stopping(700);
    last.phase = Phase::Stopped;
    last.cause = StopCause::ForceLimit;
    feed.push(&last);
    let controls = Controls::default();
    controls.end();
    let (mut view, mut out) = (View::new(BUDGETS), Vec::new());
    show_lines(&mut view, &mut samples, &controls, &mut out, &mut |_| ()).expect("memory");
    let text = String::from_utf8(out).expect("text");
    assert_eq!(text.lines().count(), 1);
    for part in [
        "    0.700 s; stopped (dry run); measured force 22.7 N, peak 22.7 N;",
        "tracking error 2.000 and 0.000 mm;",
        "contact energy 0.0226 of 0.5 J;",
        "robot 2: late p99 23 max 23 us, round trip p99 291 max 291 us, lost 0, late 0;",
        "stop: force or moment above its limit",
    ] {
        assert!(text.contains(part), "no `{part}` in {text}");
    }
}

#[test]
fn cycle_never_waits_for_the_view() {
    let (mut feed, mut samples) = feed();
    let record = sample::cycle(1);
    (0..RING_SAMPLES + 100).for_each(|_| feed.push(&record));
    assert_eq!(std::iter::from_fn(|| samples.next_sample()).count(), RING_SAMPLES);
    drop(feed);
    let (mut view, controls) = (View::new(BUDGETS), Controls::default());
    assert!(take(&mut view, &mut samples, &controls), "a session whose cycle has ended is over");
    assert_eq!(controls.stops(), 0);
    controls.request_stop();
    assert_eq!(controls.stops(), 1);
}

/// The view with a session, for manual inspection: `cargo test -p softdock-realtime show_a_session -- --ignored
/// --nocapture`.
#[test]
#[ignore = "needs a terminal and an operator"]
fn show_a_session() {
    let (mut feed, samples) = feed();
    let controls = Controls::default();
    thread::scope(|scope| {
        scope.spawn(|| {
            let cycles = (0..60_000).take_while(|_| controls.stops() == 0);
            let count = cycles.inspect(|n| feed.push(&sample::noisy(*n))).map(|_| thread::sleep(PICTURE / 100)).count();
            let mut last = sample::stopping(count as u64);
            (last.phase, last.cause) = (Phase::Stopped, StopCause::Operator);
            feed.push(&last);
            controls.end();
        });
        show(samples, BUDGETS, &controls, &mut |_| ()).expect("a terminal");
    });
}
