//! Inverse kinematics in closed form: an arm of two links in a vertical plane that turns, with a spherical wrist.
//!
//! Modified (Craig) Denavit-Hartenberg table with `alpha = 0, -90, 0, -90, 90, -90 deg` and the lengths below; the
//! wrist's centre fixes the first three joints, the rest of the attitude the last three (Pieper 1968).

use super::Manipulator;
use crate::chain::Turn;
use crate::math::atan2;
use crate::real::Real;
use crate::vector::{Mat3, Pose, Quat, Vec3, vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Below this sine of the wrist's bend, or of the elbow's, or this distance of the wrist from axis 1 \[m\], a posture
/// counts as singular: one degree, and a tenth of a forearm.
const SINGULAR_SINE: f64 = 0.0175;
const SINGULAR_DISTANCE: f64 = 0.1;
/// What divides a rate is at least so much \[m, m^2 or 1\], so that rates stay bounded at a singular posture.
const LEAST: f64 = 1e-3;

/// The lengths of the arm and the way its joints count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalWrist {
    /// Height of joint 2 above the base \[m\].
    height: f64,
    /// Distance of joint 2 from axis 1 \[m\].
    shoulder: f64,
    /// Length of the upper arm \[m\].
    upper: f64,
    /// Offset of axis 4 from joint 3 \[m\].
    elbow: f64,
    /// Distance of the wrist's centre from joint 3, along axis 4 \[m\].
    forearm: f64,
    /// Distance of frame 6 from the wrist's centre \[m\].
    hand: f64,
    /// Angle of each frame at joint angle 0 \[rad\].
    offset: [f64; 6],
    /// +1 or -1.
    sign: [f64; 6],
}

/// One of the eight postures that reach a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// The arm reaches over its own back.
    pub back: bool,
    /// The elbow hangs below the line from shoulder to wrist.
    pub elbow_down: bool,
    /// The wrist is turned over: joint 5 has the other sign.
    pub flipped: bool,
}

impl Branch {
    /// All eight.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..8).map(|bits| Self { back: bits & 1 != 0, elbow_down: bits & 2 != 0, flipped: bits & 4 != 0 })
    }
}

/// A posture that reaches a pose, by the turns of its frames; what follows of them needs no transcendental function.
#[derive(Clone, Copy, Debug)]
pub struct Posture<R> {
    /// Turns of the six frames, each from the one before it.
    pub(crate) turns: [Turn<R>; 6],
    /// 1 where the pose is out of reach or singular (the posture is then that of the nearest arm that is stretched).
    pub singular: R,
    /// Least of the sines of the wrist's bend, of the elbow's, and of the angle from axis 1 at which the stretched arm
    /// would have the wrist's centre as far from that axis.
    pub(crate) least_sine: R,
    /// The wrist's centre, base axes \[m\].
    pub(crate) wrist: Vec3<R>,
    /// 1 over its distance from axis 1, negative behind the robot's back, bounded \[1/m\].
    per_out: R,
    /// From joint 3 to the wrist's centre in the arm's plane, outwards and downwards \[m\].
    lower: (R, R),
    /// Axes of frame 3, base axes.
    third: Mat3<R>,
    /// 1 over the sine of the wrist's bend, negative if the wrist is turned over, bounded.
    per_bend: R,
}

impl SphericalWrist {
    /// Reads the lengths from a robot's joints; none if it is built otherwise.
    pub fn of(robot: &Manipulator) -> Option<Self> {
        if robot.joints.len() != 6 {
            return None;
        }
        let tilts = [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2];
        let (mut offset, mut place) = ([0.0; 6], [(0.0, 0.0); 6]);
        for (i, joint) in robot.joints.iter().enumerate() {
            // Rx(alpha) Rz(offset) with the alpha of the table: undo the tilt, a turn about z must be left.
            let (s, c) = (0.5 * tilts[i]).sin_cos();
            let tilt = Quat { w: c, v: vec3(s, 0.0, 0.0) };
            let rest = tilt.conjugate().compose(joint.link.origin.attitude);
            let at = tilt.rotate_back(joint.link.origin.position);
            if rest.v.x.hypot(rest.v.y) > 1e-9 || at.y.abs() > 1e-9 {
                return None;
            }
            offset[i] = 2.0 * rest.v.z.atan2(rest.w);
            place[i] = (at.x, at.z);
        }
        let absent = [place[0].0, place[1].1, place[2].1, place[4].0, place[4].1, place[5].0];
        let sign = std::array::from_fn(|i| robot.joints[i].sign);
        absent.iter().all(|length| length.abs() < 1e-9).then_some(Self {
            height: place[0].1,
            shoulder: place[1].0,
            upper: place[2].0,
            elbow: place[3].0,
            forearm: place[3].1,
            hand: place[5].1,
            offset,
            sign,
        })
    }

    /// The posture of a branch that puts frame 6 (origin and axes, base axes) at a pose.
    #[inline(always)]
    pub fn inverse<R: Real>(&self, branch: Branch, frame6: Pose<R>) -> Posture<R> {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let axes = frame6.attitude.matrix();
        let wrist = axes.z.scale_add(R::lit(-self.hand), frame6.position);
        let square_out = wrist.x.mul_add(wrist.x, wrist.y * wrist.y);
        let side = R::lit(if branch.back { -1.0 } else { 1.0 });
        let outwards = side / square_out.max(R::lit(LEAST * LEAST)).sqrt();
        let first = Turn { cos: wrist.x * outwards, sin: wrist.y * outwards };
        let out = square_out * outwards;
        // The vertical plane: x outwards from joint 2, y downwards.
        let (x, y) = (out - R::lit(self.shoulder), R::lit(self.height) - wrist.z);
        let (upper, lower) = (self.upper, self.elbow.hypot(self.forearm));
        let square = x.mul_add(x, y * y);
        let cosine = (square - R::lit(upper * upper + lower * lower)) * R::lit(0.5 / (upper * lower));
        let cos = cosine.min(one).max(-one);
        let down = R::lit(if branch.elbow_down { -1.0 } else { 1.0 });
        let bent = Turn { cos, sin: ((one - cos) * (one + cos)).sqrt() * down };
        // From joint 2 to the wrist as the upper arm sees it, and the distance that the arm has.
        let (along, across) = (bent.cos.mul_add(R::lit(lower), R::lit(upper)), bent.sin * R::lit(lower));
        let length = square * along.mul_add(along, across * across);
        let unit = one / length.max(R::lit(1e-30)).sqrt();
        let second = Turn { cos: x.mul_add(along, y * across) * unit, sin: y.mul_add(along, x * -across) * unit };
        let third = bent.and(Turn::lit(Turn { cos: self.elbow / lower, sin: -self.forearm / lower }));
        let forearm = second.and(bent);
        let plane = second.and(third);
        let frame3 = plane_axes(first, plane);
        // The wrist's turn Rz(theta4) Ry(-theta5) Rz(theta6) in axes turned by Rx(-90): (x, y, z) there is (x, -z, y) here.
        let (x3, y3, z3) =
            (frame3.transposed_times(axes.x), frame3.transposed_times(axes.y), frame3.transposed_times(axes.z));
        let sign = R::lit(if branch.flipped { -1.0 } else { 1.0 });
        let bend = z3.x.mul_add(z3.x, z3.z * z3.z).sqrt();
        let unit = sign / bend.max(R::lit(LEAST));
        let turns = [
            first,
            second,
            third,
            Turn { cos: z3.x * unit, sin: -(z3.z * unit) },
            Turn { cos: z3.y, sin: -(bend * sign) },
            Turn { cos: -(x3.y * unit), sin: y3.y * unit },
        ];
        let stretched = bent.sin.abs().lt(R::lit(SINGULAR_SINE));
        let overhead = out.abs().lt(R::lit(SINGULAR_DISTANCE));
        let singular = R::select(stretched | overhead | bend.lt(R::lit(SINGULAR_SINE)), one, zero);
        let per_length = R::lit(1.0 / (upper + lower));
        let least_sine = bend.min(bent.sin.abs()).min(out.abs() * per_length);
        let lower = (forearm.cos * R::lit(lower), forearm.sin * R::lit(lower));
        Posture { turns, singular, least_sine, wrist, per_out: outwards, lower, third: frame3, per_bend: unit }
    }

    /// Joint angles of a posture \[rad\], each within half a turn of its frame's offset.
    #[inline(always)]
    pub fn angles<R: Real>(&self, posture: &Posture<R>) -> [R; 6] {
        let mut angle = [R::lit(0.0); 6];
        for (i, angle) in angle.iter_mut().enumerate() {
            let Turn { cos, sin } = posture.turns[i];
            *angle = (atan2(sin, cos) - R::lit(self.offset[i])) * R::lit(self.sign[i]);
        }
        angle
    }

    /// Joint rates at a posture, for the velocity of a point that the last link carries and its angular velocity; base
    /// axes. Near a singular posture they stay bounded.
    #[inline(always)]
    pub fn rates<R: Real>(&self, posture: &Posture<R>, point: Vec3<R>, velocity: Vec3<R>, omega: Vec3<R>) -> [R; 6] {
        let Posture { turns: [first, second, _, fourth, fifth, _], wrist, lower: (x, y), third, .. } = *posture;
        let v = velocity + omega.cross(wrist - point);
        let (outwards, around) = (v.x.mul_add(first.cos, v.y * first.sin), v.y.mul_add(first.cos, v.x * -first.sin));
        let swing = around * posture.per_out;
        // In the arm's plane, outwards and downwards: the upper arm and the lower one each turn about an end.
        let (upper_x, upper_y) = (second.cos * R::lit(self.upper), second.sin * R::lit(self.upper));
        let determinant = R::lit(1.0) / away_from_zero(upper_x.mul_add(y, upper_y * -x));
        let upper_rate = outwards.mul_add(x, v.z * -y) * determinant;
        let lower_rate = (v.z.mul_add(upper_y, outwards * -upper_x)) * determinant;
        // What is left for the wrist, in frame 3 turned by Rx(-90), then in frame 4.
        let left = third.transposed_times(vec3(
            (first.sin * lower_rate) + omega.x,
            omega.y - first.cos * lower_rate,
            omega.z - swing,
        ));
        let (across, along) =
            (left.x.mul_add(fourth.cos, left.z * -fourth.sin), -(left.x.mul_add(fourth.sin, left.z * fourth.cos)));
        let last = across * posture.per_bend;
        let mut rate = [swing, upper_rate, lower_rate - upper_rate, fifth.cos.mul_add(-last, left.y), -along, last];
        for (rate, sign) in rate.iter_mut().zip(self.sign) {
            *rate = *rate * R::lit(sign);
        }
        rate
    }

    /// Joint 3 at a posture, base axes.
    #[inline(always)]
    pub(crate) fn elbow<R: Real>(&self, posture: &Posture<R>) -> Vec3<R> {
        let [first, second, ..] = posture.turns;
        let out = second.cos.mul_add(R::lit(self.upper), R::lit(self.shoulder));
        vec3(out * first.cos, out * first.sin, second.sin.mul_add(R::lit(-self.upper), R::lit(self.height)))
    }

    /// Axes and origins of the six frames at a posture, base axes.
    #[inline(always)]
    pub(crate) fn frames<R: Real>(&self, posture: &Posture<R>) -> [(Mat3<R>, Vec3<R>); 6] {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let [first, second, _, fourth, fifth, sixth] = posture.turns;
        let column = Mat3 {
            x: vec3(first.cos, first.sin, zero),
            y: vec3(-first.sin, first.cos, zero),
            z: vec3(zero, zero, one),
        };
        let shoulder = column.x.scale_add(R::lit(self.shoulder), vec3(zero, zero, R::lit(self.height)));
        let (upper, third) = (plane_axes(first, second), posture.third);
        let forearm = turned(Mat3 { x: third.x, y: -third.z, z: third.y }, fourth);
        let wrist = turned(Mat3 { x: forearm.x, y: forearm.z, z: -forearm.y }, fifth);
        let hand = turned(Mat3 { x: wrist.x, y: -wrist.z, z: wrist.y }, sixth);
        let centre = posture.wrist;
        [
            (column, vec3(zero, zero, R::lit(self.height))),
            (upper, shoulder),
            (third, self.elbow(posture)),
            (forearm, centre),
            (wrist, centre),
            (hand, hand.z.scale_add(R::lit(self.hand), centre)),
        ]
    }

    /// Height of joint 2 above the base and its distance from axis 1 \[m\].
    pub(crate) fn shoulder(&self) -> [f64; 2] {
        [self.height, self.shoulder]
    }

    /// Lengths from joint 2 to joint 3, from there to axis 4 and along it to the wrist's centre, and on to frame 6 \[m\].
    pub(crate) fn lengths(&self) -> [f64; 4] {
        [self.upper, self.elbow, self.forearm, self.hand]
    }

    /// The angle of a joint's frame from the one before it, at an angle of the joint \[rad\].
    pub(crate) fn frame_angle(&self, joint: usize, angle: f64) -> f64 {
        self.offset[joint] + self.sign[joint] * angle
    }
}

/// A divisor that is not too small, with its sign.
#[inline(always)]
fn away_from_zero<R: Real>(value: R) -> R {
    let least = R::lit(LEAST);
    R::select(value.lt(R::lit(0.0)), value.min(-least), value.max(least))
}

/// Axes turned about their own z axis.
#[inline(always)]
fn turned<R: Real>(axes: Mat3<R>, Turn { cos, sin }: Turn<R>) -> Mat3<R> {
    Mat3 { x: axes.y.scale_add(sin, axes.x * cos), y: axes.x.scale_add(-sin, axes.y * cos), z: axes.z }
}

/// Axes of a frame in the arm's plane: Rz(first) Rx(-90) Rz(plane).
#[inline(always)]
fn plane_axes<R: Real>(first: Turn<R>, plane: Turn<R>) -> Mat3<R> {
    let (Turn { cos: c1, sin: s1 }, Turn { cos: c, sin: s }) = (first, plane);
    Mat3 { x: vec3(c * c1, c * s1, -s), y: vec3(-(s * c1), -(s * s1), -c), z: vec3(-s1, c1, R::lit(0.0)) }
}

/// The angle within half a turn of `near` \[rad\].
pub fn nearest_turn(angle: f64, near: f64) -> f64 {
    angle - TAU * ((angle - near) / TAU).round()
}

/// The branch whose posture lies farthest inside the joints' ranges, with its angles; none if no posture is inside.
///
/// `frame6` in base axes; a joint that can turn more than once takes the turn nearest to the middle of its range.
pub fn best_posture(robot: &Manipulator, wrist: &SphericalWrist, frame6: Pose<f64>) -> Option<(Branch, [f64; 6])> {
    let mut best: Option<(f64, Branch, [f64; 6])> = None;
    for branch in Branch::all() {
        let posture = wrist.inverse(branch, frame6);
        if posture.singular > 0.0 {
            continue;
        }
        let (mut angle, mut room) = (wrist.angles(&posture), f64::INFINITY);
        for (angle, joint) in angle.iter_mut().zip(&robot.joints) {
            let (lower, upper) = (joint.limits.lower, joint.limits.upper);
            *angle = nearest_turn(*angle, 0.5 * (lower + upper));
            // Room as a share of half a turn at most, so that a wide range does not decide alone.
            room = room.min(((*angle - lower).min(upper - *angle) / PI).min(1.0));
        }
        if room >= 0.0 && best.is_none_or(|(most, ..)| room > most) {
            best = Some((room, branch, angle));
        }
    }
    best.map(|(_, branch, angle)| (branch, angle))
}
