//! Free bodies against an independent engine: tumbling, and an off-centre collision without friction.

#[path = "../oracles/scenes.rs"]
mod scenes;

use rapier3d::prelude::*;
use scenes::{at, closing, inertia, two_bodies};
use softdock_kernels::frame::{Batch, Tile};
use softdock_kernels::model::{ContactPoint, Model, Shape, Solid};
use softdock_kernels::outcome::Signals;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::{Vec3, vec3};

fn vector(v: Vec3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Inertias of the two bodies \[kg m^2\].
const INERTIAS: [[f64; 3]; 2] = [[3.0, 5.0, 7.0], [20.0, 12.0, 16.0]];

/// A free body with a ball on it.
struct Free {
    position: Vec3<f64>,
    velocity: Vec3<f64>,
    rate: Vec3<f64>,
    mass: f64,
    inertia: [f64; 3],
    /// Centre of the ball from the centre of mass \[m\].
    ball: Vec3<f64>,
}

/// Radius of the balls \[m\].
const RADIUS: f64 = 0.5;

/// Free bodies whose balls collide without friction or loss, after some steps.
fn world(bodies: &[Free], step: f64, steps: u32) -> Vec<RigidBody> {
    let (mut set, mut colliders) = (RigidBodySet::new(), ColliderSet::new());
    let handles: Vec<_> = bodies
        .iter()
        .map(|free| {
            let [x, y, z] = free.inertia;
            let own = MassProperties::new(Vector::ZERO, free.mass, Vector::new(x, y, z));
            let body = RigidBodyBuilder::dynamic()
                .translation(vector(free.position))
                .linvel(vector(free.velocity))
                .angvel(vector(free.rate))
                .additional_mass_properties(own)
                .gyroscopic_forces_enabled(true)
                .can_sleep(false);
            let handle = set.insert(body);
            let shape = ColliderBuilder::ball(RADIUS)
                .translation(vector(free.ball))
                .density(0.0)
                .friction(0.0)
                .restitution(1.0);
            colliders.insert_with_parent(shape, handle, &mut set);
            handle
        })
        .collect();
    let parameters = IntegrationParameters { dt: step, ..Default::default() };
    let mut pipeline = PhysicsPipeline::new();
    let (mut islands, mut broad, mut narrow) = (IslandManager::new(), BroadPhaseBvh::new(), NarrowPhase::new());
    let (mut joints, mut multi, mut ccd) = (ImpulseJointSet::new(), MultibodyJointSet::new(), CCDSolver::new());
    let mut soft = SoftBodySet::new();
    for _ in 0..steps {
        pipeline.step(
            Vector::ZERO,
            &parameters,
            &mut islands,
            &mut broad,
            &mut narrow,
            &mut set,
            &mut colliders,
            &mut joints,
            &mut multi,
            &mut soft,
            &mut ccd,
            &(),
            &(),
        );
    }
    handles.iter().map(|handle| set[*handle].clone()).collect()
}

/// The last signals of one run.
fn last(model: Model, params: Params<f64>) -> Signals {
    let (plant, batch) = (Plant::new(model), Batch { noisy: false, ..Batch::whole() });
    let mut tile = Tile::<f64, 0>::new(&plant, batch);
    tile.load(&plant, &[(0, 0, params)]);
    let mut finished = Vec::new();
    while finished.is_empty() {
        tile.step(&plant);
        tile.take_finished(&plant, &mut finished);
    }
    tile.signals(&plant, 0)
}

fn distance(found: Vec3<f64>, other: Vector) -> f64 {
    (found - vec3(other.x, other.y, other.z)).norm()
}

#[test]
fn tumbling_body_matches_rapier() {
    let (rate, time) = (vec3(0.3, 0.5, -0.4), 5.0);
    let mut model = two_bodies(2.5e-4, time, 10.0);
    let [i, _] = INERTIAS;
    model.base_inertia = inertia(i[0], i[1], i[2]);
    let found = last(model, Params { chaser_rate: rate, ..closing(1.0, 0.0, 0.0, 0.0) }).parts[0].a;
    let none = Vec3::zero();
    let free = Free { position: none, velocity: none, rate, mass: 2.0, inertia: i, ball: none };
    let other = |steps: u32| world(std::slice::from_ref(&free), time / f64::from(steps), steps);
    let error = |steps| distance(found.omega, other(steps)[0].angvel());
    let (coarse, fine) = (error(5_000), error(20_000));
    // Rapier's rate is of first order in its step: the difference is its own and goes with it.
    assert!(fine < 1e-3 && fine < 0.5 * coarse, "rates differ by {coarse}, {fine} rad/s");
}

#[test]
fn frictionless_off_centre_collision_matches_rapier() {
    let (speed, shift, masses) = (0.5, 0.4, [100.0, 300.0]);
    let apart = f64::sqrt(4.0 * RADIUS * RADIUS - shift * shift) + 0.01;
    let balls = [vec3(0.0, 0.3, 0.1), vec3(0.0, -0.2, 0.0)];
    let places = [vec3(-apart, shift, 0.0) - balls[0], Vec3::zero() - balls[1]];
    let mut model = two_bodies(1e-5, 0.2, 0.0);
    model.base_inertia = inertia(INERTIAS[0][0], INERTIAS[0][1], INERTIAS[0][2]);
    model.target_inertia = inertia(INERTIAS[1][0], INERTIAS[1][1], INERTIAS[1][2]);
    model.base_pose.position = places[0];
    model.target_pose.position = places[1];
    model.contact.a.points[0] = ContactPoint { position: balls[0], radius: RADIUS };
    model.contact.b.solids[0] = Solid { frame: at(0.0, balls[1].y, 0.0), shape: Shape::Sphere { radius: RADIUS } };
    let params = Params { base_mass: masses[0], target_mass: masses[1], ..closing(1.0, speed, 4e7, 0.0) };
    let found = last(model, params).parts[0];
    let free = |i: usize, velocity: f64| Free {
        position: places[i],
        velocity: vec3(velocity, 0.0, 0.0),
        rate: Vec3::zero(),
        mass: masses[i],
        inertia: INERTIAS[i],
        ball: balls[i],
    };
    let other = world(&[free(0, speed), free(1, 0.0)], 1e-4, 2000);
    let errors = [
        distance(found.a.velocity, other[0].linvel()),
        distance(found.b.velocity, other[1].linvel()),
        RADIUS * distance(found.a.omega, other[0].angvel()),
        RADIUS * distance(found.b.omega, other[1].angvel()),
    ];
    // Rapier bounces at a step's end, where the line of the centres has turned by v dt / R = 1e-4, and within its slop.
    assert!(errors.iter().all(|error| *error < 0.01 * speed), "velocities differ by {errors:?} m/s");
}
