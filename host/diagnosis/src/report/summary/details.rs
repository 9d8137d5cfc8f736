//! Tables of one block: possible and nearest causes, form of the error, rejected causes, calibration.

use super::ReportTable;
use crate::report::wording::{cause, effect_words, estimated, parameter, ruled_out_by};
use crate::verdict::answer::BlockAnswer;
use crate::verdict::errors::FittedParameter;
use crate::verdict::estimates::ParameterEstimate;
use softdock_analysis::number::{significant, with_unit};
use std::collections::BTreeMap;

/// Returns the tables of a block that have rows.
pub fn all(answer: &BlockAnswer) -> Vec<ReportTable> {
    let all = [possible(answer), nearest(answer), form(answer), ruled_out(answer)];
    all.into_iter().chain([fitted(answer)]).filter(|table| !table.rows.is_empty()).collect()
}

fn table(title: &'static str, head: &[&'static str], rows: Vec<Vec<String>>) -> ReportTable {
    ReportTable { title, head: head.to_vec(), rows, note: String::new() }
}

fn listed(parameters: &BTreeMap<String, ParameterEstimate>) -> String {
    let all: Vec<String> =
        parameters.iter().map(|(name, estimate)| format!("{name} {}", estimated(estimate))).collect();
    all.join(", ")
}

fn possible(answer: &BlockAnswer) -> ReportTable {
    let rows = answer.possible.iter().map(|own| vec![cause(own), listed(&own.parameters), own.id.to_owned()]);
    table("Possible, but not sufficient", &["cause", "values (95 %)", "id"], rows.collect())
}

/// What the model of free runs has after, where no cause was named.
fn nearest(answer: &BlockAnswer) -> ReportTable {
    let all = answer.free_run.iter().filter(|_| answer.effects.is_empty()).flat_map(|run| &run.with);
    let rows = all.map(|own| vec![effect_words(own.id), listed(&own.parameters), own.id.to_owned()]);
    table("No cause is named; nearest hypothesis", &["cause", "values (95 %)", "id"], rows.collect())
}

fn form(answer: &BlockAnswer) -> ReportTable {
    let terms = answer.form.iter().flat_map(|form| &form.terms);
    let rows = terms.map(|term| {
        let stability = format!("{} %", significant(100.0 * term.stability, 3));
        vec![term.name.to_owned(), listed(&term.parameters), stability, term.id.to_owned()]
    });
    let head = ["term", "values (95 %)", "random halves that select it", "id"];
    table("Form of the error outside the library", &head, rows.collect())
}

fn ruled_out(answer: &BlockAnswer) -> ReportTable {
    let rows = answer.ruled_out.iter().map(|out| {
        let residual = out.residual.map_or_else(|| "-".to_owned(), |residual| significant(residual, 3));
        vec![effect_words(out.id), ruled_out_by(out), residual, out.id.to_owned()]
    });
    table("Ruled out", &["cause", "by log-odds", "residual", "id"], rows.collect())
}

/// Nuisance parameters, also those that changed by less than a tolerance.
fn fitted(answer: &BlockAnswer) -> ReportTable {
    let row = |own: &FittedParameter| {
        let [value, model] = [own.value, own.model].map(|value| with_unit(value, own.unit));
        vec![parameter(own), value, model, significant(own.tolerances, 2)]
    };
    let rows = answer.fitted.iter().map(row).collect();
    table("Fitted parameters of the model", &["parameter", "fitted", "model", "tolerances"], rows)
}
