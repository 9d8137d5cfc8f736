//! Driver against emulated controller, cycle by cycle.

use super::controller::FanucController;
use super::driver::FanucRobot;
use super::packets::{FanucCommand, FanucRequest};
use crate::protocol::EmulatedController;
use crate::protocol::memory::{MemoryPort, local, peer, state_at};
use crate::signals::{AXES, LinkFault, Order, RAIL, RobotLink, RobotState};
use crate::time::Nanos;

const CYCLE: Nanos = Nanos::from_millis(8);
const START: [f64; AXES] = [0.1, -1.5, 1.4, 0.0, 0.5, -0.3, 0.0];

struct Bench {
    port: MemoryPort,
    controller: FanucController,
    driver: FanucRobot<MemoryPort>,
    measured: [f64; AXES],
}

impl Bench {
    fn new(version: u32) -> Self {
        let port = MemoryPort::default();
        let driver = FanucRobot::open(port.clone(), peer(), CYCLE).unwrap();
        Self { port, controller: FanucController::new(CYCLE, version), driver, measured: START }
    }

    fn begin_cycle(&mut self) {
        let now = self.port.now_after(CYCLE);
        self.port.answer(&mut self.controller);
        if now.0 > 2 * CYCLE.0 {
            self.measured = self.controller.target(now);
        }
        self.port.report(&mut self.controller, &state_at(self.measured, now));
    }

    fn cycle(&mut self, order: &Order) -> Option<RobotState> {
        self.begin_cycle();
        let state = self.driver.receive(Nanos(0)).unwrap();
        self.driver.send(order).unwrap();
        state
    }
}

fn moved(by: f64) -> [f64; AXES] {
    std::array::from_fn(|axis| if axis == RAIL { 0.0 } else { START[axis] + by * (1.0 + axis as f64) })
}

fn assert_near(a: [f64; AXES], b: [f64; AXES], tolerance: f64) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} {b:?}");
}

#[test]
fn robot_connects_follows_and_ends() {
    for version in [3, 4] {
        let mut bench = Bench::new(version);
        assert_eq!(bench.cycle(&Order::Hold), None);
        for _ in 0..5 {
            assert!(bench.cycle(&Order::Hold).unwrap().ready);
        }
        // Angles are single precision in the status.
        assert_near(bench.measured, START, 2e-7);
        for step in 1..=100 {
            bench.cycle(&Order::Move(moved(1e-3 * f64::from(step)))).unwrap();
        }
        bench.cycle(&Order::Hold).unwrap();
        bench.cycle(&Order::End(moved(0.1))).unwrap();
        assert!(!bench.cycle(&Order::Hold).unwrap().ready);
        assert_near(bench.measured, moved(0.1), 1e-12);
        assert_eq!(bench.controller.fault(), None);
        let counters = bench.driver.counters();
        assert_eq!((counters.lost, counters.unsent, counters.malformed), (0, 0, 0));
    }
}

#[test]
fn unanswered_request_is_repeated() {
    let mut bench = Bench::new(3);
    assert_eq!(bench.port.sent().len(), 2);
    for _ in 0..20 {
        bench.cycle(&Order::Hold);
    }
    assert!(bench.cycle(&Order::Hold).is_some());
}

#[test]
fn no_command_is_sent_before_the_controller_is_ready() {
    let mut bench = Bench::new(3);
    bench.controller.run_program(false);
    for _ in 0..5 {
        bench.cycle(&Order::Hold);
    }
    assert!(!bench.cycle(&Order::Move(moved(0.01))).unwrap().ready);
    assert!(bench.port.sent().is_empty());
    bench.controller.run_program(true);
    assert!(bench.cycle(&Order::Hold).unwrap().ready);
    assert_eq!(bench.port.sent().len(), 1);
}

#[test]
fn only_newest_status_is_answered_and_only_in_time() {
    let mut bench = Bench::new(3);
    bench.cycle(&Order::Hold);
    bench.cycle(&Order::Hold);
    bench.begin_cycle();
    bench.begin_cycle();
    bench.driver.receive(Nanos(0)).unwrap().unwrap();
    bench.driver.send(&Order::Hold).unwrap();
    bench.driver.send(&Order::Hold).unwrap();
    assert_eq!(bench.port.sent().len(), 1);
    assert_eq!(bench.driver.counters().unsent, 2);
    bench.begin_cycle();
    bench.driver.receive(Nanos(0)).unwrap().unwrap();
    bench.port.now_after(CYCLE);
    bench.driver.send(&Order::Hold).unwrap();
    assert!(bench.port.sent().is_empty());
}

#[test]
fn jumps_duplicates_and_silence_stop_the_controller() {
    let command = |sequence, degrees: f64| {
        let mut joints = [0.0; 9];
        joints[0] = START[0].to_degrees() + degrees;
        (1..6).for_each(|axis| joints[axis] = START[axis].to_degrees());
        FanucRequest::Command(FanucCommand { version: 3, sequence, last: false, joints }).packet()
    };
    for (case, packets) in
        [vec![command(9, 6.0)], vec![command(9, 1.0), command(9, 1.0)], vec![command(9, 1.0)]].into_iter().enumerate()
    {
        let mut controller = FanucController::new(CYCLE, 3);
        controller.take(Nanos(0), local(), FanucRequest::Start(3).packet().as_bytes(), &mut |_, _| {});
        controller.report(Nanos(0), &state_at(START, Nanos(0)), &mut |_, _| {});
        for packet in packets {
            controller.take(Nanos(0), local(), packet.as_bytes(), &mut |_, _| {});
        }
        assert_eq!(controller.fault().is_some(), case < 2);
        for _ in 0..5 {
            controller.report(Nanos(0), &state_at(START, Nanos(0)), &mut |_, _| {});
        }
        assert!(controller.fault().is_some());
    }
}

#[test]
fn one_client_at_a_time() {
    let (one, two) = (local(), peer());
    let start = FanucRequest::Start(3).packet();
    let command = |sequence| {
        let joints = std::array::from_fn(|axis| if axis < RAIL { START[axis].to_degrees() } else { 0.0 });
        FanucRequest::Command(FanucCommand { version: 3, sequence, last: false, joints }).packet()
    };
    let mut controller = FanucController::new(CYCLE, 3);
    let remote = std::sync::Arc::new(super::controller::Remote::default());
    remote.run_program(true);
    controller.obey(std::sync::Arc::clone(&remote));
    let mut now = Nanos(0);
    // Receiver of the next status.
    let status = |controller: &mut FanucController, now| {
        let mut to = None;
        controller.report(now, &state_at(START, now), &mut |address, _| to = Some(address));
        to
    };
    controller.take(now, one, start.as_bytes(), &mut |_, _| {});
    assert_eq!(status(&mut controller, now), Some(one));
    // Another client is ignored as long as the first one commands.
    for sequence in 1..=300 {
        now += CYCLE;
        controller.take(now, one, command(sequence).as_bytes(), &mut |_, _| {});
        controller.take(now, two, start.as_bytes(), &mut |_, _| {});
        controller.take(now, two, FanucRequest::Stop.packet().as_bytes(), &mut |_, _| {});
        assert_eq!(status(&mut controller, now), Some(one));
    }
    assert!(controller.has_client() && controller.fault().is_none());
    // Its remote session breaks, which ends the program: no client commands any more.
    remote.run_program(false);
    status(&mut controller, now);
    assert!(!controller.has_client());
    let mut held = START;
    held[0] += 0.2;
    controller.renew(held);
    assert_eq!(status(&mut controller, now), None);
    controller.take(now, two, start.as_bytes(), &mut |_, _| {});
    assert_eq!(status(&mut controller, now), Some(two));
    assert_eq!(controller.target(now), held);
}

#[test]
fn implausible_commands_are_not_sent() {
    let mut bench = Bench::new(3);
    bench.cycle(&Order::Hold);
    for (axis, bad) in [(0, f64::NAN), (3, f64::INFINITY), (2, 1e3), (RAIL, 0.1)] {
        bench.cycle(&Order::Hold);
        bench.port.answer(&mut bench.controller);
        let mut target = START;
        target[axis] = bad;
        assert!(matches!(bench.driver.send(&Order::Move(target)), Err(LinkFault::Unsendable(_))));
        assert!(bench.port.sent().is_empty());
    }
}

#[test]
fn dropping_the_driver_ends_the_stream() {
    let mut bench = Bench::new(3);
    for _ in 0..4 {
        bench.cycle(&Order::Hold);
    }
    bench.port.sent();
    drop(bench.driver);
    let sent: Vec<_> = bench.port.sent().iter().map(|(_, packet)| FanucRequest::read(packet)).collect();
    assert!(matches!(
        sent[..],
        [Some(FanucRequest::Command(FanucCommand { last: true, .. })), Some(FanucRequest::Stop)]
    ));
}

#[test]
fn different_cycle_is_a_mismatch() {
    let port = MemoryPort::default();
    let mut driver = FanucRobot::open(port.clone(), peer(), Nanos::from_millis(4)).unwrap();
    port.answer(&mut FanucController::new(CYCLE, 3));
    assert!(matches!(driver.receive(Nanos(0)), Err(LinkFault::Mismatch(_))));
}
