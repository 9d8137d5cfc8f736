//! Eight lanes in two AVX2 registers with FMA. Values exist only inside entry points compiled for AVX2 and FMA.

use super::*;
use std::arch::x86_64::*;

/// Eight lanes.
#[derive(Clone, Copy, Debug)]
pub struct Avx2Lanes(__m256d, __m256d);

/// Eight outcomes, all bits set where they hold.
#[derive(Clone, Copy, Debug)]
pub struct Avx2Mask(__m256d, __m256d);

/// Calls an intrinsic on both halves; sound because this module's entry points check the instruction set once.
macro_rules! halves {
    ($to:ident, $intrinsic:ident $(::<$c:tt>)? ($($value:expr),*)) => {{
        // SAFETY: only reached from `#[target_feature(enable = "avx2,fma")]` entry points.
        unsafe { $to($intrinsic$(::<$c>)?($($value.0),*), $intrinsic$(::<$c>)?($($value.1),*)) }
    }};
}

impl Avx2Lanes {
    #[inline(always)]
    fn from_array(values: [f64; WIDTH]) -> Self {
        // SAFETY: as in `halves!`; the array holds both halves.
        unsafe { Self(_mm256_loadu_pd(values.as_ptr()), _mm256_loadu_pd(values.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH] {
        let mut out = [0.0; WIDTH];
        // SAFETY: as in `halves!`; the array holds both halves.
        unsafe {
            _mm256_storeu_pd(out.as_mut_ptr(), self.0);
            _mm256_storeu_pd(out.as_mut_ptr().add(4), self.1);
        }
        out
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_add_pd(self, o))
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_sub_pd(self, o))
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_mul_pd(self, o))
    }
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_div_pd(self, o))
    }
    #[inline(always)]
    fn negated(self) -> Self {
        halves!(Avx2Lanes, _mm256_xor_pd(self, Self::lit(-0.0)))
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_and_pd(self, o))
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_or_pd(self, o))
    }
    #[inline(always)]
    fn exponent_to_ones(self) -> Self {
        // SAFETY: as in `halves!`.
        let half = |x| unsafe { _mm256_castsi256_pd(_mm256_srli_epi64::<52>(_mm256_castpd_si256(x))) };
        Self(half(self.0), half(self.1))
    }
    #[inline(always)]
    fn ones_to_exponent(self) -> Self {
        // SAFETY: as in `halves!`.
        let half = |x| unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(x))) };
        Self(half(self.0), half(self.1))
    }
}

impl Avx2Mask {
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        halves!(Avx2Mask, _mm256_and_pd(self, o))
    }
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        halves!(Avx2Mask, _mm256_or_pd(self, o))
    }
    #[inline(always)]
    fn inverted(self) -> Self {
        let all = Avx2Lanes::lit(f64::from_bits(u64::MAX));
        halves!(Avx2Mask, _mm256_xor_pd(self, all))
    }
    #[inline(always)]
    fn bits(self) -> i32 {
        // SAFETY: as in `halves!`.
        unsafe { _mm256_movemask_pd(self.0) | _mm256_movemask_pd(self.1) << 4 }
    }
    #[inline(always)]
    fn bit(self, index: usize) -> bool {
        self.bits() >> index & 1 == 1
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

operators!(Avx2Lanes, Avx2Mask, "avx2,fma");

impl Real for Avx2Lanes {
    type Mask = Avx2Mask;
    #[inline(always)]
    fn lit(value: f64) -> Self {
        // SAFETY: as in `halves!`.
        let half = unsafe { _mm256_set1_pd(value) };
        Self(half, half)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        halves!(Avx2Lanes, _mm256_fmadd_pd(self, factor, addend))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        halves!(Avx2Lanes, _mm256_sqrt_pd(self))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        halves!(Avx2Lanes, _mm256_andnot_pd(Self::lit(-0.0), self))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        halves!(Avx2Lanes, _mm256_floor_pd(self))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Avx2Mask {
        halves!(Avx2Mask, _mm256_cmp_pd::<_CMP_LT_OQ>(self, o))
    }
    #[inline(always)]
    fn le(self, o: Self) -> Avx2Mask {
        halves!(Avx2Mask, _mm256_cmp_pd::<_CMP_LE_OQ>(self, o))
    }
    #[inline(always)]
    fn select(mask: Avx2Mask, then: Self, other: Self) -> Self {
        halves!(Avx2Lanes, _mm256_blendv_pd(other, then, mask))
    }
    #[inline(always)]
    fn any(mask: Avx2Mask) -> bool {
        mask.any()
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_min_pd(self, o))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        halves!(Avx2Lanes, _mm256_max_pd(self, o))
    }
    bitwise!();
    lane_by_lane!();
}
