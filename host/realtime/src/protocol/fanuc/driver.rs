//! Our side of Stream Motion: a link to a six-axis robot whose controller is the clock master and takes joint targets.

use super::packets::{BASE_VERSION, Capability, FanucCommand, FanucReply, FanucRequest, FanucStatus, WIRE_AXES};
use crate::protocol::attitude;
use crate::protocol::link::{self, Peer, Succession};
use crate::signals::{AXES, Capabilities, LinkCounters, LinkFault, Order, RAIL, RobotLink, RobotState, plausible};
use crate::time::Nanos;
use crate::wire::Port;
use softdock_kernels::vector::{Pose, vec3};
use std::net::SocketAddr;

/// Greatest accepted faceplate position \[mm\].
const MAX_POSE: f32 = 1e6;
/// Time before the end of a cycle by which a command must be sent, and least interval to the previous one. A controller
/// takes two commands within 0.1 ms, across the boundary of two cycles, for one sent twice.
const MARGIN: Nanos = Nanos::from_micros(500);
/// Time after which an unanswered request is repeated.
const RETRY: Nanos = Nanos::from_millis(100);

/// A link to a Stream Motion robot.
pub struct FanucRobot<P: Port> {
    port: P,
    controller: SocketAddr,
    cycle: Nanos,
    peer: Peer,
    counters: LinkCounters,
    phase: Phase,
    /// Whether no motion is commanded: it is ready if nothing prevents its program from being started.
    watched: bool,
    /// Time of the phase's request.
    requested: Nanos,
    session: Session,
}

/// Phase of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Capabilities requested.
    Asked,
    /// Stream requested, in this version.
    Started(u32),
    /// Streaming.
    Streaming(u32),
}

/// State of the stream.
#[derive(Clone, Copy, Debug, Default)]
struct Session {
    last: Option<FanucStatus>,
    /// Progress of the message count.
    succession: Succession,
    /// Last commanded targets \[rad\].
    target: Option<[f64; AXES]>,
    /// Status to be answered, and its deadline.
    pending: Option<(u32, Nanos)>,
    /// Number and time of the last command.
    commanded: Option<(u32, Nanos)>,
    ended: bool,
}

impl<P: Port> FanucRobot<P> {
    /// Begins a session with the controller at its Stream Motion address, with the period of its commands.
    /// [`RobotLink::receive`] continues the handshake until status arrives.
    ///
    /// # Errors
    /// If the network interface fails.
    pub fn open(port: P, controller: SocketAddr, cycle: Nanos) -> Result<Self, LinkFault> {
        let requested = port.now();
        let mut robot = Self {
            port,
            controller,
            cycle,
            peer: Peer::at(controller),
            counters: LinkCounters::default(),
            phase: Phase::Asked,
            watched: false,
            requested,
            session: Session::default(),
        };
        // Ends a stream that an earlier client may have left open.
        robot.request(&FanucRequest::Stop)?;
        robot.request(&FanucRequest::Capability)?;
        Ok(robot)
    }

    /// Creates the robot of a dry run: the program that follows the stream is neither started nor required.
    pub fn watched(mut self) -> Self {
        self.watched = true;
        self
    }

    /// Returns the clock of its port.
    pub(super) fn now(&self) -> Nanos {
        self.port.now()
    }

    fn request(&mut self, request: &FanucRequest) -> Result<(), LinkFault> {
        self.port.send(request.packet().as_bytes(), self.controller)?;
        Ok(())
    }

    /// Repeats an unanswered request.
    fn retry(&mut self) -> Result<(), LinkFault> {
        let now = self.port.now();
        if now - self.requested < RETRY {
            return Ok(());
        }
        let request = match self.phase {
            Phase::Asked => FanucRequest::Capability,
            Phase::Started(version) => FanucRequest::Start(version),
            Phase::Streaming(_) => return Ok(()),
        };
        self.requested = now;
        self.request(&request)
    }

    fn start(&mut self, capability: Capability) -> Result<(), LinkFault> {
        if Nanos::from_millis(i64::from(capability.period_ms)) != self.cycle {
            return Err(LinkFault::Mismatch("the FANUC controller's cycle differs from the configured one"));
        }
        if !(BASE_VERSION..=BASE_VERSION + 7).contains(&capability.version) {
            return Err(LinkFault::Mismatch("the FANUC controller uses an unknown version of Stream Motion"));
        }
        self.phase = Phase::Started(capability.version);
        self.requested = self.port.now();
        self.request(&FanucRequest::Start(capability.version))
    }

    fn command(&mut self, sequence: u32, target: [f64; AXES], last: bool) -> Result<(), LinkFault> {
        let Phase::Streaming(version) = self.phase else {
            return Ok(());
        };
        let mut joints = [0.0; WIRE_AXES];
        for (angle, radians) in joints.iter_mut().zip(&target[..RAIL]) {
            *angle = radians.to_degrees();
        }
        self.request(&FanucRequest::Command(FanucCommand { version, sequence, last, joints }))?;
        self.session.target = Some(target);
        self.session.commanded = Some((sequence, self.port.now()));
        self.session.ended |= last;
        Ok(())
    }
}

/// Takes a status into the session, or counts its rejection.
fn take(
    session: &mut Session,
    counters: &mut LinkCounters,
    status: FanucStatus,
    now: Nanos,
    ready: bool,
) -> Option<RobotState> {
    let mut position = [0.0; AXES];
    for (axis, &degrees) in position[..RAIL].iter_mut().zip(&status.joints) {
        *axis = f64::from(degrees).to_radians();
    }
    let believable = plausible(&position) && status.pose[..6].iter().all(|value| value.abs() <= MAX_POSE);
    if !believable {
        counters.malformed += 1;
        return None;
    }
    if !session.succession.admits(status.sequence, status.time_stamp, counters) {
        return None;
    }
    session.last = Some(status);
    let [x, y, z, w, p, r] = std::array::from_fn(|index| f64::from(status.pose[index]));
    let attitude = attitude::from_zyx([r.to_radians(), p.to_radians(), w.to_radians()]);
    Some(RobotState {
        stamp: session.succession.stamp,
        received: now,
        position,
        reported_set_point: session.target,
        torque: None,
        pose: Some(Pose { position: vec3(x * 1e-3, y * 1e-3, z * 1e-3), attitude }),
        late_answers: 0,
        ready: ready && !session.ended,
    })
}

impl<P: Port> RobotLink for FanucRobot<P> {
    fn capabilities(&self) -> Capabilities {
        Capabilities { cycle: self.cycle, master: true, rail: false, torque: false, pose: true }
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        let Self { port, peer, counters, session, phase, watched, .. } = self;
        let mut capability = None;
        let mut phase_now = *phase;
        let (state, taken) = link::newest(port, deadline, |datagram, from, now| {
            if !peer.admits(from) {
                counters.foreign += 1;
                return None;
            }
            counters.received += 1;
            match (FanucReply::read(datagram), phase_now) {
                (Some(FanucReply::Capability(reported)), Phase::Asked) => {
                    capability = Some(reported);
                    None
                }
                (Some(FanucReply::Status(status)), Phase::Started(version) | Phase::Streaming(version)) => {
                    phase_now = Phase::Streaming(version);
                    let ready = if *watched { status.is_sound() } else { status.is_ready() };
                    take(session, counters, status, now, ready)
                }
                // An answer to a repeated request, or status of a stream that was just stopped.
                (Some(_), _) => {
                    counters.stale += 1;
                    None
                }
                (None, _) => {
                    counters.malformed += 1;
                    None
                }
            }
        })?;
        *phase = phase_now;
        if let Some(capability) = capability {
            self.start(capability)?;
        }
        let Some(state) = state else {
            self.retry()?;
            return Ok(None);
        };
        let waits = self.session.last.filter(FanucStatus::waits_for_commands);
        self.counters.overtaken += taken - 1;
        self.counters.unsent += if waits.is_some() { taken - 1 } else { 0 } + u64::from(self.session.pending.is_some());
        self.session.pending = waits.map(|status| (status.sequence, state.received + self.cycle - MARGIN));
        if waits.is_none() {
            // It no longer follows: once it does, its first target is its present position.
            self.session.target = None;
        }
        Ok(Some(state))
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        let Some(last) = self.session.last else {
            return Ok(());
        };
        let mut measured = [0.0; AXES];
        for (axis, &degrees) in measured[..RAIL].iter_mut().zip(&last.joints) {
            *axis = f64::from(degrees).to_radians();
        }
        let target = match order {
            Order::Hold => self.session.target.unwrap_or(measured),
            Order::Move(target) | Order::End(target) => *target,
        };
        if !plausible(&target) {
            return Err(LinkFault::Unsendable("an axis is not a number or outside every range"));
        }
        if target[RAIL].abs() > 1e-9 {
            return Err(LinkFault::Unsendable("this FANUC robot has no rail"));
        }
        let Some((sequence, over)) = self.session.pending.take().filter(|_| !self.session.ended) else {
            // No command may be sent before the controller is ready, nor after the end.
            self.counters.unsent += u64::from(last.waits_for_commands() && !self.session.ended);
            return Ok(());
        };
        let now = self.port.now();
        if now >= over || self.session.commanded.is_some_and(|(_, before)| now - before < MARGIN) {
            self.counters.unsent += 1;
            return Ok(());
        }
        self.command(sequence, target, matches!(order, Order::End(_)))
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

impl<P: Port> Drop for FanucRobot<P> {
    fn drop(&mut self) {
        // A controller needs a command marked as the last before the stream stops.
        if let (Some((sequence, _)), Some(target), false) =
            (self.session.commanded, self.session.target, self.session.ended)
        {
            let _ = self.command(sequence.wrapping_add(1), target, true);
        }
        let _ = self.request(&FanucRequest::Stop);
    }
}
