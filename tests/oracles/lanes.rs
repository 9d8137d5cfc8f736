//! A run is independent, bit by bit, of instruction set, order, batch and lane.

use super::bench::{at, closing, inertia, job, numbered, two_bodies};
use softdock_engine::cpu::CpuEngine;
use softdock_engine::instructions::InstructionSet;
use softdock_engine::{Engine, Job, RunInput};
use softdock_kernels::fields::to_vec;
use softdock_kernels::model::{ArmControl, Link, MAX_JOINTS, Model};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::vector::{Quat, Vec3, vec3};

/// A six-joint arm of 1 to 2 m with a tip ahead of the base, about to touch a plane.
pub(super) fn six_joints(substep: f64, time: f64) -> Model {
    let mut model = two_bodies(substep, time, 0.0);
    let quarter = |axis: Vec3<f64>| Quat::from_rotation_vector(axis * std::f64::consts::FRAC_PI_2);
    let link = |x: f64, attitude: Quat<f64>| Link {
        origin: softdock_kernels::vector::Pose { position: vec3(x, 0.02, 0.03), attitude },
        mass: 20.0,
        com: vec3(0.12, 0.01, -0.02),
        inertia: inertia(0.4, 0.7, 0.9),
    };
    let about = [
        vec3(0.0, 0.0, 0.3),
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 0.0, 0.0),
        vec3(0.0, 1.0, 0.0),
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    ];
    model.links = about.iter().map(|axis| link(0.3, quarter(*axis))).collect();
    model.start_angles = vec![0.3, 0.5, -0.4, 0.2, 0.6, -0.3];
    model.base_inertia = inertia(60.0, 50.0, 70.0);
    model.target_inertia = inertia(30.0, 40.0, 35.0);
    model.tool = at(0.2, 0.0, 0.1);
    model.seat = at(-0.4, 0.1, 0.0);
    model.target_pose = at(0.4, -0.1, 0.0);
    model.guidance.arm = ArmControl::JointPd { stiffness: [400.0; MAX_JOINTS], damping: [40.0; MAX_JOINTS] };
    // The tool's start stands where the plant puts it; shift the base so that the tip is 2 mm before the plane.
    let tip = softdock_kernels::plant::Plant::new(model.clone()).tool_start.position;
    model.base_pose = at(-tip.x - 0.002, -tip.y, -tip.z);
    model
}

fn dispersed(count: usize) -> Vec<Params<f64>> {
    (0..count)
        .map(|i| {
            let f = i as f64 / count as f64;
            Params {
                base_mass: 400.0,
                target_mass: 200.0 + 300.0 * f,
                chaser_rate: vec3(0.01, -0.02 * f, 0.01),
                target_rate: vec3(-0.01 * f, 0.02, 0.0),
                tilt: vec3(0.02 * f, 0.01, -0.03),
                contact_friction: 0.3,
                bristle_stiffness: 4e3,
                bristle_damping: 10.0,
                loop_delay: 2e-3 + 8e-3 * f,
                delay_jitter: 2e-4,
                drop_probability: 0.02,
                sensor_delay: 5e-4,
                sensor_delay_error: 1.3e-3 * f,
                sensor_noise_force: 0.3,
                sensor_noise_moment: 0.03,
                robot1_lag: 0.01 * f,
                ..closing(1.0, 0.05 + 0.05 * f, 5e3 + 2e4 * f, 30.0)
            }
        })
        .collect()
}

fn arm_job(count: usize) -> (Job, Vec<RunInput>) {
    let mut model = six_joints(2.5e-4, 0.4);
    model.timing.substeps = 4;
    model.timing.max_ticks = 400;
    let params = dispersed(count);
    (job(model, &params), numbered(&params))
}

fn made(instructions: InstructionSet, job: &Job, runs: &[RunInput]) -> Vec<Finished> {
    CpuEngine::with(instructions).run(job, runs, &|_| true).expect("nobody stops the batch")
}

/// All numbers of a row as bits.
pub(super) fn bits(row: &Finished) -> Vec<u64> {
    let numbers =
        [to_vec(&row.params), to_vec(&row.space), to_vec(&row.hil), to_vec(&row.touch[0]), to_vec(&row.touch[1])];
    let mut bits: Vec<u64> = numbers.concat().iter().map(|v| v.to_bits()).collect();
    bits.extend([row.run, u64::from(row.flags)]);
    bits
}

#[track_caller]
fn assert_same(what: &str, some: &[Finished], others: &[Finished]) {
    assert_eq!(some.len(), others.len(), "{what}: number of rows");
    for (a, b) in some.iter().zip(others) {
        assert!(bits(a) == bits(b), "{what}: run {} differs\n{a:?}\n{b:?}", a.run);
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let (job, runs) = arm_job(20);
    let one = made(InstructionSet::OneLane, &job, &runs);
    for set in [InstructionSet::Avx512, InstructionSet::Avx2, InstructionSet::detect()] {
        assert_same(&format!("{set:?}"), &one, &made(set, &job, &runs));
    }
    assert!(one.iter().all(|row| row.space.touch_time > 0.0), "all runs touch");
    assert!(one.iter().any(|row| row.flags != 0), "some run loses a packet");
}

#[test]
fn order_batch_and_lane_change_no_bit() {
    let (job, runs) = arm_job(20);
    let whole = made(InstructionSet::detect(), &job, &runs);
    let reversed: Vec<_> = runs.iter().rev().cloned().collect();
    assert_same("reversed", &whole, &made(InstructionSet::detect(), &job, &reversed));
    let pieces: Vec<_> = runs.chunks(3).flat_map(|part| made(InstructionSet::detect(), &job, part)).collect();
    assert_same("in batches of three", &whole, &pieces);
    let run = softdock_engine::cpu::replay(&job, runs[13].clone(), &mut |_| ());
    assert_same("replayed", &whole[13..14], &[run]);
}
