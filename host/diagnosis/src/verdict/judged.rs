//! Judged blocks with their answers, and withheld answers.

use crate::data::grid::Finding;
use crate::inference::fit::Fitted;
use crate::inference::judge::{BlockJudgement, Candidate, NoiseFrom};
use crate::inference::recordings::BlockRecordings;
use crate::inference::torque_error::TorqueError;
use crate::inference::unmodelled::Unmodelled;
use crate::model::block::{MeasuredBlock, MeasuredOutput};
use crate::model::hypothesis::Hypothesis;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict};
use crate::verdict::errors::RemainingError;
use softdock_analysis::number::significant;

/// Share of the measured torque that a model may miss where its residual itself is the only estimate of the noise.
const LARGE_TORQUE_ERROR: f64 = 0.2;

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

    /// Returns an answer with the errors that the model has without and with it.
    ///
    /// Without repeats the noise is estimated from the residual, which then looks like noise however large it is: a model
    /// that misses much of the torque is not without error.
    pub(crate) fn with_errors(&self, answer: BlockAnswer) -> BlockAnswer {
        let answer = self.with_remaining(answer);
        let finds_nothing = matches!(answer.answer, DiagnosisVerdict::NoEffect | DiagnosisVerdict::NoPracticalEffect);
        let error = answer.torque_error.filter(|error| error.after > LARGE_TORQUE_ERROR);
        match error.filter(|_| finds_nothing && self.judgement.noise_from == NoiseFrom::Richest) {
            Some(error) => answer.inadequate_by(format!(
                "the model misses {} % of the torque, and without repeats of a motion model error and noise are not separable",
                significant(100.0 * error.after, 2)
            )),
            None => answer,
        }
    }

    /// Returns an answer with its torque error and the error that remains.
    fn with_remaining(&self, mut answer: BlockAnswer) -> BlockAnswer {
        let before = &self.judgement.clamped;
        let after = self.found(&answer).map_or(before, |found| &found.fitted);
        answer.torque_error = TorqueError::of(&self.block, answer.held_out, [before, after]);
        answer.remaining = match &answer.torque_error {
            Some(error) => vec![self.torque(error)],
            None => self.outputs(answer.held_out, [before, after]),
        };
        answer
    }

    /// Torque or force of a drive that its model misses.
    fn torque(&self, error: &TorqueError) -> RemainingError {
        let slides = self.block.channels[0].unit == "m";
        let (signal, unit) = if slides { ("force", "N") } else { ("torque", "N m") };
        let [before, after] = [error.before, error.after].map(|share| share * error.measured_rms);
        RemainingError { signal, unit, before, after, below_hz: Some(error.cutoff_hz) }
    }

    /// What the model misses of each measured output, averaged over repeats.
    fn outputs(&self, held_out: bool, fits: [&Fitted; 2]) -> Vec<RemainingError> {
        let part = self.block.part(held_out);
        let [before, after] = fits.map(|fitted| root_mean_squares(&part, &fitted.values(&self.block.base)));
        let channels = self.block.channels.iter().zip(before.into_iter().zip(after));
        let row = |(channel, (before, after)): (&MeasuredOutput, (f64, f64))| RemainingError {
            signal: channel.name,
            unit: channel.unit,
            before,
            after,
            below_hz: None,
        };
        channels.map(row).collect()
    }
}

/// Root mean square of each channel's residual.
fn root_mean_squares(part: &BlockRecordings, set: &[f64]) -> Vec<f64> {
    let residuals = part.means(set);
    let rows = residuals.first().map_or(0, nalgebra::DMatrix::nrows);
    let of = |row: usize| {
        let (sum, count) = residuals.iter().fold((0.0, 0), |(sum, count), residual| {
            (sum + residual.row(row).norm_squared(), count + residual.ncols())
        });
        (sum / count as f64).sqrt()
    };
    (0..rows).map(of).collect()
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
        *answer = own.with_errors(answer.clone().withheld());
        Finding { recording: own.block.name.to_owned(), what }
    }
}

/// Returns whether the motion of a block is explained.
pub(crate) fn is_explained(answer: &BlockAnswer) -> bool {
    !answer.answer.is_open() || answer.form.as_ref().is_some_and(|form| form.holds)
}
