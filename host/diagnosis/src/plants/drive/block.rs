//! Block from torque to motion of a joint drive, from recordings of a rig.

use crate::data::bandwidth::judged_steps;
use crate::data::grid::Piece;
use crate::data::smooth::{SmoothedSignal, motion};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use crate::model::unknown::{ParameterPrior, Role, Unknown};
use softdock_campaign::rig::DriveRig;
use softdock_engine::blocks::BlockKind;
use softdock_engine::decimator::Decimator;
use softdock_engine::section::Section;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;
use softdock_kernels::manipulator::GRAVITY;

/// Longest step of the simulation \[s\].
const LONGEST_STEP: f64 = 5e-4;
/// The motion that the observer holds to reaches up to this share of the recording's Nyquist frequency: friction turns
/// around faster than any command.
const BAND: f64 = 0.8;

/// Standard deviation of the angle between the zeros of two encoders, which are not aligned \[rad\].
const ZERO: f64 = 0.01;
/// Damping ratio of a drive on its friction's bristles.
const BRISTLE_DAMPING: f64 = 0.03;
/// Cut-off of the low-pass for the relative torque error \[Hz\].
const TORQUE_CUTOFF: f64 = 20.0;

/// Load of a drive at an instant, by the model.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Carried {
    /// Torque of gravity against the link \[N m\].
    pub(crate) weight: f64,
    /// Torque of the other axes' motion against it \[N m\].
    pub(crate) coupling: f64,
    /// Inertia of the link about the joint \[kg m^2\].
    pub(crate) inertia: f64,
    /// Torque of a kilogram at the payload's place, its inertia about the joint left out \[N m/kg\].
    pub(crate) payload_weight: f64,
    /// Inertia of that kilogram \[kg m^2/kg\].
    pub(crate) payload_inertia: f64,
}

impl Carried {
    /// By a link of its own, whose weight follows the cosine of its angle.
    fn alone(rig: &DriveRig, angle: f64) -> Self {
        let place = if rig.prismatic { 1.0 } else { (angle - rig.gravity_angle).cos() };
        let arm = if rig.prismatic { 1.0 } else { rig.payload_radius };
        let weighted = if rig.gravity_torque == 0.0 { 0.0 } else { rig.gravity_torque.signum() };
        Self {
            weight: rig.gravity_torque * place,
            coupling: 0.0,
            inertia: rig.link_inertia,
            payload_weight: GRAVITY * arm * place * weighted,
            payload_inertia: arm * arm,
        }
    }
}

/// Function that returns the load along the motion of a recording, by its number.
pub(crate) type Carrying<'a> = &'a dyn Fn(usize, &SmoothedSignal) -> Vec<Carried>;

/// Builds the block from the recordings of a drive. `held_out` decides by the name of the experiment; `torque` has the
/// torque of each recording between the log's samples, where known.
pub fn drive_block(
    rig: &DriveRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
    torque: &[Vec<f64>],
) -> MeasuredBlock {
    let alone = |_, motion: &SmoothedSignal| motion.value.iter().map(|angle| Carried::alone(rig, *angle)).collect();
    let loaded = loaded_block(place::DRIVE.name, rig, pieces, held_out, finer, torque, &alone);
    MeasuredBlock { torque_cutoff: Some(TORQUE_CUTOFF), ..loaded }
}

/// Builds the block of a drive whose load comes from a model.
pub(crate) fn loaded_block(
    name: &'static str,
    rig: &DriveRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
    torque: &[Vec<f64>],
    carrying: Carrying<'_>,
) -> MeasuredBlock {
    let decimator = Decimator::new(judged_steps(pieces, "q"));
    let linked = pieces.iter().all(|piece| piece.signals.contains_key("q_link"));
    let trial = |(number, piece): (usize, &Piece)| {
        let known = torque.get(number).map(Vec::as_slice);
        trial(piece, held_out(&piece.experiment), finer, linked, known, &|motion| carrying(number, motion))
    };
    let mut channels = vec![MeasuredOutput { name: "motor", output: 0, unit: if rig.prismatic { "m" } else { "rad" } }];
    if linked {
        channels.push(MeasuredOutput {
            name: "link less motor",
            output: 1,
            unit: if rig.prismatic { "m" } else { "rad" },
        });
    }
    let base = to_vec(&rig.values);
    let mut tolerance = rig.tolerance.clone();
    if linked {
        tolerance.push(("link_zero", ZERO));
    }
    let section = Section::from(BlockKind::Drive);
    let damping = bristle_damping(rig, &section);
    let mut block = MeasuredBlock {
        trials: pieces.iter().enumerate().map(trial).collect(),
        decimator,
        clock: Some("time"),
        may_grow: true,
        ..MeasuredBlock::of(section, name, base, &tolerance, channels)
    };
    block.nuisances.extend(damping);
    block
}

/// Returns the damping of the friction bristles as a free parameter, since data sheets do not give it and every
/// reversal shows it; `None` if the model has no bristle friction.
fn bristle_damping(rig: &DriveRig, section: &Section) -> Option<Unknown> {
    let values = &rig.values;
    let stiffness = values.coulomb / values.presliding_travel;
    let critical = 2.0 * (stiffness * (values.motor_inertia + rig.link_inertia)).sqrt();
    let prior = ParameterPrior::LogNormal { centre: BRISTLE_DAMPING * critical, spread: 1.5 };
    (critical > 0.0).then(|| Unknown::of(section, "bristle_damping", prior, Role::Nuisance))
}

/// Returns a recording, from the time `start` \[s\], of a path that the model's drive follows without error, with the
/// torque it requires.
pub fn followed(rig: &DriveRig, start: f64, step: f64, path: &[f64]) -> Piece {
    let motion = motion(path, step, BAND * 0.5 / step, 1);
    let torque = |i: usize| {
        let [q, v, a] = [motion.value[i], motion.rate[i], motion.acceleration[i]];
        let weight = rig.gravity_torque * if rig.prismatic { 1.0 } else { (q - rig.gravity_angle).cos() };
        let p = &rig.values;
        (p.motor_inertia + rig.link_inertia) * a + p.viscous * v + p.coulomb * v.signum() + weight
    };
    let torque = (0..path.len()).map(torque).collect();
    let places = ["q", "ref", "q_link"].map(|name| (name.to_owned(), path.to_vec()));
    let signals = places.into_iter().chain([("tau".to_owned(), torque)]).collect();
    Piece { experiment: "proposed".to_owned(), repeat: 1, start, offset: 0.0, step, signals }
}

/// Resamples values to `count` equal steps over the same time; `straight` interpolates between two values.
pub(crate) fn resampled<T>(given: &[T], count: usize, straight: impl Fn(&T, &T, f64) -> T) -> Vec<T> {
    let last = given.len() - 1;
    let at = |i: usize| {
        let place = i as f64 * last as f64 / (count - 1) as f64;
        let before = (place as usize).min(last - 1);
        straight(&given[before], &given[before + 1], place - before as f64)
    };
    (0..count).map(at).collect()
}

fn trial(
    piece: &Piece,
    held_out: bool,
    finer: usize,
    linked: bool,
    torque: Option<&[f64]>,
    carrying: &dyn Fn(&SmoothedSignal) -> Vec<Carried>,
) -> Trial {
    let each = (piece.step / LONGEST_STEP).ceil() as usize * finer;
    let nyquist = 0.5 / piece.step;
    let q = motion(&piece.signals["q"], piece.step, BAND * nyquist, each);
    let torque = match torque {
        Some(known) => resampled(known, q.value.len(), |from, to, share| from + share * (to - from)),
        None => motion(&piece.signals["tau"], piece.step, nyquist, each).value,
    };
    let step = piece.step / each as f64;
    let mut inputs = Vec::with_capacity(q.value.len() * BlockKind::Drive.inputs().len());
    for (i, carried) in carrying(&q).into_iter().enumerate() {
        let Carried { weight, coupling, inertia, payload_weight, payload_inertia } = carried;
        let time = piece.start + i as f64 * step;
        inputs.extend([q.value[i], q.rate[i], q.acceleration[i]]);
        let travel = q.value[i] - q.value[i.saturating_sub(1)];
        inputs.extend([weight, coupling, inertia, payload_weight, payload_inertia, time, travel]);
    }
    // Residual of the encoder reading against the motion that the observer tracks.
    let rest = piece.signals["q"].iter().zip(q.value.iter().step_by(each)).map(|(q, held)| q - held).collect();
    let mut measured = vec![rest];
    if linked {
        // The motion common to both encoders contains no information on the gear between them.
        let pairs = piece.signals["q_link"].iter().zip(&piece.signals["q"]);
        measured.push(pairs.map(|(link, motor)| link - motor).collect());
    }
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded { step, instants: q.value.len(), stride: each, inputs, late: torque, offsets: Vec::new() },
        measured,
    }
}
