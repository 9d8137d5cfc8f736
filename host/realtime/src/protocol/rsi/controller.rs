//! The emulated KUKA controller: the reaction of a KRC with an RSI context to our answers.

use super::codec::{Message, Rob, Sen};
use super::tags::{Correction, RsiGroup, TagMap};
use crate::protocol::{EmulatedController, Line, Outbox, attitude};
use crate::signals::{AXES, RAIL, RobotState};
use crate::time::Nanos;
use std::net::SocketAddr;

/// Limits and settings of the context, in the controller's units.
#[derive(Clone, Debug, PartialEq)]
pub struct KrcSettings {
    /// Elements, `SENTYPE`, mode and cycle.
    pub tags: TagMap,
    /// Address that it sends to (`IP_NUMBER` and `PORT` of its `rsi_ethernet.xml`).
    pub client: SocketAddr,
    /// IPOC of its first message \[ms\].
    pub first_ipoc: u64,
    /// Missing answers at which RSI stops with an error (`Timeout` of the ETHERNET object).
    pub timeout: u32,
    /// Whether the time-out counts all missing answers, or successive ones only.
    pub accumulate: bool,
    /// Whether it waits for the client: missing answers count only after the first one.
    pub patient: bool,
    /// Whether it repeats its IPOC until it is answered, as the ROS-Industrial simulator does and no KRC.
    pub repeats: bool,
    /// `HOLDON`: a lost answer keeps the last value; otherwise the value falls back to 0.
    pub hold_on: bool,
    /// `AXISCORR` lower limits: joints \[deg\], rail \[mm\]; a correction is clamped there.
    pub lower: [f64; AXES],
    /// `AXISCORR` upper limits.
    pub upper: [f64; AXES],
    /// `AXISCORRMON` limits of the total correction: beyond them RSI stops with an error.
    pub monitor: [f64; AXES],
}

impl KrcSettings {
    /// Creates a context with wide limits (joints 170 deg, rail 5 m), otherwise that of the open ROS driver.
    pub fn new(tags: TagMap, client: SocketAddr) -> Self {
        let mut upper = [170.0; AXES];
        upper[RAIL] = 5000.0;
        let hold_on = tags.mode == Correction::Absolute;
        Self {
            tags,
            client,
            first_ipoc: 4_208_163_634,
            timeout: 100,
            accumulate: false,
            patient: true,
            repeats: false,
            hold_on,
            lower: upper.map(|limit| -limit),
            upper,
            monitor: upper.map(|limit| 2.0 * limit),
        }
    }
}

/// An emulated KRC.
///
/// The interpolator moves linearly over the next cycle to an answer that arrived within its own cycle.
pub struct Krc {
    settings: KrcSettings,
    ipoc: u64,
    /// Set-points at `RSI_ON`: joints \[rad\], rail \[m\].
    start: Option<[f64; AXES]>,
    /// Set-points at the end of the previous session, at which the next one begins.
    held: Option<[f64; AXES]>,
    /// The client's correction of this cycle: joints \[deg\], rail \[mm\].
    correction: [f64; AXES],
    /// The total correction since `RSI_ON`, clamped.
    total: [f64; AXES],
    /// The interpolator's line: from, to, begin.
    line: Line,
    answered: bool,
    ever_answered: bool,
    missed: u32,
    late: u32,
    fault: Option<&'static str>,
    message: Message,
}

impl Krc {
    /// Creates a controller before `RSI_ON`.
    pub fn new(settings: KrcSettings) -> Self {
        Self {
            ipoc: settings.first_ipoc,
            settings,
            start: None,
            held: None,
            correction: [0.0; AXES],
            total: [0.0; AXES],
            line: Line::default(),
            answered: false,
            ever_answered: false,
            missed: 0,
            late: 0,
            fault: None,
            message: Message::new(),
        }
    }

    /// Returns the total correction since `RSI_ON`, clamped: joints \[deg\], rail \[mm\].
    pub fn correction(&self) -> [f64; AXES] {
        self.total
    }

    /// Ends a cycle: counts a missing answer, and starts the interpolation to the new correction.
    fn close_cycle(&mut self, now: Nanos) {
        self.count_answer();
        let settings = &self.settings;
        for axis in 0..AXES {
            let wanted = match settings.tags.mode {
                Correction::Absolute => self.correction[axis],
                Correction::Relative => self.total[axis] + self.correction[axis],
            };
            self.total[axis] = wanted.clamp(settings.lower[axis], settings.upper[axis]);
            if self.total[axis].abs() > settings.monitor[axis] {
                self.fault = Some("AXISCORRMON: correction beyond its limit");
            }
        }
        let from = self.line.at(now, settings.tags.cycle);
        let start = self.start.unwrap_or(from);
        let to = if self.fault.is_some() { from } else { offset(start, self.total) };
        self.line = Line { from, to, since: now };
    }

    fn count_answer(&mut self) {
        if self.answered || (self.settings.patient && !self.ever_answered) {
            self.missed = if self.settings.accumulate { self.missed } else { 0 };
            return;
        }
        self.missed += 1;
        self.late += 1;
        if !self.settings.hold_on {
            self.correction = [0.0; AXES];
        }
        if self.missed >= self.settings.timeout {
            self.fault = Some("RSI: too many answers late or missing");
        }
    }
}

/// Adds a correction in deg and mm to set-points.
fn offset(start: [f64; AXES], correction: [f64; AXES]) -> [f64; AXES] {
    std::array::from_fn(|axis| match axis {
        RAIL => start[RAIL] + correction[RAIL] * 1e-3,
        _ => start[axis] + correction[axis].to_radians(),
    })
}

impl EmulatedController for Krc {
    fn cycle(&self) -> Nanos {
        self.settings.tags.cycle
    }

    fn change_cycle(&mut self, cycle: Nanos) {
        self.settings.tags.cycle = cycle;
    }

    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], _out: Outbox) {
        let running = self.fault.is_none() && self.start.is_some() && from.ip() == self.settings.client.ip();
        let Some(sen) = Sen::read(datagram, &self.settings.tags).ok().filter(|_| running) else {
            return;
        };
        // `Delay` has already counted the answer to an older cycle as late.
        if sen.ipoc != self.ipoc || self.answered {
            return;
        }
        (self.answered, self.ever_answered) = (true, true);
        let rail = sen.rail.filter(|_| self.settings.tags.rail);
        for (axis, given) in sen.axes.into_iter().chain([rail]).enumerate() {
            let kept = if self.settings.hold_on { self.correction[axis] } else { 0.0 };
            self.correction[axis] = given.unwrap_or(kept);
        }
        if sen.stop {
            // The motion to the last correction is completed.
            self.close_cycle(now);
            self.fault = Some("RSI was ended by the client");
        }
    }

    fn target(&mut self, now: Nanos) -> [f64; AXES] {
        self.line.at(now, self.settings.tags.cycle)
    }

    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox) {
        if self.fault.is_some() {
            // Its time continues without RSI.
            self.ipoc += self.settings.tags.cycle_millis();
            return;
        }
        if self.start.is_none() {
            let start = self.held.take().unwrap_or_else(|| state.set_point());
            self.start = Some(start);
            self.line = Line { from: start, to: start, since: now };
        } else {
            self.close_cycle(now);
            if self.answered || !self.settings.repeats {
                self.ipoc += self.settings.tags.cycle_millis();
            }
        }
        self.answered = false;
        if self.fault.is_some() {
            return;
        }
        let rob = report(&self.settings.tags, state, self.line.from, self.late, self.ipoc);
        // Six decimals of plausible values fit; an implausible state is not sent.
        if rob.write(&self.settings.tags, &mut self.message).is_ok() {
            out(self.settings.client, self.message.as_bytes());
        }
    }

    fn late_answers(&self) -> u32 {
        self.late
    }

    fn fault(&self) -> Option<&'static str> {
        self.fault
    }

    fn has_client(&self) -> bool {
        self.ever_answered && self.fault.is_none()
    }

    fn renew(&mut self, at: [f64; AXES]) {
        let (settings, ipoc, since) = (self.settings.clone(), self.ipoc, self.line.since);
        *self = Self { ipoc, held: Some(at), line: Line { from: at, to: at, since }, ..Self::new(settings) };
    }
}

/// Creates the message of a cycle.
fn report(tags: &TagMap, state: &RobotState, asked: [f64; AXES], late: u32, ipoc: u64) -> Rob {
    let joints = |axes: &[f64; AXES]| std::array::from_fn(|axis| axes[axis].to_degrees());
    let rail = if tags.rail { 1e3 } else { 0.0 };
    let external = |axes: &[f64; AXES]| [axes[RAIL] * rail, 0.0, 0.0, 0.0, 0.0, 0.0];
    let pose = state.pose.map_or([0.0; 6], |pose| {
        let [a, b, c] = attitude::to_zyx(pose.attitude).map(f64::to_degrees);
        let position = pose.position * 1e3;
        [position.x, position.y, position.z, a, b, c]
    });
    let torque = state.torque.unwrap_or([0.0; AXES]);
    let mut rob = Rob::new(ipoc, late);
    for group in RsiGroup::ALL.into_iter().filter(|&group| tags.element(group).is_some()) {
        rob.set(
            group,
            match group {
                RsiGroup::Axes => joints(&state.position),
                RsiGroup::AxesAsked => joints(&asked),
                RsiGroup::External => external(&state.position),
                RsiGroup::ExternalAsked => external(&asked),
                RsiGroup::Pose | RsiGroup::PoseAsked => pose,
                RsiGroup::Torque => std::array::from_fn(|axis| torque[axis]),
            },
        );
    }
    rob
}
