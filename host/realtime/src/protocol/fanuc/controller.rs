//! The emulated FANUC controller: Stream Motion as a strict one speaks it.

use super::packets::{BASE_VERSION, Capability, Reply, Request, Status, WIRE_AXES};
use crate::protocol::link::progress;
use crate::protocol::{Controller, Line, Outbox, attitude};
use crate::signals::{AXES, RAIL, RobotState};
use crate::time::Nanos;
use std::net::SocketAddr;

/// Largest step of a target from one command to the next \[rad\]: 5 deg, where a CRX trips.
const MAX_STEP: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Cycles without a command after which it stops following.
const MAX_SILENT: u32 = 3;

/// An emulated controller of a six-axis arm.
pub struct FanucController {
    cycle: Nanos,
    version: u32,
    client: Option<SocketAddr>,
    sequence: u32,
    /// The version agreed upon, while it streams.
    streaming: Option<u32>,
    /// The program that follows the stream runs.
    program: bool,
    /// The client has sent its last command.
    ended: bool,
    commanded: Option<u32>,
    /// What it is asked to follow.
    asked: Option<[f64; AXES]>,
    /// Where it stands and moves to; from its first report on.
    line: Option<Line>,
    silent: u32,
    fault: Option<&'static str>,
}

impl FanucController {
    /// A controller with this period, that speaks Stream Motion up to `version` (3 or 4; the latter reports forces).
    pub fn new(cycle: Nanos, version: u32) -> Self {
        Self {
            cycle,
            version: version.max(BASE_VERSION),
            client: None,
            sequence: 0,
            streaming: None,
            program: true,
            ended: false,
            commanded: None,
            asked: None,
            line: None,
            silent: 0,
            fault: None,
        }
    }

    /// Whether the program that follows the stream runs (`STREAM_MOTN`); it does from the start.
    pub fn run_program(&mut self, runs: bool) {
        self.program = runs;
    }

    /// It waits for commands and follows them.
    fn follows(&self) -> bool {
        self.program && !self.ended && self.fault.is_none()
    }

    fn start(&mut self, version: u32) {
        if version != self.version {
            self.fault = Some("Stream Motion was started in a version that was not agreed upon");
        }
        self.streaming = Some(version);
        (self.sequence, self.commanded, self.asked, self.silent, self.ended) = (0, None, None, 0, false);
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
        let Some(from) = self.asked.or(self.line.map(|line| line.to)) else {
            return;
        };
        if (0..RAIL).any(|axis| (target[axis] - from[axis]).abs() > MAX_STEP) {
            self.fault = Some("a command jumps");
            return;
        }
        self.commanded = Some(sequence);
        self.asked = Some(target);
        self.silent = 0;
        self.ended = last;
    }
}

impl Controller for FanucController {
    fn cycle(&self) -> Nanos {
        self.cycle
    }

    fn change_cycle(&mut self, cycle: Nanos) {
        self.cycle = cycle;
    }

    fn take(&mut self, _now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox) {
        match Request::read(datagram) {
            Some(Request::Capability) => {
                let period_ms = (self.cycle.0 / 1_000_000) as u32;
                let reply = Reply::Capability(Capability { period_ms, version: self.version });
                out(from, reply.packet().as_bytes());
            }
            Some(Request::Start(version)) => {
                self.client = Some(from);
                self.start(version);
            }
            Some(Request::Stop) if self.client == Some(from) => self.streaming = None,
            Some(Request::Command(command)) if self.client == Some(from) && self.follows() => match self.streaming {
                Some(version) if version == command.version => {
                    self.command(command.sequence, &command.joints, command.last);
                }
                Some(_) => self.fault = Some("a command of a version that was not agreed upon"),
                None => {}
            },
            _ => {}
        }
    }

    fn target(&mut self, now: Nanos) -> [f64; AXES] {
        self.line.map_or([0.0; AXES], |line| line.at(now, self.cycle))
    }

    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox) {
        let from = self.line.map_or(state.position, |line| line.at(now, self.cycle));
        let asked = self.asked.filter(|_| self.fault.is_none());
        self.line = Some(Line { from, to: asked.unwrap_or(from), since: now });
        let (Some(version), Some(client)) = (self.streaming, self.client) else {
            return;
        };
        self.silent += u32::from(self.asked.is_some() && self.follows());
        if self.silent > MAX_SILENT {
            self.fault = Some("commands have ceased");
        }
        self.sequence = self.sequence.wrapping_add(1);
        let status = report(version, self.sequence, self.follows(), self.fault.is_some(), now, state);
        out(client, Reply::Status(status).packet().as_bytes());
    }

    fn fault(&self) -> Option<&'static str> {
        self.fault
    }
}

/// The status of a cycle.
fn report(version: u32, sequence: u32, waits: bool, error: bool, now: Nanos, state: &RobotState) -> Status {
    let mut joints = [0.0; WIRE_AXES];
    for (angle, radians) in joints.iter_mut().zip(&state.position[..RAIL]) {
        *angle = radians.to_degrees() as f32;
    }
    let mut pose = [0.0; WIRE_AXES];
    if let Some(told) = state.pose {
        let [r, p, w] = attitude::to_zyx(told.attitude).map(|angle| angle.to_degrees() as f32);
        let position = told.position.map(|metres| (metres * 1e3) as f32);
        pose[..6].copy_from_slice(&[position.x, position.y, position.z, w, p, r]);
    }
    Status {
        version,
        sequence,
        status: u8::from(waits),
        robot_status: u8::from(error),
        contact_stop: 0,
        time_stamp: (now.0 / 1_000_000) as u32,
        pose,
        joints,
        currents: [0.0; WIRE_AXES],
        safety_scale: 1.0,
        force: (version >= 4).then_some([0.0; 6]),
    }
}
