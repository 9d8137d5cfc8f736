//! Fingers of part A: forces, times and moments in closed form, momentum through a capture.

use super::bench::{assert_close, closing, job, run, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::arm_plan::{ArmControl, ArmGuard, ArmPhase, ArmPlan, Goal, MAX_JOINTS, Pace};
use softdock_kernels::model::{ContactPoint, Finger, Members, Model, PartShape, Shape, Solid};
use softdock_kernels::outcome::Signals;
use softdock_kernels::params::Params;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};

/// Time in which the fingers close \[s\].
const CLOSING: f64 = 0.5;
const STIFFNESS: f64 = 2e4;

fn phase(closes: Option<bool>, guards: Vec<ArmGuard>) -> ArmPhase {
    let idle = [0.0; MAX_JOINTS];
    ArmPhase {
        name: "phase".to_owned(),
        control: ArmControl::JointPd { stiffness: idle, damping: idle },
        goal: Goal::Hold,
        pace: Pace { speed: 1.0, acceleration: 1.0, jerk: 1.0, turn_speed: 1.0 },
        compliance: None,
        closes,
        guards,
    }
}

/// Balls of part A beside a block of part B, each with its way to closed.
fn gripper(fingers: &[(Vec3<f64>, Vec3<f64>)]) -> Model {
    let mut model = two_bodies(2.5e-4, 1.2, 0.0);
    (model.timing.substeps, model.timing.max_ticks) = (4, 1200);
    let points = fingers.iter().map(|(position, _)| ContactPoint { position: *position, radius: 5e-3 });
    model.contact.a = PartShape { points: points.collect(), solids: Vec::new() };
    let block = Solid { frame: Pose::identity(), shape: Shape::Box { half: vec3(0.05, 0.008, 0.05) } };
    model.contact.b = PartShape { points: Vec::new(), solids: vec![block] };
    let finger = |(index, (_, travel)): (usize, &(Vec3<f64>, Vec3<f64>))| Finger {
        members: Members { points: vec![index], solids: Vec::new() },
        travel: *travel,
    };
    model.contact.fingers = fingers.iter().enumerate().map(finger).collect();
    let plan = ArmPlan {
        phases: vec![phase(None, vec![ArmGuard { after: Some(0.1), ..ArmGuard::to(1) }]), phase(Some(true), vec![])],
        camera: None,
        grip_time: CLOSING,
        sensor_lag: 0.0,
    };
    model.guidance.plan = Some(plan);
    model
}

fn heavy() -> Params<f64> {
    let inertia = Params { base_inertia_scale: 1e9, target_inertia_scale: 1e9, ..closing(1e9, 0.0, STIFFNESS, 0.0) };
    Params { base_mass: 1e9, loop_delay: 2e-3, ..inertia }
}

fn signals(model: Model, p: Params<f64>) -> Vec<Signals> {
    let mut seen = Vec::new();
    replay(&job(model, &[p]), RunInput::new(0, p), &mut |signals| seen.push(*signals));
    seen
}

#[test]
fn a_finger_touches_at_its_time_and_presses_by_its_depth() {
    // From 30 to 10 mm: the ball touches the block at 13 mm, and ends 3 mm deep.
    let model = gripper(&[(vec3(0.01, 0.03, 0.02), vec3(0.0, -0.02, 0.0))]);
    let row = &run(model.clone(), &[heavy()])[0];
    let touch = 0.1 + CLOSING * 17.0 / 20.0;
    assert_eq!(row.flags, 0, "the finger's work is no energy from nowhere");
    for (side, metrics) in [("space", row.space), ("facility", row.hil)] {
        assert!((metrics.touch_time - touch).abs() < 3e-3, "{side}: touches at {} s", metrics.touch_time);
        assert_close(side, metrics.peak_contact_force, STIFFNESS * 3e-3, 1e-6);
    }
    let seen = signals(model, heavy());
    let last = seen[seen.len() - 1].contact;
    for wrench in last {
        // It pushes part A away along +y, at the block's face.
        let lever = vec3(0.01, 0.005, 0.02);
        let force = vec3(0.0, STIFFNESS * 3e-3, 0.0);
        assert!((wrench.force - force).norm() < 1e-3, "{:?}", wrench.force);
        assert!((wrench.moment - lever.cross(force)).norm() < 1e-4, "{:?}", wrench.moment);
    }
}

#[test]
fn opposite_fingers_hold_a_free_block_in_their_middle() {
    let fingers = [(vec3(0.0, 0.03, 0.0), vec3(0.0, -0.02, 0.0)), (vec3(0.0, -0.03, 0.0), vec3(0.0, 0.02, 0.0))];
    // The block begins 4 mm beside the middle, and is pushed there.
    let free = Params { target_mass: 2.0, offset: vec3(0.0, 4e-3, 0.0), contact_damping: 400.0, ..heavy() };
    let mut model = gripper(&fingers);
    model.timing.max_ticks = 3000;
    let row = run(model.clone(), &[free])[0];
    let seen = signals(model, free);
    let parts = &seen[seen.len() - 1].parts[0];
    assert!((parts.a.position.y - parts.b.position.y).abs() < 1e-5, "in the middle: {:?}", parts.b.position);
    assert!(row.space.linear_momentum_error < 1e-9, "{}", row.space.linear_momentum_error);
}

#[test]
fn a_moving_finger_drags_by_its_friction() {
    // A ball that is pressed into a plane slides along it with the finger: Coulomb friction along its way.
    let mut model = gripper(&[(vec3(0.0, 0.012, 0.0), vec3(-0.02, 0.0, 0.0))]);
    model.base_pose.attitude = Quat::identity();
    let p = Params { contact_friction: 0.4, bristle_stiffness: 1e5, bristle_damping: 10.0, ..heavy() };
    let seen = signals(model, p);
    let during = &seen[400].contact[0];
    let normal = STIFFNESS * 1e-3;
    assert_close("normal force", during.force.y, normal, 1e-5);
    assert_close("friction on part A, against its finger", during.force.x, 0.4 * normal, 1e-3);
}

#[test]
fn momentum_holds_through_the_grapple_of_a_tumbling_satellite() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/grapple.toml");
    let campaign = softdock_campaign::load(&path).unwrap_or_else(|problems| panic!("{problems}"));
    let params: Vec<_> = (0..4).map(|run| campaign.draw(run).expect("a draw").params).collect();
    let rows = run(campaign.scenario.model.clone(), &params);
    for row in &rows {
        for side in [row.space, row.hil] {
            // Of some kg m/s and 10 kg m^2/s.
            assert!(side.linear_momentum_error < 1e-10, "linear {}", side.linear_momentum_error);
            assert!(side.angular_momentum_error < 1e-9, "angular {}", side.angular_momentum_error);
        }
    }
    let captured = rows.iter().filter(|row| row.space.capture_time > 0.0).count();
    let touched = rows.iter().filter(|row| row.space.contact_count > 0.0).count();
    assert!(captured >= 3 && touched >= 2, "{captured} captured, {touched} touched");
}

#[test]
fn soft_impedance_lowers_the_peak_force_of_the_grapple() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/grapple.toml");
    let campaign = softdock_campaign::load(&path).unwrap_or_else(|problems| panic!("{problems}"));
    // Twice the camera's error of the campaign, so that the fingers push the pin into their middle.
    let wide = |run| {
        let params = campaign.draw(run).expect("a draw").params;
        Params { camera_offset: params.camera_offset * 2.0, ..params }
    };
    let params: Vec<_> = (0..32).map(wide).collect();
    let peaks = |stiffness: f64, damping: f64, turning: [f64; 2]| -> Vec<f64> {
        let mut model = campaign.scenario.model.clone();
        for phase in &mut model.guidance.plan.as_mut().expect("phases").phases {
            phase.control = ArmControl::CartesianImpedance {
                stiffness,
                damping,
                rotation_stiffness: turning[0],
                rotation_damping: turning[1],
                joint_damping: 5.0,
            };
        }
        run(model, &params).iter().map(|row| row.space.peak_contact_force).collect()
    };
    let (soft, stiff) = (peaks(300.0, 300.0, [100.0, 100.0]), peaks(2e4, 3000.0, [8000.0, 1000.0]));
    let pairs: Vec<_> = soft.into_iter().zip(stiff).filter(|(soft, stiff)| *soft > 0.0 && *stiff > 0.0).collect();
    let lower = pairs.iter().filter(|(soft, stiff)| soft < stiff).count();
    // Of 24 pairs 20 lower ones: at least two thirds with 95 % confidence.
    assert!(pairs.len() >= 24 && lower * 6 >= pairs.len() * 5, "{lower} of {} are lower", pairs.len());
}
