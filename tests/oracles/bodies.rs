//! Free rigid bodies and arms against closed forms, and the momenta of base, arm and target.

use super::bench::{assert_close, at, closing, inertia, run, two_bodies};
use super::floating::Dense;
use super::lanes::six_joints;
use softdock_kernels::model::{Link, Model};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, Masses, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Vec3, vec3};

/// No wrench at all.
const NONE: Wrench<f64> = Wrench { force: vec3(0.0, 0.0, 0.0), moment: vec3(0.0, 0.0, 0.0) };

/// One free substep under joint torques.
fn drift<const N: usize>(m: &Plant, masses: Masses<f64>, s: Bodies<f64, N>, joint: [f64; N]) -> Bodies<f64, N> {
    let u = Actuation { braked: 0.0, thrust: Vec3::zero(), torque: Vec3::zero(), joint };
    settle(advance(m, &masses, &s, &kinematics(m, &masses, &s), &u, NONE))
}

#[test]
fn momentum_of_base_arm_and_target_holds_over_a_minute_of_contact_and_delay() {
    let mut model = six_joints(5e-4, 60.0);
    model.timing.substeps = 4;
    model.timing.max_ticks = 30_000;
    let params: Vec<_> = [2e-3, 5e-3]
        .map(|loop_delay| Params {
            base_mass: 400.0,
            target_mass: 300.0,
            loop_delay,
            target_rate: vec3(0.0, 0.02, -0.01),
            contact_friction: 0.2,
            bristle_stiffness: 5e3,
            ..closing(1.0, 0.06, 1e4, 30.0)
        })
        .to_vec();
    for row in run(model, &params) {
        // Of 24 kg m/s and some 10 kg m^2/s: rounding of 120,000 steps.
        for side in [row.space, row.hil] {
            assert!(side.touch_time > 0.0);
            assert!(side.linear_momentum_error < 24e-10, "linear {}", side.linear_momentum_error);
            assert!(side.angular_momentum_error < 10e-10, "angular {}", side.angular_momentum_error);
        }
    }
}

/// A base with one link in the plane, joint along z.
fn planar() -> (Plant, Masses<f64>) {
    let mut model = two_bodies(1e-3, 1.0, 1.0);
    model.base_inertia = inertia(6000.0, 6100.0, 6200.0);
    model.links = vec![Link {
        origin: at(1.2, 0.0, 0.0),
        mass: 140.0,
        com: vec3(1.0, 0.0, 0.0),
        inertia: inertia(50.0, 55.0, 60.0),
    }];
    model.start_angles = vec![0.0];
    let params = Params { base_mass: 2550.0, ..Params::null() };
    (Plant::new(model), space_masses(&params))
}

#[test]
fn a_planar_free_floating_arm_turns_its_base_as_the_closed_form() {
    let (m, masses) = planar();
    let mut s = start::<f64, 1>(&m, &Params { base_mass: 2550.0, ..Params::null() }, &masses);
    let reduced = 2550.0 * 140.0 / 2690.0;
    let (a, b, c): (f64, f64, f64) = (60.0 + reduced, reduced * 1.2, 6260.0 + reduced * (1.44 + 1.0));
    let root = f64::sqrt(c * c - 4.0 * b * b);
    let closed = |phi: f64| {
        let half = phi / 2.0;
        // The branch of atan that is continuous over a full turn.
        let inner = (((c - 2.0 * b) / (c + 2.0 * b)).sqrt() * half.sin()).atan2(half.cos());
        -(half + (2.0 * a - c) / root * inner)
    };
    assert_close("closed form at 1 rad", closed(1.0), -0.0476651546, 1e-9);
    let mut worst = 0.0f64;
    while s.arm.angle[0] < 6.2 {
        let torque = if s.arm.angle[0] < 1.0 { 40.0 } else { 0.0 };
        s = drift(&m, masses, s, [torque]);
        let turned = 2.0 * s.chaser.attitude.v.z.atan2(s.chaser.attitude.w);
        worst = worst.max((turned - closed(s.arm.angle[0])).abs());
    }
    assert!(worst < 1e-6, "base attitude off by {worst} rad");
}

/// Jacobi's sn, cn, dn and K by descending arithmetic-geometric means; `m` is the squared modulus.
fn jacobi(u: f64, m: f64) -> ([f64; 3], f64) {
    let (mut a, mut b, mut ladder) = (1.0f64, (1.0 - m).sqrt(), Vec::new());
    while (a - b).abs() > 1e-15 {
        let next = 0.5 * (a + b);
        ladder.push((next, 0.5 * (a - b)));
        b = (a * b).sqrt();
        a = next;
    }
    let mut phi = a * u * f64::from(1u32 << ladder.len());
    for (a, c) in ladder.iter().rev() {
        phi = 0.5 * (phi + (c / a * phi.sin()).asin());
    }
    let (sn, cn) = phi.sin_cos();
    ([sn, cn, (1.0 - m * sn * sn).sqrt()], std::f64::consts::FRAC_PI_2 / a)
}

#[test]
fn torque_free_body_tumbles_as_euler_and_poinsot() {
    let i = [1.0f64, 2.0, 3.0];
    let start_rate = vec3(0.3f64, 0.0, 1.0);
    let energy2 = i[0] * 0.09 + i[2];
    let moment2 = i[0] * i[0] * 0.09 + i[2] * i[2];
    let rate = ((i[2] - i[1]) * (moment2 - energy2 * i[0]) / (i[0] * i[1] * i[2])).sqrt();
    let modulus = (i[1] - i[0]) * (energy2 * i[2] - moment2) / ((i[2] - i[1]) * (moment2 - energy2 * i[0]));
    let middle = ((energy2 * i[2] - moment2) / (i[1] * (i[2] - i[1]))).sqrt();
    let period = 4.0 * jacobi(0.0, modulus).1 / rate;

    let mut model = two_bodies(2.5e-4, 1.0, 5.0);
    model.base_inertia = inertia(i[0], i[1], i[2]);
    model.target_inertia = model.base_inertia;
    let m = Plant::new(model);
    let params = Params { chaser_rate: start_rate, target_rate: start_rate, ..Params::null() };
    let masses = space_masses(&params);
    let mut s = start::<f64, 0>(&m, &params, &masses);
    let (mut worst, mut time) = ([0.0f64; 2], 0.0);
    while time < 3.0 * period {
        s = drift(&m, masses, s, []);
        time += m.timing.substep;
        let ([sn, cn, dn], _) = jacobi(rate * time, modulus);
        let exact = vec3(0.3 * cn, middle * sn, dn);
        for (worst, body) in worst.iter_mut().zip([&s.chaser, &s.target]) {
            let h = body.attitude.rotate_back(body.spin);
            let found = vec3(h.x / i[0], h.y / i[1], h.z / i[2]);
            *worst = worst.max((found - exact).norm());
        }
    }
    assert!(worst.iter().all(|w| *w < 1e-6), "body rates off by {worst:?} rad/s (chaser, target) in three periods");
}

/// Energy of a free six-joint arm after `time`, less the work of its joint torques, over the energy at the start.
fn energy_error(substep: f64, torque: f64) -> f64 {
    let model: Model = six_joints(substep, 1.0);
    let m = Plant::new(model);
    let params = Params { base_mass: 120.0, chaser_rate: vec3(0.1, 0.2, -0.15), ..Params::null() };
    let masses = space_masses(&params);
    let mut s = start::<f64, 6>(&m, &params, &masses);
    s.arm.rate = [0.3, -0.2, 0.4, 0.5, -0.6, 0.7];
    let first = Dense::new(&m, masses, &s).kinetic_energy();
    let (mut work, mut last) = (0.0, first);
    for step in 0..(10.0 / substep).round() as u32 {
        let before = s.arm.rate;
        let push: [f64; 6] = std::array::from_fn(|i| torque * (f64::from(step) * substep * (1.0 + i as f64)).cos());
        s = drift(&m, masses, s, push);
        work += (0..6).map(|i| push[i] * 0.5 * (before[i] + s.arm.rate[i]) * substep).sum::<f64>();
        last = Dense::new(&m, masses, &s).kinetic_energy();
    }
    (last - work - first) / first
}

#[test]
fn a_free_six_joint_arm_keeps_its_energy_and_takes_up_the_work_of_its_torques() {
    for torque in [0.0, 2.0] {
        let (coarse, fine) = (energy_error(5e-4, torque), energy_error(2.5e-4, torque));
        // Semi-implicit Euler is of first order: wrong accelerations would leave a rest at step zero.
        let rest = 2.0 * fine - coarse;
        assert!(fine.abs() < 2e-3, "energy off by {fine} at 0.25 ms");
        assert!(rest.abs() < 1e-5, "torque {torque}: energy off by {rest} at step zero ({coarse}, {fine})");
    }
}
