//! The sensor's block against closed forms.

use super::sensor::{SensorBlock, SensorLoad, SensorValues, tool_wrench};
use super::{Recorded, replay};
use crate::fields::{filled, to_vec};
use crate::space::Wrench;
use crate::vector::{Vec3, vec3};

const STEP: f64 = 1e-3;
const WRENCH: [f64; 6] = [30.0, -10.0, 200.0, 2.0, -5.0, 0.5];

fn wrench(c: [f64; 6]) -> Wrench<f64> {
    Wrench { force: vec3(c[0], c[1], c[2]), moment: vec3(c[3], c[4], c[5]) }
}

/// A load with a wrench and its second derivative.
fn load(c: [f64; 6], second: [f64; 6]) -> SensorLoad<f64> {
    let bend = wrench(second.map(|second| 0.5 * STEP * STEP * second));
    SensorLoad { wrench: wrench(c), bend, ..filled(0.0) }
}

/// Readings under a load over time, the nominal tool's wrench taken off.
fn readings(
    p: SensorValues<f64>,
    seconds: f64,
    tool: Wrench<f64>,
    load: impl Fn(f64) -> SensorLoad<f64>,
) -> Vec<[f64; 6]> {
    let instants = (seconds / STEP).round() as usize + 1;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for i in 0..instants {
        let t = i as f64 * STEP;
        inputs.extend(to_vec(&tool));
        inputs.push(t);
        late.extend(to_vec(&load(t)));
    }
    let recorded = Recorded { step: STEP, instants, stride: 1, inputs, late, offsets: Vec::new() };
    replay::<f64, SensorBlock>(&SensorBlock, &recorded, &p).chunks(6).map(|c| std::array::from_fn(|i| c[i])).collect()
}

/// The last reading of a second under a steady wrench.
fn steady(p: SensorValues<f64>) -> [f64; 6] {
    *readings(p, 1.0, filled(0.0), |_| load(WRENCH, [0.0; 6])).last().expect("instants")
}

fn near(a: [f64; 6], b: [f64; 6]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
}

#[test]
fn offsets_and_the_calibration_matrix_follow_their_laws() {
    let null = SensorValues::null();
    near(steady(null), WRENCH);
    let p = SensorValues { bias_force: vec3(1.0, 2.0, 3.0), drift_moment: vec3(0.0, 0.5, 0.0), ..null };
    near(steady(p), [31.0, -8.0, 203.0, 2.0, -4.5, 0.5]);
    near(steady(SensorValues { gain: 0.1, ..null }), WRENCH.map(|c| 1.1 * c));
    let mut p = null;
    (p.fx_of.force.z, p.fz_of.moment.y, p.my_of.force.x, p.mz_of.moment.z) = (0.01, 0.2, 0.003, -0.1);
    near(steady(p), [32.0, -10.0, 199.0, 2.0, -4.91, 0.45]);
}

#[test]
fn a_reading_comes_in_steps_that_noise_blurs_and_ends_at_its_range() {
    let null = SensorValues::null();
    let off_edges = [31.0, -9.0, 200.0, 2.0, -5.1, 0.5];
    let p = SensorValues { resolution: 4.0, blur: 1e-3, ..null };
    near(readings(p, 0.01, filled(0.0), |_| load(off_edges, [0.0; 6]))[5], [32.0, -8.0, 200.0, 2.0, -5.2, 0.4]);
    // Half a newton beyond the edge between 28 and 32 N, of a width of 2 N: three quarters of the way up.
    let mut late = WRENCH;
    late[0] = 30.5;
    let p = SensorValues { resolution: 4.0, blur: 1.0, ..null };
    let read = readings(p, 0.01, filled(0.0), |_| load(late, [0.0; 6]));
    assert!((read[5][0] - 31.0).abs() < 1e-9, "{:?}", read[5]);
    near(steady(SensorValues { resolution: 4.0, blur: 9.0, ..null }), WRENCH);
    near(steady(SensorValues { range: 40.0, ..null }), [30.0, -10.0, 40.0, 2.0, -4.0, 0.5]);
}

#[test]
fn a_parabola_comes_late_and_behind_a_low_pass_as_it_should() {
    let slopes = [3.0, -1.0, 20.0, 0.2, 0.5, -0.1];
    let parabola = |t: f64| load(slopes.map(|s| s * (t + 50.0 * t * t)), slopes.map(|s| 100.0 * s));
    let at = |t: f64| slopes.map(|s| s * (t + 50.0 * t * t));
    let read = readings(SensorValues { delay: 2.3e-3, ..SensorValues::null() }, 0.5, filled(0.0), parabola);
    near(read[400], at(0.4 - 2.3e-3));
    let early = SensorValues { clock_offset: -1.7e-3, ..SensorValues::null() };
    near(readings(early, 0.5, filled(0.0), parabola)[400], at(0.4 + 1.7e-3));
    // In the long run u - T u' + T^2 u''.
    let lag = 0.01;
    let read = readings(SensorValues { lag, ..SensorValues::null() }, 0.5, filled(0.0), parabola);
    near(read[400], slopes.map(|s| s * (0.4 + 8.0 - lag * 41.0 + lag * lag * 100.0)));
}

#[test]
fn a_heavier_tool_shows_with_gravity_and_with_motion() {
    let moving = SensorLoad {
        pull: vec3(1.0, -2.0, -9.0),
        rate: vec3(0.0, 0.0, 2.0),
        angular_acceleration: vec3(0.0, 3.0, 0.0),
        ..load(WRENCH, [0.0; 6])
    };
    let (centre, inertia) = (vec3(0.1, 0.0, 0.2), vec3(0.02, 0.03, 0.01));
    let tool = SensorValues { tool_mass: 5.0, tool_centre: centre, tool_inertia: inertia, ..SensorValues::null() };
    let nominal = tool_wrench(5.0, centre, inertia, &moving);
    near(readings(tool, 0.1, nominal, |_| moving)[50], WRENCH);
    let heavier = readings(SensorValues { tool_mass: 5.5, ..tool }, 0.1, nominal, |_| moving)[50];
    // Acceleration of the centre against the origin: (0, 3, 0) x c = (0.6, 0, -0.3), and -4 c towards the axis.
    let force = vec3(1.0 - 0.6 + 0.4, -2.0, -9.0 + 0.3) * 0.5;
    let moment = centre.cross(force);
    let added = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
    near(heavier, std::array::from_fn(|i| WRENCH[i] + added[i]));
    let turned = tool_wrench(0.0, Vec3::zero(), inertia, &moving);
    assert!((turned.moment.y + 0.03 * 3.0).abs() < 1e-12);
}

#[test]
fn null_effects_change_nothing() {
    let exotic = SensorValues { blur: 0.3, lever: 7.0, ..SensorValues::null() };
    assert_eq!(steady(SensorValues::null()), steady(exotic));
}
