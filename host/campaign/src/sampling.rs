//! Draws: the parameters of one run, a pure function of campaign, seed and run number.

use crate::campaign::{Campaign, Method};
use crate::derived::with_derived;
use crate::dispersion::Class;
use crate::distribution::{normal_quantile, normal_share};
use crate::problem::Problems;
use softdock_kernels::fields::to_vec;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use softdock_kernels::philox::{key, philox4x32, stream, uniform};

/// The inputs of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Outer draw that the run belongs to; 0 without an outer loop.
    pub outer: u32,
    /// Its parameters.
    pub params: Params<f64>,
    /// What it has of the scenario for itself; none if the campaign disperses no key of the scenario.
    pub own: Option<OwnScenario>,
}

/// A scenario with the values of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnScenario {
    /// Values of the campaign's [`keys`](Campaign::keys), SI.
    pub keys: Vec<f64>,
    /// The task and the facility with them.
    pub model: Model,
}

impl Draw {
    /// Values of the parameters and, behind them, of the campaign's keys, SI: the inputs of a run as its row has them.
    pub fn inputs(&self) -> Vec<f64> {
        let keys = self.own.iter().flat_map(|own| &own.keys);
        to_vec(&self.params).into_iter().chain(keys.copied()).collect()
    }
}

/// Rounds of the permutation: four make a Feistel network as good as random (Luby and Rackoff).
const ROUNDS: u32 = 4;

impl Campaign {
    /// The outer draw of a run: contiguous blocks of the runs.
    pub fn outer_of(&self, run: u64) -> u32 {
        let draws = u128::from(self.outer_draws.unwrap_or(1));
        let block = u128::from(run) * draws / u128::from(self.runs.max(1));
        block.min(draws - 1) as u32
    }

    /// Why the draws of its first runs would change with the number of runs; `None` if they stay as they are.
    ///
    /// Random draws and points of a Sobol' sequence depend on seed and run number alone.
    pub fn draws_depend_on_runs(&self) -> Option<String> {
        let outer = self.outer_draws.filter(|draws| *draws > 1);
        match (&self.cases, outer, self.method) {
            (Some(_), _, _) => Some("its runs are the rows of a table of cases".to_owned()),
            (_, Some(draws), _) => Some(format!("its {draws} outer draws share out the runs by their number")),
            (_, _, Method::LatinHypercube) => {
                Some("the strata of a Latin hypercube sample depend on the number of runs".to_owned())
            }
            _ => None,
        }
    }

    /// The inputs of a run.
    ///
    /// # Errors
    /// If the scenario's reader refuses the values of its keys; never without dispersed keys.
    pub fn draw(&self, run: u64) -> Result<Draw, Problems> {
        if let Some((cases, _)) = &self.cases {
            return Ok(Draw { outer: 0, params: self.given(cases, run), own: None });
        }
        let outer = self.outer_of(run);
        let mut shares: Vec<f64> = (0..self.dispersions.len()).map(|index| self.share(index, run, outer)).collect();
        for group in &self.correlations {
            let normal: Vec<f64> = group.members.iter().map(|member| normal_quantile(shares[*member])).collect();
            for (member, row) in group.members.iter().zip(&group.factor) {
                let mixed: f64 = row.iter().zip(&normal).map(|(weight, z)| weight * z).sum();
                // The ends 0 and 1 would be infinitely far out.
                shares[*member] = normal_share(mixed).clamp(f64::EPSILON / 4.0, 1.0 - f64::EPSILON / 2.0);
            }
        }
        let mut values = self.undispersed();
        self.put_draws(&shares, &mut values);
        let own = self.own_scenario(&values).map_err(|problems| problems.before(&format!("run {run}: ")))?;
        let nominal = own.as_ref().map_or(&self.scenario.model, |own| &own.model).nominal;
        let nominal = to_vec(&nominal);
        if own.is_some() {
            values[..nominal.len()].copy_from_slice(&nominal);
            self.put_draws(&shares, &mut values);
        }
        let posterior = self.outer_draws.map(|_| (self.seed, outer));
        self.scenario.identified.iter().for_each(|effect| effect.put(&nominal, posterior, &mut values));
        Ok(Draw { outer, params: with_derived(values, &self.derived), own })
    }

    fn put_draws(&self, shares: &[f64], values: &mut [f64]) {
        for (dispersion, share) in self.dispersions.iter().zip(shares) {
            values[dispersion.field] = dispersion.distribution.quantile(*share);
        }
    }

    /// The scenario with the keys' values among those of all fields; none without dispersed keys.
    fn own_scenario(&self, values: &[f64]) -> Result<Option<OwnScenario>, Problems> {
        let behind = &values[values.len() - self.extras.len()..];
        let keys = self.extras.iter().zip(behind).filter(|(extra, _)| extra.key().is_some());
        let keys: Vec<f64> = keys.map(|(_, value)| *value).collect();
        if keys.is_empty() { Ok(None) } else { self.with_keys(keys).map(Some) }
    }

    /// The scenario with values of the campaign's [`keys`](Self::keys), SI.
    ///
    /// # Errors
    /// Whatever the scenario's reader refuses.
    pub fn with_keys(&self, keys: Vec<f64>) -> Result<OwnScenario, Problems> {
        let values: Vec<_> = self.keys().zip(keys.iter().copied()).collect();
        let mut model = self.scenario.with_keys(&values)?.model;
        // The campaign may be stepped finer than its scenario says.
        model.timing = self.scenario.model.timing;
        model.facility.sensor_substeps = self.scenario.model.facility.sensor_substeps;
        Ok(OwnScenario { keys, model })
    }

    /// The undispersed run: the scenario's values and what is derived from them.
    pub fn nominal(&self) -> Params<f64> {
        with_derived(self.undispersed(), &self.derived)
    }

    /// The scenario's values and, behind them, the medians of the campaign's variables and its keys as written.
    pub(crate) fn undispersed(&self) -> Vec<f64> {
        let mut values = to_vec(&self.scenario.model.nominal);
        let parameters = values.len();
        values.resize(parameters + self.extras.len(), 0.0);
        for extra in self.dispersions.iter().filter(|dispersion| dispersion.field >= parameters) {
            let nominal = self.key_of(extra.field).map(|key| key.nominal);
            values[extra.field] = nominal.unwrap_or_else(|| extra.distribution.quantile(0.5));
        }
        values
    }

    /// The uniform number behind a dispersion: one per draw, from the stream of its name.
    fn share(&self, place: usize, run: u64, outer: u32) -> f64 {
        let dispersion = &self.dispersions[place];
        let name = dispersion.name.as_str();
        let (index, count, free) = match dispersion.class {
            Class::Aleatory => (run, self.runs, uniform(self.seed, name, run, 0)),
            // Counter 0 belongs to the runs; outer draws follow it.
            Class::Epistemic => {
                let draws = u64::from(self.outer_draws.unwrap_or(1));
                (u64::from(outer), draws, uniform(self.seed, name, 0, 1 + outer))
            }
        };
        match self.method {
            Method::Random => free,
            Method::LatinHypercube => (permuted(self.seed, name, index % count, count) as f64 + free) / count as f64,
            // Dimensions in the order of the file: the first of a Sobol' sequence fill the space best.
            Method::Sobol => sobol(self.seed, index, place),
        }
    }
}

/// A coordinate of a point of a Sobol' sequence, 0 < u < 1; scrambled after Owen by the seed.
fn sobol(seed: u64, index: u64, dimension: usize) -> f64 {
    // Counter u32::MAX - ROUNDS: behind those of the permutations.
    let scramble = philox4x32([0, 0, stream("sobol"), u32::MAX - ROUNDS], key(seed))[0];
    // The crate gives 23 bits: the middle of their cell, since 0 would be infinitely far out.
    f64::from(sobol_burley::sample(index as u32, dimension as u32, scramble)) + 0.5 / f64::from(1_u32 << 23)
}

/// Place of `index` in a random permutation of `0..count`: a Feistel network, repeated until it stays inside.
fn permuted(seed: u64, name: &str, index: u64, count: u64) -> u64 {
    let half = (u64::BITS - (count - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let mut at = index;
    loop {
        let (mut left, mut right) = (at >> half, at & mask);
        for round in 0..ROUNDS {
            // Index u32::MAX - round: far from the counters of the draws themselves.
            let word = philox4x32([right as u32, (right >> 32) as u32, stream(name), u32::MAX - round], key(seed))[0];
            (left, right) = (right, left ^ (u64::from(word) & mask));
        }
        at = left << half | right;
        if at < count {
            return at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::fields::fields;

    #[test]
    fn permutations_are_permutations() {
        for count in [1, 2, 3, 7, 64, 1000, 1025] {
            let mut places: Vec<u64> = (0..count).map(|index| permuted(5, "loop_delay", index, count)).collect();
            if count == 1000 {
                assert_ne!(places[..5], [0, 1, 2, 3, 4], "shuffled");
            }
            places.sort_unstable();
            assert!(places.iter().enumerate().all(|(index, place)| *place == index as u64), "{count}");
        }
    }

    #[test]
    fn every_parameter_has_a_stream_of_its_own() {
        let names = fields::<f64, Params<f64>>();
        let mut streams: Vec<u32> = names.iter().map(|field| stream(&field.name)).collect();
        streams.sort_unstable();
        assert!(streams.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
