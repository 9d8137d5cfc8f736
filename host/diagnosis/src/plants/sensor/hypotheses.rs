//! Effects of a force/torque sensor: offsets, gains, timing, quantisation, range, and the compensated tool.

use super::quantisation;
use super::quantisation::{FORCES, MOMENTS, raw_peak, seen_steps};
use crate::inference::autocorrelation::power;
use crate::inference::white_noise::by_differences;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf, size};
use crate::model::unknown::{ParameterPrior, Role};
use crate::plants::sensor::excess_noise::differences;

/// What the recordings of a sensor span.
#[derive(Clone, Copy, Debug)]
struct Spans {
    /// Greatest raw force \[N\], that of the tool included.
    force: f64,
    /// Greatest raw moment \[N m\].
    moment: f64,
    /// Standard deviation of the noise of a force, that of rounding it included \[N\].
    noise: f64,
}

impl Spans {
    fn of(block: &MeasuredBlock) -> Self {
        Self { force: raw_peak(block, FORCES), moment: raw_peak(block, MOMENTS), noise: noise(block) }
    }
}

/// Standard deviation of a force's noise \[N\], by what repeats differ by; without any, by what neighbouring samples do.
fn noise(block: &MeasuredBlock) -> f64 {
    let repeats = differences(block);
    if !repeats.is_empty() {
        return (FORCES.map(|channel| power(&repeats, channel)).sum::<f64>() / FORCES.len() as f64).sqrt();
    }
    let forces = block.trials.iter().flat_map(|trial| &trial.measured[FORCES]);
    by_differences(forces.map(Vec::as_slice), 1)
}

/// Free numbers of either sign, each about its nominal value.
fn either(shelf: &Shelf, names: &[&'static str], sd: f64) -> Vec<Entry> {
    names.iter().map(|name| (*name, ParameterPrior::Normal { mean: shelf.base(name), sd }, Role::Size)).collect()
}

/// Returns the hypotheses of a sensor.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let (spans, mut shelf) = (Spans::of(block), Shelf::of(block));
    offsets(&mut shelf);
    calibration(&mut shelf, &spans);
    timing(&mut shelf);
    digits(&mut shelf, &spans);
    tool(&mut shelf);
    shelf.all
}

fn offsets(shelf: &mut Shelf) {
    let mut bias =
        either(shelf, &["bias_force_x", "bias_force_y", "bias_force_z"], size("S1_bias", "sensor_bias_force_x"));
    let moments = ["bias_moment_x", "bias_moment_y", "bias_moment_z"];
    bias.extend(either(shelf, &moments, size("S1_bias", "sensor_bias_moment_x")));
    shelf.add("S1_bias", "bias", &bias, &[1.0], &[]);
    let forces = ["drift_force_x", "drift_force_y", "drift_force_z"];
    let mut drift = either(shelf, &forces, size("S2_drift", "sensor_drift_force_x"));
    let moments = ["drift_moment_x", "drift_moment_y", "drift_moment_z"];
    drift.extend(either(shelf, &moments, size("S2_drift", "sensor_drift_moment_x")));
    shelf.add("S2_drift", "drift", &drift, &[1.0], &[]);
}

fn calibration(shelf: &mut Shelf, spans: &Spans) {
    let gains =
        ["fx_of_force_x", "fy_of_force_y", "fz_of_force_z", "mx_of_moment_x", "my_of_moment_y", "mz_of_moment_z"];
    let gain = either(shelf, &gains, size("S3_gain", "sensor_gain_force_x"));
    shelf.add("S3_gain", "gain", &gain, &[1.0], &[]);
    let (share, lever) = (size("S4_crosstalk", "sensor_crosstalk"), spans.moment / spans.force);
    let own = |names: &[&'static str]| -> Vec<&'static str> {
        names.iter().copied().filter(|name| !gains.contains(name)).collect()
    };
    let mut crosstalk = either(shelf, &own(&FORCE_BY_FORCE), share);
    crosstalk.extend(either(shelf, &FORCE_BY_MOMENT, share / lever));
    crosstalk.extend(either(shelf, &MOMENT_BY_FORCE, share * lever));
    crosstalk.extend(either(shelf, &own(&MOMENT_BY_MOMENT), share));
    shelf.add("S4_crosstalk", "crosstalk between the channels", &crosstalk, &[1.0], &[]);
}

const FORCE_BY_FORCE: [&str; 9] = [
    "fx_of_force_x",
    "fx_of_force_y",
    "fx_of_force_z",
    "fy_of_force_x",
    "fy_of_force_y",
    "fy_of_force_z",
    "fz_of_force_x",
    "fz_of_force_y",
    "fz_of_force_z",
];

const FORCE_BY_MOMENT: [&str; 9] = [
    "fx_of_moment_x",
    "fx_of_moment_y",
    "fx_of_moment_z",
    "fy_of_moment_x",
    "fy_of_moment_y",
    "fy_of_moment_z",
    "fz_of_moment_x",
    "fz_of_moment_y",
    "fz_of_moment_z",
];

const MOMENT_BY_FORCE: [&str; 9] = [
    "mx_of_force_x",
    "mx_of_force_y",
    "mx_of_force_z",
    "my_of_force_x",
    "my_of_force_y",
    "my_of_force_z",
    "mz_of_force_x",
    "mz_of_force_y",
    "mz_of_force_z",
];

const MOMENT_BY_MOMENT: [&str; 9] = [
    "mx_of_moment_x",
    "mx_of_moment_y",
    "mx_of_moment_z",
    "my_of_moment_x",
    "my_of_moment_y",
    "my_of_moment_z",
    "mz_of_moment_x",
    "mz_of_moment_y",
    "mz_of_moment_z",
];

fn timing(shelf: &mut Shelf) {
    let lag = ParameterPrior::Positive { scale: size("S5_low_pass", "sensor_lag") };
    let delay = ParameterPrior::Positive { scale: size("S5_low_pass", "sensor_delay_error") };
    let entries = [("lag", lag, Role::Size), ("delay", delay, Role::Form)];
    shelf.add("S5_low_pass", "low-pass and delay", &entries, &[0.05, 0.5], &[vec![0.0], vec![1.0]]);
}

/// Step that noise, its own rounding included, does not hide, in standard deviations of that noise.
const VISIBLE: f64 = 1.5;

/// Steps of the reading, and limits of its range apart: a limit that no reading has met must not come with the steps.
fn digits(shelf: &mut Shelf, spans: &Spans) {
    let scale = size("S6_quantisation", "sensor_resolution_force").max(0.01 * spans.force);
    let peak = spans.force.max(spans.moment / shelf.base("lever"));
    let top = peak.min(shelf.base("range"));
    let blur = (3_f64.sqrt() * spans.noise).clamp(0.01 * scale, 0.25 * scale);
    let entries = [
        (quantisation::SIZE, ParameterPrior::Positive { scale }, Role::Size),
        ("blur", ParameterPrior::LogNormal { centre: blur, spread: 0.7 }, Role::Form),
    ];
    let mut sizes: Vec<f64> =
        seen_steps(shelf.block, spans.force, VISIBLE * spans.noise).into_iter().map(|step| step / scale).collect();
    sizes.extend([1.0, 0.3]);
    shelf.add("S6_quantisation", quantisation::NAME, &entries, &sizes, &[]);
    let limit = [("range", ParameterPrior::Below { top, share: 0.2 }, Role::Size)];
    shelf.add("S6_quantisation", "limited range", &limit, &[0.1, 0.3, 1.0, 3.0], &[]);
}

fn tool(shelf: &mut Shelf) {
    let mass = shelf.base("tool_mass");
    let share = size("S8_load", "load_mass_error");
    let mut entries = either(shelf, &["tool_mass"], share * if mass > 0.0 { mass } else { 1.0 });
    let centre = size("S8_load", "load_centre_error_x");
    entries.extend(either(shelf, &["tool_centre_x", "tool_centre_y", "tool_centre_z"], centre));
    shelf.add("S8_load", "mass and centre of the tool", &entries, &[1.0], &[]);
}
