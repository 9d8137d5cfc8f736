//! What stops a run: links, sensor, force, energy, distance from the command; looked at once a cycle.

use crate::limiter::Cut;
use crate::log::codes::StopCause;
use crate::signals::{AXES, ForceSample, RAIL, RobotState};
use crate::time::Nanos;
use softdock_campaign::station::Safety;
use softdock_kernels::frame::single::Progress;
use softdock_kernels::space::Wrench;

/// What a cycle has seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// The time of the cycle.
    pub now: Nanos,
    /// Robots' reports that came in it.
    pub robots: &'a [Option<RobotState>; 2],
    /// The sensor's sample that came in it.
    pub sample: Option<&'a ForceSample>,
    /// Where the axes were sent last.
    pub sent: &'a [[f64; AXES]; 2],
    /// The measured wrench without the tool's weight, once the sensor is tared.
    pub net: Option<Wrench<f64>>,
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

/// Watches over a run.
#[derive(Clone, Debug)]
pub struct Guard {
    safety: Safety,
    /// Periods of the robots' reports.
    cycles: [Nanos; 2],
    last_report: [Nanos; 2],
    last_sample: Nanos,
    last_force: Option<(Nanos, Wrench<f64>)>,
    /// Cycles in a row whose command was cut.
    cut_in_row: u32,
}

impl Guard {
    /// A guard that has just seen everything, at `now`.
    pub fn new(safety: Safety, cycles: [Nanos; 2], now: Nanos) -> Self {
        Self { safety, cycles, last_report: [now; 2], last_sample: now, last_force: None, cut_in_row: 0 }
    }

    /// Cycles that robot 1 or 2 (0 or 1 here) has been silent.
    pub fn lost(&self, robot: usize, now: Nanos) -> u32 {
        let silent = (now - self.last_report[robot]).0 - self.cycles[robot].0 / 2;
        (silent.max(0) / self.cycles[robot].0) as u32
    }

    /// The first reason to stop, if there is one. Before the run begins links and sensor are watched alone.
    pub fn check(&mut self, seen: &Seen) -> Option<Alarm> {
        let alarm = |cause| Some(Alarm { cause, dead: None });
        for (r, report) in seen.robots.iter().enumerate() {
            if report.is_some() {
                self.last_report[r] = seen.now;
            }
            let lost = self.lost(r, seen.now);
            if lost >= self.safety.stop_cycles {
                return Some(Alarm { cause: StopCause::LinkSilent, dead: Some(r) });
            }
            if lost > self.safety.hold_cycles {
                return alarm(StopCause::LostPackets);
            }
            if let Some(cause) = report.as_ref().and_then(|report| self.of_robot(r, report, seen)) {
                return alarm(cause);
            }
        }
        if let Some(cause) = self.of_sensor(seen) {
            return alarm(cause);
        }
        let progress = seen.progress?;
        if progress.unstable || !progress.created_energy.is_finite() {
            return alarm(StopCause::NonFinite);
        }
        if progress.created_energy > self.safety.contact_energy {
            return alarm(StopCause::EnergyBudget);
        }
        None
    }

    fn of_robot(&self, robot: usize, report: &RobotState, seen: &Seen) -> Option<StopCause> {
        if !report.ready {
            return Some(StopCause::RobotFault);
        }
        let [joint, rail] = self.safety.following_error;
        for i in 0..AXES {
            let (at, sent) = (report.position[i], seen.sent[robot][i]);
            if !at.is_finite() {
                return Some(StopCause::NonFinite);
            }
            if (at - sent).abs() > if i == RAIL { rail } else { joint } {
                return Some(StopCause::Tracking);
            }
        }
        None
    }

    fn of_sensor(&mut self, seen: &Seen) -> Option<StopCause> {
        if let Some(sample) = seen.sample {
            self.last_sample = seen.now;
            let w = sample.wrench;
            let finite = (w.force.norm() + w.moment.norm()).is_finite();
            if sample.saturated || sample.invalid || !finite {
                return Some(StopCause::SensorFault);
            }
        }
        if (seen.now - self.last_sample).seconds() > self.safety.sensor_age {
            return Some(StopCause::SensorStale);
        }
        let net = seen.net?;
        if net.force.norm() > self.safety.force || net.moment.norm() > self.safety.moment {
            return Some(StopCause::ForceLimit);
        }
        let last = self.last_force.replace((seen.now, net));
        let rate = last.map_or(0.0, |(then, old)| {
            let time = (seen.now - then).seconds();
            if time > 0.0 { (net.force - old.force).norm() / time } else { 0.0 }
        });
        (rate > self.safety.force_rate).then_some(StopCause::ForceRate)
    }

    /// Whether a command that was cut is a reason to stop: at once where it left a range or was no number, else when
    /// it goes on for too long.
    pub fn of_command(&mut self, cuts: &[Cut; 2], reachable: bool) -> Option<StopCause> {
        let any = cuts.iter().any(Cut::any);
        self.cut_in_row = if any { self.cut_in_row + 1 } else { 0 };
        if cuts.iter().any(|cut| cut.not_finite != 0) {
            return Some(StopCause::NonFinite);
        }
        let beyond = !reachable || cuts.iter().any(|cut| cut.position != 0);
        let clamped = f64::from(self.cut_in_row) * self.cycles[0].seconds();
        (beyond || clamped > self.safety.clamp_time).then_some(StopCause::AxisLimit)
    }
}
