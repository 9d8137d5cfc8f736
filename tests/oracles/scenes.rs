//! Two bodies that meet along x, built in code: a scenario and its parameters. The rapier oracle includes this file too.

use softdock_kernels::model::*;
use softdock_kernels::params::Params;
use softdock_kernels::vector::{Pose, Quat, Sym3, vec3};

/// A pose without rotation.
pub(crate) fn at(x: f64, y: f64, z: f64) -> Pose<f64> {
    Pose { position: vec3(x, y, z), attitude: Quat::identity() }
}

/// A diagonal inertia \[kg m^2\].
pub(crate) fn inertia(x: f64, y: f64, z: f64) -> Sym3<f64> {
    Sym3::diagonal(vec3(x, y, z))
}

/// Success by touch, end by time alone.
pub(crate) fn touch_task() -> Task {
    Task { touch: true, ..Task::OPEN }
}

/// Two rigid bodies without arm: a point of A in front of a plane of B, `gap` apart along x; command period = substep.
pub(crate) fn two_bodies(substep: f64, time: f64, gap: f64) -> Model {
    let timing = Timing { substep, substeps: 1, max_ticks: (time / substep).round() as u32 };
    Model { task: touch_task(), ..Model::two_bodies(timing, gap) }
}

/// Null parameters with two masses whose reduced mass is `mass`, closing at `speed` on a spring and damper.
pub(crate) fn closing(mass: f64, speed: f64, stiffness: f64, damping: f64) -> Params<f64> {
    Params {
        base_mass: 2.0 * mass,
        target_mass: 2.0 * mass,
        closing_speed: speed,
        contact_stiffness: stiffness,
        contact_damping: damping,
        ..Params::null()
    }
}
