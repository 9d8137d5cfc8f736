//! Levenberg-Marquardt fits of many hypotheses in lockstep, with all simulations of a round in one batch.
//!
//! Simulations for derivatives are most of the cost. They are kept from where they were last simulated until a step gains
//! less than they promise, and simulated once more where the fit ends.

mod climb;
mod probe;

use crate::model::unknown::{Role, Unknown, applied};
use climb::Climb;
use nalgebra::{DMatrix, DVector};
use probe::probe;
use rayon::prelude::*;
use std::borrow::Borrow;

/// Most rounds.
const ROUNDS: usize = 25;
/// Number of searches beside the end points of fits.
const PROBES: usize = 3;
/// Shares of its cost by which a start may trail the best of its hypothesis after so many rounds.
const TRAILS: [(usize, f64); 2] = [(2, 0.1), (4, 0.02)];
/// A fit this far behind the best of all, in chi-squared, ends when a round brings it nearer by less than this share.
pub(crate) const HOPELESS: f64 = 60.0;
const SLOW: f64 = 0.05;
/// Share of what it trails by which a round must bring a start nearer that trails too far.
const FAST: f64 = 0.5;

/// Function that returns the whitened residuals of parameter sets, one vector per set, in standard deviations.
pub type Simulate<'a> = dyn Fn(&[Vec<f64>]) -> Vec<DVector<f64>> + 'a;

/// Start of a fit of a hypothesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Number of the hypothesis; starts of the same hypothesis compete.
    pub hypothesis: usize,
    /// Free parameters, nuisance parameters first.
    pub unknowns: Vec<Unknown>,
    /// Initial `z` of each.
    pub z: Vec<f64>,
    /// Derivatives of the residuals with respect to each `z`, where known from another fit.
    pub slopes: Vec<Option<DVector<f64>>>,
}

impl Start {
    /// Builds a start without known derivatives.
    pub fn new(hypothesis: usize, unknowns: Vec<Unknown>, z: Vec<f64>) -> Self {
        Self { hypothesis, slopes: vec![None; unknowns.len()], unknowns, z }
    }

    /// Builds the start of the only hypothesis, with every parameter at its prior value.
    pub fn nominal(unknowns: Vec<Unknown>) -> Self {
        let z = vec![0.0; unknowns.len()];
        Self::new(0, unknowns, z)
    }

    /// Builds a start at the end of a fit.
    pub fn at(fitted: &Fitted) -> Self {
        Self::new(fitted.hypothesis, fitted.unknowns.clone(), fitted.z.clone()).beside(fitted)
    }

    /// Adds the derivatives of another fit for the common parameters.
    #[must_use]
    pub fn beside(self, fitted: &Fitted) -> Self {
        let slope = |unknown: &Unknown| {
            let place = fitted.place(unknown.field).filter(|place| fitted.unknowns[*place].prior == unknown.prior);
            place.filter(|place| *place < fitted.jacobian.ncols()).map(|place| fitted.jacobian.column(place).into())
        };
        Self { slopes: self.unknowns.iter().map(slope).collect(), ..self }
    }
}

/// Fitted hypothesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Number of the hypothesis.
    pub hypothesis: usize,
    /// Free parameters.
    pub unknowns: Vec<Unknown>,
    /// Standardised values.
    pub z: Vec<f64>,
    /// Whitened residuals at these values.
    pub residual: DVector<f64>,
    /// Derivatives of the residuals with respect to `z`, one column each.
    pub jacobian: DMatrix<f64>,
    /// Power of the input noise that the simulation propagates into the residuals, relative to that of the nominal
    /// parameters, in units of the noise; 0 until computed.
    pub carried: f64,
    /// Effect of the noise of measured inputs; `None` before bias compensation.
    pub input_noise: Option<InputNoise>,
    /// Whether the priors of sizes are removed: they weight the hypothesis, and would bias the size after detection.
    pub freed: bool,
}

/// Weight that is left of a freed size's prior.
const FREED: f64 = 1e-2;

/// Effect of the noise of measured inputs on a fit, with respect to `z`.
#[derive(Clone, Debug, PartialEq)]
pub struct InputNoise {
    /// Contribution to the gradient of half the sum of squares.
    pub gradient: DVector<f64>,
    /// Contribution to the information `J'J`.
    pub information: DMatrix<f64>,
}

impl Fitted {
    /// Returns the sum of squares of the whitened residuals, compensated for the propagated input noise.
    ///
    /// A simulation propagates the noise of measured inputs into the residuals, in particular where a controller
    /// responds to the noise of the output. Parameters that reduce this noise explain nothing: the sum of squares of
    /// the mean decreases by as much as the repeats scatter less.
    pub fn chi2(&self) -> f64 {
        self.residual.norm_squared() - self.carried * self.residual.len() as f64
    }

    /// Returns the mean square of the whitened residuals; noise alone gives 1.
    pub fn mean_square(&self) -> f64 {
        self.chi2() / self.residual.len() as f64
    }

    /// Returns the gradient of half the sum of squares, compensated for input noise where known.
    pub fn gradient(&self) -> DVector<f64> {
        let mut gradient = self.jacobian.tr_mul(&self.residual);
        self.input_noise.iter().for_each(|noise| gradient -= &noise.gradient);
        gradient
    }

    /// Returns the information `J'J` of the data on `z`, compensated for input noise where known.
    pub fn information(&self) -> DMatrix<f64> {
        let mut information = self.jacobian.transpose() * &self.jacobian;
        self.input_noise.iter().for_each(|noise| information -= &noise.information);
        information
    }

    /// Returns the prior precision of each `z`.
    pub fn plausible(&self) -> DVector<f64> {
        let of = |unknown: &Unknown| if self.freed && unknown.role == Role::Size { FREED } else { 1.0 };
        DVector::from_iterator(self.z.len(), self.unknowns.iter().map(of))
    }

    /// Returns the cost: sum of squares plus prior terms.
    pub fn cost(&self) -> f64 {
        self.chi2() + self.prior_slope().dot(&DVector::from_column_slice(&self.z))
    }

    /// Returns the gradient of half the prior terms.
    pub fn prior_slope(&self) -> DVector<f64> {
        self.plausible().component_mul(&DVector::from_column_slice(&self.z))
    }

    /// Returns the Hessian of half the cost, for residual variances that exceed the noise by a factor.
    pub fn curvature(&self, dispersion: f64) -> DMatrix<f64> {
        self.information() / dispersion + DMatrix::from_diagonal(&self.plausible())
    }

    /// Returns the fit with the priors of sizes removed.
    #[must_use]
    pub fn with_freed_sizes(self) -> Self {
        Self { freed: true, ..self }
    }

    /// Returns the index of the free parameter of a field.
    pub fn place(&self, field: usize) -> Option<usize> {
        self.unknowns.iter().position(|unknown| unknown.field == field)
    }

    /// Returns the value of a free parameter; `None` if the fit does not have it.
    pub fn value(&self, field: usize) -> Option<f64> {
        self.place(field).map(|place| self.unknowns[place].prior.value(self.z[place]))
    }

    /// Returns the nuisance parameters: index, parameter and z-score.
    pub fn nuisances(&self) -> impl Iterator<Item = (usize, &Unknown, f64)> {
        let all = self.unknowns.iter().zip(&self.z).enumerate().map(|(place, (unknown, z))| (place, unknown, *z));
        all.filter(|(_, unknown, _)| unknown.role == Role::Nuisance)
    }

    /// Returns the block's parameters at the fit.
    pub fn values(&self, base: &[f64]) -> Vec<f64> {
        applied(base, &self.unknowns, &self.z)
    }
}

/// Fits all starts and returns the best fit of each hypothesis, in the order of their numbers. `quotient` is the step
/// of difference quotients, as a share of a standard deviation.
pub fn fit(starts: Vec<Start>, base: &[f64], quotient: f64, simulate: &Simulate) -> Vec<Fitted> {
    let mut climbs = begun(starts, base, quotient, simulate);
    climb(&mut climbs, base, simulate);
    for _ in 0..PROBES {
        if !probe(&mut climbs, base, simulate) {
            break;
        }
        climb(&mut climbs, base, simulate);
    }
    best_of_each(climbs)
}

/// Rounds until every fit is done.
fn climb(climbs: &mut Vec<Climb>, base: &[f64], simulate: &Simulate) {
    for round in 0..ROUNDS {
        if climbs.iter().all(|climb| climb.done) {
            break;
        }
        step(climbs, base, simulate);
        if let Some((_, trail)) = TRAILS.iter().rfind(|(rounds, _)| *rounds <= round + 1) {
            drop_trailing(climbs, *trail);
            give_up_hopeless(climbs);
        }
    }
}

fn begun(starts: Vec<Start>, base: &[f64], quotient: f64, simulate: &Simulate) -> Vec<Climb> {
    let sets: Vec<_> = starts.iter().map(|start| applied(base, &start.unknowns, &start.z)).collect();
    let residuals = simulate(&sets);
    let both = starts.into_par_iter().zip(residuals);
    both.map(|(start, residual)| Climb::begun(start, residual, quotient)).collect()
}

/// One damped step of every fit under way, the best of several dampings, by forward differences where they are due.
fn step(climbs: &mut [Climb], base: &[f64], simulate: &Simulate) {
    let mut under_way: Vec<&mut Climb> = climbs.iter_mut().filter(|climb| !climb.done).collect();
    let beside: Vec<_> = under_way.iter().map(|climb| climb.beside()).collect();
    let residuals = simulated(&under_way, &beside, base, simulate);
    under_way.par_iter_mut().zip(residuals).for_each(|(climb, own)| climb.differentiate(own));
    let trials: Vec<_> = under_way.par_iter().map(|climb| climb.trials()).collect();
    let residuals = simulated(&under_way, &trials, base, simulate);
    under_way.par_iter_mut().zip(trials).zip(residuals).for_each(|((climb, trials), own)| climb.moved(trials, own));
}

/// Residuals of each fit at places of its own, simulated in one batch.
fn simulated<C: Borrow<Climb>>(
    climbs: &[C],
    places: &[Vec<Vec<f64>>],
    base: &[f64],
    simulate: &Simulate,
) -> Vec<Vec<DVector<f64>>> {
    let of = |(climb, own): (&C, &Vec<Vec<f64>>)| -> Vec<Vec<f64>> {
        own.iter().map(|z| applied(base, &climb.borrow().at.unknowns, z)).collect()
    };
    let mut residuals = simulate(&climbs.iter().zip(places).flat_map(of).collect::<Vec<_>>()).into_iter();
    places.iter().map(|own| residuals.by_ref().take(own.len()).collect()).collect()
}

/// Gives up the starts that trail far behind the best of their hypothesis and do not come much nearer: one that another fit
/// ended at is ahead from the first.
fn drop_trailing(climbs: &mut Vec<Climb>, trail: f64) {
    let best = |climbs: &[Climb], hypothesis: usize| {
        let own = climbs.iter().filter(|climb| climb.at.hypothesis == hypothesis);
        own.map(|climb| climb.at.cost()).fold(f64::INFINITY, f64::min)
    };
    let keeps = |climb: &Climb| {
        let best = best(climbs, climb.at.hypothesis);
        climb.at.cost() <= (1.0 + trail) * best + 1.0 || climb.gained > FAST * (climb.at.cost() - best)
    };
    let keep: Vec<bool> = climbs.iter().map(keeps).collect();
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
    use super::climb::GAIN;
    use super::*;
    use crate::model::unknown::ParameterPrior;
    use std::cell::Cell;

    fn unknown(field: usize, prior: ParameterPrior, role: Role) -> Unknown {
        Unknown::new(format!("p{field}"), field, "1", prior, role)
    }

    /// `a sin(w t)` sampled, less its prediction by the parameters, over a noise of 0.01.
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
    fn size_and_form_are_fitted_together_and_the_worse_start_is_dropped() {
        let unknowns = vec![
            unknown(0, ParameterPrior::Positive { scale: 1.0 }, Role::Size),
            unknown(1, ParameterPrior::LogNormal { centre: 4.0, spread: 0.5 }, Role::Form),
        ];
        let start = |z: [f64; 2]| Start::new(3, unknowns.clone(), z.into());
        let found = fit(vec![start([0.1, 0.0]), start([0.1, 1.8])], &[0.0, 1.0], 2e-3, &wave([0.7, 5.0]));
        assert_eq!((found.len(), found[0].hypothesis), (1, 3));
        let values = found[0].values(&[0.0, 1.0]);
        assert!((values[0] - 0.7).abs() < 1e-3 && (values[1] - 5.0).abs() < 1e-3, "{values:?}");
        assert_eq!(found[0].jacobian.shape(), (200, 2));
    }

    #[test]
    fn negative_size_is_clamped_to_zero() {
        let unknowns = vec![unknown(0, ParameterPrior::Positive { scale: 1.0 }, Role::Size)];
        let start = Start::new(0, unknowns, vec![0.5]);
        let found = fit(vec![start], &[0.0, 5.0], 2e-3, &wave([-0.3, 5.0]));
        assert_eq!(found[0].z, [0.0]);
    }

    /// A straight line, `p0 + p1 x` sampled, less the truth, over a noise of 0.1; counts what is simulated.
    fn line(truth: [f64; 2], simulated: &Cell<usize>) -> impl Fn(&[Vec<f64>]) -> Vec<DVector<f64>> {
        move |sets| {
            simulated.set(simulated.get() + sets.len());
            let at = |p: &[f64], i: usize| p[0] + p[1] * (i as f64 * 0.01);
            let one = |p: &Vec<f64>| DVector::from_fn(100, |i, _| (at(&truth, i) - at(p, i)) / 0.1);
            sets.iter().map(one).collect()
        }
    }

    fn offset_and_slope() -> Vec<Unknown> {
        let prior = ParameterPrior::Normal { mean: 0.0, sd: 1.0 };
        vec![unknown(0, prior, Role::Nuisance), unknown(1, prior, Role::Size)]
    }

    #[test]
    fn valid_derivatives_are_not_recomputed() {
        let count = Cell::new(0);
        let simulate = line([0.5, 2.0], &count);
        let found = fit(vec![Start::nominal(offset_and_slope())], &[0.0, 0.0], 1e-3, &simulate).remove(0);
        let from_nothing = count.replace(0);
        let start = Start::new(0, found.unknowns.clone(), vec![0.0; 2]).beside(&found);
        let again = fit(vec![start], &[0.0, 0.0], 1e-3, &simulate).remove(0);
        assert!((again.cost() - found.cost()).abs() < GAIN, "{} and {}", again.cost(), found.cost());
        // Both at first, if unknown; after that none until all, once more, at the end.
        assert_eq!((from_nothing, count.get()), (1 + (2 + 4) + 4 + (2 + 4), 1 + 4 + 4 + (2 + 4)));
    }

    #[test]
    fn distant_nuisance_is_reached_with_growing_steps() {
        let count = Cell::new(0);
        let unknowns = vec![unknown(0, ParameterPrior::Normal { mean: 0.0, sd: 0.1 }, Role::Nuisance)];
        let found = fit(vec![Start::nominal(unknowns)], &[0.0, 0.0], 1e-3, &line([3.0, 0.0], &count)).remove(0);
        // The prior, one against a hundred samples of a tolerance each, holds it back a little.
        assert!((found.z[0] - 30.0 * 100.0 / 101.0).abs() < 1e-3, "{:?}", found.z);
        assert!(count.get() <= 1 + 8 * 4 + 3, "1 + 2 + 4 + 8 + 16 tolerances, and an end: {}", count.get());
    }

    #[test]
    fn discontinuous_residual_uses_a_longer_difference_quotient() {
        // Stairs of 0.03 in the parameter: no derivative over 0.001 sees them, but where it meets an edge.
        let simulate = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
            let stair = |p: f64| (p / 0.03).floor() * 0.03;
            sets.iter().map(|set| DVector::from_fn(50, |i, _| (1.0 - stair(set[0])) * (1.0 + 0.1 * i as f64))).collect()
        };
        let unknowns = vec![unknown(0, ParameterPrior::Normal { mean: 0.0, sd: 1.0 }, Role::Size)];
        let found = fit(vec![Start::new(0, unknowns, vec![0.2])], &[0.0], 1e-3, &simulate).remove(0);
        assert!((found.z[0] - 1.0).abs() < 0.1, "{:?}", found.z);
    }

    #[test]
    fn adjacent_narrow_minimum_is_found() {
        // Two minima 0.03 apart, 0.004 wide to either side; no derivative between them shows the deeper one.
        let valley = |p: f64, centre: f64, depth: f64| depth * (1.0 - (p - centre).abs() / 0.004).max(0.0);
        let simulate = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
            let left = |p: f64| 3.0 - valley(p, 0.5, 1.0) - valley(p, 0.53, 2.9);
            sets.iter().map(|set| DVector::from_element(100, left(set[0]))).collect()
        };
        let unknowns = vec![unknown(0, ParameterPrior::Normal { mean: 0.0, sd: 1.0 }, Role::Size)];
        let found = fit(vec![Start::new(0, unknowns, vec![0.5])], &[0.0], 1e-3, &simulate).remove(0);
        assert!((found.z[0] - 0.53).abs() < 1e-3, "{:?}", found.z);
    }
}
