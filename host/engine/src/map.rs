//! Stability map: greatest contact stiffness or delay at which the loop is stable, by bisection through the loop itself.
//!
//! One dimension, ideal robots, pure delay h: two free bodies of reduced mass m on a spring k and damper b. Everything
//! depends on kappa = k h^2/m and r = b/(k h) alone. A compensator knows delay, stiffness and damping exactly.

use crate::cpu::replay;
use crate::{Job, RunInput};
use rayon::prelude::*;
use softdock_kernels::effects::EffectSet;
use softdock_kernels::metrics::flags;
use softdock_kernels::model::*;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use std::f64::consts::{PI, TAU};

/// Command periods in a delay: the step's own share of r - 1, about 1.6 over this, stays below 1 %.
const TICKS: f64 = 200.0;
/// Speed of approach \[m/s\]; of no consequence, the loop is linear or homogeneous in it.
const SPEED: f64 = 0.1;
/// The map's softest and stiffest contact, as kappa, the factor of its first scan and the steps of its bisection.
const SOFTEST: f64 = 4e-3;
const STIFFEST: f64 = 3.0;
const SCAN: f64 = 1.3;
const BISECTIONS: u32 = 8;

/// Which limit is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// A contact that never opens does not swing up.
    Linear,
    /// A bounce without adhesion gives back no more energy than came in.
    Energy,
}

/// Dampings b/(k h) of the map; the least are met only with a compensator.
const RATIOS: [f64; 16] = [0.02, 0.1, 0.3, 0.6, 0.9, 1.05, 1.1, 1.2, 1.35, 1.55, 1.72, 2.0, 2.2, 2.6, 3.0, 3.8];

/// The limits of one compensator: points of b/(k h) and k h^2/m.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitCurve {
    /// Compensator.
    pub name: &'static str,
    /// Linear limit, computed through the loop.
    pub linear: Vec<(f64, f64)>,
    /// Energy limit, computed through the loop.
    pub energy: Vec<(f64, f64)>,
    /// Linear limit in closed form.
    pub closed: Vec<(f64, f64)>,
}

/// The number of limits that [`stability_map`] computes at every so many dampings.
pub fn count_limits(every: usize) -> usize {
    let limits = |(_, kind): &(_, CompensatorKind)| if is_nonlinear(*kind) { 1 } else { 2 };
    CompensatorKind::NAMES.iter().map(limits).sum::<usize>() * RATIOS.iter().step_by(every).count()
}

/// The limits of all compensators, for a reduced mass \[kg\] and a delay \[s\], at every so many dampings; `found` is called
/// from any thread when a limit has been computed.
pub fn stability_map(mass: f64, delay: f64, every: usize, found: &(dyn Fn() + Sync)) -> Vec<LimitCurve> {
    let curve = |(name, kind): &(&'static str, CompensatorKind)| {
        let limit_at = |limit, ratio| {
            let limit = stiffest(limit, *kind, mass, delay, ratio);
            found();
            limit
        };
        limit_curve(name, *kind, every, &limit_at)
    };
    CompensatorKind::NAMES.par_iter().map(curve).collect()
}

/// Whether a compensator observes energy: a contact that never opens has no roots there.
fn is_nonlinear(kind: CompensatorKind) -> bool {
    matches!(kind, CompensatorKind::Passivity | CompensatorKind::LeadPassivity)
}

fn limit_curve(
    name: &'static str,
    kind: CompensatorKind,
    every: usize,
    limit_at: &(dyn Fn(Limit, f64) -> Option<f64> + Sync),
) -> LimitCurve {
    let found = |limit| -> Vec<(f64, f64)> {
        let at = |ratio: &f64| Some((*ratio, limit_at(limit, *ratio)?));
        RATIOS.iter().step_by(every).collect::<Vec<_>>().into_par_iter().filter_map(at).collect()
    };
    let closed = (1..400).map(|i| 0.01 * f64::from(i)).filter_map(|ratio| Some((ratio, closed_form(kind, ratio)?)));
    LimitCurve {
        name,
        linear: if is_nonlinear(kind) { Vec::new() } else { found(Limit::Linear) },
        energy: found(Limit::Energy),
        closed: closed.filter(|point| point.1 <= 4.0).collect(),
    }
}

/// A contact in a delayed loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayedContact {
    /// Reduced mass of the two bodies \[kg\].
    pub mass: f64,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Damping \[N s/m\].
    pub damping: f64,
    /// Dead time of the loop \[s\].
    pub delay: f64,
}

impl DelayedContact {
    /// The contact of given kappa = k h^2/m and r = b/(k h) at a mass and a delay.
    pub fn of(mass: f64, delay: f64, kappa: f64, ratio: f64) -> Self {
        let stiffness = kappa * mass / (delay * delay);
        Self { mass, stiffness, damping: ratio * stiffness * delay, delay }
    }

    fn period(&self) -> f64 {
        TAU * (self.mass / self.stiffness).sqrt()
    }

    fn params(&self) -> Params<f64> {
        Params {
            base_mass: 2.0 * self.mass,
            target_mass: 2.0 * self.mass,
            closing_speed: SPEED,
            contact_stiffness: self.stiffness,
            contact_damping: self.damping,
            loop_delay: self.delay,
            compensator_delay: self.delay,
            compensator_stiffness: self.stiffness,
            compensator_damping: self.damping,
            compensator_energy: 0.0,
            ..Params::null()
        }
    }

    /// Runs the loop for a time; gives the gap of the facility's simulated parts after each tick, and the restitution;
    /// nothing of a run that has diverged.
    fn run(&self, kind: CompensatorKind, bilateral: bool, time: f64) -> Option<(Vec<f64>, f64)> {
        let step = self.delay / TICKS;
        let gap = if bilateral { 0.0 } else { 2.0 * SPEED * step };
        let params = self.params();
        let mut model = bodies(step, (time / step).ceil() as u32, gap, params);
        model.contact.bilateral = bilateral;
        model.facility.compensator.kind = kind;
        model.task.end_after_separation = 2.0 * self.delay;
        let mut gaps = Vec::new();
        let effects = EffectSet::of(&params, &model.timing);
        let job = Job::new(Plant::new(model).with_effects(effects), 1, false);
        let end = replay(&job, RunInput::new(0, params), &mut |signals| {
            gaps.push(signals.parts[1].a.position.x - signals.parts[1].b.position.x);
        });
        (end.flags & flags::HIL_UNSTABLE == 0).then_some((gaps, end.hil.separation_speed / SPEED))
    }

    /// Growth per second of the dominant oscillation of a contact that never opens.
    ///
    /// With one pair of roots z left, x0..x3 obey `x[n+2] = p x[n+1] - |z|^2 x[n]`; four samples give |z|. Where no
    /// oscillation is left the size decides; a run that has met its bound grows without one.
    pub fn growth(&self, kind: CompensatorKind) -> f64 {
        let step = self.delay / TICKS;
        let stride = (self.period() / 4.0 / step).round().max(1.0) as usize;
        // Behind the dominant pair the delay has further ones, which die out within some tens of delays.
        let first = (1.75 * self.period() / step) as usize + 40 * TICKS as usize;
        let Some((gaps, _)) = self.run(kind, true, (first + 3 * stride + 2) as f64 * step) else {
            return f64::INFINITY;
        };
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| gaps[first + i * stride]);
        // Little is left but rounding.
        if c.abs().max(d.abs()) < 1e-10 * SPEED * self.period() {
            return f64::NEG_INFINITY;
        }
        let (square, bend) = ((c * c - b * d) / (b * b - a * c), (b * b - a * c).abs());
        let swings = square > 0.0 && bend > 1e-6 * (b * b).max((a * c).abs());
        let factor = if swings { square } else { (d / a).abs().powf(2.0 / 3.0) };
        factor.ln() / (2.0 * stride as f64 * step)
    }

    /// Restitution of a bounce without adhesion.
    pub fn restitution(&self, kind: CompensatorKind) -> f64 {
        self.run(kind, false, 3.0 * self.period() + 20.0 * self.delay).map_or(f64::INFINITY, |(_, e)| e)
    }

    /// Whether the contact is within a limit.
    pub fn is_within(&self, limit: Limit, kind: CompensatorKind) -> bool {
        match limit {
            Limit::Linear => self.growth(kind) <= 0.0,
            Limit::Energy => self.restitution(kind) <= 1.0,
        }
    }
}

/// The least kappa at which a loop exceeds its limit, for fixed mass, delay and r = b/(k h); `None` if it is out of the
/// limit from the softest contact on, or within it to the stiffest.
pub fn stiffest(limit: Limit, kind: CompensatorKind, mass: f64, delay: f64, ratio: f64) -> Option<f64> {
    first_beyond(SOFTEST, STIFFEST, |kappa| DelayedContact::of(mass, delay, kappa, ratio).is_within(limit, kind))
}

/// The least delay \[s\] at which a contact exceeds its limit.
pub fn longest_delay(limit: Limit, kind: CompensatorKind, contact: DelayedContact) -> Option<f64> {
    let of = |kappa: f64| (kappa * contact.mass / contact.stiffness).sqrt();
    // A weakly damped contact exceeds its limit long before the softest one of the map does.
    first_beyond(of(1e-2 * SOFTEST), of(STIFFEST), |delay| DelayedContact { delay, ..contact }.is_within(limit, kind))
}

/// Scans upwards for the first value that is not within, then bisects.
fn first_beyond(least: f64, most: f64, within: impl Fn(f64) -> bool) -> Option<f64> {
    if !within(least) {
        return None;
    }
    let (mut low, mut high) = (least, least * SCAN);
    while within(high) {
        (low, high) = (high, high * SCAN);
        if low > most {
            return None;
        }
    }
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        if within(middle) { low = middle } else { high = middle }
    }
    Some((low * high).sqrt())
}

/// The linear limit in closed form: kappa of the first root j phi/h of -phi^2 + kappa L(j phi) = 0, where the imaginary
/// part of L vanishes; `None` without one, and for compensators that are not linear.
pub fn closed_form(kind: CompensatorKind, ratio: f64) -> Option<f64> {
    linear_loop(kind, ratio, 1.0)?;
    let of = |phi: f64| linear_loop(kind, ratio, phi).unwrap_or((0.0, 0.0));
    let step = 1e-3;
    let crossing = (1..(PI / step) as u32).map(|i| f64::from(i) * step).find(|phi| {
        let (now, next) = (of(*phi), of(phi + step));
        now.1 * next.1 < 0.0 && now.0 > 0.0
    })?;
    let (mut low, mut high) = (crossing, crossing + step);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if of(low).1 * of(middle).1 <= 0.0 { high = middle } else { low = middle }
    }
    Some(low * low / of(low).0)
}

/// Force over stiffness and gap at the frequency phi/h: real and imaginary part of L.
fn linear_loop(kind: CompensatorKind, ratio: f64, phi: f64) -> Option<(f64, f64)> {
    let times = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let late = (phi.cos(), -phi.sin());
    let measured = times((1.0, ratio * phi), late);
    match kind {
        CompensatorKind::None => Some(measured),
        CompensatorKind::FirstOrderLead => Some(times(measured, (1.0, phi))),
        CompensatorKind::Smith => Some((measured.0 + 1.0 - late.0, measured.1 - late.1)),
        CompensatorKind::VirtualDamping => Some((measured.0, measured.1 + phi)),
        // A second derivative of a damped contact outgrows the mass: b h^2/2 s^3 over m s^2. How fast its differences
        // are decides then, no root near the contact's own frequency.
        CompensatorKind::SecondOrderLead => None,
        CompensatorKind::Passivity | CompensatorKind::LeadPassivity => None,
    }
}

/// A point of one body in front of a plane of the other.
fn bodies(step: f64, ticks: u32, gap: f64, nominal: Params<f64>) -> Model {
    Model {
        facility: Facility { unstable_speed: 1e3, ..Facility::IDEAL },
        task: Task { touch: true, ..Task::OPEN },
        nominal,
        ..Model::two_bodies(Timing { substep: step, substeps: 1, max_ticks: ticks }, gap)
    }
}
