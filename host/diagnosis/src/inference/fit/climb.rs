//! Fit in progress: its parameters, derivatives and next step.

use super::{Fitted, Start};
use crate::model::unknown::{Role, Unknown};
use nalgebra::{DMatrix, DVector};

/// Trial damping factors of a round, times the last good one.
const DAMPINGS: [f64; 4] = [0.2, 1.0, 6.0, 36.0];
/// A fit ends when a round gains less than this, or less than this share of what is left beyond noise.
pub(super) const GAIN: f64 = 0.02;
const SHARE: f64 = 2e-4;
/// First damping; and that at which a step that gains nothing ends a fit.
const DAMPING: f64 = 1e-3;
const STUCK: f64 = 1.0;
/// Tolerances that a nuisance may go at first; twice as far after every round that gained what it promised.
const REACH: f64 = 1.0;
/// Factor by which a derivative is taken over a longer way where a shorter one misled or leads no further though the mean
/// square that is left is this large; and the longest way.
pub(super) const MUCH: f64 = 1.5;
const LONGER: f64 = 7.0;
const LONGEST: f64 = 0.1;
/// A step that gains less than this share of what its derivatives promise, or more than one over it, does not agree with
/// them: they are simulated anew. Those by sizes and forms, which change most from place to place, are kept only where it
/// gains nearly what they promise: a model that is linear in them is.
const AGREES: f64 = 0.5;
const HOLDS: f64 = 0.98;

/// A fit under way.
pub(super) struct Climb {
    /// Where it stands; columns of its Jacobian mean nothing while they are due for the first time.
    pub(super) at: Fitted,
    /// Information `J'J`, kept with the Jacobian: most of its columns stay from round to round.
    information: DMatrix<f64>,
    /// Which derivatives are to be simulated in the next round.
    due: Vec<bool>,
    /// Whether some of them are those of another place.
    aged: bool,
    damping: f64,
    /// Difference over which derivatives are taken.
    quotient: f64,
    /// How far a nuisance may go in a round.
    reach: f64,
    /// What the last round gained.
    pub(super) gained: f64,
    pub(super) done: bool,
}

impl Climb {
    /// Builds the fit from a start with its residual; `quotient` is the step of difference quotients, as a share of a
    /// standard deviation.
    pub(super) fn begun(start: Start, residual: DVector<f64>, quotient: f64) -> Self {
        let Start { hypothesis, unknowns, z, slopes } = start;
        let size = z.len();
        let jacobian = DMatrix::zeros(residual.len(), size);
        let at = Fitted { hypothesis, unknowns, z, residual, jacobian, carried: 0.0, input_noise: None, freed: false };
        let (due, aged) = (slopes.iter().map(Option::is_none).collect(), slopes.iter().any(Option::is_some));
        let information = DMatrix::zeros(size, size);
        let mut climb =
            Self { at, information, due, aged, damping: DAMPING, quotient, reach: REACH, gained: 0.0, done: false };
        let known = slopes.into_iter().enumerate().filter_map(|(column, slope)| Some((column, slope?)));
        climb.take_slopes(known.collect());
        climb
    }

    /// Returns the parameter sets for the difference quotients that are due.
    pub(super) fn beside(&self) -> Vec<Vec<f64>> {
        let moved = |column: usize| {
            let mut z = self.at.z.clone();
            z[column] += self.quotient;
            z
        };
        self.columns_due().into_iter().map(moved).collect()
    }

    fn columns_due(&self) -> Vec<usize> {
        (0..self.due.len()).filter(|column| self.due[*column]).collect()
    }

    /// Takes the derivatives that were due from the residuals at the places beside it.
    pub(super) fn differentiate(&mut self, beside: Vec<DVector<f64>>) {
        self.aged &= self.due.iter().any(|due| !due);
        let slope = |residual: DVector<f64>| (residual - &self.at.residual) / self.quotient;
        let slopes = self.columns_due().into_iter().zip(beside.into_iter().map(slope)).collect();
        self.take_slopes(slopes);
        self.due.fill(false);
    }

    /// Takes columns of the Jacobian, and what they change of the information.
    fn take_slopes(&mut self, slopes: Vec<(usize, DVector<f64>)>) {
        slopes.iter().for_each(|(column, slope)| self.at.jacobian.set_column(*column, slope));
        let columns: Vec<usize> = slopes.into_iter().map(|(column, _)| column).collect();
        let products = self.at.jacobian.select_columns(&columns).transpose() * &self.at.jacobian;
        for (row, column) in columns.into_iter().enumerate() {
            self.information.set_row(column, &products.row(row));
            self.information.set_column(column, &products.row(row).transpose());
        }
    }

    /// Where the next step would lead for each damping.
    pub(super) fn trials(&self) -> Vec<Vec<f64>> {
        let at = &self.at;
        let size = at.z.len();
        let normal = &self.information + DMatrix::from_diagonal(&at.plausible());
        let gradient = at.gradient() + at.prior_slope();
        let trial = |factor: f64| {
            let damped = &normal + DMatrix::from_diagonal(&(normal.diagonal() * (self.damping * factor)));
            let step = damped.cholesky().map_or_else(|| DVector::zeros(size), |cholesky| cholesky.solve(&gradient));
            let moved = |(i, unknown): (usize, &Unknown)| {
                let reach = if unknown.role == Role::Size { f64::INFINITY } else { self.reach };
                unknown.prior.allowed(at.z[i] - step[i].clamp(-reach, reach))
            };
            at.unknowns.iter().enumerate().map(moved).collect()
        };
        DAMPINGS.map(trial).into()
    }

    /// Goes to the best of some trials, one a damping, and sees which derivatives are due there.
    pub(super) fn moved(&mut self, trials: Vec<Vec<f64>>, residuals: Vec<DVector<f64>>) {
        let before = self.at.cost();
        let hoped = before - self.expected(&trials[0]);
        let tried = trials.into_iter().zip(residuals).zip(DAMPINGS);
        let tried = tried.map(|((z, residual), damping)| (cost(&residual, &z), damping, z, residual));
        let best = tried.filter(|trial| trial.0 < before).min_by(|a, b| a.0.total_cmp(&b.0));
        let gained = best.as_ref().map_or(0.0, |best| before - best.0);
        let promised = best.as_ref().map_or(0.0, |best| before - self.expected(&best.2));
        let factor = best.as_ref().map_or(DAMPINGS[3], |best| best.1);
        if let Some((_, _, z, residual)) = best {
            (self.at.z, self.at.residual) = (z, residual);
        }
        let enough = f64::max(GAIN, SHARE * (before - self.at.residual.len() as f64));
        let keeps = |share: f64| (share * promised..=promised / share).contains(&gained);
        let (settled, agrees, holds) = (gained < enough, keeps(AGREES), keeps(HOLDS));
        // What jumps from sample to sample has a slope over a longer way only.
        let much = self.at.residual.norm_squared() > MUCH * self.at.residual.len() as f64;
        let misled = !self.aged && self.quotient < LONGEST && if settled { much } else { !agrees };
        // Derivatives of another place are good while they promise what comes.
        let outdated = misled || self.aged && (settled || !agrees);
        for (unknown, due) in self.at.unknowns.iter().zip(&mut self.due) {
            *due = outdated || (gained > 0.0 && !holds && unknown.role != Role::Nuisance);
        }
        // A step that gains nothing though more was hoped for is tried once more, much shorter.
        self.done = settled && !outdated && (gained > 0.0 || hoped < enough || self.damping > STUCK);
        self.damping = if outdated { self.damping } else { (self.damping * factor).max(1e-9) };
        self.reach = if agrees { 2.0 * self.reach } else { REACH };
        self.quotient = if misled { f64::min(LONGER * self.quotient, LONGEST) } else { self.quotient };
        self.aged |= gained > 0.0;
        self.gained = gained;
    }

    /// What would be left elsewhere if the derivatives held that far.
    fn expected(&self, z: &[f64]) -> f64 {
        let step = DVector::from_iterator(z.len(), z.iter().zip(&self.at.z).map(|(to, from)| to - from));
        cost(&(&self.at.residual + &self.at.jacobian * step), z)
    }

    /// Goes on from a better place, with derivatives of its own.
    pub(super) fn resume(&mut self, z: Vec<f64>, residual: DVector<f64>) {
        (self.at.z, self.at.residual) = (z, residual);
        self.due.fill(true);
        (self.aged, self.done, self.damping) = (false, false, DAMPING);
    }
}

/// What fits minimise, without noise that is carried.
pub(super) fn cost(residual: &DVector<f64>, z: &[f64]) -> f64 {
    residual.norm_squared() + z.iter().map(|z| z * z).sum::<f64>()
}
