//! The nominal start of a run drawn to scale: side view, top view, and the two parts from near.

use softdock_kernels::contact::overlap::{deepest_overlap, start_parts};
use softdock_kernels::model::Shape;
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, PreparedSolid};
use softdock_kernels::space::Parts;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};

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
        let joint = |(part, angle): (&softdock_kernels::model::Link, &f64)| {
            let turn = Quat { w: (0.5 * angle).cos(), v: vec3(0.0, 0.0, (0.5 * angle).sin()) };
            link = link.compose(part.origin).compose(Pose { position: Vec3::zero(), attitude: turn });
            link.position
        };
        let joints = plant.links.iter().zip(&plant.start_angles).map(joint).collect();
        Self { plant, parts, a, b, base, joints, target: b.compose(plant.seat.inverse()) }
    }

    /// Radius within which the parts are: planes and the faces around holes have no end of their own \[m\].
    fn reach(&self) -> f64 {
        let contact = &self.plant.contact;
        let points = contact.points.iter().map(|point| point.position.norm() + point.radius);
        let solids = contact.solids.iter().map(|solid| match solid.shape {
            Shape::Plane => 0.0,
            Shape::Sphere { radius } => radius,
            Shape::Box { half } => half.norm(),
            Shape::Cone { mouth, depth, .. } => mouth.max(depth),
            Shape::Bore { radius, depth, chamfer } => (radius + chamfer).max(depth),
        });
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
        let contact = &self.plant.contact;
        let spheres = contact.points.iter().flat_map(|point| extent(placed(self.a, point.position), point.radius));
        let mut points: Vec<Vec3<f64>> = spheres.chain([self.a.position, self.b.position]).collect();
        for solid in &self.plant.solids {
            let frame = self.b.compose(solid.solid.frame);
            match solid.solid.shape {
                Shape::Plane => points.extend(extent(frame.position, 0.6 * self.reach())),
                Shape::Sphere { radius } => points.extend(extent(frame.position, radius)),
                Shape::Box { half } => points.extend(corners(half).map(|corner| placed(frame, corner))),
                Shape::Cone { .. } | Shape::Bore { .. } => {
                    let hole = hole(solid);
                    let circles = hole
                        .iter()
                        .flat_map(|[along, radius]| extent(placed(frame, vec3(*along, 0.0, 0.0)), RIM * radius));
                    points.extend(circles);
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
        self.draw_part_b(view);
        view.path(&arm, false, &body);
        self.draw_part_a(view);
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

    /// The parts with frames, latch, approach and least distance.
    fn draw_near(&self, view: &mut View) {
        self.draw_part_b(view);
        self.draw_part_a(view);
        let (a, b) = (self.a, self.b);
        axes(view, a, 34.0);
        axes(view, b, 34.0);
        let velocity = self.parts.a.velocity - self.parts.b.velocity;
        if velocity.norm() > 0.0 {
            let direction = velocity * (1.0 / velocity.norm());
            let points = &self.plant.contact.points;
            let radius = points.iter().map(|point| point.radius).fold(0.0, f64::max);
            let from = a.position - vec3(0.0, 0.0, radius + view.metres(18.0));
            view.arrow(from, direction, 70.0, &Pen::line(VELOCITY, 2.4));
            view.label(from, with_unit(velocity.norm() * 1e3, "mm/s"), VELOCITY);
        }
        if let Some(pair) = deepest_overlap(self.plant, &self.parts) {
            // From the sphere's deepest point along its normal to the surface.
            let centre = placed(a, self.plant.contact.points[pair.point].position);
            let centre = b.attitude.rotate_back(centre - b.position);
            let normal = (centre - pair.place) * (1.0 / (centre - pair.place).norm().max(1e-12));
            let ends = [pair.place, pair.place + normal * pair.depth].map(|end| placed(b, end));
            view.path(&ends, false, &Pen::line(AXES[0], 1.4).dashed());
        }
        if let Some(latch) = &self.plant.contact.latch {
            let (point, seat) = (placed(a, latch.point), placed(b, latch.seat));
            view.dot(point, 4.0, &Pen::line(LATCH, 1.4));
            view.dot(seat, 4.0, &Pen::line(LATCH, 1.4).filled(1.0));
            view.label(seat, "seat", LATCH);
            view.label(point, "latch point", LATCH);
        }
        for (index, point) in self.plant.contact.points.iter().enumerate() {
            view.label(placed(a, point.position), format!("A{}", index + 1), PART_A);
        }
        for (index, solid) in self.plant.solids.iter().enumerate() {
            let place = self.b.compose(solid.solid.frame);
            view.label(placed(place, vec3(self.name_place(solid), 0.0, 0.0)), format!("B{}", index + 1), PART_B);
        }
    }

    /// Where along a solid's axis its name stands \[m\].
    fn name_place(&self, solid: &PreparedSolid) -> f64 {
        match solid.solid.shape {
            Shape::Plane => 0.05 * self.reach(),
            Shape::Sphere { .. } | Shape::Box { .. } => 0.0,
            Shape::Cone { depth, .. } | Shape::Bore { depth, .. } => depth + 0.06 * self.reach(),
        }
    }

    fn draw_part_a(&self, view: &mut View) {
        let pen = Pen::line(PART_A, 1.2).filled(0.25);
        for (index, point) in self.plant.contact.points.iter().enumerate() {
            view.sphere(placed(self.a, point.position), point.radius, &pen, &format!("A{}", index + 1));
        }
    }

    fn draw_part_b(&self, view: &mut View) {
        for solid in &self.plant.solids {
            let frame = self.b.compose(solid.solid.frame);
            match solid.solid.shape {
                Shape::Sphere { radius } => {
                    view.sphere(frame.position, radius, &Pen::line(PART_B, 1.6).filled(0.2), "");
                }
                Shape::Box { half } => draw_box(view, frame, half),
                Shape::Plane => draw_face(view, frame, &[[0.0, 1.5 * self.reach()], [0.0, 0.0]], 1.5 * self.reach()),
                Shape::Cone { .. } | Shape::Bore { .. } => {
                    let hole = hole(solid);
                    let mouth = hole.iter().map(|[_, radius]| *radius).fold(0.0, f64::max);
                    let outline: Vec<[f64; 2]> = [[0.0, RIM * mouth]].into_iter().chain(hole).collect();
                    draw_face(view, frame, &outline, RIM * mouth);
                }
            }
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
        let points = self.plant.contact.points.len();
        let names = match points {
            1 => "A1".to_owned(),
            2 => "A1, A2".to_owned(),
            _ => format!("A1 to A{points}"),
        };
        row(out, &dot(Pen::line(PART_A, 1.2).filled(0.25)), &format!("part A: contact points {names}, true radius"));
        row(out, &line(Pen::line(PART_B, 2.2)), "part B: surface of its solids (material shaded), on the target");
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
        let velocity = self.parts.a.velocity - self.parts.b.velocity;
        let approach = |out: &mut String, y: f64| {
            arrow(out, [left, y], [left + 28.0, y], &Pen::line(VELOCITY, 2.4));
        };
        let speed = with_unit(velocity.norm() * 1e3, "mm/s");
        row(out, &approach, &format!("velocity of part A relative to part B: {speed} (arrow not to scale)"));
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
            let words = format!("{word} {size}: A{} and B{}", pair.point + 1, pair.solid + 1);
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
        Shape::Bore { radius, depth, chamfer } => {
            vec![[0.0, radius + chamfer], [chamfer, radius], [depth, radius], [depth, 0.0]]
        }
        Shape::Plane | Shape::Sphere { .. } | Shape::Box { .. } => Vec::new(),
    }
}

/// Corners of a box.
fn corners(half: Vec3<f64>) -> [Vec3<f64>; 8] {
    std::array::from_fn(|index| {
        let sign = |bit: usize| if index >> bit & 1 == 1 { 1.0 } else { -1.0 };
        vec3(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
    })
}

/// The faces of a box.
fn draw_box(view: &mut View, frame: Pose<f64>, half: Vec3<f64>) {
    let corners = corners(half).map(|corner| placed(frame, corner));
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    for face in faces {
        view.path(&face.map(|corner| corners[corner]), true, &Pen::line(PART_B, 1.4).filled(0.08));
    }
}

/// A half space behind a face with an outline (axis, radius) around the x axis, cut off at a radius.
///
/// Seen along its axis it is drawn as circles, else as the section through the axis that faces the viewer.
fn draw_face(view: &mut View, frame: Pose<f64>, outline: &[[f64; 2]], rim: f64) {
    let surface = Pen::line(PART_B, 2.0);
    let toward = frame.attitude.rotate_back(view.plane.normal());
    let across = vec3(0.0, -toward.z, toward.y);
    let circle = |along: f64, radius: f64| -> Vec<Vec3<f64>> {
        let turn = |step: u32| (f64::from(step) * std::f64::consts::TAU / 60.0).sin_cos();
        (0..60).map(turn).map(|(sin, cos)| placed(frame, vec3(along, radius * cos, radius * sin))).collect()
    };
    for [along, radius] in outline.iter().filter(|[_, radius]| *radius > 0.0 && *radius < rim) {
        view.path(&circle(*along, *radius), true, &Pen::line(PART_B, 0.7));
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
    view.path(&material, true, &Pen::line(PART_B, 0.0).filled(0.15));
    view.path(&points, false, &surface);
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::load_scenario;
    use softdock_kernels::model::{ContactPoint, Model, Solid};
    use std::path::Path;

    fn model() -> Model {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/smoke.toml");
        load_scenario(&path).expect("the shipped scenario").model
    }

    fn drawn(model: Model) -> String {
        let nominal = model.nominal;
        scene_svg("a < b & c", &Plant::new(model), &nominal)
    }

    #[test]
    fn every_shape_in_any_attitude_is_drawn_with_finite_numbers() {
        let shapes = [
            Shape::Plane,
            Shape::Sphere { radius: 0.1 },
            Shape::Box { half: vec3(0.1, 0.2, 0.3) },
            Shape::Cone { mouth: 0.2, bottom: 0.05, depth: 0.3 },
            Shape::Bore { radius: 0.1, depth: 0.2, chamfer: 0.01 },
            Shape::Bore { radius: 0.1, depth: 0.2, chamfer: 0.0 },
        ];
        // Along x, along y and along z: seen from the side, along the axis, and from above.
        for turn in [
            Vec3::zero(),
            vec3(0.0, 0.0, std::f64::consts::FRAC_PI_2),
            vec3(0.0, std::f64::consts::FRAC_PI_2, 0.0),
            vec3(0.3, -0.4, 0.5),
        ] {
            for shape in shapes {
                let mut model = model();
                let frame = Pose { position: vec3(0.0, 0.1, 0.0), attitude: Quat::from_rotation_vector(turn) };
                model.contact.solids = vec![Solid { frame, shape }];
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
        model.contact.points = radii.map(point).to_vec();
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
