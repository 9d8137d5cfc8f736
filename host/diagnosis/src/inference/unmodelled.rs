//! Model error outside the library: the missing torque, its form, and whether that form holds on held-out motion.
//!
//! The terms of the dictionary and the linear effects of the library are simulated. Terms that most halves of the data
//! select are fitted together, and those that do not raise the evidence are dropped.

use crate::inference::admissibility::holds;
use crate::inference::bank::Bank;
use crate::inference::combine::price;
use crate::inference::evidence::evidence;
use crate::inference::fit::{Fitted, Start, fit};
use crate::inference::judge::{BlockJudgement, Candidate, JudgementContext, carried, unknowns};
use crate::inference::latent::{Latent, latent};
use crate::inference::response::KnotResponse;
use crate::inference::selection::{Linear, stable};
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;

/// Times that terms are looked for, each time on top of what was found.
const PASSES: usize = 3;
/// Log-odds that a term must gain in the end.
const PAYS: f64 = 5.0;
/// Terms that are fitted alone against the library's best.
const CLOSEST: usize = 2;

/// Model error of a block that no effect of its library explains.
#[derive(Clone, Debug)]
pub struct Unmodelled {
    /// Missing torque of each experiment.
    pub missing: Vec<Missing>,
    /// Stable form, if there is one.
    pub form: Option<Form>,
}

impl Unmodelled {
    /// Estimates the model error that a block's library does not explain; `dictionary` lists the forms outside the
    /// catalogue, and is empty for blocks without a missing torque.
    pub fn of(
        block: &MeasuredBlock,
        library: &[Hypothesis],
        dictionary: &[Hypothesis],
        judgement: &BlockJudgement,
    ) -> Self {
        let missing = if dictionary.is_empty() { Vec::new() } else { missing(block, judgement) };
        Self { missing, form: form(block, library, dictionary, judgement) }
    }
}

/// Form of a residual that no effect of the library explains.
#[derive(Clone, Debug)]
pub struct Form {
    /// Terms, each with the share of the data's halves that select it.
    pub terms: Vec<(Hypothesis, f64)>,
    /// Joint candidate of all terms; its hypotheses are indices into `terms`.
    pub candidate: Candidate,
    /// Whether it is adequate on held-out motion, as a named cause must be.
    pub holds: bool,
}

/// Missing torque of the model along an experiment.
#[derive(Clone, Debug)]
pub struct Missing {
    /// The experiment.
    pub experiment: String,
    /// Times of its knots since the recording's start \[s\].
    pub time: Vec<f64>,
    /// The block's inputs at the knots, in the order of its field table.
    pub inputs: Vec<Vec<f64>>,
    /// Torque with its standard deviation.
    pub torque: Latent,
}

/// Distance of the knots of a missing torque \[s\].
const APART: f64 = 0.05;

/// Returns the missing torque of a drive for each training experiment.
///
/// It is added to the measured torque: positive where the motion shows more torque than was measured.
fn missing(block: &MeasuredBlock, judgement: &BlockJudgement) -> Vec<Missing> {
    let greatest =
        block.trials.iter().flat_map(|trial| &trial.recorded.late).fold(0.0_f64, |most, t| most.max(t.abs()));
    let set = judgement.clamped.values(&block.base);
    let of = |response: KnotResponse| -> Option<Missing> {
        let torque = latent(&response.residual, &response.response, greatest)?;
        let KnotResponse { recorded, experiment, knots, .. } = response;
        let width = recorded.inputs.len() / recorded.instants;
        let inputs = knots.iter().map(|i| recorded.inputs[i * width..(i + 1) * width].to_vec()).collect();
        Some(Missing { experiment, time: knots.iter().map(|i| *i as f64 * recorded.step).collect(), inputs, torque })
    };
    block.part(false).responses(&judgement.noise, &set, APART).into_iter().filter_map(of).collect()
}

/// Returns whether a single term of the dictionary explains the data better than the best hypothesis of the library:
/// effects with several parameters then only approximate it.
pub(crate) fn is_simpler(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    terms: &[Hypothesis],
    judgement: &BlockJudgement,
) -> bool {
    let best = judgement.ranking.iter().find(|candidate| candidate.admissible);
    let Some(best) = best.filter(|_| !terms.is_empty()) else { return false };
    let search = Search { bench: JudgementContext::of(block, terms, judgement.noise.clone()), terms };
    let closest = search.closest(&judgement.null, judgement.dispersion);
    let choices: Vec<Vec<usize>> = closest.iter().map(|term| vec![*term]).collect();
    let log = |fitted: &Fitted| evidence(fitted, judgement.dispersion).log;
    let least = log(&judgement.null) + best.score(library.len()) + price(library.len()) + PAYS;
    let fits = closest.into_iter().zip(search.fitted(&choices, &judgement.null));
    let Some((term, fitted)) = fits.max_by(|a, b| log(&a.1).total_cmp(&log(&b.1))) else { return false };
    log(&fitted) > least && holds(&search.candidate(&[term], fitted, judgement), judgement.threshold)
}

/// Returns the stable form of the residual of a block's library, if there is one.
fn form(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    dictionary: &[Hypothesis],
    judgement: &BlockJudgement,
) -> Option<Form> {
    let mut terms = dictionary.to_vec();
    if terms.is_empty() {
        return None;
    }
    terms.extend(library.iter().filter(|hypothesis| hypothesis.is_linear()).cloned());
    let search = Search { bench: JudgementContext::of(block, &terms, judgement.noise.clone()), terms: &terms };
    let mut picked: Vec<PickedTerm> = Vec::new();
    let mut at = judgement.null.clone();
    for _ in 0..PASSES {
        let more = search.more(&at, &picked);
        if more.is_empty() {
            break;
        }
        picked.extend(more);
        picked.sort_by_key(|(term, _)| *term);
        at = search.fitted(&[numbers(&picked)], &at).remove(0);
    }
    (picked, at) = search.thinned(picked, at);
    if picked.is_empty() {
        return None;
    }
    let mut candidate = search.candidate(&numbers(&picked), at.clone(), judgement);
    // A form that raises the torque error absorbs what is no torque.
    while candidate.worse_torque.is_some() {
        (_, picked, at) = search.one_less(&picked, &at, candidate.fitted.mean_square().max(1.0))?;
        candidate = search.candidate(&numbers(&picked), at.clone(), judgement);
    }
    let holds = holds(&candidate, judgement.threshold) && !candidate.is_impossible();
    let terms = picked.into_iter().map(|(term, share)| (terms[term].clone(), share)).collect::<Vec<_>>();
    let hypotheses = (0..terms.len()).collect();
    Some(Form { terms, candidate: Candidate { hypotheses, ..candidate }, holds })
}

fn numbers(picked: &[PickedTerm]) -> Vec<usize> {
    picked.iter().map(|(term, _)| *term).collect()
}

/// A term, with the share of the data's halves that select it.
type PickedTerm = (usize, f64);

struct Search<'a> {
    bench: JudgementContext<'a>,
    terms: &'a [Hypothesis],
}

impl Search<'_> {
    fn base(&self) -> &[f64] {
        &self.bench.block.base
    }

    /// What some terms change on top of a fit.
    fn bank(&self, terms: &[Hypothesis], at: &Fitted) -> Bank {
        let shortcut = self.bench.learn.shortcut(&self.bench.noise, &at.values(self.base()));
        Bank::simulate(terms, at, self.base(), &|sets| shortcut.whitened(sets))
    }

    /// The terms that promise most on top of a fit.
    fn closest(&self, at: &Fitted, dispersion: f64) -> Vec<usize> {
        let bank = self.bank(self.terms, at);
        let odds = bank.log_odds(&bank.scores(at).dispersed(dispersion), self.terms.len());
        let mut all: Vec<usize> = (0..self.terms.len()).collect();
        all.sort_by(|a, b| odds[*b].total_cmp(&odds[*a]));
        all.truncate(CLOSEST);
        all
    }

    /// Terms that most halves of the data pick on top of a fit, each with their share.
    fn more(&self, at: &Fitted, picked: &[PickedTerm]) -> Vec<PickedTerm> {
        let is_new = |number: &usize| picked.iter().all(|(own, _)| own != number);
        let left: Vec<usize> = (0..self.terms.len()).filter(is_new).collect();
        let shelf: Vec<Hypothesis> = left.iter().map(|number| self.terms[*number].clone()).collect();
        let bank = self.bank(&shelf, at);
        let columns: Vec<_> = bank.entries().iter().map(|entry| bank.signatures(entry)).collect();
        let model = Linear {
            residual: &at.residual,
            known: &at.jacobian,
            z: &at.z,
            terms: &columns,
            dispersion: at.mean_square().max(1.0),
        };
        stable(&model).into_iter().map(|picked| (left[picked.term], picked.share)).collect()
    }

    /// Joint fits of several choices of terms, from where their numbers stand in another fit.
    fn fitted(&self, choices: &[Vec<usize>], from: &Fitted) -> Vec<Fitted> {
        let start = |(number, choice): (usize, &Vec<usize>)| {
            let hypotheses: Vec<&Hypothesis> = choice.iter().map(|term| &self.terms[*term]).collect();
            let unknowns = unknowns(self.bench.block, &hypotheses);
            let z = carried(&unknowns, from);
            Start::new(number, unknowns, z).beside(from)
        };
        let starts = choices.iter().enumerate().map(start).collect();
        let anchor = from.values(self.base());
        let shortcut = self.bench.learn.shortcut(&self.bench.noise, &anchor);
        let quick = fit(starts, self.base(), self.bench.block.quotient(), &|sets| shortcut.whitened(sets));
        self.bench.polished(quick)
    }

    /// The terms without those that do not pay, and their fit.
    fn thinned(&self, mut picked: Vec<PickedTerm>, mut at: Fitted) -> (Vec<PickedTerm>, Fitted) {
        loop {
            let dispersion = at.mean_square().max(1.0);
            let own = evidence(&at, dispersion).log;
            match self.one_less(&picked, &at, dispersion) {
                Some((log, choice, fitted)) if log > own - PAYS => (picked, at) = (choice, fitted),
                _ => return (picked, at),
            }
        }
    }

    /// The terms without the one that pays least, with their evidence and fit; `None` for a single term.
    fn one_less(&self, picked: &[PickedTerm], at: &Fitted, dispersion: f64) -> Option<(f64, Vec<PickedTerm>, Fitted)> {
        if picked.len() < 2 {
            return None;
        }
        let without = |place: usize| {
            let mut rest = picked.to_vec();
            rest.remove(place);
            rest
        };
        let choices: Vec<Vec<PickedTerm>> = (0..picked.len()).map(without).collect();
        let sets: Vec<Vec<usize>> = choices.iter().map(|choice| numbers(choice)).collect();
        let fits = choices.into_iter().zip(self.fitted(&sets, at));
        let scored = fits.map(|(choice, fitted)| (evidence(&fitted, dispersion).log, choice, fitted));
        scored.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn candidate(&self, members: &[usize], fitted: Fitted, judgement: &BlockJudgement) -> Candidate {
        let dispersion = fitted.mean_square().max(1.0);
        let evidence_of = |fitted: &Fitted| evidence(fitted, dispersion);
        let own = evidence_of(&fitted);
        let log_odds = own.log - evidence_of(&judgement.null).log;
        let mut one = [Candidate { log_odds, ..Candidate::new(members.to_vec(), fitted, own) }];
        // While it is admissible: that of others is not computed.
        self.bench.refuse_worse_torque(&judgement.clamped, &mut one);
        self.bench.add_input_noise(&judgement.null, dispersion, &mut one);
        self.bench.compensate(dispersion, &mut one);
        self.bench.add_deviations(dispersion, &mut one);
        self.bench.add_adequacies(&judgement.null, &judgement.clamped, &mut one);
        let [candidate] = one;
        candidate
    }
}
