//! The facility's delay compensation: its kind, and the numbers that this kind takes.

use crate::check::{Checker, span_of};
use crate::written::facility::CompensatorTable;
use softdock_kernels::model::{Compensator, CompensatorKind};
use softdock_kernels::params::Params;

pub(crate) fn read(c: &mut Checker, table: &Option<CompensatorTable>, p: &mut Params<f64>) -> Compensator {
    let Some(t) = table else {
        return Compensator::NONE;
    };
    let kind = c.choice(&t.kind, &CompensatorKind::NAMES);
    let taken = |name: &str| kind.parameters().contains(&name);
    // What has no harmless value must be stated.
    let needed = |name: &'static str, span| (name, span, taken(name), taken(name));
    let may = |name: &'static str, span| (name, span, taken(name), false);
    let keys = [
        needed("delay", span_of(&t.delay)),
        may("lag", span_of(&t.lag)),
        needed("stiffness", span_of(&t.stiffness)),
        may("margin", span_of(&t.margin)),
        may("damping", span_of(&t.damping)),
        needed("energy", span_of(&t.energy)),
        may("threshold", span_of(&t.threshold)),
        ("pulls", span_of(&t.pulls), kind != CompensatorKind::None, false),
    ];
    c.keys_of_kind(&t.kind, &keys);
    p.compensator_delay = c.parameter_or(&t.delay, "compensator_delay", 0.0);
    p.compensator_lag = c.parameter_or(&t.lag, "compensator_lag", 0.0);
    p.compensator_stiffness = c.parameter_or(&t.stiffness, "compensator_stiffness", 0.0);
    p.compensator_margin = c.parameter_or(&t.margin, "compensator_margin", 0.0);
    p.compensator_damping = c.parameter_or(&t.damping, "compensator_damping", 0.0);
    p.compensator_energy = c.parameter_or(&t.energy, "compensator_energy", p.compensator_energy);
    p.compensator_threshold = c.parameter_or(&t.threshold, "compensator_threshold", 0.0);
    Compensator { kind, pulls: t.pulls.as_ref().is_some_and(|pulls| pulls.value) }
}
