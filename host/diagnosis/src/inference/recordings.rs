//! Recordings of a block, grouped into experiments, with their residuals for any parameters: per recording, averaged
//! over repeats, whitened, and the differences of repeats.

use crate::inference::adequacy::Level;
use crate::inference::autocorrelation::power;
use crate::inference::noise::{Noise, deviations, mean};
use crate::inference::parameter_deviations::ExperimentRows;
use crate::inference::trend::{Aged, Detrended, detrended};
use crate::model::block::{MeasuredBlock, Trial};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use softdock_kernels::block::Recorded;
use std::borrow::Cow;

/// Parameter sets whose outputs are held at once: those of ten recordings of six channels fill some hundred megabytes.
pub(super) const MOST_SETS: usize = 128;
/// Greatest whitened residual: far beyond what any recording shows, and small enough for sums of squares and their products.
const FARTHEST: f64 = 1e8;

impl MeasuredBlock {
    /// Returns the held-out recordings, or the training recordings.
    pub fn part(&self, held_out: bool) -> BlockRecordings<'_> {
        // Held-out recordings are only compared: their tare residual is not fitted.
        BlockRecordings::of(self, self.tared && !held_out, |trial| trial.held_out == held_out)
    }

    /// Returns the sum of squares of each recording's low-passed residual for a parameter set.
    pub fn misfits(&self, set: &[f64]) -> Vec<f64> {
        let all = BlockRecordings::of(self, false, |_| true);
        let residuals = all.of_trials(&all.all(), &[set.to_vec()]).remove(0);
        residuals.iter().map(DMatrix::norm_squared).collect()
    }

    /// Returns residuals that contain only noise: the differences of repeats at the nominal parameters, or quiet
    /// stretches; empty without either.
    pub fn noise_alone(&self) -> Vec<DMatrix<f64>> {
        let learn = self.part(false);
        if !learn.has_repeats() {
            return self.quiet.clone();
        }
        let mut series = learn.deviations(&self.base);
        series.extend(self.part(true).deviations(&self.base));
        series
    }

    /// Returns whether the differences of repeats, at a parameter set, contain a trend over the session that is not
    /// common to all experiments.
    pub fn grew(&self, set: &[f64]) -> bool {
        self.clock.is_some() && !BlockRecordings::of(self, false, |_| true).detrended(set).trend.is_empty()
    }

    /// Returns, for each parameter set, the power of the trend that it leaves as a share of what it explains of the
    /// recordings beyond the nominal one, in units of the noise: `None` without a trend, infinity if it explains nothing.
    pub(crate) fn shares_of_trend(&self, nominal: &[f64], sets: &[Vec<f64>]) -> Vec<Option<f64>> {
        if self.clock.is_none() {
            return vec![None; sets.len()];
        }
        let all = BlockRecordings::of(self, false, |_| true);
        let simulated: Vec<Vec<f64>> = std::iter::once(nominal.to_vec()).chain(sets.iter().cloned()).collect();
        let residuals = all.of_trials(&all.all(), &simulated);
        let (nominal, own) = residuals.split_first().expect("the nominal one is first");
        let without = all.averaged(nominal);
        own.iter().map(|trials| all.share_of_trend(&without, trials)).collect()
    }
}

/// Training or held-out recordings of a block, grouped into experiments.
pub struct BlockRecordings<'a> {
    pub(super) block: &'a MeasuredBlock,
    pub(super) recordings: Vec<&'a Recorded>,
    /// Trials of each experiment, by their places in `recordings`.
    pub(super) experiments: Vec<(&'a str, Vec<usize>)>,
    /// What was measured, low-passed: trial by trial, one row a channel.
    pub(super) measured: Vec<DMatrix<f64>>,
    /// How many outputs the block has.
    outputs: usize,
    /// Whether what a tare has left is fitted with the rest, see [`MeasuredBlock::tared`].
    tares: bool,
}

impl<'a> BlockRecordings<'a> {
    /// Selects recordings of a block; `tares` is whether their tare residuals are fitted.
    pub(super) fn of(block: &'a MeasuredBlock, tares: bool, is_member: impl Fn(&Trial) -> bool) -> Self {
        let outputs = block.section.outputs().len();
        let mut part =
            Self { block, recordings: Vec::new(), experiments: Vec::new(), measured: Vec::new(), outputs, tares };
        for trial in block.trials.iter().filter(|trial| is_member(trial)) {
            let place = part.recordings.len();
            match part.experiments.iter_mut().find(|experiment| experiment.0 == trial.experiment) {
                Some(experiment) => experiment.1.push(place),
                None => part.experiments.push((&trial.experiment, vec![place])),
            }
            part.recordings.push(&trial.recorded);
            let measured = trial.measured.iter().map(|row| block.decimator.pass(row.clone(), 1));
            part.measured.push(table(measured.collect()));
        }
        part
    }

    /// Returns the same recordings, each as an experiment of its own.
    pub fn repeats_apart(&self) -> Self {
        let alone = |(name, members): &(&'a str, Vec<usize>)| {
            let name = *name;
            members.iter().map(move |member| (name, vec![*member])).collect::<Vec<_>>()
        };
        let experiments = self.experiments.iter().flat_map(alone).collect();
        Self { recordings: self.recordings.clone(), measured: self.measured.clone(), experiments, ..*self }
    }

    /// Returns whether there are no recordings.
    pub fn is_empty(&self) -> bool {
        self.recordings.is_empty()
    }

    /// Returns whether any experiment was repeated, which is required to estimate the noise.
    pub fn has_repeats(&self) -> bool {
        self.experiments.iter().any(|(_, members)| members.len() > 1)
    }

    /// Residuals (measured less simulated, low-passed) of some trials for every parameter set: `[set][trial]`.
    pub(super) fn of_trials(&self, trials: &[usize], sets: &[Vec<f64>]) -> Vec<Vec<DMatrix<f64>>> {
        let recordings: Vec<&Recorded> = trials.iter().map(|trial| self.recordings[*trial]).collect();
        self.of_recordings(&recordings, trials, sets)
    }

    /// The same, for the inputs of some recordings and what was measured in trials.
    pub(super) fn of_recordings(
        &self,
        recordings: &[&Recorded],
        trials: &[usize],
        sets: &[Vec<f64>],
    ) -> Vec<Vec<DMatrix<f64>>> {
        let batch = |sets: &[Vec<f64>]| -> Vec<Vec<DMatrix<f64>>> {
            let outputs = self.block.simulate(recordings, sets);
            let residual = |set: usize, place: usize| {
                let mut residual = self.measured[trials[place]].clone();
                residual -= self.of_channels(&outputs[place][set]);
                residual
            };
            let of_set = |set| (0..trials.len()).map(|place| residual(set, place)).collect();
            (0..sets.len()).into_par_iter().map(of_set).collect()
        };
        sets.chunks(MOST_SETS).flat_map(batch).collect()
    }

    /// Outputs as the channels have them: one row a channel.
    pub(super) fn of_channels(&self, outputs: &[f64]) -> DMatrix<f64> {
        let channels = &self.block.channels;
        let of = |row: usize, sample: usize| outputs[sample * self.outputs + channels[row].output];
        DMatrix::from_fn(channels.len(), outputs.len() / self.outputs, of)
    }

    pub(super) fn all(&self) -> Vec<usize> {
        (0..self.recordings.len()).collect()
    }

    /// Returns the differences of repeats in each experiment, for a parameter set.
    pub fn deviations(&self, set: &[f64]) -> Vec<DMatrix<f64>> {
        self.detrended(set).noise
    }

    /// Trend of residuals over what they lack beside the nominal ones, which are averaged over repeats.
    fn share_of_trend(&self, nominal: &[DMatrix<f64>], trials: &[DMatrix<f64>]) -> Option<f64> {
        let Detrended { noise, trend } = self.detrended_residuals(trials);
        let explained: Vec<DMatrix<f64>> =
            nominal.iter().zip(self.averaged(trials)).map(|(without, with)| without - with).collect();
        let in_noise = |of: &dyn Fn(usize) -> f64| (0..trend.len()).map(|c| of(c) / power(&noise, c)).sum::<f64>();
        (!trend.is_empty()).then(|| in_noise(&|c| trend[c]) / in_noise(&|c| power(&explained, c)))
    }

    /// What the repeats of each experiment differ by but for trends, where there is a session's clock.
    pub(super) fn detrended(&self, set: &[f64]) -> Detrended {
        self.detrended_residuals(&self.of_trials(&self.all(), &[set.to_vec()])[0])
    }

    /// The same by the residuals of all trials.
    fn detrended_residuals(&self, trials: &[DMatrix<f64>]) -> Detrended {
        let of = |(_, members): &(&str, Vec<usize>)| Aged {
            deviations: deviations(&cut(members, trials)),
            ages: self.block.clock.map_or_else(Vec::new, |clock| self.ages(clock, members)),
        };
        let repeats: Vec<Aged> = self.experiments.iter().filter(|(_, members)| members.len() > 1).map(of).collect();
        match self.block.clock {
            Some(_) => detrended(repeats, &|| rounding(self.block)),
            None => Detrended::without_trend(repeats),
        }
    }

    /// When each of some repeats began \[s\], from their mean on.
    fn ages(&self, clock: &str, members: &[usize]) -> Vec<f64> {
        let field = self.block.section.inputs().iter().position(|field| field.name == clock).expect("an input's name");
        let starts: Vec<f64> = members.iter().map(|trial| self.recordings[*trial].inputs[field]).collect();
        let mean = starts.iter().sum::<f64>() / starts.len() as f64;
        starts.iter().map(|start| start - mean).collect()
    }

    /// Returns the power of the input noise that the simulation propagates into the residuals, for every parameter set,
    /// relative to that of the nominal parameters, in units of the noise. It is estimated from repeats and is 0 without
    /// them.
    pub fn carried(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<f64> {
        if sets.is_empty() || !self.has_repeats() {
            return vec![0.0; sets.len()];
        }
        let all: Vec<Vec<f64>> = std::iter::once(&self.block.base).chain(sets).cloned().collect();
        let powers = self.whitened_deviations(noise, &all).into_iter().map(|own| own.norm_squared() / own.len() as f64);
        let powers: Vec<f64> = powers.collect();
        powers[1..].iter().map(|power| power - powers[0]).collect()
    }

    /// Returns the noise level of these recordings for a parameter set, estimated from repeats, in units of the noise
    /// that whitens them: some motions are noisier than others.
    pub fn level(&self, noise: &Noise, set: &[f64]) -> Level {
        if !self.has_repeats() {
            return Level::LEARNT;
        }
        let whitened: Vec<f64> = self.deviations(set).iter().flat_map(|x| noise.whiten(x, 1)).collect();
        let own = bounded(whitened);
        // Of R deviations from a mean R - 1 are independent.
        let repeated = self.experiments.iter().map(|(_, members)| members.len()).filter(|count| *count > 1);
        let independent = 1.0 - repeated.clone().count() as f64 / repeated.sum::<usize>() as f64;
        Level { power: own.norm_squared() / own.len() as f64, samples: independent * own.len() as f64 }
    }

    /// Returns the whitened differences of repeats in each experiment, concatenated, for every parameter set.
    pub fn whitened_differences(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        self.differences(noise, &self.of_trials(&self.all(), sets))
    }

    /// The same of residuals `[set][trial]`.
    fn differences(&self, noise: &Noise, residuals: &[Vec<DMatrix<f64>>]) -> Vec<DVector<f64>> {
        let whitened = |residuals: &Vec<DMatrix<f64>>| {
            let of = |(_, members): &(&str, Vec<usize>)| deviations(&cut(members, residuals));
            bounded(self.experiments.iter().flat_map(of).flat_map(|x| noise.whiten(&x, 1)).collect())
        };
        residuals.par_iter().map(whitened).collect()
    }

    /// Returns the same with all repeats of an experiment simulated from one start time, so that parameter sets differ
    /// only in the input noise that they propagate.
    pub fn whitened_deviations(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        // What a drive that warms up changes from one repeat to the next is no noise: all begin at one time.
        let field = self.block.section.inputs().iter().position(|field| field.name == "time");
        let at_once = |trial: usize| {
            let own = self.experiments.iter().find(|(_, members)| members.contains(&trial));
            self.on_average(&own.expect("every trial belongs to an experiment").1, trial, field)
        };
        let recordings: Vec<Cow<'a, Recorded>> = self.all().into_iter().map(at_once).collect();
        let recordings: Vec<&Recorded> = recordings.iter().map(AsRef::as_ref).collect();
        self.differences(noise, &self.of_recordings(&recordings, &self.all(), sets))
    }

    /// Returns the residuals of each experiment, averaged over its repeats, for a parameter set.
    pub fn means(&self, set: &[f64]) -> Vec<DMatrix<f64>> {
        self.averaged(&self.of_trials(&self.all(), &[set.to_vec()]).remove(0))
    }

    /// Residuals of all trials as those of each experiment, averaged over its repeats.
    pub(super) fn averaged(&self, trials: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
        self.experiments.iter().map(|(_, members)| mean(&cut(members, trials))).collect()
    }

    /// Estimates the noise for a parameter set before any hypothesis: from repeats, or white without repeats; `None` if
    /// it is not identifiable.
    pub fn noise(&self, set: &[f64]) -> Option<Noise> {
        match self.has_repeats() {
            true => Noise::above(&self.deviations(set), &self.block.floor),
            false => Noise::rough(&self.means(set), &self.block.floor),
        }
    }

    /// Returns the whitened mean residuals of all experiments, concatenated, for every parameter set.
    pub fn whitened(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let whiten = |trials: Vec<DMatrix<f64>>| {
            let of = |(_, members): &(&str, Vec<usize>)| self.white(noise, mean(&cut(members, &trials)), members.len());
            bounded(self.experiments.iter().flat_map(of).collect())
        };
        self.of_trials(&self.all(), sets).into_par_iter().map(whiten).collect()
    }

    /// Returns the innovations of a residual averaged over repeats. If tare residuals are fitted, its mean has no
    /// information and is removed, as from every parameter set: the least-squares constant.
    pub(super) fn white(&self, noise: &Noise, mut residual: DMatrix<f64>, repeats: usize) -> Vec<f64> {
        if self.tares {
            let mean = residual.column_mean();
            residual.column_iter_mut().for_each(|mut sample| sample -= &mean);
        }
        noise.whiten(&residual, repeats)
    }

    /// Returns the experiments with their rows in the whitened residuals.
    pub fn experiments(&self, noise: &Noise) -> Vec<ExperimentRows> {
        let mut start = 0;
        let of = |(_, members): &(&str, Vec<usize>)| {
            let shortest = members.iter().map(|trial| self.measured[*trial].ncols()).min().unwrap_or(0);
            let end = start + shortest.saturating_sub(noise.order()) * self.block.channels.len();
            ExperimentRows { rows: std::mem::replace(&mut start, end)..end, repeats: members.len() }
        };
        self.experiments.iter().map(of).collect()
    }

    /// A repeat as if it had begun when all repeats of its experiment did on the average; `field` is the place of the
    /// time among the inputs.
    pub(super) fn on_average(&self, members: &[usize], trial: usize, field: Option<usize>) -> Cow<'a, Recorded> {
        let Some(field) = field else { return Cow::Borrowed(self.recordings[trial]) };
        let start = |trial: &usize| self.recordings[*trial].inputs[field];
        let shift = members.iter().map(start).sum::<f64>() / members.len() as f64 - start(&trial);
        let mut recorded = self.recordings[trial].clone();
        let width = self.block.section.inputs().len();
        recorded.inputs.iter_mut().skip(field).step_by(width).for_each(|time| *time += shift);
        Cow::Owned(recorded)
    }
}

/// Whitened residuals within what can be reckoned with.
///
/// Parameters that nothing in the library forbids (a fixture too stiff for the step) may make a simulation diverge: then it
/// explains nothing, and must not spread.
pub(super) fn bounded(mut whitened: Vec<f64>) -> DVector<f64> {
    whitened.iter_mut().for_each(|w| *w = if w.is_nan() { FARTHEST } else { w.clamp(-FARTHEST, FARTHEST) });
    DVector::from_vec(whitened)
}

/// Variance of the quantisation of each channel; empty if the readings lie on no steps.
fn rounding(block: &MeasuredBlock) -> Vec<f64> {
    let steps = block.quantisation.and_then(|quantisation| (quantisation.steps)(block));
    // Repeats meet a step in any phase where the output moves through steps: a uniform distribution.
    steps.map_or_else(Vec::new, |found| found.steps.iter().map(|step| step * step / 12.0).collect())
}

/// Rows of equal length as a matrix.
fn table(rows: Vec<Vec<f64>>) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows[0].len(), |c, t| rows[c][t])
}

/// The repeats of an experiment cut to the shortest.
pub(super) fn cut(members: &[usize], trials: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
    let shortest = members.iter().map(|trial| trials[*trial].ncols()).min().unwrap_or(0);
    members.iter().map(|trial| trials[*trial].columns(0, shortest).into_owned()).collect()
}
