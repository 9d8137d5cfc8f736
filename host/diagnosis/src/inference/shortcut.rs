//! Mean residuals of all repeats from the simulation of one of them.

use crate::inference::fit::{Fitted, Start, fit};
use crate::inference::noise::{Noise, mean};
use crate::inference::recordings::{BlockRecordings, bounded, cut};
use nalgebra::{DMatrix, DVector};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use softdock_kernels::block::Recorded;
use std::borrow::Cow;

/// Approximation of mean residuals that simulates only the first repeat of each experiment.
///
/// Repeats have the same command, so a parameter changes all of them alike. The others are simulated once, at
/// parameters near those in question.
pub struct Shortcut<'a> {
    part: &'a BlockRecordings<'a>,
    noise: &'a Noise,
    /// Its recording.
    first: Vec<Cow<'a, Recorded>>,
    /// Mean residual of each experiment less that of its first repeat, at those parameters.
    rest: Vec<DMatrix<f64>>,
}

impl Shortcut<'_> {
    /// Returns the whitened mean residuals of all experiments, concatenated, for every parameter set.
    pub fn whitened(&self, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let whiten = |trials: Vec<DMatrix<f64>>| {
            let of = |(place, own): (usize, &DMatrix<f64>)| {
                let rest = &self.rest[place];
                let repeats = self.part.experiments[place].1.len();
                self.part.white(self.noise, own.columns(0, rest.ncols()) + rest, repeats)
            };
            bounded(trials.iter().enumerate().flat_map(of).collect())
        };
        self.part.of_typical(&self.first, sets).into_par_iter().map(whiten).collect()
    }

    /// Fits the null hypothesis: the nuisance parameters alone, from their nominal values.
    pub fn null(&self) -> Fitted {
        let block = self.part.block;
        let start = Start::nominal(block.nuisances.clone());
        fit(vec![start], &block.base, block.quotient(), &|sets| self.whitened(sets)).remove(0)
    }
}

impl<'a> BlockRecordings<'a> {
    /// Returns the approximation of [`whitened`](Self::whitened) that simulates one repeat of each experiment; it is
    /// exact at the parameters `at`.
    pub fn shortcut(&'a self, noise: &'a Noise, at: &[f64]) -> Shortcut<'a> {
        let trials = self.of_trials(&self.all(), &[at.to_vec()]).remove(0);
        let first = self.typical();
        let own = self.of_typical(&first, &[at.to_vec()]).remove(0);
        let rest = |((_, members), own): (&(&str, Vec<usize>), DMatrix<f64>)| {
            let mean = mean(&cut(members, &trials));
            let own = own.columns(0, mean.ncols()).into_owned();
            mean - own
        };
        let rest = self.experiments.iter().zip(own).map(rest).collect();
        Shortcut { part: self, noise, first, rest }
    }

    /// Residuals of the repeats that stand for all, for every parameter set: `[set][experiment]`.
    fn of_typical(&self, typical: &[Cow<'_, Recorded>], sets: &[Vec<f64>]) -> Vec<Vec<DMatrix<f64>>> {
        let measured: Vec<usize> = self.experiments.iter().map(|(_, members)| members[0]).collect();
        let recordings: Vec<&Recorded> = typical.iter().map(AsRef::as_ref).collect();
        self.of_recordings(&recordings, &measured, sets)
    }

    /// The first repeat of each experiment, on a session's clock as if it had begun when all repeats did on the average.
    fn typical(&self) -> Vec<Cow<'a, Recorded>> {
        let fields = self.block.section.inputs();
        let field = self.block.clock.and_then(|clock| fields.iter().position(|field| field.name == clock));
        self.experiments.iter().map(|(_, members)| self.on_average(members, members[0], field)).collect()
    }
}
