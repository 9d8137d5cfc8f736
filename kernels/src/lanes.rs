//! Eight f64 lanes as one scalar: AVX-512, AVX2 with FMA, or plain arrays, chosen at run time by the engine.
//!
//! All three give the same bits as f64 itself: every operation is exactly rounded and `mul_add` is fused on all.
//! Explicit types, since loops over arrays do not vectorise reliably.

use crate::lookup::LookupTable;
use crate::real::{ONES, Real};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A deferred stage call; its method is always inlined.
pub trait Stage {
    /// What the stage gives.
    type Output;
    /// Runs the stage.
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

/// The scalar's bit tricks, by the inherent functions of a lane type.
macro_rules! bitwise {
    () => {
        #[inline(always)]
        fn frexp(self) -> (Self, Self) {
            let bits = |bits| Self::lit(f64::from_bits(bits));
            let exponent = self.exponent_to_ones().and(bits(0x7ff)).or(Self::lit(ONES)) - Self::lit(ONES + 1022.0);
            (self.and(bits(!(0x7ff << 52))).or(bits(1022 << 52)), exponent)
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            (self + Self::lit(ONES + 1023.0)).ones_to_exponent()
        }
    };
}

/// Reads of a table, lane by lane.
macro_rules! lane_by_lane {
    () => {
        #[inline(always)]
        fn look_up(table: &LookupTable, index: Self, step: usize) -> Self {
            let (index, mut out) = (index.to_array(), [0.0; WIDTH]);
            for lane in 0..WIDTH {
                out[lane] = table.at(index[lane], step);
            }
            Self::from_array(out)
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub mod avx2;
#[cfg(target_arch = "x86_64")]
pub mod avx512;
pub mod plain;
