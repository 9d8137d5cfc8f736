//! Eight f64 lanes as one scalar: AVX-512, AVX2 with FMA, or plain arrays, chosen at run time by the engine.
//!
//! All three give the same bits as f64 itself: every operation is exactly rounded and `mul_add` is fused on all.
//! Explicit types, since loops over arrays do not vectorise reliably.

use crate::real::Real;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A stage call that waits to be carried out; its method is always inlined.
pub trait Stage {
    /// What the stage gives.
    type Output;
    /// Carries the stage out.
    fn run(self) -> Self::Output;
}

/// A scalar made of `WIDTH` independent lanes; f64 itself has one.
pub trait Lane: Real + Send + Sync {
    /// Number of lanes.
    const WIDTH: usize;
    /// Lanes from values, one call per lane.
    fn gather(value: impl FnMut(usize) -> f64) -> Self;
    /// One lane's value.
    fn lane(self, index: usize) -> f64;
    /// Whether a mask holds in one lane.
    fn holds(mask: Self::Mask, index: usize) -> bool;
    /// Runs a stage as a function of its own, compiled for this type's instruction set: one frame that contains
    /// every stage would take the compiler minutes and overflow the instruction cache.
    fn stage<S: Stage>(stage: S) -> S::Output;
}

impl Lane for f64 {
    const WIDTH: usize = 1;
    #[inline(always)]
    fn gather(mut value: impl FnMut(usize) -> f64) -> Self {
        value(0)
    }
    #[inline(always)]
    fn lane(self, _index: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn holds(mask: bool, _index: usize) -> bool {
        mask
    }
    #[inline(always)]
    fn stage<S: Stage>(stage: S) -> S::Output {
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2,fma")]
            #[inline(never)]
            fn fused<S: Stage>(stage: S) -> S::Output {
                stage.run()
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                // SAFETY: checked just above.
                return unsafe { fused(stage) };
            }
        }
        out_of_line(stage)
    }
}

/// A stage for any processor, as a function of its own as well: inlined, the stages that machines with a fused
/// multiply-add never run were most of the code of every frame.
#[inline(never)]
fn out_of_line<S: Stage>(stage: S) -> S::Output {
    stage.run()
}

/// [`Lane::stage`] with the given instruction set.
macro_rules! stage_with {
    ($features:literal) => {
        #[inline(always)]
        fn stage<S: Stage>(stage: S) -> S::Output {
            #[target_feature(enable = $features)]
            #[inline(never)]
            fn compiled<S: Stage>(stage: S) -> S::Output {
                stage.run()
            }
            // SAFETY: lanes of this type exist only inside entry points that have checked the instruction set.
            unsafe { compiled(stage) }
        }
    };
    () => {
        #[inline(always)]
        fn stage<S: Stage>(stage: S) -> S::Output {
            out_of_line(stage)
        }
    };
}

/// The most lanes that any scalar has.
pub(crate) const MOST_LANES: usize = 64;

/// Number of lanes of the vector types.
pub const WIDTH: usize = 8;

/// Forwards the operator traits of a lane type to its inherent functions.
macro_rules! operators {
    ($lanes:ident, $mask:ident $(, $features:literal)?) => {
        crate::scalar_bundle!($lanes);
        operators!(@binary $lanes, Add add, Sub sub, Mul mul, Div div);
        operators!(@binary $mask, BitAnd bitand, BitOr bitor);
        impl Neg for $lanes {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                self.negated()
            }
        }
        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                self.inverted()
            }
        }
        impl Lane for $lanes {
            const WIDTH: usize = WIDTH;
            #[inline(always)]
            fn gather(value: impl FnMut(usize) -> f64) -> Self {
                Self::from_array(std::array::from_fn(value))
            }
            #[inline(always)]
            fn lane(self, index: usize) -> f64 {
                self.to_array()[index]
            }
            #[inline(always)]
            fn holds(mask: $mask, index: usize) -> bool {
                mask.bit(index)
            }
            stage_with!($($features)?);
        }
    };
    (@binary $ty:ident, $($trait:ident $function:ident),*) => {
        $(impl $trait for $ty {
            type Output = Self;
            #[inline(always)]
            fn $function(self, o: Self) -> Self {
                self.$function(o)
            }
        })*
    };
}

/// The scalar's bit tricks, lane by lane (rare: noise and general exponents only).
macro_rules! bitwise {
    () => {
        #[inline(always)]
        fn frexp(self) -> (Self, Self) {
            let parts = self.to_array().map(Real::frexp);
            (Self::from_array(parts.map(|p| p.0)), Self::from_array(parts.map(|p| p.1)))
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            Self::from_array(self.to_array().map(Real::exp2_whole))
        }
    };
}

/// Eight lanes in plain arrays: any processor; fused through the standard library where the hardware cannot.
pub mod plain {
    use super::*;

    /// Eight lanes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(align(64))]
    pub struct Lanes([f64; WIDTH]);

    /// Eight outcomes.
    #[derive(Clone, Copy, Debug)]
    pub struct Mask([bool; WIDTH]);

    macro_rules! each {
        ($index:ident => $value:expr) => {{ std::array::from_fn(|$index| $value) }};
    }

    impl Lanes {
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
    }

    impl Mask {
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

    operators!(Lanes, Mask);

    impl Real for Lanes {
        type Mask = Mask;
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
        fn lt(self, o: Self) -> Mask {
            Mask(each!(i => self.0[i] < o.0[i]))
        }
        #[inline(always)]
        fn le(self, o: Self) -> Mask {
            Mask(each!(i => self.0[i] <= o.0[i]))
        }
        #[inline(always)]
        fn select(mask: Mask, then: Self, other: Self) -> Self {
            Self(each!(i => if mask.0[i] { then.0[i] } else { other.0[i] }))
        }
        #[inline(always)]
        fn any(mask: Mask) -> bool {
            mask.any()
        }
        bitwise!();
    }
}

/// Eight lanes in one AVX-512 register. Values exist only inside entry points compiled for AVX-512.
#[cfg(target_arch = "x86_64")]
pub mod avx512 {
    use super::*;
    use std::arch::x86_64::*;

    /// Eight lanes.
    #[derive(Clone, Copy, Debug)]
    pub struct Lanes(__m512d);

    /// Eight outcomes.
    #[derive(Clone, Copy, Debug)]
    pub struct Mask(__mmask8);

    /// Calls an intrinsic; sound because this module's entry points check the instruction set once.
    macro_rules! simd {
        ($call:expr) => {{
            // SAFETY: only reached from `#[target_feature(enable = "avx512f,avx512dq")]` entry points.
            unsafe { $call }
        }};
    }

    impl Lanes {
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
    }

    impl Mask {
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

    operators!(Lanes, Mask, "avx512f,avx512dq,avx2,fma");

    impl Real for Lanes {
        type Mask = Mask;
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
        fn lt(self, o: Self) -> Mask {
            Mask(simd!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, o.0)))
        }
        #[inline(always)]
        fn le(self, o: Self) -> Mask {
            Mask(simd!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, o.0)))
        }
        #[inline(always)]
        fn select(mask: Mask, then: Self, other: Self) -> Self {
            Self(simd!(_mm512_mask_blend_pd(mask.0, other.0, then.0)))
        }
        #[inline(always)]
        fn any(mask: Mask) -> bool {
            mask.any()
        }
        bitwise!();
    }
}

/// Eight lanes in two AVX2 registers with FMA. Values exist only inside entry points compiled for AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
pub mod avx2 {
    use super::*;
    use std::arch::x86_64::*;

    /// Eight lanes.
    #[derive(Clone, Copy, Debug)]
    pub struct Lanes(__m256d, __m256d);

    /// Eight outcomes, all bits set where they hold.
    #[derive(Clone, Copy, Debug)]
    pub struct Mask(__m256d, __m256d);

    /// Calls an intrinsic on both halves; sound because this module's entry points check the instruction set once.
    macro_rules! halves {
        ($to:ident, $intrinsic:ident $(::<$c:tt>)? ($($value:expr),*)) => {{
            // SAFETY: only reached from `#[target_feature(enable = "avx2,fma")]` entry points.
            unsafe { $to($intrinsic$(::<$c>)?($($value.0),*), $intrinsic$(::<$c>)?($($value.1),*)) }
        }};
    }

    impl Lanes {
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
            halves!(Lanes, _mm256_add_pd(self, o))
        }
        #[inline(always)]
        fn sub(self, o: Self) -> Self {
            halves!(Lanes, _mm256_sub_pd(self, o))
        }
        #[inline(always)]
        fn mul(self, o: Self) -> Self {
            halves!(Lanes, _mm256_mul_pd(self, o))
        }
        #[inline(always)]
        fn div(self, o: Self) -> Self {
            halves!(Lanes, _mm256_div_pd(self, o))
        }
        #[inline(always)]
        fn negated(self) -> Self {
            halves!(Lanes, _mm256_xor_pd(self, Self::lit(-0.0)))
        }
    }

    impl Mask {
        #[inline(always)]
        fn bitand(self, o: Self) -> Self {
            halves!(Mask, _mm256_and_pd(self, o))
        }
        #[inline(always)]
        fn bitor(self, o: Self) -> Self {
            halves!(Mask, _mm256_or_pd(self, o))
        }
        #[inline(always)]
        fn inverted(self) -> Self {
            let all = Lanes::lit(f64::from_bits(u64::MAX));
            halves!(Mask, _mm256_xor_pd(self, all))
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

    operators!(Lanes, Mask, "avx2,fma");

    impl Real for Lanes {
        type Mask = Mask;
        #[inline(always)]
        fn lit(value: f64) -> Self {
            // SAFETY: as in `halves!`.
            let half = unsafe { _mm256_set1_pd(value) };
            Self(half, half)
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, addend: Self) -> Self {
            halves!(Lanes, _mm256_fmadd_pd(self, factor, addend))
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            halves!(Lanes, _mm256_sqrt_pd(self))
        }
        #[inline(always)]
        fn abs(self) -> Self {
            halves!(Lanes, _mm256_andnot_pd(Self::lit(-0.0), self))
        }
        #[inline(always)]
        fn floor(self) -> Self {
            halves!(Lanes, _mm256_floor_pd(self))
        }
        #[inline(always)]
        fn lt(self, o: Self) -> Mask {
            halves!(Mask, _mm256_cmp_pd::<_CMP_LT_OQ>(self, o))
        }
        #[inline(always)]
        fn le(self, o: Self) -> Mask {
            halves!(Mask, _mm256_cmp_pd::<_CMP_LE_OQ>(self, o))
        }
        #[inline(always)]
        fn select(mask: Mask, then: Self, other: Self) -> Self {
            halves!(Lanes, _mm256_blendv_pd(other, then, mask))
        }
        #[inline(always)]
        fn any(mask: Mask) -> bool {
            mask.any()
        }
        bitwise!();
    }
}
