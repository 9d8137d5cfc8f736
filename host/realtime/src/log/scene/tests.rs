//! The URDF of the shipped facility agrees with our own kinematics.

#[path = "../../../tests/drive/urdf.rs"]
mod urdf;

use super::*;
use crate::log::topics::default_names;
use softdock_campaign::Campaign;
use softdock_kernels::philox::uniform;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use urdf::{about, apart, origin_of, pose_in_parent, pose_of, turned};
use urdf_rs::{Geometry, JointType};

fn shipped() -> (Plant, Station) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml");
    let campaign = Campaign::load(&file).expect("the shipped campaign");
    let station = campaign.scenario.station.clone().expect("it names its facility");
    (Plant::new(campaign.scenario.model), station)
}

fn described(plant: &Plant, station: &Station) -> (LoggedScene, urdf_rs::Robot) {
    let scene = LoggedScene::new(plant, station, &default_names()).expect("in reach");
    let urdf = urdf_rs::read_from_string(&scene.urdf).expect("a URDF");
    (scene, urdf)
}

/// Positions of the axes of both robots within their limits, in controller coordinates.
fn positions(station: &Station, arms: &Arms, number: u32) -> [[f64; AXES]; 2] {
    let limits = arms.limits(station);
    [0, 1].map(|robot| {
        std::array::from_fn(|axis| {
            let share = uniform(3, "axes", robot as u64, number * AXES as u32 + axis as u32);
            let limit = limits[axis];
            if axis == RAIL && robot == 1 { 0.0 } else { limit.lower + share * (limit.upper - limit.lower) }
        })
    })
}

#[test]
fn urdf_kinematics_match_ours() {
    let (plant, station) = shipped();
    let arms = Arms::new(&plant, &station).expect("in reach");
    let (scene, urdf) = described(&plant, &station);
    for number in 0..200 {
        let axes = positions(&station, &arms, number);
        let named = default_names().into_iter().zip(axes).flat_map(|(names, axes)| names.into_iter().zip(axes));
        let named: BTreeMap<String, f64> = named.collect();
        for (robot, axes) in axes.iter().enumerate() {
            let held = arms.part_on(robot, axes, &[0.0; AXES]);
            let held = Pose { position: held.position, attitude: held.attitude };
            let part = pose_of(&urdf, &format!("robot_{}_part", robot + 1), &named);
            assert!(apart(&part, &held) < 1e-9, "part on robot {}: {}", robot + 1, apart(&part, &held));
            let [base, tool] =
                ["base", "tool"].map(|frame| pose_of(&urdf, &format!("robot_{}_{frame}", robot + 1), &named));
            let tool = base.inverse().compose(tool);
            assert!(apart(&tool, &arms.tool_pose(robot, axes)) < 1e-9, "tool of robot {}", robot + 1);
        }
        let part = pose_of(&urdf, "robot_1_part", &named);
        assert!(apart(&scene.part_a(|axis| axes[0][axis]), &part) < 1e-9, "part A of the transforms");
        let sensor = part.inverse().compose(pose_of(&urdf, SENSOR_FRAME, &named));
        assert!(apart(&sensor, &station.sensor.frame) < 1e-9, "the sensor in part A");
    }
}

#[test]
fn transforms_match_the_urdf() {
    let (plant, station) = shipped();
    let arms = Arms::new(&plant, &station).expect("in reach");
    let (scene, urdf) = described(&plant, &station);
    let axes = positions(&station, &arms, 7);
    for frame in &scene.fixed {
        let joint = urdf.joints.iter().find(|joint| joint.child.link == frame.child).expect("a joint");
        assert_eq!((joint.parent.link.as_str(), &joint.joint_type), (frame.parent.as_str(), &JointType::Fixed));
        assert!(apart(&origin_of(joint), &frame.pose) < 1e-9, "{}", frame.child);
    }
    for (robot, frame) in scene.moving.iter().enumerate().flat_map(|(r, frames)| frames.iter().map(move |f| (r, f))) {
        let joint = urdf.joints.iter().find(|joint| joint.child.link == frame.child).expect("a joint");
        assert_eq!((&joint.name, &joint.parent.link), (&default_names()[robot][frame.axis], &frame.parent));
        let position = axes[robot][frame.axis];
        let named = BTreeMap::from([(joint.name.clone(), position)]);
        assert!(apart(&pose_in_parent(joint, &named), &frame.pose(position)) < 1e-9, "{}", frame.child);
    }
}

#[test]
fn urdf_is_one_tree_with_all_axes_and_capsules() {
    let (plant, station) = shipped();
    let (_, urdf) = described(&plant, &station);
    let children: BTreeSet<&str> = urdf.joints.iter().map(|joint| joint.child.link.as_str()).collect();
    assert_eq!(children.len(), urdf.joints.len(), "a link with two parents");
    let roots: Vec<&str> =
        urdf.links.iter().map(|link| link.name.as_str()).filter(|name| !children.contains(name)).collect();
    assert_eq!(roots, [LABORATORY_FRAME]);
    let moving = urdf.joints.iter().filter(|joint| joint.joint_type != JointType::Fixed);
    let names: BTreeSet<String> = moving.map(|joint| joint.name.clone()).collect();
    let mut expected: BTreeSet<String> = default_names().into_iter().flatten().collect();
    // Robot 2 has no rail: that axis of its JointState moves nothing.
    assert!(expected.remove("robot_2_rail") && urdf.joints.iter().any(|joint| joint.name == "robot_2_rail"));
    assert_eq!(names, expected);
    let arms = Arms::new(&plant, &station).expect("in reach");
    let limit = &urdf.joints.iter().find(|joint| joint.name == "robot_1_joint_2").expect("axis 2").limit;
    let own = arms.limits(&station)[1];
    assert_eq!((limit.lower, limit.upper, limit.velocity), (own.lower, own.upper, own.speed));
    for robot in [1, 2] {
        for capsule in &station.model.capsules {
            let name = format!("robot_{robot}_link_{}", capsule.joint + 1);
            let link = urdf.links.iter().find(|link| link.name == name).expect("a link");
            let has = |wanted: &dyn Fn(&Geometry) -> bool| link.visual.iter().filter(|v| wanted(&v.geometry)).count();
            assert!(has(&|g| matches!(g, Geometry::Cylinder { .. })) >= 1, "{name}");
            let way = capsule.axis.to - capsule.axis.from;
            let cylinder = |g: &Geometry| {
                matches!(g, Geometry::Cylinder { radius, length }
                    if *radius == capsule.radius && (length - way.norm()).abs() < 1e-12)
            };
            assert_eq!(has(&cylinder), 1, "{name}");
            assert!(has(&|g| matches!(g, Geometry::Sphere { .. })) >= 2, "{name}");
        }
    }
    let last = urdf.links.iter().find(|link| link.name == "robot_2_link_6").expect("a link");
    assert_eq!(last.visual.len(), 6, "the flange and the tool");
}

#[test]
fn cylinder_is_aligned_with_its_capsule() {
    for towards in [vec3(0.3, -0.2, 0.9), vec3(0.0, 0.0, -1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, -1.0, 1e-6)] {
        let found = z_towards(towards).rotate(vec3(0.0, 0.0, 1.0));
        assert!((found - towards * (1.0 / towards.norm())).norm() < 1e-9, "{towards:?}: {found:?}");
    }
}

#[test]
fn roll_pitch_yaw_round_trip_including_straight_up() {
    for number in 0..3000 {
        let draw = |place: u32| 2.0 * uniform(5, "attitude", number, place) - 1.0;
        let v = vec3(draw(0), draw(1), draw(2));
        let mut attitude = Quat { w: draw(3), v }.normalized();
        if number % 3 == 0 {
            // Up or down, then any yaw.
            let up = about(vec3(0.0, 1.0, 0.0), if number % 2 == 0 { 1.0 } else { -1.0 } * std::f64::consts::FRAC_PI_2);
            attitude = about(vec3(0.0, 0.0, 1.0), 3.0 * draw(4)).compose(up).attitude;
        }
        let rpy = roll_pitch_yaw(attitude);
        let back = turned([rpy.x, rpy.y, rpy.z]);
        let there = Pose { position: Vec3::zero(), attitude };
        assert!(apart(&back, &there) < 1e-9, "{attitude:?}: {rpy:?}");
    }
}
