//! Eight lanes in plain arrays: any processor; fused through the standard library where the hardware cannot.

use super::*;

/// Eight lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct PlainLanes([f64; WIDTH]);

/// Eight outcomes.
#[derive(Clone, Copy, Debug)]
pub struct PlainMask([bool; WIDTH]);

macro_rules! each {
    ($index:ident => $value:expr) => {{ std::array::from_fn(|$index| $value) }};
}

impl PlainLanes {
    #[inline(always)]
    fn from_array(values: [f64; WIDTH]) -> Self {
        Self(values)
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH] {
        self.0
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self(each!(i => self.0[i] + o.0[i]))
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self(each!(i => self.0[i] - o.0[i]))
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self(each!(i => self.0[i] * o.0[i]))
    }
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        Self(each!(i => self.0[i] / o.0[i]))
    }
    #[inline(always)]
    fn negated(self) -> Self {
        Self(each!(i => -self.0[i]))
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        Self(each!(i => f64::from_bits(self.0[i].to_bits() & o.0[i].to_bits())))
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        Self(each!(i => f64::from_bits(self.0[i].to_bits() | o.0[i].to_bits())))
    }
    #[inline(always)]
    fn exponent_to_ones(self) -> Self {
        Self(each!(i => f64::from_bits(self.0[i].to_bits() >> 52)))
    }
    #[inline(always)]
    fn ones_to_exponent(self) -> Self {
        Self(each!(i => f64::from_bits(self.0[i].to_bits() << 52)))
    }
}

impl PlainMask {
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(each!(i => self.0[i] & o.0[i]))
    }
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(each!(i => self.0[i] | o.0[i]))
    }
    #[inline(always)]
    fn inverted(self) -> Self {
        Self(each!(i => !self.0[i]))
    }
    #[inline(always)]
    fn bit(self, index: usize) -> bool {
        self.0[index]
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.contains(&true)
    }
}

operators!(PlainLanes, PlainMask);

impl Real for PlainLanes {
    type Mask = PlainMask;
    #[inline(always)]
    fn lit(value: f64) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(each!(i => self.0[i].mul_add(factor.0[i], addend.0[i])))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(each!(i => self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(each!(i => self.0[i].abs()))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(each!(i => self.0[i].floor()))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> PlainMask {
        PlainMask(each!(i => self.0[i] < o.0[i]))
    }
    #[inline(always)]
    fn le(self, o: Self) -> PlainMask {
        PlainMask(each!(i => self.0[i] <= o.0[i]))
    }
    #[inline(always)]
    fn select(mask: PlainMask, then: Self, other: Self) -> Self {
        Self(each!(i => if mask.0[i] { then.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn any(mask: PlainMask) -> bool {
        mask.any()
    }
    bitwise!();
    lane_by_lane!();
}
