//! Judged blocks with their answers, and withheld answers.

use crate::data::grid::Finding;
use crate::inference::judge::{BlockJudgement, Candidate};
use crate::inference::torque_error::TorqueError;
use crate::inference::unmodelled::Unmodelled;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict};

/// Judgement of a block, for the page of the diagnosis.
pub struct Judged {
    /// The block.
    pub block: MeasuredBlock,
    /// Its library.
    pub library: Vec<Hypothesis>,
    /// Forms outside the catalogue that an unexplained residual may have; empty for blocks without a dictionary.
    pub dictionary: Vec<Hypothesis>,
    /// Judgement of the block.
    pub judgement: BlockJudgement,
    /// Model error that no cause of the library explains.
    pub outside: Option<Unmodelled>,
}

impl Judged {
    /// Returns the fit of an answer: of the named causes, or of the form outside the library.
    pub fn found(&self, answer: &BlockAnswer) -> Option<&Candidate> {
        let named = self.judgement.ranking.iter().find(|candidate| candidate.admissible && !answer.effects.is_empty());
        let form = self.outside.as_ref().and_then(|outside| outside.form.as_ref()).filter(|form| form.holds);
        named.or(form.map(|form| &form.candidate))
    }

    /// Returns the answer with the form of its model error, if no cause of the library explains it.
    pub(crate) fn looked_outside(&mut self, answer: BlockAnswer, prismatic: bool) -> BlockAnswer {
        self.outside = answer.answer.is_open().then(|| self.unmodelled());
        // A hint beside the reasons of an inadequate model would be one more cause that does not hold.
        let form = self.outside.as_ref().and_then(|outside| outside.form.as_ref());
        match form.filter(|form| form.holds || answer.answer == DiagnosisVerdict::NotInLibrary) {
            Some(form) => answer.without_name().with_form(form, prismatic),
            None => answer,
        }
    }

    fn unmodelled(&self) -> Unmodelled {
        Unmodelled::of(&self.block, &self.library, &self.dictionary, &self.judgement)
    }

    /// Returns the relative torque errors of the nominal model and of an answer.
    pub(crate) fn torque_error(&self, answer: &BlockAnswer) -> Option<TorqueError> {
        let before = &self.judgement.clamped;
        let after = self.found(answer).map_or(before, |found| &found.fitted);
        TorqueError::of(&self.block, answer.held_out, [before, after])
    }
}

/// Answers of all blocks.
#[derive(Default)]
pub(crate) struct Blocks {
    pub(crate) answers: Vec<BlockAnswer>,
    pub(crate) judged: Vec<Judged>,
    /// Mean square of what a step of half the length changes in the whitened residuals.
    pub(crate) errors: Vec<f64>,
}

impl Blocks {
    /// Withholds the verdict on a block and reports the reason.
    pub(crate) fn withhold(&mut self, place: usize, what: String) -> Finding {
        let (own, answer) = (&mut self.judged[place], &mut self.answers[place]);
        own.outside = None;
        *answer = answer.clone().withheld(&own.library);
        answer.torque_error = own.torque_error(answer);
        Finding { recording: own.block.name.to_owned(), what }
    }
}

/// Returns whether the motion of a block is explained.
pub(crate) fn is_explained(answer: &BlockAnswer) -> bool {
    !answer.answer.is_open() || answer.form.as_ref().is_some_and(|form| form.holds)
}
