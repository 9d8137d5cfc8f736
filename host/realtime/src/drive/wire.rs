//! What goes onto the wire to one robot, in that robot's own cycle, and what the robot has taken of it.
//!
//! A robot that has not taken an answer holds its set-point. The next answer starts there, at rest: a path that heals
//! never gives the robot the way of all lost cycles in one. Robots with cycles shorter than the master's are led on a
//! cubic between the master's commands.

use crate::limiter::Limiter;
use crate::signals::{AXES, Capabilities, LinkCounters, Order, RobotState, of_axis};
use crate::time::Nanos;
use softdock_campaign::station::AxisLimits;

/// Set-points that are remembered: a robot reports one of the last ones, or one between two of them.
const REMEMBERED: usize = 16;
/// How far a reported set-point may lie from those that were sent: rounding on the wire and the robot's own filter
/// \[rad\], \[m\].
const NEAR: [f64; 2] = [2e-4, 2e-4];

/// A report of a robot that gives the beat came too early if its clock shows less than this share of the least step
/// between two reports at rest,
const EARLY: f64 = 0.9;
/// or if its reports are ahead of our clock by this many cycles.
const AHEAD: f64 = 1.5;
/// Rate by which a robot's clock may be faster than ours.
const DRIFT: f64 = 0.02;

/// How a robot stands to what it has been sent; all of it counts from its first answer with a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireState {
    /// Answers that the robot has not taken.
    pub untaken: u64,
    /// The same in a row.
    pub untaken_in_row: u32,
    /// Cycles in a row in which the robot has reported a set-point that nobody here has sent.
    pub off_course: u32,
    /// Reports that came too early: the robot's cycle has become shorter than it was.
    pub early: u32,
    /// Cycles in a row in which it is away from its commands and led back within its limits.
    pub led_back: u32,
    /// 1 while what it is sent moves.
    pub moving: u32,
}

/// The last stage before a robot's link.
#[derive(Clone, Debug)]
pub struct Wire {
    limits: [AxisLimits; AXES],
    cycle: Nanos,
    /// Its reports give the beat; otherwise we do.
    beats: bool,
    /// Stamp and arrival of its last report, and the least growth of the stamp before any motion.
    last: Option<(Nanos, Nanos)>,
    growth: Nanos,
    /// How much sooner than a cycle after the last ones its reports have come, as far as no pause has made up for it.
    ahead: f64,
    /// Answers between two commands of the master.
    share: u32,
    limiter: Option<Limiter>,
    /// The limiter before the last answer, in case that one is not taken.
    before: Option<Limiter>,
    answered: bool,
    /// Late answers and reports that never reached us, as the last report had them.
    counted: Option<(u32, u64)>,
    /// Set-point of the robot's last report.
    set_point: [f64; AXES],
    sent: [[f64; AXES]; REMEMBERED],
    /// The master's last commands, newest first, and how many answers have gone out since the newest.
    knots: [[f64; AXES]; 3],
    since: u32,
    state: WireState,
}

impl Wire {
    /// A wire to a robot, under a master of another cycle; the limits are those of its axes.
    pub fn new(limits: [AxisLimits; AXES], robot: Capabilities, master: Nanos) -> Self {
        let cycle = robot.cycle;
        let share = ((master.0 as f64 / cycle.0 as f64).round() as u32).max(1);
        Self {
            limits,
            cycle,
            beats: robot.master,
            last: None,
            growth: Nanos(i64::MAX),
            ahead: 0.0,
            share,
            limiter: None,
            before: None,
            answered: false,
            counted: None,
            set_point: [0.0; AXES],
            sent: [[0.0; AXES]; REMEMBERED],
            knots: [[0.0; AXES]; 3],
            since: 0,
            state: WireState::default(),
        }
    }

    /// How the robot stands to what it has been sent.
    pub fn state(&self) -> WireState {
        self.state
    }

    /// The limiter, once a motion has been sent.
    pub fn limiter(&self) -> Option<&Limiter> {
        self.limiter.as_ref()
    }

    /// A report of the robot: what it has taken, and where its set-point is.
    ///
    /// A controller counts the cycles in which no answer came in time. As many more as reports were lost on their way to
    /// us, or overtaken, have had none of ours; one more, and the last answer was not taken either.
    pub fn reported(&mut self, report: &RobotState, counters: &LinkCounters) {
        let now = (report.late_answers, counters.lost + counters.overtaken);
        let (late, passed) = self.counted.unwrap_or(now);
        self.counted = Some(now);
        self.set_point = report.set_point();
        self.beat(report);
        let Some(limiter) = &mut self.limiter else { return };
        let unseen = now.1 - passed;
        let missing = u64::from(report.late_answers.saturating_sub(late));
        let taken = self.answered && missing <= unseen;
        if self.answered && !taken {
            // The limiter as it was: what it has sent since has not happened.
            *limiter =
                self.before.clone().unwrap_or_else(|| Limiter::new(self.limits, self.cycle.seconds(), self.set_point));
            self.state.untaken += 1;
        }
        let held = unseen + u64::from(!taken);
        self.state.untaken += unseen;
        if held > 0 {
            limiter.rest();
            self.state.led_back = self.state.led_back.max(1);
            self.state.untaken_in_row += held as u32;
        } else {
            self.state.untaken_in_row = 0;
        }
        self.answered = false;
        let told = report.asked.is_none_or(|asked| self.has_sent(&asked));
        self.state.off_course = if told { 0 } else { self.state.off_course + 1 };
    }

    /// Compares a report's time with that of the one before: commands that are made for one cycle must not go to a robot
    /// that takes them in a shorter one.
    fn beat(&mut self, report: &RobotState) {
        let now = (report.stamp, report.received);
        let Some(last) = self.last.replace(now).filter(|_| self.beats) else { return };
        let grown = now.0 - last.0;
        if self.limiter.is_none() {
            self.growth = self.growth.min(grown);
            return;
        }
        let cycles = (now.1 - last.1).0 as f64 / self.cycle.0 as f64;
        self.ahead = (self.ahead + 1.0 - DRIFT - cycles).max(0.0);
        let early = (grown.0 as f64) < EARLY * self.growth.0 as f64 && self.growth.0 < i64::MAX;
        self.state.early += u32::from(early || self.ahead > AHEAD);
    }

    /// Whether a set-point lies within what was sent of late.
    fn has_sent(&self, asked: &[f64; AXES]) -> bool {
        asked.iter().enumerate().all(|(i, asked)| {
            let near = of_axis(NEAR, i);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for sent in &self.sent {
                (least, most) = (least.min(sent[i]), most.max(sent[i]));
            }
            (least - near..=most + near).contains(asked)
        })
    }

    /// A new command of the master, for the end of its cycle.
    pub fn command(&mut self, order: &Order) {
        if let Order::Move(axes) | Order::End(axes) = order {
            if self.limiter.is_none() {
                let limiter = Limiter::new(self.limits, self.cycle.seconds(), self.set_point);
                (self.limiter, self.sent, self.knots) = (Some(limiter), [self.set_point; REMEMBERED], [*axes; 3]);
            }
            self.knots = [*axes, self.knots[0], self.knots[1]];
            self.since = 0;
        }
    }

    /// The order as it may go onto the wire now; `stopping` once the session is being stopped. Nothing goes to a robot
    /// that follows somebody else, or in another cycle: what we have asked for so far means something else to it.
    pub fn answer(&mut self, order: &Order, stopping: bool) -> Option<Order> {
        if self.state.off_course > 0 || self.state.early > 0 {
            return None;
        }
        self.since += 1;
        let wanted = self.wanted();
        let Some(limiter) = self.limiter.as_mut().filter(|_| !matches!(order, Order::Hold)) else {
            return Some(*order);
        };
        self.before = Some(limiter.clone());
        // Away from its commands a robot is stopped where it is, and led nowhere any more.
        let away = stopping && self.state.led_back > 0;
        let axes = if away { limiter.stop() } else { limiter.approach(&wanted).0 };
        self.state.led_back = if axes == wanted { 0 } else { self.state.led_back + 1 };
        self.state.moving = u32::from(!limiter.at_rest());
        self.sent.rotate_right(1);
        self.sent[0] = axes;
        self.answered = true;
        Some(if matches!(order, Order::End(_)) { Order::End(axes) } else { Order::Move(axes) })
    }

    /// Where the robot shall be at the end of its cycle: on a cubic between the master's commands.
    fn wanted(&self) -> [f64; AXES] {
        let [to, from, earlier] = &self.knots;
        if self.since >= self.share {
            return *to;
        }
        let u = f64::from(self.since) / f64::from(self.share);
        // Hermite's cubic with the mean speeds of both commands at its ends.
        let (second, third) = (u * u * (3.0 - 2.0 * u), u * (1.0 - u));
        std::array::from_fn(|i| {
            let (before, now) = (from[i] - earlier[i], to[i] - from[i]);
            from[i] + now * second + third * (before * (1.0 - u) - now * u)
        })
    }

    /// The next step of a stop without the master.
    pub fn stop(&mut self) -> Option<[f64; AXES]> {
        let limiter = self.limiter.as_mut()?;
        let axes = limiter.stop();
        self.state.moving = u32::from(!limiter.at_rest());
        Some(axes)
    }
}
