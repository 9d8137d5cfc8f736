//! The machine's own peak: how many fused multiply-adds per second its lanes make, and a device's.

use crate::EngineError;
use crate::gpu::{GpuEngine, WORKGROUP};
use crate::instructions::InstructionSet;
use softdock_kernels::lanes::{Lane, Stage};
use std::hint::black_box;
use std::time::Instant;

/// Independent chains: latency times pipes of current cores, and still in registers.
const CHAINS: usize = 12;

struct Chains<L: Lane> {
    start: [L; CHAINS],
    factor: L,
    rounds: u32,
}

impl<L: Lane> Stage for Chains<L> {
    type Output = [L; CHAINS];
    #[inline(always)]
    fn run(self) -> [L; CHAINS] {
        let mut chains = self.start;
        for _ in 0..self.rounds {
            for chain in &mut chains {
                *chain = chain.mul_add(self.factor, self.factor);
            }
        }
        chains
    }
}

/// Multiply-adds of one thread, as flop/s.
fn thread_peak<L: Lane>(seconds: f64) -> f64 {
    const ROUNDS: u32 = 100_000;
    let (factor, start) = (black_box(0.5), black_box(1.0));
    let (began, mut flops) = (Instant::now(), 0.0);
    while began.elapsed().as_secs_f64() < seconds {
        let ended = L::stage(Chains { start: [L::lit(start); CHAINS], factor: L::lit(factor), rounds: ROUNDS });
        black_box(ended[CHAINS - 1].lane(0));
        flops += 2.0 * f64::from(ROUNDS) * (CHAINS * L::WIDTH) as f64;
    }
    flops / began.elapsed().as_secs_f64()
}

/// Peak of all threads of the current pool in f64 \[flop/s\]; f32 makes twice as many in the same registers.
pub fn cpu_peak(instructions: InstructionSet, seconds: f64) -> f64 {
    let one = move || match instructions {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => thread_peak::<softdock_kernels::lanes::avx512::Avx512Lanes>(seconds),
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => thread_peak::<softdock_kernels::lanes::avx2::Avx2Lanes>(seconds),
        #[cfg(not(target_arch = "x86_64"))]
        InstructionSet::Plain => thread_peak::<softdock_kernels::lanes::plain::PlainLanes>(seconds),
        _ => thread_peak::<f64>(seconds),
    };
    rayon::broadcast(|_| one()).into_iter().sum()
}

/// Multiply-adds of a device in f32 \[flop/s\]: chains in registers, one dispatch of about half a second.
///
/// # Errors
/// See [`EngineError`].
pub fn device_peak(engine: &GpuEngine) -> Result<f64, EngineError> {
    let text = format!(
        "@group(0) @binding(0) var<storage, read_write> data: array<u32>;\n\
         @compute @workgroup_size({WORKGROUP})\n\
         fn chains(@builtin(global_invocation_id) id: vec3u) {{\n\
             let factor = vec4f(bitcast<f32>(data[0]));\n\
             let rounds = data[1];\n\
             var a = vec4f(bitcast<f32>(data[2])); var b = a + 1.0; var c = a + 2.0; var d = a + 3.0;\n\
             for (var i = 0u; i < rounds; i++) {{\n\
                 a = fma(a, factor, factor); b = fma(b, factor, factor);\n\
                 c = fma(c, factor, factor); d = fma(d, factor, factor);\n\
             }}\n\
             data[3u + id.x] = bitcast<u32>(dot(a + b + c + d, vec4f(1.0)));\n\
         }}\n"
    );
    // Short loops and many invocations: some drivers cut a loop after 65,535 rounds.
    const ROUNDS: u32 = 16_384;
    let seconds = |groups: u32, rounds: u32| {
        let mut data = vec![0u32; 3 + groups as usize * WORKGROUP];
        (data[0], data[1], data[2]) = (0.5f32.to_bits(), rounds, 1.0f32.to_bits());
        engine.compute_timed(&text, "chains", groups, &[data]).map(|answer| answer.1)
    };
    let mut groups = 64u32;
    loop {
        // What the driver compiles at the first dispatch falls out of the difference.
        let took = seconds(groups, ROUNDS)? - seconds(groups, 1)?;
        if took > 0.2 || groups >= 65_535 {
            return Ok(32.0 * f64::from(ROUNDS - 1) * f64::from(groups) * WORKGROUP as f64 / took);
        }
        groups = (groups * 4).min(65_535);
    }
}
