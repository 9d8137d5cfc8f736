//! The record of a cycle: parts, commands, limits, phase.

use super::{Core, Orders, State, pose};
use crate::limiter::Cut;
use crate::log::codes::{LimitKind, Phase, cycle_flags};
use crate::log::record::RobotRecord;
use crate::log::table::Logged;
use crate::signals::{AXES, Order, RAIL};
use softdock_kernels::frame::single::Progress;
use softdock_kernels::robot::command;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::Pose;

impl Core {
    /// Records the command of robot 0 or 1, with all fields on the wire.
    pub fn sent(&mut self, robot: usize, order: Option<&Order>) {
        self.moved_records()[robot].set_command(order);
    }

    /// Records the parts as held by the robots.
    pub(super) fn note_parts(&mut self, parts: &Parts<f64>) {
        let simulated = self.computer.progress().parts;
        [self.record.part_a, self.record.part_b] = self.in_contact_frame([pose(&parts.a), pose(&parts.b)], &simulated);
    }

    /// Returns poses of the parts, transformed from the laboratory to the contact frame with each robot's share of the
    /// simulated motion.
    fn in_contact_frame(&self, poses: [Pose<f64>; 2], simulated: &Parts<f64>) -> [Pose<f64>; 2] {
        let shared = command(&self.task.plant, simulated);
        let moved = |at: Pose<f64>, simulated: &Motion<f64>, shared: &Motion<f64>| Pose {
            position: at.position + (simulated.position - shared.position),
            ..at
        };
        let [a, b] = poses;
        [moved(a, &simulated.a, &shared.a), moved(b, &simulated.b, &shared.b)]
    }

    /// Returns the records of the robots that receive the commands: the emulated ones of a dry run, else the real ones.
    pub(super) fn moved_records(&mut self) -> [&mut RobotRecord; 2] {
        let r = &mut self.record;
        if r.emulated_1.present() { [&mut r.emulated_1, &mut r.emulated_2] } else { [&mut r.robot_1, &mut r.robot_2] }
    }

    pub(super) fn note_cuts(&mut self, cuts: &[Cut; 2]) {
        for (record, cut) in self.moved_records().into_iter().zip(cuts) {
            record.limits = Logged::BLANK;
            let kinds = [
                (cut.position, LimitKind::Position),
                (cut.speed, LimitKind::Velocity),
                (cut.acceleration, LimitKind::Acceleration),
                (cut.jerk, LimitKind::Jerk),
                (cut.not_finite, LimitKind::NonFinite),
            ];
            for (bits, kind) in kinds {
                (0..AXES).filter(|i| bits & (1 << i) != 0).for_each(|i| record.limits.set(kind, i));
            }
        }
    }

    /// The rest of the record.
    pub(super) fn note(&mut self, orders: &Orders) {
        let energy = self.injected_energy();
        let progress = self.computer.progress();
        let used = self.limits_used();
        let is_commanded = orders.moved.iter().flatten().any(|order| !matches!(order, Order::Hold));
        let commanded =
            if is_commanded { self.in_contact_frame(self.sent[0], &progress.parts) } else { [Logged::BLANK; 2] };
        for (i, (record, order)) in self.moved_records().into_iter().zip(&orders.moved).enumerate() {
            record.computed = match order {
                Some(Order::Move(axes) | Order::End(axes)) => *axes,
                Some(Order::Hold) | None => Logged::BLANK,
            };
            record.limit_used = used[i];
        }
        let r = &mut self.record;
        if r.emulated_1.present() {
            r.robot_1.set_command(Some(&Order::Hold));
            r.robot_2.set_command(Some(&Order::Hold));
            (r.robot_1.computed, r.robot_2.computed) = (r.emulated_1.computed, r.emulated_2.computed);
        }
        r.phase = if self.ready { Phase::Ready } else { phase(&self.state, &progress) };
        r.flags = (r.flags & cycle_flags::ARMED) | if progress.captured { cycle_flags::LATCHED } else { 0 };
        [r.commanded_part_a, r.commanded_part_b] = commanded;
        (r.simulated_part_a, r.simulated_part_b) = (progress.parts.a, progress.parts.b);
        r.fed_back = progress.fed_back;
        r.contact_energy = energy;
    }

    /// Returns the used share of each axis' range, from its middle.
    pub(super) fn limits_used(&self) -> [[f64; AXES]; 2] {
        let Some(limiters) = &self.limiters else {
            return [Logged::BLANK; 2];
        };
        std::array::from_fn(|r| {
            let at = limiters[r].position();
            std::array::from_fn(|i| {
                // Only robot 1 has the rail.
                if (r, i) == (1, RAIL) {
                    return f64::NAN;
                }
                let limit = &self.limits[i];
                let half = 0.5 * (limit.upper - limit.lower);
                if half > 0.0 { (at[i] - limit.lower - half).abs() / half } else { 0.0 }
            })
        })
    }
}

fn phase(state: &State, progress: &Progress) -> Phase {
    match state {
        State::StartUp | State::Enabling { .. } => Phase::StartUp,
        State::ToStart { .. } => Phase::ToStart,
        State::Weighing { .. } => Phase::Weighing,
        State::Taring { .. } => Phase::Taring,
        State::RunIn { .. } => Phase::Approach,
        State::Running | State::Closing { .. } => match progress {
            Progress { captured: true, .. } => Phase::Captured,
            Progress { touching: true, .. } => Phase::Contact,
            Progress { touched: true, .. } => Phase::Free,
            _ => Phase::Approach,
        },
        State::Stopping => Phase::Stopping,
        State::Retracting { .. } => Phase::Retracting,
        State::Ending { .. } | State::Over => Phase::Stopped,
    }
}
