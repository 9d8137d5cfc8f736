//! Block of the loop with measured inputs and outputs.

use crate::model::unknown::{ParameterPrior, Role, Unknown};
use nalgebra::DMatrix;
use softdock_engine::blocks::Outputs;
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_engine::simulator::Simulator;
use softdock_kernels::block::Recorded;

/// Measured signal that is compared with an output of the block.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredOutput {
    /// Name of the block's output.
    pub name: &'static str,
    /// Index of the output in the block's field table.
    pub output: usize,
    /// SI unit.
    pub unit: &'static str,
}

/// Recording of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Name of the experiment: trials of one command share it.
    pub experiment: String,
    /// Whether it is held out of the fits.
    pub held_out: bool,
    /// Inputs of the simulation.
    pub recorded: Recorded,
    /// Measured samples of each channel at the block's output instants.
    pub measured: Vec<Vec<f64>>,
}

/// Quantisation steps that all readings of a block lie on.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadingSteps {
    /// Step of each channel, in its unit; 0 for channels without one.
    pub steps: Vec<f64>,
    /// Value of the effect's size parameter.
    pub size: f64,
}

/// Quantisation of a block's readings: the effect by its names, and its detection in the readings.
#[derive(Clone, Copy, Debug)]
pub struct Quantisation {
    /// Name of the hypothesis.
    pub name: &'static str,
    /// Name of its size parameter.
    pub size: &'static str,
    /// Function that returns the steps; `None` if the readings lie on none.
    pub steps: fn(&MeasuredBlock) -> Option<ReadingSteps>,
}

/// Block with its recordings and prior knowledge.
#[derive(Clone, Debug)]
pub struct MeasuredBlock {
    /// Section of the loop.
    pub section: Section,
    /// Name in answers (`R3 drive`).
    pub name: &'static str,
    /// Nominal parameters, in the order of the block's field table.
    pub base: Vec<f64>,
    /// Nuisance parameters.
    pub nuisances: Vec<Unknown>,
    /// Compared signals.
    pub channels: Vec<MeasuredOutput>,
    /// Recordings.
    pub trials: Vec<Trial>,
    /// Decimation of the residuals.
    pub decimator: Decimator,
    /// Resolution of each channel as a standard deviation, in its unit; empty if the noise is larger.
    pub floor: Vec<f64>,
    /// Standard deviation of each channel's own noise; empty if unknown.
    pub known_noise: Vec<f64>,
    /// Input with the clock of the session, if trends over the session must not count as noise.
    pub clock: Option<&'static str>,
    /// Simulator.
    pub simulator: Simulator,
    /// Residuals that contain only noise, if the recordings have such stretches; one row per channel.
    pub quiet: Vec<DMatrix<f64>>,
    /// Whether decimated instants are independent, as segments with their own initial states are. The scatter of their
    /// gradients then calibrates the likelihood.
    pub stands_alone: bool,
    /// Whether each recording has its own channel offsets, as after a tare. The tare residual is not a property of the
    /// block, and its mean over a short rest does not determine it.
    pub tared: bool,
    /// Considered parameters: held fixed in the fits, with their standard deviations, which contribute to the
    /// uncertainty of the results (Tapley, Schutz and Born, Statistical Orbit Determination, 2004, ch. 6).
    pub considered: Vec<(&'static str, f64)>,
    /// Cut-off of the low-pass for the relative torque error \[Hz\]; `None` for blocks whose input is no torque of a
    /// drive.
    pub torque_cutoff: Option<f64>,
    /// Quantisation of the readings; `None` if it is not detectable.
    pub quantisation: Option<Quantisation>,
    /// Whether an effect may grow over the session, as warming does, so that repeats are compared one by one.
    pub may_grow: bool,
}

impl MeasuredBlock {
    /// Builds a block without recordings from its parameters, tolerances (see [`nuisances`]) and channels, without
    /// decimation.
    pub(crate) fn of(
        section: Section,
        name: &'static str,
        base: Vec<f64>,
        tolerance: &[(&'static str, f64)],
        channels: Vec<MeasuredOutput>,
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
            torque_cutoff: None,
            quantisation: None,
            may_grow: false,
        }
    }

    /// Returns the first recording of each held-out experiment, or of each training experiment.
    pub fn firsts(&self, held_out: bool) -> Vec<&Trial> {
        let mut firsts: Vec<&Trial> = Vec::new();
        for trial in self.trials.iter().filter(|trial| trial.held_out == held_out) {
            if firsts.iter().all(|first| first.experiment != trial.experiment) {
                firsts.push(trial);
            }
        }
        firsts
    }

    /// Simulates every recording with every parameter set and returns the decimated outputs.
    pub fn simulate(&self, recordings: &[&Recorded], sets: &[Vec<f64>]) -> Outputs {
        self.simulator.simulate(&self.section, recordings, sets, &self.decimator)
    }

    /// Returns the step of difference quotients, as a share of a parameter's standard deviation.
    pub fn quotient(&self) -> f64 {
        match &self.section {
            Section::Touch(_) => QUOTIENT_TOUCH,
            section if self.simulator.is_single(section) => QUOTIENT_SINGLE,
            _ => QUOTIENT,
        }
    }

    /// Returns the time between decimated samples of a recording \[s\].
    pub fn judged_step(&self, trial: &Trial) -> f64 {
        trial.recorded.step * (trial.recorded.stride * self.decimator.every()) as f64
    }

    /// Returns the index of a parameter in the field table.
    pub fn field(&self, name: &str) -> usize {
        self.section.parameters().iter().position(|field| field.name == name).expect("the name of a block's parameter")
    }

    /// Returns an input of a recording at every instant of the simulation.
    pub(crate) fn input<'a>(&self, trial: &'a Trial, name: &str) -> impl Iterator<Item = f64> + use<'a> {
        let fields = self.section.inputs();
        let place = fields.iter().position(|field| field.name == name).expect("the name of a block's input");
        trial.recorded.inputs.iter().skip(place).step_by(fields.len()).copied()
    }
}

/// Difference quotients in double precision, and in single, where a smaller difference would be one of roundings.
const QUOTIENT: f64 = 2e-3;
const QUOTIENT_SINGLE: f64 = 5e-2;
/// Where a touch begins in one step of the simulation or the next: the residual is a staircase of the parameters.
const QUOTIENT_TOUCH: f64 = 0.3;

/// Travels and depths whose tolerance is a factor: they cannot be negative.
const FACTORS: [&str; 2] = ["presliding_travel", "damping_onset"];

/// Returns the nuisance parameters: normal priors about the nominal values, with the tolerances of the rig as standard
/// deviations.
fn nuisances(section: &Section, base: &[f64], tolerance: &[(&'static str, f64)]) -> Vec<Unknown> {
    let of = |(name, sd): &(&'static str, f64)| {
        let unknown = Unknown::of(section, name, ParameterPrior::Normal { mean: 0.0, sd: *sd }, Role::Nuisance);
        let mean = base[unknown.field];
        let prior = match FACTORS.contains(name) {
            true => ParameterPrior::LogNormal { centre: mean, spread: sd / mean },
            false => ParameterPrior::Normal { mean, sd: *sd },
        };
        Unknown { prior, ..unknown }
    };
    tolerance.iter().map(of).collect()
}
