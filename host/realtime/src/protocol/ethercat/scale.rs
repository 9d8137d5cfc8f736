//! Conversion between counts of a drive and SI units of an axis.

/// Scale of one axis and its drive, from the facility file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisScale {
    /// Increments of the drive's position (objects 607A and 6064) per radian of the joint, or per metre of the rail:
    /// product of encoder increments, gear and the drive's own factor group; more than 0.
    pub counts_per_unit: f64,
    /// Whether the drive counts up where the axis, by our convention, moves down.
    pub reversed: bool,
    /// The drive's position at the axis' zero \[counts\].
    pub zero: i32,
    /// Rated torque at the joint \[N m\], or rated force of the rail \[N\]: 1000 of object 6077. `None`: unknown, no
    /// torques are reported.
    pub rated_torque: Option<f64>,
    /// Greatest commanded speed of the axis \[rad/s\] or \[m/s\]; a target beyond this step per cycle is refused.
    pub velocity: f64,
    /// Following error at which the drive faults \[rad\] or \[m\], written to object 6065 if it exists. `None`: the
    /// drive's own value stays.
    pub following_window: Option<f64>,
}

impl AxisScale {
    /// Creates a scale of counts per radian (or metre), with the drive's zero, and 2 rad/s (or m/s).
    pub fn new(counts_per_unit: f64) -> Self {
        Self { counts_per_unit, reversed: false, zero: 0, rated_torque: None, velocity: 2.0, following_window: None }
    }

    /// Returns the invalid value, if any.
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

    /// Returns the position of the axis \[rad\] or \[m\].
    pub fn position(&self, counts: i32) -> f64 {
        (f64::from(counts) - f64::from(self.zero)) / self.signed()
    }

    /// Returns the nearest counts of a position \[rad\] or \[m\]; `None` if the drive cannot express it.
    pub fn counts(&self, position: f64) -> Option<i32> {
        let counts = position.mul_add(self.signed(), f64::from(self.zero)).round();
        // A comparison with NaN is false.
        (counts >= f64::from(i32::MIN) && counts <= f64::from(i32::MAX)).then_some(counts as i32)
    }

    /// Returns the torque \[N m\] or force \[N\] of an actual value of object 6077 (1000 is the rated torque).
    pub fn torque(&self, per_mille: i16) -> Option<f64> {
        let sign = if self.reversed { -1.0 } else { 1.0 };
        self.rated_torque.map(|rated| sign * rated * f64::from(per_mille) * 1e-3)
    }

    /// Returns the greatest step in a cycle of this duration \[s\], in counts; at least one.
    pub fn step(&self, cycle: f64) -> i32 {
        // One additional count: both ends of a step are rounded.
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
    fn inexpressible_positions_have_no_counts() {
        let axis = AxisScale::new(1e6);
        for position in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 2147.5, -2147.5] {
            assert_eq!(axis.counts(position), None, "{position}");
        }
        assert_eq!(axis.counts(2147.483647), Some(i32::MAX));
    }

    #[test]
    fn step_is_velocity_times_cycle_plus_rounding() {
        assert_eq!(AxisScale { velocity: 2.0, ..AxisScale::new(1e5) }.step(1e-3), 201);
        assert_eq!(AxisScale::new(1e-9).step(1e-3), 2);
    }

    #[test]
    fn invalid_scale_is_refused() {
        assert_eq!(AxisScale::new(1e5).flaw(), None);
        assert!(AxisScale::new(0.0).flaw().is_some());
        assert!(AxisScale::new(f64::NAN).flaw().is_some());
        assert!(AxisScale { velocity: 0.0, ..AxisScale::new(1.0) }.flaw().is_some());
    }

    proptest! {
        #[test]
        fn positions_round_trip_within_half_a_count(
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
