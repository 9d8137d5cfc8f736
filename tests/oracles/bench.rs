//! Small scenarios built in code for the oracles: two bodies that meet along x, and their runs.

use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::model::*;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};

/// A pose without rotation.
pub(super) fn at(x: f64, y: f64, z: f64) -> Pose<f64> {
    Pose { position: vec3(x, y, z), attitude: Quat::identity() }
}

/// A diagonal inertia \[kg m^2\].
pub(super) fn inertia(x: f64, y: f64, z: f64) -> Sym3<f64> {
    Sym3::diagonal(vec3(x, y, z))
}

/// An ideal facility without limits.
pub(super) fn ideal_facility() -> Facility {
    Facility {
        robot1_share: 0.5,
        rail: None,
        drop_hold_ticks: 3,
        sensor_substeps: 1,
        crosstalk: [[0.0; 6]; 6],
        unstable_speed: 1e6,
        impedance: None,
        test_motion: None,
        joint_level: None,
        compensator: Compensator::NONE,
        load: None,
        tared: false,
    }
}

/// Success by touch, end by time alone.
pub(super) fn touch_task() -> Task {
    Task {
        capture: false,
        touch: true,
        max_force: f64::INFINITY,
        max_time: f64::INFINITY,
        max_restitution: f64::INFINITY,
        end_after_separation: f64::INFINITY,
        end_after_capture: f64::INFINITY,
        max_depth: 1e6,
    }
}

/// Two rigid bodies without arm: a point of A in front of a plane of B, `gap` apart along x; command period = substep.
pub(super) fn two_bodies(substep: f64, time: f64, gap: f64) -> Model {
    Model {
        timing: Timing { substep, substeps: 1, max_ticks: (time / substep).round() as u32 },
        base_inertia: inertia(1.0, 1.0, 1.0),
        base_pose: at(-gap, 0.0, 0.0),
        links: Vec::new(),
        tool: Pose::identity(),
        start_angles: Vec::new(),
        target_inertia: inertia(1.0, 1.0, 1.0),
        target_pose: Pose::identity(),
        seat: Pose::identity(),
        contact: Contact {
            points: vec![ContactPoint { position: Vec3::zero(), radius: 0.0 }],
            solids: vec![Solid { frame: Pose::identity(), shape: Shape::Plane }],
            law: NormalLaw::Linear,
            bilateral: false,
            latch: None,
        },
        guidance: Guidance {
            thrust: Thrust::Off,
            arm: ArmControl::JointPd { stiffness: [0.0; MAX_JOINTS], damping: [0.0; MAX_JOINTS] },
        },
        orbit_rate: 0.0,
        orbit_axes: Quat::identity(),
        field: Vec3::zero(),
        facility: ideal_facility(),
        task: touch_task(),
        nominal: Params::null(),
    }
}

/// Null parameters with two masses whose reduced mass is `mass`, closing at `speed` on a spring and damper.
pub(super) fn closing(mass: f64, speed: f64, stiffness: f64, damping: f64) -> Params<f64> {
    Params {
        base_mass: 2.0 * mass,
        target_mass: 2.0 * mass,
        closing_speed: speed,
        contact_stiffness: stiffness,
        contact_damping: damping,
        ..Params::null()
    }
}

/// A job over a model; the seed is fixed.
pub(super) fn job(model: Model, params: &[Params<f64>]) -> Job {
    Job::new(Plant::new(model), 7, params.iter().any(is_noisy))
}

/// Numbers parameter sets as runs 0, 1, ...
pub(super) fn numbered(params: &[Params<f64>]) -> Vec<RunInput> {
    params.iter().zip(0..).map(|(params, run)| RunInput { run, params: *params }).collect()
}

/// Makes all runs on the widest lanes of this machine.
pub(super) fn run(model: Model, params: &[Params<f64>]) -> Vec<Finished> {
    let job = job(model, params);
    CpuEngine::new().run(&job, &numbered(params), &|_| true).expect("nobody stops the batch")
}

/// Asserts |value / expected - 1| <= tolerance and says what was compared.
#[track_caller]
pub(super) fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let error = value / expected - 1.0;
    assert!(error.abs() <= tolerance, "{what}: {value} instead of {expected}, off by {error:.2e} of {tolerance:.0e}");
}
