//! Parameters that can change nothing in a scenario: to vary one is a mistake, and is refused.

use crate::campaign::Campaign;
use crate::check::Checker;
use crate::expression::Bounds;
use crate::overlap::without_robots;
use crate::scenario::held::without_effect_if_held;
use softdock_kernels::effects::{EFFECTS, Effect, EffectParameter, EffectSet, Null};
use softdock_kernels::fields::fields;
use softdock_kernels::manipulator::cell::Feedforward;
use softdock_kernels::model::{CompensatorKind, Model};
use softdock_kernels::params::Params;
use std::ops::Range;

/// Why a parameter does nothing, and what to do about it.
type Reason = (&'static str, &'static str);

const UNUSED: Reason = ("no expression uses this variable", "remove it, or use it in the expr of a [[derived]]");
const NO_LATCH: Reason = ("the scenario has no latch", "remove it, or add a table [latch] to the scenario");
const NO_HOOKS: Reason = ("the latch has no hooks that could fail", "remove it, or add latch.hook to the scenario");
const NO_CAMERA: Reason = ("the arm has no camera", "remove it, or add a table [arm.camera] to the scenario");
const NO_RAIL: Reason = ("the facility has no rail", "remove it, or add a table [facility.rail] to the scenario");
const RAIL_STANDS: Reason =
    ("the rail's share of the motion is 0", "remove it, or raise facility.rail.share in the scenario");
const NO_JOINTS: Reason = (
    "the robots follow with a lag, without joints",
    "remove it, or add a table [facility.joint_level] to the scenario",
);
const JOINTS: Reason =
    ("at the joint level the robots follow by their drives", "disperse a parameter of the drives instead");
const NO_FEEDFORWARD: Reason = (
    "the controllers do not feed this part of the model forward",
    "remove it, or write facility.joint_level.feedforward = \"full\"",
);
const NO_TEST: Reason = ("the facility makes no test motion", "remove it, or add a table [facility.test_motion]");
const NO_LAG: Reason =
    ("the lag of this response is always 0, which is ideal", "remove it, or give the response a lag above 0 s");
const VISCOUS: Reason = (
    "the contact law has a damping and no dissipation",
    "disperse `contact_damping` instead, or write law = \"power\" in the scenario",
);
const DISSIPATIVE: Reason = (
    "the contact law has a dissipation and no damping",
    "disperse `contact_dissipation` instead, or write law = \"linear\" in the scenario",
);
const NO_COMMON: Reason = (
    "every point and solid is in a [[contact.pair]] with its own properties",
    "remove it, or leave points and solids to the law of [contact]",
);
const BILATERAL: Reason =
    ("a bilateral contact never parts", "remove it, or write bilateral = false in [contact] of the scenario");
const NO_EFFECT: Reason = (
    "it shapes an effect that no run has",
    "remove it, or give the effect a size: `softdock check` lists the effects in play",
);
const NO_FRICTION: Reason = ("friction is always 0", "remove it, or give the contact a friction above 0");
const NO_DAMPING: Reason =
    ("the contact has neither damping nor dissipation", "remove it, or give the contact a damping above 0");
const NO_PATTERN: Reason = (
    "every element of the crosstalk pattern is 0",
    "remove it, or write facility.sensor.crosstalk_pattern with an element that is not 0",
);
const NO_TARE: Reason =
    ("the sensor is not tared", "remove it, or write tared = true in [facility.sensor] of the scenario");
const NO_LOAD: Reason =
    ("no load is mounted on the sensor", "remove it, or add a table [facility.sensor.load] to the scenario");
const NO_COMPENSATOR: Reason = (
    "the facility has no compensator",
    "remove it, or add a table [facility.compensator] that takes it to the scenario",
);
const OTHER_COMPENSATOR: Reason = (
    "the facility's kind of compensator does not take it",
    "remove it, or choose a kind that takes it in [facility.compensator]",
);
const NEVER_SWITCHED: Reason = (
    "with a delay or a stiffness that is always 0 the compensator damps nothing",
    "remove it, or give the compensator a delay and, for virtual damping, a stiffness above 0",
);

/// A dispersion or derived value without effect, with its place in the file.
pub(crate) struct IneffectiveKey {
    name: String,
    why: Reason,
    pub(crate) place: Range<usize>,
}

impl IneffectiveKey {
    pub(crate) fn refuse(&self, c: &mut Checker) {
        let (why, remedy) = self.why;
        c.refuse(&self.place, format!("`{}` does nothing here: {why}", self.name), remedy);
    }
}

/// Dispersions and derived values of parameters that can change nothing.
///
/// One that another derived value is computed from does its work there.
pub(crate) fn targets(campaign: &Campaign, bounds: &[Bounds]) -> Vec<IneffectiveKey> {
    let dispersed = campaign.dispersions.iter().map(|d| (d.field, &d.name, &d.place));
    let derived = campaign.derived.iter().map(|d| (d.field, &d.name, &d.place));
    let unused = |field: &usize| !campaign.derived.iter().any(|derived| derived.expression.names().contains(field));
    let parameters = bounds.len() - campaign.extras.len();
    let effects = campaign.effects();
    let why = |field: usize, name: &str| match field < parameters {
        true => {
            ineffective(name, &campaign.scenario.model, bounds).or(shapes_nothing(name, effects).then_some(NO_EFFECT))
        }
        // A key without effect is found where its ends are read.
        false => campaign.key_of(field).is_none().then_some(UNUSED),
    };
    let target = |(field, name, place): (usize, &String, &Range<usize>)| {
        Some(IneffectiveKey { name: name.clone(), why: why(field, name)?, place: place.clone() })
    };
    dispersed.chain(derived).filter(|(field, ..)| unused(field)).filter_map(target).collect()
}

/// Why a parameter changes nothing, if so.
fn ineffective(name: &str, model: &Model, bounds: &[Bounds]) -> Option<Reason> {
    let table = fields::<f64, Params<f64>>();
    let never = |name: &str| {
        let at = table.iter().position(|field| field.name == name).expect("a field of Params");
        bounds[at].least == 0.0 && bounds[at].greatest == 0.0
    };
    let without = |reason: Reason, condition: bool| condition.then_some(reason);
    let rail = model.facility.rail.as_ref();
    let viscous = model.contact.law.is_viscous();
    let rows = || model.contact.pairs.iter().map(|row| &row.properties);
    let joints = model.facility.joint_level.as_ref();
    match name {
        _ if name.starts_with("camera_") => {
            let camera = model.guidance.plan.as_ref().and_then(|plan| plan.camera.as_ref());
            without(NO_CAMERA, camera.is_none())
        }
        _ if without_effect_if_held(name, model.held).is_some() => without_effect_if_held(name, model.held),
        "latch_failed" => without(NO_HOOKS, model.contact.latch.as_ref().is_none_or(|latch| latch.hooks.is_empty())),
        _ if name.starts_with("latch_") => without(NO_LATCH, model.contact.latch.is_none()),
        _ if name.starts_with("test_") => without(NO_TEST, model.facility.test_motion.is_none()),
        _ if name.starts_with("rail_") && rail.is_none() => Some(NO_RAIL),
        _ if name.starts_with("rail_") && joints.is_some() => Some(JOINTS),
        _ if name.starts_with("rail_") && rail.is_some_and(|rail| rail.share == 0.0) => Some(RAIL_STANDS),
        _ if name.starts_with("robot1_lag") || name.starts_with("robot2_lag") => {
            let lag = if name.starts_with("robot1") { "robot1_lag" } else { "robot2_lag" };
            without(JOINTS, joints.is_some()).or(without(NO_LAG, name != lag && never(lag)))
        }
        _ if name.starts_with("robot1_") || name.starts_with("robot2_") => match joints {
            None => Some(NO_JOINTS),
            Some(level) => without(NO_FEEDFORWARD, !feeds(level.servo.feedforward, name)),
        },
        "rail_lag_damping" => without(NO_LAG, never("rail_lag")),
        "contact_stiffness"
        | "contact_damping"
        | "contact_dissipation"
        | "contact_friction"
        | "bristle_stiffness"
        | "bristle_damping"
            if !without_robots(model).pairs.iter().any(|pair| pair.properties.is_none()) =>
        {
            Some(NO_COMMON)
        }
        "contact_dissipation" => without(VISCOUS, viscous),
        "contact_damping" => without(DISSIPATIVE, !viscous),
        "bristle_stiffness" | "bristle_damping" => without(NO_FRICTION, never("contact_friction")),
        "contact_friction_error" | "contact_stribeck" | "contact_anisotropy" => {
            without(NO_FRICTION, never("contact_friction") && rows().all(|pair| pair.friction == 0.0))
        }
        "contact_adhesion" => without(BILATERAL, model.contact.bilateral),
        "tool_speed_limit" | "tool_rotation_limit" => without(JOINTS, joints.is_some()),
        "contact_damping_error" => {
            let common = never(if viscous { "contact_damping" } else { "contact_dissipation" });
            without(NO_DAMPING, common && rows().all(|pair| pair.damping == 0.0 && pair.dissipation == 0.0))
        }
        _ if name.starts_with("tare_error_") => without(NO_TARE, !model.facility.tared),
        _ if name.starts_with("load_") => without(NO_LOAD, model.facility.load.is_none()),
        "sensor_crosstalk" => {
            without(NO_PATTERN, model.facility.crosstalk.iter().flatten().all(|element| *element == 0.0))
        }
        _ => name.strip_prefix("compensator_").and_then(|name| ineffective_compensator(name, model, &never)),
    }
}

/// Whether a parameter only shapes effects that no run has.
fn shapes_nothing(name: &str, effects: EffectSet) -> bool {
    let shapes = |p: &EffectParameter| p.field == name && p.null == Null::Any;
    let shaped = |effect: &&Effect| effect.parameters.iter().any(shapes);
    EFFECTS.iter().any(|effect| shaped(&effect)) && !effects.iter().any(|effect| shaped(&effect))
}

/// Why a parameter of a compensator changes nothing, if so.
fn ineffective_compensator(name: &str, model: &Model, never: &dyn Fn(&str) -> bool) -> Option<Reason> {
    let kind = model.facility.compensator.kind;
    let of = |reason: Reason, condition: bool| condition.then_some(reason);
    let unstiff = kind == CompensatorKind::VirtualDamping && never("compensator_stiffness");
    match name {
        _ if kind == CompensatorKind::None => Some(NO_COMPENSATOR),
        _ if !kind.parameters().contains(&name) => Some(OTHER_COMPENSATOR),
        "margin" | "lag" => of(NEVER_SWITCHED, unstiff || never("compensator_delay")),
        _ => None,
    }
}

/// Whether a feedforward of this kind needs a parameter of its model; true for all that is not of its model.
fn feeds(feedforward: Feedforward, name: &str) -> bool {
    match feedforward {
        Feedforward::Off => !name.contains("_model_"),
        Feedforward::Gravity => !name.contains("_model_") || name.ends_with("_model_gravity_error"),
        Feedforward::Full => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::tests::{FREE_BODY, scenario};
    use softdock_kernels::fields::to_vec;

    #[test]
    fn common_law_has_no_effect_where_every_point_and_solid_are_in_a_pair() {
        let why = |text: &str, parameter: &str| {
            let model = scenario(text).expect("valid").model;
            let bounds: Vec<Bounds> =
                to_vec(&model.nominal).into_iter().map(|value| Bounds { least: value, greatest: value }).collect();
            ineffective(parameter, &model, &bounds).map(|reason| reason.0)
        };
        let pair = "[[contact.pair]]\nlaw = \"linear\"\nstiffness = \"1e4 N/m\"\nfriction = 0.1\n[start]";
        let covered = FREE_BODY.replace("[start]", pair);
        assert_eq!(why(&covered, "contact_stiffness"), Some(NO_COMMON.0));
        assert_eq!(why(FREE_BODY, "contact_stiffness"), None);
        assert_eq!(why(&covered, "contact_friction_error"), None, "the pair has friction");
        assert_eq!(why(FREE_BODY, "contact_friction_error"), Some(NO_FRICTION.0));
    }
}
