//! Overall answer from the answers of all blocks.

use crate::diagnosis::{Diagnosis, Prepared};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, Residual};

/// Returns the overall answer: the most severe of all blocks.
pub(super) fn summed(prepared: Prepared, blocks: Vec<BlockAnswer>, numerical_error: Vec<f64>) -> Diagnosis {
    let answer = blocks.iter().map(|block| block.answer).max().unwrap_or(DiagnosisVerdict::NoEffect);
    let found = |block: &&BlockAnswer| block.answer >= DiagnosisVerdict::NoPracticalEffect;
    let main = blocks.iter().filter(found).max_by(|a, b| a.residual.before.total_cmp(&b.residual.before));
    let main = main.or(blocks.last());
    // What is hardly worth knowing is no cause beside one that is.
    let worth = |block: &&BlockAnswer| {
        block.answer > DiagnosisVerdict::NoPracticalEffect || answer <= DiagnosisVerdict::NoPracticalEffect
    };
    Diagnosis {
        answer,
        provisional: !prepared.provisional.is_empty(),
        effects: blocks.iter().filter(|block| worth(block)).flat_map(|block| block.effects.clone()).collect(),
        ruled_out: blocks.iter().flat_map(|block| block.ruled_out.clone()).collect(),
        gain: main.and_then(|block| block.gain),
        residual: main.map_or(Residual { before: 1.0, after: 1.0 }, |block| block.residual),
        not_visible: blocks.iter().flat_map(|block| block.not_visible.clone()).collect(),
        experiment: splitting(&blocks),
        proposed: None,
        reasons: prepared.provisional,
        isolability: prepared.isolability,
        identifiability: Vec::new(),
        findings: prepared.findings,
        data_quality: prepared.data_quality,
        blocks,
        numerical_error,
    }
}

/// Returns the discriminating experiments of the groups that the rivals of an ambiguous answer share, with each other
/// or with effects outside the library.
fn splitting(blocks: &[BlockAnswer]) -> Option<String> {
    let ambiguous = blocks.iter().find(|block| block.answer == DiagnosisVerdict::Ambiguous)?;
    let groups = softdock_kernels::effects::GROUPS.iter().filter(|group| {
        let found = ambiguous.effects.iter().filter(|effect| group.has(effect.id)).count();
        let missing = ambiguous.partner_missing.iter().any(|id| group.has(id));
        group.id != "own" && found >= if missing { 1 } else { 2 }
    });
    let splits: Vec<&str> = groups.map(|group| group.splits).collect();
    (!splits.is_empty()).then(|| splits.join("; "))
}
