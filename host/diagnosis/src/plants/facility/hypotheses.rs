//! Effects of a whole facility: every row of the effect table that is detectable in one of its sections.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf};
use crate::model::unknown::{ParameterPrior, Role};
use softdock_campaign::legal_range;
use softdock_kernels::effects::{EFFECTS, Effect, EffectBlock, EffectParameter, Null};
use softdock_kernels::fields::fields;
use softdock_kernels::model::Model;
use softdock_kernels::space::Motion;

/// Zero-mean effects, which are judged by repeats and packets, not by simulation.
const RANDOM: [&str; 3] = ["C3_jitter", "C4_drops", "S7_noise"];
/// Quantisation of a noisy reading counts as noise, and the tare residual is removed from every drive.
const TOLERATED: [&str; 3] = ["S6_quantisation", "S1_bias", "S9_tare"];

/// Effects whose parameters act alone as well, with names in the order of the parameters, and whether they also act
/// together: a limit of the tools may bite without the other, and a delay needs no low-pass.
const APART: [(&str, &[&str], bool); 2] = [
    ("C7_rate_limit", &["greatest speed of the tools", "greatest rotation rate of the tools"], false),
    ("S5_low_pass", &["low-pass", "delay"], true),
];
/// Sizes at which a limit is tried: what it cuts differs in form from size to size.
const LIMITS: [f64; 5] = [0.3, 1.0, 2.0, 3.0, 4.0];

/// Returns the hypotheses between the commands of a facility and the motion of its parts.
pub fn of_motion(block: &MeasuredBlock, model: &Model) -> Vec<Hypothesis> {
    let jointed = model.facility.joint_level.is_some();
    let acts = |effect: &Effect| match effect.block {
        EffectBlock::Command => true,
        EffectBlock::Robot => jointed != (effect.id == "C2_lag"),
        // The encoders of a robot's axes do not see what its mount does.
        _ => false,
    };
    of(block, model, &acts)
}

/// Returns the hypotheses between the motion of the parts and the measured wrench.
pub fn of_wrench(block: &MeasuredBlock, model: &Model) -> Vec<Hypothesis> {
    let carries = model.facility.load.is_some();
    let acts = |effect: &Effect| match effect.block {
        EffectBlock::Sensor => effect.id != "S8_load" || carries,
        EffectBlock::Contact => true,
        _ => false,
    };
    of(block, model, &acts)
}

fn of(block: &MeasuredBlock, model: &Model, acts: &dyn Fn(&Effect) -> bool) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    let rail = model.facility.rail.is_some_and(|rail| rail.share > 0.0);
    for effect in EFFECTS.iter().filter(|effect| acts(effect)) {
        if RANDOM.contains(&effect.id) || TOLERATED.contains(&effect.id) {
            continue;
        }
        let apart = APART.iter().find(|row| row.0 == effect.id);
        for (parameter, name) in effect.parameters.iter().zip(apart.map_or([].as_slice(), |row| row.1)) {
            let entry = entry(&shelf, block, parameter);
            let sizes = if entry.0.ends_with("_limit") { LIMITS.as_slice() } else { &[1.0] };
            shelf.add(effect.id, name, &[entry], sizes, &[]);
        }
        if apart.is_some_and(|row| !row.2) {
            continue;
        }
        let there = |parameter: &&EffectParameter| rail || parameter.field != "rail_lag";
        let entries: Vec<Entry> =
            effect.parameters.iter().filter(there).map(|parameter| entry(&shelf, block, parameter)).collect();
        let forms = entries.iter().filter(|entry| entry.2 == Role::Form).count();
        shelf.add(effect.id, effect.name, &entries, &[1.0], &grid(forms));
    }
    shelf.all
}

/// Forms that are tried: each number at its most plausible value and a factor of e to either side.
fn grid(numbers: usize) -> Vec<Vec<f64>> {
    match numbers {
        0 => Vec::new(),
        1 => [-1.0, 0.0, 1.0].map(|z| vec![z]).into(),
        _ => [-1.0, -0.5, 0.0, 0.5, 1.0].map(|z| (0..numbers).map(|k| if k == 0 { z } else { 0.0 }).collect()).into(),
    }
}

/// Returns a parameter of an effect as a free parameter about its nominal value.
fn entry(shelf: &Shelf, block: &MeasuredBlock, parameter: &EffectParameter) -> Entry {
    let EffectParameter { field, null, scale } = *parameter;
    let (nominal, (least, _)) = (shelf.base(field), legal_range(field));
    if null == Null::Any {
        return (field, ParameterPrior::LogNormal { centre: scale, spread: 1.0 }, Role::Form);
    }
    if field.ends_with("_limit") {
        // It shows only where the commands are faster.
        return (field, ParameterPrior::Below { top: nominal.min(fastest(block, field)), share: 0.5 }, Role::Size);
    }
    let prior = match (least >= 0.0, nominal > 0.0) {
        (true, true) => ParameterPrior::LogNormal { centre: nominal, spread: (1.0 + scale / nominal).ln() },
        (true, false) => ParameterPrior::Positive { scale },
        (false, _) => ParameterPrior::Normal { mean: nominal, sd: scale },
    };
    (field, prior, Role::Size)
}

/// Greatest commanded speed along an axis \[m/s\], or about one \[rad/s\], whichever the field limits.
fn fastest(block: &MeasuredBlock, field: &str) -> f64 {
    let half = fields::<f64, Motion<f64>>().len();
    let from = if field.contains("rotation") { half - 3 } else { half - 6 };
    let rows = block.trials.iter().flat_map(|trial| trial.recorded.inputs.chunks(half));
    rows.flat_map(|motion| &motion[from..from + 3]).fold(1e-6, |most, rate| most.max(rate.abs()))
}
