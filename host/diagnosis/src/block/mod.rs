//! A block of the loop with what was measured at its inputs and outputs, and its residuals for any parameters.

mod bandwidth;
pub mod body;
pub mod command;
pub mod contact;
pub mod controller;
pub mod dead_zone;
pub mod drive;
pub mod facility;
mod links;
mod part;
pub mod response;
pub mod robot;
pub mod sensor;
mod shortcut;
pub mod toss;
mod trend;

use crate::inference::unknown::{Prior, Role, Unknown};
use nalgebra::DMatrix;
use softdock_engine::blocks::Outputs;
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_engine::simulator::Simulator;
use softdock_kernels::block::Recorded;

pub(crate) use bandwidth::{highest, judged_steps};
pub use part::Part;

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
    /// Whether each recording's channels are off by constants of its own, as those of a sensor that is tared before each:
    /// what a tare leaves is no property of the block, and its mean over a short rest is no measure of it.
    pub tared: bool,
    /// Parameters that are left as they are, and how far they may be off: what a fit finds is as uncertain as they are
    /// (the considered parameters of Tapley, Schutz and Born, Statistical Orbit Determination, 2004, ch. 6).
    pub considered: Vec<(&'static str, f64)>,
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
            tared: false,
        }
    }

    /// The trials that are held out, or the others.
    pub fn part(&self, held_out: bool) -> Part<'_> {
        // What is held out is only compared: as a tare left it, the rest shows no misfit of the touch.
        Part::of(self, self.tared && !held_out, |trial| trial.held_out == held_out)
    }

    /// Sum of squares of each trial's residual, low-passed, at such parameters.
    pub fn misfits(&self, set: &[f64]) -> Vec<f64> {
        let all = Part::of(self, false, |_| true);
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
        self.clock.is_some() && Part::of(self, false, |_| true).detrended(set).grew
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

/// Difference quotients in double precision, and in single, where a smaller difference would be one of roundings.
const QUOTIENT: f64 = 2e-3;
const QUOTIENT_SINGLE: f64 = 5e-2;

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
