//! One case from its plan to its record: scale, recordings, seal, diagnosis; and only then what needs the truth.

use crate::baseline::Baselines;
use crate::exhibit::{Exhibit, read};
use crate::measure::true_gain;
use crate::oracle::{Oracle, Scale};
use crate::plan::{Case, Task};
use crate::plant::{code, hides_others, is_random};
use crate::record::{Answer, Effect, Estimate, Ledger, Record, Said, SealLine};
use crate::seal::{SealedTruth, seal};
use crate::{Error, Result};
use softdock_diagnosis::answer::{BlockAnswer, Bounds, EffectFound};
use softdock_diagnosis::diagnosis::{Diagnosis, Judged, Options};
use softdock_diagnosis::experiment::Experiment;
use softdock_diagnosis::inference::evidence::evidence;
use softdock_gauntlet::{EffectCase, Hidden, Told, follow, further, generate};
use std::path::Path;
use std::time::Instant;

/// Experiments that an ambiguous answer may ask for, one after the other.
const EXPERIMENTS: u64 = 2;

/// Times that the repeats are made again which a true gain is measured on: its own chance should widen no interval.
const AGAIN: u64 = 4;

/// Runs cases one after the other; those that share a seed share their oracles.
pub struct Bench<'a> {
    ledger: &'a Ledger,
    oracles: Oracles,
    baselines: Baselines,
}

/// What was asked of oracles for the last seed.
#[derive(Default)]
struct Oracles {
    asked: Vec<Asked>,
}

/// How large a case hides its effects.
struct Hiding {
    scales: Vec<Option<Scale>>,
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
    scale: Option<Scale>,
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

impl<'a> Bench<'a> {
    /// With a ledger to write to.
    pub fn new(ledger: &'a Ledger) -> Self {
        Self { ledger, oracles: Oracles::default(), baselines: Baselines::default() }
    }

    /// Runs a case and writes its record.
    ///
    /// # Errors
    /// A case that the generator refuses, files that cannot be written. What the diagnosis refuses is an answer.
    pub fn run(&mut self, case: &Case) -> Result<Record> {
        let begin = Instant::now();
        let Hiding { scales, hidden } = self.oracles.sized(case)?;
        let set =
            hidden.as_ref().map(|hidden| generate(case.plant.rig, hidden, case.noise, case.seed())).transpose()?;
        let sealed = seal(self.ledger.folder(), &SealedTruth::of(case, &scales, set.as_ref()))?;
        self.ledger.seal(&SealLine { case: case.id(), sealed: sealed.clone() })?;
        let mut record = Record::of(case.id(), sealed);
        if let (Some(set), Some(hidden)) = (set, hidden) {
            let exhibit = Exhibit::of(&set)?;
            let options = Options { without: left_out(case, exhibit.path())?, ..Options::default() };
            let start = Instant::now();
            let Found { answer, judged, proposed } = answer(exhibit.path(), &options);
            record.cost.diagnosis = start.elapsed().as_secs_f64();
            if let Some(judged) = judged.filter(|_| answer.said == Said::Named && !matches!(case.task, Task::Null)) {
                let (rig, seed) = (case.plant.rig, case.seed());
                record.gain = true_gain(exhibit.path(), &judged, &further(rig, &hidden, case.noise, seed, AGAIN)?)?;
            }
            record.answer = Some(answer);
            // The baselines get the recordings that the first answer had.
            if case.plant.baselines && !matches!(case.task, Task::LeftOut(_)) {
                record.baselines = self.baselines.answers(case, exhibit.path())?;
            }
            record.after = after(case, &hidden, &exhibit, &options, proposed)?;
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
    set.write(folder).map_err(Error::file(folder))?;
    seal(folder, &SealedTruth::of(case, &scales, Some(&set)))?;
    Ok(true)
}

impl Oracles {
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
    ) -> Result<(Option<Scale>, Option<f64>)> {
        let seed = case.seed();
        self.asked.retain(|asked| asked.seed == seed);
        let place = match self.asked.iter().position(|asked| asked.effect.id == effect.id && asked.beside == beside) {
            Some(place) => place,
            None => {
                self.asked.push(Asked::of(case, effect, beside.to_vec())?);
                self.asked.len() - 1
            }
        };
        let asked = &self.asked[place];
        Ok((asked.scale.clone(), asked.multiple(case.multiple)?))
    }
}

/// Names of the library that a case goes without.
fn left_out(case: &Case, folder: &Path) -> Result<Vec<String>> {
    let Task::LeftOut(effect) = case.task else { return Ok(Vec::new()) };
    let views = read(folder, &[], &Options::default())?.isolability;
    let ids = views.iter().flat_map(|view| view.effects.iter());
    Ok(ids.filter(|id| code(id) == code(effect.id)).map(|id| (*id).to_owned()).collect())
}

/// What a diagnosis says of a folder.
struct Found {
    answer: Answer,
    /// The block where most was found.
    judged: Option<Judged>,
    /// The experiment that an ambiguous answer asks for.
    proposed: Option<Experiment>,
}

/// Diagnoses a folder: nothing of the truth comes here.
fn answer(folder: &Path, options: &Options) -> Found {
    match read(folder, &[], options).and_then(|prepared| Ok(prepared.diagnose()?)) {
        Ok((diagnosis, judged)) => {
            let (answer, judged) = told(&diagnosis, judged);
            Found { answer, judged, proposed: diagnosis.proposed.filter(Experiment::separates) }
        }
        Err(error) => Found { answer: refused(error.to_string()), judged: None, proposed: None },
    }
}

/// Runs the experiments that ambiguous answers propose, and gives the answers with their recordings added.
fn after(
    case: &Case,
    hidden: &[Hidden],
    exhibit: &Exhibit,
    options: &Options,
    mut proposed: Option<Experiment>,
) -> Result<Vec<Answer>> {
    let mut answers = Vec::new();
    for number in 1..=EXPERIMENTS {
        let Some(Experiment { step, path, repeats, .. }) = proposed.take() else { break };
        let told = Told { step_s: step, path, repeats: repeats as u64 };
        let Some(recordings) = follow(case.plant.rig, hidden, case.noise, case.seed(), &told, number)? else { break };
        exhibit.add(&recordings)?;
        let found = answer(exhibit.path(), options);
        proposed = found.proposed;
        answers.push(found.answer);
    }
    Ok(answers)
}

fn refused(refusal: String) -> Answer {
    Answer {
        said: Said::Refused,
        effects: Vec::new(),
        blocks: Vec::new(),
        partner_missing: false,
        experiment: None,
        gain: None,
        gain_elsewhere: None,
        refusal: Some(refusal),
    }
}

fn told(diagnosis: &Diagnosis, judged: Vec<Judged>) -> (Answer, Option<Judged>) {
    let of = |found: &EffectFound| {
        let own = judged.iter().find(|judged| judged.block.name == found.block);
        let parameters = own.map_or_else(Default::default, |own| estimates(found, own));
        Effect { id: found.id.to_owned(), block: found.block.to_owned(), p: found.p, parameters }
    };
    let blocks: Vec<(String, Said)> =
        diagnosis.blocks.iter().map(|block| (block.block.to_owned(), block.answer.into())).collect();
    let mut effects: Vec<Effect> = diagnosis.effects.iter().map(of).collect();
    effects.sort_by(|a, b| b.p.total_cmp(&a.p));
    let answer = Answer {
        said: diagnosis.answer.into(),
        effects,
        blocks,
        partner_missing: diagnosis.blocks.iter().any(|block| block.partner_missing),
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
fn estimates(found: &EffectFound, judged: &Judged) -> std::collections::BTreeMap<String, Estimate> {
    let Judged { block, library, judgement, .. } = judged;
    // Several hypotheses may be forms of one effect.
    let is_own = |number: &usize| library[*number].effect.id == found.id;
    let with = judgement.ranking.iter().find(|c| c.sound && c.hypotheses.iter().any(is_own));
    let curvature = with.map(|candidate| (candidate, evidence(&candidate.fitted, 1.0).covariance));
    let of = |(name, told): (&String, &softdock_diagnosis::answer::Estimate)| {
        let place = curvature.as_ref().and_then(|(candidate, covariance)| {
            let place = candidate.fitted.unknowns.iter().position(|unknown| unknown.name == *name)?;
            let (unknown, z) = (&candidate.fitted.unknowns[place], candidate.fitted.z[place]);
            let sd = covariance[(place, place)].sqrt();
            let slope = 0.5 * (unknown.prior.value(z + sd) - unknown.prior.value(z - sd));
            Some((slope.abs(), block.base[unknown.field]))
        });
        let (sd, nominal) = place.unwrap_or_default();
        (name.clone(), Estimate { value: told.value, lo: told.lo, hi: told.hi, sd, nominal })
    };
    found.parameters.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_diagnosis::judge;
    use softdock_gauntlet::{NoiseColour, Rig};

    /// What is said of a command's way with something hidden, names left out: verdict and ids in their order.
    fn said(hidden: &[(&'static str, f64)], without: &[&str]) -> (Said, Vec<String>) {
        said_of(Rig::Command, 11, hidden, without)
    }

    /// The same of the data set of a rig and a seed.
    fn said_of(rig: Rig, seed: u64, hidden: &[(&'static str, f64)], without: &[&str]) -> (Said, Vec<String>) {
        said_behind(NoiseColour::FirstOrder, rig, seed, hidden, without)
    }

    /// The same behind noise of a colour.
    fn said_behind(
        colour: NoiseColour,
        rig: Rig,
        seed: u64,
        hidden: &[(&'static str, f64)],
        without: &[&str],
    ) -> (Said, Vec<String>) {
        let answer = answer_behind(colour, rig, seed, hidden, without);
        let mut ids: Vec<String> = answer.effects.into_iter().map(|effect| effect.id).collect();
        ids.sort();
        (answer.said, ids)
    }

    /// The whole of what is said.
    fn answer_behind(
        colour: NoiseColour,
        rig: Rig,
        seed: u64,
        hidden: &[(&'static str, f64)],
        without: &[&str],
    ) -> Answer {
        let hidden: Vec<Hidden> = hidden.iter().map(|(id, size)| Hidden { id, size: *size }).collect();
        let set = generate(rig, &hidden, colour, seed).expect("effects of the bench");
        let exhibit = Exhibit::of(&set).expect("room");
        let without = without.iter().map(|id| (*id).to_owned()).collect();
        answer(exhibit.path(), &Options { without, ..Options::default() }).answer
    }

    #[test]
    fn what_has_no_mean_is_named_behind_a_lag_a_limit_and_a_hold() {
        let (lag, limit, hold) = (("C2_lag", 0.003), ("C7_rate_limit", 1.2), ("C6_hold", 0.004_177));
        let (jitter, drops) = (("C3_jitter", 1.2e-4), ("C4_drops", 1.5e-3));
        for pair in [[lag, jitter], [lag, drops], [jitter, limit], [drops, limit], [jitter, hold], [drops, hold]] {
            let mut ids = pair.map(|(id, _)| id.to_owned()).to_vec();
            ids.sort();
            assert_eq!(said(&pair, &[]), (Said::Named, ids));
        }
    }

    #[test]
    fn a_lag_that_seems_there_and_is_of_no_use_hides_neither_losses_nor_jitter() {
        for (seed, id, size) in [(1_888_172_402, "C4_drops", 7.761_6e-4), (4_210_823_708, "C3_jitter", 4.390_6e-4)] {
            assert_eq!(said_of(Rig::Command, seed, &[(id, size)], &[]), (Said::Named, vec![id.to_owned()]));
        }
    }

    #[test]
    fn a_hold_behind_a_limit_and_a_delay_behind_a_deep_one_are_named() {
        let cases = [
            (11, "C6_hold", 0.0041, 1.1),
            (11, "C1_transport_delay", 0.0041, 1.1),
            (4_009_981_770, "C1_transport_delay", 0.008_861, 1.0),
        ];
        for (seed, id, late, limit) in cases {
            let found = (Said::Named, vec![id.to_owned(), "C7_rate_limit".to_owned()]);
            assert_eq!(said_of(Rig::Command, seed, &[(id, late), ("C7_rate_limit", limit)], &[]), found);
        }
    }

    #[test]
    fn an_effect_is_named_beside_another_that_is_lost_from_anywhere_but_where_it_is() {
        let named = |ids: [&str; 2]| (Said::Named, ids.map(str::to_owned).to_vec());
        // Steps of a reading are in phase with its gain.
        let hidden = [("S3_gain", 0.04), ("S6_quantisation", 4.0)];
        assert_eq!(said_of(Rig::Sensor, 1_759_870_806, &hidden, &[]), named(["S3_gain", "S6_quantisation"]));
        // A boom on either side of its body looks nearly alike.
        let hidden = [("P1_mass", 12.188), ("P3_appendage", 0.078_834)];
        assert_eq!(said_of(Rig::Body, 889_584_576, &hidden, &[]), named(["P1_mass", "P3_appendage"]));
    }

    #[test]
    fn a_mount_that_gives_way_as_much_as_the_contact_is_found_where_it_rings() {
        let compliance = 6.832_731_8e-6;
        let mount = [("K10_fixture", compliance)];
        let answer = answer_behind(NoiseColour::FirstOrder, Rig::Contact, 3_583_276_528, &mount, &[]);
        assert_eq!(answer.said, Said::Named);
        let [found] = &answer.effects[..] else { panic!("one effect: {:?}", answer.effects) };
        let off = |name: &str, truth: f64| (found.parameters[name].value / truth - 1.0).abs();
        // The bench's plate has 1.5 kg.
        let frequency = 1.0 / (std::f64::consts::TAU * (1.5 * compliance).sqrt());
        assert!(off("fixture_frequency", frequency) < 0.01, "{:?}", found.parameters);
        assert!(off("fixture_compliance", compliance) < 0.05, "{:?}", found.parameters);
    }

    #[test]
    fn noise_is_not_taken_for_steps() {
        let found = said_of(Rig::Sensor, 520_532_707, &[("S7_noise", 5.417)], &[]);
        assert_eq!(found, (Said::Named, vec!["S7_noise".to_owned()]));
    }

    #[test]
    fn a_drift_beside_a_gain_or_a_lag_is_named() {
        let drift = ("S2_drift", 0.051_874);
        for other in [("S3_gain", 0.030_844), ("S5_low_pass", 9.17e-4)] {
            let found = (Said::Named, vec![drift.0.to_owned(), other.0.to_owned()]);
            assert_eq!(said_of(Rig::Sensor, 2_370_655_822, &[drift, other], &[]), found);
        }
    }

    #[test]
    fn a_drift_is_named_behind_steps_of_the_reading() {
        let named = (Said::Named, ["S2_drift", "S6_quantisation"].map(str::to_owned).to_vec());
        let (white, pink) = (NoiseColour::White, NoiseColour::Pink);
        let cases = [(white, 2_537_318_737, 0.061_688, 3.830_4), (pink, 1_379_738_469, 0.091_103, 4.0)];
        for (colour, seed, drift, step) in cases {
            let hidden = [("S2_drift", drift), ("S6_quantisation", step)];
            assert_eq!(said_behind(colour, Rig::Sensor, seed, &hidden, &[]), named);
        }
    }

    #[test]
    fn a_drift_that_scatters_about_nothing_is_none() {
        let found = said_behind(NoiseColour::Pink, Rig::Sensor, 2_634_078_062, &[], &[]);
        assert_eq!(found, (Said::NoEffect, Vec::new()));
    }

    #[test]
    fn a_mount_is_not_named_for_what_a_friction_beyond_its_tolerance_explains() {
        let (id, seed) = ("K4_friction", 3_402_732_986);
        let of = |size, without| said_behind(NoiseColour::White, Rig::Contact, seed, &[(id, size)], without);
        assert_eq!(of(0.059_073, &[]), (Said::Named, vec![id.to_owned()]));
        assert_eq!(of(0.029_537, &[id]), (Said::NotInLibrary, Vec::new()));
    }

    #[test]
    fn a_lag_that_a_clock_nearly_makes_up_for_is_named() {
        let lag = ("S5_low_pass", 0.001);
        let found = said_behind(NoiseColour::White, Rig::Contact, 527_519_681, &[lag], &[]);
        assert_eq!(found, (Said::Named, vec![lag.0.to_owned()]));
    }

    #[test]
    fn what_explains_less_than_a_strained_clock_hides_is_not_named() {
        let (rig, without) = (Rig::Drive { link_encoder: false }, "J12_current_loop");
        assert_eq!(said_of(rig, 2_617_100_129, &[(without, 0.004)], &[without]), (Said::NotInLibrary, Vec::new()));
    }

    #[test]
    fn a_delay_that_a_clock_may_explain_is_nothing_unknown() {
        // Three tolerances of the clock offset, no more.
        assert_ne!(said(&[("C1_transport_delay", 6e-4)], &[]).0, Said::NotInLibrary);
    }

    #[test]
    fn a_delay_that_strains_the_clock_is_not_in_a_library_without_it() {
        assert_eq!(said(&[("C1_transport_delay", 0.02)], &["C1_transport_delay"]).0, Said::NotInLibrary);
    }

    #[test]
    fn losses_and_jitter_that_the_library_goes_without_are_not_in_it() {
        for (id, size) in [("C3_jitter", 3e-4), ("C4_drops", 5e-3)] {
            assert_eq!(said(&[(id, size)], &[id]), (Said::NotInLibrary, Vec::new()));
        }
    }

    #[test]
    fn a_long_lag_is_not_taken_for_jitter() {
        assert_eq!(said(&[("C2_lag", 0.015)], &[]), (Said::Named, vec!["C2_lag".to_owned()]));
    }

    #[test]
    fn a_gear_that_is_many_times_softer_than_the_models_is_found() {
        let soft = 8.4e-6;
        let hidden = [Hidden { id: "J8_elasticity", size: soft }];
        let set = generate(Rig::Robot, &hidden, NoiseColour::FirstOrder, 11).expect("an effect of the bench");
        let exhibit = Exhibit::of(&set).expect("room");
        let prepared = read(exhibit.path(), &[], &Options::default()).expect("good recordings");
        let (block, library) = prepared.blocks(1).swap_remove(1);
        let library: Vec<_> = library.into_iter().filter(|own| code(own.effect.id) == "J8").collect();
        let judgement = judge(&block, &block, &library).expect("repeats");
        let found = judgement.ranking[0].fitted.values(&block.base)[block.field("compliance")];
        let truth = block.base[block.field("compliance")] + soft;
        assert!((found / truth - 1.0).abs() < 0.05, "{found} instead of {truth}");
        assert!(judgement.ranking[0].fitted.mean_square() < 1.3, "{}", judgement.ranking[0].fitted.mean_square());
    }

    /// What is said of a robot's axes by a library without what takes longest, and is like nothing that is hidden.
    fn axes(seed: u64, hidden: &[(&'static str, f64)], without: &[&str]) -> (Vec<Said>, Answer) {
        let costly = ["J9_torque_ripple", "J10_transmission_error"];
        let answer = answer_behind(NoiseColour::FirstOrder, Rig::Robot, seed, hidden, &[&costly, without].concat());
        (answer.blocks.iter().map(|block| block.1).collect(), answer)
    }

    #[test]
    fn what_is_less_probable_than_nothing_is_not_named() {
        // How the gear of axis 2 winds up tells a little wrong what axis 3 carries.
        let hidden = [("J2_viscous", 22.627416997969522), ("J8_elasticity", 2.7262693316631445e-6)];
        let (said, answer) = axes(2_753_534_839, &hidden, &[]);
        assert_eq!(said, [Said::NoEffect, Said::Named, Said::NoEffect]);
        assert!(answer.effects.iter().all(|effect| effect.p > 0.5), "{answer:?}");
    }

    #[test]
    fn what_spares_a_nuisance_the_impossible_is_named() {
        let said = said_of(Rig::Sensor, 709_456_285, &[("S3_gain", 0.0154)], &[]);
        assert_eq!(said, (Said::Named, vec!["S3_gain".to_owned()]));
    }

    #[test]
    fn an_axis_is_not_blamed_for_the_gear_of_another() {
        let id = "J8_elasticity";
        let (said, _) = axes(11, &[(id, 8.4e-6)], &[id]);
        assert_eq!(said, [Said::NoEffect, Said::NotInLibrary, Said::NoEffect]);
    }

    #[test]
    fn noise_of_the_measured_place_is_no_lag_of_the_force() {
        let set = generate(Rig::Contact, &[], NoiseColour::FirstOrder, 3_584_678_196).expect("nothing hidden");
        let exhibit = Exhibit::of(&set).expect("room");
        assert_eq!(answer(exhibit.path(), &Options::default()).answer.said, Said::NoEffect);
    }
}
