//! Open-loop tosses of a measured cube: softdock and the engine Rapier, fitted to the same tosses with the same optimiser,
//! compared on others. The folder of the data is in `SOFTDOCK_DATA`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rapier3d::prelude::*;
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_identify::contact::population::{PopulationSize, minimise};
use softdock_identify::contact::toss::{
    OpenLoopError, OpenLoopToss, Tosses, fit_toss, mean_error, open_loop, toss_cost, toss_unknowns, training,
};
use softdock_kernels::fields::to_vec;
use softdock_kernels::philox;
use std::path::Path;

/// Steps of Rapier in a frame of 1/148 s.
const STEPS: usize = 4;
/// Natural frequency of Rapier's contacts with fixed bodies by default \[Hz\]; it has no stiffness.
const FREQUENCY: f64 = 60.0;
const RESAMPLES: usize = 2000;

/// Parameters of Rapier in the order of softdock's: restitution, friction, frequency, half width, surface, inertia.
type Parameters = [f64; 6];

/// A measured displacement and turn.
type Pose = (Vector3<f64>, UnitQuaternion<f64>);

fn vector(v: Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Simulates a toss from its first state.
fn run(toss: &OpenLoopToss, mass: f64, gravity: f64, parameters: &Parameters) -> Vec<Pose> {
    let [restitution, friction, frequency, half_width, surface, inertia] = *parameters;
    let (mut bodies, mut colliders) = (RigidBodySet::new(), ColliderSet::new());
    let material = |shape: ColliderBuilder| shape.friction(friction).restitution(restitution);
    let up = Vector::new(0.0, 0.0, 1.0);
    let ground = ColliderBuilder::new(SharedShape::halfspace(up)).translation(up * surface);
    colliders.insert(material(ground));
    let begin = &toss.begin;
    let body = RigidBodyBuilder::dynamic()
        .translation(vector(begin.position))
        .rotation(vector(begin.attitude.scaled_axis()))
        .linvel(vector(begin.velocity))
        .angvel(vector(begin.attitude * begin.rate))
        .additional_mass_properties(MassProperties::new(Vector::ZERO, mass, Vector::new(inertia, inertia, inertia)))
        .gyroscopic_forces_enabled(true)
        .can_sleep(false);
    let handle = bodies.insert(body);
    let cube = ColliderBuilder::cuboid(half_width, half_width, half_width).density(0.0);
    colliders.insert_with_parent(material(cube), handle, &mut bodies);
    let softness = SpringCoefficients { natural_frequency: frequency, ..SpringCoefficients::contact_defaults() };
    let settings = IntegrationParameters {
        dt: toss.step / STEPS as f64,
        length_unit: 0.1,
        contact_softness: softness,
        static_contact_softness: softness,
        ..Default::default()
    };
    let mut pipeline = PhysicsPipeline::new();
    let (mut islands, mut broad, mut narrow) = (IslandManager::new(), BroadPhaseBvh::new(), NarrowPhase::new());
    let (mut joints, mut multi, mut ccd) = (ImpulseJointSet::new(), MultibodyJointSet::new(), CCDSolver::new());
    let mut soft = SoftBodySet::new();
    let mut poses = vec![(Vector3::zeros(), UnitQuaternion::identity())];
    for _ in 1..toss.measured.len() {
        for _ in 0..STEPS {
            pipeline.step(
                Vector::new(0.0, 0.0, -gravity),
                &settings,
                &mut islands,
                &mut broad,
                &mut narrow,
                &mut bodies,
                &mut colliders,
                &mut joints,
                &mut multi,
                &mut soft,
                &mut ccd,
                &(),
                &(),
            );
        }
        let (place, turn) = (bodies[handle].translation(), bodies[handle].rotation());
        let attitude = UnitQuaternion::from_quaternion(Quaternion::new(turn.w, turn.x, turn.y, turn.z));
        poses.push((Vector3::new(place.x, place.y, place.z) - begin.position, begin.attitude.inverse() * attitude));
    }
    poses
}

/// Errors of Rapier on tosses, on two threads.
fn errors(tosses: &[OpenLoopToss], mass: f64, gravity: f64, parameters: &Parameters) -> Vec<OpenLoopError> {
    let one = |toss: &OpenLoopToss| {
        let poses = run(toss, mass, gravity, parameters);
        mean_error(&toss.measured, |frame| poses[frame])
    };
    let (first, second) = tosses.split_at(tosses.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| second.iter().map(one).collect::<Vec<_>>());
        let mut all: Vec<OpenLoopError> = first.iter().map(one).collect();
        all.extend(other.join().expect("no panic"));
        all
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = values.collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Mean and its 95 % bootstrap interval over tosses.
fn interval(values: &[f64]) -> [f64; 3] {
    let resample = |number: usize| {
        let draw = |at: usize| {
            let share = philox::uniform(4, "tosses", number as u64, at as u32);
            values[((share * values.len() as f64) as usize).min(values.len() - 1)]
        };
        mean((0..values.len()).map(draw))
    };
    let mut all: Vec<f64> = (0..RESAMPLES).map(resample).collect();
    all.sort_by(f64::total_cmp);
    [mean(values.iter().copied()), all[RESAMPLES / 40], all[RESAMPLES - 1 - RESAMPLES / 40]]
}

/// Half of the tosses are fitted, the other half is compared; see `docs/evidence/contact.md`.
#[test]
#[ignore = "needs SOFTDOCK_DATA"]
fn open_loop_tosses_are_predicted_better_than_by_rapier() {
    let data = std::env::var("SOFTDOCK_DATA").expect("SOFTDOCK_DATA: the folder of the measured data");
    let log = Path::new(&data).join("cube-tosses/tosses.csv");
    let rig = Rig::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/rigs/cube_toss.toml"));
    let rig = rig.expect("the shipped rig");
    let RigModel::Toss(own) = &rig.plant else { panic!("a rig of tosses") };
    let tosses = Tosses::read(&rig, own, &[&log], 0.5).expect("tosses");
    let (fitted, held_out) = (training(&tosses).expect("tosses"), OpenLoopToss::of(&tosses, true));
    let size = PopulationSize::default();
    let values = &own.values;
    let (mass, gravity) = (values.mass, -values.gravity.z);
    let nominal = [values.restitution, values.friction, FREQUENCY, values.half_width, 0.0, values.inertia.x];

    let unknowns = toss_unknowns(own);
    let parameters = |z: &Vec<f64>| -> Parameters {
        std::array::from_fn(|place| {
            let value = unknowns[place].prior.value(z[place]);
            // A frequency goes with the root of a stiffness; its prior is as wide as that of the stiffness.
            if place == 2 { FREQUENCY * value / values.stiffness } else { value }
        })
    };
    let evaluate = |places: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let cost = |z: &Vec<f64>| {
            let errors = errors(&fitted, mass, gravity, &parameters(z));
            errors.iter().map(|error| toss_cost(error, values.half_width)).collect()
        };
        places.iter().map(cost).collect()
    };
    let rapier = parameters(&minimise(&[0.0; 6], size, &evaluate)[0].z);
    let softdock = fit_toss(&tosses, size).expect("a fit");
    println!("rapier {rapier:?}\nsoftdock {:?} {:?}", softdock.estimates, softdock.body);

    let own_errors = open_loop(&held_out, &[softdock.values.clone(), to_vec(values)]);
    let rows = [
        ("softdock fitted", own_errors[0].clone()),
        ("softdock nominal", own_errors[1].clone()),
        ("rapier fitted", errors(&held_out, mass, gravity, &rapier)),
        ("rapier nominal", errors(&held_out, mass, gravity, &nominal)),
    ];
    let [position, rotation]: [fn(&OpenLoopError) -> f64; 2] =
        [|error| 1e3 * error.position_m, |error| error.rotation_rad.to_degrees()];
    for (name, errors) in &rows {
        let of = |f: fn(&OpenLoopError) -> f64| {
            let mut all: Vec<f64> = errors.iter().map(f).collect();
            let [value, low, high] = interval(&all);
            all.sort_by(f64::total_cmp);
            let at = |share: f64| all[((share * all.len() as f64) as usize).min(all.len() - 1)];
            format!(
                "{value:.2} ({low:.2} to {high:.2}) | {:.2} | {:.2} | {:.2} | {:.2}",
                at(0.0),
                at(0.5),
                at(0.9),
                at(1.0)
            )
        };
        println!("| {name} | {} | {} |", of(position), of(rotation));
    }
    for (what, f) in [("position [mm]", position), ("rotation [deg]", rotation)] {
        let gains: Vec<f64> = rows[2].1.iter().zip(&rows[0].1).map(|(rapier, own)| f(rapier) - f(own)).collect();
        let [gain, low, high] = interval(&gains);
        let better = gains.iter().filter(|gain| **gain > 0.0).count();
        println!(
            "{what}: rapier less softdock {gain:.2} ({low:.2} to {high:.2}), better on {better} of {}",
            gains.len()
        );
        assert!(low > 0.0, "{what}: softdock is not better than Rapier: {gain} ({low} to {high})");
    }
}
