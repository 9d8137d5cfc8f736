//! Eight lanes in one AVX-512 register. Values exist only inside entry points compiled for AVX-512.

use super::*;
use std::arch::x86_64::*;

/// Eight lanes.
#[derive(Clone, Copy, Debug)]
pub struct Avx512Lanes(__m512d);

/// Eight outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Avx512Mask(__mmask8);

/// Calls an intrinsic; sound because this module's entry points check the instruction set once.
macro_rules! simd {
    ($call:expr) => {{
        // SAFETY: only reached from `#[target_feature(enable = "avx512f,avx512dq")]` entry points.
        unsafe { $call }
    }};
}

impl Avx512Lanes {
    #[inline(always)]
    fn from_array(values: [f64; WIDTH]) -> Self {
        Self(simd!(_mm512_loadu_pd(values.as_ptr())))
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH] {
        let mut out = [0.0; WIDTH];
        simd!(_mm512_storeu_pd(out.as_mut_ptr(), self.0));
        out
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self(simd!(_mm512_add_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self(simd!(_mm512_sub_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self(simd!(_mm512_mul_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        Self(simd!(_mm512_div_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn negated(self) -> Self {
        Self(simd!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        Self(simd!(_mm512_and_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        Self(simd!(_mm512_or_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn exponent_to_ones(self) -> Self {
        Self(simd!(_mm512_castsi512_pd(_mm512_srli_epi64::<52>(_mm512_castpd_si512(self.0)))))
    }
    #[inline(always)]
    fn ones_to_exponent(self) -> Self {
        Self(simd!(_mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0)))))
    }
}

impl Avx512Mask {
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(self.0 & o.0)
    }
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
    #[inline(always)]
    fn inverted(self) -> Self {
        Self(!self.0)
    }
    #[inline(always)]
    fn bit(self, index: usize) -> bool {
        self.0 >> index & 1 == 1
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
}

operators!(Avx512Lanes, Avx512Mask, "avx512f,avx512dq,avx2,fma");

impl Real for Avx512Lanes {
    type Mask = Avx512Mask;
    #[inline(always)]
    fn lit(value: f64) -> Self {
        Self(simd!(_mm512_set1_pd(value)))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(simd!(_mm512_fmadd_pd(self.0, factor.0, addend.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(simd!(_mm512_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(simd!(_mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0)))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(simd!(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Avx512Mask {
        Avx512Mask(simd!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn le(self, o: Self) -> Avx512Mask {
        Avx512Mask(simd!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn select(mask: Avx512Mask, then: Self, other: Self) -> Self {
        Self(simd!(_mm512_mask_blend_pd(mask.0, other.0, then.0)))
    }
    #[inline(always)]
    fn any(mask: Avx512Mask) -> bool {
        mask.any()
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(simd!(_mm512_min_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(simd!(_mm512_max_pd(self.0, o.0)))
    }
    bitwise!();
    lane_by_lane!();
}
