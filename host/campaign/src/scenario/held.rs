//! Bodies that are held: the keys that have no effect then, and scenarios in which nothing can move.

use crate::check::Checker;
use crate::no_effect::without_effect_if_held;
use crate::problem::Problem;
use crate::written::At;
use crate::written::scenario::{InertiaTable, ScenarioFile};
use softdock_kernels::model::Held;
use softdock_kernels::params::Params;
use softdock_kernels::vector::Sym3;
use std::ops::Range as Span;

/// A held body, in messages.
struct Body {
    /// Its table.
    table: &'static str,
    /// Why its mass and inertia have no effect.
    message: &'static str,
}

const BASE: Body = Body { table: "base", message: "a held base does not move: this has no effect" };
const TARGET: Body = Body { table: "target", message: "a held target does not move: this has no effect" };

/// Which bodies are held.
pub(super) fn read(file: &ScenarioFile) -> Held {
    let is = |written: &Option<At<bool>>| written.as_ref().is_some_and(|held| held.value);
    Held { base: is(&file.base.held), target: is(&file.target.held) }
}

/// Refuses keys without effect, and a scenario in which nothing can move; `p` has the motion at the start.
pub(super) fn check(c: &mut Checker, file: &ScenarioFile, held: Held, p: &Params<f64>) {
    let mut refuse = |span: Option<Span<usize>>, message: &str, remedy: &str| {
        if let Some(span) = span {
            c.refuse(&span, message, remedy);
        }
    };
    let span = |written: &Option<crate::written::Quantities>| written.as_ref().map(|written| written.span.clone());
    if held.base {
        refuse(span(&file.start.chaser_rate), BASE.message, "remove it, or remove base.held");
        let approach = file.guidance.approach.as_ref().map(|approach| approach.span.clone());
        refuse(approach, "a held base takes no thrust", "remove [guidance.approach], or remove base.held");
    }
    if held.target {
        refuse(span(&file.start.target_rate), TARGET.message, "remove it, or remove target.held");
    }
    if held.base && file.arm.is_none() {
        let field = file.field.as_ref().map(|field| field.acceleration.span.clone());
        refuse(field, "the field acts on the chaser, and a held base does not move", "remove [field]");
    }
    if held.base && held.target {
        let moves_nothing = "base and target are held: nothing moves at the start";
        let closing = (p.closing_speed != 0.0).then(|| file.start.closing_speed.span.clone());
        refuse(closing, moves_nothing, "write closing_speed = \"0 m/s\", or remove base.held or target.held");
        refuse(span(&file.start.drift), moves_nothing, "remove it, or remove base.held or target.held");
        let orbit = file.orbit.as_ref().map(|orbit| orbit.rate.span.clone());
        refuse(orbit, "relative gravity acts on free bodies, and base and target are held", "remove [orbit]");
        if file.arm.is_none() {
            let held = file.target.held.as_ref().map(|held| held.span.clone());
            refuse(held, "base and target are held: nothing can move", "add [arm], or remove base.held or target.held");
        }
    }
    for effect in &file.effect {
        for (name, quantity) in &effect.parameters {
            if let Some((why, remedy)) = without_effect_if_held(name, held) {
                c.refuse(&quantity.span, format!("`{name}` has no effect: {why}"), remedy);
            }
        }
    }
}

/// Mass \[kg\] and inertia of the base.
pub(super) fn base(c: &mut Checker, file: &ScenarioFile, held: Held) -> (f64, Sym3<f64>) {
    mass_and_inertia(c, (&file.base.mass, &file.base.inertia), held.base, &BASE)
}

/// Mass \[kg\] and inertia of the target.
pub(super) fn target(c: &mut Checker, file: &ScenarioFile, held: Held) -> (f64, Sym3<f64>) {
    mass_and_inertia(c, (&file.target.mass, &file.target.inertia), held.target, &TARGET)
}

/// Both are required of a free body and refused of a held one, whose values are those that change nothing.
fn mass_and_inertia(
    c: &mut Checker,
    (mass, inertia): (&Option<crate::written::Quantity>, &Option<At<InertiaTable>>),
    is_held: bool,
    body: &Body,
) -> (f64, Sym3<f64>) {
    let harmless = (1.0, Sym3 { xx: 1.0, yy: 1.0, zz: 1.0, ..Sym3::splat(0.0) });
    if is_held {
        let written = [mass.as_ref().map(|mass| &mass.span), inertia.as_ref().map(|inertia| &inertia.span)];
        for span in written.into_iter().flatten() {
            c.refuse(span, body.message, format!("remove it, or remove {}.held", body.table));
        }
        return harmless;
    }
    let mut required = |key: &str, example: &str| {
        let span = c.source.span_of(body.table);
        let problem = Problem::at(&c.source, span, "this key must be there").key(format!("{}.{key}", body.table));
        c.problems.push(problem.value("").remedy(format!("add {key} = {example}, or held = true")));
    };
    if mass.is_none() {
        required("mass", "\"400 kg\"");
    }
    if inertia.is_none() {
        required("inertia", "{ ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }");
    }
    let parameter = format!("{}_mass", body.table);
    let mass = mass.as_ref().map_or(harmless.0, |mass| c.parameter(mass, &parameter));
    (mass, inertia.as_ref().map_or(harmless.1, |inertia| super::bodies::inertia(c, inertia)))
}
