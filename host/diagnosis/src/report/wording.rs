//! Words of an answer: places, causes, sizes, probabilities, verdicts.

use crate::model::place::place;
use crate::verdict::answer::{BlockAnswer, Bounds, DiagnosisVerdict, EffectFound, FormFound, RuledOut};
use crate::verdict::errors::{FittedParameter, RemainingError};
use crate::verdict::estimates::EffectSize;
use crate::verdict::estimates::ParameterEstimate;
use softdock_analysis::number::{prefixed, significant};
use softdock_kernels::effects::{Effect, row_of};

/// Returns the name of a verdict.
pub fn verdict(verdict: DiagnosisVerdict) -> &'static str {
    match verdict {
        DiagnosisVerdict::NoEffect => "no effect",
        DiagnosisVerdict::Withheld => "no verdict",
        DiagnosisVerdict::NoPracticalEffect => "no practical effect",
        DiagnosisVerdict::Named => "named",
        DiagnosisVerdict::Ambiguous => "ambiguous",
        DiagnosisVerdict::NotInLibrary => "not in the library",
        DiagnosisVerdict::ModelInadequate => "model inadequate",
    }
}

/// Returns the component and the cause that a catalogue id stands for (`gear: backlash`).
pub fn effect_words(id: &str) -> String {
    row_of(id).map_or_else(|| id.to_owned(), Effect::words)
}

/// Returns the words of an id with the id, for lists without a column of ids.
pub fn words_and_id(id: &str) -> String {
    format!("{} ({id})", effect_words(id))
}

/// Robots of a facility by the prefixes of their parameters.
const ROBOTS: [(&str, &str); 3] = [("robot1_", "Robot 1"), ("robot2_", "Robot 2"), ("rail_", "Rail")];

/// Returns the place of an effect: that of its block, or the robot of a facility that its size belongs to.
pub fn effect_place(effect: &EffectFound) -> &'static str {
    let parameter = effect.size.as_ref().map_or("", |size| &size.parameter);
    let robot = ROBOTS.iter().find(|(prefix, _)| parameter.starts_with(prefix));
    robot.map_or(place(effect.block), |(_, robot)| robot)
}

/// Returns component and cause of an effect (`gear: backlash`); the cause alone where the component is the place.
pub fn cause(effect: &EffectFound) -> String {
    let component = row_of(effect.id).map_or("", |row| row.component);
    match component.is_empty() || effect_place(effect).to_lowercase() == component {
        true => effect.name.to_owned(),
        false => format!("{component}: {}", effect.name),
    }
}

/// Returns place, component and cause of an effect (`Axis 2, gear: backlash`).
pub fn place_and_cause(effect: &EffectFound) -> String {
    let (place, cause) = (effect_place(effect), cause(effect));
    let joint = if cause.contains(": ") { ", " } else { ": " };
    format!("{place}{joint}{cause}")
}

/// Returns the principal size of an effect with its interval, in a readable unit, and the model's value.
pub fn sized(size: &EffectSize) -> String {
    let EffectSize { parameter, estimate: ParameterEstimate { value, lo, hi, unit }, model } = size;
    let is_share = unit == "1" && parameter.ends_with("_error");
    let (factor, unit) = if is_share { (100.0, "%".to_owned()) } else { prefixed(*value, unit) };
    let number = |value: f64| significant(factor * value, 3);
    let with_unit = |value: f64| format!("{} {unit}", number(value)).trim_end().to_owned();
    let instead = model.map_or_else(String::new, |model| format!(" instead of {}", with_unit(model)));
    format!("{} ({} to {}){instead}", with_unit(*value), number(*lo), number(*hi))
}

/// Returns an estimate with its interval and unit, as model files have it.
pub fn estimated(estimate: &ParameterEstimate) -> String {
    let [value, lo, hi] = [estimate.value, estimate.lo, estimate.hi].map(|value| significant(value, 4));
    let unit = if estimate.unit == "1" { "" } else { &estimate.unit };
    format!("{value} {unit} ({lo} to {hi})").replace("  ", " ")
}

/// Returns a fitted parameter with its meaning and name.
pub fn parameter(own: &FittedParameter) -> String {
    format!("{} ({})", own.meaning, own.name)
}

/// Returns the residual of a block before and after, in units of the noise.
pub fn residuals(block: &BlockAnswer) -> String {
    let (before, after) = (significant(block.residual.before, 3), significant(block.residual.after, 3));
    if before == after { before } else { format!("{before} -> {after}") }
}

/// Returns the root mean square of an error before and after.
pub fn remaining(error: &RemainingError) -> String {
    let (factor, unit) = prefixed(error.after.max(error.before), error.unit);
    let [before, after] = [error.before, error.after].map(|value| significant(factor * value, 3));
    let range = if before == after { before } else { format!("{before} -> {after}") };
    format!("{range} {unit}")
}

/// Returns the log-odds against a cause, or that its parameters are implausible.
pub(crate) fn ruled_out_by(out: &RuledOut) -> String {
    let odds = significant(out.log_odds, 3);
    match (out.implausible, out.log_odds > 0.0) {
        (false, _) => odds,
        (true, true) => format!("{odds} (with implausible parameters)"),
        (true, false) => "implausible parameters".to_owned(),
    }
}

/// Returns the text of a form outside the library.
pub fn behaviour(form: &FormFound) -> String {
    let terms: Vec<&str> = form.terms.iter().map(|term| term.name).collect();
    let strength = if form.holds { "behaves like" } else { "weakly resembles" };
    format!("{strength} {}", terms.join(" and "))
}

/// Returns the text of the residual and the gain.
pub fn residual(block: &BlockAnswer) -> String {
    let (before, after) = (significant(block.residual.before, 3), significant(block.residual.after, 3));
    let place = if block.held_out { "on held-out motion" } else { "on the motion that was fitted" };
    let percent = |share: f64| significant(100.0 * share, 3);
    let is_open = block.answer.is_open();
    let has_words = !is_open || block.form.as_ref().is_some_and(|form| form.holds);
    match block.gain.filter(|_| has_words) {
        None if is_open => {
            format!("residual {before} times the noise, {after} with the nearest possible cause, {place}")
        }
        None => format!("residual {before} times the noise {place}"),
        Some(gain) => {
            let range = |lo: f64, hi: f64| format!("{} to {} %", percent(lo), percent(hi));
            let elsewhere = gain.elsewhere.map(|Bounds { lo, hi }| format!("; on other motion {}", range(lo, hi)));
            format!(
                "residual {before} times the noise before, {after} after, {place}: gain {} % ({}){}",
                percent(gain.value),
                range(gain.lo, gain.hi),
                elsewhere.unwrap_or_default()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_states_unit_interval_and_model() {
        let estimate =
            |value: f64, lo: f64, hi: f64, unit: &str| ParameterEstimate { value, lo, hi, unit: unit.to_owned() };
        let size = |parameter: &str, estimate: ParameterEstimate, model: Option<f64>| {
            sized(&EffectSize { parameter: parameter.to_owned(), estimate, model })
        };
        assert_eq!(size("half_backlash", estimate(8e-4, 7e-4, 9e-4, "rad"), None), "0.8 mrad (0.7 to 0.9)");
        assert_eq!(size("torque_constant_error", estimate(-0.1, -0.2, 0.0, "1"), None), "-10 % (-20 to 0)");
        assert_eq!(
            size("coulomb", estimate(20.0, 19.0, 21.0, "N m"), Some(12.0)),
            "20 N m (19 to 21) instead of 12 N m"
        );
    }

    #[test]
    fn every_effect_has_words() {
        for effect in softdock_kernels::effects::EFFECTS {
            assert!(!effect_words(effect.id).contains(effect.id) && !effect.component.is_empty(), "{}", effect.id);
        }
        assert_eq!(effect_words("J7_backlash"), "gear: backlash");
    }
}
