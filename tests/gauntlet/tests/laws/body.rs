//! The free body's effects as its recordings show them.

use crate::support::Recording;
use softdock_gauntlet::{Hidden, Rig, fresh};

/// The noise-free motion with and without one effect.
fn pair(id: &'static str, size: f64) -> (Recording, Recording) {
    let fresh = fresh(Rig::Body, &[Hidden { id, size }], 21).expect(id);
    (Recording::read(&fresh.with_effect), Recording::read(&fresh.without_effect))
}

fn ratio(pair: &(Recording, Recording), column: &str, time: f64) -> f64 {
    let row = (time / 0.004).round() as usize;
    pair.0.column(column)[row] / pair.1.column(column)[row]
}

#[test]
fn mass_centre_and_inertia_follow_newton_and_euler() {
    // The first pulse is a force along y, 0.4 to 0.9 s; the second a moment about z, from 0.7 s.
    let heavier = pair("P1_mass", 30.0);
    assert!((ratio(&heavier, "ay_m_per_s2", 0.5) - 300.0 / 330.0).abs() < 2e-3);
    let larger = pair("P1_inertia", 0.1);
    assert!((ratio(&larger, "wz_rad_per_s", 1.4) - 1.0 / 1.1).abs() < 0.01);
    // Off along x by d, the force turns the body about z: alpha = -d F / I.
    let off = pair("P1_centre", 0.05);
    let turned = off.0.column("wz_rad_per_s")[162] - off.1.column("wz_rad_per_s")[162];
    let expected = -0.05 * 70.0 * 0.248 / 100.0;
    assert!((turned / expected - 1.0).abs() < 0.03, "{turned} instead of {expected}");
}

/// Frequency \[Hz\] at which a column of the free drift at the end of the record is strongest, and its amplitude.
fn strongest(values: &[f64], low: f64, high: f64) -> (f64, f64) {
    let tail = &values[1300..];
    let mean = tail.iter().sum::<f64>() / tail.len() as f64;
    let line = |hz: f64| {
        let sum = tail.iter().enumerate().fold([0.0; 2], |sum, (i, value)| {
            let (sin, cos) = (std::f64::consts::TAU * hz * i as f64 * 0.004).sin_cos();
            [sum[0] + (value - mean) * sin, sum[1] + (value - mean) * cos]
        });
        2.0 * sum[0].hypot(sum[1]) / tail.len() as f64
    };
    let grid = (0..200).map(|i| low + (high - low) * f64::from(i) / 200.0);
    grid.map(|hz| (hz, line(hz))).max_by(|a, b| a.1.total_cmp(&b.1)).expect("a line")
}

#[test]
fn slosh_and_boom_ring_after_the_last_pulse() {
    let (slosh, still) = pair("P2_slosh", 12.0);
    // Free, the body swings against its 12 of 300 kg: 0.5 Hz sqrt(300/288) = 0.51 Hz and a little more where it turns.
    let (hz, amplitude) = strongest(&slosh.column("az_m_per_s2"), 0.3, 1.0);
    assert!((hz - 0.515).abs() < 0.05 && amplitude > 2e-3, "{hz} {amplitude}");
    let (_, quiet) = strongest(&still.column("az_m_per_s2"), 0.3, 1.0);
    assert!(quiet < 0.1 * amplitude, "{quiet} {amplitude}");
    let (boom, _) = pair("P3_appendage", 3.0);
    // 2.8 Hz with the body held; free, its 3 kg 2.5 m out swing against 80 kg m^2: higher by a tenth or so.
    let (hz, amplitude) = strongest(&boom.column("wz_rad_per_s"), 2.0, 4.5);
    assert!(hz > 2.8 && hz < 3.5 && amplitude > 1e-5, "{hz} {amplitude}");
}
