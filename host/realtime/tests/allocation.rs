//! Drivers and emulated devices allocate nothing in a cycle, over sockets.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use softdock_kernels::space::Wrench;
use softdock_realtime::protocol::egm::controller::{EgmController, EgmSettings};
use softdock_realtime::protocol::egm::driver::EgmRobot;
use softdock_realtime::protocol::fanuc::controller::FanucController;
use softdock_realtime::protocol::fanuc::driver::FanucRobot;
use softdock_realtime::protocol::netft::calibration::NetFtCalibration;
use softdock_realtime::protocol::netft::driver::{NetFt, NetFtSettings, OnSilence};
use softdock_realtime::protocol::netft::sensor_box::NetBox;
use softdock_realtime::protocol::rsi::controller::{Krc, KrcSettings};
use softdock_realtime::protocol::rsi::driver::RsiRobot;
use softdock_realtime::protocol::rsi::tags::{Correction, TagMap};
use softdock_realtime::protocol::{EmulatedController, SensorBox};
use softdock_realtime::signals::{AXES, ForceSample, ForceSensor, Order, RobotLink, RobotState};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::{MAX_DATAGRAM, Port, udp::UdpPort};
use std::net::SocketAddr;

/// Aborts the test at a forbidden allocation.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const CYCLES: usize = 200;
const START: [f64; AXES] = [0.1, -0.5, 0.4, 0.0, 0.5, -0.3, 0.0];

fn bind() -> (UdpPort, SocketAddr) {
    let port = UdpPort::bind(SocketAddr::from(([127, 0, 0, 1], 0))).unwrap();
    let address = port.local_address().unwrap();
    (port, address)
}

fn soon(port: &UdpPort) -> Nanos {
    port.now() + Nanos::from_millis(200)
}

/// Takes the waiting datagrams.
fn take_all(port: &mut UdpPort, mut take: impl FnMut(&mut UdpPort, SocketAddr, &[u8])) {
    let mut buffer = [0; MAX_DATAGRAM];
    while let Some((length, from)) = port.receive(&mut buffer, Nanos(0)).unwrap() {
        take(port, from, &buffer[..length]);
    }
}

/// Runs cycles of a robot with the controller at `port`.
fn run(robot: &mut impl RobotLink, controller: &mut impl EmulatedController, port: &mut UdpPort) {
    let state = RobotState {
        stamp: Nanos(0),
        received: Nanos(0),
        position: START,
        reported_set_point: Some(START),
        torque: Some([0.0; AXES]),
        pose: None,
        late_answers: 0,
        ready: true,
    };
    let mut received = 0;
    for cycle in 0..CYCLES {
        received += usize::from(assert_no_alloc(|| run_cycle(robot, controller, port, &state, cycle)));
    }
    assert!(received > CYCLES / 2, "only {received} cycles");
}

/// Runs a cycle of both; returns whether the robot has received a report.
fn run_cycle(
    robot: &mut impl RobotLink,
    controller: &mut impl EmulatedController,
    port: &mut UdpPort,
    state: &RobotState,
    cycle: usize,
) -> bool {
    let now = port.now();
    take_all(port, |port, from, datagram| {
        controller.take(now, from, datagram, &mut |to, reply| port.send(reply, to).unwrap());
    });
    controller.report(now, state, &mut |to, datagram| port.send(datagram, to).unwrap());
    let report = robot.receive(soon(port)).unwrap();
    if let Some(state) = &report {
        let target = state.position.map(|axis| axis + 1e-6);
        let order = if cycle.is_multiple_of(2) { Order::Hold } else { Order::Move(target) };
        // A late cycle may refuse the command: that must not allocate either.
        let _ = robot.send(&order);
    }
    report.is_some()
}

#[test]
fn robots() {
    for mode in [Correction::Absolute, Correction::Relative] {
        let tags = TagMap { mode, torque: Some("GearTorque".to_owned()), ..TagMap::im_free().with_rail() };
        let ((ours, client), (mut theirs, _)) = (bind(), bind());
        let mut krc = Krc::new(KrcSettings::new(tags.clone(), client));
        let mut robot = RsiRobot::new(ours, tags, None).unwrap();
        run(&mut robot, &mut krc, &mut theirs);
    }
    let ((ours, client), (mut theirs, _)) = (bind(), bind());
    let mut controller = EgmController::new(EgmSettings { rail: true, ..EgmSettings::new(client) });
    let mut robot = EgmRobot::new(ours, Nanos::from_millis(4), true, None);
    run(&mut robot, &mut controller, &mut theirs);

    let ((ours, _), (mut theirs, address)) = (bind(), bind());
    let mut controller = FanucController::new(Nanos::from_millis(8), 4);
    let mut robot = FanucRobot::open(ours, address, Nanos::from_millis(8)).unwrap();
    run(&mut robot, &mut controller, &mut theirs);
}

#[test]
fn force_sensor() {
    let ((ours, _), (mut theirs, address)) = (bind(), bind());
    let calibration = NetFtCalibration::new(1e6, 1e6).unwrap();
    let period = Nanos::from_millis(1);
    let mut sensor = NetBox::new(calibration.clone(), period);
    let settings = NetFtSettings { on_silence: OnSilence::Request, ..NetFtSettings::new(address, calibration, period) };
    let mut driver = NetFt::start(ours, settings).unwrap();
    let sample = ForceSample::new(Nanos(0), 0, Wrench::zero());
    let mut received = 0;
    for _ in 0..CYCLES {
        received += assert_no_alloc(|| {
            take_all(&mut theirs, |_, from, datagram| sensor.take(Nanos(0), from, datagram, &mut |_, _| {}));
            sensor.report(Nanos(0), &sample, &mut |to, datagram| theirs.send(datagram, to).unwrap());
            usize::from(driver.latest().unwrap().is_some())
        });
    }
    assert!(received > CYCLES / 2, "only {received} samples");
}
