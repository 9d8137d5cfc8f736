//! The blocks against closed forms.

use super::controller::{Controller, ControllerValues};
use super::drive::{Drive, DriveValues};
use super::kernel::kernel;
use super::{Recorded, replay};

/// Recording of a motor whose angle, rate and acceleration are given over time, with a torque.
fn driven(
    seconds: f64,
    step: f64,
    motion: impl Fn(f64) -> [f64; 3],
    carried: f64,
    torque: impl Fn(f64) -> f64,
) -> Recorded {
    let instants = (seconds / step).round() as usize + 1;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for i in 0..instants {
        let t = i as f64 * step;
        let [angle, rate, acceleration] = motion(t);
        inputs.extend([angle, rate, acceleration, carried, 15.0, 1.0, t]);
        late.push(torque(t));
    }
    Recorded { step, instants, stride: 1, inputs, late }
}

/// Missing torque and lag angle of a drive, sample by sample.
fn run(p: DriveValues<f64>, recorded: &Recorded) -> Vec<[f64; 2]> {
    replay::<f64, Drive>(&Drive, recorded, &p).chunks(2).map(|out| [out[0], out[1]]).collect()
}

#[test]
fn a_rigid_drive_asks_for_inertia_friction_and_load() {
    let p = DriveValues { motor_inertia: 10.0, coulomb: 20.0, viscous: 30.0, offset: 2.0, ..DriveValues::null() };
    let out = run(p, &driven(1.0, 1e-3, |t| [t, 1.0 + t, 1.0], 60.0, |_| 5.0));
    // At t = 1 s: rotor 10, friction 20 + 30 x 2, load 60, offset 2, less the 5 that it was told.
    let last = out[1000];
    assert!((last[0] - (10.0 + 20.0 + 60.0 + 60.0 + 2.0 - 5.0)).abs() < 1e-6, "{last:?}");
    assert!(last[1].abs() < 1e-9);
}

#[test]
fn a_torque_that_comes_late_is_that_of_before() {
    let p = DriveValues { clock_offset: 2.5e-3, ..DriveValues::null() };
    let out = run(p, &driven(0.1, 1e-3, |_| [0.0; 3], 0.0, |t| 1000.0 * t));
    assert!((out[50][0] + (50.0 - 2.5)).abs() < 1e-9, "{:?}", out[50]);
    assert!(out[1][0].abs() < 1e-9, "before the recording its first value held");
}

#[test]
fn an_elastic_gear_lags_by_its_load_and_swings_with_its_frequency() {
    let compliance = 1e-5;
    let p = DriveValues { compliance, gear_damping: 0.0, ..DriveValues::null() };
    let still = run(p, &driven(0.2, 1e-3, |_| [0.0; 3], 60.0, |_| 0.0));
    assert!(
        still.iter().all(|out| (out[1] + 60.0 * compliance).abs() < 1e-9),
        "at rest the windup is load times compliance"
    );
    // A step of the load: carried jumps from 60 to 160 at 0.1 s.
    let step = 2e-4;
    let mut jump = driven(0.5, step, |_| [0.0; 3], 60.0, |_| 0.0);
    (500..jump.instants).for_each(|i| jump.inputs[7 * i + 3] = 160.0);
    let out = run(p, &jump);
    let omega = 1.0 / (15.0_f64 * compliance).sqrt();
    for i in [700, 1111, 2222] {
        // The load rises within the step that ends at instant 500: on the average half a step earlier.
        let t = (i as f64 - 499.5) * step;
        let exact = -compliance * (60.0 + 100.0 * (1.0 - (omega * t).cos()));
        assert!((out[i][1] - exact).abs() < 2e-3 * 100.0 * compliance, "{} against {exact}", out[i][1]);
    }
}

#[test]
fn a_loose_gear_falls_through_its_play() {
    let p = DriveValues { half_backlash: 1e-3, compliance: 1e-8, gear_damping: 0.5, ..DriveValues::null() };
    let step = 2e-4;
    let mut jump = driven(0.2, step, |_| [0.0; 3], 30.0, |_| 0.0);
    (500..jump.instants).for_each(|i| jump.inputs[7 * i + 3] = -30.0);
    let out = run(p, &jump);
    // Free for 2e-3 rad under 30 N m on 15 kg m^2: sqrt(2 x 2e-3 / 2) s.
    let met = (500..jump.instants).find(|i| out[*i][1] > 1e-3 - 1e-7).expect("the other flank");
    let time = (met as f64 - 499.5) * step;
    assert!((time - (2.0_f64 * 2e-3 / 2.0).sqrt()).abs() < 2.0 * step, "{time}");
    assert!(out[(500 + met) / 2][0].abs() < 1e-9, "no torque in the play");
    assert!((out[jump.instants - 1][0] + 30.0).abs() < 0.1, "{:?}", out[jump.instants - 1]);
}

#[test]
fn ripple_and_transmission_error_come_back_with_the_angle() {
    let p = DriveValues { ripple_sin: 3.0, ripple_cycles: 40.0, ..DriveValues::null() };
    let out = run(p, &driven(1.0, 1e-3, |t| [t, 1.0, 0.0], 0.0, |_| 0.0));
    assert!((out[777][0] + 3.0 * (40.0_f64 * 0.777).sin()).abs() < 1e-9);
    let p = DriveValues { wave_sin: 1e-4, wave_cycles: 40.0, ..DriveValues::null() };
    let out = run(p, &driven(1.0, 1e-3, |t| [t, 1.0, 0.0], 0.0, |_| 0.0));
    let wave = 1e-4 * (40.0_f64 * 0.777).sin();
    assert!((out[777][1] - wave).abs() < 1e-8, "link angle");
    assert!(
        (out[777][0] + 15.0 * 1600.0 * wave).abs() < 0.02,
        "torque goes with the square of the speed: {}",
        out[777][0]
    );
}

#[test]
fn a_current_loop_lags_and_a_limit_cuts() {
    let p = DriveValues { current_lag: 0.01, torque_limit: 80.0, ..DriveValues::null() };
    let out = run(p, &driven(0.05, 1e-3, |_| [0.0; 3], 0.0, |t| if t < 1e-9 { 0.0 } else { 100.0 }));
    assert!((out[10][0] + 80.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{:?}", out[10]);
}

#[test]
fn warm_up_cable_and_payload_follow_their_laws() {
    let cold = DriveValues { coulomb: 20.0, cold_friction: 0.5, warm_up: 2.0, ..DriveValues::null() };
    let out = run(cold, &driven(1.0, 1e-3, |t| [t, 1.0, 0.0], 0.0, |_| 0.0));
    assert!((out[1000][0] - 20.0 * (1.0 + 0.5 * (-0.5_f64).exp())).abs() < 1e-9);
    let cable = DriveValues { cable_stiffness: 4.0, cable_centre: 0.5, payload: 3.0, ..DriveValues::null() };
    let out = run(cable, &driven(1.0, 1e-3, |t| [t, 1.0, 0.0], 0.0, |_| 0.0));
    assert!((out[1000][0] - (4.0 * 0.5 + 3.0)).abs() < 1e-9, "spring and a payload of 1 N m a kilogram");
}

#[test]
fn a_reference_may_be_late_held_lagging_or_limited() {
    let instants = 2001;
    let late: Vec<f64> = (0..instants).flat_map(|i| [i as f64 * 1e-3, 1.0, 0.0, 0.0]).collect();
    let recorded = Recorded { step: 1e-3, instants, stride: 1, inputs: vec![0.0; instants], late };
    let asked = |p: ControllerValues<f64>| replay::<f64, Controller>(&Controller, &recorded, &p)[2000];
    let p = ControllerValues { position_gain: 100.0, ..ControllerValues::null() };
    assert!((asked(p) - 200.0).abs() < 1e-9);
    assert!((asked(ControllerValues { delay: 0.0123, ..p }) - 100.0 * (2.0 - 0.0123)).abs() < 1e-9);
    assert!((asked(ControllerValues { clock_skew: 0.01, ..p }) - 100.0 * (2.0 - 0.02)).abs() < 1e-9, "grows with time");
    assert!((asked(ControllerValues { hold: 0.03, ..p }) - 100.0 * 1.98).abs() < 1e-6, "held since the 66th period");
    assert!(
        (asked(ControllerValues { lag: 0.05, ..p }) - 100.0 * (2.0 - 0.05)).abs() < 0.06,
        "behind by rate times lag"
    );
    assert!((asked(ControllerValues { rate_limit: 0.5, ..p }) - 100.0).abs() < 0.2, "half the way");
    assert!((asked(ControllerValues { torque_limit: 50.0, ..p }) - 50.0).abs() < 1e-9);
}

#[test]
fn null_effects_change_nothing_and_the_kernels_are_whole() {
    let recorded = driven(0.5, 1e-3, |t| [t.sin(), t.cos(), -t.sin()], 10.0, |t| 3.0 * t);
    let plain = DriveValues { motor_inertia: 10.0, coulomb: 20.0, viscous: 30.0, ..DriveValues::null() };
    let exotic = DriveValues { ripple_cycles: 33.0, wave_cycles: 12.0, warm_up: 7.0, stribeck_speed: 0.5, ..plain };
    assert_eq!(run(plain, &recorded), run(exotic, &recorded));
    for text in [kernel(&Drive, 1e-3), kernel(&Controller, 1e-3)] {
        for name in ["lateness", "start", "advance", "output", "replay", "input_at", "params_of", "put_output"] {
            assert_eq!(text.matches(&format!("fn {name}(")).count(), 1, "{name}");
        }
    }
}
