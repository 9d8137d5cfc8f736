//! Fuzzes every parser of wire data with mutated messages: no panic, no hang, no implausible output.
//!
//! Mutations are seeded, so that a failure repeats. The drivers read from a port in memory and send commands in
//! between; the emulated devices are fed directly.

mod mutation;

use crate::protocol::egm::controller::{EgmController, EgmSettings};
use crate::protocol::egm::driver::EgmRobot;
use crate::protocol::egm::messages::SensorCommand;
use crate::protocol::fanuc::controller::FanucController;
use crate::protocol::fanuc::driver::FanucRobot;
use crate::protocol::fanuc::packets::{FanucCommand, FanucRequest};
use crate::protocol::memory::{MemoryPort, local, peer, state_at};
use crate::protocol::netft::calibration::NetFtCalibration;
use crate::protocol::netft::driver::{NetFt, NetFtSettings, OnSilence};
use crate::protocol::netft::rdt::{RdtCommand, RdtRecord, RdtRequest};
use crate::protocol::netft::sensor_box::NetBox;
use crate::protocol::rsi::codec::Sen;
use crate::protocol::rsi::controller::{Krc, KrcSettings};
use crate::protocol::rsi::driver::RsiRobot;
use crate::protocol::rsi::tags::TagMap;
use crate::protocol::{EmulatedController, SensorBox};
use crate::signals::{AXES, ForceSample, ForceSensor, MAX_EFFORT, Order, RAIL, RobotLink, RobotState, plausible};
use crate::time::Nanos;
use mutation::{Random, mutate};
use softdock_kernels::space::Wrench;
use std::time::{Duration, Instant};

/// Inputs per parser in every test run, and in the full one.
const FEW: u64 = 200_000;
const MANY: u64 = 10_000_000;

/// Longest time of an input: detects a hang, not a descheduled test.
const HANG: Duration = Duration::from_secs(2);

/// Inputs after which driver and device are created anew, so that a corrupted session does not mask later inputs.
const SESSION: u64 = 16;

const START: [f64; AXES] = [0.1, -1.5, 1.4, 0.0, 0.5, -0.3, 0.0];

/// Feeds `count` mutations of valid messages; `feed` returns whether one had an effect. Both results must be frequent:
/// otherwise the mutations are too weak or too strong to test anything.
fn fuzz(name: &str, count: u64, valid: &[Vec<u8>], mut feed: impl FnMut(u64, &[u8], &mut Random) -> bool) {
    let mut random = Random(0x5_0F7D_0CC5);
    let mut message = Vec::with_capacity(8192);
    let (begin, mut slowest, mut taken) = (Instant::now(), Duration::ZERO, 0);
    for index in 0..count {
        mutate(&mut message, valid, &mut random);
        let before = Instant::now();
        taken += u64::from(feed(index, &message, &mut random));
        slowest = slowest.max(before.elapsed());
    }
    assert!(slowest < HANG, "{name}: an input took {slowest:?}");
    assert!((count / 100..count - count / 100).contains(&taken), "{name}: {taken} of {count} inputs were taken");
    println!("{name}: {count} inputs, {taken} taken, in {:.1?}, slowest {slowest:?}", begin.elapsed());
}

fn assert_sound(state: &RobotState) {
    assert!(plausible(&state.position), "{state:?}");
    assert!(state.reported_set_point.is_none_or(|asked| plausible(&asked)), "{state:?}");
    assert!(state.torque.is_none_or(|torque| torque.iter().all(|value| value.abs() <= MAX_EFFORT)), "{state:?}");
    assert!(
        state.pose.is_none_or(|pose| pose.position.norm() < 1e4 && pose.attitude.v.norm() <= 1.0 + 1e-9),
        "{state:?}"
    );
}

/// Returns a command, sometimes an implausible one.
fn order(state: &RobotState, random: &mut Random) -> Order {
    let mut target = state.position;
    match random.below(8) {
        0 | 1 => Order::Hold,
        2 => {
            target[random.below(AXES)] = random.wild_number();
            Order::Move(target)
        }
        3 => Order::End(target),
        _ => Order::Move(target),
    }
}

/// Feeds a driver and checks its output: `sent` must accept every datagram.
fn feed_robot(
    robot: &mut impl RobotLink,
    port: &MemoryPort,
    datagram: &[u8],
    random: &mut Random,
    sent: impl Fn(&[u8]) -> bool,
) -> bool {
    port.now_after(Nanos::from_millis(8));
    port.deliver(peer(), datagram);
    let Ok(Some(state)) = robot.receive(Nanos(0)) else {
        port.sent();
        return false;
    };
    assert_sound(&state);
    let _ = robot.send(&order(&state, random));
    for (to, message) in port.sent() {
        assert!(to == peer() && sent(&message), "{}", String::from_utf8_lossy(&message));
    }
    true
}

/// Returns the messages of a controller's first cycles.
fn reports(controller: &mut dyn EmulatedController, count: usize) -> Vec<Vec<u8>> {
    let mut messages = Vec::new();
    for cycle in 0..count {
        let now = controller.cycle() * cycle as i64;
        controller.report(now, &state_at(START, now), &mut |_, datagram| messages.push(datagram.to_vec()));
    }
    messages
}

/// Feeds an emulated controller in a cycle, checks that its targets stay plausible, and returns whether they have
/// changed.
fn feed_controller(controller: &mut dyn EmulatedController, index: u64, datagram: &[u8]) -> bool {
    let now = controller.cycle() * index as i64;
    let before = controller.target(now);
    controller.take(now, local(), datagram, &mut |_, _| {});
    controller.report(now, &state_at(START, now), &mut |_, _| {});
    let target = controller.target(now + controller.cycle());
    assert!(plausible(&target), "{target:?}");
    target != before
}

fn rsi_reports(count: u64) {
    let tags = TagMap { torque: Some("GearTorque".to_owned()), ..TagMap::im_free().with_rail() };
    let mut krc = Krc::new(KrcSettings::new(tags.clone(), local()));
    let valid = reports(&mut krc, 20);
    let sound = |message: &[u8]| {
        Sen::read(message, &tags).is_ok_and(|sen| {
            // Offsets from a plausible start.
            let mut target = [0.0; AXES];
            (0..RAIL).for_each(|axis| target[axis] = sen.axes[axis].unwrap_or(f64::NAN).to_radians() * 0.5);
            target[RAIL] = sen.rail.unwrap_or(f64::NAN) * 0.5e-3;
            plausible(&target)
        })
    };
    let port = MemoryPort::default();
    let mut driver = RsiRobot::new(port.clone(), tags.clone(), None).unwrap();
    fuzz("RSI reports", count, &valid, |index, datagram, random| {
        if index % SESSION == 0 {
            driver = RsiRobot::new(port.clone(), tags.clone(), None).unwrap();
            // Half of the sessions begin with a valid message.
            if index % (2 * SESSION) == 0 {
                feed_robot(&mut driver, &port, &valid[0], random, sound);
            }
        }
        feed_robot(&mut driver, &port, datagram, random, sound)
    });
}

fn rsi_answers(count: u64) {
    let tags = TagMap::kroshu().with_rail();
    let settings = KrcSettings { hold_on: false, ..KrcSettings::new(tags.clone(), local()) };
    let mut valid = Vec::new();
    for step in 0..SESSION {
        let axes = [Some(0.25 * step as f64); 6];
        let sen = Sen { axes, rail: Some(-1.5), stop: false, ipoc: settings.first_ipoc };
        let mut message = crate::protocol::text::Text::new();
        sen.write(&tags, &mut message).unwrap();
        valid.push(message.as_bytes().to_vec());
    }
    fuzz("RSI answers", count, &valid, |_, datagram, _| {
        // An answer must repeat the IPOC: each input meets the cycle that it answers.
        let mut krc = Krc::new(settings.clone());
        feed_controller(&mut krc, 0, &[]);
        feed_controller(&mut krc, 1, datagram)
    });
}

fn net_ft_records(count: u64) {
    let calibration = NetFtCalibration::new(1e6, 1e6).unwrap();
    let settings = NetFtSettings {
        on_silence: OnSilence::Request,
        ..NetFtSettings::new(peer(), calibration, Nanos::from_millis(1))
    };
    let record = |step: u32| RdtRecord { rdt_sequence: step, ft_sequence: 7 * step, status: 0, counts: [1000; 6] };
    let valid: Vec<_> = (1..20).map(|step| record(step).bytes().to_vec()).collect();
    let port = MemoryPort::default();
    let mut driver = NetFt::start(port.clone(), settings.clone()).unwrap();
    fuzz("Net F/T records", count, &valid, |index, datagram, _| {
        if index % SESSION == 0 {
            driver = NetFt::start(port.clone(), settings.clone()).unwrap();
        }
        port.deliver(peer(), datagram);
        let sample = driver.latest().ok().flatten();
        if let Some(sample) = sample {
            let wrench = sample.wrench;
            assert!(wrench.force.norm() < 2.0 * MAX_EFFORT && wrench.moment.norm() < 2.0 * MAX_EFFORT, "{sample:?}");
        }
        assert!(port.sent().iter().all(|(_, message)| RdtRequest::read(message).is_some()));
        sample.is_some()
    });
}

fn net_ft_requests(count: u64) {
    let sample = ForceSample::new(Nanos(0), 0, Wrench::zero());
    let commands = [
        RdtCommand::Stop,
        RdtCommand::Stream,
        RdtCommand::StreamBuffered,
        RdtCommand::Bias,
        RdtCommand::ResetThresholds,
    ];
    let valid: Vec<_> = commands.map(|command| RdtRequest { command, count: 3 }.bytes().to_vec()).into();
    let mut sensor = NetBox::new(NetFtCalibration::new(1e6, 1e6).unwrap(), Nanos::from_millis(1));
    fuzz("Net F/T requests", count, &valid, |_, datagram, _| {
        sensor.take(Nanos(0), local(), datagram, &mut |_, _| {});
        let mut sent = false;
        sensor.report(Nanos(0), &sample, &mut |_, record| sent = RdtRecord::read(record).is_some());
        sent
    });
}

fn net_ft_calibrations(count: u64) {
    let units = [("N", "Nm"), ("lbf", "lbf-in"), ("kN", "kNm")];
    let valid = units.map(|(force, moment)| {
        NetFtCalibration::with_units("Net F/T", 1e6, 2e5, force, moment).unwrap().to_xml().into_bytes()
    });
    fuzz("Net F/T calibrations", count, &valid, |_, xml, _| {
        let calibration = NetFtCalibration::from_xml(&String::from_utf8_lossy(xml)).ok();
        let counts = [i32::MAX, i32::MIN, 1, i32::MAX, i32::MIN, -1];
        if let Some(wrench) = calibration.as_ref().and_then(|calibration| calibration.wrench(counts)) {
            assert!(wrench.force.norm() < 2.0 * MAX_EFFORT && wrench.moment.norm() < 2.0 * MAX_EFFORT);
        }
        calibration.is_some()
    });
}

fn fanuc_replies(count: u64) {
    let cycle = Nanos::from_millis(8);
    let mut capability = Vec::new();
    let mut valid = Vec::new();
    for version in [3, 4] {
        let mut controller = FanucController::new(cycle, version);
        for request in [FanucRequest::Capability, FanucRequest::Start(version)] {
            let packet = request.packet();
            controller.take(Nanos(0), local(), packet.as_bytes(), &mut |_, reply| capability = reply.to_vec());
        }
        valid.extend(reports(&mut controller, 10));
        valid.push(capability.clone());
    }
    let sound = |message: &[u8]| match FanucRequest::read(message) {
        Some(FanucRequest::Command(command)) => {
            let mut target = [0.0; AXES];
            (0..RAIL).for_each(|axis| target[axis] = command.joints[axis].to_radians());
            plausible(&target) && command.joints[RAIL..].iter().all(|&angle| angle == 0.0)
        }
        request => request.is_some(),
    };
    let port = MemoryPort::default();
    let mut driver = FanucRobot::open(port.clone(), peer(), cycle).unwrap();
    fuzz("FANUC replies", count, &valid, |index, datagram, random| {
        if index % SESSION == 0 {
            driver = FanucRobot::open(port.clone(), peer(), cycle).unwrap();
            if index % (4 * SESSION) != 0 {
                feed_robot(&mut driver, &port, &capability, random, sound);
            }
        }
        feed_robot(&mut driver, &port, datagram, random, sound)
    });
}

fn fanuc_requests(count: u64) {
    let joints = std::array::from_fn(|axis| START.get(axis).map_or(0.0, |angle| angle.to_degrees()));
    let command = |sequence| {
        let mut joints: [f64; 9] = joints;
        joints[0] += 0.1 * f64::from(sequence);
        let command = FanucCommand { version: 3, sequence, last: sequence == 9, joints };
        FanucRequest::Command(command)
    };
    let mut valid: Vec<_> = (1..20).map(|sequence| command(sequence).packet().as_bytes().to_vec()).collect();
    for request in [FanucRequest::Stop, FanucRequest::Capability, FanucRequest::Start(3)] {
        valid.push(request.packet().as_bytes().to_vec());
    }
    let mut controller = FanucController::new(Nanos::from_millis(8), 3);
    fuzz("FANUC requests", count, &valid, |index, datagram, _| {
        if index % SESSION == 0 {
            controller = FanucController::new(Nanos::from_millis(8), 3);
            feed_controller(&mut controller, 0, FanucRequest::Start(3).packet().as_bytes());
        }
        feed_controller(&mut controller, 1 + index % SESSION, datagram)
    });
}

fn egm_settings() -> EgmSettings {
    EgmSettings { rail: true, ..EgmSettings::new(local()) }
}

fn egm_reports(count: u64) {
    let mut controller = EgmController::new(egm_settings());
    controller.set_force(Some(Wrench::zero()));
    let valid = reports(&mut controller, 20);
    let sound = |message: &[u8]| {
        SensorCommand::read(message).is_ok_and(|command| {
            let mut target = [0.0; AXES];
            let joints = command.planned.joints;
            joints.as_slice().iter().zip(&mut target).for_each(|(angle, axis)| *axis = angle.to_radians());
            target[RAIL] = command.planned.external.as_slice()[0] * 1e-3;
            joints.as_slice().len() == RAIL && plausible(&target)
        })
    };
    let port = MemoryPort::default();
    let make = || EgmRobot::new(port.clone(), Nanos::from_millis(4), true, None);
    let mut driver = make();
    fuzz("EGM reports", count, &valid, |index, datagram, random| {
        if index % SESSION == 0 {
            driver = make();
        }
        feed_robot(&mut driver, &port, datagram, random, sound)
    });
}

fn egm_commands(count: u64) {
    let mut controller = EgmController::new(egm_settings());
    let port = MemoryPort::default();
    let mut driver = EgmRobot::new(port.clone(), Nanos::from_millis(4), true, None);
    let mut valid = Vec::new();
    for step in 0..16 {
        port.report(&mut controller, &state_at(START, Nanos(0)));
        driver.receive(Nanos(0)).unwrap();
        driver.send(&Order::Move(START.map(|axis| axis + 1e-3 * f64::from(step)))).unwrap();
        valid.extend(port.sent().into_iter().map(|(_, message)| message));
    }
    fuzz("EGM commands", count, &valid, |index, datagram, _| {
        if index % SESSION == 0 {
            controller = EgmController::new(egm_settings());
            feed_controller(&mut controller, 0, &[]);
        }
        feed_controller(&mut controller, 1 + index % SESSION, datagram)
    });
}

/// Defines a test of each parser at both sizes.
macro_rules! fuzz_tests {
    ($($parser:ident)*) => {
        mod few {
            $(#[test]
            fn $parser() {
                super::$parser(super::FEW);
            })*
        }
        mod many {
            $(#[test]
            #[ignore = "ten million inputs: cargo test --release -p softdock-realtime many -- --ignored --nocapture"]
            fn $parser() {
                super::$parser(super::MANY);
            })*
        }
    };
}

fuzz_tests! {
    rsi_reports rsi_answers
    net_ft_records net_ft_requests net_ft_calibrations
    fanuc_replies fanuc_requests
    egm_reports egm_commands
}
