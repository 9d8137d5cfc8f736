//! Effects of a joint drive: friction, gear, motor, load.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf};
use crate::model::unknown::{ParameterPrior, Role};
use std::f64::consts::TAU;

/// Plausible logarithm of cold over warm viscous friction: it halves, or more, as a robot's gear warms up (Bittencourt and
/// Gunnarsson, J. Dyn. Sys. Meas. Control 134 (2012) 051013).
const WARM_LOSS: f64 = std::f64::consts::LN_2;

/// What the recordings of a drive span.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spans {
    /// Root mean square of the measured torque.
    pub(super) torque: f64,
    /// Greatest measured torque.
    pub(super) peak: f64,
    /// Greatest rate.
    pub(super) rate: f64,
    /// Range of the angle.
    range: f64,
    /// Greatest angle, whatever its sign.
    pub(super) farthest: f64,
    /// Middle of the range.
    middle: f64,
    /// Time between the first and the last sample of all recordings.
    time: f64,
    /// Inertia of motor and link.
    inertia: f64,
    /// Whether the joint slides.
    slides: bool,
    /// Greatest torque of a kilogram of payload at the joint \[N m/kg\]; 0 where it has no weight.
    payload_weight: f64,
    /// Inertia of the link, or a tenth of the motor's where a model counts all as motor.
    link: f64,
}

impl Spans {
    pub(super) fn of(block: &MeasuredBlock) -> Self {
        let all = |name: &'static str| block.trials.iter().flat_map(move |trial| block.input(trial, name));
        let range = |name: &'static str| {
            all(name).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)))
        };
        let torque = || block.trials.iter().flat_map(|trial| trial.recorded.late.iter().copied());
        let motor = block.base[block.field("motor_inertia")];
        let link = all("inertia").next().unwrap_or(0.0);
        let (lo, hi) = range("angle");
        let (start, end) = range("time");
        Self {
            torque: (torque().map(|t| t * t).sum::<f64>() / torque().count() as f64).sqrt(),
            peak: torque().fold(0.0, |peak, t| peak.max(t.abs())),
            rate: all("rate").fold(0.0, |peak, v| peak.max(v.abs())),
            range: hi - lo,
            farthest: hi.max(-lo),
            middle: 0.5 * (lo + hi),
            time: end - start,
            inertia: motor + link,
            slides: block.channels[0].unit == "m",
            payload_weight: all("payload_weight").fold(0.0, |most, weight| most.max(weight.abs())),
            link: if link > 0.0 { link } else { 0.1 * motor },
        }
    }

    /// Size of dry friction: as the model has it, or as much as all of the torque.
    fn dry(&self, coulomb: f64) -> f64 {
        if coulomb > 0.0 { coulomb } else { self.torque }
    }

    /// Cycles of which at least one is seen, and up to which they are looked for \[1/rad\].
    fn cycles(&self) -> [f64; 2] {
        let least = TAU / self.range;
        if self.slides {
            return [least, MOST_PERIODS * least];
        }
        [least.max(LEAST_CYCLES), (least.max(LEAST_CYCLES) * 4.0).max(MOST_CYCLES)]
    }

    /// Compliance at which the link swings on the gear with a frequency \[Hz\].
    fn compliance(&self, frequency: f64) -> f64 {
        1.0 / (self.link * (TAU * frequency).powi(2))
    }
}

fn either(mean: f64, sd: f64) -> ParameterPrior {
    ParameterPrior::Normal { mean, sd }
}

fn grid(values: impl IntoIterator<Item = f64>) -> Vec<Vec<f64>> {
    values.into_iter().map(|value| vec![value]).collect()
}

/// Sizes from the least to the greatest, each so many times the one before.
fn ladder(least: f64, greatest: f64, factor: f64) -> Vec<f64> {
    std::iter::successors(Some(least), |size| Some(size * factor)).take_while(|size| *size <= greatest).collect()
}

/// Returns the hypotheses of a drive.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let (spans, mut shelf) = (Spans::of(block), Shelf::of(block));
    friction(&mut shelf, &spans);
    gear(&mut shelf, &spans);
    motor(&mut shelf, &spans);
    load(&mut shelf, &spans);
    if block.channels.len() > 1 {
        let age = either(0.0, 4e-3);
        shelf.add("J20_encoder_delay", "latency of the samples", &[("link_age", age, Role::Size)], &[1.0], &[]);
    }
    limits(&mut shelf, &spans);
    shelf.calibrate(&CALIBRATION);
    shelf.all
}

/// Parameters that any model of a drive has slightly wrong. Friction by direction is none: an offset is nearly the same.
const CALIBRATION: [&str; 6] = ["coulomb", "viscous", "inertia_error", "gravity_cos", "gravity_sin", "offset"];
/// Greatest relative error of a motor's torque constant: makers state 10 %, and magnets lose up to 20 % with the
/// temperature (Bertotti, Hysteresis in Magnetism, 1998; data sheets of servo motors).
const WORST_CONSTANT: f64 = 0.3;
/// Greatest link inertia beyond the model's, as a share of the whole: beyond, the model is one of another machine.
const WORST_INERTIA: f64 = 2.0;
/// Greatest share of its load that a gear loses as friction (Bittencourt 2010: 10 % to 20 %, worm gears 50 %).
const WORST_LOSS: f64 = 0.5;
/// Least frequency of a link on its gear \[Hz\]: below, no servo holds the joint.
const SOFTEST_GEAR: f64 = 1.0;
/// Greatest play and transmission error of a robot's gear \[rad\]: ten times what makers reject.
const WORST_GEAR: f64 = 0.01;
/// Greatest time constant of a current loop \[s\], and greatest age of an encoder's samples.
const SLOWEST_CURRENT: f64 = 5e-3;
const OLDEST_SAMPLE: f64 = 0.05;
/// Share of the greatest torque that the drive gave, below which it cannot saturate.
const LOWEST_LIMIT: f64 = 0.3;

/// Limits the parameters to what a drive can have that gave these torques at these rates.
fn limits(shelf: &mut Shelf, spans: &Spans) {
    let Spans { peak, rate, inertia, link, .. } = *spans;
    let gear = if spans.slides { WORST_GEAR * spans.range.min(1.0) } else { WORST_GEAR };
    let either = |size: f64| [-size, size];
    let weight = spans.payload_weight;
    let payload = if weight > 0.0 { peak / weight } else { f64::INFINITY };
    for (name, limits) in [
        ("coulomb", [0.0, peak]),
        ("viscous", [0.0, peak / rate]),
        ("stribeck", [0.0, peak]),
        ("stribeck_speed", [0.0, rate]),
        ("load_coefficient", [0.0, WORST_LOSS]),
        ("warm_loss", [0.0, 3.0 * WARM_LOSS]),
        ("half_backlash", [0.0, gear]),
        ("compliance", [0.0, spans.compliance(SOFTEST_GEAR).max(4.0 * shelf.base("compliance"))]),
        ("wave_sin", either(gear)),
        ("wave_cos", either(gear)),
        ("ripple_sin", either(0.5 * peak)),
        ("ripple_cos", either(0.5 * peak)),
        ("torque_constant_error", either(WORST_CONSTANT)),
        ("current_lag", [0.0, SLOWEST_CURRENT]),
        ("torque_limit", [LOWEST_LIMIT * peak, f64::INFINITY]),
        ("coulomb_asymmetry", either(peak)),
        ("offset", either(peak)),
        ("payload", either(payload)),
        ("inertia_error", [-link, WORST_INERTIA * inertia]),
        ("gravity_cos", either(peak)),
        ("gravity_sin", either(peak)),
        ("cable_stiffness", [0.0, peak / spans.range]),
        ("link_age", either(OLDEST_SAMPLE)),
    ] {
        shelf.limit(name, limits);
    }
}

fn friction(shelf: &mut Shelf, spans: &Spans) {
    let (coulomb, viscous) = (shelf.base("coulomb"), shelf.base("viscous"));
    let (dry, wet) = (spans.dry(coulomb), if viscous > 0.0 { viscous } else { spans.torque / spans.rate });
    shelf.add("J1_coulomb", "Coulomb friction", &[("coulomb", either(coulomb, 0.3 * dry), Role::Size)], &[1.0], &[]);
    shelf.add("J2_viscous", "viscous friction", &[("viscous", either(viscous, 0.3 * wet), Role::Size)], &[1.0], &[]);
    shelf.add(
        "J3_stribeck",
        "static friction beyond Coulomb's",
        &[
            ("stribeck", ParameterPrior::Positive { scale: 0.5 * dry }, Role::Size),
            ("stribeck_speed", ParameterPrior::LogNormal { centre: 0.03 * spans.rate, spread: 1.0 }, Role::Form),
        ],
        &[0.5],
        &grid([-1.5, -0.5, 0.5, 1.5]),
    );
    shelf.add(
        "J4_presliding",
        "travel before sliding",
        &[(
            "presliding_travel",
            ParameterPrior::LogNormal { centre: shelf.base("presliding_travel"), spread: 1.5 },
            Role::Size,
        )],
        &[0.4, 1.0, 2.0],
        &[],
    );
    // Harmonic drives lose 10 % to 20 % of their load torque.
    let load = ParameterPrior::Positive { scale: 0.1 };
    // Of all of the link's torque, or of what it takes to hold the link: what deforms bearings and teeth is in between.
    let inertial = either(0.5, 0.5);
    shelf.add(
        "J5_load_friction",
        "friction that grows with the load",
        &[("load_coefficient", load, Role::Size), ("load_inertial", inertial, Role::Form)],
        &[1.0],
        &grid([-1.0, 1.0]),
    );
    shelf.add(
        "J6_temperature",
        "friction that decreases as the drive warms up",
        &[
            ("warm_loss", ParameterPrior::Positive { scale: WARM_LOSS }, Role::Size),
            ("warm_up", ParameterPrior::LogNormal { centre: 0.5 * spans.time, spread: 1.0 }, Role::Form),
        ],
        &[0.5],
        &grid([-1.0, 0.0, 1.0]),
    );
}

fn gear(shelf: &mut Shelf, spans: &Spans) {
    let compliance = shelf.base("compliance");
    // Teeth may be as stiff as a model without a gear has them.
    let spread = if compliance > 0.0 { 1.0 } else { 1.5 };
    let stiff = ParameterPrior::LogNormal { centre: spans.compliance(60.0).max(compliance), spread };
    shelf.add(
        "J7_backlash",
        "backlash",
        &[
            ("half_backlash", ParameterPrior::Positive { scale: 3e-4 }, Role::Size),
            ("compliance", stiff, Role::Form),
            ("gear_damping", ParameterPrior::LogNormal { centre: 0.2, spread: 0.7 }, Role::Form),
        ],
        &ladder(0.02, 5.0, 1.2),
        &[vec![0.0, -0.7], vec![0.0, 0.7], vec![-1.0, 0.5], vec![1.0, 0.5]],
    );
    if compliance == 0.0 {
        shelf.add(
            "J8_elasticity",
            "elasticity",
            &[
                ("compliance", ParameterPrior::Positive { scale: spans.compliance(30.0) }, Role::Size),
                ("gear_damping", ParameterPrior::LogNormal { centre: 0.05, spread: 1.0 }, Role::Form),
            ],
            &ladder(0.02, 12.0, 1.4),
            &grid([-0.5, 0.5]),
        );
    } else {
        // A softer gear swings more slowly, so that the same damping is a larger share of what is critical; and a robot's
        // further axes damp its links before anybody knows that these are not rigid.
        let damping = shelf.base("gear_damping").max(0.01);
        shelf.add(
            "J8_elasticity",
            "elasticity",
            &[
                ("compliance", ParameterPrior::LogNormal { centre: compliance, spread: 0.7 }, Role::Size),
                ("gear_damping", ParameterPrior::LogNormal { centre: damping, spread: 1.0 }, Role::Form),
            ],
            &softer_or_stiffer(),
            &grid([0.0, 1.0]),
        );
    }
    let wave = either(0.0, 1e-4);
    shelf.add(
        "J10_transmission_error",
        "transmission error",
        &[("wave_sin", wave, Role::Size), ("wave_cos", wave, Role::Size), periodic("wave_cycles", spans)],
        &[1.0],
        &cycles(spans),
    );
}

/// Sizes of a gear's compliance in spreads of its logarithm, each 1.4 times the next: a fit that starts further from the
/// truth stops where the link is in step with another of its swings.
fn softer_or_stiffer() -> Vec<f64> {
    let halves = (-4..=10).filter(|half| *half != 0);
    halves.map(|half| 0.5 * f64::from(half)).collect()
}

/// How often a periodic effect comes around in a radian.
fn periodic(name: &'static str, spans: &Spans) -> Entry {
    let [least, most] = spans.cycles();
    (name, ParameterPrior::LogNormal { centre: (least * most).sqrt(), spread: 0.25 * (most / least).ln() }, Role::Form)
}

/// Cycles of a gear's or a motor's turn in a radian of the joint, at least and at most.
const LEAST_CYCLES: f64 = 5.0;
const MOST_CYCLES: f64 = 120.0;
/// Most periods over the range of an axis that slides: the turns of its screw.
const MOST_PERIODS: f64 = 40.0;
/// Most cycles that are tried.
const MOST_TRIED: f64 = 400.0;

/// Cycles so dense that no period of the range falls between two of them.
fn cycles(spans: &Spans) -> Vec<Vec<f64>> {
    let [least, most] = spans.cycles();
    let (_, prior, _) = periodic("", spans);
    let step = (std::f64::consts::PI / (2.0 * spans.range)).max((most - least) / MOST_TRIED);
    let count = ((most - least) / step) as usize;
    grid((0..=count).map(|k| prior.place(least + k as f64 * step)))
}

fn motor(shelf: &mut Shelf, spans: &Spans) {
    let ripple = either(0.0, 0.05 * spans.torque);
    shelf.add(
        "J9_torque_ripple",
        "torque ripple",
        &[("ripple_sin", ripple, Role::Size), ("ripple_cos", ripple, Role::Size), periodic("ripple_cycles", spans)],
        &[1.0],
        &cycles(spans),
    );
    let constant = either(shelf.base("torque_constant_error"), 0.05);
    shelf.add(
        "J11_torque_constant",
        "torque constant",
        &[("torque_constant_error", constant, Role::Size)],
        &[1.0],
        &[],
    );
    let lag = ParameterPrior::Positive { scale: 5e-4 };
    shelf.add("J12_current_loop", "lag", &[("current_lag", lag, Role::Size)], &[1.0], &[]);
    let limit = ParameterPrior::Below { top: spans.peak.min(shelf.base("torque_limit")), share: 0.2 };
    shelf.add("J13_saturation", "torque limit", &[("torque_limit", limit, Role::Size)], &[0.3, 1.0, 3.0], &[]);
    direction(shelf, spans);
}

/// Adds direction-dependent friction. Its two forms differ only at reversals, not while sliding, so that each is a
/// hypothesis of its own.
fn direction(shelf: &mut Shelf, spans: &Spans) {
    let asymmetry = either(shelf.base("coulomb_asymmetry"), 0.1 * spans.dry(shelf.base("coulomb")));
    shelf.add(
        "J18_drive_offset",
        "friction that depends on the direction",
        &[("coulomb_asymmetry", asymmetry, Role::Size)],
        &[1.0],
        &[],
    );
    let offset = either(shelf.base("offset"), 0.05 * spans.torque);
    shelf.add("J18_drive_offset", "torque offset", &[("offset", offset, Role::Size)], &[1.0], &[]);
}

fn load(shelf: &mut Shelf, spans: &Spans) {
    let gravity = either(0.0, 0.05 * spans.torque);
    // Without weight a payload is inertia and nothing else.
    if spans.payload_weight > 0.0 {
        let payload = either(0.0, 1.0);
        shelf.add("J14_payload", "mass beyond the model's", &[("payload", payload, Role::Size)], &[1.0], &[]);
    }
    let inertia = either(0.0, 0.1 * spans.inertia);
    shelf.add("J15_link_inertia", "inertia beyond the model's", &[("inertia_error", inertia, Role::Size)], &[1.0], &[]);
    // Along a line a weight is an offset and nothing else.
    if !spans.slides {
        shelf.add(
            "J16_gravity_compensation",
            "gravity torque beyond the model's",
            &[("gravity_cos", gravity, Role::Size), ("gravity_sin", gravity, Role::Size)],
            &[1.0],
            &[],
        );
    }
    let spring = 0.1 * spans.torque / spans.range;
    shelf.add(
        "J17_cable_drag",
        "spring",
        &[
            ("cable_stiffness", ParameterPrior::Positive { scale: spring }, Role::Size),
            ("cable_centre", either(spans.middle, 0.5 * spans.range), Role::Form),
        ],
        &[1.0],
        &grid([0.0]),
    );
}
