//! Adequacy of each candidate on held-out motion, and its gain on unrecorded motion.

use crate::inference::adequacy::{Adequacy, adequacy, gain_elsewhere};
use crate::inference::admissibility::{gains, has_nuisance_beyond_prior};
use crate::inference::bootstrap::Pair;
use crate::inference::fit::Fitted;
use crate::inference::judge::{CLAMP, Candidate, JudgementContext, clamped};
use crate::inference::noise::Noise;
use crate::inference::parameter_deviations::ExperimentRows;
use nalgebra::DVector;

/// Best candidates whose held-out residuals are whitened by the noise under themselves too.
const OWN_NOISE: usize = 3;

impl JudgementContext<'_> {
    /// Computes the adequacy of each candidate against the clamped null hypothesis. A candidate with a nuisance
    /// parameter beyond the clamp is inadmissible unless it explains more of the held-out data than the null hypothesis
    /// with nuisance parameters as far from nominal: one of many may be that far by chance.
    pub(crate) fn add_adequacies(&self, null: &Fitted, clamped: &Fitted, ranking: &mut [Candidate]) {
        if self.test.is_empty() {
            return;
        }
        let base = &self.block.base;
        let fits = std::iter::once(clamped).chain(ranking.iter().map(|candidate| &candidate.fitted));
        let sets: Vec<Vec<f64>> = fits.map(|fitted| fitted.values(base)).collect();
        let residuals = self.test.whitened(&self.noise, &sets);
        let (without, with) = residuals.split_first().expect("the null hypothesis is first");
        let level = self.test.level(&self.noise, base);
        let (learnt, tested) = (self.motions().experiments(&self.noise), self.test.experiments(&self.noise));
        let together = self.together.as_ref().map(|together| together.whitened(&self.noise, &sets));
        for (place, candidate) in ranking.iter_mut().enumerate() {
            let with = &with[place];
            let own = if place < OWN_NOISE { self.by_own_noise(&sets[place + 1]) } else { None };
            let own = own.unwrap_or_else(|| mean_square(with) / level.power);
            let carried = [candidate.fitted.carried, clamped.carried];
            let own_learnt = [&candidate.fitted.residual, &clamped.residual];
            let learnt = each_of(&learnt, together.as_ref().map_or(own_learnt, |all| [&all[place + 1], &all[0]]));
            let motions: Vec<Pair<'_>> = learnt.chain(each_of(&tested, [with, without])).collect();
            let gain_elsewhere = gain_elsewhere(&motions, carried);
            let found = adequacy(with.as_slice(), own, without.as_slice(), carried, level);
            candidate.admissible = candidate.admissible && self.explains_more_than_nuisances(candidate, null, with);
            candidate.adequacy = Some(Adequacy { gain_elsewhere, ..found });
            candidate.held_out = with.clone();
        }
    }

    /// Returns whether a candidate with a nuisance parameter beyond its prior explains more of the held-out data, with
    /// residual `with`, than the null hypothesis with nuisance parameters as far from nominal, or unlimited.
    fn explains_more_than_nuisances(&self, candidate: &Candidate, null: &Fitted, with: &DVector<f64>) -> bool {
        let z = candidate.greatest_nuisance_deviation().map_or(0.0, |(_, z)| z.abs());
        if z <= CLAMP {
            return true;
        }
        let reach = if has_nuisance_beyond_prior(&candidate.fitted) { f64::INFINITY } else { z };
        let shifted = clamped(self.block, null, reach, &|sets| self.simulated(sets));
        let without = self.test.whitened(&self.noise, &[shifted.values(&self.block.base)]).remove(0);
        gains(mean_square(&without), mean_square(with))
    }

    /// Mean square of the held-out residuals under these parameters in units of the noise that repeats have under them;
    /// `None` without repeats.
    fn by_own_noise(&self, set: &[f64]) -> Option<f64> {
        let mut deviations = self.motions().deviations(set);
        deviations.extend(self.test.deviations(set));
        let noise = Noise::above(&deviations, &self.block.floor)?;
        let residual = self.test.whitened(&noise, &[set.to_vec()]).remove(0);
        Some(mean_square(&residual) / self.test.level(&noise, set).power)
    }
}

fn mean_square(w: &DVector<f64>) -> f64 {
    w.norm_squared() / w.len() as f64
}

/// Residuals with and without a hypothesis, motion by motion.
fn each_of<'r>(motions: &'r [ExperimentRows], both: [&'r DVector<f64>; 2]) -> impl Iterator<Item = Pair<'r>> {
    motions.iter().map(move |motion| both.map(|all| &all.as_slice()[motion.rows.clone()]))
}
