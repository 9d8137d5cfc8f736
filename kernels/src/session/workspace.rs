//! Where the robots of a session may not be: near each other's arms, in keep-out boxes.
//!
//! Distances are computed only where a cheap bound cannot exclude that a rule is met: a plane between the arms, and for
//! each robot and box a face of the box that the robot is outside of.

use super::axes::{Asked, SessionRobot};
use crate::bundle;
use crate::manipulator::cell::{AXES, Commanded, Extent, Links, links, links_at, wrapped};
use crate::model::{KeepOut, SessionRules};
use crate::plant::Plant;
use crate::real::Real;
use crate::segment::Segment;
use crate::space::Parts;
use crate::vector::{Mat3, Vec3, vec3};

bundle! {
    /// How far the robots are from where they may not be.
    Clearance {
        arms: R, "m", "least distance between the arms, without the links that hold the parts";
        depth: R, "m", "greatest depth of a link or a tool in a keep-out box, negative outside";
    }
}

/// Distance and depth where a bound shows that no rule is met; no limit of a distance is as great \[m\].
const FAR: f64 = 10.0;

/// What the robots of a session keep out of, prepared.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// Reach of robots 1 and 2 towards each other, and the sum up to which their arms are far enough apart; none without
    /// the rule.
    between: Option<([Extent; 2], f64)>,
    boxes: Vec<PreparedBox>,
}

/// A keep-out box with, for each robot, its reach towards a face of the box and the coordinate of that face.
#[derive(Clone, Debug)]
struct PreparedBox {
    centre: Vec3<f64>,
    axes: Mat3<f64>,
    half: Vec3<f64>,
    faces: [(Extent, f64); 2],
}

impl Workspace {
    /// The workspace of robots at the start of a run; none if no rule needs one.
    pub(crate) fn new(rules: &SessionRules, robots: &[SessionRobot; 2], start: &Parts<f64>) -> Option<Self> {
        if !rules.arm_distance.is_finite() && rules.keep_out.is_empty() {
            return None;
        }
        let at = [robots[0].commanded(&start.a), robots[1].commanded(&start.b)];
        let between = rules.arm_distance.is_finite().then(|| between(robots, &at, rules.arm_distance));
        let boxes = rules.keep_out.iter().map(|keep_out| PreparedBox::new(keep_out, robots, &at)).collect();
        Some(Self { between, boxes })
    }

    /// Whether the arms may be too near each other, or a link or a tool in a box.
    #[inline(always)]
    pub(super) fn is_near<R: Real>(&self, at: &[Commanded<R>; 2]) -> R::Mask {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let mut near = one.lt(zero);
        if let Some(([first, second], most)) = &self.between {
            // Not "greater than": a NaN is near too.
            near = near | !(first.reach(&at[0]) + second.reach(&at[1])).le(R::lit(*most));
        }
        for keep_out in &self.boxes {
            let [(first, face1), (second, face2)] = &keep_out.faces;
            let outside = first.reach(&at[0]).le(R::lit(*face1)) & second.reach(&at[1]).le(R::lit(*face2));
            near = near | !outside;
        }
        near
    }

    /// Distance and depth of links in the laboratory.
    #[inline(always)]
    fn exact<R: Real>(&self, robots: &[SessionRobot; 2], at: &[Links<R>; 2]) -> Clearance<R> {
        let mut found = far_apart::<R>();
        if self.between.is_some() {
            found.arms = arms_apart(robots, at);
        }
        for keep_out in &self.boxes {
            for robot in 0..at.len() {
                found.depth = found.depth.max(keep_out.depth(&robots[robot], &at[robot]));
            }
        }
        found
    }
}

/// The direction in which the arms are farthest apart at the start, of those from base to base, elbow to elbow and wrist
/// to wrist.
fn between(robots: &[SessionRobot; 2], at: &[Commanded<f64>; 2], distance: f64) -> ([Extent; 2], f64) {
    let place = |robot: usize, point: Vec3<f64>| robots[robot].cell.in_laboratory(point, at[robot].place);
    let points = |robot: usize| [Vec3::zero(), at[robot].points[0], at[robot].points[1]].map(|p| place(robot, p));
    let (from, to) = (points(0), points(1));
    let extents = (0..from.len()).map(|i| {
        let way = to[i] - from[i];
        // Two robots in one place have no direction between them.
        let towards = if way.norm() > 1e-9 { way * (1.0 / way.norm()) } else { vec3(1.0, 0.0, 0.0) };
        [Extent::new(&robots[0].cell, towards, None), Extent::new(&robots[1].cell, -towards, None)]
    });
    let sum = |[first, second]: &[Extent; 2]| first.reach(&at[0]) + second.reach(&at[1]);
    let best = extents.min_by(|one, two| sum(one).total_cmp(&sum(two))).expect("three directions");
    (best, -distance)
}

impl PreparedBox {
    fn new(keep_out: &KeepOut, robots: &[SessionRobot; 2], at: &[Commanded<f64>; 2]) -> Self {
        let (centre, axes, half) = (keep_out.frame.position, keep_out.frame.attitude.matrix(), keep_out.half);
        let face = |robot: usize| {
            let toward_box = [(axes.x, half.x), (axes.y, half.y), (axes.z, half.z)];
            let both = toward_box.into_iter().flat_map(|(axis, half)| [(axis, half), (-axis, half)]);
            let faces = both.map(|(inwards, half)| {
                let extent = Extent::new(&robots[robot].cell, inwards, Some(robots[robot].tool_radius));
                (extent, inwards.dot(centre) - half)
            });
            let beyond = |(extent, face): &(Extent, f64)| extent.reach(&at[robot]) - face;
            faces.min_by(|one, two| beyond(one).total_cmp(&beyond(two))).expect("six faces")
        };
        Self { centre, axes, half, faces: [face(0), face(1)] }
    }

    /// Greatest depth of a robot's links and tool, negative outside.
    #[inline(always)]
    fn depth<R: Real>(&self, robot: &SessionRobot, at: &Links<R>) -> R {
        let (axes, centre) = (Mat3::<R>::lit(self.axes), Vec3::<R>::lit(self.centre));
        let mut depth = R::lit(-FAR);
        for i in 0..=at.count {
            let (from, to) = (at.axes[i].from - centre, at.axes[i].to - centre);
            let inside = Segment { from: axes.transposed_times(from), to: axes.transposed_times(to) };
            let radius = if i < at.count { wrapped(&robot.cell, i).0 } else { robot.tool_radius };
            // The new one last, so that a NaN stands.
            depth = depth.max(R::lit(radius) - inside.distance_to_box(self.half));
        }
        depth
    }
}

/// Least distance between the links of two robots but those that hold the parts.
#[inline(always)]
fn arms_apart<R: Real>(robots: &[SessionRobot; 2], at: &[Links<R>; 2]) -> R {
    let mut apart = R::lit(FAR);
    for i in 0..at[0].count {
        let (radius1, counts1) = wrapped(&robots[0].cell, i);
        for j in 0..at[1].count {
            let (radius2, counts2) = wrapped(&robots[1].cell, j);
            if counts1 && counts2 {
                let axes = at[0].axes[i].distance_to(&at[1].axes[j]);
                apart = apart.min(axes - R::lit(radius1 + radius2));
            }
        }
    }
    apart
}

/// No robot is near another one or a box.
#[inline(always)]
pub fn far_apart<R: Real>() -> Clearance<R> {
    Clearance { arms: R::lit(FAR), depth: R::lit(-FAR) }
}

/// Distance of the arms and depth in the keep-out boxes for commanded motions; far where the bounds show as much.
#[inline(always)]
pub fn clearance<R: Real>(m: &Plant, asked: &Asked<R>, reference: &Parts<R>) -> Clearance<R> {
    let far = far_apart();
    let near = R::lit(0.0).lt(asked.near_body);
    let (Some(robots), Some(workspace)) = (&m.session_robots, m.workspace.as_ref().filter(|_| R::any(near))) else {
        return far;
    };
    let found = workspace.exact(robots, &[links(&robots[0].cell, &reference.a), links(&robots[1].cell, &reference.b)]);
    Clearance { arms: R::select(near, found.arms, far.arms), depth: R::select(near, found.depth, far.depth) }
}

/// Distance and depth for positions of the axes of both robots, in their own angles; far without a rule that needs them.
pub fn clearance_at(m: &Plant, axes: [&[f64; AXES]; 2]) -> Clearance<f64> {
    let (Some(robots), Some(workspace)) = (&m.session_robots, &m.workspace) else {
        return far_apart();
    };
    workspace.exact(robots, &[links_at(&robots[0].cell, axes[0]), links_at(&robots[1].cell, axes[1])])
}

/// The robot (1 or 2) and the keep-out box that one of its links or its tool is deepest in, with the depth \[m\].
pub fn deepest_in_box<'a>(m: &'a Plant, reference: &Parts<f64>) -> Option<(usize, &'a str, f64)> {
    let (robots, workspace) = (m.session_robots.as_ref()?, m.workspace.as_ref()?);
    let at = [links(&robots[0].cell, &reference.a), links(&robots[1].cell, &reference.b)];
    let rows = workspace.boxes.iter().zip(&m.facility.rules.keep_out).flat_map(|(prepared, keep_out)| {
        let depth = |robot: usize| prepared.depth(&robots[robot], &at[robot]);
        [0, 1].map(|robot| (robot + 1, keep_out.name.as_str(), depth(robot)))
    });
    rows.filter(|(.., depth)| *depth > 0.0).max_by(|one, two| one.2.total_cmp(&two.2))
}

#[cfg(test)]
mod tests;
