//! Fit of restitution, friction and stiffness to a body tossed onto a plane, and its open-loop errors.

use super::estimate::ContactEstimate;
use super::population::{PopulationSize, bootstrap, minimise};
use crate::Result;
use nalgebra::{UnitQuaternion, Vector3};
use softdock_campaign::Rig;
use softdock_campaign::rig::TossRig;
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::data::grid::{self, Piece};
use softdock_diagnosis::data::state::{BodyState, Poses};
use softdock_diagnosis::model::unknown::ParameterPrior;
use softdock_diagnosis::plants::toss::block::{StateNoise, clear, free_run};
use softdock_engine::blocks::{BlockKind, simulate};
use softdock_kernels::fields::to_vec;
use std::collections::BTreeSet;
use std::path::Path;

/// Tosses on which parameters are fitted: more do not narrow the intervals within the model error.
const MOST_TOSSES: usize = 120;
/// Errors of a whole toss that cost one: share of the body's width, and angle \[rad\].
const POSITION_COST: f64 = 0.1;
const ROTATION_COST: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Prior standard deviations: natural logarithms of factors, and lengths \[m\].
const COEFFICIENT_FACTOR: f64 = 0.7;
const STIFFNESS_FACTOR: f64 = 1.0;
const INERTIA_FACTOR: f64 = 0.1;
const SURFACE: f64 = 1e-3;
const SIZE: f64 = 1e-3;
const LEAST_COEFFICIENT: f64 = 0.1;
/// Resamples of the tosses for intervals.
const RESAMPLES: usize = 400;

/// Tosses of a rig, some held out.
pub struct Tosses {
    /// The rig.
    pub rig: TossRig,
    /// Recordings of single tosses.
    pub pieces: Vec<Piece>,
    /// Names of those that are held out.
    pub held_out: BTreeSet<String>,
    /// What was assumed or changed when the recordings were read.
    pub notes: Vec<String>,
}

impl Tosses {
    /// Reads tosses and holds out a share of them, evenly spread.
    ///
    /// # Errors
    /// A recording that cannot be read, or too few tosses.
    pub fn read(rig: &Rig, own: &TossRig, logs: &[&Path], hold_out: f64) -> Result<Self> {
        let (mut pieces, mut notes) = (Vec::new(), Vec::new());
        for path in logs {
            let (read, findings) = grid::read(path, rig)?;
            pieces.extend(read);
            notes.extend(findings.into_iter().map(|finding| format!("{}: {}", finding.recording, finding.what)));
        }
        let mut names: Vec<&str> = Vec::new();
        for piece in &pieces {
            if !names.contains(&piece.experiment.as_str()) {
                names.push(&piece.experiment);
            }
        }
        let count = (hold_out * names.len() as f64).round() as usize;
        if hold_out > 0.0 && (count == 0 || count == names.len()) {
            let what = format!("{} tosses cannot be divided: --hold-out {hold_out} holds out {count}", names.len());
            return Err(DiagnosisError::unfit(what, "record more tosses, or write --hold-out 0"));
        }
        let is_held = |place: usize| (place + 1) * count / names.len() > place * count / names.len();
        let held_out = (0..names.len()).filter(|place| is_held(*place)).map(|place| names[place].to_owned()).collect();
        Ok(Self { rig: own.clone(), held_out, pieces, notes })
    }
}

/// Parameter of a tossed body that is fitted: name, fields that it sets, prior.
pub struct TossUnknown {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Fields of the block that have its value.
    fields: Vec<usize>,
    /// Prior.
    pub prior: ParameterPrior,
}

/// Returns the parameters that are fitted, those of the contact first.
pub fn toss_unknowns(rig: &TossRig) -> Vec<TossUnknown> {
    let (table, base) = (BlockKind::Toss.parameters(), to_vec(&rig.values));
    let of = |name: &'static str, fields: &[&str], prior: &dyn Fn(f64) -> ParameterPrior| {
        let place = |name: &&str| table.iter().position(|field| field.name == *name).expect("a field of the block");
        let fields: Vec<usize> = fields.iter().map(place).collect();
        TossUnknown { name, unit: table[fields[0]].unit, prior: prior(base[fields[0]]), fields }
    };
    let coefficient =
        |value: f64| ParameterPrior::LogNormal { centre: value.max(LEAST_COEFFICIENT), spread: COEFFICIENT_FACTOR };
    let factor = |spread: f64| move |centre: f64| ParameterPrior::LogNormal { centre, spread };
    let about = |sd: f64| move |mean: f64| ParameterPrior::Normal { mean, sd };
    vec![
        of("restitution", &["restitution"], &coefficient),
        of("friction", &["friction"], &coefficient),
        of("stiffness", &["stiffness"], &factor(STIFFNESS_FACTOR)),
        of("half_width", &["half_width"], &about(SIZE)),
        of("surface", &["surface"], &about(SURFACE)),
        of("inertia", &["inertia_x", "inertia_y", "inertia_z"], &factor(INERTIA_FACTOR)),
    ]
}

/// Estimate of what is not of the contact: size, height of the plane, inertia.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct BodyEstimate {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// Fit of a tossed body.
#[derive(Clone, Debug)]
pub struct TossFit {
    /// Estimates under the keys of a scenario's `[contact]`.
    pub estimates: Vec<ContactEstimate>,
    /// Estimates of what is not of the contact.
    pub body: Vec<BodyEstimate>,
    /// The body's parameters in the order of the block's field table.
    pub values: Vec<f64>,
    /// Number of tosses that were fitted.
    pub fitted: usize,
    /// Parameter sets that were simulated.
    pub sets: usize,
}

/// Returns the cost of an error of a toss.
pub fn toss_cost(error: &OpenLoopError, half_width: f64) -> f64 {
    error.position_m / (POSITION_COST * 2.0 * half_width) + error.rotation_rad / ROTATION_COST
}

/// Returns so many of the tosses, evenly spread.
fn spread(all: Vec<OpenLoopToss>, most: usize) -> Vec<OpenLoopToss> {
    let (count, total) = (all.len().min(most), all.len());
    let is_kept = |place: usize| (place + 1) * count / total > place * count / total;
    all.into_iter().enumerate().filter(|(place, _)| is_kept(*place)).map(|(_, toss)| toss).collect()
}

/// Returns the tosses that a fit uses.
///
/// # Errors
/// If no toss begins in free flight.
pub fn training(tosses: &Tosses) -> Result<Vec<OpenLoopToss>> {
    let all = OpenLoopToss::of(tosses, false);
    if all.is_empty() {
        return Err(DiagnosisError::unfit(
            "no toss begins in free flight: no corner may be near the plane in the first five frames of one",
            "record from before the first blow until the body rests, and check `half_width` and `position.z` of the rig",
        ));
    }
    Ok(spread(all, MOST_TOSSES))
}

/// Fits a tossed body to the whole tosses that are not held out, each simulated from its first state alone.
///
/// # Errors
/// If no toss begins in free flight.
pub fn fit_toss(tosses: &Tosses, size: PopulationSize) -> Result<TossFit> {
    let (own, unknowns, base) = (training(tosses)?, toss_unknowns(&tosses.rig), to_vec(&tosses.rig.values));
    let set = |z: &Vec<f64>| {
        let mut values = base.clone();
        for (unknown, z) in unknowns.iter().zip(z) {
            unknown.fields.iter().for_each(|field| values[*field] = unknown.prior.value(*z));
        }
        values
    };
    let half_width = tosses.rig.values.half_width;
    let evaluate = |places: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let errors = open_loop(&own, &places.iter().map(set).collect::<Vec<_>>());
        errors.iter().map(|errors| errors.iter().map(|error| toss_cost(error, half_width)).collect()).collect()
    };
    let all = minimise(&vec![0.0; unknowns.len()], size, &evaluate);
    let (best, resampled) = (&all[0], bootstrap(&all, RESAMPLES, size.seed));
    let interval = |place: usize| {
        let unknown = &unknowns[place];
        let mut values: Vec<f64> = resampled.iter().map(|z| unknown.prior.value(z[place])).collect();
        values.sort_by(f64::total_cmp);
        (unknown.prior.value(best.z[place]), [values[RESAMPLES / 40], values[RESAMPLES - 1 - RESAMPLES / 40]])
    };
    let estimate = |place: usize| {
        let (value, interval) = interval(place);
        ContactEstimate::new(unknowns[place].name, unknowns[place].unit, value, interval)
    };
    let of_body = |place: usize| {
        let (value, interval) = interval(place);
        BodyEstimate { name: unknowns[place].name, unit: unknowns[place].unit, value, interval }
    };
    Ok(TossFit {
        estimates: (0..CONTACT_PARAMETERS).map(estimate).collect(),
        body: (CONTACT_PARAMETERS..unknowns.len()).map(of_body).collect(),
        values: set(&best.z),
        fitted: own.len(),
        sets: all.len(),
    })
}

/// Number of the parameters that are of the contact: the first ones.
const CONTACT_PARAMETERS: usize = 3;

/// A toss from its first smooth state on.
pub struct OpenLoopToss {
    /// Name of the toss.
    pub name: String,
    /// First state.
    pub begin: BodyState,
    /// Time between frames \[s\].
    pub step: f64,
    /// Measured displacement \[m\] and turn from the first state, frame by frame.
    pub measured: Vec<(Vector3<f64>, UnitQuaternion<f64>)>,
}

impl OpenLoopToss {
    /// Returns the tosses of a part that begin in free flight.
    pub fn of(tosses: &Tosses, held_out: bool) -> Vec<Self> {
        let poses: Vec<Poses> = tosses.pieces.iter().map(Poses::of).collect();
        let noise = StateNoise::of(&tosses.rig, poses.iter());
        let one = |(piece, poses): (&Piece, &Poses)| {
            let smooth = |frame: &usize| poses.state(*frame).filter(|state| noise.is_smooth(state));
            let last = poses.frames() - 1;
            let first = (0..last).find(|frame| clear(&tosses.rig, poses, *frame, *frame) && smooth(frame).is_some())?;
            let begin = smooth(&first)?;
            let at = |frame: usize| {
                (poses.position[frame] - begin.position, begin.attitude.inverse() * poses.attitude[frame])
            };
            let measured = (first..=last).map(at).collect();
            Some(Self { name: piece.experiment.clone(), begin, step: poses.step, measured })
        };
        let own = |(piece, _): &(&Piece, &Poses)| tosses.held_out.contains(&piece.experiment) == held_out;
        tosses.pieces.iter().zip(&poses).filter(own).filter_map(one).collect()
    }
}

/// Errors of an open-loop simulation of a toss, means over its frames.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct OpenLoopError {
    /// Distance of the middle of the body \[m\].
    pub position_m: f64,
    /// Angle between simulated and measured attitude \[rad\].
    pub rotation_rad: f64,
}

/// Simulates tosses from their first states and compares them with the measurement, by parameter set and toss.
pub fn open_loop(tosses: &[OpenLoopToss], sets: &[Vec<f64>]) -> Vec<Vec<OpenLoopError>> {
    let runs: Vec<_> = tosses.iter().map(|toss| free_run(&toss.begin, toss.measured.len() - 1, toss.step)).collect();
    let outputs = simulate(BlockKind::Toss, &runs.iter().collect::<Vec<_>>(), sets);
    let width = BlockKind::Toss.outputs().len();
    let error = |toss: usize, set: usize| {
        let simulated = |frame: usize| {
            let row = &outputs[toss][set][frame * width..];
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(row[3], row[4], row[5]));
            (Vector3::new(row[0], row[1], row[2]), turn)
        };
        mean_error(&tosses[toss].measured, simulated)
    };
    (0..sets.len()).map(|set| (0..tosses.len()).map(|toss| error(toss, set)).collect()).collect()
}

/// Mean errors of simulated against measured displacements and turns; the first frame is the common start.
pub fn mean_error(
    measured: &[(Vector3<f64>, UnitQuaternion<f64>)],
    simulated: impl Fn(usize) -> (Vector3<f64>, UnitQuaternion<f64>),
) -> OpenLoopError {
    let count = (measured.len() - 1).max(1) as f64;
    let (mut position, mut rotation) = (0.0, 0.0);
    for (frame, (way, turn)) in measured.iter().enumerate().skip(1) {
        let (own_way, own_turn) = simulated(frame);
        position += (own_way - way).norm();
        rotation += turn.angle_to(&own_turn);
    }
    OpenLoopError { position_m: position / count, rotation_rad: rotation / count }
}
