//! Effects of a contact: its normal law, its friction, its mount, and the force sensor's timing.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::{Entry, Hypothesis, Shelf, size};
use crate::model::unknown::{ParameterPrior, Role};
use std::f64::consts::TAU;

/// No plate that moves on a mount is as light \[kg\]; a lighter one would ring faster than the simulation's steps.
const LIGHTEST_PLATE: f64 = 0.1;

/// What the recordings of a contact span.
#[derive(Clone, Copy, Debug)]
struct Spans {
    /// Greatest normal force \[N\].
    force: f64,
    /// Greatest depth \[m\].
    depth: f64,
    /// Greatest rate along the normal \[m/s\].
    rate: f64,
    /// Greatest sliding speed \[m/s\].
    sliding: f64,
}

impl Spans {
    fn of(block: &MeasuredBlock) -> Self {
        let motion = || block.trials.iter().flat_map(|trial| trial.recorded.late.chunks(6));
        // The normal is the last axis, of one or of three.
        let normal = block.channels.len() - 1;
        let normal = block.trials.iter().flat_map(|trial| trial.measured[normal].iter());
        Self {
            force: normal.fold(0.0, |peak, force| peak.max(force.abs())),
            depth: motion().fold(1e-6, |peak, m| peak.max(-m[2])),
            rate: motion().fold(0.0, |peak, m| peak.max(m[5].abs())),
            sliding: motion().fold(0.0, |peak, m| peak.max(m[3].hypot(m[4]))),
        }
    }
}

/// A size of either sign about its nominal value.
fn either(shelf: &Shelf, name: &'static str, sd: f64) -> Entry {
    (name, ParameterPrior::Normal { mean: shelf.base(name), sd }, Role::Size)
}

fn grid(values: impl IntoIterator<Item = f64>) -> Vec<Vec<f64>> {
    values.into_iter().map(|value| vec![value]).collect()
}

/// Returns the hypotheses of a contact.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let (spans, mut shelf) = (Spans::of(block), Shelf::of(block));
    normal(&mut shelf, &spans);
    // Without a lateral force no friction is visible.
    if block.channels.len() > 1 {
        friction(&mut shelf, &spans);
    }
    mount(&mut shelf);
    sensor(&mut shelf);
    shelf.all
}

fn normal(shelf: &mut Shelf, spans: &Spans) {
    let share = size("K1_stiffness", "contact_stiffness_error");
    let stiffness = either(shelf, "stiffness", share * shelf.base("stiffness"));
    shelf.add("K1_stiffness", "stiffness", &[stiffness], &[1.0], &[]);
    let exponent = either(shelf, "exponent", size("K2_exponent", "contact_exponent_error"));
    shelf.add("K2_exponent", "exponent of force over depth", &[exponent], &[0.5], &[]);
    // A damping that gives a tenth of the greatest force at the greatest rate, at any depth or the greatest.
    let least = 0.1 * spans.force / spans.rate;
    let damping = size("K3_damping", "contact_damping_error") * shelf.base("damping");
    let linear = either(shelf, "damping", damping.max(least));
    let deep = either(shelf, "depth_damping", least / spans.depth);
    shelf.add("K3_damping", "damping", &[linear, deep], &[1.0], &[]);
    let surface = either(shelf, "surface", size("K7_surface_offset", "place_error_z"));
    shelf.add("K7_surface_offset", "position of the surface", &[surface], &[0.1], &[]);
    let scale = size("K8_adhesion", "contact_adhesion").max(0.02 * spans.force);
    let range = ParameterPrior::LogNormal { centre: shelf.base("adhesion_range"), spread: 1.0 };
    let entries = [("adhesion", ParameterPrior::Positive { scale }, Role::Size), ("adhesion_range", range, Role::Form)];
    shelf.add("K8_adhesion", "adhesion", &entries, &[1.0], &grid([-1.0, 0.0, 1.0]));
}

fn friction(shelf: &mut Shelf, spans: &Spans) {
    let nominal = shelf.base("friction");
    let level = if nominal > 0.0 { nominal } else { 0.1 };
    let coefficient = either(shelf, "friction", size("K4_friction", "contact_friction_error") * level);
    shelf.add("K4_friction", "friction", &[coefficient], &[1.0], &[]);
    let entries = [
        ("stribeck", ParameterPrior::Positive { scale: size("K5_stribeck", "contact_stribeck") * level }, Role::Size),
        ("stribeck_speed", ParameterPrior::LogNormal { centre: 0.1 * spans.sliding, spread: 1.0 }, Role::Form),
    ];
    shelf.add(
        "K5_stribeck",
        "friction that decreases with the sliding speed",
        &entries,
        &[1.0],
        &grid([-1.5, -0.5, 0.5, 1.5]),
    );
    let share = size("K6_anisotropy", "contact_anisotropy");
    let entries = [either(shelf, "anisotropy", share), either(shelf, "anisotropy_across", share)];
    shelf.add("K6_anisotropy", "friction that depends on the direction of sliding", &entries, &[0.5], &[]);
}

/// Adds the compliant mount. Its trial frequencies are a tenth apart, between the slowest that oscillates in a
/// recording and the fastest that its samples show. The softer the mount relative to the contact, the higher its
/// frequency in contact; a soft mount has a start of its own.
fn mount(shelf: &mut Shelf) {
    let scale = size("K10_fixture", "fixture_compliance");
    let (centre, damping) = (shelf.base("fixture_frequency"), shelf.base("fixture_damping"));
    let entries = [
        ("fixture_compliance", ParameterPrior::Positive { scale }, Role::Size),
        ("fixture_frequency", ParameterPrior::LogNormal { centre, spread: 1.0 }, Role::Form),
        ("fixture_damping", ParameterPrior::LogNormal { centre: damping, spread: 1.0 }, Role::Form),
    ];
    let forms: Vec<Vec<f64>> = (0..30).map(|k| vec![-1.5 + 0.1 * f64::from(k), 0.0]).collect();
    shelf.add("K10_fixture", "compliance with a resonance", &entries, &[0.5, 5.0], &forms);
    let mount = shelf.all.last_mut().expect("it was added");
    let mass = |form: &[f64]| {
        let of = |place: usize| mount.unknowns[place].prior.value(form[place]);
        1.0 / (of(0) * (TAU * of(1)).powi(2))
    };
    mount.forms.retain(|form| mass(form) > LIGHTEST_PLATE);
}

fn sensor(shelf: &mut Shelf) {
    let lag = ParameterPrior::Positive { scale: size("S5_low_pass", "sensor_lag") };
    shelf.add("S5_low_pass", "low-pass", &[("lag", lag, Role::Size)], &[0.05, 0.5], &[]);
}
