//! From a rig's model and its recordings to an answer: blocks, numerical gate, judgement, decision.

use crate::answer::{BlockAnswer, EffectFound, Gain, NotVisible, Residual, RuledOut, Verdict};
use crate::block::MeasuredBlock;
use crate::block::controller::torques_between;
use crate::block::facility::FacilityModel;
use crate::decide::decide;
use crate::experiment::Experiment;
use crate::free_run::FreeRun;
use crate::hold_out::Every;
use crate::isolability::BlockView;
use crate::judge::{Candidate, Judgement, explains_better, judge, numerical_error};
use crate::library::Hypothesis;
use crate::outside::{Outside, is_simpler};
use crate::packets;
use crate::recording::drive_log::DriveLog;
use crate::recording::grid::{Finding, Piece};
use crate::suspects::suspects;
use crate::timing;
use crate::torque_error::TorqueError;
use crate::variance::excess_noise;
use crate::{Error, Result};
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

/// How a diagnosis is made.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Holds out what each recording has from this time on \[s\].
    pub hold_out_from: Option<f64>,
    /// Holds out experiments by their numbers.
    pub hold_out_experiments: Option<Every>,
    /// Catalogue ids that the library goes without.
    pub without: Vec<String>,
    /// Simulates in steps half as long as usual: an answer must not depend on them.
    pub half_step: bool,
    /// Who simulates.
    pub simulator: Simulator,
}

impl Options {
    /// How many times shorter than usual the first steps are.
    fn first(&self) -> usize {
        if self.half_step { 2 } else { 1 }
    }
}

/// What is diagnosed, with its recordings.
enum Subject {
    Rig(Box<Rig>, Vec<Piece>),
    Facility(Box<FacilityModel>, Vec<DriveLog>),
}

/// Recordings, ready to be judged.
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
    /// Reasons why the answer can be provisional only.
    pub provisional: Vec<String>,
    /// What was found in the recordings.
    pub findings: Vec<Finding>,
    /// Which blocks and effects these channels can tell apart.
    pub isolability: Vec<BlockView>,
}

/// A diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The answer.
    pub answer: Verdict,
    /// Whether it rests on data that cannot bear more: no repeats, or no different motion held out.
    pub provisional: bool,
    /// Why it is provisional.
    pub reasons: Vec<String>,
    /// The causes.
    pub effects: Vec<EffectFound>,
    /// What was ruled out.
    pub ruled_out: Vec<RuledOut>,
    /// Gain on held-out motion in the block where most was found.
    pub gain: Option<Gain>,
    /// Residual before and after in that block.
    pub residual: Residual,
    /// What these data could not have shown.
    pub not_visible: Vec<NotVisible>,
    /// The experiment that would tell rivals apart.
    pub experiment: Option<String>,
    /// The motion that would do that best.
    pub proposed: Option<Experiment>,
    /// Block by block.
    pub blocks: Vec<BlockAnswer>,
    /// Which blocks and effects these channels can tell apart.
    pub isolability: Vec<BlockView>,
    /// What was found in the recordings.
    pub findings: Vec<Finding>,
    /// Mean square of what a step of half the length changes in the whitened residuals, block by block.
    pub numerical_error: Vec<f64>,
}

/// What a diagnosis leaves for its page.
pub struct Judged {
    /// The block.
    pub block: MeasuredBlock,
    /// Its library.
    pub library: Vec<Hypothesis>,
    /// What the data say of it.
    pub judgement: Judgement,
    /// What is wrong that no cause of the library explains.
    pub outside: Option<Outside>,
}

impl Judged {
    /// The fit that an answer rests on: of what was named, or of the form that something outside the library has.
    pub fn found(&self, answer: &BlockAnswer) -> Option<&Candidate> {
        let named = self.judgement.ranking.iter().find(|candidate| candidate.sound && !answer.effects.is_empty());
        let form = self.outside.as_ref().and_then(|outside| outside.form.as_ref());
        named.or(form.map(|form| &form.candidate))
    }

    /// An answer with what it behaves like, if no cause of the library explains it.
    fn looked_outside(&mut self, answer: BlockAnswer, prismatic: bool) -> BlockAnswer {
        let is_outside = answer.answer == Verdict::NotInLibrary;
        self.outside = is_outside.then(|| Outside::of(&self.block, &self.library, &self.judgement));
        match self.outside.as_ref().and_then(|outside| outside.form.as_ref()) {
            Some(form) => answer.with_form(form, prismatic),
            None => answer,
        }
    }

    fn torque_error(&self, answer: &BlockAnswer) -> Option<TorqueError> {
        let before = &self.judgement.clamped;
        let after = self.found(answer).map_or(before, |found| &found.fitted);
        TorqueError::of(&self.block, answer.held_out, [before, after])
    }
}

impl Prepared {
    fn new(
        subject: Subject,
        held_out: BTreeSet<String>,
        provisional: Vec<String>,
        findings: Vec<Finding>,
        options: &Options,
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

    /// The same with what its channels can tell apart.
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

    /// Judges every block.
    ///
    /// # Errors
    /// A channel without any noise, a simulation that no step makes exact enough.
    pub fn diagnose(mut self) -> Result<(Diagnosis, Vec<Judged>)> {
        let mut prismatic = false;
        if let Some(RigModel::Drive(rig)) = self.plant() {
            prismatic = rig.prismatic;
            let suspects = suspects(rig, self.pieces());
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
            if !self.carries_otherwise(&all) {
                break;
            }
            all = self.judged(prismatic)?;
        }
        self.withhold_loaded(&mut all);
        let Blocks { answers, judged, errors } = all;
        let proposed = answers
            .iter()
            .zip(&judged)
            .find_map(|(answer, own)| (answer.answer == Verdict::Ambiguous).then(|| self.proposed(own)).flatten());
        let answers = timed.into_iter().chain(answers).collect();
        Ok((Diagnosis { proposed, ..summed(self, answers, errors) }, judged))
    }

    /// Judges every block by what is known by now.
    fn judged(&mut self, prismatic: bool) -> Result<Blocks> {
        let mut all = Blocks::default();
        for place in 0..self.places() {
            let Exact { block, library, finer, error } = self.exact_enough(place)?;
            all.errors.push(error);
            self.tell_steps(&block, error);
            let is_left_out = |hypothesis: &Hypothesis| self.without.iter().any(|id| id == hypothesis.effect.id);
            let (missing, library): (Vec<Hypothesis>, Vec<Hypothesis>) = library.into_iter().partition(is_left_out);
            let missing: Vec<&'static str> = missing.iter().map(|hypothesis| hypothesis.effect.id).collect();
            let judgement = judge(&block, &finer, &library).ok_or_else(|| silent(&block))?;
            let mut answer = decide(&block, &library, &missing, &judgement, prismatic);
            if answer.answer.names() && is_simpler(&block, &library, &judgement) {
                answer = answer.denied();
            }
            let mut own = Judged { block, library, judgement, outside: None };
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

    /// The answer where what repeats differ by grew with the session: no effect of a library does that to a signal, and
    /// noise cannot be told from it.
    fn changing(&mut self, block: &MeasuredBlock, answer: BlockAnswer) -> BlockAnswer {
        let what = "what repeats differ by grows with the time of the session, and with the signal: something drifts \
                    that no cause of the library has, such as a gain with warmth; repeat one experiment for as long as \
                    it takes to settle";
        self.findings.push(Finding { recording: block.name.to_owned(), what: what.to_owned() });
        answer.denied()
    }

    /// Says so where the steps of a scenario were kept though they are not exact.
    fn tell_steps(&mut self, block: &MeasuredBlock, error: f64) {
        if error >= NUMERICAL {
            let what = format!(
                "judged in the steps of the scenario, which explain these drives better than exact ones do, as where an \
                 emulated facility moves in them: half the step changes the residual by {:.2} times the noise",
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

    /// Log-odds for an effect that has no mean against none, by what repeats differ by; `None` if these recordings cannot
    /// tell.
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
                let what =
                    format!("{}: half the step still changes the residual by {error:.2} of the noise", coarse.0.name);
                return Err(Error::unfit(what, "check the stiffness and damping of the model file"));
            }
            let longer = std::mem::replace(&mut coarse, fine);
            usual = usual.or(Some(Usual { block: longer.0, library: longer.1, error }));
        }
    }
}

/// What was said of every block.
#[derive(Default)]
struct Blocks {
    answers: Vec<BlockAnswer>,
    judged: Vec<Judged>,
    /// Mean square of what a step of half the length changes in the whitened residuals.
    errors: Vec<f64>,
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

fn silent(block: &MeasuredBlock) -> Error {
    let channels: Vec<&str> = block.channels.iter().map(|channel| channel.name).collect();
    Error::unfit(
        format!("{}: {} is constant, or its repeats are the same to the last digit", block.name, channels.join(" or ")),
        "check the column in [log]; repeats must be measured, not copied",
    )
}
