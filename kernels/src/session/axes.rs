//! What a command asks of the robots' axes: rates, and ranges.
//!
//! Rates are needed every cycle, and follow from the turns of the joints without any angle. Angles are computed only
//! where a turn says that a joint is near the end of its range.

use crate::bundle;
use crate::chain::Turn;
use crate::manipulator::cell::{AXES, Cell, Commanded, RAIL, commanded, commanded_axes};
use crate::model::AxisRange;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Parts};
use std::f64::consts::PI;

bundle! {
    /// What a command asks of the axes of both robots.
    Asked {
        rates_a: [R; AXES], "1/s", "rates of robot 1's axes";
        rates_b: [R; AXES], "1/s", "rates of robot 2's axes";
        near_limit: R, "1", "1 where a joint may be at the end of its range, or a robot out of reach";
        least_sine: R, "1", "least of the sines of the angles from the singular postures";
        near_body: R, "1", "1 where the arms may be too near each other, or a robot in a keep-out box";
    }
}

/// Share of a range that a pose out of reach counts as.
const OUT_OF_REACH: f64 = 2.0;
/// Share of a range from which a joint's angle is looked at.
const NEAR: f64 = 0.99;

/// A robot that a session drives.
#[derive(Clone, Debug)]
pub struct SessionRobot {
    /// The robot in its place.
    pub cell: Cell,
    /// Limits of its axes, the joints' in the model's angles.
    limits: [AxisRange; AXES],
    /// Greatest way of a joint from the start \[rad\].
    correction: f64,
    /// Radius of the tool about the line from the last link's frame to the part's origin \[m\].
    pub(super) tool_radius: f64,
    /// Where each joint is far from the ends of its range.
    windows: [Window; RAIL],
}

/// A range of the angle of a joint's frame.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Its middle.
    middle: Turn<f64>,
    /// Cosine of half its width; below -1 the joint may turn as it likes.
    cosine: f64,
}

impl SessionRobot {
    /// A robot in its place, with the limits of its axes.
    pub(crate) fn new(cell: Cell, limits: &[AxisRange; AXES], correction: f64, tool_radius: f64) -> Self {
        let windows = std::array::from_fn(|joint| {
            // From the start, where the closed form gives angles within half a turn.
            let start = cell.start[joint];
            let model = cell.limits(joint).expect("a joint");
            let most = PI.min(correction);
            let lower = (-most).max(limits[joint].lower.max(model.lower) - start);
            let upper = most.min(limits[joint].upper.min(model.upper) - start);
            let (middle, half) = (0.5 * (lower + upper), 0.5 * (upper - lower));
            let cosine = if half >= PI { -2.0 } else { (NEAR * half).cos() };
            let frame = cell.frame_angle(joint, middle);
            Window { middle: Turn { cos: frame.cos(), sin: frame.sin() }, cosine }
        });
        Self { cell, limits: *limits, correction, tool_radius, windows }
    }

    /// What a commanded motion asks of the axes.
    #[inline(always)]
    pub(super) fn commanded<R: Real>(&self, reference: &Motion<R>) -> Commanded<R> {
        commanded(&self.cell, reference)
    }

    /// The same, and whether a joint may be at the end of its range.
    #[inline(always)]
    fn ask<R: Real>(&self, reference: &Motion<R>) -> (Commanded<R>, R::Mask) {
        let (zero, asked) = (R::lit(0.0), self.commanded(reference));
        let mut near = zero.lt(asked.singular);
        for i in 0..RAIL {
            let (Turn { cos, sin }, window) = (asked.turns[i], &self.windows[i]);
            let cosine = cos.mul_add(R::lit(window.middle.cos), sin * R::lit(window.middle.sin));
            // Not "less than": a NaN is near too.
            near = near | !R::lit(window.cosine).le(cosine);
        }
        if self.cell.axes() > RAIL {
            near = near | !range_share(&self.limits[RAIL], 0.0, asked.place).le(R::lit(NEAR));
        }
        (asked, near)
    }

    /// Greatest share of its range, or of its correction, that a joint needs; above 1 it cannot be commanded.
    #[inline(always)]
    fn used<R: Real>(&self, reference: &Motion<R>) -> R {
        let zero = R::lit(0.0);
        let (angle, limited) = commanded_axes(&self.cell, reference);
        let mut used = R::select(zero.lt(limited), R::lit(OUT_OF_REACH), zero);
        for (i, angle) in angle.into_iter().enumerate().take(self.cell.axes()) {
            let start = if i < RAIL { self.cell.start[i] } else { 0.0 };
            used = used.max(range_share(&self.limits[i], start, angle));
            if i < RAIL {
                used = used.max(angle.abs() * R::lit(1.0 / self.correction));
            }
        }
        used
    }

    /// Whether an axis would have to be faster, or to accelerate more, than it may, to go from rates to others.
    #[inline(always)]
    pub(super) fn too_fast<R: Real>(&self, from: &[R; AXES], to: &[R; AXES], cycle: R) -> R::Mask {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let mut over = one.lt(zero);
        for i in 0..self.cell.axes() {
            let limit = &self.limits[i];
            let change = (to[i] - from[i]).abs();
            // Not "greater than": the comparison must also catch a NaN.
            over = over | !to[i].abs().le(R::lit(limit.speed)) | !change.le(R::lit(limit.acceleration) * cycle);
        }
        over
    }
}

/// How far a place from the start is from the middle of an axis' range, 1 at its ends.
#[inline(always)]
fn range_share<R: Real>(limit: &AxisRange, start: f64, place: R) -> R {
    let (middle, half) = (0.5 * (limit.lower + limit.upper), 0.5 * (limit.upper - limit.lower));
    (place - R::lit(middle - start)).abs() * R::lit(1.0 / half)
}

/// What commanded motions ask of the axes of both robots.
#[inline(always)]
pub fn axes_asked<R: Real>(m: &Plant, reference: &Parts<R>) -> Asked<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let Some([robot1, robot2]) = &m.session_robots else {
        let rates = [zero; AXES];
        return Asked { rates_a: rates, rates_b: rates, near_limit: zero, least_sine: one, near_body: zero };
    };
    let ((a, near_a), (b, near_b)) = (robot1.ask(&reference.a), robot2.ask(&reference.b));
    let at = [a, b];
    let mut near_body = zero;
    if let Some(workspace) = &m.workspace {
        near_body = R::select(workspace.is_near(&at), one, zero);
    }
    Asked {
        rates_a: a.rate,
        rates_b: b.rate,
        near_limit: R::select(near_a | near_b, one, zero),
        // A NaN of either robot stands.
        least_sine: R::select(a.least_sine.le(R::lit(2.0)), a.least_sine.min(b.least_sine), a.least_sine),
        near_body,
    }
}

/// Greatest share of its range, or of its correction, that a joint of either robot needs for commanded motions; 0 where
/// none is near the end of one.
#[inline(always)]
pub fn range_used<R: Real>(m: &Plant, asked: &Asked<R>, reference: &Parts<R>) -> R {
    let zero = R::lit(0.0);
    let near = zero.lt(asked.near_limit);
    let Some([robot1, robot2]) = m.session_robots.as_ref().filter(|_| R::any(near)) else {
        return zero;
    };
    R::select(near, robot1.used(&reference.a).max(robot2.used(&reference.b)), zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::cell::Feedforward;
    use crate::manipulator::sample;
    use crate::model::{Rail, Timing};
    use crate::philox::uniform;
    use crate::vector::{Pose, Quat, Vec3, vec3};

    /// A robot 1 m below its part, with these limits.
    fn robot(limit: AxisRange, correction: f64, on_rail: bool) -> SessionRobot {
        let (timing, mut mount) = (Timing { substep: 1e-3, substeps: 1, max_ticks: 1 }, sample::mount());
        mount.base.position.z = -1.0;
        let rail = on_rail.then(|| (Rail { axis: vec3(1.0, 0.0, 0.0), share: 0.5 }, sample::carriage()));
        let servo = sample::servo(Feedforward::Full);
        let cell = Cell::new(&sample::robot(), &mount, &servo, rail, Pose::identity(), &timing).unwrap();
        SessionRobot::new(cell, &[limit; AXES], correction, 0.1)
    }

    /// Numbers from -1 to 1.
    fn draws() -> impl FnMut() -> f64 {
        let mut drawn = 0;
        move || {
            drawn += 1;
            2.0 * uniform(7, "axes", 0, drawn) - 1.0
        }
    }

    /// A motion up to 0.6 m and about 1 rad from the start.
    fn motion(draw: &mut impl FnMut() -> f64) -> Motion<f64> {
        let mut vector = |size: f64| vec3(draw(), draw(), draw()) * size;
        let v = vector(0.3);
        let attitude = Quat { w: (1.0 - v.dot(v)).sqrt(), v };
        Motion { position: vector(0.4), attitude, velocity: vector(0.3), omega: vector(0.5) }
    }

    #[test]
    fn rates_are_the_change_of_the_angles() {
        let mut draw = draws();
        let limit = AxisRange { lower: -3.0, upper: 3.0, speed: 1.0, acceleration: 4.0 };
        for on_rail in [false, true] {
            let robot = robot(limit, 3.0, on_rail);
            let mut seen = 0;
            while seen < 2000 {
                let reference = motion(&mut draw);
                let after = |time: f64| Motion {
                    position: reference.position + reference.velocity * time,
                    attitude: reference.attitude.turned(reference.omega * time),
                    ..reference
                };
                let step = 1e-5;
                let [before, now, after] = [-step, 0.0, step].map(|time| commanded_axes(&robot.cell, &after(time)));
                if now.1 > 0.0 {
                    continue;
                }
                seen += 1;
                let rates = robot.ask(&reference).0.rate;
                for (i, found) in rates.into_iter().enumerate().take(robot.cell.axes()) {
                    let rate = (after.0[i] - before.0[i]) / (2.0 * step);
                    assert!((rate - found).abs() < 1e-5 * (1.0 + rate.abs()), "axis {i}: {rate}, not {found}");
                }
            }
        }
    }

    #[test]
    fn no_joint_reaches_the_end_of_its_range_unseen() {
        let mut draw = draws();
        let limit = |lower, upper| AxisRange { lower, upper, speed: 1.0, acceleration: 4.0 };
        let cases = [
            (limit(-3.0, 3.0), 0.5),
            (limit(-1.4, 2.1), 1.0),
            (limit(-1.2, 6.2), 6.0),
            (limit(-9.0, 9.0), 3.0),
            (limit(-9.0, 9.0), 9.0),
        ];
        for (limit, correction) in cases {
            for on_rail in [false, true] {
                let robot = robot(limit, correction, on_rail);
                let (mut far, mut beyond) = (0, 0);
                for _ in 0..5000 {
                    let reference = motion(&mut draw);
                    let (used, near) = (robot.used(&reference), robot.ask(&reference).1);
                    assert!(near || used < 1.0, "{limit:?}: {used} of a range, unseen");
                    // A wide range ends where the model's own does.
                    assert!(!near || used > 0.98 || correction > 1.0, "{limit:?}: {used} of a range is near");
                    (far, beyond) = (far + u32::from(!near), beyond + u32::from(used > 1.0));
                }
                assert!(far > 100 && (beyond > 100 || limit.upper > 6.0), "{limit:?}: {far} far, {beyond} beyond");
            }
        }
    }

    #[test]
    fn a_motion_that_is_no_number_is_near_a_limit_and_too_fast() {
        let robot = robot(AxisRange { lower: -3.0, upper: 3.0, speed: 1.0, acceleration: 4.0 }, 1.0, false);
        let still = Vec3::splat(0.0);
        let reference = Motion { position: still, attitude: Quat::identity(), velocity: still, omega: still };
        let (asked, near) = robot.ask(&reference);
        let rates = asked.rate;
        assert!(!near && !robot.too_fast(&rates, &rates, 1e-3));
        let (_, near) = robot.ask(&Motion { position: vec3(f64::NAN, 0.0, 0.0), ..reference });
        assert!(near);
        let wrong = robot.ask(&Motion { velocity: vec3(0.0, f64::NAN, 0.0), ..reference }).0.rate;
        assert!(robot.too_fast(&rates, &wrong, 1e-3));
        let fast = robot.ask(&Motion { velocity: vec3(0.0, 0.01, 0.0), ..reference }).0.rate;
        assert!(robot.too_fast(&rates, &fast, 1e-3) && !robot.too_fast(&fast, &fast, 1e-3), "a step of the speed");
    }
}
