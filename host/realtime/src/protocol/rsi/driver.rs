//! Our side of RSI: a link to a robot whose controller is the clock master and takes corrections of its axes.

use super::codec::{Message, Rob, Sen};
use super::tags::{Correction, RsiGroup, TagMap};
use crate::protocol::attitude;
use crate::protocol::link::{self, Peer};
use crate::signals::{
    AXES, Capabilities, LinkCounters, LinkFault, MAX_EFFORT, Order, RAIL, RobotLink, RobotState, plausible,
};
use crate::time::Nanos;
use crate::wire::Port;
use softdock_kernels::vector::{Pose, vec3};
use std::net::IpAddr;

/// Greatest accepted growth of IPOC between two messages. A session does not outlive 100 missing answers (1.2 s at 12
/// ms), so that more than 10 s is a damaged number.
const MAX_IPOC_GROWTH: u64 = 10_000;

/// Cycles of silence after which the session must be a new one: ending and restarting takes longer.
const SESSION_CYCLES: u64 = 25;

/// Greatest accepted tool position \[mm\].
const MAX_POSE: f64 = 1e6;

/// A link to an RSI robot.
pub struct RsiRobot<P> {
    port: P,
    tags: TagMap,
    peer: Peer,
    counters: LinkCounters,
    session: Option<Session>,
    pending: Option<Pending>,
    message: Message,
    ended: bool,
}

/// State of the session.
#[derive(Clone, Copy)]
struct Session {
    /// Set-points at its begin, the reference of absolute corrections: joints \[rad\], rail \[m\].
    start: [f64; AXES],
    /// Set-points that result from our answers.
    target: [f64; AXES],
    /// Whether a correction other than zero was sent.
    moved: bool,
    ipoc: u64,
    /// Whether an answer to that IPOC was sent: no second one may follow.
    answered: bool,
    /// Arrival and `Delay` of the last report with that IPOC.
    received: Nanos,
    delay: u32,
    /// Smallest growth of IPOC: one cycle in the controller's own count.
    growth: u64,
}

impl Session {
    /// Begins a session with a report.
    fn new(start: [f64; AXES], rob: &Rob, received: Nanos) -> Self {
        Self {
            start,
            target: start,
            moved: false,
            ipoc: rob.ipoc,
            answered: false,
            received,
            delay: rob.delay,
            growth: u64::MAX,
        }
    }

    /// Whether a report repeats an unanswered IPOC in a later cycle of its controller, as the ROS-Industrial simulator
    /// does. A second copy of one report does not count: `Delay` has not grown, and no cycle has passed.
    fn is_repeated_by(&self, rob: &Rob, received: Nanos, cycle: Nanos) -> bool {
        let later = rob.delay > self.delay || rob.delay == self.delay && received >= self.received + cycle;
        rob.ipoc == self.ipoc && !self.answered && later
    }
}

/// A report to be answered.
#[derive(Clone, Copy)]
struct Pending {
    ipoc: u64,
    /// End of its cycle.
    over: Nanos,
}

impl<P: Port> RsiRobot<P> {
    /// Creates a link to a robot whose controller sends to `port`. Accepts only the host `from`, if given, and only the
    /// address of the first valid message.
    ///
    /// # Errors
    /// If the tag map is invalid.
    pub fn new(port: P, tags: TagMap, from: Option<IpAddr>) -> Result<Self, LinkFault> {
        tags.check().map_err(LinkFault::Mismatch)?;
        Ok(Self {
            port,
            tags,
            peer: Peer::new(from),
            counters: LinkCounters::default(),
            session: None,
            pending: None,
            message: Message::new(),
            ended: false,
        })
    }

    /// Returns the tag map.
    pub fn tags(&self) -> &TagMap {
        &self.tags
    }
}

/// Contents of a valid report.
struct Report {
    state: RobotState,
    ipoc: u64,
}

/// Takes a datagram into the session, or counts its rejection.
fn take(
    tags: &TagMap,
    session: &mut Option<Session>,
    counters: &mut LinkCounters,
    datagram: &[u8],
    now: Nanos,
) -> Result<Option<Report>, LinkFault> {
    let Some(rob) = Rob::read(datagram, tags).ok().filter(|rob| rob.ipoc < i64::MAX as u64 / 1_000_000) else {
        counters.malformed += 1;
        return Ok(None);
    };
    if !rob.is_complete(tags) {
        counters.malformed += 1;
        // The first message shows whether the map matches the context; later mismatches are damaged messages.
        return if session.is_none() { Err(LinkFault::Mismatch("a mapped RSI element is not sent")) } else { Ok(None) };
    }
    let state = state(&rob, tags, now);
    if !believable(&rob, &state) {
        counters.malformed += 1;
        return Ok(None);
    }
    let Some(known) = session else {
        let start = state.set_point();
        *session = Some(Session::new(start, &rob, now));
        return Ok(Some(Report { state, ipoc: rob.ipoc }));
    };
    if known.is_repeated_by(&rob, now, tags.cycle) {
        (known.received, known.delay) = (now, rob.delay);
        return Ok(Some(Report { state, ipoc: rob.ipoc }));
    }
    if rob.ipoc <= known.ipoc {
        counters.stale += 1;
        return Ok(None);
    }
    let growth = rob.ipoc - known.ipoc;
    if growth > MAX_IPOC_GROWTH {
        counters.malformed += 1;
        return Ok(None);
    }
    (known.ipoc, known.answered, known.received, known.delay) = (rob.ipoc, false, now, rob.delay);
    known.growth = known.growth.min(growth);
    let cycles = growth / known.growth;
    counters.lost += cycles - 1;
    if cycles > SESSION_CYCLES {
        // Possibly a new session, with a new reference of its corrections.
        if known.moved {
            return Err(LinkFault::Stopped(
                "its controller was silent too long: its corrections may have a new reference",
            ));
        }
        let start = state.set_point();
        (known.start, known.target) = (start, start);
    }
    Ok(Some(Report { state, ipoc: rob.ipoc }))
}

/// Returns the axes of a report: joints \[rad\], rail \[m\]; 0 without a rail, whatever the external axes.
fn axes(joints: [f64; 6], external: [f64; 6], rail: bool) -> [f64; AXES] {
    let mut axes = [0.0; AXES];
    for (axis, degrees) in axes.iter_mut().zip(joints) {
        *axis = degrees.to_radians();
    }
    axes[RAIL] = if rail { external[0] * 1e-3 } else { 0.0 };
    axes
}

fn state(rob: &Rob, tags: &TagMap, now: Nanos) -> RobotState {
    let target = (tags.axes_asked.is_some()).then(|| {
        // Without reported set-points the rail holds its measured position.
        let external = if tags.external_asked.is_some() { RsiGroup::ExternalAsked } else { RsiGroup::External };
        axes(rob.group(RsiGroup::AxesAsked), rob.group(external), tags.rail)
    });
    let torque = tags.torque.as_ref().map(|_| {
        let joints = rob.group(RsiGroup::Torque);
        std::array::from_fn(|axis| joints.get(axis).copied().unwrap_or(0.0))
    });
    let pose = tags.pose.as_ref().map(|_| {
        let [x, y, z, a, b, c] = rob.group(RsiGroup::Pose);
        let attitude = attitude::from_zyx([a.to_radians(), b.to_radians(), c.to_radians()]);
        Pose { position: vec3(x * 1e-3, y * 1e-3, z * 1e-3), attitude }
    });
    RobotState {
        stamp: Nanos(rob.ipoc as i64 * 1_000_000),
        received: now,
        position: axes(rob.group(RsiGroup::Axes), rob.group(RsiGroup::External), tags.rail),
        reported_set_point: target,
        torque,
        pose,
        late_answers: rob.delay,
        ready: true,
    }
}

fn believable(rob: &Rob, state: &RobotState) -> bool {
    plausible(&state.position)
        && state.reported_set_point.is_none_or(|target| plausible(&target))
        && state.torque.is_none_or(|torque| torque.iter().all(|value| value.abs() <= MAX_EFFORT))
        && rob.group(RsiGroup::Pose).iter().all(|value| value.abs() <= MAX_POSE)
}

/// Returns the answer for a command, and the resulting set-points.
fn answer(tags: &TagMap, session: &Session, order: &Order, ipoc: u64) -> Result<(Sen, [f64; AXES]), LinkFault> {
    let target = match order {
        Order::Hold => session.target,
        Order::Move(target) | Order::End(target) => *target,
    };
    if !plausible(&target) {
        return Err(LinkFault::Unsendable("an axis is not a number or outside every range"));
    }
    let from = match tags.mode {
        Correction::Absolute => session.start,
        Correction::Relative => session.target,
    };
    let correction: [f64; AXES] = std::array::from_fn(|axis| target[axis] - from[axis]);
    if !tags.rail && correction[RAIL].abs() > 1e-9 {
        return Err(LinkFault::Unsendable("this robot has no rail"));
    }
    let written: [f64; AXES] = std::array::from_fn(|axis| match axis {
        RAIL => as_written(correction[RAIL] * 1e3),
        _ => as_written(correction[axis].to_degrees()),
    });
    let sen = Sen {
        axes: std::array::from_fn(|axis| Some(written[axis])),
        rail: Some(written[RAIL]),
        stop: matches!(order, Order::End(_)),
        ipoc,
    };
    // Counts the written values: increments below the last decimal must not be lost.
    let target = std::array::from_fn(|axis| match axis {
        RAIL => from[RAIL] + written[RAIL] * 1e-3,
        _ => from[axis] + written[axis].to_radians(),
    });
    Ok((sen, target))
}

/// Rounds a value to six decimals.
fn as_written(value: f64) -> f64 {
    (value * 1e6).round() * 1e-6
}

impl<P: Port> RobotLink for RsiRobot<P> {
    fn capabilities(&self) -> Capabilities {
        Capabilities {
            cycle: self.tags.cycle,
            master: true,
            rail: self.tags.rail,
            torque: self.tags.torque.is_some(),
            pose: self.tags.pose.is_some(),
        }
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        let Self { port, tags, peer, counters, session, ended, .. } = self;
        let mut fault = None;
        let (report, taken) = link::newest(port, deadline, |datagram, from, now| {
            if !peer.admits(from) {
                counters.foreign += 1;
                return None;
            }
            counters.received += 1;
            let report = take(tags, session, counters, datagram, now).unwrap_or_else(|mismatch| {
                fault = Some(mismatch);
                None
            })?;
            peer.settle(from);
            Some(report)
        })?;
        if let Some(mismatch) = fault.filter(|_| report.is_none()) {
            return Err(mismatch);
        }
        let Some(Report { mut state, ipoc }) = report else {
            return Ok(None);
        };
        // Overtaken reports, and one that was not answered, stay unanswered.
        counters.overtaken += taken - 1;
        counters.unsent += taken - 1 + u64::from(self.pending.is_some());
        self.pending = Some(Pending { ipoc, over: state.received + tags.cycle });
        state.ready = !*ended;
        Ok(Some(state))
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        let (Some(mut session), Some(to)) = (self.session, self.peer.address()) else {
            return Ok(());
        };
        // Nothing new to answer: a second answer to one report would be stale in the controller's socket.
        let Some(pending) = self.pending.take() else {
            self.counters.unsent += 1;
            return Ok(());
        };
        // The end request is repeated, in case an answer was lost.
        let end = Order::End(session.target);
        let order = if self.ended { &end } else { order };
        let (sen, target) = answer(&self.tags, &session, order, pending.ipoc)?;
        sen.write(&self.tags, &mut self.message).map_err(|_| LinkFault::Unsendable("the message is too long"))?;
        if self.port.now() >= pending.over {
            self.counters.unsent += 1;
            return Ok(());
        }
        self.port.send(self.message.as_bytes(), to)?;
        session.target = target;
        session.answered = true;
        session.moved |= matches!(order, Order::Move(_));
        self.session = Some(session);
        self.ended |= sen.stop;
        Ok(())
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}
