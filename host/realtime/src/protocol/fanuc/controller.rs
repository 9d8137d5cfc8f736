//! The emulated FANUC controller: a strict implementation of Stream Motion.

use super::packets::{BASE_VERSION, Capability, FanucReply, FanucRequest, FanucStatus, WIRE_AXES};
use crate::protocol::link::progress;
use crate::protocol::{EmulatedController, Line, Outbox, attitude};
use crate::signals::{AXES, RAIL, RobotState};
use crate::time::Nanos;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Greatest step of a target from one command to the next \[rad\]: 5 deg, at which a CRX trips.
const MAX_STEP: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Time without commands and requests after which another client may replace the present one.
const FORGOTTEN: Nanos = Nanos::from_millis(1000);
/// Cycles without a command after which it stops following.
const MAX_SILENT: u32 = 3;

/// State shared by the Remote Motion Interface, the operator's panel and the emulated controller.
#[derive(Debug, Default)]
pub struct Remote {
    program: AtomicBool,
    resets: AtomicU32,
    emergency_stop: AtomicBool,
    teach_pendant: AtomicBool,
}

impl Remote {
    /// Whether the program that follows the stream runs (`STREAM_MOTN`).
    pub fn runs_program(&self) -> bool {
        self.program.load(Ordering::Acquire) && !self.is_stopped() && !self.is_taught()
    }

    /// Starts or ends that program.
    pub fn run_program(&self, runs: bool) {
        self.program.store(runs, Ordering::Release);
    }

    /// Clears faults whose cause is gone.
    pub fn reset(&self) {
        self.resets.fetch_add(1, Ordering::AcqRel);
    }

    /// Presses or releases the emergency stop.
    pub fn press_emergency_stop(&self, pressed: bool) {
        self.emergency_stop.store(pressed, Ordering::Release);
    }

    /// Switches the teach pendant on or off.
    pub fn teach(&self, on: bool) {
        self.teach_pendant.store(on, Ordering::Release);
    }

    /// Whether the emergency stop is pressed.
    pub fn is_stopped(&self) -> bool {
        self.emergency_stop.load(Ordering::Acquire)
    }

    /// Whether the teach pendant is on.
    pub fn is_taught(&self) -> bool {
        self.teach_pendant.load(Ordering::Acquire)
    }
}

/// An emulated controller of a six-axis arm.
pub struct FanucController {
    cycle: Nanos,
    version: u32,
    client: Option<SocketAddr>,
    /// Time of that client's last datagram.
    last_datagram: Nanos,
    sequence: u32,
    /// Negotiated version, while it streams.
    streaming: Option<u32>,
    /// Whether the program that follows the stream runs.
    program: bool,
    /// Interface that starts and ends that program and clears faults, and the processed resets.
    remote: Option<(Arc<Remote>, u32)>,
    /// Whether the client has sent its last command.
    ended: bool,
    commanded: Option<u32>,
    /// Target.
    target: Option<[f64; AXES]>,
    /// Position and interpolation; from its first report on.
    line: Option<Line>,
    silent: u32,
    fault: Option<&'static str>,
}

impl FanucController {
    /// Creates a controller with this period, which supports Stream Motion up to `version` (3 or 4; the latter reports
    /// forces).
    pub fn new(cycle: Nanos, version: u32) -> Self {
        Self {
            cycle,
            version: version.max(BASE_VERSION),
            client: None,
            last_datagram: Nanos(0),
            sequence: 0,
            streaming: None,
            program: true,
            remote: None,
            ended: false,
            commanded: None,
            target: None,
            line: None,
            silent: 0,
            fault: None,
        }
    }

    /// Whether the program that follows the stream runs (`STREAM_MOTN`); initially it does.
    pub fn run_program(&mut self, runs: bool) {
        self.program = runs;
    }

    /// Returns the interpolator's position; `None` before its first report.
    pub fn line_at(&self, now: Nanos) -> Option<[f64; AXES]> {
        self.line.map(|line| line.at(now, self.cycle))
    }

    /// Gives an interface control of program and faults.
    pub fn obey(&mut self, remote: Arc<Remote>) {
        self.program = remote.runs_program();
        let resets = remote.resets.load(Ordering::Acquire);
        self.remote = Some((remote, resets));
    }

    /// Applies the interface's requests since the last cycle.
    fn apply_remote(&mut self) {
        let Some((remote, seen)) = &mut self.remote else { return };
        self.program = remote.runs_program();
        let resets = remote.resets.load(Ordering::Acquire);
        if resets != std::mem::replace(seen, resets) {
            (self.fault, self.target, self.commanded, self.silent) = (None, None, None, 0);
        }
    }

    /// One client at a time: another one may start once its stream has stopped, or it is gone and commands nothing.
    fn may_start(&self, from: SocketAddr, now: Nanos) -> bool {
        let free = self.streaming.is_none() || self.target.is_none() && now - self.last_datagram > FORGOTTEN;
        free || self.client.is_none_or(|client| client == from)
    }

    /// Returns the robot status bits: 0 fault, 1 teach pendant, 2 emergency stop.
    fn robot_status(&self) -> u8 {
        let (taught, stopped) =
            self.remote.as_ref().map_or((false, false), |(remote, _)| (remote.is_taught(), remote.is_stopped()));
        u8::from(self.fault.is_some() || stopped) | u8::from(taught) << 1 | u8::from(stopped) << 2
    }

    /// Whether it is ready for commands and follows them.
    fn follows(&self) -> bool {
        self.program && !self.ended && self.fault.is_none()
    }

    fn start(&mut self, version: u32) {
        if version != self.version {
            self.fault = Some("Stream Motion was started in a version that was not negotiated");
        }
        self.streaming = Some(version);
        (self.sequence, self.commanded, self.target, self.silent, self.ended) = (0, None, None, 0, false);
    }

    fn command(&mut self, sequence: u32, joints: &[f64; WIRE_AXES], last: bool) {
        if self.commanded.is_some_and(|before| progress(before, sequence) <= 0) {
            self.fault = Some("a command was sent twice or out of order");
            return;
        }
        let mut target = [0.0; AXES];
        for (axis, degrees) in target[..RAIL].iter_mut().zip(joints) {
            *axis = degrees.to_radians();
        }
        let Some(from) = self.target.or(self.line.map(|line| line.to)) else {
            return;
        };
        if (0..RAIL).any(|axis| (target[axis] - from[axis]).abs() > MAX_STEP) {
            self.fault = Some("a command jumps");
            return;
        }
        self.commanded = Some(sequence);
        self.target = Some(target);
        self.silent = 0;
        self.ended = last;
    }
}

impl EmulatedController for FanucController {
    fn cycle(&self) -> Nanos {
        self.cycle
    }

    fn change_cycle(&mut self, cycle: Nanos) {
        self.cycle = cycle;
    }

    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox) {
        if self.client == Some(from) {
            self.last_datagram = now;
        }
        match FanucRequest::read(datagram) {
            Some(FanucRequest::Capability) => {
                let period_ms = (self.cycle.0 / 1_000_000) as u32;
                let reply = FanucReply::Capability(Capability { period_ms, version: self.version });
                out(from, reply.packet().as_bytes());
            }
            Some(FanucRequest::Start(version)) if self.may_start(from, now) => {
                (self.client, self.last_datagram) = (Some(from), now);
                self.start(version);
            }
            Some(FanucRequest::Stop) if self.client == Some(from) => self.streaming = None,
            Some(FanucRequest::Command(command)) if self.client == Some(from) && self.follows() => match self.streaming
            {
                Some(version) if version == command.version => {
                    self.command(command.sequence, &command.joints, command.last);
                }
                Some(_) => self.fault = Some("a command of a version that was not negotiated"),
                None => {}
            },
            _ => {}
        }
    }

    fn target(&mut self, now: Nanos) -> [f64; AXES] {
        self.line_at(now).unwrap_or([0.0; AXES])
    }

    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox) {
        self.apply_remote();
        let from = self.line.map_or(state.position, |line| line.at(now, self.cycle));
        let target = self.target.filter(|_| self.fault.is_none());
        self.line = Some(Line { from, to: target.unwrap_or(from), since: now });
        let (Some(version), Some(client)) = (self.streaming, self.client) else {
            return;
        };
        self.silent += u32::from(self.target.is_some() && self.follows());
        if self.silent > MAX_SILENT {
            self.fault = Some("no more commands");
        }
        self.sequence = self.sequence.wrapping_add(1);
        let status = report(version, self.sequence, self.follows(), self.robot_status(), now, state);
        out(client, FanucReply::Status(status).packet().as_bytes());
    }

    fn fault(&self) -> Option<&'static str> {
        self.fault
    }

    fn has_client(&self) -> bool {
        self.streaming.is_some() && self.target.is_some() && self.follows()
    }

    fn renew(&mut self, at: [f64; AXES]) {
        self.line = self.line.map(|line| Line { from: at, to: at, ..line });
        (self.fault, self.streaming, self.client) = (None, None, None);
        (self.target, self.commanded, self.silent, self.ended) = (None, None, 0, false);
    }
}

/// Creates the status of a cycle.
fn report(version: u32, sequence: u32, waits: bool, robot_status: u8, now: Nanos, state: &RobotState) -> FanucStatus {
    let mut joints = [0.0; WIRE_AXES];
    for (angle, radians) in joints.iter_mut().zip(&state.position[..RAIL]) {
        *angle = radians.to_degrees() as f32;
    }
    let mut words = [0.0; WIRE_AXES];
    if let Some(pose) = state.pose {
        let [r, p, w] = attitude::to_zyx(pose.attitude).map(|angle| angle.to_degrees() as f32);
        let position = pose.position.map(|metres| (metres * 1e3) as f32);
        words[..6].copy_from_slice(&[position.x, position.y, position.z, w, p, r]);
    }
    FanucStatus {
        version,
        sequence,
        status: u8::from(waits),
        robot_status,
        contact_stop: 0,
        time_stamp: (now.0 / 1_000_000) as u32,
        pose: words,
        joints,
        currents: [0.0; WIRE_AXES],
        safety_scale: 1.0,
        force: (version >= 4).then_some([0.0; 6]),
    }
}
