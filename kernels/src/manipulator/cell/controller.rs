//! A robot's controller: position loops once a tick, limits of speed and acceleration, feedforward.

use super::reach::{angles, closed_form, rates, refined, within_ranges};
use super::{AXES, Cell, Drives, Feedforward, JOINTS, RAIL, SetPoint, joints};
use crate::chain::Turn;
use crate::fields::filled;
use crate::manipulator::drive::cold;
use crate::manipulator::inverse_kinematics::Posture;
use crate::manipulator::{Arm, DriveParams, Levels, counterweight_torque};
use crate::real::Real;
use crate::robot::rail_share;
use crate::space::Motion;
use crate::vector::Vec3;

/// References of the axes.
pub(super) struct Course<R> {
    pub(super) angle: [R; AXES],
    pub(super) rate: [R; AXES],
    /// 1 where the motion is out of reach, near a singular posture or beyond a range.
    pub(super) limited: R,
}

/// Angles and rates of the axes for a motion of the part; the rail takes its share.
#[inline(always)]
pub(super) fn course<R: Real>(cell: &Cell, reference: &Motion<R>) -> Course<R> {
    let (place, speed, left) = rail_share(cell.rail.as_ref().map(|(rail, _)| rail), *reference);
    let found = closed_form(cell, &left);
    let (angle, limited) = axis_angles(cell, refined(cell, &left, &found), place, found.0.singular);
    Course { angle, rate: axis_rates(cell, &left, &found, speed), limited }
}

/// Rates of all axes.
#[inline(always)]
fn axis_rates<R: Real>(cell: &Cell, left: &Motion<R>, found: &(Posture<R>, Vec3<R>), on_rail: R) -> [R; AXES] {
    let mut rate = [on_rail; AXES];
    rate[..JOINTS].copy_from_slice(&rates(cell, found, left.velocity, left.omega));
    rate
}

/// Angles of all axes cut to their ranges; `limited` becomes 1 where one was beyond.
#[inline(always)]
fn axis_angles<R: Real>(cell: &Cell, joints: [R; JOINTS], place: R, limited: R) -> ([R; AXES], R) {
    let (joints, limited) = within_ranges(cell, joints, limited);
    let (place, limited) = on_rail(cell, place, limited);
    let mut angle = [place; AXES];
    angle[..JOINTS].copy_from_slice(&joints);
    (angle, limited)
}

/// The place on the rail cut to its ends; `limited` becomes 1 where it was beyond.
#[inline(always)]
fn on_rail<R: Real>(cell: &Cell, place: R, limited: R) -> (R, R) {
    let Some((_, carriage)) = &cell.rail else {
        return (place, limited);
    };
    let limits = &carriage.joint.limits;
    let kept = place.min(R::lit(limits.upper)).max(R::lit(limits.lower));
    (kept, limited.max(R::select(kept.lt(place) | place.lt(kept), R::lit(1.0), R::lit(0.0))))
}

/// What a motion of the part commands the axes.
#[derive(Clone, Copy)]
pub struct Commanded<R> {
    /// Turns of the joints' frames, each from the one before it.
    pub(crate) turns: [Turn<R>; JOINTS],
    /// Place on the rail \[m\]; zero without one.
    pub(crate) place: R,
    /// Rates of the axes \[1/s\].
    pub(crate) rate: [R; AXES],
    /// 1 where the motion is out of reach or near a singular posture.
    pub(crate) singular: R,
    /// Least of the sines of the angles from the singular postures.
    pub(crate) least_sine: R,
    /// Joint 3, the wrist's centre and the part's origin in base axes, without the rail's place.
    pub(crate) points: [Vec3<R>; 3],
}

/// What a motion of the part commands the axes, exact to the scalar's rounding of metres: enough to compare it with
/// limits, at a fraction of the cost of a set-point. No angle is computed, and no range is checked.
#[inline(always)]
pub fn commanded<R: Real>(cell: &Cell, reference: &Motion<R>) -> Commanded<R> {
    let (place, speed, left) = rail_share(cell.rail.as_ref().map(|(rail, _)| rail), *reference);
    let found = closed_form(cell, &left);
    let rate = axis_rates(cell, &left, &found, speed);
    let points = [cell.wrist.elbow(&found.0), found.0.wrist, found.1];
    let Posture { turns, singular, least_sine, .. } = found.0;
    Commanded { turns, place, rate, singular, least_sine, points }
}

/// Angles of the axes from the start posture for a motion of the part, as exact as [`commanded`], and 1 where it is out
/// of reach, near a singular posture or beyond a range of the robot's model.
#[inline(always)]
pub fn commanded_axes<R: Real>(cell: &Cell, reference: &Motion<R>) -> ([R; AXES], R) {
    let (place, _, left) = rail_share(cell.rail.as_ref().map(|(rail, _)| rail), *reference);
    let (found, _) = closed_form(cell, &left);
    axis_angles(cell, angles(cell, &found), place, found.singular)
}

/// What the position loops make of a commanded motion of the part, from where the motors are; once a tick.
#[inline(always)]
pub fn set_point<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    s: &Drives<R>,
    last: &SetPoint<R>,
    reference: &Motion<R>,
) -> SetPoint<R> {
    let (zero, one, tick) = (R::lit(0.0), R::lit(1.0), R::lit(cell.tick));
    let Course { angle, rate, mut limited } = course(cell, reference);
    let (mut acceleration, mut speed) = ([zero; AXES], [zero; AXES]);
    for i in 0..cell.axes() {
        let axis = cell.axis(i);
        acceleration[i] = (rate[i] - last.rate[i]) * R::lit(1.0 / cell.tick);
        let motor = s.axis[i].angle + (s.axis[i].windup - last.sag[i]);
        let wanted = (angle[i] - motor).mul_add(p.position_gain, rate[i] * p.velocity_feedforward);
        // Speed first, then its change: the limits that a drive's controller keeps. Another gear accelerates the joints
        // with more torque.
        let most = axis.speed_limit(p);
        let fastest = wanted.min(most).max(-most);
        let change = R::lit(axis.joint.limits.acceleration) * p.gear_ratio * tick;
        speed[i] = fastest.min(last.speed[i] + change).max(last.speed[i] - change);
        let beyond = speed[i].lt(wanted) | wanted.lt(speed[i]);
        limited = limited.max(R::select(beyond, one, zero));
    }
    let torque = feedforward(cell, p, angle, rate, acceleration);
    let (age, cold) = cold(cell.effects, p, last.age, tick);
    SetPoint { angle, rate, speed, torque, age, cold, limited: last.limited.max(limited), ..*last }
}

/// Torques of the feedforward, from a model that may be wrong.
#[inline(always)]
pub(super) fn feedforward<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    angle: [R; AXES],
    rate: [R; AXES],
    acceleration: [R; AXES],
) -> [R; AXES] {
    let zero = [R::lit(0.0); AXES];
    if cell.servo.feedforward == Feedforward::Off {
        return zero;
    }
    let load = weight(cell, angle);
    let mut torque = zero;
    for i in 0..JOINTS {
        torque[i] = load[i].mul_add(p.model_gravity_error, load[i]);
    }
    if cell.servo.feedforward == Feedforward::Gravity {
        return torque;
    }
    let moving = inertial(cell, angle, rate, acceleration);
    for i in 0..cell.axes() {
        let joint = cell.axis(i).joint;
        let rotor = p.gear_ratio * p.gear_ratio * R::lit(joint.drive.reflected_inertia());
        let inertial = acceleration[i].mul_add(rotor, moving[i]);
        // A commanded direction that changes smoothly: no step of the torque at a rate of zero.
        let direction = rate[i] / (rate[i].abs() + R::lit(joint.friction.stribeck_speed));
        let resisting = Levels::of(&joint.friction).torque(direction, rate[i], load[i]);
        let inertial = inertial.mul_add(p.model_inertia_error, inertial);
        torque[i] = torque[i] + inertial + resisting.mul_add(p.model_friction_error, resisting);
    }
    torque
}

/// What the gears carry of a robot at rest: its weight, less what the counterbalances take.
#[inline(always)]
pub(super) fn weight<R: Real>(cell: &Cell, angle: [R; AXES]) -> [R; AXES] {
    let Arm { chain, lifted, .. } = &cell.arm;
    let turns = cell.arm.turns(joints(angle));
    let carried = cell.arm.posture(&turns).weight(Vec3::lit(*lifted));
    // The carriage is pushed along the rail whatever the posture.
    let mut torque = [R::lit(cell.track().0.dot(*lifted) * chain.mass); AXES];
    for i in 0..JOINTS {
        torque[i] = match cell.robot.joints[i].counterweight {
            Some(c) => carried[i] - counterweight_torque(&c, angle[i] + R::lit(cell.start[i])),
            None => carried[i],
        };
    }
    torque
}

/// Torques that move the links, without their weight, and the force that moves the carriage under them.
#[inline(always)]
fn inertial<R: Real>(cell: &Cell, angle: [R; AXES], rate: [R; AXES], acceleration: [R; AXES]) -> [R; AXES] {
    let (along, mass) = cell.track();
    let along = Vec3::lit(along);
    let turns = cell.arm.turns(joints(angle));
    let (torque, push) =
        cell.arm.posture(&turns).torques(&joints(rate), &joints(acceleration), along * acceleration[RAIL]);
    let mut all = [along.dot(push) + acceleration[RAIL] * R::lit(mass); AXES];
    all[..JOINTS].copy_from_slice(&torque);
    all
}

/// The set-point before the first tick: the motion that is under way.
#[inline(always)]
pub fn first_set_point<R: Real>(s: &Drives<R>) -> SetPoint<R> {
    let mut set: SetPoint<R> = filled(R::lit(0.0));
    for i in 0..AXES {
        set.angle[i] = s.axis[i].angle;
        set.rate[i] = s.axis[i].rate;
        set.speed[i] = s.axis[i].rate;
        set.sag[i] = s.axis[i].windup;
    }
    set
}
