//! What stops a session, evaluated once a cycle: links and samples here, all else by the rules that the farm steps too.

use super::wire::WireState;
use crate::limiter::Cut;
use crate::log::codes::StopCause;
use crate::signals::{ForceSample, RobotState};
use crate::time::Nanos;
use softdock_campaign::station::LinkRules;
use softdock_kernels::frame::single::{Measured, Progress};
use softdock_kernels::outcome::Stop;
use softdock_kernels::plant::Plant;
use softdock_kernels::session::{Observed, Rule, Session, axes_asked, new_session, range_used, supervise};
use softdock_kernels::space::Parts;
use std::sync::Arc;

/// What a cycle has seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// The time of the cycle.
    pub now: Nanos,
    /// Robots' reports that came in it.
    pub robots: &'a [Option<RobotState>; 2],
    /// How the robots stand to what they have been sent.
    pub wires: &'a [WireState; 2],
    /// Reports of the robots that were lost so far.
    pub lost: [u64; 2],
    /// The sensor's sample that came in it.
    pub sample: Option<&'a ForceSample>,
    /// Parts and wrench as measured, once the sensor is tared.
    pub measured: Option<&'a Measured>,
    /// What the parts were commanded to do by now.
    pub commanded: &'a Parts<f64>,
    /// The run, once it has begun.
    pub progress: Option<Progress>,
}

/// A reason to stop; a dead link is told nothing more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alarm {
    /// Why.
    pub cause: StopCause,
    /// The robot whose link is dead, 0 or 1.
    pub dead: Option<usize>,
}

/// Supervises a session.
#[derive(Clone, Debug)]
pub struct Guard {
    plant: Arc<Plant>,
    links: LinkRules,
    /// Periods of the robots' reports.
    cycles: [Nanos; 2],
    last_report: [Nanos; 2],
    last_sample: Nanos,
    session: Session<f64>,
    stop: Option<Stop>,
    /// The last command was cut to the limits of an axis.
    cut: bool,
    budgets: [Budget; 2],
}

/// A window is counted in so many slots at most.
const SLOTS: usize = 64;

/// Lost cycles of a robot within the window, a slot of some cycles at a time: the window is never shorter than asked for.
#[derive(Clone, Copy, Debug)]
struct Budget {
    slots: [u64; SLOTS],
    used: usize,
    at: usize,
    cycles_per_slot: u32,
    cycles: u32,
    /// Lost cycles so far; none before the first cycle.
    before: Option<u64>,
}

impl Budget {
    /// A window of so many cycles.
    fn new(cycles: u32) -> Self {
        let cycles_per_slot = cycles.div_ceil(SLOTS as u32 - 1).max(1);
        let used = (cycles.div_ceil(cycles_per_slot) as usize + 1).min(SLOTS);
        Self { slots: [0; SLOTS], used, at: 0, cycles_per_slot, cycles: 0, before: None }
    }

    /// Takes in the lost cycles so far; gives those within the window.
    fn take(&mut self, so_far: u64) -> u64 {
        if self.cycles == self.cycles_per_slot {
            (self.at, self.cycles) = ((self.at + 1) % self.used, 0);
            self.slots[self.at] = 0;
        }
        self.cycles += 1;
        self.slots[self.at] += so_far.saturating_sub(self.before.unwrap_or(so_far));
        self.before = Some(so_far);
        self.slots[..self.used].iter().sum()
    }
}

impl Guard {
    /// A guard that has just seen everything, at `now`; the plant holds the session's rules.
    pub fn new(plant: Arc<Plant>, links: LinkRules, cycles: [Nanos; 2], now: Nanos) -> Self {
        let session = new_session();
        let budgets = [Budget::new((links.window / cycles[0].seconds()).ceil() as u32); 2];
        Self { plant, links, cycles, last_report: [now; 2], last_sample: now, session, stop: None, cut: false, budgets }
    }

    /// The run begins: energies count from here.
    pub fn begin_run(&mut self) {
        self.session = new_session();
    }

    /// The rule that was met, and by what.
    pub fn stop(&self) -> Option<Stop> {
        self.stop
    }

    /// Notes that a command was beyond the range of a joint, before the rule itself could see it.
    pub fn meet_joint_range(&mut self) {
        self.stop.get_or_insert(Stop { rule: Rule::JointRange, value: 1.0 });
    }

    /// Energy injected by the facility since the run began \[J\].
    pub fn injected_energy(&self, progress: &Progress) -> f64 {
        progress.port_energy - self.session.work
    }

    /// Cycles that robot 1 or 2 (0 or 1 here) has been silent.
    pub fn lost(&self, robot: usize, now: Nanos) -> u32 {
        let cycles = (now - self.last_report[robot]).0 as f64 / self.cycles[robot].0 as f64;
        // A report counts as lost when the next one could almost be there.
        (cycles - 0.4).max(0.0) as u32
    }

    /// The first reason to stop, if there is one. Before the tare only links and samples are supervised.
    pub fn check(&mut self, seen: &Seen) -> Option<Alarm> {
        let alarm = |cause| Some(Alarm { cause, dead: None });
        for (r, report) in seen.robots.iter().enumerate() {
            if report.is_some() {
                self.last_report[r] = seen.now;
            }
            let lost = self.lost(r, seen.now);
            if lost >= self.links.stop_cycles {
                return Some(Alarm { cause: StopCause::LinkSilent, dead: Some(r) });
            }
            if lost > self.links.hold_cycles {
                return alarm(StopCause::LostPackets);
            }
            if let Some(cause) = report.as_ref().and_then(of_robot) {
                return alarm(cause);
            }
            if seen.wires[r].off_course > 0 {
                // What it is asked for means something else to it: it is asked for nothing any more.
                return Some(Alarm { cause: StopCause::SetPoint, dead: Some(r) });
            }
            if let Some(cause) = self.of_wire(r, &seen.wires[r], seen.lost[r]) {
                return alarm(cause);
            }
        }
        if let Some(cause) = self.of_sensor(seen) {
            return alarm(cause);
        }
        let stop = self.of_rules(seen)?;
        self.stop = Some(stop);
        alarm(cause_of(stop.rule))
    }

    /// The rule of the session that is met in this cycle.
    fn of_rules(&mut self, seen: &Seen) -> Option<Stop> {
        let measured = seen.measured?;
        if let Some(progress) = seen.progress.filter(|progress| progress.unstable) {
            return Some(Stop { rule: Rule::Divergence, value: progress.speed });
        }
        let asked = axes_asked(&self.plant, seen.commanded);
        let observed = Observed {
            parts: measured.parts,
            commanded: *seen.commanded,
            wrench: measured.wrench,
            saturated: f64::from(u8::from(measured.saturated)),
            cut: f64::from(u8::from(self.cut)),
            asked,
            range_used: range_used(&self.plant, &asked, seen.commanded),
            // Before the run nothing goes through the port.
            port_energy: seen.progress.map_or(f64::NEG_INFINITY, |progress| progress.port_energy),
        };
        self.session = supervise(&self.plant, &self.session, &observed, self.cycles[0].seconds());
        Stop::of([0.0, 0.0, self.session.rule, self.session.value])
    }

    /// Whether a robot does not take enough of what it is sent.
    fn of_wire(&mut self, robot: usize, wire: &WireState, lost: u64) -> Option<StopCause> {
        let in_window = self.budgets[robot].take(lost + wire.untaken);
        if wire.untaken_in_row > self.links.hold_cycles {
            return Some(StopCause::UntakenAnswers);
        }
        if in_window > u64::from(self.links.window_cycles) {
            return Some(StopCause::LossBudget);
        }
        let led_back = f64::from(wire.led_back) * self.cycles[robot].seconds();
        (led_back > self.links.catch_up).then_some(StopCause::CatchUp)
    }

    fn of_sensor(&mut self, seen: &Seen) -> Option<StopCause> {
        if let Some(sample) = seen.sample {
            self.last_sample = seen.now;
            let w = sample.wrench;
            let finite = (w.force.norm() + w.moment.norm()).is_finite();
            // Before the tare no rule supervises the samples.
            let saturated = sample.saturated && seen.measured.is_none();
            if sample.invalid || saturated || !finite {
                return Some(StopCause::SensorFault);
            }
        }
        if (seen.now - self.last_sample).seconds() > self.links.sensor_age {
            return Some(StopCause::SensorStale);
        }
        None
    }

    /// Whether a limited command is a reason to stop at once: it left a range or was no number. A command that is cut
    /// to speed, acceleration or jerk counts towards the session's clamp time.
    pub fn of_command(&mut self, cuts: &[Cut; 2], reachable: bool) -> Option<StopCause> {
        self.cut = cuts.iter().any(Cut::any);
        if cuts.iter().any(|cut| cut.not_finite != 0) {
            return Some(StopCause::NonFinite);
        }
        let beyond = !reachable || cuts.iter().any(|cut| cut.position != 0);
        beyond.then_some(StopCause::AxisLimit)
    }
}

fn of_robot(report: &RobotState) -> Option<StopCause> {
    if !report.ready {
        return Some(StopCause::RobotFault);
    }
    report.position.iter().any(|at| !at.is_finite()).then_some(StopCause::NonFinite)
}

/// The cause in the log of a rule that was met.
pub fn cause_of(rule: Rule) -> StopCause {
    match rule {
        Rule::Force | Rule::Moment => StopCause::ForceLimit,
        Rule::ForceRate => StopCause::ForceRate,
        Rule::Saturation => StopCause::SensorFault,
        Rule::InjectedEnergy => StopCause::EnergyBudget,
        Rule::FollowingError | Rule::FollowingRotation => StopCause::Tracking,
        Rule::ToolReach | Rule::ToolRotation => StopCause::ToolLimit,
        Rule::JointRange | Rule::ClampTime => StopCause::AxisLimit,
        Rule::Divergence => StopCause::NonFinite,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_cycles_are_counted_within_the_window_and_no_longer() {
        for window in [1, 3, 63, 64, 250, 10_000] {
            let mut budget = Budget::new(window);
            assert_eq!(budget.take(100), 0, "what was lost before counts for nothing");
            let mut lost = 100;
            for cycle in 0..3 * window {
                lost += u64::from(cycle % 2 == 0);
                let (found, most) = (budget.take(lost), u64::from(window));
                // Half of the cycles, over the window and at most two slots of it more.
                let slot = u64::from(budget.cycles_per_slot);
                let least = u64::from(cycle.min(window)) / 2;
                assert!(
                    (least..=(most + 2 * slot) / 2 + 1).contains(&found),
                    "window {window}, cycle {cycle}: {found}"
                );
            }
            (0..2 * window + 2 * budget.cycles_per_slot).for_each(|_| {
                budget.take(lost);
            });
            assert_eq!(budget.take(lost), 0, "window {window}");
        }
    }
}
