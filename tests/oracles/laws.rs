//! Contact laws in the loop in space: exact restitutions, Hertz, an oblique sphere, a block on an incline.

use super::bench::{assert_close, at, closing, inertia, job, run, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::contact::space_pairs;
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::{ContactPoint, Model, NormalLaw};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Parts, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Vec3, vec3};

/// Bounces of a reduced mass of 50 kg at 0.1 m/s, steps of 10 us: the damper sees the speed half a step late.
fn bounces(law: NormalLaw, params: &[Params<f64>]) -> Vec<Finished> {
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    model.contact.law = law;
    model.task.end_after_separation = 2e-3;
    run(model, params)
}

#[test]
fn rate_dependent_springs_return_the_exact_speed() {
    let table = [(0.1, 0.937475580), (0.5, 0.748434932), (1.0, 0.593624260), (2.0, 0.410719686), (5.0, 0.196980245)];
    for (exponent, stiffness) in [(1.0, 5e4), (1.5, 9e5)] {
        let params = table.map(|(d, _)| Params { contact_dissipation: d / 0.1, ..closing(50.0, 0.1, stiffness, 0.0) });
        for ((d, exact), row) in table.into_iter().zip(bounces(NormalLaw::Power { exponent }, &params)) {
            assert_close(&format!("n = {exponent}, D = {d}"), row.space.restitution, exact, 1e-3);
        }
    }
}

#[test]
fn hertzian_impact_has_duration_and_depth_of_hertz() {
    let (mass, speed, stiffness): (f64, f64, f64) = (50.0, 0.1, 9e5);
    let row = bounces(NormalLaw::Power { exponent: 1.5 }, &[closing(mass, speed, stiffness, 0.0)])[0];
    let depth = (5.0 * mass * speed * speed / (4.0 * stiffness)).powf(0.4);
    assert_close("depth", row.space.peak_depth, depth, 1e-3);
    assert_close("duration", row.space.contact_duration, 2.94328 * depth / speed, 1e-3);
    assert_close("force", row.space.peak_contact_force, stiffness * depth.powf(1.5), 1e-3);
}

#[test]
fn a_spring_and_damper_that_cannot_pull_returns_the_closed_form() {
    let table = [
        (0.05, 0.858758),
        (0.1, 0.744079),
        (0.2, 0.571740),
        (0.4, 0.363527),
        (0.6, 0.248841),
        (0.8, 0.179783),
        (0.95, 0.144813),
        (1.5, 0.0755883),
    ];
    let params = table.map(|(zeta, _)| closing(50.0, 0.1, 5e4, 2.0 * zeta * (50.0f64 * 5e4).sqrt()));
    for ((zeta, exact), row) in table.into_iter().zip(bounces(NormalLaw::Linear, &params)) {
        assert_close(&format!("zeta = {zeta}"), row.space.restitution, exact, 2e-3);
    }
}

/// Tangential speed and spin times radius of a solid unit sphere after an oblique impact at normal speed 1 with e = 0.8.
fn oblique(friction: f64, tangential: f64) -> (f64, f64) {
    let radius = 0.5;
    let mut model = two_bodies(5e-6, 0.05, radius + 1e-4);
    model.contact.law = NormalLaw::Power { exponent: 1.0 };
    model.contact.a.points[0].radius = radius;
    let own = 0.4 * radius * radius;
    model.base_inertia = inertia(own, own, own);
    let params = Params {
        base_mass: 1.0,
        target_mass: 1e9,
        target_inertia_scale: 1e9,
        drift: vec3(0.0, tangential, 0.0),
        contact_dissipation: 0.37315,
        contact_friction: friction,
        // Stiff and damped against the normal spring: nearly the rigid body of the closed form.
        bristle_stiffness: 4e6,
        bristle_damping: 2e3,
        ..closing(1.0, 1.0, 1e4, 0.0)
    };
    let mut last = None;
    replay(&job(model, &[params]), RunInput::new(0, params), &mut |signals| last = Some(signals.parts[0].a));
    let motion = last.expect("at least one tick");
    (motion.velocity.y, motion.omega.z * radius)
}

#[test]
fn an_oblique_sphere_slides_or_sticks_as_a_rigid_one() {
    // Sticks: v' = 5 v / 7, and the contact point stands. The plane looks to -x, so the spin is about z.
    let (speed, spin) = oblique(0.1, 0.5);
    assert_close("sticking speed", speed, 0.357143, 1e-2);
    assert_close("sticking spin", spin.abs(), 0.357143, 1e-2);
    // Slides throughout: dv = mu (1 + e) v_n, r dw = 5/2 of it.
    let (speed, spin) = oblique(0.1, 1.0);
    assert_close("sliding speed", speed, 1.0 - 0.18, 1e-2);
    assert_close("sliding spin", spin.abs(), 0.45, 1e-2);
}

/// A block of 10 kg on four points, on a plane that leans 20 degrees; friction 0.5 would hold 26.
fn block() -> (Model, Params<f64>) {
    let mut model = two_bodies(2.5e-4, 101.0, 0.05);
    model.tool = at(0.05, 0.0, 0.0);
    model.base_pose = at(-0.05, 0.0, 0.0);
    let corner = |y: f64, z: f64| ContactPoint { position: vec3(0.0, y, z), radius: 0.0 };
    model.contact.a.points = vec![corner(0.1, 0.1), corner(0.1, -0.1), corner(-0.1, 0.1), corner(-0.1, -0.1)];
    model.base_inertia = inertia(0.07, 0.04, 0.04);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    model.field = vec3(9.81 * cos, 9.81 * sin, 0.0);
    let params = Params {
        base_mass: 10.0,
        target_mass: 1e9,
        target_inertia_scale: 1e9,
        contact_friction: 0.5,
        bristle_stiffness: 1e5,
        bristle_damping: 200.0,
        contact_stiffness: 1e5,
        contact_damping: 200.0,
        ..Params::null()
    };
    (model, params)
}

#[test]
fn a_block_below_the_friction_angle_stands_for_a_hundred_seconds() {
    let (mut model, params) = block();
    model.timing.substeps = 4;
    model.timing.max_ticks = 101_000;
    let mut places = Vec::new();
    replay(&job(model, &[params]), RunInput::new(0, params), &mut |signals| {
        places.push(signals.parts.map(|parts| parts.a.position - parts.b.position));
    });
    for side in 0..2 {
        let creep = places[1000..].iter().map(|p| (p[side] - places[1000][side]).norm()).fold(0.0, f64::max);
        assert!(creep < 1e-6, "loop {side} creeps {creep} m");
    }
}

#[test]
fn a_block_stands_also_while_its_weight_ripples_by_ten_percent() {
    let (model, p) = block();
    let m = Plant::new(model);
    let (masses, pairs) = (space_masses(&p), space_pairs(&m, &p));
    let mut bodies = start::<f64, 0>(&m, &p, &masses);
    let mut states = vec![filled(0.0); m.contacts.len()];
    let weight = p.base_mass * m.field.x;
    let (mut stood, mut creep) = (Vec3::zero(), 0.0f64);
    for step in 0..404_000 {
        let k = kinematics(&m, &masses, &bodies);
        let time = f64::from(step) * m.timing.substep;
        let Parts { a, b } = k.parts;
        let gap = a.position - b.position;
        if step == 4000 {
            stood = gap;
        } else if step > 4000 {
            creep = creep.max((gap.y - stood.y).abs() - 1e-12);
        }
        let touch = touch_points(&m, &pairs, &k.parts, &mut states, true);
        let ripple = 0.1 * weight * (std::f64::consts::TAU * 7.3 * time).sin();
        let u = Actuation { braked: 0.0, thrust: vec3(ripple, 0.0, 0.0), torque: Vec3::zero(), joint: [] };
        bodies = settle(advance(&m, &masses, &bodies, &k, &u, touch.wrench));
    }
    // The ripple rocks the block about its tilted equilibrium; what counts is that it does not walk.
    assert!(creep < 1e-6, "creeps {creep} m");
}
