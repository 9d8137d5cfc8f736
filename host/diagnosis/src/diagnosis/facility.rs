//! A whole facility from the logs of its drives: told to motion, and motion to wrench.

use super::{Options, Prepared, Subject};
use crate::block::MeasuredBlock;
use crate::block::facility::{FacilityModel, MOTION, WRENCH, motion_section, wrench_section};
use crate::isolability::BlockView;
use crate::library::{self, Hypothesis};
use crate::recording::drive_log::DriveLog;
use crate::recording::grid::Finding;
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::path::Path;

/// Reads the logs of drives on a facility; without held-out drives the last third of the runs is held out.
///
/// Several drives of one run are repeats of it, which tell the noise.
///
/// # Errors
/// Logs that cannot be used, a scenario whose commands the logs do not hold, an id that is in no library.
pub fn prepare_facility(
    model: FacilityModel,
    logs: &[&Path],
    holdout: &[&Path],
    options: &Options,
) -> Result<Prepared> {
    if model.scenario().model.facility.impedance.is_some() {
        let what = "the scenario has impedance control: what the robots were told is not in the log";
        return Err(Error::unfit(what, "diagnose a drive of the same facility without [facility.impedance]"));
    }
    let mut findings = Vec::new();
    let mut read = |paths: &[&Path]| -> Result<Vec<DriveLog>> {
        paths.iter().map(|path| DriveLog::read(path, &mut findings)).collect()
    };
    let (mut learn, mut test) = (named(read(logs)?), named(read(holdout)?));
    if test.is_empty() {
        (learn, test) = last_third(learn);
    }
    if learn.is_empty() || test.is_empty() {
        let what = "drives of one run alone cannot be learnt from and judged by";
        return Err(Error::unfit(what, "drive another run of the campaign and give its log too"));
    }
    findings.extend(strangers(&model, learn.iter().chain(&test)));
    let runs: BTreeSet<String> = learn.iter().map(|log| log.name.clone()).collect();
    // A run that is learnt from and judged by would prove little.
    for log in test.iter_mut().filter(|log| runs.contains(&log.name)) {
        log.name += super::HELD_OUT;
    }
    let held_out: BTreeSet<String> = test.iter().map(|log| log.name.clone()).collect();
    let mut provisional = Vec::new();
    if runs.len() == learn.len() {
        let why = "no run was driven twice: the motion's noise is what the richest explanation leaves";
        provisional.push(why.to_owned());
    }
    if held_out.iter().any(|name| name.ends_with(super::HELD_OUT)) {
        provisional.push("a held-out drive is of a run that was learnt from".to_owned());
    }
    let logs = learn.into_iter().chain(test).collect();
    let (without, isolability) = (options.without.clone(), Vec::new());
    let subject = Subject::Facility(Box::new(model), logs);
    let (first, torque) = (options.first(), Vec::new());
    Prepared { subject, held_out, without, first, torque, provisional, findings, isolability }.seen()
}

/// Drives of another campaign than the one they are compared with.
fn strangers<'a>(model: &FacilityModel, logs: impl Iterator<Item = &'a DriveLog>) -> Vec<Finding> {
    let FacilityModel::Campaign(campaign) = model else {
        return Vec::new();
    };
    let is_strange = |log: &&DriveLog| log.campaign_hash.as_ref().is_some_and(|hash| *hash != campaign.hash);
    let told = |log: &DriveLog| Finding {
        recording: log.name.clone(),
        what: format!("driven for another state of the campaign than {}: its draw may be another", campaign.id),
    };
    logs.filter(is_strange).map(told).collect()
}

/// Drives by the experiment that they are: the run of a campaign; of no campaign, each its own.
fn named(mut logs: Vec<DriveLog>) -> Vec<DriveLog> {
    for (number, log) in logs.iter_mut().enumerate() {
        log.name = match (log.run, &log.campaign) {
            (Some(run), Some(campaign)) => format!("{campaign} {run}"),
            _ => format!("{} ({})", log.name, number + 1),
        };
    }
    logs
}

/// Drives of the first runs, and those of the last third of them.
fn last_third(logs: Vec<DriveLog>) -> (Vec<DriveLog>, Vec<DriveLog>) {
    let mut runs: Vec<String> = Vec::new();
    for log in &logs {
        if !runs.contains(&log.name) {
            runs.push(log.name.clone());
        }
    }
    let kept = runs.len() - runs.len().div_ceil(3).min(runs.len().saturating_sub(1));
    logs.into_iter().partition(|log| runs[..kept].contains(&log.name))
}

/// The sections with their libraries.
pub(super) fn sections(
    model: &FacilityModel,
    logs: &[DriveLog],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> Vec<(MeasuredBlock, Vec<Hypothesis>)> {
    let scenario = &model.scenario().model;
    let motion = motion_section(model, logs, held_out, finer);
    let wrench = wrench_section(model, logs, held_out, finer);
    let of_motion = library::facility::of_motion(&motion, scenario);
    let of_wrench = library::facility::of_wrench(&wrench, scenario);
    vec![(motion, of_motion), (wrench, of_wrench)]
}

/// What the sections can show.
pub(super) fn views(sections: &[(MeasuredBlock, Vec<Hypothesis>)]) -> Vec<BlockView> {
    let view = |place: usize, inputs: &[&'static str], outputs: &[&'static str]| {
        let (block, library) = &sections[place];
        BlockView::judged(block, library, inputs, outputs)
    };
    vec![view(0, &["commands"], &MOTION), view(1, &["motion of the parts"], &WRENCH)]
}
