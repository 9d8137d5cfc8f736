//! Stop conditions of a session, evaluated once per cycle: links and samples here, all others by the rules of the farm.

use crate::limiter::Cut;
use crate::log::codes::StopCause;
use crate::signals::WireState;
use crate::signals::{ForceSample, RobotState};
use crate::time::Nanos;
use softdock_campaign::Station;
use softdock_campaign::station::{LinkRules, StationSensor};
use softdock_kernels::contact::overlap::deepest_overlap;
use softdock_kernels::frame::single::{Measured, Progress};
use softdock_kernels::outcome::Stop;
use softdock_kernels::plant::Plant;
use softdock_kernels::session::{Observed, Rule, Session, axes_asked, clearance, new_session, range_used, supervise};
use softdock_kernels::space::{Parts, Wrench};
use std::sync::Arc;

/// Inputs of the guard in one cycle.
#[derive(Clone, Copy, Debug)]
pub struct GuardInputs<'a> {
    /// Time of the cycle.
    pub now: Nanos,
    /// Robot reports that arrived in the cycle.
    pub robots: &'a [Option<RobotState>; 2],
    /// State of each robot relative to its commands.
    pub wires: &'a [WireState; 2],
    /// Robot reports lost so far.
    pub lost: [u64; 2],
    /// Sensor sample that arrived in the cycle.
    pub sample: Option<&'a ForceSample>,
    /// Wrenches on part A, tared as far as the tare is known: of the newest sample, and of the largest change in the
    /// cycle.
    pub wrenches: [Wrench<f64>; 2],
    /// Error of each robot's tool from its command, and commanded speed.
    pub tools: [ToolError; 2],
    /// The session is stopping already; further rules change nothing.
    pub stopping: bool,
    /// Measured parts and wrench, after the tare.
    pub measured: Option<&'a Measured>,
    /// Commanded motion of the parts at this time.
    pub commanded: &'a Parts<f64>,
    /// Progress of the run, once it has begun.
    pub progress: Option<Progress>,
}

/// Error of a robot's tool from its command, and its commanded speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolError {
    /// Distance \[m\].
    pub distance: f64,
    /// Angle \[rad\].
    pub angle: f64,
    /// Commanded speed \[m/s\].
    pub speed: f64,
    /// Commanded angular speed \[rad/s\].
    pub turn_rate: f64,
}

/// A reason to stop; a dead link receives no further commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alarm {
    /// Cause.
    pub cause: StopCause,
    /// The robot whose link is dead, 0 or 1.
    pub dead: Option<usize>,
    /// Value beyond its limit, where one is known.
    pub violation: Option<LimitViolation>,
}

/// A value beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitViolation {
    /// Robot, 0 or 1, if one is concerned.
    pub robot: Option<usize>,
    /// Axis, if one is concerned.
    pub axis: Option<usize>,
    /// Value.
    pub value: f64,
    /// Limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Alarm {
    /// Creates an alarm without a value.
    pub fn of(cause: StopCause) -> Self {
        Self { cause, dead: None, violation: None }
    }

    /// Creates an alarm of a robot's value beyond its limit.
    fn beyond(cause: StopCause, robot: usize, value: f64, limit: f64, unit: &'static str) -> Self {
        Self {
            violation: Some(LimitViolation { robot: Some(robot), axis: None, value, limit, unit }),
            ..Self::of(cause)
        }
    }

    /// Creates an alarm of a session rule.
    fn of_rule(plant: &Plant, stop: Stop) -> Self {
        let row = stop.rule.row();
        let found = LimitViolation {
            robot: None,
            axis: None,
            value: stop.value,
            limit: (row.limit)(&plant.facility),
            unit: row.unit,
        };
        Self { violation: Some(found), ..Self::of(cause_of(stop.rule)) }
    }
}

/// Supervises a session.
#[derive(Clone, Debug)]
pub struct Guard {
    plant: Arc<Plant>,
    links: LinkRules,
    sensor: StationSensor,
    /// Report periods of the robots.
    cycles: [Nanos; 2],
    last_report: [Nanos; 2],
    last_sample: Nanos,
    session: Session<f64>,
    stop: Option<Stop>,
    /// The last command was clamped to the limits of an axis.
    cut: bool,
    budgets: [Budget; 2],
    /// Commanded speed and angular speed of each robot's tool, held and decaying: a robot lags behind its command.
    paces: [[f64; 2]; 2],
    worst: [[f64; 2]; 2],
}

/// Greatest number of slots of a window.
const SLOTS: usize = 64;

/// Lost cycles of a robot within a sliding window of slots; the window is never shorter than configured.
#[derive(Clone, Copy, Debug)]
struct Budget {
    slots: [u64; SLOTS],
    used: usize,
    at: usize,
    cycles_per_slot: u32,
    cycles: u32,
    /// Total lost cycles so far; `None` before the first cycle.
    before: Option<u64>,
}

impl Budget {
    /// Creates a window of a number of cycles.
    fn new(cycles: u32) -> Self {
        let cycles_per_slot = cycles.div_ceil(SLOTS as u32 - 1).max(1);
        let used = (cycles.div_ceil(cycles_per_slot) as usize + 1).min(SLOTS);
        Self { slots: [0; SLOTS], used, at: 0, cycles_per_slot, cycles: 0, before: None }
    }

    /// Takes the total of lost cycles; returns those within the window.
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
    /// Creates a guard at `now`, with all links taken as just received; the plant holds the session's rules.
    pub fn new(plant: Arc<Plant>, station: &Station, cycles: [Nanos; 2], now: Nanos) -> Self {
        let (links, session) = (station.links, new_session());
        let budgets = [Budget::new((links.window / cycles[0].seconds()).ceil() as u32); 2];
        Self {
            plant,
            links,
            sensor: station.sensor,
            cycles,
            last_report: [now; 2],
            last_sample: now,
            session,
            stop: None,
            cut: false,
            budgets,
            paces: [[0.0; 2]; 2],
            worst: [[0.0; 2]; 2],
        }
    }

    /// Starts the run: energies count from here.
    pub fn begin_run(&mut self) {
        self.session = new_session();
    }

    /// Returns the rule that stopped the session, with its value.
    pub fn stop(&self) -> Option<Stop> {
        self.stop
    }

    /// Records that a command exceeded a joint range, before the rule evaluates it.
    pub fn meet_joint_range(&mut self) {
        self.stop.get_or_insert(Stop { rule: Rule::JointRange, value: 1.0 });
    }

    /// Returns the energy injected by the facility since the run began \[J\].
    pub fn injected_energy(&self, progress: &Progress) -> f64 {
        progress.port_energy - self.session.work
    }

    /// Returns the cycles since the last report of robot 0 or 1.
    pub fn lost(&self, robot: usize, now: Nanos) -> u32 {
        let cycles = (now - self.last_report[robot]).0 as f64 / self.cycles[robot].0 as f64;
        // A report counts as lost when the next one is almost due.
        (cycles - 0.4).max(0.0) as u32
    }

    /// Returns the first reason to stop. Before the tare only the rules of force and moment are silent.
    pub fn check(&mut self, inputs: &GuardInputs) -> Option<Alarm> {
        for (r, report) in inputs.robots.iter().enumerate() {
            if report.is_some() {
                self.last_report[r] = inputs.now;
            }
            if let Some(alarm) = self.of_link(r, inputs) {
                return Some(alarm);
            }
        }
        if let Some(cause) = self.of_sensor(inputs) {
            return Some(Alarm::of(cause));
        }
        if let Some(alarm) = (0..2).find_map(|r| self.of_tool(r, &inputs.tools[r])) {
            return Some(alarm);
        }
        // Before the tare the readings contain the sensor's bias.
        let bias = if inputs.measured.is_some() { [0.0; 2] } else { self.sensor.bias };
        if inputs.stopping {
            return None;
        }
        let force = self.of_force(&inputs.wrenches, bias);
        if let (None, Some(alarm)) = (force, self.of_contact(inputs)) {
            return Some(alarm);
        }
        let stop = match force {
            Some(stop) => stop,
            None => self.of_rules(inputs)?,
        };
        self.stop = Some(stop);
        Some(Alarm::of_rule(&self.plant, stop))
    }

    /// Checks a robot's link and the robot's own state.
    fn of_link(&mut self, robot: usize, inputs: &GuardInputs) -> Option<Alarm> {
        let (links, wire) = (self.links, &inputs.wires[robot]);
        let cycles =
            |cause, cycles: u64, limit: u32| Alarm::beyond(cause, robot, cycles as f64, f64::from(limit), "cycles");
        let lost = self.lost(robot, inputs.now);
        if lost >= links.stop_cycles {
            let silent = cycles(StopCause::LinkSilent, lost.into(), links.stop_cycles);
            return Some(Alarm { dead: Some(robot), ..silent });
        }
        if lost > links.hold_cycles {
            return Some(cycles(StopCause::LostPackets, lost.into(), links.hold_cycles));
        }
        if let Some(report) = &inputs.robots[robot] {
            if !report.ready {
                return Some(Alarm::of(StopCause::RobotFault));
            }
            if report.position.iter().any(|at| !at.is_finite()) {
                return Some(Alarm::of(StopCause::NonFinite));
            }
        }
        if wire.off_course > 0 {
            // The robot interprets commands differently: send none.
            return Some(Alarm { dead: Some(robot), ..Alarm::of(StopCause::SetPoint) });
        }
        if wire.early > 0 {
            return Some(Alarm { dead: Some(robot), ..Alarm::of(StopCause::Rate) });
        }
        let in_window = self.budgets[robot].take(inputs.lost[robot] + wire.untaken);
        if wire.untaken_in_row > links.hold_cycles {
            return Some(cycles(StopCause::UntakenAnswers, wire.untaken_in_row.into(), links.hold_cycles));
        }
        if in_window > u64::from(links.window_cycles) {
            return Some(cycles(StopCause::LossBudget, in_window, links.window_cycles));
        }
        let led_back = f64::from(wire.led_back) * self.cycles[robot].seconds();
        (led_back > links.catch_up).then(|| Alarm::beyond(StopCause::CatchUp, robot, led_back, links.catch_up, "s"))
    }

    /// Evaluates the session rules of this cycle.
    fn of_rules(&mut self, inputs: &GuardInputs) -> Option<Stop> {
        let measured = inputs.measured?;
        if let Some(progress) = inputs.progress.filter(|progress| progress.unstable) {
            return Some(Stop { rule: Rule::Divergence, value: progress.speed });
        }
        // Before the run no energy passes the port.
        let port_energy = inputs.progress.map_or(f64::NEG_INFINITY, |progress| progress.port_energy);
        self.step_rules(measured, inputs.commanded, port_energy);
        Stop::of_session(self.session.rule, self.session.value)
    }

    /// Evaluates the injected energy at a time of the run, once a report covers the motion until then.
    pub fn injected(&mut self, port_energy: f64, measured: &Measured, commanded: &Parts<f64>) -> Option<Alarm> {
        self.step_rules(measured, commanded, port_energy);
        let value = port_energy - self.session.work;
        let stop = Stop { rule: Rule::InjectedEnergy, value };
        is_beyond(value, self.plant.facility.rules.injected_energy).then(|| {
            self.stop = Some(stop);
            Alarm::of_rule(&self.plant, stop)
        })
    }

    /// Steps the session rules by one cycle.
    fn step_rules(&mut self, measured: &Measured, commanded: &Parts<f64>, port_energy: f64) {
        let asked = axes_asked(&self.plant, commanded);
        let observed = Observed {
            parts: measured.parts,
            commanded: *commanded,
            wrench: measured.wrench,
            saturated: f64::from(u8::from(measured.saturated)),
            cut: f64::from(u8::from(self.cut)),
            asked,
            range_used: range_used(&self.plant, &asked, commanded),
            clearance: clearance(&self.plant, &asked, commanded),
            port_energy,
        };
        self.session = supervise(&self.plant, &self.session, &observed, self.cycles[0].seconds());
    }

    /// Checks a robot's tool error against the error that its speed explains.
    fn of_tool(&mut self, robot: usize, tool: &ToolError) -> Option<Alarm> {
        let kept = (-self.cycles[0].seconds() / self.links.tracking.time).exp();
        let [speed, turn_rate] = &mut self.paces[robot];
        *speed = tool.speed.max(*speed * kept);
        *turn_rate = tool.turn_rate.max(*turn_rate * kept);
        let limits = &self.links.tracking;
        let (distance, angle) = (limits.distance + limits.time * *speed, limits.angle + limits.time * *turn_rate);
        self.worst[robot] = [self.worst[robot][0].max(tool.distance), self.worst[robot][1].max(tool.angle)];
        if is_beyond(tool.distance, distance) {
            return Some(Alarm::beyond(StopCause::Tracking, robot, tool.distance, distance, "m"));
        }
        is_beyond(tool.angle, angle).then(|| Alarm::beyond(StopCause::Tracking, robot, tool.angle, angle, "rad"))
    }

    /// Returns the greatest distance \[m\] and angle \[rad\] of each robot's tool from its command so far.
    pub fn worst_tracking(&self) -> [[f64; 2]; 2] {
        self.worst
    }

    /// Checks whether geometry and measured force contradict each other, while no latch holds the parts.
    fn of_contact(&self, inputs: &GuardInputs) -> Option<Alarm> {
        let measured = inputs.measured.filter(|_| !inputs.progress.is_some_and(|progress| progress.captured))?;
        let depth = deepest_overlap(&self.plant, &measured.parts)?.depth;
        let (force, limits) = (measured.wrench.force.norm(), &self.links.contact);
        let found = |value, limit, unit| Some(LimitViolation { robot: None, axis: None, value, limit, unit });
        if depth > limits.blind_overlap && force < self.sensor.touch_force {
            let found = found(depth, limits.blind_overlap, "m");
            return Some(Alarm { violation: found, ..Alarm::of(StopCause::BlindSensor) });
        }
        let force = force.max(inputs.wrenches[1].force.norm());
        (depth < -limits.free_distance && force > limits.free_force).then(|| {
            let found = found(force, limits.free_force, "N");
            Alarm { violation: found, ..Alarm::of(StopCause::FreeForce) }
        })
    }

    /// Checks force and moment of every sample of the cycle, from the first motion on.
    fn of_force(&self, wrenches: &[Wrench<f64>; 2], bias: [f64; 2]) -> Option<Stop> {
        let rules = &self.plant.facility.rules;
        let most = |size: fn(&Wrench<f64>) -> f64| size(&wrenches[0]).max(size(&wrenches[1]));
        let (force, moment) = (most(|w| w.force.norm()), most(|w| w.moment.norm()));
        if is_beyond(force, rules.force + bias[0]) {
            return Some(Stop { rule: Rule::Force, value: force });
        }
        is_beyond(moment, rules.moment + bias[1]).then_some(Stop { rule: Rule::Moment, value: moment })
    }

    fn of_sensor(&mut self, inputs: &GuardInputs) -> Option<StopCause> {
        if let Some(sample) = inputs.sample {
            self.last_sample = inputs.now;
            let w = sample.wrench;
            let finite = (w.force.norm() + w.moment.norm()).is_finite();
            // Before the tare no rule supervises the samples.
            let saturated = sample.saturated && inputs.measured.is_none();
            if sample.invalid || saturated || !finite {
                return Some(StopCause::SensorFault);
            }
        }
        if (inputs.now - self.last_sample).seconds() > self.links.sensor_age {
            return Some(StopCause::SensorStale);
        }
        None
    }

    /// Whether a clamped command is a reason to stop at once: it left a range or was no number. A command that is
    /// clamped in speed, acceleration or jerk counts towards the session's clamp time.
    pub fn of_command(&mut self, cuts: &[Cut; 2], reachable: bool) -> Option<StopCause> {
        self.cut = cuts.iter().any(Cut::any);
        if cuts.iter().any(|cut| cut.not_finite != 0) {
            return Some(StopCause::NonFinite);
        }
        let beyond = !reachable || cuts.iter().any(|cut| cut.position != 0);
        beyond.then_some(StopCause::AxisLimit)
    }
}

/// Whether a value exceeds its limit; NaN does.
fn is_beyond(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// Maps a session rule to its cause in the log.
pub fn cause_of(rule: Rule) -> StopCause {
    match rule {
        Rule::Force | Rule::Moment => StopCause::ForceLimit,
        Rule::ForceRate => StopCause::ForceRate,
        Rule::Saturation => StopCause::SensorFault,
        Rule::InjectedEnergy => StopCause::EnergyBudget,
        Rule::FollowingError | Rule::FollowingRotation => StopCause::Tracking,
        Rule::ToolReach | Rule::ToolRotation => StopCause::ToolLimit,
        Rule::JointRange | Rule::ClampTime => StopCause::AxisLimit,
        Rule::ToolSpeed => StopCause::ToolSpeed,
        Rule::KeepOut => StopCause::KeepOut,
        Rule::ArmDistance => StopCause::ArmDistance,
        Rule::Singularity => StopCause::Singularity,
        Rule::Divergence => StopCause::NonFinite,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_cycles_count_only_within_the_window() {
        for window in [1, 3, 63, 64, 250, 10_000] {
            let mut budget = Budget::new(window);
            assert_eq!(budget.take(100), 0, "losses before the first cycle do not count");
            let mut lost = 100;
            for cycle in 0..3 * window {
                lost += u64::from(cycle % 2 == 0);
                let (found, most) = (budget.take(lost), u64::from(window));
                // Half of the cycles, over the window and at most two further slots.
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
