//! The vector of parameters: 13 per joint as in the reference facility's paper, then offsets and friction beyond it.

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

/// Where each parameter stands in the vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Number of joints.
    pub joints: usize,
    /// Joints with a counterbalance.
    pub counterweights: Vec<usize>,
}

impl Layout {
    /// The parameters of a robot.
    pub fn of(robot: &Robot) -> Self {
        let joints = &robot.model.joints;
        let balanced = (0..joints.len()).filter(|joint| joints[*joint].counterweight.is_some());
        Self { joints: joints.len(), counterweights: balanced.collect() }
    }

    /// Length of the vector.
    pub fn len(&self) -> usize {
        (PER_JOINT + 2) * self.joints + 2 * self.counterweights.len()
    }

    /// A robot without joints has no parameters.
    pub fn is_empty(&self) -> bool {
        self.joints == 0
    }

    /// First of the ten inertial parameters of a link.
    pub fn inertial(&self, joint: usize) -> usize {
        PER_JOINT * joint
    }

    /// Reflected rotor inertia \[kg m^2\].
    pub fn rotor(&self, joint: usize) -> usize {
        PER_JOINT * joint + 10
    }

    /// Coulomb friction \[N m\].
    pub fn coulomb(&self, joint: usize) -> usize {
        PER_JOINT * joint + 11
    }

    /// Viscous friction \[N m s/rad\].
    pub fn viscous(&self, joint: usize) -> usize {
        PER_JOINT * joint + 12
    }

    /// Torque offset \[N m\].
    pub fn offset(&self, joint: usize) -> usize {
        PER_JOINT * self.joints + 2 * joint
    }

    /// Static friction beyond Coulomb's \[N m\].
    pub fn stribeck(&self, joint: usize) -> usize {
        self.offset(joint) + 1
    }

    /// Factors of sin q and cos q of the counterbalance of a joint, if it has one \[N m\].
    pub fn counterweight(&self, joint: usize) -> Option<usize> {
        let place = self.counterweights.iter().position(|balanced| *balanced == joint)?;
        Some((PER_JOINT + 2) * self.joints + 2 * place)
    }

    /// Name (`Izz 2`) and unit of a parameter.
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

    /// The parameters that a robot model holds.
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
