//! Line segments: the distance between two of them, and from one to a box.

use crate::real::Real;
use crate::vector::Vec3;

/// A straight line between two points; both may be one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<R> {
    /// Where it begins.
    pub from: Vec3<R>,
    /// Where it ends.
    pub to: Vec3<R>,
}

/// Least square of a length that divides \[m^2\].
const LEAST_SQUARE: f64 = 1e-12;

impl<R: Real> Segment<R> {
    /// A constant of the model as a segment of this scalar.
    #[inline(always)]
    pub fn lit(segment: Segment<f64>) -> Self {
        Self { from: Vec3::lit(segment.from), to: Vec3::lit(segment.to) }
    }

    /// Least distance to another segment \[m\].
    ///
    /// The points that are nearest on the two lines are moved onto the segments in turn (Ericson, Real-Time Collision
    /// Detection, 2005, 5.1.9). For nearly parallel segments the distance is exact to the square root of the rounding.
    #[inline(always)]
    pub fn distance_to(&self, other: &Self) -> R {
        let (zero, one, least) = (R::lit(0.0), R::lit(1.0), R::lit(LEAST_SQUARE));
        let (along, across, apart) = (self.to - self.from, other.to - other.from, self.from - other.from);
        let (a, e, b) = (along.dot(along).max(least), across.dot(across).max(least), along.dot(across));
        let (c, f) = (along.dot(apart), across.dot(apart));
        let determinant = a.mul_add(e, -(b * b));
        let wanted = b.mul_add(f, -(c * e)) / determinant.max(R::lit(1e-30));
        // Of parallel segments any pair of opposite points will do.
        let first = R::select(determinant.le(R::lit(1e-30)), zero, wanted.min(one).max(zero));
        let second = (b.mul_add(first, f) / e).min(one).max(zero);
        let first = (b.mul_add(second, -c) / a).min(one).max(zero);
        across.scale_add(-second, along.scale_add(first, apart)).norm()
    }

    /// Least distance to a box about the origin, from its half edge lengths \[m\]; zero inside.
    ///
    /// Half the slope of the square of the distance along the segment is continuous, never falls, and is straight
    /// between the places where the segment crosses a plane of a face: the last of them below zero and the first one
    /// above give the nearest point.
    #[inline(always)]
    pub fn distance_to_box(&self, half: Vec3<f64>) -> R {
        let (zero, one, least) = (R::lit(0.0), R::lit(1.0), R::lit(1e-12));
        let along = self.to - self.from;
        let (mut lower, mut upper) = (zero, one);
        let (mut falling, mut rising) = (self.slope(along, half, zero), self.slope(along, half, one));
        let from = [self.from.x, self.from.y, self.from.z];
        let way = [along.x, along.y, along.z];
        let face = [half.x, half.y, half.z];
        for axis in 0..3 {
            let per_length = one / R::select(way[axis].lt(zero), way[axis].min(-least), way[axis].max(least));
            for side in 0..2 {
                let face = if side == 0 { -face[axis] } else { face[axis] };
                let place = ((R::lit(face) - from[axis]) * per_length).min(one).max(zero);
                let slope = self.slope(along, half, place);
                let before = slope.le(zero) & lower.lt(place);
                let behind = zero.le(slope) & place.lt(upper);
                lower = R::select(before, place, lower);
                falling = R::select(before, slope, falling);
                upper = R::select(behind, place, upper);
                rising = R::select(behind, slope, rising);
            }
        }
        let (fall, rise) = ((-falling).max(zero), rising.max(zero));
        let place = (upper - lower).mul_add(fall / (fall + rise).max(R::lit(1e-30)), lower);
        outside(along.scale_add(place, self.from), half).norm()
    }

    /// Half the slope of the square of the distance to the box, at a share of the way.
    #[inline(always)]
    fn slope(&self, along: Vec3<R>, half: Vec3<f64>, place: R) -> R {
        outside(along.scale_add(place, self.from), half).dot(along)
    }
}

/// From the nearest point of a box about the origin to a point; zero inside.
#[inline(always)]
fn outside<R: Real>(point: Vec3<R>, half: Vec3<f64>) -> Vec3<R> {
    point.zip(half, |at, half| at - at.min(R::lit(half)).max(R::lit(-half)))
}
