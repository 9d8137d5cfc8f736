//! Diagnosis from a model and recordings to an answer: blocks, convergence of the step, judgement, decision.

use crate::data::drive_log::DriveLog;
use crate::data::grid::{Finding, Piece};
use crate::data::hold_out::Every;
use crate::inference::judge::{explains_better, judge, numerical_error};
use crate::inference::unmodelled::is_simpler;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::isolability::BlockView;
use crate::plants::command::packets;
use crate::plants::command::timing;
use crate::plants::drive::controller::torques_between;
use crate::plants::drive::dictionary::forms;
use crate::plants::drive::unit_checks::check_units;
use crate::plants::facility::block::FacilityModel;
use crate::plants::sensor::excess_noise::excess_noise;
use crate::propose::experiment::ProposedExperiment;
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound, Gain, NotVisible, Residual, RuledOut};
use crate::verdict::decide::decide;
use crate::verdict::free_run::FreeRun;
use crate::verdict::judged::{Blocks, Judged};
use crate::{DiagnosisError, Result};
use serde::Serialize;
use softdock_campaign::Rig;
use softdock_campaign::rig::{RigModel, TossRig};
use softdock_engine::blocks::BlockKind;
use softdock_engine::simulator::Simulator;
use std::cell::OnceCell;
use std::collections::BTreeSet;

mod axes;
mod blocks;
mod facility;
mod prepare;
mod proposal;
mod summed;
mod torque;
mod views;

use axes::{Axes, PASSES};
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

/// Model with its recordings.
enum Subject {
    Rig(Box<Rig>, Vec<Piece>),
    Facility(Box<FacilityModel>, Vec<DriveLog>),
}

/// Recordings that are ready for the diagnosis.
pub struct Prepared {
    subject: Subject,
    held_out: BTreeSet<String>,
    without: Vec<String>,
    /// How many times shorter than usual the first steps are.
    first: usize,
    /// The torque of each recording of a drive between the log's samples too, once its controller is understood.
    torque: Vec<Vec<f64>>,
    simulator: Simulator,
    /// What the axes of a robot carry, once it was asked for.
    axes: OnceCell<Axes>,
    /// Reasons why the answer is provisional.
    pub provisional: Vec<String>,
    /// Findings in the recordings.
    pub findings: Vec<Finding>,
    /// Isolability of blocks and effects by the recorded channels.
    pub isolability: Vec<BlockView>,
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
    /// Findings in the recordings.
    pub findings: Vec<Finding>,
    /// Discretisation error of each block: mean square change of the whitened residuals with half the step.
    pub numerical_error: Vec<f64>,
}

impl Prepared {
    fn new(
        subject: Subject,
        held_out: BTreeSet<String>,
        provisional: Vec<String>,
        findings: Vec<Finding>,
        options: &DiagnosisOptions,
    ) -> Self {
        Self {
            subject,
            held_out,
            without: options.without.clone(),
            first: options.first(),
            torque: Vec::new(),
            simulator: options.simulator.clone(),
            axes: OnceCell::new(),
            provisional,
            findings,
            isolability: Vec::new(),
        }
    }

    /// Adds the isolability of the channels.
    fn seen(mut self) -> Result<Self> {
        self.isolability = self.views()?;
        Ok(self)
    }

    /// What a rig is; a facility is none.
    fn plant(&self) -> Option<&RigModel> {
        match &self.subject {
            Subject::Rig(rig, _) => Some(&rig.plant),
            Subject::Facility(..) => None,
        }
    }

    /// Recordings of a rig.
    fn pieces(&self) -> &[Piece] {
        match &self.subject {
            Subject::Rig(_, pieces) => pieces,
            Subject::Facility(..) => &[],
        }
    }

    fn has(&self, signal: &str) -> bool {
        self.pieces().iter().all(|piece| piece.signals.contains_key(signal))
    }

    /// Diagnoses every block.
    ///
    /// # Errors
    /// A channel without any noise, a simulation that no step makes exact enough.
    pub fn diagnose(mut self) -> Result<(Diagnosis, Vec<Judged>)> {
        let mut prismatic = false;
        if let Some(RigModel::Drive(rig)) = self.plant() {
            prismatic = rig.prismatic;
            let suspects = check_units(rig, self.pieces());
            self.findings.extend(suspects);
        }
        let mut timed = Vec::new();
        if let Some(RigModel::Command(rig)) = self.plant() {
            prismatic = rig.prismatic;
            let findings;
            (timed, findings) = timing::answers(rig, self.pieces());
            self.findings.extend(findings);
        }
        let mut all = self.judged(prismatic)?;
        for _ in 1..PASSES {
            if !self.update_loads(&all) {
                break;
            }
            all = self.judged(prismatic)?;
        }
        self.withhold_loaded(&mut all);
        let Blocks { answers, judged, errors } = all;
        let proposed = answers.iter().zip(&judged).find_map(|(answer, own)| {
            (answer.answer == DiagnosisVerdict::Ambiguous).then(|| self.proposed(own)).flatten()
        });
        let answers = timed.into_iter().chain(answers).collect();
        Ok((Diagnosis { proposed, ..summed(self, answers, errors) }, judged))
    }

    /// Judges every block by what is known by now.
    fn judged(&mut self, prismatic: bool) -> Result<Blocks> {
        let mut all = Blocks::default();
        for place in 0..self.places() {
            let Exact { block, library, finer, error } = self.exact_enough(place)?;
            all.errors.push(error);
            self.report_kept_step(&block, error);
            let is_left_out = |hypothesis: &Hypothesis| self.without.iter().any(|id| id == hypothesis.effect.id);
            let (missing, library): (Vec<Hypothesis>, Vec<Hypothesis>) = library.into_iter().partition(is_left_out);
            let missing: Vec<&'static str> = missing.iter().map(|hypothesis| hypothesis.effect.id).collect();
            let dictionary = forms(&block);
            let judgement = judge(&block, &finer, &library).ok_or_else(|| silent(&block))?;
            let mut answer = decide(&block, &library, &missing, &judgement, prismatic);
            if answer.answer.names() && is_simpler(&block, &library, &dictionary, &judgement) {
                answer = answer.without_name();
            }
            let mut own = Judged { block, library, dictionary, judgement, outside: None };
            answer = own.looked_outside(answer, prismatic);
            answer.torque_error = own.torque_error(&answer);
            if let Some(found) = own.found(&answer).filter(|_| own.block.section.is(BlockKind::Controller)) {
                self.torque = self.moving(torques_between(&own.block, found));
            }
            if let Some(RigModel::Toss(rig)) = self.plant() {
                answer.free_run = self.free_run(rig, &own, &answer);
            }
            let explained = own.found(&answer).map(|found| found.fitted.values(&own.block.base));
            answer = match own.block.grew(explained.as_ref().unwrap_or(&own.block.base)) {
                true => self.changing(&own.block, answer),
                false => self.with_random(&own.block, answer),
            };
            all.answers.push(answer);
            all.judged.push(own);
        }
        self.withhold(&mut all, prismatic);
        Ok(all)
    }

    /// How free runs of a tossed body do, on what is held out if anything is.
    fn free_run(&self, rig: &TossRig, judged: &Judged, answer: &BlockAnswer) -> Option<FreeRun> {
        let own = |piece: &&Piece| self.held_out.contains(&piece.experiment) == answer.held_out;
        FreeRun::of(rig, &self.pieces().iter().filter(own).collect::<Vec<_>>(), answer.held_out, judged)
    }

    /// Returns the answer without a cause, because the repeat-to-repeat difference grew with the session time: no effect of
    /// a library explains that, and it is not separable from noise.
    fn changing(&mut self, block: &MeasuredBlock, answer: BlockAnswer) -> BlockAnswer {
        let what = "the repeat-to-repeat difference grows with the session time and with the signal: a drift that is not \
                    in the library, such as a temperature-dependent gain; repeat one experiment until the drift settles";
        self.findings.push(Finding { recording: block.name.to_owned(), what: what.to_owned() });
        answer.without_name()
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

    /// The answer with the effects that have no mean.
    fn with_random(&self, block: &MeasuredBlock, answer: BlockAnswer) -> BlockAnswer {
        match self.plant() {
            Some(RigModel::Sensor(rig)) => match excess_noise(rig, block) {
                Some(noise) => answer.with_noise(&noise, &self.without),
                None => answer,
            },
            Some(RigModel::Command(rig)) => packets::with_random(rig, self.pieces(), block, &self.without, answer),
            _ => answer,
        }
    }

    /// Returns the log-odds of a zero-mean effect (jitter, losses, noise) from repeat-to-repeat variance; `None` if
    /// these recordings do not determine them.
    pub fn odds_by_repeats(&self, id: &str) -> Option<f64> {
        let block = || self.block(0, self.first).0;
        match self.plant()? {
            RigModel::Sensor(rig) => excess_noise(rig, &block()).map(|noise| noise.log_odds),
            RigModel::Command(rig) => packets::odds(rig, self.pieces(), &block(), id),
            _ => None,
        }
    }

    /// The block at a place, in usual steps or so short ones that half of them changes nothing that matters.
    fn exact_enough(&self, place: usize) -> Result<Exact> {
        let (mut finer, mut coarse, mut usual) = (self.first, self.block(place, self.first), None);
        loop {
            let fine = self.block(place, 2 * finer);
            let error = numerical_error(&coarse.0, &fine.0).ok_or_else(|| silent(&coarse.0))?;
            if error < NUMERICAL {
                let exact = Exact { block: coarse.0, library: coarse.1, finer: fine.0, error };
                return Ok(match usual.filter(|_| matches!(self.subject, Subject::Facility(..))) {
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
