//! The nominal start of a run drawn to scale: side view, top view, and the two parts from near.

use softdock_kernels::contact::features::features;
use softdock_kernels::contact::mesh::Mesh;
use softdock_kernels::contact::overlap::{deepest_overlap, start_parts};
use softdock_kernels::model::{ContactPoint, Shape, Side};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, PointSource, PreparedSolid};
use softdock_kernels::space::Parts;
use softdock_kernels::vector::{Pose, Vec3, vec3};

use std::collections::BTreeMap;

use crate::number::with_unit;
use crate::plots::canvas::{Pen, Plane, View, arrow, circle, path, svg_file, text};
use crate::plots::figure::{RGBColor, colour};

/// Width of the page, and left and right end of the views of the whole scene, px.
const WIDTH: f64 = 1240.0;
const WIDE: [f64; 2] = [70.0, 1220.0];

/// Size of the square view of the parts, and the left end of the legend beside it, px.
const NEAR: f64 = 480.0;
const LEGEND: f64 = 640.0;

/// Height that both views of the whole scene share at most, and the least of one, px.
const HEIGHTS: f64 = 620.0;
const LEAST_HEIGHT: f64 = 130.0;

/// Radius at which the face around a hole is cut off, over the radius of its mouth.
const RIM: f64 = 1.3;

/// Space around the scene, for axes and labels, px.
const MARGIN: f64 = 40.0;

/// Height between two views, for the axis of the upper and the heading of the lower one, px.
const BETWEEN: f64 = 66.0;

/// Colours of the bodies; axes are red, green and blue.
const PART_A: RGBColor = colour::SPACE;
const PART_B: RGBColor = colour::FACILITY;
const ARM: RGBColor = colour::TEXT;
const VELOCITY: RGBColor = colour::TRUSTED;
const LATCH: RGBColor = colour::FALSE_PASS;
const AXES: [RGBColor; 3] = [RGBColor(0xC8, 0x1E, 0x1E), RGBColor(0x1E, 0x8C, 0x2D), RGBColor(0x28, 0x46, 0xC8)];

/// Where everything stands at the start, contact frame.
struct Scene<'a> {
    plant: &'a Plant,
    parts: Parts<f64>,
    a: Pose<f64>,
    b: Pose<f64>,
    base: Pose<f64>,
    /// Origins of the arm's joints, from the base outwards.
    joints: Vec<Vec3<f64>>,
    target: Pose<f64>,
}

/// The nominal start of a scenario as an SVG file: bodies, arm, parts, latch and approach in the contact frame.
///
/// `heading` is the title of the page. Lengths are in metres and to scale; a contact point has its true radius.
pub fn scene_svg(heading: &str, plant: &Plant, params: &Params<f64>) -> String {
    let scene = Scene::new(plant, params);
    let mut body = String::new();
    text(&mut body, [20.0, 32.0], 18.0, colour::TEXT, heading);
    let whole = scene.whole_points();
    let [side, top] = [Plane::Side, Plane::Top].map(|plane| bounds(plane, &whole));
    let span = |of: &[[f64; 2]; 2], axis: usize| (of[1][axis] - of[0][axis]).max(0.05);
    let fits_across = (WIDE[1] - WIDE[0] - 2.0 * MARGIN) / span(&side, 0);
    let fits_up = (HEIGHTS - 4.0 * MARGIN) / (span(&side, 1) + span(&top, 1));
    let scale = fits_across.min(fits_up);
    let height = |of: &[[f64; 2]; 2]| (span(of, 1) * scale + 2.0 * MARGIN).max(LEAST_HEIGHT);
    let mut upper = 80.0;
    for (index, (plane, of, name)) in
        [(Plane::Side, side, "side view"), (Plane::Top, top, "top view")].into_iter().enumerate()
    {
        let frame = [WIDE[0], upper, WIDE[1], upper + height(&of)];
        let mut view = View::new(plane, frame, middle(&of), scale);
        scene.draw_whole(&mut view);
        body += &view.finish(name, index);
        upper += height(&of) + BETWEEN;
    }
    let near = bounds(Plane::Side, &scene.near_points());
    let scale = NEAR / (1.3 * span(&near, 0).max(span(&near, 1)));
    let frame = [WIDE[0], upper, WIDE[0] + NEAR, upper + NEAR];
    let mut view = View::new(Plane::Side, frame, middle(&near), scale);
    scene.draw_near(&mut view);
    body += &view.finish("the two parts, side view", 2);
    scene.legend(&mut body, upper + 20.0);
    svg_file(heading, [WIDTH, upper + NEAR + 50.0], &body)
}

/// Least and greatest coordinates of points in a view \[m\].
fn bounds(plane: Plane, points: &[Vec3<f64>]) -> [[f64; 2]; 2] {
    let mut ends = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for place in points.iter().map(|point| plane.project(*point)) {
        for axis in [0, 1] {
            ends[0][axis] = ends[0][axis].min(place[axis]);
            ends[1][axis] = ends[1][axis].max(place[axis]);
        }
    }
    ends
}

fn middle(of: &[[f64; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|axis| 0.5 * (of[0][axis] + of[1][axis]))
}

/// A point of a frame in the frame around it.
fn placed(pose: Pose<f64>, point: Vec3<f64>) -> Vec3<f64> {
    pose.position + pose.attitude.rotate(point)
}

/// The corners of a cube around a ball: its extent along every axis.
fn extent(centre: Vec3<f64>, radius: f64) -> [Vec3<f64>; 2] {
    [centre - Vec3::splat(radius), centre + Vec3::splat(radius)]
}

impl<'a> Scene<'a> {
    fn new(plant: &'a Plant, params: &Params<f64>) -> Self {
        let parts = start_parts(plant, params);
        let a = Pose { position: parts.a.position, attitude: parts.a.attitude };
        let b = Pose { position: parts.b.position, attitude: parts.b.attitude };
        let base = a.compose(plant.tool_start.inverse());
        let mut link = base;
        let joint = |(number, angle): (usize, &f64)| {
            link = link.compose(plant.link_pose(number, *angle));
            link.position
        };
        let joints = plant.start_angles.iter().enumerate().map(joint).collect();
        Self { plant, parts, a, b, base, joints, target: b.compose(plant.seat.inverse()) }
    }

    /// Pose of a part.
    fn pose(&self, side: Side) -> Pose<f64> {
        match side {
            Side::A => self.a,
            Side::B => self.b,
        }
    }

    /// Solids of both parts with their poses.
    fn solids(&self) -> impl Iterator<Item = (Side, &PreparedSolid, Pose<f64>)> {
        let of = |side: Side| self.plant.solids[side as usize].iter().map(move |solid| (side, solid));
        let all = Side::BOTH.into_iter().flat_map(of);
        all.map(|(side, solid)| (side, solid, self.pose(side).compose(solid.solid.frame)))
    }

    /// Points of both parts besides those of their solids, with their places.
    fn points(&self) -> impl Iterator<Item = (Side, usize, &ContactPoint, Vec3<f64>)> {
        let of = |side: Side| self.plant.contact.part(side).points.iter().enumerate().map(move |own| (side, own));
        let all = Side::BOTH.into_iter().flat_map(of);
        all.map(|(side, (index, point))| (side, index, point, placed(self.pose(side), point.position)))
    }

    /// Name of a point or solid: the points of part A and the solids of part B count first.
    fn name(&self, side: Side, source: PointSource) -> String {
        let part = self.plant.contact.part(side);
        let index = match (side, source) {
            (Side::A, PointSource::Point(index)) | (Side::B, PointSource::Solid(index)) => index,
            (Side::A, PointSource::Solid(index)) => part.points.len() + index,
            (Side::B, PointSource::Point(index)) => part.solids.len() + index,
        };
        format!("{side:?}{}", index + 1)
    }

    /// Radius within which the parts are: planes and the faces around holes have no end of their own \[m\].
    fn reach(&self) -> f64 {
        let points = self.points().map(|(_, _, point, _)| point.position.norm() + point.radius);
        let solids = self.solids().map(|(_, solid, _)| solid.solid.shape.reach());
        points.chain(solids).fold(0.02, f64::max)
    }

    /// Points that the views of the whole scene must show.
    fn whole_points(&self) -> Vec<Vec3<f64>> {
        let mut points = self.near_points();
        points.extend([self.base.position, self.target.position]);
        points.extend(&self.joints);
        points
    }

    /// Points that the view of the parts must show.
    fn near_points(&self) -> Vec<Vec3<f64>> {
        let spheres = self.points().flat_map(|(_, _, point, place)| extent(place, point.radius));
        let mut points: Vec<Vec3<f64>> = spheres.chain([self.a.position, self.b.position]).collect();
        for (_, solid, frame) in self.solids() {
            match solid.solid.shape {
                Shape::Mesh(ref mesh) => points.extend(mesh.vertices.iter().map(|vertex| placed(frame, *vertex))),
                Shape::Plane => points.extend(extent(frame.position, 0.6 * self.reach())),
                Shape::Box { half } => points.extend(corners(half).map(|corner| placed(frame, corner))),
                Shape::Cone { .. } | Shape::Bore { .. } => {
                    let hole = hole(solid);
                    let circles = hole
                        .iter()
                        .flat_map(|[along, radius]| extent(placed(frame, vec3(*along, 0.0, 0.0)), RIM * radius));
                    points.extend(circles);
                }
                Shape::Sphere { .. }
                | Shape::Capsule { .. }
                | Shape::Cylinder { .. }
                | Shape::Frustum { .. }
                | Shape::Ring { .. } => {
                    let [front, back] = solid.solid.shape.ends();
                    let radius = solid.solid.shape.across();
                    points.extend(
                        [front, back].into_iter().flat_map(|x| extent(placed(frame, vec3(x, 0.0, 0.0)), radius)),
                    );
                }
            }
        }
        if let Some(latch) = &self.plant.contact.latch {
            points.extend([placed(self.a, latch.point), placed(self.b, latch.seat)]);
        }
        points
    }

    /// Base, arm, parts and target.
    fn draw_whole(&self, view: &mut View) {
        let body = Pen::line(ARM, 2.2);
        let arm: Vec<Vec3<f64>> =
            [self.base.position].into_iter().chain(self.joints.iter().copied()).chain([self.a.position]).collect();
        view.path(&[self.target.position, self.b.position], false, &Pen::line(PART_B, 2.2));
        self.draw_part(view, Side::B);
        view.path(&arm, false, &body);
        self.draw_part(view, Side::A);
        for joint in &self.joints {
            view.dot(*joint, 3.5, &Pen { fill: Some((colour::PAPER, 1.0)), ..Pen::line(ARM, 1.4) });
        }
        for (frame, length) in [(self.base, 26.0), (self.target, 26.0)] {
            axes(view, frame, length);
            view.dot(frame.position, 3.0, &Pen::line(ARM, 1.0).filled(1.0));
        }
        view.label(self.base.position, "base", colour::TEXT);
        view.label(self.target.position, "target", colour::TEXT);
        view.label(self.a.position, "part A", PART_A);
        view.label(self.b.position, "part B", PART_B);
        for (index, joint) in self.joints.iter().enumerate() {
            view.label(*joint, format!("J{}", index + 1), ARM);
        }
    }

    /// Velocity of part A relative to part B \[m/s\]; none where it is rounding alone.
    fn closing_velocity(&self) -> Option<Vec3<f64>> {
        let velocity = self.parts.a.velocity - self.parts.b.velocity;
        (velocity.norm() > 1e-9).then_some(velocity)
    }

    /// The parts with frames, latch, approach and least distance.
    fn draw_near(&self, view: &mut View) {
        self.draw_part(view, Side::B);
        self.draw_part(view, Side::A);
        let (a, b) = (self.a, self.b);
        axes(view, a, 34.0);
        axes(view, b, 34.0);
        if let Some(velocity) = self.closing_velocity() {
            let direction = velocity * (1.0 / velocity.norm());
            let radius = self.points().map(|(_, _, point, _)| point.radius).fold(0.0, f64::max);
            let from = a.position - vec3(0.0, 0.0, radius + view.metres(18.0));
            view.arrow(from, direction, 70.0, &Pen::line(VELOCITY, 2.4));
            view.label(from, with_unit(velocity.norm() * 1e3, "mm/s"), VELOCITY);
        }
        if let Some(pair) = deepest_overlap(self.plant, &self.parts) {
            // From the sphere's deepest point along the normal to the surface.
            let ends = [pair.place, pair.place + pair.normal * pair.depth].map(|end| placed(b, end));
            view.path(&ends, false, &Pen::line(AXES[0], 1.4).dashed());
        }
        if let Some(latch) = &self.plant.contact.latch {
            let (point, seat) = (placed(a, latch.point), placed(b, latch.seat));
            view.dot(point, 4.0, &Pen::line(LATCH, 1.4));
            view.dot(seat, 4.0, &Pen::line(LATCH, 1.4).filled(1.0));
            view.label(seat, "seat", LATCH);
            view.label(point, "latch point", LATCH);
        }
        for (side, index, _, place) in self.points() {
            view.label(place, self.name(side, PointSource::Point(index)), ink(side));
        }
        for (side, solid, frame) in self.solids() {
            let place = placed(frame, vec3(self.name_place(solid), 0.0, 0.0));
            view.label(place, self.name(side, PointSource::Solid(solid.index)), ink(side));
        }
    }

    /// Where along a solid's axis its name stands \[m\].
    fn name_place(&self, solid: &PreparedSolid) -> f64 {
        match solid.solid.shape {
            Shape::Mesh(_) => solid.solid.shape.ends()[1],
            Shape::Plane => 0.05 * self.reach(),
            Shape::Sphere { .. }
            | Shape::Box { .. }
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. }
            | Shape::Frustum { .. }
            | Shape::Ring { .. } => 0.0,
            Shape::Cone { depth, .. } | Shape::Bore { depth, .. } => depth + 0.06 * self.reach(),
        }
    }

    fn draw_part(&self, view: &mut View, side: Side) {
        let ink = ink(side);
        for (_, solid, frame) in self.solids().filter(|own| own.0 == side) {
            match solid.solid.shape {
                Shape::Sphere { radius } => {
                    view.sphere(frame.position, radius, &Pen::line(ink, 1.6).filled(0.2), "");
                }
                Shape::Box { half } => draw_box(view, frame, half, ink),
                Shape::Mesh(ref mesh) => draw_mesh(view, frame, mesh, ink),
                Shape::Plane => {
                    draw_face(view, frame, &[[0.0, 1.5 * self.reach()], [0.0, 0.0]], 1.5 * self.reach(), ink);
                }
                Shape::Cone { .. } | Shape::Bore { .. } => {
                    let hole = hole(solid);
                    let mouth = hole.iter().map(|[_, radius]| *radius).fold(0.0, f64::max);
                    let outline: Vec<[f64; 2]> = [[0.0, RIM * mouth]].into_iter().chain(hole).collect();
                    draw_face(view, frame, &outline, RIM * mouth, ink);
                }
                Shape::Capsule { .. } | Shape::Cylinder { .. } | Shape::Frustum { .. } | Shape::Ring { .. } => {
                    draw_round(view, frame, &solid.solid.shape, ink);
                }
            }
        }
        let pen = Pen::line(ink, 1.2).filled(0.25);
        for (_, index, point, place) in self.points().filter(|own| own.0 == side) {
            view.sphere(place, point.radius, &pen, &self.name(side, PointSource::Point(index)));
        }
    }

    /// What the colours and signs stand for, and the numbers of the start.
    fn legend(&self, out: &mut String, mut y: f64) {
        let left = LEGEND;
        let mut row = |out: &mut String, sign: &dyn Fn(&mut String, f64), words: &str| {
            sign(out, y);
            text(out, [left + 40.0, y + 4.0], 12.0, colour::TEXT, words);
            y += 24.0;
        };
        let line = |pen: Pen| move |out: &mut String, y: f64| path(out, &[[left, y], [left + 28.0, y]], false, &pen);
        let dot = |pen: Pen| move |out: &mut String, y: f64| circle(out, [left + 14.0, y], 5.0, &pen, "");
        let names = |side: Side| {
            let part = self.plant.contact.part(side);
            match part.points.len() + part.solids.len() {
                1 => format!("{side:?}1"),
                2 => format!("{side:?}1, {side:?}2"),
                count => format!("{side:?}1 to {side:?}{count}"),
            }
        };
        let words = format!("part A: contact points and solids {}, true size", names(Side::A));
        row(out, &dot(Pen::line(PART_A, 1.2).filled(0.25)), &words);
        row(
            out,
            &line(Pen::line(PART_B, 2.2)),
            &format!("part B: {} (material shaded), on the target", names(Side::B)),
        );
        let arm = if self.joints.is_empty() { "base to part A" } else { "base to part A over the joints J of the arm" };
        row(out, &line(Pen::line(ARM, 2.2)), arm);
        let centres = "centres of mass of base and target";
        row(
            out,
            &|out: &mut String, y| circle(out, [left + 14.0, y], 3.0, &Pen::line(ARM, 1.0).filled(1.0), ""),
            centres,
        );
        let frame = |out: &mut String, y: f64| {
            for (at, ink) in [0.0, 11.0, 22.0].into_iter().zip(AXES) {
                arrow(out, [left + at, y + 4.0], [left + at + 9.0, y - 5.0], &Pen::line(ink, 1.6));
            }
        };
        row(out, &frame, "axes x (red), y (green), z (blue) of base, target, parts A and B");
        if let Some(velocity) = self.closing_velocity() {
            let approach = |out: &mut String, y: f64| {
                arrow(out, [left, y], [left + 28.0, y], &Pen::line(VELOCITY, 2.4));
            };
            let speed = with_unit(velocity.norm() * 1e3, "mm/s");
            row(out, &approach, &format!("velocity of part A relative to part B: {speed} (arrow not to scale)"));
        }
        if self.plant.contact.latch.is_some() {
            row(
                out,
                &dot(Pen::line(LATCH, 1.4).filled(1.0)),
                "seat of the latch in part B; ring: latch point of part A",
            );
        }
        if let Some(pair) = deepest_overlap(self.plant, &self.parts) {
            let size = with_unit(pair.depth.abs() * 1e3, "mm");
            let word = if pair.depth > 0.0 { "greatest overlap" } else { "least distance" };
            let (point, solid) = (self.name(pair.side, pair.source), PointSource::Solid(pair.solid));
            let words = format!("{word} {size}: {point} and {}", self.name(pair.side.other(), solid));
            row(out, &line(Pen::line(AXES[0], 1.4).dashed()), &words);
        }
        let gap = (self.b.position - self.a.position).map(|length| with_unit((length * 1e4).round() / 10.0, "mm"));
        let words = format!("part B's origin from part A's: ({}, {}, {})", gap.x, gap.y, gap.z);
        row(out, &|_: &mut String, _: f64| {}, &words);
    }
}

/// The axes of a frame.
fn axes(view: &mut View, frame: Pose<f64>, length: f64) {
    let directions = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    for (direction, ink) in directions.into_iter().zip(AXES) {
        view.arrow(frame.position, frame.attitude.rotate(direction), length, &Pen::line(ink, 1.3));
    }
}

/// Outline of a hole in a half space, from its rim inwards to the axis: axis and radius \[m\].
fn hole(solid: &PreparedSolid) -> Vec<[f64; 2]> {
    match solid.solid.shape {
        Shape::Cone { mouth, bottom, depth } => vec![[0.0, mouth], [depth, bottom], [depth, 0.0]],
        Shape::Bore { radius, depth, chamfer, .. } => {
            vec![[0.0, radius + chamfer], [chamfer, radius], [depth, radius], [depth, 0.0]]
        }
        _ => Vec::new(),
    }
}

/// Corners of a box.
fn corners(half: Vec3<f64>) -> [Vec3<f64>; 8] {
    let vertices = features(&Shape::Box { half });
    std::array::from_fn(|index| vertices[index].point.position)
}

/// Colour of a part.
fn ink(side: Side) -> RGBColor {
    match side {
        Side::A => PART_A,
        Side::B => PART_B,
    }
}

/// A circle about the x axis of a frame.
fn circle_about_x(frame: Pose<f64>, along: f64, radius: f64) -> Vec<Vec3<f64>> {
    let turn = |step: u32| (f64::from(step) * std::f64::consts::TAU / 60.0).sin_cos();
    (0..60).map(turn).map(|(sin, cos)| placed(frame, vec3(along, radius * cos, radius * sin))).collect()
}

/// A solid round about x: its circles at both ends, and lines between them.
fn draw_round(view: &mut View, frame: Pose<f64>, shape: &Shape, ink: RGBColor) {
    let (pen, thin) = (Pen::line(ink, 1.6), Pen::line(ink, 1.0).filled(0.08));
    let radii = match *shape {
        Shape::Capsule { radius, .. } | Shape::Cylinder { radius, .. } => [radius; 2],
        Shape::Frustum { front, back, .. } => [front, back],
        Shape::Ring { radius, tube, .. } => [radius - tube, radius + tube],
        _ => return,
    };
    let ends: [[f64; 2]; 2] = std::array::from_fn(|end| [shape.ends()[end], radii[end]]);
    if matches!(shape, Shape::Capsule { .. }) {
        ends.iter().for_each(|[x, radius]| view.sphere(placed(frame, vec3(*x, 0.0, 0.0)), *radius, &thin, ""));
    }
    let [front, back] = ends.map(|[x, radius]| circle_about_x(frame, x, radius));
    view.path(&front, true, &thin);
    view.path(&back, true, &thin);
    for index in (0..front.len()).step_by(5) {
        view.path(&[front[index], back[index]], false, &Pen::line(ink, 0.5));
    }
    // The outline: the lines between the circles that are farthest apart across the view.
    let toward = frame.attitude.rotate_back(view.plane.normal());
    let across = vec3(0.0, -toward.z, toward.y);
    if across.norm() > 0.1 && !matches!(shape, Shape::Ring { .. }) {
        let across = across * (1.0 / across.norm());
        for side in [-1.0, 1.0] {
            let at = |[x, radius]: [f64; 2]| placed(frame, vec3(x, 0.0, 0.0) + across * (side * radius));
            view.path(&ends.map(at), false, &pen);
        }
    }
}

/// Most triangles of a mesh that are filled; of a finer one only sharp edges and the outline are drawn.
const MOST_FILLED: usize = 2_000;

/// The triangles of a mesh as a shade, its sharp edges and its outline as lines.
fn draw_mesh(view: &mut View, frame: Pose<f64>, mesh: &Mesh, ink: RGBColor) {
    let at = |corner: u32| placed(frame, mesh.vertices[corner as usize]);
    let toward = view.plane.normal();
    let mut sides: BTreeMap<[u32; 2], Vec<Vec3<f64>>> = BTreeMap::new();
    let shade = Pen { fill: Some((ink, 0.06)), ..Pen::line(ink, 0.0) };
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(at);
        let across = (b - a).cross(c - a);
        let normal = across * (1.0 / across.norm().max(f64::MIN_POSITIVE));
        for (one, two) in [(0, 1), (1, 2), (2, 0)] {
            let (one, two) = (triangle[one], triangle[two]);
            sides.entry([one.min(two), one.max(two)]).or_default().push(normal);
        }
        // Those that look away are covered by the others.
        if mesh.triangles.len() <= MOST_FILLED && normal.dot(toward) > 0.0 {
            view.path(&[a, b, c], true, &shade);
        }
    }
    for (edge, normals) in sides {
        let [one, two] = [normals[0], normals[normals.len() - 1]];
        let is_sharp = one.dot(two) < 0.88;
        let is_outline = one.dot(toward) * two.dot(toward) <= 0.0;
        if is_sharp || is_outline {
            view.path(&edge.map(at), false, &Pen::line(ink, if is_outline { 1.4 } else { 0.7 }));
        }
    }
}

/// The faces of a box.
fn draw_box(view: &mut View, frame: Pose<f64>, half: Vec3<f64>, ink: RGBColor) {
    let corners = corners(half).map(|corner| placed(frame, corner));
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    for face in faces {
        view.path(&face.map(|corner| corners[corner]), true, &Pen::line(ink, 1.4).filled(0.08));
    }
}

/// A half space behind a face with an outline (axis, radius) around the x axis, cut off at a radius.
///
/// Seen along its axis it is drawn as circles, else as the section through the axis that faces the viewer.
fn draw_face(view: &mut View, frame: Pose<f64>, outline: &[[f64; 2]], rim: f64, ink: RGBColor) {
    let surface = Pen::line(ink, 2.0);
    let toward = frame.attitude.rotate_back(view.plane.normal());
    let across = vec3(0.0, -toward.z, toward.y);
    let circle = |along: f64, radius: f64| circle_about_x(frame, along, radius);
    for [along, radius] in outline.iter().filter(|[_, radius]| *radius > 0.0 && *radius < rim) {
        view.path(&circle(*along, *radius), true, &Pen::line(ink, 0.7));
    }
    if across.norm() < 0.1 {
        view.path(&circle(0.0, rim), true, &surface);
        return;
    }
    let across = across * (1.0 / across.norm());
    let deepest = outline.iter().map(|[along, _]| *along).fold(0.0, f64::max);
    let back = deepest + 0.12 * rim.max(deepest);
    let half = |side: f64| outline.iter().map(move |[along, radius]| (*along, side * radius));
    let section: Vec<(f64, f64)> = half(1.0).chain(half(-1.0).rev()).collect();
    let at = |(along, radius): (f64, f64)| placed(frame, vec3(along, 0.0, 0.0) + across * radius);
    let points: Vec<Vec3<f64>> = section.iter().copied().map(at).collect();
    let behind = [(back, -rim), (back, rim)].map(at);
    let material: Vec<Vec3<f64>> = points.iter().copied().chain(behind).collect();
    view.path(&material, true, &Pen::line(ink, 0.0).filled(0.15));
    view.path(&points, false, &surface);
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::load_scenario;
    use softdock_kernels::contact::mesh::{Ball, Grid};
    use softdock_kernels::lookup::LookupTable;
    use softdock_kernels::model::{Model, Solid};
    use softdock_kernels::vector::Quat;
    use std::path::Path;
    use std::sync::Arc;

    fn model() -> Model {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/smoke.toml");
        load_scenario(&path).expect("the shipped scenario").model
    }

    #[test]
    fn mesh_is_drawn_with_its_edges_and_facing_triangles() {
        let paths = |solids: Vec<Solid>| {
            let mut model = model();
            model.contact.b.solids = solids;
            drawn(model).matches("<path").count()
        };
        let solid = Solid { frame: Pose::identity(), shape: tetrahedron() };
        let (with, without) = (paths(vec![solid]), paths(Vec::new()));
        // Six edges in each of three views, and at least one triangle.
        assert!(with >= without + 3 * 7, "{with} and {without}");
    }

    fn drawn(model: Model) -> String {
        let nominal = model.nominal;
        scene_svg("a < b & c", &Plant::new(model), &nominal)
    }

    /// A tetrahedron far from the nodes of its grid, which no figure reads but for the least distance.
    fn tetrahedron() -> Shape {
        let table = LookupTable { values: vec![0.1_f32; 8].into(), offset: 0 };
        Shape::Mesh(Arc::new(Mesh {
            grid: Grid { origin: Vec3::splat(-0.1), cell: 0.5, nodes: [2; 3], margin: 0.1, table },
            shell: Vec::new(),
            ball: Ball { centre: Vec3::zero(), radius: 0.3 },
            half_thickness: 0.05,
            vertices: vec![Vec3::zero(), vec3(0.2, 0.0, 0.0), vec3(0.0, 0.2, 0.0), vec3(0.0, 0.0, 0.2)],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }))
    }

    #[test]
    fn every_shape_in_any_attitude_is_drawn_with_finite_numbers() {
        let shapes = [
            Shape::Plane,
            Shape::Sphere { radius: 0.1 },
            Shape::Box { half: vec3(0.1, 0.2, 0.3) },
            Shape::Cone { mouth: 0.2, bottom: 0.05, depth: 0.3 },
            Shape::Bore { radius: 0.1, depth: 0.2, chamfer: 0.01, points: 8 },
            Shape::Bore { radius: 0.1, depth: 0.2, chamfer: 0.0, points: 8 },
            tetrahedron(),
        ];
        // Along x, along y and along z: seen from the side, along the axis, and from above.
        for turn in [
            Vec3::zero(),
            vec3(0.0, 0.0, std::f64::consts::FRAC_PI_2),
            vec3(0.0, std::f64::consts::FRAC_PI_2, 0.0),
            vec3(0.3, -0.4, 0.5),
        ] {
            for shape in shapes.clone() {
                let mut model = model();
                let frame = Pose { position: vec3(0.0, 0.1, 0.0), attitude: Quat::from_rotation_vector(turn) };
                model.contact.b.solids = vec![Solid { frame, shape: shape.clone() }];
                let svg = drawn(model);
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{shape:?}");
                assert!(svg.contains("B1"), "{shape:?}");
            }
        }
    }

    #[test]
    fn contact_points_are_drawn_to_scale() {
        let mut model = model();
        let radii = [0.025, 0.05, 0.0];
        let point = |radius: f64| ContactPoint { position: Vec3::zero(), radius };
        model.contact.a.points = radii.map(point).to_vec();
        let svg = drawn(model);
        let near = svg.rsplit("the two parts").next().expect("the last view");
        let radius = |name: &str| -> f64 {
            let circle = near.split(&format!("class=\"{name}\"")).nth(1).expect("a circle");
            circle
                .split("r=\"")
                .nth(1)
                .and_then(|rest| rest.split('"').next())
                .expect("a radius")
                .parse()
                .expect("a number")
        };
        assert!((radius("A2") / radius("A1") - 2.0).abs() < 1e-3, "{} and {}", radius("A1"), radius("A2"));
        assert!(radius("A3") > 0.0, "a point without radius is a dot");
    }

    #[test]
    fn the_heading_is_escaped() {
        assert!(drawn(model()).contains("<title>a &lt; b &amp; c</title>"));
    }
}
