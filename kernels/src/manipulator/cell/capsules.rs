//! Where a robot's links and its tool are: capsules in the laboratory, and how far they reach in a direction at most.

use super::controller::Commanded;
use super::reach::closed_form;
use super::{AXES, Cell, JOINTS, RAIL};
use crate::manipulator::{MAX_CAPSULES, link_frames};
use crate::real::Real;
use crate::robot::rail_share;
use crate::segment::Segment;
use crate::space::Motion;
use crate::vector::{Mat3, Pose, Quat, Vec3};

/// Capsules of a robot with its tool.
pub(crate) struct Links<R> {
    /// Axes of the links' capsules in the laboratory, then that of the tool.
    pub(crate) axes: [Segment<R>; MAX_CAPSULES + 1],
    /// How many of them are links'.
    pub(crate) count: usize,
}

/// The axes of a robot's capsules in the laboratory for a motion of its part; the tool's is the line from the last
/// link's frame to the part's origin.
#[inline(always)]
pub(crate) fn links<R: Real>(cell: &Cell, reference: &Motion<R>) -> Links<R> {
    let (place, _, left) = rail_share(cell.rail.as_ref().map(|(rail, _)| rail), *reference);
    let (found, part) = closed_form(cell, &left);
    placed(cell, &cell.wrist.frames(&found), part, place)
}

/// The same for positions of the axes in the robot's own angles, whatever posture that is.
pub(crate) fn links_at(cell: &Cell, position: &[f64; AXES]) -> Links<f64> {
    let frames = link_frames(&cell.robot, cell.angles_from_start(position));
    let part = frames[JOINTS - 1].compose(cell.tool_inverse.inverse()).position;
    placed(cell, &frames.map(|frame| (frame.attitude.matrix(), frame.position)), part, position[RAIL])
}

/// Capsules on the links' frames in base axes, the part there, and the place on the rail.
#[inline(always)]
fn placed<R: Real>(cell: &Cell, frames: &[(Mat3<R>, Vec3<R>); JOINTS], part: Vec3<R>, place: R) -> Links<R> {
    let base = cell.base_inverse.inverse();
    let (to_laboratory, mut origin) = (Quat::<R>::lit(base.attitude).matrix(), Vec3::lit(base.position));
    if let Some((rail, _)) = &cell.rail {
        origin = Vec3::lit(rail.axis).scale_add(place, origin);
    }
    let mut axes = [Segment { from: Vec3::zero(), to: Vec3::zero() }; MAX_CAPSULES + 1];
    let capsules = &cell.robot.capsules;
    for i in 0..capsules.len() {
        let (axis, (turn, at)) = (capsules[i].axis, frames[capsules[i].joint]);
        axes[i].from = to_laboratory.times(turn.times_onto(axis.from, at)) + origin;
        axes[i].to = to_laboratory.times(turn.times_onto(axis.to, at)) + origin;
    }
    let hand = frames[JOINTS - 1].1;
    axes[capsules.len()] = Segment { from: to_laboratory.times(hand) + origin, to: to_laboratory.times(part) + origin };
    Links { axes, count: capsules.len() }
}

/// Radius of a capsule \[m\], and whether its link counts as arm: all but the last one, which holds the part.
pub(crate) fn wrapped(cell: &Cell, index: usize) -> (f64, bool) {
    let capsule = &cell.robot.capsules[index];
    (capsule.radius, capsule.joint < JOINTS - 1)
}

/// A bound on how far a robot reaches in a direction of the laboratory, from three of its points.
///
/// Its links and its tool lie within some radius of the lines from joint 2 over joint 3 and the wrist's centre to the
/// part's origin, and those that only axis 1 moves reach no farther than a constant, wherever the axes stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// The direction in base axes.
    direction: Vec3<f64>,
    /// What a metre of the rail adds.
    along_rail: f64,
    /// Reach of what only axis 1 moves \[m\].
    fixed: f64,
    /// What is added to joint 3, the wrist's centre and, if the tool counts, the part's origin \[m\].
    added: [Option<f64>; 3],
}

impl Extent {
    /// Along a unit vector of the laboratory, with the tool of this radius or of the links but the last alone.
    pub(crate) fn new(cell: &Cell, towards: Vec3<f64>, tool: Option<f64>) -> Self {
        let base = cell.base_inverse.inverse();
        let direction = base.attitude.rotate_back(towards);
        let offset = towards.dot(base.position);
        let around = direction.x.hypot(direction.y);
        let [height, shoulder] = cell.wrist.shoulder();
        let [upper, elbow, forearm, hand] = cell.wrist.lengths();
        let point = |x, y, z| Vec3 { x, y, z };
        let upper_arm = Segment { from: Vec3::zero(), to: point(upper, 0.0, 0.0) };
        let lower_arm = Segment { from: Vec3::zero(), to: point(elbow, forearm, 0.0) };
        let to_part = Segment { from: point(0.0, 0.0, -hand), to: cell.tool() };
        // What lies beside joint 2 to 3, joint 3 to the wrist's centre, and there to the part.
        let mut beside = [Beside::NOTHING; 3];
        let mut fixed = f64::NEG_INFINITY;
        for capsule in &cell.robot.capsules {
            let radius = capsule.radius;
            for end in [capsule.axis.from, capsule.axis.to] {
                match capsule.joint {
                    0 => {
                        let most = direction.z * (height + end.z) + around * end.x.hypot(end.y);
                        fixed = fixed.max(most + radius);
                    }
                    1 => beside[0].add(nearest(&upper_arm, end), radius),
                    2 => beside[1].add(nearest(&lower_arm, end), radius),
                    3 => beside[1].add(beside_forearm(end, elbow, forearm), radius),
                    4 => beside[1].add((1.0, end.norm()), radius),
                    _ if tool.is_some() => beside[2].add(nearest(&to_part, end), radius),
                    _ => {}
                }
            }
        }
        if let Some(radius) = tool {
            beside[2].add(nearest(&to_part, Vec3::zero()), radius);
            beside[2].add((1.0, 0.0), radius);
        }
        let [upper_arm, lower_arm, to_part] = beside.map(|beside| beside.at_ends());
        if let Some(radius) = upper_arm[0] {
            fixed = fixed.max(direction.z * height + around * shoulder.abs() + radius);
        }
        let most = |one: Option<f64>, two: Option<f64>| one.into_iter().chain(two).reduce(f64::max).map(|r| r + offset);
        let added = [most(upper_arm[1], lower_arm[0]), most(lower_arm[1], to_part[0]), most(to_part[1], None)];
        let along_rail = cell.rail.as_ref().map_or(0.0, |(rail, _)| rail.axis.dot(towards));
        Self { direction, along_rail, fixed: fixed + offset, added }
    }

    /// Greatest coordinate along the direction \[m\].
    #[inline(always)]
    pub(crate) fn reach<R: Real>(&self, at: &Commanded<R>) -> R {
        let direction = Vec3::lit(self.direction);
        let mut reach = R::lit(self.fixed.max(-NOWHERE));
        for i in 0..at.points.len() {
            if let Some(added) = self.added[i] {
                // The new one last, so that a NaN stands.
                reach = reach.max(direction.dot(at.points[i]) + R::lit(added));
            }
        }
        at.place.mul_add(R::lit(self.along_rail), reach)
    }
}

/// A coordinate beyond any robot \[m\].
const NOWHERE: f64 = 1e6;

/// Balls beside a line: each one's place on it, from 0 to 1, and how far from there its surface is \[m\].
struct Beside(Vec<[f64; 2]>);

impl Beside {
    const NOTHING: Self = Self(Vec::new());

    /// Adds a ball about a point from its place on the line and its distance from there.
    fn add(&mut self, (place, distance): (f64, f64), radius: f64) {
        self.0.push([place, distance + radius]);
    }

    /// Radii of balls about the ends of the line whose hull holds all of them; none if there are none.
    fn at_ends(&self) -> [Option<f64>; 2] {
        let most = |nearer: fn(f64) -> bool| {
            let near = self.0.iter().filter(|[place, _]| nearer(*place)).map(|[_, radius]| *radius);
            near.fold(0.0, f64::max)
        };
        if self.0.is_empty() {
            return [None; 2];
        }
        let (mut first, mut last) = (most(|place| place <= 0.0), most(|place| place >= 1.0));
        for [place, radius] in &self.0 {
            // Between the ends the hull's radius is between theirs: what is beyond it raises the nearer one.
            let missing = radius - (first * (1.0 - place) + last * place);
            if missing > 0.0 && *place < 0.5 {
                first += missing / (1.0 - place);
            } else if missing > 0.0 {
                last += missing / place;
            }
        }
        [Some(first), Some(last)]
    }
}

/// Place on a line, from 0 to 1, that is nearest to a point, and the distance from there \[m\].
fn nearest(line: &Segment<f64>, point: Vec3<f64>) -> (f64, f64) {
    let (along, to) = (line.to - line.from, point - line.from);
    let place = (to.dot(along) / along.dot(along).max(1e-12)).clamp(0.0, 1.0);
    (place, (to - along * place).norm())
}

/// Place on the line from joint 3 to the wrist's centre for a point of frame 4, and a bound on its distance from there,
/// wherever axis 4 stands: that axis begins beside joint 3 and meets the line at the wrist.
fn beside_forearm(point: Vec3<f64>, elbow: f64, forearm: f64) -> (f64, f64) {
    if forearm <= 0.0 {
        return (1.0, point.norm());
    }
    let along = point.z.clamp(-forearm, 0.0);
    let back = -along / forearm;
    (1.0 - back, point.x.hypot(point.y).hypot(point.z - along) + elbow.abs() * back)
}

impl Cell {
    /// A point of base axes in the laboratory, at a place on the rail.
    pub(crate) fn in_laboratory(&self, point: Vec3<f64>, on_rail: f64) -> Vec3<f64> {
        let base = self.base_inverse.inverse();
        let along = self.rail.as_ref().map_or(Vec3::zero(), |(rail, _)| rail.axis);
        along.scale_add(on_rail, base.position + base.attitude.rotate(point))
    }

    /// Capsules of the links.
    #[cfg(test)]
    pub(crate) fn capsules(&self) -> &[crate::manipulator::Capsule] {
        &self.robot.capsules
    }

    /// Place of the part's origin in the last link's frame.
    fn tool(&self) -> Vec3<f64> {
        let pose: Pose<f64> = self.tool_inverse.inverse();
        pose.position
    }
}
