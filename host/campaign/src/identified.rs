//! Effects that a diagnosis found, read back from behind a model file: their values, and how well they are known.

use crate::check::Checker;
use crate::distribution::normal_quantile;
use crate::ranges::{in_words, legal, legal_range};
use crate::suggest::suggestion;
use crate::units::show;
use crate::written::effect::EffectTable;
use nalgebra::DMatrix;
use softdock_kernels::effects::{BENCH_EFFECTS, DICTIONARY, EFFECTS};
use softdock_kernels::fields::{Bundle, fields, from_slice, to_vec};
use softdock_kernels::params::Params;
use softdock_kernels::philox::uniform;
use softdock_kernels::range::Range;

/// An effect of a scenario's facility.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedEffect {
    /// Catalogue id.
    pub id: String,
    /// Its parameters, by their places in the table of [`Params`].
    pub fields: Vec<usize>,
    /// Cholesky factor of their covariance, row by row; empty if they are known exactly.
    pub factor: Vec<Vec<f64>>,
}

impl IdentifiedEffect {
    /// Whether its values are known to a covariance.
    pub fn is_uncertain(&self) -> bool {
        !self.factor.is_empty()
    }

    /// By how much its parameters differ from their best values in an outer draw of a campaign.
    fn deviations(&self, seed: u64, outer: u32) -> Vec<f64> {
        // Counter 0 belongs to the runs, as with every epistemic stream.
        let normal = |place: usize| normal_quantile(uniform(seed, &format!("{}.{place}", self.id), 0, 1 + outer));
        let z: Vec<f64> = (0..self.fields.len()).map(normal).collect();
        self.factor.iter().map(|row| row.iter().zip(&z).map(|(weight, z)| weight * z).sum()).collect()
    }

    /// Puts its values in the places of whatever a campaign draws for them: the measured facility is the one that there
    /// is. In an outer draw they are drawn from the posterior, within what is legal.
    pub(crate) fn put(&self, nominal: &[f64], posterior: Option<(u64, u32)>, values: &mut [f64]) {
        let off = posterior.map_or_else(Vec::new, |(seed, outer)| self.deviations(seed, outer));
        let table = fields::<f64, Params<f64>>();
        for (k, place) in self.fields.iter().enumerate() {
            let (least, greatest) = legal_range(&table[*place].name);
            values[*place] = (nominal[*place] + off.get(k).copied().unwrap_or(0.0)).clamp(least, greatest);
        }
    }
}

/// The parameters of a scenario with those that its effects name, and the effects.
pub(crate) fn identified_effects(
    c: &mut Checker,
    written: &[EffectTable],
    nominal: &mut Params<f64>,
) -> Vec<IdentifiedEffect> {
    let table = fields::<f64, Params<f64>>();
    let mut all = Vec::new();
    for effect in written.iter().filter(|effect| is_known(c, effect)).collect::<Vec<_>>() {
        *nominal = with_parameters(c, false, effect, nominal);
        let values = to_vec(nominal);
        let place = |name: &String| table.iter().position(|field| field.name == *name);
        let places: Vec<usize> = effect.parameters.keys().filter_map(place).collect();
        for (place, quantity) in places.iter().zip(effect.parameters.values()) {
            let (field, range) = (&table[*place], legal(&table[*place].name));
            if !range.contains(values[*place]) {
                let message = format!("{} is out of range", show(values[*place], field.unit));
                c.refuse(&quantity.span, message, format!("write a value {}", in_words(range, field.unit)));
            }
        }
        let factor = factor(c, effect, places.len());
        all.push(IdentifiedEffect { id: effect.id.value.clone(), fields: places, factor });
    }
    all
}

/// Cholesky factor of an effect's covariance.
fn factor(c: &mut Checker, effect: &EffectTable, count: usize) -> Vec<Vec<f64>> {
    let Some(written) = &effect.covariance else {
        return Vec::new();
    };
    let rows = &written.value;
    let square = rows.len() == count && rows.iter().all(|row| row.len() == count);
    let matrix = square.then(|| DMatrix::from_fn(count, count, |i, j| rows[i][j]));
    let even = matrix.filter(|m| (m - m.transpose()).amax() <= 1e-9 * m.amax());
    match even.and_then(DMatrix::cholesky) {
        Some(cholesky) => cholesky.l().row_iter().map(|row| row.iter().copied().collect()).collect(),
        None => {
            let message = format!("no covariance of the {count} parameters of `{}`", effect.id.value);
            c.refuse(
                &written.span,
                message,
                "write a symmetric, positive definite matrix, rows in the order of the names",
            );
            Vec::new()
        }
    }
}

/// Whether an effect is in the table and names no axis; refused if not.
pub(crate) fn is_known(c: &mut Checker, written: &EffectTable) -> bool {
    if let Some(joint) = &written.joint {
        c.refuse(&joint.span, "there is no axis to choose here", "remove joint");
    }
    is_listed(c, written)
}

/// The axis, from 0, that a known effect of a robot acts on; refused if there is none.
pub(crate) fn is_known_at(c: &mut Checker, written: &EffectTable, axes: usize) -> Option<usize> {
    let Some(joint) = &written.joint else {
        let message = format!("`{}` acts on one axis of the robot, and none is named", written.id.value);
        c.refuse(&written.id.span, message, format!("add joint, from 1 to {axes}"));
        return None;
    };
    let axis = c.count(joint, 1, axes as u64) as usize - 1;
    is_listed(c, written).then_some(axis)
}

fn is_listed(c: &mut Checker, written: &EffectTable) -> bool {
    let all = EFFECTS.iter().chain(BENCH_EFFECTS).chain([&DICTIONARY]);
    let (id, known): (_, Vec<&str>) = (&written.id, all.map(|effect| effect.id).collect());
    let is_known = known.contains(&id.value.as_str());
    if !is_known {
        c.refuse(&id.span, format!("there is no effect `{}`", id.value), suggestion(&id.value, &known));
    }
    is_known
}

/// A block's values with those that an effect names.
pub(crate) fn with_parameters<B: Bundle<f64>>(
    c: &mut Checker,
    prismatic: bool,
    written: &EffectTable,
    values: &B,
) -> B {
    let (table, mut all) = (fields::<f64, B>(), to_vec(values));
    let names: Vec<&str> = table.iter().map(|field| field.name.as_str()).collect();
    for (name, value) in &written.parameters {
        let Some(place) = names.iter().position(|field| field == name) else {
            let message = format!("`{}` has no parameter `{name}`", written.id.value);
            c.refuse(&value.span, message, suggestion(name, &names));
            continue;
        };
        let unit = if prismatic { sliding(table[place].unit) } else { table[place].unit };
        all[place] = c.number(value, unit, Range::size(LARGEST));
    }
    from_slice(&all)
}

/// Largest size of an effect's parameter, whatever its unit.
const LARGEST: f64 = 1e12;

/// A unit of a turning joint on a sliding one.
pub fn sliding(unit: &'static str) -> &'static str {
    match unit {
        "rad" => "m",
        "rad/s" => "m/s",
        "1/rad" => "1/m",
        "N m" => "N",
        "N m/rad" => "N/m",
        "N m s/rad" => "N s/m",
        "rad/(N m)" => "m/N",
        "kg m^2" => "kg",
        "N m s^2/rad^2" => "N s^2/m^2",
        "N m s^3/rad^3" => "N s^3/m^3",
        "N m s/rad^2" => "N s/m^2",
        "N m/rad^2" => "N/m^2",
        "N m/rad^3" => "N/m^3",
        "1/(N m)" => "1/N",
        other => other,
    }
}
