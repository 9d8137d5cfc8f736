//! Fit of a contact law to measured forces along measured motions, by the contact stage of the simulation.

use super::estimate::{ContactDetermination, ContactEstimate, FittedContact};
use super::search::{SearchSize, search};
use super::touches::{Touch, Touches};
use super::uncertainty::{ParameterUncertainty, SampleRange};
use nalgebra::DVector;
use softdock_campaign::rebound_restitution;
use softdock_diagnosis::inference::fit::{Fitted, Simulate};
use softdock_diagnosis::model::unknown::{ParameterPrior, Role, Unknown};
use softdock_engine::contact_law::{PointOnPlate, contact_forces};
use softdock_kernels::material::NormalLaw;

/// A law that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FittedLaw {
    /// F = K d + b d'.
    Linear,
    /// F = K d^n (1 + a d').
    Power,
    /// F = K d^n (1 + D d'/v).
    Rebound,
}

impl FittedLaw {
    /// All laws by the words of a scenario file.
    pub const NAMED: [(&'static str, Self); 3] =
        [("linear", Self::Linear), ("power", Self::Power), ("rebound", Self::Rebound)];

    /// Returns the word of a scenario file.
    pub fn word(self) -> &'static str {
        Self::NAMED.iter().find(|row| row.1 == self).expect("every law has a row").0
    }
}

/// Prior standard deviation of an exponent, and of the surface as a share of the greatest depth.
const EXPONENT: f64 = 0.5;
const SURFACE_SHARE: f64 = 0.2;
/// Prior standard deviation of stiffnesses and of friction, as the natural logarithm of a factor.
const STIFFNESS_FACTOR: f64 = 2.0;
const FRICTION: f64 = 0.3;
const FRICTION_FACTOR: f64 = 1.0;
/// Speed below which every touch is damped as one of this speed, over the speed of the fastest touch.
const SLOWEST_SHARE: f64 = 0.1;
/// Least noise over the greatest force: beyond it no sensor is known.
const LEAST_NOISE: f64 = 1e-4;
/// Noise at first, over the greatest force.
const FIRST_NOISE: f64 = 0.02;

/// Fit of a law.
#[derive(Clone, Debug)]
pub struct LawFit {
    /// The law.
    pub law: FittedLaw,
    /// Slowest touch that is damped at its own speed \[m/s\].
    pub slowest: f64,
    /// Estimates under the keys of `[contact]`.
    pub estimates: Vec<ContactEstimate>,
    /// Height of the surface with its interval \[m\].
    pub surface: (f64, [f64; 2]),
    /// Restitution of two free bodies at the speed of the fastest touch, if the law gives one without a mass.
    pub restitution: Option<f64>,
    /// Root mean square of the residual of the normal force over that of the force, on the fitted touches.
    pub error: f64,
    /// Bayes information criterion with the number of independent samples.
    pub criterion: f64,
    /// Number of independent samples.
    pub independent: f64,
    /// The parameters of the fit, in the order of [`PointOnPlate::parameters`].
    pub values: Vec<f64>,
}

/// Extremes of the touches.
struct Extremes {
    force: f64,
    depth: f64,
    speed: f64,
    surface: f64,
}

impl Extremes {
    fn of(touches: &[&Touch]) -> Self {
        let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let mut begins: Vec<f64> = touches.iter().map(|touch| touch.at(touch.first).position.z).collect();
        begins.sort_by(f64::total_cmp);
        let surface = begins[begins.len() / 2];
        let samples = || touches.iter().flat_map(|touch| (touch.first..touch.force.len()).map(move |i| (touch, i)));
        Self {
            force: most(&mut samples().map(|(touch, i)| touch.force[i][2])),
            depth: most(&mut samples().map(|(touch, i)| surface - touch.at(i).position.z)).max(1e-9),
            speed: most(&mut samples().map(|(touch, i)| touch.at(i).velocity.z.abs())).max(1e-9),
            surface,
        }
    }
}

/// The law with an exponent that is a parameter of each lane, on top of 1.
fn kernel_law(law: FittedLaw, slowest: f64) -> NormalLaw {
    match law {
        FittedLaw::Linear => NormalLaw::Linear,
        FittedLaw::Power => NormalLaw::Power { exponent: 1.0 },
        FittedLaw::Rebound => NormalLaw::Rebound { exponent: 1.0, slowest },
    }
}

/// Measured touches under a law.
struct Compared<'a> {
    touches: &'a [&'a Touch],
    contacts: Vec<PointOnPlate>,
    channels: Vec<usize>,
}

impl<'a> Compared<'a> {
    fn new(law: NormalLaw, touches: &'a [&'a Touch], lateral: [bool; 2]) -> Self {
        let contact =
            |touch: &&Touch| PointOnPlate::new(law, touch.step / touch.finer as f64, touch.finer, touch.motion.clone());
        let channels = (0..3).filter(|axis| *axis == 2 || lateral[*axis]).collect();
        Self { touches, contacts: touches.iter().map(contact).collect(), channels }
    }

    /// Where the samples of each channel of each touch are in a residual.
    fn series(&self) -> Vec<Vec<SampleRange>> {
        let mut at = 0;
        let mut next = |length: usize| {
            at += length;
            at - length..at
        };
        self.touches.iter().map(|touch| self.channels.iter().map(|_| next(touch.force.len())).collect()).collect()
    }

    /// Measured less modelled forces over the noise of each channel, without the mean of each recording: a tare is unknown.
    fn residuals(&self, sets: &[Vec<f64>], noise: [f64; 3]) -> Vec<DVector<f64>> {
        let contacts: Vec<&PointOnPlate> = self.contacts.iter().collect();
        let forces = contact_forces(&contacts, sets);
        (0..sets.len()).map(|set| self.residual(&|touch| &forces[touch][set], noise)).collect()
    }

    fn residual<'f>(&self, forces: &dyn Fn(usize) -> &'f Vec<f64>, noise: [f64; 3]) -> DVector<f64> {
        let mut residual = Vec::new();
        for (number, touch) in self.touches.iter().enumerate() {
            let modelled = forces(number);
            for axis in &self.channels {
                let of = |(i, force): (usize, &[f64; 3])| (force[*axis] - modelled[3 * i + axis]) / noise[*axis];
                residual.extend(touch.force.iter().enumerate().map(of));
            }
        }
        let mut residual = DVector::from_vec(residual);
        let series = self.series();
        for channel in 0..self.channels.len() {
            let mut from = 0;
            while from < self.touches.len() {
                let name = &self.touches[from].recording;
                let to = (from..self.touches.len()).find(|t| self.touches[*t].recording != *name);
                let to = to.unwrap_or(self.touches.len());
                let own: Vec<SampleRange> = series[from..to].iter().map(|touch| touch[channel].clone()).collect();
                let count: usize = own.iter().map(ExactSizeIterator::len).sum();
                let mean = own.iter().cloned().flatten().map(|i| residual[i]).sum::<f64>() / count as f64;
                own.into_iter().flatten().for_each(|i| residual[i] -= mean);
                from = to;
            }
        }
        residual
    }

    /// Root mean square of a residual in each channel, in newtons.
    fn rms(&self, residual: &DVector<f64>, noise: [f64; 3]) -> [f64; 3] {
        let series = self.series();
        let mut all = noise;
        for (channel, axis) in self.channels.iter().enumerate() {
            let own = || series.iter().flat_map(|touch| touch[channel].clone());
            let sum: f64 = own().map(|i| residual[i] * residual[i]).sum();
            all[*axis] = noise[*axis] * (sum / own().count() as f64).sqrt();
        }
        all
    }
}

fn unknowns(law: FittedLaw, extremes: &Extremes, lateral: bool) -> Vec<Unknown> {
    let table = PointOnPlate::parameters();
    let of = |name: &str, prior: ParameterPrior| {
        let field = table.iter().position(|field| field.name == name).expect("a parameter of the contact");
        Unknown::new(name, field, table[field].unit, prior, Role::Form)
    };
    let factor = |centre: f64, spread: f64| ParameterPrior::LogNormal { centre, spread };
    let stiffness = extremes.force / extremes.depth;
    let mut all = vec![
        of("stiffness", factor(stiffness, STIFFNESS_FACTOR)),
        of("surface", ParameterPrior::Normal { mean: extremes.surface, sd: SURFACE_SHARE * extremes.depth }),
    ];
    match law {
        FittedLaw::Linear => {
            all.push(of("damping", ParameterPrior::Positive { scale: extremes.force / extremes.speed }));
        }
        FittedLaw::Power | FittedLaw::Rebound => {
            all.push(of("exponent_error", ParameterPrior::Normal { mean: 0.25, sd: EXPONENT }));
            let slower = if law == FittedLaw::Rebound { SLOWEST_SHARE } else { 1.0 };
            all.push(of("dissipation", ParameterPrior::Positive { scale: 1.0 / (slower * extremes.speed) }));
        }
    }
    if lateral {
        all.push(of("friction", factor(FRICTION, FRICTION_FACTOR)));
        all.push(of("bristle_stiffness", factor(stiffness, STIFFNESS_FACTOR)));
        all.push(of("bristle_damping", ParameterPrior::Positive { scale: 0.1 * extremes.force / extremes.speed }));
    }
    all
}

/// Parameters that no fit changes: no effect of the mounted parts.
fn base() -> Vec<f64> {
    let table = PointOnPlate::parameters();
    table.iter().map(|field| if field.name == "stribeck_speed" { 0.1 } else { 0.0 }).collect()
}

/// Fits a law to the touches that are not held out.
pub fn fit_law(law: FittedLaw, touches: &Touches, size: SearchSize) -> LawFit {
    let own = touches.part(false);
    let extremes = Extremes::of(&own);
    let slowest = SLOWEST_SHARE * extremes.speed;
    let lateral = touches.lateral.iter().any(|recorded| *recorded);
    let compared = Compared::new(kernel_law(law, slowest), &own, touches.lateral);
    let (unknowns, base) = (unknowns(law, &extremes, lateral), base());
    let mut noise = [FIRST_NOISE * extremes.force; 3];
    let fitted_with = |noise: [f64; 3], size: SearchSize| {
        let simulate = |sets: &[Vec<f64>]| compared.residuals(sets, noise);
        search(&unknowns, &base, size, &simulate as &Simulate)
    };
    let mut fitted = fitted_with(noise, size);
    // The residual of the first fit is the noise of the second, so that channels weigh by it and priors stay weak.
    for _ in 0..2 {
        noise = compared.rms(&fitted.residual, noise).map(|rms| rms.max(LEAST_NOISE * extremes.force));
        let simulate = |sets: &[Vec<f64>]| compared.residuals(sets, noise);
        fitted = refined(&fitted, &base, &simulate);
    }
    described(law, slowest, &compared, &extremes, &fitted, &base, noise)
}

/// The fit again from where it ended.
fn refined(fitted: &Fitted, base: &[f64], simulate: &Simulate) -> Fitted {
    let start = softdock_diagnosis::inference::fit::Start::new(0, fitted.unknowns.clone(), fitted.z.clone());
    softdock_diagnosis::inference::fit::fit(vec![start], base, 1e-4, simulate).remove(0)
}

fn described(
    law: FittedLaw,
    slowest: f64,
    compared: &Compared,
    extremes: &Extremes,
    fitted: &Fitted,
    base: &[f64],
    noise: [f64; 3],
) -> LawFit {
    let uncertainty = ParameterUncertainty::of(fitted, &compared.series());
    let found = FittedContact { fitted, uncertainty: &uncertainty };
    let place = |name: &str| found.place(name);
    let of = |name: &str| found.value(place(name).expect("a parameter of the law"));
    let mut estimates = Vec::new();
    let mut restitution = None;
    let scale = 1.0 / extremes.speed;
    match law {
        FittedLaw::Linear => {
            let (value, interval) = of("stiffness");
            estimates.push(ContactEstimate::new("stiffness", "N/m", value, interval));
            let (value, interval) = of("damping");
            let most = extremes.force / extremes.speed;
            estimates.push(ContactEstimate::positive("damping", "N s/m", value, interval, most));
        }
        FittedLaw::Power | FittedLaw::Rebound => {
            let (stiffness, exponent) = (place("stiffness").expect("fitted"), place("exponent_error").expect("fitted"));
            let (value, interval) = found.power_stiffness(stiffness, exponent);
            estimates.push(ContactEstimate::new("stiffness", "N/m", value, interval));
            let (value, interval) = found.value(exponent);
            estimates.push(ContactEstimate::new("exponent", "1", 1.0 + value, interval.map(|end| 1.0 + end)));
            let (value, interval) = of("dissipation");
            let at = if law == FittedLaw::Rebound { slowest } else { extremes.speed };
            let damped = ContactEstimate::positive("dissipation", "s/m", value, interval, scale * extremes.speed / at);
            if damped.determination == ContactDetermination::Determined {
                restitution = Some(rebound_restitution(value * at));
            }
            estimates.push(if law == FittedLaw::Rebound { as_restitution(&damped, slowest) } else { damped });
        }
    }
    friction(&found, extremes, &mut estimates);
    let values = fitted.values(base);
    let forces = compared.touches.iter().flat_map(|touch| touch.force.iter().map(|force| force[2]));
    let power = forces.clone().map(|force| force * force).sum::<f64>() / forces.count() as f64;
    let rms = compared.rms(&fitted.residual, noise);
    let tau = fitted.residual.len() as f64 / uncertainty.independent;
    // Channels keep their own noise, so that the criterion compares the residuals in newtons.
    let logs: f64 =
        compared.channels.iter().map(|axis| 2.0 * rms[*axis].ln()).sum::<f64>() / compared.channels.len() as f64;
    LawFit {
        law,
        slowest,
        estimates,
        surface: of("surface"),
        restitution,
        error: rms[2] / power.sqrt().max(f64::MIN_POSITIVE),
        criterion: uncertainty.independent * logs + fitted.z.len() as f64 * (fitted.residual.len() as f64 / tau).ln(),
        independent: uncertainty.independent,
        values,
    }
}

/// Restitution of a law whose damping is stated by it; a greater dissipation is a smaller restitution.
fn as_restitution(damped: &ContactEstimate, slowest: f64) -> ContactEstimate {
    let of = |dissipation: f64| rebound_restitution(dissipation * slowest);
    let interval = damped.interval.map(|[lo, hi]| [of(hi), of(lo)]);
    ContactEstimate {
        key: "restitution",
        unit: "1",
        value: damped.value.map(of),
        interval,
        reason: damped.reason.replace("from 0", "from 1"),
        ..damped.clone()
    }
}

fn friction(found: &FittedContact, extremes: &Extremes, estimates: &mut Vec<ContactEstimate>) {
    const KEYS: [(&str, &str); 3] = [("friction", "1"), ("bristle_stiffness", "N/m"), ("bristle_damping", "N s/m")];
    for (key, unit) in KEYS {
        estimates.push(match found.place(key) {
            None => ContactEstimate::undetermined(key, unit, "the recordings have no lateral force with its position"),
            Some(place) => {
                let (value, interval) = found.value(place);
                match key {
                    "bristle_damping" => {
                        let most = extremes.force / extremes.speed;
                        ContactEstimate::positive(key, unit, value, interval, most)
                    }
                    _ => ContactEstimate::new(key, unit, value, interval),
                }
            }
        });
    }
}

/// Measured and predicted normal force of a touch, the recording's tare aside.
#[derive(Clone, Debug)]
pub struct PredictedTouch<'a> {
    /// The touch.
    pub touch: &'a Touch,
    /// Measured normal force less the mean difference of its recording \[N\].
    pub measured: Vec<f64>,
    /// Predicted normal force \[N\].
    pub predicted: Vec<f64>,
}

impl PredictedTouch<'_> {
    /// Root mean square of the difference over that of the force.
    pub fn error(&self) -> f64 {
        let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
        let difference = square(&mut self.measured.iter().zip(&self.predicted).map(|(m, p)| m - p));
        (difference / square(&mut self.measured.iter().copied()).max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Predicted less measured peak force over the measured one.
    pub fn peak_error(&self) -> f64 {
        let peak = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        peak(&self.predicted) / peak(&self.measured).max(f64::MIN_POSITIVE) - 1.0
    }
}

/// Predicts the touches of a part with a fitted law.
pub fn predicted<'a>(fit: &LawFit, touches: &'a Touches, held_out: bool) -> Vec<PredictedTouch<'a>> {
    let own = touches.part(held_out);
    let compared = Compared::new(kernel_law(fit.law, fit.slowest), &own, touches.lateral);
    let contacts: Vec<&PointOnPlate> = compared.contacts.iter().collect();
    let forces = contact_forces(&contacts, std::slice::from_ref(&fit.values));
    let residual = compared.residual(&|touch| &forces[touch][0], [1.0; 3]);
    let normal = compared.channels.iter().position(|axis| *axis == 2).expect("always compared");
    let series = compared.series();
    let touch = |(number, touch): (usize, &&'a Touch)| {
        let predicted: Vec<f64> = (0..touch.force.len()).map(|i| forces[number][0][3 * i + 2]).collect();
        let rest = residual.rows(series[number][normal].start, touch.force.len());
        let measured = predicted.iter().zip(rest.iter()).map(|(force, rest)| force + rest).collect();
        PredictedTouch { touch, measured, predicted }
    };
    own.iter().enumerate().map(touch).collect()
}
