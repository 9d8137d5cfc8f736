//! Distances of part B's shapes against sampled outlines, and a peg that jams or slides in its bore.

use super::bench::{at, inertia, two_bodies};
use softdock_kernels::contact::distance::part_distance;
use softdock_kernels::contact::{Point, contact_point, space_pair};
use softdock_kernels::model::{ContactPoint, Shape, Solid};
use softdock_kernels::monitor::{gather, no_touch};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Vec3, vec3};

/// Repeatable points in a box of half a metre about the mouth.
fn scattered(count: u32) -> impl Iterator<Item = Vec3<f64>> {
    let part = |i: u32, ratio: f64| (f64::from(i) * ratio).fract() - 0.5;
    (1..=count).map(move |i| vec3(part(i, 0.8191725134), part(i, 0.6710436067), part(i, 0.5497004779)))
}

/// Distance to an outline in the half plane, from 20,000 samples.
fn sampled(corners: &[[f64; 2]], x: f64, r: f64) -> f64 {
    let mut least = f64::INFINITY;
    for pair in corners.windows(2) {
        for i in 0..=20_000 {
            let t = f64::from(i) / 20_000.0;
            let [px, pr] = [0, 1].map(|k| pair[0][k] + t * (pair[1][k] - pair[0][k]));
            least = least.min((x - px).hypot(r - pr));
        }
    }
    least
}

#[test]
fn hollow_shapes_have_exact_distances_and_unit_normals_out_of_the_material() {
    let cone = Shape::Cone { mouth: 0.3, bottom: 0.1, depth: 0.25 };
    let bore = Shape::Bore { radius: 0.15, depth: 0.3, chamfer: 0.05 };
    let outlines = [
        (cone, vec![[0.0, 1.5], [0.0, 0.3], [0.25, 0.1], [0.25, 0.0]]),
        (bore, vec![[0.0, 1.5], [0.0, 0.2], [0.05, 0.15], [0.3, 0.15], [0.3, 0.0]]),
    ];
    for (shape, outline) in outlines {
        let mut model = two_bodies(1e-3, 1.0, 1.0);
        model.contact.solids = vec![Solid { frame: at(0.0, 0.0, 0.0), shape }];
        let m = Plant::new(model);
        for p in scattered(300) {
            let found = part_distance(&m, p);
            let exact = sampled(&outline, p.x, p.y.hypot(p.z));
            // Samples lie 65 um apart at most.
            assert!((found.distance.abs() - exact).abs() < 1e-4, "{shape:?} at {p:?}: {found:?}, sampled {exact}");
            assert!((found.normal.norm() - 1.0).abs() < 1e-12, "{shape:?} at {p:?}: {found:?}");
            let wall = outline[1..].windows(2).find(|w| (w[0][0]..=w[1][0]).contains(&p.x) && w[1][0] > w[0][0]);
            let free = p.x < 0.0
                || wall.is_some_and(|w| {
                    p.y.hypot(p.z) < w[0][1] + (w[1][1] - w[0][1]) * (p.x - w[0][0]) / (w[1][0] - w[0][0])
                });
            assert_eq!(found.distance > 0.0, free, "{shape:?} at {p:?}: {found:?}");
            // A step out of the material lengthens the distance by the step, away from edges and the axis.
            let further = part_distance(&m, p + found.normal * 1e-7).distance - found.distance;
            assert!((further - 1e-7).abs() < 1e-9 || found.distance.abs() < 1e-6, "{shape:?} at {p:?}: {further}");
        }
    }
}

/// How far a peg of radius 20 mm on two opposite contacts 20 mm apart moves under 10 N and a moment, once wedged.
fn inserted(moment: f64) -> f64 {
    let (radius, length) = (0.02, 0.02);
    let mut model = two_bodies(2.5e-5, 1.0, 0.0);
    model.base_pose = at(0.05, 0.0, 0.0);
    model.base_inertia = inertia(1e-3, 1e-3, 1e-3);
    model.contact.solids[0].shape = Shape::Bore { radius: radius + 1e-5, depth: 10.0, chamfer: 0.0 };
    let places = [(0.0, radius), (0.0, -radius), (-length, radius), (-length, -radius)];
    model.contact.points =
        places.iter().map(|(x, y)| ContactPoint { position: vec3(*x, *y, 0.0), radius: 0.0 }).collect();
    let p = Params {
        target_mass: 1e9,
        target_inertia_scale: 1e9,
        contact_stiffness: 1e6,
        contact_damping: 500.0,
        contact_friction: 0.2,
        bristle_stiffness: 1e6,
        bristle_damping: 500.0,
        ..Params::null()
    };
    let m = Plant::new(model);
    let (masses, pair) = (space_masses(&p), space_pair(&p));
    let mut s = start::<f64, 0>(&m, &p, masses);
    let mut bristles = vec![Vec3::zero(); m.contact.points.len()];
    let mut wedged = 0.0;
    for step in 0..24_000 {
        if step == 10_000 {
            wedged = s.chaser.com.x;
        }
        let k = kinematics(&m, masses, &s);
        let touch = m.contact.points.iter().zip(&mut bristles).fold(no_touch(), |sum, (point, bristle)| {
            let c =
                contact_point(&m, pair, &k.parts, Point { position: point.position, radius: point.radius }, *bristle);
            *bristle = c.bristle;
            gather(&sum, &c)
        });
        // The moment first, so that the peg is wedged before it is pushed.
        let push = if step < 4000 { 0.0 } else { 10.0 };
        let u = Actuation { thrust: vec3(push, 0.0, 0.0), torque: vec3(0.0, 0.0, moment), joint: [] };
        s = settle(advance(&m, masses, &s, &k, &u, touch.wrench));
    }
    s.chaser.com.x - wedged
}

#[test]
fn a_peg_on_two_points_jams_where_the_diagram_says() {
    // M / (r F) = lambda = l / (2 r mu) = 2.5 without a lateral force: 0.5 N m.
    for sign in [-1.0, 1.0] {
        let (jams, slides) = (inserted(sign * 0.52), inserted(sign * 0.48));
        // 0.4 N too much push 1 kg by some 20 mm in the last 0.35 s.
        assert!(jams.abs() < 1e-6, "jams, yet moves {jams} m");
        assert!(slides > 1e-2, "slides, yet moves {slides} m");
    }
}
