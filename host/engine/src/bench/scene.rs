//! The scenes that are measured: an arm of seven joints on a free base, a sphere in a drogue, a free target.

use softdock_kernels::frame::Batch;
use softdock_kernels::manipulator::cell::{AXES, Feedforward, Mount};
use softdock_kernels::manipulator::sample;
use softdock_kernels::model::*;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::range::UNLIMITED;
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};
use softdock_tracer::kernel::kernel;
use std::f64::consts::PI;

/// The scene with a tick of `substeps` steps of `substep` seconds, ended after `ticks`.
///
/// A 1,600 kg chaser whose arm holds a sphere inside the drogue of a 900 kg target: in contact from the start, so
/// that no lane idles, though the kernels are free of branches anyway.
pub fn scene(substep: f64, substeps: u32, ticks: u32) -> Plant {
    let link = |turn: Quat<f64>, length: f64| Link {
        origin: Pose { position: vec3(length, 0.0, 0.0), attitude: turn },
        mass: 12.0,
        com: vec3(0.2, 0.01, -0.01),
        inertia: Sym3::diagonal(vec3(0.05, 0.4, 0.4)),
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (up, down) = (Quat { w: half, v: vec3(half, 0.0, 0.0) }, Quat { w: half, v: vec3(-half, 0.0, 0.0) });
    let links: Vec<Link> =
        (0..MAX_JOINTS).map(|i| link(if i % 2 == 0 { up } else { down }, if i == 0 { 1.0 } else { 0.4 })).collect();
    let start_angles = vec![0.1, -0.2, 0.3, 0.2, -0.1, 0.2, -0.3];
    let chain = Model {
        timing: Timing { substep, substeps, max_ticks: ticks },
        base_inertia: Sym3::diagonal(vec3(900.0, 1100.0, 1000.0)),
        base_pose: Pose::identity(),
        links,
        slides: Vec::new(),
        tool: Pose { position: vec3(0.3, 0.0, 0.0), attitude: Quat::identity() },
        drives: Vec::new(),
        brakes: Brakes::Open,
        start_angles,
        target_inertia: Sym3::diagonal(vec3(300.0, 350.0, 400.0)),
        target_pose: Pose { position: vec3(1.2, 0.0, 0.0), attitude: Quat::identity() },
        seat: Pose { position: vec3(-1.0, 0.0, 0.0), attitude: Quat::identity() },
        ring: None,
        held: Held::NONE,
        contact: drogue(),
        guidance: Guidance {
            thrust: Thrust::Off,
            plan: None,
            thrusters: None,
            arm: ArmControl::JointPd { stiffness: [40.0; MAX_JOINTS], damping: [15.0; MAX_JOINTS] },
        },
        orbit_rate: 0.0,
        orbit_axes: Quat::identity(),
        field: Vec3::zero(),
        facility: Facility::IDEAL,
        task: Task::OPEN,
        nominal: nominal(),
    };
    // The tool at the contact frame's origin, whatever the posture.
    let reach = Plant::new(chain.clone()).tool_start.position;
    Plant::new(Model { base_pose: Pose { position: -reach, attitude: Quat::identity() }, ..chain })
}

/// The scene with both robots joint by joint, held where they stand by their flanges.
pub fn with_joints(plant: &Plant) -> Plant {
    let mut model = Model::clone(plant);
    // A tool that undoes the part's own attitude, so that the flange looks as it does in the sample.
    let towards = |base: Pose<f64>, attitude: Quat<f64>| {
        let mount = sample::mount();
        let flange = sample::mount().tool.attitude.conjugate();
        let own = base.attitude.compose(flange).conjugate().compose(attitude);
        Mount { base, tool: Pose { attitude: own, ..mount.tool }, ..mount }
    };
    let (a, b) = (model.base_pose.compose(plant.tool_start), model.target_pose.compose(model.seat));
    let base1 = sample::mount().base;
    let around = Quat { w: 0.0, v: vec3(0.0, 0.0, 1.0) };
    let base2 = Pose { position: vec3(-base1.position.x, 0.0, base1.position.z), attitude: around };
    model.facility.joint_level = Some(JointLevel {
        robot: sample::robot(),
        mounts: [towards(base1, a.attitude), towards(base2, b.attitude)],
        servo: sample::servo(Feedforward::Full),
        carriage: None,
    });
    (model.nominal.robot1, model.nominal.robot2) = (sample::reference_drives(), sample::reference_drives());
    Plant::new(model)
}

/// The scene with every rule of a session in force, and none that is ever met: the axes have an industrial robot's limits
/// of speed and acceleration, and commands may be cut for ever.
pub fn supervised(plant: &Plant) -> Plant {
    const FAR: f64 = 1e9;
    let mut level = with_joints(plant).facility.joint_level.clone().expect("robots with joints");
    // Below the parts by 1 m, as in the reference facility: wrists bent, far from singular.
    level.mounts.iter_mut().for_each(|mount| mount.base.position.z = -1.0);
    let mut model = Model::clone(plant);
    let limit = AxisRange { lower: -FAR, upper: FAR, speed: 1.0, acceleration: 4.0 };
    let (limits, correction, tool_radius) = ([limit; AXES], [FAR; 2], [0.1; 2]);
    model.facility.session_robots = Some(SessionRobots { level, limits, correction, tool_radius });
    model.facility.rules = SessionRules {
        force: FAR,
        moment: FAR,
        force_rate: FAR,
        sensor_saturation: true,
        injected_energy: FAR,
        following_error: FAR,
        following_rotation: PI,
        tool_reach: FAR,
        tool_rotation: PI,
        clamp_time: FAR,
        tool_speed: FAR,
        keep_out: [("floor", -2.0, vec3(0.0, 0.0, 1.0)), ("wall", 4.0, vec3(0.0, 1.0, 0.0))].map(keep_out).into(),
        arm_distance: 0.02,
        singularity: 1e-3,
    };
    Plant::new(model)
}

/// A slab across an axis of the laboratory, 1 m thick.
fn keep_out((name, place, axis): (&str, f64, Vec3<f64>)) -> KeepOut {
    let half = vec3(5.0, 5.0, 5.0) - axis * 4.5;
    KeepOut { name: name.to_owned(), frame: Pose { position: axis * place, attitude: Quat::identity() }, half }
}

/// Parameters of every run of the scene: soft contact with friction, delay, lagging robots, a noisy sensor.
fn nominal() -> Params<f64> {
    Params {
        closing_speed: 0.02,
        base_mass: 1600.0,
        target_mass: 900.0,
        contact_stiffness: 5000.0,
        contact_damping: 100.0,
        contact_friction: 0.2,
        bristle_stiffness: 5000.0,
        bristle_damping: 50.0,
        loop_delay: 0.008,
        robot1_lag: 0.01,
        robot2_lag: 0.01,
        tool_speed_limit: 2.0,
        tool_rotation_limit: 2.0,
        sensor_delay: 0.001,
        sensor_lag: 0.0005,
        sensor_noise_force: 0.1,
        sensor_noise_moment: 0.01,
        sensor_range_force: UNLIMITED,
        sensor_range_moment: UNLIMITED,
        ..Params::null()
    }
}

/// A sphere of 5 cm inside a cone, touching its wall.
fn drogue() -> Contact {
    Contact {
        a: PartShape { points: vec![ContactPoint { position: Vec3::zero(), radius: 0.05 }], solids: Vec::new() },
        b: PartShape {
            points: Vec::new(),
            solids: vec![Solid {
                frame: Pose { position: vec3(-0.12, 0.0, 0.0), attitude: Quat::identity() },
                shape: Shape::Cone { mouth: 0.15, bottom: 0.05, depth: 0.2 },
            }],
        },
        law: NormalLaw::Linear,
        pairs: Vec::new(),
        patch_radius: 0.0,
        bilateral: false,
        latch: None,
        fingers: Vec::new(),
    }
}

/// Floating-point operations of one ideal step, counted in the traced stages (fma = 2, all others 1).
pub fn ideal_step_flops(plant: &Plant) -> usize {
    let kernel = kernel(plant, Batch::whole());
    let of = |name: &str| kernel.functions.iter().find(|f| f.name == name).map_or(0, |f| f.flops());
    let per_step = ["kinematics", "latch", "total_wrench", "observe", "advance"];
    let per_point = of("contact_point") + of("gather");
    let per_tick: usize = ["finish", "guide", "settle"].into_iter().map(of).sum();
    let steps: usize = per_step.into_iter().map(of).sum();
    steps + per_point * plant.contacts.len() + per_tick / plant.timing.substeps as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::session::{axes_asked, clearance_at};

    #[test]
    fn the_supervised_scene_has_every_rule_of_the_workspace_and_meets_none() {
        let plant = supervised(&scene(2.5e-4, 4, 1));
        let asked = axes_asked(&plant, &plant.start);
        assert_eq!((asked.near_limit, asked.near_body), (0.0, 0.0), "what is far is what a tick costs in a campaign");
        let [first, second] = plant.session_robots.as_ref().expect("two robots");
        let found = clearance_at(&plant, [&first.cell.home(), &second.cell.home()]);
        assert!(found.arms < 5.0 && found.arms > plant.facility.rules.arm_distance, "{found:?}");
        assert!(found.depth < 0.0 && found.depth > -5.0 && asked.least_sine > 0.1, "{found:?}");
    }
}
