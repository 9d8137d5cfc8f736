//! FANUC Stream Motion: our driver against airo-fanuc's strict fake controller, and its client against our emulated one.

use super::{PythonPeer, Served, alone, assert_near, at_rest, loopback, now, numbers, serve_controller};
use softdock_realtime::protocol::fanuc::controller::FanucController;
use softdock_realtime::protocol::fanuc::driver::FanucRobot;
use softdock_realtime::protocol::fanuc::rmi::RmiSession;
use softdock_realtime::protocol::fanuc::rmi_server::RmiServer;
use softdock_realtime::protocol::{Controller, Outbox};
use softdock_realtime::signals::{AXES, Order, RAIL, Robot, RobotState};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use softdock_test_size::sized;
use std::f64::consts::TAU;
use std::net::SocketAddr;
use std::time::Duration;

const CYCLE: Nanos = Nanos::from_millis(8);
/// Where the fake controller starts \[deg\].
const START: [f64; RAIL] = [5.0, -30.0, 20.0, 0.0, -40.0, 10.0];
/// Amplitude of the motion \[deg\] and its period \[s\].
const SWING: f64 = 8.0;
const PERIOD: f64 = 6.0;

fn next(robot: &mut FanucRobot<UdpPort>) -> RobotState {
    for _ in 0..50 {
        if let Some(state) = robot.receive(now() + Nanos::from_millis(100)).unwrap() {
            return state;
        }
    }
    panic!("no status within five seconds");
}

/// A swing that begins and ends at rest.
fn target(start: &[f64; AXES], time: f64) -> [f64; AXES] {
    let swing = 0.5 * SWING.to_radians() * (1.0 - (TAU * time / PERIOD).cos());
    std::array::from_fn(|axis| if axis < RAIL { start[axis] + swing } else { 0.0 })
}

fn drive(version: &str, periods: f64) {
    let _alone = alone();
    let mut controller = PythonPeer::start("fanuc_controller.py", &[version]);
    let ports = controller.told();
    let address = |key| loopback(PythonPeer::port(&ports, key));
    let mut session = RmiSession::open(address("rmi"), Duration::from_secs(5)).unwrap();
    let mut robot = FanucRobot::open(UdpPort::bind(loopback(0)).unwrap(), address("stream"), CYCLE).unwrap();
    assert!(!next(&mut robot).ready);
    session.start_stream_program().unwrap();
    let mut state = next(&mut robot);
    while !state.ready {
        robot.send(&Order::Hold).unwrap();
        state = next(&mut robot);
    }
    let start = state.position;
    let (begin, mut worst) = (state.stamp, 0.0_f64);
    loop {
        let time = (state.stamp - begin).seconds();
        if time >= periods * PERIOD {
            break;
        }
        let wanted = target(&start, time);
        robot.send(&Order::Move(wanted)).unwrap();
        worst = worst.max((state.position[0] - wanted[0]).abs());
        state = next(&mut robot);
        assert!(state.ready);
    }
    for _ in 0..125 {
        robot.send(&Order::Hold).unwrap();
        next(&mut robot);
    }
    robot.send(&Order::End(target(&start, periods * PERIOD))).unwrap();
    next(&mut robot);
    let counters = robot.counters();
    drop(robot);
    std::thread::sleep(Duration::from_millis(50));
    let result = controller.end();
    println!(
        "FANUC version {version}: {:.0} s of motion, {counters:?}, worst lag {:.2} deg",
        periods * PERIOD,
        worst.to_degrees()
    );
    assert_eq!(result["violations"].as_array().map(Vec::len), Some(0), "{result}");
    assert_eq!(result["alarms"].as_array().map(Vec::len), Some(0), "{result}");
    assert!(result["error"].is_null(), "{result}");
    // It lags by 125 ms, 0.9 deg at the fastest, and is back where it began.
    assert_near(&numbers(&result["joints"])[..RAIL], &START, 0.05);
    assert!(worst.to_degrees() < 1.5);
    assert_eq!((counters.malformed, counters.foreign), (0, 0));
}

#[test]
#[ignore = "needs airo-fanuc: SOFTDOCK_PEER_PYTHON"]
fn our_driver_moves_the_strict_controller_without_a_violation() {
    drive("4", sized(1.0, 5.0));
}

#[test]
#[ignore = "needs airo-fanuc: SOFTDOCK_PEER_PYTHON"]
fn our_driver_speaks_the_older_version_too() {
    drive("3", 1.0);
}

/// The emulated controller with its Remote Motion Interface.
struct Armed {
    controller: FanucController,
    rmi: RmiServer,
}

impl Controller for Armed {
    fn cycle(&self) -> Nanos {
        self.controller.cycle()
    }

    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox) {
        self.controller.take(now, from, datagram, out);
    }

    fn target(&mut self, now: Nanos) -> [f64; AXES] {
        self.controller.target(now)
    }

    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox) {
        self.controller.run_program(self.rmi.program_runs());
        self.controller.report(now, state, out);
    }

    fn fault(&self) -> Option<&'static str> {
        self.controller.fault()
    }
}

#[test]
#[ignore = "needs airo-fanuc: SOFTDOCK_PEER_PYTHON"]
fn airo_fanuc_moves_our_controller() {
    let _alone = alone();
    let rmi = RmiServer::start(loopback(0)).unwrap();
    let port = UdpPort::bind(loopback(0)).unwrap();
    let stream = port.local_address().unwrap().port().to_string();
    let arming = rmi.local_address().port().to_string();
    let armed = Armed { controller: FanucController::new(CYCLE, 3), rmi };
    let start = std::array::from_fn(|axis| START.get(axis).map_or(0.0, |angle| angle.to_radians()));
    let served = Served::start(move |over| serve_controller(port, armed, at_rest(start), over));
    let told = PythonPeer::start("fanuc_client.py", &[&stream, &arming]).told();
    let end = served.end();
    assert_eq!(told["result"], "done", "{told}");
    let there: Vec<_> = START.iter().map(|angle| angle + 5.0).collect();
    assert_near(&numbers(&told["joints"]), &there, 0.01);
    let joints: Vec<_> = end.position[..RAIL].iter().map(|angle| angle.to_degrees()).collect();
    assert_near(&joints, &there, 0.01);
}
