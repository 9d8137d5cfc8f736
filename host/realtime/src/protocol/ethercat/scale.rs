//! Counts of a drive and SI units of an axis: the only place where the two meet.

/// How one axis is wired to its drive: what a facility file says of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisScale {
    /// Increments of the drive's position (objects 607A and 6064) per radian of the joint, or per metre of the rail:
    /// encoder increments, gear and the drive's own factor group in one; more than 0.
    pub counts_per_unit: f64,
    /// The drive counts up where the axis, by our convention, goes down.
    pub reversed: bool,
    /// The drive's position where the axis stands at 0 \[counts\].
    pub zero: i32,
    /// Rated torque at the joint \[N m\], or rated force of the rail \[N\]: 1000 of object 6077. `None`: not known, no
    /// torques are reported.
    pub rated_torque: Option<f64>,
    /// Fastest that the axis is ever asked to go \[rad/s\] or \[m/s\]; a target farther from the last one than this
    /// allows in a cycle is refused.
    pub velocity: f64,
    /// Following error at which the drive itself is to fault \[rad\] or \[m\], written to object 6065 if the drive has
    /// it. `None`: the drive keeps its own.
    pub following_window: Option<f64>,
}

impl AxisScale {
    /// An axis with this many counts per radian (or metre), zero where the drive has its zero, 2 rad/s (or m/s).
    pub fn new(counts_per_unit: f64) -> Self {
        Self { counts_per_unit, reversed: false, zero: 0, rated_torque: None, velocity: 2.0, following_window: None }
    }

    /// What in it cannot be, if anything.
    pub fn flaw(&self) -> Option<&'static str> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.counts_per_unit) {
            Some("counts_per_unit must be more than 0")
        } else if !positive(self.velocity) {
            Some("velocity must be more than 0")
        } else if self.rated_torque.is_some_and(|torque| !positive(torque)) {
            Some("rated_torque must be more than 0")
        } else if self.following_window.is_some_and(|window| !positive(window)) {
            Some("following_window must be more than 0")
        } else {
            None
        }
    }

    fn signed(&self) -> f64 {
        if self.reversed { -self.counts_per_unit } else { self.counts_per_unit }
    }

    /// Position of the axis \[rad\] or \[m\].
    pub fn position(&self, counts: i32) -> f64 {
        (f64::from(counts) - f64::from(self.zero)) / self.signed()
    }

    /// Counts of a position \[rad\] or \[m\], to the nearest; `None` if the drive cannot express it.
    pub fn counts(&self, position: f64) -> Option<i32> {
        let counts = position.mul_add(self.signed(), f64::from(self.zero)).round();
        // A comparison with NaN is false.
        (counts >= f64::from(i32::MIN) && counts <= f64::from(i32::MAX)).then_some(counts as i32)
    }

    /// Torque \[N m\] or force \[N\] of an actual value of object 6077 (1000 is the rated torque).
    pub fn torque(&self, per_mille: i16) -> Option<f64> {
        let sign = if self.reversed { -1.0 } else { 1.0 };
        self.rated_torque.map(|rated| sign * rated * f64::from(per_mille) * 1e-3)
    }

    /// Counts that the axis may be asked to go in a cycle of so many seconds; at least one.
    pub fn step(&self, cycle: f64) -> i32 {
        // One count more: both ends of a step are rounded.
        ((self.velocity * cycle * self.counts_per_unit).ceil() + 1.0).clamp(1.0, f64::from(i32::MAX)) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn counts_follow_ratio_sign_and_zero() {
        let axis = AxisScale { reversed: true, zero: 1000, ..AxisScale::new(100.0) };
        assert_eq!(axis.counts(1.0), Some(900));
        assert_eq!(axis.position(900), 1.0);
        assert_eq!(AxisScale { rated_torque: Some(50.0), ..axis }.torque(100), Some(-5.0));
        assert_eq!(axis.torque(100), None);
    }

    #[test]
    fn what_a_drive_cannot_express_has_no_counts() {
        let axis = AxisScale::new(1e6);
        for position in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 2147.5, -2147.5] {
            assert_eq!(axis.counts(position), None, "{position}");
        }
        assert_eq!(axis.counts(2147.483647), Some(i32::MAX));
    }

    #[test]
    fn a_step_is_the_velocity_over_a_cycle_and_the_rounding() {
        assert_eq!(AxisScale { velocity: 2.0, ..AxisScale::new(1e5) }.step(1e-3), 201);
        assert_eq!(AxisScale::new(1e-9).step(1e-3), 2);
    }

    #[test]
    fn a_scale_without_sense_is_named() {
        assert_eq!(AxisScale::new(1e5).flaw(), None);
        assert!(AxisScale::new(0.0).flaw().is_some());
        assert!(AxisScale::new(f64::NAN).flaw().is_some());
        assert!(AxisScale { velocity: 0.0, ..AxisScale::new(1.0) }.flaw().is_some());
    }

    proptest! {
        #[test]
        fn positions_come_back_within_half_a_count(
            ratio in 1e2..1e7f64, zero in -1_000_000..1_000_000i32, reversed: bool, position in -100.0..100.0f64
        ) {
            let axis = AxisScale { reversed, zero, ..AxisScale::new(ratio) };
            if let Some(counts) = axis.counts(position) {
                prop_assert!((axis.position(counts) - position).abs() <= 0.5001 / ratio);
                prop_assert_eq!(axis.counts(axis.position(counts)), Some(counts));
            }
        }

        #[test]
        fn no_position_panics(bits: u64, counts: i32) {
            let axis = AxisScale::new(3.7e4);
            let _ = axis.counts(f64::from_bits(bits));
            let _ = axis.position(counts);
        }
    }
}
