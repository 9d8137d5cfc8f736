//! Base, arm, target and where the parts stand on them.

use super::held::Massive;
use super::sliding::units;
use super::{arm_drive, held};
use crate::arm::{self, Arm, HeldJoint};
use crate::check::Checker;
use crate::inertia::fault;
use crate::mesh::{MeshFile, mass_of};
use crate::placement::end_frame;
use crate::source::Source;
use crate::suggest::suggestion;
use crate::units::show;
use crate::written::scenario::{ArmTable, InertiaTable, ScenarioFile};
use crate::written::{At, Quantities};
use softdock_kernels::manipulator::ArmDrive;
use softdock_kernels::model::{Brakes, Contact, Held, Link, Side};
use softdock_kernels::params::Params;
use softdock_kernels::range::{ANGLE, LENGTH, Range};
use softdock_kernels::vector::{Pose, Sym3};
use std::collections::BTreeMap;

/// The bodies of a scenario.
pub(crate) struct Bodies {
    pub(crate) base_inertia: Sym3<f64>,
    pub(crate) links: Vec<Link>,
    pub(crate) slides: Vec<bool>,
    pub(crate) joints: Vec<String>,
    pub(crate) held_joints: Vec<String>,
    pub(crate) rated_joints: usize,
    /// Centre of mass of the base with what it carries, in the frame that the file states.
    pub(crate) centre: Pose<f64>,
    pub(crate) angles: Vec<f64>,
    /// Limits of the joints' angles \[rad\].
    pub(crate) limits: Vec<(f64, f64)>,
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
        end_frame(&self.links, &self.slides, &self.angles, self.tool).inverse()
    }
}

pub(crate) fn read(c: &mut Checker, file: &ScenarioFile, contact: &Contact, meshes: &[MeshFile]) -> Bodies {
    let held = held::read(file);
    let Massive { mass: base_mass, inertia: base_inertia, part: part_a } =
        held::base(c, file, held, mass_of(meshes, Side::A, &file.part_a.solid, &contact.a));
    let Massive { mass: target_mass, inertia: target_inertia, part: seat } =
        held::target(c, file, held, mass_of(meshes, Side::B, &file.part_b.solid, &contact.b));
    let target_pose = if file.target.position.is_some() || file.target.rotation.is_some() {
        c.pose(&file.target.position, &file.target.rotation)
    } else {
        seat.inverse()
    };
    let mut bodies = Bodies {
        base_inertia,
        links: Vec::new(),
        slides: Vec::new(),
        joints: Vec::new(),
        held_joints: Vec::new(),
        rated_joints: 0,
        centre: Pose::identity(),
        angles: Vec::new(),
        limits: Vec::new(),
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
    let link = file.part_a.link.as_ref();
    let base = if bodies.held.base { arm::BaseMass::Held } else { arm::BaseMass::Refused };
    let mut stated = arm::Stated { end: link.map(|link| link.value.as_str()), held: None };
    let mut arm = match arm::read(&source, mount, base, stated) {
        Ok(arm) => arm,
        Err(problems) => return c.problems.extend(problems),
    };
    let held = held_places(c, table, &arm);
    if !held.is_empty() {
        stated.held = Some(&held);
        arm = match arm::read(&source, mount, base, stated) {
            Ok(arm) => arm,
            Err(problems) => return c.problems.extend(problems),
        };
    }
    check_held(c, table, &arm);
    merge_into_base(&mut arm, bodies);
    match arm.frame(link.map(|link| link.value.as_str())) {
        Ok(frame) => bodies.tool = frame.compose(part_a),
        Err(message) => {
            let span = link.map_or(table.urdf.span.clone(), |link| link.span.clone());
            return c.refuse(&span, message, "name a link that a joint moves, or one that is fixed to such a link");
        }
    }
    bodies.angles = angles(c, table, &arm);
    if let Some(drive) = &table.drive {
        (bodies.drives, bodies.brakes) = arm_drive::read(c, &drive.value, &arm, &bodies.angles);
    }
    let is_rated = |own: &&arm::JointRating| **own != arm::JointRating::default();
    bodies.rated_joints = arm.ratings.iter().filter(is_rated).count();
    bodies.held_joints = held_lines(&arm);
    bodies.limits = arm.limits;
    (bodies.links, bodies.slides, bodies.joints, bodies.urdf) = (arm.links, arm.slides, arm.joints, Some(source));
}

/// The places at which `[arm] held` holds joints \[rad, m\].
fn held_places(c: &mut Checker, table: &ArmTable, arm: &Arm) -> BTreeMap<String, f64> {
    let mut places = BTreeMap::new();
    for (name, written) in table.held.iter().flatten() {
        let Some(joint) = arm.held.iter().find(|joint| joint.name == *name) else {
            let names: Vec<&str> = arm.held.iter().map(|joint| joint.name.as_str()).collect();
            let (message, remedy) = match arm.joints.contains(name) {
                true => (
                    format!("joint `{name}` moves: it is on the chain to part A"),
                    "remove it; arm.angles has its start".to_owned(),
                ),
                false if names.is_empty() => {
                    (format!("no joint is held, and none is called `{name}`"), "remove it".to_owned())
                }
                false => (format!("no joint `{name}` is held"), suggestion(name, &names)),
            };
            c.refuse(&written.span, message, remedy);
            continue;
        };
        let (unit, range) = if joint.slides { ("m", Range::size(LENGTH)) } else { ("rad", Range::size(ANGLE)) };
        places.insert(name.clone(), c.number(written, unit, range));
    }
    places
}

/// Refuses joints that are held beyond their limits.
fn check_held(c: &mut Checker, table: &ArmTable, arm: &Arm) {
    for joint in &arm.held {
        let (lower, upper) = joint.limits;
        if !(lower..=upper).contains(&joint.place) {
            let written = table.held.as_ref().and_then(|held| held.get(&joint.name));
            let span = written.map_or(table.urdf.span.clone(), |written| written.span.clone());
            let (name, unit) = (&joint.name, if joint.slides { "m" } else { "rad" });
            let message =
                format!("joint `{name}` is held at {}, beyond its limits in the URDF", show(joint.place, unit));
            let example = format!("\"{} {unit}\"", lower.max(0.0).min(upper));
            let limits = format!("{} to {}", show(lower, unit), show(upper, unit));
            c.refuse(&span, message, format!("write [arm] held = {{ {name} = {example} }}, a value from {limits}"));
        }
    }
}

/// Lines of `check` about the joints that are held.
fn held_lines(arm: &Arm) -> Vec<String> {
    let line = |joint: &HeldJoint| {
        let place = show(joint.place, if joint.slides { "m" } else { "rad" });
        format!("joint `{}`: held at {place}, {} on link `{}`", joint.name, show(joint.mass, "kg"), joint.carrier)
    };
    arm.held.iter().map(line).collect()
}

/// Joins what joints of the base hold to the base, whose frame moves to the centre of mass of both.
fn merge_into_base(arm: &mut Arm, bodies: &mut Bodies) {
    if bodies.held.base || arm.on_base.mass == 0.0 {
        return;
    }
    let mut whole = arm.on_base;
    whole.add(bodies.base_mass, bodies.base_inertia, Pose::identity());
    let (centre, inertia) = whole.about_com();
    (bodies.base_mass, bodies.base_inertia) = (whole.mass, inertia);
    bodies.centre.position = centre;
    if let Some(first) = arm.links.first_mut() {
        first.origin.position = first.origin.position - centre;
    }
}

/// Start angles and travels, one per joint and inside the joint's limits.
fn angles(c: &mut Checker, table: &ArmTable, arm: &Arm) -> Vec<f64> {
    let count = table.angles.value.len();
    if count != arm.joints.len() && !arm.held.is_empty() {
        let listed = |names: Vec<&String>| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let (moving, held) = (listed(arm.joints.iter().collect()), arm.held.iter().map(|joint| &joint.name).collect());
        let joints = arm.joints.len();
        let message = format!(
            "{count} values, and the chain to part A has {joints} joint{}: {moving}",
            if joints == 1 { "" } else { "s" }
        );
        let remedy = format!("write {joints} values in brackets; joints off the chain are held: {}", listed(held));
        c.refuse(&table.angles.span, message, remedy);
        return vec![0.0; joints];
    }
    joint_places(c, &table.angles, &arm.slides, &arm.limits, &arm.joints)
}

/// One place for each joint, within its limits \[rad, m\].
pub(super) fn joint_places(
    c: &mut Checker,
    listed: &Quantities,
    slides: &[bool],
    limits: &[(f64, f64)],
    names: &[String],
) -> Vec<f64> {
    let places = c.list_of(listed, &units(slides, "rad"), Range::size(ANGLE));
    for (index, place) in places.iter().enumerate() {
        let (lower, upper) = limits[index];
        if !(lower..=upper).contains(place)
            && let Some(written) = listed.value.get(index)
        {
            let (what, limits) = match slides[index] {
                true => ("travel", format!("a travel from {lower:.6} m to {upper:.6} m")),
                false => {
                    ("angle", format!("an angle from {:.3} deg to {:.3} deg", lower.to_degrees(), upper.to_degrees()))
                }
            };
            let message = format!("joint `{}` does not reach this {what}", names[index]);
            c.refuse(&written.span, message, format!("write {limits}, the limits in the URDF"));
        }
    }
    places
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
