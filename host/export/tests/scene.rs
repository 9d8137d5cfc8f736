//! Exported scenes, read back by another reader.

use softdock_campaign::Campaign;
use softdock_export::{SceneJoint, SceneTree, mjcf_files, urdf_files};
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use std::path::Path;

fn plant(campaign: &str) -> Plant {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
    Plant::new(Campaign::load(&root.join(format!("{campaign}.toml"))).expect("a campaign").scenario.model)
}

/// Rotation by roll, pitch and yaw about fixed axes \[rad\], as URDF defines it.
fn rotation([roll, pitch, yaw]: [f64; 3]) -> Quat<f64> {
    let about = |axis: Vec3<f64>, angle: f64| Quat { w: (0.5 * angle).cos(), v: axis * (0.5 * angle).sin() };
    let [x, y, z] = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    about(z, yaw).compose(about(y, pitch)).compose(about(x, roll))
}

fn pose(origin: &urdf_rs::Pose) -> Pose<f64> {
    let [x, y, z] = origin.xyz.0;
    Pose { position: vec3(x, y, z), attitude: rotation(origin.rpy.0) }
}

/// Pose of a link of a URDF with the joints at these positions.
fn urdf_pose(robot: &urdf_rs::Robot, link: &str, position: &dyn Fn(&str) -> f64) -> Pose<f64> {
    let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == link) else { return Pose::identity() };
    let [x, y, z] = joint.axis.xyz.0;
    let (axis, q) = (vec3(x, y, z), position(&joint.name));
    let motion = match joint.joint_type {
        urdf_rs::JointType::Revolute => {
            Pose { position: Vec3::zero(), attitude: Quat { w: (0.5 * q).cos(), v: axis * (0.5 * q).sin() } }
        }
        urdf_rs::JointType::Prismatic => Pose { position: axis * q, attitude: Quat::identity() },
        _ => Pose::identity(),
    };
    urdf_pose(robot, &joint.parent.link, position).compose(pose(&joint.origin)).compose(motion)
}

fn assert_near(found: Pose<f64>, expected: Pose<f64>, what: &str) {
    let turn = found.attitude.compose(Quat { w: expected.attitude.w, v: expected.attitude.v * -1.0 });
    let (way, angle) = ((found.position - expected.position).norm(), 2.0 * turn.v.norm());
    assert!(way < 1e-9 && angle < 1e-9, "{what}: {way} m, {angle} rad");
}

#[test]
fn urdf_has_the_masses_and_the_kinematics_of_the_plant() {
    for campaign in ["probe_drogue", "berth", "insert", "grapple", "soft_capture", "smoke_joint"] {
        let plant = plant(campaign);
        let tree = SceneTree::of(campaign, &plant);
        let exported = urdf_files(&tree);
        let robot = urdf_rs::read_from_string(&exported.files[0].text).expect(campaign);
        assert_eq!(robot.links.len(), tree.frames.len(), "{campaign}");
        for (link, frame) in robot.links.iter().zip(&tree.frames) {
            let mass = frame.inertial.map_or(0.0, |inertial| inertial.mass);
            assert!((link.inertial.mass.value - mass).abs() <= 1e-12 * mass, "{campaign}: {}", link.name);
        }
        // Every mesh that it names is there.
        let named = exported.files[0].text.matches("filename=\"").count();
        assert_eq!(named, 2 * (exported.files.len() - 1), "{campaign}: once to see, once to touch");
        let start = |name: &str| {
            let frame = tree.find(name.strip_suffix("_joint").expect("a joint")).expect("a frame");
            tree.frames[frame].start
        };
        // Part A at the start posture, by the chain of the physics.
        let part = plant.base_pose.compose(plant.tool_start);
        assert_near(urdf_pose(&robot, "part_a", &start), part, campaign);
        let tree_pose = tree.world_pose(tree.find("part_a").expect("part A"), &|at| tree.frames[at].start);
        assert_near(tree_pose, part, campaign);
        assert_near(urdf_pose(&robot, "part_b", &start), plant.target_pose.compose(plant.seat), campaign);
        assert!(tree.frames.iter().filter(|frame| frame.joint == SceneJoint::Free).count() == 2);
    }
}

#[test]
fn files_name_what_they_leave_out_and_escape_names() {
    let plant = plant("plate_impact");
    let mut tree = SceneTree::of("a<b>&\"c", &plant);
    tree.frames[1].name = "<script>".to_owned();
    for exported in [urdf_files(&tree), mjcf_files(&tree, 0.3, 1e-3)] {
        let text = &exported.files[0].text;
        assert!(!text.contains("<script>") && text.contains("&lt;script&gt;"), "{text}");
        assert!(exported.notes.iter().any(|note| note.contains("left out")), "{:?}", exported.notes);
        assert!(exported.notes.iter().all(|note| text.contains(&note.replace('-', "‐"))), "{:?}", exported.notes);
    }
}
