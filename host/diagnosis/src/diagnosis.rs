//! Diagnosis from a model and recordings to an answer: blocks, convergence of the step, judgement, decision.

use crate::data::grid::Finding;
use crate::data::hold_out::Every;
use crate::data::quality::RecordingQuality;
use crate::data::recordings::Recordings;
use crate::inference::identifiability::{BlockIdentifiability, identifiability};
use crate::inference::judge::{SMALL_TREND, explains_better, judge, numerical_error};
use crate::inference::unmodelled::is_simpler;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::plants::DiagnosedPlant;
use crate::propose::experiment::ProposedExperiment;
use crate::propose::motion::proposed;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound, Gain, NotVisible, Residual, RuledOut};
use crate::verdict::decide::decide;
use crate::verdict::judged::{Blocks, Judged};
use crate::verdict::reconcile::reconcile;
use crate::{DiagnosisError, Result};
use serde::Serialize;
use softdock_engine::simulator::Simulator;
use std::collections::BTreeSet;

mod facility;
mod prepare;
mod summed;

pub use facility::prepare_facility;
pub use prepare::prepare;
use summed::summed;

/// Options of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct DiagnosisOptions {
    /// Time from which each recording is held out \[s\].
    pub hold_out_from: Option<f64>,
    /// Experiments that are held out, by their numbers.
    pub hold_out_experiments: Option<Every>,
    /// Catalogue ids that the library excludes.
    pub without: Vec<String>,
    /// Whether to simulate with half the usual step, to check that the answer does not depend on it.
    pub half_step: bool,
    /// Simulator.
    pub simulator: Simulator,
}

impl DiagnosisOptions {
    /// How many times shorter than usual the first steps are.
    fn first(&self) -> usize {
        if self.half_step { 2 } else { 1 }
    }
}

/// Recordings that are ready for the diagnosis.
pub struct Prepared {
    plant: Box<dyn DiagnosedPlant>,
    recordings: Recordings,
    without: Vec<String>,
    /// How many times shorter than usual the first steps are.
    first: usize,
    simulator: Simulator,
    /// Reasons why the answer is provisional.
    pub provisional: Vec<String>,
    /// Findings in the recordings.
    pub findings: Vec<Finding>,
    /// Quality of the recordings, signal by signal.
    pub data_quality: Vec<RecordingQuality>,
    /// Isolability of blocks and effects by the recorded channels.
    pub isolability: Vec<BlockView>,
    /// Identifiability block by block, once computed.
    identifiability: Option<Vec<BlockIdentifiability>>,
}

/// Result of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The answer.
    pub answer: DiagnosisVerdict,
    /// Whether the answer is provisional: no repeats, or no different motion held out.
    pub provisional: bool,
    /// Why it is provisional.
    pub reasons: Vec<String>,
    /// The causes.
    pub effects: Vec<EffectFound>,
    /// What was ruled out.
    pub ruled_out: Vec<RuledOut>,
    /// Gain on held-out motion in the block with the most severe verdict.
    pub gain: Option<Gain>,
    /// Residual before and after in that block.
    pub residual: Residual,
    /// Causes that are not detectable with these data.
    pub not_visible: Vec<NotVisible>,
    /// Discriminating experiment of the rivals.
    pub experiment: Option<String>,
    /// Most discriminating motion.
    pub proposed: Option<ProposedExperiment>,
    /// Answers block by block.
    pub blocks: Vec<BlockAnswer>,
    /// Isolability of blocks and effects by the recorded channels.
    pub isolability: Vec<BlockView>,
    /// Identifiability of parameters and effects, block by block.
    pub identifiability: Vec<BlockIdentifiability>,
    /// Findings in the recordings.
    pub findings: Vec<Finding>,
    /// Quality of the recordings, signal by signal.
    pub data_quality: Vec<RecordingQuality>,
    /// Discretisation error of each block: mean square change of the whitened residuals with half the step.
    pub numerical_error: Vec<f64>,
}

impl Prepared {
    fn new(
        mut plant: Box<dyn DiagnosedPlant>,
        recordings: Recordings,
        provisional: Vec<String>,
        findings: Vec<Finding>,
        options: &DiagnosisOptions,
    ) -> Self {
        plant.exclude(&options.without);
        Self {
            plant,
            recordings,
            without: options.without.clone(),
            first: options.first(),
            simulator: options.simulator.clone(),
            provisional,
            findings,
            data_quality: Vec::new(),
            isolability: Vec::new(),
            identifiability: None,
        }
    }

    /// Adds the isolability of the channels.
    fn seen(mut self) -> Result<Self> {
        self.isolability = self.views()?;
        Ok(self)
    }

    /// The rows of the isolability matrix, block by block.
    ///
    /// # Errors
    /// A signal that the plant cannot be judged without, an id that is in no library.
    fn views(&self) -> Result<Vec<BlockView>> {
        self.plant.require(&self.recordings)?;
        let views = self.plant.views(&self.recordings, &self.blocks(1));
        let known: BTreeSet<&str> = views.iter().flat_map(|view| view.effects.iter().copied()).collect();
        if let Some(id) = self.without.iter().find(|id| !known.contains(id.as_str())) {
            let known: Vec<&str> = known.into_iter().collect();
            return Err(DiagnosisError::unfit(
                format!("no block has an effect `{id}`"),
                format!("write one of: {}", known.join(", ")),
            ));
        }
        Ok(views)
    }

    /// All blocks, simulated in steps so many times finer than usual.
    pub fn blocks(&self, finer: usize) -> Vec<(MeasuredBlock, Vec<Hypothesis>)> {
        (0..self.plant.places(&self.recordings)).map(|place| self.block(place, finer)).collect()
    }

    /// The block at a place by the simulator that was chosen, with its library.
    fn block(&self, place: usize, finer: usize) -> (MeasuredBlock, Vec<Hypothesis>) {
        let block = self.plant.block(&self.recordings, place, finer);
        let block = MeasuredBlock { simulator: self.simulator.clone(), ..block };
        let library = self.plant.library(&self.recordings, place, &block);
        (block, library)
    }

    /// Returns which parameters and effects these motions determine, block by block, before any answer; computed once.
    pub fn identifiability(&mut self) -> &[BlockIdentifiability] {
        if self.identifiability.is_none() {
            let blocks = self.blocks(self.first);
            let without = |hypothesis: &Hypothesis| self.without.iter().all(|id| id != hypothesis.effect.id);
            let of = |(block, library): (MeasuredBlock, Vec<Hypothesis>)| {
                let library: Vec<Hypothesis> = library.into_iter().filter(without).collect();
                identifiability(&block, &library)
            };
            let before = self.plant.identifiability_before_blocks(&self.recordings, &blocks);
            let mut all: Vec<BlockIdentifiability> =
                before.into_iter().chain(blocks.into_iter().filter_map(of)).collect();
            for row in all.iter_mut().flat_map(|block| &mut block.rows) {
                row.session = row.id.and_then(|id| self.plant.session(id));
            }
            self.identifiability = Some(all);
        }
        self.identifiability.as_deref().unwrap_or_default()
    }

    /// Diagnoses every block.
    ///
    /// # Errors
    /// A channel without any noise, a simulation that no step makes exact enough.
    pub fn diagnose(mut self) -> Result<(Diagnosis, Vec<Judged>)> {
        self.identifiability();
        let (timed, findings) = self.plant.before_blocks(&self.recordings);
        self.findings.extend(findings);
        let mut all = self.judged()?;
        while self.plant.update(&self.recordings, &all) {
            all = self.judged()?;
        }
        self.findings.extend(self.plant.withhold_at_last(&mut all));
        let Blocks { answers, judged, errors } = all;
        let proposed = answers.iter().zip(&judged).find_map(|(answer, own)| {
            let is_ambiguous = answer.answer == DiagnosisVerdict::Ambiguous;
            is_ambiguous.then(|| proposed(self.plant.as_ref(), &self.recordings, own)).flatten()
        });
        let mut answers: Vec<BlockAnswer> = timed.into_iter().chain(answers).collect();
        let mut identifiability = self.identifiability.take().unwrap_or_default();
        reconcile(&mut answers, &mut identifiability);
        Ok((Diagnosis { proposed, identifiability, ..summed(self, answers, errors) }, judged))
    }

    /// Judges every block by what is known by now.
    fn judged(&mut self) -> Result<Blocks> {
        let prismatic = self.plant.is_prismatic();
        let mut all = Blocks::default();
        for place in 0..self.plant.places(&self.recordings) {
            let Exact { block, library, finer, error } = self.exact_enough(place)?;
            all.errors.push(error);
            self.report_kept_step(&block, error);
            let is_left_out = |hypothesis: &Hypothesis| self.without.iter().any(|id| id == hypothesis.effect.id);
            let (missing, library): (Vec<Hypothesis>, Vec<Hypothesis>) = library.into_iter().partition(is_left_out);
            let missing: Vec<&'static str> = missing.iter().map(|hypothesis| hypothesis.effect.id).collect();
            let dictionary = self.plant.dictionary(&block);
            let judgement = judge(&block, &finer, &library).ok_or_else(|| silent(&block))?;
            let mut answer = decide(&block, &library, &missing, &judgement, prismatic);
            if answer.answer.names() && is_simpler(&block, &library, &dictionary, &judgement) {
                answer = answer.without_name();
            }
            let mut own = Judged { block, library, dictionary, judgement, outside: None };
            answer = own.looked_outside(answer, prismatic);
            answer = own.with_errors(answer);
            self.plant.learn(&self.recordings, self.first, &own, &answer);
            answer = self.plant.complete(&self.recordings, &own, answer);
            answer = self.without_drift(&own, answer);
            all.answers.push(answer);
            all.judged.push(own);
        }
        self.findings.extend(self.plant.withhold(&mut all));
        Ok(all)
    }

    /// Returns the answer for a block whose repeats may drift over the session: no effect of a library explains that, and it
    /// is not separable from noise. A drift that is small beside what a cause explains is a finding beside it; otherwise no
    /// cause is named.
    fn without_drift(&mut self, own: &Judged, answer: BlockAnswer) -> BlockAnswer {
        let base = &own.block.base;
        let share = match own.found(&answer) {
            Some(found) => {
                own.block.shares_of_trend(&own.judgement.clamped.values(base), &[found.fitted.values(base)])[0]
            }
            None => own.block.grew(base).then_some(f64::INFINITY),
        };
        let Some(share) = share else {
            return self.plant.with_random(&self.recordings, &own.block, &self.without, answer);
        };
        let is_small = share < SMALL_TREND;
        let beside = if is_small { " (small beside what the named cause explains)" } else { "" };
        let what = format!(
            "the repeat-to-repeat difference grows with the session time and with the signal{beside}: a drift that is not in \
             the library, such as a temperature-dependent gain; repeat one experiment until the drift settles"
        );
        self.findings.push(Finding { recording: own.block.name.to_owned(), what });
        if is_small { answer } else { answer.without_name() }
    }

    /// Reports that the step size of a scenario was kept although it is not converged.
    fn report_kept_step(&mut self, block: &MeasuredBlock, error: f64) {
        if error >= NUMERICAL {
            let what = format!(
                "simulated with the step of the scenario, which explains these drives better than a converged step does \
                 (as for an emulated facility): halving the step changes the residual by {:.2} times the noise",
                error.sqrt()
            );
            self.findings.push(Finding { recording: block.name.to_owned(), what });
        }
    }

    /// Returns the log-odds of a zero-mean effect (jitter, losses, noise) from repeat-to-repeat variance; `None` if
    /// these recordings do not determine them.
    pub fn odds_by_repeats(&self, id: &str) -> Option<f64> {
        self.plant.odds_by_repeats(&self.recordings, &|| self.block(0, self.first).0, id)
    }

    /// The block at a place, in usual steps or so short ones that half of them changes nothing that matters.
    fn exact_enough(&self, place: usize) -> Result<Exact> {
        let (mut finer, mut coarse, mut usual) = (self.first, self.block(place, self.first), None);
        loop {
            let fine = self.block(place, 2 * finer);
            let error = numerical_error(&coarse.0, &fine.0).ok_or_else(|| silent(&coarse.0))?;
            if error < NUMERICAL {
                let exact = Exact { block: coarse.0, library: coarse.1, finer: fine.0, error };
                return Ok(match usual.filter(|_| self.plant.keeps_usual_steps()) {
                    Some(usual) => exact.unless_modelled(usual),
                    None => exact,
                });
            }
            finer *= 2;
            if finer > FINEST {
                let what = format!(
                    "{}: halving the step still changes the residual by {error:.2} of the noise",
                    coarse.0.name
                );
                return Err(DiagnosisError::unfit(what, "check the stiffness and damping of the model file"));
            }
            let longer = std::mem::replace(&mut coarse, fine);
            usual = usual.or(Some(Usual { block: longer.0, library: longer.1, error }));
        }
    }
}

/// A block in steps that are short enough.
struct Exact {
    block: MeasuredBlock,
    library: Vec<Hypothesis>,
    /// The same block in shorter steps: half as long, or exact ones where longer are kept.
    finer: MeasuredBlock,
    /// Mean square of what steps half as long change in the whitened residuals.
    error: f64,
}

/// A block in usual steps, where those are too long to be exact.
struct Usual {
    block: MeasuredBlock,
    library: Vec<Hypothesis>,
    /// Mean square of what steps half as long change in the whitened residuals.
    error: f64,
}

impl Exact {
    /// The block of a facility in the steps of its scenario, if they explain the recordings better than exact ones do: an
    /// emulated facility moves in them, and what they do to its robots would be taken for an effect.
    fn unless_modelled(self, usual: Usual) -> Self {
        match explains_better(&usual.block, &self.block) {
            true => Self { block: usual.block, library: usual.library, finer: self.block, error: usual.error },
            false => self,
        }
    }
}

/// Mean square by which half the step may change the whitened residuals.
const NUMERICAL: f64 = 0.01;
/// How many times finer than usual a step may become.
const FINEST: usize = 16;

fn silent(block: &MeasuredBlock) -> DiagnosisError {
    let channels: Vec<&str> = block.channels.iter().map(|channel| channel.name).collect();
    DiagnosisError::unfit(
        format!("{}: {} is constant, or its repeats are identical", block.name, channels.join(" or ")),
        "check the column in [log]; repeats must be measured, not copied",
    )
}
