//! Parameter errors of right answers: error, Cramer-Rao bound, interval coverage.

use crate::plan::MachineKind;
use crate::plant::{Alias, From, GauntletPlant};
use crate::record::{NamedCause, RecordedAnswer, RecordedEstimate};
use crate::seal::{Hidden, SealedTruth};
use serde::Serialize;
use std::collections::BTreeMap;

/// Error of a parameter against the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterError {
    /// The case.
    pub case: String,
    /// Its machine.
    pub machine: MachineKind,
    /// Effect and parameter, by the generator's names.
    pub name: String,
    /// Size of the effect, in multiples of its detection limit.
    pub multiple: f64,
    /// Whether it is a size, not a form parameter.
    pub is_size: bool,
    /// Unit.
    pub unit: String,
    /// Absolute error, in the unit.
    pub error: f64,
    /// Absolute error over the hidden parameter.
    pub relative: f64,
    /// Cramer-Rao standard deviation, in the unit; `None` if the answer has none.
    pub sd: Option<f64>,
    /// Error over the Cramer-Rao standard deviation.
    pub by_bound: Option<f64>,
    /// Whether the 95 % interval contains the truth; `None` for a norm of several parameters.
    pub held: Option<bool>,
}

/// Returns the errors of the parameters that generator and diagnosis have in common.
pub fn compared(plant: &GauntletPlant, truth: &SealedTruth, answer: &RecordedAnswer) -> Vec<ParameterError> {
    let mut all = Vec::new();
    for hidden in &truth.hidden {
        let Some(found) = answer.effects.iter().find(|effect| plant.is_right(&hidden.id, &effect.id)) else {
            continue;
        };
        all.extend(of_cause(plant, truth, hidden, found));
    }
    all
}

/// Largest relative error of a size that is about the true one.
const ABOUT: f64 = 0.5;

/// Returns whether a named cause has about the size of a true effect: its error is at most half of the size, or its 95 %
/// interval contains the truth. A cause without comparable parameters agrees by its name alone.
pub fn is_about(plant: &GauntletPlant, truth: &SealedTruth, hidden: &Hidden, found: &NamedCause) -> bool {
    let all: Vec<ParameterError> = of_cause(plant, truth, hidden, found).collect();
    let has_size = all.iter().any(|own| own.is_size);
    let mut compared = all.iter().filter(|own| own.is_size || !has_size);
    compared.all(|own| own.relative <= ABOUT || own.held == Some(true))
}

/// Returns the errors of a named cause against a true effect.
fn of_cause(
    plant: &GauntletPlant,
    truth: &SealedTruth,
    hidden: &Hidden,
    found: &NamedCause,
) -> impl Iterator<Item = ParameterError> {
    plant.aliases(&hidden.id).filter_map(move |alias| one(plant, alias, truth, hidden, &found.parameters))
}

fn one(
    plant: &GauntletPlant,
    alias: &Alias,
    truth: &SealedTruth,
    hidden: &Hidden,
    found: &BTreeMap<String, RecordedEstimate>,
) -> Option<ParameterError> {
    let place = hidden.parameters.iter().position(|parameter| parameter.name == alias.parameter)?;
    let parameter = &hidden.parameters[place];
    let estimates: Vec<&RecordedEstimate> =
        alias.fields.iter().map(|field| found.get(*field)).collect::<Option<_>>()?;
    let [least, own] = expected(alias, truth, hidden, parameter.value, estimates[0].nominal)?;
    let value = match estimates[..] {
        [only] => only.value,
        _ => estimates.iter().map(|own| own.value * own.value).sum::<f64>().sqrt(),
    };
    let most = if place == 0 { least + grown(plant, &hidden.id, &truth.perturbations) } else { least };
    let expected = value.clamp(least.min(most), least.max(most));
    let sd = deviation(&estimates, value);
    let error = (value - expected).abs();
    Some(ParameterError {
        case: truth.case.clone(),
        machine: truth.machine,
        name: name(alias),
        multiple: truth.multiple,
        is_size: place == 0 && !matches!(alias.from, From::Along(..)),
        unit: parameter.unit.clone(),
        error,
        relative: error / own.abs(),
        sd,
        by_bound: sd.map(|sd| error / sd),
        held: (estimates.len() == 1).then(|| (estimates[0].lo..=estimates[0].hi).contains(&expected)),
    })
}

/// By how much perturbations of the machine let the size of an effect grow while it is recorded.
fn grown(plant: &GauntletPlant, effect: &str, perturbations: &[Hidden]) -> f64 {
    let adds = |own: &&Hidden| plant.grows.contains(&(own.id.as_str(), effect));
    perturbations.iter().filter(adds).filter_map(|own| own.parameters.first()).map(|size| size.value).sum()
}

/// Of a parameter that the fitter has under several names, which one.
fn name(Alias { effect, parameter, fields, from }: &Alias) -> String {
    match from {
        From::Along(..) | From::Share(_) | From::Scaled(_) => format!("{effect} {parameter} ({})", fields[0]),
        _ => format!("{effect} {parameter}"),
    }
}

/// What the fitter should find for a hidden parameter, and how much of that is hidden.
fn expected(alias: &Alias, truth: &SealedTruth, hidden: &Hidden, value: f64, nominal: f64) -> Option<[f64; 2]> {
    let drawn = |name: &str| truth.nuisance(name);
    let further = |name: &str| hidden.parameters.iter().find(|own| own.name == name).map(|own| own.value);
    Some(match alias.from {
        From::Zero => [value, value],
        From::Model => [nominal + value, value],
        From::Nominal(factor) => [nominal * drawn(factor)? + value, value],
        From::Factor(factor) => [(1.0 + value) * drawn(factor)? - 1.0, value],
        From::Share(share) => [(1.0 + value) * (1.0 + drawn(share)?) - 1.0, value],
        From::Drawn(besides) => [nominal + drawn(besides)? + value, value],
        From::Scaled(factor) => [nominal * drawn(factor)? * (1.0 + value), nominal * value],
        From::Along(component, besides) => {
            let own = value * further(component)?;
            let besides = if besides.is_empty() { 0.0 } else { drawn(besides)? };
            [own + besides, own]
        }
    })
}

/// Standard deviation of a number, or of the length of several that are known apart from one another.
fn deviation(estimates: &[&RecordedEstimate], length: f64) -> Option<f64> {
    let sd = match estimates {
        [only] => only.sd,
        _ => estimates.iter().map(|own| (own.value / length * own.sd).powi(2)).sum::<f64>().sqrt(),
    };
    (sd > 0.0).then_some(sd)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::tests::{answer, truth};
    use crate::plant::PLANTS;
    use crate::record::RecordedVerdict;
    use crate::seal::{Asks, Number};

    fn number(name: &str, value: f64, unit: &str) -> Number {
        Number { name: name.to_owned(), value, unit: unit.to_owned() }
    }

    #[test]
    fn parameter_error_is_relative_to_the_drawn_nominal() {
        let mut truth = truth(Asks::Effect, &["J1_coulomb"]);
        truth.hidden[0].parameters = vec![number("level", 4.0, "N m")];
        truth.nuisances = vec![number("coulomb_factor", 1.05, "")];
        let mut answer = answer(RecordedVerdict::Named, &["J1_coulomb"]);
        let estimate = RecordedEstimate { value: 25.5, lo: 24.6, hi: 26.4, sd: 0.25, nominal: 20.0 };
        answer.effects[0].parameters.insert("coulomb".to_owned(), estimate);
        let found = compared(&PLANTS[0], &truth, &answer);
        assert_eq!(found.len(), 1);
        assert!((found[0].error - 0.5).abs() < 1e-12 && (found[0].relative - 0.125).abs() < 1e-12, "{found:?}");
        assert!((found[0].by_bound.expect("a deviation") - 2.0).abs() < 1e-9 && found[0].held == Some(true));
    }

    #[test]
    fn component_error_includes_the_drawn_nuisance() {
        let mut truth = truth(Asks::Effect, &["S1_bias"]);
        truth.hidden[0].parameters = vec![number("force", 3.0, "N"), number("unit_x", -0.5, "")];
        truth.nuisances = vec![number("bias_force_x", 0.2, "N")];
        let mut answer = answer(RecordedVerdict::Named, &["S1_bias"]);
        let estimate = RecordedEstimate { value: -1.27, lo: -1.4, hi: -1.1, sd: 0.1, nominal: 0.0 };
        answer.effects[0].parameters.insert("bias_force_x".to_owned(), estimate);
        let sensor = PLANTS.iter().find(|plant| plant.name == "sensor").expect("a plant");
        let found = compared(sensor, &truth, &answer);
        assert_eq!((found.len(), found[0].held, found[0].is_size), (1, Some(true), false));
        assert!((found[0].error - 0.03).abs() < 1e-12 && (found[0].relative - 0.02).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn perturbation_is_confirmed_by_its_size_not_by_its_name_alone() {
        let mut truth = truth(Asks::Null, &[]);
        let parameters = vec![number("level", 0.5, "N m")];
        truth.perturbations = vec![Hidden { id: "J1_coulomb".to_owned(), scale: None, parameters }];
        truth.nuisances = vec![number("coulomb_factor", 1.0, "")];
        let named = |value: f64| {
            let mut answer = answer(RecordedVerdict::Named, &["J1_coulomb"]);
            let estimate = RecordedEstimate { value, lo: value - 0.1, hi: value + 0.1, sd: 0.05, nominal: 20.0 };
            answer.effects[0].parameters.insert("coulomb".to_owned(), estimate);
            is_about(&PLANTS[0], &truth, &truth.perturbations[0], &answer.effects[0])
        };
        assert_eq!([20.4, 20.7, 22.0, 19.5].map(named), [true, true, false, false]);
    }

    #[test]
    fn load_friction_that_comes_with_warming_up_adds_to_that_of_the_cold_machine() {
        let mut truth = truth(Asks::Null, &[]);
        let perturbation =
            |id: &str| Hidden { id: id.to_owned(), scale: None, parameters: vec![number("share", 0.04, "")] };
        truth.perturbations = vec![perturbation("J5_load_friction"), perturbation("temperature_load")];
        let named = |value: f64| {
            let mut answer = answer(RecordedVerdict::Named, &["J5_load_friction"]);
            let estimate = RecordedEstimate { value, lo: value - 0.001, hi: value + 0.001, sd: 0.0005, nominal: 0.0 };
            answer.effects[0].parameters.insert("load_coefficient".to_owned(), estimate);
            is_about(&PLANTS[0], &truth, &truth.perturbations[0], &answer.effects[0])
        };
        assert_eq!([0.01, 0.03, 0.07, 0.09, 0.12].map(named), [false, true, true, true, false]);
    }

    #[test]
    fn amplitude_is_the_norm_of_sine_and_cosine() {
        let mut truth = truth(Asks::Effect, &["J9_torque_ripple"]);
        truth.hidden[0].parameters = vec![number("amplitude", 5.0, "N m")];
        let mut answer = answer(RecordedVerdict::Named, &["J9_torque_ripple"]);
        for (name, value) in [("ripple_sin", 3.0), ("ripple_cos", -4.1)] {
            let estimate = RecordedEstimate { value, lo: value, hi: value, sd: 0.1, nominal: 0.0 };
            answer.effects[0].parameters.insert(name.to_owned(), estimate);
        }
        let found = compared(&PLANTS[0], &truth, &answer);
        assert!((found[0].error - 0.0803).abs() < 1e-3 && found[0].held.is_none(), "{found:?}");
        assert!((found[0].sd.expect("a deviation") - 0.1).abs() < 1e-9);
    }
}
