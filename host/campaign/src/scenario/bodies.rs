//! Base, arm, target and where the parts stand on them.

use super::{arm_drive, held};
use crate::arm::{self, Arm};
use crate::check::Checker;
use crate::inertia::fault;
use crate::placement::end_frame;
use crate::source::Source;
use crate::written::At;
use crate::written::scenario::{ArmTable, InertiaTable, ScenarioFile};
use softdock_kernels::manipulator::ArmDrive;
use softdock_kernels::model::{Brakes, Held, Link};
use softdock_kernels::params::Params;
use softdock_kernels::range::{ANGLE, Range};
use softdock_kernels::vector::{Pose, Sym3};

/// The bodies of a scenario.
pub(crate) struct Bodies {
    pub(crate) base_inertia: Sym3<f64>,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<String>,
    pub(crate) angles: Vec<f64>,
    pub(crate) drives: Vec<ArmDrive>,
    pub(crate) brakes: Brakes,
    pub(crate) tool: Pose<f64>,
    pub(crate) target_inertia: Sym3<f64>,
    pub(crate) target_pose: Pose<f64>,
    pub(crate) seat: Pose<f64>,
    pub(crate) held: Held,
    pub(crate) urdf: Option<Source>,
    base_mass: f64,
    target_mass: f64,
}

impl Bodies {
    /// Writes the nominal masses.
    pub(crate) fn masses(&self, p: &mut Params<f64>) {
        p.base_mass = self.base_mass;
        p.target_mass = self.target_mass;
    }

    /// A place for the base when none is known.
    pub(crate) fn base_at_origin(&self) -> Pose<f64> {
        end_frame(&self.links, &self.angles, self.tool).inverse()
    }
}

pub(crate) fn read(c: &mut Checker, file: &ScenarioFile) -> Bodies {
    let held = held::read(file);
    let (base_mass, base_inertia) = held::base(c, file, held);
    let (target_mass, target_inertia) = held::target(c, file, held);
    let part_a = c.pose(&file.part_a.position, &file.part_a.rotation);
    let seat = c.pose(&file.part_b.position, &file.part_b.rotation);
    let target_pose = if file.target.position.is_some() || file.target.rotation.is_some() {
        c.pose(&file.target.position, &file.target.rotation)
    } else {
        seat.inverse()
    };
    let mut bodies = Bodies {
        base_inertia,
        links: Vec::new(),
        joints: Vec::new(),
        angles: Vec::new(),
        drives: Vec::new(),
        brakes: Brakes::Open,
        tool: part_a,
        target_inertia,
        target_pose,
        seat,
        held,
        urdf: None,
        base_mass,
        target_mass,
    };
    match (&file.arm, &file.part_a.link) {
        (Some(table), _) => read_arm(c, table, file, part_a, &mut bodies),
        (None, Some(link)) => c.refuse(&link.span, "this link needs an arm", "remove it, or add [arm]"),
        (None, None) => {}
    }
    bodies
}

fn read_arm(c: &mut Checker, table: &ArmTable, file: &ScenarioFile, part_a: Pose<f64>, bodies: &mut Bodies) {
    let mount = c.pose(&table.position, &table.rotation);
    let source = match c.read_beside(&table.urdf) {
        Ok(source) => source,
        Err(problems) => return c.problems.extend(problems),
    };
    let arm = match arm::read(&source, mount, arm::BaseMass::Refused) {
        Ok(arm) => arm,
        Err(problems) => return c.problems.extend(problems),
    };
    bodies.angles = angles(c, table, &arm);
    if let Some(drive) = &table.drive {
        (bodies.drives, bodies.brakes) = arm_drive::read(c, &drive.value, &arm, &bodies.angles);
    }
    let link = file.part_a.link.as_ref();
    match arm.frame(link.map(|link| link.value.as_str())) {
        Ok(frame) => bodies.tool = frame.compose(part_a),
        Err(message) => {
            let span = link.map_or(table.urdf.span.clone(), |link| link.span.clone());
            c.refuse(&span, message, "name the last moving link, or one that is fixed to it");
        }
    }
    (bodies.links, bodies.joints, bodies.urdf) = (arm.links, arm.joints, Some(source));
}

/// Start angles, one per joint and inside the joint's limits.
fn angles(c: &mut Checker, table: &ArmTable, arm: &Arm) -> Vec<f64> {
    let angles = c.list(&table.angles, arm.joints.len(), "rad", Range::size(ANGLE));
    for (index, angle) in angles.iter().enumerate() {
        let (lower, upper) = arm.limits[index];
        if !(lower..=upper).contains(angle)
            && let Some(written) = table.angles.value.get(index)
        {
            let (lower, upper) = (lower.to_degrees(), upper.to_degrees());
            let message = format!("joint `{}` does not reach this angle", arm.joints[index]);
            let remedy = format!("write an angle from {lower:.3} deg to {upper:.3} deg, the limits in the URDF");
            c.refuse(&written.span, message, remedy);
        }
    }
    angles
}

/// An inertia that a rigid body can have \[kg m^2\].
pub(super) fn inertia(c: &mut Checker, table: &At<InertiaTable>) -> Sym3<f64> {
    let noted = c.problems.len();
    let inertia = c.inertia(&table.value);
    if c.problems.len() == noted
        && let Some(fault) = fault(inertia)
    {
        let remedy = "take the tensor about the centre of mass from its source again; off-diagonal elements are \
                      matrix elements, with the sign that they have in the matrix";
        c.refuse(&table.span, format!("no rigid body has this inertia: {fault}"), remedy);
    }
    inertia
}
