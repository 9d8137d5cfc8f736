//! Instruction sets of the lanes, chosen at run time; all give the same bits.

use softdock_kernels::lanes::Lane;

/// Instruction set of the lanes. All give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Eight lanes in one register.
    Avx512,
    /// Eight lanes in two registers, fused multiply-add.
    Avx2,
    /// One lane at a time, the single-run path; exact but slow where there is no fused multiply-add.
    OneLane,
    /// Eight lanes in arrays, for processors that always have a fused multiply-add (aarch64).
    Plain,
}

impl InstructionSet {
    /// The widest that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                return Self::Avx2;
            }
            Self::OneLane
        }
        #[cfg(not(target_arch = "x86_64"))]
        Self::Plain
    }

    /// Runs that one thread steps side by side.
    pub(crate) fn lanes(self) -> usize {
        if self == Self::OneLane { 1 } else { 8 }
    }

    pub(crate) fn supported(self) -> bool {
        match self {
            Self::OneLane => true,
            Self::Plain => cfg!(not(target_arch = "x86_64")),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Runs work with these lanes; the machine must have them.
    pub(crate) fn run<W: OnLanes>(self, work: W) -> W::Output {
        assert!(self.supported(), "{self:?} on a machine without");
        match self {
            // SAFETY: the machine has it, as asserted above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { on_avx512(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { on_avx2(work) },
            #[cfg(not(target_arch = "x86_64"))]
            Self::Plain => work.execute::<softdock_kernels::lanes::plain::PlainLanes>(),
            _ => work.execute::<f64>(),
        }
    }
}

/// Work that is written once for lanes of any width.
pub(crate) trait OnLanes {
    /// What it gives.
    type Output;
    /// Does it; always inlined, so that it is compiled for the instruction set of its caller.
    fn execute<L: Lane>(self) -> Self::Output;
}

/// One entry point per instruction set, each compiled for it.
macro_rules! entry_points {
    ($($name:ident: $lanes:ty, $features:literal;)*) => {
        $(
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = $features)]
            fn $name<W: OnLanes>(work: W) -> W::Output {
                work.execute::<$lanes>()
            }
        )*
    };
}

entry_points! {
    on_avx512: softdock_kernels::lanes::avx512::Avx512Lanes, "avx512f,avx512dq,avx2,fma";
    on_avx2: softdock_kernels::lanes::avx2::Avx2Lanes, "avx2,fma";
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::lanes::plain::PlainLanes;
    use softdock_kernels::math::{exp, log};

    /// What is made of a number's bits, and the smaller and the greater of it and another.
    struct Bits(f64, f64);

    impl OnLanes for Bits {
        type Output = [u64; 6];
        #[inline(always)]
        fn execute<L: Lane>(self) -> [u64; 6] {
            let (a, b) = (L::lit(self.0), L::lit(self.1));
            let (mantissa, exponent) = a.abs().frexp();
            let whole = exponent.max(L::lit(-1022.0)).min(L::lit(1023.0)).exp2_whole();
            let results = [mantissa, exponent, whole, a.min(b), a.max(b), exp(a) + log(a.abs())];
            results.map(|lanes| lanes.lane(L::WIDTH - 1).to_bits())
        }
    }

    #[test]
    fn bits_and_order_are_the_same_on_every_instruction_set() {
        let numbers = [0.0, -0.0, 1.0, -0.37, 3e-300, -86.9, 1.7e308, f64::MIN_POSITIVE, f64::INFINITY, f64::NAN];
        for (a, b) in numbers.into_iter().flat_map(|a| numbers.map(|b| (a, b))) {
            let one = InstructionSet::OneLane.run(Bits(a, b));
            let sets = [InstructionSet::Avx512, InstructionSet::Avx2].into_iter().filter(|set| set.supported());
            sets.for_each(|set| assert_eq!(set.run(Bits(a, b)), one, "{set:?}: {a} and {b}"));
            assert_eq!(Bits(a, b).execute::<PlainLanes>(), one, "in arrays: {a} and {b}");
        }
    }
}
