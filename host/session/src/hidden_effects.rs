//! Applies effects that the session does not know to an emulated facility.

use crate::error::Result;
use softdock_campaign::Scenario;
use softdock_kernels::fields::{from_slice, to_vec};
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use std::path::Path;

/// Returns the model and the draw of a facility with the effects of a file, if there is one.
pub(crate) fn with_effects(
    scenario: &Scenario,
    effects: Option<&Path>,
    draw: Params<f64>,
) -> Result<(Model, Params<f64>)> {
    let Some(effects) = effects else {
        return Ok((scenario.model.clone(), draw));
    };
    let other = scenario.with_effects(effects)?;
    let params = replaced(&draw, &scenario.model.nominal, &other.model.nominal);
    Ok((other.model, params))
}

/// Returns the draw, with the effects' changes of each parameter.
fn replaced(draw: &Params<f64>, before: &Params<f64>, after: &Params<f64>) -> Params<f64> {
    let (before, after) = (to_vec(before), to_vec(after));
    let changed = before.iter().zip(&after).zip(to_vec(draw));
    let values: Vec<f64> =
        changed.map(|((before, after), drawn)| if before == after { drawn } else { *after }).collect();
    from_slice(&values)
}
