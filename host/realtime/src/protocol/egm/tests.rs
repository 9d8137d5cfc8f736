//! Driver against emulated robot, cycle by cycle.

use super::controller::{EgmController, EgmSettings};
use super::driver::EgmRobot;
use super::messages::{EgmAxes, EgmMotion, RobotReport, SensorCommand};
use crate::protocol::EmulatedController;
use crate::protocol::memory::{MemoryPort, local, peer, state_at};
use crate::signals::{AXES, LinkFault, Order, RAIL, RobotLink, RobotState};
use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;

const CYCLE: Nanos = Nanos::from_millis(4);
const START: [f64; AXES] = [0.1, -1.5, 1.4, 0.0, 0.5, -0.3, 1.2];

struct Bench {
    port: MemoryPort,
    controller: EgmController,
    driver: EgmRobot<MemoryPort>,
    measured: [f64; AXES],
}

impl Bench {
    fn new(change: impl FnOnce(&mut EgmSettings)) -> Self {
        let mut settings = EgmSettings { rail: true, ..EgmSettings::new(local()) };
        change(&mut settings);
        let port = MemoryPort::default();
        let driver = EgmRobot::new(port.clone(), CYCLE, settings.rail, Some(peer().ip()));
        Self { port, controller: EgmController::new(settings), driver, measured: START }
    }

    fn begin_cycle(&mut self) {
        let now = self.port.now_after(CYCLE);
        if now.0 > CYCLE.0 {
            self.measured = self.controller.target(now);
        }
        self.port.report(&mut self.controller, &state_at(self.measured, now));
    }

    fn cycle(&mut self, order: &Order) -> Option<RobotState> {
        self.begin_cycle();
        let state = self.driver.receive(Nanos(0)).unwrap();
        self.driver.send(order).unwrap();
        self.port.answer(&mut self.controller);
        state
    }
}

fn moved(by: f64) -> [f64; AXES] {
    std::array::from_fn(|axis| START[axis] + by * (1.0 + axis as f64))
}

fn assert_near(a: [f64; AXES], b: [f64; AXES]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12), "{a:?} {b:?}");
}

#[test]
fn robot_follows_holds_and_ends_by_convergence() {
    let mut bench = Bench::new(|settings| settings.settled = Some(Nanos::from_millis(1500)));
    for _ in 0..5 {
        assert!(bench.cycle(&Order::Hold).unwrap().ready);
    }
    assert_near(bench.measured, START);
    for step in 1..=100 {
        bench.cycle(&Order::Move(moved(1e-3 * f64::from(step)))).unwrap();
    }
    for _ in 0..5 {
        bench.cycle(&Order::Hold).unwrap();
    }
    assert_near(bench.measured, moved(0.1));
    bench.cycle(&Order::End(moved(0.1))).unwrap();
    for _ in 0..500 {
        assert!(!bench.cycle(&Order::Move(moved(1.0))).unwrap().ready);
    }
    assert_eq!(bench.controller.fault(), Some("EGM has converged"));
    assert_near(bench.measured, moved(0.1));
    let counters = bench.driver.counters();
    assert_eq!((counters.lost, counters.unsent, counters.malformed), (0, 0, 0));
}

#[test]
fn robot_moved_before_following_is_held_at_its_position() {
    let port = MemoryPort::default();
    let mut driver = EgmRobot::new(port.clone(), CYCLE, false, None);
    for (sequence, running, angle) in [(0, false, 10.0), (1, false, 20.0), (2, true, 20.0), (3, true, 20.1)] {
        let motion = EgmMotion { joints: EgmAxes::of(&[angle; 6]), ..EgmMotion::default() };
        let report = RobotReport {
            sequence,
            feedback: motion,
            planned: motion,
            motors_on: true,
            running,
            rapid_running: true,
            ..RobotReport::default()
        };
        port.deliver(peer(), report.message().as_bytes().unwrap());
        driver.receive(Nanos(0)).unwrap().unwrap();
        driver.send(&Order::Hold).unwrap();
    }
    let sent = port.sent();
    let held =
        sent.iter().map(|(_, message)| SensorCommand::read(message).unwrap().planned.joints.as_slice()[0].round());
    assert_eq!(held.collect::<Vec<_>>(), [10.0, 20.0, 20.0, 20.0]);
}

#[test]
fn session_ends_without_targets() {
    let mut bench = Bench::new(|_| {});
    bench.cycle(&Order::Hold).unwrap();
    for _ in 0..252 {
        bench.begin_cycle();
    }
    assert_eq!(bench.controller.fault(), Some("CommTimeout: no more targets"));
    assert!(!bench.cycle(&Order::Hold).unwrap().ready);
}

#[test]
fn only_newest_report_is_answered_and_only_in_time() {
    let mut bench = Bench::new(|_| {});
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
fn lost_old_and_foreign_datagrams_are_counted() {
    let mut bench = Bench::new(|_| {});
    bench.cycle(&Order::Hold);
    let mut old = None;
    bench.controller.report(Nanos(0), &state_at(START, Nanos(0)), &mut |_, datagram| old = Some(datagram.to_vec()));
    let old = old.unwrap();
    bench.cycle(&Order::Hold).unwrap();
    bench.port.deliver(peer(), &old);
    bench.port.deliver(peer(), &old[1..]);
    bench.port.deliver("192.168.1.9:6510".parse().unwrap(), &old);
    assert_eq!(bench.driver.receive(Nanos(0)), Ok(None));
    let counters = bench.driver.counters();
    assert_eq!((counters.lost, counters.stale, counters.malformed, counters.foreign), (1, 1, 1, 1));
}

#[test]
fn implausible_commands_are_not_sent() {
    let mut bench = Bench::new(|settings| settings.rail = false);
    bench.measured[RAIL] = 0.0;
    for (axis, bad) in [(0, f64::NAN), (3, f64::INFINITY), (2, 1e3), (RAIL, 0.1)] {
        bench.begin_cycle();
        bench.driver.receive(Nanos(0)).unwrap().unwrap();
        let mut target = START;
        target[RAIL] = 0.0;
        target[axis] = bad;
        assert!(matches!(bench.driver.send(&Order::Move(target)), Err(LinkFault::Unsendable(_))));
        assert!(bench.port.sent().is_empty());
    }
}

#[test]
fn robot_force_is_reported() {
    let mut controller = EgmController::new(EgmSettings::new(local()));
    controller.set_force(Some(Wrench { force: vec3(1.0, 2.0, 3.0), moment: vec3(4.0, 5.0, 6.0) }));
    let mut force = None;
    controller.report(Nanos(0), &state_at(START, Nanos(0)), &mut |_, datagram| {
        force = Some(RobotReport::read(datagram).unwrap().force);
    });
    assert_eq!(force.unwrap().as_slice(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}
