//! Loads of the axes of a robot: computed with the gears of the model first, then with the identified gears.

use super::RobotPlant;
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::inference::torque_error::lacking;
use crate::model::place;
use crate::model::unknown::Role;
use crate::plants::robot::block::{Loads, loads};
use crate::verdict::judged::{Blocks, Judged, is_explained};
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::fields::from_slice;

/// A gear that winds up otherwise by less than this share moves no link otherwise.
const SAME: f64 = 0.02;
/// Times that the axes are judged: by the model's gears, and twice by those found, of which one more is taken each time.
pub(super) const PASSES: usize = 3;

/// Loads of the axes, and the gears they were computed with.
pub(super) struct Axes {
    drives: Vec<DriveValues<f64>>,
    pub(super) loads: Loads,
}

impl RobotPlant {
    /// Returns the loads of the axes with the gears identified so far.
    pub(super) fn axes(&self, recordings: &Recordings) -> &Axes {
        let nominal = || self.rig.drives.iter().map(|drive| drive.values).collect();
        self.axes.get_or_init(|| self.carrying(recordings, nominal()))
    }

    fn carrying(&self, recordings: &Recordings, drives: Vec<DriveValues<f64>>) -> Axes {
        Axes { loads: loads(&self.whole(recordings).rig, &recordings.pieces, &drives), drives }
    }

    /// Recomputes the loads of the axes if a gear with another compliance was identified, because its link moves
    /// differently and loads the other axes. Returns `false` if all gears are unchanged.
    ///
    /// The finding in one axis may be caused by the link of another: of the newly identified gears, the one with the
    /// best explanation of its axis is applied first.
    pub(super) fn update_loads(&mut self, recordings: &Recordings, all: &Blocks) -> bool {
        let gears: Vec<Option<DriveValues<f64>>> = all.judged.iter().map(Judged::gear).collect();
        let (known, nominal) = (&self.axes(recordings).drives, |place: usize| self.rig.drives[place].values);
        let is_new = |place: &usize| gears[*place].is_some() && winds_alike(&known[*place], &nominal(*place));
        let residual = |place: &usize| all.answers[*place].residual.after;
        let first = (0..gears.len()).filter(is_new).min_by(|a, b| residual(a).total_cmp(&residual(b)));
        let waits = |place: usize| is_new(&place) && first != Some(place);
        let found = |place: usize| gears[place].filter(|_| !waits(place)).unwrap_or(nominal(place));
        let found: Vec<DriveValues<f64>> = (0..gears.len()).map(found).collect();
        if known.iter().zip(&found).all(|(known, found)| winds_alike(known, found)) {
            return false;
        }
        self.axes = self.carrying(recordings, found).into();
        true
    }
}

/// Withholds the verdict on unexplained axes beside an axis with a larger misfit: the unknown motion of its link
/// loads the others.
pub(super) fn withhold_loaded(all: &mut Blocks) -> Vec<Finding> {
    let unexplained = (0..all.answers.len()).filter(|place| !is_explained(&all.answers[*place]));
    let lacks = |place: usize| {
        let own = &all.judged[place];
        let torque = lacking(&own.block, all.answers[place].held_out, &own.judgement.clamped)?;
        Some((place, torque))
    };
    let lacks: Vec<(usize, f64)> = unexplained.filter_map(lacks).collect();
    let Some((worst, _)) = lacks.iter().max_by(|a, b| a.1.total_cmp(&b.1)).copied() else { return Vec::new() };
    let culprit = place::place(all.answers[worst].block);
    let mut findings = Vec::new();
    for (place, _) in lacks.into_iter().filter(|(place, _)| *place != worst) {
        let what = format!(
            "no cause explains the motion, but the load from {culprit}, which is itself unexplained, may: no verdict \
             on this axis; correct {culprit} first"
        );
        findings.push(all.withhold(place, what));
    }
    findings
}

/// Returns whether the gears of two drives have equal compliance.
fn winds_alike(a: &DriveValues<f64>, b: &DriveValues<f64>) -> bool {
    (a.compliance - b.compliance).abs() <= SAME * a.compliance.abs()
}

impl Judged {
    /// The drive that was found, if it is explained best by a gear that winds up otherwise than the model's.
    fn gear(&self) -> Option<DriveValues<f64>> {
        let of_gear = |number: &usize| {
            let mut own = self.library[*number].unknowns.iter();
            own.any(|unknown| unknown.name == "compliance" && unknown.role != Role::Nuisance)
        };
        let judgement = &self.judgement;
        let best = judgement.admissible().next()?;
        let present = judgement.finds(best, self.library.len());
        (present && best.hypotheses.iter().any(of_gear)).then(|| from_slice(&best.fitted.values(&self.block.base)))
    }
}
