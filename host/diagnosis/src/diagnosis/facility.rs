//! Whole facility from the logs of its drives: command to motion, and motion to wrench.

use super::{DiagnosisOptions, Prepared};
use crate::data::drive_log::DriveLog;
use crate::data::grid::Finding;
use crate::data::recordings::Recordings;
use crate::plants::facility::FacilityPlant;
use crate::plants::facility::block::FacilityModel;
use crate::{DiagnosisError, Result};
use std::collections::BTreeSet;
use std::path::Path;

/// Reads the logs of drives on a facility; without held-out drives the last third of them is held out.
///
/// # Errors
/// Logs that cannot be used, a scenario whose commands the logs do not hold, an id that is in no library.
pub fn prepare_facility(
    model: FacilityModel,
    logs: &[&Path],
    holdout: &[&Path],
    options: &DiagnosisOptions,
) -> Result<Prepared> {
    if model.scenario().model.facility.impedance.is_some() {
        let what = "the scenario has impedance control, so the log does not contain the commands to the robots";
        return Err(DiagnosisError::unfit(what, "diagnose a drive of the same facility without [facility.impedance]"));
    }
    let (mut findings, tick) = (Vec::new(), model.scenario().model.timing.tick());
    let mut read = |paths: &[&Path]| -> Result<Vec<DriveLog>> {
        paths.iter().map(|path| DriveLog::read(path, tick, &mut findings)).collect()
    };
    let (mut learn, mut test) = (read(logs)?, read(holdout)?);
    if test.is_empty() && learn.len() > 1 {
        test = learn.split_off(learn.len() - learn.len().div_ceil(3).min(learn.len() - 1));
    }
    if learn.is_empty() || test.is_empty() {
        let what = "one drive cannot serve both for training and as held-out data";
        return Err(DiagnosisError::unfit(what, "drive another run of the campaign and pass its log as well"));
    }
    findings.extend(strangers(&model, learn.iter().chain(&test)));
    named_apart(learn.iter_mut().chain(&mut test));
    let held_out: BTreeSet<String> = test.iter().map(|log| log.name.clone()).collect();
    let why = "no drive repeats the commands of another: the noise of the motion is estimated from the residual of the richest hypothesis";
    let provisional = vec![why.to_owned()];
    let logs = learn.into_iter().chain(test).collect();
    let plant = Box::new(FacilityPlant::of(model, logs));
    Prepared::new(plant, Recordings { pieces: Vec::new(), held_out }, provisional, findings, options).seen()
}

/// Drives of another campaign than the one they are compared with.
fn strangers<'a>(model: &FacilityModel, logs: impl Iterator<Item = &'a DriveLog>) -> Vec<Finding> {
    let FacilityModel::Campaign(campaign) = model else {
        return Vec::new();
    };
    let is_strange = |log: &&DriveLog| log.campaign_hash.as_ref().is_some_and(|hash| *hash != campaign.hash);
    let finding = |log: &DriveLog| Finding {
        recording: log.name.clone(),
        what: format!("driven for another version of campaign {}: its draw may differ", campaign.id),
    };
    logs.filter(is_strange).map(finding).collect()
}

/// Drives of the same name get numbers: each is an experiment of its own.
fn named_apart<'a>(logs: impl Iterator<Item = &'a mut DriveLog>) {
    let mut seen: BTreeSet<String> = BTreeSet::new();
    for log in logs {
        let name = log.name.clone();
        let mut number = 1;
        while !seen.insert(log.name.clone()) {
            number += 1;
            log.name = format!("{name} ({number})");
        }
    }
}
