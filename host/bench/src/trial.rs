//! One case from its plan to its record: scale, recordings, seal, diagnosis; and only then what needs the truth.

use crate::baseline::Baselines;
use crate::oracle::{DetectionLimit, Oracle, multiplied};
use crate::plan::{Case, CaseTask};
use crate::plant::{hides_others, is_random};
use crate::record::{
    CaseRecord, Ledger, NamedCause, RecordedAnswer, RecordedEstimate, RecordedVerdict, ScaleLine, SealLine, scales,
};
use crate::recordings_folder::{RecordingsFolder, read};
use crate::seal::{SealedTruth, seal};
use crate::true_gain::true_gain;
use crate::{GauntletError, Result};
use softdock_diagnosis::answer::{BlockAnswer, Bounds, EffectFound};
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, Judged};
use softdock_diagnosis::experiment::ProposedExperiment;
use softdock_diagnosis::inference::evidence::evidence;
use softdock_gauntlet::{EffectCase, Hidden, Stronger, Told, follow, further, generate};
use softdock_kernels::effects::code;
use std::path::Path;
use std::time::Instant;

/// Experiments that an ambiguous answer may ask for, one after the other.
const EXPERIMENTS: u64 = 2;

/// Times that the repeats are made again which a true gain is measured on: its own chance should widen no interval.
const AGAIN: u64 = 4;

/// Runs cases one after the other; those that share a seed share their oracles.
pub struct TrialRunner<'a> {
    ledger: &'a Ledger,
    oracles: Oracles<'a>,
    baselines: Baselines,
}

/// What was asked of oracles for the last seed, and the scales that they have told any worker.
#[derive(Default)]
struct Oracles<'a> {
    ledger: Option<&'a Ledger>,
    told: Vec<ScaleLine>,
    asked: Vec<Asked>,
}

/// How large a case hides its effects.
struct Hiding {
    scales: Vec<Option<DetectionLimit>>,
    /// None if the bench cannot show such sizes.
    hidden: Option<Vec<Hidden>>,
}

/// The scale of an effect on the recordings of a seed.
struct Asked {
    seed: u64,
    effect: &'static EffectCase,
    /// What is hidden besides and is noise to this effect.
    beside: Vec<Hidden>,
    oracle: Oracle,
    scale: Option<DetectionLimit>,
}

impl Asked {
    fn of(case: &Case, effect: &'static EffectCase, beside: Vec<Hidden>) -> Result<Self> {
        let seed = case.seed();
        let oracle = Oracle::of(case.plant, effect, &beside, case.noise, seed)?;
        let scale = oracle.scale()?;
        Ok(Self { seed, effect, beside, oracle, scale })
    }

    /// The size that is so many times as large, if the bench can show it.
    fn multiple(&self, multiple: f64) -> Result<Option<f64>> {
        self.scale.as_ref().map_or(Ok(None), |scale| self.oracle.multiple(scale, multiple))
    }
}

impl<'a> TrialRunner<'a> {
    /// With a ledger to write to.
    ///
    /// # Errors
    /// A ledger that cannot be read.
    pub fn new(ledger: &'a Ledger) -> Result<Self> {
        let oracles = Oracles { ledger: Some(ledger), told: scales(ledger.folder())?, asked: Vec::new() };
        Ok(Self { ledger, oracles, baselines: Baselines::default() })
    }

    /// Runs a case and writes its record.
    ///
    /// # Errors
    /// A case that the generator refuses, files that cannot be written. What the diagnosis refuses is an answer.
    pub fn run(&mut self, case: &Case) -> Result<CaseRecord> {
        let begin = Instant::now();
        let Hiding { scales, hidden } = self.oracles.sized(case)?;
        let set =
            hidden.as_ref().map(|hidden| generate(case.plant.rig, hidden, case.noise, case.seed())).transpose()?;
        let sealed = seal(self.ledger.folder(), &SealedTruth::of(case, &scales, set.as_ref()))?;
        self.ledger.seal(&SealLine { case: case.id(), sealed: sealed.clone() })?;
        let mut record = CaseRecord::of(case.id(), sealed);
        if let (Some(set), Some(hidden)) = (set, hidden) {
            let exhibit = RecordingsFolder::of(&set)?;
            let options = DiagnosisOptions { without: left_out(case, exhibit.path())?, ..DiagnosisOptions::default() };
            let start = Instant::now();
            let Found { answer, judged, proposed } = answer(exhibit.path(), &options);
            record.cost.diagnosis = start.elapsed().as_secs_f64();
            if let Some(judged) =
                judged.filter(|_| answer.said == RecordedVerdict::Named && !matches!(case.task, CaseTask::Null))
            {
                let (rig, seed) = (case.plant.rig, case.seed());
                record.gain = true_gain(exhibit.path(), &judged, &further(rig, &hidden, case.noise, seed, AGAIN)?)?;
            }
            record.answer = Some(answer);
            // The baselines get the recordings that the first answer had.
            if case.plant.baselines && !matches!(case.task, CaseTask::LeftOut(_)) {
                record.baselines = self.baselines.answers(case, exhibit.path())?;
            }
            let follow =
                |told: &Told, number: u64| Ok(follow(case.plant.rig, &hidden, case.noise, case.seed(), told, number)?);
            record.after = after(&follow, &exhibit, &options, proposed)?;
        }
        record.cost.rest = begin.elapsed().as_secs_f64() - record.cost.diagnosis;
        self.ledger.finish(&record)?;
        Ok(record)
    }
}

/// Writes a case's model and recordings as the diagnosis gets them, and its truth beside them; whether the bench can show
/// such a size.
///
/// # Errors
/// A case that the generator refuses, a folder that cannot be written.
pub fn lay_out(case: &Case, folder: &Path) -> Result<bool> {
    let Hiding { scales, hidden } = Oracles::default().sized(case)?;
    let Some(hidden) = hidden else { return Ok(false) };
    let set = generate(case.plant.rig, &hidden, case.noise, case.seed())?;
    set.write(folder).map_err(GauntletError::file(folder))?;
    seal(folder, &SealedTruth::of(case, &scales, Some(&set)))?;
    Ok(true)
}

impl Oracles<'_> {
    /// Scales of what a case hides, and how large it hides it. What hides others comes first, noise before all: it is
    /// noise to them.
    fn sized(&mut self, case: &Case) -> Result<Hiding> {
        let mut order: Vec<(usize, &'static EffectCase)> = case.hidden().into_iter().enumerate().collect();
        order.sort_by_key(|(_, effect)| (!is_random(effect.id), !hides_others(effect.id)));
        let (mut noise, mut sized) = (Vec::new(), Vec::new());
        for (place, effect) in order {
            let (scale, size) = self.size(case, effect, &noise)?;
            let hidden = size.map(|size| Hidden { id: effect.id, size });
            noise.extend(hidden.filter(|_| hides_others(effect.id)));
            sized.push((place, scale, hidden));
        }
        sized.sort_by_key(|(place, ..)| *place);
        let (scales, hidden): (_, Vec<_>) = sized.into_iter().map(|(_, scale, hidden)| (scale, hidden)).unzip();
        Ok(Hiding { scales, hidden: hidden.into_iter().collect() })
    }

    /// The scale of an effect beside such noise, and so many times that.
    fn size(
        &mut self,
        case: &Case,
        effect: &'static EffectCase,
        beside: &[Hidden],
    ) -> Result<(Option<DetectionLimit>, Option<f64>)> {
        let (plant, seed) = (case.plant.name, case.seed());
        let is_told = |line: &&ScaleLine| line.plant == plant && line.effect == effect.id && line.seed == seed;
        // A limit has no multiples: only the oracle itself tells what shows so many times as much.
        let can_be_told = beside.is_empty() && effect.stronger == Stronger::Larger;
        if let Some(ScaleLine { scale, .. }) = self.told.iter().find(is_told).filter(|_| can_be_told) {
            return Ok((scale.clone(), scale.as_ref().and_then(|scale| multiplied(effect, scale, case.multiple))));
        }
        self.asked.retain(|asked| asked.seed == seed);
        let place = match self.asked.iter().position(|asked| asked.effect.id == effect.id && asked.beside == beside) {
            Some(place) => place,
            None => {
                self.asked.push(Asked::of(case, effect, beside.to_vec())?);
                self.asked.len() - 1
            }
        };
        let asked = &self.asked[place];
        let (scale, size) = (asked.scale.clone(), asked.multiple(case.multiple)?);
        if can_be_told {
            let (plant, effect) = (plant.to_owned(), effect.id.to_owned());
            self.remember(ScaleLine { plant, effect, seed, scale: scale.clone() })?;
        }
        Ok((scale, size))
    }

    /// Writes a scale down for all workers.
    fn remember(&mut self, line: ScaleLine) -> Result<()> {
        self.ledger.map_or(Ok(()), |ledger| ledger.scale(&line))?;
        self.told.push(line);
        Ok(())
    }
}

/// Names of the library that a case goes without.
fn left_out(case: &Case, folder: &Path) -> Result<Vec<String>> {
    let CaseTask::LeftOut(effect) = case.task else { return Ok(Vec::new()) };
    let views = read(folder, &[], &DiagnosisOptions::default())?.isolability;
    let ids = views.iter().flat_map(|view| view.effects.iter());
    Ok(ids.filter(|id| code(id) == code(effect.id)).map(|id| (*id).to_owned()).collect())
}

/// What a diagnosis says of a folder.
struct Found {
    answer: RecordedAnswer,
    /// The block where most was found.
    judged: Option<Judged>,
    /// The experiment that an ambiguous answer asks for.
    proposed: Option<ProposedExperiment>,
}

/// Diagnoses a folder: nothing of the truth comes here.
fn answer(folder: &Path, options: &DiagnosisOptions) -> Found {
    match read(folder, &[], options).and_then(|prepared| Ok(prepared.diagnose()?)) {
        Ok((diagnosis, judged)) => {
            let (answer, judged) = told(&diagnosis, judged);
            Found { answer, judged, proposed: diagnosis.proposed.filter(ProposedExperiment::separates) }
        }
        Err(error) => Found { answer: refused(error.to_string()), judged: None, proposed: None },
    }
}

/// Recordings of a path that an experiment asks for, files by name and text; nothing of a bench that follows none.
type Follow<'a> = &'a dyn Fn(&Told, u64) -> Result<Option<Vec<(String, String)>>>;

/// Runs the experiments that ambiguous answers propose, and gives the answers with their recordings added.
fn after(
    follow: Follow<'_>,
    exhibit: &RecordingsFolder,
    options: &DiagnosisOptions,
    mut proposed: Option<ProposedExperiment>,
) -> Result<Vec<RecordedAnswer>> {
    let mut answers = Vec::new();
    for number in 1..=EXPERIMENTS {
        let Some(ProposedExperiment { step, path, repeats, .. }) = proposed.take() else { break };
        let Some(recordings) = follow(&Told { step_s: step, path, repeats: repeats as u64 }, number)? else { break };
        exhibit.add(&recordings)?;
        let found = answer(exhibit.path(), options);
        proposed = found.proposed;
        answers.push(found.answer);
    }
    Ok(answers)
}

fn refused(refusal: String) -> RecordedAnswer {
    RecordedAnswer {
        said: RecordedVerdict::Refused,
        effects: Vec::new(),
        blocks: Vec::new(),
        partner_missing: false,
        experiment: None,
        gain: None,
        gain_elsewhere: None,
        refusal: Some(refusal),
    }
}

fn told(diagnosis: &Diagnosis, judged: Vec<Judged>) -> (RecordedAnswer, Option<Judged>) {
    let of = |found: &EffectFound| {
        let own = judged.iter().find(|judged| judged.block.name == found.block);
        let parameters = own.map_or_else(Default::default, |own| estimates(found, own));
        NamedCause { id: found.id.to_owned(), block: found.block.to_owned(), p: found.p, parameters }
    };
    let blocks: Vec<(String, RecordedVerdict)> =
        diagnosis.blocks.iter().map(|block| (block.block.to_owned(), block.answer.into())).collect();
    let mut effects: Vec<NamedCause> = diagnosis.effects.iter().map(of).collect();
    effects.sort_by(|a, b| b.p.total_cmp(&a.p));
    let answer = RecordedAnswer {
        said: diagnosis.answer.into(),
        effects,
        blocks,
        partner_missing: diagnosis.blocks.iter().any(|block| !block.partner_missing.is_empty()),
        experiment: diagnosis.experiment.clone(),
        gain: diagnosis.gain.map(|gain| [gain.value, gain.lo, gain.hi]),
        gain_elsewhere: diagnosis.gain.and_then(|gain| gain.elsewhere).map(|Bounds { lo, hi }| [lo, hi]),
        refusal: None,
    };
    let main = |block: &&BlockAnswer| !block.effects.is_empty() && block.gain == diagnosis.gain;
    let main = diagnosis.blocks.iter().find(main).map(|block| block.block);
    (answer, judged.into_iter().find(|judged| Some(judged.block.name) == main))
}

/// The numbers of a cause with what the curvature of the likelihood says of them.
fn estimates(found: &EffectFound, judged: &Judged) -> std::collections::BTreeMap<String, RecordedEstimate> {
    let Judged { block, library, judgement, .. } = judged;
    // Several hypotheses may be forms of one effect.
    let is_own = |number: &usize| library[*number].effect.id == found.id;
    let with = judgement.ranking.iter().find(|c| c.admissible && c.hypotheses.iter().any(is_own));
    let curvature = with.map(|candidate| (candidate, evidence(&candidate.fitted, 1.0).covariance));
    let of = |(name, told): (&String, &softdock_diagnosis::answer::ParameterEstimate)| {
        let place = curvature.as_ref().and_then(|(candidate, covariance)| {
            let place = candidate.fitted.unknowns.iter().position(|unknown| unknown.name == *name)?;
            let (unknown, z) = (&candidate.fitted.unknowns[place], candidate.fitted.z[place]);
            let sd = covariance[(place, place)].sqrt();
            let slope = 0.5 * (unknown.prior.value(z + sd) - unknown.prior.value(z - sd));
            Some((slope.abs(), block.base[unknown.field]))
        });
        let (sd, nominal) = place.unwrap_or_default();
        (name.clone(), RecordedEstimate { value: told.value, lo: told.lo, hi: told.hi, sd, nominal })
    };
    found.parameters.iter().map(of).collect()
}

#[cfg(test)]
mod tests;
