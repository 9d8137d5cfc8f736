//! Trial of a case: detection limit, recordings, seal, diagnosis, and only then the computations that require the
//! truth.

use crate::baseline::Baselines;
use crate::plan::{Case, CaseTask, MachineKind};
use crate::record::{CaseRecord, Ledger, NamedCause, RecordedAnswer, RecordedEstimate, RecordedVerdict, SealLine};
use crate::recordings_folder::{RecordingsFolder, read};
use crate::seal::{SealedTruth, seal};
use crate::sizing::Oracles;
use crate::true_gain::true_gain;
use crate::{GauntletError, Result};
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions};
use softdock_diagnosis::inference::evidence::evidence;
use softdock_diagnosis::propose::experiment::ProposedExperiment;
use softdock_diagnosis::verdict::answer::{BlockAnswer, Bounds, EffectFound};
use softdock_diagnosis::verdict::judged::Judged;
use softdock_gauntlet::{CommandedPath, Hidden, follow, further, generate};
use softdock_kernels::effects::code;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Largest number of consecutive experiments of ambiguous answers.
const EXPERIMENTS: u64 = 2;

/// Number of further sets of repeats for the true gain, so that its own sampling error is negligible.
const AGAIN: u64 = 4;

/// Runner of cases; cases with the same seed share their oracles.
pub struct TrialRunner<'a> {
    ledger: &'a Ledger,
    oracles: Oracles<'a>,
    baselines: Baselines,
}

impl<'a> TrialRunner<'a> {
    /// Builds a runner that writes to a ledger.
    ///
    /// # Errors
    /// A ledger that cannot be read.
    pub fn new(ledger: &'a Ledger) -> Result<Self> {
        Ok(Self { ledger, oracles: Oracles::of(ledger)?, baselines: Baselines::default() })
    }

    /// Runs a case and writes its record.
    ///
    /// # Errors
    /// A case that the generator rejects, or files that cannot be written. A rejection by the diagnosis is an answer.
    pub fn run(&mut self, case: &Case) -> Result<CaseRecord> {
        let begin = Instant::now();
        let hiding = self.oracles.sized(case)?;
        let hidden = hiding.all();
        let set =
            hidden.as_ref().map(|hidden| generate(case.plant.rig, hidden, case.noise, case.seed())).transpose()?;
        let sealed = seal(self.ledger.folder(), &SealedTruth::of(case, &hiding, set.as_ref()))?;
        self.ledger.seal(&SealLine { case: case.id(), sealed: sealed.clone() })?;
        let mut record = CaseRecord::of(case.id(), sealed);
        if let (Some(set), Some(hidden)) = (set, hidden) {
            let recordings = RecordingsFolder::of(&set)?;
            let options =
                DiagnosisOptions { without: left_out(case, recordings.path())?, ..DiagnosisOptions::default() };
            let start = Instant::now();
            let found = answer(recordings.path(), &options);
            record.cost.diagnosis = start.elapsed().as_secs_f64();
            record.answer = Some(found.answer.clone());
            // No demand on a perturbed machine asks for more.
            if case.machine == MachineKind::Exact {
                self.compare(case, &hidden, &recordings, &options, found, &mut record)?;
            }
        }
        record.cost.rest = begin.elapsed().as_secs_f64() - record.cost.diagnosis;
        self.ledger.finish(&record)?;
        Ok(record)
    }

    /// Adds the true gain of an answer, the baseline methods, and the answers after the proposed experiments.
    fn compare(
        &mut self,
        case: &Case,
        hidden: &[Hidden],
        recordings: &RecordingsFolder,
        options: &DiagnosisOptions,
        found: Found,
        record: &mut CaseRecord,
    ) -> Result<()> {
        let Found { answer, judged, proposed, .. } = found;
        let (rig, noise, seed) = (case.plant.rig, case.noise, case.seed());
        let is_named = answer.verdict == RecordedVerdict::Named && !matches!(case.task, CaseTask::Null);
        if let Some(judged) = judged.filter(|_| is_named) {
            record.gain = true_gain(recordings.path(), &judged, &further(rig, hidden, noise, seed, AGAIN)?)?;
        }
        // The baselines get the recordings that the first answer had.
        if case.plant.baselines && !matches!(case.task, CaseTask::LeftOut(_)) {
            record.baselines = self.baselines.answers(case, recordings.path())?;
        }
        let follow = |commanded: &CommandedPath, number: u64| Ok(follow(rig, hidden, noise, seed, commanded, number)?);
        record.after = after(&follow, recordings, options, proposed)?;
        Ok(())
    }
}

/// Writes a case's model, recordings and sealed truth. Returns whether its size is within the range of the generator.
///
/// # Errors
/// A case that the generator rejects, or a folder that cannot be written.
pub fn lay_out(case: &Case, folder: &Path) -> Result<bool> {
    let hiding = Oracles::default().sized(case)?;
    let Some(hidden) = hiding.all() else { return Ok(false) };
    let set = generate(case.plant.rig, &hidden, case.noise, case.seed())?;
    set.write(folder).map_err(GauntletError::file(folder))?;
    seal(folder, &SealedTruth::of(case, &hiding, Some(&set)))?;
    Ok(true)
}

/// Returns the names that a case excludes from the library.
fn left_out(case: &Case, folder: &Path) -> Result<Vec<String>> {
    let CaseTask::LeftOut(effect) = case.task else { return Ok(Vec::new()) };
    let views = read(folder, &[], &DiagnosisOptions::default())?.isolability;
    let ids = views.iter().flat_map(|view| view.effects.iter());
    Ok(ids.filter(|id| code(id) == code(effect.id)).map(|id| (*id).to_owned()).collect())
}

/// Answer of a diagnosis for a folder.
pub(crate) struct Found {
    pub(crate) answer: RecordedAnswer,
    /// Relative torque error by block, as the model is.
    pub(crate) unexplained: BTreeMap<String, f64>,
    /// Block with the most severe verdict.
    judged: Option<Judged>,
    /// Experiment proposed by an ambiguous answer.
    proposed: Option<ProposedExperiment>,
}

/// Diagnoses a folder, without access to the truth.
pub(crate) fn answer(folder: &Path, options: &DiagnosisOptions) -> Found {
    match read(folder, &[], options).and_then(|prepared| Ok(prepared.diagnose()?)) {
        Ok((diagnosis, judged)) => {
            let error = |block: &BlockAnswer| Some((block.block.to_owned(), block.torque_error?.before));
            let unexplained = diagnosis.blocks.iter().filter_map(error).collect();
            let (answer, judged) = recorded(&diagnosis, judged);
            let proposed = diagnosis.proposed.filter(ProposedExperiment::separates);
            Found { answer, unexplained, judged, proposed }
        }
        Err(error) => {
            let (answer, unexplained) = (refused(error.to_string()), BTreeMap::new());
            Found { answer, unexplained, judged: None, proposed: None }
        }
    }
}

/// Function that returns the recordings of a proposed path, by file name and text; `None` for a rig that follows no
/// path.
type Follow<'a> = &'a dyn Fn(&CommandedPath, u64) -> Result<Option<Vec<(String, String)>>>;

/// Runs the experiments that ambiguous answers propose, and returns the answers with their recordings.
fn after(
    follow: Follow<'_>,
    recordings: &RecordingsFolder,
    options: &DiagnosisOptions,
    mut proposed: Option<ProposedExperiment>,
) -> Result<Vec<RecordedAnswer>> {
    let mut answers = Vec::new();
    for number in 1..=EXPERIMENTS {
        let Some(ProposedExperiment { step, path, repeats, .. }) = proposed.take() else { break };
        let Some(followed) = follow(&CommandedPath { step_s: step, path, repeats: repeats as u64 }, number)? else {
            break;
        };
        recordings.add(&followed)?;
        let found = answer(recordings.path(), options);
        proposed = found.proposed;
        answers.push(found.answer);
    }
    Ok(answers)
}

fn refused(refusal: String) -> RecordedAnswer {
    RecordedAnswer {
        verdict: RecordedVerdict::Refused,
        effects: Vec::new(),
        possible: Vec::new(),
        blocks: Vec::new(),
        partner_missing: false,
        experiment: None,
        gain: None,
        gain_elsewhere: None,
        refusal: Some(refusal),
    }
}

fn recorded(diagnosis: &Diagnosis, judged: Vec<Judged>) -> (RecordedAnswer, Option<Judged>) {
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
        verdict: diagnosis.answer.into(),
        effects,
        possible: diagnosis.blocks.iter().flat_map(possible).collect(),
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

/// Causes that an inadequate model leaves possible, with the block.
fn possible(block: &BlockAnswer) -> impl Iterator<Item = (String, String)> {
    block.possible.iter().map(|cause| (cause.id.to_owned(), block.block.to_owned()))
}

/// Returns the parameters of a cause with their Cramer-Rao standard deviations.
fn estimates(found: &EffectFound, judged: &Judged) -> BTreeMap<String, RecordedEstimate> {
    let Judged { block, library, judgement, .. } = judged;
    // Several hypotheses may be forms of one effect.
    let is_own = |number: &usize| library[*number].effect.id == found.id;
    let with = judgement.ranking.iter().find(|c| c.admissible && c.hypotheses.iter().any(is_own));
    let curvature = with.map(|candidate| (candidate, evidence(&candidate.fitted, 1.0).covariance));
    let of = |(name, estimate): (&String, &softdock_diagnosis::verdict::estimates::ParameterEstimate)| {
        let place = curvature.as_ref().and_then(|(candidate, covariance)| {
            let place = candidate.fitted.unknowns.iter().position(|unknown| unknown.name == *name)?;
            let (unknown, z) = (&candidate.fitted.unknowns[place], candidate.fitted.z[place]);
            let sd = covariance[(place, place)].sqrt();
            let slope = 0.5 * (unknown.prior.value(z + sd) - unknown.prior.value(z - sd));
            Some((slope.abs(), block.base[unknown.field]))
        });
        let (sd, nominal) = place.unwrap_or_default();
        (name.clone(), RecordedEstimate { value: estimate.value, lo: estimate.lo, hi: estimate.hi, sd, nominal })
    };
    found.parameters.iter().map(of).collect()
}

#[cfg(test)]
mod tests;
