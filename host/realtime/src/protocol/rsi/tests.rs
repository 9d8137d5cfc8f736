//! Driver against emulated controller, cycle by cycle.

use super::controller::{Krc, KrcSettings};
use super::driver::RsiRobot;
use super::tags::{Correction, TagMap};
use crate::protocol::EmulatedController;
use crate::protocol::memory::{MemoryPort, local, peer, state_at};
use crate::signals::{AXES, LinkFault, Order, RAIL, RobotLink, RobotState};
use crate::time::Nanos;

const START: [f64; AXES] = [0.1, -1.5, 1.4, 0.0, 0.5, -0.3, 1.2];

/// A robot that follows its set-points at once.
struct Bench {
    port: MemoryPort,
    krc: Krc,
    driver: RsiRobot<MemoryPort>,
    now: Nanos,
    measured: [f64; AXES],
}

impl Bench {
    fn new(tags: TagMap, change: impl FnOnce(&mut KrcSettings)) -> Self {
        let mut settings = KrcSettings::new(tags.clone(), local());
        change(&mut settings);
        let port = MemoryPort::default();
        let driver = RsiRobot::new(port.clone(), tags, Some(peer().ip())).unwrap();
        Self { port, krc: Krc::new(settings), driver, now: Nanos::from_millis(1), measured: START }
    }

    fn begin_cycle(&mut self) {
        self.now += self.krc.cycle();
        self.port.set_now(self.now);
        if self.krc.fault().is_none() && self.now.0 > 2 * self.krc.cycle().0 {
            self.measured = self.krc.target(self.now);
        }
        self.port.report(&mut self.krc, &state_at(self.measured, self.now));
    }

    fn cycle(&mut self, order: &Order) -> Option<RobotState> {
        self.begin_cycle();
        let state = self.driver.receive(self.now).unwrap();
        self.driver.send(order).unwrap();
        self.port.answer(&mut self.krc);
        state
    }
}

fn moved(by: f64) -> [f64; AXES] {
    std::array::from_fn(|axis| START[axis] + by * (1.0 + axis as f64))
}

fn assert_near(a: [f64; AXES], b: [f64; AXES], tolerance: f64) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} {b:?}");
}

fn rail_tags(mode: Correction) -> TagMap {
    TagMap { mode, ..TagMap::kroshu().with_rail() }
}

#[test]
fn both_modes_follow_and_hold_without_a_jump() {
    for mode in [Correction::Absolute, Correction::Relative] {
        for tags in [rail_tags(mode), TagMap { cycle: Nanos::from_millis(12), ..rail_tags(mode) }] {
            let mut bench = Bench::new(tags, |_| {});
            for _ in 0..5 {
                bench.cycle(&Order::Hold).unwrap();
            }
            assert_near(bench.measured, START, 1e-7);
            for step in 1..=100 {
                bench.cycle(&Order::Move(moved(1e-3 * f64::from(step)))).unwrap();
            }
            for _ in 0..5 {
                bench.cycle(&Order::Hold).unwrap();
            }
            assert_near(bench.measured, moved(0.1), 2e-8);
            assert_eq!(bench.krc.late_answers(), 0);
            let counters = bench.driver.counters();
            assert_eq!((counters.received, counters.lost, counters.unsent), (110, 0, 0));
        }
    }
}

#[test]
fn increments_below_the_last_decimal_are_not_lost() {
    let mut bench = Bench::new(rail_tags(Correction::Relative), |_| {});
    bench.cycle(&Order::Hold);
    for step in 1..=2000 {
        bench.cycle(&Order::Move(moved(1e-9 * f64::from(step))));
    }
    bench.cycle(&Order::Hold);
    bench.cycle(&Order::Hold);
    assert_near(bench.measured, moved(2e-6), 2e-8);
}

#[test]
fn the_interpolator_moves_linearly() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |_| {});
    bench.cycle(&Order::Hold);
    bench.cycle(&Order::Move(moved(0.01)));
    bench.cycle(&Order::Hold);
    let quarter = bench.krc.target(bench.now + Nanos::from_millis(1));
    assert_near(quarter, moved(0.0025), 1e-8);
}

#[test]
fn only_newest_report_is_answered_and_only_in_time() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |_| {});
    bench.cycle(&Order::Hold);
    bench.begin_cycle();
    bench.begin_cycle();
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    bench.driver.send(&Order::Hold).unwrap();
    let sent = bench.port.sent();
    assert_eq!(sent.len(), 1);
    assert!(String::from_utf8_lossy(&sent[0].1).contains("<IPOC>4208163646</IPOC>"));
    assert_eq!(bench.driver.counters().unsent, 2);
    // A second answer to one report, and an answer after the end of its cycle.
    bench.driver.send(&Order::Hold).unwrap();
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    bench.port.set_now(bench.now + Nanos::from_millis(4));
    bench.driver.send(&Order::Hold).unwrap();
    assert!(bench.port.sent().is_empty());
    assert_eq!(bench.driver.counters().unsent, 4);
}

#[test]
fn repeated_ipoc_is_answered_once_with_the_newest_command() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |settings| settings.repeats = true);
    for _ in 0..3 {
        bench.cycle(&Order::Hold).unwrap();
    }
    // A stall of 20 ms: the same IPOC comes five more times, and the answer to the first copy is too late.
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    for _ in 0..5 {
        bench.begin_cycle();
    }
    bench.port.set_now(bench.now + Nanos::from_millis(1));
    bench.driver.send(&Order::Hold).unwrap();
    assert!(bench.port.sent().is_empty(), "the first copy's cycle is over");
    let before = bench.driver.counters();
    let state = bench.driver.receive(bench.now).unwrap().expect("the repeated report");
    let after = bench.driver.counters();
    assert_eq!((after.overtaken - before.overtaken, after.stale, after.lost, state.late_answers), (4, 0, 0, 5));
    bench.driver.send(&Order::Move(moved(1e-3))).unwrap();
    bench.driver.send(&Order::Move(moved(2e-3))).unwrap();
    let sent = bench.port.sent();
    assert_eq!(sent.len(), 1, "one answer");
    // One more copy, in transit since before the answer.
    bench.begin_cycle();
    assert_eq!(bench.driver.receive(bench.now), Ok(None), "an answered IPOC is stale");
    bench.driver.send(&Order::Move(moved(3e-3))).unwrap();
    assert!(bench.port.sent().is_empty(), "never a second answer");
    bench.krc.take(bench.now, local(), &sent[0].1, &mut |_, _| {});
    bench.cycle(&Order::Move(moved(1e-3))).expect("the link works");
    assert_near(bench.krc.target(bench.now + bench.krc.cycle()), moved(1e-3), 2e-8);
}

#[test]
fn second_copy_of_a_report_is_not_a_new_cycle() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |_| {});
    bench.cycle(&Order::Hold).unwrap();
    bench.begin_cycle();
    let mut buffer = [0; 1500];
    let (length, _) = crate::wire::Port::receive(&mut bench.port, &mut buffer, bench.now).unwrap().unwrap();
    for _ in 0..2 {
        bench.port.deliver(peer(), &buffer[..length]);
    }
    bench.driver.receive(bench.now).unwrap().expect("the first copy");
    let counters = bench.driver.counters();
    assert_eq!((counters.stale, counters.overtaken), (1, 0));
    bench.driver.send(&Order::Hold).unwrap();
    assert_eq!(bench.port.sent().len(), 1);
    // Without growing `Delay`, a copy a cycle later is answered if the first one was not.
    bench.begin_cycle();
    let (length, _) = crate::wire::Port::receive(&mut bench.port, &mut buffer, bench.now).unwrap().unwrap();
    bench.port.deliver(peer(), &buffer[..length]);
    bench.driver.receive(bench.now).unwrap().expect("the first copy");
    bench.port.set_now(bench.now + bench.krc.cycle());
    bench.driver.send(&Order::Hold).unwrap();
    assert!(bench.port.sent().is_empty());
    bench.port.deliver(peer(), &buffer[..length]);
    bench.driver.receive(bench.now).unwrap().expect("the copy a cycle later");
    bench.driver.send(&Order::Hold).unwrap();
    assert_eq!(bench.port.sent().len(), 1);
}

#[test]
fn lost_old_and_foreign_datagrams_are_counted() {
    let mut bench = Bench::new(TagMap::kroshu(), |_| {});
    bench.cycle(&Order::Hold);
    bench.cycle(&Order::Hold);
    bench.begin_cycle();
    let mut buffer = [0; 1500];
    let (length, _) = crate::wire::Port::receive(&mut bench.port, &mut buffer, bench.now).unwrap().unwrap();
    let lost = buffer[..length].to_vec();
    bench.cycle(&Order::Hold).unwrap();
    bench.port.deliver(peer(), &lost);
    bench.port.deliver(peer(), b"<Rob></Rob>");
    bench.port.deliver("192.168.1.2:5".parse().unwrap(), &lost);
    bench.port.deliver("192.168.1.9:49152".parse().unwrap(), &lost);
    assert_eq!(bench.driver.receive(bench.now), Ok(None));
    let counters = bench.driver.counters();
    assert_eq!((counters.lost, counters.stale, counters.malformed, counters.foreign), (1, 1, 1, 2));
    assert_eq!(bench.krc.late_answers(), 1);
    assert_eq!(bench.cycle(&Order::Hold).unwrap().late_answers, 1);
}

#[test]
fn silence_of_a_hundred_cycles_is_a_fault() {
    let mut bench = Bench::new(TagMap::im_free(), |_| {});
    for _ in 0..3 {
        bench.cycle(&Order::Hold);
    }
    for _ in 0..100 {
        assert_eq!(bench.krc.fault(), None);
        bench.begin_cycle();
    }
    bench.begin_cycle();
    assert!(bench.krc.fault().is_some());
}

#[test]
fn a_lost_answer_keeps_or_drops_the_correction_as_configured() {
    for hold_on in [true, false] {
        let mut bench = Bench::new(rail_tags(Correction::Absolute), |settings| {
            (settings.hold_on, settings.accumulate, settings.timeout) = (hold_on, true, 3);
        });
        for _ in 0..3 {
            bench.cycle(&Order::Move(moved(0.01)));
        }
        for lost in 1..=3 {
            bench.begin_cycle();
            bench.begin_cycle();
            let expected = if hold_on { 0.01_f64.to_degrees() } else { 0.0 };
            assert!((bench.krc.correction()[0] - expected).abs() < 1e-6);
            // Each answers the newest of two: every second one is missing, and the count adds up.
            bench.cycle(&Order::Move(moved(0.01)));
            assert_eq!(bench.krc.fault().is_some(), 2 * lost >= 3);
        }
    }
}

#[test]
fn corrections_are_clamped_and_monitored() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |settings| {
        settings.upper[0] = 1.0;
        settings.monitor[1] = 2.0;
    });
    bench.cycle(&Order::Hold);
    let mut far = START;
    far[0] += 0.1;
    bench.cycle(&Order::Move(far));
    bench.cycle(&Order::Hold);
    assert!((bench.krc.correction()[0] - 1.0).abs() < 1e-9);
    far[1] -= 0.1;
    bench.cycle(&Order::Move(far));
    bench.begin_cycle();
    assert!(bench.krc.fault().unwrap().starts_with("AXISCORRMON"));
}

#[test]
fn end_request_is_repeated_until_confirmed() {
    let mut bench = Bench::new(rail_tags(Correction::Absolute), |_| {});
    bench.cycle(&Order::Hold);
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    bench.driver.send(&Order::End(START)).unwrap();
    let lost = bench.port.sent();
    assert!(String::from_utf8_lossy(&lost[0].1).contains("<Stop>1</Stop>"));
    let state = bench.cycle(&Order::Move(moved(1.0))).unwrap();
    assert!(!state.ready);
    assert_eq!(bench.krc.fault(), Some("RSI was ended by the client"));
    assert_near(bench.krc.target(bench.now), START, 1e-8);
}

#[test]
fn implausible_commands_are_not_sent() {
    for tags in [rail_tags(Correction::Absolute), TagMap::kroshu()] {
        let mut bench = Bench::new(tags, |_| {});
        for bad in [f64::NAN, f64::INFINITY, 1e3] {
            bench.begin_cycle();
            bench.driver.receive(bench.now).unwrap().unwrap();
            let mut target = START;
            target[RAIL] = bad;
            assert!(matches!(bench.driver.send(&Order::Move(target)), Err(LinkFault::Unsendable(_))));
            assert!(bench.port.sent().is_empty());
        }
    }
}

#[test]
fn external_axes_without_a_rail_are_zero_both_ways() {
    let mut bench = Bench::new(TagMap::kroshu(), |_| {});
    let mut start = START;
    start[RAIL] = 0.0;
    for _ in 0..3 {
        let state = bench.cycle(&Order::Hold).unwrap();
        assert_near(state.position, start, 1e-8);
    }
    assert!(!bench.driver.capabilities().rail);
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    let mut target = start;
    target[0] += 1e-3;
    bench.driver.send(&Order::Move(target)).unwrap();
    let sent = bench.port.sent();
    let text = String::from_utf8_lossy(&sent[0].1);
    assert!(text.contains("<EK E1=\"0.000000\"/>"), "{text}");
    bench.begin_cycle();
    bench.driver.receive(bench.now).unwrap().unwrap();
    target[RAIL] = 0.1;
    assert_eq!(bench.driver.send(&Order::Move(target)), Err(LinkFault::Unsendable("this robot has no rail")));
    // A client's rail correction moves nothing.
    let text = text.replace("E1=\"0.000000\"", "E1=\"50.000000\"").replace("<IPOC>4208163646<", "<IPOC>4208163650<");
    bench.krc.take(bench.now, local(), text.as_bytes(), &mut |_, _| {});
    bench.begin_cycle();
    assert_eq!(bench.krc.correction()[RAIL], 0.0);
    assert!(bench.krc.correction()[0] > 0.05);
}

#[test]
fn map_that_differs_from_the_context_is_refused() {
    let mut settings = KrcSettings::new(TagMap::kroshu(), local());
    settings.timeout = 1;
    let port = MemoryPort::default();
    let mut driver = RsiRobot::new(port.clone(), TagMap::im_free(), None).unwrap();
    port.report(&mut Krc::new(settings), &state_at(START, Nanos(0)));
    assert!(matches!(driver.receive(Nanos(0)), Err(LinkFault::Mismatch(_))));
    let bad = TagMap { axes: "A B".to_owned(), ..TagMap::kroshu() };
    assert!(RsiRobot::new(port, bad, None).is_err());
}
