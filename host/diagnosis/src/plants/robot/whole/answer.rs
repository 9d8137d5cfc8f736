//! Answer for the robot as a whole: the named causes, what was ruled out, the gain on held-out motion.

use super::regression::{Fit, Regression, Sampled};
use super::terms::{Cause, Kind, Terms, load};
use super::{PENALTY, THRESHOLD, Whole, places, sets};
use crate::inference::identifiability::{BlockIdentifiability, Determination, IdentifiabilityRow};
use crate::inference::torque_error::RISE;
use crate::model::place::{COUPLINGS, ROBOT, axis};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound, Gain, Residual, RuledOut};
use crate::verdict::estimates::EffectSize;
use crate::verdict::estimates::ParameterEstimate;
use nalgebra::{DMatrix, DVector};
use softdock_campaign::rig::{COUPLING_EFFECT, LOAD_EFFECT, RobotRig, TILT_EFFECT};
use softdock_kernels::fields::{Bundle, Field, fields, from_slice};
use std::collections::{BTreeMap, BTreeSet};

/// Half width of a 95 % interval in standard deviations.
const WIDTH: f64 = 1.96;
/// Least gain on held-out motion of practical importance.
const PRACTICAL: f64 = 0.02;
/// Length of a block of the gain's interval \[s\].
const BLOCK: f64 = 1.0;
/// Fewest blocks of which a gain has an interval.
const LEAST_BLOCKS: usize = 4;

/// Rounds in which noise and the best set of causes determine each other.
const ROUNDS: usize = 3;

/// Sets of possible causes, the most probable first, with their log-odds against none.
struct Ranking(Vec<(BTreeSet<usize>, f64)>);

impl Ranking {
    fn of(rig: &RobotRig, terms: &Terms, regression: &Regression) -> Self {
        let causes = &terms.causes;
        let none = regression.fit(&[]).evidence;
        let weighed = |set: BTreeSet<usize>| {
            let fit = regression.fit(&places(causes, &set));
            let possible = set.iter().all(|cause| {
                let cause = &causes[*cause];
                cause.is_possible(rig, terms.place, &fit.of(cause.terms.clone()).0)
            });
            let log_odds = fit.evidence - none - PENALTY * set.len() as f64;
            possible.then_some((set, log_odds))
        };
        let mut all: Vec<_> = sets(causes).into_iter().filter_map(weighed).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        Self(all)
    }

    fn best(&self) -> &BTreeSet<usize> {
        // That without causes is always possible.
        &self.0[0].0
    }

    /// Log-odds of the best set with a cause against the best without it.
    fn lead(&self, cause: usize) -> f64 {
        let best = |with: bool| self.0.iter().find(|(set, _)| set.contains(&cause) == with).map(|own| own.1);
        best(true).unwrap_or(f64::NEG_INFINITY) - best(false).unwrap_or(0.0)
    }

    /// Posterior probability of a cause.
    fn share(&self, cause: usize) -> f64 {
        let weight = |log_odds: f64| (log_odds - self.0[0].1).exp();
        let own = self.0.iter().filter(|(set, _)| set.contains(&cause)).map(|own| weight(own.1));
        own.sum::<f64>() / self.0.iter().map(|own| weight(own.1)).sum::<f64>()
    }
}

/// Judges all sets of causes.
pub(super) fn whole(rig: &RobotRig, terms: &Terms, mut regression: Regression, recordings: &[Sampled]) -> Whole {
    let causes = &terms.causes;
    let local = causes.len() - 1;
    let mut ranking = Ranking::of(rig, terms, &regression);
    for _ in 0..ROUNDS {
        regression.learn_noise(&places(causes, ranking.best()), recordings);
        ranking = Ranking::of(rig, terms, &regression);
    }
    // Separate errors of every axis are judged axis by axis; here they widen the intervals.
    let background: BTreeSet<usize> = ranking.best().iter().copied().filter(|cause| *cause == local).collect();
    let leads = |cause: &usize| *cause != local && ranking.lead(*cause) > THRESHOLD;
    let fit = |set: &BTreeSet<usize>| regression.fit(&places(causes, &(set | &background)));
    let compared = |without: &BTreeSet<usize>, with: &BTreeSet<usize>| {
        HeldOut::of(&fit(without), &fit(with), &regression, recordings)
    };
    let mut named: BTreeSet<usize> = ranking.best().iter().copied().filter(leads).collect();
    // Each cause must hold on held-out motion beside the others: the weakest goes first.
    let own_gain = |named: &BTreeSet<usize>, cause: usize| {
        let without = named.iter().copied().filter(|own| *own != cause).collect();
        (cause, compared(&without, named))
    };
    loop {
        let own = named.iter().map(|cause| own_gain(&named, *cause));
        let weakest = own.min_by(|a, b| a.1.gain.value.total_cmp(&b.1.gain.value));
        match weakest.filter(|(_, own)| own.gain.value < PRACTICAL || !own.confirms()) {
            Some((cause, _)) => named.remove(&cause),
            None => break,
        };
    }
    if !compared(&BTreeSet::new(), &named).confirms() {
        named.clear();
    }
    let after = fit(&named);
    let held_out = compared(&BTreeSet::new(), &named);
    let others = || (0..local).filter(|cause| !named.contains(cause));
    let ruled_out = others().map(|cause| RuledOut {
        id: effect(causes[cause].kind).0,
        block: block(causes[cause].kind),
        log_odds: -ranking.lead(cause),
        implausible: false,
        residual: None,
    });
    let is_found = !named.is_empty();
    let mut ruled_out: Vec<RuledOut> =
        ruled_out.filter(|own| is_found && own.log_odds > THRESHOLD && own.log_odds.is_finite()).collect();
    ruled_out.sort_by(|a, b| a.log_odds.total_cmp(&b.log_odds));
    // What is larger on held-out motion than in training is no noise: the intervals cover it.
    let transfer = held_out.residual.after.max(1.0).powi(2);
    let effects: Vec<EffectFound> = named
        .iter()
        .map(|cause| {
            let odds = [ranking.share(*cause), ranking.lead(*cause)];
            found(&causes[*cause], terms, &after, odds, transfer)
        })
        .collect();
    let answer = BlockAnswer {
        block: ROBOT.name,
        answer: if is_found { DiagnosisVerdict::Named } else { DiagnosisVerdict::NoEffect },
        inadequate: Vec::new(),
        possible: Vec::new(),
        form: None,
        partner_missing: Vec::new(),
        log_odds: named.iter().map(|cause| ranking.lead(*cause)).fold(0.0, f64::max),
        threshold: THRESHOLD,
        gain: is_found.then_some(held_out.gain),
        residual: held_out.residual,
        torque_error: None,
        remaining: Vec::new(),
        fitted: Vec::new(),
        free_run: None,
        held_out: true,
        ruled_out,
        not_visible: Vec::new(),
        confounded: Vec::new(),
        nuisances_beyond_prior: Vec::new(),
        samples: recordings.iter().flat_map(|own| &own.axes).map(DMatrix::nrows).sum(),
        effects,
    };
    let rig = with_errors(rig, &answer.effects);
    Whole {
        answer: Some(answer),
        identifiability: Some(identifiability(terms, &regression)),
        findings: Vec::new(),
        rig,
    }
}

/// Which causes the motions determine, beside the calibration of all axes.
fn identifiability(terms: &Terms, regression: &Regression) -> BlockIdentifiability {
    let causes = terms.causes.iter().filter(|cause| cause.kind != Kind::Local);
    let row = |cause: &Cause| {
        let places = places(std::slice::from_ref(cause), &BTreeSet::from([0]));
        let (deviation, plausible) = (regression.deviation(places[0]), terms.deviations[places[0]]);
        let log_odds = regression.expected(&places);
        let (id, name) = effect(cause.kind);
        let (parameter, unit) = principal(cause.kind);
        IdentifiabilityRow {
            id: Some(id),
            name,
            parameter: parameter.to_owned(),
            unit,
            plausible,
            deviation,
            log_odds,
            determination: Determination::of(deviation / plausible, log_odds, THRESHOLD),
            session: None,
        }
    };
    BlockIdentifiability { block: ROBOT.name, rows: causes.map(row).collect(), confounded: Vec::new() }
}

/// Parameter that states the size of a cause, with its unit.
fn principal(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Load => ("payload", "kg"),
        Kind::Tilt | Kind::Local => ("tilt_x", "rad"),
        Kind::Coupling(..) => ("coupling_inertia", "kg m^2"),
    }
}

/// Catalogue id and description of a cause.
pub(super) fn effect(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Load => (LOAD_EFFECT, "mass beyond the model's"),
        Kind::Tilt => (TILT_EFFECT, "tilt"),
        Kind::Coupling(..) => (COUPLING_EFFECT, "coupling to the axis before"),
        Kind::Local => ("", "separate errors of every axis"),
    }
}

fn block(kind: Kind) -> &'static str {
    match kind {
        Kind::Coupling(axis, _) => COUPLINGS[axis - 1].name,
        _ => ROBOT.name,
    }
}

/// A named cause with its probability, log-odds and parameters; their variances are larger by the factor `transfer`.
fn found(cause: &Cause, terms: &Terms, fit: &Fit, [p, log_odds]: [f64; 2], transfer: f64) -> EffectFound {
    let (values, covariance) = fit.of(cause.terms.clone());
    let covariance = transfer * covariance;
    let (names, values, slopes, unit): (&[&str], Vec<f64>, DMatrix<f64>, &[&str]) = match cause.kind {
        Kind::Load => {
            let mass = values[0];
            let slopes = DMatrix::from_fn(4, 4, |i, j| match (i, j) {
                (0, 0) => 1.0,
                (0, _) => 0.0,
                (_, 0) => -values[i] / (mass * mass),
                _ if i == j => 1.0 / mass,
                _ => 0.0,
            });
            let (mass, [x, y, z]) = load(&values, terms.place);
            let values = vec![mass, x, y, z];
            (
                &["payload", "payload_place_x", "payload_place_y", "payload_place_z"],
                values,
                slopes,
                &["kg", "m", "m", "m"],
            )
        }
        Kind::Coupling(..) => (
            &["coupling_inertia", "coupling_viscous", "coupling_coulomb", "coupling_torque"],
            values,
            DMatrix::identity(4, 4),
            &["kg m^2", "N m s/rad", "N m", "1"],
        ),
        Kind::Tilt | Kind::Local => (&["tilt_x", "tilt_y"], values, DMatrix::identity(2, 2), &["rad", "rad"]),
    };
    let covariance = &slopes * covariance * slopes.transpose();
    let estimate = |k: usize| {
        let half = WIDTH * covariance[(k, k)].sqrt();
        ParameterEstimate { value: values[k], lo: values[k] - half, hi: values[k] + half, unit: unit[k].to_owned() }
    };
    let mut parameters: BTreeMap<String, ParameterEstimate> =
        names.iter().enumerate().map(|(k, name)| ((*name).to_owned(), estimate(k))).collect();
    let mut rows: Vec<Vec<f64>> = covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
    if let Kind::Coupling(_, ratio) = cause.kind {
        let exact = ParameterEstimate { value: ratio, lo: ratio, hi: ratio, unit: "1".to_owned() };
        parameters.insert("coupling_ratio".to_owned(), exact);
        // A ratio is no estimate: the covariance of the others alone would miss its row.
        rows.clear();
    }
    let (id, name) = effect(cause.kind);
    // In the order of the names, which is that of their terms.
    let principal = if cause.kind == Kind::Load { &names[..1] } else { names };
    let size = EffectSize::among(&parameters, principal);
    EffectFound { id, name, block: block(cause.kind), p, log_odds, size, parameters, covariance: rows }
}

/// Residuals on held-out motion, before and after, in units of the noise.
struct HeldOut {
    gain: Gain,
    residual: Residual,
    /// Whether the torque error of an axis rises.
    rises: bool,
}

impl HeldOut {
    fn of(before: &Fit, after: &Fit, regression: &Regression, recordings: &[Sampled]) -> Self {
        let axes = regression.noise.len();
        let (mut blocks, mut sums) = (Vec::new(), vec![[0.0; 2]; axes]);
        for recording in recordings.iter().filter(|recording| recording.held_out) {
            let length = ((BLOCK * recording.rate) as usize).max(1);
            let count = recording.axes[0].nrows();
            let mut own = vec![[0.0; 2]; count.div_ceil(length)];
            for (axis, sums) in sums.iter_mut().enumerate() {
                let rests = [before, after].map(|fit| fit.rest(&recording.axes[axis], axis));
                for (which, rest) in rests.iter().enumerate() {
                    for (k, value) in rest.iter().enumerate() {
                        let square = value * value / regression.noise[axis].power;
                        own[k / length][which] += square;
                        sums[which] += square;
                    }
                }
            }
            blocks.extend(own);
        }
        let samples: usize =
            recordings.iter().filter(|own| own.held_out).flat_map(|own| &own.axes).map(DMatrix::nrows).sum();
        let total = |which: usize| sums.iter().map(|own| own[which]).sum::<f64>();
        let rms = |which: usize| (total(which) / samples as f64).sqrt();
        let rises = sums.iter().any(|[before, after]| after.sqrt() > (1.0 + RISE) * before.sqrt());
        let residual = Residual { before: rms(0), after: rms(1) };
        Self { gain: gain(&blocks, [total(0), total(1)]), residual, rises }
    }

    fn confirms(&self) -> bool {
        self.gain.lo > 0.0 && !self.rises
    }
}

/// Gain with its interval from the scatter of the blocks: a ratio of sums.
fn gain(blocks: &[[f64; 2]], [before, after]: [f64; 2]) -> Gain {
    let ratio = after / before;
    let squares = DVector::from_iterator(blocks.len(), blocks.iter().map(|[b, a]| a - ratio * b)).norm_squared();
    let half = if blocks.len() < LEAST_BLOCKS { f64::INFINITY } else { WIDTH * squares.sqrt() / before };
    let of = |ratio: f64| 1.0 - ratio.max(0.0).sqrt();
    Gain { value: of(ratio), lo: of(ratio + half), hi: of(ratio - half), elsewhere: None }
}

/// The robot with the named causes.
fn with_errors(rig: &RobotRig, effects: &[EffectFound]) -> RobotRig {
    let mut rig = rig.clone();
    for effect in effects {
        match axis(effect.block) {
            Some(axis) => rig.couplings[axis - 1] = values(effect),
            None => rig.model = rig.model.with_errors(&values(effect)),
        }
    }
    rig
}

/// The parameters of an effect as a bundle; those that it lacks are 0.
fn values<B: Bundle<f64>>(effect: &EffectFound) -> B {
    let value = |field: &Field| effect.parameters.get(&field.name).map_or(0.0, |estimate| estimate.value);
    from_slice(&fields::<f64, B>().iter().map(value).collect::<Vec<_>>())
}
