//! Extended model: the model file with the identified effects appended.

use crate::diagnosis::Diagnosis;
use crate::model::place::axis;
use crate::report::summary::headline;
use crate::report::wording::estimated;
use crate::verdict::answer::{DiagnosisVerdict, EffectFound};
use crate::verdict::estimates::ParameterEstimate;
use std::collections::BTreeMap;

/// An effect as it is written: its parameters, and their covariance.
#[derive(Default)]
struct Table<'a> {
    parameters: BTreeMap<&'a String, &'a ParameterEstimate>,
    covariance: &'a [Vec<f64>],
}

/// Returns the text of the extended model file; `None` if the answer names no effect to add.
///
/// `uncertain` adds the covariances, for readers that draw parameters from them.
pub fn extended(model: &str, diagnosis: &Diagnosis, uncertain: bool) -> Option<String> {
    let tables = tables(diagnosis);
    if tables.is_empty() {
        return None;
    }
    let mut out = format!("{}\n\n# {}\n", model.trim_end(), headline(diagnosis));
    out += "# Written by softdock diagnose; intervals of 95 % stand beside the numbers.\n";
    for ((joint, id), table) in tables {
        out += &format!("\n[[effect]]\nid = \"{id}\"\n");
        out += &joint.map_or_else(String::new, |joint| format!("joint = {joint}\n"));
        if uncertain && !table.covariance.is_empty() {
            let row = |row: &Vec<f64>| {
                format!("[{}]", row.iter().map(|cell| format!("{cell:e}")).collect::<Vec<_>>().join(", "))
            };
            let rows: Vec<String> = table.covariance.iter().map(row).collect();
            out += &format!("# Of the parameters in their order, SI units.\ncovariance = [{}]\n", rows.join(", "));
        }
        out += "\n[effect.parameters]\n";
        for (name, estimate) in table.parameters {
            let unit = if estimate.unit == "1" { String::new() } else { format!(" {}", estimate.unit) };
            out += &format!("{name} = \"{}{unit}\"  # {}\n", estimate.value, estimated(estimate));
        }
    }
    Some(out)
}

/// Effects to add, each with its parameters: those that were named, or what something outside the library behaves like.
fn tables(diagnosis: &Diagnosis) -> BTreeMap<(Option<usize>, &'static str), Table<'_>> {
    let mut all: BTreeMap<(Option<usize>, &'static str), Table> = BTreeMap::new();
    let blocks = diagnosis.blocks.iter().filter(|block| block.answer == DiagnosisVerdict::Named);
    let named: Vec<&EffectFound> = blocks.flat_map(|block| &block.effects).collect();
    let forms = diagnosis.blocks.iter().filter_map(|block| Some((axis(block.block), block.form.as_ref()?)));
    let forms = forms.filter(|(_, form)| form.holds);
    // The terms of a form are one effect.
    for (axis, term) in forms.flat_map(|(axis, form)| form.terms.iter().map(move |term| (axis, term))) {
        all.entry((axis, term.id)).or_default().parameters.extend(&term.parameters);
    }
    for effect in named {
        let table = all.entry((axis(effect.block), effect.id)).or_default();
        table.parameters.extend(&effect.parameters);
        if table.parameters.len() == effect.covariance.len() {
            table.covariance = &effect.covariance;
        }
    }
    all
}
