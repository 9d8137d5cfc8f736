//! Starts of hypotheses from the fits of nested hypotheses.

use crate::inference::fit::{Fitted, HOPELESS, Start};
use crate::inference::judge::taken;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::{Role, Unknown};

/// Difference in chi-squared between two nested fits above which the worse restarts from the better: most of it is
/// explained by the further parameters.
const AHEAD: f64 = 10.0;

/// One start for every fit of a single hypothesis that ended above one which contains it: a gear with backlash whose gap
/// comes out as nothing is an elastic gear, and has found a valley that the elastic gear's own starts missed.
pub(super) fn starts(library: &[Hypothesis], singles: &[Fitted]) -> Vec<Start> {
    let contains = |outer: &Fitted, inner: &Fitted| {
        outer.hypothesis != inner.hypothesis && library[outer.hypothesis].has_all_of(&library[inner.hypothesis])
    };
    let again = |inner: &Fitted| {
        let ahead = singles.iter().filter(|outer| outer.cost() < inner.cost() - AHEAD && contains(outer, inner));
        let best = ahead.min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
        // It has all nuisances, too.
        Some(Start::new(inner.hypothesis, inner.unknowns.clone(), taken(&inner.unknowns, best)))
    };
    singles.iter().filter_map(again).collect()
}

/// One start for every fit of a single hypothesis that ended far above the null hypothesis, which each contains: the one
/// repeat by which fits are led may have a valley of its own. Its size is nothing, and it looks as it did.
pub(super) fn astray(singles: &[Fitted], null: &Fitted) -> Vec<Start> {
    let far = null.cost() + HOPELESS * null.mean_square().max(1.0);
    let place = |(unknown, z): (&Unknown, &f64)| match null.value(unknown.field) {
        Some(value) => unknown.prior.allowed(unknown.prior.place(value)),
        None if unknown.role == Role::Form => *z,
        None => 0.0,
    };
    let again = |single: &Fitted| {
        let z = single.unknowns.iter().zip(&single.z).map(place).collect();
        Start::new(single.hypothesis, single.unknowns.clone(), z).beside(null)
    };
    singles.iter().filter(|single| single.cost() > far).map(again).collect()
}

/// The better of two fits of every hypothesis; `again` has some of them.
pub(super) fn better(mut singles: Vec<Fitted>, again: Vec<Fitted>) -> Vec<Fitted> {
    for fitted in again {
        let own = singles.iter_mut().find(|single| single.hypothesis == fitted.hypothesis);
        if let Some(own) = own.filter(|own| fitted.cost() < own.cost()) {
            *own = fitted;
        }
    }
    singles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::unknown::ParameterPrior;
    use nalgebra::{DMatrix, DVector};
    use softdock_kernels::effects::DICTIONARY;

    fn unknown(field: usize, spread: f64) -> Unknown {
        let prior = ParameterPrior::LogNormal { centre: 1.0, spread };
        Unknown::new(format!("p{field}"), field, "1", prior, Role::Size)
    }

    fn hypothesis(unknowns: Vec<Unknown>) -> Hypothesis {
        let (forms, sizes) = (vec![vec![1.0; unknowns.len()]], vec![0]);
        Hypothesis { effect: &DICTIONARY, name: "a form", unknowns, forms, sizes, shaped: true, calibration: false }
    }

    /// Returns a fit of a hypothesis with all parameters at `z` and a given residual.
    fn fitted(library: &[Hypothesis], hypothesis: usize, z: f64, left: f64) -> Fitted {
        let unknowns = library[hypothesis].unknowns.clone();
        let (z, residual) = (vec![z; unknowns.len()], DVector::from_element(1, left.sqrt()));
        let jacobian = DMatrix::zeros(1, 0);
        Fitted { hypothesis, unknowns, z, residual, jacobian, carried: 0.0, input_noise: None, freed: false }
    }

    #[test]
    fn hypothesis_restarts_from_a_better_nested_fit() {
        let library = [hypothesis(vec![unknown(3, 1.0)]), hypothesis(vec![unknown(2, 1.0), unknown(3, 0.5)])];
        let behind = [fitted(&library, 0, 0.1, 500.0), fitted(&library, 1, 2.0, 100.0)];
        let again = starts(&library, &behind);
        // Two spreads of a half are one of a whole; what the outer one lacks is not started.
        assert_eq!((again.len(), again[0].hypothesis, &again[0].z), (1, 0, &vec![1.0]));
        let ahead = [fitted(&library, 0, 0.1, 100.0), fitted(&library, 1, 2.0, 500.0)];
        assert!(starts(&library, &ahead).is_empty());
    }

    #[test]
    fn fit_worse_than_the_null_restarts_from_it() {
        let of = |field, role| Unknown { role, ..unknown(field, 1.0) };
        let unknowns = vec![of(3, Role::Nuisance), of(2, Role::Size), of(4, Role::Form)];
        let library = [hypothesis(vec![of(3, Role::Nuisance)]), hypothesis(unknowns)];
        let null = fitted(&library, 0, 0.0, 0.5);
        let again = astray(&[fitted(&library, 1, 2.0, 500.0), fitted(&library, 1, 0.0, 50.0)], &null);
        // A nuisance is where it was, a size nothing, a form as it was found; one that ended little above is left alone.
        assert_eq!((again.len(), again[0].hypothesis, &again[0].z), (1, 1, &vec![0.0, 0.0, 2.0]));
    }

    #[test]
    fn the_better_of_two_fits_is_kept() {
        let library = [hypothesis(vec![unknown(3, 1.0)]), hypothesis(vec![unknown(2, 1.0)])];
        let left =
            |of: &[f64]| of.iter().enumerate().map(|(n, left)| fitted(&library, n, 0.0, *left)).collect::<Vec<_>>();
        let kept = |again: f64| better(left(&[5.0, 7.0]), vec![fitted(&library, 1, 0.0, again)])[1].cost();
        assert!((kept(3.0) - 3.0).abs() < 1e-12 && (kept(9.0) - 7.0).abs() < 1e-12);
    }
}
