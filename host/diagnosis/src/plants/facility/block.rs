//! Sections of a whole facility from the logs of drives: command to motion of the parts, and motion to measured wrench.

mod path;

use crate::data::drive_log::{Cycle, DriveLog};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use nalgebra::DMatrix;
use path::{commanded_rows, held, measured_rows};
use softdock_campaign::{Campaign, Scenario};
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;
use softdock_kernels::frame::facility::readings;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::range::UNLIMITED;
use softdock_kernels::space::{Parts, Wrench};
use softdock_kernels::vector::Vec3;
use std::sync::Arc;

/// Model that a facility is compared with.
#[derive(Clone, Debug)]
pub enum FacilityModel {
    /// A scenario: the facility has the parameters of its file.
    Scenario(Box<Scenario>),
    /// A campaign: each drive was on the facility that its run draws.
    Campaign(Box<Campaign>),
}

impl FacilityModel {
    /// Returns the scenario.
    pub fn scenario(&self) -> &Scenario {
        match self {
            Self::Scenario(scenario) => scenario,
            Self::Campaign(campaign) => &campaign.scenario,
        }
    }

    /// Returns the campaign, if its runs were driven.
    pub fn campaign(&self) -> Option<&Campaign> {
        if let Self::Campaign(campaign) = self { Some(campaign) } else { None }
    }

    /// Parameters of the facility of a drive.
    fn params(&self, log: &DriveLog) -> Params<f64> {
        match (self, log.run) {
            (Self::Campaign(campaign), Some(run)) if run < campaign.runs => {
                campaign.draw(run).expect("no keys of the scenario are dispersed").params
            }
            _ => self.scenario().model.nominal,
        }
    }
}

/// Samples of the motion per second that are judged, about: robots do not follow faster.
const MOTION_RATE: f64 = 250.0;
/// Likewise of the wrench: a touch is over in some hundredths of a second.
const WRENCH_RATE: f64 = 500.0;
/// Resolution of the tool pose from the axes of a robot \[m\], \[rad\].
const RESOLUTION: f64 = 2e-6;
/// Standard deviation of the offsets between the time stamps of commands, axes and wrenches \[s\].
const STAMPS: f64 = 1e-4;
/// Detection threshold of a touch, in standard deviations of the force before it.
const TOUCH: f64 = 8.0;
/// Share of the time before the first touch over which a drive's tare is checked: the end may contain an undetected
/// contact.
const FREE: f64 = 0.8;

/// Channels of the motion, in the order of the facility's outputs.
pub const MOTION: [&str; 12] = [
    "part_a.x",
    "part_a.y",
    "part_a.z",
    "part_a.turn_x",
    "part_a.turn_y",
    "part_a.turn_z",
    "part_b.x",
    "part_b.y",
    "part_b.z",
    "part_b.turn_x",
    "part_b.turn_y",
    "part_b.turn_z",
];
/// Channels of the wrench, which follow.
pub const WRENCH: [&str; 6] = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"];

/// Builds the section from the commands of the robots to the motion of the parts. `held_out` decides by the name of the
/// drive.
pub(crate) fn motion_section(
    model: &FacilityModel,
    logs: &[DriveLog],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let plant = plant(&untouched(&model.scenario().model), finer);
    let nominal = model.scenario().model.nominal;
    let trial = |log: &DriveLog| {
        let rows = commanded_rows(&plant, log);
        trial(&plant, log, rows, [&nominal, &model.params(log)], 0..MOTION.len(), held_out(&log.name))
    };
    let unit = |name: &str| if name.contains("turn") { "rad" } else { "m" };
    let channel = |(output, name): (usize, &&'static str)| MeasuredOutput { name, output, unit: unit(name) };
    let section = Section::Facility(Arc::clone(&plant));
    let base = to_vec(&nominal);
    let channels = MOTION.iter().enumerate().map(channel).collect();
    MeasuredBlock {
        trials: logs.iter().map(trial).collect(),
        decimator: decimator(logs, MOTION_RATE),
        floor: vec![RESOLUTION; MOTION.len()],
        ..MeasuredBlock::of(section, place::FACILITY_MOTION.name, base, &[("loop_delay", STAMPS)], channels)
    }
}

/// Builds the section from the measured motion of the parts to the measured wrench, of the drives whose runs began.
pub(crate) fn wrench_section(
    model: &FacilityModel,
    logs: &[DriveLog],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let mut ideal = model.scenario().model.clone();
    ideal.facility.joint_level = None;
    let plant = plant(&ideal, finer);
    let followed = |p: Params<f64>| followed_and_tared(p, &plant);
    let nominal = followed(ideal.nominal);
    let has_run = || logs.iter().filter(|log| log.has_run);
    let trial = |log: &DriveLog| {
        let mut rows = measured_rows(&plant, log);
        // Commanded a tick ahead and delayed by a tick, so that stamps may be early as well.
        rows.rotate_left(1);
        let last = rows.len() - 1;
        rows[last] = rows[last - 1];
        let own = followed(model.params(log));
        trial(&plant, log, rows, [&nominal, &own], MOTION.len()..MOTION.len() + WRENCH.len(), held_out(&log.name))
    };
    let unit = |name: &str| if name.starts_with("force") { "N" } else { "N m" };
    let channel =
        |(k, name): (usize, &&'static str)| MeasuredOutput { name, output: MOTION.len() + k, unit: unit(name) };
    let (section, decimator) = (Section::Touch(Arc::clone(&plant)), decimator(logs, WRENCH_RATE));
    let base = to_vec(&nominal);
    let channels = WRENCH.iter().enumerate().map(channel).collect();
    MeasuredBlock {
        trials: has_run().map(trial).collect(),
        quiet: has_run().map(|log| quiet(log, &decimator)).collect(),
        tared: true,
        decimator,
        ..MeasuredBlock::of(section, place::FACILITY_WRENCH.name, base, &[("loop_delay", STAMPS)], channels)
    }
}

/// The scenario's plant in steps so many times finer; what the simulation computer does is in the log already.
fn plant(model: &Model, finer: usize) -> Arc<Plant> {
    let mut model = model.clone();
    model.timing.substep /= finer as f64;
    model.timing.substeps *= finer as u32;
    model.facility.sensor_substeps *= finer as u32;
    (model.facility.impedance, model.facility.test_motion) = (None, None);
    Arc::new(Plant::new(model))
}

/// The model without what pushes its parts, where its robots do not feel it.
fn untouched(model: &Model) -> Model {
    let mut model = model.clone();
    if model.facility.joint_level.is_none() {
        (model.contact.a, model.contact.b) = Default::default();
        model.contact.pairs.clear();
        model.contact.latch = None;
    }
    model
}

/// Returns parameters with robots that follow their commands one tick late, and with a tared sensor.
fn followed_and_tared(p: Params<f64>, plant: &Plant) -> Params<f64> {
    Params {
        loop_delay: plant.timing.loop_delay(p.sensor_delay, plant.timing.tick()),
        clock_skew: 0.0,
        command_hold: 0.0,
        tool_speed_limit: UNLIMITED,
        tool_rotation_limit: UNLIMITED,
        robot1_lag: 0.0,
        robot1_lag_zero: 0.0,
        robot2_lag: 0.0,
        robot2_lag_zero: 0.0,
        rail_lag: 0.0,
        sensor_bias_force: Vec3::zero(),
        sensor_bias_moment: Vec3::zero(),
        ..p
    }
}

fn decimator(logs: &[DriveLog], rate: f64) -> Decimator {
    let every = logs.first().map_or(1.0, |log| (1.0 / (rate * log.cycle)).round());
    Decimator::new(every.max(1.0) as usize)
}

/// A drive as a trial: rows of motions, the parameters of the section and of this drive, and the channels of the outputs.
fn trial(
    plant: &Plant,
    log: &DriveLog,
    rows: Vec<Parts<f64>>,
    [nominal, own]: [&Params<f64>; 2],
    channels: std::ops::Range<usize>,
    held_out: bool,
) -> Trial {
    let (start, tare) = (plant.start, left_by_tare(&log.cycles[1..]));
    let measured: Vec<Vec<f64>> = held(plant, log)
        .iter()
        .zip(&log.cycles[1..])
        .map(|(parts, cycle)| to_vec(&readings(&start, parts, cycle.wrench - tare)))
        .collect();
    let offsets = to_vec(own).iter().zip(to_vec(nominal)).map(|(own, nominal)| own - nominal).collect();
    Trial {
        experiment: log.name.clone(),
        held_out,
        recorded: Recorded {
            step: plant.timing.tick(),
            instants: rows.len(),
            stride: log.ticks,
            inputs: rows.iter().flat_map(to_vec::<f64, _>).collect(),
            late: Vec::new(),
            offsets,
        },
        measured: channels.map(|channel| measured.iter().map(|row| row[channel]).collect()).collect(),
    }
}

/// Returns the tare residual of a drive: the mean wrench before contact, zero if contact is immediate.
///
/// Each drive is tared on its own, so that this is no property of the facility.
fn left_by_tare(cycles: &[Cycle]) -> Wrench<f64> {
    let free = free(cycles);
    let sum = free.iter().fold(Wrench::zero(), |sum, cycle| sum + cycle.wrench);
    let scale = 1.0 / free.len().max(1) as f64;
    Wrench { force: sum.force * scale, moment: sum.moment * scale }
}

/// The cycles before the parts touched.
fn free(cycles: &[Cycle]) -> &[Cycle] {
    let step = |pair: &[Cycle]| (pair[1].wrench.force - pair[0].wrench.force).norm();
    let mut steps: Vec<f64> = cycles.windows(2).map(step).collect();
    steps.sort_by(f64::total_cmp);
    let touch = TOUCH * steps[steps.len() / 2];
    let first = cycles[0].wrench.force;
    let free = cycles.iter().take_while(|cycle| (cycle.wrench.force - first).norm() < touch).count();
    &cycles[..(FREE * free as f64) as usize]
}

/// The sensor's noise, from the wrenches before the parts touched.
fn quiet(log: &DriveLog, decimator: &Decimator) -> DMatrix<f64> {
    let cycles = &log.cycles[1..];
    let tare = left_by_tare(cycles);
    let flat: Vec<f64> = free(cycles).iter().flat_map(|cycle| to_vec(&(cycle.wrench - tare))).collect();
    let passed = decimator.pass(flat, WRENCH.len());
    DMatrix::from_vec(WRENCH.len(), passed.len() / WRENCH.len(), passed)
}
