//! Hypotheses of each block: its possible effects with their priors and forms.

use crate::model::block::MeasuredBlock;
use crate::model::unknown::{ParameterPrior, Role, Unknown};
use softdock_kernels::effects::{DICTIONARY, Effect, EffectId, row_of};

/// Hypothesis of an effect in a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// Row of the effect table: id, and the groups of confounded effects.
    pub effect: &'static Effect,
    /// Short description for this plant.
    pub name: &'static str,
    /// Free parameters.
    pub unknowns: Vec<Unknown>,
    /// Forms for the screening: a `z` for every free parameter, at a finite size.
    pub forms: Vec<Vec<f64>>,
    /// Indices of the free parameters that are sizes of one form, matched together.
    pub sizes: Vec<usize>,
    /// Whether the shape of the signature depends on the size, so that forms are screened at their own sizes.
    pub shaped: bool,
    /// Whether its sizes belong to the calibration: what any model of such a plant has slightly wrong. They are fitted
    /// together before structure is searched.
    pub calibration: bool,
}

impl Hypothesis {
    /// Returns component, description and id.
    pub fn words(&self) -> String {
        format!("{}: {} ({})", self.effect.component, self.name, self.effect.id)
    }

    /// Returns whether the residual is linear in its sizes: no form parameters, and no threshold.
    pub fn is_linear(&self) -> bool {
        !self.shaped && self.sizes.len() == self.unknowns.len()
    }

    /// Returns whether it contains all parameters of another.
    pub(crate) fn has_all_of(&self, other: &Self) -> bool {
        other.unknowns.iter().all(|inner| self.unknowns.iter().any(|own| own.field == inner.field))
    }
}

/// Builds hypotheses of one block.
pub(crate) struct Shelf<'a> {
    pub(crate) block: &'a MeasuredBlock,
    pub(crate) all: Vec<Hypothesis>,
}

/// A free number as a library writes it.
pub(crate) type Entry = (&'static str, ParameterPrior, Role);

impl<'a> Shelf<'a> {
    pub(crate) fn of(block: &'a MeasuredBlock) -> Self {
        Self { block, all: Vec::new() }
    }

    /// The nominal value of a parameter.
    pub(crate) fn base(&self, name: &str) -> f64 {
        self.block.base[self.block.field(name)]
    }

    /// Limits a parameter, wherever it is free, to what physics allows.
    pub(crate) fn limit(&mut self, name: &str, limits: [f64; 2]) {
        let unknowns = self.all.iter_mut().flat_map(|hypothesis| &mut hypothesis.unknowns);
        unknowns.filter(|unknown| unknown.name == name).for_each(|unknown| unknown.limits = limits);
    }

    /// Makes the effects of these parameters alone part of the calibration.
    pub(crate) fn calibrate(&mut self, names: &[&str]) {
        for hypothesis in &mut self.all {
            hypothesis.calibration = hypothesis.unknowns.iter().all(|unknown| names.contains(&unknown.name.as_str()));
        }
    }

    /// Adds a form outside the catalogue.
    pub(crate) fn form(&mut self, name: &'static str, (field, prior, role): Entry) {
        let unknowns = vec![Unknown::of(&self.block.section, field, prior, role)];
        let forms = vec![vec![1.0]];
        self.all.push(Hypothesis {
            effect: &DICTIONARY,
            name,
            unknowns,
            forms,
            sizes: vec![0],
            shaped: false,
            calibration: false,
        });
    }

    /// Adds an effect of the table. Its forms: every combination of the given `z` of its form numbers, at the given
    /// sizes.
    pub(crate) fn add(&mut self, id: &str, name: &'static str, entries: &[Entry], sizes: &[f64], forms: &[Vec<f64>]) {
        let unknown = |(name, prior, role): &Entry| Unknown::of(&self.block.section, name, *prior, *role);
        let unknowns: Vec<Unknown> = entries.iter().map(unknown).collect();
        let shaped = |size: f64, form: &[f64]| -> Vec<f64> {
            let mut form = form.iter();
            let z = |unknown: &Unknown| if unknown.role == Role::Size { size } else { *form.next().unwrap_or(&0.0) };
            unknowns.iter().map(z).collect()
        };
        let none = [Vec::new()];
        let forms = if forms.is_empty() { &none[..] } else { forms };
        let forms = forms.iter().flat_map(|form| sizes.iter().map(|size| shaped(*size, form)).collect::<Vec<_>>());
        let forms = forms.collect();
        let places = (0..unknowns.len()).filter(|i| unknowns[*i].role == Role::Size).collect();
        let effect = row_of(id).expect("an id of the effect tables");
        let shaped = sizes.len() > 1;
        self.all.push(Hypothesis { effect, name, unknowns, forms, sizes: places, shaped, calibration: false });
    }
}

/// The plausible size of a parameter by the effect table.
pub(crate) fn size(id: &str, field: &str) -> f64 {
    let parameters = EffectId::of(id).effect().parameters;
    parameters.iter().find(|parameter| parameter.field == field).expect("a parameter of the effect").scale
}
