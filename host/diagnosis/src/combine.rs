//! Combinations of effects: a beam search that adds what pays after a joint fit, and drops what no longer does.

use crate::block::MeasuredBlock;
use crate::inference::bank::Bank;
use crate::inference::evidence::evidence;
use crate::inference::fit::{Fitted, Start};
use crate::judge::{NEARLY_NOISE, best_entries, is_sound, sized, unknowns};
use crate::library::Hypothesis;

/// Combinations from which the next larger ones are made.
const BEAM: usize = 3;
/// Most effects of a combination that is an answer, and of one whose remainder tells the noise: more would swallow some.
const MOST: usize = 4;
const MOST_FOR_NOISE: usize = 3;
/// Effects that are tried on top of a combination, the most promising.
const TRIED: usize = 8;
/// Log-odds by the screening below which an effect is not tried on top of a combination.
const PROMISING: f64 = 2.0;
/// Log-odds by which one more effect must pay for itself, beyond its share of the prior.
const PAYS: f64 = 5.0;

/// Fits starts; the best of each hypothesis comes back.
pub(crate) type Fit<'a> = dyn Fn(Vec<Start>) -> Vec<Fitted> + 'a;

/// Hypotheses of a combination, in rising order, and their joint fit.
pub(crate) type Set = (Vec<usize>, Fitted);

/// All single effects, and the combinations that explain the data better than any of their parts; `strictly` those alone
/// that are what their names say.
pub(crate) fn combine(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    bank: &Bank,
    singles: Vec<Fitted>,
    dispersion: f64,
    strictly: bool,
    fit: &Fit,
) -> Vec<Set> {
    let price = PAYS + (library.len() as f64).ln();
    let log = |set: &Set| evidence(&set.1, dispersion).log;
    let mut all: Vec<Set> = singles.into_iter().map(|fitted| (vec![fitted.hypothesis], fitted)).collect();
    let sound = |set: &Set| !strictly || is_sound(&block.base, library, &set.0, &set.1, &evidence(&set.1, dispersion));
    let mut beam = beam_of(all.clone(), &sound, &log);
    let most = if strictly { MOST } else { MOST_FOR_NOISE };
    for _ in 1..most {
        // What leaves nothing but noise can be added to; sets without it have nothing to explain that it does not.
        if beam.first().is_some_and(|best| best.1.mean_square() < NEARLY_NOISE) {
            beam.truncate(1);
        }
        let starts = beam.iter().flat_map(|set| grown(block, library, bank, dispersion, set, &all)).collect();
        let larger = fitted(starts, fit);
        // More than any of its parts, or it is none.
        let pays = |set: &Set| {
            let parts = all.iter().filter(|part| part.0.iter().all(|own| set.0.contains(own)));
            log(set) > price + parts.map(&log).fold(f64::NEG_INFINITY, f64::max)
        };
        let paying: Vec<Set> = larger.into_iter().filter(pays).collect();
        if paying.is_empty() {
            break;
        }
        beam = beam_of(paying.clone(), &sound, &log);
        all.extend(paying.into_iter().filter(sound));
    }
    all
}

/// The best sound sets, and the best of all if that is not sound: what strains it may be what one more effect explains.
fn beam_of(mut sets: Vec<Set>, sound: &dyn Fn(&Set) -> bool, log: &dyn Fn(&Set) -> f64) -> Vec<Set> {
    sets.sort_by(|a, b| log(b).total_cmp(&log(a)));
    let strained = sets.first().filter(|best| !sound(best)).cloned();
    strained.into_iter().chain(sets.into_iter().filter(sound).take(BEAM)).collect()
}

/// A combination with one more effect, for every effect that promises something.
fn grown(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    bank: &Bank,
    dispersion: f64,
    (members, fitted): &Set,
    known: &[Set],
) -> Vec<(Vec<usize>, Start)> {
    let scores = bank.scores(fitted).dispersed(dispersion);
    let shares = |number: usize| {
        let fields = || library[number].unknowns.iter().map(|unknown| unknown.field);
        members.iter().any(|own| library[*own].unknowns.iter().any(|unknown| fields().any(|f| f == unknown.field)))
    };
    let odds = bank.log_odds(&scores, library.len());
    let mut tried: Vec<usize> =
        (0..library.len()).filter(|number| odds[*number] > PROMISING && !shares(*number)).collect();
    tried.sort_by(|a, b| odds[*b].total_cmp(&odds[*a]));
    tried.truncate(TRIED);
    let with = |number: usize| {
        let mut set = members.clone();
        set.push(number);
        set.sort_unstable();
        if known.iter().any(|other| other.0 == set) {
            return None;
        }
        let hypotheses: Vec<&Hypothesis> = set.iter().map(|number| &library[*number]).collect();
        let unknowns = unknowns(block, &hypotheses);
        let (entry, multiples) = best_entries(bank, &scores, number).into_iter().next()?;
        let new = sized(&library[number], entry, &multiples);
        let place = |field: usize, unknowns: &[crate::inference::unknown::Unknown]| {
            unknowns.iter().position(|unknown| unknown.field == field)
        };
        let z = unknowns.iter().map(|unknown| match place(unknown.field, &library[number].unknowns) {
            Some(own) => new[own],
            None => place(unknown.field, &fitted.unknowns).map_or(0.0, |own| fitted.z[own]),
        });
        Some((set, Start { hypothesis: 0, z: z.collect(), unknowns }))
    };
    tried.into_iter().filter_map(with).collect()
}

/// Joint fits; combinations that were reached from two sides are fitted from both.
fn fitted(starts: Vec<(Vec<usize>, Start)>, fit: &Fit) -> Vec<Set> {
    let mut sets: Vec<Vec<usize>> = starts.iter().map(|(set, _)| set.clone()).collect();
    sets.sort();
    sets.dedup();
    let numbered = |(set, start): (Vec<usize>, Start)| Start {
        hypothesis: sets.iter().position(|other| *other == set).expect("collected above"),
        ..start
    };
    let fits = fit(starts.into_iter().map(numbered).collect());
    fits.into_iter().map(|fitted| (sets[fitted.hypothesis].clone(), fitted)).collect()
}
