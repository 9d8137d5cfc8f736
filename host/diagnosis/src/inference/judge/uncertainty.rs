//! Uncertainty of the best candidates' parameters, and their bias from input noise.

use crate::inference::admissibility::is_admissible;
use crate::inference::errors_in_variables::compensated;
use crate::inference::evidence::evidence;
use crate::inference::fit::{Fitted, InputNoise, Simulate};
use crate::inference::judge::{Candidate, JudgementContext, RARITY, REFINED};
use crate::inference::parameter_deviations::{ErrorSources, deviations};
use crate::model::unknown::{Role, applied};
use nalgebra::DVector;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Rise of the sum of squares at two deviations to either side, of the four or more that a parabola has, below which a
/// deviation is too small; and times that it is doubled.
const RISE: f64 = 2.0;
const WIDENINGS: usize = 8;

impl JudgementContext<'_> {
    /// Computes the log-odds of the best candidates that input noise alone may give. If a candidate changes the
    /// propagated noise by `d`, the sum of squares of a residual `r` changes by `2 r'd + d'd`. Repeats determine the
    /// second term, which is subtracted; the first is random with standard deviation `2 |d|`.
    pub(crate) fn add_input_noise(&self, null: &Fitted, dispersion: f64, ranking: &mut [Candidate]) {
        if !self.learn.has_repeats() {
            return;
        }
        let best: Vec<&mut Candidate> =
            ranking.iter_mut().filter(|candidate| candidate.admissible).take(REFINED).collect();
        let fits = std::iter::once(null).chain(best.iter().map(|candidate| &candidate.fitted));
        let sets: Vec<Vec<f64>> = fits.map(|fitted| fitted.values(&self.block.base)).collect();
        let carried = self.learn.whitened_deviations(&self.noise, &sets);
        let rare = Normal::standard().inverse_cdf(1.0 - RARITY);
        for (candidate, own) in best.into_iter().zip(&carried[1..]) {
            // Whitened means count as single repeats do: their noise has the same power.
            let share = null.residual.len() as f64 / own.len() as f64;
            candidate.by_input_noise = rare * ((own - &carried[0]).norm_squared() * share).sqrt() / dispersion;
        }
    }

    /// Removes the size priors and the input-noise bias from the parameters of the best candidates. Their ranking is
    /// unchanged, except for combinations that become inadmissible.
    pub(crate) fn compensate(&self, dispersion: f64, ranking: &mut [Candidate]) {
        let mut best: Vec<&mut Candidate> =
            ranking.iter_mut().filter(|candidate| candidate.admissible).take(REFINED).collect();
        best.par_iter_mut().for_each(|candidate| self.compensate_one(dispersion, candidate));
    }

    /// The same of one candidate.
    fn compensate_one(&self, dispersion: f64, candidate: &mut Candidate) {
        let (mean, deviation) = (
            |sets: &[Vec<f64>]| self.simulated(sets),
            |sets: &[Vec<f64>]| self.learn.whitened_deviations(&self.noise, sets),
        );
        let deviation: Option<&Simulate> = if self.learn.has_repeats() { Some(&deviation) } else { None };
        let freed = candidate.fitted.clone().with_freed_sizes();
        let compensated = compensated(&freed, &self.block.base, &mean, deviation);
        let compensated = self.with_carried(compensated.into_iter().collect()).pop();
        // A parameter whose effect jumps, such as a hold, has no sensitivity.
        if let Some(compensated) = compensated.filter(|compensated| compensated.cost() <= freed.cost()) {
            candidate.evidence.covariance = evidence(&compensated, dispersion).covariance;
            candidate.fitted = compensated;
            let Candidate { hypotheses, fitted, evidence, .. } = &*candidate;
            let one = hypotheses.len() == 1;
            candidate.admissible =
                one || is_admissible(&self.block.base, self.library, hypotheses, fitted, &evidence.covariance);
        }
    }

    /// How far the numbers of each candidate may be off; a combination with a size that may be nothing is not sound.
    pub(crate) fn add_deviations(&self, dispersion: f64, ranking: &mut [Candidate]) {
        let experiments = self.learn.experiments(&self.noise);
        let best = ranking.iter().filter(|candidate| candidate.admissible).take(REFINED);
        let sets: Vec<Vec<f64>> = best.map(|candidate| candidate.fitted.values(&self.block.base)).collect();
        let unfitted = self.unfitted(&sets);
        let repeats = match self.learn.has_repeats() {
            true => self.learn.whitened_differences(&self.noise, &sets),
            false => Vec::new(),
        };
        let mut place = 0..sets.len();
        for candidate in ranking {
            let place = if candidate.admissible { place.next() } else { None };
            let Candidate { fitted, evidence, .. } = &*candidate;
            let changed = |place: usize| unfitted.iter().map(move |all| &all[place] - &fitted.residual);
            let shifts = place.into_iter().flat_map(changed).collect();
            let seen =
                ErrorSources { experiments: &experiments, shifts, repeats: place.and_then(|place| repeats.get(place)) };
            candidate.deviations = deviations(fitted, evidence, dispersion, &seen);
            if place.is_some() {
                self.widen(&candidate.fitted, dispersion, &mut candidate.deviations);
            }
            let (base, members) = (&self.block.base, &candidate.hypotheses);
            candidate.sure = is_admissible(base, self.library, members, &candidate.fitted, &candidate.covariance());
            candidate.admissible &= candidate.sure || members.len() == 1;
        }
    }

    /// Widens the deviations of sizes and forms that the data do not constrain: an effect that jumps from sample to
    /// sample, such as a hold, has no derivative.
    fn widen(&self, fitted: &Fitted, dispersion: f64, deviations: &mut [f64]) {
        let places = (0..deviations.len()).filter(|place| fitted.unknowns[*place].role != Role::Nuisance);
        for place in places {
            for _ in 0..WIDENINGS {
                let ways = [-2.0 * deviations[place], 2.0 * deviations[place]];
                let rise = self.rise(fitted, place, ways).into_iter().fold(f64::INFINITY, f64::min) / dispersion;
                // A point with a much smaller residual belongs to another minimum.
                if rise.abs() >= RISE {
                    break;
                }
                deviations[place] *= 2.0;
            }
        }
    }

    /// Returns the increase of a fit's residual for shifts of one parameter with the others fixed: an upper bound of
    /// the increase with the others refitted.
    fn rise(&self, fitted: &Fitted, place: usize, ways: [f64; 2]) -> [f64; 2] {
        let moved = ways.map(|way| {
            let mut z = fitted.z.clone();
            z[place] = fitted.unknowns[place].prior.allowed(z[place] + way);
            z
        });
        let sets: Vec<Vec<f64>> = moved.iter().map(|z| applied(&self.block.base, &fitted.unknowns, z)).collect();
        let residuals = self.simulated(&sets);
        let plausible = fitted.plausible()[place];
        let of = |number: usize| {
            let (from, to) = (fitted.z[place], moved[number][place]);
            let way = to - from;
            let input_noise =
                |noise: &InputNoise| 2.0 * noise.gradient[place] * way + noise.information[(place, place)] * way * way;
            residuals[number].norm_squared() - fitted.residual.norm_squared() + plausible * (to * to - from * from)
                - fitted.input_noise.as_ref().map_or(0.0, input_noise)
        };
        [of(0), of(1)]
    }

    /// Whitened residuals where what is not fitted is otherwise, for every set: in finer steps, and with each considered
    /// parameter a deviation off.
    fn unfitted(&self, sets: &[Vec<f64>]) -> Vec<Vec<DVector<f64>>> {
        let finer = self.finer.iter().map(|finer| finer.whitened(&self.noise, sets));
        let off = |(name, deviation): &(&str, f64)| {
            let field = self.block.field(name);
            let moved = |set: &Vec<f64>| {
                let mut set = set.clone();
                set[field] += deviation;
                set
            };
            self.simulated(&sets.iter().map(moved).collect::<Vec<_>>())
        };
        finer.chain(self.block.considered.iter().map(off)).collect()
    }
}
