//! Agreement of answers with the identifiability of their blocks: what is named is determined, what is withheld is not, and
//! the effects that are not detectable are the rows that are not determined.

use crate::inference::identifiability::{BlockIdentifiability, Determination, IdentifiabilityRow};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, NotVisible};
use std::collections::BTreeSet;

/// Adapts identifiability to the answers, and states in each answer what is not detectable and what is confounded.
pub(crate) fn reconcile(answers: &mut [BlockAnswer], blocks: &mut [BlockIdentifiability]) {
    for block in blocks {
        if let Some(answer) = answers.iter_mut().find(|answer| answer.block == block.block) {
            block.rows.iter_mut().for_each(|row| adapt(row, answer));
            answer.not_visible = not_visible(block);
            answer.confounded = confounded(block);
        }
    }
}

/// Adapts a row to an answer. A named effect may be far larger than is plausible, and is determined at its size.
fn adapt(row: &mut IdentifiabilityRow, answer: &BlockAnswer) {
    let Some(id) = row.id else { return };
    if answer.answer == DiagnosisVerdict::Withheld {
        (row.determination, row.log_odds) = (Determination::Not, 0.0);
    } else if let Some(effect) = answer.effects.iter().find(|effect| effect.id == id) {
        // Several hypotheses may be forms of one effect.
        row.determination = Determination::Determined;
        row.log_odds = row.log_odds.max(effect.log_odds);
    }
}

/// Effects none of whose forms is determined, each once.
fn not_visible(block: &BlockIdentifiability) -> Vec<NotVisible> {
    let is_determined = |row: &&IdentifiabilityRow| row.determination == Determination::Determined;
    let determined: BTreeSet<&str> = block.rows.iter().filter(is_determined).filter_map(|row| row.id).collect();
    let mut all: Vec<NotVisible> = Vec::new();
    for row in &block.rows {
        let Some(id) = row.id.filter(|id| !determined.contains(id)) else { continue };
        match all.iter_mut().find(|own| own.id == id) {
            Some(own) => own.log_odds = own.log_odds.max(row.log_odds),
            None => all.push(NotVisible { id, name: row.name, block: block.block, log_odds: row.log_odds }),
        }
    }
    all
}

/// Pairs of effects that are confounded.
fn confounded(block: &BlockIdentifiability) -> Vec<[&'static str; 2]> {
    let id = |key: &String| block.rows.iter().find_map(|row| row.id.filter(|id| id == key));
    block.confounded.iter().filter_map(|pair| Some([id(&pair.rows[0])?, id(&pair.rows[1])?])).collect()
}
