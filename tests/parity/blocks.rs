//! Blocks of the loop, replayed from recordings on the device, against their Rust text in f64.

use super::adapters;
use softdock_engine::blocks::{BlockKind, simulate};
use softdock_kernels::block::Recorded;
use softdock_kernels::block::body::{BodyValues, Hung};
use softdock_kernels::block::command::CommandValues;
use softdock_kernels::block::contact::ContactValues;
use softdock_kernels::block::controller::ControllerValues;
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::block::sensor::SensorValues;
use softdock_kernels::block::toss::TossValues;
use softdock_kernels::fields::to_vec;
use softdock_kernels::philox;
use softdock_kernels::vector::{Vec3, vec3};
use softdock_test_size::sized;

/// Every function of `wgsl/replay.wgsl`; all of them have a share in every number that is compared here.
pub(crate) const REPLAY_FRAME: [&str; 5] = ["lanes", "instants", "stride", "late_at", "replay"];

/// Parameter sets: more than a workgroup.
const SETS: u64 = 100;
const INSTANTS: usize = 2000;
/// Their distance \[s\].
const STEP: f64 = 5e-4;

/// Between 0 and 1, another for every name and set.
fn draw(name: &str, set: u64) -> f64 {
    philox::uniform(5, name, set, 0)
}

/// A swing of a joint: angle, rate and acceleration.
fn swing(t: f64) -> [f64; 3] {
    let omega = 9.0_f64;
    [(omega * t).sin() / omega, (omega * t).cos(), -omega * (omega * t).sin()]
}

/// The swing's recording, asked every eighth instant.
fn recorded(row: impl Fn(f64, [f64; 3]) -> Vec<f64>, late: impl Fn(f64, [f64; 3]) -> Vec<f64>) -> Recorded {
    let of = |make: &dyn Fn(f64, [f64; 3]) -> Vec<f64>| {
        (0..INSTANTS).flat_map(|i| make(i as f64 * STEP, swing(i as f64 * STEP))).collect()
    };
    Recorded { step: STEP, instants: INSTANTS, stride: 8, inputs: of(&row), late: of(&late), offsets: Vec::new() }
}

fn drives() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(
        |t, [q, v, a]| vec![q, v, a, 60.0 * q.cos(), 3.0 * a, 15.0, 8.0, 0.6, t, q - swing(t - STEP)[0]],
        |_, [q, v, a]| vec![28.0 * a + 30.0 * v + 20.0 * v.signum() + 60.0 * q.cos()],
    );
    let set = |i: u64| {
        to_vec(&DriveValues {
            motor_inertia: 10.0,
            coulomb: 20.0 * draw("coulomb", i),
            bristle_damping: 100.0 * draw("bristles", i),
            viscous: 30.0,
            stribeck: 8.0 * draw("stribeck", i),
            compliance: 1e-6 * draw("compliance", i),
            half_backlash: if i.is_multiple_of(3) { 2e-4 * draw("play", i) } else { 0.0 },
            gear_damping: 0.3,
            ripple_sin: 3.0 * draw("ripple", i),
            ripple_cycles: 40.0,
            payload: draw("payload", i),
            clock_offset: 2e-3 * (draw("clock", i) - 0.5),
            current_lag: 1e-3 * draw("current", i),
            ..DriveValues::null()
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

fn controllers() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(|_, [q, v, _]| vec![q, v], |_, [q, v, a]| vec![q, v, a, 20.0 * v.signum(), 30.0 * q]);
    let set = |i: u64| {
        to_vec(&ControllerValues {
            period: 5e-4,
            position_gain: 3e4,
            velocity_gain: 1e3,
            derivative_lag: 1.6e-3,
            delay: 5e-3 * draw("delay", i),
            lag: 5e-3 * draw("lag", i),
            clock_offset: 1e-3 * (draw("clock", i) - 0.5),
            clock_skew: 1e-3 * draw("skew", i),
            rate_limit: 0.5 + draw("limit", i),
            ..ControllerValues::null()
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

fn sensors() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(
        |t, [q, _, _]| vec![1.0, 2.0, -50.0 * q, 0.1, 0.2, 0.0, t],
        |t, [q, v, a]| {
            let wrench = [100.0 * q, -30.0 * v, 50.0 + a, 2.0 * q, v, 0.0];
            let bend = wrench.map(|c| -0.5 * (9.0 * 5e-4_f64).powi(2) * c);
            [&wrench[..], &bend, &[q, 1.0, -9.8, 0.0, v, t, a, 0.0, 1.0]].concat()
        },
    );
    let set = |i: u64| {
        let mut p = SensorValues {
            tool_mass: 5.0 + draw("mass", i),
            tool_centre: vec3(0.01, 0.0, 0.09),
            tool_inertia: vec3(0.02, 0.02, 0.015),
            bias_force: vec3(1.0, draw("bias", i), -1.0),
            drift_moment: vec3(0.0, 0.01 * draw("drift", i), 0.0),
            gain: 0.02 * draw("gain", i),
            lag: 2e-3 * draw("lag", i),
            delay: 2e-3 * draw("delay", i),
            resolution: if i.is_multiple_of(3) { 1.0 + draw("resolution", i) } else { 0.0 },
            blur: 0.5,
            range: 60.0 + 100.0 * draw("range", i),
            ..SensorValues::null()
        };
        (p.fx_of.force.z, p.my_of.force.x) = (0.02 * draw("crosstalk", i), 1e-3);
        to_vec(&p)
    };
    (recorded, (0..SETS).map(set).collect())
}

fn contacts() -> (Recorded, Vec<Vec<f64>>) {
    let recorded =
        recorded(|t, _| vec![t], |_, [q, v, _]| vec![0.1 * q, 5e-3 * v, 1e-2 * q, 0.1 * v, -0.4 * q, 1e-2 * v]);
    let set = |i: u64| {
        to_vec(&ContactValues {
            stiffness: 1e5,
            exponent: 1.0 + 0.5 * draw("exponent", i),
            damping: 200.0,
            damping_onset: 1e-5,
            depth_damping: 1e5 * draw("deep", i),
            friction: 0.3 * draw("friction", i),
            stribeck: 0.1 * draw("stribeck", i),
            anisotropy: 0.1 * draw("anisotropy", i),
            presliding_travel: 5e-5,
            surface: 1e-4 * (draw("surface", i) - 0.5),
            adhesion: 10.0 * draw("adhesion", i),
            fixture_compliance: if i.is_multiple_of(3) { 1e-6 * draw("fixture", i) } else { 0.0 },
            lag: 1e-3 * draw("lag of the force", i),
            clock_offset: 2e-3 * (draw("clock", i) - 0.5),
            ..ContactValues::null()
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

fn commands() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(|t, [_, v, _]| vec![1.0 / v.hypot(0.3), t], |_, [q, _, a]| vec![q, 0.5 * 5e-4 * 5e-4 * a]);
    let set = |i: u64| {
        to_vec(&CommandValues {
            transport_delay: 2e-3,
            delay: 5e-3 * draw("command's delay", i),
            clock_offset: 1e-3 * (draw("clock", i) - 0.5),
            clock_skew: 1e-3 * draw("skew", i),
            hold: 4e-3 + 2e-3 * draw("period", i),
            hold_phase: 4e-3 * draw("phase", i),
            hold_share: if i.is_multiple_of(3) { draw("hold", i) } else { 0.0 },
            blur: 1e-4,
            lag: 5e-3 * draw("lag", i),
            dead_band: if i.is_multiple_of(2) { 0.02 * draw("dead band", i) } else { 0.0 },
            position_offset: 0.02 * (draw("position offset", i) - 0.5),
            rate_limit: 0.5 + draw("limit", i),
            limit_lag: 1e-4 * draw("lag of the limit", i),
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

fn bodies() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(
        |t, [q, v, _]| vec![0.1 * q, 0.2 * v, 0.1, if t > 0.5 { 1.0 } else { 0.0 }],
        |_, [q, v, _]| vec![90.0 * v, 60.0, -300.0 * q, 20.0 * v, 5.0, 100.0 * q],
    );
    let set = |i: u64| {
        let slosh = Hung {
            mass: if i.is_multiple_of(3) { 30.0 * draw("slosh", i) } else { 0.0 },
            frequency: 0.3 + draw("frequency", i),
            damping: 0.02,
            place: vec3(0.1, 0.05, 0.3),
        };
        let place = vec3(2.5 * draw("boom", i), 0.0, 0.1);
        let appendage = Hung { mass: 3.0 * draw("appendage", i), frequency: 2.8, damping: 0.004, place };
        to_vec(&BodyValues {
            mass: 300.0,
            centre: vec3(0.02 * draw("centre", i), 0.0, 0.0),
            inertia: vec3(90.0, 110.0, 100.0),
            slosh,
            appendage,
            accelerometer_bias: vec3(0.0, 1e-3 * draw("accelerometer", i), 0.0),
            gyroscope_bias: vec3(0.0, 0.0, 1e-3 * draw("gyroscope", i)),
            clock_offset: 1e-3 * (draw("clock", i) - 0.5),
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

/// A cube that turns as it flies, is begun anew every eighth step, and strikes the plane with some of its corners.
fn tosses() -> (Recorded, Vec<Vec<f64>>) {
    let recorded = recorded(
        |t, [q, v, _]| {
            let begins = if ((t / 5e-4).round() as usize).is_multiple_of(8) { 1.0 } else { 0.0 };
            let (sin, cos) = (2.0 * q + 0.4).sin_cos();
            vec![
                begins,
                q,
                0.2,
                0.06 + 0.1 * q,
                cos,
                0.6 * sin,
                0.0,
                0.8 * sin,
                0.5 * v,
                0.1,
                -v.abs(),
                2.0,
                v,
                1.0,
                1.0,
                0.5,
            ]
        },
        |t, _| vec![t],
    );
    let set = |i: u64| {
        to_vec(&TossValues {
            mass: 0.37,
            inertia: Vec3::splat(8e-4),
            centre: vec3(1e-3 * draw("centre of a cube", i), 0.0, 0.0),
            half_width: 0.05,
            corner_radius: 5e-3 * draw("corner", i),
            gravity: vec3(0.0, 0.0, -9.81),
            drag: 0.1 * draw("air", i),
            stiffness: 5e3,
            hardening: 0.1 * draw("hardening", i),
            restitution: 0.3 + 0.5 * draw("restitution", i),
            depth_damping: 1e4 * draw("deep", i),
            friction: 0.3 * draw("friction", i),
            stribeck: 0.1 * draw("stribeck", i),
            stribeck_speed: 0.1,
            anisotropy: 0.1 * draw("anisotropy", i),
            rolling: 1e-3 * draw("rolling", i),
            surface: 1e-3 * (draw("surface", i) - 0.5),
            slope_x: 0.02 * draw("slope", i),
            ..TossValues::null()
        })
    };
    (recorded, (0..SETS).map(set).collect())
}

#[test]
fn block_on_the_device_matches_its_rust_function() {
    // f32 has 6e-8 of an angle of 0.1 rad, and 2000 steps; a gain of 3e4 N m/rad makes 1e-2 N m of that. What friction
    // and teeth decide at zero speed may fall half a step apart.
    // A reading of 100 N has 1e-5 N, a step's edge (1 N wide) up to four times that and the moments less; a depth of 1 mm
    // under 1e5 N/m has 1e-5 N, its rate and the bristles a hundred times as much.
    // A command of 0.1 rad over 0.3 rad/s has 2e-8 s, an edge of a hold (0.2 ms wide) 1e-3 of the 5 ms before it; rates of
    // 0.2 rad/s add up over 2000 steps. A place of 0.3 m has 3e-8 m, a corner's force 1e-4 N of it, which turns a cube of
    // 1e-3 kg m^2 within a segment by 1e-8 rad; the speed over which its spring changes is 2 mm/s.
    let cases = [
        (BlockKind::Drive, drives(), 3e-6),
        (BlockKind::Controller, controllers(), 0.1),
        (BlockKind::Sensor, sensors(), 3e-3),
        (BlockKind::Contact, contacts(), 0.3),
        (BlockKind::Command, commands(), 2e-5),
        (BlockKind::Body, bodies(), 1e-5),
        (BlockKind::Toss, tosses(), 1e-4),
    ];
    for gpu in adapters() {
        for (kind, (recorded, sets), allowed) in &cases {
            let exact = simulate(*kind, &[recorded], sets);
            let rounded = gpu.simulate(*kind, &[recorded], sets).expect("the device runs it");
            for (set, (a, b)) in exact[0].iter().zip(&rounded[0]).enumerate() {
                assert_eq!(a.len(), b.len());
                let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < *allowed && b.iter().any(|value| *value != 0.0), "{kind:?} set {set}: {apart:e}");
            }
        }
    }
}

/// One thread may fetch the answer for another; the device is not lost.
#[test]
fn device_serves_concurrent_threads() {
    let (whole, sets) = bodies();
    let beginning = |all: &[f64]| all[..all.len() / INSTANTS * 20].to_vec();
    let (inputs, late) = (beginning(&whole.inputs), beginning(&whole.late));
    let recorded = Recorded { instants: 20, inputs, late, ..whole };
    for gpu in adapters() {
        let ask = || gpu.simulate(BlockKind::Body, &[&recorded], &sets[..4]);
        let expected = ask().expect("the device runs it");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    (0..sized(250, 1000)).for_each(|_| assert!(ask().is_ok_and(|answer| answer == expected)))
                });
            }
        });
    }
}
