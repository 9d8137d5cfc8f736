//! Realistic inputs: runs of several scenarios recorded on their way, in contact and out of it, rounded to f32.

use crate::oracles::meshes::{block_with_cone, sphere};
use softdock_kernels::arm_motion::ArmMotion;
use softdock_kernels::arm_plan::{ArmGuard, ArmPhase, ArmPlan, Camera, Compliance, Goal, MAX_JOINTS, Pace};
use softdock_kernels::capture_ring::Ring;
use softdock_kernels::compensator::Compensation;
use softdock_kernels::contact::PointContact;
use softdock_kernels::contact::mesh::ShellPoint;
use softdock_kernels::contact::shell::{Relative, ShellTouch, no_shell_touch, relative, shell_point, touch_shell};
use softdock_kernels::contact::{LatchState, Point, PointState, contact_point, hil_pair, latch, space_pair};
use softdock_kernels::effects::EFFECTS;
use softdock_kernels::fields::{Bundle, Field, fields, from_slice, to_vec};
use softdock_kernels::frame::lane_state::{LaneState, state_fields};
use softdock_kernels::frame::{Batch, Loops, Tile};
use softdock_kernels::guidance::guide;
use softdock_kernels::impedance::Admittance;
use softdock_kernels::load::Load;
use softdock_kernels::manipulator::cell::{Drives, Feedforward, SetPoint};
use softdock_kernels::manipulator::{ArmDrive, Drive, Friction, Stops};
use softdock_kernels::material::Pair;
use softdock_kernels::model::{
    ArmControl, Brakes, Compensator, CompensatorKind, ContactPoint, Finger, Hook, ImpedanceLaw, MaterialPair, Members,
    Model, NormalLaw, SensorLoad, Shape, Solid, TestMotion, Thrust, Thrusters, Waveform,
};
use softdock_kernels::monitor::{Touch, Watch, gather, no_touch, total_wrench};
use softdock_kernels::params::Params;
use softdock_kernels::philox::{key, uniform};
use softdock_kernels::plant::{Plant, PointOfPair, ShellOfPair};
use softdock_kernels::robot::{Robots, command, extrapolate, mounted_parts};
use softdock_kernels::sensor::Sensor;
use softdock_kernels::session::{Asked, Clearance, Session, axes_asked};
use softdock_kernels::space::{Bodies, Kinematics, Parts, Wrench, hil_masses, kinematics, space_masses};
use softdock_kernels::stewart::{CaptureRing, stewart_legs};
use softdock_kernels::test_motion::{Tracking, followed};
use softdock_kernels::thrusters::Firing;
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};
use softdock_mesh::{Options, Triangles, prepare};
use softdock_test_size::is_full;
use softdock_tracer::wgsl::Function;
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// Seed of everything that is drawn here.
const SEED: u64 = 0x5EED_0FDA;
/// Runs of a scenario, and snapshots of each: half of them in contact where a run comes to that.
const RUNS: u64 = 32;
const SNAPSHOTS: usize = 8;
/// Samples of a scenario: whole workgroups.
pub(crate) const SAMPLES: usize = RUNS as usize * SNAPSHOTS;
/// A run is looked at every so many ticks.
const EVERY: u32 = 5;
/// Relative disturbance of every sampled number: far above f32, far below a contact's depth over its lever.
const DISTURBANCE: f64 = 1e-4;

/// Numbers in (0, 1) and normal deviates, one after the other.
pub(crate) struct Stream {
    name: &'static str,
    next: u64,
}

impl Stream {
    pub(crate) fn new(name: &'static str, number: usize) -> Self {
        Self { name, next: (number as u64) << 32 }
    }
    pub(crate) fn uniform(&mut self) -> f64 {
        self.next += 1;
        uniform(SEED, self.name, self.next, 0)
    }
    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// One run between two ticks; every number is an f32.
#[derive(Clone)]
pub(crate) struct Snapshot {
    pub(crate) run: u64,
    pub(crate) tick: u32,
    pub(crate) params: Params<f64>,
    pub(crate) lane: LaneState,
}

/// A scenario with snapshots of its runs.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) plant: Plant,
    pub(crate) batch: Batch,
    pub(crate) snapshots: Vec<Snapshot>,
}

/// The shipped scenarios, and two more that have what those lack: other controllers, shapes, laws, an orbit; in the short
/// check without those whose stages others have too.
pub(crate) static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let mut cases = vec![
        case("smoke", "smoke.toml", |_| {}, |_| {}),
        case("smoke_joint", "smoke_joint.toml", feed_all_forward, |p| {
            (p.test_amplitude, p.test_frequency) = (1e-3, 3.0);
        }),
        case("computed torque, Power law, box and ball", "probe_drogue.toml", crowded, |p| {
            (p.contact_stiffness, p.contact_damping, p.contact_dissipation) = (4e5, 0.0, 2.0);
            tuned(p);
        }),
        case(PREDICTED, "smoke.toml", |m| compensated(m, CompensatorKind::Smith), tuned),
        case(OBSERVED, "smoke.toml", observed, tuned),
        case(MESHED, "smoke.toml", meshed, |_| {}),
        case("held base, a joint that slides", "probe_drogue.toml", on_mount, tuned),
    ];
    if is_full() {
        cases.extend([
            case("plate_impact", "plate_impact.toml", |_| {}, |_| {}),
            case("probe_drogue", "probe_drogue.toml", |_| {}, |_| {}),
            case("Cartesian impedance, chamfered bore", "probe_drogue.toml", bored, tuned),
        ]);
    }
    cases
});

/// Short dockings with a compensator that uses past samples, and with one that has internal state.
pub(crate) const PREDICTED: &str = "smoke, Smith predictor";
pub(crate) const OBSERVED: &str = "smoke, switched lead and passivity";
/// A short docking of meshes on a held target.
pub(crate) const MESHED: &str = "smoke, meshes";

/// A ball of triangles on the probe, and the drogue as a mesh: points and shells against grids, shells of both parts.
fn meshed(model: &mut Model) {
    let solid = |triangles: &Triangles, points: usize, margin: f64, position: Vec3<f64>| {
        let solid = softdock_mesh::ClosedMesh::check(triangles).expect("a closed surface");
        let options = Options { resolution: Some(3e-3), margin, points, patch: 4e-4 };
        let mesh = prepare(&solid, &options).expect("a grid");
        let attitude = Quat::from_rotation_vector(vec3(0.2, -0.1, 0.05));
        Solid { frame: Pose { position, attitude }, shape: Shape::Mesh(Arc::new(mesh)) }
    };
    let mut drogue = block_with_cone([0.08, 0.03, 0.08], 0.1, 24);
    drogue.vertices.iter_mut().for_each(|vertex| vertex.x += 0.001);
    model.contact.a.solids = vec![solid(&sphere(0.024, 24), 80, 0.0, vec3(-0.001, 0.0, 0.0))];
    model.contact.b.solids = vec![solid(&drogue, 150, 0.025, Vec3::zero())];
    model.contact.b.solids[0].frame.attitude = Quat::from_rotation_vector(vec3(0.3, 0.0, 0.0));
    model.held.target = true;
}

/// Lets a joint slide, with part A where it was.
fn slide(model: &mut Model, joint: usize) {
    // Not by a plant: its robots reach the start of the parts alone.
    let tool = |model: &Model| {
        let links = model.start_angles.iter().enumerate().map(|(i, place)| model.link_pose(i, *place));
        links.fold(Pose::identity(), |inner, link| inner.compose(link)).compose(model.tool)
    };
    let part_a = model.base_pose.compose(tool(model));
    model.slides = (0..model.links.len()).map(|other| other == joint).collect();
    model.start_angles[joint] = 0.05;
    model.base_pose = part_a.compose(tool(model).inverse());
}

/// An arm with a joint that slides, on a held base in a field.
fn on_mount(model: &mut Model) {
    model.held.base = true;
    slide(model, 1);
    model.field = vec3(0.02, -0.01, 0.03);
    model.guidance.arm = ArmControl::ComputedTorque { bandwidth: 2.0, damping_ratio: 0.8 };
    model.guidance.thrust = Thrust::Off;
}

fn compensated(model: &mut Model, kind: CompensatorKind) {
    model.facility.compensator = Compensator { kind, pulls: false };
}

/// A compensator with internal state, behind a tared sensor with a load; part B on a ring, a latch with hooks.
fn observed(model: &mut Model) {
    compensated(model, CompensatorKind::LeadPassivity);
    model.facility.tared = true;
    model.facility.load = Some(SensorLoad {
        mass: 12.0,
        centre: vec3(0.08, 0.01, -0.02),
        gravity: vec3(0.0, 0.0, -9.81),
        inertia_compensated: true,
    });
    model.ring = Some(CaptureRing {
        mass: 25.0,
        inertia: Sym3::diagonal(vec3(1.0, 0.7, 0.6)),
        centre: vec3(0.02, 0.01, -0.005),
        legs: stewart_legs([0.2, 0.25], [0.2, 0.25], [0.05, 0.3]),
        stiffness: 8e3,
        damping: 150.0,
        force_limit: 60.0,
        lag: 3e-3,
        strokes: [4e-3, 3e-3],
        stop_stiffness: 5e4,
    });
    let latch = model.contact.latch.as_mut().expect("a latch");
    let hook = |y: f64, z: f64| Hook { point: vec3(0.0, y, z), seat: latch.seat + vec3(0.0, y, z) };
    latch.hooks = vec![hook(0.1, 0.0), hook(-0.05, 0.08)];
    latch.hook_reach = 0.02;
}

/// Numbers for any compensator, and tools that are slow enough to meet their limits.
fn tuned(p: &mut Params<f64>) {
    (p.tool_speed_limit, p.tool_rotation_limit) = (0.06, 0.05);
    p.compensator_delay = 0.9 * p.loop_delay;
    p.compensator_lag = 1.3e-3;
    p.compensator_stiffness = 2e4;
    p.compensator_margin = 0.2;
    p.compensator_damping = 40.0;
    p.compensator_energy = 1e-3;
    p.compensator_threshold = 2.0;
    p.sensor_delay_error = 7e-4;
}

/// A law of every other kind, and all that a pair may have in both loops.
fn laws() -> Vec<MaterialPair> {
    let plain = Pair {
        stiffness: 3e4,
        damping: 60.0,
        dissipation: 12.0,
        friction: 0.2,
        bristle_stiffness: 2e4,
        bristle_damping: 50.0,
        stribeck: 0.0,
        stribeck_speed: 0.02,
        exponent_error: 0.0,
        anisotropy: 0.0,
        adhesion: 0.0,
    };
    let rough = Pair { stribeck: 0.4, anisotropy: 0.3, adhesion: 1.5, ..plain };
    let of = |point: usize, solid: usize, law: NormalLaw, properties: Pair<f64>| MaterialPair {
        a: Members { points: vec![point], solids: Vec::new() },
        b: Members { points: Vec::new(), solids: vec![solid] },
        law,
        properties,
        patch_radius: 0.0,
    };
    vec![
        MaterialPair { patch_radius: 0.02, ..of(0, 0, NormalLaw::Rebound { exponent: 1.3, slowest: 2e-3 }, rough) },
        of(1, 0, NormalLaw::Impact { exponent: 1.4, ramp: 4e-3 }, plain),
        of(2, 1, NormalLaw::Stop { stroke: 3e-3, stiffness: 2e5, exponent: 1.2 }, plain),
    ]
}

/// A box and a ball in the approach corridor, a general exponent, laws of pairs, computed torque, thrust and an orbit.
fn crowded(model: &mut Model) {
    let at = |x: f64, y: f64, shape| {
        let frame = Pose { position: vec3(x, y, 0.0), attitude: Quat { w: 0.8, v: vec3(0.0, 0.6, 0.0) } };
        Solid { frame, shape }
    };
    model.contact.b.solids = vec![
        at(0.05, 0.12, Shape::Box { half: vec3(0.03, 0.15, 0.08) }),
        at(0.08, -0.11, Shape::Sphere { radius: 0.12 }),
    ];
    model.contact.law = NormalLaw::Power { exponent: 1.7 };
    model.contact.pairs = laws();
    // Beside the head: its rims meet the box, and the box's vertices and the ball meet it.
    let frame = Pose { position: vec3(0.01, 0.02, 0.0), attitude: Quat { w: 0.9, v: vec3(0.0, 0.3, 0.316) } };
    model.contact.a.solids = vec![Solid { frame, shape: Shape::Cylinder { radius: 0.03, length: 0.05, points: 6 } }];
    // The cylinder is a finger.
    let members = Members { points: Vec::new(), solids: vec![0] };
    model.contact.fingers = vec![Finger { members, travel: vec3(0.0, -0.03, 0.01) }];
    model.guidance.arm = ArmControl::ComputedTorque { bandwidth: 2.0, damping_ratio: 0.8 };
    model.guidance.thrust = Thrust::Approach {
        speed_gain: 400.0,
        lateral_stiffness: 80.0,
        lateral_damping: 300.0,
        attitude_stiffness: 200.0,
        attitude_damping: 900.0,
        max_force: 20.0,
        max_torque: 10.0,
    };
    model.guidance.plan = Some(plan());
    let torque = vec3(2.0, 3.0, 4.0);
    model.guidance.thrusters = Some(Thrusters { torque, deadband: 2e-3, lead: 0.5, pulse: 20, off_at_touch: false });
    slide(model, 2);
    model.drives = (0..model.links.len()).map(arm_drive).collect();
    model.brakes = Brakes::CloseAtTouch;
    compensated(model, CompensatorKind::SecondOrderLead);
    model.orbit_rate = 1.1e-3;
    model.field = vec3(1e-3, 0.0, -2e-3);
}

/// Phases of every kind, none of them longer than a quarter of a second.
fn plan() -> ArmPlan {
    let pd = ArmControl::JointPd { stiffness: [900.0; MAX_JOINTS], damping: [300.0; MAX_JOINTS] };
    let torque = ArmControl::ComputedTorque { bandwidth: 3.0, damping_ratio: 0.7 };
    let soft = |stiffness: f64| ArmControl::CartesianImpedance {
        stiffness,
        damping: 500.0,
        rotation_stiffness: 200.0,
        rotation_damping: 150.0,
        joint_damping: 4.0,
    };
    let place =
        |x: f64, y: f64| Pose { position: vec3(x, y, 0.01), attitude: Quat { w: 0.999, v: vec3(0.03, 0.02, -0.02) } };
    let after = |seconds: f64, next: usize| ArmGuard { after: Some(seconds), ..ArmGuard::to(next) };
    let pace = |speed: f64| Pace { speed, acceleration: 2.0 * speed, jerk: 9.0 * speed, turn_speed: 0.3 };
    let compliance = Compliance {
        inverse_mass: [0.02, 0.01, 0.0, 0.5, 0.0, 0.4],
        damping: [300.0, 200.0, 0.0, 10.0, 0.0, 20.0],
        stiffness: [0.0, 500.0, 0.0, 50.0, 0.0, 0.0],
        press: [5.0, 0.0, 0.0, 0.0, 0.0, 0.1],
    };
    let phase = |name: &str, control, goal, pace, guards: Vec<ArmGuard>| ArmPhase {
        name: name.to_owned(),
        control,
        goal,
        pace,
        compliance: None,
        closes: None,
        guards,
    };
    let mut press = phase("press", soft(700.0), Goal::PartB(place(0.0, 0.0)), pace(0.2), vec![after(0.2, 3)]);
    press.compliance = Some(compliance);
    press.closes = Some(true);
    let touching = ArmGuard { force: Some(5.0), force_below: Some(1e4), ..ArmGuard::to(2) };
    let arrived = ArmGuard { arrived: true, ..ArmGuard::to(2) };
    ArmPlan {
        phases: vec![
            phase(
                "swing",
                pd,
                Goal::Joints([0.01, -0.02, 0.03, 0.01, -0.01, 0.02, 0.0, 0.0]),
                pace(0.5),
                vec![after(0.15, 1)],
            ),
            phase(
                "near",
                soft(900.0),
                Goal::PartB(place(-0.02, 0.01)),
                pace(0.3),
                vec![touching, arrived, after(0.25, 2)],
            ),
            press,
            phase("back", torque, Goal::Joints([0.0; MAX_JOINTS]), pace(0.4), vec![after(0.2, 4)]),
            phase(
                "aside",
                soft(800.0),
                Goal::Base(place(0.8, 0.05)),
                pace(0.1),
                vec![ArmGuard { captured: true, ..ArmGuard::to(5) }, after(0.2, 5)],
            ),
            phase("stay", soft(600.0), Goal::Hold, pace(0.1), vec![after(0.1, 0)]),
        ],
        grip_time: 0.2,
        camera: Some(Camera { period: 20, delay: 35, noise_position: 1e-3, noise_rotation: 2e-3, smoothing: 0.05 }),
        sensor_lag: 3e-3,
    }
}

/// A drive with everything: every second one with an elastic gear, or with a stop beside the start posture.
fn arm_drive(joint: usize) -> ArmDrive {
    let is_elastic = joint.is_multiple_of(2);
    let gear_stiffness = if is_elastic { 4000.0 } else { f64::INFINITY };
    let stops = Stops { lower: -1e-3, upper: 2e-3, stiffness: 2e4, damping: 20.0 };
    ArmDrive {
        drive: Drive {
            gear_ratio: 80.0,
            rotor_inertia: 3e-4,
            gear_stiffness,
            gear_damping: 3.0,
            backlash: 1e-4,
            torque_limit: 60.0,
            ..Drive::ideal()
        },
        friction: Friction { coulomb: 1.0, viscous: 4.0, stribeck: 0.5, stribeck_speed: 0.02, ..Friction::none() },
        presliding_travel: 2e-4,
        speed_limit: 0.3,
        stops: (!is_elastic).then_some(stops),
        brake: if is_elastic { 30.0 } else { 0.0 },
    }
}

/// The whole feedforward, an impedance with coupled axes and a test motion, so that every stage of the joint level does all that it can.
fn feed_all_forward(model: &mut Model) {
    let size = |i: usize, shift: f64, turn: f64| if i < 3 { shift } else { turn };
    let matrix = |shift: f64, turn: f64| -> [[f64; 6]; 6] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i == j { size(i, shift, turn) } else { 0.02 * size(i, shift, turn).min(size(j, shift, turn)) }
            })
        })
    };
    let law = ImpedanceLaw::new(matrix(200.0, 30.0), matrix(4000.0, 300.0), matrix(2e4, 2e3));
    model.facility.impedance = Some(law.expect("a mass with an inverse"));
    let axis = vec3(0.0, 0.6, 0.8);
    model.facility.test_motion = Some(TestMotion { axis, waveform: Waveform::Sine, begin: 0.1, settle: 0.2 });
    model.facility.joint_level.as_mut().expect("robots with joints").servo.feedforward = Feedforward::Full;
}

/// A bore with a chamfer, and a soft end-effector.
fn bored(model: &mut Model) {
    model.contact.b.solids = vec![Solid {
        frame: Pose::identity(),
        shape: Shape::Bore { radius: 0.03, depth: 0.08, chamfer: 0.01, points: 6 },
    }];
    compensated(model, CompensatorKind::VirtualDamping);
    model.contact.a.points.push(ContactPoint { position: vec3(0.01, 0.0, 0.02), radius: 0.0 });
    model.guidance.arm = ArmControl::CartesianImpedance {
        stiffness: 800.0,
        damping: 600.0,
        rotation_stiffness: 300.0,
        rotation_damping: 200.0,
        joint_damping: 5.0,
    };
}

fn case(name: &'static str, campaign: &str, change: fn(&mut Model), adjust: fn(&mut Params<f64>)) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns").join(campaign);
    let campaign = softdock_campaign::load(&path).expect("a shipped campaign loads");
    let mut model = campaign.scenario.model.clone();
    change(&mut model);
    let plant = Plant::new(model);
    let batch = Batch { key: key(SEED), noisy: true, loops: Loops::Both };
    let draw = |run: u64| {
        let mut params = campaign.draw(run).expect("a draw").params;
        adjust(&mut params);
        with_effects(params, run)
    };
    let snapshots = match plant.joints() {
        0 => record::<0>(&plant, batch, draw),
        6 => record::<6>(&plant, batch, draw),
        other => unreachable!("no shipped scenario has {other} joints"),
    };
    Case { name, plant, batch, snapshots }
}

/// Every effect at a size of its own, as none of the shipped campaigns has all of them.
fn with_effects(params: Params<f64>, run: u64) -> Params<f64> {
    let mut draws = Stream::new("effects", run as usize);
    let mut values = to_vec(&params);
    for (value, field) in values.iter_mut().zip(fields::<f64, Params<f64>>()) {
        let parameter = EFFECTS.iter().flat_map(|e| e.parameters).find(|p| p.field == field.name);
        if let Some(parameter) = parameter.filter(|p| !p.field.ends_with("range_force")) {
            *value += 0.5 * parameter.scale * draws.normal().abs();
        }
        *value = f64::from(*value as f32);
    }
    from_slice(&values)
}

/// Steps runs in f64 and keeps some of their states.
fn record<const N: usize>(plant: &Plant, batch: Batch, draw: impl Fn(u64) -> Params<f64>) -> Vec<Snapshot> {
    let names = state_fields::<N>(plant);
    let at = |name: &str| names.iter().position(|f| f.name == name).expect("a row of the state");
    let (touching, over) =
        (["space_watch_touching", "hil_watch_touching"].map(at), ["space_watch_done", "hil_watch_done"].map(at));
    let mut out = Vec::with_capacity(SAMPLES);
    for run in 0..RUNS {
        let (params, mut draws) = (draw(run), Stream::new("snapshots", run as usize));
        let mut tile = Tile::<f64, N>::new(plant, batch);
        tile.load(plant, &[(0, run, params)]);
        // Reservoir sampling of both kinds: apart, and in contact in either loop.
        let (mut pools, mut seen) = ([Vec::new(), Vec::new()], [0.0; 2]);
        for tick in 0..plant.timing.max_ticks.min(3000) {
            if tick % EVERY > 0 {
                tile.step(plant);
                continue;
            }
            let lane = tile.lane_state(plant);
            if over.iter().any(|row| lane.state[*row] > 0.0) || seen[1] > 60.0 {
                break;
            }
            let kind = usize::from(touching.iter().any(|row| lane.state[*row] > 0.0));
            let pool = &mut pools[kind];
            seen[kind] += 1.0;
            if pool.len() < SNAPSHOTS {
                pool.push((tick, lane));
            } else if draws.uniform() < SNAPSHOTS as f64 / seen[kind] {
                pool[(draws.uniform() * SNAPSHOTS as f64) as usize] = (tick, lane);
            }
            tile.step(plant);
        }
        let [mut kept, mut touching] = pools;
        touching.truncate(SNAPSHOTS.saturating_sub(kept.len()).max(SNAPSHOTS / 2));
        kept.truncate(SNAPSHOTS - touching.len());
        kept.extend(touching);
        // A run that was soon over is used again, disturbed otherwise.
        for (number, (tick, mut lane)) in kept.iter().cloned().cycle().take(SNAPSHOTS).enumerate() {
            // One of them in its last tick.
            let tick = if number == 1 { plant.timing.max_ticks } else { tick };
            disturb(&mut lane.state, &names, DISTURBANCE, &mut draws);
            round(&mut lane.lines);
            out.push(Snapshot { run, tick, params, lane });
        }
    }
    out
}

/// Rounds to f32.
pub(crate) fn round(values: &mut [f64]) {
    values.iter_mut().for_each(|value| *value = f64::from(*value as f32));
}

/// Changes each number by its own small part and rounds to f32; counts and flags stay, quaternions keep their length.
pub(crate) fn disturb(values: &mut [f64], names: &[Field], size: f64, draws: &mut Stream) {
    for index in 0..values.len() {
        let (name, quaternion) = (&names[index].name, index + 4 <= values.len());
        if name.ends_with("attitude_w") && quaternion {
            let norm = (0..4).map(|k| values[index + k].powi(2)).sum::<f64>().sqrt();
            (0..4).for_each(|k| values[index + k] /= norm);
        } else if names[index].unit != "1" {
            values[index] *= 1.0 + size * draws.normal();
        }
    }
    round(values);
}

/// What the stages see of a snapshot: on the way through the loop, on one of its two sides.
struct Scene<const N: usize> {
    facility: bool,
    bodies: Bodies<f64, N>,
    watch: Watch<f64>,
    robots: Robots<f64>,
    sensor: Sensor<f64>,
    kinematics: Kinematics<f64, N>,
    simulated: Parts<f64>,
    mounted: Parts<f64>,
    states: Vec<PointState<f64>>,
    contacts: Vec<PointContact<f64>>,
    shells: Vec<SampledShell>,
    touch: Touch<f64>,
    latch: LatchState<f64>,
}

/// A shell on its way: relative motion, its deepest points first, and what all of them do.
struct SampledShell {
    relative: Relative<f64>,
    points: Vec<ShellPoint<f64>>,
    touch: ShellTouch<f64>,
}

fn sampled_shell(
    plant: &Plant,
    shell: &ShellOfPair,
    pair: &Pair<f64>,
    parts: &Parts<f64>,
    before: f64,
) -> SampledShell {
    let (of, relative) = (&plant.pairs[shell.pair], relative(plant, shell, parts));
    let with =
        |sum: ShellTouch<f64>, point: &ShellPoint<f64>| shell_point(plant, of, pair, &relative, point, before, &sum);
    let mut points = shell.points.clone();
    let depth = |point: &ShellPoint<f64>| with(no_shell_touch(), point).depth;
    points.sort_by(|one, two| depth(two).total_cmp(&depth(one)));
    let touch = points.iter().fold(no_shell_touch(), with);
    SampledShell { relative, points, touch }
}

fn point_of(contact: &PointOfPair) -> Point<f64> {
    Point { position: contact.point.position, radius: contact.point.radius, share: contact.share }
}

fn scene<const N: usize>(plant: &Plant, shot: &Snapshot, facility: bool) -> Scene<N> {
    let state = &shot.lane.state;
    let (bodies, watch) = (fields::<f64, Bodies<f64, N>>().len(), fields::<f64, Watch<f64>>().len());
    let offset = if facility { bodies + watch } else { 0 };
    let rest = &state[2 * (bodies + watch)..];
    let (robots, rest) = rest.split_at(fields::<f64, Robots<f64>>().len());
    let mut bodies_now: Bodies<f64, N> = from_slice(&state[offset..]);
    let watch_now: Watch<f64> = from_slice(&state[offset + bodies..]);
    let masses = if facility { hil_masses(&shot.params) } else { space_masses(&shot.params) };
    // Between two ticks the steps are zero: in the middle of a tick, of half a millisecond, they are these.
    bodies_now.chaser.com_step = bodies_now.chaser.momentum * (5e-4 / masses.base_mass);
    bodies_now.target.com_step = bodies_now.target.momentum * (5e-4 / masses.target_mass);
    let k = kinematics(plant, &masses, &bodies_now);
    let robots: Robots<f64> = from_slice(robots);
    let mounted = if facility { mounted_parts(plant, &shot.params, &robots) } else { k.parts };
    let tile = Tile::<f64, N>::resume(plant, Batch::whole(), shot.run, shot.tick, shot.params, &shot.lane);
    let states = tile.contact_states()[usize::from(facility)].clone();
    let contacts: Vec<_> = plant
        .contacts
        .iter()
        .zip(&states)
        .map(|(contact, state)| {
            let point = point_of(contact);
            let of = &plant.pairs[contact.pair];
            let pair = if facility { hil_pair(of, &shot.params) } else { space_pair(of, &shot.params) };
            contact_point(plant, of, &pair, &mounted, point, *state)
        })
        .collect();
    let of_shells = plant.shells.iter().zip(&states[plant.contacts.len()..]).map(|(shell, state)| {
        let of = &plant.pairs[shell.pair];
        let pair = if facility { hil_pair(of, &shot.params) } else { space_pair(of, &shot.params) };
        let sampled = sampled_shell(plant, shell, &pair, &mounted, state.approach);
        (sampled, touch_shell(plant, shell, &pair, &mounted, state))
    });
    let (shells, touches): (Vec<_>, Vec<_>) = of_shells.unzip();
    let contacts: Vec<_> = contacts.into_iter().chain(touches).collect();
    Scene {
        facility,
        bodies: bodies_now,
        watch: watch_now,
        robots,
        sensor: from_slice(rest),
        kinematics: k,
        simulated: k.parts,
        mounted,
        states,
        touch: contacts.iter().fold(no_touch(), |sum, c| gather(&sum, c)),
        latch: latch(plant, &shot.params, &mounted, watch_now.closed, 0.0),
        contacts,
        shells,
    }
}

/// The scalars of a bundle, through its own type.
fn flat<B: Bundle<f64>>(bundle: &B) -> Vec<f64> {
    to_vec(bundle)
}

/// Inputs of a stage function, one list per sample.
pub(crate) fn arguments<const N: usize>(case: &Case, function: &Function) -> Vec<Vec<f64>> {
    let mut draws = Stream::new("arguments", 0);
    let samples = case.snapshots.iter().enumerate().map(|(index, shot)| {
        let scene = scene::<N>(&case.plant, shot, index % 2 == 1);
        let mut out = Vec::new();
        for (argument, structure) in &function.arguments {
            let mut values = bundle(&case.plant, shot, &scene, index / 2, (argument, &structure.name), &mut draws);
            disturb(&mut values, &structure.fields, DISTURBANCE, &mut draws);
            out.extend(values);
        }
        out
    });
    samples.collect()
}

/// What the arm's plan wants on the scene's side.
fn arm_motion<const N: usize>(plant: &Plant, shot: &Snapshot, s: &Scene<N>) -> Vec<f64> {
    let name = if s.facility { "hil_motion_" } else { "space_motion_" };
    optional::<N, ArmMotion<f64, N>>(plant, shot, name)
}

/// The thrusters on the scene's side.
fn firing<const N: usize>(plant: &Plant, shot: &Snapshot, s: &Scene<N>) -> Vec<f64> {
    let name = if s.facility { "hil_firing_" } else { "space_firing_" };
    optional::<N, Firing<f64>>(plant, shot, name)
}

/// The ring that part B rides on, on the scene's side.
fn ring<const N: usize>(plant: &Plant, shot: &Snapshot, s: &Scene<N>) -> Vec<f64> {
    let name = if s.facility { "hil_ring_" } else { "space_ring_" };
    optional::<N, Ring<f64>>(plant, shot, name)
}

/// One argument, by the name of its struct and, where that is not enough, its own.
fn bundle<const N: usize>(
    plant: &Plant,
    shot: &Snapshot,
    s: &Scene<N>,
    index: usize,
    (argument, structure): (&str, &str),
    draws: &mut Stream,
) -> Vec<f64> {
    let p = shot.params;
    match structure {
        "Params" => flat(&p),
        "Masses" => flat(&if s.facility { hil_masses(&p) } else { space_masses(&p) }),
        "Pair" => {
            let of = &plant.pairs[index % plant.pairs.len()];
            flat(&if s.facility { hil_pair(of, &p) } else { space_pair(of, &p) })
        }
        "Bodies" => flat(&s.bodies),
        "Kinematics" => flat(&s.kinematics),
        "Watch" => flat(&s.watch),
        "Robots" => flat(&s.robots),
        "Sensor" => flat(&s.sensor),
        "Compensation" => optional::<N, Compensation<f64>>(plant, shot, "compensation_"),
        "Load" => optional::<N, Load<f64>>(plant, shot, "load_"),
        "Touch" => flat(&s.touch),
        "Asked" => {
            // As if a joint were near the end of its range, and the robots near each other, in every other sample.
            let near = f64::from(index as u32 % 2);
            flat(&Asked { near_limit: near, near_body: near, ..axes_asked(plant, &command(plant, &s.simulated)) })
        }
        "Clearance" => flat(&Clearance { arms: 0.5 * draws.normal(), depth: 0.1 * draws.normal() }),
        "Session" => optional::<N, Session<f64>>(plant, shot, "session_"),
        "Admittance" => optional::<N, Admittance<f64>>(plant, shot, "admittance_"),
        "Tracking" => optional::<N, Tracking<f64>>(plant, shot, "tracking_"),
        "Followed" => {
            let tracking = optional::<N, Tracking<f64>>(plant, shot, "tracking_");
            flat(&followed(plant, &p, &from_slice(&tracking)))
        }
        "Drives" => {
            let robot = if argument == "drives2" { "drives_b_" } else { "drives_a_" };
            optional::<N, Drives<f64>>(plant, shot, robot)
        }
        "SetPoint" => optional::<N, SetPoint<f64>>(plant, shot, "set_a_"),
        "LatchState" => flat(&s.latch),
        "PointContact" => flat(&s.contacts[index % s.contacts.len()]),
        "PointState" => flat(&s.states[index % s.states.len()]),
        "Point" => flat(&point_of(&plant.contacts[index % plant.contacts.len()])),
        "Relative" => flat(&s.shells[index % s.shells.len()].relative),
        "ShellTouch" => flat(&s.shells[index % s.shells.len()].touch),
        "ShellPoint" => {
            // Every other sample one of the deepest.
            let points = &s.shells[index % s.shells.len()].points;
            let among = if (index / 2).is_multiple_of(2) { points.len().min(6) } else { points.len() };
            flat(&points[(draws.uniform() * among as f64) as usize])
        }
        "Grip" => vec![draws.uniform(), draws.normal()],
        "Firing" => firing::<N>(plant, shot, s),
        "Ring" => ring::<N>(plant, shot, s),
        "ArmMotion" => arm_motion::<N>(plant, shot, s),
        "Actuation" => {
            let masses = if s.facility { hil_masses(&p) } else { space_masses(&p) };
            let Bodies { arm, drives, chaser, .. } = s.bodies;
            let touched = f64::from(index as u32 % 2);
            let motion = from_slice(&arm_motion::<N>(plant, shot, s));
            let firing = from_slice(&firing::<N>(plant, shot, s));
            flat(&guide(plant, &p, &masses, &arm, &drives, chaser.attitude, &s.kinematics, touched, &motion, &firing))
        }
        "Wrench" => {
            let contact = if argument == "noise" { zero_wrench() } else { total_wrench(&s.touch, &s.latch) };
            let size = if argument == "noise" { 1.0 } else { 5.0 };
            flat(&contact).into_iter().map(|value| value + size * draws.normal()).collect()
        }
        "Parts" => {
            let reference = command(plant, &s.simulated);
            flat(&match argument {
                "reference" | "last" | "second" => reference,
                "first" => extrapolate(plant, &reference, -1.0),
                "third" => extrapolate(plant, &reference, 1.0),
                "simulated" => s.simulated,
                "past" => extrapolate(plant, &s.mounted, -5.0),
                _ => s.mounted,
            })
        }
        "f32" => vec![scalar(plant, shot, s, argument, draws)],
        other => panic!("no sampler for a {other}"),
    }
}

/// A part of the state that a scenario may not have; at rest where it has none.
fn optional<const N: usize, B: Bundle<f64>>(plant: &Plant, shot: &Snapshot, prefix: &str) -> Vec<f64> {
    let (names, width) = (state_fields::<N>(plant), fields::<f64, B>().len());
    match names.iter().position(|field| field.name.starts_with(prefix)) {
        Some(row) => shot.lane.state[row..][..width].to_vec(),
        None => vec![0.0; width],
    }
}

fn zero_wrench() -> Wrench<f64> {
    Wrench { force: Vec3::zero(), moment: Vec3::zero() }
}

/// A bare scalar, by its name.
fn scalar<const N: usize>(plant: &Plant, shot: &Snapshot, s: &Scene<N>, name: &str, draws: &mut Stream) -> f64 {
    let u = draws.uniform();
    match name {
        "closed" => s.watch.closed,
        "before" => 0.1 * u,
        "gripped" => (2.0 * u).floor(),
        "time" => f64::from(shot.tick) * plant.timing.tick() + u * 1e-3,
        "periods" => 1.0 - 130.0 * u,
        "lost_before" => (u * 6.0).floor(),
        "last" | "facility" => f64::from(u8::from(u < 0.5)),
        "port_energy" => u - 0.5,
        "cycle" => plant.timing.tick(),
        "place" | "range_used" => 2.0 * u,
        "share" => 0.25 * (1.0 + (4.0 * u).floor()),
        "age" | "u" | "v" => u,
        other => panic!("no sampler for the scalar `{other}`"),
    }
}
