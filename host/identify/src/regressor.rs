//! Rigid-body regressor: joint torques as linear functions of the links' inertial parameters.
//!
//! Each link's force and moment about its own frame's origin, in its own axes, then moved to the joints below it.
//! Khalil, Dombre, Modeling, Identification and Control of Robots (2002), ch. 12.

use crate::layout::INERTIAL;
use softdock_kernels::manipulator::{Joint, Manipulator};
use softdock_kernels::vector::{Mat3, Pose, Quat, Vec3, vec3};

/// Returns the torque of each joint per inertial parameter of each link: `[joint][10 link + parameter]`, shape N x 10
/// N.
///
/// Angles \[rad\], rates \[rad/s\], accelerations \[rad/s^2\]; the parameters are about the link frames' origins.
pub fn rigid_regressor(robot: &Manipulator, angle: &[f64], rate: &[f64], acceleration: &[f64]) -> Vec<Vec<f64>> {
    let n = robot.joints.len();
    let mut rows = vec![vec![0.0; INERTIAL * n]; n];
    let mut axes: Vec<(Vec3<f64>, Vec3<f64>)> = Vec::with_capacity(n);
    let mut frame = Pose::identity();
    let (mut omega, mut alpha, mut gain) = (Vec3::zero(), Vec3::zero(), -robot.gravity);
    for i in 0..n {
        let below = frame.position;
        frame = frame.compose(robot.joints[i].link.origin).compose(turned(&robot.joints[i], angle[i]));
        let arm = frame.position - below;
        gain = gain + alpha.cross(arm) + omega.cross(omega.cross(arm));
        let axis = frame.attitude.rotate(vec3(0.0, 0.0, robot.joints[i].sign));
        alpha = alpha + axis * acceleration[i] + omega.cross(axis) * rate[i];
        omega = omega + axis * rate[i];
        axes.push((axis, frame.position));
        let back = |v: Vec3<f64>| frame.attitude.rotate_back(v);
        let per_parameter = unit_wrenches(back(omega), back(alpha), back(gain));
        let rotation = frame.attitude.matrix();
        for (parameter, (force, moment)) in per_parameter.into_iter().enumerate() {
            let (force, moment) = (rotation.times(force), rotation.times(moment));
            for (j, (axis, foot)) in axes.iter().enumerate() {
                rows[j][INERTIAL * i + parameter] = axis.dot(moment + (frame.position - *foot).cross(force));
            }
        }
    }
    rows
}

fn turned(joint: &Joint, angle: f64) -> Pose<f64> {
    let (sin, cos) = (0.5 * joint.sign * angle).sin_cos();
    Pose { position: Vec3::zero(), attitude: Quat { w: cos, v: vec3(0.0, 0.0, sin) } }
}

/// Force and moment about the link's origin for a unit of each inertial parameter; all in link axes.
fn unit_wrenches(omega: Vec3<f64>, alpha: Vec3<f64>, gain: Vec3<f64>) -> [(Vec3<f64>, Vec3<f64>); INERTIAL] {
    let zero = Vec3::zero();
    // d(I w) per element, in the order xx, xy, xz, yy, yz, zz.
    let products = |v: Vec3<f64>| {
        [
            vec3(v.x, 0.0, 0.0),
            vec3(v.y, v.x, 0.0),
            vec3(v.z, 0.0, v.x),
            vec3(0.0, v.y, 0.0),
            vec3(0.0, v.z, v.y),
            vec3(0.0, 0.0, v.z),
        ]
    };
    let (turning, spinning) = (products(alpha), products(omega));
    let unit = Mat3 { x: vec3(1.0, 0.0, 0.0), y: vec3(0.0, 1.0, 0.0), z: vec3(0.0, 0.0, 1.0) };
    let units = [unit.x, unit.y, unit.z];
    std::array::from_fn(|k| match k {
        0..6 => (zero, turning[k] + omega.cross(spinning[k])),
        6..9 => {
            let e = units[k - 6];
            (alpha.cross(e) + omega.cross(omega.cross(e)), e.cross(gain))
        }
        _ => (gain, zero),
    })
}
