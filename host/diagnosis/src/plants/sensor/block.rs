//! Block from force to reading of a force/torque sensor, from recordings of a test rig.

use super::quantisation::QUANTISATION;
use crate::data::bandwidth::{highest, judged_steps};
use crate::data::grid::Piece;
use crate::data::smooth::{SmoothedSignal, motion};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use rayon::prelude::*;
use softdock_campaign::rig::SensorRig;
use softdock_engine::blocks::BlockKind;
use softdock_engine::decimator::Decimator;
use softdock_kernels::block::Recorded;
use softdock_kernels::block::sensor::{SensorLoad, tool_wrench};
use softdock_kernels::fields::to_vec;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::{Quat, Vec3, vec3};

/// Longest step of the simulation \[s\].
const LONGEST_STEP: f64 = 1e-3;
/// Smallest decimation factor: aliased components lie near the end of the band.
const FEWEST_STEPS: usize = 4;
/// By how much the motion's band exceeds what stands out of its noise.
const BAND: f64 = 1.5;
/// Band of a motion that stands out of its noise nowhere, in cycles a sample.
const LEAST_BAND: f64 = 0.01;

/// Measured signals, in the order of the block's outputs.
pub const READINGS: [(&str, &str); 6] = [
    ("force.x", "N"),
    ("force.y", "N"),
    ("force.z", "N"),
    ("moment.x", "N m"),
    ("moment.y", "N m"),
    ("moment.z", "N m"),
];

/// Input signals.
pub const INPUTS: [&str; 5] = ["reference.force", "reference.moment", "orientation", "acceleration", "rate"];

/// Builds the block from the recordings of a sensor. `held_out` decides by the name of the experiment.
pub fn sensor_block(rig: &SensorRig, pieces: &[Piece], held_out: &dyn Fn(&str) -> bool, finer: usize) -> MeasuredBlock {
    let base = to_vec(&rig.values);
    let steps = READINGS.iter().map(|reading| judged_steps(pieces, reading.0)).min().unwrap_or(FEWEST_STEPS);
    let bands = ["acceleration.x", "acceleration.y", "acceleration.z", "rate.x", "rate.y", "rate.z"];
    let band = bands.iter().filter_map(|signal| highest(pieces, signal)).fold(LEAST_BAND, f64::max);
    let channel = |(output, reading): (usize, &(&'static str, &'static str))| MeasuredOutput {
        name: reading.0,
        output,
        unit: reading.1,
    };
    let channels = READINGS.iter().enumerate().map(channel).collect();
    let held: Vec<bool> = pieces.iter().map(|piece| held_out(&piece.experiment)).collect();
    let trials = pieces.par_iter().zip(held).map(|(piece, held)| trial(rig, piece, held, finer, band));
    MeasuredBlock {
        trials: trials.collect(),
        decimator: Decimator::new(steps.max(FEWEST_STEPS)),
        clock: Some("time"),
        quantisation: Some(QUANTISATION),
        known_noise: rig.noise.map_or_else(Vec::new, |[force, moment]| [[force; 3], [moment; 3]].concat()),
        ..MeasuredBlock::of(BlockKind::Sensor.into(), place::SENSOR.name, base, &rig.tolerance, channels)
    }
}

fn trial(rig: &SensorRig, piece: &Piece, held_out: bool, finer: usize, band: f64) -> Trial {
    let each = (piece.step / LONGEST_STEP).ceil() as usize * finer;
    let step = piece.step / each as f64;
    let loads = loads(rig, piece, each, band);
    let p = &rig.values;
    let (mut inputs, mut late) = (Vec::new(), Vec::new());
    for (i, load) in loads.iter().enumerate() {
        inputs.extend(to_vec(&tool_wrench(p.tool_mass, p.tool_centre, p.tool_inertia, load)));
        inputs.push(piece.start + i as f64 * step);
        late.extend(to_vec(load));
    }
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded { step, instants: loads.len(), stride: each, inputs, late, offsets: Vec::new() },
        measured: READINGS.iter().map(|reading| piece.signals[reading.0].clone()).collect(),
    }
}

/// What acts on the sensor, `each` instants a sample; its motion without what is only noise above its band.
fn loads(rig: &SensorRig, piece: &Piece, each: usize, band: f64) -> Vec<SensorLoad<f64>> {
    let (step, nyquist) = (piece.step / each as f64, 0.5 / piece.step);
    let axes = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}.{axis}"));
    let known = |name: &str| axes(name).map(|signal| motion(&piece.signals[&signal], piece.step, nyquist, each));
    let (force, moment) = (known("reference.force"), known("reference.moment"));
    let slow = |samples: &[f64]| motion(samples, piece.step, (BAND * band / piece.step).min(nyquist), each);
    let none = vec![0.0; piece.samples()];
    let rate = axes("rate").map(|signal| slow(piece.signals.get(&signal).unwrap_or(&none)));
    let pull = pull(rig, piece).map(|samples| slow(&samples));
    let value = |m: &[SmoothedSignal; 3], i: usize| vec3(m[0].value[i], m[1].value[i], m[2].value[i]);
    let bend = |m: &[SmoothedSignal; 3], i: usize| {
        vec3(m[0].acceleration[i], m[1].acceleration[i], m[2].acceleration[i]) * (0.5 * step * step)
    };
    let load = |i: usize| SensorLoad {
        wrench: Wrench { force: value(&force, i), moment: value(&moment, i) },
        bend: Wrench { force: bend(&force, i), moment: bend(&moment, i) },
        pull: value(&pull, i),
        rate: value(&rate, i),
        angular_acceleration: vec3(rate[0].rate[i], rate[1].rate[i], rate[2].rate[i]),
    };
    (0..force[0].value.len()).map(load).collect()
}

/// Gravity less the acceleration of the sensor's origin, in sensor axes, sample by sample.
fn pull(rig: &SensorRig, piece: &Piece) -> [Vec<f64>; 3] {
    let signal = |name: &str, i: usize| piece.signals.get(name).map_or(0.0, |values| values[i]);
    let at = |i: usize| -> Vec3<f64> {
        let v = vec3(signal("orientation.x", i), signal("orientation.y", i), signal("orientation.z", i));
        let attitude = Quat { w: signal("orientation.w", i), v };
        let acceleration = vec3(signal("acceleration.x", i), signal("acceleration.y", i), signal("acceleration.z", i));
        attitude.rotate_back(vec3(0.0, 0.0, -rig.gravity)) - acceleration
    };
    let all: Vec<Vec3<f64>> = (0..piece.samples()).map(at).collect();
    [all.iter().map(|v| v.x).collect(), all.iter().map(|v| v.y).collect(), all.iter().map(|v| v.z).collect()]
}
