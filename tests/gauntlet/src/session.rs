//! Session at a rig: three repeats of every experiment in mixed order, a held-out motion, and the separate truth.

use crate::catalogue::{Hidden, Parameter, Rig, Sizes, outside};
use crate::commanded_path::CommandedPath;
use crate::error::Error;
use crate::random::{NoiseColour, Stream};
use crate::table::Table;
use crate::{body, command, contact, drive, facility, robot, sensor};
use std::path::Path;
use std::{fs, io};

/// Repeats of every experiment; they differ in noise only.
const REPEATS: u64 = 3;
/// Largest number of repeats of a commanded path.
const MOST_ASKED: u64 = 40;
/// Number from which on records are none of a session's.
const FAR: u64 = 1_000_000;
/// From the start of one record to that of the next \[s\].
const SPACING_S: f64 = 10.0;
/// Name of the held-out experiment, and of the one that no recording shows.
pub(crate) const HOLDOUT: &str = "validation";
pub(crate) const FRESH: &str = "fresh";

/// Circumstances of one record.
pub(crate) struct Run {
    /// Seed of the data set.
    pub(crate) seed: u64,
    /// Place in the session's order: names the streams of its noise.
    pub(crate) number: u64,
    /// When it starts, on the session's clock \[s\].
    pub(crate) start_s: f64,
    /// Colour of the disturbance; none for the truth: no disturbance, no instruments.
    pub(crate) noise: Option<NoiseColour>,
    /// Whether hidden effects act on the readings only, not on the motion, if the rig can separate them.
    pub(crate) unmoved: bool,
}

impl Run {
    /// The stream of a noise of this record.
    pub(crate) fn stream(&self, purpose: &str) -> Stream {
        Stream::new(self.seed, purpose, self.number)
    }
}

/// Dependence of noiseless records of an experiment on their time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ageing {
    /// None: the clock restarts with every record.
    Nothing,
    /// Through the recorded time only.
    Time,
    /// The rig warms up, drifts, or has further random effects.
    Rig,
}

/// A rig with its hidden effects and its nuisances.
pub(crate) trait SimulatedRig {
    /// The nominal model, as its owner would write it down.
    fn model(&self) -> String;
    /// Files that the model names, by name and text.
    fn beside(&self) -> Vec<(String, String)> {
        Vec::new()
    }
    /// Names of the training experiments.
    fn training(&self) -> &'static [&'static str];
    /// What makes its records differ from time to time.
    fn ageing(&self) -> Ageing {
        Ageing::Rig
    }
    /// Runs one experiment.
    fn record(&self, experiment: &str, run: &Run) -> Table;
    /// Follows a commanded path; `None` if this rig follows none.
    fn follow(&self, _commanded: &CommandedPath, _run: &Run) -> Option<Table> {
        None
    }
    /// Further true parameters of a hidden effect than its size.
    fn further(&self, id: &str) -> Vec<Parameter>;
    /// Returns the nuisance parameters drawn within the model's tolerances.
    fn nuisances(&self) -> Vec<Parameter>;
}

fn bench(rig: Rig, sizes: &Sizes, seed: u64) -> Box<dyn SimulatedRig> {
    match rig {
        Rig::Drive { link_encoder } => Box::new(drive::DriveRig::new(sizes, link_encoder, seed)),
        Rig::Robot => Box::new(robot::RobotRig::new(sizes, seed)),
        Rig::Contact => Box::new(contact::ContactRig::new(sizes, seed)),
        Rig::Sensor => Box::new(sensor::SensorRig::new(sizes, seed)),
        Rig::Command => Box::new(command::CommandRig::new(sizes, seed)),
        Rig::Body => Box::new(body::BodyRig::new(sizes, seed)),
        Rig::Facility => Box::new(facility::FacilityRig::new(sizes, seed)),
    }
}

/// True hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenTruth {
    /// Its id.
    pub id: &'static str,
    /// Whether it is outside the catalogue, so that no name is right.
    pub outside: bool,
    /// Parameters; the first is the size.
    pub parameters: Vec<Parameter>,
}

/// Truth of a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Hidden effects; empty for a null set.
    pub hidden: Vec<HiddenTruth>,
    /// Drawn nuisance parameters, as differences from the model or factors on it.
    pub nuisances: Vec<Parameter>,
}

/// Data set: model, recordings, and the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    /// TOML text of the nominal model.
    pub model: String,
    /// Files referenced by the model: name and text.
    pub beside: Vec<(String, String)>,
    /// Training recordings: file name (`sweep_1.csv`) and CSV text.
    pub logs: Vec<(String, String)>,
    /// Recordings of a different motion.
    pub holdout: Vec<(String, String)>,
    /// Truth, sealed until scored.
    pub truth: Truth,
}

impl Set {
    /// Returns a smaller set: the first repeats of every experiment, and the first `share` of the rows of each.
    #[must_use]
    pub fn shortened(mut self, repeats: u64, share: f64) -> Self {
        let is_kept = |(file, _): &(String, String)| {
            let repeat = file.trim_end_matches(".csv").rsplit('_').next().and_then(|number| number.parse::<u64>().ok());
            repeat.is_none_or(|repeat| repeat <= repeats)
        };
        self.logs.retain(is_kept);
        self.holdout.retain(is_kept);
        for (_, text) in self.logs.iter_mut().chain(&mut self.holdout) {
            let rows = text.lines().count() - 1;
            let lines = 1 + (share * rows as f64).round() as usize;
            text.truncate(text.split_inclusive('\n').take(lines).map(str::len).sum());
        }
        self
    }

    /// Writes `model.toml`, its referenced files, `training/*.csv` and `holdout/*.csv` into a folder, without the
    /// truth.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        for (name, files) in [("training", &self.logs), ("holdout", &self.holdout)] {
            fs::create_dir_all(folder.join(name))?;
            for (file, text) in files {
                fs::write(folder.join(name).join(file), text)?;
            }
        }
        for (file, text) in &self.beside {
            fs::write(folder.join(file), text)?;
        }
        fs::write(folder.join("model.toml"), &self.model)
    }
}

/// Unrecorded motion without noise, disturbance and instruments; CSV with the recordings' columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Fresh {
    /// Motion of the rig.
    pub with_effect: String,
    /// Motion of the same rig, with the same nuisance parameters, without the hidden effects.
    pub without_effect: String,
}

/// The session's order: every round runs all experiments once, in mixed order, so that a drift is no experiment's own.
fn order(bench: &dyn SimulatedRig, seed: u64) -> Vec<(&'static str, u64)> {
    let experiments: Vec<&str> = bench.training().iter().copied().chain([HOLDOUT]).collect();
    let mut stream = Stream::new(seed, "order", 0);
    let mut order = Vec::new();
    for repeat in 1..=REPEATS {
        let mut round: Vec<(f64, &str)> = experiments.iter().map(|name| (stream.uniform(), *name)).collect();
        round.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.extend(round.into_iter().map(|(_, name)| (name, repeat)));
    }
    order
}

fn truth(rig: Rig, sizes: &Sizes, bench: &dyn SimulatedRig) -> Truth {
    let hidden = sizes.iter().map(|(case, size)| {
        let mut parameters = vec![Parameter::new(case.parameter, *size, case.unit)];
        parameters.extend(bench.further(case.id));
        HiddenTruth { id: case.id, outside: outside(rig).contains(case), parameters }
    });
    Truth { hidden: hidden.collect(), nuisances: bench.nuisances() }
}

/// Generates a data set: recordings of a rig with hidden effects (none, one or more), noise of a colour, and nuisance
/// parameters drawn from a seed.
///
/// # Errors
/// An effect that the rig does not have or that is named twice, a size that is not a positive number or too large.
pub fn generate(rig: Rig, hidden: &[Hidden], noise: NoiseColour, seed: u64) -> Result<Set, Error> {
    session(rig, hidden, Some(noise), false, seed)
}

/// Generates the data set of the same seed without disturbance and instruments, with all digits.
///
/// # Errors
/// As [`generate`].
pub fn exact(rig: Rig, hidden: &[Hidden], seed: u64) -> Result<Set, Error> {
    session(rig, hidden, None, false, seed)
}

/// Generates the same along the motion of the rig without hidden effects: the change of the readings by an effect is
/// the difference from the [`exact`] set without hidden effects. A blow at a slightly different time is another blow,
/// with another model residual that would be attributed to the effect. Rigs without blows return the exact set.
///
/// # Errors
/// As [`generate`].
pub fn unmoved(rig: Rig, hidden: &[Hidden], seed: u64) -> Result<Set, Error> {
    session(rig, hidden, None, true, seed)
}

fn session(rig: Rig, hidden: &[Hidden], noise: Option<NoiseColour>, unmoved: bool, seed: u64) -> Result<Set, Error> {
    let sizes = Sizes::check(rig, hidden)?;
    let bench = bench(rig, &sizes, seed);
    let mut set = Set {
        model: bench.model(),
        beside: bench.beside(),
        logs: Vec::new(),
        holdout: Vec::new(),
        truth: truth(rig, &sizes, &*bench),
    };
    let mut exact = Exact::default();
    for (number, (experiment, repeat)) in (0..).zip(order(&*bench, seed)) {
        let run = Run { seed, number, start_s: number as f64 * SPACING_S, noise, unmoved };
        let table =
            if noise.is_some() { bench.record(experiment, &run) } else { exact.record(&*bench, experiment, &run) };
        let file = (format!("{experiment}_{repeat}.csv"), table.csv());
        if experiment == HOLDOUT { set.holdout.push(file) } else { set.logs.push(file) }
    }
    set.logs.sort();
    set.holdout.sort();
    Ok(set)
}

/// Records without noise, made once where repeats are alike.
#[derive(Default)]
struct Exact {
    made: Vec<(&'static str, f64, Table)>,
}

impl Exact {
    fn record(&mut self, bench: &dyn SimulatedRig, experiment: &'static str, run: &Run) -> Table {
        if bench.ageing() == Ageing::Rig {
            return bench.record(experiment, run).exact();
        }
        let place = self.made.iter().position(|made| made.0 == experiment).unwrap_or_else(|| {
            self.made.push((experiment, run.start_s, bench.record(experiment, run).exact()));
            self.made.len() - 1
        });
        let (_, start_s, table) = &self.made[place];
        match bench.ageing() {
            Ageing::Time => table.clone().later(run.start_s - start_s),
            _ => table.clone(),
        }
    }
}

/// Generates an unrecorded motion, with the nuisance parameters of the data set of the same seed.
///
/// # Errors
/// As [`generate`].
pub fn fresh(rig: Rig, hidden: &[Hidden], seed: u64) -> Result<Fresh, Error> {
    let sizes = Sizes::check(rig, hidden)?;
    let record = |sizes: &Sizes| {
        let bench = bench(rig, sizes, seed);
        let (number, start_s) = middle(&*bench);
        let run = Run { seed, number, start_s, noise: None, unmoved: false };
        bench.record(FRESH, &run).exact().csv()
    };
    Ok(Fresh { with_effect: record(&sizes), without_effect: record(&Sizes::none()) })
}

/// Number of the fresh motion's record, and when it starts \[s\]: in the middle of the session, so that what drifts or warms
/// up is met as the recordings met it on the average, and another motion is all that differs.
fn middle(bench: &dyn SimulatedRig) -> (u64, f64) {
    let number = REPEATS * (bench.training().len() as u64 + 1);
    (number, 0.5 * number as f64 * SPACING_S)
}

/// Further recordings as files, for the true gain.
#[derive(Clone, Debug, PartialEq)]
pub struct Further {
    /// Recordings of the held-out motion.
    pub holdout: Vec<(String, String)>,
    /// Recordings of an unrecorded motion.
    pub fresh: Vec<(String, String)>,
}

/// Generates further recordings of the data set's rig with new noise: `times` times the repeats of the held-out motion,
/// each at its time in the session, and those of the [`fresh`] motion. Every repetition is an experiment by its name
/// (`validation2_1.csv`).
///
/// # Errors
/// As [`generate`].
pub fn further(rig: Rig, hidden: &[Hidden], noise: NoiseColour, seed: u64, times: u64) -> Result<Further, Error> {
    let bench = bench(rig, &Sizes::check(rig, hidden)?, seed);
    let session = (0..).zip(order(&*bench, seed));
    let held_out = session.filter(|(_, (experiment, _))| *experiment == HOLDOUT);
    let starts: Vec<f64> = held_out.map(|(number, _)| f64::from(number) * SPACING_S).collect();
    let of = |experiment: &str, start_s: &dyn Fn(usize) -> f64| {
        let one = |place: u64| {
            let (time, repeat) = (place / REPEATS, place % REPEATS);
            let start_s = start_s(repeat as usize);
            let run = Run { seed, number: FAR + place, start_s, noise: Some(noise), unmoved: false };
            (format!("{experiment}{}_{}.csv", time + 1, repeat + 1), bench.record(experiment, &run).csv())
        };
        (0..REPEATS * times).map(one).collect()
    };
    let (_, middle_s) = middle(&*bench);
    Ok(Further { holdout: of(HOLDOUT, &|repeat| starts[repeat]), fresh: of(FRESH, &|_| middle_s) })
}

/// Generates recordings, with repeats, of a path commanded after the session, with the nuisance parameters of the data
/// set of the same seed; `number` counts such paths from 1. Returns `None` if the rig follows no path.
///
/// # Errors
/// As [`generate`].
pub fn follow(
    rig: Rig,
    hidden: &[Hidden],
    noise: NoiseColour,
    seed: u64,
    commanded: &CommandedPath,
    number: u64,
) -> Result<Option<Vec<(String, String)>>, Error> {
    let bench = bench(rig, &Sizes::check(rig, hidden)?, seed);
    // Behind the session, the motion that nobody records, and as many paths as were asked before.
    let before = REPEATS * (bench.training().len() as u64 + 2) + MOST_ASKED * (number - 1);
    let record = |repeat: u64| {
        let number_of_run = before + repeat;
        let start_s = number_of_run as f64 * SPACING_S;
        let run = Run { seed, number: number_of_run, start_s, noise: Some(noise), unmoved: false };
        let table = bench.follow(commanded, &run)?;
        Some((format!("asked{number}_{}.csv", repeat + 1), table.csv()))
    };
    Ok((0..commanded.repeats.min(MOST_ASKED)).map(record).collect())
}

/// Every rig, for tests.
#[cfg(test)]
pub(crate) const RIGS: [Rig; 7] =
    [Rig::Drive { link_encoder: true }, Rig::Robot, Rig::Contact, Rig::Sensor, Rig::Command, Rig::Body, Rig::Facility];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::effects;

    #[test]
    fn cached_record_equals_a_later_one() {
        for rig in RIGS {
            for case in effects(rig).iter().chain(outside(rig)) {
                let sizes = Sizes::check(rig, &[Hidden { id: case.id, size: case.size }]).expect("an effect");
                let bench = bench(rig, &sizes, 5);
                let run = |number| Run { seed: 5, number, start_s: 70.0 * number as f64, noise: None, unmoved: false };
                let (experiment, mut exact) = (bench.training()[0], Exact::default());
                exact.record(&*bench, experiment, &run(0));
                let (commanded, made) = (exact.record(&*bench, experiment, &run(1)), bench.record(experiment, &run(1)));
                assert!(commanded.distance(&made) < 1e-9, "{rig:?} with {}: {}", case.id, commanded.distance(&made));
            }
        }
    }
}
