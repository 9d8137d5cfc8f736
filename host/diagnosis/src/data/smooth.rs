//! Motion from sampled positions: band-limited value, rate and acceleration on a finer grid, with zero phase.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use std::cell::RefCell;
use std::f64::consts::PI;

/// The pass band ends at this share of the cut-off.
const PASS: f64 = 0.8;

/// Position with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedSignal {
    /// Position.
    pub value: Vec<f64>,
    /// First derivative \[1/s\].
    pub rate: Vec<f64>,
    /// Second derivative \[1/s^2\].
    pub acceleration: Vec<f64>,
}

/// Returns the low-passed motion of samples with period `step` \[s\], at `finer` instants per step from the first to
/// the last sample.
///
/// The samples less their chord are continued point-symmetrically at both ends, which makes them a sine series; its
/// terms above the cut-off \[Hz\] are dropped and the rest is differentiated term by term, so that no band-limited
/// motion is distorted. Near the ends, where the acceleration jumps in the continuation, a few periods of the cut-off
/// ring.
pub fn motion(samples: &[f64], step: f64, cutoff: f64, finer: usize) -> SmoothedSignal {
    let n = samples.len() - 1;
    let chord = (samples[n] - samples[0]) / n as f64;
    let odd: Vec<f64> = samples.iter().enumerate().map(|(i, y)| y - samples[0] - chord * i as f64).collect();
    let mut whole = odd.clone();
    whole.extend(odd[1..n].iter().rev().map(|y| -y));
    let forward = planned(|planner| planner.plan_fft_forward(2 * n));
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut whole, &mut spectrum).expect("buffers of the plan's lengths");

    let base = PI / (n as f64 * step);
    let passed = ((2.0 * PI * cutoff / base).ceil() as usize).min(spectrum.len());
    let passing = |(k, term): (usize, &Complex<f64>)| {
        let omega = base * k as f64;
        // The series is odd: only the sine terms carry it.
        (omega, term.im * low_pass(omega / (2.0 * PI), cutoff) / (2 * n) as f64)
    };
    let sines: Vec<(f64, f64)> = spectrum[..passed].iter().enumerate().map(passing).collect();
    let backward = planned(|planner| planner.plan_fft_inverse(2 * n * finer));
    let derivative = |order: u32| -> Vec<f64> {
        let mut wide = backward.make_input_vec();
        for (wide, (omega, sine)) in wide.iter_mut().zip(&sines) {
            *wide = Complex::new(0.0, *sine) * Complex::new(0.0, *omega).powu(order);
        }
        wide[0] = Complex::default();
        let last = wide.len() - 1;
        wide[last].im = 0.0;
        let mut out = backward.make_output_vec();
        backward.process(&mut wide, &mut out).expect("buffers of the plan's lengths");
        out.truncate(n * finer + 1);
        out
    };
    let (mut value, mut rate) = (derivative(0), derivative(1));
    let acceleration = derivative(2);
    for (i, value) in value.iter_mut().enumerate() {
        *value += samples[0] + chord * i as f64 / finer as f64;
    }
    rate.iter_mut().for_each(|rate| *rate += chord / step);
    SmoothedSignal { value, rate, acceleration }
}

thread_local! {
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// A plan by this thread's planner, which keeps those it made: to make one takes as long as to use it, and recordings of
/// one length have many signals.
fn planned<P>(plan: impl FnOnce(&mut RealFftPlanner<f64>) -> P) -> P {
    PLANNER.with(|planner| plan(&mut planner.borrow_mut()))
}

/// 1 in the pass band, 0 above the cut-off, half a cosine between.
fn low_pass(frequency: f64, cutoff: f64) -> f64 {
    let place = (frequency / cutoff - PASS) / (1.0 - PASS);
    0.5 + 0.5 * (PI * place.clamp(0.0, 1.0)).cos()
}

/// Returns the power of a series in equal bands up to its Nyquist frequency, with a Hann window.
pub fn band_powers(series: &[f64], bands: usize) -> Vec<f64> {
    let n = series.len();
    let mean = series.iter().sum::<f64>() / n as f64;
    let taper = |i: usize| 0.5 - 0.5 * (2.0 * PI * (i as f64 + 0.5) / n as f64).cos();
    let mut tapered: Vec<f64> = series.iter().enumerate().map(|(i, y)| (y - mean) * taper(i)).collect();
    let forward = planned(|planner| planner.plan_fft_forward(n));
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut tapered, &mut spectrum).expect("buffers of the plan's lengths");
    let mut powers = vec![0.0; bands];
    for (k, value) in spectrum.iter().enumerate() {
        powers[(2 * k * bands / n).min(bands - 1)] += value.norm_sqr();
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_below_the_cutoff_is_differentiated_exactly() {
        let (step, finer, f) = (0.004, 8, 7.0);
        let omega = 2.0 * PI * f;
        let samples: Vec<f64> = (0..1500).map(|i| 0.3 * i as f64 * step + (omega * i as f64 * step).sin()).collect();
        let m = motion(&samples, step, 100.0, finer);
        assert_eq!(m.value.len(), 1499 * finer + 1);
        for i in (2000..10_000).step_by(333) {
            let t = i as f64 * step / finer as f64;
            assert!((m.value[i] - 0.3 * t - (omega * t).sin()).abs() < 1e-5, "{t}");
            assert!((m.rate[i] - 0.3 - omega * (omega * t).cos()).abs() < 1e-4 * omega, "{t}");
            assert!((m.acceleration[i] + omega * omega * (omega * t).sin()).abs() < 1e-3 * omega * omega, "{t}");
        }
    }
}
