//! Where bodies stand at the start: forward kinematics of the arm, and the chaser placed from its tool.

use softdock_kernels::model::{Link, joint_motion};
use softdock_kernels::vector::{Pose, Quat, vec3};

/// Pose of the tool in the base's body frame.
pub(crate) fn end_frame(links: &[Link], slides: &[bool], angles: &[f64], tool: Pose<f64>) -> Pose<f64> {
    link_frames(links, slides, angles).last().map_or(tool, |last| last.compose(tool))
}

/// Poses of the links in the base's body frame; joints for which `slides` has no entry turn.
pub(crate) fn link_frames(links: &[Link], slides: &[bool], angles: &[f64]) -> Vec<Pose<f64>> {
    let mut at = Pose::identity();
    let joints = links.iter().zip(angles).enumerate();
    joints
        .map(|(joint, (link, angle))| {
            let slides = slides.get(joint).copied().unwrap_or(false);
            at = at.compose(link.origin).compose(joint_motion(slides, *angle));
            at
        })
        .collect()
}

/// Pose of the base in the contact frame that puts part A's frame at (-gap, 0, 0) with the contact frame's axes.
pub(crate) fn base_from_tool(tool_on_base: Pose<f64>, gap: f64) -> Pose<f64> {
    let tool = Pose { position: vec3(-gap, 0.0, 0.0), attitude: Quat::identity() };
    tool.compose(tool_on_base.inverse())
}

/// The angle of a rotation \[rad\].
#[cfg(test)]
pub(crate) fn turned_by(attitude: Quat<f64>) -> f64 {
    2.0 * attitude.v.norm().atan2(attitude.w.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::vector::{Sym3, Vec3};

    /// A planar arm of two links of 1 m: the textbook's forward kinematics.
    #[test]
    fn planar_arm() {
        let link = |x: f64| Link {
            origin: Pose { position: vec3(x, 0.0, 0.0), attitude: Quat::identity() },
            mass: 1.0,
            com: Vec3::zero(),
            inertia: Sym3::splat(0.0),
        };
        let tool = Pose { position: vec3(1.0, 0.0, 0.0), attitude: Quat::identity() };
        let (a, b) = (0.3_f64, 0.9_f64);
        let end = end_frame(&[link(0.0), link(1.0)], &[], &[a, b], tool);
        let expected = vec3(a.cos() + (a + b).cos(), a.sin() + (a + b).sin(), 0.0);
        assert!((end.position - expected).norm() < 1e-14);
        let base = base_from_tool(end, 0.25);
        let placed = base.compose(end);
        assert!((placed.position - vec3(-0.25, 0.0, 0.0)).norm() < 1e-14);
        assert!(turned_by(placed.attitude) < 1e-12);
    }
}
