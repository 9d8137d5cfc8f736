//! One industrial robot in its place in the laboratory: constants prepared, and the stages that command and drive it.
//!
//! Joint angles count from the start posture, and the tool's place from its start, so that f32 does not freeze: the
//! tool moves by a product of screws about the joint axes of the start posture, each written as a small change.

use super::drive::{Reference, motor, moved};
use super::{
    Branch, DriveParams, JointState, Levels, Manipulator, SphericalWrist, VelocityLoop, best_posture,
    counterweight_torque, forward_dynamics, joint_axis, link_frames, rigid_torques, turn,
};
use crate::bundle;
use crate::fields::filled;
use crate::math::sin_cos;
use crate::real::Real;
use crate::space::{Motion, Wrench};
use crate::vector::{Mat3, Pose, Quat, Vec3, vec3};
use std::f64::consts::TAU;

bundle! {
    /// One robot's joints; written by the drive stage.
    Drives {
        joint: [JointState<R>; 6], "1", "joint";
        limited: R, "1", "1 once a torque, speed, acceleration or range limit was met";
    }
}

bundle! {
    /// What a robot's controller is told for a tick; written by the set-point stage.
    SetPoint {
        angle: [R; 6], "rad", "commanded joint angles, from the start posture";
        rate: [R; 6], "rad/s", "commanded joint rates";
        speed: [R; 6], "rad/s", "motor speed that the position loops ask for";
        torque: [R; 6], "N m", "torque of the feedforward";
        sag: [R; 6], "rad", "windup of the gears under the weight at the start, which the start's alignment takes out";
        limited: R, "1", "1 once a command was out of reach, near a singular posture or beyond a limit";
    }
}

/// What the controller adds to the velocity loop's torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// Nothing.
    Off,
    /// The torque that carries the robot's weight at the commanded posture.
    Gravity,
    /// All torques of the commanded motion: inertia, weight, friction.
    Full,
}

/// What a robot carries, fixed to its flange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the part's frame \[m\].
    pub com: Vec3<f64>,
    /// Inertia about the centre of mass, part axes \[kg m^2\].
    pub inertia: crate::vector::Sym3<f64>,
}

/// Where a robot stands and what it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Pose of the robot's base in the laboratory.
    pub base: Pose<f64>,
    /// Pose of the contact part in the last link's frame.
    pub tool: Pose<f64>,
    /// The contact part and what holds it.
    pub payload: Payload,
}

/// The controllers of a robot's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    /// Velocity loop of each joint.
    pub velocity: [VelocityLoop; 6],
    /// What the controller adds.
    pub feedforward: Feedforward,
}

/// A robot prepared for its stages.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The robot with its payload; its link frames at joint angle 0 are those of the start posture.
    robot: Manipulator,
    wrist: SphericalWrist,
    branch: Branch,
    /// Start posture, in the robot's own angles \[rad\].
    pub start: [f64; 6],
    servo: Servo,
    base: Pose<f64>,
    base_inverse: Pose<f64>,
    tool: Pose<f64>,
    tool_inverse: Pose<f64>,
    /// Pose of the part at the start posture, laboratory.
    home: Pose<f64>,
    /// Joint axes at the start posture and the levers from them to the part, laboratory.
    screws: [(Vec3<f64>, Vec3<f64>); 6],
    /// Command period and substep \[s\].
    tick: f64,
    substep: f64,
}

/// Why a robot cannot stand where it is put.
#[derive(Clone, Debug, PartialEq)]
pub enum Misplaced {
    /// Not six joints with a spherical wrist.
    NoWrist,
    /// No posture inside the joints' ranges reaches the start.
    OutOfReach,
}

impl Cell {
    /// A robot whose part starts at `home` (laboratory).
    ///
    /// # Errors
    /// If the robot's wrist is not spherical or its joints cannot reach the start.
    pub fn new(
        robot: &Manipulator,
        mount: &Mount,
        servo: &Servo,
        home: Pose<f64>,
        timing: &crate::model::Timing,
    ) -> Result<Self, Misplaced> {
        let wrist = SphericalWrist::of(robot).ok_or(Misplaced::NoWrist)?;
        let (base_inverse, tool_inverse) = (mount.base.inverse(), mount.tool.inverse());
        let frame6 = base_inverse.compose(home).compose(tool_inverse);
        let (branch, start) = best_posture(robot, &wrist, frame6).ok_or(Misplaced::OutOfReach)?;
        let mut robot = robot.clone();
        for (joint, angle) in robot.joints.iter_mut().zip(start) {
            let turned = turn(vec3(0.0, 0.0, 1.0), joint.sign * angle);
            joint.link.origin.attitude = joint.link.origin.attitude.compose(turned);
        }
        carry(&mut robot, mount);
        let frames = link_frames(&robot, [0.0; 6]);
        let screws = std::array::from_fn(|i| {
            let axis = mount.base.attitude.rotate(joint_axis(frames[i], robot.joints[i].sign));
            (axis, home.position - mount.base.compose(frames[i]).position)
        });
        Ok(Self {
            robot,
            wrist,
            branch,
            start,
            servo: servo.clone(),
            base: mount.base,
            base_inverse,
            tool: mount.tool,
            tool_inverse,
            home,
            screws,
            tick: timing.tick(),
            substep: timing.substep,
        })
    }
}

/// Adds the payload to the last link.
fn carry(robot: &mut Manipulator, mount: &Mount) {
    let last = &mut robot.joints.last_mut().expect("six joints").link;
    let (payload, tool) = (&mount.payload, mount.tool);
    let com = tool.position + tool.attitude.rotate(payload.com);
    let mass = last.mass + payload.mass;
    let middle = (last.com * last.mass + com * payload.mass) * (1.0 / mass);
    let own = last.inertia + crate::vector::Sym3::point_mass(last.mass, last.com - middle);
    let carried =
        payload.inertia.rotated(tool.attitude.matrix()) + crate::vector::Sym3::point_mass(payload.mass, com - middle);
    (last.mass, last.com, last.inertia) = (mass, middle, own + carried);
}

/// The part's pose in the laboratory, from joint angles: its place changes by the screws, last joint first.
#[inline(always)]
fn tool_pose<R: Real>(cell: &Cell, angle: [R; 6]) -> Pose<R> {
    let (mut shift, mut turn) = (Vec3::zero(), Quat::identity());
    for i in (0..6).rev() {
        let (axis, lever) = (Vec3::lit(cell.screws[i].0), Vec3::lit(cell.screws[i].1));
        let (s, c) = sin_cos(angle[i] * R::lit(0.5));
        // (rotation - 1) r = 2 s (c a x r + s a x (a x r)) with the half angle: small for a small angle.
        let r: Vec3<R> = lever + shift;
        let across = axis.cross(r);
        shift = (across * c + axis.cross(across) * s).scale_add(s + s, shift);
        turn = Quat { w: c, v: axis * s }.compose(turn);
    }
    Pose { position: Vec3::lit(cell.home.position) + shift, attitude: turn.compose(Quat::lit(cell.home.attitude)) }
}

/// What the part's twist and the joints' rates have to do with each other at a posture; base axes.
struct Reach<R> {
    frames: [Pose<R>; 6],
    axes: [Vec3<R>; 6],
    part: Vec3<R>,
}

impl<R: Real> Reach<R> {
    #[inline(always)]
    fn at(cell: &Cell, angle: [R; 6]) -> Self {
        let frames = link_frames(&cell.robot, angle);
        let mut axes = [Vec3::zero(); 6];
        for i in 0..6 {
            axes[i] = joint_axis(frames[i], cell.robot.joints[i].sign);
        }
        let part = frames[5].position + frames[5].attitude.rotate(Vec3::lit(cell.tool.position));
        Self { frames, axes, part }
    }

    /// Velocity of the part's origin and angular velocity, base axes.
    #[inline(always)]
    fn twist(&self, rate: [R; 6]) -> (Vec3<R>, Vec3<R>) {
        let (mut velocity, mut omega) = (Vec3::zero(), Vec3::zero());
        for (i, rate) in rate.into_iter().enumerate() {
            velocity = self.axes[i].cross(self.part - self.frames[i].position).scale_add(rate, velocity);
            omega = self.axes[i].scale_add(rate, omega);
        }
        (velocity, omega)
    }

    /// Joint rates for a velocity of the part and an angular velocity: the wrist's centre needs the first three alone.
    #[inline(always)]
    fn rates(&self, velocity: Vec3<R>, omega: Vec3<R>) -> [R; 6] {
        let wrist = self.frames[4].position;
        let column = |i: usize| self.axes[i].cross(wrist - self.frames[i].position);
        let arm = Mat3 { x: column(0), y: column(1), z: column(2) };
        let first = solve(arm, velocity + omega.cross(wrist - self.part));
        let swung = self.axes[2].scale_add(first.z, self.axes[1].scale_add(first.y, self.axes[0] * first.x));
        let hand = Mat3 { x: self.axes[3], y: self.axes[4], z: self.axes[5] };
        let last = solve(hand, omega - swung);
        [first.x, first.y, first.z, last.x, last.y, last.z]
    }
}

/// `columns * x = right`; near a singular matrix the solution stays bounded.
#[inline(always)]
fn solve<R: Real>(columns: Mat3<R>, right: Vec3<R>) -> Vec3<R> {
    let (yz, least) = (columns.y.cross(columns.z), R::lit(1e-3));
    let determinant = columns.x.dot(yz);
    let safe = R::select(determinant.lt(R::lit(0.0)), determinant.min(-least), determinant.max(least));
    let x = right.dot(yz);
    let y = columns.x.dot(right.cross(columns.z));
    let z = columns.x.dot(columns.y.cross(right));
    vec3(x, y, z) * (R::lit(1.0) / safe)
}

/// Joint angles that put the part at a pose, and 1 where they are out of reach, singular or out of range.
///
/// The closed form finds the posture to the scalar's rounding of metres; one Newton step on the small differences
/// finds it to the rounding of millimetres.
#[inline(always)]
fn posture<R: Real>(cell: &Cell, told: &Motion<R>) -> ([R; 6], R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let pose = Pose { position: told.position, attitude: told.attitude };
    let frame6 = Pose::lit(cell.base_inverse).compose(pose).compose(Pose::lit(cell.tool_inverse));
    let found = cell.wrist.inverse(cell.branch, frame6);
    let (mut angle, mut limited) = (found.angle, found.singular);
    for (i, angle) in angle.iter_mut().enumerate() {
        let away = *angle - R::lit(cell.start[i]);
        let turns = away.mul_add(R::lit(1.0 / TAU), R::lit(0.5)).floor();
        *angle = turns.mul_add(R::lit(-TAU), away);
    }
    let reach = Reach::at(cell, angle);
    let at = tool_pose(cell, angle);
    let error = told.attitude.compose(at.attitude.conjugate());
    let turn = error.v * R::select(error.w.lt(zero), R::lit(-2.0), R::lit(2.0));
    let to_base = Quat::lit(cell.base_inverse.attitude);
    let step = reach.rates(to_base.rotate(told.position - at.position), to_base.rotate(turn));
    for i in 0..6 {
        let limits = &cell.robot.joints[i].limits;
        let wanted = angle[i] + step[i];
        angle[i] = wanted.min(R::lit(limits.upper - cell.start[i])).max(R::lit(limits.lower - cell.start[i]));
        let beyond = angle[i].lt(wanted) | wanted.lt(angle[i]);
        limited = limited.max(R::select(beyond, one, zero));
    }
    (angle, limited)
}

/// What the position loops make of a commanded motion of the part, from where the motors are; once a tick.
#[inline(always)]
pub fn set_point<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    s: &Drives<R>,
    last: &SetPoint<R>,
    told: &Motion<R>,
) -> SetPoint<R> {
    let (zero, one, tick) = (R::lit(0.0), R::lit(1.0), R::lit(cell.tick));
    let (angle, mut limited) = posture(cell, told);
    let to_base = Quat::lit(cell.base_inverse.attitude);
    let rate = Reach::at(cell, angle).rates(to_base.rotate(told.velocity), to_base.rotate(told.omega));
    let (mut acceleration, mut speed) = ([zero; 6], [zero; 6]);
    for i in 0..6 {
        let limits = &cell.robot.joints[i].limits;
        acceleration[i] = (rate[i] - last.rate[i]) * R::lit(1.0 / cell.tick);
        let motor = s.joint[i].angle + (s.joint[i].windup - last.sag[i]);
        let wanted = (angle[i] - motor).mul_add(p.position_gain, rate[i] * p.velocity_feedforward);
        // Speed first, then its change: the limits that a drive's controller keeps. Another gear lets the motors turn no
        // faster, but accelerate the joints with more torque.
        let most = R::lit(limits.speed) / p.gear_ratio;
        let fastest = wanted.min(most).max(-most);
        let change = R::lit(limits.acceleration) * p.gear_ratio * tick;
        speed[i] = fastest.min(last.speed[i] + change).max(last.speed[i] - change);
        let beyond = speed[i].lt(wanted) | wanted.lt(speed[i]);
        limited = limited.max(R::select(beyond, one, zero));
    }
    let torque = feedforward(cell, p, angle, rate, acceleration);
    SetPoint { angle, rate, speed, torque, limited: last.limited.max(limited), ..*last }
}

/// Torques of the feedforward, from a model that may be wrong.
#[inline(always)]
fn feedforward<R: Real>(cell: &Cell, p: &DriveParams<R>, angle: [R; 6], rate: [R; 6], acceleration: [R; 6]) -> [R; 6] {
    let zero = [R::lit(0.0); 6];
    if cell.servo.feedforward == Feedforward::Off {
        return zero;
    }
    let still = weight(cell, angle);
    let load = carried(cell, angle, still);
    let mut torque = zero;
    for i in 0..6 {
        torque[i] = load[i].mul_add(p.model_gravity_error, load[i]);
    }
    if cell.servo.feedforward == Feedforward::Gravity {
        return torque;
    }
    let moving = rigid_torques(&cell.robot, angle, rate, acceleration);
    for i in 0..6 {
        let joint = &cell.robot.joints[i];
        let rotor = p.gear_ratio * p.gear_ratio * R::lit(joint.drive.reflected_inertia());
        let inertial = acceleration[i].mul_add(rotor, moving[i] - still[i]);
        // A commanded direction that changes smoothly: no step of the torque at a rate of zero.
        let direction = rate[i] / (rate[i].abs() + R::lit(joint.friction.stribeck_speed));
        let resisting = Levels::of(&joint.friction).torque(direction, rate[i], load[i]);
        let inertial = inertial.mul_add(p.model_inertia_error, inertial);
        torque[i] = torque[i] + inertial + resisting.mul_add(p.model_friction_error, resisting);
    }
    torque
}

/// Torques of the rigid links at rest.
#[inline(always)]
fn weight<R: Real>(cell: &Cell, angle: [R; 6]) -> [R; 6] {
    let still = [R::lit(0.0); 6];
    rigid_torques(&cell.robot, angle, still, still)
}

/// What the gears carry of the links' weight: what the counterbalances leave.
#[inline(always)]
fn carried<R: Real>(cell: &Cell, angle: [R; 6], mut weight: [R; 6]) -> [R; 6] {
    for i in 0..6 {
        if let Some(c) = cell.robot.joints[i].counterweight {
            weight[i] = weight[i] - counterweight_torque(&c, angle[i] + R::lit(cell.start[i]));
        }
    }
    weight
}

/// One substep of a robot: drives, gears and the chain of its links, under a wrench on its part.
///
/// `load` about the part's origin, laboratory axes; `rail` the acceleration of the robot's base \[m/s^2\], laboratory.
#[inline(always)]
pub fn drive<R: Real>(
    cell: &Cell,
    p: &DriveParams<R>,
    s: &Drives<R>,
    told: &SetPoint<R>,
    load: Wrench<R>,
    rail: Vec3<R>,
) -> Drives<R> {
    let zero = R::lit(0.0);
    let (mut angle, mut rate) = ([zero; 6], [zero; 6]);
    for i in 0..6 {
        (angle[i], rate[i]) = (s.joint[i].angle, s.joint[i].rate);
    }
    let (mut torque, mut armature, mut next) = ([zero; 6], [zero; 6], *s);
    let mut geared = [None; 6];
    for i in 0..6 {
        let joint = &cell.robot.joints[i];
        let reference = Reference { speed: told.speed[i], torque: told.torque[i] };
        let servo = &cell.servo.velocity[i];
        let (state, gear, limited) = motor(joint, servo, cell.start[i], cell.substep, p, &s.joint[i], reference);
        next.joint[i] = state;
        next.limited = next.limited.max(limited);
        (torque[i], armature[i]) = (gear.torque, gear.armature);
        if let Some(c) = joint.counterweight {
            torque[i] = torque[i] + counterweight_torque(&c, angle[i] + R::lit(cell.start[i]));
        }
        geared[i] = Some(gear);
    }
    let frames = link_frames(&cell.robot, angle);
    let part = frames[5].position + frames[5].attitude.rotate(Vec3::lit(cell.tool.position));
    let to_base = Quat::lit(cell.base_inverse.attitude);
    let force = to_base.rotate(load.force);
    let tip = Wrench { force, moment: to_base.rotate(load.moment) + part.cross(force) };
    let acceleration = forward_dynamics(&cell.robot, &frames, rate, &torque, &armature, tip, to_base.rotate(rail));
    for i in 0..6 {
        let gear = geared[i].expect("one gear a joint");
        next.joint[i] = moved(cell.substep, &next.joint[i], gear, acceleration[i]);
    }
    next.limited = next.limited.max(told.limited);
    next
}

/// Motion of the part that a robot holds, laboratory.
#[inline(always)]
pub fn held_part<R: Real>(cell: &Cell, s: &Drives<R>) -> Motion<R> {
    let zero = R::lit(0.0);
    let (mut angle, mut rate) = ([zero; 6], [zero; 6]);
    for i in 0..6 {
        (angle[i], rate[i]) = (s.joint[i].angle, s.joint[i].rate);
    }
    let pose = tool_pose(cell, angle);
    let (velocity, omega) = Reach::at(cell, angle).twist(rate);
    let to_laboratory = Quat::lit(cell.base.attitude);
    Motion {
        position: pose.position,
        attitude: pose.attitude,
        velocity: to_laboratory.rotate(velocity),
        omega: to_laboratory.rotate(omega),
    }
}

/// A robot on its first command: moving as told, as far behind as its position loops follow, its motors carrying its
/// weight.
#[inline(always)]
pub fn drives_at<R: Real>(cell: &Cell, p: &DriveParams<R>, told: &Motion<R>) -> Drives<R> {
    let zero = R::lit(0.0);
    let (angle, limited) = posture(cell, told);
    let to_base = Quat::lit(cell.base_inverse.attitude);
    let rate = Reach::at(cell, angle).rates(to_base.rotate(told.velocity), to_base.rotate(told.omega));
    let torque = carried(cell, angle, weight(cell, angle));
    let ahead = feedforward(cell, p, angle, rate, [zero; 6]);
    let mut s = Drives { joint: [filled(zero); 6], limited };
    for i in 0..6 {
        let drive = &cell.robot.joints[i].drive;
        let compliance = p.gear_compliance * R::lit(1.0 / drive.gear_stiffness);
        let play = p.backlash * R::lit(0.5 * drive.backlash);
        // Against the loaded flank of the gear; without load in the middle of the play.
        let one = R::lit(1.0);
        let side = torque[i].min(one).max(-one) * play;
        // The error with which a position loop asks for the rate that is under way.
        let behind = rate[i] * (R::lit(1.0) - p.velocity_feedforward) / p.position_gain.max(R::lit(1e-3));
        s.joint[i] = JointState {
            angle: angle[i] - behind,
            rate: rate[i],
            windup: torque[i].mul_add(compliance, side),
            motor_rate: rate[i],
            torque: torque[i],
            integral: torque[i] - ahead[i],
            slip: zero,
        };
    }
    s
}

/// The set-point before the first tick: the motion that is under way.
#[inline(always)]
pub fn first_set_point<R: Real>(s: &Drives<R>) -> SetPoint<R> {
    let mut set: SetPoint<R> = filled(R::lit(0.0));
    for i in 0..6 {
        set.angle[i] = s.joint[i].angle;
        set.rate[i] = s.joint[i].rate;
        set.speed[i] = s.joint[i].rate;
        set.sag[i] = s.joint[i].windup;
    }
    set
}
