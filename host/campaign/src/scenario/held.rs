//! Bodies that are held: the keys that have no effect then, and scenarios in which nothing can move.

use crate::check::Checker;
use crate::inertia::Joined;
use crate::problem::Problem;
use crate::written::scenario::{InertiaTable, ScenarioFile};
use crate::written::{At, Quantities, Quantity};
use softdock_kernels::model::Held;
use softdock_kernels::params::Params;
use softdock_kernels::vector::{Pose, Sym3};
use std::ops::Range as Span;

/// Why a parameter has no effect, and what to do about it.
type Reason = (&'static str, &'static str);

const HELD_BASE: Reason = ("the base is held", "remove it, or remove base.held from the scenario");
const HELD_TARGET: Reason = ("the target is held", "remove it, or remove target.held from the scenario");
const HELD_BOTH: Reason =
    ("base and target are held", "remove it, or remove base.held or target.held from the scenario");

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
    let span = |written: &Option<Quantities>| written.as_ref().map(|written| written.span.clone());
    if held.base {
        refuse(span(&file.start.chaser_rate), BASE.message, "remove it, or remove base.held");
        let approach = file.guidance.approach.as_ref().map(|approach| approach.span.clone());
        refuse(approach, "a held base takes no thrust", "remove [guidance.approach], or remove base.held");
        let thrusters = file.base.thrusters.as_ref().map(|thrusters| thrusters.span.clone());
        refuse(thrusters, "a held base has nothing to turn", "remove base.thrusters, or remove base.held");
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

/// Mass \[kg\] and inertia of a body, and the pose of its part in its frame.
pub(super) struct Massive {
    pub(super) mass: f64,
    pub(super) inertia: Sym3<f64>,
    pub(super) part: Pose<f64>,
}

/// The base with part A; with an arm the part is in its link's frame.
pub(super) fn base(c: &mut Checker, file: &ScenarioFile, held: Held, meshes: Option<Joined>) -> Massive {
    let (part, table) = (&file.part_a, &file.base);
    let place = (&part.position, &part.rotation);
    let meshes = meshes.filter(|_| file.arm.is_none());
    mass_and_inertia(c, (&table.mass, &table.inertia), held.base, &BASE, place, meshes)
}

/// The target with part B.
pub(super) fn target(c: &mut Checker, file: &ScenarioFile, held: Held, meshes: Option<Joined>) -> Massive {
    let (part, table) = (&file.part_b, &file.target);
    let place = (&part.position, &part.rotation);
    mass_and_inertia(c, (&table.mass, &table.inertia), held.target, &TARGET, place, meshes)
}

/// Both are required of a free body and refused of a held one, whose values are those that change nothing. Where neither is
/// written they are those of the part's meshes that state a density, and the body's frame is in their centre of mass.
fn mass_and_inertia(
    c: &mut Checker,
    (mass, inertia): (&Option<Quantity>, &Option<At<InertiaTable>>),
    is_held: bool,
    body: &Body,
    (position, rotation): (&Option<Quantities>, &Option<Quantities>),
    meshes: Option<Joined>,
) -> Massive {
    let part = c.pose(position, rotation);
    let harmless = Massive { mass: 1.0, inertia: Sym3 { xx: 1.0, yy: 1.0, zz: 1.0, ..Sym3::splat(0.0) }, part };
    if is_held {
        let written = [mass.as_ref().map(|mass| &mass.span), inertia.as_ref().map(|inertia| &inertia.span)];
        for span in written.into_iter().flatten() {
            c.refuse(span, body.message, format!("remove it, or remove {}.held", body.table));
        }
        return harmless;
    }
    if let (None, None, Some(of_meshes)) = (mass, inertia, meshes) {
        if let Some(written) = position {
            let message = format!("the {}'s centre of mass follows from the meshes of its part", body.table);
            let remedy = "remove it, or write mass and inertia of the body";
            c.refuse(&written.span, message, remedy);
        }
        if of_meshes.mass == 0.0 {
            return harmless;
        }
        let (centre, inertia) = of_meshes.about_com();
        let turn = part.attitude.matrix();
        let part = Pose { position: -part.attitude.rotate(centre), ..part };
        return Massive { mass: of_meshes.mass, inertia: inertia.rotated(turn), part };
    }
    let mut required = |key: &str, example: &str| {
        let span = c.source.span_of(body.table);
        let problem = Problem::at(&c.source, span, "this key must be there").key(format!("{}.{key}", body.table));
        let remedy =
            format!("add {key} = {example}, or held = true, or the density of its part's meshes instead of both");
        c.problems.push(problem.value("").remedy(remedy));
    };
    if mass.is_none() {
        required("mass", "\"400 kg\"");
    }
    if inertia.is_none() {
        required("inertia", "{ ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }");
    }
    let parameter = format!("{}_mass", body.table);
    let mass = mass.as_ref().map_or(harmless.mass, |mass| c.parameter(mass, &parameter));
    let inertia = inertia.as_ref().map_or(harmless.inertia, |inertia| super::bodies::inertia(c, inertia));
    Massive { mass, inertia, part }
}

/// Why a parameter changes nothing where bodies are held, if so.
pub(crate) fn without_effect_if_held(name: &str, held: Held) -> Option<Reason> {
    let of = |starts: &[&str]| starts.iter().any(|start| name.starts_with(start));
    let of_target = ["target_", "mass_error", "inertia_error", "slosh_", "appendage_"];
    match held {
        Held { base: true, .. } if of(&["base_", "chaser_rate"]) => Some(HELD_BASE),
        Held { target: true, .. } if of(&of_target) => Some(HELD_TARGET),
        Held { base: true, target: true } if of(&["closing_speed", "drift"]) => Some(HELD_BOTH),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_of_held_bodies_have_no_effect() {
        let (base, target) = (Held { base: true, target: false }, Held { base: false, target: true });
        let both = Held { base: true, target: true };
        let of_target = [
            "target_mass",
            "target_inertia_scale",
            "target_rate_x",
            "mass_error",
            "inertia_error",
            "target_com_error_y",
            "slosh_share",
            "appendage_damping",
        ];
        for (name, held) in of_target.map(|name| (name, target)).into_iter().chain([
            ("base_mass", base),
            ("base_inertia_scale", base),
            ("chaser_rate_z", base),
            ("closing_speed", both),
            ("drift_x", both),
        ]) {
            assert!(softdock_kernels::params::row_of(name).is_some(), "{name}");
            assert!(without_effect_if_held(name, held).is_some(), "{name}");
            assert!(without_effect_if_held(name, Held::NONE).is_none(), "{name}");
        }
        assert!(without_effect_if_held("closing_speed", base).is_none(), "the target moves towards the base");
        assert!(without_effect_if_held("offset_x", both).is_none(), "the chaser is placed otherwise");
    }
}
