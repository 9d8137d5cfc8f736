//! Elementary functions by own polynomials, equal on every backend (GPU builtins differ by up to 2e-4 between drivers).

use crate::real::Real;

const TAU_4: f64 = std::f64::consts::FRAC_PI_2;
/// First bits of pi/2, exact in f32, so that `k * TAU_4_HIGH` is exact for |k| < 2^13 on every backend.
const TAU_4_HIGH: f64 = 1.570_312_5;
/// The rest of pi/2, with the 6.1e-17 by which f64's own pi/2 is short.
const TAU_4_LOW: f64 = TAU_4 - TAU_4_HIGH + 6.123_233_995_736_766e-17;
/// The same split of ln 2.
const LN_2_HIGH: f64 = 0.693_359_375;
const LN_2_LOW: f64 = std::f64::consts::LN_2 - LN_2_HIGH + 2.319_046_813_846_299_6e-17;

/// Sine and cosine for |angle| < 1e4 rad: reduction to an octant, Taylor series to below 1e-16.
#[inline(always)]
pub fn sin_cos<R: Real>(angle: R) -> (R, R) {
    let quarter_turns = angle.mul_add(R::lit(1.0 / TAU_4), R::lit(0.5)).floor();
    let r = quarter_turns.mul_add(R::lit(-TAU_4_LOW), quarter_turns.mul_add(R::lit(-TAU_4_HIGH), angle));
    let s = r * r;
    let sin = r * s.polynomial(&[
        1.0,
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
    ]);
    let cos = s.polynomial(&[
        1.0,
        -1.0 / 2.0,
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 20_922_789_888_000.0,
    ]);
    // Quadrant 0..3: odd ones swap sine and cosine, the upper two change the sign.
    let quadrant = (quarter_turns * R::lit(0.25)).floor().mul_add(R::lit(-4.0), quarter_turns);
    let upper = R::lit(1.5).lt(quadrant);
    let odd = R::lit(0.5).lt(R::select(upper, quadrant - R::lit(2.0), quadrant));
    let (a, b) = (R::select(odd, cos, sin), R::select(odd, -sin, cos));
    (R::select(upper, -a, a), R::select(upper, -b, b))
}

/// A first-order lag \[s\] after a step \[s\] over which `to` holds, exactly; without a time constant nothing lags.
#[inline(always)]
pub fn lagged<R: Real>(step: f64, lag: R, at: R, to: R) -> R {
    if lag.max(R::lit(0.0)).is_absent() {
        return to;
    }
    let share = R::lit(1.0) - exp(-(R::lit(step) / lag.max(R::lit(1e-9))));
    R::select(lag.le(R::lit(0.0)), to, (to - at).mul_add(share, at))
}

/// The same after a step over which the signal goes straight from `from` to `to`.
#[inline(always)]
pub fn lagged_along<R: Real>(step: f64, lag: R, at: R, from: R, to: R) -> R {
    if lag.max(R::lit(0.0)).is_absent() {
        return to;
    }
    let keep = exp(-(R::lit(step) / lag.max(R::lit(1e-9))));
    let behind = (to - from) * lag * R::lit(1.0 / step);
    R::select(lag.le(R::lit(0.0)), to, (at - from + behind).mul_add(keep, to - behind))
}

/// Angle of the vector (x, y) from +x, in (-pi, pi]; 0 for the zero vector.
#[inline(always)]
pub fn atan2<R: Real>(y: R, x: R) -> R {
    let (ay, ax) = (y.abs(), x.abs());
    let ratio = ay.min(ax) / ay.max(ax).max(R::lit(1e-30));
    // Two half-angle steps bring the argument below 0.2, where 12 terms reach 1e-17.
    let t = half_angle(half_angle(ratio));
    let mut coefficients = [0.0; 12];
    for (k, c) in coefficients.iter_mut().enumerate() {
        *c = if k % 2 == 0 { 4.0 } else { -4.0 } / (2 * k + 1) as f64;
    }
    let octant = t * (t * t).polynomial(&coefficients);
    let quadrant = R::select(ax.lt(ay), R::lit(TAU_4) - octant, octant);
    let half_plane = R::select(x.lt(R::lit(0.0)), R::lit(2.0 * TAU_4) - quadrant, quadrant);
    R::select(y.lt(R::lit(0.0)), -half_plane, half_plane)
}

/// Tangent of half the angle whose tangent is `t`.
#[inline(always)]
fn half_angle<R: Real>(t: R) -> R {
    t / (R::lit(1.0) + t.mul_add(t, R::lit(1.0)).sqrt())
}

/// Exponential function, argument clamped to [-87, 87] (the normal range of f32).
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    let x = x.min(R::lit(87.0)).max(R::lit(-87.0));
    let k = x.mul_add(R::lit(std::f64::consts::LOG2_E), R::lit(0.5)).floor();
    let r = k.mul_add(R::lit(-LN_2_LOW), k.mul_add(R::lit(-LN_2_HIGH), x));
    let mut coefficients = [1.0; 14];
    for k in 1..coefficients.len() {
        coefficients[k] = coefficients[k - 1] / k as f64;
    }
    r.polynomial(&coefficients) * k.exp2_whole()
}

/// Natural logarithm of a positive normal number.
#[inline(always)]
pub fn log<R: Real>(x: R) -> R {
    let (mantissa, exponent) = x.frexp();
    let low = mantissa.lt(R::lit(std::f64::consts::FRAC_1_SQRT_2));
    let one = R::lit(1.0);
    let m = R::select(low, mantissa + mantissa, mantissa);
    let e = R::select(low, exponent - one, exponent);
    let s = (m - one) / (m + one);
    let mut coefficients = [0.0; 11];
    for (k, c) in coefficients.iter_mut().enumerate() {
        *c = 2.0 / (2 * k + 1) as f64;
    }
    e.mul_add(R::lit(LN_2_HIGH), e.mul_add(R::lit(LN_2_LOW), s * (s * s).polynomial(&coefficients)))
}

/// `base^exponent` for a base above 0 and a constant exponent; whole and half exponents are exact products.
#[inline(always)]
pub fn power<R: Real>(base: R, exponent: f64) -> R {
    match exponent {
        1.0 => base,
        1.5 => base * base.sqrt(),
        2.0 => base * base,
        _ => exp(log(base.max(R::lit(1e-30))) * R::lit(exponent)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agree_with_the_standard_library() {
        for i in -4000..4000 {
            let x = f64::from(i) * 0.0137;
            let (s, c) = sin_cos(x);
            assert!((s - x.sin()).abs() < 4e-16 && (c - x.cos()).abs() < 4e-16, "sin_cos({x})");
            assert!((exp(x) / x.exp() - 1.0).abs() < 1e-15 || x.abs() > 87.0, "exp({x})");
            let positive = x.exp();
            if positive.is_normal() {
                assert!((log(positive) - positive.ln()).abs() < 1e-15 * x.abs().max(1.0), "log({positive})");
            }
            let (y, z) = (x.sin() * 3.0, (1.3 * x).cos());
            assert!((atan2(y, z) - y.atan2(z)).abs() < 1e-15, "atan2({y}, {z})");
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert!((power(0.37, 1.7) - 0.37_f64.powf(1.7)).abs() < 1e-15);
    }
}
