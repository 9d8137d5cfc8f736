//! The extended model: the model file as it is, with what a diagnosis found added at its end.

use crate::decide::{Estimate, Verdict};
use crate::diagnosis::Diagnosis;
use crate::words::{estimated, headline};
use std::collections::BTreeMap;

/// The text of the extended model file; `None` where the answer names nothing that could be added.
pub fn extended(model: &str, diagnosis: &Diagnosis) -> Option<String> {
    let tables = tables(diagnosis);
    if tables.is_empty() {
        return None;
    }
    let mut out = format!("{}\n\n# {}\n", model.trim_end(), headline(diagnosis));
    out += "# Written by softdock diagnose; intervals of 95 % stand beside the numbers.\n";
    for (id, parameters) in tables {
        out += &format!("\n[[effect]]\nid = \"{id}\"\n\n[effect.parameters]\n");
        for (name, estimate) in parameters {
            let unit = if estimate.unit == "1" { String::new() } else { format!(" {}", estimate.unit) };
            out += &format!("{name} = \"{}{unit}\"  # {}\n", estimate.value, estimated(estimate));
        }
    }
    Some(out)
}

/// Effects to add, each with its parameters: those that were named, or what something outside the library behaves like.
fn tables(diagnosis: &Diagnosis) -> BTreeMap<&'static str, BTreeMap<&String, &Estimate>> {
    let mut all: BTreeMap<&'static str, BTreeMap<&String, &Estimate>> = BTreeMap::new();
    let named = diagnosis.effects.iter().filter(|_| diagnosis.answer == Verdict::Named);
    let forms = diagnosis.blocks.iter().filter_map(|block| block.form.as_ref()).filter(|form| form.holds);
    let terms = forms.flat_map(|form| &form.terms).map(|term| (term.id, &term.parameters));
    // The terms of a form are one effect.
    for (id, parameters) in named.map(|effect| (effect.id, &effect.parameters)).chain(terms) {
        all.entry(id).or_default().extend(parameters);
    }
    all
}
