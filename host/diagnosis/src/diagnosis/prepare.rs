//! Preparation of a rig's recordings: training data, held-out data, reasons for a provisional answer.

use super::{DiagnosisOptions, Prepared};
use crate::data::grid::{Finding, Piece, read_with_quality};
use crate::data::hold_out::{last_third, split};
use crate::data::plausibility::check;
use crate::data::quality::RecordingQuality;
use crate::data::recordings::Recordings;
use crate::data::repeats::separate_motions;
use crate::data::segments::separate_segments;
use crate::plants::{self, DiagnosedPlant};
use crate::{DiagnosisError, Result};
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use std::collections::BTreeSet;
use std::path::Path;

/// What is added to the name of an experiment whose later part is held out.
const HELD_OUT: &str = ", held out";

/// Reads a rig's recordings.
///
/// # Errors
/// Recordings that cannot be used, an id that is in no library.
pub fn prepare(rig: Rig, logs: &[&Path], holdout: &[&Path], options: &DiagnosisOptions) -> Result<Prepared> {
    let (mut findings, mut quality) = (Vec::new(), Vec::new());
    let mut pieces = |paths| pieces(&rig, paths, &mut findings, &mut quality);
    let (mut learn, mut test) = (pieces(logs)?, pieces(holdout)?);
    findings.extend([&mut learn, &mut test].into_iter().flat_map(|pieces| separate_motions(pieces)));
    from_session_start(&mut learn, &mut test);
    let inertia = match &rig.plant {
        RigModel::Drive(drive) => Some(drive.values.motor_inertia + drive.link_inertia),
        _ => None,
    };
    let plant = plants::of_rig(rig.plant);
    if plant.needs_motion() {
        learn.iter().chain(&test).try_for_each(moves)?;
    }
    findings.extend(check(&learn, inertia)?);
    let asked = options.hold_out_from.is_some() || !test.is_empty();
    if let Some(every) = options.hold_out_experiments.or_else(|| plant.default_hold_out().filter(|_| !asked)) {
        (test, learn) = every.split(learn)?;
    }
    if plant.without_blocks(&learn).is_some() {
        learn.extend(test);
        return Ok(Prepared { data_quality: quality, ..timed(plant, learn, findings, options) });
    }
    let mut provisional = Vec::new();
    if let Some(from) = options.hold_out_from.or_else(|| test.is_empty().then(|| last_third(&learn))) {
        let (before, after) = split(&learn, from);
        (learn, test) = (before, test.into_iter().chain(after).collect());
        provisional.push(format!("no different motion was held out, only the recordings after {from:.3} s"));
    }
    if plant.needs_motion() {
        provisional.extend(held_out_at_rest(&learn, &test)?);
    }
    if named_apart(&learn, &mut test) && options.hold_out_from.is_none() {
        provisional.push("a held-out recording repeats a training motion".to_owned());
    }
    if !learn.iter().any(|piece| piece.repeat > 1) {
        provisional.push(format!("no repeats: {}", plant.noise_without_repeats()));
    }
    if learn.is_empty() || test.is_empty() {
        let what = "no recording remains for training or for the held-out test".to_owned();
        return Err(DiagnosisError::unfit(what, "record longer, or hold out less"));
    }
    let held_out = test.iter().map(|piece| piece.experiment.clone()).collect();
    let pieces = learn.into_iter().chain(test).collect();
    let prepared = Prepared::new(plant, Recordings { pieces, held_out }, provisional, findings, options);
    Prepared { data_quality: quality, ..prepared }.seen()
}

/// What files have of a rig's signals, and what was found in them.
fn pieces(
    rig: &Rig,
    paths: &[&Path],
    findings: &mut Vec<Finding>,
    quality: &mut Vec<RecordingQuality>,
) -> Result<Vec<Piece>> {
    let mut all = Vec::new();
    for (file, path) in paths.iter().enumerate() {
        let read = read_with_quality(path, rig)?;
        findings.extend(read.findings);
        quality.extend(read.quality);
        all.extend(read.pieces.into_iter().map(|piece| (file, piece)));
    }
    let (all, found) = separate_segments(all);
    findings.extend(found);
    Ok(all)
}

/// Clock beyond which time stamps count from 1970 and not from the start of a session \[s\].
const EPOCH: f64 = 1e8;

/// Counts time stamps since 1970 from the earliest recording on: the held-out time and the temperature of a drive count
/// from the start of the session. Stamps of other clocks move with them.
fn from_session_start(learn: &mut [Piece], test: &mut [Piece]) {
    let start = learn.iter().chain(&*test).map(|piece| piece.start).fold(f64::INFINITY, f64::min);
    if start < EPOCH || start.is_infinite() {
        return;
    }
    for piece in learn.iter_mut().chain(test) {
        piece.start -= start;
        let stamps = piece.signals.iter_mut().filter(|(name, _)| name.ends_with(".t"));
        stamps.for_each(|(_, values)| values.iter_mut().for_each(|stamp| *stamp -= start));
    }
}

/// Prepares recordings of events without an echo, which determine delays only and have no held-out data.
fn timed(
    plant: Box<dyn DiagnosedPlant>,
    pieces: Vec<Piece>,
    findings: Vec<Finding>,
    options: &DiagnosisOptions,
) -> Prepared {
    let (reason, isolability) = plant.without_blocks(&pieces).unwrap_or_default();
    let recordings = Recordings { pieces, held_out: BTreeSet::new() };
    Prepared { isolability, ..Prepared::new(plant, recordings, vec![reason], findings, options) }
}

/// Gives held-out recordings names apart from those that are learnt from, since a recording that is learnt from and judged
/// by would prove nothing; whether any had the same.
fn named_apart(learn: &[Piece], test: &mut [Piece]) -> bool {
    let is_learnt = |piece: &&mut Piece| learn.iter().any(|own| own.experiment == piece.experiment);
    let shared = test.iter_mut().filter(is_learnt).map(|piece| piece.experiment += HELD_OUT);
    shared.count() > 0
}

/// Share of a joint's training motion below which a held-out motion confirms nothing about it.
const LEAST_MOTION: f64 = 0.05;

/// Returns the reason for a provisional answer where some joints rest in every held-out recording.
///
/// # Errors
/// No joint moves there: each hypothesis would be judged by the noise.
fn held_out_at_rest(learn: &[Piece], test: &[Piece]) -> Result<Option<String>> {
    let travel = |pieces: &[Piece], signal: &str| {
        let range = |values: &Vec<f64>| {
            let numbers = || values.iter().copied().filter(|value| value.is_finite());
            numbers().fold(f64::NEG_INFINITY, f64::max) - numbers().fold(f64::INFINITY, f64::min)
        };
        pieces.iter().filter_map(|piece| piece.signals.get(signal)).map(range).fold(0.0, f64::max)
    };
    let is_angle = |signal: &&String| *signal == "q" || signal.starts_with("q.");
    let angles: BTreeSet<&String> = learn.iter().flat_map(|piece| piece.signals.keys()).filter(is_angle).collect();
    let resting = angles.iter().filter(|angle| travel(test, angle) < LEAST_MOTION * travel(learn, angle));
    let resting: Vec<String> = resting
        .map(|angle| {
            format!("`{angle}` (range {:.4} rad or m, in training {:.4})", travel(test, angle), travel(learn, angle))
        })
        .collect();
    if resting.is_empty() || test.is_empty() {
        return Ok(None);
    }
    let what = format!("the held-out recordings move too little to confirm a cause: {}", resting.join(", "));
    match resting.len() == angles.len() {
        true => Err(DiagnosisError::unfit(what, "hold out a recording in which the joint moves as in training")),
        false => Ok(Some(what)),
    }
}

/// A channel of a drive that never changes was not measured.
fn moves(piece: &Piece) -> Result<()> {
    let still = |values: &Vec<f64>| values.iter().all(|value| *value == values[0]);
    match piece.signals.iter().find(|(_, values)| still(values)) {
        None => Ok(()),
        Some((signal, values)) => Err(DiagnosisError::unfit(
            format!("`{signal}` is constant in {}: {} throughout", piece.experiment, values[0]),
            "check its column in [log]; remove it there if the channel was not recorded",
        )),
    }
}
