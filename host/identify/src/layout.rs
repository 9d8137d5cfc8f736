//! Parameter vector: 13 per joint as in the reference facility's paper, followed by offsets and further friction
//! parameters.

use softdock_campaign::Robot;
use softdock_kernels::vector::Sym3;

/// Inertial parameters of a link: inertia about the link frame's origin, mass times centre of mass, mass.
pub const INERTIAL: usize = 10;

/// Parameters per joint: inertial ones, reflected rotor inertia, Coulomb and viscous friction.
pub const PER_JOINT: usize = 13;

/// Names and units of the 13, in the paper's order (eq. 5).
const NAMES: [(&str, &str); PER_JOINT] = [
    ("Ixx", "kg m^2"),
    ("Ixy", "kg m^2"),
    ("Ixz", "kg m^2"),
    ("Iyy", "kg m^2"),
    ("Iyz", "kg m^2"),
    ("Izz", "kg m^2"),
    ("mx", "kg m"),
    ("my", "kg m"),
    ("mz", "kg m"),
    ("m", "kg"),
    ("Ia", "kg m^2"),
    ("fc", "N m"),
    ("fv", "N m s/rad"),
];

/// Indices of the parameters in the vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Number of joints.
    pub joints: usize,
    /// Joints with a counterbalance.
    pub counterweights: Vec<usize>,
}

impl Layout {
    /// Returns the layout of a robot's parameters.
    pub fn of(robot: &Robot) -> Self {
        let joints = &robot.model.joints;
        let balanced = (0..joints.len()).filter(|joint| joints[*joint].counterweight.is_some());
        Self { joints: joints.len(), counterweights: balanced.collect() }
    }

    /// Returns the length of the vector.
    pub fn len(&self) -> usize {
        (PER_JOINT + 2) * self.joints + 2 * self.counterweights.len()
    }

    /// Returns whether there are no parameters (a robot without joints).
    pub fn is_empty(&self) -> bool {
        self.joints == 0
    }

    /// Returns the index of the first of the ten inertial parameters of a link.
    pub fn inertial(&self, joint: usize) -> usize {
        PER_JOINT * joint
    }

    /// Returns the index of the reflected rotor inertia \[kg m^2\].
    pub fn rotor(&self, joint: usize) -> usize {
        PER_JOINT * joint + 10
    }

    /// Returns the index of the Coulomb friction \[N m\].
    pub fn coulomb(&self, joint: usize) -> usize {
        PER_JOINT * joint + 11
    }

    /// Returns the index of the viscous friction \[N m s/rad\].
    pub fn viscous(&self, joint: usize) -> usize {
        PER_JOINT * joint + 12
    }

    /// Returns the index of the torque offset \[N m\].
    pub fn offset(&self, joint: usize) -> usize {
        PER_JOINT * self.joints + 2 * joint
    }

    /// Returns the index of the static friction beyond Coulomb's \[N m\].
    pub fn stribeck(&self, joint: usize) -> usize {
        self.offset(joint) + 1
    }

    /// Returns the index of the counterbalance's factors of sin q and cos q \[N m\], if the joint has one.
    pub fn counterweight(&self, joint: usize) -> Option<usize> {
        let place = self.counterweights.iter().position(|balanced| *balanced == joint)?;
        Some((PER_JOINT + 2) * self.joints + 2 * place)
    }

    /// Returns the name (`Izz 2`) and unit of a parameter.
    pub fn name(&self, index: usize) -> (String, &'static str) {
        let (plain, offsets) = (PER_JOINT * self.joints, 2 * self.joints);
        if index < plain {
            let (name, unit) = NAMES[index % PER_JOINT];
            return (format!("{name} {}", index / PER_JOINT + 1), unit);
        }
        let rest = index - plain;
        if rest < offsets {
            let name = if rest.is_multiple_of(2) { "offset" } else { "fs" };
            return (format!("{name} {}", rest / 2 + 1), "N m");
        }
        let rest = rest - offsets;
        let name = if rest.is_multiple_of(2) { "balance sin" } else { "balance cos" };
        (format!("{name} {}", self.counterweights[rest / 2] + 1), "N m")
    }

    /// Returns the parameter values of a robot model.
    pub fn values(&self, robot: &Robot) -> Vec<f64> {
        let mut values = vec![0.0; self.len()];
        for (i, joint) in robot.model.joints.iter().enumerate() {
            let link = &joint.link;
            let about_origin = link.inertia + Sym3::point_mass(link.mass, link.com);
            let first = link.com * link.mass;
            let at = self.inertial(i);
            let Sym3 { xx, yy, zz, xy, xz, yz } = about_origin;
            let inertial = [xx, xy, xz, yy, yz, zz, first.x, first.y, first.z, link.mass];
            values[at..at + INERTIAL].copy_from_slice(&inertial);
            values[self.rotor(i)] = joint.drive.reflected_inertia();
            values[self.coulomb(i)] = joint.friction.coulomb;
            values[self.viscous(i)] = joint.friction.viscous;
            values[self.offset(i)] = joint.drive.torque_offset;
            values[self.stribeck(i)] = joint.friction.stribeck;
            if let (Some(at), Some(c)) = (self.counterweight(i), joint.counterweight) {
                // The drive feels +C sin(q - angle).
                values[at] = c.torque * c.angle.cos();
                values[at + 1] = -c.torque * c.angle.sin();
            }
        }
        values
    }
}
