//! A block of the loop with what was measured at its inputs and outputs, and its residuals for any parameters.

pub mod body;
pub mod command;
pub mod contact;
pub mod controller;
pub mod dead_zone;
pub mod drive;
pub mod facility;
mod links;
pub mod response;
pub mod robot;
pub mod sensor;
mod shortcut;
pub mod toss;
mod trend;

use crate::inference::adequacy::Level;
use crate::inference::noise::{Noise, deviations, mean};
use crate::inference::spread::Experiment;
use crate::inference::unknown::{Prior, Role, Unknown};
use crate::recording::grid::Piece;
use crate::recording::smooth::band_powers;
use crate::steps::rounding;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use softdock_engine::blocks::Outputs;
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_engine::simulator::Simulator;
use softdock_kernels::block::Recorded;
use std::borrow::Cow;
use std::collections::BTreeMap;
use trend::{Aged, Detrended, detrended};

/// A measured signal that a block's model must give.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the block's output.
    pub name: &'static str,
    /// Place of the output in the block's field table.
    pub output: usize,
    /// SI unit.
    pub unit: &'static str,
}

/// One recording of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Name of the experiment: trials of one command share it.
    pub experiment: String,
    /// Whether it is kept from the fits, to judge them.
    pub held_out: bool,
    /// The inputs.
    pub recorded: Recorded,
    /// What was measured of each channel at the block's output samples.
    pub measured: Vec<Vec<f64>>,
}

/// A block, its recordings and what is known of it.
#[derive(Clone, Debug)]
pub struct MeasuredBlock {
    /// Which section of the loop.
    pub section: Section,
    /// Its name in answers (`R3 drive`).
    pub name: &'static str,
    /// Nominal parameters, in the order of the block's field table.
    pub base: Vec<f64>,
    /// What may differ unnoticed.
    pub nuisances: Vec<Unknown>,
    /// What is compared.
    pub channels: Vec<Channel>,
    /// Its recordings.
    pub trials: Vec<Trial>,
    /// Which samples of the residuals are judged.
    pub decimator: Decimator,
    /// Standard deviation of what each channel cannot resolve, in its unit; empty where the noise hides it.
    pub floor: Vec<f64>,
    /// Standard deviation of each channel's own noise; empty where it is not known.
    pub known_noise: Vec<f64>,
    /// The input that is the session's clock, where what grows with it must not count as noise.
    pub clock: Option<&'static str>,
    /// Who simulates it.
    pub simulator: Simulator,
    /// Residuals that hold nothing but noise, where the recordings have some; one row a channel.
    pub quiet: Vec<DMatrix<f64>>,
    /// Whether judged instants are independent of one another, as segments are that each begin anew: how what they pull
    /// scatters then tells how much their residuals say.
    pub stands_alone: bool,
    /// Parameters that are left as they are, and how far they may be off: what a fit finds is as uncertain as they are
    /// (the considered parameters of Tapley, Schutz and Born, Statistical Orbit Determination, 2004, ch. 6).
    pub considered: Vec<(&'static str, f64)>,
}

/// The recordings of a block as experiments: those to learn from or those to judge by.
pub struct Part<'a> {
    block: &'a MeasuredBlock,
    recordings: Vec<&'a Recorded>,
    /// Trials of each experiment, by their places in `recordings`.
    experiments: Vec<(&'a str, Vec<usize>)>,
    /// What was measured, low-passed: trial by trial, one row a channel.
    measured: Vec<DMatrix<f64>>,
    /// How many outputs the block has.
    outputs: usize,
}

impl MeasuredBlock {
    /// A block without recordings, of which nothing is known but parameters, with [`nuisances`] by their tolerance, and
    /// channels; judged sample by sample.
    pub(crate) fn of(
        section: Section,
        name: &'static str,
        base: Vec<f64>,
        tolerance: &[(&'static str, f64)],
        channels: Vec<Channel>,
    ) -> Self {
        Self {
            nuisances: nuisances(&section, &base, tolerance),
            section,
            name,
            base,
            channels,
            trials: Vec::new(),
            decimator: Decimator::none(),
            floor: Vec::new(),
            known_noise: Vec::new(),
            clock: None,
            simulator: Simulator::default(),
            quiet: Vec::new(),
            considered: Vec::new(),
            stands_alone: false,
        }
    }

    /// The trials that are held out, or the others.
    pub fn part(&self, held_out: bool) -> Part<'_> {
        self.part_of(|trial| trial.held_out == held_out)
    }

    /// Sum of squares of each trial's residual, low-passed, at such parameters.
    pub fn misfits(&self, set: &[f64]) -> Vec<f64> {
        let all = self.part_of(|_| true);
        let residuals = all.of_trials(&all.all(), &[set.to_vec()]).remove(0);
        residuals.iter().map(DMatrix::norm_squared).collect()
    }

    /// One recording of each experiment that is held out, or of the others.
    pub fn firsts(&self, held_out: bool) -> Vec<&Trial> {
        let mut firsts: Vec<&Trial> = Vec::new();
        for trial in self.trials.iter().filter(|trial| trial.held_out == held_out) {
            if firsts.iter().all(|first| first.experiment != trial.experiment) {
                firsts.push(trial);
            }
        }
        firsts
    }

    fn part_of(&self, is_member: impl Fn(&Trial) -> bool) -> Part<'_> {
        let outputs = self.section.outputs().len();
        let mut part =
            Part { block: self, recordings: Vec::new(), experiments: Vec::new(), measured: Vec::new(), outputs };
        for trial in self.trials.iter().filter(|trial| is_member(trial)) {
            let place = part.recordings.len();
            match part.experiments.iter_mut().find(|experiment| experiment.0 == trial.experiment) {
                Some(experiment) => experiment.1.push(place),
                None => part.experiments.push((&trial.experiment, vec![place])),
            }
            part.recordings.push(&trial.recorded);
            part.measured.push(table(trial.measured.iter().map(|row| self.decimator.pass(row.clone(), 1)).collect()));
        }
        part
    }

    /// Simulates it for every recording and every parameter set: the samples that are judged.
    pub fn simulate(&self, recordings: &[&Recorded], sets: &[Vec<f64>]) -> Outputs {
        self.simulator.simulate(&self.section, recordings, sets, &self.decimator)
    }

    /// Share of a parameter's standard deviation over which difference quotients are taken.
    pub fn quotient(&self) -> f64 {
        if self.simulator.is_single(&self.section) { QUOTIENT_SINGLE } else { QUOTIENT }
    }

    /// Residuals that hold nothing but noise: what repeats differ by at the nominal parameters, or quiet stretches; none
    /// where the recordings have neither.
    pub fn noise_alone(&self) -> Vec<DMatrix<f64>> {
        let learn = self.part(false);
        if !learn.has_repeats() {
            return self.quiet.clone();
        }
        let mut series = learn.deviations(&self.base);
        series.extend(self.part(true).deviations(&self.base));
        series
    }

    /// Whether what repeats differ by at such parameters grew with the session, otherwise than all alike.
    pub fn grew(&self, set: &[f64]) -> bool {
        self.clock.is_some() && self.part_of(|_| true).detrended(set).grew
    }

    /// From one judged sample of a trial to the next \[s\].
    pub fn judged_step(&self, trial: &Trial) -> f64 {
        trial.recorded.step * (trial.recorded.stride * self.decimator.every()) as f64
    }

    /// The place of a parameter in the field table.
    pub fn field(&self, name: &str) -> usize {
        self.section.parameters().iter().position(|field| field.name == name).expect("the name of a block's parameter")
    }

    /// What a recording has of an input at every instant of the simulation.
    pub(crate) fn input<'a>(&self, trial: &'a Trial, name: &str) -> impl Iterator<Item = f64> + use<'a> {
        let fields = self.section.inputs();
        let place = fields.iter().position(|field| field.name == name).expect("the name of a block's input");
        trial.recorded.inputs.iter().skip(place).step_by(fields.len()).copied()
    }
}

impl<'a> Part<'a> {
    /// The same recordings, each an experiment by itself.
    pub fn repeats_apart(&self) -> Self {
        let alone = |(name, members): &(&'a str, Vec<usize>)| {
            let name = *name;
            members.iter().map(move |member| (name, vec![*member])).collect::<Vec<_>>()
        };
        let experiments = self.experiments.iter().flat_map(alone).collect();
        Self { recordings: self.recordings.clone(), measured: self.measured.clone(), experiments, ..*self }
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.recordings.is_empty()
    }

    /// Whether any experiment was repeated: only then is its noise known.
    pub fn has_repeats(&self) -> bool {
        self.experiments.iter().any(|(_, members)| members.len() > 1)
    }

    /// Residuals (measured less simulated, low-passed) of some trials for every parameter set: `[set][trial]`.
    fn of_trials(&self, trials: &[usize], sets: &[Vec<f64>]) -> Vec<Vec<DMatrix<f64>>> {
        let recordings: Vec<&Recorded> = trials.iter().map(|trial| self.recordings[*trial]).collect();
        self.of_recordings(&recordings, trials, sets)
    }

    /// The same, for the inputs of some recordings and what was measured in trials.
    fn of_recordings(&self, recordings: &[&Recorded], trials: &[usize], sets: &[Vec<f64>]) -> Vec<Vec<DMatrix<f64>>> {
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
    fn of_channels(&self, outputs: &[f64]) -> DMatrix<f64> {
        let channels = &self.block.channels;
        let of = |row: usize, sample: usize| outputs[sample * self.outputs + channels[row].output];
        DMatrix::from_fn(channels.len(), outputs.len() / self.outputs, of)
    }

    fn all(&self) -> Vec<usize> {
        (0..self.recordings.len()).collect()
    }

    /// What the repeats of each experiment differ by, for one parameter set.
    pub fn deviations(&self, set: &[f64]) -> Vec<DMatrix<f64>> {
        self.detrended(set).noise
    }

    /// What the repeats of each experiment differ by but for trends, where there is a session's clock.
    fn detrended(&self, set: &[f64]) -> Detrended {
        let trials = self.of_trials(&self.all(), &[set.to_vec()]).remove(0);
        let of = |(_, members): &(&str, Vec<usize>)| Aged {
            deviations: deviations(&cut(members, &trials)),
            ages: self.block.clock.map_or_else(Vec::new, |clock| self.ages(clock, members)),
        };
        let repeats: Vec<Aged> = self.experiments.iter().filter(|(_, members)| members.len() > 1).map(of).collect();
        match self.block.clock {
            Some(_) => detrended(repeats, &|| rounding(self.block)),
            None => Detrended { noise: repeats.into_iter().flat_map(|own| own.deviations).collect(), grew: false },
        }
    }

    /// When each of some repeats began \[s\], from their mean on.
    fn ages(&self, clock: &str, members: &[usize]) -> Vec<f64> {
        let field = self.block.section.inputs().iter().position(|field| field.name == clock).expect("an input's name");
        let starts: Vec<f64> = members.iter().map(|trial| self.recordings[*trial].inputs[field]).collect();
        let mean = starts.iter().sum::<f64>() / starts.len() as f64;
        starts.iter().map(|start| start - mean).collect()
    }

    /// Power of the noise that the simulation carries into the residuals for every parameter set, beyond what it carries
    /// for the model's own, in units of the noise: by what repeats differ by. 0 without repeats.
    pub fn carried(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<f64> {
        if sets.is_empty() || !self.has_repeats() {
            return vec![0.0; sets.len()];
        }
        let all: Vec<Vec<f64>> = std::iter::once(&self.block.base).chain(sets).cloned().collect();
        let powers = self.whitened_deviations(noise, &all).into_iter().map(|own| own.norm_squared() / own.len() as f64);
        let powers: Vec<f64> = powers.collect();
        powers[1..].iter().map(|power| power - powers[0]).collect()
    }

    /// The noise of these recordings for one parameter set, by what repeats differ by, in units of the noise that all are
    /// whitened by: some motions are noisier than others, as those through many steps of a reading are.
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

    /// What the residuals of the repeats of each experiment differ by, whitened, one after the other, for every parameter
    /// set.
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

    /// The same where all repeats of an experiment are simulated as if they had begun at one time: by it sets differ in what
    /// they let through of the inputs' noise, and in nothing else.
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

    /// Residuals of each experiment, averaged over its repeats, for one parameter set.
    pub fn means(&self, set: &[f64]) -> Vec<DMatrix<f64>> {
        self.averaged(&self.of_trials(&self.all(), &[set.to_vec()]).remove(0))
    }

    /// Residuals of all trials as those of each experiment, averaged over its repeats.
    fn averaged(&self, trials: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
        self.experiments.iter().map(|(_, members)| mean(&cut(members, trials))).collect()
    }

    /// The noise for one parameter set before any hypothesis: by the repeats, or of no colour without any; `None` if it
    /// cannot be told.
    pub fn noise(&self, set: &[f64]) -> Option<Noise> {
        match self.has_repeats() {
            true => Noise::above(&self.deviations(set), &self.block.floor),
            false => Noise::rough(&self.means(set), &self.block.floor),
        }
    }

    /// Whitened mean residuals of all experiments, one after the other, for every parameter set.
    pub fn whitened(&self, noise: &Noise, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let whiten = |trials: Vec<DMatrix<f64>>| {
            let of = |(_, members): &(&str, Vec<usize>)| noise.whiten(&mean(&cut(members, &trials)), members.len());
            bounded(self.experiments.iter().flat_map(of).collect())
        };
        self.of_trials(&self.all(), sets).into_par_iter().map(whiten).collect()
    }

    /// The experiments, with their rows of the whitened residuals.
    pub fn experiments(&self, noise: &Noise) -> Vec<Experiment> {
        let mut start = 0;
        let of = |(_, members): &(&str, Vec<usize>)| {
            let shortest = members.iter().map(|trial| self.measured[*trial].ncols()).min().unwrap_or(0);
            let end = start + shortest.saturating_sub(noise.order()) * self.block.channels.len();
            Experiment { rows: std::mem::replace(&mut start, end)..end, repeats: members.len() }
        };
        self.experiments.iter().map(of).collect()
    }

    /// A repeat as if it had begun when all repeats of its experiment did on the average; `field` is the place of the
    /// time among the inputs.
    fn on_average(&self, members: &[usize], trial: usize, field: Option<usize>) -> Cow<'a, Recorded> {
        let Some(field) = field else { return Cow::Borrowed(self.recordings[trial]) };
        let start = |trial: &usize| self.recordings[*trial].inputs[field];
        let shift = members.iter().map(start).sum::<f64>() / members.len() as f64 - start(&trial);
        let mut recorded = self.recordings[trial].clone();
        let width = self.block.section.inputs().len();
        recorded.inputs.iter_mut().skip(field).step_by(width).for_each(|time| *time += shift);
        Cow::Owned(recorded)
    }
}

/// Difference quotients in double precision, and in single, where a smaller difference would be one of roundings.
const QUOTIENT: f64 = 2e-3;
const QUOTIENT_SINGLE: f64 = 5e-2;
/// Parameter sets whose outputs are held at once: those of ten recordings of six channels fill some hundred megabytes.
const MOST_SETS: usize = 128;

/// Travels and depths whose tolerance is a factor: they cannot be negative.
const FACTORS: [&str; 2] = ["presliding_travel", "damping_onset"];

/// What may differ unnoticed: normal about the nominal values, with the standard deviations of a rig's tolerance.
fn nuisances(section: &Section, base: &[f64], tolerance: &[(&'static str, f64)]) -> Vec<Unknown> {
    let of = |(name, sd): &(&'static str, f64)| {
        let unknown = Unknown::of(section, name, Prior::Normal { mean: 0.0, sd: *sd }, Role::Nuisance);
        let mean = base[unknown.field];
        let prior = match FACTORS.contains(name) {
            true => Prior::LogNormal { centre: mean, spread: sd / mean },
            false => Prior::Normal { mean, sd: *sd },
        };
        Unknown { prior, ..unknown }
    };
    tolerance.iter().map(of).collect()
}

/// Whitened residuals within what can be reckoned with.
///
/// Parameters that nothing in the library forbids (a fixture too stiff for the step) may make a simulation diverge: then it
/// explains nothing, and must not spread.
fn bounded(mut whitened: Vec<f64>) -> DVector<f64> {
    whitened.iter_mut().for_each(|w| *w = if w.is_nan() { FARTHEST } else { w.clamp(-FARTHEST, FARTHEST) });
    DVector::from_vec(whitened)
}

/// Greatest whitened residual: far beyond what any recording shows, and small enough for sums of squares and their products.
const FARTHEST: f64 = 1e8;

/// Rows of equal length as a matrix.
fn table(rows: Vec<Vec<f64>>) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows[0].len(), |c, t| rows[c][t])
}

/// The repeats of an experiment cut to the shortest.
fn cut(members: &[usize], trials: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
    let shortest = members.iter().map(|trial| trials[*trial].ncols()).min().unwrap_or(0);
    members.iter().map(|trial| trials[*trial].columns(0, shortest).into_owned()).collect()
}

/// How many samples of a recording one judged sample stands for: as few as what repeats have in common, in the signal
/// that is judged, stands out of what they differ by; at least two.
///
/// Above that frequency there is nothing to explain, only noise to be mistaken for something.
pub(crate) fn judged_steps(pieces: &[Piece], signal: &str) -> usize {
    highest(pieces, signal).map_or(DEFAULT_STEPS, |highest| ((0.4 / highest) as usize).clamp(2, MOST_STEPS))
}

/// Highest frequency, in cycles a sample, up to which what repeats have in common in a signal stands out of what they
/// differ by; none without repeats, or where nothing does.
pub(crate) fn highest(pieces: &[Piece], signal: &str) -> Option<f64> {
    let mut repeats: BTreeMap<&str, Vec<&[f64]>> = BTreeMap::new();
    for piece in pieces {
        if let Some(samples) = piece.signals.get(signal) {
            repeats.entry(&piece.experiment).or_default().push(samples);
        }
    }
    repeats.values().filter_map(|list| highest_common(list)).max_by(f64::total_cmp)
}

/// Samples that one judged sample stands for where no repeats tell.
const DEFAULT_STEPS: usize = 4;
/// The most that it may stand for.
const MOST_STEPS: usize = 25;
/// Bands in which the power is compared, from nothing to the Nyquist frequency.
const BANDS: usize = 50;

/// Highest frequency, in cycles a sample, up to which the mean of repeats has more power than the noise in it.
fn highest_common(repeats: &[&[f64]]) -> Option<f64> {
    let count = repeats.len();
    let n = repeats.iter().map(|list| list.len()).min()?;
    if count < 2 || n < 4 * BANDS {
        return None;
    }
    let mean: Vec<f64> = (0..n).map(|i| repeats.iter().map(|list| list[i]).sum::<f64>() / count as f64).collect();
    let mut noise = vec![0.0; BANDS];
    for list in repeats {
        let rest: Vec<f64> = (0..n).map(|i| list[i] - mean[i]).collect();
        // Of the mean of so many repeats, from deviations with one degree of freedom less.
        let share = 1.0 / (count * (count - 1)) as f64;
        noise.iter_mut().zip(band_powers(&rest, BANDS)).for_each(|(sum, power)| *sum += share * power);
    }
    let signal = band_powers(&mean, BANDS);
    let bands = (0..BANDS).take_while(|band| signal[*band] > 2.0 * noise[*band]).count();
    (bands > 0).then_some(0.5 * bands as f64 / BANDS as f64)
}
