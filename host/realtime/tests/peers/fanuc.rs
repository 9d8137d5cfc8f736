//! FANUC Stream Motion: our driver against airo-fanuc's strict fake controller, and its client against our emulated one.

use super::{PythonPeer, Served, alone, assert_near, at_rest, loopback, now, numbers, serve_controller};
use softdock_realtime::protocol::fanuc::armed::ArmedFanuc;
use softdock_realtime::protocol::fanuc::controller::FanucController;
use softdock_realtime::protocol::fanuc::driver::FanucRobot;
use softdock_realtime::protocol::fanuc::rmi_server::RmiServer;
use softdock_realtime::signals::{AXES, Order, RAIL, RobotLink, RobotState};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use softdock_test_size::sized;
use std::f64::consts::TAU;
use std::time::Duration;

const CYCLE: Nanos = Nanos::from_millis(8);
/// Start of the fake controller \[deg\].
const START: [f64; RAIL] = [5.0, -30.0, 20.0, 0.0, -40.0, 10.0];
/// Amplitude of the motion \[deg\] and its period \[s\].
const SWING: f64 = 8.0;
const PERIOD: f64 = 6.0;

fn next(robot: &mut ArmedFanuc<UdpPort>) -> RobotState {
    for _ in 0..50 {
        if let Some(state) = robot.receive(now() + Nanos::from_millis(100)).unwrap() {
            return state;
        }
    }
    panic!("no status within five seconds");
}

/// A swing from rest to rest.
fn target(start: &[f64; AXES], time: f64) -> [f64; AXES] {
    let swing = 0.5 * SWING.to_radians() * (1.0 - (TAU * time / PERIOD).cos());
    std::array::from_fn(|axis| if axis < RAIL { start[axis] + swing } else { 0.0 })
}

fn drive(version: &str, periods: f64) {
    let _alone = alone();
    let mut controller = PythonPeer::start("fanuc_controller.py", &[version]);
    let ports = controller.next_line();
    let address = |key| loopback(PythonPeer::port(&ports, key));
    let robot = FanucRobot::open(UdpPort::bind(loopback(0)).unwrap(), address("stream"), CYCLE).unwrap();
    let mut robot = ArmedFanuc::arm(robot, address("rmi"), Duration::from_secs(5)).unwrap();
    let mut state = next(&mut robot);
    assert!(state.ready);
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
    // The lag is 125 ms, 0.9 deg at the greatest speed; the motion ends at its start.
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
fn our_driver_supports_the_older_version() {
    drive("3", 1.0);
}

/// Arms against a fake controller with a fault; returns the error, and the controller's result.
fn refused_by(trouble: &str) -> String {
    let mut controller = PythonPeer::start("fanuc_controller.py", &["4", trouble]);
    let ports = controller.next_line();
    let address = |key| loopback(PythonPeer::port(&ports, key));
    let robot = FanucRobot::open(UdpPort::bind(loopback(0)).unwrap(), address("stream"), CYCLE).unwrap();
    let error = ArmedFanuc::arm(robot, address("rmi"), Duration::from_secs(1)).err().expect(trouble).to_string();
    let result = controller.end();
    println!("{trouble}: {error}");
    assert_eq!(result["violations"].as_array().map(Vec::len), Some(0), "{result}");
    assert_near(&numbers(&result["joints"])[..RAIL], &START, 1e-6);
    error
}

#[test]
#[ignore = "needs airo-fanuc: SOFTDOCK_PEER_PYTHON"]
fn refusals_quote_the_strict_controller() {
    let _alone = alone();
    let error = refused_by("estop");
    assert!(error.contains("its servos are off: SRVO-001 Operator panel E-stop"), "{error}");
    assert!(refused_by("teach").contains("teach pendant is on"));
    let error = refused_by("state");
    assert!(error.contains("refuses FRC_Initialize with error 2556943: Invalid Controller State"), "{error}");
    assert!(refused_by("program").contains("is not ready for commands"));
}

#[test]
#[ignore = "needs airo-fanuc: SOFTDOCK_PEER_PYTHON"]
fn airo_fanuc_moves_our_controller() {
    let _alone = alone();
    let rmi = RmiServer::start(loopback(0)).unwrap();
    let port = UdpPort::bind(loopback(0)).unwrap();
    let stream = port.local_address().unwrap().port().to_string();
    let arming = rmi.local_address().port().to_string();
    let mut controller = FanucController::new(CYCLE, 3);
    controller.obey(rmi.remote());
    let start = std::array::from_fn(|axis| START.get(axis).map_or(0.0, |angle| angle.to_radians()));
    let served = Served::start(move |over| serve_controller(port, controller, at_rest(start), over));
    let result = PythonPeer::start("fanuc_client.py", &[&stream, &arming]).next_line();
    let end = served.end();
    assert_eq!(result["result"], "done", "{result}");
    let there: Vec<_> = START.iter().map(|angle| angle + 5.0).collect();
    assert_near(&numbers(&result["joints"]), &there, 0.01);
    let joints: Vec<_> = end.position[..RAIL].iter().map(|angle| angle.to_degrees()).collect();
    assert_near(&joints, &there, 0.01);
}
