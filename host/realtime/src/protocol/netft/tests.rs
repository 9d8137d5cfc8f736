//! Driver against emulated box, period by period.

use super::calibration::NetFtCalibration;
use super::driver::{NetFt, NetFtSettings, OnSilence};
use super::rdt::{RdtCommand, RdtRecord, RdtRequest, STATUS_ERROR, STATUS_SATURATED};
use super::sensor_box::NetBox;
use crate::protocol::SensorBox;
use crate::protocol::memory::{MemoryPort, peer};
use crate::signals::{ForceSample, ForceSensor, LinkFault};
use crate::time::Nanos;
use crate::wire::Port;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;

const PERIOD: Nanos = Nanos::from_millis(1);

fn sample(force: f64) -> ForceSample {
    let wrench = Wrench { force: vec3(force, 0.0, -2.0 * force), moment: vec3(0.0, 0.1 * force, 0.0) };
    ForceSample::new(Nanos(0), 0, wrench)
}

struct Bench {
    port: MemoryPort,
    sensor: NetBox,
    driver: NetFt<MemoryPort>,
}

impl Bench {
    fn new(on_silence: OnSilence) -> Self {
        let port = MemoryPort::default();
        let calibration = NetFtCalibration::new(1e6, 1e6).unwrap();
        let settings = NetFtSettings { on_silence, ..NetFtSettings::new(peer(), calibration.clone(), PERIOD) };
        let sensor = NetBox::new(calibration, PERIOD);
        Self { driver: NetFt::start(port.clone(), settings).unwrap(), sensor, port }
    }

    /// Runs a period: requests arrive; the box sends its measurement, if `delivered`.
    fn period(&mut self, sample: &ForceSample, delivered: bool) {
        let now = self.port.now() + PERIOD;
        self.port.set_now(now);
        self.port.answer_sensor(&mut self.sensor);
        let port = self.port.clone();
        self.sensor.report(now, sample, &mut |_, record| {
            if delivered {
                port.deliver(peer(), record);
            }
        });
    }

    fn deliver(&self, rdt_sequence: u32, ft_sequence: u32, status: u32) {
        self.port.deliver(peer(), &RdtRecord { rdt_sequence, ft_sequence, status, counts: [1; 6] }.bytes());
    }
}

#[test]
fn wrench_is_si() {
    let mut bench = Bench::new(OnSilence::Stop);
    for step in 1..=50 {
        bench.period(&sample(f64::from(step)), true);
        let taken = bench.driver.latest().unwrap().unwrap();
        let error = taken.wrench - sample(f64::from(step)).wrench;
        assert!(error.force.norm() < 2e-6 && error.moment.norm() < 2e-6);
    }
    let counters = bench.driver.counters();
    assert_eq!((counters.received, counters.lost), (50, 0));
}

#[test]
fn newest_record_is_taken_and_earlier_error_is_reported() {
    let mut bench = Bench::new(OnSilence::Stop);
    let saturated = ForceSample { saturated: true, ..sample(9.0) };
    bench.period(&saturated, true);
    bench.period(&sample(1.0), true);
    let taken = bench.driver.latest().unwrap().unwrap();
    assert!((taken.wrench.force.x - 1.0).abs() < 1e-6);
    assert!(taken.saturated && !taken.invalid);
    assert_eq!(bench.driver.latest(), Ok(None));
}

#[test]
fn lost_and_foreign_datagrams_are_counted() {
    let mut bench = Bench::new(OnSilence::Stop);
    // Past the time in which the count may restart.
    for _ in 0..101 {
        bench.period(&sample(1.0), true);
        bench.driver.latest().unwrap();
    }
    bench.period(&sample(1.0), false);
    bench.period(&sample(1.0), false);
    bench.period(&sample(1.0), true);
    bench.port.deliver("192.168.1.2:5".parse().unwrap(), &[0; 36]);
    bench.port.deliver(peer(), &[0; 35]);
    bench.deliver(104, 10_000, 0);
    bench.deliver(104 + 200_000, 10_000, 0);
    bench.driver.latest().unwrap().unwrap();
    let counters = bench.driver.counters();
    assert_eq!((counters.lost, counters.foreign, counters.malformed, counters.stale), (2, 1, 2, 1));
}

#[test]
fn silence_stops_an_armed_session() {
    let mut bench = Bench::new(OnSilence::Stop);
    bench.period(&sample(1.0), true);
    bench.driver.latest().unwrap().unwrap();
    for _ in 0..3 {
        bench.period(&sample(1.0), false);
        assert_eq!(bench.driver.latest(), Ok(None));
    }
    bench.period(&sample(1.0), false);
    assert!(matches!(bench.driver.latest(), Err(LinkFault::Stopped(_))));
}

#[test]
fn dry_run_requests_a_lost_stream_again() {
    let mut bench = Bench::new(OnSilence::Request);
    bench.period(&sample(1.0), true);
    bench.driver.latest().unwrap().unwrap();
    let thief = "192.168.1.7:40000".parse().unwrap();
    bench.sensor.take(Nanos(0), thief, &RdtRequest { command: RdtCommand::Stream, count: 0 }.bytes(), &mut |_, _| {});
    let mut silent = 0;
    while bench.driver.latest().unwrap().is_none() {
        let ours = bench.sensor.client() != Some(thief);
        bench.period(&sample(1.0), ours);
        silent += 1;
        assert!(silent < 10);
    }
    assert_ne!(bench.sensor.client(), Some(thief));
    bench.period(&sample(2.0), true);
    assert!(bench.driver.latest().unwrap().is_some());
}

#[test]
fn stall_is_invalid_and_restart_is_a_fault() {
    let mut bench = Bench::new(OnSilence::Request);
    bench.port.set_now(Nanos::from_millis(200));
    bench.deliver(u32::MAX, 700, 0);
    assert!(!bench.driver.latest().unwrap().unwrap().invalid);
    bench.deliver(0, 707, 0);
    assert!(!bench.driver.latest().unwrap().unwrap().invalid);
    bench.deliver(1, 707, 0);
    assert!(bench.driver.latest().unwrap().unwrap().invalid);
    bench.deliver(2, 714, STATUS_SATURATED | STATUS_ERROR);
    assert!(bench.driver.latest().unwrap().unwrap().saturated);
    assert_eq!(bench.driver.counters().lost, 0);
    bench.deliver(3, 7, 0);
    assert!(matches!(bench.driver.latest(), Err(LinkFault::Stopped(_))));
}

#[test]
fn bias_command_zeroes_the_load() {
    let mut bench = Bench::new(OnSilence::Stop);
    bench.driver.bias().unwrap();
    bench.period(&sample(5.0), true);
    bench.period(&sample(6.0), true);
    let taken = bench.driver.latest().unwrap().unwrap();
    assert!((taken.wrench.force.x - 1.0).abs() < 1e-6);
}

#[test]
fn requested_count_ends_the_stream() {
    let mut sensor = NetBox::new(NetFtCalibration::new(1e6, 1e6).unwrap(), PERIOD);
    sensor.take(Nanos(0), peer(), &RdtRequest { command: RdtCommand::Stream, count: 2 }.bytes(), &mut |_, _| {});
    let mut sent = 0;
    for _ in 0..5 {
        sensor.report(Nanos(0), &sample(1.0), &mut |_, _| sent += 1);
    }
    assert_eq!(sent, 2);
}
