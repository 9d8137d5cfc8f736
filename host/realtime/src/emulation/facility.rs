//! The emulated facility behind its protocols: one physics clock and three endpoints; the caller advances the time.

use super::world::World;
use crate::protocol::{EmulatedController, SensorBox};
use crate::signals::{AXES, ForceSample, RobotState};
use crate::time::Nanos;
use crate::wire::relay::Endpoint;
use softdock_kernels::monitor::Watch;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Takes the datagrams that the facility sends: endpoint, receiver, bytes.
pub type Wires<'a> = &'a mut dyn FnMut(Endpoint, SocketAddr, &[u8]);

/// Fault of the emulated sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ailment {
    /// None.
    None,
    /// Reported saturation.
    Saturated,
    /// Reported invalid samples.
    Invalid,
    /// No measured contact, only the weight of the tool.
    Blind,
    /// No samples.
    Silent,
    /// The same sample repeatedly.
    Stuck,
}

/// Two controllers and a sensor's electronics around one physical world.
pub struct EmulatedFacility {
    world: World,
    controllers: [Box<dyn EmulatedController>; 2],
    sensor: Box<dyn SensorBox>,
    tick: Nanos,
    /// Due times: physics tick, reports of robots 1 and 2, sample.
    due: [Nanos; 4],
    /// Before its first report a controller has no session, and its robot stands.
    begun: [bool; 2],
    sequence: u32,
    last: Option<ForceSample>,
    ailment: Ailment,
    /// Blocked axes with their positions.
    held: [Option<(usize, f64)>; 2],
    /// Offset of the next sample \[N\].
    knock: f64,
    /// Renewal of sessions; `None`: the first ones are the last.
    renewal: Option<Renewal>,
    /// Set-points of both robots at the begin of each of their cycles, if recorded.
    set_points: Option<[Vec<SetPoint>; 2]>,
    begins_in_motion: [bool; 2],
}

/// Renewal of ended sessions.
#[derive(Debug, Default)]
struct Renewal {
    /// Time without clients after which the parts are released.
    pause: Nanos,
    /// Reason for the end of each robot's last session.
    causes: [Option<&'static str>; 2],
    /// Axes of both robots when the first client began to command one; `None` without a client.
    begin: Option<[[f64; AXES]; 2]>,
    /// Time since which no client commands them.
    alone_since: Option<Nanos>,
    /// Contact of the previous session.
    last: Option<Watch<f64>>,
    /// Number of renewals.
    over: Arc<AtomicU32>,
}

/// Set-point of an emulated robot's controller at the begin of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoint {
    /// Time.
    pub at: Nanos,
    /// Joints \[rad\], rail \[m\].
    pub axes: [f64; AXES],
    /// Answers that were late or missing so far.
    pub late_answers: u32,
}

impl EmulatedFacility {
    /// Creates a facility that begins at a time; robot 2's cycles begin `phase` after robot 1's.
    pub fn new(
        world: World,
        controllers: [Box<dyn EmulatedController>; 2],
        sensor: Box<dyn SensorBox>,
        begin: Nanos,
        phase: Nanos,
    ) -> Self {
        let tick = Nanos::from_seconds(world.tick_seconds());
        let first = begin + tick;
        let due = [first, first, first + phase, first];
        Self {
            world,
            controllers,
            sensor,
            tick,
            due,
            begun: [false; 2],
            sequence: 0,
            last: None,
            ailment: Ailment::None,
            held: [None; 2],
            knock: 0.0,
            renewal: None,
            set_points: None,
            begins_in_motion: [false; 2],
        }
    }

    /// Offers new sessions after one has ended or lost its client. The robots hold; after `pause` without clients the
    /// latch opens, touching parts are separated towards the start of the session, and the controllers offer new
    /// sessions. Returns the counter of ended sessions.
    pub fn renew_sessions(&mut self, pause: Nanos) -> Arc<AtomicU32> {
        let renewal = Renewal { pause, ..Renewal::default() };
        let over = Arc::clone(&renewal.over);
        self.renewal = Some(renewal);
        over
    }

    /// Moves the begin to another time; must be called before any event is due.
    pub fn begin(&mut self, at: Nanos) {
        let shift = at + self.tick - self.due[0];
        self.due = self.due.map(|due| due + shift);
    }

    /// Returns the time of the next event.
    pub fn next(&self) -> Nanos {
        self.due.into_iter().min().unwrap_or_default()
    }

    /// Processes all events that are due by a time, in order.
    pub fn run_until(&mut self, now: Nanos, out: Wires) {
        loop {
            let at = self.next();
            if at > now {
                return;
            }
            // The physics first: reports of an instant include its tick.
            match self.due.iter().position(|due| *due == at) {
                Some(0) => self.step(at),
                Some(3) => self.sample(at, out),
                Some(robot) => self.report(robot - 1, at, out),
                None => return,
            }
        }
    }

    fn step(&mut self, at: Nanos) {
        let targets = [0, 1].map(|robot: usize| self.target(robot, at));
        self.world.tick(&targets);
        self.due[0] = at + self.tick;
    }

    /// Returns the targets of a robot's axes.
    fn target(&mut self, robot: usize, at: Nanos) -> [f64; AXES] {
        let mut target = match self.begun[robot] {
            true => self.controllers[robot].target(at),
            false => self.world.robot(robot).position,
        };
        if let Some((axis, at)) = self.held[robot] {
            target[axis] = at;
        }
        target
    }

    fn report(&mut self, robot: usize, at: Nanos, out: Wires) {
        // The last tick was this long ago; there is none before the first.
        let since = (at - (self.due[0] - self.tick)).seconds();
        let reading = self.world.robot_after(robot, since.max(0.0));
        let state = RobotState {
            stamp: at,
            received: at,
            position: reading.position,
            reported_set_point: None,
            torque: reading.torque,
            pose: Some(reading.pose),
            late_answers: 0,
            ready: true,
        };
        let endpoint = if robot == 0 { Endpoint::Robot1 } else { Endpoint::Robot2 };
        self.begun[robot] = true;
        let controller = &mut self.controllers[robot];
        controller.report(at, &state, &mut |to, datagram| out(endpoint, to, datagram));
        if let Some(seen) = &mut self.set_points {
            let (axes, late_answers) = (controller.target(at), controller.late_answers());
            seen[robot].push(SetPoint { at, axes, late_answers });
        }
        self.due[1 + robot] = at + controller.cycle();
        self.update_session(robot, at);
    }

    /// Releases the parts once all clients are gone, then offers new sessions.
    fn update_session(&mut self, robot: usize, at: Nanos) {
        let busy = self.controllers.iter().any(|controller| controller.has_client());
        let held = [0, 1].map(|robot: usize| self.target(robot, at));
        let Some(renewal) = &mut self.renewal else { return };
        renewal.causes[robot] = self.controllers[robot].fault().or(renewal.causes[robot]);
        if busy {
            renewal.begin.get_or_insert(held);
            renewal.alone_since = None;
            return;
        }
        let Some(begin) = renewal.begin else { return };
        if at - *renewal.alone_since.get_or_insert(at) >= renewal.pause {
            (renewal.begin, renewal.alone_since) = (None, None);
            renewal.last = Some(self.world.watch());
            renewal.over.fetch_add(1, Ordering::Relaxed);
            let apart = self.world.apart(&held, &begin);
            self.world.release(&apart);
            self.controllers.iter_mut().zip(apart).for_each(|(controller, at)| controller.renew(at));
            // Later datagrams belong to the new sessions.
            self.set_points.iter_mut().flatten().for_each(Vec::clear);
        }
    }

    fn sample(&mut self, at: Nanos, out: Wires) {
        self.due[3] = at + self.sensor.period();
        self.sequence = self.sequence.wrapping_add(1);
        let mut wrench = match self.ailment {
            Ailment::Blind => self.world.reading_without_contact(),
            _ => self.world.reading(),
        };
        wrench.force.z += std::mem::take(&mut self.knock);
        let fresh = ForceSample {
            saturated: self.ailment == Ailment::Saturated || self.world.saturated(),
            invalid: self.ailment == Ailment::Invalid,
            ..ForceSample::new(at, self.sequence, wrench)
        };
        let sample = match (self.ailment, self.last) {
            (Ailment::Silent, _) => return,
            (Ailment::Stuck, Some(last)) => last,
            _ => fresh,
        };
        self.last = Some(sample);
        self.sensor.report(at, &sample, &mut |to, datagram| out(Endpoint::Sensor, to, datagram));
    }

    /// Delivers a datagram to an endpoint.
    pub fn take(&mut self, endpoint: Endpoint, now: Nanos, from: SocketAddr, datagram: &[u8], out: Wires) {
        let mut out = |to: SocketAddr, datagram: &[u8]| out(endpoint, to, datagram);
        match endpoint {
            Endpoint::Robot1 => self.controllers[0].take(now, from, datagram, &mut out),
            Endpoint::Robot2 => self.controllers[1].take(now, from, datagram, &mut out),
            Endpoint::Sensor => self.sensor.take(now, from, datagram, &mut out),
        }
    }

    /// Whether the recorded set-points of robot 0 or 1 begin during a motion.
    pub fn begins_in_motion(&self, robot: usize) -> bool {
        self.begins_in_motion[robot]
    }

    /// Records the robots' set-points from now on.
    pub fn keep_set_points(&mut self) {
        self.set_points = Some([Vec::new(), Vec::new()]);
    }

    /// Returns the recorded set-points of robot 0 or 1, cycle by cycle.
    pub fn set_points(&self, robot: usize) -> &[SetPoint] {
        self.set_points.as_ref().map_or(&[], |both| &both[robot])
    }

    /// Ends the controller of robot 0 or 1, jogs its axis, and starts another controller after a time.
    pub fn begin_again(
        &mut self,
        robot: usize,
        other: Box<dyn EmulatedController>,
        axis: usize,
        by: f64,
        after: Nanos,
    ) {
        self.controllers[robot] = other;
        self.begun[robot] = false;
        self.due[1 + robot] += after;
        let mut axes = [0, 1].map(|robot| self.world.robot(robot).position);
        axes[robot][axis] += by;
        self.world.set_axes(&axes);
        // Later datagrams belong to the new session.
        if let Some(seen) = &mut self.set_points {
            seen[robot].clear();
        }
        self.begins_in_motion[robot] = false;
    }

    /// Changes the cycle of the controller of robot 0 or 1.
    pub fn change_cycle(&mut self, robot: usize, cycle: Nanos) {
        self.controllers[robot].change_cycle(cycle);
        // The answer taken was meant for the previous cycle.
        if let Some(seen) = &mut self.set_points {
            seen[robot].clear();
        }
        self.begins_in_motion[robot] = true;
    }

    /// Blocks an axis of robot 0 or 1 at its position, whatever its controller commands, or releases it.
    pub fn hold_axis(&mut self, robot: usize, axis: Option<usize>) {
        self.held[robot] = axis.map(|axis| (axis, self.world.robot(robot).position[axis]));
    }

    /// Adds an offset along the sensor's z axis to the next sample \[N\].
    pub fn knock(&mut self, force: f64) {
        self.knock = force;
    }

    /// Sets the fault of the sensor.
    pub fn ail(&mut self, ailment: Ailment) {
        self.ailment = ailment;
    }

    /// Returns the reason why robot 0 or 1 has stopped following, if it has.
    pub fn fault(&self, robot: usize) -> Option<&'static str> {
        self.controllers[robot].fault()
    }

    /// Returns the reason for the end of robot 0's or 1's last session, if one has ended.
    pub fn last_end(&self, robot: usize) -> Option<&'static str> {
        self.fault(robot).or_else(|| self.renewal.as_ref().and_then(|renewal| renewal.causes[robot]))
    }

    /// Returns the contact history of this session, or of the previous one if no client has commanded a robot since.
    pub fn watch(&self) -> Watch<f64> {
        let before = self.renewal.as_ref().filter(|renewal| renewal.begin.is_none()).and_then(|renewal| renewal.last);
        before.unwrap_or_else(|| self.world.watch())
    }

    /// Returns the physical world.
    pub fn world(&self) -> &World {
        &self.world
    }
}
