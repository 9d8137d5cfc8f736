//! Random numbers inside the loop: one Philox block per run, tick and channel, turned into normal deviates.

use crate::bundle;
use crate::math::{log, sin_cos};
use crate::philox::{philox4x32, stream};
use crate::real::Real;

/// Channel of the command link: jitter and drops.
pub const LINK: u32 = stream("command_link");
/// Channels of the sensor noise: four deviates and two more.
pub const SENSOR: [u32; 2] = [stream("sensor_noise_a"), stream("sensor_noise_b")];

/// Channels of the noise of the arm's camera: four deviates and two more.
pub const CAMERA: [u32; 2] = [stream("camera_noise_a"), stream("camera_noise_b")];

bundle! {
    /// Two independent normal deviates.
    Normals {
        first: R, "1", "first deviate";
        second: R, "1", "second deviate";
    }
}

/// Box-Muller: two uniforms in (0, 1) to two normal deviates.
#[inline(always)]
pub fn normals<R: Real>(u: R, v: R) -> Normals<R> {
    let radius = (log(u) * R::lit(-2.0)).sqrt();
    let (sin, cos) = sin_cos(v * R::lit(2.0 * std::f64::consts::PI));
    Normals { first: radius * cos, second: radius * sin }
}

/// Four uniforms in (0, 1) with 24 bits each (exact in f32) for a run, tick and channel.
#[inline(always)]
pub fn uniforms(key: [u32; 2], run: u64, tick: u32, channel: u32) -> [f64; 4] {
    philox4x32([run as u32, (run >> 32) as u32, channel, tick], key)
        .map(|word| (f64::from(word >> 8) + 0.5) * (1.0 / 16_777_216.0))
}
