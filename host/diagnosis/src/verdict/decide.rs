//! Decision: from the judgement of a block to its answer.

use crate::inference::adequacy::{ADEQUATE, Adequacy};
use crate::inference::admissibility::{
    LARGEST_Z, PRACTICAL, REPORTED_Z, beyond_limits, has_nuisance_beyond_prior, is_adequate, reported_nuisances,
};
use crate::inference::fit::Fitted;
use crate::inference::judge::{BlockJudgement, Candidate};
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::Role;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound, Gain, Residual, RuledOut};
use crate::verdict::errors::FittedParameter;
use crate::verdict::estimates::{EffectSize, covariance, parameters};
use softdock_analysis::number::{significant, with_unit};
use softdock_kernels::effects::{Effect, GROUPS, Group};
use std::collections::BTreeSet;

/// Log-odds within which rivals are reported together.
const GAP: f64 = 3.0;
/// Share of the training misfit that a candidate leaves at most where only training motion excites it.
const EXCITED: f64 = 0.8;

/// Decides the answer for a block; `missing` are effects that the block's library excludes.
pub(crate) fn decide(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    missing: &[&'static str],
    judgement: &BlockJudgement,
    prismatic: bool,
) -> BlockAnswer {
    let context = Context { block, library, judgement, prismatic };
    let ranking: Vec<&Candidate> = judgement.admissible().collect();
    let best = ranking.first().copied();
    let is_there = |best: &&Candidate| judgement.finds(best, library.len()) && !is_nothing(best);
    let present = best.filter(|best| is_there(best) && !context.only_reduces_a_nuisance(best));
    let rivals = present.map_or_else(Vec::new, |best| context.rivals(best, &ranking));
    let partners = present.map_or_else(Vec::new, |best| context.missing_partners(best, missing));
    let answer = context.verdict(present, best, rivals.len() > 1 || !partners.is_empty());
    let is_inadequate = answer == DiagnosisVerdict::ModelInadequate;
    let is_likely = |best: &&Candidate| best.score(library.len()) > 0.0;
    let possible: Vec<&Candidate> = present.or(best.filter(is_likely)).into_iter().filter(|_| is_inadequate).collect();
    let shown: Vec<&Candidate> = if answer.names() { rivals.clone() } else { Vec::new() };
    let mut effects = context.effects(&shown, &ranking);
    effects.sort_by(|a, b| b.p.total_cmp(&a.p));
    let adequacy = present.and_then(|best| best.adequacy);
    BlockAnswer {
        block: block.name,
        answer,
        effects,
        inadequate: if is_inadequate { context.inadequacies(present) } else { Vec::new() },
        possible: context.effects(&possible, &ranking),
        form: None,
        partner_missing: if answer == DiagnosisVerdict::Ambiguous { partners } else { Vec::new() },
        log_odds: best.map_or(0.0, |best| best.log_odds),
        threshold: judgement.threshold,
        gain: adequacy.as_ref().map(Gain::of),
        residual: context.residual(present, best),
        torque_error: None,
        remaining: Vec::new(),
        fitted: FittedParameter::all(block, context.fitted(present), prismatic),
        free_run: None,
        held_out: judgement.ranking.iter().any(|candidate| candidate.adequacy.is_some()),
        ruled_out: context.ruled_out(&shown),
        not_visible: Vec::new(),
        confounded: Vec::new(),
        nuisances_beyond_prior: reported_nuisances(context.fitted(present))
            .map(|(_, unknown, z)| (unknown.name.clone(), z))
            .collect(),
        samples: judgement.samples,
    }
}

struct Context<'a> {
    block: &'a MeasuredBlock,
    library: &'a [Hypothesis],
    judgement: &'a BlockJudgement,
    prismatic: bool,
}

impl Context<'_> {
    fn verdict(&self, present: Option<&Candidate>, best: Option<&Candidate>, several: bool) -> DiagnosisVerdict {
        if self.is_inadequate(present) {
            return DiagnosisVerdict::ModelInadequate;
        }
        let Some(best) = present else {
            // Weak evidence that a nuisance parameter explains within its prior needs no cause.
            let explains = |best: &Candidate| {
                !has_nuisance_beyond_prior(&best.fitted) && best.adequacy.is_some_and(|a| a.leaves_noise())
            };
            let unexplained = self.is_misfit() && !best.is_some_and(explains);
            return if unexplained { DiagnosisVerdict::NotInLibrary } else { DiagnosisVerdict::NoEffect };
        };
        match best.adequacy {
            Some(a) if !is_adequate(&a, best) => DiagnosisVerdict::NotInLibrary,
            // A short event may be absent from a resample, but the motion is not explained without it.
            Some(a) if a.gain_lo < PRACTICAL && !self.is_misfit() && !self.is_learnt_misfit(best) => {
                DiagnosisVerdict::NoPracticalEffect
            }
            // What gains nothing on unexplained motion is no cause of it.
            Some(a) if a.gain_lo < PRACTICAL && self.is_misfit() && !a.leaves_noise() => DiagnosisVerdict::NotInLibrary,
            _ if several => DiagnosisVerdict::Ambiguous,
            _ => DiagnosisVerdict::Named,
        }
    }

    /// Returns the fit of an answer: of the candidate that is present, or of the null hypothesis.
    fn fitted<'f>(&'f self, present: Option<&'f Candidate>) -> &'f Fitted {
        present.map_or(&self.judgement.null, |best| &best.fitted)
    }

    /// Returns whether the model is inadequate: the answer has a parameter beyond its tolerance, or leaves more than
    /// noise where something impossible leaves less.
    fn is_inadequate(&self, present: Option<&Candidate>) -> bool {
        let explains = match present {
            Some(best) => best.adequacy.is_some_and(|a| a.leaves_noise()),
            None => !self.is_misfit(),
        };
        // Of many recordings without a model error some have a parameter as rarely far off.
        let most = if present.is_none() && explains { LARGEST_Z } else { REPORTED_Z };
        let is_beyond = self.fitted(present).nuisances().any(|(_, _, z)| z.abs() > most);
        is_beyond || !explains && self.impossible(present).is_some()
    }

    /// Returns the most probable impossible candidate, if it is more probable than the best possible one.
    fn impossible(&self, present: Option<&Candidate>) -> Option<&Candidate> {
        let least = present.map_or(self.judgement.threshold, |best| self.score(best) + GAP);
        let impossible = self.judgement.ranking.iter().filter(|candidate| candidate.is_impossible());
        let best = impossible.max_by(|a, b| self.score(a).total_cmp(&self.score(b)))?;
        (self.score(best) > least).then_some(best)
    }

    /// Returns the reasons why the model is inadequate.
    fn inadequacies(&self, present: Option<&Candidate>) -> Vec<String> {
        let mut reasons: Vec<String> = reported_nuisances(self.fitted(present))
            .map(|(_, unknown, z)| {
                let nominal = unknown.prior.value(0.0);
                format!(
                    "{} ({}) would have to be {} instead of {}: {} tolerances off",
                    self.block.section.parameters()[unknown.field].meaning,
                    unknown.name,
                    with_unit(unknown.prior.value(z), unknown.unit),
                    with_unit(nominal, unknown.unit),
                    significant(z, 2)
                )
            })
            .collect();
        if let Some(impossible) = self.impossible(present) {
            let ids: Vec<String> = impossible.hypotheses.iter().map(|number| self.library[*number].words()).collect();
            let ids = ids.join(" and ");
            reasons.extend(beyond_limits(&impossible.fitted).map(|(unknown, value)| {
                let [least, most] = unknown.limits.map(|limit| significant(limit, 3));
                format!(
                    "{ids} would explain most, but {} = {} is impossible: {least} to {most}",
                    unknown.name,
                    with_unit(value, unknown.unit)
                )
            }));
            reasons.extend(impossible.worse_torque.map(|error| {
                let [before, after] = [error.before, error.after].map(|error| significant(100.0 * error, 3));
                format!("{ids} would explain most, but raises the torque error from {before} % to {after} %")
            }));
        }
        reasons
    }

    /// Returns whether an effect is detected only because it reduces a rare but possible nuisance z-score: then the
    /// nuisance parameter is the finding, unless it is the effect's own size.
    fn only_reduces_a_nuisance(&self, best: &Candidate) -> bool {
        let null = &self.judgement.null;
        let z_scores = null.unknowns.iter().zip(&null.z);
        let Some((nuisance, z)) = z_scores.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else {
            return false;
        };
        let of_best = best.fitted.place(nuisance.field);
        let absorbed = of_best.filter(|place| best.fitted.unknowns[*place].role == Role::Nuisance);
        let rare = (REPORTED_Z..LARGEST_Z).contains(&z.abs());
        let share = absorbed.map_or(0.0, |place| 0.5 * (z * z - best.fitted.z[place].powi(2)));
        rare && best.log_odds - share < self.judgement.threshold
    }

    /// Returns the mean square residual of the nominal model, on held-out motion if there is any.
    fn without(&self) -> f64 {
        self.held_out().map_or(self.judgement.misfit(), |adequacy| adequacy.without)
    }

    /// Returns whether that is more than noise.
    fn is_misfit(&self) -> bool {
        self.without() >= self.held_out().map_or(ADEQUATE, |adequacy| adequacy.tolerated)
    }

    /// Returns whether the training recordings are explained only with the candidate: held-out motion that hardly excites
    /// it does not show that it has no practical effect.
    fn is_learnt_misfit(&self, best: &Candidate) -> bool {
        let without = self.judgement.misfit();
        without >= ADEQUATE && best.fitted.mean_square() < EXCITED * without
    }

    /// Returns the adequacy of any candidate on held-out motion.
    fn held_out(&self) -> Option<Adequacy> {
        self.judgement.ranking.iter().find_map(|candidate| candidate.adequacy)
    }

    fn residual(&self, present: Option<&Candidate>, best: Option<&Candidate>) -> Residual {
        let before = self.without();
        let of = |candidate: &Candidate| match candidate.adequacy {
            Some(adequacy) => adequacy.with,
            None => candidate.fitted.mean_square(),
        };
        let after = present.or(best.filter(|_| self.is_misfit())).map_or(before, of);
        Residual { before: before.sqrt(), after: after.sqrt() }
    }

    /// Returns the best candidate and those almost as probable, without supersets of the best.
    fn rivals<'c>(&self, best: &'c Candidate, ranking: &[&'c Candidate]) -> Vec<&'c Candidate> {
        let near = |other: &&&Candidate| {
            let within = best.hypotheses.iter().all(|number| self.has(other, self.id(*number)));
            !within && self.judgement.lead(best, Some(other), self.library.len()) < GAP
        };
        std::iter::once(best).chain(ranking.iter().filter(near).copied()).collect()
    }

    /// The effect of a hypothesis; several may be forms of one.
    fn id(&self, number: usize) -> &'static str {
        self.library[number].effect.id
    }

    /// Whether a candidate has an effect, in any form.
    fn has(&self, candidate: &Candidate, id: &str) -> bool {
        candidate.hypotheses.iter().any(|number| self.id(*number) == id)
    }

    /// Returns the log-odds less the complexity penalty of every further effect.
    fn score(&self, candidate: &Candidate) -> f64 {
        candidate.score(self.library.len())
    }

    /// The effects not in the library that share any group with one of the best's.
    fn missing_partners(&self, best: &Candidate, missing: &[&'static str]) -> Vec<&'static str> {
        let is_found = |group: &Group| best.hypotheses.iter().any(|number| group.has(self.id(*number)));
        let groups = || GROUPS.iter().filter(|group| group.id != "own" && is_found(group));
        let partners = missing.iter().filter(|id| groups().any(|group| group.has(id)));
        // Several hypotheses may be forms of one effect.
        partners.copied().collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The effects of some candidates, each with its probability over all that were fitted.
    fn effects(&self, shown: &[&Candidate], ranking: &[&Candidate]) -> Vec<EffectFound> {
        let probabilities = self.judgement.probabilities(self.library.len());
        let mut found: Vec<EffectFound> = Vec::new();
        for candidate in shown {
            let known = found.len();
            for number in &candidate.hypotheses {
                let Hypothesis { effect: Effect { id, .. }, name, .. } = &self.library[*number];
                let parameters = parameters(candidate, &self.library[*number], self.prismatic);
                let covariance = covariance(candidate, &self.library[*number]);
                match found.iter_mut().position(|effect| effect.id == *id) {
                    // Of two forms of one effect the candidate's own go together.
                    Some(place) if place >= known => {
                        found[place].parameters.extend(parameters);
                        // The covariance between its forms is not reported.
                        found[place].covariance.clear();
                    }
                    Some(_) => {}
                    None => {
                        let with = ranking.iter().zip(&probabilities).filter(|(other, _)| self.has(other, id));
                        let p = with.map(|(_, probability)| probability).sum();
                        let size = EffectSize::of(self.block, &self.library[*number], &parameters);
                        let (block, log_odds) = (self.block.name, self.log_odds(id, ranking));
                        found.push(EffectFound { id, name, block, p, log_odds, size, parameters, covariance });
                    }
                }
            }
        }
        found
    }

    /// Log-odds of the best of some candidates, in falling order, with an effect against the best one without it.
    fn log_odds(&self, id: &str, ranking: &[&Candidate]) -> f64 {
        let best = |with: bool| ranking.iter().find(|candidate| self.has(candidate, id) == with).copied();
        best(true).map_or(0.0, |own| self.judgement.lead(own, best(false), self.library.len()))
    }

    /// The single effects that are not among those shown.
    fn ruled_out(&self, shown: &[&Candidate]) -> Vec<RuledOut> {
        let Some(best) = shown.first() else {
            return Vec::new();
        };
        let is_shown = |number: &usize| shown.iter().any(|own| self.has(own, self.id(*number)));
        let out = |candidate: &&Candidate| candidate.hypotheses.len() == 1 && !is_shown(&candidate.hypotheses[0]);
        let row = |candidate: &Candidate| RuledOut {
            id: self.id(candidate.hypotheses[0]),
            block: self.block.name,
            log_odds: self.score(best) - self.score(candidate),
            implausible: !candidate.admissible,
            residual: candidate.adequacy.map(|adequacy| adequacy.with.sqrt()),
        };
        self.judgement.ranking.iter().filter(out).map(row).collect()
    }
}

/// Returns the best candidate and those almost as probable.
pub(crate) fn rivals<'c>(
    block: &MeasuredBlock,
    library: &[Hypothesis],
    judgement: &'c BlockJudgement,
) -> Vec<&'c Candidate> {
    let ranking: Vec<&Candidate> = judgement.admissible().collect();
    let context = Context { block, library, judgement, prismatic: false };
    ranking.first().map_or_else(Vec::new, |best| context.rivals(best, &ranking))
}

/// Returns whether the evidence for an effect is within the scatter of its parameters: they may be nominal, and no
/// held-out motion gains.
fn is_nothing(candidate: &Candidate) -> bool {
    !candidate.sure && candidate.adequacy.is_some_and(|adequacy| adequacy.gain_lo < PRACTICAL)
}
