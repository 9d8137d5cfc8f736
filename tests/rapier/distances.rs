//! Distances between segments, and from segments to boxes, against an independent library.

use rapier3d::parry::query;
use rapier3d::parry::shape::{self, Cuboid};
use rapier3d::prelude::*;
use softdock_kernels::philox::uniform;
use softdock_kernels::segment::Segment;
use softdock_kernels::vector::{Vec3, vec3};

fn vector(v: Vec3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Numbers from -1 to 1.
fn draws(name: &'static str) -> impl FnMut() -> f64 {
    let mut drawn = 0;
    move || {
        drawn += 1;
        2.0 * uniform(7, name, 0, drawn) - 1.0
    }
}

fn point(draw: &mut impl FnMut() -> f64, size: f64) -> Vec3<f64> {
    vec3(draw(), draw(), draw()) * size
}

/// A segment of any length; every fifth one is a point, every seventh along an axis.
fn segment(draw: &mut impl FnMut() -> f64, case: usize) -> Segment<f64> {
    let from = point(draw, 1.5);
    let mut way = point(draw, 1.0);
    if case.is_multiple_of(5) {
        way = Vec3::zero();
    }
    if case.is_multiple_of(7) {
        (way.y, way.z) = (0.0, 0.0);
    }
    Segment { from, to: from + way }
}

fn shape_of(segment: &Segment<f64>) -> shape::Segment {
    shape::Segment::new(vector(segment.from), vector(segment.to))
}

#[test]
fn segments_are_as_far_apart_as_an_independent_library_finds() {
    let mut draw = draws("segments");
    let here = Pose::IDENTITY;
    for case in 0..20_000 {
        let (one, mut two) = (segment(&mut draw, case), segment(&mut draw, case / 2));
        // Parallel, nearly parallel, on one line.
        let along = one.to - one.from;
        match case % 11 {
            0 => two.to = two.from + along * draw(),
            1 => two.to = two.from + along * draw() + point(&mut draw, 1e-7),
            2 => two = Segment { from: one.from + along * (2.0 * draw()), to: one.from + along * (2.0 * draw()) },
            _ => {}
        }
        let found = one.distance_to(&two);
        let expected = query::distance(&here, &shape_of(&one), &here, &shape_of(&two)).expect("segments").distance;
        let allowed = if matches!(case % 11, 1 | 2) { 1e-6 } else { 1e-9 };
        assert!((found - expected).abs() < allowed, "case {case}: {found} m, not {expected} m: {one:?} {two:?}");
        assert!((two.distance_to(&one) - found).abs() < allowed, "case {case}: not the same the other way");
    }
}

#[test]
fn segments_are_as_far_from_boxes_as_an_independent_library_finds() {
    let mut draw = draws("boxes");
    let here = Pose::IDENTITY;
    let mut inside = 0;
    for case in 0..20_000 {
        let segment = segment(&mut draw, case);
        let half = vec3(0.55, 0.55, 0.55) + point(&mut draw, 0.5);
        let found = segment.distance_to_box(half);
        let cuboid = Cuboid::new(vector(half));
        let expected = query::distance(&here, &shape_of(&segment), &here, &cuboid).expect("convex shapes").distance;
        assert!((found - expected).abs() < 1e-6, "case {case}: {found} m, not {expected} m: {segment:?} {half:?}");
        // No point of the segment is nearer, and one is as near.
        let points = (0..=200).map(|share| {
            let at = segment.from + (segment.to - segment.from) * (f64::from(share) / 200.0);
            let out = |at: f64, half: f64| (at.abs() - half).max(0.0);
            vec3(out(at.x, half.x), out(at.y, half.y), out(at.z, half.z)).norm()
        });
        let least = points.fold(f64::INFINITY, f64::min);
        assert!(found <= least + 1e-12 && found > least - 0.01, "case {case}: {found} m, {least} m by points");
        inside += usize::from(found == 0.0);
    }
    assert!((1000..19_000).contains(&inside), "{inside} segments reach into their box");
}
