//! Forward kinematics of a URDF, as its specification defines it.

use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use std::collections::BTreeMap;
use urdf_rs::JointType;

/// Returns a rotation about an axis.
pub(crate) fn about(axis: Vec3<f64>, angle: f64) -> Pose<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Pose { position: Vec3::zero(), attitude: Quat { w: cos, v: axis * sin } }
}

/// Returns a rotation by roll, pitch and yaw about fixed axes.
pub(crate) fn turned([roll, pitch, yaw]: [f64; 3]) -> Pose<f64> {
    let [x, y, z] = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    about(z, yaw).compose(about(y, pitch)).compose(about(x, roll))
}

/// Returns the origin of a joint.
pub(crate) fn origin_of(joint: &urdf_rs::Joint) -> Pose<f64> {
    let [x, y, z] = joint.origin.xyz.0;
    Pose { position: vec3(x, y, z), ..turned(joint.origin.rpy.0) }
}

/// Returns the pose of a joint's child in its parent.
pub(crate) fn pose_in_parent(joint: &urdf_rs::Joint, positions: &BTreeMap<String, f64>) -> Pose<f64> {
    let [x, y, z] = joint.axis.xyz.0;
    let axis = vec3(x, y, z);
    let way = match joint.joint_type {
        JointType::Fixed => Pose::identity(),
        JointType::Revolute => about(axis, positions[&joint.name]),
        JointType::Prismatic => Pose { position: axis * positions[&joint.name], attitude: Quat::identity() },
        ref other => panic!("{other:?}"),
    };
    origin_of(joint).compose(way)
}

/// Returns the pose of a link in the root, from the positions of the joints by their names.
pub(crate) fn pose_of(urdf: &urdf_rs::Robot, link: &str, positions: &BTreeMap<String, f64>) -> Pose<f64> {
    let Some(joint) = urdf.joints.iter().find(|joint| joint.child.link == link) else {
        return Pose::identity();
    };
    pose_of(urdf, &joint.parent.link, positions).compose(pose_in_parent(joint, positions))
}

/// Returns the distance \[m\] or angle \[rad\] between two poses, the greater of both, accurate for small ones.
pub(crate) fn apart(one: &Pose<f64>, two: &Pose<f64>) -> f64 {
    let turn = one.attitude.compose(two.attitude.conjugate());
    (one.position - two.position).norm().max(2.0 * turn.v.norm())
}
