//! Fits many hypotheses at once: Levenberg-Marquardt in lockstep, every simulation of a round in one batch.

use super::unknown::{Role, Unknown, applied};
use nalgebra::{DMatrix, DVector};

/// Trial damping factors of a round, times the last good one.
const DAMPINGS: [f64; 4] = [0.2, 1.0, 6.0, 36.0];
/// Most rounds.
const ROUNDS: usize = 25;
/// A fit ends when a round gains less than this, or less than this share of what is left beyond noise.
const GAIN: f64 = 0.02;
const SHARE: f64 = 2e-4;
/// Damping at which a step that gains nothing ends a fit.
const STUCK: f64 = 1.0;
/// Rounds after which a start must not trail the best of its hypothesis by more than [`TRAIL`].
const PATIENCE: usize = 4;
const TRAIL: f64 = 0.02;
/// A fit this far behind the best of all, in chi-squared, ends when a round brings it nearer by less than this share.
pub(crate) const HOPELESS: f64 = 60.0;
const SLOW: f64 = 0.05;

/// Whitened residuals of parameter sets, one vector a set: what the data have left over, in standard deviations.
pub type Simulate<'a> = dyn Fn(&[Vec<f64>]) -> Vec<DVector<f64>> + 'a;

/// A hypothesis and where its fit starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Number of the hypothesis: starts of one compete.
    pub hypothesis: usize,
    /// Its free numbers, nuisances first.
    pub unknowns: Vec<Unknown>,
    /// First `z` of each.
    pub z: Vec<f64>,
}

impl Start {
    /// Of the only hypothesis, every number where its prior has it.
    pub fn nominal(unknowns: Vec<Unknown>) -> Self {
        Self { hypothesis: 0, z: vec![0.0; unknowns.len()], unknowns }
    }

    /// Where a fit ended.
    pub fn at(fitted: &Fitted) -> Self {
        let Fitted { hypothesis, unknowns, z, .. } = fitted;
        Self { hypothesis: *hypothesis, unknowns: unknowns.clone(), z: z.clone() }
    }
}

/// A fitted hypothesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Number of the hypothesis.
    pub hypothesis: usize,
    /// Its free numbers.
    pub unknowns: Vec<Unknown>,
    /// Their places.
    pub z: Vec<f64>,
    /// Whitened residuals there.
    pub residual: DVector<f64>,
    /// Their derivatives by `z`, one column each.
    pub jacobian: DMatrix<f64>,
    /// Power of the noise that the simulation carries into the residuals under these parameters, beyond what it carries
    /// under the model's own, in units of the noise; 0 until it is looked at.
    pub carried: f64,
    /// What the noise of measured inputs does to it; none until that is taken off.
    pub input_noise: Option<InputNoise>,
    /// Whether sizes are what the data say: what is plausible of a size weighs its hypothesis, and would only shrink it
    /// once that is found.
    pub freed: bool,
}

/// Weight that is left of a freed size's prior.
const FREED: f64 = 1e-2;

/// What the noise of measured inputs does to a fit, by its `z`.
#[derive(Clone, Debug, PartialEq)]
pub struct InputNoise {
    /// What it adds to the gradient of half the sum of squares.
    pub pull: DVector<f64>,
    /// What it adds to the information `J'J`.
    pub information: DMatrix<f64>,
}

impl Fitted {
    /// Sum of squares of the whitened residuals, as if the simulation carried the same noise whatever the parameters.
    ///
    /// What was measured of an input has noise, which a simulation carries into the residuals, and most of all where a
    /// controller answers to the very noise that the output was read with. Parameters that make this noise smaller explain
    /// nothing: by as much as repeats scatter less, the sum of squares of their mean is smaller by itself.
    pub fn chi2(&self) -> f64 {
        self.residual.norm_squared() - self.carried * self.residual.len() as f64
    }

    /// Mean square of the whitened residuals; 1 if nothing but noise is left.
    pub fn mean_square(&self) -> f64 {
        self.chi2() / self.residual.len() as f64
    }

    /// Gradient of half the sum of squares, without what the noise of inputs pulls where that is known.
    pub fn gradient(&self) -> DVector<f64> {
        let mut gradient = self.jacobian.tr_mul(&self.residual);
        self.input_noise.iter().for_each(|noise| gradient -= &noise.pull);
        gradient
    }

    /// Information `J'J` of the data on the `z`, without what is noise of inputs where that is known.
    pub fn information(&self) -> DMatrix<f64> {
        let mut information = self.jacobian.tr_mul(&self.jacobian);
        self.input_noise.iter().for_each(|noise| information -= &noise.information);
        information
    }

    /// Precision of each `z` by what is plausible of it.
    pub fn plausible(&self) -> DVector<f64> {
        let of = |unknown: &Unknown| if self.freed && unknown.role == Role::Size { FREED } else { 1.0 };
        DVector::from_iterator(self.z.len(), self.unknowns.iter().map(of))
    }

    /// What the fit minimises: the sum of squares with the priors' share.
    pub fn cost(&self) -> f64 {
        self.chi2() + self.prior_slope().dot(&DVector::from_column_slice(&self.z))
    }

    /// Slope of half of the priors' share in what the fit minimises.
    pub fn prior_slope(&self) -> DVector<f64> {
        self.plausible().component_mul(&DVector::from_column_slice(&self.z))
    }

    /// Curvature of half of what the fit minimises, where residual variances exceed the noise's by a factor.
    pub fn curvature(&self, dispersion: f64) -> DMatrix<f64> {
        self.information() / dispersion + DMatrix::from_diagonal(&self.plausible())
    }

    /// The same numbers with sizes that are what the data say.
    #[must_use]
    pub fn with_freed_sizes(self) -> Self {
        Self { freed: true, ..self }
    }

    /// Place of the free number that a field of the block's parameters is.
    pub fn place(&self, field: usize) -> Option<usize> {
        self.unknowns.iter().position(|unknown| unknown.field == field)
    }

    /// The nuisances: place, what it is, and by how many tolerances it is off.
    pub fn nuisances(&self) -> impl Iterator<Item = (usize, &Unknown, f64)> {
        let all = self.unknowns.iter().zip(&self.z).enumerate().map(|(place, (unknown, z))| (place, unknown, *z));
        all.filter(|(_, unknown, _)| unknown.role == Role::Nuisance)
    }

    /// The block's parameters at the fit.
    pub fn values(&self, base: &[f64]) -> Vec<f64> {
        applied(base, &self.unknowns, &self.z)
    }
}

/// A fit under way.
struct Climb {
    at: Fitted,
    damping: f64,
    /// What the last round gained.
    gained: f64,
    done: bool,
}

/// Fits all starts by difference quotients over such a share of a standard deviation; the best of each hypothesis comes
/// back, in the order of their numbers.
pub fn fit(starts: Vec<Start>, base: &[f64], quotient: f64, simulate: &Simulate) -> Vec<Fitted> {
    let mut climbs = begun(starts, base, simulate);
    for round in 0..ROUNDS {
        if climbs.iter().all(|climb| climb.done) {
            break;
        }
        differentiate(&mut climbs, base, quotient, simulate);
        step(&mut climbs, base, simulate);
        if round + 1 >= PATIENCE {
            drop_trailing(&mut climbs);
            give_up_hopeless(&mut climbs);
        }
    }
    best_of_each(climbs)
}

fn begun(starts: Vec<Start>, base: &[f64], simulate: &Simulate) -> Vec<Climb> {
    let sets: Vec<_> = starts.iter().map(|start| applied(base, &start.unknowns, &start.z)).collect();
    let residuals = simulate(&sets);
    let climb = |(start, residual): (Start, DVector<f64>)| {
        let Start { hypothesis, unknowns, z } = start;
        let jacobian = DMatrix::zeros(0, 0);
        let at = Fitted { hypothesis, unknowns, z, residual, jacobian, carried: 0.0, input_noise: None, freed: false };
        Climb { at, damping: 1e-3, gained: 0.0, done: false }
    };
    starts.into_iter().zip(residuals).map(climb).collect()
}

/// Jacobians of all fits under way, by forward differences in one batch.
fn differentiate(climbs: &mut [Climb], base: &[f64], quotient: f64, simulate: &Simulate) {
    let mut sets = Vec::new();
    for climb in climbs.iter().filter(|climb| !climb.done) {
        for column in 0..climb.at.z.len() {
            let mut z = climb.at.z.clone();
            z[column] += quotient;
            sets.push(applied(base, &climb.at.unknowns, &z));
        }
    }
    let mut moved = simulate(&sets).into_iter();
    for climb in climbs.iter_mut().filter(|climb| !climb.done) {
        let columns: Vec<DVector<f64>> = (0..climb.at.z.len())
            .map(|_| (moved.next().expect("one residual a set") - &climb.at.residual) / quotient)
            .collect();
        climb.at.jacobian = match columns.is_empty() {
            true => DMatrix::zeros(climb.at.residual.len(), 0),
            false => DMatrix::from_columns(&columns),
        };
    }
}

/// One damped step of every fit, the best of several dampings.
fn step(climbs: &mut [Climb], base: &[f64], simulate: &Simulate) {
    let trials: Vec<Vec<Vec<f64>>> =
        climbs.iter().map(|climb| if climb.done { Vec::new() } else { trials(climb) }).collect();
    let set = |(climb, z): (&Climb, &Vec<f64>)| applied(base, &climb.at.unknowns, z);
    let sets: Vec<_> =
        climbs.iter().zip(&trials).flat_map(|(climb, list)| list.iter().map(move |z| set((climb, z)))).collect();
    let mut residuals = simulate(&sets).into_iter();
    for (climb, list) in climbs.iter_mut().zip(trials) {
        let before = climb.at.cost();
        let (mut gained, mut factor) = (0.0, DAMPINGS[3]);
        for (z, damping) in list.into_iter().zip(DAMPINGS) {
            let residual = residuals.next().expect("one residual a set");
            let cost = residual.norm_squared() + z.iter().map(|z| z * z).sum::<f64>();
            if cost < before - gained {
                (gained, factor) = (before - cost, damping);
                (climb.at.z, climb.at.residual) = (z, residual);
            }
        }
        // A step that gains nothing is tried once more, much shorter.
        let enough = f64::max(GAIN, SHARE * (before - climb.at.residual.len() as f64));
        climb.done |= gained < enough && (gained > 0.0 || climb.damping > STUCK);
        climb.damping = (climb.damping * factor).max(1e-9);
        climb.gained = gained;
    }
}

/// Where the next step would lead for each damping.
fn trials(climb: &Climb) -> Vec<Vec<f64>> {
    let at = &climb.at;
    let size = at.z.len();
    let (normal, gradient) = (at.curvature(1.0), at.gradient() + at.prior_slope());
    let trial = |factor: f64| {
        let damped = &normal + DMatrix::from_diagonal(&(normal.diagonal() * (climb.damping * factor)));
        let step = damped.cholesky().map_or_else(|| DVector::zeros(size), |cholesky| cholesky.solve(&gradient));
        let moved = |(i, unknown): (usize, &Unknown)| {
            let reach = if unknown.role == Role::Size { f64::INFINITY } else { 1.0 };
            unknown.prior.allowed(at.z[i] - step[i].clamp(-reach, reach))
        };
        at.unknowns.iter().enumerate().map(moved).collect()
    };
    DAMPINGS.map(trial).into()
}

/// Gives up the starts that trail far behind the best of their hypothesis.
fn drop_trailing(climbs: &mut Vec<Climb>) {
    let best = |climbs: &[Climb], hypothesis: usize| {
        let own = climbs.iter().filter(|climb| climb.at.hypothesis == hypothesis);
        own.map(|climb| climb.at.cost()).fold(f64::INFINITY, f64::min)
    };
    let keep: Vec<bool> =
        climbs.iter().map(|c| c.at.cost() <= (1.0 + TRAIL) * best(climbs, c.at.hypothesis) + 1.0).collect();
    let mut keep = keep.into_iter();
    climbs.retain(|_| keep.next().expect("one answer a fit"));
}

/// Ends the fits that lie far behind the best of all and come no nearer: whatever they reach, they are ruled out.
fn give_up_hopeless(climbs: &mut [Climb]) {
    let best = climbs.iter().map(|climb| climb.at.cost()).fold(f64::INFINITY, f64::min);
    for climb in climbs.iter_mut() {
        let behind = climb.at.cost() - best;
        climb.done |= behind > HOPELESS && climb.gained < SLOW * behind;
    }
}

/// The best of each hypothesis.
fn best_of_each(mut climbs: Vec<Climb>) -> Vec<Fitted> {
    climbs.sort_by(|a, b| (a.at.hypothesis.cmp(&b.at.hypothesis)).then(a.at.cost().total_cmp(&b.at.cost())));
    climbs.dedup_by_key(|climb| climb.at.hypothesis);
    climbs.into_iter().map(|climb| climb.at).collect()
}

#[cfg(test)]
mod tests {
    use super::super::unknown::Prior;
    use super::*;

    fn unknown(field: usize, prior: Prior, role: Role) -> Unknown {
        Unknown { name: format!("p{field}"), field, unit: "1", prior, role }
    }

    /// `a sin(w t)` sampled, less what the parameters say, over a noise of 0.01.
    fn wave(truth: [f64; 2]) -> impl Fn(&[Vec<f64>]) -> Vec<DVector<f64>> {
        move |sets| {
            let at = |p: &[f64], t: f64| p[0] * (p[1] * t).sin();
            let one = |p: &Vec<f64>| {
                DVector::from_fn(200, |i, _| (at(&truth, i as f64 * 0.01) - at(p, i as f64 * 0.01)) / 0.01)
            };
            sets.iter().map(one).collect()
        }
    }

    #[test]
    fn size_and_form_are_found_together_and_the_worse_start_is_dropped() {
        let unknowns = vec![
            unknown(0, Prior::Positive { scale: 1.0 }, Role::Size),
            unknown(1, Prior::LogNormal { centre: 4.0, spread: 0.5 }, Role::Form),
        ];
        let start = |z: [f64; 2]| Start { hypothesis: 3, unknowns: unknowns.clone(), z: z.into() };
        let found = fit(vec![start([0.1, 0.0]), start([0.1, 1.8])], &[0.0, 1.0], 2e-3, &wave([0.7, 5.0]));
        assert_eq!((found.len(), found[0].hypothesis), (1, 3));
        let values = found[0].values(&[0.0, 1.0]);
        assert!((values[0] - 0.7).abs() < 1e-3 && (values[1] - 5.0).abs() < 1e-3, "{values:?}");
        assert_eq!(found[0].jacobian.shape(), (200, 2));
    }

    #[test]
    fn a_size_that_would_be_negative_stays_at_nothing() {
        let unknowns = vec![unknown(0, Prior::Positive { scale: 1.0 }, Role::Size)];
        let start = Start { hypothesis: 0, unknowns, z: vec![0.5] };
        let found = fit(vec![start], &[0.0, 5.0], 2e-3, &wave([-0.3, 5.0]));
        assert_eq!(found[0].z, [0.0]);
    }
}
