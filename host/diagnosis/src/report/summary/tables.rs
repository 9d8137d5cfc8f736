//! Tables of a summary: answers block by block, named causes, reasons, calibration, remaining error; and next steps.

use super::headline::ranked;
use super::{ReportTable, identifiability};
use crate::diagnosis::Diagnosis;
use crate::model::place::place;
use crate::report::text::proposed;
use crate::report::wording::{
    behaviour, cause, effect_place, estimated, parameter, remaining, residuals, sized, verdict, words_and_id,
};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound};
use crate::verdict::errors::RemainingError;
use softdock_analysis::number::{posterior, significant, with_unit};

/// Tolerances from which on a calibrated parameter is listed.
const LISTED: f64 = 1.0;

/// Returns the tables that have rows.
pub(super) fn all(diagnosis: &Diagnosis) -> Vec<ReportTable> {
    let all = [blocks(diagnosis), named(diagnosis), reasons(diagnosis), calibrated(diagnosis), unexplained(diagnosis)];
    all.into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// Block by block: verdict, causes, sizes, probabilities, residual and error.
fn blocks(diagnosis: &Diagnosis) -> ReportTable {
    let rows = diagnosis.blocks.iter().flat_map(|block| {
        let common = [residuals(block), block.remaining.first().map_or_else(String::new, |_| error(block))];
        let effects: Vec<Option<&EffectFound>> = match block.effects.is_empty() {
            true => vec![None],
            false => block.effects.iter().map(Some).collect(),
        };
        effects.into_iter().enumerate().map(move |(number, effect)| {
            let [residual, error] = if number == 0 { common.clone() } else { Default::default() };
            let size = effect.and_then(|effect| effect.size.as_ref());
            vec![
                effect.map_or(place(block.block), effect_place).to_owned(),
                verdict(block.answer).to_owned(),
                effect.map_or_else(|| "-".to_owned(), cause),
                size.map_or_else(|| "-".to_owned(), sized),
                effect.map_or_else(|| "-".to_owned(), |effect| posterior(effect.p)),
                residual,
                error,
                effect.map_or(block.block, |effect| effect.id).to_owned(),
            ]
        })
    });
    ReportTable {
        title: "Answer, block by block",
        head: vec!["place", "verdict", "cause", "size (95 %)", "probability", "residual", "error", "id"],
        rows: rows.collect(),
        note: "residual: RMS in units of the noise, noise alone gives 1; error: RMS of torque, force or motion; before -> \
               after, on held-out motion where there is any"
            .to_owned(),
    }
}

/// Error of a block: of a drive relative to its torque, of others the largest.
fn error(block: &BlockAnswer) -> String {
    match &block.torque_error {
        Some(error) => {
            let [before, after] = [error.before, error.after].map(|share| significant(100.0 * share, 3));
            let range = if before == after { before } else { format!("{before} -> {after}") };
            format!("{range} % of the torque")
        }
        None => block.largest_error().map_or_else(String::new, remaining),
    }
}

/// Parameters of the named causes, with their evidence.
fn named(diagnosis: &Diagnosis) -> ReportTable {
    let rows = ranked(diagnosis).into_iter().flat_map(|effect| {
        effect.parameters.iter().enumerate().map(move |(number, (name, estimate))| {
            let first = |text: String| if number == 0 { text } else { String::new() };
            vec![
                first(effect_place(effect).to_owned()),
                first(cause(effect)),
                name.clone(),
                estimated(estimate),
                first(significant(effect.log_odds, 3)),
                first(effect.id.to_owned()),
            ]
        })
    });
    ReportTable {
        title: "Named, with evidence",
        head: vec!["place", "cause", "parameter", "value (95 %)", "log-odds", "id"],
        rows: rows.collect(),
        note: "log-odds: natural logarithm of the odds against the best explanation without the cause".to_owned(),
    }
}

/// Reasons of inadequate models, parameters beyond their tolerances, possible causes and forms outside the library.
fn reasons(diagnosis: &Diagnosis) -> ReportTable {
    let rows = diagnosis.blocks.iter().flat_map(|block| {
        let beyond = block.fitted.iter().filter(|own| own.is_beyond_tolerance() && block.inadequate.is_empty());
        let beyond = beyond.map(|own| {
            let [value, model] = [own.value, own.model].map(|value| with_unit(value, own.unit));
            let tolerances = significant(own.tolerances, 2);
            format!("{} would have to be {value} instead of {model}: {tolerances} tolerances off", parameter(own))
        });
        let possible = block.possible.iter().map(|effect| format!("possible, but not sufficient: {}", cause(effect)));
        let form = block.form.iter().map(|form| format!("it {}", behaviour(form)));
        let partner = block.partner_missing.iter().map(|id| format!("excluded, but possible: {}", words_and_id(id)));
        let all = block.inadequate.iter().cloned().chain(beyond).chain(possible).chain(form).chain(partner);
        all.map(|reason| vec![place(block.block).to_owned(), reason])
    });
    ReportTable {
        title: "Not explained, and why",
        head: vec!["place", "reason"],
        rows: rows.collect(),
        note: String::new(),
    }
}

/// Parameters that were fitted within their tolerances and changed by one at least.
fn calibrated(diagnosis: &Diagnosis) -> ReportTable {
    let all = || diagnosis.blocks.iter().flat_map(|block| block.fitted.iter().map(move |own| (block, own)));
    let all = || all().filter(|(_, own)| !own.is_beyond_tolerance());
    let moved = all().filter(|(_, own)| own.tolerances.abs() >= LISTED);
    let rows: Vec<Vec<String>> = moved
        .map(|(block, own)| {
            vec![
                place(block.block).to_owned(),
                parameter(own),
                with_unit(own.value, own.unit),
                with_unit(own.model, own.unit),
                with_unit(own.value - own.model, own.unit),
                significant(own.tolerances, 2),
            ]
        })
        .collect();
    let note = format!("{} further parameters changed by less than one tolerance", all().count() - rows.len());
    ReportTable {
        title: "Calibrated within tolerance",
        head: vec!["place", "parameter", "fitted", "model", "change", "tolerances"],
        rows,
        note,
    }
}

/// Error that remains of each block: the largest of each unit.
fn unexplained(diagnosis: &Diagnosis) -> ReportTable {
    let rows = diagnosis.blocks.iter().flat_map(|block| {
        let is_largest = |own: &&RemainingError| {
            let alike = block.remaining.iter().filter(|other| other.unit == own.unit);
            alike.max_by(|a, b| a.after.total_cmp(&b.after)).is_some_and(|most| most.signal == own.signal)
        };
        block.remaining.iter().filter(is_largest).map(|own| {
            let band = own.below_hz.map_or_else(|| "all".to_owned(), |hz| format!("below {} Hz", significant(hz, 3)));
            let share = block.torque_error.map_or_else(String::new, |error| {
                format!("{} % of {}", significant(100.0 * error.after, 3), with_unit(error.measured_rms, own.unit))
            });
            vec![place(block.block).to_owned(), own.signal.to_owned(), remaining(own), band, share]
        })
    });
    ReportTable {
        title: "What remains unexplained",
        head: vec!["place", "signal", "RMS error, before -> after", "band", "after, of the measured RMS"],
        rows: rows.collect(),
        note: String::new(),
    }
}

/// Returns what to do and to measure next.
pub(super) fn next(diagnosis: &Diagnosis) -> Vec<String> {
    let mut all: Vec<String> = diagnosis.blocks.iter().filter_map(step).collect();
    all.extend(diagnosis.experiment.as_ref().map(|experiment| format!("Separate the rivals: {experiment}.")));
    all.extend(diagnosis.proposed.as_ref().map(|experiment| format!("Most discriminating: {}.", proposed(experiment))));
    if diagnosis.blocks.iter().any(|block| block.answer == DiagnosisVerdict::Named) {
        all.push("Diagnose a new recording with extended.toml, the model with the named causes.".to_owned());
    }
    all.extend(identifiability::motions(&diagnosis.identifiability));
    if diagnosis.provisional {
        all.push(
            "Record every motion three times, and another motion for --holdout: the answer is provisional.".to_owned(),
        );
    }
    all
}

/// What an open verdict on a block asks for.
fn step(block: &BlockAnswer) -> Option<String> {
    let place = place(block.block);
    match block.answer {
        DiagnosisVerdict::ModelInadequate => {
            Some(format!("{place}: correct the model where the reasons say so, and diagnose again."))
        }
        DiagnosisVerdict::NotInLibrary => Some(format!(
            "{place}: record motions at other speeds, loads and temperatures; compare on which of them the error depends."
        )),
        _ => None,
    }
}
