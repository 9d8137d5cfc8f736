//! The scalar that the physics is written in: f64, a lane vector of f64, or a symbol of the tracer.

use crate::lookup::LookupTable;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A real number, or several at once, or a name for one.
///
/// There are no branches on values: comparisons give a [`Mask`](Self::Mask), and [`select`](Self::select)
/// chooses. `min` and `max` give the second operand when the comparison fails (also for NaN), on every
/// implementation but WGSL, where NaN is caught by the monitor before it matters.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self> + 'static
{
    /// The outcome of a comparison.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;

    /// A constant.
    fn lit(value: f64) -> Self;
    /// `self * factor + addend`, rounded once wherever the hardware can.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Greatest whole number not above.
    fn floor(self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `then` where the mask holds, `other` elsewhere.
    fn select(mask: Self::Mask, then: Self, other: Self) -> Self;
    /// Whether the mask holds in any lane: work that none needs may be left out where it would change nothing. A trace
    /// knows no values and leaves all work in.
    fn any(mask: Self::Mask) -> bool;
    /// `self = mantissa * 2^exponent` with the mantissa in [0.5, 1), for positive normal numbers.
    fn frexp(self) -> (Self, Self);
    /// `2^self` for a whole number in the normal exponent range.
    fn exp2_whole(self) -> Self;
    /// Number `index + step` of a table, for a whole number `index` from 0 on; beyond the table its last one.
    fn look_up(table: &LookupTable, index: Self, step: usize) -> Self;

    /// The smaller value.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }

    /// The greater value.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }

    /// Whether it is zero in every lane, and with it all that it scales. Never in a trace.
    #[inline(always)]
    fn is_absent(self) -> bool {
        !Self::any(!self.abs().le(Self::lit(0.0)))
    }

    /// Polynomial with the given coefficients, at least two, lowest power first: even and odd powers by Horner's rule, for
    /// two chains of additions that do not wait for each other take half the time of one.
    #[inline(always)]
    fn polynomial(self, coefficients: &[f64]) -> Self {
        let square = self * self;
        let mut k = coefficients.len() - 2;
        let (mut odd, mut even) = (Self::lit(coefficients[k + 1]), Self::lit(coefficients[k]));
        // No iterator: what it calls might be compiled for any processor.
        while k > 0 {
            k -= 1;
            (odd, even) = (even, odd.mul_add(square, Self::lit(coefficients[k])));
        }
        odd.mul_add(self, even)
    }
}

/// From here to its double the last bit of a number counts ones: added to it, a small whole number stands in the last
/// bits. Conversions to integers would be made lane by lane.
pub(crate) const ONES: f64 = (1_u64 << 52) as f64;

impl Real for f64 {
    type Mask = bool;

    #[inline(always)]
    fn lit(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        f64::mul_add(self, factor, addend)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, then: Self, other: Self) -> Self {
        if mask { then } else { other }
    }
    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }
    #[inline(always)]
    fn frexp(self) -> (Self, Self) {
        let bits = self.to_bits();
        let exponent = f64::from_bits(ONES.to_bits() | (bits >> 52) & 0x7ff) - (ONES + 1022.0);
        (f64::from_bits((bits & !(0x7ff << 52)) | (1022 << 52)), exponent)
    }
    #[inline(always)]
    fn exp2_whole(self) -> Self {
        f64::from_bits((self + (ONES + 1023.0)).to_bits() << 52)
    }
    #[inline(always)]
    fn look_up(table: &LookupTable, index: Self, step: usize) -> Self {
        table.at(index, step)
    }
}
