//! The extended model: the model file as it is, with what a diagnosis found added at its end.

use crate::decide::Verdict;
use crate::diagnosis::Diagnosis;
use crate::words::{estimated, headline};

/// The text of the extended model file; `None` where the answer names nothing that could be added.
pub fn extended(model: &str, diagnosis: &Diagnosis) -> Option<String> {
    if diagnosis.answer != Verdict::Named {
        return None;
    }
    let mut out = format!("{}\n\n# {}\n", model.trim_end(), headline(diagnosis));
    out += "# Written by softdock diagnose; intervals of 95 % stand beside the numbers.\n";
    for effect in &diagnosis.effects {
        out += &format!("\n[[effect]]\nid = \"{}\"\n\n[effect.parameters]\n", effect.id);
        for (name, estimate) in &effect.parameters {
            let unit = if estimate.unit == "1" { String::new() } else { format!(" {}", estimate.unit) };
            out += &format!("{name} = \"{}{unit}\"  # {}\n", estimate.value, estimated(estimate));
        }
    }
    Some(out)
}
