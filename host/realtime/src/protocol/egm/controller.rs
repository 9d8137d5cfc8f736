//! The emulated EGM robot: reports first, each cycle, and moves to the joint targets in the answers.

use super::CYCLE;
use super::messages::{EgmAxes, EgmMotion, RobotReport, SensorCommand};
use crate::protocol::link::progress;
use crate::protocol::{EmulatedController, Line, Outbox};
use crate::signals::{AXES, RAIL, RobotState, plausible};
use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use std::net::SocketAddr;

/// Distance at which a joint counts as converged \[rad\]: 0.5 deg, the default of `EGMRunJoint`.
const CONVERGED: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Settings of the robot's EGM session.
#[derive(Clone, Debug, PartialEq)]
pub struct EgmSettings {
    /// Address that it sends to (its `UdpUc` device).
    pub client: SocketAddr,
    /// Period of its messages (`SampleRate`): a multiple of 4 ms.
    pub cycle: Nanos,
    /// Whether its first external axis is a rail.
    pub rail: bool,
    /// Time without a target after which the session ends with an error (`CommTimeout`).
    pub silence: Nanos,
    /// Time at the target after which the session ends by itself (`CondTime`); `None`: never.
    pub settled: Option<Nanos>,
}

impl EgmSettings {
    /// Creates a session at 4 ms that ends after one second without targets and does not end by convergence.
    pub fn new(client: SocketAddr) -> Self {
        Self { client, cycle: CYCLE, rail: false, silence: Nanos::from_millis(1000), settled: None }
    }
}

/// An emulated EGM robot.
pub struct EgmController {
    settings: EgmSettings,
    sequence: u32,
    commanded: Option<u32>,
    target: Option<[f64; AXES]>,
    line: Option<Line>,
    /// Last target taken.
    last_target: Nanos,
    /// Time since which it is at its target.
    settled_since: Option<Nanos>,
    force: Option<Wrench<f64>>,
    fault: Option<&'static str>,
}

impl EgmController {
    /// Creates a robot whose `EGMRunJoint` begins with its first report.
    pub fn new(settings: EgmSettings) -> Self {
        Self {
            settings,
            sequence: 0,
            commanded: None,
            target: None,
            line: None,
            last_target: Nanos(0),
            settled_since: None,
            force: None,
            fault: None,
        }
    }

    /// Sets the reading of its own force sensor: N, N m.
    pub fn set_force(&mut self, force: Option<Wrench<f64>>) {
        self.force = force;
    }

    /// Evaluates the two conditions that end a session.
    fn watch(&mut self, now: Nanos, measured: &[f64; AXES]) {
        let Some(target) = self.target else {
            return;
        };
        if now - self.last_target > self.settings.silence {
            self.fault = Some("CommTimeout: no more targets");
        }
        let near = (0..RAIL).all(|axis| (measured[axis] - target[axis]).abs() < CONVERGED);
        self.settled_since = near.then(|| self.settled_since.unwrap_or(now));
        if let (Some(since), Some(time)) = (self.settled_since, self.settings.settled)
            && now - since >= time
        {
            self.fault = Some("EGM has converged");
        }
    }
}

impl EmulatedController for EgmController {
    fn cycle(&self) -> Nanos {
        self.settings.cycle
    }

    fn change_cycle(&mut self, cycle: Nanos) {
        self.settings.cycle = cycle;
    }

    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], _out: Outbox) {
        let Some(line) = self.line.filter(|_| self.fault.is_none() && from.ip() == self.settings.client.ip()) else {
            return;
        };
        let Ok(command) = SensorCommand::read(datagram) else {
            return;
        };
        if self.commanded.is_some_and(|before| progress(before, command.sequence) <= 0) {
            return;
        }
        // Joints without a target keep their last one.
        let mut target = self.target.unwrap_or(line.to);
        for (axis, degrees) in target[..RAIL].iter_mut().zip(command.planned.joints.as_slice()) {
            *axis = degrees.to_radians();
        }
        if let (true, Some(&rail)) = (self.settings.rail, command.planned.external.as_slice().first()) {
            target[RAIL] = rail * 1e-3;
        }
        if plausible(&target) {
            (self.commanded, self.target, self.last_target) = (Some(command.sequence), Some(target), now);
        }
    }

    fn target(&mut self, now: Nanos) -> [f64; AXES] {
        self.line.map_or([0.0; AXES], |line| line.at(now, self.settings.cycle))
    }

    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox) {
        if self.fault.is_none() {
            self.watch(now, &state.position);
        }
        let from = self.line.map_or(state.position, |line| line.at(now, self.settings.cycle));
        let target = self.target.filter(|_| self.fault.is_none());
        self.line = Some(Line { from, to: target.unwrap_or(from), since: now });
        // After the session the robot continues to report that EGM has stopped.
        let report = RobotReport {
            sequence: self.sequence,
            time_ms: (now.0 / 1_000_000) as u32,
            feedback: motion(&self.settings, &state.position, state),
            planned: EgmMotion { pose: None, ..motion(&self.settings, &from, state) },
            motors_on: true,
            running: self.fault.is_none(),
            rapid_running: true,
            converged: self.settled_since.is_some(),
            force: self.force.map_or(EgmAxes::default(), |wrench| {
                let (force, moment) = (wrench.force, wrench.moment);
                EgmAxes::of(&[force.x, force.y, force.z, moment.x, moment.y, moment.z])
            }),
            torque: state.torque.map_or(EgmAxes::default(), |torque| EgmAxes::of(&torque[..RAIL])),
        };
        self.sequence = self.sequence.wrapping_add(1);
        if let Some(bytes) = report.message().as_bytes() {
            out(self.settings.client, bytes);
        }
    }

    fn fault(&self) -> Option<&'static str> {
        self.fault
    }

    fn has_client(&self) -> bool {
        self.target.is_some() && self.fault.is_none()
    }

    fn renew(&mut self, at: [f64; AXES]) {
        (self.fault, self.commanded, self.target, self.settled_since) = (None, None, None, None);
        self.line = self.line.map(|line| Line { from: at, to: at, ..line });
    }
}

fn motion(settings: &EgmSettings, axes: &[f64; AXES], state: &RobotState) -> EgmMotion {
    let joints: [f64; RAIL] = std::array::from_fn(|axis| axes[axis].to_degrees());
    let pose = state.pose.map(|pose| {
        let (position, turn) = (pose.position * 1e3, pose.attitude);
        [position.x, position.y, position.z, turn.w, turn.v.x, turn.v.y, turn.v.z]
    });
    let external = if settings.rail { EgmAxes::of(&[axes[RAIL] * 1e3]) } else { EgmAxes::default() };
    EgmMotion { joints: EgmAxes::of(&joints), external, pose }
}
