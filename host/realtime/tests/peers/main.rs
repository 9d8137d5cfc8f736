//! Our drivers and emulated devices against software of third parties.
//!
//! All tests are ignored by default: `tests/peers/install.sh DIRECTORY` creates the Python environment that they need,
//! and `SOFTDOCK_PEER_PYTHON=DIRECTORY/bin/python cargo test --release -p softdock-realtime --test peers -- --ignored`
//! runs them, one after the other. A test without its variable fails with a message; tests that need the address of a
//! running controller report that they were skipped.

mod egm;
mod fanuc;
mod net_ft;
mod rsi;

use serde_json::Value;
use softdock_realtime::protocol::{EmulatedController, SensorBox};
use softdock_realtime::signals::{AXES, ForceSample, RobotState};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::{MAX_DATAGRAM, Port, udp::UdpPort};
use std::io::{BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::thread::JoinHandle;

/// These tests measure rates: one at a time.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn loopback(port: u16) -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], port))
}

/// Returns the time on the clock of the ports.
fn now() -> Nanos {
    static CLOCK: OnceLock<UdpPort> = OnceLock::new();
    CLOCK.get_or_init(|| UdpPort::bind(loopback(0)).unwrap()).now()
}

/// A peer in its own process; it prints a line of JSON when it is ready, and another one at its end.
struct PythonPeer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
}

impl PythonPeer {
    fn start(script: &str, arguments: &[&str]) -> Self {
        let python = std::env::var("SOFTDOCK_PEER_PYTHON")
            .expect("SOFTDOCK_PEER_PYTHON must name the Python of an environment made by tests/peers/install.sh");
        let script = format!("{}/tests/peers/{script}", env!("CARGO_MANIFEST_DIR"));
        let mut command = Command::new(python);
        command.arg(script).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the Python interpreter starts");
        let (stdin, stdout) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        Self { child, stdin, stdout }
    }

    /// Returns the next line of the peer.
    fn next_line(&mut self) -> Value {
        let mut line = String::new();
        self.stdout.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("the peer printed {line:?}"))
    }

    /// Returns a port from the peer's first line.
    fn port(value: &Value, key: &str) -> u16 {
        u16::try_from(value[key].as_u64().unwrap()).unwrap()
    }

    /// Ends the peer, and returns its result.
    fn end(&mut self) -> Value {
        self.stdin.write_all(b"\n").unwrap();
        self.next_line()
    }
}

impl Drop for PythonPeer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns numbers from a peer's result.
fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is no list"))
        .iter()
        .map(|value| value.as_f64().unwrap())
        .collect()
}

#[track_caller]
fn assert_near(measured: &[f64], expected: &[f64], tolerance: f64) {
    let near =
        measured.len() == expected.len() && measured.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(near, "{measured:?} is not {expected:?}");
}

/// An emulated device on a socket and the machine's clock, until dropped.
struct Served<T> {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<T>>,
}

impl<T> Served<T> {
    fn start(serve: impl FnOnce(&AtomicBool) -> T + Send + 'static) -> Self
    where
        T: Send + 'static,
    {
        let over = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&over);
        Self { over, thread: Some(std::thread::spawn(move || serve(&ended))) }
    }

    fn end(mut self) -> T {
        self.over.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl<T> Drop for Served<T> {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

/// Serves a controller whose robot is always at its target; returns the last target.
fn serve_controller(
    mut port: UdpPort,
    mut controller: impl EmulatedController,
    start: RobotState,
    over: &AtomicBool,
) -> RobotState {
    let mut state = start;
    let mut next = port.now();
    while !over.load(Ordering::Relaxed) {
        (state.stamp, state.received) = (next, next);
        controller.report(next, &state, &mut |to, datagram| port.send(datagram, to).unwrap());
        next += controller.cycle();
        take_until(&mut port, next, |port, now, from, datagram| {
            controller.take(now, from, datagram, &mut |to, reply| port.send(reply, to).unwrap());
        });
        state.position = controller.target(next);
    }
    state
}

/// Serves a sensor with constant readings.
fn serve_sensor(mut port: UdpPort, mut sensor: impl SensorBox, sample: ForceSample, over: &AtomicBool) {
    let mut next = port.now();
    while !over.load(Ordering::Relaxed) {
        sensor.report(next, &sample, &mut |to, datagram| port.send(datagram, to).unwrap());
        next += sensor.period();
        take_until(&mut port, next, |port, now, from, datagram| {
            sensor.take(now, from, datagram, &mut |to, reply| port.send(reply, to).unwrap());
        });
    }
}

fn take_until(port: &mut UdpPort, deadline: Nanos, mut take: impl FnMut(&mut UdpPort, Nanos, SocketAddr, &[u8])) {
    let mut buffer = [0; MAX_DATAGRAM];
    while let Some((length, from)) = port.receive(&mut buffer, deadline).unwrap() {
        let now = port.now();
        take(port, now, from, &buffer[..length]);
    }
}

/// A robot at rest.
fn at_rest(position: [f64; AXES]) -> RobotState {
    RobotState {
        stamp: Nanos(0),
        received: Nanos(0),
        position,
        reported_set_point: Some(position),
        torque: None,
        pose: None,
        late_answers: 0,
        ready: true,
    }
}
