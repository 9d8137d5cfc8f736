//! Net F/T: our driver against pynetft's fake sensor; the clients pynetft and NetFT against our emulated box.

use super::{PythonPeer, Served, alone, assert_near, loopback, numbers, serve_sensor};
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::vec3;
use softdock_realtime::protocol::netft::RDT_PORT;
use softdock_realtime::protocol::netft::calibration::NetFtCalibration;
use softdock_realtime::protocol::netft::driver::{NetFt, NetFtSettings, OnSilence};
use softdock_realtime::protocol::netft::http::{CalibrationServer, fetch_calibration};
use softdock_realtime::protocol::netft::sensor_box::NetBox;
use softdock_realtime::signals::{ForceSample, ForceSensor};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use std::net::SocketAddr;
use std::time::Duration;

const POUND: f64 = 4.448_221_615_260_5;

/// Returns the next sample of a driver.
fn wait_for_sample(driver: &mut NetFt<UdpPort>) -> ForceSample {
    for _ in 0..2000 {
        if let Some(sample) = driver.latest().unwrap() {
            return sample;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("no sample within two seconds");
}

#[test]
#[ignore = "needs pynetft's fake sensor: SOFTDOCK_PEER_PYTHON"]
fn our_driver_reads_pynetfts_fake_sensor() {
    let _alone = alone();
    let mut sensor = PythonPeer::start("net_ft_sensor.py", &[]);
    let ports = sensor.next_line();
    let address = |key| loopback(PythonPeer::port(&ports, key));
    let calibration = fetch_calibration(address("http"), Duration::from_secs(5)).unwrap();
    assert_eq!(calibration.product, "Gamma");
    let settings = NetFtSettings {
        on_silence: OnSilence::Request,
        silence: Nanos::from_millis(200),
        ..NetFtSettings::new(address("rdt"), calibration, Nanos::from_millis(1))
    };
    let mut driver = NetFt::start(UdpPort::bind(loopback(0)).unwrap(), settings).unwrap();
    let mut sample = wait_for_sample(&mut driver);
    while driver.counters().received < 7 {
        sample = wait_for_sample(&mut driver);
    }
    let (force, moment) = (sample.wrench.force, sample.wrench.moment);
    assert_near(&[force.x, force.y, force.z], &[4.0 * POUND, 0.0, -2.0 * POUND], 1e-9);
    assert_near(&[moment.x, moment.y, moment.z], &[0.0, 0.03, 0.0], 1e-12);
    assert!(sample.saturated && !sample.invalid);
    let counters = driver.counters();
    assert_eq!((counters.lost, counters.malformed, counters.foreign), (2, 1, 0));
    // The stream ends: the driver requests it again, and the second stream begins.
    let sample = wait_for_sample(&mut driver);
    assert_near(&[sample.wrench.force.x], &[7.0 * POUND], 1e-9);
    drop(driver);
    std::thread::sleep(Duration::from_millis(100));
    let result = sensor.end();
    let requests = result["requests"].as_array().unwrap();
    let commands: Vec<_> = requests.iter().map(|request| request[1].as_u64().unwrap()).collect();
    assert_eq!((commands.first(), commands.last()), (Some(&2), Some(&0)));
    assert!(commands[..commands.len() - 1].iter().all(|&command| command == 2) && commands.len() >= 3);
}

fn load() -> ForceSample {
    let wrench = Wrench { force: vec3(1.5, -2.5, 300.0), moment: vec3(0.25, 0.5, -12.0) };
    ForceSample::new(Nanos(0), 0, wrench)
}

#[test]
#[ignore = "needs pynetft: SOFTDOCK_PEER_PYTHON"]
fn pynetft_reads_our_box() {
    let _alone = alone();
    let calibration = NetFtCalibration::with_units("softdock", 1e6, 1e6, "N", "N-m").unwrap();
    let server = CalibrationServer::start(loopback(0), &calibration).unwrap();
    let port = UdpPort::bind(loopback(0)).unwrap();
    let rdt = port.local_address().unwrap().port().to_string();
    let http = server.local_address().port().to_string();
    let sensor = NetBox::new(calibration, Nanos::from_millis(1));
    let served = Served::start(move |over| serve_sensor(port, sensor, load(), over));
    let result = PythonPeer::start("net_ft_client.py", &["pynetft", "127.0.0.1", &rdt, &http]).next_line();
    served.end();
    assert_near(&numbers(&result["wrench"]), &[1.5, -2.5, 300.0, 0.25, 0.5, -12.0], 1e-6);
    assert_near(&numbers(&result["biased"]), &[0.0; 6], 1e-6);
    assert_eq!(result["product"], "softdock");
    assert_eq!((result["lost"].as_u64(), result["errors"].as_u64()), (Some(0), Some(0)));
    println!("pynetft: 1000 records of a 1 kHz stream in {:.3} s", result["elapsed"].as_f64().unwrap());
}

#[test]
#[ignore = "needs NetFT: SOFTDOCK_PEER_PYTHON"]
fn netft_reads_our_box() {
    let _alone = alone();
    // The client has a fixed port: another address of this host avoids conflicts.
    let address = SocketAddr::from(([127, 0, 0, 2], RDT_PORT));
    let port = UdpPort::bind(address).unwrap();
    let sensor = NetBox::new(NetFtCalibration::new(1e6, 1e6).unwrap(), Nanos::from_micros(143));
    let served = Served::start(move |over| serve_sensor(port, sensor, load(), over));
    let result = PythonPeer::start("net_ft_client.py", &["NetFT", "127.0.0.2", "0", "0"]).next_line();
    served.end();
    let counts = [1.5e6, -2.5e6, 3e8, 2.5e5, 5e5, -1.2e7];
    assert_near(&numbers(&result["single"]), &counts, 0.0);
    assert_near(&numbers(&result["streamed"]), &counts, 0.0);
}
