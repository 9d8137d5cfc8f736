//! Headline: the answer of a diagnosis in a sentence that a reader can act on.

use crate::diagnosis::Diagnosis;
use crate::model::place::place;
use crate::report::wording::{behaviour, cause, effect_place, effect_words, place_and_cause, sized};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound};
use crate::verdict::errors::RemainingError;
use softdock_analysis::number::{posterior, significant, with_unit};

/// Returns the headline.
pub fn headline(diagnosis: &Diagnosis) -> String {
    let answer = sentence(diagnosis);
    // A named cause in one block is reported beside an open verdict in another.
    let beside = match diagnosis.answer > DiagnosisVerdict::Named {
        true => named(diagnosis).map_or_else(String::new, |named| format!(" Named: {named}.")),
        false => String::new(),
    };
    let provisional = if diagnosis.provisional { "Provisional. " } else { "" };
    format!("{provisional}{answer}{beside}")
}

fn sentence(diagnosis: &Diagnosis) -> String {
    let blocks = blocks(diagnosis, diagnosis.answer);
    match diagnosis.answer {
        DiagnosisVerdict::NoEffect => {
            format!("No model error: the model explains the recordings{}.", beyond(diagnosis))
        }
        DiagnosisVerdict::Withheld => {
            format!("No verdict on {}: the reasons are listed below.", places(&blocks))
        }
        DiagnosisVerdict::NoPracticalEffect => no_practical_effect(&blocks),
        DiagnosisVerdict::Named => named(diagnosis).map_or_else(String::new, |named| format!("{named}.")),
        DiagnosisVerdict::Ambiguous => ambiguous(diagnosis, &blocks),
        DiagnosisVerdict::NotInLibrary => not_in_library(&blocks),
        DiagnosisVerdict::ModelInadequate => inadequate(&blocks),
    }
}

/// Returns the effects of all named blocks, the most consequential first: the block whose answer reduces the residual
/// most, and in it the effect with the greatest evidence.
pub(crate) fn ranked(diagnosis: &Diagnosis) -> Vec<&EffectFound> {
    let reduction = |block: &BlockAnswer| block.residual.before.powi(2) - block.residual.after.powi(2);
    let mut all: Vec<(f64, &EffectFound)> = blocks(diagnosis, DiagnosisVerdict::Named)
        .into_iter()
        .flat_map(|block| block.effects.iter().map(move |effect| (reduction(block), effect)))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.log_odds.total_cmp(&a.1.log_odds)));
    all.into_iter().map(|(_, effect)| effect).collect()
}

/// Returns the most consequential named cause with its size and probability, and how many more there are.
fn named(diagnosis: &Diagnosis) -> Option<String> {
    let ranked = ranked(diagnosis);
    let first = ranked.first()?;
    let more = match ranked.len() - 1 {
        0 => String::new(),
        count => format!(", and {count} more"),
    };
    Some(format!("{}, {}{more}", with_size(first), posterior(first.p)))
}

fn with_size(effect: &EffectFound) -> String {
    let size = effect.size.as_ref().map_or_else(String::new, |size| format!(" {}", sized(size)));
    format!("{}{size}", place_and_cause(effect))
}

fn no_practical_effect(blocks: &[&BlockAnswer]) -> String {
    let Some((effect, block)) = blocks.iter().find_map(|block| Some((block.effects.first()?, block))) else {
        return "No correction needed: no effect has a practical gain.".to_owned();
    };
    let gain = block.gain.map_or_else(String::new, |gain| format!(" ({} %)", significant(100.0 * gain.value, 2)));
    format!("No correction needed: {} has no practical gain{gain}.", with_size(effect))
}

fn ambiguous(diagnosis: &Diagnosis, blocks: &[&BlockAnswer]) -> String {
    let Some(block) = blocks.first() else { return String::new() };
    let found = block.effects.iter().map(|effect| format!("{}, {}", cause(effect), posterior(effect.p)));
    let missing = block.partner_missing.iter().map(|id| format!("{} (excluded)", effect_words(id)));
    let rivals: Vec<String> = found.chain(missing).collect();
    let place = block.effects.first().map_or(place(block.block), effect_place);
    let what = if diagnosis.proposed.is_some() { "record the proposed experiment" } else { "see what to measure next" };
    format!("{place}: {}; these recordings do not separate them, {what}.", rivals.join(", or "))
}

fn not_in_library(blocks: &[&BlockAnswer]) -> String {
    let Some(block) = blocks.first() else { return String::new() };
    let size = block.largest_error().map_or_else(String::new, |error| format!(" of {}", error_size(error)));
    let form = block.form.as_ref().filter(|form| form.holds).map(|form| format!("; it {}", behaviour(form)));
    let others = others(blocks);
    format!(
        "{}: model error{size} without a cause in the library{}{others}.",
        place(block.block),
        form.unwrap_or_default()
    )
}

fn inadequate(blocks: &[&BlockAnswer]) -> String {
    let Some(block) = blocks.first() else { return String::new() };
    let reason = block.inadequate.first().map_or("", String::as_str);
    format!("{}: model inadequate; {reason}; correct it and diagnose again{}.", place(block.block), others(blocks))
}

/// Further places with the same verdict.
fn others(blocks: &[&BlockAnswer]) -> String {
    match blocks {
        [] | [_] => String::new(),
        [_, others @ ..] => format!("; the same in {}", places(others)),
    }
}

fn places(blocks: &[&BlockAnswer]) -> String {
    let places: Vec<&str> = blocks.iter().map(|block| place(block.block)).collect();
    places.join(", ")
}

/// Size of an error that a block's model has as given.
fn error_size(error: &RemainingError) -> String {
    let band = error.below_hz.map_or_else(String::new, |hz| format!(" below {} Hz", significant(hz, 3)));
    format!("{} RMS{band} ({})", with_unit(error.before, error.unit), error.signal)
}

/// Returns the parameters beyond their tolerances.
fn beyond(diagnosis: &Diagnosis) -> String {
    let all = diagnosis.blocks.iter().flat_map(|block| {
        let row = |(name, z): &(String, f64)| {
            format!("{}: {name} is {} tolerances off", place(block.block), significant(*z, 2))
        };
        block.nuisances_beyond_prior.iter().map(row)
    });
    let all: Vec<String> = all.collect();
    if all.is_empty() { String::new() } else { format!("; check {}", all.join(", ")) }
}

fn blocks(diagnosis: &Diagnosis, verdict: DiagnosisVerdict) -> Vec<&BlockAnswer> {
    diagnosis.blocks.iter().filter(|block| block.answer == verdict).collect()
}
