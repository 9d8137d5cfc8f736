//! Whether fits are what their names say, and combinations worth their effects.

use crate::inference::adequacy::{ADEQUATE, gain_interval};
use crate::inference::fit::Fitted;
use crate::inference::unknown::{Role, Unknown};
use crate::judge::Candidate;
use crate::library::Hypothesis;
use nalgebra::{DMatrix, DVector};

/// Gain on held-out motion that one more effect must bring.
const WORTH: f64 = 0.01;
/// Standard deviations by which a size must differ from the model's.
const SIGNIFICANT: f64 = 2.0;
/// Prior standard deviations within which the form of an effect is plausible.
const FAR_OFF: f64 = 3.5;
/// Standard deviations that make up a size that is well known.
const WELL_KNOWN: f64 = 8.0;
/// Correlation of two sizes from which on one effect may undo the other.
const TIED: f64 = 0.8;
/// Mean square of whitened residuals that may be noise alone.
pub(crate) const NEARLY_NOISE: f64 = 1.1;
/// Tolerances by which a combination may pull a nuisance.
pub(crate) const PULLED: f64 = 4.5;

/// Whether a fit is what its name says: every effect has a size that differs from the model's, so that it is not its
/// form alone that explains the data (a gear's stiffness without backlash), and a form that is plausible (a Stribeck
/// speed beyond all speeds is Coulomb friction by another name). Of a combination more is asked: sizes that are
/// plausible, or well known and apart from the others', and nuisances near their tolerance. `covariance` of all the fit's
/// `z`.
pub(crate) fn is_sound(
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
    let each = own().all(|hypothesis| differs(hypothesis) && hypothesis.unknowns.iter().all(plausible));
    each && (members.len() == 1 || !(has_doubtful_size(library, members, fitted, covariance) || is_strained(fitted)))
}

/// The nuisances that a fit pulls further than a combination may; see [`Fitted::nuisances`].
pub(crate) fn strained(fitted: &Fitted) -> impl Iterator<Item = (usize, &Unknown, f64)> {
    fitted.nuisances().filter(|(_, _, z)| z.abs() > PULLED)
}

/// Whether there are any.
pub(crate) fn is_strained(fitted: &Fitted) -> bool {
    strained(fitted).next().is_some()
}

/// Log-odds against the pulls of a fit's strained nuisances. What pulls them is no effect of the library, and an effect
/// that explains less than they hide beside it may be any.
pub(crate) fn strain(fitted: &Fitted) -> f64 {
    strained(fitted).map(|(_, _, z)| 0.5 * z * z).sum()
}

/// Whether a fit strains a nuisance and yet explains no more than the nuisances do alone: then the nuisance is the finding,
/// and the effect only takes some tolerances off it.
pub(crate) fn is_strained_for_nothing(fitted: &Fitted, null: &Fitted) -> bool {
    is_strained(fitted) && fitted.chi2() > null.chi2()
}

/// Whether mean squares of held-out residuals tell that something is gained from one to the other.
pub(crate) fn gains(without: f64, with: f64) -> bool {
    1.0 - (with / without).sqrt() > WORTH
}

/// Whether a combination has an effect of implausible size though much is still missing, or one that is hardly known, or
/// that another one takes back: then it bends with what is missing.
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
    let is_vague = |size: usize| fitted.z[size].powi(2) < WELL_KNOWN * WELL_KNOWN * covariance(size, size);
    let bends = fitted.mean_square() > ADEQUATE;
    let is_doubtful = |number: usize, size: usize| bends || is_vague(size) || is_undone(number, size);
    members.iter().any(|number| sizes(*number).into_iter().filter(too_large).any(|size| is_doubtful(*number, size)))
}

/// Drops the effects with all numbers of another, and more, that explain hardly more than it: a gear many times softer than
/// the model's leaves what a gap of microradians takes up, and has none. What another leaves is to be a share of what it
/// explains, as what a simulation tells wrong is.
pub(crate) fn drop_embellished(ranking: &mut Vec<Candidate>, library: &[Hypothesis]) {
    let alone = |candidate: &Candidate| match candidate.hypotheses[..] {
        [number] => Some(&library[number]),
        _ => None,
    };
    let sound = ranking.iter().filter(|candidate| candidate.sound);
    let plain: Vec<(&Hypothesis, f64)> =
        sound.filter_map(|candidate| Some((alone(candidate)?, candidate.log_odds))).collect();
    let embellishes = |own: &Hypothesis, log_odds: f64| {
        let is_within = |other: &Hypothesis| other.unknowns.len() < own.unknowns.len() && own.has_all_of(other);
        plain.iter().any(|(other, least)| is_within(other) && (1.0 - WORTH) * log_odds < *least)
    };
    ranking.retain(|candidate| !alone(candidate).is_some_and(|own| embellishes(own, candidate.log_odds)));
}

/// Drops the combinations that explain hardly more of the held-out motion than one with fewer effects does, those that are
/// dropped themselves aside; `dispersion` as in the evidence.
pub(crate) fn drop_worthless(ranking: &mut Vec<Candidate>, dispersion: f64) {
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

/// Whether a combination explains more of the held-out motion than its parts and anything sound with fewer effects do:
/// where those leave more than noise, one more effect must explain half of that, else it only bends with what is missing.
/// What strains a nuisance explains by what is none, and does not count. Where nothing explains what is learnt from, what
/// is left there is no noise that the evidence could weigh: then chance must not make what is held out look better either.
fn is_worthwhile<'c>(candidate: &Candidate, smaller: impl Iterator<Item = &'c Candidate>, dispersion: f64) -> bool {
    let Some(own) = candidate.adequacy else {
        return true;
    };
    let has_fewer = |other: &Candidate| other.hypotheses.len() < candidate.hypotheses.len();
    let is_part = |other: &Candidate| other.hypotheses.iter().all(|member| candidate.hypotheses.contains(member));
    let counts = |other: &Candidate| has_fewer(other) && (other.sound || is_part(other)) && !is_strained(&other.fitted);
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
