//! Our side of EGM: a link to a robot that reports first, each cycle, and takes joint targets.

use super::messages::{EgmAxes, EgmMotion, RobotReport, SensorCommand};
use crate::protocol::link::{self, Peer, Succession};
use crate::signals::{
    AXES, Capabilities, LinkCounters, LinkFault, MAX_EFFORT, Order, RAIL, RobotLink, RobotState, plausible,
};
use crate::time::Nanos;
use crate::wire::Port;
use softdock_kernels::vector::{Pose, Quat, vec3};
use std::net::IpAddr;

/// Greatest accepted tool position \[mm\].
const MAX_POSE: f64 = 1e6;

/// A link to an EGM robot.
pub struct EgmRobot<P> {
    port: P,
    cycle: Nanos,
    rail: bool,
    peer: Peer,
    counters: LinkCounters,
    session: Session,
}

/// State of the session.
#[derive(Clone, Copy, Debug, Default)]
struct Session {
    /// Progress of the message count.
    succession: Succession,
    /// Holding position before any motion, later the last target: joints \[rad\], rail \[m\].
    target: Option<[f64; AXES]>,
    /// Deadline for answering the last report.
    pending: Option<Nanos>,
    /// Count of our messages.
    sent: u32,
    ended: bool,
}

impl<P: Port> EgmRobot<P> {
    /// Creates a link to a robot that sends to `port` each `cycle`, with or without a rail as its first external axis.
    /// Accepts only the host `from`, if given, and only the address of the first valid message.
    pub fn new(port: P, cycle: Nanos, rail: bool, from: Option<IpAddr>) -> Self {
        let (peer, counters) = (Peer::new(from), LinkCounters::default());
        Self { port, cycle, rail, peer, counters, session: Session::default() }
    }
}

fn axes(motion: &EgmMotion, rail: bool) -> Option<[f64; AXES]> {
    let mut axes = [0.0; AXES];
    let joints: &[f64; RAIL] = motion.joints.as_slice().try_into().ok()?;
    for (axis, degrees) in axes.iter_mut().zip(joints) {
        *axis = degrees.to_radians();
    }
    if rail {
        axes[RAIL] = motion.external.as_slice().first()? * 1e-3;
    }
    Some(axes).filter(plausible)
}

/// Returns the tool's pose; `None` for a quaternion of zero length.
fn pose(fields: [f64; 7]) -> Option<Pose<f64>> {
    let [x, y, z, u0, u1, u2, u3] = fields;
    let length = (u0 * u0 + u1 * u1 + u2 * u2 + u3 * u3).sqrt();
    let attitude = Quat { w: u0, v: vec3(u1, u2, u3) };
    (0.9..1.1)
        .contains(&length)
        .then(|| Pose { position: vec3(x * 1e-3, y * 1e-3, z * 1e-3), attitude: attitude.normalized() })
}

/// Converts a report to a state; `None` if it is not plausible.
fn state(report: &RobotReport, rail: bool, received: Nanos) -> Option<RobotState> {
    let position = axes(&report.feedback, rail)?;
    let torque = report.torque.as_slice();
    let reported = report.feedback.pose;
    let believable = reported.is_none_or(|reported| reported.iter().all(|value| value.abs() <= MAX_POSE))
        && torque.iter().all(|value| value.abs() <= MAX_EFFORT);
    believable.then(|| RobotState {
        stamp: Nanos(0),
        received,
        position,
        reported_set_point: axes(&report.planned, rail),
        torque: (!torque.is_empty()).then(|| std::array::from_fn(|axis| torque.get(axis).copied().unwrap_or(0.0))),
        pose: reported.and_then(pose),
        late_answers: 0,
        ready: report.motors_on && report.running && report.rapid_running,
    })
}

/// Takes a datagram into the session, or counts its rejection.
fn take(
    session: &mut Session,
    counters: &mut LinkCounters,
    rail: bool,
    datagram: &[u8],
    now: Nanos,
) -> Option<RobotState> {
    let read = RobotReport::read(datagram).ok().and_then(|report| Some((report, state(&report, rail, now)?)));
    let Some((report, mut state)) = read else {
        counters.malformed += 1;
        return None;
    };
    if !session.succession.admits(report.sequence, report.time_ms, counters) {
        return None;
    }
    if session.target.is_none() || !state.ready {
        // Holds at the planner's position: the measured one sags under load. Until the robot follows, others may move
        // it; it must then be held where it is.
        session.target = state.reported_set_point.or(Some(state.position));
    }
    state.stamp = session.succession.stamp;
    state.ready &= !session.ended;
    Some(state)
}

impl<P: Port> RobotLink for EgmRobot<P> {
    fn capabilities(&self) -> Capabilities {
        Capabilities { cycle: self.cycle, master: true, rail: self.rail, torque: false, pose: true }
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        let Self { port, rail, peer, counters, session, .. } = self;
        let (state, taken) = link::newest(port, deadline, |datagram, from, now| {
            if !peer.admits(from) {
                counters.foreign += 1;
                return None;
            }
            counters.received += 1;
            let state = take(session, counters, *rail, datagram, now)?;
            peer.settle(from);
            Some(state)
        })?;
        if let Some(state) = &state {
            self.counters.overtaken += taken - 1;
            self.counters.unsent += taken - 1 + u64::from(self.session.pending.is_some());
            self.session.pending = Some(state.received + self.cycle);
        }
        Ok(state)
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        let (Some(held), Some(to)) = (self.session.target, self.peer.address()) else {
            return Ok(());
        };
        let target = match order {
            Order::Move(target) | Order::End(target) if !self.session.ended => *target,
            Order::Hold | Order::Move(_) | Order::End(_) => held,
        };
        if !plausible(&target) {
            return Err(LinkFault::Unsendable("an axis is not a number or outside every range"));
        }
        if !self.rail && target[RAIL].abs() > 1e-9 {
            return Err(LinkFault::Unsendable("this EGM robot has no rail"));
        }
        let now = self.port.now();
        if self.session.pending.take().is_none_or(|over| now >= over) {
            self.counters.unsent += 1;
            return Ok(());
        }
        let joints: [f64; RAIL] = std::array::from_fn(|axis| target[axis].to_degrees());
        let external = if self.rail { EgmAxes::of(&[target[RAIL] * 1e3]) } else { EgmAxes::default() };
        let planned = EgmMotion { joints: EgmAxes::of(&joints), external, pose: None };
        let time_ms = (now.0 / 1_000_000) as u32;
        let command = SensorCommand { sequence: self.session.sent, time_ms, planned };
        let message = command.message();
        self.port.send(message.as_bytes().ok_or(LinkFault::Unsendable("the message is too long"))?, to)?;
        self.session.sent = self.session.sent.wrapping_add(1);
        self.session.target = Some(target);
        // EGM has no message that ends a session: the last target is repeated until the robot has converged.
        self.session.ended |= matches!(order, Order::End(_));
        Ok(())
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}
