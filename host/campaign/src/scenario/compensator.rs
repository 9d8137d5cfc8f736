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
    c.take(t.parameters(0), p);
    Compensator { kind, pulls: t.pulls.as_ref().is_some_and(|pulls| pulls.value) }
}
