//! Soft capture ring: kinematics both ways, stiffness and natural frequency in closed form, load control, momentum, energy.

use super::bench::{assert_close, job, run, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::capture_ring::{Ring, on_ring, push_ring, ring_at, settle_ring};
use softdock_kernels::metrics::flags;
use softdock_kernels::model::{Held, Hook, Latch, Model};
use softdock_kernels::outcome::Signals;
use softdock_kernels::params::Params;
use softdock_kernels::philox::uniform;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::stewart::{CaptureRing, LEGS, leg_jacobian, leg_lengths, pose_of_lengths, stewart_legs};
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};
use std::f64::consts::TAU;

const STIFFNESS: f64 = 3e3;
const MASS: f64 = 20.0;

/// A ring with its centre of mass in the origin, without damping, lag, limit and stops that are met.
fn ring() -> CaptureRing {
    CaptureRing {
        mass: MASS,
        inertia: Sym3::diagonal(vec3(3.0, 2.0, 2.0)),
        centre: Vec3::zero(),
        legs: stewart_legs([0.4, 0.5], [0.2, 0.15], [0.05, 0.4]),
        stiffness: STIFFNESS,
        damping: 0.0,
        force_limit: f64::INFINITY,
        lag: 0.0,
        strokes: [0.2, 0.2],
        stop_stiffness: 1e5,
    }
}

fn plant(ring: CaptureRing, substep: f64) -> Plant {
    Plant::new(Model { ring: Some(ring), ..two_bodies(substep, 1.0, 0.0) })
}

fn still(pose: Pose<f64>) -> Motion<f64> {
    Motion { position: pose.position, attitude: pose.attitude, velocity: Vec3::zero(), omega: Vec3::zero() }
}

/// A mount turned and displaced in the contact frame, and part A somewhere else.
fn parts() -> Parts<f64> {
    let attitude = Quat::from_rotation_vector(vec3(0.3, -0.2, 0.4));
    let b = still(Pose { position: vec3(0.1, -0.05, 0.2), attitude });
    Parts { a: still(Pose { position: vec3(-0.3, 0.1, 0.0), attitude: Quat::identity() }), b }
}

/// A pose within `way` \[m\] and `turn` \[rad\] of the start, by its number.
fn pose(number: u64, way: f64, turn: f64) -> Pose<f64> {
    let draw = |name: &str| 2.0 * uniform(5, name, number, 0) - 1.0;
    let vector = |names: [&str; 3], size: f64| vec3(draw(names[0]), draw(names[1]), draw(names[2])) * size;
    let attitude = Quat::from_rotation_vector(vector(["u", "v", "w"], turn));
    Pose { position: vector(["x", "y", "z"], way), attitude }
}

#[test]
fn forward_kinematics_invert_inverse_kinematics() {
    let legs = ring().legs;
    for number in 0..400 {
        let wanted = pose(number, 0.08, 0.15);
        let lengths = leg_lengths(&legs, wanted);
        let found = pose_of_lengths(&legs, &lengths, Pose::identity()).expect("a pose near the start");
        let turn = found.attitude.small_rotation_to(wanted.attitude).norm();
        assert!((found.position - wanted.position).norm() < 1e-9 && turn < 1e-9, "{number}: {found:?} of {wanted:?}");
    }
}

#[test]
fn leg_lengths_are_distances_of_the_joints() {
    // Joints by their own angles, rotated by a matrix written out here: turn about x, then about z.
    let (legs, way) = (ring().legs, vec3(0.03, -0.02, 0.05));
    let (roll, yaw) = (0.2_f64, -0.1_f64);
    let half = |angle: f64, axis: Vec3<f64>| Quat { w: (0.5 * angle).cos(), v: axis * (0.5 * angle).sin() };
    let attitude = half(yaw, vec3(0.0, 0.0, 1.0)).compose(half(roll, vec3(1.0, 0.0, 0.0)));
    let found = leg_lengths(&legs, Pose { position: way, attitude });
    for (leg, found) in found.into_iter().enumerate() {
        let sign = if leg % 2 == 0 { -1.0 } else { 1.0 };
        let middle = (leg / 2) as f64 * TAU / 3.0;
        let (on_ring, on_mount) = (middle + sign * 0.2, middle + sign * (TAU / 6.0 - 0.15));
        let [x, y, z] = [0.05, 0.4 * on_ring.cos(), 0.4 * on_ring.sin()];
        let [y, z] = [y * roll.cos() - z * roll.sin(), y * roll.sin() + z * roll.cos()];
        let [x, y] = [x * yaw.cos() - y * yaw.sin(), x * yaw.sin() + y * yaw.cos()];
        let gap = [x + way.x - 0.4, y + way.y - 0.5 * on_mount.cos(), z + way.z - 0.5 * on_mount.sin()];
        let length = gap.iter().map(|e| e * e).sum::<f64>().sqrt();
        assert!((found - length).abs() < 1e-12, "leg {leg}: {found} of {length}");
    }
}

#[test]
fn the_jacobian_has_the_slopes_of_the_lengths() {
    let legs = ring().legs;
    for number in 0..50 {
        let at = pose(number, 0.08, 0.15);
        let jacobian = leg_jacobian(&legs, at);
        let slopes = |axis: usize| jacobian.map(|leg| leg[axis]);
        for (axis, expected) in (0..6).map(|axis| (axis, slopes(axis))) {
            let unit = |k: usize| if k == axis { 1e-6 } else { 0.0 };
            let moved = |sign: f64| Pose {
                position: at.position + vec3(unit(0), unit(1), unit(2)) * sign,
                attitude: at.attitude.turned(vec3(unit(3), unit(4), unit(5)) * sign),
            };
            let (more, less) = (leg_lengths(&legs, moved(1.0)), leg_lengths(&legs, moved(-1.0)));
            for leg in 0..LEGS {
                let slope = (more[leg] - less[leg]) / 2e-6;
                assert!((slope - expected[leg]).abs() < 1e-9, "leg {leg}, axis {axis}");
            }
        }
    }
}

/// Wrench of the legs on the ring about part A's origin, mount's axes, with the ring displaced on its mount.
fn legs_wrench(of: CaptureRing, displaced: Pose<f64>) -> ([f64; 6], Ring<f64>) {
    let (plant, parts) = (plant(of, 1e-4), parts());
    let mut s = ring_at(&plant, &parts);
    let (mount, axes) = (parts.b, parts.b.attitude);
    s.body.com = mount.position + axes.rotate(displaced.position + displaced.attitude.rotate(of.centre));
    s.body.attitude = axes.compose(displaced.attitude);
    let next = push_ring(&plant, &s, &parts, Wrench::zero());
    let force = axes.rotate_back(next.back.force);
    // About the ring's origin.
    let to_ring = parts.a.position - (mount.position + axes.rotate(displaced.position));
    let moment = axes.rotate_back(next.back.moment + to_ring.cross(next.back.force));
    ([force.x, force.y, force.z, moment.x, moment.y, moment.z], next)
}

#[test]
fn a_displaced_ring_is_pushed_back_by_the_stiffness_of_its_legs() {
    let of = ring();
    let jacobian = leg_jacobian(&of.legs, Pose::identity());
    for axis in 0..6 {
        let small = 1e-7;
        let unit = |k: usize| if k == axis { small } else { 0.0 };
        let attitude = Quat::from_rotation_vector(vec3(unit(3), unit(4), unit(5)));
        let (found, _) = legs_wrench(of, Pose { position: vec3(unit(0), unit(1), unit(2)), attitude });
        for (row, found) in found.into_iter().enumerate() {
            // K = J^T k J; the legs have no force at the start, so that nothing else adds to it.
            let column = |row: usize| jacobian.iter().map(|leg| STIFFNESS * leg[row] * leg[axis]).sum::<f64>();
            let (expected, scale) = (-small * column(row), small * STIFFNESS);
            assert!((found - expected).abs() < 1e-5 * scale, "{row}, {axis}: {found} of {expected}");
        }
    }
}

#[test]
fn three_pairs_of_legs_have_the_stiffness_of_their_shares_along_the_axis() {
    let of = ring();
    let leg = of.legs[0];
    let share = (leg.mount.x - leg.ring.x) / leg.start_length();
    let (found, next) = legs_wrench(of, Pose { position: vec3(1e-6, 0.0, 0.0), attitude: Quat::identity() });
    assert_close("stiffness along x", -found[0] / 1e-6, 6.0 * STIFFNESS * share * share, 1e-5);
    assert!(found[1..].iter().all(|part| part.abs() < 1e-9), "{found:?}");
    assert_close("stroke", next.peak_stroke, 1e-6 * share, 1e-5);
}

#[test]
fn a_leg_stops_at_its_force_limit_and_then_at_its_stop() {
    let limited = CaptureRing { force_limit: 50.0, strokes: [0.03, 0.03], ..ring() };
    // Lengths that all legs have in common, along x: 20 mm and 40 mm shorter.
    for (way, beyond) in [(0.02, 0.0), (0.04, 0.01)] {
        let goal = limited.legs.map(|leg| leg.start_length() - way);
        let at = pose_of_lengths(&limited.legs, &goal, Pose::identity()).expect("a pose along x");
        let (_, next) = legs_wrench(limited, at);
        assert_close("force", next.peak_force, 50.0 + 1e5 * beyond, 1e-9);
        assert_close("stroke", next.peak_stroke, way, 1e-9);
        // Lengthened.
        let goal = limited.legs.map(|leg| leg.start_length() + way);
        let at = pose_of_lengths(&limited.legs, &goal, Pose::identity()).expect("a pose along x");
        let (wrench, next) = legs_wrench(limited, at);
        assert_close("force", next.peak_force, 50.0 + 1e5 * beyond, 1e-9);
        assert!(wrench[0] > 0.0, "long legs pull the ring towards the mount");
    }
}

#[test]
fn a_legs_force_follows_its_command_with_its_lag() {
    let (lag, substep) = (0.05, 1e-4);
    // So heavy that it stays where it is.
    let of = CaptureRing { lag, mass: 1e9, inertia: Sym3::diagonal(vec3(1e9, 1e9, 1e9)), ..ring() };
    let (plant, parts) = (plant(of, substep), parts());
    let mut s = ring_at(&plant, &parts);
    s.body.com = s.body.com + parts.b.attitude.rotate(vec3(1e-3, 0.0, 0.0));
    let at_once = self::plant(CaptureRing { lag: 0.0, ..of }, substep);
    let first = push_ring(&at_once, &s, &parts, Wrench::zero()).force[0];
    for step in 1..=1000 {
        s = push_ring(&plant, &s, &parts, Wrench::zero());
        let expected = first * (1.0 - (-f64::from(step) * substep / lag).exp());
        assert!((s.force[0] - expected).abs() < 2e-3 * first.abs(), "{step}: {} of {expected}", s.force[0]);
    }
}

/// Place of the ring along the mount's x axis after each substep, from a push on.
fn swing(of: CaptureRing, substep: f64, time: f64) -> Vec<f64> {
    let (plant, parts) = (plant(of, substep), parts());
    let mut s = ring_at(&plant, &parts);
    s.body.momentum = parts.b.attitude.rotate(vec3(of.mass * 1e-3, 0.0, 0.0));
    let mut out = Vec::new();
    for _ in 0..(time / substep) as usize {
        s = settle_ring(&plant, &push_ring(&plant, &s, &parts, Wrench::zero()));
        let b = on_ring(&plant, &s, &parts).b;
        out.push(parts.b.attitude.rotate_back(b.position - parts.b.position).x);
    }
    out
}

/// Frequency of the swing by its rising zeros, and the ratio of neighbouring peaks \[Hz, 1\].
fn observed(seen: &[f64], substep: f64) -> (f64, f64) {
    let rising = |i: &usize| seen[*i] < 0.0 && seen[i + 1] >= 0.0;
    let zeros: Vec<f64> =
        (0..seen.len() - 1).filter(rising).map(|i| (i as f64 + seen[i] / (seen[i] - seen[i + 1])) * substep).collect();
    let periods = (zeros.len() - 1) as f64;
    let peak = |from: f64, to: f64| {
        seen[(from / substep) as usize..(to / substep) as usize].iter().fold(0.0, |a: f64, b| a.max(*b))
    };
    (periods / (zeros[zeros.len() - 1] - zeros[0]), peak(zeros[1], zeros[2]) / peak(zeros[0], zeros[1]))
}

#[test]
fn the_natural_frequency_and_the_decrement_along_the_axis_are_those_of_the_closed_form() {
    let damping = 10.0;
    let leg = ring().legs[0];
    let share = (leg.mount.x - leg.ring.x) / leg.start_length();
    let (along, brake) = (6.0 * STIFFNESS * share * share, 6.0 * damping * share * share);
    let rate = (along / MASS).sqrt();
    let ratio = brake / (2.0 * MASS * rate);
    let seen = swing(CaptureRing { damping, ..ring() }, 1e-4, 2.0);
    let (frequency, decay) = observed(&seen, 1e-4);
    let root = (1.0 - ratio * ratio).sqrt();
    assert_close("frequency", frequency, rate * root / TAU, 5e-3);
    assert_close("decay of a period", decay, (-TAU * ratio / root).exp(), 5e-3);
}

/// Two free bodies whose part B rides on a ring, part A off the axis, with a latch of three hooks.
fn capture(substeps: u32) -> (Model, Params<f64>) {
    let mut model = two_bodies(2.5e-4 / f64::from(substeps) * 4.0, 3.0, 0.02);
    (model.timing.substeps, model.timing.max_ticks) = (substeps, 3000);
    model.ring =
        Some(CaptureRing { centre: vec3(0.02, 0.01, -0.015), damping: 80.0, force_limit: 400.0, lag: 4e-3, ..ring() });
    model.contact.a.points[0].position = vec3(0.0, 0.12, -0.05);
    let hook = |y: f64, z: f64| Hook { point: vec3(0.0, y, z), seat: vec3(0.0, y, z) };
    model.contact.latch = Some(Latch {
        point: Vec3::zero(),
        seat: Vec3::zero(),
        depth: 0.012,
        offset: 0.05,
        angle: 0.2,
        // Below the closing speed: it closes after the touch.
        speed: 0.06,
        hooks: vec![hook(0.3, 0.0), hook(-0.15, 0.26), hook(-0.15, -0.26)],
        hook_reach: 0.04,
    });
    let params = Params {
        base_mass: 400.0,
        target_mass: 700.0,
        base_inertia_scale: 60.0,
        target_inertia_scale: 120.0,
        closing_speed: 0.08,
        drift: vec3(0.0, 0.004, -0.003),
        chaser_rate: vec3(0.004, -0.003, 0.002),
        target_rate: vec3(0.0, 0.003, -0.002),
        contact_stiffness: 2e4,
        contact_damping: 60.0,
        contact_friction: 0.2,
        bristle_stiffness: 1e4,
        bristle_damping: 20.0,
        latch_stiffness: 2e4,
        latch_damping: 100.0,
        loop_delay: 3e-3,
        ..Params::null()
    };
    (model, params)
}

fn signals(model: Model, p: Params<f64>) -> Vec<Signals> {
    let mut seen = Vec::new();
    replay(&job(model, &[p]), RunInput::new(0, p), &mut |signals| seen.push(*signals));
    seen
}

#[test]
fn momenta_of_chaser_ring_and_target_hold_through_a_capture() {
    let (model, params) = capture(4);
    let row = &run(model, &[params])[0];
    for (side, seen) in [("space", row.space), ("facility", row.hil)] {
        assert!(seen.touch_time > 0.0 && seen.capture_time > seen.touch_time, "{side}: {seen:?}");
        assert!(seen.peak_leg_force > 20.0, "{side}: {} N", seen.peak_leg_force);
        // Of 32 kg m/s and some 60 kg m^2/s.
        assert!(seen.linear_momentum_error < 1e-9, "{side}: linear {}", seen.linear_momentum_error);
        assert!(seen.angular_momentum_error < 1e-9, "{side}: angular {}", seen.angular_momentum_error);
    }
    assert_eq!(row.flags & flags::INVALID, 0, "the legs' losses are no energy from nowhere");
}

#[test]
fn the_mount_of_a_held_target_takes_the_impulse_of_the_legs() {
    let (model, params) = capture(4);
    let held = Model { held: Held { target: true, ..Held::NONE }, ..model };
    let params = Params { target_rate: Vec3::zero(), ..params };
    let row = &run(held, &[params])[0];
    assert!(row.space.capture_time > 0.0);
    assert!(row.space.linear_momentum_error < 1e-9, "{}", row.space.linear_momentum_error);
    assert!(row.space.angular_momentum_error < 1e-9, "{}", row.space.angular_momentum_error);
}

#[test]
fn a_stiff_massless_ring_is_a_fixed_part() {
    // What a ring of a thousandth of the mass on hard legs does differs from part B on the target itself by little.
    let (model, params) = capture(40);
    let fixed = Model { ring: None, ..model.clone() };
    let hard = CaptureRing {
        mass: 0.3,
        inertia: Sym3::diagonal(vec3(0.05, 0.03, 0.03)),
        centre: Vec3::zero(),
        stiffness: 4e6,
        damping: 300.0,
        force_limit: f64::INFINITY,
        lag: 0.0,
        ..ring()
    };
    let rows = [Model { ring: Some(hard), ..model }, fixed].map(|model| run(model, &[params])[0].space);
    assert_close("impulse", rows[0].impulse, rows[1].impulse, 0.02);
    assert_close("time of capture", rows[0].capture_time, rows[1].capture_time, 0.01);
    assert_close("peak force", rows[0].first_contact_force, rows[1].first_contact_force, 0.02);
}

#[test]
fn energy_of_the_bodies_goes_into_legs_contact_and_latch() {
    // Without damping and latch the ring gives back what it took: the bodies part with the energy that they had.
    let (mut model, params) = capture(40);
    let mut bare = ring();
    (bare.centre, bare.mass) = (Vec3::zero(), 2.0);
    (model.ring, model.contact.latch) = (Some(bare), None);
    model.contact.a.points[0].position = Vec3::zero();
    let mut head_on = Params { contact_damping: 0.0, contact_friction: 0.0, drift: Vec3::zero(), ..params };
    (head_on.chaser_rate, head_on.target_rate) = (Vec3::zero(), Vec3::zero());
    let seen = signals(model.clone(), head_on);
    // The target has the momentum that the chaser has lost.
    let (chaser, target) = (head_on.base_mass, head_on.target_mass + bare.mass);
    let energy = |of: &Signals| {
        let a = of.parts[0].a.velocity.x;
        let b = (head_on.closing_speed - a) * (chaser / target);
        0.5 * (chaser * a * a + target * b * b)
    };
    let row = &run(model, &[head_on])[0];
    assert!(row.space.separation_time > 0.0, "it parts: {:?}", row.space);
    // The ring swings on its legs afterwards, with a share that its mass allows: 2 kg of 1100 kg.
    let (first, last) = (energy(&seen[0]), energy(&seen[seen.len() - 1]));
    assert!((last / first - 1.0).abs() < 0.03, "{last} J of {first} J");
}

#[test]
fn a_hook_that_fails_neither_closes_nor_holds() {
    let (model, params) = capture(4);
    let far = Latch { hook_reach: 1e-4, ..model.contact.latch.clone().expect("a latch") };
    let beyond = Model {
        contact: softdock_kernels::model::Contact { latch: Some(far), ..model.contact.clone() },
        ..model.clone()
    };
    assert!(run(beyond, &[params])[0].space.capture_time < 0.0, "no hook within a tenth of a millimetre");
    let rows = run(model.clone(), &[params, Params { latch_failed: 1.0, ..params }]);
    assert!(rows.iter().all(|row| row.space.capture_time > 0.0));
    assert!(rows[0].space.peak_latch_force != rows[1].space.peak_latch_force);
    // One hook out of reach keeps the latch open, unless it is the one that fails.
    let mut away = model;
    away.contact.latch.as_mut().expect("a latch").hooks[0].seat = vec3(0.0, 0.5, 0.0);
    let rows = run(away, &[params, Params { latch_failed: 1.0, ..params }]);
    assert!(rows[0].space.capture_time < 0.0 && rows[1].space.capture_time > 0.0, "{rows:?}");
}
