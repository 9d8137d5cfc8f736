//! A robot's drives and links, substep by substep, under the wrench on its part.

use super::controller::{Course, course, feedforward, weight};
use super::reach::{Reach, tool_pose};
use super::{AXES, Cell, Drives, JOINTS, RAIL, SetPoint, joints};
use crate::chain::Chain;
use crate::chain::driven::{PointMass, led};
use crate::chain::inertia::Force;
use crate::effects::EffectId;
use crate::fields::filled;
use crate::manipulator::drive::{Reference, cable, motor, moved};
use crate::manipulator::{DriveParams, JointState, counterweight_torque};
use crate::real::Real;
use crate::space::{Motion, Wrench};
use crate::vector::{Mat3, Quat, Vec3};

const PAYLOAD: EffectId = EffectId::of("J14_payload");

/// One substep of a robot: drives, gears, the chain of its links and the carriage under it, under a wrench on its part.
///
/// `load` about the part's origin, laboratory axes.
#[inline(always)]
pub fn drive<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    s: &Drives<R>,
    set_point: &SetPoint<R>,
    load: Wrench<R>,
) -> Drives<R> {
    let zero = R::lit(0.0);
    let (mut torque, mut armature, mut next) = ([zero; AXES], [zero; AXES], *s);
    let mut geared = [None; AXES];
    for i in 0..cell.axes() {
        let axis = cell.axis(i);
        let reference = Reference { speed: set_point.speed[i], torque: set_point.torque[i], cold: set_point.cold };
        // The errors of gears in angle are none of a rack's.
        let p = &if i == RAIL { DriveParams { transmission_error: zero, ..*p } } else { *p };
        let (state, gear, limited) = motor(axis, p, &s.axis[i], reference);
        let (drag, cable) = cable(axis, p, &s.axis[i]);
        next.axis[i] = JointState { cable, ..state };
        next.limited = next.limited.max(limited);
        (torque[i], armature[i]) = (gear.torque + drag, gear.armature);
        if let Some(c) = axis.joint.counterweight {
            torque[i] = torque[i] + counterweight_torque(&c, s.axis[i].angle + R::lit(axis.start));
        }
        geared[i] = Some(gear);
    }
    let acceleration = accelerations(cell, p, s, &torque, &armature, load);
    for i in 0..cell.axes() {
        let gear = geared[i].expect("one gear an axis");
        next.axis[i] = moved(cell.substep, &next.axis[i], gear, acceleration[i]);
    }
    next.limited = next.limited.max(set_point.limited);
    next
}

/// Accelerations of the axes: the chain of the links on what carries it.
#[inline(always)]
fn accelerations<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    s: &Drives<R>,
    torque: &[R; AXES],
    armature: &[R; AXES],
    load: Wrench<R>,
) -> [R; AXES] {
    let (angle, rate) = motion(s);
    let turns = cell.arm.turns(angle);
    let posture = cell.arm.posture(&turns);
    let to_chain = Quat::lit(cell.to_chain);
    let (force, moment) = (posture.in_last(to_chain.rotate(load.force)), posture.in_last(to_chain.rotate(load.moment)));
    let part = Vec3::lit(cell.arm.chain.tool.position);
    let tip = Force { moment: moment + part.cross(force), force };
    let (torques, armatures, lifted) = (joints(*torque), joints(*armature), Vec3::lit(cell.arm.lifted));
    let chain = posture.folded(&rate, &torques, &armatures, tip, led(lifted), unknown_payload(cell, p));
    let (along, mass) = cell.track();
    let along = Vec3::lit(along);
    let mut all = [R::lit(0.0); AXES];
    if cell.rail.is_some() {
        all[RAIL] = chain.slide(along, armature[RAIL] + R::lit(mass), torque[RAIL]);
    }
    let joints = chain.accelerations(&posture, Vec3::zero(), along * all[RAIL]);
    all[..JOINTS].copy_from_slice(&joints);
    all
}

/// The mass on the part that the feedforward does not know, if there may be one.
#[inline(always)]
fn unknown_payload<R: Real>(cell: &Cell, p: &DriveParams<R>) -> Option<PointMass<R>> {
    if !cell.effects.has(PAYLOAD) {
        return None;
    }
    let Chain { tool, tool_axes, .. } = &cell.arm.chain;
    let place = Vec3::lit(tool.position) + Mat3::lit(*tool_axes).times(p.payload_place);
    Some(PointMass { mass: p.payload_error, place })
}

/// Torques with which the joints carry that mass at rest.
#[inline(always)]
fn unknown_weight<R: Real>(cell: &Cell, p: &DriveParams<R>, angle: [R; AXES]) -> [R; AXES] {
    let mut torque = [R::lit(0.0); AXES];
    if let Some(payload) = unknown_payload(cell, p) {
        let turns = cell.arm.turns(joints(angle));
        let carried = cell.arm.posture(&turns).weight_of(payload, Vec3::lit(cell.arm.lifted));
        torque[..JOINTS].copy_from_slice(&carried);
    }
    torque
}

/// Angles and rates of the joints.
#[inline(always)]
fn motion<R: Real>(s: &Drives<R>) -> ([R; JOINTS], [R; JOINTS]) {
    let (mut angle, mut rate) = ([R::lit(0.0); JOINTS], [R::lit(0.0); JOINTS]);
    for i in 0..JOINTS {
        (angle[i], rate[i]) = (s.axis[i].angle, s.axis[i].rate);
    }
    (angle, rate)
}

/// Motion of the part that a robot holds, laboratory, without the rail's; and place and speed on the rail.
#[inline(always)]
pub fn held_part<R: Real>(cell: &Cell, s: &Drives<R>) -> (Motion<R>, [R; 2]) {
    let (angle, rate) = motion(s);
    let pose = tool_pose(cell, angle);
    let (velocity, omega) = Reach::at(cell, angle).twist(rate);
    let to_laboratory = Quat::lit(cell.to_chain.conjugate());
    let motion = Motion {
        position: pose.position,
        attitude: pose.attitude,
        velocity: to_laboratory.rotate(velocity),
        omega: to_laboratory.rotate(omega),
    };
    (motion, [s.axis[RAIL].angle, s.axis[RAIL].rate])
}

/// A robot on its first command: at the commanded velocity, as far behind as its position loops follow, its motors carrying its
/// weight.
#[inline(always)]
pub fn drives_at<R: Real>(cell: &Cell, p: &DriveParams<R>, reference: &Motion<R>) -> Drives<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let Course { angle, rate, limited } = course(cell, reference);
    let mut torque = weight(cell, angle);
    let unknown = unknown_weight(cell, p, angle);
    for i in 0..JOINTS {
        torque[i] = torque[i] + unknown[i];
    }
    let ahead = feedforward(cell, p, angle, rate, [zero; AXES]);
    let mut s = Drives { axis: [filled(zero); AXES], limited };
    for i in 0..cell.axes() {
        let drive = &cell.axis(i).joint.drive;
        let compliance = p.gear_compliance * R::lit(1.0 / drive.gear_stiffness);
        let play = p.backlash * R::lit(0.5 * drive.backlash);
        // Against the loaded flank of the gear; without load in the middle of the play.
        let side = torque[i].min(one).max(-one) * play;
        // The error with which a position loop asks for the rate that is under way.
        let behind = rate[i] * (one - p.velocity_feedforward) / p.position_gain.max(R::lit(1e-3));
        s.axis[i] = JointState {
            angle: angle[i] - behind,
            rate: rate[i],
            windup: torque[i].mul_add(compliance, side),
            motor_rate: rate[i],
            torque: torque[i],
            integral: torque[i] - ahead[i],
            slip: zero,
            cable: zero,
        };
    }
    s
}
