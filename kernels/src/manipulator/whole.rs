//! Errors of a robot as a whole: an unknown load at the flange, a tilted base, motors coupled by their gears.

use super::Manipulator;
use crate::bundle;
use crate::fields::filled;
use crate::model::Link;
use crate::vector::{Quat, Sym3, Vec3, vec3};

bundle! {
    /// Errors that load several axes at once.
    RobotErrors {
        payload: R, "kg", "mass at the flange beyond the model's";
        payload_place_x: R, "m", "its centre from the flange, in flange axes, x";
        payload_place_y: R, "m", "the same, y";
        payload_place_z: R, "m", "the same, z";
        tilt_x: R, "rad", "tilt of the base against gravity about its x axis";
        tilt_y: R, "rad", "tilt of the base against gravity about its y axis";
    }
}

bundle! {
    /// Coupling of an axis to the one before: its motor turns by the angle of the axis plus `ratio` times that of the
    /// one before.
    AxisCoupling {
        coupling_ratio: R, "1", "turns of the motor by the axis before, per turn by its own axis";
        coupling_inertia: R, "kg m^2", "inertia of the motor at the joint's side";
        coupling_viscous: R, "N m s/rad", "viscous friction of the motor at the joint's side";
        coupling_coulomb: R, "N m", "Coulomb friction of the motor at the joint's side";
        coupling_torque: R, "1", "share of the axis' reported torque that acts on the axis before, times the ratio";
    }
}

impl RobotErrors<f64> {
    /// A robot without errors.
    pub fn null() -> Self {
        filled(0.0)
    }
}

impl AxisCoupling<f64> {
    /// An axis that is not coupled.
    pub fn null() -> Self {
        filled(0.0)
    }
}

impl Manipulator {
    /// Returns the robot with a point mass \[kg\] more at a place in flange axes \[m\].
    #[must_use]
    pub fn with_load(&self, load: f64, place: Vec3<f64>) -> Self {
        let mut laden = self.clone();
        if let Some(joint) = laden.joints.last_mut() {
            let Link { mass, com, inertia, .. } = joint.link;
            let at = self.flange.position + self.flange.attitude.rotate(place);
            let whole = mass + load;
            let centre = (com * mass + at * load) * (1.0 / whole);
            let moved = Sym3::point_mass(mass, com - centre) + Sym3::point_mass(load, at - centre);
            joint.link = Link { mass: whole, com: centre, inertia: inertia + moved, ..joint.link };
        }
        laden
    }

    /// Returns the robot with its errors as a whole.
    #[must_use]
    pub fn with_errors(&self, errors: &RobotErrors<f64>) -> Self {
        let RobotErrors { payload, payload_place_x, payload_place_y, payload_place_z, tilt_x, tilt_y } = *errors;
        let mut robot = match payload == 0.0 {
            true => self.clone(),
            false => self.with_load(payload, vec3(payload_place_x, payload_place_y, payload_place_z)),
        };
        if (tilt_x, tilt_y) != (0.0, 0.0) {
            // Gravity in the axes of the tilted base.
            robot.gravity = Quat::from_rotation_vector(vec3(tilt_x, tilt_y, 0.0)).rotate_back(self.gravity);
        }
        robot
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::sample;

    #[test]
    fn null_errors_change_nothing() {
        let robot = sample::robot();
        assert_eq!(robot.with_errors(&RobotErrors::null()), robot);
    }

    #[test]
    fn load_moves_the_centre_of_mass_of_the_last_link() {
        let robot = sample::robot();
        let laden = robot.with_load(2.0, vec3(0.0, 0.0, 0.1));
        let (own, with) = (robot.joints.last().expect("joints").link, laden.joints.last().expect("joints").link);
        assert!((with.mass - own.mass - 2.0).abs() < 1e-12);
        let at = robot.flange.position + robot.flange.attitude.rotate(vec3(0.0, 0.0, 0.1));
        let moment = with.com * with.mass - own.com * own.mass - at * 2.0;
        assert!(moment.dot(moment) < 1e-20);
    }

    #[test]
    fn tilt_about_x_turns_gravity_towards_y() {
        let robot = sample::robot();
        let tilted = robot.with_errors(&RobotErrors { tilt_x: 0.01, ..RobotErrors::null() });
        // A base that is turned by +x sees its own y axis rise, so that gravity has a component along -y.
        assert!((tilted.gravity.y + robot.gravity.z.abs() * 0.01).abs() < 1e-3, "{:?}", tilted.gravity);
    }
}
