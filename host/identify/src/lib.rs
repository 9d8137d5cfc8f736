//! Identification of a robot: from recordings to a physically consistent model with its prediction errors and
//! residuals.

pub mod base;
pub mod choose;
pub mod consistent;
pub mod contact;
pub mod elasticity;
pub mod excitation;
pub mod files;
pub mod filter;
pub mod layout;
pub mod log;
pub mod model;
pub mod motion;
pub mod motion_page;
pub mod published_errors;
pub mod regressor;
pub mod report;
pub mod series;
pub mod system;
pub mod whiteness;

use crate::base::{Base, LeastSquares};
use crate::choose::{CrossValidationScore, Folds};
use crate::consistent::RobotPrior;
use crate::elasticity::{Elasticity, elasticity};
use crate::layout::Layout;
use crate::log::Recording;
use crate::model::{identified, predicted};
use crate::motion::{Preparation, RecordedMotion};
use crate::system::{FrictionShape, System, rms, shapes};
use crate::whiteness::Whiteness;
use nalgebra::DVector;
use softdock_campaign::Robot;
use softdock_diagnosis::DiagnosisError;
use std::path::Path;

/// Result with the error of a recording or an identification.
pub(crate) type Result<T> = std::result::Result<T, DiagnosisError>;

/// Options of an identification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdentificationOptions {
    /// Filter and period.
    pub preparation: Preparation,
    /// Weight of the a-priori robot; `None` chooses it by cross-validation.
    pub lambda: Option<f64>,
    /// Whether to choose each joint's friction shape by cross-validation; otherwise the a-priori shape is used.
    pub choose_shapes: bool,
}

impl Default for IdentificationOptions {
    fn default() -> Self {
        let preparation = Preparation { cutoff: 10.0, period: None };
        Self { preparation, lambda: None, choose_shapes: true }
    }
}

/// Measured and predicted torque of one joint over one recording.
#[derive(Clone, Debug)]
pub struct TorqueComparison {
    /// RMS(measured - predicted) / RMS(measured).
    pub relative_error: f64,
    /// The same for unregularised weighted least squares over the base parameters.
    pub plain_error: f64,
    /// Root mean square of the residual \[N m\], joint side.
    pub residual_rms: f64,
    /// Correlation over time of the residual.
    pub whiteness: Whiteness,
    /// Measured torque \[N m\], joint side.
    pub measured: Vec<f64>,
    /// Predicted torque \[N m\], joint side.
    pub predicted: Vec<f64>,
}

/// Torque comparison of a recording.
#[derive(Clone, Debug)]
pub struct RecordingComparison {
    /// Name of the recording.
    pub name: String,
    /// Sampling period \[s\].
    pub step: f64,
    /// Comparison of each joint.
    pub joints: Vec<TorqueComparison>,
}

/// Result of an identification.
#[derive(Clone, Debug)]
pub struct Identification {
    /// The a-priori robot.
    pub prior: Robot,
    /// Identified robot, as written to the model file.
    pub robot: Robot,
    /// Indices and names of the parameters.
    pub layout: Layout,
    /// The physically consistent parameters.
    pub theta: DVector<f64>,
    /// A-priori values of the same.
    pub prior_theta: DVector<f64>,
    /// Weighted least squares over the base parameters, with standard errors.
    pub least_squares: LeastSquares,
    /// Friction shapes.
    pub shapes: Vec<FrictionShape>,
    /// Chosen weight of the a-priori robot with its cross-validation errors.
    pub score: CrossValidationScore,
    /// Cross-validation errors of all weights.
    pub scores: Vec<CrossValidationScore>,
    /// Elasticity from second encoders.
    pub elasticity: Vec<Elasticity>,
    /// The fitted recordings.
    pub fitted: Vec<RecordingComparison>,
    /// Validation recordings, which were not fitted.
    pub validated: Vec<RecordingComparison>,
    /// Statements about what was changed in the recordings.
    pub notes: Vec<String>,
}

/// Identifies a robot from recordings and validates it on others.
///
/// # Errors
/// If a recording cannot be read, the equations are too few, or a joint moves too little.
pub fn identify(
    prior: &Robot,
    logs: &[&Path],
    validation: &[&Path],
    options: &IdentificationOptions,
) -> Result<Identification> {
    let read = |paths: &[&Path]| paths.iter().map(|path| Recording::read(path, prior)).collect::<Result<Vec<_>>>();
    let (recordings, others) = (read(logs)?, read(validation)?);
    identify_recordings(prior, &recordings, &others, options)
}

/// Identifies a robot as [`identify`] does, from recordings in memory.
pub fn identify_recordings(
    prior: &Robot,
    recordings: &[Recording],
    others: &[Recording],
    options: &IdentificationOptions,
) -> Result<Identification> {
    let ready = |recordings: &[Recording]| {
        recordings
            .iter()
            .map(|recording| RecordedMotion::new(recording, &options.preparation))
            .collect::<Result<Vec<_>>>()
    };
    let (motions, other_motions) = (ready(recordings)?, ready(others)?);
    still_joints(prior, &motions)?;
    let mut shape = shapes(prior);
    let mut system = System::new(prior, &motions, &shape);
    let base = Base::of(prior);
    let knowledge = RobotPrior::of(prior);
    let mut least_squares = LeastSquares::new(&system, &base, &motions);
    let mut folds = Folds::new(&system, &least_squares.sigma);
    if options.choose_shapes {
        folds.choose_shapes(&mut system, &motions, &knowledge, &mut shape);
        least_squares = LeastSquares::new(&system, &base, &motions);
    }
    let scores = match options.lambda {
        Some(lambda) => vec![folds.score(&knowledge, lambda)],
        None => folds.scores(&knowledge),
    };
    let score = scores.iter().min_by(|a, b| a.mean().total_cmp(&b.mean())).cloned().expect("at least one weight");
    let theta = folds.fit(&knowledge, score.lambda);
    let source = format!("identified from {}", names(recordings));
    let mut robot = identified(prior, &theta, &shape, &source);
    let elasticity = elasticity(&robot, recordings, &options.preparation);
    for row in elasticity.iter().filter(|row| row.is_believed()) {
        robot.model.joints[row.joint].drive.gear_stiffness = row.stiffness_n_m_per_rad;
        robot.joints[row.joint].sources.drive.insert_str(0, "gear stiffness: second encoder; ");
    }
    let plain = base.spread(&least_squares.beta);
    let compare = |motions: &[RecordedMotion]| {
        motions.iter().map(|motion| compared(&robot, prior, motion, &shape, &plain, options)).collect::<Vec<_>>()
    };
    let (fitted, validated) = (compare(&motions), compare(&other_motions));
    let of = |recording: &Recording| {
        recording.notes.iter().map(|note| format!("{}: {note}", recording.name)).collect::<Vec<_>>()
    };
    Ok(Identification {
        notes: recordings.iter().chain(others).flat_map(of).collect(),
        prior: prior.clone(),
        layout: Layout::of(prior),
        prior_theta: knowledge.theta,
        least_squares,
        shapes: shape,
        score,
        scores,
        elasticity,
        fitted,
        validated,
        robot,
        theta,
    })
}

/// The recordings' names in a row.
pub(crate) fn names(recordings: &[Recording]) -> String {
    recordings.iter().map(|recording| recording.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Every joint must slide: less travel than this is taken for a joint at rest \[rad\].
const LEAST_TRAVEL: f64 = 0.01;

fn still_joints(robot: &Robot, motions: &[RecordedMotion]) -> Result<()> {
    for (joint, facts) in robot.joints.iter().enumerate() {
        let all = || motions.iter().flat_map(|motion| motion.angle[joint].iter());
        let (least, greatest) =
            (all().copied().fold(f64::INFINITY, f64::min), all().copied().fold(f64::NEG_INFINITY, f64::max));
        if greatest - least < LEAST_TRAVEL {
            let what = format!("joint {} moves by only {:.4} deg", facts.name, (greatest - least).to_degrees());
            let remedy = "record a motion that moves every joint; `identify robot MODEL --design` makes one";
            return Err(DiagnosisError::unfit(what, remedy));
        }
    }
    Ok(())
}

/// Prediction by the written model, through the kernels, beside that of plain least squares.
fn compared(
    robot: &Robot,
    prior: &Robot,
    motion: &RecordedMotion,
    shapes: &[FrictionShape],
    plain: &DVector<f64>,
    options: &IdentificationOptions,
) -> RecordingComparison {
    let system = System::new(prior, std::slice::from_ref(motion), shapes);
    let predicted = predicted(&robot.model, motion);
    let every = (0.5 / (options.preparation.cutoff * motion.step)).round() as usize;
    let joint = |(index, predicted): (usize, Vec<f64>)| {
        let measured = motion.torque[index].clone();
        let residual: Vec<f64> = measured.iter().zip(&predicted).map(|(m, p)| m - p).collect();
        let whole = rms(&measured).max(f64::MIN_POSITIVE);
        TorqueComparison {
            relative_error: rms(&residual) / whole,
            plain_error: rms(system.residual(index, plain).iter()) / whole,
            residual_rms: rms(&residual),
            whiteness: Whiteness::of(&residual, every),
            measured,
            predicted,
        }
    };
    let joints = predicted.into_iter().enumerate().map(joint).collect();
    RecordingComparison { name: motion.name.clone(), step: motion.step, joints }
}
