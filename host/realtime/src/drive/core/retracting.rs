//! Retraction after a stop, on request: robot 1 moves its part straight back along the approach, which unloads the
//! contact.

use super::{Core, Orders, State};
use crate::drive::guard::Alarm;
use crate::drive::motion::{JointMove, unit_move};
use crate::limiter::Limiter;
use crate::log::codes::StopCause;
use crate::signals::AXES;
use crate::time::Nanos;
use softdock_kernels::frame::single::Measured;
use softdock_kernels::session::clearance_at;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::Vec3;

/// Greatest mean speed of a retraction \[m/s\].
const SPEED: f64 = 0.01;
/// Poses of the path at which boxes and arms are checked.
const WAY_POSES: u32 = 20;

/// A straight retraction of part A, from rest to rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Retreat {
    /// Pose of part A at its begin, at rest.
    from: Motion<f64>,
    /// Axes of robot 2, constant.
    other: [f64; AXES],
    /// Direction, laboratory, unit length.
    direction: Vec3<f64>,
    distance: f64,
    duration: f64,
    /// Measured force at the begin of the retraction \[N\].
    force: Option<f64>,
}

impl Core {
    /// Plans the retraction, if one is requested and the robots can make it under supervision.
    pub(super) fn retreat(&self) -> Option<Retreat> {
        let (limiters, distance) = (self.limiters.as_ref()?, self.task.retract);
        let latched = self.computer.progress().captured;
        let dead = self.dead.contains(&true);
        if distance <= 0.0
            || latched
            || dead
            || !self.tared
            || self.retracted.is_some()
            || !may_retract(self.record.cause)
        {
            return None;
        }
        let at = limiters.each_ref().map(Limiter::position);
        let from = self.arms.part_on(0, &at[0], &[0.0; AXES]);
        let direction = self.approach * -1.0;
        let end = Motion { position: direction.scale_add(distance, from.position), ..from };
        let (axes, reachable) = self.arms.axes_for(0, &end);
        // The path speed bounds the axis speeds between its ends; the limiter clamps the rest.
        let way = JointMove::new(at, [axes.position, at[1]], &self.limits);
        let duration = way.duration().max(distance / SPEED);
        // The path must stay out of the boxes and keep the least distance of the arms.
        let poses = (1..=WAY_POSES).map(|k| {
            let way = distance * f64::from(k) / f64::from(WAY_POSES);
            let part = Motion { position: direction.scale_add(way, from.position), ..from };
            [self.arms.axes_for(0, &part).0.position, at[1]]
        });
        let is_clear = |axes: [[f64; AXES]; 2]| {
            let found =
                clearance_at(&self.task.plant, [0, 1].map(|r: usize| self.arms.in_model(r, &axes[r])).each_ref());
            let least = self.task.plant.facility.rules.arm_distance;
            found.depth <= 0.0 && (!least.is_finite() || found.arms >= least)
        };
        let reachable = reachable && { poses }.all(is_clear);
        reachable.then_some(Retreat { from, other: at[1], direction, distance, duration, force: None })
    }

    /// Steps the retraction by one cycle; an increasing force ends it.
    pub(super) fn retract(&mut self, retreat: &Retreat, begun: Nanos, now: Nanos, net: Option<Measured>) -> Orders {
        let mut retreat = *retreat;
        let force = net.map_or(f64::NAN, |measured| measured.wrench.force.norm());
        let first = *retreat.force.get_or_insert(force);
        self.state = State::Retracting { retreat, begun };
        if force.is_nan() || force > first + self.task.station.links.contact.free_force {
            self.stop(Alarm::of(StopCause::ForceLimit));
            return self.ramp_down();
        }
        let time = (now - begun).seconds() + self.capabilities[0].cycle.seconds();
        let share = unit_move(time / retreat.duration);
        let way = share * retreat.distance;
        let part = Motion { position: retreat.direction.scale_add(way, retreat.from.position), ..retreat.from };
        let (axes, reachable) = self.arms.axes_for(0, &part);
        self.retracted = Some(way);
        let orders = self.limited(&[axes.position, retreat.other], reachable);
        if time >= retreat.duration && matches!(self.state, State::Retracting { .. }) {
            self.ramp_begun = now;
            self.state = State::Stopping;
        }
        self.commanded = Parts { a: part, ..self.commanded };
        orders
    }
}

/// Whether a retraction is safe after this cause: the robots follow their commands, and the sensor supervises them.
fn may_retract(cause: StopCause) -> bool {
    match cause {
        StopCause::LinkSilent
        | StopCause::LinkFault
        | StopCause::RobotFault
        | StopCause::SetPoint
        | StopCause::Rate
        | StopCause::NonFinite
        | StopCause::KeepOut
        | StopCause::Singularity
        | StopCause::SensorStale
        | StopCause::SensorFault
        | StopCause::StartRefused
        | StopCause::Checked
        | StopCause::Panic
        | StopCause::None => false,
        StopCause::Completed
        | StopCause::Operator
        | StopCause::Signal
        | StopCause::LostPackets
        | StopCause::ForceLimit
        | StopCause::ForceRate
        | StopCause::EnergyBudget
        | StopCause::AxisLimit
        | StopCause::ToolLimit
        | StopCause::Tracking
        | StopCause::Overrun
        | StopCause::UntakenAnswers
        | StopCause::LossBudget
        | StopCause::BlindSensor
        | StopCause::FreeForce
        | StopCause::Torque
        | StopCause::ToolSpeed
        | StopCause::ArmDistance
        | StopCause::CatchUp => true,
    }
}
