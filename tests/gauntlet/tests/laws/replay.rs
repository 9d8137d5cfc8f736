//! Completeness of the drive's model file: a simpler simulation from its text alone reproduces a healthy recording with
//! known nuisance parameters.

use crate::support::{Recording, distance, set};
use softdock_gauntlet::{Rig, fresh};

const RIG: Rig = Rig::Drive { link_encoder: false };
const SEED: u64 = 31;
/// Sample of the log and period of the controller \[s\], and substeps of the simulation in a period.
const SAMPLE: f64 = 0.004;
const PERIOD: f64 = 0.001;
const SUBSTEPS: usize = 16;

/// Angle, rate and acceleration at a time \[s\] from samples of the angle: a quintic between the two samples about it,
/// whose rates and accelerations come from five-point differences.
fn reference(samples: &[f64], time: f64) -> [f64; 3] {
    let place = time / SAMPLE;
    let knot = (place.floor() as usize).min(samples.len() - 2);
    let at = |i: i64| samples[(knot as i64 + i).clamp(0, samples.len() as i64 - 1) as usize];
    let first = |i: i64| (8.0 * (at(i + 1) - at(i - 1)) - at(i + 2) + at(i - 2)) / 12.0;
    let second = |i: i64| (16.0 * (at(i + 1) + at(i - 1)) - at(i + 2) - at(i - 2) - 30.0 * at(i)) / 12.0;
    let s = place - knot as f64;
    let (a, b, c) = (at(0), first(0), 0.5 * second(0));
    let (d0, d1, d2) = (at(1) - a - b - c, first(1) - b - 2.0 * c, second(1) - 2.0 * c);
    let (d, e, f) = (10.0 * d0 - 4.0 * d1 + 0.5 * d2, -15.0 * d0 + 7.0 * d1 - d2, 6.0 * d0 - 3.0 * d1 + 0.5 * d2);
    [
        a + s * (b + s * (c + s * (d + s * (e + s * f)))),
        (b + s * (2.0 * c + s * (3.0 * d + s * (4.0 * e + s * 5.0 * f)))) / SAMPLE,
        (2.0 * c + s * (6.0 * d + s * (12.0 * e + s * 20.0 * f))) / (SAMPLE * SAMPLE),
    ]
}

/// Returns a drawn nuisance parameter.
fn nuisance(name: &str) -> f64 {
    let truth = set(RIG, &[], SEED).truth;
    truth.nuisances.iter().find(|parameter| parameter.name == name).expect(name).value
}

/// Angles \[rad\] and torques \[N m\] at the samples: Dahl friction, semi-implicit steps.
fn simulate(samples: &[f64]) -> [Vec<f64>; 2] {
    let coulomb = 20.0 * nuisance("coulomb_factor");
    let viscous = 30.0 * nuisance("viscous_factor");
    let constant = nuisance("torque_constant_factor");
    let travel = 0.0002 * nuisance("presliding_travel_factor");
    let (offset, late) = (nuisance("offset"), nuisance("clock_offset") / PERIOD);
    let keep = (-std::f64::consts::TAU * 100.0 * PERIOD).exp();
    let (mut q, mut v, mut bristle) = (samples[0], 0.0_f64, 0.0_f64);
    let (mut filtered, mut last) = (0.0, q);
    let (mut angles, mut torques) = (Vec::new(), Vec::new());
    for tick in 0..samples.len() * 4 {
        let [r, rate, acceleration] = reference(samples, tick as f64 * PERIOD);
        filtered = keep * filtered + (1.0 - keep) * (q - last) / PERIOD;
        last = q;
        let feedforward = 25.0 * acceleration + 30.0 * rate + 20.0 * (rate / 0.02).tanh() + 60.0 * r.cos();
        let torque = 35_530.0 * (r - q) + 1319.0 * (rate - filtered) + feedforward;
        angles.push(q);
        torques.push(torque);
        let step = PERIOD / SUBSTEPS as f64;
        for _ in 0..SUBSTEPS {
            let friction = coulomb * bristle / travel + viscous * v;
            v += step * (constant * torque + offset - friction - 60.0 * q.cos()) / 25.0;
            // Exact for a constant rate over the step.
            let target = travel.copysign(v);
            bristle = target + (bristle - target) * (-v.abs() * step / travel).exp();
            q += step * v;
        }
    }
    let stamped = |tick: usize| {
        let other = if late >= 0.0 { tick + 1 } else { tick.max(1) - 1 };
        torques[tick] + late.abs() * (torques[other] - torques[tick])
    };
    let ticks = || (0..samples.len() - 1).map(|sample| 4 * sample);
    [ticks().map(|tick| angles[tick]).collect(), ticks().map(stamped).collect()]
}

#[test]
fn healthy_drive_matches_its_model_file() {
    let truth = Recording::read(&fresh(RIG, &[], SEED).expect("a motion").without_effect);
    let [angles, torques] = simulate(&truth.column("ref_rad"));
    // The five-point differences want neighbours: not at the ends.
    let inner = 3..angles.len() - 3;
    let apart = |own: &[f64], name: &str| distance(&own[inner.clone()], &truth.column(name)[inner.clone()]);
    let (angle, torque) = (apart(&angles, "q_rad"), apart(&torques, "tau_nm"));
    // Encoder: 5e-6 rad of noise and a quantum of 6e-6; torque channel: 1 N m. The rig's bristles have a damping.
    assert!(angle < 3e-6, "{angle:e} rad");
    assert!(torque < 0.25, "{torque} N m");
    // Without the nuisances it is not: the test can see the difference.
    assert!(apart(&angles, "ref_rad") > 3e-5);
}
