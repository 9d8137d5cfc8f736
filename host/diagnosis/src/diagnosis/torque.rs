//! Which of the torques that a controller may have asked for between a log's samples moved the drive as it did.

use super::{Prepared, Subject};
use crate::block::drive::drive_block;
use softdock_campaign::rig::Plant;

impl Prepared {
    /// Of the torques that the log allows, recording by recording, those that leave least of the motion unexplained: a jump
    /// that comes a period late is an impulse, which the drive's angle shows.
    pub(super) fn moving(&self, allowed: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let Subject::Rig(rig, pieces) = &self.subject else { return Vec::new() };
        let Plant::Drive(drive) = &rig.plant else { return Vec::new() };
        let held = |experiment: &str| self.held_out.contains(experiment);
        let most = allowed.iter().map(Vec::len).max().unwrap_or(0);
        let nth = |n: usize| -> Vec<Vec<f64>> { allowed.iter().map(|own| own[n.min(own.len() - 1)].clone()).collect() };
        if most <= 1 {
            return nth(0);
        }
        let left = |n: usize| drive_block(drive, pieces, &held, self.first, &nth(n)).misfits();
        let left: Vec<Vec<f64>> = (0..most).map(left).collect();
        let least = |trial: usize| {
            (0..allowed[trial].len()).min_by(|a, b| left[*a][trial].total_cmp(&left[*b][trial])).expect("one at least")
        };
        let best: Vec<usize> = (0..allowed.len()).map(least).collect();
        allowed.into_iter().zip(best).map(|(mut own, best)| own.swap_remove(best)).collect()
    }
}
