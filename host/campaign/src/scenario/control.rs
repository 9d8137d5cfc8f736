//! Guidance: the approach's thrust and the arm's controller.

use super::sliding::units;
use crate::check::{Checker, span_of};
use crate::units::show;
use crate::written::scenario::{ArmTable, ControllerTable, GuidanceTable, ThrustersTable};
use crate::written::{At, Quantities, Quantity};
use softdock_kernels::model::{ArmControl, MAX_JOINTS, Thrust, Thrusters, Timing};
use softdock_kernels::range::{DAMPING, FORCE, Range, STIFFNESS};
use softdock_kernels::vector::Vec3;

const STIFF: Range = Range::within(0.0, STIFFNESS);
const DAMP: Range = Range::within(0.0, DAMPING);

pub(crate) fn thrust(c: &mut Checker, table: &GuidanceTable) -> Thrust {
    let Some(approach) = &table.approach else {
        return Thrust::Off;
    };
    let t = &approach.value;
    Thrust::Approach {
        speed_gain: c.number(&t.speed_gain, "N s/m", DAMP),
        lateral_stiffness: c.number(&t.lateral_stiffness, "N/m", STIFF),
        lateral_damping: c.number(&t.lateral_damping, "N s/m", DAMP),
        attitude_stiffness: c.number(&t.attitude_stiffness, "N m/rad", STIFF),
        attitude_damping: c.number(&t.attitude_damping, "N m s/rad", DAMP),
        max_force: c.number(&t.max_force, "N", Range::within(0.0, FORCE)),
        max_torque: c.number(&t.max_torque, "N m", Range::within(0.0, FORCE)),
    }
}

/// Longest pulse of a thruster \[ticks\].
const LONGEST_PULSE: f64 = 1e5;

/// The thrusters of the base.
pub(crate) fn thrusters(c: &mut Checker, table: Option<&At<ThrustersTable>>, timing: &Timing) -> Option<Thrusters> {
    let t = &table?.value;
    let torque = c.vector(&t.torque, "N m", Range::within(0.0, FORCE));
    if torque == Vec3::zero() {
        c.refuse(&t.torque.span, "the thrusters have no torque", "write a torque above 0 N m, or remove the table");
    }
    Some(Thrusters {
        torque,
        deadband: c.number(&t.deadband, "rad", Range::above(0.0, 0.5)),
        lead: c.number(&t.lead, "s", Range::within(0.0, 1e3)),
        pulse: ticks(c, &t.pulse, timing.tick(), [1.0, LONGEST_PULSE]),
        off_at_touch: t.off_at_touch.unwrap_or(false),
    })
}

/// A time as a whole number of ticks, from `least` to `most`.
pub(super) fn ticks(c: &mut Checker, written: &Quantity, tick: f64, [least, most]: [f64; 2]) -> u32 {
    let time = c.number(written, "s", Range::within(least * tick * (1.0 - 1e-9), most * tick * (1.0 + 1e-9)));
    let count = (time / tick).round();
    if (time / tick - count).abs() > 1e-6 {
        let message = format!("{} is not a whole number of ticks of {}", show(time, "s"), show(tick, "s"));
        let nearest = show(count.clamp(least, most) * tick, "s");
        c.refuse(&written.span, message, format!("write a multiple of the tick: {nearest} is the nearest"));
    }
    count as u32
}

#[derive(Clone, Copy, PartialEq)]
enum Law {
    JointPd,
    ComputedTorque,
    CartesianImpedance,
}

/// A controller that has nothing to do.
pub(crate) const IDLE: ArmControl = ArmControl::JointPd { stiffness: [0.0; MAX_JOINTS], damping: [0.0; MAX_JOINTS] };

/// The arm's controller, where it has no phases; without an arm one that has nothing to do.
pub(crate) fn arm(c: &mut Checker, arm: Option<&ArmTable>, slides: &[bool]) -> ArmControl {
    let Some(arm) = arm.filter(|arm| arm.phase.is_empty()) else { return IDLE };
    match &arm.controller {
        Some(table) => controller(c, &table.value, slides),
        None => {
            let span = c.source.span_of("arm");
            c.refuse(&span, "the arm has no controller", "add a table [arm.controller], or phases with controllers");
            IDLE
        }
    }
}

/// A controller as it is written, of joints of which some slide.
pub(crate) fn controller(c: &mut Checker, t: &ControllerTable, slides: &[bool]) -> ArmControl {
    let laws = [
        ("joint_pd", Law::JointPd),
        ("computed_torque", Law::ComputedTorque),
        ("cartesian_impedance", Law::CartesianImpedance),
    ];
    let law = c.choice(&t.law, &laws);
    let needs = |name, span, of: Law| (name, span, law == of, law == of);
    let keys = [
        needs("joint_stiffness", span_of(&t.joint_stiffness), Law::JointPd),
        needs("joint_damping", span_of(&t.joint_damping), Law::JointPd),
        needs("bandwidth", span_of(&t.bandwidth), Law::ComputedTorque),
        needs("damping_ratio", span_of(&t.damping_ratio), Law::ComputedTorque),
        needs("stiffness", span_of(&t.stiffness), Law::CartesianImpedance),
        needs("damping", span_of(&t.damping), Law::CartesianImpedance),
        needs("rotation_stiffness", span_of(&t.rotation_stiffness), Law::CartesianImpedance),
        needs("rotation_damping", span_of(&t.rotation_damping), Law::CartesianImpedance),
        needs("null_space_damping", span_of(&t.null_space_damping), Law::CartesianImpedance),
    ];
    c.keys_of_kind(&t.law, &keys);
    match law {
        Law::JointPd => ArmControl::JointPd {
            stiffness: gains(c, &t.joint_stiffness, slides, "N m/rad", STIFF),
            damping: gains(c, &t.joint_damping, slides, "N m s/rad", DAMP),
        },
        Law::ComputedTorque => ArmControl::ComputedTorque {
            bandwidth: c.number_or(&t.bandwidth, 1.0, "rad/s", Range::within(0.0, 1e4)),
            damping_ratio: c.number_or(&t.damping_ratio, 1.0, "1", Range::within(0.0, 100.0)),
        },
        Law::CartesianImpedance => ArmControl::CartesianImpedance {
            stiffness: c.number_or(&t.stiffness, 0.0, "N/m", STIFF),
            damping: c.number_or(&t.damping, 0.0, "N s/m", DAMP),
            rotation_stiffness: c.number_or(&t.rotation_stiffness, 0.0, "N m/rad", STIFF),
            rotation_damping: c.number_or(&t.rotation_damping, 0.0, "N m s/rad", DAMP),
            joint_damping: c.number_or(&t.null_space_damping, 0.0, "N m s/rad", DAMP),
        },
    }
}

/// A gain of each joint; `unit` is that of a joint which turns.
fn gains(
    c: &mut Checker,
    written: &Option<Quantities>,
    slides: &[bool],
    unit: &'static str,
    range: Range,
) -> [f64; MAX_JOINTS] {
    let mut gains = [0.0; MAX_JOINTS];
    if let Some(written) = written {
        let list = c.list_of(written, &units(slides, unit), range);
        gains[..list.len()].copy_from_slice(&list);
    }
    gains
}
