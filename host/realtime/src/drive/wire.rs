//! Last stage of the commands to one robot, in that robot's own cycle, with the robot's acknowledgements.
//!
//! A robot that has not taken an answer holds its set-point. The next answer starts there, at rest: after an outage the
//! robot never receives the path of all lost cycles in one step. A robot with a shorter cycle than the master follows a
//! quadratic B-spline of the master's commands, half a master cycle behind them: its speed is linear between the
//! differences of successive commands, and its acceleration is the commanded one.

use crate::limiter::Limiter;
use crate::signals::{AXES, Capabilities, LinkCounters, Order, RobotState, WireState, of_axis};
use crate::time::Nanos;
use softdock_campaign::station::AxisLimits;

/// Number of stored set-points: a robot reports one of the last ones, or one between two of them.
const REMEMBERED: usize = 16;
/// Share of a timing difference that one answer corrects, if a robot is answered more or less often between two
/// commands than its cycle states.
const STEERING: f64 = 0.02;
/// Tolerance between reported and sent set-points: rounding on the wire and the robot's own filter \[rad\], \[m\].
const NEAR: [f64; 2] = [2e-4, 2e-4];

/// A report of the clock master is early if its stamp grows by less than this share of the least step between two
/// reports at rest,
const EARLY: f64 = 0.9;
/// or if its reports are ahead of our clock by this number of cycles.
const AHEAD: f64 = 1.5;
/// Longest pause, in cycles, after which reports may follow in a burst; a longer one ends the session by its own rule.
const PAUSE: f64 = 3.0;
/// Greatest rate difference between a robot's clock and ours; a lead or lag of reports decays at this rate.
const DRIFT: f64 = 0.02;

/// Last stage before a robot's link.
#[derive(Clone, Debug)]
pub struct Wire {
    limits: [AxisLimits; AXES],
    cycle: Nanos,
    /// The robot is the clock master; otherwise this machine is.
    beats: bool,
    /// Stamp and arrival of its last report, and the least growth of the stamp before any motion.
    last: Option<(Nanos, Nanos)>,
    growth: Nanos,
    /// Lead of its reports over our clock \[cycles\]; negative after a pause.
    ahead: f64,
    /// Answers between two commands of the master, at least 1.
    share: f64,
    limiter: Option<Limiter>,
    /// State of the limiter before the last answer, restored if that one is not taken.
    before: Option<Limiter>,
    answered: bool,
    /// Counts of late answers and of lost reports, as of the last report.
    counted: Option<(u32, u64)>,
    /// Set-point of the robot's last report.
    set_point: [f64; AXES],
    sent: [[f64; AXES]; REMEMBERED],
    /// The master's last commands, newest first.
    knots: [[f64; AXES]; 3],
    /// Answers since the newest command, in cycles of the master; continues over the next command.
    phase: f64,
    /// Earliness or lateness of the last command in that count.
    early: f64,
    state: WireState,
}

impl Wire {
    /// Creates the stage of a robot under a master of another cycle; the limits are those of its axes.
    pub fn new(limits: [AxisLimits; AXES], robot: Capabilities, master: Nanos) -> Self {
        let cycle = robot.cycle;
        let share = (master.0 as f64 / cycle.0 as f64).max(1.0);
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
            phase: 0.0,
            early: 0.0,
            state: WireState::default(),
        }
    }

    /// Returns the robot's state relative to its commands.
    pub fn state(&self) -> WireState {
        self.state
    }

    /// Returns the limiter, once a motion has been sent.
    pub fn limiter(&self) -> Option<&Limiter> {
        self.limiter.as_ref()
    }

    /// Takes a report of the robot: the answers that it took, and its set-point.
    ///
    /// A controller counts cycles without an answer in time. Each report that was lost or overtaken accounts for one of
    /// them; one more means that the last answer was not taken.
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
            // Restores the limiter: the commands sent since were not executed.
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
        let is_own_set_point = report.reported_set_point.is_none_or(|asked| self.has_sent(&asked));
        self.state.off_course = if is_own_set_point { 0 } else { self.state.off_course + 1 };
    }

    /// Compares the time of a report with that of the one before: commands for one cycle must not go to a robot that
    /// executes them in a shorter one.
    fn beat(&mut self, report: &RobotState) {
        let now = (report.stamp, report.received);
        if self.last.is_some_and(|last| last.0 == now.0) {
            // A report that is repeated until it is answered.
            return;
        }
        let Some(last) = self.last.replace(now).filter(|_| self.beats) else { return };
        let grown = now.0 - last.0;
        let cycles = (now.1 - last.1).0 as f64 / self.cycle.0 as f64;
        let ahead = (self.ahead + 1.0 - cycles).max(-PAUSE);
        self.ahead = ahead - ahead.clamp(-DRIFT, DRIFT);
        if self.limiter.is_none() {
            self.growth = self.growth.min(grown);
            self.ahead = self.ahead.min(0.0);
            return;
        }
        let early = (grown.0 as f64) < EARLY * self.growth.0 as f64 && self.growth.0 < i64::MAX;
        self.state.early += u32::from(early || self.ahead > AHEAD);
    }

    /// Whether a set-point lies within those sent recently.
    fn has_sent(&self, set_point: &[f64; AXES]) -> bool {
        set_point.iter().enumerate().all(|(i, set_point)| {
            let near = of_axis(NEAR, i);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for sent in &self.sent {
                (least, most) = (least.min(sent[i]), most.max(sent[i]));
            }
            (least - near..=most + near).contains(set_point)
        })
    }

    /// Takes a new command of the master, for the end of its cycle.
    pub fn command(&mut self, order: &Order) {
        if let Order::Move(axes) | Order::End(axes) = order {
            if self.limiter.is_none() {
                let limiter = Limiter::new(self.limits, self.cycle.seconds(), self.set_point);
                (self.limiter, self.sent, self.knots) = (Some(limiter), [self.set_point; REMEMBERED], [*axes; 3]);
                self.phase = 1.0;
            }
            self.knots = [*axes, self.knots[0], self.knots[1]];
            // After one answer more or less than usual the count continues from there: no step in speed.
            self.early = (self.phase - 1.0).clamp(-0.5, 0.5);
            self.phase = self.early;
        }
    }

    /// Limits a command before it is sent; `stopping` once the session is stopping. A robot with a foreign set-point or
    /// a different cycle receives no command: it would interpret the commands differently.
    pub fn answer(&mut self, order: &Order, stopping: bool) -> Option<Order> {
        if self.state.off_course > 0 || self.state.early > 0 {
            return None;
        }
        self.phase += (1.0 - STEERING * self.early) / self.share;
        let target = self.target();
        let Some(limiter) = self.limiter.as_mut().filter(|_| !matches!(order, Order::Hold)) else {
            return Some(*order);
        };
        self.before = Some(limiter.clone());
        // A robot away from its commands is stopped where it is and not led further.
        let away = stopping && self.state.led_back > 0;
        let axes = if away { limiter.stop() } else { limiter.approach(&target).0 };
        self.state.led_back = if axes == target { 0 } else { self.state.led_back + 1 };
        self.state.moving = u32::from(!limiter.at_rest());
        self.sent.rotate_right(1);
        self.sent[0] = axes;
        self.answered = true;
        Some(if matches!(order, Order::End(_)) { Order::End(axes) } else { Order::Move(axes) })
    }

    /// Returns the target of the robot at the end of its cycle.
    fn target(&self) -> [f64; AXES] {
        let [to, from, earlier] = &self.knots;
        if self.share <= 1.0 {
            return *to;
        }
        // Between the midpoints of the last two steps; from there straight to the last command, and no further.
        let (u, beyond) = (self.phase.clamp(0.0, 1.0), (self.phase - 1.0).clamp(0.0, 0.5));
        std::array::from_fn(|i| {
            let (before, now) = (from[i] - earlier[i], to[i] - from[i]);
            from[i] - 0.5 * before + before * u + 0.5 * (now - before) * u * u + now * beyond
        })
    }

    /// Returns the next step of a stop without the master.
    pub fn stop(&mut self) -> Option<[f64; AXES]> {
        let limiter = self.limiter.as_mut()?;
        let axes = limiter.stop();
        self.state.moving = u32::from(!limiter.at_rest());
        Some(axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::memory::state_at;

    const MASTER: Nanos = Nanos::from_millis(4);
    const SHORT: Nanos = Nanos::from_millis(1);
    const LIMIT: AxisLimits = AxisLimits { lower: -9.0, upper: 9.0, speed: 3.0, acceleration: 10.0, jerk: 1e5 };

    /// Returns the first-axis commands of a 1 ms robot under a 4 ms master, whose commands come after these numbers of
    /// answers.
    /// answers each.
    fn sent(commands: impl Fn(f64) -> f64, answers: impl Iterator<Item = usize>) -> Vec<f64> {
        let mut wire = Wire::new([LIMIT; AXES], robot(SHORT), MASTER);
        let (mut sent, mut now) = (Vec::new(), Nanos(0));
        let mut report = state_at([0.0; AXES], now);
        wire.reported(&report, &LinkCounters::default());
        for (cycle, answers) in answers.enumerate() {
            let order = Order::Move([commands(cycle as f64 * MASTER.seconds()); AXES]);
            wire.command(&order);
            for _ in 0..answers {
                now += SHORT;
                let Some(Order::Move(axes)) = wire.answer(&order, false) else { panic!("an answer") };
                sent.push(axes[0]);
                report = state_at(axes, now);
                wire.reported(&report, &LinkCounters::default());
            }
        }
        sent
    }

    /// Returns accelerations between positions a millisecond apart.
    fn accelerations(sent: &[f64]) -> Vec<f64> {
        sent.array_windows::<3>().map(|[a, b, c]| (c - 2.0 * b + a) / SHORT.seconds().powi(2)).collect()
    }

    /// Rest, then an acceleration of 2 rad/s^2 from 0.1 s on.
    fn pull_away(time: f64) -> f64 {
        (time - 0.1).max(0.0).powi(2)
    }

    /// Creates the stage of a robot that is the clock master.
    fn robot(cycle: Nanos) -> Capabilities {
        Capabilities { cycle, master: true, rail: true, torque: false, pose: true }
    }

    #[test]
    fn constant_master_acceleration_stays_constant_for_a_faster_robot() {
        let sent = sent(pull_away, std::iter::repeat_n(4, 100));
        let found = accelerations(&sent);
        assert!(found[..95].iter().all(|a| a.abs() < 1e-6), "at rest");
        assert!(found[110..].iter().all(|a| (a - 2.0).abs() < 1e-6), "{:?}", &found[110..130]);
        assert!(found.iter().all(|a| (-1e-6..2.0 + 1e-6).contains(a)), "no sign is reversed, nothing overshoots");
        // Half a master cycle behind its command for the end of the cycle.
        let end = pull_away(99.0 * MASTER.seconds() - 0.5 * MASTER.seconds());
        assert!((sent[399] - end).abs() < 1e-5, "{} {end}", sent[399]);
    }

    #[test]
    fn uneven_answers_cause_no_speed_steps() {
        let even = |time: f64| 0.2 * (1.0 - (time * 3.0).cos());
        // Occasionally one answer more, later one less; then a clock that is faster by 0.2 %.
        let uneven = (0..200).map(|cycle| match cycle % 20 {
            7 => 5,
            13 => 3,
            _ => 4,
        });
        let faster = (0..1000).map(|cycle| if cycle % 125 == 3 { 5 } else { 4 });
        for answers in [uneven.collect::<Vec<_>>(), faster.collect()] {
            let sent = sent(even, answers.into_iter());
            let found = accelerations(&sent[60..]);
            let most = found.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
            // An additional or missing answer with a standstill or a double step would cause 600.
            assert!(most < 5.0, "{most} rad/s^2 where the master asks for 1.8");
        }
    }

    #[test]
    fn last_command_is_reached_without_further_commands() {
        let mut wire = Wire::new([LIMIT; AXES], robot(SHORT), MASTER);
        wire.reported(&state_at([0.0; AXES], Nanos(0)), &LinkCounters::default());
        let mut last = 0.0;
        for cycle in 0..50 {
            let order = Order::Move([1e-4 * f64::from(cycle); AXES]);
            wire.command(&order);
            for _ in 0..if cycle == 49 { 100 } else { 4 } {
                let Some(Order::Move(axes)) = wire.answer(&order, false) else { panic!("an answer") };
                wire.reported(&state_at(axes, Nanos(0)), &LinkCounters::default());
                last = axes[0];
            }
        }
        assert!((last - 49e-4).abs() < 1e-12, "{last}");
    }

    /// Returns the number of early reports among reports with a counter stamp and these arrival times, in robot cycles.
    fn early_reports(arrivals: impl Iterator<Item = f64>) -> u32 {
        let mut wire = Wire::new([LIMIT; AXES], robot(MASTER), MASTER);
        for (cycle, arrival) in arrivals.enumerate() {
            let mut report = state_at([0.0; AXES], MASTER * cycle as i64);
            report.received = Nanos::from_seconds(arrival * MASTER.seconds());
            wire.reported(&report, &LinkCounters::default());
            let order = Order::Move([0.0; AXES]);
            wire.command(&order);
            wire.answer(&order, false);
        }
        wire.state().early
    }

    #[test]
    fn burst_after_a_pause_is_not_taken_for_a_shorter_cycle() {
        // Every 20 cycles the reports of three cycles wait for the next one.
        let bursts =
            (0..1000).map(|cycle| if cycle % 20 > 16 { f64::from(cycle - cycle % 20 + 20) } else { cycle.into() });
        assert_eq!(early_reports(bursts), 0);
        let faster = (0..1000).map(|cycle| f64::from(cycle) * 0.985);
        assert_eq!(early_reports(faster), 0, "a clock that is faster by 1.5 %");
        let slower = (0..1000).map(|cycle| f64::from(cycle) * 1.015);
        assert_eq!(early_reports(slower), 0, "a clock that is slower by 1.5 %");
        let shorter = (0..100).map(|cycle| f64::from(cycle.min(50)) + 0.5 * f64::from((cycle - 50).max(0)));
        assert!(early_reports(shorter) > 40, "half the cycle from the 50th report on");
    }

    #[test]
    fn robot_with_master_cycle_receives_unchanged_commands() {
        let mut wire = Wire::new([LIMIT; AXES], robot(MASTER), MASTER);
        wire.reported(&state_at([0.0; AXES], Nanos(0)), &LinkCounters::default());
        for cycle in 0..50 {
            let axes = [1e-4 * f64::from(cycle); AXES];
            wire.command(&Order::Move(axes));
            let sent = wire.answer(&Order::Move(axes), false);
            assert!(cycle < 2 || sent == Some(Order::Move(axes)), "{sent:?}");
            wire.reported(&state_at(axes, Nanos(0)), &LinkCounters::default());
        }
    }
}
