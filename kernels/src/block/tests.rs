//! The blocks against closed forms.

use super::controller::{ControllerBlock, ControllerValues};
use super::drive::{DriveBlock, DriveValues};
use super::{Block, Forms, Recorded, replay};
use crate::fields::{Bundle, to_vec};
use crate::lanes::{Lane, WIDTH, plain::PlainLanes};

/// Inertias of motor and link \[kg m^2\].
const MOTOR: f64 = 10.0;
const LINK: f64 = 15.0;

/// Recording of a motor whose angle, rate and acceleration are given over time, with a load and a torque.
fn driven(
    seconds: f64,
    step: f64,
    motion: impl Fn(f64) -> [f64; 3],
    load: impl Fn(f64) -> f64,
    torque: impl Fn(f64) -> f64,
) -> Recorded {
    let instants = (seconds / step).round() as usize + 1;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for i in 0..instants {
        let t = i as f64 * step;
        let [angle, rate, acceleration] = motion(t);
        let travel = angle - motion(t - step)[0];
        inputs.extend([angle, rate, acceleration, load(t), 0.0, LINK, 2.0, 0.5, t, travel]);
        late.push(torque(t));
    }
    Recorded { step, instants, stride: 1, inputs, late, offsets: Vec::new() }
}

/// Motor and link angle of a drive, sample by sample.
fn run(p: DriveValues<f64>, recorded: &Recorded) -> Vec<[f64; 2]> {
    let width = recorded.inputs.len() / recorded.instants;
    let measured = recorded.inputs.iter().step_by(width * recorded.stride);
    let outputs = replay::<f64, DriveBlock>(&DriveBlock, recorded, &p);
    let of = |(out, measured): (&[f64], &f64)| [out[0] + measured, out[0] + out[1] + measured];
    outputs.chunks(2).zip(measured).map(of).collect()
}

fn drive() -> DriveValues<f64> {
    DriveValues { motor_inertia: MOTOR, ..DriveValues::null() }
}

/// A swing of 0.3 rad with 1 Hz.
fn swing(t: f64) -> [f64; 3] {
    let omega = std::f64::consts::TAU;
    [0.3 * (omega * t).sin(), 0.3 * omega * (omega * t).cos(), -0.3 * omega * omega * (omega * t).sin()]
}

/// Simulates each parameter set alone and all of them as lanes of one vector: they must give the same.
pub(super) fn same_beside_others<B: Block>(block: &B, recorded: &Recorded, sets: &[B::Params<f64>; WIDTH]) {
    let fields: Vec<Vec<f64>> = sets.iter().map(to_vec).collect();
    let mut field = 0;
    let lanes = Bundle::read(&mut || {
        field += 1;
        PlainLanes::gather(|lane| fields[lane][field - 1])
    });
    let together = replay::<PlainLanes, B>(block, recorded, &lanes);
    for (lane, set) in sets.iter().enumerate() {
        let alone = replay::<f64, B>(block, recorded, set);
        let beside: Vec<f64> = together.iter().map(|all| all.lane(lane)).collect();
        assert_eq!(alone, beside, "set {lane}");
    }
}

/// The greatest distance between simulated and measured motor angle, were a torque of a drive's own law given.
fn departure(p: DriveValues<f64>, torque: impl Fn(f64, [f64; 3]) -> f64) -> f64 {
    furthest(p, &driven(3.0, 2e-4, swing, |_| 60.0, |t| torque(t, swing(t))))
}

/// How far a drive gets from the swing that was recorded.
fn furthest(p: DriveValues<f64>, recorded: &Recorded) -> f64 {
    let angle = |i: usize| swing(i as f64 * 2e-4)[0];
    run(p, recorded).iter().enumerate().map(|(i, out)| (out[0] - angle(i)).abs()).fold(0.0, f64::max)
}

/// Torque of inertias and load in a motion.
fn rigid([_, _, acceleration]: [f64; 3]) -> f64 {
    (MOTOR + LINK) * acceleration + 60.0
}

/// What a torque of 1 N m that is missing for long does to the angle: the observer's spring holds it.
const ONE: f64 = 1.0 / (25.0 * (20.0 * std::f64::consts::PI) * (20.0 * std::f64::consts::PI));

#[test]
fn a_drive_given_its_own_torque_moves_as_measured() {
    let none = departure(drive(), |_, m| rigid(m));
    assert!(none < 0.02 * ONE, "{none}");
    let p = DriveValues { viscous: 30.0, offset: 2.0, payload: 3.0, ..drive() };
    let mass = |m: [f64; 3]| 3.0 * (0.5 * m[2] + 2.0);
    assert!(departure(p, |_, m| rigid(m) + 30.0 * m[1] + mass(m) + 2.0) < 0.02 * ONE);
    let p = DriveValues { torque_constant_error: 0.25, inertia_error: 4.0, ..drive() };
    assert!(departure(p, |_, m| (rigid(m) + 4.0 * m[2]) / 1.25) < 0.02 * ONE);
    let p = DriveValues { ripple_sin: 3.0, ripple_cos: -1.0, ripple_cycles: 40.0, ..drive() };
    assert!(departure(p, |_, m| rigid(m) - 3.0 * (40.0 * m[0]).sin() + (40.0 * m[0]).cos()) < 0.02 * ONE);
    let p = DriveValues { cable_stiffness: 40.0, cable_centre: 0.1, gravity_cos: 5.0, gravity_sin: -3.0, ..drive() };
    let tied = |q: f64| 40.0 * (q - 0.1) + 5.0 * q.cos() - 3.0 * q.sin();
    assert!(departure(p, |_, m| rigid(m) + tied(m[0])) < 0.02 * ONE);
}

#[test]
fn every_form_of_the_dictionary_is_the_torque_that_it_says() {
    let none = drive().form;
    let form = Forms { drag_square: 20.0, drag_cube: 6.0, drag_even: -4.0, drag_slope: 9.0, ..none };
    let drag = |[q, v, _]: [f64; 3]| 20.0 * v * v.abs() + 6.0 * v * v * v - 4.0 * v * v + 9.0 * q * v;
    assert!(departure(DriveValues { form, ..drive() }, |_, m| rigid(m) + drag(m)) < 0.02 * ONE);
    let form = Forms { spring_square: 30.0, spring_cube: -80.0, ..none };
    let spring = |[q, _, _]: [f64; 3]| 30.0 * q * q - 80.0 * q * q * q;
    assert!(departure(DriveValues { form, ..drive() }, |_, m| rigid(m) + spring(m)) < 0.02 * ONE);
    // Dry friction turns with its direction, at once but for a step.
    let form = Forms { friction_slope: 1.0, friction_square: 4.0, ..none };
    let dry = |[q, v, _]: [f64; 3]| (q + 4.0 * q * q) * v.signum();
    let p = DriveValues { form, presliding_travel: 1e-7, ..drive() };
    assert!(departure(p, |_, m| rigid(m) + dry(m)) < 0.02 * ONE);
    let form = Forms { torque_square: 2e-4, ..none };
    // T - c T |T| = rigid, solved for T.
    let commanded = |m: [f64; 3]| {
        let whole = rigid(m);
        (1.0 - (1.0 - 4.0 * 2e-4 * whole.abs()).sqrt()) / 4e-4 * whole.signum()
    };
    assert!(departure(DriveValues { form, ..drive() }, |_, m| commanded(m)) < 0.02 * ONE);
}

#[test]
fn friction_acts_against_the_motion_and_falls_as_the_drive_warms_up() {
    let forwards = |t: f64| [t, 1.0, 0.0];
    let p = DriveValues { coulomb: 20.0, coulomb_asymmetry: 4.0, viscous: 30.0, ..drive() };
    let p = DriveValues { warm_loss: 0.5, warm_up: 2.0, ..p };
    let torque = |t: f64| 24.0 + 30.0 * (-0.5 * (1.0 - (-t / 2.0).exp())).exp();
    let out = run(p, &driven(1.0, 2e-4, forwards, |_| 0.0, torque));
    assert!(out.iter().enumerate().all(|(i, out)| (out[0] - i as f64 * 2e-4).abs() < 0.05 * ONE));
    let p = DriveValues { coulomb: 20.0, stribeck: 10.0, stribeck_speed: 0.5, load_coefficient: 0.1, ..drive() };
    let out = run(p, &driven(1.0, 2e-4, forwards, |_| 60.0, |_| 60.0 + 26.0 + 10.0 * (-2.0_f64).exp()));
    assert!(out.iter().enumerate().all(|(i, out)| (out[0] - i as f64 * 2e-4).abs() < 0.05 * ONE));
}

#[test]
fn friction_grows_with_the_load_and_with_as_much_of_the_acceleration_as_counts() {
    // Dry friction turns with its direction, at once but for a step.
    let p = DriveValues { coulomb: 1.0, load_coefficient: 0.01, presliding_travel: 1e-7, ..drive() };
    let friction = |share: f64, [_, v, a]: [f64; 3]| (1.0 + 0.01 * (60.0 + share * LINK * a).abs()) * v.signum();
    for share in [0.0, 1.0] {
        let p = DriveValues { load_inertial: share, ..p };
        assert!(departure(p, |_, m| rigid(m) + friction(share, m)) < 0.2 * ONE, "{share}");
        assert!(departure(p, |_, m| rigid(m) + friction(1.0 - share, m)) > 0.6 * ONE, "{share}");
    }
}

/// Taken for weight, what other axes put on a joint made its friction by load come out too small.
#[test]
fn the_other_axes_motion_loads_a_gear_as_its_own_does() {
    let p = DriveValues { coulomb: 1.0, load_coefficient: 0.01, presliding_travel: 1e-7, ..drive() };
    let coupled = |share: f64| {
        let friction = |[_, v, a]: [f64; 3]| (1.0 + 0.01 * (60.0 + share * 2.0 * LINK * a).abs()) * v.signum();
        let torque = |t| rigid(swing(t)) + LINK * swing(t)[2] + friction(swing(t));
        let mut recorded = driven(3.0, 2e-4, swing, |_| 60.0, torque);
        let width = recorded.inputs.len() / recorded.instants;
        recorded.inputs.chunks_mut(width).for_each(|inputs| inputs[4] = LINK * inputs[2]);
        recorded
    };
    for share in [0.0, 1.0] {
        let p = DriveValues { load_inertial: share, ..p };
        assert!(furthest(p, &coupled(share)) < 0.2 * ONE, "{share}");
        assert!(furthest(p, &coupled(1.0 - share)) > 0.6 * ONE, "{share}");
    }
}

#[test]
fn bristles_are_as_stiff_whatever_the_level() {
    // 20 N m over 1 mrad: at first 20 kN m/rad, also where friction is twice as high.
    let p = DriveValues { coulomb: 20.0, presliding_travel: 1e-3, coulomb_asymmetry: 20.0, ..drive() };
    let (motion, level) = (|t: f64| [1e-3 * t, 1e-3, 0.0], |t: f64| 40.0 * (1.0 - (-t * 20.0 / 40.0).exp()));
    let out = run(p, &driven(1.0, 2e-4, motion, |_| 0.0, level));
    assert!(out.iter().enumerate().all(|(i, out)| (out[0] - i as f64 * 2e-7).abs() < 0.05 * ONE));
}

#[test]
fn bristles_resist_while_they_bend() {
    // z = s (1 - exp(-v t / s)), so that z' falls from v to nothing while the bristles' torque comes.
    let p = DriveValues { coulomb: 20.0, presliding_travel: 1e-3, bristle_damping: 1000.0, ..drive() };
    let motion = |t: f64| if t < 0.1 { [0.0; 3] } else { [1e-3 * (t - 0.1), 1e-3, 0.0] };
    let torque = |t: f64| if t < 0.1 { 0.0 } else { 20.0 - 19.0 * (0.1 - t).exp() };
    let recorded = driven(3.0, 2e-4, motion, |_| 0.0, torque);
    let furthest = |p| {
        let out = run(p, &recorded);
        // From when the observer has brought the motor up to its rate.
        (1500..recorded.instants).map(|i| (out[i][0] - motion(i as f64 * 2e-4)[0]).abs()).fold(0.0, f64::max)
    };
    assert!(furthest(p) < 0.05 * ONE, "{}", furthest(p) / ONE);
    assert!(furthest(DriveValues { bristle_damping: 0.0, ..p }) > 0.5 * ONE);
}

#[test]
fn a_missing_torque_shows_as_the_observer_holds_it() {
    let recorded = driven(2.0, 2e-4, |_| [0.0; 3], |_| 60.0, |_| 61.0);
    let last = run(drive(), &recorded)[recorded.instants - 1];
    assert!((last[0] - ONE).abs() < 1e-3 * ONE, "{last:?}");
}

#[test]
fn a_torque_that_comes_late_or_lags_or_is_cut_is_as_good_as_the_one_that_acts() {
    let still = |torque: &dyn Fn(f64) -> f64| driven(0.5, 1e-3, |_| [0.0; 3], |_| 0.0, torque);
    let wave = |t: f64| 50.0 * (30.0 * t.max(0.0)).sin();
    let early = run(DriveValues { clock_offset: 0.003, ..drive() }, &still(&wave));
    let late = run(drive(), &still(&|t| wave(t - 0.003)));
    assert!(early.iter().zip(&late).all(|(a, b)| (a[0] - b[0]).abs() < 1e-12));
    let cut = run(DriveValues { torque_limit: 20.0, ..drive() }, &still(&wave));
    let small = run(drive(), &still(&|t| wave(t).clamp(-20.0, 20.0)));
    assert_eq!(cut, small);
    let lagged = run(DriveValues { current_lag: 0.01, ..drive() }, &still(&|t| 100.0 * t));
    let exact = run(drive(), &still(&|t| 100.0 * (t - 0.01 * (1.0 - (-t / 0.01).exp()))));
    assert!(lagged.iter().zip(&exact).all(|(a, b)| (a[0] - b[0]).abs() < 1e-12));
}

#[test]
fn an_encoder_behind_the_gear_may_tell_where_the_link_was() {
    let p = DriveValues { link_age: 0.003, link_zero: 0.2, ..drive() };
    let motion = |t: f64| [(2.0 * t).sin(), 2.0 * (2.0 * t).cos(), -4.0 * (2.0 * t).sin()];
    let out = run(p, &driven(2.0, 2e-4, motion, |_| 60.0, |t| rigid(motion(t))));
    let was = |i: usize| (2.0 * (i as f64 * 2e-4 - 0.003)).sin();
    assert!(out.iter().enumerate().all(|(i, out)| (out[1] - 0.2 - was(i)).abs() < 0.1 * ONE), "{:?}", out[5000]);
}

/// When a load jumps: it rises within the step that ends at 0.1 s, on the average half a step earlier \[s\].
const JUMP: f64 = 0.0999;

/// A drive at rest whose load jumps; its motor has moved by `moved` so long after.
fn jump(seconds: f64, from: f64, to: f64, moved: impl Fn(f64) -> [f64; 3]) -> Recorded {
    let load = move |t: f64| if t < JUMP { from } else { to };
    driven(seconds, 2e-4, |t| if t < JUMP { [0.0; 3] } else { moved(t - JUMP) }, load, move |_| from)
}

#[test]
fn an_elastic_gear_winds_up_by_its_load_and_swings_with_its_frequency() {
    let compliance = 1e-5;
    let p = DriveValues { compliance, gear_damping: 0.0, ..drive() };
    // Motor and link against one another, the load on the link alone; both together fall.
    let (reduced, share) = (MOTOR * LINK / (MOTOR + LINK), LINK / (MOTOR + LINK));
    let omega = 1.0 / (reduced * compliance).sqrt();
    let wound = 100.0 * compliance * reduced / LINK;
    let fall = -100.0 / (MOTOR + LINK);
    let motor = |t: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        let swing = [wound * (1.0 - cos), wound * omega * sin, wound * omega * omega * cos];
        [0.5 * fall * t * t + share * swing[0], fall * t + share * swing[1], fall + share * swing[2]]
    };
    let out = run(p, &jump(0.5, 60.0, 160.0, motor));
    assert!(
        out[..490].iter().all(|out| (out[0] - out[1] - 60.0 * compliance).abs() < 1e-7),
        "at rest load times compliance"
    );
    for i in [700, 1111, 2222] {
        let exact = 60.0 * compliance + wound * (1.0 - (omega * (i as f64 * 2e-4 - JUMP)).cos());
        let windup = out[i][0] - out[i][1];
        assert!((windup - exact).abs() < 1e-2 * 100.0 * compliance, "{windup} against {exact}");
    }
}

#[test]
fn a_loose_gear_falls_through_its_play() {
    let p = DriveValues { half_backlash: 1e-3, compliance: 1e-8, gear_damping: 0.5, ..drive() };
    let forwards = 30.0 / MOTOR;
    let recorded = jump(0.3, 30.0, -70.0, |t| [0.5 * forwards * t * t, forwards * t, forwards]);
    let out = run(p, &recorded);
    let windup = |i: usize| out[i][0] - out[i][1];
    // Free for 2e-3 rad: the motor goes on with 30 N m on 10 kg m^2, the link is pulled by 70 N m on 15 kg m^2.
    let met = (500..recorded.instants).find(|i| windup(*i) < -1e-3 + 1e-7).expect("the other flank");
    let apart = 70.0 / LINK - forwards;
    let time = met as f64 * 2e-4 - JUMP;
    assert!((time - (2.0_f64 * 2e-3 / apart).sqrt()).abs() < 4e-4, "{time}");
}

#[test]
fn a_transmission_error_moves_the_link_and_asks_for_torque() {
    let p = DriveValues { wave_sin: 1e-4, wave_cycles: 40.0, ..drive() };
    let wave = |t: f64| 1e-4 * (40.0 * t).sin();
    let out = run(p, &driven(1.0, 2e-4, |t| [t, 1.0, 0.0], |_| 0.0, |t| -LINK * 1600.0 * wave(t)));
    for i in [1000, 3333, 5000] {
        let t = i as f64 * 2e-4;
        assert!((out[i][1] - out[i][0] - wave(t)).abs() < 2e-6, "{:?}", out[i]);
        assert!((out[i][0] - t).abs() < 0.2 * ONE, "{:?}", out[i]);
    }
}

#[test]
fn a_gear_whose_ratio_waves_gives_what_it_takes() {
    let p = DriveValues { wave_sin: 1e-4, wave_cycles: 40.0, ..drive() };
    // The link's angle is g(q): the motor feels g'(q) times what turns the link.
    let motion = |t: f64| [0.3 * t * t, 0.6 * t, 0.6];
    let torque = |t: f64| {
        let [angle, rate, acceleration] = motion(t);
        let (sin, cos) = (40.0 * angle).sin_cos();
        let (slope, bend) = (1.0 + 1e-4 * 40.0 * cos, -1e-4 * 1600.0 * sin);
        MOTOR * acceleration + slope * (LINK * (slope * acceleration + bend * rate * rate) + 300.0)
    };
    let recorded = driven(2.0, 2e-4, motion, |_| 300.0, torque);
    let furthest = |p| {
        let out = run(p, &recorded);
        (1000..recorded.instants).map(|i| (out[i][0] - motion(i as f64 * 2e-4)[0]).abs()).fold(0.0, f64::max)
    };
    let without = furthest(DriveValues { wave_sin: 0.0, ..p });
    assert!(furthest(p) < 0.01 * without, "{} of {without}", furthest(p));
}

#[test]
fn a_reference_may_be_late_held_lagging_or_limited() {
    let instants = 2002;
    let late: Vec<f64> = (0..instants).flat_map(|i| [i as f64 * 1e-3, 1.0, 3.0, 0.0, 7.0]).collect();
    let recorded =
        Recorded { step: 1e-3, instants, stride: 1, inputs: vec![0.0; 2 * instants], late, offsets: Vec::new() };
    let asked = |p: ControllerValues<f64>| replay::<f64, ControllerBlock>(&ControllerBlock, &recorded, &p)[2000];
    let p = ControllerValues { period: 1e-3, position_gain: 100.0, ..ControllerValues::null() };
    assert!((asked(p) - 200.0).abs() < 1e-9);
    assert!((asked(ControllerValues { delay: 0.0123, ..p }) - 100.0 * (2.0 - 0.0123)).abs() < 1e-9);
    for offset in [-0.01, -3e-4, 3e-4] {
        let stamped = ControllerValues { clock_offset: offset, ..p };
        assert!((asked(stamped) - 100.0 * (2.0 + offset)).abs() < 1e-9, "asked for at another time than its stamp's");
    }
    assert!((asked(ControllerValues { clock_skew: 0.01, ..p }) - 100.0 * (2.0 - 0.02)).abs() < 1e-9, "grows with time");
    let held = ControllerValues { hold: 0.03, ..p };
    assert!((asked(held) - 100.0 * 1.98).abs() < 1e-6, "held since the 66th period");
    assert!((asked(ControllerValues { clock_offset: 3e-4, ..held }) - 100.0 * 1.98).abs() < 1e-6, "held all the same");
    let turning = ControllerValues { hold: 0.004, clock_offset: -3e-4, ..p };
    assert!((asked(turning) - 100.0 * (2.0 - 0.3 * 0.004)).abs() < 1e-6, "0.7 of what is new, 0.3 of what was held");
    assert!(
        (asked(ControllerValues { lag: 0.05, ..p }) - 100.0 * (2.0 - 0.05)).abs() < 1e-9,
        "behind by rate times lag"
    );
    let limited = ControllerValues { rate_limit: 0.5, ..p };
    assert!((asked(limited) - 100.0 - 7.0 * (1.0 - 2.0)).abs() < 0.2, "half the way, and the weight of that place");
    let ahead = ControllerValues { position_gain: 0.0, inertia: 2.0, viscous: 4.0, ..limited };
    assert!((asked(ahead) - 4.0 * 0.5 - 7.0 * (1.0 - 2.0)).abs() < 0.01, "at a constant rate of its own");
    let dry = ControllerValues { coulomb: 20.0, coulomb_speed: 0.4, ..p };
    assert!((asked(dry) - 200.0 - 20.0 * 2.5_f64.tanh()).abs() < 1e-9);
    assert!((asked(ControllerValues { torque_limit: 50.0, ..p }) - 50.0).abs() < 1e-9);
}

/// What a drive does not have is left out of its steps only where its neighbours have none either.
#[test]
fn a_drive_moves_the_same_whatever_drives_are_simulated_beside_it() {
    let base = DriveValues { coulomb: 20.0, presliding_travel: 1e-3, viscous: 5.0, bristle_damping: 3.0, ..drive() };
    let sets = [
        base,
        DriveValues { compliance: 2e-5, gear_damping: 0.1, load_coefficient: 0.1, ..base },
        DriveValues { half_backlash: 1e-4, load_coefficient: 0.1, ..base },
        DriveValues { ripple_sin: 3.0, ripple_cycles: 40.0, load_coefficient: 0.1, ..base },
        DriveValues { wave_cos: 1e-4, wave_cycles: 20.0, stribeck: 8.0, ..base },
        DriveValues { warm_loss: 0.5, warm_up: 10.0, ..base },
        DriveValues { cable_hysteresis: 4.0, gravity_sin: 6.0, ..base },
        DriveValues { current_lag: 2e-3, clock_offset: 1e-3, ..base },
    ];
    let recorded = driven(1.0, 5e-4, swing, |t| 60.0 + 20.0 * t, |t| 80.0 + rigid(swing(t)));
    same_beside_others(&DriveBlock, &recorded, &sets);
}

#[test]
fn null_effects_change_nothing() {
    let recorded = driven(0.5, 1e-3, swing, |_| 10.0, |t| 3.0 * t);
    let plain = DriveValues { coulomb: 20.0, viscous: 30.0, ..drive() };
    let exotic = DriveValues { ripple_cycles: 33.0, wave_cycles: 12.0, warm_up: 7.0, stribeck_speed: 0.5, ..plain };
    assert_eq!(run(plain, &recorded), run(exotic, &recorded));
}
