//! Block from motion to force of a contact, from recordings of a test rig.

use crate::data::bandwidth::highest;
use crate::data::grid::Piece;
use crate::data::smooth::{SmoothedSignal, motion};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use crate::model::unknown::{ParameterPrior, Role, Unknown};
use softdock_campaign::rig::ContactRig;
use softdock_engine::blocks::BlockKind;
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;

/// Longest step of the simulation \[s\].
const LONGEST_STEP: f64 = 2.5e-4;
/// Decimation factor. Repeats of a bounce diverge, so their mean does not determine the bandwidth; a touch is shorter
/// than a sample, and a mount oscillates at up to a tenth of the sampling rate.
const STEPS: usize = 5;
/// By how much the motion's band exceeds what stands out of its noise: a touch bends a motion at once.
const BAND: f64 = 1.5;
/// Band of a motion that stands out of its noise nowhere, in cycles a sample.
const LEAST_BAND: f64 = 0.02;

/// Damping of a contact's bristles over their stiffness \[s\]: bristles are stiff, and what they swing is damped little.
const BRISTLE_LEAD: f64 = 1e-4;

/// Measured signals, in the order of the block's outputs.
pub const FORCES: [&str; 3] = ["force.x", "force.y", "force.z"];
/// Input signals.
pub const POSITIONS: [&str; 3] = ["position.x", "position.y", "position.z"];

/// Builds the block from the recordings of a contact. `held_out` decides by the name of the experiment.
pub fn contact_block(
    rig: &ContactRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let base = to_vec(&rig.values);
    let bands = POSITIONS.map(|signal| highest(pieces, signal).unwrap_or(LEAST_BAND));
    let recorded = |signal: &str| pieces.iter().all(|piece| piece.signals.contains_key(signal));
    let compared: Vec<usize> = (0..FORCES.len()).filter(|axis| recorded(FORCES[*axis])).collect();
    let channel = |axis: &usize| MeasuredOutput { name: FORCES[*axis], output: *axis, unit: "N" };
    let channels = compared.iter().map(channel).collect();
    let section = Section::from(BlockKind::Contact);
    let lead = bristle_lead(rig, &section);
    let mut block = MeasuredBlock {
        trials: pieces.iter().map(|piece| trial(piece, held_out(&piece.experiment), finer, bands, &compared)).collect(),
        decimator: Decimator::new(STEPS),
        ..MeasuredBlock::of(section, place::CONTACT.name, base, &rig.tolerance, channels)
    };
    block.nuisances.extend(lead);
    block
}

/// Returns the damping of the friction bristles as a free parameter, since data sheets do not give it and every
/// reversal shows it; `None` if the model has no bristle friction.
fn bristle_lead(rig: &ContactRig, section: &Section) -> Option<Unknown> {
    let prior = ParameterPrior::LogNormal { centre: BRISTLE_LEAD, spread: 1.5 };
    (rig.values.friction > 0.0).then(|| Unknown::of(section, "bristle_lead", prior, Role::Nuisance))
}

fn trial(piece: &Piece, held_out: bool, finer: usize, bands: [f64; 3], compared: &[usize]) -> Trial {
    let each = (piece.step / LONGEST_STEP).ceil() as usize * finer;
    let step = piece.step / each as f64;
    let nyquist = 0.5 / piece.step;
    // A lateral motion that was not recorded is none.
    let still = vec![0.0; piece.samples()];
    let axis = |k: usize| -> SmoothedSignal {
        let samples = piece.signals.get(POSITIONS[k]).unwrap_or(&still);
        motion(samples, piece.step, (BAND * bands[k] / piece.step).min(nyquist), each)
    };
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let instants = z.value.len();
    let (mut inputs, mut late) = (Vec::with_capacity(instants), Vec::with_capacity(6 * instants));
    for i in 0..instants {
        inputs.push(piece.start + i as f64 * step);
        late.extend([x.value[i], y.value[i], z.value[i], x.rate[i], y.rate[i], z.rate[i]]);
    }
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded { step, instants, stride: each, inputs, late, offsets: Vec::new() },
        measured: compared.iter().map(|axis| piece.signals[FORCES[*axis]].clone()).collect(),
    }
}
