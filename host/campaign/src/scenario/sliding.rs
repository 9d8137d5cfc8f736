//! Joints that slide: their units, and gains of the joint controller.

use super::bodies::Bodies;
use crate::check::Checker;
use crate::written::Quantities;
use crate::written::scenario::ScenarioFile;
use softdock_kernels::model::{ArmControl, MAX_JOINTS};
use softdock_kernels::range::{DAMPING, Range, STIFFNESS};

/// The unit that a joint which slides has in place of one that turns.
pub(crate) fn of_sliding(unit: &'static str) -> &'static str {
    match unit {
        "rad" => "m",
        "rad/s" => "m/s",
        "N m" => "N",
        "N m/rad" => "N/m",
        "N m s/rad" => "N s/m",
        "kg m^2" => "kg",
        other => other,
    }
}

/// The units of all joints, from that of a joint which turns.
pub(crate) fn units(slides: &[bool], unit: &'static str) -> Vec<&'static str> {
    slides.iter().map(|slides| if *slides { of_sliding(unit) } else { unit }).collect()
}

/// The joint controller of an arm with joints that slide, whose gains have units of their own; none for other arms and laws.
pub(super) fn joint_pd(c: &mut Checker, file: &ScenarioFile, bodies: &Bodies) -> Option<ArmControl> {
    let table = &file.arm.as_ref()?.controller.value;
    let [stiffness, damping] = [table.joint_stiffness.as_ref()?, table.joint_damping.as_ref()?];
    let others = [&table.bandwidth, &table.damping_ratio, &table.stiffness, &table.damping];
    let is_alone = table.law.value == "joint_pd" && others.iter().all(|key| key.is_none());
    if !is_alone || !bodies.slides.contains(&true) {
        return None;
    }
    let mut gains = |written: &Quantities, unit: &'static str, most: f64| {
        let mut gains = [0.0; MAX_JOINTS];
        let list = c.list_of(written, &units(&bodies.slides, unit), Range::within(0.0, most));
        gains[..list.len()].copy_from_slice(&list);
        gains
    };
    let stiffness = gains(stiffness, "N m/rad", STIFFNESS);
    Some(ArmControl::JointPd { stiffness, damping: gains(damping, "N m s/rad", DAMPING) })
}
