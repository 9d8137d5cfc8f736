//! Admissibility of fits and combinations.

use crate::inference::adequacy::{ADEQUATE, Adequacy, gain_interval};
use crate::inference::fit::Fitted;
use crate::inference::judge::Candidate;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::{Role, Unknown};
use nalgebra::{DMatrix, DVector};

/// Gain on held-out motion that one more effect must bring.
const WORTH: f64 = 0.01;
/// Standard deviations by which a size must differ from the model's.
const SIGNIFICANT: f64 = 2.0;
/// Prior standard deviations within which the form of an effect is plausible.
const FAR_OFF: f64 = 3.5;
/// Standard deviations that make up a size that is well known.
const WELL_KNOWN: f64 = 8.0;
/// The same in spite of a misfit, or of another effect that may undo it.
const BEYOND_DOUBT: f64 = 40.0;
/// Correlation of two sizes from which on one effect may undo the other.
const TIED: f64 = 0.8;
/// Mean square of whitened residuals that may be noise alone.
pub(crate) const NEARLY_NOISE: f64 = 1.1;
/// z-score from which a nuisance parameter is a finding.
pub(crate) const REPORTED_Z: f64 = 3.5;
/// Largest nuisance z-score of a combination.
pub(crate) const LARGEST_Z: f64 = 4.5;
/// Share of the misfit that a fit must explain where it is not adequate.
const EXPLAINED: f64 = 0.8;
/// Gain from which on an effect is worth knowing.
pub(crate) const PRACTICAL: f64 = 0.01;

/// Returns whether a fit is admissible: every effect has a size that differs from nominal, so that not its form alone
/// explains the data (a gear's stiffness without backlash), and a plausible form (a Stribeck speed beyond all speeds is
/// Coulomb friction by another name). A combination also needs plausible or well-known sizes that are separable, and
/// nuisance parameters near their priors. `covariance` is that of all the fit's `z`.
pub(crate) fn is_admissible(
    base: &[f64],
    library: &[Hypothesis],
    members: &[usize],
    fitted: &Fitted,
    covariance: &DMatrix<f64>,
) -> bool {
    let place = |unknown: &Unknown| fitted.place(unknown.field).expect("a fit has the numbers of its hypotheses");
    // Sizes of one effect may be known together and not apart.
    let differs = |hypothesis: &Hypothesis| {
        let sizes: Vec<&Unknown> = hypothesis.sizes.iter().map(|size| &hypothesis.unknowns[*size]).collect();
        let off = |unknown: &&Unknown| fitted.z[place(unknown)] - unknown.prior.place(base[unknown.field]);
        let off = DVector::from_iterator(sizes.len(), sizes.iter().map(off));
        let own = |i: usize, j: usize| covariance[(place(sizes[i]), place(sizes[j]))];
        let own = DMatrix::from_fn(sizes.len(), sizes.len(), own).cholesky();
        own.is_some_and(|covariance| off.dot(&covariance.solve(&off)) > SIGNIFICANT * SIGNIFICANT)
    };
    let plausible = |unknown: &Unknown| unknown.role != Role::Form || fitted.z[place(unknown)].abs() < FAR_OFF;
    let own = || members.iter().map(|number| &library[*number]);
    let each = own().all(|hypothesis| differs(hypothesis) && hypothesis.unknowns.iter().all(plausible))
        && beyond_limits(fitted).next().is_none();
    each && (members.len() == 1
        || !(has_doubtful_size(library, members, fitted, covariance) || has_nuisance_beyond_prior(fitted)))
}

/// Returns the sizes and forms beyond their physical limits, with their values.
pub(crate) fn beyond_limits(fitted: &Fitted) -> impl Iterator<Item = (&Unknown, f64)> {
    let values = fitted.unknowns.iter().zip(&fitted.z).map(|(unknown, z)| (unknown, unknown.prior.value(*z)));
    values.filter(|(unknown, value)| {
        let [least, most] = unknown.limits;
        unknown.role != Role::Nuisance && !(least..=most).contains(value)
    })
}

/// Returns the nuisance parameters so far off that they are findings; see [`Fitted::nuisances`].
pub(crate) fn reported_nuisances(fitted: &Fitted) -> impl Iterator<Item = (usize, &Unknown, f64)> {
    fitted.nuisances().filter(|(_, _, z)| z.abs() > REPORTED_Z)
}

/// Returns the nuisance parameters beyond the limit of a combination.
fn nuisances_beyond_prior(fitted: &Fitted) -> impl Iterator<Item = (usize, &Unknown, f64)> {
    fitted.nuisances().filter(|(_, _, z)| z.abs() > LARGEST_Z)
}

/// Returns whether there are any.
pub(crate) fn has_nuisance_beyond_prior(fitted: &Fitted) -> bool {
    nuisances_beyond_prior(fitted).next().is_some()
}

/// Returns the log-odds penalty of a fit's nuisance parameters beyond their priors. Their cause is not in the library,
/// and an effect that explains less than they absorb may be arbitrary.
pub(crate) fn penalty_of_nuisances(fitted: &Fitted) -> f64 {
    nuisances_beyond_prior(fitted).map(|(_, _, z)| 0.5 * z * z).sum()
}

/// Returns whether a fit has a nuisance parameter beyond its prior and explains no more than the nuisance parameters
/// alone: then the nuisance parameter is the finding.
pub(crate) fn only_shifts_nuisances(fitted: &Fitted, null: &Fitted) -> bool {
    has_nuisance_beyond_prior(fitted) && fitted.chi2() > null.chi2()
}

/// Returns whether mean squares of held-out residuals show a gain.
pub(crate) fn gains(without: f64, with: f64) -> bool {
    1.0 - (with / without).sqrt() > WORTH
}

/// Returns whether a combination has an effect of implausible size despite a large misfit, a poorly determined size, or
/// a size that another effect cancels: then it only fits the missing part.
fn has_doubtful_size(library: &[Hypothesis], members: &[usize], fitted: &Fitted, covariance: &DMatrix<f64>) -> bool {
    let sizes = |number: usize| {
        let own = &library[number];
        let place = |size: &usize| fitted.place(own.unknowns[*size].field);
        own.sizes.iter().map(|size| place(size).expect("a fit has the numbers of its hypotheses")).collect::<Vec<_>>()
    };
    let covariance = |a: usize, b: usize| covariance[(a, b)];
    let tied = |a: usize, b: usize| covariance(a, b).powi(2) > TIED * TIED * covariance(a, a) * covariance(b, b);
    let others = |number: usize| members.iter().filter(move |other| **other != number).flat_map(|other| sizes(*other));
    let is_undone = |number: usize, size: usize| others(number).any(|other| tied(size, other));
    let too_large = |size: &usize| fitted.z[*size].abs() >= FAR_OFF;
    let is_within = |size: usize, deviations: f64| fitted.z[size].powi(2) < deviations.powi(2) * covariance(size, size);
    let bends = fitted.mean_square() > ADEQUATE;
    let is_doubtful = |number: usize, size: usize| {
        is_within(size, WELL_KNOWN) || is_within(size, BEYOND_DOUBT) && (bends || is_undone(number, size))
    };
    // What any model has wrong is limited by physics alone.
    let mut structure = members.iter().filter(|number| !library[**number].calibration);
    structure.any(|number| sizes(*number).into_iter().filter(too_large).any(|size| is_doubtful(*number, size)))
}

/// Drops over-parameterised effects: those with all parameters of another and more that explain hardly more. For
/// example, backlash of microradians absorbs the discretisation residual of a gear much softer than the model's. The
/// residual of the smaller hypothesis must be a share of its explained part.
pub(crate) fn drop_over_parameterised(ranking: &mut Vec<Candidate>, library: &[Hypothesis]) {
    let alone = |candidate: &Candidate| match candidate.hypotheses[..] {
        [number] => Some(&library[number]),
        _ => None,
    };
    let admissible = ranking.iter().filter(|candidate| candidate.admissible);
    let plain: Vec<(&Hypothesis, f64)> =
        admissible.filter_map(|candidate| Some((alone(candidate)?, candidate.log_odds))).collect();
    let embellishes = |own: &Hypothesis, log_odds: f64| {
        let is_within = |other: &Hypothesis| other.unknowns.len() < own.unknowns.len() && own.has_all_of(other);
        plain.iter().any(|(other, least)| is_within(other) && (1.0 - WORTH) * log_odds < *least)
    };
    ranking.retain(|candidate| !alone(candidate).is_some_and(|own| embellishes(own, candidate.log_odds)));
}

/// Drops combinations without a gain on held-out motion over any kept combination with fewer effects; `dispersion` as
/// in the evidence.
pub(crate) fn drop_without_held_out_gain(ranking: &mut Vec<Candidate>, dispersion: f64) {
    let mut places: Vec<usize> = (0..ranking.len()).collect();
    places.sort_by_key(|place| ranking[*place].hypotheses.len());
    let mut kept: Vec<usize> = Vec::new();
    for place in places {
        if is_worthwhile(&ranking[place], kept.iter().map(|place| &ranking[*place]), dispersion) {
            kept.push(place);
        }
    }
    let mut place = 0..;
    ranking.retain(|_| place.next().is_some_and(|place| kept.contains(&place)));
}

/// Returns whether a combination explains more of the held-out motion than its subsets and every admissible candidate
/// with fewer effects. Where these leave more than noise, one more effect must explain half of the remainder.
/// Candidates with nuisance parameters beyond their priors do not count. If no hypothesis explains the training data,
/// the gain must also be significant.
fn is_worthwhile<'c>(candidate: &Candidate, smaller: impl Iterator<Item = &'c Candidate>, dispersion: f64) -> bool {
    let Some(own) = candidate.adequacy else {
        return true;
    };
    let has_fewer = |other: &Candidate| other.hypotheses.len() < candidate.hypotheses.len();
    let is_part = |other: &Candidate| other.hypotheses.iter().all(|member| candidate.hypotheses.contains(member));
    let counts = |other: &Candidate| {
        has_fewer(other) && (other.admissible || is_part(other)) && !has_nuisance_beyond_prior(&other.fitted)
    };
    let fewer = smaller.filter(|other| counts(other));
    let best = fewer.filter_map(|other| Some((other, other.adequacy?.with))).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((best, least)) = best else {
        return true;
    };
    let is_much = least < NEARLY_NOISE || own.with - 1.0 < 0.5 * (least - 1.0);
    gains(least, own.with) && is_much && (dispersion < NEARLY_NOISE || surely_gains(candidate, best))
}

/// Whether a candidate explains more of the held-out motion than another, and not by chance.
fn surely_gains(candidate: &Candidate, other: &Candidate) -> bool {
    let [with, without] = [candidate, other].map(|candidate| candidate.held_out.as_slice());
    gain_interval([with, without], [candidate.fitted.carried, other.fitted.carried])[0] > 0.0
}

/// Returns whether a candidate holds: it is detected, adequate on held-out motion, and of practical gain.
pub(crate) fn holds(candidate: &Candidate, threshold: f64) -> bool {
    let explains = |a: &Adequacy| is_adequate(a, candidate) && a.gain_lo >= PRACTICAL;
    candidate.is_present(threshold) && candidate.adequacy.as_ref().is_some_and(explains)
}

/// Returns whether a fit is adequate on held-out motion, or nearly so with all nuisance parameters within their priors.
pub(crate) fn is_adequate(adequacy: &Adequacy, candidate: &Candidate) -> bool {
    let z = candidate.greatest_nuisance_deviation().map_or(0.0, |z| z.1.abs());
    adequacy.leaves_noise() || (adequacy.explained >= EXPLAINED && z <= LARGEST_Z)
}
