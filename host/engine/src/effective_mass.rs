//! Effective mass along a contact normal: what a push there has to move, joints free.

use softdock_kernels::outcome::Finished;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Kinematics, Wrench, space_masses};
use softdock_kernels::staged::{advance_in_place, kinematics, start};
use softdock_kernels::vector::Vec3;
use softdock_kernels::with_joints;

/// Effective mass \[kg\] along the normal of the first touch in space, at the start posture; `None` without a touch.
///
/// From the change of relative speed that a unit impulse at the contact point causes (facts of section 5:
/// `1/m_eff = n^T J H^-1 J^T n`), by one substep with and one without the push.
pub fn effective_mass(plant: &Plant, run: &Finished) -> Option<f64> {
    let [normal, lever] = run.touch;
    (normal.norm() > 0.5).then(|| with_joints!(plant.joints(), at_start(plant, run, normal, lever)))
}

fn at_start<const N: usize>(plant: &Plant, run: &Finished, normal: Vec3<f64>, lever: Vec3<f64>) -> f64 {
    let masses = space_masses(&run.params);
    let bodies = start::<f64, N>(plant, &run.params, &masses);
    let k = kinematics(plant, &masses, &bodies);
    let idle = Actuation { braked: 0.0, thrust: Vec3::zero(), torque: Vec3::zero(), joint: [0.0; N] };
    // A force that changes the speed by about 1 mm/s: far above rounding, far below large rotations.
    let moving = [
        (!plant.held.base).then_some(masses.base_mass),
        (!plant.held.target).then_some(masses.target_mass),
        (plant.held.base && N > 0).then_some(plant.chain.mass),
    ];
    let push = 1e-3 / plant.timing.substep * moving.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let separation = |force: f64| {
        let force = normal * force;
        let mut next = bodies;
        let w = Wrench { force, moment: lever.cross(force) };
        advance_in_place(plant, &masses, &mut next, &k, &idle, w, w);
        // Twists after the push at the configuration before it.
        let mut there = bodies;
        (there.chaser.momentum, there.chaser.spin) = (next.chaser.momentum, next.chaser.spin);
        (there.target.momentum, there.target.spin) = (next.target.momentum, next.target.spin);
        there.arm.rate = next.arm.rate;
        let k: Kinematics<f64, N> = kinematics(plant, &masses, &there);
        let (a, b) = (k.parts.a, k.parts.b);
        let from_b = a.position - b.position + lever;
        (a.velocity + a.omega.cross(lever) - b.velocity - b.omega.cross(from_b)).dot(normal)
    };
    push * plant.timing.substep / (separation(push) - separation(0.0))
}
