//! Mount of a robot: its base and its part.

use crate::check::Checker;
use crate::inertia::fault;
use crate::written::At;
use crate::written::joint_level::{MountTable, PayloadTable};
use softdock_kernels::manipulator::cell::{Mount, Payload};
use softdock_kernels::range::{LENGTH, MASS, Range};
use softdock_kernels::vector::{Sym3, Vec3};

/// Base, tool and payload of a robot, as its table states them.
pub(crate) fn mount(c: &mut Checker, table: &MountTable) -> Mount {
    let base = c.pose(&Some(table.position.clone()), &table.rotation);
    let tool = c.pose(&table.part_position, &table.part_rotation);
    let nothing = Payload { mass: 0.0, com: Vec3::zero(), inertia: Sym3::splat(0.0) };
    let payload = table.payload.as_ref().map_or(nothing, |table| payload(c, table));
    Mount { base, tool, payload }
}

fn payload(c: &mut Checker, table: &At<PayloadTable>) -> Payload {
    let t = &table.value;
    let noted = c.problems.len();
    let inertia = c.inertia(&t.inertia);
    if c.problems.len() == noted
        && let Some(fault) = fault(inertia)
    {
        let remedy = "take the tensor about the centre of mass from its source again";
        c.refuse(&table.span, format!("no rigid body has this inertia: {fault}"), remedy);
    }
    Payload {
        mass: c.number(&t.mass, "kg", Range::within(0.0, MASS)),
        com: c.vector(&t.com, "m", Range::size(LENGTH)),
        inertia,
    }
}
